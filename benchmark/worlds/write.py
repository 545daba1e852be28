"""A recording on disk, in the form `ins-recording/1`; its tables come as dictionaries."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

FILES = {"recording.toml", "imu.parquet", "gps.parquet", "gps.csv", "reference.parquet", "chamber.parquet",
         "chamber.csv"}  # fmt: skip


def _value(value) -> str:
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list | tuple | np.ndarray):
        return "[" + ", ".join(_value(one) for one in value) + "]"
    return repr(float(value))


def toml(tables: dict) -> str:
    """Keys first, then tables; a table of an axis holds inline tables."""
    lines = [f"{key} = {_value(value)}" for key, value in tables.items() if not isinstance(value, dict)]
    for name, table in tables.items():
        if not isinstance(table, dict):
            continue
        inner = {key: value for key, value in table.items() if name == "accelerometer" and key in ("x", "y", "z")}
        lines += ["", f"[{name}]", *(f"{key} = {_value(one)}" for key, one in table.items() if key not in inner)]
        for axis, one in inner.items():
            lines += ["", f"[{name}.{axis}]", *(f"{key} = {_value(value)}" for key, value in one.items())]
    return "\n".join(lines) + "\n"


def write(folder: Path, head: dict, tables: dict[str, dict[str, np.ndarray]], csv: tuple[str, ...] = ()) -> None:
    """Write `head` as recording.toml and each table beside it."""
    folder.mkdir(parents=True, exist_ok=False)
    (folder / "recording.toml").write_text(toml(head))
    for name, columns in tables.items():
        table = pa.table({key: pa.array(np.ascontiguousarray(values)) for key, values in columns.items()})
        if name in csv:
            pa.csv.write_csv(table, folder / f"{name}.csv")
        else:
            pa.parquet.write_table(table, folder / f"{name}.parquet", compression="zstd", compression_level=1)
