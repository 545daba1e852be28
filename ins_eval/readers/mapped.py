"""A recording from any source of named columns and the mapping file that states what they are.

The mapping lies beside the source (DRIVE.csv, DRIVE.toml) or is named with ``--assume mapping=PATH``. Without one the
refusal prints a mapping made for the columns found, to be completed and saved (`mapping_template`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ins_eval.errors import UsageError
from ins_eval.readers import assembly, fix_columns, mapping_template, receivers
from ins_eval.readers.columns import Columns, same_length, vectors
from ins_eval.readers.fix_columns import stamps
from ins_eval.readers.layout import ACCELEROMETER_UNITS, GYRO_UNITS, Layout, choose
from ins_eval.readers.mapping import Epochs, MappingFile
from ins_eval.readers.sampling import Readings
from ins_eval.recording import Fixes, Recording
from ins_eval.tables import parse, read_toml
from ins_eval.units import SPEED_UNITS

KEYS = ("mapping", "time.unit", "gps.file", "reference.file", *assembly.KEYS, *fix_columns.KEYS)
LONG_AGO_S = 1e7  # stamps beyond it are counted from a whole second before the first, so as to lose no digits
OTHERS = ("gps", "reference", "solution")

Opened = Callable[[Path, bool], Columns]


def read(path: Path, assumed: Mapping[str, str], opened: Opened) -> Recording:
    """A recording from a file, which `opened` turns into columns, and its mapping.

    Raises `UsageError` for a mapping that is missing (with one to complete) or does not fit the columns, `DataRefused`
    for columns that cannot be right.
    """
    return of_mapping(path, *_mapping(path, assumed, opened), assumed, opened)


def of_mapping(path: Path, file: Path, mapping: MappingFile, assumed: Mapping[str, str], opened: Opened) -> Recording:
    """As `read`, with the mapping that `file` holds."""
    source = opened(path, mapping.header)
    described_time = mapping.time or mapping.solution.time
    unit = assumed.get("time.unit", described_time.unit)
    beside = source
    if described_time.file is not None:
        beside = opened(file.parent / described_time.file, isinstance(described_time.column, str))
    time_s = stamps(beside, described_time, f"{file}, time", unit)
    origin_s, origin_note = _origin(time_s)
    if mapping.gyro is not None:
        _check_units(source, mapping, file, assumed)
    readings = None if mapping.gyro is None else _readings(source, mapping, file, time_s - origin_s)
    others, other_notes = {}, []
    for name in OTHERS:
        described = getattr(mapping, name)
        if described is not None:
            others[name], found = _others(source, described, (file, name), origin_s, assumed, opened)
            other_notes += found
    if "reference" not in others and mapping.gps is not None and _only_attitude(mapping.gps):
        others["reference"] = others.pop("gps")
        other_notes.append("The table gps holds an attitude alone, which no receiver gives: it is the reference.")
    if mapping.gps is None and "gps.file" in assumed:
        span_s = receivers.span(time_s - origin_s)
        others["gps"], found = receivers.read(Path(assumed["gps.file"]), span_s, origin_s)
        other_notes += found
    return assembly.recording(
        assembly.Tables(
            name=mapping.name or path.stem,
            kind=mapping.kind,
            readings=readings,
            layout=None if readings is None else Layout(mapping.gyro.unit, mapping.accelerometer.unit, mapping.axes),
            start=mapping.start,
            belief=mapping.belief,
            notes=(
                f"The file {path.name} is a table of {len(time_s)} rows, read as {file.name} says.",
                *source.notes,
                *(() if beside is source else beside.notes),
                f"The column '{described_time.column}' is taken as time in {unit}, because "
                f"{'you assume so' if 'time.unit' in assumed else 'the mapping says so'}.",
                *_week_note(mapping),
                *origin_note,
                *other_notes,
                *_fix_notes(mapping, assumed),
            ),
            **others,
        ),
        str(file) if mapping.start is None and not others else str(path),
        assumed,
        "the mapping says so",
    )


def _mapping(path: Path, assumed: Mapping[str, str], opened: Opened) -> tuple[Path, MappingFile]:
    """The mapping file and what it says, with the kind that is assumed."""
    file = Path(assumed["mapping"]) if "mapping" in assumed else path.with_suffix(".toml")
    if not file.is_file() or not file.stat().st_size:  # or the shell has just made it
        raise UsageError(
            f"{file}: there is no such mapping file, or it is empty, expected one that says what the columns of "
            f"{path.name} are; save the following as {path.with_suffix('.toml').name}, complete it and import again",
            mapping_template.template(opened(path, True)),
        )
    described = read_toml(file)
    if "kind" in assumed:
        described["kind"] = assumed["kind"]
    return file, parse(MappingFile, described, str(file))


def _check_units(source: Columns, mapping: MappingFile, file: Path, assumed: Mapping[str, str]) -> None:
    """Refuse another unit of a sensor than the source states beside its columns, unless it is assumed."""
    for sensor, units in (("gyro", GYRO_UNITS), ("accelerometer", ACCELEROMETER_UNITS)):
        taken = getattr(mapping, sensor)
        for column in taken.columns:
            stated = source.units.get(str(column))
            if stated in units and stated != taken.unit and f"{sensor}.unit" not in assumed:
                raise UsageError(
                    f"{file}: {sensor}.unit is {taken.unit}, but {source.path.name} states {stated} with the name of "
                    f"column '{column}', expected the same; correct one of them, or --assume {sensor}.unit={taken.unit}"
                )


def _readings(source: Columns, mapping: MappingFile, file: Path, time_s: np.ndarray) -> Readings:
    scalars = {"temperature_c": mapping.temperature, "height_baro_m": mapping.height_baro}
    columns = {n: source.numbers(one.column, f"{file}, {n}") for n, one in scalars.items() if one is not None}
    columns |= {str(column): source.numbers(column, f"{file}, further") for column in mapping.further}
    if mapping.speed is not None:
        choose(f"{file}, speed.unit", mapping.speed.unit, SPEED_UNITS)
        speed = source.numbers(mapping.speed.column, f"{file}, speed")
        columns["speed_mps"] = SPEED_UNITS[mapping.speed.unit] * speed
    gyro = vectors(source, mapping.gyro.columns, f"{file}, gyro")
    accelerometer = vectors(source, mapping.accelerometer.columns, f"{file}, accelerometer")
    same_length(source.path, "the imu", {"time": time_s, "gyro": gyro, "accelerometer": accelerometer, **columns})
    return Readings(time_s, gyro, accelerometer, columns, source.first_row)


def _origin(time_s: np.ndarray) -> tuple[float, list[str]]:
    known_s = time_s[np.isfinite(time_s)]
    if not known_s.size or abs(first_s := float(known_s[0])) < LONG_AGO_S:
        return 0.0, []
    origin_s = float(np.floor(first_s))
    return origin_s, [f"All times are counted from {origin_s:.0f} s of the file's clock."]


def _others(
    source: Columns,
    described: Epochs,
    place: tuple[Path, str],
    origin_s: float,
    assumed: Mapping[str, str],
    opened: Opened,
) -> tuple[Fixes, list[str]]:
    """The table of another navigator and notes on it; of a file of its own where the mapping or the user names one."""
    file, name = place
    named = assumed.get(f"{name}.file")
    own = Path(named) if named is not None else None if described.file is None else file.parent / described.file
    if own is None:
        return fix_columns.fixes(source, described, f"{file}, {name}", origin_s, assumed, keep_empty=False)
    source = opened(own, True)
    fixes, notes = fix_columns.fixes(source, described, f"{file}, {name}", origin_s, assumed, keep_empty=True)
    return fixes, [*source.notes, *notes]


def _only_attitude(described: Epochs) -> bool:
    return described.position is None and described.velocity is None


def _week_note(mapping: MappingFile) -> list[str]:
    weeks = [one.time for one in (mapping, *_described(mapping)) if one.time and one.time.week is not None]
    return [
        f"Second and week of GPS are taken to UTC with {leap_s:g} leap seconds; leap_s beside week states another."
        for leap_s in sorted({time.leap_s for time in weeks})
    ]


def _described(mapping: MappingFile) -> list[Any]:
    return [one for one in (getattr(mapping, name) for name in OTHERS) if one is not None]


def _fix_notes(mapping: MappingFile, assumed: Mapping[str, str]) -> list[str]:
    """What the groups of the other navigators are taken for, where it is not the plainest."""
    notes = []
    for name in OTHERS:
        described: Epochs | None = getattr(mapping, name)
        if described is None:
            continue
        groups = [group for group in ("position", "velocity", "attitude") if getattr(described, group) is not None]
        parts = []
        if described.position is not None:
            unit = assumed.get("position.unit", described.position.unit)
            parts.append(f"position {described.position.frame}" + (f" in {unit}" if unit else ""))
            if (height_unit := assumed.get("height.unit", described.position.height_unit)) != "m":
                parts.append(f"height in {height_unit}")
        if described.velocity is not None:
            axes = assumed.get("velocity.axes", described.velocity.axes)
            parts.append(f"velocity {axes} in {assumed.get('velocity.unit', described.velocity.unit)}")
        if described.attitude is not None:
            parts.append(f"attitude as {described.attitude.form}")
        missing = [group for group in ("position", "velocity") if group not in groups]
        without = f", without {' and '.join(missing)}" if missing else ""
        notes.append(f"The table {name} is taken as {', '.join(parts)}{without}, because the mapping says so.")
    for key in fix_columns.KEYS:
        if key in assumed:
            notes.append(f"The {key.replace('.', ' ')} is taken as {assumed[key]}, because you assume so.")
    return notes
