"""Files of a GPS receiver alone, RTKLIB and NMEA: fixes to be given beside an IMU with ``--assume gps.file=PATH``.

Their stamps are brought to UTC, seconds since 1970. The clock of the IMU may count these, the seconds of the GPS week
or those of the UTC day; taken is the first of them in which the two overlap, and the notes say which.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ins_eval.boundary import content
from ins_eval.errors import DataRefused
from ins_eval.readers import nmea, rtklib
from ins_eval.readers.fix_columns import GPS_EPOCH_S, WEEK_S
from ins_eval.recording import Fixes
from ins_eval.units import DAY

EXPECTED = "a file of a receiver, RTKLIB .pos or NMEA"
LEAP_S = 18.0  # GPS minus UTC, since 2017


@dataclass(frozen=True)
class ReceiverFile:
    """A format of a receiver: how its beginning looks, and what turns its text into fixes and notes."""

    name: str
    begins: Callable[[bytes], bool]
    read: Callable[[str, bytes], tuple[Fixes, list[str]]]


FORMATS = (
    ReceiverFile("RTKLIB", rtklib.begins, rtklib.fixes),
    ReceiverFile("NMEA", nmea.begins, nmea.fixes),
)


def read(path: Path, span_s: tuple[float, float], origin_s: float = 0.0) -> tuple[Fixes, list[str]]:
    """The fixes of a receiver's file on the clock of an IMU that covers `span_s`, and what was found.

    `origin_s` was taken off the IMU's stamps. Raises `DataRefused` for another file, and where no clock makes the two
    overlap.
    """
    raw = content(path, EXPECTED)
    found = next((one for one in FORMATS if one.begins(raw)), None)
    if found is None:
        raise DataRefused(f"{path}: is neither RTKLIB nor NMEA, expected {EXPECTED}; describe it in a mapping as [gps]")
    fixes, notes = found.read(str(path), raw)
    first_s, last_s = span_s[0] + origin_s, span_s[1] + origin_s
    clocks = {
        "UTC, seconds since 1970": 0.0,
        "the seconds of the GPS week": _whole(fixes.time_s[0] + LEAP_S - GPS_EPOCH_S, WEEK_S) + GPS_EPOCH_S - LEAP_S,
        "the seconds of the UTC day": _whole(fixes.time_s[0], DAY),
    }
    for clock, zero_s in clocks.items():
        if fixes.time_s[0] - zero_s <= last_s and fixes.time_s[-1] - zero_s >= first_s:
            notes = [
                f"The file {path.name} is {found.name} with {len(fixes.time_s)} fixes; the clock of the IMU is taken "
                f"as {clock}, because the two overlap so{f' ({LEAP_S:g} leap seconds)' if 'GPS' in clock else ''}.",
                *notes,
            ]
            return replace(fixes, time_s=fixes.time_s - zero_s - origin_s), notes
    raise DataRefused(
        f"{path}: covers {fixes.time_s[0]:.10g} to {fixes.time_s[-1]:.10g} s since 1970 (UTC) and the IMU "
        f"{first_s:.10g} to {last_s:.10g} s of its clock, expected an overlap in UTC, the GPS week or the UTC day; "
        "give the IMU stamps of one of these clocks"
    )


def span(time_s: np.ndarray) -> tuple[float, float]:
    """The first and last finite stamp."""
    sound = time_s[np.isfinite(time_s)]
    return (float(sound.min()), float(sound.max())) if sound.size else (0.0, 0.0)


def _whole(time_s: float, period_s: float) -> float:
    return float(np.floor(time_s / period_s) * period_s)
