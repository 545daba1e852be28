"""Reader of the ASCII logs of NovAtel receivers with an inertial unit: one sentence a line, its name first.

    %RAWIMUSA      week, second; then week, second, status, z accel, -y accel, x accel, z gyro, -y gyro, x gyro [counts]
    #RAWIMUA       the same with a long header
    #BESTPOSA      latitude longitude [deg], height above sea level [m], undulation [m], ... standard deviations
    #BESTVELA      horizontal speed [m/s], course [deg], vertical speed up [m/s]
    #INSPVAA, %INSPVASA   the receiver's own solution: position, north east up [m/s], roll pitch azimuth [deg]

Counts become increments by the scale factors of the unit, which the log does not state: --assume imu.model=NAME, or
gyro.scale (rad a count) and accelerometer.scale (m/s a count). The raw axes y of the unit are written with the opposite
sign; axes are the unit's right-forward-up (x, y, z). Source: NovAtel OEM7 Commands and Logs Reference Manual, RAWIMUS.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ins_eval.boundary import content
from ins_eval.errors import DataRefused, UsageError
from ins_eval.readers import assembly
from ins_eval.readers.autopilot import later
from ins_eval.readers.files import shown
from ins_eval.readers.fix_columns import checked_groups, groups_found
from ins_eval.readers.layout import Layout, choose
from ins_eval.readers.options import number
from ins_eval.readers.sampling import Readings
from ins_eval.recording import Fixes, Recording
from ins_eval.units import ARCSEC, DEG

KEYS = (
    *(key for key in assembly.KEYS if not key.endswith(".unit")),
    "imu.model",
    "gyro.scale",
    "accelerometer.scale",
)
EXPECTED = "NovAtel ASCII logs with RAWIMUA or RAWIMUSA"
FOOT_M = 0.3048
# rad a count, m/s a count; manual, table Raw IMU Scale Factors, and the maker's driver for ROS (oem7_imu.cpp, 2020)
SCALES = {
    "HG1700-AG58": (2.0**-33, FOOT_M * 2.0**-27),
    "HG1700-AG62": (2.0**-33, FOOT_M * 2.0**-26),
    "HG1900": (2.0**-33, FOOT_M * 2.0**-27),
    "HG4930": (2.0**-33, 2.0**-29),
    "LN200": (2.0**-19, 2.0**-14),
    "IMAR-FSAS": (0.1 * 2.0**-8 * ARCSEC, 0.05 * 2.0**-15),
    "ISA-100C": (1e-9, 2e-8),
    "ADIS16488": (720.0 * 2.0**-31 * DEG, 200.0 * 2.0**-31),
    "STIM300": (2.0**-21 * DEG, 2.0**-22),
}
WEEK_S = 604800.0
SOLUTIONS = {"INSPVAA", "INSPVASA"}
SHORT = {"RAWIMUSA", "INSPVASA"}
WIDTH = {"RAWIMUA": 9, "RAWIMUSA": 9, "BESTPOSA": 10, "BESTVELA": 8, "INSPVAA": 12, "INSPVASA": 12}


def read(path: Path, assumed: Mapping[str, str]) -> Recording:
    """The whole log as one recording."""
    rows, bad = _sentences(path, content(path, EXPECTED))
    name = next((name for name in ("RAWIMUSA", "RAWIMUA") if rows[name]), None)
    if name is None:
        raise DataRefused(f"{path}: holds no sentence RAWIMUA or RAWIMUSA, expected {EXPECTED}; log one of them")
    gyro_scale, force_scale, scale_note = _scales(path, assumed)
    raw = np.array([row[2:] for row in rows[name]])  # week, second, status, accelerometer, gyro
    week = float(raw[0, 0])
    time_s = WEEK_S * (raw[:, 0] - week) + raw[:, 1]
    turned = [2, 1, 0]
    sign = np.array([1.0, -1.0, 1.0])
    readings = Readings(time_s, gyro_scale * sign * raw[:, 6:9][:, turned], force_scale * sign * raw[:, 3:6][:, turned])
    gps = _gps(path, rows, week)
    solution = _solution(path, [row for kind in sorted(SOLUTIONS) for row in rows[kind]], week)
    counts = ", ".join(f"{len(found)} {kind}" for kind, found in rows.items() if found)
    return assembly.recording(
        assembly.Tables(
            name=path.stem,
            kind=assumed.get("kind", "drive"),
            readings=readings,
            layout=Layout("rad", "m/s", "RFU"),
            gps=gps,
            solution=solution,
            notes=(
                f"The file {path.name} holds NovAtel sentences: {counts}; {bad} damaged lines were left out. Stamps "
                f"are seconds of GPS week {week:.0f}.",
                scale_note,
                *(
                    ["The sentences of INSPVA are what the receiver's INS put out: the table solution."]
                    * bool(solution)
                ),
            ),
        ),
        str(path),
        assumed,
        "this is the format's convention",
    )


def _sentences(path: Path, raw: bytes) -> tuple[dict[str, list[list]], int]:
    """Week and second of the header and the fields of each sentence; how many lines were damaged."""
    rows: dict[str, list[list]] = {name: [] for name in WIDTH}
    bad, wrong = 0, b""
    for line in raw.splitlines():
        name = line[1:].partition(b",")[0].decode("ascii", "replace")
        if name not in WIDTH or line[:1] not in (b"#", b"%"):
            continue
        head, semicolon, body = line.partition(b";")
        text, star, checksum = body.partition(b"*")
        fields = text.split(b",")
        try:
            if not semicolon or not star or int(checksum, 16) != crc32(line[1:].partition(b"*")[0]):
                raise ValueError("damaged")
            header = head.split(b",")
            stamp = header[1:3] if name in SHORT else header[5:7]
            solved = fields[:2] if name.startswith("BEST") else fields[-1:] if name in SOLUTIONS else []
            status = solved[0].decode("ascii") if solved else ""
            wanted = fields[2:] if name.startswith("BEST") else fields[:-1] if name in SOLUTIONS else fields
            values = [_number(name, k, field) for k, field in enumerate(wanted[: WIDTH[name]])]
            if len(values) < min(WIDTH[name], 5 if name.startswith("BEST") else 9):
                raise ValueError("short")
            rows[name].append([float(stamp[0]), float(stamp[1]), *values, *([status] if solved else [])])
        except (ValueError, IndexError):
            bad, wrong = bad + 1, wrong or line
    if bad and not any(rows.values()):
        raise DataRefused(f"{path}: {shown(wrong)}, expected whole sentences ({EXPECTED}); copy the file again")
    return rows, bad


def _number(name: str, k: int, field: bytes) -> float:
    if name.startswith("RAWIMU") and k == 2:
        int(field, 16)
        return 0.0  # the status, which is in hexadecimal
    try:
        return float(field)
    except ValueError:
        if name.startswith("BEST") and k >= 3:
            return float("nan")  # the name of a datum, of a station
        raise


def crc32(data: bytes) -> int:
    """The checksum of a sentence: CRC-32 reflected, without the usual inversions."""
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


def _scales(path: Path, assumed: Mapping[str, str]) -> tuple[float, float, str]:
    if "imu.model" in assumed:
        choose("imu.model", model := assumed["imu.model"], SCALES)
        return *SCALES[model], f"Counts are scaled as those of an {model}, because you assume so."
    if "gyro.scale" in assumed and "accelerometer.scale" in assumed:
        scales = number(assumed, "gyro.scale", 1.0), number(assumed, "accelerometer.scale", 1.0)
        return *scales, f"A count is {scales[0]:.6g} rad and {scales[1]:.6g} m/s, because you assume so."
    raise UsageError(
        f"{path}: its counts need the scale factors of the unit; --assume imu.model=NAME ({', '.join(SCALES)}), or "
        "--assume gyro.scale=RAD --assume accelerometer.scale=M/S"
    )


def _gps(path: Path, rows: Mapping[str, list[list]], week: float) -> Fixes | None:
    """Position and velocity of one stamp are one fix; a stamp with one of them lacks the other."""
    epochs: dict[float, dict[str, list[float]]] = {}
    for name in ("BESTPOSA", "BESTVELA"):
        for row in rows[name]:
            if row[-1] == "SOL_COMPUTED":
                epochs.setdefault(WEEK_S * (row[0] - week) + row[1], {})[name] = row[2:-1]
    if not epochs:
        return None
    times = sorted(epochs)
    position, velocity_n = np.full((len(times), 3), np.nan), np.full((len(times), 3), np.nan)
    for k, time in enumerate(times):
        if "BESTPOSA" in epochs[time]:
            latitude, longitude, height, undulation = epochs[time]["BESTPOSA"][:4]
            position[k] = DEG * latitude, DEG * longitude, height + undulation
        if "BESTVELA" in epochs[time]:
            speed, course, up = epochs[time]["BESTVELA"][2:5]
            velocity_n[k] = speed * np.cos(DEG * course), speed * np.sin(DEG * course), -up
    fixes = Fixes.of(np.array(times), position, velocity_n, groups_found(position, velocity_n, None))
    return checked_groups(fixes, f"{path}, BESTPOSA and BESTVELA")


def _solution(path: Path, rows: list[list], week: float) -> Fixes | None:
    if not rows:
        return None
    table = np.array([row[2:-1] for row in rows])
    time_s = WEEK_S * (table[:, 0] - week) + table[:, 1]
    keep = later(time_s)
    table = table[keep]
    good = np.array([row[-1].startswith("INS_SOLUTION_GOOD") for row in rows])[keep]
    valid = good & np.isfinite(table).all(axis=1)
    position, velocity_n = table[:, 2:5] * [DEG, DEG, 1.0], table[:, 5:8] * [1.0, 1.0, -1.0]
    fixes = Fixes.of(time_s[keep], position, velocity_n, valid, DEG * table[:, 8:11])
    return checked_groups(fixes, f"{path}, INSPVA") if fixes.valid.any() else None
