"""Rows of a receiver's table that repeat the row before: a logger at a higher rate writes a fix until the next comes.

A vehicle that moves has no two fixes of the same position and velocity, so a row that repeats the one before is none.
One that stands may have; of its rows as many are left as the receiver makes fixes in motion.
"""

from __future__ import annotations

import numpy as np

from ins_eval.recording import Fixes
from ins_eval.recording.consistency.alternatives import FEWEST
from ins_eval.recording.consistency.track import moved

SLOW_MPS = 0.5  # the way from a fix to the next, or its velocity: slower, a fix may be as the one before; by reasoning


def without_repeats(fixes: Fixes, table: str) -> tuple[Fixes, list[str]]:
    """The fixes without rows that repeat the one before, and a sentence on them; the first of equals stays.

    Where a vehicle moves all repeats are left out. Where it stands, one row is left for each interval of the receiver,
    the median from change to change in motion; with too little motion to tell that interval, all are left.
    """
    columns = [fixes.latitude_rad, fixes.longitude_rad, fixes.height_m, *fixes.velocity_n.T]
    columns += [] if fixes.attitude_rad is None else [*fixes.attitude_rad.T]
    values = np.column_stack([*columns, fixes.valid])
    same = ((values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1]))).all(axis=1)
    same &= np.isfinite(values[1:, :-1]).any(axis=1) & fixes.valid[1:]
    if not same.any():
        return fixes, []
    first = np.flatnonzero(np.r_[True, ~same])  # row of each fix
    rows = np.diff(np.r_[first, len(values)])  # how many show it
    moving = _moving(fixes.rows(first))
    if moving.sum() < FEWEST:
        return fixes, []
    interval = float(np.median(rows[:-1][moving[:-1]]))
    since = np.arange(len(values)) - np.repeat(first, rows)
    keep = np.floor(since / interval) > np.floor((since - 1) / interval)
    keep &= ~np.repeat(moving, rows) | (since == 0)
    if keep.all():
        return fixes, []
    return fixes.rows(keep), [
        f"{np.count_nonzero(~keep)} of {len(keep)} rows of {table} repeat the row before, as a logger writes a fix "
        f"until the next comes; they were left out, and {np.count_nonzero(keep)} fixes are used."
    ]


def _moving(fixes: Fixes) -> np.ndarray:
    """Which of unequal fixes (m,) are valid and have a velocity, or else a way to the next, of a vehicle in motion."""
    pairs = np.arange(len(fixes.time_s) - 1), np.arange(1, len(fixes.time_s))
    way_m = moved(fixes.latitude_rad, fixes.longitude_rad, fixes.height_m, pairs)
    of_way = np.hypot(way_m[:, 0], way_m[:, 1]) / np.diff(fixes.time_s)
    of_way = np.r_[of_way, of_way[-1:]]
    speed = np.hypot(*fixes.velocity_n[:, :2].T)
    return fixes.valid & (np.where(np.isfinite(speed), speed, of_way) > SLOW_MPS)
