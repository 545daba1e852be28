"""Elements that follow the reading late: the error that the believed compensation then makes.

The compensation takes K1(T, r) and K0(T) at the reading T and its rate r; the output was made at Te, L dTe/dt = T - Te,
and at the rate re of Te. A compensation is a straight line in the output, f = A E - B with A = g0 / K1, B = g0 K0, so

    indicated - true = (A / Ae - 1) f + (A / Ae Be - B)

with A, B at (T, r) and Ae, Be at (Te, re): a scale factor error and a bias, both known for each L.
"""

from __future__ import annotations

import numpy as np

from ins_eval.compensation import CompensationModel, Samples
from ins_eval.effects.effect import Effect, Parameter
from ins_eval.effects.temperature import SmoothedTemperature
from ins_eval.thermal import filtered_rate, lagged

NAME = "temperature.lag"
OUTPUT_PULSE_PER_S = 1e5  # the second of two points of a straight line
SPREAD = 0.3  # sigma of the lag around the one for which a column was made, as a part of it

EFFECTS = (
    Effect(
        name=NAME,
        physics="the temperature of magnet and pendulum follows that of the thermometer with a first-order lag and "
        "takes scale factor and bias along; a rate term named beside it is what is left then",
        enters="temperature", unit="s", si=1.0, nominal=30.0, axes=(None,),
        parameters=(Parameter("lag_s", "s", 1.0, 600.0, 13),),
        excited_by="a temperature that changes, and a compensation that depends on it",
        reference="Paper A (Sensors 2021, 21, 294), AUDIT A13: 0.4 to 2.7 min behind a surface sensor",
    ),
)  # fmt: skip


def lag_factors(
    model: CompensationModel, seen: SmoothedTemperature, axis: int, lag_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """Scale factor error (n,) and bias (n,) in m/s^2 that a lag makes of one accelerometer, on the grid of `seen`."""
    late = seen.in_runs(lambda time_s, smooth_c: lagged(time_s, smooth_c, lag_s), axis)
    late_rate = np.empty_like(late)
    for rows in seen.runs:
        late_rate[rows] = filtered_rate(seen.time_s[rows], np.ascontiguousarray(late[rows]), seen.filter_s)
    slope, offset = _line(model, seen, seen.smooth_c[:, axis], seen.rate_c_per_min[:, axis])
    late_slope, late_offset = _line(model, seen, late, late_rate)
    ratio = slope / late_slope
    return ratio - 1.0, ratio * late_offset - offset


def _line(
    model: CompensationModel, seen: SmoothedTemperature, temperature_c, rate_c_per_min
) -> tuple[np.ndarray, np.ndarray]:
    """A in m/s^2 per pulse/s and B in m/s^2 of f = A E - B, (n,) each."""
    at_zero, at_one = (
        model.specific_force(
            Samples(seen.time_s, np.full_like(seen.time_s, output), np.asarray(temperature_c), rate_c_per_min)
        )
        for output in (0.0, OUTPUT_PULSE_PER_S)
    )
    return (at_one - at_zero) / OUTPUT_PULSE_PER_S, -at_zero
