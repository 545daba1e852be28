"""Velocities in a receiver's table that it did not measure.

A logger that has no velocity down writes 0, and one that has none at all writes differences of its positions: with
these every error of a position is counted twice, and the velocity is late by half an interval. Of fixes 1 to n at p_k,
the mean velocity of an interval is d_k = (p_k - p_k-1) / dt, and a velocity that was measured leaves less of d_k as
mean of both ends than at one of them,

    rms((v_k + v_k-1) / 2 - d_k)  <  rms(v_k - d_k), rms(v_k-1 - d_k), rms(v_k - (d_k + d_k+1) / 2),

while one that was computed is the other way round, and scatters to and fro with the positions. A way that was summed
from velocities is computed too, but these are smooth.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ins_eval.recording import Fixes
from ins_eval.recording.consistency import WARNING
from ins_eval.recording.consistency.alternatives import FEWEST
from ins_eval.recording.consistency.track import moved

MOVING_MPS = 1.0  # slower, a velocity says little either way; like the others here by reasoning
RISEN_M = 5.0  # of heights, which no velocity down of 0 makes
COMPUTED = 0.1  # of what the mean of both ends leaves: rounding of positions to a centimetre at 1 Hz
TO_AND_FRO = -0.1  # correlation of second differences with the next: -3/4 and -2/5 of velocities from white noise
WAYS = ("the last interval", "the next interval", "both intervals beside")


def without_computed(fixes: Fixes, table: str) -> tuple[Fixes, list[str]]:
    """The fixes without velocities that were not measured, and a warning of them."""
    known = np.flatnonzero(fixes.valid & np.isfinite(fixes.velocity_n[:, :2]).all(axis=1))
    velocity_n = fixes.velocity_n[known]
    moving = np.hypot(velocity_n[:, 0], velocity_n[:, 1]) > MOVING_MPS
    if moving.sum() <= FEWEST:
        return fixes, []
    if (said := _differences(fixes.rows(known), moving)) is not None:
        nothing = np.full_like(fixes.velocity_n, np.nan)
        seen = f"the velocities of {table} are differences of its positions over {said}; they tell nothing more"
        return replace(fixes, velocity_n=nothing), [f"{WARNING}{seen}, and are left out."]
    down, height_m = velocity_n[moving, 2], fixes.height_m[known][moving]
    risen_m = float(np.ptp(height_m))
    if not down.any() and risen_m > RISEN_M:  # NaN counts as any
        left = fixes.velocity_n.copy()
        left[:, 2] = np.nan
        seen = f"{WARNING}the velocity down of {table} is 0 in every fix, and heights change by {risen_m:.0f} m"
        return replace(fixes, velocity_n=left), [f"{seen}; it counts as not measured."]
    return fixes, []


def _differences(fixes: Fixes, moving: np.ndarray) -> str | None:
    """Over which intervals the velocities are differences of positions, None if they were measured."""
    n = len(fixes.time_s)
    pairs = np.arange(n - 1), np.arange(1, n)
    step_s = np.diff(fixes.time_s)
    way = moved(fixes.latitude_rad, fixes.longitude_rad, fixes.height_m, pairs)[:, :2] / step_s[:, None]
    velocity = fixes.velocity_n[:, :2]
    even = (step_s < 1.5 * np.median(step_s)) & moving[1:] & moving[:-1] & np.isfinite(way).all(axis=1)
    inner = np.flatnonzero(even[1:] & even[:-1]) + 1  # fixes between two such intervals
    if inner.size <= FEWEST:
        return None
    last, following = way[inner - 1], way[inner]
    bent = np.diff(velocity, 2, axis=0)[inner - 1]
    if float((bent[1:] * bent[:-1])[np.diff(inner) == 1].sum()) > TO_AND_FRO * float((bent**2).sum()):
        return None
    measured = _rms(0.5 * (velocity[inner] + velocity[inner - 1]) - last)
    left = [_rms(velocity[inner] - one) for one in (last, following, 0.5 * (last + following))]
    k = int(np.argmin(left))
    return WAYS[k] if left[k] < COMPUTED * measured else None


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
