"""What stands in a receiver's table and was not measured: velocities, and fixes without satellites.

A logger that has no velocity down writes 0, and one that has none at all writes differences of its positions: with
these every error of a position is counted twice, and the velocity is late by half an interval. Of fixes 1 to n at p_k,
the mean velocity of an interval is d_k = (p_k - p_k-1) / dt, and a velocity that was measured leaves less of d_k as
mean of both ends than at one of them,

    rms((v_k + v_k-1) / 2 - d_k)  <  rms(v_k - d_k), rms(v_k-1 - d_k), rms(v_k - (d_k + d_k+1) / 2),

while one that was computed is the other way round, and scatters to and fro with the positions. A way that was summed
from velocities is computed too, but these are smooth.

A receiver that loses its satellites may go straight on, or stand, and jump back when it has them again: one velocity v
to the last digit in `HELD` fixes and more, whose positions lie on that line to `EXACT_M`, and after the last of them

    |p_k+1 - p_k - (v_k + v_k+1) dt / 2|  >  `JUMPS` median |p_i+1 - p_i - (v_i + v_i+1) dt / 2| + `LEAST_M`,

i not in such a run. A vehicle that keeps its velocity ends without that jump, and measured positions scatter. One that
stands does not jump either, but for a receiver that holds it there: it has come to rest by less than g.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ins_eval.recording import Fixes
from ins_eval.recording.consistency import WARNING
from ins_eval.recording.consistency.alternatives import FEWEST
from ins_eval.recording.consistency.track import moved
from ins_eval.units import STANDARD_GRAVITY

MOVING_MPS = 1.0  # slower, a velocity says little either way; like the others here by reasoning
RISEN_M = 5.0  # of heights, which no velocity down of 0 makes
COMPUTED = 0.1  # of what the mean of both ends leaves: rounding of positions to a centimetre at 1 Hz
TO_AND_FRO = -0.1  # correlation of second differences with the next: -3/4 and -2/5 of velocities from white noise
HELD = 5  # fixes of one velocity: written with few digits, two or three are alike by chance; by reasoning
JUMPS, LEAST_M = 10.0, 1.0  # times that positions usually depart from their velocities, and metres; by reasoning
EXACT_M = 0.2  # of positions that were computed: those written to 1e-6 deg are exact to 0.1 m, of two
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


def without_extrapolated(fixes: Fixes, table: str) -> tuple[Fixes, list[str]]:
    """The fixes with those that hold a velocity, and from which the next one jumps, as outages; and a warning."""
    known = np.flatnonzero(fixes.valid & np.isfinite(fixes.velocity_n[:, :2]).all(axis=1))
    velocity = fixes.velocity_n[known, :2]
    same = (velocity[1:] == velocity[:-1]).all(axis=1)
    first, last = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]]).astype(int))).reshape(-1, 2).T
    held = (last - first + 1 >= HELD) & (last < len(known) - 1)
    if not held.any():
        return fixes, []
    pairs = known[:-1], known[1:]
    way_m = moved(fixes.latitude_rad, fixes.longitude_rad, fixes.height_m, pairs)[:, :2]
    step_s = np.diff(fixes.time_s[known])
    departs_m = np.hypot(*(way_m - 0.5 * (velocity[1:] + velocity[:-1]) * step_s[:, None]).T)
    usual_m = float(np.nanmedian(departs_m[~same])) if np.isfinite(departs_m[~same]).any() else np.inf
    slows = np.hypot(*np.diff(velocity, axis=0).T) > STANDARD_GRAVITY * step_s  # by more than a vehicle does
    runs = [
        (j, k)
        for j, k in zip(first[held], last[held], strict=True)
        if departs_m[k] > JUMPS * usual_m + LEAST_M and departs_m[j:k].max() < EXACT_M
        if velocity[j].any() or (j > 0 and slows[j - 1])
    ]
    if not runs:
        return fixes, []
    valid = fixes.valid.copy()
    for j, k in runs:
        valid[known[j + 1 : k + 1]] = False
    (j, k), count = runs[0], int(np.count_nonzero(fixes.valid & ~valid))
    return replace(fixes, valid=valid), [
        f"{WARNING}{count} fixes of {table} keep one velocity to the last digit, the first from "
        f"{fixes.time_s[known[j]]:.6g} to {fixes.time_s[known[k]]:.6g} s, and the next is {departs_m[k]:.0f} m off "
        "from where that leads, as where a receiver has no satellites; they count as an outage."
    ]


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
