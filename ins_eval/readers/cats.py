"""Logs of a CATS rocket flight computer: read, looked at, and refused with the reason.

    imu.csv       ts [s], id, Ax Ay Az [m/s^2], Gx Gy Gz [deg/s]      ts = 0 at lift-off
    baro.csv      ts, id, T [degC], P [Pa]                            beside it
    gnssInfo.csv  ts, latitude, longitude [deg], satellites           beside it

The receiver's log has no height and no velocity and loses its lock in the boost, and the IMU's begins a moment before
lift-off: there is no attitude to start from and nothing to hold a navigation against.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import NoReturn

import numpy as np

from ins_eval.boundary import content
from ins_eval.errors import DataRefused
from ins_eval.readers.files import shown

KEYS = ()
EXPECTED = "the file imu.csv with the columns ts, id, Ax, Ay, Az, Gx, Gy, Gz"
COLUMNS = ("ts", "Ax", "Ay", "Az", "Gx", "Gy", "Gz")


def read(path: Path, assumed: Mapping[str, str]) -> NoReturn:
    """Always raises `DataRefused`: for a log that cannot be right, or because it cannot be used."""
    table = _table(path)
    time_s = table[:, 0]
    before = np.linalg.norm(table[time_s < 0.0][:, 1:4], axis=1)
    rest = f"specific force {before.mean():.3g} +- {before.std():.2g} m/s^2" if before.size else "none"
    rate_hz = (len(time_s) - 1) / (time_s[-1] - time_s[0]) if time_s[-1] > time_s[0] else np.nan
    raise DataRefused(
        f"{path}: has {len(time_s)} samples at {rate_hz:.4g} Hz, only {-min(time_s[0], 0.0):.3g} s of them before "
        f"lift-off ({rest}), and a receiver's log without height and velocity, expected a minute at rest and the "
        "receiver's full solution, from which to find the start and the errors; record both"
    )


def _table(path: Path) -> np.ndarray:
    """The columns of imu.csv, (n, 7)."""
    text = content(path, EXPECTED).decode("utf-8", errors="replace")
    rows = csv.reader(io.StringIO(text, newline=""))
    try:
        header = [name.strip() for name in next(rows)]
        missing = [name for name in COLUMNS if name not in header]
        if missing:
            raise DataRefused(f"{path}: has no column {missing[0]}, expected {EXPECTED}; name the IMU's file")
        wanted = [header.index(name) for name in COLUMNS]
        values = [
            _numbers(path, rows.line_num, [row[k] if k < len(row) else "" for k in wanted]) for row in rows if row
        ]
    except csv.Error as fault:
        raise DataRefused(f"{path}: is no CSV ({fault}), expected {EXPECTED}; export it again") from None
    if len(values) < 2:
        raise DataRefused(f"{path}: holds {len(values)} samples, expected at least two; copy the file again")
    return np.array(values)


def _numbers(path: Path, line: int, fields: list[str]) -> list[float]:
    for name, field in zip(COLUMNS, fields, strict=True):
        try:
            sound = np.isfinite(float(field))
        except ValueError:
            sound = False
        if not sound:
            raise DataRefused(
                f"{path}, line {line}, column {name}: {shown(field)}, expected a number; correct that line"
            )
    return [float(field) for field in fields]
