"""Where samples are missing between stamps, and where one was only stamped late."""

from __future__ import annotations

import numpy as np

LONGEST_STEP = 1.5  # of the median step; beyond it a sample is missing, or stamped late
MADE_UP = 0.5  # of what a step is too long, by which its neighbours are too short where a stamp is late


def gaps(time_s: np.ndarray, longest: float = LONGEST_STEP) -> np.ndarray:
    """Numbers k of the steps, from sample k to k + 1 of stamps `time_s` (n,), in which samples are missing.

    Those beyond `longest` median steps, but for one that its neighbours make up for: a stamp there is late or early.
    """
    steps = np.diff(time_s)
    steps = np.pad(steps / np.median(steps), 1, constant_values=1.0)
    long = np.flatnonzero(steps > longest)
    short = 2.0 - steps[long - 1] - steps[long + 1]
    return long[short < MADE_UP * (steps[long] - 1.0)] - 1
