"""Strapdown INS navigation evaluation: quartz flexible accelerometers, their compensation, what it is worth in flight.

Conventions, the same in every module
-------------------------------------
Frames: ``n`` north-east-down at the vehicle (WGS-84), ``b`` body axes forward-right-down, ``i`` inertial, ``e`` Earth.
``velocity_n`` is a vector in n, ``mat_nb`` takes b to n. Attitude is roll, pitch, heading, applied in the order
heading, pitch, roll; heading is clockwise from true north. Quaternions are scalar first and take b to n.

Units: SI, angles in rad. Where a quantity is not SI its name says so: ``temperature_c``, ``bias_ug``,
``rate_c_per_min``, ``latitude_deg``. 1 g of an accelerometer's data is 9.80665 m/s^2, 1 nmi is 1852 m (`units`).

Samples: row k of a recording covers the time from row k-1 to its own ``time_s``. Gyros deliver angle increments,
accelerometers pulses or velocity increments. ``dtheta_b`` and ``dv_b`` are compensated increments of angle (rad) and
velocity (m/s) over a sample, body axes.

Errors: indicated = true + bias; indicated = (1 + 1e-6 ppm) true. A navigation error is INS minus reference, in the
reference's north-east-down, in m and m/s.

Rate of temperature: dT/dt always means the causal, first-order filtered derivative of the reading, in degC/min
(`thermal.filtered_rate`), in chamber, oven and flight alike.

Random numbers: each source of error has its own named stream below one seed (`streams`), so adding a source moves no
other draw, and compensations are compared on the same instruments.

One way through
---------------
profile -> trajectory -> thermal -> imu -> recording -> compensation -> alignment, strapdown -> reference -> metrics
-> report. A recording may come from a file instead; nothing after it can tell. An estimator (`calibration`,
`compensation`) never sees how the truth was made.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

_PUBLIC = {
    "Recording": "recording",
    "Imu": "recording",
    "Fixes": "recording",
    "Start": "recording",
    "ChamberReadings": "recording",
    "Samples": "compensation",
    "CompensationModel": "compensation",
    "check_model": "compensation.check",
    "load_model": "compensation.registry",
    "four_point": "calibration.four_point",
    "align": "alignment",
    "navigate": "strapdown",
    "read": "interface.read",
    "import_file": "interface.import_file",
    "simulate": "analysis.simulate",
    "evaluate": "interface.evaluate",
    "compare": "interface.compare",
    "calibrate": "interface.calibrate",
    "diagnose": "interface.diagnose",
    "predict": "interface.predict",
    "fly": "interface.fly",
    "results": "interface.results",
    "Result": "interface.result",
}
_MODULES = ("ensemble", "figures", "metrics", "readers", "units")

__all__ = [*_PUBLIC, *_MODULES, "__version__"]

if TYPE_CHECKING:
    from ins_eval import ensemble, figures, metrics, readers, units
    from ins_eval.alignment import align
    from ins_eval.analysis.simulate import simulate
    from ins_eval.calibration.four_point import four_point
    from ins_eval.compensation import CompensationModel, Samples
    from ins_eval.compensation.check import check_model
    from ins_eval.compensation.registry import load_model
    from ins_eval.interface.calibrate import calibrate
    from ins_eval.interface.compare import compare
    from ins_eval.interface.diagnose import diagnose
    from ins_eval.interface.evaluate import evaluate
    from ins_eval.interface.fly import fly
    from ins_eval.interface.import_file import import_file
    from ins_eval.interface.predict import predict
    from ins_eval.interface.read import read
    from ins_eval.interface.result import Result
    from ins_eval.interface.results import results
    from ins_eval.recording import ChamberReadings, Fixes, Imu, Recording, Start
    from ins_eval.strapdown import navigate

    __version__: str


def __getattr__(name: str) -> Any:
    """Public names are imported when first asked for, so that the command line starts quickly."""
    if name == "__version__":
        from importlib.metadata import version

        return version("ins-eval")
    if name in _MODULES:
        return importlib.import_module(f"ins_eval.{name}")
    if name not in _PUBLIC:
        raise AttributeError(f"module 'ins_eval' has no attribute '{name}'")
    return getattr(importlib.import_module(f"ins_eval.{_PUBLIC[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
