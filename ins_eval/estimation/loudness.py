"""Gyros of one unit that are not alike: which is noisier than the others, and when."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import median_filter

from ins_eval.error_model.geometry import CLOCK_S
from ins_eval.error_model.null import is_coarse
from ins_eval.estimation.noise import SECOND_DIFFERENCE, angle_random_walk
from ins_eval.random_processes import NORMAL_MAD
from ins_eval.recording import PARKED

if TYPE_CHECKING:
    from ins_eval.error_model.null import Believed

SHOWN = 0.03  # of the believed noise: less is none, by reasoning
LOUD_EPOCHS = 61  # that tell how noisy a gyro is for the time being, to a sixth; by reasoning


def loudness(navigated: Believed, nodes_s: np.ndarray) -> np.ndarray | None:
    """By how much (epochs, 3) each gyro is noisier than the middle one of the three; None where that is not told.

    The three of a MEMS unit are not alike, nor for long. Where a coarse unit is parked its readings show it: by the
    second differences of their means over epochs, of `LOUD_EPOCHS` of them each time. What is far quieter than
    believed, as a recording that is planned, shows no noise. What accelerometers have of vibration returns within an
    epoch: it is white noise of the velocity, which is read off for each channel.
    """
    belief, interval_s = navigated.recording.belief, np.diff(nodes_s)
    if navigated.recording.kind not in PARKED or not is_coarse(belief) or interval_s.size < LOUD_EPOCHS:
        return None
    ends = np.searchsorted(navigated.time_s, nodes_s + CLOCK_S)
    turned = np.concatenate([np.zeros((1, 3)), np.cumsum(navigated.gyro, axis=0)])[ends]
    second = np.abs(np.diff(np.diff(turned, axis=0) / interval_s[:, None], 2, axis=0))
    level = median_filter(second, (LOUD_EPOCHS, 1), mode="reflect") / (NORMAL_MAD * SECOND_DIFFERENCE)
    least = SHOWN * angle_random_walk(belief) / np.sqrt(np.median(interval_s))
    usual = max(float(np.median(np.median(level, axis=0))), least)
    return np.maximum(np.pad(level, ((1, 1), (0, 0)), mode="edge") / usual, 1.0)
