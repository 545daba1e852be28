"""Reader of an ArduPilot log as text tables, packed in one zip archive: IMU.txt, GPS.txt and ATT.txt.

Rows of numbers without a header: IMU (8 columns) two stamps, gyro, accelerometer; GPS (14) stamp, status, 4 unused,
latitude, longitude, 2 heights, speed, course, velocity down, unused; ATT (7) two stamps, roll, pitch, yaw, 2 unused.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ins_eval.boundary import archive
from ins_eval.errors import DataRefused
from ins_eval.readers.apm_log import KEYS, Log, recording
from ins_eval.readers.files import text_numbers
from ins_eval.recording import Recording

__all__ = ["KEYS", "read"]

EXPECTED = "a zip archive with IMU.txt, GPS.txt and ATT.txt"
COLUMNS = {
    "IMU": (8, "stamp [ms] twice, gyro x y z [rad/s], accelerometer x y z [m/s^2]", [1, 2, 3, 4, 5, 6, 7]),
    "GPS": (
        14,
        "stamp [ms], status, ..., latitude, longitude, heights, speed, course, down",
        [0, 1, 6, 7, 9, 10, 11, 12],
    ),
    "ATT": (7, "stamp [ms] twice, roll, pitch, yaw [deg], ...", [1, 2, 3, 4]),
}


def read(path: Path, assumed: Mapping[str, str]) -> Recording:
    """The whole log as one flight."""
    files = archive(path, EXPECTED)
    tables = {}
    for table, (width, meaning, wanted) in COLUMNS.items():
        if f"{table}.txt" not in files:
            raise DataRefused(f"{path}: holds no {table}.txt, expected {EXPECTED}; pack all tables of the log")
        tables[table] = text_numbers(f"{path}, {table}.txt", files[f"{table}.txt"], width, meaning)[:, wanted]
    log = Log(tables["IMU"], tables["GPS"], tables["ATT"], "above the take-off point")
    return recording(log, path, "in text tables", assumed)
