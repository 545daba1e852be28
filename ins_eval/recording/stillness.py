"""Quiet stretches of a parked recording, found by rule: where to align.

People climb in and out and engines run while a vehicle is parked. The rule knows nothing of the instrument's
noise, resolution or rate: it compares the recording with its own quietest part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ins_eval.errors import DataRefused
from ins_eval.recording import Imu

WINDOW_S = 1.0
WINDOW_SAMPLES = 10  # at least, so that a standard deviation means something
QUIETEST_SHARE = 0.25
DISTURBED_FACTOR = 2.0
MOVED_FACTOR = 10.0  # of what is carried or turned by hand
TOLERATED_S = 3.0
APART_S = 10.0
ROUND_OFF = 1e-9  # of the largest value: what arithmetic leaves of a constant

ENOUGH_FOR_ALIGNMENT_S = 300.0
MOST_FOR_ALIGNMENT_S = 600.0


@dataclass(frozen=True)
class Stretch:
    """A part of a recording between two times of the IMU's clock: the samples with start_s < time_s <= end_s."""

    start_s: float
    end_s: float

    @property
    def duration_s(self) -> float:
        return self.end_s - self.start_s


def still_stretches(imu: Imu, minimum_s: float = 120.0, factor: float = DISTURBED_FACTOR) -> list[Stretch]:
    """Find the stretches of at least `minimum_s` in which nobody disturbs the vehicle, in order of time.

    1. The recording is cut into windows of 1 s. The agitation of a window is the standard deviation of the three
       gyro channels together, and of the three accelerometer channels together.
    2. The baseline of each is the median over its quietest quarter of windows. A window is disturbed where either
       agitation exceeds `factor` times its baseline and the resolution of the channel.
    3. Disturbed windows less than 10 s apart are one burst. A burst of more than 3 s ends a stretch; a shorter one,
       a door or a step, is tolerated inside a stretch but never at its ends.

    A recording that is disturbed throughout in the same way is its own baseline: it counts as quiet.
    """
    time_s = np.asarray(imu.time_s)
    step_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else WINDOW_S
    samples = max(WINDOW_SAMPLES, round(WINDOW_S / step_s))
    windows = len(time_s) // samples
    if windows == 0:
        return []
    window_s = samples * step_s
    disturbed = _disturbed(imu.gyro, samples, factor) | _disturbed(imu.accelerometer, samples, factor)
    first_s = time_s[0] - step_s
    edges_s = np.concatenate([[first_s], time_s[samples - 1 : windows * samples : samples]])
    stretches = [
        Stretch(float(edges_s[a]), float(edges_s[b]))
        for a, b in _between_bursts(disturbed, max(1, round(TOLERATED_S / window_s)), round(APART_S / window_s))
    ]
    return [stretch for stretch in stretches if stretch.duration_s >= minimum_s]


def choose_alignment(stretches: Sequence[Stretch]) -> Stretch:
    """The stretch to align on: the first that is long enough, so that most of the recording is left to navigate.

    That is the first stretch of at least 300 s, or else the longest; of a longer one than 600 s the first 600 s.
    Navigation then starts at its end and goes on through whatever follows, quiet or not.
    Raises `DataRefused` where there is no stretch.
    """
    if not stretches:
        raise DataRefused(
            "no quiet stretch to align on was found, expected some minutes in which nobody moves the vehicle; "
            "record longer at rest"
        )
    long_enough = [stretch for stretch in stretches if stretch.duration_s >= ENOUGH_FOR_ALIGNMENT_S]
    chosen = long_enough[0] if long_enough else max(stretches, key=lambda stretch: stretch.duration_s)
    return Stretch(chosen.start_s, min(chosen.end_s, chosen.start_s + MOST_FOR_ALIGNMENT_S))


def _disturbed(increments: np.ndarray, samples: int, factor: float) -> np.ndarray:
    """Windows of `samples` rows whose agitation exceeds `factor` times that of the quietest part, shape (windows,)."""
    windows = len(increments) // samples
    parts = np.asarray(increments[: windows * samples], dtype=float).reshape(windows, samples, 3)
    agitation = np.sqrt(sum(parts[:, :, axis].var(axis=1) for axis in range(3)))
    quietest = np.sort(agitation)[: max(1, int(QUIETEST_SHARE * windows))]
    return agitation > max(factor * float(np.median(quietest)), _resolution(increments))


def _resolution(increments: np.ndarray) -> float:
    """The smallest step between neighbouring samples: one count of a coarse channel, next to nothing of a fine one."""
    round_off = ROUND_OFF * max(float(increments.max(initial=0.0)), -float(increments.min(initial=0.0)))
    steps = (np.abs(np.diff(column)) for column in np.asarray(increments).T)
    smallest = min(float(np.min(one, initial=np.inf, where=one > round_off)) for one in steps)
    return smallest if np.isfinite(smallest) else round_off


def _between_bursts(disturbed: np.ndarray, tolerated: int, apart: int) -> list[tuple[int, int]]:
    """Stretches of windows [a, b) that no burst of more than `tolerated` windows interrupts."""
    bursts: list[list[int]] = []  # [first, one past last]
    for k in np.flatnonzero(disturbed):
        if bursts and k - bursts[-1][1] < apart:
            bursts[-1][1] = int(k) + 1
        else:
            bursts.append([int(k), int(k) + 1])
    n = len(disturbed)
    splits = [b for b in bursts if b[1] - b[0] > tolerated or b[0] == 0 or b[1] == n]
    starts = [0, *(end for _, end in splits)]
    ends = [*(first for first, _ in splits), n]
    return [(a, b) for a, b in zip(starts, ends, strict=True) if b > a]
