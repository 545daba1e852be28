"""From a recording to a folder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ins_eval.errors import UsageError
from ins_eval.files import write_together, write_whole
from ins_eval.recording import ChamberReadings, Fixes, Imu, Recording
from ins_eval.recording.belief import Belief
from ins_eval.recording.form.columns import CSV, PARQUET, parquet_bytes
from ins_eval.recording.form.description import CHAMBER, FILE, FORMAT, Description, ImuTable, StartTable, table_of
from ins_eval.recording.form.names import (
    ACCELEROMETER,
    ATTITUDE,
    BARO,
    FILLED,
    GYRO,
    POSITION,
    READINGS,
    SIGMAS,
    TEMPERATURE,
    TEMPERATURES,
    UNIT,
    VALID,
    VELOCITY,
)
from ins_eval.recording.form.toml import dumps
from ins_eval.tables import parse
from ins_eval.units import to_degrees_exactly

TABLES = ("imu", "gps", "reference", "solution", "chamber", "truth")
HEAD = f"A recording in the form {FORMAT}. The unit of a value is in its name."
BELIEF_HEAD = """What is believed of an instrument: the tables of recording.toml that are not data.
The unit of a value is in its name; that of an effect stands beside it."""
Table = dict[str, np.ndarray]


def write(recording: Recording, folder: str | Path, truth: Fixes | None = None) -> Path:
    """Write a recording, and the `truth` beside it where it is known; returns the folder.

    `form.read` gives back every array to the last bit. A radian value that no number of degrees can hold comes back
    as the nearest that one can (`units.through_degrees`). The same recording gives the same bytes.

    All files are written aside and then put in place, ``recording.toml`` last: an earlier recording in the folder is
    replaced with all its tables, and stays what it was where one cannot be written.
    Raises UsageError for a folder with tables of another origin, which would mix with these, and StorageError.
    """
    of_fixes = {"gps": recording.gps, "reference": recording.reference, "solution": recording.solution, "truth": truth}
    tables = {} if recording.imu is None else {"imu": _imu(recording.imu)}
    tables |= {name: _fixes(fixes) for name, fixes in of_fixes.items() if fixes is not None}
    description = Description(
        format=FORMAT,
        kind=recording.kind,
        name=recording.name,
        notes=recording.notes,
        imu=None if recording.imu is None else _imu_table(recording.imu, recording.unit),
        start=_start(recording) if np.isfinite(recording.start.latitude_rad) else None,
    )
    unused = tuple(name for name in ("gps", "reference", "solution") if name not in tables)
    return _write_folder(Path(folder), table_of(description, recording.belief, unused), tables)


def write_chamber(
    readings: ChamberReadings | Sequence[ChamberReadings],
    folder: str | Path,
    name: str = "",
    belief: Belief | None = None,
    notes: tuple[str, ...] = (),
) -> Path:
    """Write the readings of an accelerometer as `write` does a recording, or of several of them in one table.

    Of the belief only what is of the accelerometer's own axis is kept; for several the axis is not said. Several
    stand one after another, each with a ``unit_id``: their times and runs go on.
    """
    several = [readings] if isinstance(readings, ChamberReadings) else _one_after_another(readings)
    tables = [{"time_s": one.time_s, **{c: getattr(one, c) for c in READINGS}, **_named(one)} for one in several]
    columns = {column: np.concatenate([table[column] for table in tables]) for column in tables[0]}
    alone = several[0] if len(several) == 1 else replace(several[0], unit_id="", axis="")
    description = Description(format=FORMAT, kind=CHAMBER, name=name or alone.unit_id or None, notes=notes)
    table = table_of(
        description, belief or Belief(), unused=("gps", "reference", "solution", "height", "earth", "gyro")
    )
    of_axis = table["accelerometer"].get(alone.axis, {})
    table["accelerometer"] = {key: value for key, value in table["accelerometer"].items() if key not in tuple("xyz")}
    if alone.axis:
        table["accelerometer"][alone.axis] = of_axis
    return _write_folder(Path(folder), table, {CHAMBER: columns})


def write_belief(path: str | Path, belief: Belief, folder: str | Path = ".") -> Path:
    """Write a belief as a file that ``--belief`` takes; returns the path.

    `folder` is that to which its compensation files are relative: the file names them by their whole path, so that
    it may stand anywhere.
    """
    table = belief.model_dump(exclude_none=True)
    for axis in "xyz":
        of_axis = table["accelerometer"].get(axis, {})
        if "compensation" in of_axis:
            of_axis["compensation"] = str((Path(folder) / of_axis["compensation"]).resolve())
    return write_whole(
        Path(path), dumps({key: value for key, value in table.items() if value != ()}, BELIEF_HEAD).encode()
    )


def _named(readings: ChamberReadings) -> Table:
    """The columns of a chamber table that need not be there."""
    unit = {UNIT: np.full(readings.time_s.size, readings.unit_id, dtype=object)} if readings.unit_id else {}
    return unit | {name: values for name, values in readings.further.items() if name not in ("time_s", *READINGS, UNIT)}


def _one_after_another(several: Sequence[ChamberReadings]) -> list[ChamberReadings]:
    """Accelerometers that were measured side by side, as if one had followed the other."""
    columns = {tuple(_named(one)) for one in several}
    if len({one.unit_id for one in several}) < len(several) or len(columns) > 1:
        raise UsageError(
            f"chamber: {len(several)} accelerometers for one table need a unit_id each and the same further columns; "
            "write a recording of each"
        )
    placed, time_s, run = [], 0.0, 0
    for one in several:
        step_s = float(np.median(np.diff(one.time_s)))
        placed.append(replace(one, time_s=one.time_s - one.time_s[0] + time_s, run=one.run - one.run.min() + run))
        time_s, run = float(placed[-1].time_s[-1]) + step_s, int(placed[-1].run.max()) + 1
    return placed


def _write_folder(folder: Path, description: dict[str, Any], tables: dict[str, Table]) -> Path:
    """Write all files in place of an earlier recording; what is not of one is left alone."""
    theirs = [f"{name}{CSV}" for name in TABLES]
    if not (folder / FILE).exists():
        theirs += [f"{name}{PARQUET}" for name in TABLES if name not in tables]
    for file in theirs:
        if (folder / file).exists():
            raise UsageError(
                f"{folder}: holds {file}, which is not ours to replace, expected a new folder or that of an earlier "
                "result; choose another folder or move the file away"
            )
    for name, table in tables.items():
        _of_one_length(f"{folder}, {name}", table)
    contents = {folder / f"{name}{PARQUET}": parquet_bytes(table) for name, table in tables.items()}
    contents[folder / FILE] = dumps(description, HEAD).encode()
    gone = [folder / FILE, *(folder / f"{name}{PARQUET}" for name in TABLES if name not in tables)]
    write_together(contents, gone)
    return folder


def _start(recording: Recording) -> StartTable:
    start = recording.start
    table = {
        "time_s": start.time_s,
        "latitude_deg": float(to_degrees_exactly(start.latitude_rad)),
        "longitude_deg": float(to_degrees_exactly(start.longitude_rad)),
        "height_m": start.height_m,
        "velocity_ned_mps": start.velocity_n,
        "attitude_deg": _degrees(start.attitude_rad),
        "attitude_sigma_deg": _degrees(start.attitude_sigma_rad),
        "position_sigma_m": start.position_sigma_m,
        "velocity_sigma_mps": start.velocity_sigma_mps,
        "still_until_s": start.still_until_s,
    }
    return parse(StartTable, table, f"recording '{recording.name}', start")


def _degrees(rad: tuple[float, float, float] | None) -> tuple[float, ...] | None:
    return None if rad is None else tuple(to_degrees_exactly(rad).tolist())


def _imu_table(imu: Imu, unit: str | None) -> ImuTable:
    rate_hz = float(f"{1.0 / float(np.median(np.diff(imu.time_s))):.9g}")
    return ImuTable(rate_hz=rate_hz, gyro="increment", accelerometer=imu.accelerometer_form, unit=unit)


def _imu(imu: Imu) -> Table:
    columns = {"time_s": imu.time_s}
    columns |= dict(zip((*GYRO, *ACCELEROMETER), (*imu.gyro.T, *imu.accelerometer.T), strict=True))
    if imu.temperature_c is not None and imu.temperature_c.ndim == 2:
        columns |= dict(zip(TEMPERATURES, imu.temperature_c.T, strict=True))
    elif imu.temperature_c is not None:
        columns[TEMPERATURE] = imu.temperature_c
    if imu.height_baro_m is not None:
        columns[BARO] = imu.height_baro_m
    if imu.filled is not None and imu.filled.any():
        columns[FILLED] = imu.filled.astype(np.int64)
    return columns | {name: values for name, values in imu.further.items() if name not in columns}


def _fixes(fixes: Fixes) -> Table:
    """Columns of a table of fixes; those that hold nothing are left out, unless all do."""
    latitude, longitude = to_degrees_exactly(fixes.latitude_rad), to_degrees_exactly(fixes.longitude_rad)
    motion = dict(zip((*POSITION, *VELOCITY), (latitude, longitude, fixes.height_m, *fixes.velocity_n.T), strict=True))
    if fixes.attitude_rad is not None:
        motion |= dict(zip(ATTITUDE, to_degrees_exactly(fixes.attitude_rad).T, strict=True))
    columns = {"time_s": fixes.time_s}
    delivered = {name: values for name, values in motion.items() if not np.isnan(values).all()}
    columns |= delivered or motion
    columns[VALID] = np.asarray(fixes.valid).astype(np.int8)
    columns |= {name: getattr(fixes, name) for name in SIGMAS if getattr(fixes, name) is not None}
    return columns


def _of_one_length(where: str, table: Table) -> None:
    """Refuse a table in which a column has other rows than `time_s`."""
    rows = len(table["time_s"])
    for name, values in table.items():
        if len(values) != rows:
            raise UsageError(
                f"{where}: column {name} has {len(values)} rows, expected {rows}, as many as time_s; give every column "
                "of a table the same rows"
            )
