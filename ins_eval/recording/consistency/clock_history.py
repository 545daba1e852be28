"""The clock of fixes against the IMU's over time: late by a constant, by a jump more from some instant on, or drifting.

Every block of 10 s leaves squares S_b(o) of changes of velocity at each offset o tried (`clocks`). The noise of a block
has a size of its own, so that of n differences in it

    log L_b(o) = -n/2 log S_b(o),

and a history o(t) has the sum over blocks. A block in which nothing moves has a flat curve, and no say. The evidence of
a kind of history is the mean of L over all that are tried: two offsets and an instant fit more than one offset does.

An error model that is linear in a delay knows x(t) - d x'(t), which is motion that changes slowly over d. What is later
than that has to be known before anything is linear about it: a history is where a search may begin, and no answer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from ins_eval.recording import Fixes, Imu
from ins_eval.recording.consistency.clocks import COARSE_S, PRIOR, WIDEST_S, VelocityScan
from ins_eval.units import PPM

LINEAR_S = 0.1  # later, motion that changes within a second has turned by a third: no linear response; by reasoning
LARGEST_DRIFT = 2e-3  # of one; crystals are off by 100 ppm, coarse counters by a thousand: by reasoning


@dataclass(frozen=True)
class ClockHistory:
    """Stamp minus the IMU's stamp of the same instant at the start, s, a jump of it at `at_s`, and its drift in s/s.

    `log_evidence` of its kind is over that of clocks that agree.
    """

    offset_s: float
    log_evidence: float
    jump_s: float = 0.0
    at_s: float | None = None
    drift: float = 0.0

    def ends_s(self, seconds: float) -> tuple[float, float]:
        """The offset at the start and so many seconds later."""
        return self.offset_s, self.offset_s + self.jump_s + self.drift * seconds

    @property
    def clock_step(self) -> float:
        """As `recording.clock_step`, s: stamps of the IMU that are late."""
        return -self.jump_s

    @property
    def clock_drift_ppm(self) -> float:
        """As `recording.clock_drift`: the clock of the IMU is fast."""
        return -self.drift / PPM


def clock_histories(imu: Imu, start_s: float, fixes: Fixes) -> list[ClockHistory]:
    """The likeliest constant, jumping and drifting offset of the clock of `fixes`; `imu` in increments.

    Each only where it leads clocks that agree by odds of a hundred to one, and the latter two the constant as well;
    none whose offset is nowhere beyond what a linear response describes, or at an end of what was tried.
    """
    scan = VelocityScan.of(imu, start_s, fixes)
    if scan is None:
        return []
    tried_s = np.arange(-WIDEST_S, WIDEST_S + 0.5 * COARSE_S, COARSE_S)
    squares = scan.squares(tried_s).sum(axis=2)  # (offsets, blocks)
    if not (squares > 0.0).all():
        return []
    log = -0.5 * scan.freedom * np.log(squares)
    log -= log[np.argmin(np.abs(tried_s))]
    log -= _mean(log[np.abs(tried_s) < LINEAR_S].sum(axis=1)) / scan.freedom.size  # of clocks that agree
    constant = _constant(tried_s, log)
    others = (_jumping(tried_s, log, scan.block_s), _drifting(tried_s, log, scan.block_s - start_s))
    least = max(constant.log_evidence, 0.0) + PRIOR
    seconds = float(imu.time_s[-1]) - start_s
    found = [constant] if constant.log_evidence > PRIOR else []
    found += [one for one in others if one.log_evidence > least]
    return [one for one in found if LINEAR_S < np.max(np.abs(one.ends_s(seconds))) < WIDEST_S - COARSE_S]


def _constant(tried_s: np.ndarray, log: np.ndarray) -> ClockHistory:
    total = log.sum(axis=1)
    return ClockHistory(float(tried_s[np.argmax(total)]), _mean(total))


def _jumping(tried_s: np.ndarray, log: np.ndarray, block_s: np.ndarray) -> ClockHistory:
    """The best pair of offsets, and the instant from which the second holds, between two blocks."""
    before = np.cumsum(log, axis=1)[:, :-1]
    after = log.sum(axis=1, keepdims=True) - before
    k = int(np.argmax(before.max(axis=0) + after.max(axis=0)))
    first_s, second_s = (float(tried_s[np.argmax(part[:, k])]) for part in (before, after))
    each = logsumexp(before, axis=0) + logsumexp(after, axis=0) - 2.0 * np.log(tried_s.size)
    return ClockHistory(first_s, _mean(each), second_s - first_s, 0.5 * float(block_s[k] + block_s[k + 1]))


def _drifting(tried_s: np.ndarray, log: np.ndarray, since_s: np.ndarray) -> ClockHistory:
    """The best straight line; beyond the offsets tried it has the likelihood of the farthest."""
    longest_s = float(since_s[-1])
    steps = int(min(LARGEST_DRIFT * longest_s, 2.0 * WIDEST_S) / COARSE_S)
    whole_s, blocks = COARSE_S * np.arange(-steps, steps + 1), np.arange(since_s.size)
    total = np.empty((whole_s.size, tried_s.size))
    for i, whole in enumerate(whole_s):
        at = np.arange(tried_s.size)[:, None] + np.rint(whole * since_s / longest_s / COARSE_S).astype(int)
        total[i] = log[np.clip(at, 0, tried_s.size - 1), blocks].sum(axis=1)
    i, k = np.unravel_index(np.argmax(total), total.shape)
    return ClockHistory(float(tried_s[k]), _mean(total), drift=float(whole_s[i] / longest_s))


def _mean(log: np.ndarray) -> float:
    """Logarithm of the mean."""
    return float(logsumexp(log) - np.log(log.size))
