"""Channels of the IMU that hold one value for longer than chance makes, are at a limit of their converter, or spike."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ins_eval.recording import Recording
from ins_eval.recording.consistency.limits import ROUND_OFF, changes

STUCK_S = 1.0  # shorter, a channel may rest; by reasoning, as are the next
COARSE_STUCK_S = 30.0  # of a channel whose neighbours are mostly equal: smooth motion alone holds a count for seconds
CHANCE_RUN_FACTOR = 5.0  # of the longest run of equal values that chance makes, beyond which it is not chance
TURNING = 0.3  # of the samples of what measures are turning points: 2 / 3 of white noise, few of a motion without noise
# a sample stands alone that is SPIKE times as far from its neighbours as all but one in a hundred are, where they agree
# to SHARE of that: a shock rings for more than one; by reasoning
USUAL, SPIKE, SHARE = 0.99, 10.0, 0.1
PILE_UP = 10  # times the next value, and that often at least, before the largest value counts as a limit; by reasoning


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
    return Run(begin_s, end_s, _noisy(np.delete(values, slice(edges[k] + 1, edges[k + 1] + 1))))


def _noisy(values: np.ndarray) -> bool:
    """Whether there is noise in what is left of a channel."""
    steps = np.diff(values)
    return bool(steps.size > 1 and np.mean(steps[1:] * steps[:-1] < 0.0) > TURNING)


def saturated(values: np.ndarray) -> dict[str, int]:
    """How many samples of a channel (n,) are its smallest and its largest value, where that is a converter's limit.

    It is taken far more often than its neighbour there.
    """
    counts = np.rint(values / (ROUND_OFF * max(float(np.abs(values).max()), 1e-300)))
    found = {}
    for which, sided in (("smallest", -counts), ("largest", counts)):
        at_end = sided == sided.max()
        inner = sided[~at_end]
        piled = int(np.count_nonzero(at_end))
        if piled < PILE_UP or not inner.size or piled < PILE_UP * np.count_nonzero(inner == inner.max()):
            continue
        if len(np.unique(counts)) > PILE_UP:
            found[which] = piled
    return found


def spikes(values: np.ndarray) -> np.ndarray:
    """Rows of a channel (n,) that stand alone: what motion, and its noise, make reaches over more than one sample.

    With d_k = x_k - (x_(k-1) + x_(k+1)) / 2 a fault a in one sample alone makes d = -a / 2, a, -a / 2.
    """
    apart = values[1:-1] - 0.5 * (values[:-2] + values[2:])
    size = np.abs(apart)
    if size.size * (1.0 - USUAL) < 1.0 or not size.any():
        return np.zeros(0, dtype=int)
    usual = np.quantile(size, USUAL, method="higher") or size[size > 0.0].min()  # of few counts most are 0
    rows = 1 + np.flatnonzero(size[1:-1] > SPIKE * usual)
    beside = np.maximum(np.abs(apart[rows - 1] + 0.5 * apart[rows]), np.abs(apart[rows + 1] + 0.5 * apart[rows]))
    return 1 + rows[beside < SHARE * size[rows]]


def unmeasured(recording: Recording) -> dict[str, float]:
    """Sensors, such as ``gyro.z``, that measure, and the share of the recording in which they do not.

    There they hold one value, or are at a limit.
    """
    imu, whole_s = recording.imu, float(recording.imu.time_s[-1] - recording.start.time_s)
    shares = {}
    for of in ("gyro", "accelerometer"):
        for axis, values in zip("xyz", getattr(imu, of).T, strict=True):
            run, piled = held(values, recording), sum(saturated(values).values())
            held_share = (run.end_s - run.begin_s) / whole_s if run is not None and run.measures else 0.0
            inside = (values > values.min()) & (values < values.max())
            piled_share = piled / values.size if piled and _noisy(values[inside]) else 0.0
            shares[f"{of}.{axis}"] = max(held_share, piled_share)
    return {name: share for name, share in shares.items() if share > 0.0}
