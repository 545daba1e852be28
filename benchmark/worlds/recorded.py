"""A recording on disk as tables, read without the tool: cut, resampled, and written again.

The tables are those of `ins-recording/1` with gyro and accelerometer in increments: rad and m/s over the sample that
ends at `time_s`.
"""

from __future__ import annotations

import copy
import math
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.parquet

from benchmark.worlds.earth import from_euler
from benchmark.worlds.write import write

DEG = math.pi / 180.0
GYRO = ("gyro_x", "gyro_y", "gyro_z")
ACCEL = ("accel_x", "accel_y", "accel_z")
ANGLES = ("roll_deg", "pitch_deg", "heading_deg")
NAVIGATORS = ("gps", "reference")
TABLES = ("imu", *NAVIGATORS, "chamber")
HELD = ("temperature_c", "height_baro_m")  # at the end of a sample, not over it
FREE = ("attitude_deg", "attitude_sigma_deg")  # keys of a start that a part of a recording does not have


@dataclass
class Recorded:
    """What `recording.toml` says, and the columns of each table."""

    head: dict
    tables: dict[str, dict[str, np.ndarray]]

    @property
    def kind(self) -> str:
        return self.head["kind"]

    @property
    def time_s(self) -> np.ndarray:
        return self.tables["chamber" if self.kind == "chamber" else "imu"]["time_s"]

    @property
    def step_s(self) -> np.ndarray:
        """How long each sample lasts, (n,) s; the first as long as most."""
        step = np.diff(self.time_s)
        return np.concatenate(([float(np.median(step))], step))

    @property
    def start_s(self) -> float:
        return float(self.time_s[0] - self.step_s[0])

    @property
    def seconds(self) -> float:
        return float(self.time_s[-1] - self.start_s)

    def triad(self, names: tuple[str, ...]) -> np.ndarray:
        """Three columns of the IMU, (n, 3)."""
        return np.column_stack([self.tables["imu"][name] for name in names])

    def copy(self) -> Recorded:
        tables = {name: {key: values.copy() for key, values in one.items()} for name, one in self.tables.items()}
        return Recorded(copy.deepcopy(self.head), tables)

    def save(self, folder: Path) -> None:
        """Without the words of the importer, which tell of the file as it was."""
        write(folder, {key: value for key, value in self.head.items() if key != "notes"}, self.tables)


def read(folder: Path) -> Recorded:
    """A folder in the form."""
    head = tomllib.loads((folder / "recording.toml").read_text())
    tables = {}
    for name in TABLES:
        path = folder / f"{name}.parquet"
        if path.exists():
            table = pyarrow.parquet.read_table(path)
            tables[name] = {column: table[column].to_numpy(zero_copy_only=False) for column in table.column_names}
    return Recorded(head, tables)


def attitudes(table: dict[str, np.ndarray], at_s: np.ndarray) -> np.ndarray:
    """Rotations from body to north, east, down, (n, 3, 3), of a table with roll, pitch and heading at these times."""
    angles = [np.interp(at_s, table["time_s"], np.unwrap(table[name] * DEG)) for name in ANGLES]
    return np.stack([from_euler(*one) for one in zip(*angles, strict=True)])


def part(recorded: Recorded, begin: float, end: float) -> Recorded:
    """The stretch between two shares of the duration, as if it alone had been recorded."""
    out = recorded.copy()
    t0, whole = recorded.start_s, recorded.seconds
    low, high = t0 + begin * whole, t0 + end * whole
    for name, table in out.tables.items():
        rows = (table["time_s"] > low) & (table["time_s"] <= high)
        out.tables[name] = {key: values[rows] for key, values in table.items()}
    if begin > 0.0 and recorded.kind != "chamber":
        _begin_anew(recorded, out)
    return out


def _begin_anew(whole: Recorded, out: Recorded) -> None:
    """Where a part starts: as the navigators of the recording have it, at rest as before; attitude where one is."""
    start, at = out.head["start"], out.start_s
    start["time_s"] = at
    fixes = next((whole.tables[name] for name in ("gps", "reference") if "latitude_deg" in whole.tables.get(name, {})),
                 None)  # fmt: skip
    if fixes is not None:
        k = int(np.argmin(np.abs(fixes["time_s"] - at)))
        start |= {key: float(fixes[key][k]) for key in ("latitude_deg", "longitude_deg", "height_m")}
        start["velocity_ned_mps"] = [float(fixes[f"velocity_{axis}_mps"][k]) for axis in "ned"]
    reference = whole.tables.get("reference", {})
    if "roll_deg" in reference and "attitude_deg" in start:
        k = int(np.argmin(np.abs(reference["time_s"] - at)))
        start["attitude_deg"] = [float(reference[name][k]) for name in ANGLES]


def merged(recorded: Recorded, many: int) -> Recorded:
    """Every `many` samples of the IMU, or readings of a chamber, as one; fixes stay."""
    out = recorded.copy()
    if recorded.kind == "chamber":
        table = out.tables["chamber"]
        n = len(table["time_s"]) // many * many
        out.tables["chamber"] = {
            key: values[:n].reshape(-1, many)[:, 0]
            if values.dtype.kind in "iub"
            else values[:n].reshape(-1, many).mean(1)
            for key, values in table.items()
        }
        return out
    table = out.tables["imu"]
    n = len(table["time_s"]) // many * many
    blocks = {key: values[:n].reshape(-1, many) for key, values in table.items()}
    out.tables["imu"] = {
        key: one[:, -1] if key == "time_s" or key in HELD else one.max(1) if key == "filled" else one.sum(1)
        for key, one in blocks.items()
    }
    out.head["imu"]["rate_hz"] = recorded.head["imu"]["rate_hz"] / many
    return out
