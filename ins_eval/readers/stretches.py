"""A recording that gaps cut into stretches, each a recording of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ins_eval.errors import DataRefused
from ins_eval.recording import PARKED, Fixes, Imu, Recording, Start
from ins_eval.recording.stamps import gaps

SHORTEST_S = 10.0  # of a stretch that is kept


def stretches(recording: Recording) -> list[Recording]:
    """The parts between gaps, those below 10 s left out; one without gaps is given back as it is.

    Each but the first begins at its first sample, whose own increment covers the gap and is left out, at the fix
    nearest to it and with an attitude that nobody states (parked: at the place of the start, in its attitude).
    Raises: DataRefused where no stretch is long enough.
    """
    if recording.imu is None or len(recording.imu.time_s) < 2:
        return [recording]
    time_s = recording.imu.time_s
    cuts = gaps(time_s) + 1
    if not cuts.size:
        return [recording]
    edges = [0, *cuts.tolist(), len(time_s)]
    bounds = [(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True) if time_s[b - 1] - time_s[a] >= SHORTEST_S]
    gap_s = float(np.diff(time_s).max())
    gaps_are = "gap of" if cuts.size == 1 else f"{cuts.size} gaps, the longest of"
    found = f"the recording is cut at {'a ' if cuts.size == 1 else ''}{gaps_are} {gap_s:.4g} s"
    if not bounds:
        raise DataRefused(
            f"recording '{recording.name}': {found}, and no stretch lasts {SHORTEST_S:g} s; --assume gaps=bridge draws "
            "straight lines over the gaps, --assume gaps=longest keeps the longest stretch"
        )
    return [_part(recording, a, b, k + 1, len(bounds), found) for k, (a, b) in enumerate(bounds)]


def _part(recording: Recording, a: int, b: int, number: int, count: int, found: str) -> Recording:
    imu = recording.imu
    begin_s = recording.start.time_s if a == 0 else float(imu.time_s[a])
    end_s = float(imu.time_s[b - 1])
    note = f"{found}: this is stretch {number} of {count} of at least {SHORTEST_S:g} s, {begin_s:.6g} to {end_s:.6g} s."
    return replace(
        recording,
        name=f"{recording.name}-{number}" if count > 1 else recording.name,
        start=recording.start if a == 0 else _start(recording, begin_s),
        imu=_rows(imu, slice(a if a == 0 else a + 1, b)),
        gps=_within(recording.gps, begin_s, end_s),
        reference=_within(recording.reference, begin_s, end_s),
        notes=(*recording.notes, note),
    )


def _rows(imu: Imu, chosen: slice) -> Imu:
    part = imu.rows(chosen)
    return replace(part, filled=None) if part.filled is not None and not part.filled.any() else part


def _start(recording: Recording, begin_s: float) -> Start:
    """Place and velocity of the fix nearest to the begin; the attitude is unknown where the vehicle moves."""
    start = replace(recording.start, time_s=begin_s, still_until_s=None)
    if recording.kind in PARKED:
        return start
    start = replace(start, attitude_rad=None, attitude_sigma_rad=None)
    for fixes, section in ((recording.gps, recording.belief.gps), (recording.reference, recording.belief.reference)):
        if fixes is None:
            continue
        known = fixes.valid & np.isfinite(np.column_stack([fixes.latitude_rad, fixes.velocity_n])).all(axis=1)
        if known.any():
            rows = np.flatnonzero(known)
            k = rows[np.argmin(np.abs(fixes.time_s[rows] - section.time_offset_s - begin_s))]
            return replace(start, **fixes.state(int(k)))
    return start


def _within(fixes: Fixes | None, begin_s: float, end_s: float) -> Fixes | None:
    """The fixes of a stretch, or None where there are none."""
    if fixes is None:
        return None
    rows = (fixes.time_s >= begin_s - 1.0) & (fixes.time_s <= end_s + 1.0)
    if not (rows & (fixes.valid | (fixes.attitude_rad is not None))).any():
        return None
    return fixes.rows(rows)
