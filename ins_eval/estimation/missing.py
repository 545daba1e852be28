"""What samples that were filled in may miss: how it moved between the samples around them nobody recorded.

A straight line stands in for a run of L samples, T seconds. By how much its mean is off is taken from the recording
itself, wherever as many samples were recorded in the minute before and after, or ten times T,

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
_AROUND_S, _AROUND_RUNS = 60.0, 10  # by reasoning: as it moved around it, not as it was handled an hour before


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
    around = max(1, round(_AROUND_S / float(np.median(np.diff(navigated.time_s)))))
    for k, increments in enumerate((navigated.velocity, navigated.gyro)):
        square = np.empty(length.size)
        for one in range(alike.max() + 1):
            of = np.flatnonzero(alike == one)
            square[of] = _missed(increments, filled, int(length[of].max()), first[of], around)
        out[:, k] = np.bincount(epoch, np.repeat(square * length, length), nodes_s.size - 1)  # of each: s^2 T dt
    return out


def _missed(increments: np.ndarray, filled: np.ndarray, length: int, first: np.ndarray, around: int) -> np.ndarray:
    """Mean square e per sample and axis of means over `length` recorded samples around each run that begins at `first`.

    Of the whole recording where none are near, and the variance of what was recorded where none are at all.
    """
    length = min(length, filled.size - 2)
    recorded = np.append(0, np.cumsum(~filled))
    whole = recorded[length + 2 :] - recorded[: -length - 2] == length + 2  # with the samples before and after
    if length < 1 or not whole.any():
        return np.full(first.size, increments[~filled].var(axis=0).mean() if (~filled).any() else 0.0)
    square = np.zeros(whole.size)
    for column in increments.T:
        sums = np.append(0.0, np.cumsum(column))
        mean = (sums[length + 1 : -1] - sums[1 : -length - 1]) / length
        square += np.square(mean - 0.5 * (column[: -length - 1] + column[length + 1 :])) / 3.0
    count, total = (np.append(0.0, np.cumsum(one)) for one in (whole, np.where(whole, square, 0.0)))
    reach = max(around, _AROUND_RUNS * length)
    begin, end = (np.clip(first + by, 0, whole.size) for by in (-reach - length, reach))
    near = count[end] - count[begin]
    of_all = total[-1] / count[-1]
    return np.where(near > 0.0, np.maximum(total[end] - total[begin], 0.0) / np.maximum(near, 1.0), of_all)
