"""The place at which a recording begins against that of its first fixes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pymap3d import geodetic2ned

from ins_eval.recording import Recording
from ins_eval.recording.belief import POSITION_SIGMA_M
from ins_eval.recording.consistency.alternatives import Finding
from ins_eval.recording.consistency.limits import WARNED
from ins_eval.recording.consistency.settling import LATE_S

NEAR_S, MOST_FIXES = 5.0, 9  # from the start, and as many as one that is wrong does not decide
SIGMAS = 5.0  # beyond which neither errs, by reasoning
# beyond the sigmas, by reasoning: slow errors of a receiver and its antenna; a geoid is mostly farther away
ACROSS_M, ABOVE_M = 20.0, 15.0


def check_start(recording: Recording) -> Iterator[Finding]:
    """A start that is farther from the fixes than either may err, across or in height.

    Fixes of the first `NEAR_S`, or until as long after a standstill that is stated, are taken back to the start with
    their velocities, and their median is compared.
    """
    start = recording.start
    stood_s = start.time_s if start.still_until_s is None else start.still_until_s
    for table in ("gps", "reference"):
        fixes, described = getattr(recording, table), getattr(recording.belief, table)
        if fixes is None:
            continue
        at_s = fixes.time_s - described.time_offset_s
        since_s = at_s - np.clip(at_s, start.time_s, stood_s)  # in motion
        place = np.column_stack([fixes.latitude_rad, fixes.longitude_rad, fixes.height_m])
        rows = np.flatnonzero(fixes.valid & np.isfinite(place).all(axis=1) & (np.abs(since_s) < NEAR_S))[:MOST_FIXES]
        if not rows.size:
            continue
        velocity_n = np.where(np.isfinite(fixes.velocity_n[rows]), fixes.velocity_n[rows], start.velocity_n)
        begin = start.latitude_rad, start.longitude_rad, start.height_m
        apart_m = np.column_stack(geodetic2ned(*place[rows].T, *begin, deg=False))
        apart_m = np.median(apart_m - since_s[rows, None] * velocity_n, axis=0)
        own = np.empty(0) if fixes.position_sigma_m is None else fixes.position_sigma_m[rows]
        sigma_m = max(own[np.isfinite(own)], default=described.position_sigma_m or POSITION_SIGMA_M)
        allowed_m = SIGMAS * np.hypot(sigma_m, start.position_sigma_m) + np.linalg.norm(described.lever_arm_m)
        speed = np.abs(np.median(velocity_n, axis=0))
        across_m, most_m = np.hypot(*apart_m[:2]), allowed_m + ACROSS_M + LATE_S * np.hypot(*speed[:2])
        if across_m > most_m:
            seen = f"start: its place is {across_m:.0f} m from that of {table}, expected within {most_m:.0f} m"
            yield Finding("start.place", seen, f"state the place of {table}, or how uncertain it is", WARNED)
        most_m = allowed_m + ABOVE_M + LATE_S * speed[2]
        if abs(apart_m[2]) > most_m:
            seen = (
                f"start: its height is {abs(apart_m[2]):.0f} m {'below' if apart_m[2] < 0.0 else 'above'} that of "
                f"{table}, expected within {most_m:.0f} m; one may be above the sea, the other above the ellipsoid"
            )
            yield Finding("start.height", seen, f"state the height of {table}", WARNED)
        return
