"""Reader of any table in CSV; a small mapping file states what its columns are.

The mapping lies beside the table (DRIVE.csv, DRIVE.toml) or is named with ``--assume mapping=PATH``. Without one the
refusal prints a mapping made for the columns found, to be completed and saved (`csv_template`).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import numpy as np

from ins_eval.errors import UsageError
from ins_eval.recording import Fixes, Recording, Start
from ins_eval.recording.belief import Belief, Vector
from ins_eval.recording.readers import csv_template
from ins_eval.recording.readers.delimited import CUT_NOTE, Column, DelimitedTable
from ins_eval.recording.readers.epochs import checked
from ins_eval.recording.readers.layout import Layout, choose
from ins_eval.recording.readers.options import believed_time_offset
from ins_eval.recording.readers.sampling import Readings, sampled
from ins_eval.tables import Strict, parse, read_toml
from ins_eval.units import DEG

KEYS = ("mapping", "kind", *Layout.KEYS, "time.unit", "gps.time_offset_s", "reference.time_offset_s")
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
ANGLE_UNITS = {"deg": DEG, "rad": 1.0, "1e-7 deg": 1e-7 * DEG}
LONG_AGO_S = 1e7  # stamps beyond it are counted from a whole second before the first, so as to lose no digits


class TimeColumn(Strict):
    column: Column
    unit: Literal["s", "ms", "us", "ns"]


class Triad(Strict):
    columns: tuple[Column, Column, Column]
    unit: str


class One(Strict):
    column: Column


class Velocity(Strict):
    """Three columns in m/s; in the third form course is in degrees from north."""

    columns: tuple[Column, Column, Column]
    axes: Literal["NED", "ENU", "speed course down"]


class GivenStart(Strict):
    latitude_deg: float
    longitude_deg: float
    height_m: float
    velocity_ned_mps: Vector = (0.0, 0.0, 0.0)
    attitude_deg: Vector | None = None
    attitude_sigma_deg: Vector | None = None
    position_sigma_m: float = 0.0
    velocity_sigma_mps: float = 0.0


class Epochs(Strict):
    """GPS or reference: latitude, longitude in `unit` and height in m; roll, pitch, heading in `unit`."""

    file: str | None = None  # beside the mapping; absent: the table itself
    time: TimeColumn
    position: Triad
    velocity: Velocity
    attitude: Triad | None = None
    valid: One | None = None


class MappingFile(Strict):
    """What the columns are."""

    kind: Literal["flight", "drive", "oven", "static"]
    axes: str
    name: str | None = None
    header: bool = True  # false: columns are numbered from 1
    time: TimeColumn
    gyro: Triad
    accelerometer: Triad
    temperature: One | None = None  # degC
    height_baro: One | None = None  # m
    further: tuple[Column, ...] = ()
    start: GivenStart | None = None
    gps: Epochs | None = None
    reference: Epochs | None = None
    belief: Belief = Belief()


def read(path: Path, assumed: Mapping[str, str]) -> Recording:
    """A recording from FILE.csv and its mapping.

    Raises `UsageError` for a mapping that is missing (with one to complete) or does not fit the table, `DataRefused`
    for a table that cannot be right.
    """
    file, mapping = _mapping(path, assumed)
    table = DelimitedTable(path, mapping.header)
    choose("time.unit", time_unit := assumed.get("time.unit", mapping.time.unit), TIME_UNITS)
    layout = Layout(mapping.gyro.unit, mapping.accelerometer.unit, mapping.axes).overridden(assumed)
    scalars = {"temperature_c": mapping.temperature, "height_baro_m": mapping.height_baro}
    further = {str(column): table.numbers(column, f"{file}, further") for column in mapping.further}
    time_s = TIME_UNITS[time_unit] * table.numbers(mapping.time.column, f"{file}, time")
    origin_s, origin_note = _origin(time_s)
    samples = sampled(
        Readings(
            time_s - origin_s,
            table.vectors(mapping.gyro.columns, f"{file}, gyro"),
            table.vectors(mapping.accelerometer.columns, f"{file}, accelerometer"),
            {n: table.numbers(one.column, f"{file}, {n}") for n, one in scalars.items() if one is not None} | further,
            table.first_row,
        ),
        layout,
        str(path),
    )
    others = {
        name: _epochs(table, described, file, name, origin_s, assumed.get("position.unit"))
        for name, described in (("gps", mapping.gps), ("reference", mapping.reference))
        if described is not None
    }
    belief, offset_notes = _believed(mapping.belief, others, assumed)
    return Recording(
        name=mapping.name or path.stem,
        kind=mapping.kind,
        start=_start(file, mapping, belief, samples.start_s, others),
        imu=samples.imu,
        belief=belief,
        notes=(
            f"The file {path.name} is a table of {len(table.data)} rows, read as {file.name} tells.",
            *([CUT_NOTE.format(path.name)] if table.cut else []),
            f"The column '{mapping.time.column}' is taken as time in {time_unit}, because "
            f"{'you assume so' if 'time.unit' in assumed else 'the mapping says so'}.",
            *origin_note,
            *layout.notes(assumed, "the mapping says so"),
            *samples.notes,
            *offset_notes,
        ),
        **others,
    )


def _mapping(path: Path, assumed: Mapping[str, str]) -> tuple[Path, MappingFile]:
    """The mapping file and what it says, with the kind that is assumed."""
    file = Path(assumed["mapping"]) if "mapping" in assumed else path.with_suffix(".toml")
    if not file.is_file():
        table = DelimitedTable(path)
        raise UsageError(
            f"{file}: there is no such mapping file, expected one that says what the columns of {path.name} are; save "
            f"the following as {path.with_suffix('.toml').name}, complete it and import again\n\n"
            f"{csv_template.template(table.data)}"
        )
    described = read_toml(file)
    if "kind" in assumed:
        described["kind"] = assumed["kind"]
    return file, parse(MappingFile, described, str(file))


def _origin(time_s: np.ndarray) -> tuple[float, list[str]]:
    first_s = float(time_s[0])
    if not np.isfinite(first_s) or abs(first_s) < LONG_AGO_S:
        return 0.0, []
    origin_s = float(np.floor(first_s))
    return origin_s, [f"All times are counted from {origin_s:.0f} s of the file's clock."]


def _epochs(
    table: DelimitedTable, described: Epochs, file: Path, name: str, origin_s: float, position_unit: str | None
) -> Fixes:
    """The table of another navigator; rows without a position are an outage."""
    where = f"{file}, {name}"
    if described.file is not None:
        table = DelimitedTable(file.parent / described.file)
    choose(f"{where}, position.unit", unit := position_unit or described.position.unit, ANGLE_UNITS)
    position = table.vectors(described.position.columns, where)
    position[:, :2] *= ANGLE_UNITS[unit]
    velocity_n = _velocity(table.vectors(described.velocity.columns, where), described.velocity.axes)
    time_s = TIME_UNITS[described.time.unit] * table.numbers(described.time.column, where) - origin_s
    valid = np.isfinite(position).all(axis=1) & np.isfinite(velocity_n).all(axis=1)
    if described.valid is not None:
        valid &= np.nan_to_num(table.numbers(described.valid.column, where)) != 0.0
    attitude_rad = None
    if described.attitude is not None:
        choose(f"{where}, attitude.unit", described.attitude.unit, ANGLE_UNITS)
        attitude_rad = ANGLE_UNITS[described.attitude.unit] * table.vectors(described.attitude.columns, where)
        valid &= np.isfinite(attitude_rad).all(axis=1)
    # in a table shared with the IMU most rows have no fix
    keep = (
        np.isfinite(time_s) if described.file is not None else np.isfinite(time_s) & np.isfinite(position).all(axis=1)
    )
    return checked(
        Fixes(
            time_s=time_s[keep],
            latitude_rad=position[keep, 0],
            longitude_rad=position[keep, 1],
            height_m=position[keep, 2],
            velocity_n=velocity_n[keep],
            valid=valid[keep],
            attitude_rad=None if attitude_rad is None else attitude_rad[keep],
        ),
        f"{table.path}, {name}",
    )


def _velocity(columns: np.ndarray, axes: str) -> np.ndarray:
    if axes == "NED":
        return columns
    if axes == "ENU":
        return columns[:, [1, 0, 2]] * np.array([1.0, 1.0, -1.0])
    speed, course, down = columns.T
    return np.column_stack([speed * np.cos(course * DEG), speed * np.sin(course * DEG), down])


def _believed(belief: Belief, others: Mapping[str, Fixes], assumed: Mapping[str, str]) -> tuple[Belief, list[str]]:
    """The belief of the mapping with the clock offsets that are assumed, and a sentence for each."""
    notes = []
    for name in others:
        described = getattr(belief, name)
        if f"{name}.time_offset_s" in assumed or "time_offset_s" not in described.model_fields_set:
            offset_s, note = believed_time_offset(name, assumed, "the mapping says nothing")
            belief = belief.model_copy(update={name: described.model_copy(update={"time_offset_s": offset_s})})
            notes.append(note)
    return belief, notes


def _start(file: Path, mapping: MappingFile, belief: Belief, start_s: float, others: Mapping[str, Fixes]) -> Start:
    """The start of the mapping, or else the valid fix nearest to the first sample."""
    place = mapping.start
    if place is not None:
        return Start(
            time_s=start_s,
            latitude_rad=place.latitude_deg * DEG,
            longitude_rad=place.longitude_deg * DEG,
            height_m=place.height_m,
            velocity_n=place.velocity_ned_mps,
            attitude_rad=_radians(place.attitude_deg),
            attitude_sigma_rad=_radians(place.attitude_sigma_deg),
            position_sigma_m=place.position_sigma_m,
            velocity_sigma_mps=place.velocity_sigma_mps,
        )
    if not others:
        raise UsageError(
            f"{file}: has neither [start] nor [gps] nor [reference], expected where the recording begins; add [start] "
            "with latitude_deg, longitude_deg and height_m"
        )
    name = "reference" if "reference" in others else "gps"
    fixes, described = others[name], getattr(belief, name)
    valid = np.flatnonzero(fixes.valid)
    k = int(valid[np.argmin(np.abs(fixes.time_s[valid] - described.time_offset_s - start_s))])
    return Start(
        time_s=start_s,
        latitude_rad=float(fixes.latitude_rad[k]),
        longitude_rad=float(fixes.longitude_rad[k]),
        height_m=float(fixes.height_m[k]),
        velocity_n=tuple(fixes.velocity_n[k].tolist()),
        attitude_rad=None if fixes.attitude_rad is None else tuple(fixes.attitude_rad[k].tolist()),
        position_sigma_m=described.position_sigma_m,
        velocity_sigma_mps=described.velocity_sigma_mps,
    )


def _radians(degrees: Vector | None) -> Vector | None:
    return None if degrees is None else tuple(DEG * value for value in degrees)
