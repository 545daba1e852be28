"""Which drifts each test sees: every part is drifted by itself and all tests are made again.

The scan sees the electronics of the forward channel and nothing of the pendulum, which lies on its stop. The constant
current sees k_VI k_DA against itself and nothing of the torquer, whose gain cancels. The output at 1 g sees the
feedback channel, the torquer and the pendulosity, and nothing of the forward channel. So a drift of the magnet is not
seen by the tests, and not compensated.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ins_eval.calibration import loop_gains
from ins_eval.digital_loop import sampled
from ins_eval.digital_loop.model import Loop
from ins_eval.digital_loop.parts import PARTS
from ins_eval.streams import Streams
from ins_eval.units import PPM

DRIFT_PPM = 200.0
SEEN = 0.01  # of the drift: less is the noise of the test or a second-order effect
MEASURED_S = 4.0  # each setting; the noise of the loop is then 0.03 ug, and the same in all tests
SETTLING_S = 0.2


class DriftRow(NamedTuple):
    """A part drifted by +200 ppm: what each test reads then. seen_by: those of "scan", "current", "output" that do."""

    part: str
    forward_scan_ppm: float
    current_test_ppm: float
    output_ug: float
    seen_by: tuple[str, ...]


def table(loop: Loop, drift_ppm: float = DRIFT_PPM) -> list[DriftRow]:
    """One row for each of `PARTS`: the estimates of `loop` before and with that part drifted, and the output at 1 g.

    Every test is made with the same noise, so that what is shown is the drift. An error that a test makes up, such as
    that of the constant current itself, shows as what the test would report.
    """
    gain, step, output = _tests(loop)
    rows = []
    for part in PARTS:
        new_gain, new_step, new_output = _tests(loop.with_drift(part, drift_ppm))
        scan = float(loop_gains.forward_drift_ppm(gain, new_gain))
        current = float(loop_gains.feedback_drift_ppm(step, new_step))
        error_ug = (new_output - output) / loop.counts_per_g / PPM
        found = {"scan": scan, "current": current, "output": error_ug}
        seen_by = tuple(name for name, size in found.items() if _seen(size, drift_ppm))
        rows.append(DriftRow(part, scan, current, error_ug, seen_by))
    return rows


def _seen(size: float, drift_ppm: float) -> bool:
    return abs(size) > SEEN * abs(drift_ppm)


def _tests(loop: Loop) -> tuple[float, float, float]:
    """Slope of the scan, N_on - N_off and N_out, from the same random numbers whatever the loop is."""
    streams = Streams(0).at("observability")
    slope = loop_gains.scan_gain(*sampled.scan(loop, streams.at("scan").rng())).value
    settling, measured = (round(seconds / loop.period_s) for seconds in (SETTLING_S, MEASURED_S))
    on = np.repeat([0.0, 1.0], settling + measured)
    halves = np.split(sampled.closed_loop(loop, np.ones(on.size), on, streams.at("loop").rng()), 2)
    off_mean, on_mean = (float(half[settling:].mean()) for half in halves)
    return slope, on_mean - off_mean, off_mean
