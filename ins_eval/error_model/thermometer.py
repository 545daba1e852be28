"""What the steps of the thermometer do to a compensated output.

The step q of the thermometer makes an error of variance q^2 / 12 that stays for as long as a step lasts; through the
slope of the believed compensation it is noise of the accelerometer, of known size: density 2 sigma^2 times its
correlation time. The temperature itself is that of `ins_eval.effects.temperature`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ins_eval.compensation import Samples
from ins_eval.error_model.null import Believed, triad
from ins_eval.navigation import samples
from ins_eval.thermal import thermometer_step
from ins_eval.units import MINUTE

if TYPE_CHECKING:
    from ins_eval.effects.temperature import SmoothedTemperature

SHORTEST_STEP_S, LONGEST_STEP_S = 5.0, 300.0
WARMER_C = 0.05  # of a difference quotient of what is believed: laws are straight over so little; by reasoning


def step_noise(believed: Believed, seen: SmoothedTemperature | None, middle_s: np.ndarray) -> np.ndarray:
    """Density (epochs, 3) in (m/s^2)^2 s of what the thermometer's steps add to each accelerometer."""
    out = np.zeros((middle_s.size, 3))
    recording = believed.recording
    if seen is None or recording.imu.accelerometer_form != "pulse":
        return out
    filter_s = recording.belief.accelerometer.rate_filter_s
    rows = np.clip(np.searchsorted(recording.imu.time_s, middle_s), 0, recording.imu.time_s.size - 1)
    for axis, (model, given) in enumerate(zip(triad(believed), samples(recording), strict=True)):
        step_c = thermometer_step(given.temperature_c)
        few = Samples(*(getattr(given, name)[rows] for name in ("time_s", "output", "temperature_c", "rate_c_per_min")))
        base = model.specific_force(few)
        warmer = Samples(few.time_s, few.output, few.temperature_c + WARMER_C, few.rate_c_per_min)
        faster = Samples(few.time_s, few.output, few.temperature_c, few.rate_c_per_min + WARMER_C)
        slope = (model.specific_force(warmer) - base) / WARMER_C
        slope_rate = (model.specific_force(faster) - base) / WARMER_C
        sigma = step_c / np.sqrt(12.0) * (np.abs(slope) + MINUTE / filter_s * np.abs(slope_rate))
        speed = np.abs(np.gradient(seen.smooth_c[:, axis], seen.time_s))
        lasting = step_c / np.maximum(np.interp(middle_s, seen.time_s, speed), 1e-9)
        out[:, axis] = 2.0 * sigma**2 * np.clip(0.25 * lasting, SHORTEST_STEP_S, LONGEST_STEP_S)
    return out
