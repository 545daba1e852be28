"""Wrong descriptions of a recording, before physics is looked for: what `consistency` finds, as effects of a belief.

Each contradiction has alternatives. Where there are several, or where the odds leave doubt, they are navigated, and the
one whose evidence is highest with everything uncertain integrated out is taken, if it is higher than that of what was
read; every mistake counts against it, and so does a start that it turns away from the stated attitude. A gyro's x and y
exchanged are to any navigation, to rounding, the accelerometers' exchanged and a sign of either triad turned, in a box
on its side: one mistake, not three. Then the recording is examined again as it is mended, until nothing contradicts
itself. Last, where a scale factor that no sensor has would fit best, the other sign of that column is tried, and of two
such columns each in the place of the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from ins_eval.believed import believed
from ins_eval.error_model.columns import EARTH_TERMS
from ins_eval.errors import InsEvalError
from ins_eval.estimation.case import Case, prepare, with_effects
from ins_eval.estimation.chamber import indicated
from ins_eval.estimation.clock_starts import clock_beliefs
from ins_eval.estimation.evidence import log_evidence, reduce
from ins_eval.estimation.stated_start import log_prior_of_start
from ins_eval.estimation.wrong_description import WrongDescription
from ins_eval.recording import PARKED, ChamberReadings, Recording, consistency
from ins_eval.recording.belief import Belief, EffectBelief
from ins_eval.recording.consistency.alternatives import AXIS_PRIOR, BEYOND_DOUBT, COUNTED, Finding, mistakes
from ins_eval.recording.consistency.rest import check_chamber
from ins_eval.recording.mending import AXES, ENU, MAGNETIC, SENSORS, mended, mended_chamber
from ins_eval.units import DEG, DEG_PER_H, PPM, STANDARD_GRAVITY

REFUTED = "navigated, what was read is no less probable"
TURNS = 4  # units, order, velocity and a clock may all be wrong
UNITS = {  # what was read over what is right
    "gyro": {1.0 / DEG: "deg", 1.0 / DEG_PER_H: "deg/h", DEG: "rad, read as deg"},
    "accelerometer": {1.0 / STANDARD_GRAVITY: "g", 1e3 / STANDARD_GRAVITY: "mg", STANDARD_GRAVITY: "m/s^2, read as g"},
}
SAME_UNIT = 1e-3  # of a factor
# Of what a column shows: one that is off by less is its own. Another's is off by 1, its opposite by 2; turned and
# exchanged ones of real and simulated logs seemed to be off by 0.6 to 3.5, sound ones at the right clock by up to 0.3.
HALF = 0.5
EAST_NORTH = np.array([[0.0, 1.0], [1.0, 0.0]])


@dataclass(frozen=True, eq=False)
class _Changes:
    """What makes the right triads of those read (3, 3), and what else is to be mended; `why` by what it changes."""

    gyro: np.ndarray
    accelerometer: np.ndarray
    others: tuple[EffectBelief, ...] = ()
    why: tuple[tuple[str, Finding], ...] = ()

    @property
    def described(self) -> list[WrongDescription]:
        why = dict(self.why)
        of_sensors = [(sensor, one) for sensor in SENSORS for one in _of_matrix(sensor, getattr(self, sensor))]
        return [_wrong(one, why[key]) for key, one in (*of_sensors, *((one.name, one) for one in self.others))]

    def on(self, recording: Recording) -> Recording:
        effects = [one.effect for one in self.described]
        return replace(recording, belief=_with_clocks(with_effects(recording.belief, effects)))


def wrong_descriptions(recording: Recording) -> tuple[list[WrongDescription], list[Finding] | None]:
    """What the description of a recording has wrong, as far as its parts tell, and what `consistency` finds beside it.

    The latter is None where that was not looked at.
    """
    changes = _Changes(np.eye(3), np.eye(3))
    if recording.imu is None:
        return [], None
    for _ in range(TURNS):
        here = changes.on(recording)
        found = consistency.findings(mended(here))
        best = None
        for k, one in enumerate(found):
            if one.decided and (options := list(_options(one, changes))):
                best = _best(recording, changes, one, options)
                if best is not changes:
                    break
                found[k] = replace(one, log_odds=0.0, seen=f"{one.seen}; {REFUTED}")
        if best is None or best is changes:
            return changes.described, found
        changes = best
    return changes.described, None


def wrong_columns(recording: Recording, case: Case) -> list[WrongDescription]:
    """What is wrong with a column of sensors that the parts of a recording do not tell, and its navigation does.

    `case` is the recording as it was read. What a column of wrong sign or place indicates is off by about as much as it
    is, a scale factor error beyond any sensor's. At a wrong instant any column may seem to be wrong, and so may a gyro
    where the Earth is believed to stand still. So it must be also where clocks are brought together as the motion
    tells, or where no term of the Earth is left out, if that is more probable. Put right, the recording must be more
    probable beyond doubt, and no column of it may seem to be wrong.
    """
    if not _beyond_sensors(case):
        return []
    others = (*clock_beliefs(case), *_left_out(recording.belief))
    around = {(): case} | {one: _navigated(_believing(recording, one)) for one in others}
    heights = {one: _height(navigated) for one, navigated in around.items()}
    likeliest = max(heights, key=heights.__getitem__)
    tried = _beyond_sensors(around[likeliest] or case)
    lead, chosen, right = -np.inf, None, []
    for one in _what_else(tried):
        turned = [_navigated(_believing(recording, (*known, one))) for known in {(), likeliest}]
        height = max(map(_height, turned)) - heights[likeliest]
        if height > lead:
            lead, chosen, right = height, one, turned
    if chosen is None or not lead > BEYOND_DOUBT or all(one is None or _beyond_sensors(one) for one in right):
        return []
    seeming = [one for one in tried if one[0] == chosen.sensor]
    sensor, axis, scale = next((one for one in seeming if one[1] == chosen.axis), seeming[0])
    done = f"the sign of {chosen.axis} turned"
    if chosen.other_axis is not None:
        done = f"{chosen.axis} and {chosen.other_axis} exchanged"
    seen = (
        f"{sensor} {axis}: a scale factor that is off by {scale:+.2g} would fit best, which no sensor has; with "
        f"{done} the fixes agree"
    )
    return [WrongDescription(chosen, lead, seen)]


def _left_out(belief: Belief) -> list[tuple[EffectBelief, ...]]:
    """The terms of the Earth that a belief leaves out, as effects that put them in: one set of all, or none."""
    terms = tuple(EffectBelief(name=f"earth.{one}", value=1.0) for one in EARTH_TERMS if not getattr(belief.earth, one))
    return [terms] if terms else []


def _believing(recording: Recording, effects: Sequence[EffectBelief]) -> Recording:
    return replace(recording, belief=with_effects(recording.belief, effects))


def _what_else(tried: Sequence[tuple[str, str, float]]) -> Iterator[EffectBelief]:
    """What columns may be that are none of their axes: of the other sign, or two of a sensor exchanged.

    What one column of a sensor has wrong another may seem to have, whose motion is alike: each sign of it is tried.
    """
    for sensor in dict.fromkeys(sensor for sensor, _, _ in tried):
        for axis in AXES:
            yield EffectBelief(name="recording.axis_sign", axis=axis, value=-1.0, sensor=sensor)
    for (sensor, axis, _), (of, other, _) in combinations(tried, 2):
        if of == sensor:
            yield EffectBelief(name="recording.axes_exchanged", axis=axis, other_axis=other, value=1.0, sensor=sensor)


def _beyond_sensors(case: Case) -> list[tuple[str, str, float]]:
    """Sensor and axis of each scale factor error that would fit beyond doubt, and is more than `HALF`.

    Each alone beside the arms to the antennas, however long they are: what these show where it turns a gyro does, too.
    """
    if case.believed is None or case.kind in PARKED:
        return []
    arms = [one.column for one in case.candidates if one.name.endswith(".lever_arm")]
    ones = [case.member(f"{sensor}.scale", axis, {}) for sensor in SENSORS for axis in AXES]
    columns = [*arms, *(one.column for one in ones)]
    left = reduce(case.whitened(columns, np.zeros(len(case.noise.free)), case.blocks), len(case.nuisances))
    n = len(arms)
    across = np.linalg.pinv(left.normal[:n, :n], hermitian=True) @ left.normal[:n, n:]
    normal = np.maximum(np.diag(left.normal)[n:] - (left.normal[:n, n:] * across).sum(axis=0), 1e-300)
    projection = left.projection[n:] - across.T @ left.projection[:n]
    shares = PPM * projection / normal * np.array([one.nominal for one in ones])
    return [
        (one.name.partition(".")[0], str(one.axis), float(share))
        for one, share, gain in zip(ones, shares, 0.5 * projection**2 / normal, strict=True)
        if gain > BEYOND_DOUBT and abs(share) > HALF
    ]


def wrong_descriptions_of_chamber(
    readings: ChamberReadings, belief: Belief, name: str, folder: str | Path = "."
) -> list[WrongDescription]:
    """The same of an accelerometer in a chamber: unit and sign of its output."""
    shown_g = indicated(*mended_chamber(readings, belief, name), folder) / STANDARD_GRAVITY
    found = next(check_chamber(readings.input_g, shown_g), None)
    if found is None:
        return []
    size = np.abs(found.factor) * np.eye(3)
    if found.factor < 0.0:
        size[AXES.index(readings.axis or "x")] *= -1.0
    return [_wrong(one, found) for one in _of_matrix("accelerometer", size)]


def _wrong(effect: EffectBelief, found: Finding) -> WrongDescription:
    sigma = found.late[1] if found.late else found.jump[2] if found.jump else 0.0
    if found.turned is not None:
        sigma = found.turned[1] / DEG
    return WrongDescription(effect, float(np.nan_to_num(found.log_odds, posinf=COUNTED)), found.seen, sigma)


def _best(recording: Recording, read: _Changes, found: Finding, options: Sequence[_Changes]) -> _Changes | None:
    """The option that is the most probable once navigated, or what was `read`; None where none can be navigated."""
    if len(options) == 1 and found.log_odds > BEYOND_DOUBT:
        return options[0]
    heights = [_posterior(one, recording) for one in options]
    if max(heights) == -np.inf:  # none can be navigated: its odds alone decide
        return options[0] if found.log_odds > BEYOND_DOUBT else None
    lead = max(heights) - _posterior(read, recording)
    if not lead > 0.0:
        return read
    best = options[int(np.argmax(heights))]
    above = f"{lead:.0f} nats above what was read" if np.isfinite(lead) else "and what was read cannot be"
    seen = f"{found.seen}; of {len(options)} that were navigated what is named is the most probable, {above}"
    proved = replace(found, log_odds=max(found.log_odds, lead), seen=seen)
    return replace(best, why=tuple((what, proved if one is found else one) for what, one in best.why))


def _posterior(changes: _Changes, recording: Recording) -> float:
    """log evidence of a recording so mended, and the log prior of so many mistakes, those of its start among them."""
    mended_so = changes.on(recording)
    case = _navigated(mended_so)
    if (height := _height(case)) == -np.inf:
        return height
    with np.errstate(all="ignore"):
        try:
            return height + AXIS_PRIOR * len(changes.described) + log_prior_of_start(mended_so, case)
        except (ArithmeticError, np.linalg.LinAlgError, ValueError):
            return -np.inf


def _navigated(recording: Recording) -> Case | None:
    """The recording under its belief, None where it cannot be navigated: a wrong sign makes any solution absurd."""
    try:
        with np.errstate(all="ignore"):
            return prepare(believed(recording), recording.folder)
    except (InsEvalError, ArithmeticError, np.linalg.LinAlgError, ValueError):
        return None


def _height(case: Case | None) -> float:
    """log evidence at the expected noise, -inf of what cannot be navigated or comes to no number."""
    if case is None:
        return -np.inf
    with np.errstate(all="ignore"):
        try:
            height = log_evidence(case.whitened([], np.zeros(len(case.noise.free)), case.blocks))
        except (ArithmeticError, np.linalg.LinAlgError, ValueError):
            return -np.inf
    return height if np.isfinite(height) else -np.inf


def _options(found: Finding, changes: _Changes) -> Iterator[_Changes]:
    """What would end a contradiction, likeliest first; nothing where it is no matter of this family."""
    if found.key == "axes":
        for force, rate in found.orders:
            moved = {"gyro": rate, "accelerometer": force}
            new = {sensor: turn @ getattr(changes, sensor) for sensor, turn in moved.items()}
            because = tuple((s, found) for s, turn in moved.items() if not np.array_equal(turn, np.eye(3)))
            yield replace(changes, **new, why=(*changes.why, *because))
    elif found.key in ("gyro.unit", "accelerometer.unit"):
        sensor = found.key.partition(".")[0]
        scaled = {sensor: found.factor * getattr(changes, sensor)}
        yield replace(changes, **scaled, why=(*changes.why, (sensor, found)))
    elif (one := _of_fixes(found)) is not None and one.name not in dict(changes.why):
        yield replace(changes, others=(*changes.others, one), why=(*changes.why, (one.name, found)))


def _with_clocks(belief: Belief) -> Belief:
    """A belief whose tables state by how much stamps are late, in place of its effects."""
    for one in belief.effects:
        table, _, what = one.name.partition(".")
        if what == "time_offset":
            stated = getattr(belief, table)
            late = stated.model_copy(update={"time_offset_s": stated.time_offset_s + one.value})
            others = tuple(other for other in belief.effects if other is not one)
            belief = belief.model_copy(update={table: late, "effects": others})
    return belief


def _of_fixes(found: Finding) -> EffectBelief | None:
    if found.late is not None:
        return EffectBelief(name=found.key.removesuffix("_s"), value=found.late[0])
    if found.key == "velocity.unit":
        return EffectBelief(name="recording.gps_velocity", value=float(f"{1.0 / found.factor:.6g}"))
    if found.key == "velocity.axes" and found.matrix is not None:
        if np.array_equal(found.matrix, np.diag([1.0, 1.0, -1.0])):
            return EffectBelief(name="recording.gps_velocity", axis="down", value=-1.0)
        if np.array_equal(found.matrix[:2, :2], EAST_NORTH):  # level motion does not tell the third
            return EffectBelief(name="recording.reference_frame", value=0.0, frame_found=ENU)
    if found.turned is not None:
        return EffectBelief(name="recording.reference_frame", value=-found.turned[0] / DEG, frame_found=MAGNETIC)
    if found.jump is not None:
        at_s, late_s, _ = found.jump
        return EffectBelief(name="recording.clock_step", value=-late_s, at_s=at_s)
    return None


def _of_matrix(sensor: str, matrix: np.ndarray) -> list[EffectBelief]:
    """A unit, columns that are exchanged and signs, in the order in which they are mended."""
    found = []
    size = float(np.abs(matrix).max())
    turn = np.rint(matrix / size)
    for k, axis in enumerate(AXES):
        j = int(np.argmax(np.abs(turn[k])))
        if j == k:
            continue
        value = min((1.0, -1.0), key=lambda value: mistakes(turn @ _exchange(k, j, value)))
        found.append(
            EffectBelief(name="recording.axes_exchanged", axis=axis, other_axis=AXES[j], value=value, sensor=sensor)
        )
        turn = turn @ _exchange(k, j, value)  # what is left to be done after it; its inverse is itself
    found += [
        EffectBelief(name="recording.axis_sign", axis=AXES[k], value=-1.0, sensor=sensor)
        for k in range(3)
        if turn[k, k] < 0.0
    ]
    if abs(size - 1.0) > SAME_UNIT:
        unit = next((name for factor, name in UNITS[sensor].items() if abs(factor * size - 1.0) < SAME_UNIT), None)
        value = float(f"{1.0 / size:.6g}")
        found.append(EffectBelief(name="recording.unit", value=value, sensor=sensor, unit_found=unit))
    return found


def _exchange(k: int, j: int, value: float) -> np.ndarray:
    """The matrix (3, 3) that exchanges two columns, and turns the sign of both for a value of -1."""
    out = np.eye(3)
    out[[k, j]] = value * out[[j, k]]
    return out
