"""From the rows of a file to the increments of an `Imu`: time stamps, lost rows, rates.

Row k of a file in rates holds the rate at its stamp; the increment over a step is the trapezoid between two rows,

    increment_k = (rate_k-1 + rate_k) / 2 (t_k - t_k-1),

and the first row is the start. Row k of a file in increments covers the step that ends at its stamp. A row that is
missing, or in which time, gyro or accelerometer holds no number, is filled with a straight line between its neighbours
where the gap is short, and marked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ins_eval.errors import DataRefused
from ins_eval.readers.layout import ACCELEROMETER_UNITS, GYRO_UNITS, Layout, frd_from
from ins_eval.recording import Imu
from ins_eval.recording.form.names import FILLED
from ins_eval.recording.stamps import gaps

LONGEST_STEP = 1.4  # of the median step; beyond it a row is missing. Validation refuses from 1.5 of them on
FEWEST_ROWS = 3
LARGEST_VALUE = 1e15  # of any column in its own unit, seconds and microseconds since 1970 included
LARGEST_TIME_S = 1e11  # the year 5000


@dataclass
class Readings:
    """The rows of a file as they stand there: stamps in s, gyro and accelerometer in the file's units and axes."""

    time_s: np.ndarray
    gyro: np.ndarray
    accelerometer: np.ndarray
    scalars: dict[str, np.ndarray] = field(default_factory=dict)  # temperature_c, height_baro_m, any further column
    first_row: int = 1  # number of the first row as a line of the file, for messages


@dataclass(frozen=True)
class Sampled:
    """The samples, when the first of them begins, and what was done to the rows."""

    start_s: float
    imu: Imu
    notes: tuple[str, ...]


def sampled(readings: Readings, layout: Layout, where: str) -> Sampled:
    """Check the stamps, fill short gaps, convert to SI increments in forward-right-down.

    Long gaps stay in the times where `layout` has them cut: `stretches.stretches` then makes a recording of each part.
    Raises `DataRefused` for stamps that are no numbers, values that no sensor has, and time that stands still or goes
    back, unless `layout` says what to do with it.
    """
    if len(readings.time_s) < FEWEST_ROWS:
        raise DataRefused(f"{where}: {len(readings.time_s)} rows, expected at least three; check that it is complete")
    notes: list[str] = []
    readings = _with_numbers(readings, where, notes)
    gyro_form, gyro_scale = GYRO_UNITS[layout.gyro_unit]
    accelerometer_form, accelerometer_scale = ACCELEROMETER_UNITS[layout.accelerometer_unit]
    turn = frd_from(layout.axes)
    columns = {
        "gyro": gyro_scale * (readings.gyro @ turn.T),
        "accelerometer": accelerometer_scale * (readings.accelerometer @ turn.T),
        **readings.scalars,
    }
    time_s = readings.time_s
    time_s, columns = _increasing(time_s, columns, layout, where, readings.first_row, notes)
    if len(time_s) < FEWEST_ROWS:
        raise DataRefused(f"{where}: {len(time_s)} usable rows, expected at least three; check that it is complete")
    step_s = float(np.median(np.diff(time_s)))
    time_s, columns = _without_long_gaps(time_s, columns, layout, step_s, where, notes)
    increments = {"gyro"} if gyro_form == "increment" else set()
    increments |= {"accelerometer"} if accelerometer_form == "increment" else set()
    time_s, columns, filled = _bridged(time_s, columns, increments, layout, step_s, where, notes)

    # The first row of rates is only a beginning; a row of increments has covered a step of its own.
    both = len(increments) == 2
    for name in {"gyro", "accelerometer"} - increments:
        before = columns[name][:1] if both else columns[name][:-1]
        columns[name] = 0.5 * (before + columns[name][1:]) * np.diff(time_s)[:, None]
    if not both:
        columns = {k: v if k in {"gyro", "accelerometer"} - increments else v[1:] for k, v in columns.items()}
        filled = filled[1:] | filled[:-1] if len(increments) == 0 else filled[1:]
        notes.append("The rates at the stamps were integrated to increments by the trapezoidal rule.")
    if filled.any():
        notes.append(f"{filled.sum()} increments rest on samples that were put in (column filled).")
    known = {name: columns.pop(name) for name in ("temperature_c", "height_baro_m") if name in columns}
    imu = Imu(
        time_s=time_s if both else time_s[1:],
        gyro=columns.pop("gyro"),
        accelerometer=columns.pop("accelerometer"),
        accelerometer_form="increment",
        further=columns,
        filled=filled if filled.any() else None,
        **known,
    )
    return Sampled(float(time_s[0] - step_s if both else time_s[0]), imu, tuple(notes))


