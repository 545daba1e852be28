"""What is believed where nobody stated it: from the unit's sheet, from rest, from sheets of its grade, from the fixes.

Every value that is filled in stands with its source in the belief and in the notes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ins_eval import datasheets
from ins_eval.compensation.file import believed_model
from ins_eval.datasheets import UnitSheet
from ins_eval.earth import radii
from ins_eval.errors import InsEvalError
from ins_eval.grade import ANGLE_RANDOM_WALK, BIAS, VELOCITY_RANDOM_WALK, VISIBLE_SIGMAS, Grade, measure_grade, typical
from ins_eval.navigation import compensate, samples
from ins_eval.random_processes import NORMAL_MAD
from ins_eval.recording import Fixes, Recording
from ins_eval.recording.belief import (
    POSITION_SIGMA_M,
    SHOWN_KEYS,
    UNSTATED,
    VELOCITY_SIGMA_MPS,
    ZERO,
    Belief,
    FormTable,
    clauses,
)
from ins_eval.recording.mending import mended
from ins_eval.units import DEG_PER_H, UG

QFA_BIAS_SIGMA_UG = 50.0  # Paper A, Table 5: an accelerometer of which only its own readings are known
FILLED = ("gyro", "accelerometer", "gps")
STATED = "stated"
NOT_STATED = "Believed, not stated"  # what a note of it begins with


@dataclass(frozen=True)
class Filled:
    """A value that nobody stated, and where it came from."""

    value: object
    source: str


def believed(recording: Recording) -> Recording:
    """The same recording, wrong descriptions mended, with every unknown key of gyro, accelerometer and GPS filled in.

    1. The data sheet of ``recording.unit``, where it is named.
    2. What its stretches at rest show.
    3. The geometric mean over the sheets of the nearest grade, or of the coarsest where no noise is seen.
    4. Of GPS: the sigmas that the fixes state, or else their spread.

    What was filled in leads the notes and stands in ``source`` of its table. A belief without unknown keys comes back
    as it is. Raises: UsageError for a unit that has no sheet.
    """
    if recording.imu is None:
        return recording
    recording = mended(recording)
    sheet = None if recording.unit is None else datasheets.unit(recording.unit)
    belief = recording.belief
    unknown = {table: _unknown(getattr(belief, table)) for table in FILLED}
    if recording.gps is None:
        unknown["gps"] = ()
    if not any(unknown.values()):
        return recording
    asked = unknown["gyro"] or "bias_sigma_ug" in unknown["accelerometer"]
    grade = measure_grade(recording, recorded_velocity(recording)) if asked else None
    found = {
        "gyro": _gyro(belief, sheet, grade) if unknown["gyro"] else {},
        "accelerometer": _accelerometer(belief, sheet, grade) if unknown["accelerometer"] else {},
        "gps": _gps(belief, recording.gps) if unknown["gps"] else {},
    }
    notes = [] if grade is None else [grade.words]
    for table, filled in found.items():
        notes += [f"{NOT_STATED}: [{table}] {key} = {_shown(one.value)}, {one.source}." for key, one in filled.items()]
        if filled:
            belief = belief.model_copy(update={table: _with(getattr(belief, table), filled)})
    notes += [note for note in recording.notes if note not in notes]
    return replace(recording, belief=belief, notes=tuple(notes))


def believed_of_chamber(belief: Belief) -> Belief:
    """The same of accelerometers that only a chamber saw."""
    if belief.accelerometer.bias_sigma_ug is not None:
        return belief
    words = "tested INS of Paper A, Table 5, since nothing else is known of an accelerometer in a chamber"
    filled = {"bias_sigma_ug": Filled(QFA_BIAS_SIGMA_UG, words)}
    return belief.model_copy(update={"accelerometer": _with(belief.accelerometer, filled)})


def _unknown(table: FormTable) -> tuple[str, ...]:
    """Keys that have no value; white noise of accelerometers may stay unknown where their bias is stated."""
    names = {
        "GyroBelief": ("bias_radps", "bias_sigma_deg_per_h", "angle_random_walk_deg_per_sqrt_h"),
        "AccelerometerBelief": ("bias_mps2", "bias_sigma_ug"),
        "GpsBelief": ("position_sigma_m", "velocity_sigma_mps"),
    }[type(table).__name__]
    return tuple(name for name in names if getattr(table, name) is None)


def _with(table: Any, filled: dict[str, Filled]) -> Any:
    """A table with these values, and their sources behind those that it had."""
    sources = [table.source] if table.source else []
    sources += [f"{key}: {one.source}" for key, one in filled.items()]
    return table.model_copy(update={**{key: one.value for key, one in filled.items()}, "source": "; ".join(sources)})


def _gyro(belief: Belief, sheet: UnitSheet | None, grade: Grade) -> dict[str, Filled]:
    gyro, filled = belief.gyro, {}
    offset, sigma = grade.gyro_offset, grade.gyro_offset_sigma
    if gyro.angle_random_walk_deg_per_sqrt_h is None:
        filled["angle_random_walk_deg_per_sqrt_h"] = _white(ANGLE_RANDOM_WALK, "gyro", sheet, grade)
    measured = offset is not None and bool((np.abs(offset) > VISIBLE_SIGMAS * sigma).any())
    if gyro.bias_radps is None:
        filled["bias_radps"] = Filled(ZERO, "taken as 0, since no stretch at rest shows another")
        if measured:
            value = tuple(float(f"{one:.6g}") for one in offset)
            filled["bias_radps"] = Filled(value, f"mean rate in {grade.rest_s:.0f} s at rest less Earth rate")
    stated = gyro.bias_sigma_deg_per_h
    bias = _bias("gyro", sheet, grade) if stated is None else None
    if offset is not None and (stated is None or gyro.bias_radps is None):
        away = offset - np.asarray(filled["bias_radps"].value if gyro.bias_radps is None else gyro.bias_radps)
        left = float(f"{np.hypot(away, sigma).max() / DEG_PER_H:.3g}")
        of_sheet = bias is not None and sheet is not None and not measured
        grown = stated is None and measured and gyro.bias_radps is None
        if (grown or left < (bias.value if bias else stated)) and not of_sheet:
            beside = "" if stated is None else f", in place of {stated:g} about 0 as stated"
            bias = Filled(left, f"what {grade.rest_s:.0f} s at rest leave of an offset{beside}")
    return filled if bias is None else {**filled, "bias_sigma_deg_per_h": bias}


def _accelerometer(belief: Belief, sheet: UnitSheet | None, grade: Grade | None) -> dict[str, Filled]:
    accelerometer, filled = belief.accelerometer, {}
    if accelerometer.bias_mps2 is None:
        filled["bias_mps2"] = Filled(ZERO, "taken as 0, since a rest shows one direction only")
    if accelerometer.bias_sigma_ug is None:
        bias = _bias("accelerometer", sheet, grade)
        seen = abs(grade.force_offset or 0.0) / UG
        if seen > bias.value:
            bias = Filled(float(f"{seen:.3g}"), f"offset of the norm of specific force in {grade.rest_s:.0f} s at rest")
        filled["bias_sigma_ug"] = bias
        if accelerometer.velocity_random_walk_ug_per_sqrt_hz is None:
            filled["velocity_random_walk_ug_per_sqrt_hz"] = _white(VELOCITY_RANDOM_WALK, "accelerometer", sheet, grade)
    return filled


def _white(key: str, table: str, sheet: UnitSheet | None, grade: Grade) -> Filled:
    """White noise: of the sheet, at rest, or at most what the quietest pieces of a motion have."""
    if sheet is not None and (value := getattr(getattr(sheet, table), key)) is not None:
        return Filled(value, f"data sheet of {sheet.name}, {sheet.source}")
    if key in grade.white:
        return Filled(float(f"{grade.white[key]:.3g}"), f"Allan deviation in {grade.rest_s:.0f} s at rest")
    if grade.rests and key in grade.bounds:
        return Filled(
            float(f"{grade.bounds[key]:.3g}"), f"Allan deviation at 1 s in {grade.rest_s:.0f} s at rest, at most"
        )
    return _of_grade(table, key, grade)


def _bias(table: str, sheet: UnitSheet | None, grade: Grade) -> Filled:
    """One sigma of the turn-on bias: what the sheet says of its repeatability."""
    key = BIAS[table]
    if sheet is not None and (value := getattr(getattr(sheet, table), key)) is not None:
        return Filled(value, f"data sheet of {sheet.name}, {sheet.source}")
    return _of_grade(table, key, grade)


def _of_grade(table: str, key: str, grade: Grade) -> Filled:
    """The mean of the sheets of its grade; of the coarsest where the recording shows no grade."""
    words = grade.grade or datasheets.GRADES[0]
    known = "" if grade.grade else ", the coarsest, since no noise is seen"
    return Filled(float(f"{typical(words, table, key):.3g}"), f"mean of the data sheets of grade {words}{known}")


def _gps(belief: Belief, fixes: Fixes) -> dict[str, Filled]:
    filled = {}
    for key, own, least, unit, spread in (
        ("position_sigma_m", fixes.position_sigma_m, POSITION_SIGMA_M, "m", _position_spread),
        ("velocity_sigma_mps", fixes.velocity_sigma_mps, VELOCITY_SIGMA_MPS, "m/s", _velocity_spread),
    ):
        if getattr(belief.gps, key) is None:
            filled[key] = _sigma(own, least, unit, spread, fixes)
    return filled


def _sigma(own: np.ndarray | None, least: float, unit: str, spread: Callable[[Fixes], float], fixes: Fixes) -> Filled:
    """That of the fixes themselves, or else their spread, of which a slow error is no part."""
    if own is not None and (known := own[np.isfinite(own) & (own > 0.0)]).size:
        return Filled(float(f"{np.median(known):.3g}"), "median of what the fixes state themselves")
    seen = spread(fixes)
    if seen > least:
        return Filled(float(f"{seen:.3g}"), "spread of the fixes about smooth motion")
    words = f"that of a single-frequency receiver, since the spread of {seen:.2g} {unit} hides slow errors"
    return Filled(least, words)


def _position_spread(fixes: Fixes) -> float:
    known = fixes.valid & np.isfinite(fixes.latitude_rad) & np.isfinite(fixes.height_m)
    if known.sum() < 5:
        return 0.0
    meridian, transverse = radii(fixes.latitude_rad[known])
    latitude, longitude = fixes.latitude_rad[known], fixes.longitude_rad[known]
    east = np.unwrap(longitude) * transverse * np.cos(latitude)
    return _third_differences(fixes.time_s[known], np.column_stack([latitude * meridian, east, fixes.height_m[known]]))


def _velocity_spread(fixes: Fixes) -> float:
    known = fixes.valid & np.isfinite(fixes.velocity_n).all(axis=1)
    return _third_differences(fixes.time_s[known], fixes.velocity_n[known]) if known.sum() >= 5 else 0.0


def _third_differences(time_s: np.ndarray, values: np.ndarray) -> float:
    """Noise of a series from its third differences, sigma^2 = d^2 / 20, where they are evenly spaced; the median."""
    third = np.diff(values, n=3, axis=0)
    step_s = np.diff(time_s)
    even = np.lib.stride_tricks.sliding_window_view(step_s, 3).max(axis=1) < 1.5 * np.median(step_s)
    if not even.any():
        return 0.0
    return float(np.median(np.abs(third[even]), axis=0).max() / NORMAL_MAD / np.sqrt(20.0))


def velocity_increments(recording: Recording) -> np.ndarray | None:
    """What the accelerometers recorded, (n, 3) in m/s; None where nothing says what a pulse is worth."""
    if recording.imu.accelerometer_form == "increment":
        return recording.imu.accelerometer
    if any(getattr(recording.belief.accelerometer, axis) is None for axis in "xyz"):
        return None
    triad = [believed_model(recording.belief, axis, recording.folder) for axis in "xyz"]
    return compensate(samples(recording), triad, recording.interval_s)


def recorded_velocity(recording: Recording) -> np.ndarray | None:
    """The same; None also where a compensation file is missing."""
    try:
        return velocity_increments(recording)
    except InsEvalError:  # a file that is missing is refused where it is needed
        return None


def _shown(value: object) -> str:
    return f"[{', '.join(f'{one:.6g}' for one in value)}]" if isinstance(value, tuple) else f"{value:g}"


@dataclass(frozen=True)
class BeliefRow:
    """A believed value in words, and where it comes from."""

    key: str
    value: str
    source: str


def belief_rows(recording: Recording) -> list[BeliefRow]:
    """What is believed of gyros, accelerometers and GPS."""
    belief = recording.belief
    rows = []
    for table in SHOWN_KEYS:
        if table == "gps" and recording.gps is None:
            continue
        of = getattr(belief, table)
        sources = clauses(of.source)
        own = {key: sources[key] for key in SHOWN_KEYS[table] if key in sources}
        for key in SHOWN_KEYS[table]:
            value = getattr(of, key)
            if value is None:
                source = "unknown, estimated where it is needed"
            elif key not in of.model_fields_set and key not in own:
                source = UNSTATED
            else:
                source = own.get(key) or (STATED if own or not of.source else of.source)
            shown = "none" if value is None else _shown(value)
            rows.append(BeliefRow(f"[{table}] {key}", shown, source))
    return rows
