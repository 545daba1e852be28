"""Where samples are missing between stamps, and where one was only stamped late."""

from __future__ import annotations

import numpy as np

LONGEST_STEP = 1.5  # of the median step; beyond it a sample is missing, or stamped late
BESIDE = 15  # samples before and after a step by which its pace is judged; white jitter of 0.2 passes
MADE_UP = 0.5  # of what a step is too long: stamps that go on at least so much later lack a sample


def gaps(time_s: np.ndarray, longest: float = LONGEST_STEP, least: float = 0.0) -> np.ndarray:
    """Numbers k of the steps, from sample k to k + 1 of stamps `time_s` (n,), in which samples are missing.

    Those beyond `longest` median steps after which the stamps go on later by it: by the medians of a few samples before
    and after, counted in steps. Where they do not, a stamp was late or early. A gap lacks at least `least` samples.
    """
    steps = np.diff(time_s)
    step_s = float(np.median(steps))
    long = np.flatnonzero(steps > longest * step_s)
    late = time_s / step_s - np.arange(time_s.size)
    later = np.array(
        [np.median(late[k + 1 : k + 1 + BESIDE]) - np.median(late[max(0, k + 1 - BESIDE) : k + 1]) for k in long]
    )
    return long[later >= MADE_UP * np.maximum(steps[long] / step_s - 1.0, least)] if long.size else long