def filled(imu: Imu, of_rates: Sequence[str], layout: Layout, where: str) -> tuple[Imu, tuple[str, ...]]:
    """Samples in increments with short gaps filled, and what was done to them; long ones stay as `sampled` has them.

    Increments that are `of_rates` (gyro, accelerometer) cover a gap before their sample, others their own step.
    """
    notes: list[str] = []
    step_s = float(np.median(np.diff(imu.time_s)))
    if not gaps(imu.time_s, LONGEST_STEP).size:
        return imu, ()
    own = step_s / np.diff(imu.time_s, prepend=imu.time_s[0] - step_s)[:, None]
    sensors = {"gyro": imu.gyro, "accelerometer": imu.accelerometer}
    columns = {name: values * np.minimum(own, 1.0) if name in of_rates else values for name, values in sensors.items()}
    known = {"temperature_c": imu.temperature_c, "height_baro_m": imu.height_baro_m}
    columns |= {name: values for name, values in known.items() if values is not None}
    for name, values in imu.further.items():
        if np.issubdtype(values.dtype, np.number):
            columns[name] = values
        else:
            notes.append(f"The column {name} holds no numbers that could lie on straight lines; it was left out.")
    was_filled = np.zeros(imu.time_s.size) if imu.filled is None else imu.filled
    time_s, columns = _without_long_gaps(
        imu.time_s, {**columns, FILLED: was_filled.astype(float)}, layout, step_s, where, notes
    )
    time_s, columns, new = _bridged(time_s, columns, set(sensors), layout, step_s, where, notes)
    if imu.accelerometer_form == "pulse":
        columns["accelerometer"] = np.where(new[:, None], np.rint(columns["accelerometer"]), columns["accelerometer"])
    marked = new | (columns.pop(FILLED) == 1.0)
    made = replace(
        imu,
        time_s=time_s,
        **{name: columns.pop(name) for name in (*sensors, *known) if name in columns},
        further=columns,
        filled=marked if marked.any() else None,
    )
    return made, tuple(notes)


def _with_numbers(readings: Readings, where: str, notes: list[str]) -> Readings:
    """The rows in which gyro and accelerometer hold numbers; other columns are straight lines where they do not."""
    time_s = readings.time_s
    values = {"time": time_s, "gyro": readings.gyro, "accelerometer": readings.accelerometer}
    for name, column in (values | readings.scalars).items():
        flat = column.reshape(len(column), -1)
        wild = ~((np.abs(flat) < LARGEST_VALUE) | np.isnan(flat)).all(axis=1)
        if wild.any():
            of = "number of seconds" if name == "time" else "sensor value"
            raise DataRefused(
                f"{where}: {name} is no finite {of} in {wild.sum()} rows, first in row "
                f"{int(np.argmax(wild)) + readings.first_row}; remove them or write NaN there, which counts as a "
                "missing sample"
            )
    stamped = np.isfinite(time_s)
    if stamped.any() and np.nanmax(np.abs(time_s)) > LARGEST_TIME_S:
        raise DataRefused(
            f"{where}: a time of {np.nanmax(np.abs(time_s)):.3g} s, expected the seconds of a clock; "
            "check the unit of the time column"
        )
    felt = np.isfinite(np.column_stack([readings.gyro, readings.accelerometer])).all(axis=1)
    for known, of in ((stamped, "time"), (felt, "gyro or accelerometer")):
        if not known.all():
            lost = np.flatnonzero(~known)
            notes.append(
                f"{lost.size} rows hold no number for {of}, first row {lost[0] + readings.first_row}: they count as "
                "missing."
            )
    keep = stamped & felt
    if keep.sum() < FEWEST_ROWS:
        raise DataRefused(f"{where}: {keep.sum()} rows hold numbers, expected at least three; check the columns")
    scalars = {}
    for name, column in readings.scalars.items():
        known = np.isfinite(column.reshape(len(column), -1)).all(axis=1)
        if not known.all():
            if known.sum() < FEWEST_ROWS:
                notes.append(f"The column {name} holds {known.sum()} numbers; it was left out.")
                continue
            rows = np.flatnonzero(known)
            flat = column.reshape(len(column), -1)
            lines = [np.interp(np.arange(len(column)), rows, line[known]) for line in flat.T]
            column = np.column_stack(lines).reshape(column.shape)
            notes.append(f"{(~known).sum()} values of {name} were no number and lie on straight lines now.")
        scalars[name] = column[keep]
    return Readings(time_s[keep], readings.gyro[keep], readings.accelerometer[keep], scalars, readings.first_row)


