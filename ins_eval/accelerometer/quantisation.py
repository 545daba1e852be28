"""Quantisation: a pulse leaves when a whole one has gathered; what is left is carried into the next sample.

Source: Paper A, section 3.1 (the output is in pulses); one pulse is about 3e-5 m/s.
"""

from __future__ import annotations

from typing import ClassVar

import numba
import numpy as np

from ins_eval.accelerometer.effect import AccelerometerEffect


@numba.njit(cache=True)
def whole_pulses(pulses):
    """Whole counts (n,) of the `pulses` (n,) due in each sample, of either sign; less than one is ever owed."""
    counts = np.empty(pulses.size)
    remainder = 0.0
    for k in range(pulses.size):
        gathered = remainder + pulses[k]
        counts[k] = np.trunc(gathered) + 0.0  # no -0 in tables
        remainder = gathered - counts[k]
    return counts


class Quantisation(AccelerometerEffect):
    """Output in whole pulses, the remainder carried."""

    name: ClassVar[str] = "quantisation"

    def counted(self, pulses: np.ndarray) -> np.ndarray:
        return whole_pulses(pulses)
