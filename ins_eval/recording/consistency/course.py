"""Velocities of another navigator that are turned against the way of its positions, or older than these.

With horizontal vectors as complex numbers, the way dp from one fix to another some seconds later, the integral w of the
velocities between them and their change dv make

    dp = c w + tau dv,   arg c: the way is turned by it against the velocities, tau: these are late by it,

by least squares over all pairs; one sigma of both by the jackknife over blocks (Efron and Tibshirani, An Introduction
to the Bootstrap, 1993, chapter 11), that of the turn with what a slow error of the velocities does to it. A receiver's
course from magnetic north, or from that of a grid, is so turned; a velocity that is filtered is late. On a circle at
one speed the two are alike, and neither is known.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ins_eval.limits import within
from ins_eval.recording import Fixes
from ins_eval.recording.consistency.alternatives import BEYOND_DOUBT, Finding
from ins_eval.recording.consistency.track import moved, pairs_of, travelled, without_missing_down
from ins_eval.units import DEG

BLOCKS = 20  # of the jackknife: by reasoning
LEAST_TURN_RAD = 1.5 * DEG  # 114 simulated recordings, and the real ones, are turned by less than 0.4
LARGEST_TURN_RAD = 45.0 * DEG  # of a declination, but near a magnetic pole; by reasoning
SLOW_MPS = 0.3  # by which velocities may be off for minutes: at v they seem turned by as much over v; by reasoning
ALIKE = 0.9  # of the change of velocity, that a turn of it takes up on a circle; by reasoning
LEAST_LATE_S = 0.15  # three times what velocities may be older than positions anyway (`estimation.case.LAG_S`)
SIGMAS = 5.0  # by reasoning


def check_course(fixes: Fixes, table: str, alone: bool) -> Iterator[Finding]:
    """What is wrong with the course or the age of the velocities; `alone` where the fixes are the only ones."""
    fixes, _ = without_missing_down(fixes)
    use = fixes.valid & within(fixes.velocity_n).all(axis=1)
    use &= np.isfinite(fixes.latitude_rad) & np.isfinite(fixes.longitude_rad)
    time_s, velocity_n = fixes.time_s[use], fixes.velocity_n[use]
    pairs = pairs_of(time_s) if use.sum() > BLOCKS else None
    if pairs is None or len(pairs[0]) < BLOCKS:
        return
    went = moved(fixes.latitude_rad[use], fixes.longitude_rad[use], fixes.height_m[use], pairs)
    change = velocity_n[pairs[1]] - velocity_n[pairs[0]]
    way, through, changed = map(_complex, (went, travelled(time_s, velocity_n, pairs), change))
    if _alike(through, changed):
        return
    (turn_rad, late_s), sigma = _fitted(way, through, changed)
    speed = np.sqrt(np.mean(np.abs(through / (time_s[pairs[1]] - time_s[pairs[0]])) ** 2))
    sigma[0] = np.hypot(sigma[0], SLOW_MPS / max(speed, SLOW_MPS))
    odds = [_log_odds(one / s) if s > 0.0 else 0.0 for one, s in zip((turn_rad, late_s), sigma, strict=True)]
    if max(LEAST_TURN_RAD, SIGMAS * sigma[0]) < abs(turn_rad) < LARGEST_TURN_RAD:
        side = "right" if turn_rad > 0.0 else "left"
        degrees = abs(turn_rad) / DEG
        seen = (
            f"{table}: the way of the positions leads {degrees:.3g} ± {sigma[0] / DEG:.2g}° to the {side} of the "
            "velocities, expected along them; it looks as if these are from magnetic north, or from that of a grid"
        )
        mend = f"turn the velocities by {degrees:.3g}° to the {side}, or leave their columns out"
        mendable = alone and fixes.attitude_rad is None
        yield Finding(
            f"{table}.velocity", seen, mend, odds[0], turned=(turn_rad, float(sigma[0])) if mendable else None
        )
    if abs(late_s) > max(LEAST_LATE_S, SIGMAS * sigma[1]):
        older = "older" if late_s > 0.0 else "younger"
        seen = (
            f"{table}: the velocities are {abs(late_s):.3f} ± {sigma[1]:.2g} s {older} than the positions beside them, "
            "expected of the same instant; an offset of the clock that comes out holds for the velocities alone"
        )
        mend = "bring the velocities to the instants of the positions, or leave their columns out"
        yield Finding(f"{table}.velocity", seen, mend, min(odds[1], BEYOND_DOUBT))


def _alike(through: np.ndarray, change: np.ndarray) -> bool:
    """Whether a turn does to the way what an age does."""
    power = np.vdot(through, through).real * np.vdot(change, change).real
    return abs(np.vdot(through, change)) ** 2 > ALIKE * power


def _complex(vectors: np.ndarray) -> np.ndarray:
    return vectors[:, 0] + 1j * vectors[:, 1]


def _fitted(went: np.ndarray, through: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The angle arg c in rad and tau in s (2,), and one sigma of each."""
    columns = np.array([through, 1j * through, change]).T
    rows = np.stack([columns.real, columns.imag], axis=1)  # (n, 2, 3)
    shown = np.stack([went.real, went.imag], axis=1)
    blocks = np.array_split(np.arange(went.size), BLOCKS)
    normal = np.array([np.einsum("nki,nkj->ij", rows[block], rows[block]) for block in blocks])
    projection = np.array([np.einsum("nki,nk->i", rows[block], shown[block]) for block in blocks])
    whole = _solved(normal.sum(axis=0), projection.sum(axis=0))
    normal, projection = normal.sum(axis=0) - normal, projection.sum(axis=0) - projection  # all blocks but one
    away = np.array([_solved(*one) for one in zip(normal, projection, strict=True)]) - whole
    away[:, 0] = (away[:, 0] + np.pi) % (2.0 * np.pi) - np.pi
    spread = away - away.mean(axis=0)
    return whole, np.sqrt((BLOCKS - 1.0) / BLOCKS * (spread**2).sum(axis=0))


def _solved(normal: np.ndarray, projection: np.ndarray) -> np.ndarray:
    real, imaginary, late_s = np.linalg.lstsq(normal, projection, rcond=None)[0]
    return np.array([np.arctan2(imaginary, real), late_s])


def _log_odds(sigmas: float) -> float:
    """Of Student's distribution with as many degrees of freedom as blocks leave."""
    freedom = BLOCKS - 1.0
    return float(0.5 * BLOCKS * np.log1p(sigmas**2 / freedom))