def _increasing(time_s, columns, layout: Layout, where: str, first_row: int, notes: list[str]):
    """Without rows whose stamp does not exceed all before it."""
    highest = np.maximum.accumulate(time_s)
    keep = np.concatenate([[True], time_s[1:] > highest[:-1]])
    lost = int((~keep).sum())
    if not lost:
        return time_s, columns
    k = int(np.argmin(keep))
    back = int((np.diff(time_s) < 0.0).sum())
    if back > len(time_s) // 2:
        raise DataRefused(
            f"{where}, row {k + first_row}: time goes back from {time_s[k - 1]:.10g} to {time_s[k]:.10g} s, and so in "
            f"{back} of {len(time_s)} rows, expected strictly increasing times; sort the rows by their time"
        )
    how = "repeats" if time_s[k] == time_s[k - 1] else "goes back"
    if layout.stamps != "drop":
        raise DataRefused(
            f"{where}, row {k + first_row}: time {how} from {time_s[k - 1]:.10g} to {time_s[k]:.10g} s ({lost} such "
            "rows), expected strictly increasing times; separate joined logs, or --assume stamps=drop leaves these "
            "rows out"
        )
    notes.append(f"{lost} rows whose time repeats or goes back were left out, because you assume stamps=drop.")
    return time_s[keep], {name: values[keep] for name, values in columns.items()}


def _beyond(steps: np.ndarray, step_s: float, layout: Layout) -> np.ndarray:
    """Which steps lack more than a row and more time than is filled."""
    return (steps > LONGEST_STEP * step_s) & (steps - step_s > layout.fill_s) & (np.rint(steps / step_s) > 2.0)


def _without_long_gaps(time_s, columns, layout: Layout, step_s: float, where: str, notes: list[str]):
    """The longest part without a long gap, or all of it where long gaps are to be cut later or bridged."""
    steps = np.diff(time_s)
    long = np.flatnonzero(_beyond(steps, step_s, layout))
    if not long.size or layout.gaps in ("cut", "bridge"):
        return time_s, columns
    edges = np.concatenate([[0], long + 1, [len(time_s)]])
    k = int(np.argmax(np.diff(edges)))
    part = slice(edges[k], edges[k + 1])
    worst = long[np.argmax(steps[long])]
    found = (
        f"{long.size} gap{'s' if long.size > 1 else ''} in time, the longest {steps[worst]:.4g} s after "
        f"{time_s[worst]:.10g} s"
    )
    kept = f"the longest part without, {time_s[part][0]:.10g} to {time_s[part][-1]:.10g} s"
    if layout.gaps == "refuse":
        raise DataRefused(
            f"{where}: {found}, expected steps of {step_s:.4g} s; --assume gaps=cut makes a recording of each part, "
            f"--assume gaps=longest keeps {kept}, --assume gaps=bridge draws a straight line over them"
        )
    notes.append(f"Found {found}: kept was {kept}; {len(time_s) - (edges[k + 1] - edges[k])} rows were left out.")
    if edges[k + 1] - edges[k] < FEWEST_ROWS:
        raise DataRefused(f"{where}: {found}, so that no part of three rows is left; check the unit of the time column")
    return time_s[part], {name: values[part] for name, values in columns.items()}


def _bridged(time_s, columns, increments: set[str], layout: Layout, step_s: float, where: str, notes: list[str]):
    """With rows on a straight line between their neighbours where some are missing, and which rows these are."""
    steps = np.diff(time_s)
    long = np.flatnonzero(_beyond(steps, step_s, layout) & (layout.gaps == "cut"))
    short = np.setdiff1d(gaps(time_s, LONGEST_STEP), long)
    if not short.size:
        return time_s, columns, np.zeros(len(time_s), dtype=bool)
    pieces = np.maximum(np.rint(np.minimum(steps[short] / step_s, 1e9)).astype(int), 2)
    if pieces.sum() > len(time_s):
        raise DataRefused(
            f"{where}: {pieces.sum() - len(pieces)} rows are missing and {len(time_s)} are there, expected most of "
            "them; cut the recording at its gaps with --assume gaps=longest"
        )
    added = np.concatenate([time_s[k] + steps[k] * np.arange(1, n) / n for k, n in zip(short, pieces, strict=True)])
    merged = np.sort(np.concatenate([time_s, added]))
    rows = np.arange(len(time_s))
    at = np.interp(merged, time_s, rows)
    mended = {}
    for name, values in columns.items():
        flat = values.reshape(len(values), -1)
        lines = np.column_stack([np.interp(at, rows, line) for line in flat.T])
        if name in increments:  # a new row covers its own step, which need not be the median one
            new = np.isin(merged, added)
            lines[new] *= np.diff(merged, prepend=merged[0] - step_s)[new, None] / step_s
        mended[name] = lines.reshape(len(merged), *values.shape[1:])
    notes.append(
        f"{short.size} steps exceed {LONGEST_STEP} times the median step of {step_s:.4g} s, {steps[short].sum():.3g} s "
        f"in all, the longest {steps[short].max():.4g} s after {time_s[short[np.argmax(steps[short])]]:.10g} s: "
        f"{len(added)} samples on straight lines were put in, not measured ones."
    )
    return merged, mended, np.isin(merged, added)
