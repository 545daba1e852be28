"""Channels of the IMU that hold one value for longer than chance makes."""

from __future__ import annotations

import numpy as np

from ins_eval.recording import Recording
from ins_eval.recording.consistency.limits import changes

STUCK_S = 1.0
COARSE_STUCK_S = 30.0  # of a channel whose neighbours are mostly equal: smooth motion alone holds a count for seconds
CHANCE_RUN_FACTOR = 5.0  # of the longest run of equal values that chance makes, beyond which it is not chance
MUCH = 0.05  # of a recording: then what is wrong with the sensor is that it does not measure; by reasoning


def held(values: np.ndarray, recording: Recording) -> tuple[float, float] | None:
    """From when to when a channel (n,) of a recording holds one value for longer than chance makes, in s, or None.

    If neighbours are equal with probability p, the longest run among n samples is about ln(n (1 - p)) / ln(1 / p).
    What never changes is held from the first sample to the last.
    """
    time_s, n = recording.imu.time_s, len(values)
    rows = changes(values, recording.interval_s)
    if not rows.size:
        return float(time_s[0]), float(time_s[-1])
    edges = np.concatenate([[-1], rows, [n - 1]])
    runs = np.diff(edges)
    equal = 1.0 - rows.size / (n - 1)
    chance = np.log(max(rows.size, 2)) / -np.log(equal) if equal > 0.0 else 1.0
    k, step_s = int(np.argmax(runs)), float(np.median(np.diff(time_s)))
    shortest_s = COARSE_STUCK_S if equal > 0.5 else STUCK_S
    if runs[k] * step_s <= shortest_s or runs[k] <= CHANCE_RUN_FACTOR * max(chance, 1.0):
        return None
    end_s = float(time_s[edges[k + 1]])
    return end_s - float(runs[k]) * step_s, end_s


def stuck(recording: Recording) -> frozenset[str]:
    """The sensors, such as ``gyro.z``, that are stuck for `MUCH` of a recording and measure in the rest of it."""
    imu, whole_s = recording.imu, float(recording.imu.time_s[-1] - recording.imu.time_s[0])
    named = {
        f"{sensor}.{axis}": getattr(imu, sensor)[:, k]
        for sensor in ("gyro", "accelerometer")
        for k, axis in enumerate("xyz")
    }
    runs = {name: run for name, values in named.items() if (run := held(values, recording)) is not None}
    return frozenset(name for name, (begin, end) in runs.items() if MUCH * whole_s < end - begin < whole_s)
