"""Reader of the PSINS text format ``.imu``: a parked strapdown unit as whole counts.

    % comments, anywhere
    pitch0 roll0 yaw0 [deg]  vE0 vN0 vU0 [m/s]                        "maybe inaccurate", says the format itself
    latitude longitude [deg]  height [m]  t0 [s]  interval [ms]  g [m/s^2]
    gyro scale x y z [arcsec/count]  accelerometer scale x y z [ug s/count]
    gyro x y z  accelerometer x y z                                   counts, one row an interval

Body axes are right-forward-up and yaw is counter-clockwise from north; both become ours here:

    (x, y, z) forward-right-down = (y, x, -z) right-forward-up,   heading = -yaw

Roll and pitch turn about the same physical axes, in the same order and sense, in both conventions.
The format is the one written by the PSINS toolbox of G. Yan (2009-2015).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ins_eval.boundary import content
from ins_eval.errors import DataRefused
from ins_eval.readers.files import shown
from ins_eval.readers.layout import frd_from
from ins_eval.recording import Imu, Recording, Start
from ins_eval.units import ARCSEC, DEG

COLUMNS = 6
EXPECTED = "a text file in the PSINS format, three header lines and rows of counts"
EXPECTED_ROW = "gyro x y z, accelerometer x y z"
LARGEST_COUNT = 2.0**31
CUT_NOTE = "The file does not end with a line break, so its last row may be cut and was left out."
AXES = "RFU"
KEYS = ("axes",)

# What each number of the three header lines is, and what it can be.
HEADER = (
    (
        ("pitch", "deg", -90.0, 90.0),
        ("roll", "deg", -180.0, 180.0),
        ("yaw", "deg", -360.0, 360.0),
        ("east velocity of a parked vehicle", "m/s", -0.1, 0.1),
        ("north velocity of a parked vehicle", "m/s", -0.1, 0.1),
        ("up velocity of a parked vehicle", "m/s", -0.1, 0.1),
    ),
    (
        ("latitude", "deg", -90.0, 90.0),
        ("longitude", "deg", -180.0, 360.0),
        ("height", "m", -1000.0, 20000.0),
        ("first time", "s", -1e9, 1e9),
        ("sampling interval", "ms", 0.1, 1000.0),
        ("gravity", "m/s^2", 9.7, 9.9),
    ),
    (
        *((f"gyro scale {axis}", "arcsec per count", 1e-6, 3600.0) for axis in "xyz"),
        *((f"accelerometer scale {axis}", "ug s per count", 1e-6, 1e6) for axis in "xyz"),
    ),
)


def read(path: Path, assumed: Mapping[str, str]) -> Recording:
    """As `read_imu_text`; ``axes`` may be assumed."""
    return read_imu_text(path, assumed.get("axes", AXES))


def read_imu_text(path: str | Path, axes: str = AXES) -> Recording:
    """Read a parked recording in the PSINS text format.

    gyro = counts * scale [arcsec],   accelerometer = counts * scale [ug s] * 1e-6 g, g as the header states it.

    Returns a `Recording` of kind ``"static"``; its start carries the attitude of the header, which the format
    calls inaccurate, so that it can be shown beside an alignment.
    Raises `UsageError` for a path that names no file, `StorageError` for one that cannot be read and
    `DataRefused`, with the line in the file, for content that cannot be right.
    """
    path = Path(path)
    frd = frd_from(axes)
    rows, cut = _rows(path)
    header = _header(path, rows[: len(HEADER)])
    counts = _counts(path, rows[len(HEADER) :])

    (pitch, roll, yaw, east, north, up), (latitude, longitude, height_m, time_s, interval_ms, gravity) = header[:2]
    interval_s = 1e-3 * interval_ms
    gyro_scale, accelerometer_scale = np.array(header[2]).reshape(2, 3)
    gyro = counts[:, :3] * (gyro_scale * ARCSEC)
    accelerometer = counts[:, 3:] * (accelerometer_scale * 1e-6 * gravity)
    heading = -yaw % 360.0
    return Recording(
        name=path.stem,
        kind="static",
        start=Start(
            time_s=time_s,
            latitude_rad=latitude * DEG,
            longitude_rad=longitude * DEG,
            height_m=height_m,
            velocity_n=(north, east, 0.0 - up),
            attitude_rad=(roll * DEG, pitch * DEG, heading * DEG),
        ),
        imu=Imu(
            time_s=time_s + interval_s * np.arange(1, len(counts) + 1),
            gyro=gyro @ frd.T,
            accelerometer=accelerometer @ frd.T,
            accelerometer_form="increment",
        ),
        notes=(
            f"The file {path.name} is in the PSINS text format and holds {len(counts)} samples at "
            f"{1.0 / interval_s:g} Hz, {len(counts) * interval_s:.1f} s.",
            f"Counts were converted with the scales of the header, gyro {_listed(gyro_scale)} arcsec and "
            f"accelerometer {_listed(accelerometer_scale)} ug s per count, where 1 ug is 1e-6 of the header's "
            f"{gravity} m/s^2.",
            "Assumed: body axes are right-forward-up, as is the format's convention; they were turned to "
            "forward-right-down."
            if axes == AXES
            else f"Body axes are taken as {axes}, because you assume so, where the format's convention is {AXES}.",
            f"Assumed: the first row covers the interval that starts at {time_s:g} s, and the vehicle is parked "
            "throughout.",
            f"The header gives roll {roll:g}, pitch {pitch:g}, heading {heading:g} degrees and itself calls them maybe "
            "inaccurate: they are shown beside the alignment, not used in it.",
            "The format carries no temperature, no barometer and no GPS.",
            *([CUT_NOTE] if cut else []),
        ),
    )


def _rows(path: Path) -> tuple[list[tuple[int, list[bytes]]], bool]:
    """Every line that holds numbers, as (line in the file, fields), and whether a last row may be cut short."""
    raw = content(path, EXPECTED).removeprefix(b"\xef\xbb\xbf")  # the mark of some editors before UTF-8
    if b"\0" in raw:
        line = raw.count(b"\n", 0, raw.index(b"\0")) + 1
        raise DataRefused(
            f"{path}, line {line}: a zero byte, expected plain text in the PSINS format; "
            "export the recording as text, in ASCII or UTF-8"
        )
    rows = []
    for number, row in enumerate(raw.splitlines(), start=1):
        fields = row.partition(b"%")[0].split()
        if fields:
            rows.append((number, fields))
    # Half a number is still a number: only a line break tells that the last one is whole.
    cut = not raw.endswith((b"\n", b"\r")) and len(rows) > len(HEADER) and len(rows[-1][1]) == COLUMNS
    return (rows[:-1] if cut else rows), cut


def _header(path: Path, rows: list[tuple[int, list[bytes]]]) -> list[list[float]]:
    """The three header lines as numbers within their limits, six each."""
    if len(rows) < len(HEADER):
        raise DataRefused(
            f"{path}: ends after {len(rows)} of 3 header lines, expected three and then rows of counts; "
            "copy the file again"
        )
    header = []
    for (number, fields), quantities in zip(rows, HEADER, strict=True):
        expected = ", ".join(f"{name} [{unit}]" for name, unit, *_ in quantities)
        if len(fields) != COLUMNS:
            raise DataRefused(
                f"{path}, line {number}: {len(fields)} columns in the header, expected {COLUMNS}: {expected}; "
                "check that this is a file in the PSINS text format"
            )
        values = []
        for field, (name, unit, low, high) in zip(fields, quantities, strict=True):
            value = _number(field)
            if value is None:
                raise DataRefused(
                    f"{path}, line {number}: {shown(field)} in the header, expected a number for {name} [{unit}]; "
                    "check that this is a file in the PSINS text format"
                )
            if not low <= value <= high:
                raise DataRefused(
                    f"{path}, line {number}: {name} is {value:g}, expected {low:g} to {high:g} {unit}; "
                    "correct the header or export the recording again"
                )
            values.append(value)
        header.append(values)
    return header


def _counts(path: Path, rows: list[tuple[int, list[bytes]]]) -> np.ndarray:
    """The rows of counts, shape (n, 6), whole numbers as floats."""
    if not rows:
        raise DataRefused(
            f"{path}: ends after the header, expected rows of counts ({EXPECTED_ROW}); copy the file again"
        )
    for number, fields in rows:
        if len(fields) != COLUMNS:
            last = number == rows[-1][0]
            raise DataRefused(
                f"{path}, line {number}: {len(fields)} columns, expected {COLUMNS} ({EXPECTED_ROW}); "
                + ("the last line seems cut short: copy the file again or delete it" if last else "correct that line")
            )
    fields = [field for _, row in rows for field in row]
    try:
        counts = np.array(fields, dtype=float)
    except ValueError:
        counts = np.array(np.nan)
    sound = (np.abs(counts) <= LARGEST_COUNT) & (counts == np.rint(counts))  # False also where not a number
    if not sound.all() or b"_" in b"".join(fields):
        _refuse_count(path, rows)
    return counts.reshape(-1, COLUMNS)


def _refuse_count(path: Path, rows: list[tuple[int, list[bytes]]]) -> None:
    """Raise `DataRefused` for the first field that is no whole count."""
    for number, fields in rows:
        for column, field in enumerate(fields, start=1):
            value = _number(field)
            if value is None or not value.is_integer() or abs(value) > LARGEST_COUNT:
                raise DataRefused(
                    f"{path}, line {number}, column {column}: {shown(field)}, expected a whole count; "
                    "correct that line or export the recording again"
                )


def _number(field: bytes) -> float | None:
    """The finite number a field holds, or None."""
    try:
        value = float(field)
    except ValueError:
        return None
    return value if np.isfinite(value) and b"_" not in field else None


def _listed(scale: np.ndarray) -> str:
    """One number where the three axes agree, three otherwise."""
    return f"{scale[0]:g}" if (scale == scale[0]).all() else ", ".join(f"{value:g}" for value in scale)
