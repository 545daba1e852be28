"""From a folder to a recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa

from ins_eval.errors import DataRefused, UsageError, did_you_mean
from ins_eval.limits import BY_NAME, limits_of
from ins_eval.printable import printable, shown
from ins_eval.recording import ChamberReadings, Fixes, Imu, Recording, Start, whole_rows
from ins_eval.recording.belief import Belief
from ins_eval.recording.consistency import Finding
from ins_eval.recording.form.columns import Columns, open_table
from ins_eval.recording.form.description import CHAMBER, ImuTable, Opened, open_folder
from ins_eval.recording.form.names import (
    ACCELEROMETER,
    AIR,
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
from ins_eval.recording.form.plausibility import check_plausible
from ins_eval.recording.form.start import start_of, start_of_solution
from ins_eval.recording.mending import mended
from ins_eval.recording.outages import measured, stated_valid
from ins_eval.recording.thermometer import without_faults
from ins_eval.recording.validation import validate
from ins_eval.tables import parse, read_toml
from ins_eval.units import DEG

CLOCK_TOLERANCE = 0.1  # of the step that rate_hz states; milliseconds for seconds is a factor of 1000
POSITION_TOLERANCE_G = 0.1  # an index head stands within a few degrees, and local gravity within 0.5 %


def read(
    folder: str | Path,
    solution_alone: bool = False,
    belief: Belief | None = None,
    doubted: bool = False,
    lost_samples: bool = False,
) -> Recording:
    """Read a recording of kind flight, drive, oven or static; with `solution_alone` also one without ``imu``.

    Rates (at their times) become increments over the sample, by the trapezoid with the sample before:

        increment_k = (rate_k-1 + rate_k) / 2 (t_k - t_k-1),   the first: rate_0 (t_0 - start)

    A `belief` stands in place of its own. What it says of a wrong description (`mending`) counts when the content is
    checked, and is not taken off. A `doubted` one may contradict itself: the caller mends and validates it.
    Where `lost_samples` are allowed, rows of ``imu`` that hold no number are left out: the caller fills or cuts.

    Its notes say what was assumed and what is suspicious, one sentence each.
    Raises UsageError for a folder that does not exist or holds a chamber, StorageError for a file that cannot be
    read and DataRefused, with file, row and column, for content that cannot be right.
    """
    opened = open_folder(folder)
    description = opened.description
    if description.kind == CHAMBER:
        raise UsageError(
            f"{opened.file}: is of kind '{CHAMBER}', expected a flight, drive, oven or static; calibrate on it"
        )
    gps, of_gps = _fixes(opened, "gps")
    reference, of_reference = _fixes(opened, "reference")
    solution, of_solution = _fixes(opened, "solution")
    tables = {"reference": reference, "gps": gps, "solution": solution}
    start, imu, assumed = _start_and_imu(opened, tables, solution_alone, lost_samples)
    pa.default_memory_pool().release_unused()  # it keeps as much as the tables had
    notes = (*opened.notes, *assumed, *of_gps, *of_reference, *of_solution)
    recording = Recording(
        name=opened.name,
        kind=description.kind,
        start=start,
        imu=imu,
        gps=gps,
        reference=reference,
        belief=opened.belief if belief is None else belief,
        notes=tuple(dict.fromkeys(notes)),
        unit=None if description.imu is None else description.imu.unit,
        folder=Path(folder),
        solution=solution,
    )
    return recording if doubted or lost_samples else validated(recording)


def _start_and_imu(
    opened: Opened, tables: Mapping[str, Fixes | None], solution_alone: bool, lost_samples: bool
) -> tuple[Start, Imu | None, list[str]]:
    """The start, what the table ``imu`` holds, if there is one, and notes on both."""
    table, solution = open_table(opened.folder, "imu"), tables["solution"]
    if table is None and solution is not None:
        if not solution_alone:
            raise DataRefused(
                f"{opened.folder}: holds no imu, only the solution that an INS put out; expected imu.parquet or "
                "imu.csv; add it, or take `ins-eval evaluate`, which needs none"
            )
        return start_of_solution(opened, solution), None, []
    description = opened.description
    if description.imu is None:
        raise DataRefused(f"{opened.file}: '[imu]' is missing; add that table")
    table = _there(opened, "imu", table)
    table.require(("time_s", *GYRO, *ACCELEROMETER))
    table, lost = _with_numbers(table) if lost_samples else (table, [])
    time_s = table.increasing_time()
    if time_s.size < 2:
        raise DataRefused(f"{table.path}: holds {time_s.size} row, expected at least two samples; copy the file again")
    step_s = float(np.median(np.diff(time_s)))
    _check_rate(opened, step_s)
    start, said = start_of(opened, tables, float(time_s[0]) - step_s)
    imu, assumed = _imu(table, description.imu, time_s, start.time_s)
    imu, faults = without_faults(imu)
    assumed += faults
    return start, imu, [*table.notes, *lost, *assumed, *said]


def _with_numbers(table: Columns) -> tuple[Columns, list[str]]:
    """The rows in which gyro and accelerometer hold numbers, and what is to be said of the others."""
    values = np.column_stack([table.numbers(name, gaps=True) for name in (*GYRO, *ACCELEROMETER)])
    known = np.isfinite(values).all(axis=1)
    if known.all():
        return table, []
    first = table.row(int(np.argmin(known)))
    note = f"{np.count_nonzero(~known)} rows hold no number for gyro or accelerometer, first row {first}: they count as"
    return table.only(known), [f"{note} missing."]


def read_chamber(folder: str | Path, unit: str | None = None) -> ChamberReadings:
    """Read the readings of one accelerometer in a chamber; `read_belief` gives what is believed of it.

    A table of several accelerometers needs the `unit` that is meant, as its column ``unit_id`` names it. The axis is
    the one that has a table in ``recording.toml``, or not said. Further columns are kept.
    Raises like `read`, and UsageError for a unit that is not there or not chosen.
    """
    opened = open_folder(folder)
    if opened.description.kind != CHAMBER:
        raise UsageError(
            f"{opened.file}: is of kind '{opened.description.kind}', expected kind = \"{CHAMBER}\"; "
            "name the folder of a chamber recording"
        )
    if len(opened.axes) > 1:
        raise DataRefused(
            f"{opened.file}: has tables of the accelerometers {' and '.join(opened.axes)}, expected the one that was "
            "in the chamber; keep the table of that axis"
        )
    whole = _there(opened, CHAMBER, open_table(opened.folder, CHAMBER))
    whole.require(("time_s", *READINGS))
    unit_id, table = _of_unit(whole, unit)
    time_s = table.increasing_time()
    run, input_g, rate_c_per_min, temperature_c, output = (table.numbers(name, *limits_of(name)) for name in READINGS)
    _check_runs(table, run, input_g)
    further = table.others(("time_s", *READINGS, UNIT))
    if AIR in further:
        further[AIR] = table.numbers(AIR, *limits_of(AIR))
    return ChamberReadings(
        time_s,
        run.astype(np.int64),
        input_g,
        rate_c_per_min,
        temperature_c,
        output,
        unit_id=unit_id,
        axis=opened.axes[0] if opened.axes else "",
        further=further,
    )


def given_as_rates(folder: str | Path) -> tuple[str, ...]:
    """Which of gyro and accelerometer the table ``imu`` of a recording holds as rates."""
    meaning = open_folder(folder).description.imu
    return tuple(name for name in ("gyro", "accelerometer") if meaning and getattr(meaning, name) == "rate")


def read_belief(folder: str | Path) -> Belief:
    """What a recording of any kind believes, without its tables."""
    return open_folder(folder).belief


def belief_of_file(file: Path) -> Belief:
    """The belief tables of a file, which may hold others."""
    tables = {key: table for key, table in read_toml(file).items() if key in Belief.model_fields}
    return parse(Belief, tables, str(file))


def _there(opened: Opened, name: str, table: Columns | None) -> Columns:
    if table is None:
        raise DataRefused(
            f"{opened.folder}: holds neither {name}.parquet nor {name}.csv, expected one of them for kind "
            f"'{opened.description.kind}'; add it"
        )
    return table


def _check_rate(opened: Opened, step_s: float) -> None:
    """The rate that is stated is that of the table."""
    rate_hz = opened.description.imu.rate_hz
    if rate_hz is None or abs(step_s * rate_hz - 1.0) <= CLOCK_TOLERANCE:
        return
    guess = " (milliseconds given for seconds?)" if abs(step_s * rate_hz / 1000.0 - 1.0) <= CLOCK_TOLERANCE else ""
    raise DataRefused(
        f"{opened.file}: rate_hz is {rate_hz:g}, but the samples of imu are {step_s:.6g} s apart, expected "
        f"{1.0 / rate_hz:.6g} s{guess}; correct the one that is wrong"
    )


def _imu(table: Columns, meaning: ImuTable, time_s: np.ndarray, start_s: float) -> tuple[Imu, list[str]]:
    known = ["time_s", *GYRO, *ACCELEROMETER]
    interval_s = np.diff(time_s, prepend=start_s)[:, None]
    notes = []

    def triad(names: tuple[str, ...], form: str, sensor: str) -> np.ndarray:
        values = np.column_stack([table.numbers(name) for name in names])
        if form != "rate":
            return values
        notes.append(
            f"The {sensor} was given as rates: they became increments by the trapezoid with the sample before, the "
            "first by its own value."
        )
        before = np.concatenate([values[:1], values[:-1]])
        return 0.5 * (before + values) * interval_s

    def optional(names: tuple[str, ...]) -> list[np.ndarray] | None:
        if not set(names) <= set(table.names):
            return None
        known.extend(names)
        return [table.numbers(name) for name in names]

    gyro = triad(GYRO, meaning.gyro, "gyro")
    accelerometer = triad(ACCELEROMETER, meaning.accelerometer, "accelerometer")
    temperature = optional(TEMPERATURES)
    if temperature is None and TEMPERATURE not in table.names and (some := set(TEMPERATURES) & set(table.names)):
        table.require([name for name in TEMPERATURES if name not in some])
    temperature_c = np.column_stack(temperature) if temperature else (optional((TEMPERATURE,)) or [None])[0]
    height_baro_m = (optional((BARO,)) or [None])[0]
    filled = (optional((FILLED,)) or [None])[0]
    slips = table.slips((*known, TEMPERATURE, *TEMPERATURES, BARO, FILLED))
    return (
        Imu(
            time_s=time_s,
            gyro=gyro,
            accelerometer=accelerometer,
            accelerometer_form="pulse" if meaning.accelerometer == "pulse" else "increment",
            temperature_c=temperature_c,
            height_baro_m=height_baro_m,
            further=table.others(known),
            filled=None if filled is None else filled != 0.0,
        ),
        notes + slips,
    )


def _fixes(opened: Opened, name: str) -> tuple[Fixes | None, list[str]]:
    """The table ``gps``, ``reference`` or ``solution``, and notes on it; of its groups of columns any may be missing.

    A row is valid where it has all groups that the table ever has; where no row has, since groups have rows of their
    own, a row that has one of them.
    """
    table = open_table(opened.folder, name)
    if table is None:
        return None, []
    table.require(("time_s",))
    attitudes = ATTITUDE if name != "gps" else ()
    if name == "gps":
        _check_groups(table)
    time_s = table.increasing_time()
    missing = np.full(time_s.size, np.nan)

    def column(of: str) -> np.ndarray | None:
        return table.numbers(of, *BY_NAME.get(of, ()), gaps=True) if of in table.names else None

    def filled(of: str) -> np.ndarray:
        return missing.copy() if (values := column(of)) is None else values

    motion = np.column_stack([filled(of) for of in (*POSITION, *VELOCITY)])
    if name == "gps":
        _check_halves(table, motion)
    alone = np.isfinite(motion[:, 0]) != np.isfinite(motion[:, 1])
    motion[alone, :2] = np.nan
    half = [f"{name}: latitude without longitude, or the reverse, in {np.count_nonzero(alone)} rows; not used."]
    valid = whole_rows(motion)
    flag = column(VALID)
    stated, open_rows = stated_valid(np.ones(time_s.size) if flag is None else flag, valid, name, table.row)
    attitude = [filled(of) * DEG for of in attitudes]
    known = ("time_s", *POSITION, *VELOCITY, VALID, *SIGMAS, *attitudes)
    position_sigma_m, velocity_sigma_mps = (column(of) for of in SIGMAS)
    fixes = Fixes(
        time_s=time_s,
        latitude_rad=motion[:, 0] * DEG,
        longitude_rad=motion[:, 1] * DEG,
        height_m=motion[:, 2].copy(),
        velocity_n=motion[:, 3:].copy(),
        valid=valid & stated,
        attitude_rad=np.column_stack(attitude) if set(ATTITUDE) & set(table.names) and attitude else None,
        position_sigma_m=position_sigma_m,
        velocity_sigma_mps=velocity_sigma_mps,
    )
    fixes, found = measured(fixes, name)
    return fixes, [*table.notes, *table.slips(known), *(half if alone.any() else []), *open_rows, *found]


def _check_groups(table: Columns) -> None:
    """A receiver gives a position or a velocity, and of neither only one half."""
    halves = (POSITION[:2], VELOCITY[:2])
    for one, other in (*halves, *(half[::-1] for half in halves)):
        if one in table.names and other not in table.names:
            table.require(("time_s", one, other))
    if not any(half[0] in table.names for half in halves):
        table.require(("time_s", *POSITION, *VELOCITY))


def _check_halves(table: Columns, motion: np.ndarray) -> None:
    """Of a position or a velocity that has values, in `motion` (n, 6), no half is without any."""
    for names, values in ((POSITION[:2], motion[:, :2]), (VELOCITY[:2], motion[:, 3:5])):
        empty = np.isnan(values).all(axis=0)
        if empty.any() and not empty.all():
            without, other = names if empty[0] else names[::-1]
            raise DataRefused(
                f"{table.path}, column {without}: no row has a value, expected one wherever {other} has one; fill the "
                f"column, or remove {other} as well"
            )


def validated(recording: Recording, found: Sequence[Finding] | None = None, judged: bool = False) -> Recording:
    """The recording with what `validate` has to say of it; of an incomplete reference it sees nothing.

    `found` is what `consistency` finds of the recording as it is mended, where that is known already; `judged`: see
    `validate`.
    """
    right = mended(recording)
    reference = right.reference
    complete = reference is not None and bool(
        np.isfinite([reference.latitude_rad, reference.longitude_rad, reference.height_m]).any(axis=1).all()
    )
    try:
        whole = complete or reference is None
        checked = validate(right, found, judged) if whole else validate(replace(right, reference=None), judged=judged)
        check_plausible(right)
    except DataRefused as refused:
        raise DataRefused(printable(f"{recording.folder}: {refused}")) from None
    return replace(recording, notes=checked.notes)


def _check_runs(table: Columns, run: np.ndarray, input_g: np.ndarray) -> None:
    """Each run has a whole number, is one piece, and stays in one position of +1, 0 or -1 g."""

    def refuse(row: int, column: str, seen: str, expected: str) -> None:
        raise DataRefused(f"{table.path}, row {table.row(row)}, column {column}: {seen}, expected {expected}")

    if (bad := np.flatnonzero((run != np.rint(run)) | (np.abs(run) > 2.0**53))).size:
        refuse(bad[0], "run", f"{run[bad[0]]:g}", "a whole number; number the stays in one position 0, 1, 2, ...")
    begins = np.concatenate([[0], np.flatnonzero(np.diff(run)) + 1])
    _, first = np.unique(run[begins], return_index=True)
    if first.size < begins.size:
        row = int(np.delete(begins, first)[0])
        refuse(row, "run", f"run {run[row]:g} goes on after another", "one uninterrupted stay; give it a new number")
    if (bad := np.flatnonzero(np.abs(input_g - np.clip(np.rint(input_g), -1, 1)) > POSITION_TOLERANCE_G)).size:
        seen = f"{input_g[bad[0]]:g}"
        refuse(bad[0], "input_g", seen, "+1, 0 or -1, the specific force along the input axis in g; convert it to g")
    position_of_run = np.repeat(np.rint(input_g[begins]), np.diff(np.append(begins, run.size)))
    if (bad := np.flatnonzero(np.rint(input_g) != position_of_run)).size:
        seen = f"{input_g[bad[0]]:g} in run {run[bad[0]]:g} that began at {position_of_run[bad[0]]:+g} g"
        refuse(bad[0], "input_g", seen, "one position in a run; give each position a run of its own")


def _of_unit(table: Columns, wanted: str | None) -> tuple[str, Columns]:
    """The unit that is `wanted`, or the only one, and its rows."""
    where = f"{table.path}, column {UNIT}"
    if UNIT not in table.names:
        if wanted:
            raise UsageError(f"{where}: is not there, so {shown(wanted)} cannot be found; leave --unit away or add it")
        return "", table
    column = np.array(["" if one is None else str(one) for one in table.data.column(UNIT).to_pylist()])
    units = list(dict.fromkeys(column.tolist()))
    if wanted is None and len(units) > 1:
        listed = ", ".join(shown(one) for one in units[:6]) + (", ..." if len(units) > 6 else "")
        raise UsageError(f"{where}: names {len(units)} units ({listed}), expected one; choose it with --unit")
    if wanted is not None and wanted not in units:
        raise UsageError(f"{where}: holds no unit {shown(wanted)}{did_you_mean(wanted, units)}")
    chosen = units[0] if wanted is None else wanted
    return chosen, table if len(units) == 1 else table.only(column == chosen)
