"""What samples that were filled in may miss: how it moved between the samples around them nobody recorded.

A straight line stands in for a run of L samples, T seconds. By how much its mean is off is taken from the recording
itself, wherever as many samples were recorded,

    e = mean of L samples - (sample before + sample after) / 2,

and its root mean square s, in rad/s or m/s^2, adds the variance (s T)^2 of angle or velocity over the run, as a random
walk through it. So what a run hides is neither taken for a measurement nor for an error of a sensor.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ins_eval.error_model.null import Believed

_LONGER = 1.25  # runs up to so many times as long are taken alike, as the longest of them


def filled_in(navigated: Believed, nodes_s: np.ndarray) -> np.ndarray:
    """Variance (epochs, 2) per axis of velocity, (m/s)^2, and angle, rad^2, of what filled samples miss in an epoch."""
    out = np.zeros((nodes_s.size - 1, 2))
    imu = navigated.recording.imu
    if imu.filled is None or not navigated.time_s.size:
        return out
    filled = imu.filled[np.searchsorted(imu.time_s, navigated.time_s[0] - 1e-6) :][: navigated.time_s.size]
    first, last = np.flatnonzero(np.diff(np.concatenate([[False], filled, [False]]).astype(int))).reshape(-1, 2).T
    if not first.size:
        return out
    length = last - first
    alike = np.unique(np.floor(np.log(length) / np.log(_LONGER)), return_inverse=True)[1]
    samples = np.flatnonzero(filled)
    epoch = np.clip(np.searchsorted(nodes_s, navigated.time_s[samples] - 1e-6) - 1, 0, nodes_s.size - 2)
    for k, increments in enumerate((navigated.velocity, navigated.gyro)):
        square = [_missed(increments, filled, int(length[alike == one].max())) for one in range(alike.max() + 1)]
        variance = np.array(square)[alike] * length  # of each sample: s^2 T dt
        out[:, k] = np.bincount(epoch, np.repeat(variance, length), nodes_s.size - 1)
    return out


def _missed(increments: np.ndarray, filled: np.ndarray, length: int) -> float:
    """Mean square e of a mean over `length` recorded samples, per sample and axis; the variance where none are."""
    length = min(length, filled.size - 2)
    recorded = np.append(0, np.cumsum(~filled))
    whole = recorded[length + 2 :] - recorded[: -length - 2] == length + 2  # with the samples before and after
    if length < 1 or not whole.any():
        return float(increments[~filled].var(axis=0).mean()) if (~filled).any() else 0.0
    total = 0.0
    for column in increments.T:
        sums = np.append(0.0, np.cumsum(column))
        mean = (sums[length + 1 : -1] - sums[1 : -length - 1]) / length
        line = 0.5 * (column[: -length - 1] + column[length + 1 :])
        total += float(np.square((mean - line)[whole]).mean()) / 3.0
    return total
