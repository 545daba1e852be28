"""Believed effects taken off a recording before it is navigated: the only place that does it.

    indicated = true + error(true)   for a gyro and an accelerometer after compensation

so the true rate w and specific force f are found by repeated substitution, w <- w_indicated - error(w, f) and likewise
f. Effects of a receiver change what is believed of it, those of the Earth set the flag of what was left out, and those
of the start turn its attitude.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ins_eval.effects.effect import ACCELEROMETER, AXES, Effect, multiplied
from ins_eval.effects.parts import SENSORS, EffectPart, chamber_conditions, conditions, parts, possible
from ins_eval.effects.slow import Conditions
from ins_eval.effects.start import ROTATIONS
from ins_eval.effects.temperature import SmoothedTemperature
from ins_eval.effects.vocabulary import VOCABULARY, checked
from ins_eval.errors import DataRefused
from ins_eval.recording import ChamberReadings, Fixes, Recording, Start
from ins_eval.recording.belief import Belief, EffectBelief
from ins_eval.units import STANDARD_GRAVITY

BLOCK = 1 << 16  # samples
SUBSTITUTIONS = 3  # each leaves a part in a thousand of an error of 1000 ppm
OF_INPUT = ("1", "f", "f^2", "f^3", "|f|")  # multipliers that are known where only the input axis is


class _Applied(NamedTuple):
    """A part of a believed effect with its size in SI, (n,) at the samples or one number."""

    part: EffectPart
    size: np.ndarray | float


def without_effects(
    recording: Recording, velocity: np.ndarray, folder: str | Path = "."
) -> tuple[Recording, np.ndarray]:
    """A recording and its compensated velocity increments (n, 3) in m/s with the believed effects taken off.

    Of the belief that is returned only the effects of the start are left: `turned_start` takes them off the state that
    navigation begins with. Where there is nothing to take off, the recording comes back as it is.
    Raises: UsageError for an effect that the vocabulary does not have.
    """
    believed = of_recording(recording.belief, recording.name)
    if not recording.belief.effects:
        return recording, velocity
    of_start = tuple(one for one in believed if VOCABULARY[one.name].enters == "start")
    gyro = recording.imu.gyro
    if any(VOCABULARY[one.name].enters in (*SENSORS, "temperature", "any") for one in believed):
        gyro, velocity = _sensors(recording, velocity, believed, folder)
    belief, reference = recording.belief.model_copy(update={"effects": of_start}), recording.reference
    for one in believed:
        belief, reference = _believed(belief, reference, one)
    changed = replace(recording, belief=belief, reference=reference, imu=replace(recording.imu, gyro=gyro))
    return changed, velocity


def effects_left(belief: Belief) -> tuple[EffectBelief, ...]:
    """The effects that `without_effects` has not taken off yet."""
    return tuple(one for one in belief.effects if VOCABULARY[one.name].enters != "start")


def turned_start(start: Start, belief: Belief) -> Start:
    """The start with the effects of alignment in a belief taken off: C_true = exp(phi x) C_believed, phi in n."""
    phi = np.zeros(3)
    for one in belief.effects:
        if (one.name, one.axis) in ROTATIONS:
            phi[ROTATIONS[one.name, one.axis]] += VOCABULARY[one.name].si * one.value
    if start.attitude_rad is None or not phi.any():
        return start
    before = Rotation.from_euler("ZYX", np.asarray(start.attitude_rad, dtype=float)[::-1])
    angles = (Rotation.from_rotvec(phi) * before).as_euler("ZYX", suppress_warnings=True)[::-1]
    return replace(start, attitude_rad=tuple(float(angle) for angle in angles))


def chamber_error(
    readings: ChamberReadings,
    belief: Belief,
    name: str,
    folder: str | Path = ".",
    seen: SmoothedTemperature | None = None,
) -> np.ndarray:
    """What the believed effects add to the compensated specific force of an accelerometer in a chamber, (n,) m/s^2."""
    given = chamber_conditions(readings, belief, folder, seen)
    axis = given.axes[0]
    force = np.zeros((readings.time_s.size, 3))
    force[:, AXES.index(axis)] = STANDARD_GRAVITY * readings.input_g
    found = _at(_parts(of_recording(belief, name), given), readings.time_s)
    found = [one for one in found if one.part.axis == axis and one.part.multiplier in OF_INPUT]
    return _error(found, ACCELEROMETER, force, force)[:, AXES.index(axis)]


def of_recording(belief: Belief, name: str) -> tuple[EffectBelief, ...]:
    """The effects of a belief that a recording of this name has; they are checked."""
    checked(belief.effects)
    return tuple(one for one in belief.effects if one.recording in (None, name))


def _sensors(
    recording: Recording, velocity: np.ndarray, believed: Sequence[EffectBelief], folder: str | Path
) -> tuple[np.ndarray, np.ndarray]:
    """Increments (n, 3) without the effects, block by block: each error depends on one sample alone."""
    edges = np.concatenate([[recording.start.time_s], recording.imu.time_s])
    found = _parts(believed, conditions(recording, folder))
    without_w, without_f = np.empty_like(recording.imu.gyro), np.empty_like(velocity)
    for first in range(0, len(without_w), BLOCK):
        rows = slice(first, first + BLOCK)
        ends = edges[first : first + BLOCK + 1]
        interval_s = np.diff(ends)[:, None]
        applied = _at(found, 0.5 * (ends[1:] + ends[:-1]))
        indicated_w, indicated_f = recording.imu.gyro[rows] / interval_s, velocity[rows] / interval_s
        w, f = indicated_w, indicated_f
        for _ in range(SUBSTITUTIONS):
            w, f = indicated_w - _error(applied, "gyro", f, w), indicated_f - _error(applied, ACCELEROMETER, f, w)
        without_w[rows], without_f[rows] = w * interval_s, f * interval_s
    return without_w, without_f


def _parts(believed: Sequence[EffectBelief], given: Conditions) -> list[tuple[EffectPart, float]]:
    """Parts of the effects of the sensors, each with the value of its effect."""
    found = []
    for one in believed:
        effect = VOCABULARY[one.name]
        if effect.enters == "any":
            _require_driver(one, given)
        elif not possible(effect, given) or (effect.enters == "temperature" and one.value == 0.0):
            continue
        found += [(part, one.value) for part in parts(effect, one.axis, parameters(effect, one), given)]
    return found


def _at(found: Sequence[tuple[EffectPart, float]], time_s: np.ndarray) -> list[_Applied]:
    """The parts with their sizes at the instants `time_s` (n,)."""
    return [_Applied(part, value * part.weight * part.slow(time_s)) for part, value in found]


def parameters(effect: Effect, believed: EffectBelief) -> dict[str, float | str]:
    """The further parameters of a believed effect, as `parts` takes them."""
    stated = {name: getattr(believed, name) for name in (*(p.name for p in effect.parameters), "other_axis", "form")
              if name in EffectBelief.model_fields}  # fmt: skip
    if effect.enters == "temperature":
        stated["lag_s"] = believed.value
    return {name: value for name, value in stated.items() if value is not None}


def _require_driver(believed: EffectBelief, given: Conditions) -> None:
    if believed.driver not in given.columns:
        raise DataRefused(
            f"effects ({believed.name}): the recording has no column '{believed.driver}', expected what the effect is "
            "driven by; leave the effect out for this recording"
        )


def _error(found: Sequence[_Applied], sensor: str, force: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """The error (n, 3) of a sensor at specific force (n, 3) in m/s^2 and body rate (n, 3) in rad/s."""
    out = np.zeros_like(force)
    for part, size in found:
        if part.sensor == sensor:
            out[:, AXES.index(part.axis)] += size * multiplied(sensor, part.multiplier, part.axis, force, rate)
    return out


def _believed(belief: Belief, reference: Fixes | None, one: EffectBelief) -> tuple[Belief, Fixes | None]:
    """What is believed of receivers and Earth, and the reference itself, with one effect taken off."""
    section, _, what = one.name.partition(".")
    if section == "earth":
        return belief.model_copy(update={"earth": belief.earth.model_copy(update={what: True})}), reference
    if section not in ("gps", "reference"):
        return belief, reference
    table = getattr(belief, section)
    if what == "time_offset":
        table = table.model_copy(update={"time_offset_s": table.time_offset_s + one.value})
    elif what == "lever_arm":
        arm = tuple(m + one.value * (axis == one.axis) for m, axis in zip(table.lever_arm_m, AXES, strict=True))
        table = table.model_copy(update={"lever_arm_m": arm})
    elif reference is not None and reference.attitude_rad is not None:
        reference = replace(reference, attitude_rad=_mounted(reference.attitude_rad, one))
    return belief.model_copy(update={section: table}), reference


def _mounted(attitude_rad: np.ndarray, one: EffectBelief) -> np.ndarray:
    """Attitude (m, 3) of the instrument from that of a reference which is turned about a body axis against it."""
    known = np.isfinite(attitude_rad).all(axis=1)
    turn = np.zeros(3)
    turn[AXES.index(one.axis)] = VOCABULARY[one.name].si * one.value
    given = Rotation.from_euler("ZYX", attitude_rad[known][:, ::-1])
    out = np.array(attitude_rad)
    out[known] = (given * Rotation.from_rotvec(-turn)).as_euler("ZYX", suppress_warnings=True)[:, ::-1]
    return out
