"""Sentences of a receiver (NMEA 0183): GGA position and height, RMC date, speed and course; read with pynmea2.

GGA and RMC of one time of day are one fix; the height above the ellipsoid is the altitude plus the separation of the
geoid. There is no vertical velocity. Sentences whose checksum is wrong are left out and counted.
"""

from __future__ import annotations

import datetime
from collections.abc import Iterator

import numpy as np

from ins_eval.errors import DataRefused
from ins_eval.readers.fix_columns import checked_groups
from ins_eval.readers.optional import library
from ins_eval.recording import Fixes
from ins_eval.units import DAY, DEG

EXPECTED = "NMEA sentences GGA and RMC"
KNOT = 1852.0 / 3600.0
LONGEST_LINE = 200
KINDS = (b"GGA", b"RMC")


def begins(raw: bytes) -> bool:
    """Whether the text looks like such a file."""
    return any(line.startswith(b"$") and line[3:6].isalpha() for line in raw[:4000].splitlines())


def fixes(where: str, raw: bytes) -> tuple[Fixes, list[str]]:
    """The fixes, stamps in UTC since 1970, and what was found.

    Raises `DataRefused` for a file without a dated fix.
    """
    pynmea2 = library("pynmea2", where)
    sentences, bad, geoid = _sentences(pynmea2, raw)
    epochs: dict[float, dict] = {}
    for time_s, values in _dated(sentences):
        epochs.setdefault(round(time_s, 6), {}).update(values)
    if not epochs:
        raise DataRefused(f"{where}: holds no dated fix, expected {EXPECTED}; without RMC there is no date")
    times = sorted(epochs)
    rows = [epochs[time] for time in times]

    def column(name: str) -> np.ndarray:
        return np.array([float(row.get(name, np.nan)) for row in rows])

    speed, course = column("speed"), column("course")
    still = np.isnan(course) & (speed < KNOT)  # receivers leave the course out when they stand
    course[still] = 0.0
    velocity_n = np.column_stack([speed * np.cos(course), speed * np.sin(course), np.full(len(rows), np.nan)])
    latitude, longitude = column("latitude"), column("longitude")
    fixed = np.array([row.get("valid", True) for row in rows]) & np.isfinite(latitude)
    found = checked_groups(Fixes(np.array(times), latitude, longitude, column("height_m"), velocity_n, fixed), where)
    return found, [
        f"{bad} sentences were damaged and left out; {int((~fixed).sum())} of {len(rows)} fixes are none. Velocity is "
        "speed and course, without a vertical one; heights are "
        f"{'above the ellipsoid' if geoid else 'above mean sea level and taken as ellipsoidal'}."
    ]


def _sentences(pynmea2, raw: bytes) -> tuple[list[tuple[float, float | None, dict]], int, bool]:
    """Second of the day, midnight of RMC since 1970, values; how many were damaged; whether all have a geoid."""
    found: list[tuple[float, float | None, dict]] = []
    bad, geoid = 0, True
    for line in raw.splitlines():
        if line[3:6] not in KINDS or len(line) > LONGEST_LINE:
            continue
        try:
            sentence = pynmea2.parse(line.decode("ascii"), check=True)
            time = sentence.timestamp
            second = 3600.0 * time.hour + 60.0 * time.minute + time.second + 1e-6 * time.microsecond
            if sentence.sentence_type == "RMC":
                day = datetime.datetime.combine(sentence.datestamp, datetime.time(), datetime.UTC).timestamp()
                found.append((second, day, _of_rmc(sentence)))
            else:
                found.append((second, None, _of_gga(sentence)))
                geoid &= sentence.altitude is None or sentence.geo_sep not in (None, "")
        except Exception:  # a damaged sentence makes the library fail in many ways
            bad += 1
    return found, bad, geoid


def _dated(found: list[tuple[float, float | None, dict]]) -> Iterator[tuple[float, dict]]:
    """Seconds since 1970 of each sentence: GGA has the day of the nearest midnight to the RMC before, or the first."""
    latest_s = next((second + day for second, day, _ in found if day is not None), None)
    for second, day, values in found if latest_s is not None else ():
        if day is None:
            day = DAY * round((latest_s - second) / DAY)
        latest_s = day + second
        yield latest_s, values


def _of_rmc(sentence) -> dict:
    place = {} if not sentence.lat else {"latitude": DEG * sentence.latitude, "longitude": DEG * sentence.longitude}
    valid = {} if sentence.status == "A" else {"valid": False}
    speed = {} if sentence.spd_over_grnd in (None, "") else {"speed": KNOT * float(sentence.spd_over_grnd)}
    course = {} if sentence.true_course in (None, "") else {"course": DEG * float(sentence.true_course)}
    return {**place, **valid, **speed, **course}


def _of_gga(sentence) -> dict:
    place = {} if not sentence.lat else {"latitude": DEG * sentence.latitude, "longitude": DEG * sentence.longitude}
    valid = {} if int(sentence.gps_qual) > 0 else {"valid": False}
    if sentence.altitude is None:
        return {**place, **valid}
    return {**place, **valid, "height_m": float(sentence.altitude) + float(sentence.geo_sep or 0.0)}
