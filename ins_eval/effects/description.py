"""Wrong descriptions of a recording: no physics of an instrument, but the simulation being told the wrong thing.

`recording.mending` takes them off a recording before anything else is done with it.
"""

from __future__ import annotations

from functools import partial

from ins_eval.effects.accelerometer import AT
from ins_eval.effects.effect import Effect

FAMILY = "recording"
SIGNS = "Savage, Strapdown Analytics, 2nd ed., section 18.4: signs, order and units are checked before any filter"
CLOCKS = "Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd ed., section 14.3"

_of = partial(Effect, enters=FAMILY)

EFFECTS = (
    _of(
        name="recording.axis_sign",
        physics="a column has the wrong sign",
        unit="factor", si=1.0, nominal=1.0, words=("sensor",),
        excited_by="turns about the axis, or specific force along it", reference=SIGNS,
    ),
    _of(
        name="recording.axes_exchanged",
        physics="two columns of a sensor stand for each other",
        unit="factor", si=1.0, nominal=1.0, words=("sensor", "other_axis"),
        excited_by="turns about both axes, or specific force along them", reference=SIGNS,
    ),
    _of(
        name="recording.unit",
        physics="the columns of a sensor are in another unit",
        unit="factor", si=1.0, nominal=1.0, axes=(None,), words=("sensor", "unit_found"),
        excited_by="turns; gravity", reference=SIGNS,
    ),
    _of(
        name="recording.clock_step",
        physics="a clock jumps: from then on the stamps of the IMU are late against those of the fixes",
        unit="s", si=1.0, nominal=0.1, axes=(None,), parameters=(AT,), local=True,
        excited_by="acceleration, or speed, on both sides of the jump", reference=CLOCKS,
    ),
    _of(
        name="recording.clock_drift",
        physics="the clock of the IMU is fast against that of the fixes",
        unit="ppm", si=1e-6, nominal=20.0, axes=(None,), local=True,
        excited_by="acceleration, or speed, late in a long recording", reference=CLOCKS,
    ),
    _of(
        name="recording.gps_velocity",
        physics="the velocity of the fixes is in another unit, or positive upwards",
        unit="factor", si=1.0, nominal=1.0, axes=(None, "down"),
        excited_by="speed; climb and descent", reference=SIGNS,
    ),
    _of(
        name="recording.reference_frame",
        physics="what measures gives east, north, up for north, east, down, or its heading from magnetic north",
        unit="deg", si=1.0, nominal=5.0, axes=(None,), words=("frame_found",),
        excited_by="speed; any attitude", reference=SIGNS,
    ),
)  # fmt: skip
