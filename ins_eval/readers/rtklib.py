"""Solutions of RTKLIB (.pos): a header after ``%``, whose last line names the columns, then one line an epoch.

    GPST or UTC   date and time, or GPS week and second
    position      latitude longitude [deg] height [m], or x y z of the Earth-fixed frame [m]
    Q ns sd...    quality (1 fixed, 2 float, 4 differential, 5 single), satellites, standard deviations [m]
    v...          velocity north, east, up [m/s] where it was written

Source: RTKLIB manual 2.4.2, appendix B.1.
"""

from __future__ import annotations

import datetime
import re

import numpy as np

from ins_eval.errors import DataRefused
from ins_eval.readers.files import shown
from ins_eval.readers.fix_columns import GPS_EPOCH_S, WEEK_S, checked_groups, geodetic
from ins_eval.recording import Fixes
from ins_eval.units import DEG

EXPECTED = "an RTKLIB solution with its header"
NAMES = re.compile(rb"^%\s+(GPST|UTC|JST)\s+(.*)$", re.MULTILINE)
GEODETIC = ("latitude(deg)", "longitude(deg)", "height(m)")
EARTH_FIXED = ("x-ecef(m)", "y-ecef(m)", "z-ecef(m)")
SIGMAS = ("sdn(m)", "sde(m)", "sdu(m)")
VELOCITY = ("vn(m/s)", "ve(m/s)", "vu(m/s)")
LEAP_S = 18.0
HOURS = {b"GPST": 0.0, b"UTC": 0.0, b"JST": 9.0}  # beyond UTC


def begins(raw: bytes) -> bool:
    """Whether the text looks like such a file."""
    return raw.startswith(b"%") and NAMES.search(raw[:20_000]) is not None


def fixes(where: str, raw: bytes) -> tuple[Fixes, list[str]]:
    """The fixes, stamps in UTC since 1970, and what was found.

    Raises `DataRefused` with the line of what is no epoch.
    """
    header = NAMES.search(raw)
    if header is None:
        raise DataRefused(f"{where}: names no columns after %, expected {EXPECTED}; write it again with its header")
    names = [name.decode("ascii", "replace") for name in header[2].split()]
    position = next((group for group in (GEODETIC, EARTH_FIXED) if set(group) <= set(names)), None)
    if position is None:
        raise DataRefused(
            f"{where}: its columns are {', '.join(names)[:200]}, expected {', '.join(GEODETIC)} or "
            f"{', '.join(EARTH_FIXED)}; write the solution in degrees or Earth-fixed"
        )
    rows = [
        _row(where, number, line, len(names))
        for number, line in enumerate(raw.splitlines(), start=1)
        if line.strip() and not line.startswith(b"%")
    ]
    if not rows:
        raise DataRefused(f"{where}: holds no epochs, expected {EXPECTED}; check the processing")
    table = np.array(rows)
    time_s = table[:, 0] - (LEAP_S if header[1] == b"GPST" else 3600.0 * HOURS[header[1]])

    def columns(group: tuple[str, ...]) -> np.ndarray:
        return table[:, [1 + names.index(name) for name in group]]

    place = columns(position)
    place = place * [DEG, DEG, 1.0] if position is GEODETIC else geodetic(place)
    moving = set(VELOCITY) <= set(names)
    velocity_n = columns(VELOCITY) * [1.0, 1.0, -1.0] if moving else np.full((len(table), 3), np.nan)
    sigma = None
    if set(SIGMAS) <= set(names):
        with np.errstate(all="ignore"):
            sigma = np.sqrt(np.mean(columns(SIGMAS) ** 2, axis=1))
    known = np.isfinite(place).all(axis=1)
    latitude, longitude, height = place.T
    found = checked_groups(Fixes(time_s, latitude, longitude, height, velocity_n, known, None, sigma), where)
    quality = table[:, 1 + names.index("Q")] if "Q" in names else np.zeros(0)
    counted = ", ".join(f"{int((quality == q).sum())} of quality {q:g}" for q in np.unique(quality)[:9])
    return found, [
        f"Its stamps are {header[1].decode()}, its positions {'geodetic' if position is GEODETIC else 'Earth-fixed'}"
        f"{'' if moving else ', without velocity'}{f'; {counted}' if counted else ''}."
    ]


def _row(where: str, number: int, line: bytes, width: int) -> tuple[float, ...]:
    """Seconds since 1970 on the clock of the file, and the columns; both forms of time."""
    fields = line.replace(b",", b" ").split()
    try:
        if b"/" in fields[0]:
            day = datetime.datetime(*(int(part) for part in fields[0].split(b"/")), tzinfo=datetime.UTC)
            hour, minute, second = (float(part) for part in fields[1].split(b":"))
            time_s = day.timestamp() + 3600.0 * hour + 60.0 * minute + second
        else:
            time_s = GPS_EPOCH_S + WEEK_S * int(fields[0]) + float(fields[1])
        values = tuple(float(field) for field in fields[2:])
    except (ValueError, IndexError, OverflowError, TypeError):
        raise DataRefused(
            f"{where}, line {number}: {shown(line[:20])}, expected date, time and {width} numbers; correct that line"
        ) from None
    if len(values) != width:
        raise DataRefused(
            f"{where}, line {number}: {len(values)} columns after the time, expected {width} as in the header; correct "
            "or delete that line"
        )
    return (time_s, *values)
