"""Channels of the IMU that hold one value for longer than chance makes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ins_eval.recording import Recording
from ins_eval.recording.consistency.limits import changes

STUCK_S = 1.0  # shorter, a channel may rest; by reasoning, as are the next
COARSE_STUCK_S = 30.0  # of a channel whose neighbours are mostly equal: smooth motion alone holds a count for seconds
CHANCE_RUN_FACTOR = 5.0  # of the longest run of equal values that chance makes, beyond which it is not chance
TURNING = 0.3  # of the samples of what measures are turning points: 2 / 3 of white noise, few of a motion without noise


class Run(NamedTuple):
    """A run of one value, from when to when; `measures`: there is noise in the rest of the channel."""

    begin_s: float
    end_s: float
    measures: bool


def held(values: np.ndarray, recording: Recording) -> Run | None:
    """The longest run of one value in a channel (n,) of a recording, where it is longer than chance makes.

    If neighbours outside of it are equal with probability p, the longest run among n samples is about
    ln(n (1 - p)) / ln(1 / p). What never changes is held from the start to the last sample.
    """
    time_s, n = recording.imu.time_s, len(values)
    rows = changes(values, recording.interval_s)
    if not rows.size:
        return Run(recording.start.time_s, float(time_s[-1]), measures=False)
    edges = np.concatenate([[-1], rows, [n - 1]])
    runs = np.diff(edges)
    k = int(np.argmax(runs))
    equal = 1.0 - rows.size / (n - runs[k])
    chance = np.log(max(rows.size, 2)) / -np.log(equal) if equal > 0.0 else 1.0
    shortest_s = COARSE_STUCK_S if equal > 0.5 else STUCK_S
    begin_s = float(time_s[edges[k]]) if edges[k] >= 0 else recording.start.time_s
    end_s = float(time_s[edges[k + 1]])
    if end_s - begin_s <= shortest_s or runs[k] <= CHANCE_RUN_FACTOR * max(chance, 1.0):
        return None
    rest = np.diff(np.delete(values, slice(edges[k] + 1, edges[k + 1] + 1)))
    turning = np.mean(rest[1:] * rest[:-1] < 0.0) if rest.size > 1 else 0.0
    return Run(begin_s, end_s, measures=bool(turning > TURNING))


def stuck(recording: Recording) -> dict[str, float]:
    """Sensors, such as ``gyro.z``, that measure but for a run of one value, and the share of the recording it takes."""
    imu, whole_s = recording.imu, float(recording.imu.time_s[-1] - recording.start.time_s)
    channels = {
        f"{of}.{axis}": getattr(imu, of)[:, k] for of in ("gyro", "accelerometer") for k, axis in enumerate("xyz")
    }
    runs = {name: run for name, values in channels.items() if (run := held(values, recording)) and run.measures}
    return {name: (run.end_s - run.begin_s) / whole_s for name, run in runs.items()}
