"""Where a recording begins that does not say it: at a fix."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ins_eval.earth import radii
from ins_eval.recording import Fixes, Start
from ins_eval.recording.belief import POSITION_SIGMA_M, VELOCITY_SIGMA_MPS, Belief

NAMES = {"gps": "GPS", "reference": "the reference"}  # of the tables, in sentences


def begin_at_a_fix(
    tables: Mapping[str, Fixes | None],
    belief: Belief,
    start_s: float,
    attitude_sigma_rad: tuple[float, float, float] | None = None,
) -> tuple[Start, list[str]] | None:
    """The state of the fix with a position nearest to `start_s`, and what was assumed; None where there is none.

    `tables` are ``reference``, ``gps`` and ``solution`` in the order in which they are asked. An attitude comes from
    the table that has one, with the sigmas that are given.
    """
    located = [
        (name, fixes, np.flatnonzero(np.isfinite(fixes.latitude_rad) & np.isfinite(fixes.longitude_rad) & fixes.valid))
        for name, fixes in tables.items()
        if fixes is not None
    ]
    located = [found for found in located if found[2].size]
    if not located:
        return None
    name, fixes, rows = located[0]
    described = getattr(belief, "gps" if name == "solution" else name)
    near_s = np.abs(fixes.time_s[rows] - described.time_offset_s - start_s)
    k = int(rows[np.argmin(near_s)])
    notes, height_m, velocity_n = [], float(fixes.height_m[k]), fixes.velocity_n[k]
    if not np.isfinite(height_m):
        height_m = 0.0
        notes.append(f"The height of the start is taken as 0 m, because {NAMES.get(name, name)} has none there.")
    if not np.isfinite(velocity_n).all():
        velocity_n = np.where(np.isfinite(velocity_n), velocity_n, _differenced(fixes, rows, k))
        notes.append(
            "The velocity of the start comes from differences of position, because "
            f"{NAMES.get(name, name)} has none there."
        )
    attitude = None
    for table in (tables.get("reference"), tables.get("solution")):
        if attitude is None and table is not None and table.attitude_rad is not None:
            known = np.flatnonzero(np.isfinite(table.attitude_rad).all(axis=1))
            if known.size:
                attitude = table.attitude_rad[known[np.argmin(np.abs(table.time_s[known] - start_s))]]
    sigmas = described.position_sigma_m, described.velocity_sigma_mps
    if None in sigmas:
        sigmas = POSITION_SIGMA_M, VELOCITY_SIGMA_MPS
        notes.append(f"The start is believed to {sigmas[0]:g} m and {sigmas[1]:g} m/s, since nobody stated its sigmas.")
    start = Start(
        time_s=start_s,
        **{**fixes.state(k), "height_m": height_m, "velocity_n": tuple(velocity_n.tolist())},
        attitude_rad=None if attitude is None else tuple(attitude.tolist()),
        attitude_sigma_rad=None if attitude is None else attitude_sigma_rad,
        position_sigma_m=sigmas[0],
        velocity_sigma_mps=sigmas[1],
    )
    return start, notes


def _differenced(fixes: Fixes, rows: np.ndarray, k: int) -> np.ndarray:
    """North, east, down velocity (3,) from the position at row k to the next of `rows`, m/s; 0 where there is none."""
    later = rows[rows > k]
    earlier = rows[rows < k]
    if not later.size and not earlier.size:
        return np.zeros(3)
    a, b = (k, int(later[0])) if later.size else (int(earlier[-1]), k)
    meridian, transverse = radii(fixes.latitude_rad[k])
    north = (fixes.latitude_rad[b] - fixes.latitude_rad[a]) * meridian
    east = (fixes.longitude_rad[b] - fixes.longitude_rad[a]) * transverse * np.cos(fixes.latitude_rad[k])
    down = np.nan_to_num(fixes.height_m[a] - fixes.height_m[b])
    return np.array([north, east, down]) / (fixes.time_s[b] - fixes.time_s[a])
