"""Reader of an ArduPilot log converted to MATLAB: every table X is beside its column names X_label.

The tables used are IMU, GPS and ATT (see `apm_log`); their columns are found by name. GPS stamps are the column T, the
autopilot's time of reception, because TimeMS is the receiver's time of week.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ins_eval.errors import DataRefused, did_you_mean
from ins_eval.readers.apm_log import KEYS, Log, recording
from ins_eval.readers.files import numbers
from ins_eval.readers.matlab5 import variables
from ins_eval.recording import Recording

__all__ = ["KEYS", "read"]

EXPECTED = "an ArduPilot log with the tables IMU, GPS, ATT and their labels"
COLUMNS = {
    "IMU": ("TimeMS", "GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"),
    "GPS": ("T", "Status", "Lat", "Lng", "Alt", "Spd", "GCrs", "VZ"),
    "ATT": ("TimeMS", "Roll", "Pitch", "Yaw"),
}


def read(path: Path, assumed: Mapping[str, str]) -> Recording:
    """The whole log as one flight."""
    found = variables(path, [name + end for name in COLUMNS for end in ("", "_label")], EXPECTED)
    tables = {name: _columns(path, found, name) for name in COLUMNS}
    log = Log(tables["IMU"], tables["GPS"], tables["ATT"], "above mean sea level")
    return recording(log, path, "in MATLAB form", assumed)


def _columns(path: Path, found: dict[str, np.ndarray], table: str) -> np.ndarray:
    """The wanted columns of one table, (n, wanted)."""
    where = f"{path}, {table}"
    for name in (table, f"{table}_label"):
        if name not in found:
            raise DataRefused(
                f"{path}: has no variable {name}, expected {EXPECTED}; check that this is the format named"
            )
    labels = [str(label) for label in found[f"{table}_label"].ravel()]
    values = numbers(where, found[table], len(labels), ", ".join(labels))
    missing = [name for name in COLUMNS[table] if name not in labels]
    if missing:
        raise DataRefused(
            f"{where}: has no column {missing[0]}{did_you_mean(missing[0], labels)}; export the log with all columns"
        )
    return values[:, [labels.index(name) for name in COLUMNS[table]]]
