"""Do the parts of a recording fit each other? One list of checks, for the importers and for the form.

`findings` gives what contradicts itself, with the alternative that holds and its odds; `report` refuses what is beyond
doubt, warns of what is likely, and mends nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence

import numpy as np

from ins_eval.errors import DataRefused
from ins_eval.recording import Fixes, Imu, Recording
from ins_eval.recording.consistency.alternatives import BEYOND_DOUBT, Finding
from ins_eval.recording.consistency.course import check_course
from ins_eval.recording.consistency.far_clocks import check_far_clock
from ins_eval.recording.consistency.limits import check_limits, check_outliers
from ins_eval.recording.consistency.rest import check_rest
from ins_eval.recording.consistency.settling import check_settling
from ins_eval.recording.consistency.start import check_start
from ins_eval.recording.consistency.track import check_baro, check_height, check_stamps, check_track
from ins_eval.recording.consistency.triads import check_triads
from ins_eval.recording.mending import turned

__all__ = ["ACCEPTED", "KEY", "Finding", "findings", "report"]

WARNING = "Warning: "  # begins a note of what is likely wrong
KEY = "consistency"  # `--assume consistency=warn` turns every refusal of this list to a warning
ACCEPTED = "What contradicts {} is accepted, because you assume so."  # the note that says so, also to a later reading


def findings(recording: Recording) -> list[Finding]:
    """Every contradiction, the coarsest first: limits, single values, position and velocity, height, start, the IMU."""
    with np.errstate(all="ignore"):  # damaged values overflow, and are refused by what comes of them
        return [*check_limits(recording), *check_outliers(recording), *_of_motion(recording)]


def _of_motion(recording: Recording) -> Iterator[Finding]:
    finite = _finite(recording.imu)
    for table in ("gps", "reference"):
        fixes = getattr(recording, table)
        if fixes is not None and fixes.valid.any():
            yield from _of_velocity(fixes, table, alone=table == "reference" or recording.reference is None)
            found = [check_stamps(fixes, table), check_height(fixes, table)]
            if found[-1] is None:
                found.append(check_baro(recording.imu, fixes, recording.start.height_m, table))
            if finite:
                found.append(check_far_clock(recording, fixes, table))
            yield from (one for one in found if one is not None)
    if finite:
        yield from check_start(recording)
        yield from check_settling(recording)
        yield from check_rest(recording)
        yield from check_triads(recording)


def _of_velocity(fixes: Fixes, table: str, alone: bool) -> Iterator[Finding]:
    """What `check_track` finds, and `check_course` where that finds nothing or a turn of the velocities ends it all."""
    track, course = check_track(fixes, table), list(check_course(fixes, table, alone))
    if any(one.decided for one in track):
        turns = [one.turned[0] for one in course if one.turned is not None]
        if not turns or any(one.decided for one in check_track(turned(fixes, turns[0]), table)):
            course = []
        else:
            track = []
    yield from (*track, *course)


def report(
    recording: Recording,
    found: Sequence[Finding],
    where: str,
    accepted: Collection[str] = (),
    remedy: Callable[[Finding], str] = lambda one: one.mend,
) -> list[str]:
    """A warning for each contradiction in `found` that is likely; `remedy` says how to mend one.

    Raises `DataRefused` for the first that is beyond doubt and whose key is not `accepted`, here or in the notes.
    """
    notes = []
    for one in found:
        if not one.decided:
            notes.append(f"Undecided: {one.seen}.")
            continue
        odds = f", odds {one.odds}" if np.isfinite(one.log_odds) else ""
        if (warning := f"{WARNING}{one.seen}{odds}.") in recording.notes:
            continue
        keys = (one.key, KEY)
        said = [ACCEPTED.format(key) for key in keys if key in accepted]
        if not said and not any(ACCEPTED.format(key) in recording.notes for key in keys):
            if one.log_odds > BEYOND_DOUBT:
                raise DataRefused(f"{where}, {one.seen}{odds}; {remedy(one)}")
            said = [f"Nothing was mended: {remedy(one)}."]
        notes += [warning, *said]
    return notes


def _finite(imu: Imu) -> bool:
    return bool(np.isfinite(imu.time_s).all() and np.isfinite(imu.gyro).all() and np.isfinite(imu.accelerometer).all())
