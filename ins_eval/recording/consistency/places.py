"""Positions without velocities: the unit and order that the gyros and accelerometers prefer.

Differences of positions are velocities under each alternative, and these are held against the integrated specific
force, turned by the gyros, over windows of 8 s (`windows`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ins_eval.earth import gravity
from ins_eval.recording import Fixes, Recording
from ins_eval.recording.consistency.alternatives import EXPLAINED, LIKELY, UNIT_PRIOR, Finding, undecided
from ins_eval.recording.consistency.track import HEIGHT_UNITS, another_height, another_place, moved, places
from ins_eval.recording.consistency.windows import INTERVAL_S, Integrals, velocity_scores


def check_places(recording: Recording, integrals: Integrals, fixes: Fixes, table: str) -> Iterator[Finding]:
    """The alternative of latitude and longitude, or of height, that the motion prefers, or what it leaves open."""
    use = fixes.valid & np.isfinite(fixes.latitude_rad) & np.isfinite(fixes.longitude_rad)
    fixes = fixes.rows(use)
    at_s = fixes.time_s - getattr(recording.belief, table).time_offset_s
    units = HEIGHT_UNITS if np.isfinite(fixes.height_m).all() else {"m": 1.0}
    ways = [(place, unit) for place in places(fixes) for unit in units]
    velocities = [
        differenced(replace(fixes, latitude_rad=latitude, longitude_rad=longitude, height_m=factor * fixes.height_m))
        for latitude, longitude in places(fixes).values()
        for factor in units.values()
    ]
    down = float(gravity(recording.start.latitude_rad, recording.start.height_m))
    arm_m = np.asarray(getattr(recording.belief, table).lever_arm_m, dtype=float)
    scored = velocity_scores(integrals, at_s, np.array(velocities), down, arm_m)
    if scored is None:
        return
    log, changed_mps, left_mps = scored
    log = log + UNIT_PRIOR * np.array([(place != "as read") + (unit != "m") for place, unit in ways])
    best = int(np.argmax(log))
    explained = left_mps[best] < EXPLAINED * min(left_mps[0], changed_mps[best])  # and not by standing still
    if best and log[best] - log[0] > LIKELY and explained:
        place, unit = ways[best]
        seen = (
            f"{table}: positions contradict gyros and accelerometers: their changes of velocity in {INTERVAL_S:g} s "
            f"differ by {left_mps[0]:.3g} m/s, and by {left_mps[best]:.3g} m/s otherwise, expected the same motion"
        )
        log_odds = float(log[best] - log[0])
        yield (
            another_height(seen, unit, log_odds) if place == "as read" else another_place(seen, place, table, log_odds)
        )
        return
    near = [way for way, one in zip(ways[1:], log[1:], strict=True) if one > log[0] - LIKELY]
    parts = ["the unit and order of the position"] if any(place != "as read" for place, _ in near) else []
    parts += ["the unit of the height"] if any(unit != "m" for _, unit in near) else []
    yield from undecided(f"{table}: the motion", parts)


def differenced(fixes: Fixes, interval_s: float = INTERVAL_S) -> np.ndarray:
    """Differences of positions over an interval about each fix, (n, 3) m/s; level without a height."""
    rows = np.arange(len(fixes.time_s))
    ahead = max(1, round(0.5 * interval_s / float(np.median(np.diff(fixes.time_s)))))
    pairs = np.maximum(rows - ahead, 0), np.minimum(rows + ahead, rows[-1])
    way_m = moved(fixes.latitude_rad, fixes.longitude_rad, fixes.height_m, pairs)
    return way_m / (fixes.time_s[pairs[1]] - fixes.time_s[pairs[0]])[:, None]
