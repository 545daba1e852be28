"""The belief through the full mechanization: compensated increments, the start, and the solution they give."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from ins_eval.alignment import align
from ins_eval.compensation.file import believed_model
from ins_eval.earth import EARTH_RATE
from ins_eval.effects import turned_start, without_effects
from ins_eval.effects.reading import thermometers
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.error_model.geometry import turn
from ins_eval.errors import DataRefused
from ins_eval.initialization import (
    ATTITUDE,
    HEADING_SIGMA_RAD,
    TILT_SIGMA_RAD,
    Initialization,
    find,
    standstills,
    stated_heading_sigma,
    track,
)
from ins_eval.navigation import beginning, compensate, height_aid, samples, standstill_to_align_on, without_bias
from ins_eval.recording import PARKED, Start
from ins_eval.recording.mending import mended
from ins_eval.strapdown import SAMPLES_PER_STEP, Solution, navigate_arcs
from ins_eval.units import ARCSEC, DEG, DEG_PER_H, HOUR, STANDARD_GRAVITY, UG

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ins_eval.compensation import CompensationModel
    from ins_eval.recording import Recording
    from ins_eval.recording.belief import Belief
    from ins_eval.recording.stillness import Stretch

LARGEST_ATTITUDE_RAD = 10.0 * DEG  # 1 - cos of it is 1.5 %, which does not matter more than noise: by reasoning
UNSTATED_LEVEL_SIGMA_RAD = 0.5 * DEG
UNSTATED_HEADING_SIGMA_RAD = 2.0 * DEG
LEAST_LEVEL_SIGMA_RAD = 5.0 * ARCSEC  # of a vehicle that settles after it was levelled
# usual sizes of a misalignment that nobody looked for, and the most that one is; by reasoning
LEANING, MOST_LEANING_RAD = 10.0, 0.02
WIDE_POSITION_M, WIDE_VELOCITY_MPS = 30.0, 3.0  # of a start that the fixes are to find
SWAY_MPS = 2e-3  # velocity of a vehicle that stands, at one instant


@dataclass(frozen=True, eq=False)
class Believed:
    """One recording as its belief makes it: increments corrected and compensated, from a known state on.

    `gyro` and `velocity` (n, 3) in rad and m/s over the samples that end at `time_s` (n,); `attitude_sigma_n` (3,) rad
    is one sigma of the start's attitude about north, east and down; `aid_m` (n,) the height that damps the solution.
    `arcs` are the states at which it begins afresh (`arcs`), at the ends of steps; none where errors stay small.
    `stands` are the stretches of a parked recording between which somebody moves the unit.
    `gyro_bias` in rad/s and `force_bias` in m/s^2 (3,) are taken off as it is navigated: a day at 200 Hz has no room
    for the same increments twice. `found` is what rest, motion and fixes showed of the start, if that was asked.
    """

    recording: Recording
    start: Start
    time_s: np.ndarray
    gyro: np.ndarray
    velocity: np.ndarray
    aid_m: np.ndarray
    attitude_sigma_n: np.ndarray
    folder: str | Path = "."
    arcs: tuple[Start, ...] = ()
    stands: tuple[Stretch, ...] = ()
    gyro_bias: np.ndarray = field(default_factory=lambda: np.zeros(3))
    force_bias: np.ndarray = field(default_factory=lambda: np.zeros(3))
    found: Initialization | None = None

    def increments(self, first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
        """Angles, rad, and velocities, m/s, of the samples from `first` to `last`, the biases taken off."""
        if not (self.gyro_bias.any() or self.force_bias.any()):
            return self.gyro[first:last], self.velocity[first:last]
        time_s = self.time_s[first:last]
        before_s = self.time_s[first - 1 : last - 1] if first else np.append(self.start.time_s, time_s[:-1])
        interval_s = (time_s - before_s)[:, None]
        gyro, velocity = self.gyro[first:last], self.velocity[first:last]
        return gyro - interval_s * self.gyro_bias, velocity - interval_s * self.force_bias

    def without_increments(self, read: Recording) -> Believed:
        """The same for those who ask what was believed; its recording holds the gyros of the one that was `read`."""
        none = np.zeros((0, 3))
        recording = replace(self.recording, imu=replace(self.recording.imu, gyro=read.imu.gyro))
        return replace(self, recording=recording, gyro=none, velocity=none, aid_m=none[:, 0], found=None)


def believe(recording: Recording, folder: str | Path = ".") -> Believed:
    """Mend a recording, compensate it, take off the effects it believes in, align where it gives no attitude.

    Where the gyros do not find north either, the attitude is found from rest, motion and fixes (`initialization`).

    Where the table [earth] leaves the rotation out, a standstill gives the level alone, also with `earth.rotation`
    among the effects: both are to be compared from one start, and north found on these gyros would be of the one.

    Raises DataRefused where nothing says what a pulse is worth, or where there is nothing to align on.
    """
    finds_north = recording.belief.earth.rotation
    recording, compensated = _compensated(recording, folder)
    gyro, velocity = without_bias(recording, compensated)
    imu, belief = recording.imu, recording.belief
    start, sigma_n, shown = recording.start, None, None
    stand = beginning(recording, compensated) if finds_north else standstill_to_align_on(recording)
    if isinstance(stand, Initialization):  # what it found of the biases stays in: it is what a diagnosis looks for
        start, sigma_n, shown, stand = stand.start, _found_sigma(stand, recording), stand, None
    elif stand is not None:
        rows = slice(*np.searchsorted(imu.time_s, [stand.start_s + 1e-6, stand.end_s + 1e-6]))
        at = replace(start, time_s=float(imu.time_s[rows.start - 1]) if rows.start else start.time_s)
        if finds_north:
            found = align(imu.time_s[rows], gyro[rows], velocity[rows], at)
            start, sigma_n = found.start, _aligned_sigma(recording, found)
        else:
            start, sigma_n = _levelled(recording, velocity[rows], float(imu.time_s[rows][-1]))
    elif start.attitude_rad is None:
        raise DataRefused(
            f"{recording.name}: the attitude of the start is unknown and there is no standstill to find it on; "
            "give attitude_deg in [start]"
        )
    if stand is not None:  # the next disturbance may begin where it ends
        start = replace(start, velocity_sigma_mps=max(start.velocity_sigma_mps, SWAY_MPS))
    start = turned_start(start, belief)
    sigma_n = _given_sigma(start) if sigma_n is None else sigma_n
    return replace(_begun(recording, start, (gyro, velocity), sigma_n, folder), found=shown)


def _found_sigma(found: Initialization, recording: Recording) -> np.ndarray:
    """One sigma (3,) of an attitude that was found, with what accelerometers that lean across do to its heading.

    The initialization knows their offsets and scales; it would take one that leans for another heading, unless that
    is stated.
    """
    if recording.start.attitude_rad is not None:
        return found.sigmas[ATTITUDE]
    coarse = max(1.0, recording.belief.accelerometer.bias_sigma_ug / VOCABULARY["accelerometer.bias"].nominal)
    leaning = min(LEANING * coarse * 1e-6 * VOCABULARY["accelerometer.misalignment"].nominal, MOST_LEANING_RAD)
    return np.hypot(found.sigmas[ATTITUDE], [0.0, 0.0, leaning])


def begin_afresh(
    recording: Recording, folder: str | Path = ".", shown: Initialization | None = None
) -> tuple[Believed, Initialization, Solution]:
    """The same from its first sample on, how its state was found, and the path that rest, motion and fixes show.

    For what is navigated in arcs (`begun_at`). `shown` is what these showed already.
    """
    judged = _judged(recording)
    known = shown if judged is recording else None
    recording, compensated = _compensated(judged, folder)
    gyro, velocity = without_bias(recording, compensated)
    found = find(recording, gyro, velocity) if known is None else known
    turned = recording.kind not in PARKED or len(standstills(recording)) > 1
    path = track(recording, found, gyro, velocity) if turned else found.path
    return _wide(recording, start_at(path, recording.start.time_s), (gyro, velocity), folder), found, path


def begun_at(recording: Recording, start: Start, folder: str | Path = ".") -> Believed:
    """The same from a state that is known as far as a first guess is: the rest is left to the fixes.

    Where a start counts that is stated with sigmas (`begins_as_stated`), it is what is known.
    """
    recording, compensated = _compensated(_judged(recording), folder)
    return _wide(recording, start, without_bias(recording, compensated), folder)


def _judged(recording: Recording) -> Recording:
    """Without a reference that knows attitudes alone: a coarse unit's own is made of the gyros that are judged."""
    known = recording.reference
    if known is None or (known.valid & np.isfinite([known.latitude_rad, *known.velocity_n.T]).any(axis=0)).any():
        return recording
    return replace(recording, reference=None)


def _wide(recording: Recording, start: Start, increments, folder: str | Path) -> Believed:
    if begins_as_stated(recording, start):
        turned = turned_start(recording.start, recording.belief)
        return _begun(recording, turned, increments, _given_sigma(turned), folder)
    start = replace(start, position_sigma_m=WIDE_POSITION_M, velocity_sigma_mps=WIDE_VELOCITY_MPS)
    # no fix shows the heading of what stands
    heading = stated_heading_sigma(recording) if recording.kind in PARKED else HEADING_SIGMA_RAD
    sigma_n = np.array([TILT_SIGMA_RAD, TILT_SIGMA_RAD, heading])
    return _begun(recording, start, increments, sigma_n, folder)


def begins_as_stated(recording: Recording, found: Start) -> bool:
    """Whether a recording in arcs begins in what is believed of its start, and not in a first guess.

    Not where the attitude that was `found` is so far from it that a linear error model could not follow. Else what is
    stated counts for a parked unit, and for another where errors would stay small if it were right.
    """
    start = turned_start(recording.start, recording.belief)
    if start.attitude_rad is None or start.attitude_sigma_rad is None:
        return False
    if np.linalg.norm(turn(start.attitude_rad, found.attitude_rad)) >= LARGEST_ATTITUDE_RAD:
        return False
    duration_s = float(recording.imu.time_s[-1]) - start.time_s
    return recording.kind in PARKED or stays_small(recording.belief, max(start.attitude_sigma_rad), duration_s)


def stays_small(belief: Belief, attitude_sigma_rad: float, duration_s: float) -> bool:
    """Whether stated sigmas keep the attitude within what a linear error model can follow."""
    gyro = belief.gyro.bias_sigma_deg_per_h * DEG_PER_H
    return bool(np.hypot(attitude_sigma_rad, gyro * duration_s) <= LARGEST_ATTITUDE_RAD)


def is_coarse(belief: Belief) -> bool:
    """Whether gyros are believed to turn a unit within an hour by more than a linear error model can follow."""
    return not stays_small(belief, 0.0, HOUR)


def start_at(path: Solution, time_s: float) -> Start:
    """The state of a path at an instant; before its first row that of the first, after its last that of the last."""
    return starts_at(path, [time_s])[0]


def starts_at(path: Solution, time_s: Sequence[float]) -> list[Start]:
    """The same at several instants."""
    k = np.clip(np.searchsorted(path.time_s, time_s), 1, path.time_s.size - 1)
    share = np.clip((time_s - path.time_s[k - 1]) / (path.time_s[k] - path.time_s[k - 1]), 0.0, 1.0)[:, None]
    values = np.column_stack([path.latitude_rad, path.longitude_rad, path.height_m, path.velocity_n])
    between = (1.0 - share) * values[k - 1] + share * values[k]
    before, after = (Rotation.from_quat(path.quaternion_nb[j], scalar_first=True) for j in (k - 1, k))
    attitude = Rotation.from_rotvec(share * (after * before.inv()).as_rotvec()) * before
    angles = attitude.as_euler("ZYX", suppress_warnings=True)[:, ::-1]
    return [
        Start(float(at_s), latitude, longitude, height, tuple(velocity), tuple(rolled))
        for at_s, (latitude, longitude, height, *velocity), rolled in zip(
            time_s, between.tolist(), angles.tolist(), strict=True
        )
    ]


def _compensated(recording: Recording, folder: str | Path) -> tuple[Recording, np.ndarray]:
    """The recording without the effects that it believes in, and its compensated velocity increments (n, 3)."""
    recording = mended(recording)
    return without_effects(recording, _velocity(recording, folder), folder)


def _begun(recording: Recording, start: Start, increments, sigma_n: np.ndarray, folder: str | Path) -> Believed:
    """The recording from its start on, in whole steps."""
    imu = recording.imu
    rest = slice(int(np.searchsorted(imu.time_s, start.time_s + 1e-6)), None)
    rest = slice(rest.start, rest.start + (imu.time_s.size - rest.start) // SAMPLES_PER_STEP * SAMPLES_PER_STEP)
    gyro, velocity = (np.ascontiguousarray(one[rest]) for one in increments)
    return Believed(recording, start, imu.time_s[rest], gyro, velocity, _aid(recording)[rest], sigma_n, folder)


def solve(believed: Believed) -> tuple[Solution, ...]:
    """The solution of the full mechanization, one row every step, of each arc; the height of arcs is not damped."""
    begins = [believed.start, *believed.arcs]
    edges = [*np.searchsorted(believed.time_s, [one.time_s + 1e-6 for one in begins]), believed.time_s.size]
    return navigate_arcs(
        believed.time_s,
        believed.increments,
        begins,
        edges,
        believed.aid_m,
        "free" if believed.arcs else "damped",
        earth=believed.recording.belief.earth,
    )


def _velocity(recording: Recording, folder: str | Path) -> np.ndarray:
    believed = recording.belief.accelerometer
    if recording.imu.accelerometer_form != "pulse":
        return recording.imu.accelerometer
    if any(getattr(believed, axis) is None for axis in "xyz"):
        raise DataRefused(
            f"{recording.name}: the accelerometers deliver pulses, and nothing says what a pulse is worth; expected "
            "[accelerometer.x], .y and .z in recording.toml, or --belief FILE"
        )
    return compensate(samples(as_told(recording)), _triad(recording, folder), recording.interval_s)


def as_told(recording: Recording) -> Recording:
    """The same with the temperature that its thermometers tell instead of their readings: steps would be errors."""
    imu = recording.imu
    if imu.temperature_c is None:
        return recording
    told = [one.at(imu.time_s) for one in thermometers(recording)]
    return replace(recording, imu=replace(imu, temperature_c=told[0] if len(told) == 1 else np.column_stack(told)))


def triad(believed: Believed) -> list[CompensationModel]:
    """The believed compensation of the three accelerometers of a recording in pulses."""
    return _triad(believed.recording, believed.folder)


def _triad(recording: Recording, folder: str | Path) -> list[CompensationModel]:
    return [believed_model(recording.belief, axis, folder) for axis in "xyz"]


def _aid(recording: Recording) -> np.ndarray:
    """A height for every sample to keep the solution near the truth; its own errors cancel, see `propagation`."""
    aid = height_aid(recording)
    if aid is not None:
        return aid
    for fixes, section in (
        (recording.reference, recording.belief.reference),
        (recording.gps, recording.belief.gps),
    ):
        if fixes is not None and recording.kind not in PARKED:
            known = fixes.valid & np.isfinite(fixes.height_m)
            if known.any():
                stamps = fixes.time_s[known] - section.time_offset_s
                return np.interp(recording.imu.time_s, stamps, fixes.height_m[known])
    return np.full(recording.imu.time_s.size, recording.start.height_m)


def _given_sigma(start: Start) -> np.ndarray:
    """One sigma about north, east, down of an attitude whose roll, pitch and heading have sigmas of their own."""
    if start.attitude_sigma_rad is None:
        return np.array([UNSTATED_LEVEL_SIGMA_RAD, UNSTATED_LEVEL_SIGMA_RAD, UNSTATED_HEADING_SIGMA_RAD])
    roll, pitch, heading = start.attitude_sigma_rad
    c, s = np.cos(start.attitude_rad[2]), np.sin(start.attitude_rad[2])
    return np.array([np.hypot(c * roll, s * pitch), np.hypot(s * roll, c * pitch), heading])


def _levelled(recording: Recording, velocity: np.ndarray, end_s: float) -> tuple[Start, np.ndarray]:
    """The start at the end of a standstill, level by its specific force, with the given heading; its sigma N, E, D.

    f = C_bn (0, 0, -g), so that  roll = atan2(-f_y, -f_z),  pitch = atan2(f_x, sqrt(f_y^2 + f_z^2))
    """
    start = recording.start
    if start.attitude_rad is None:
        raise DataRefused(
            f"{recording.name}: [earth] leaves the rotation out, so the gyros cannot find north, and the heading of "
            "the start is unknown; give attitude_deg in [start]"
        )
    x, y, z = -velocity.sum(axis=0)
    attitude = (float(np.arctan2(y, z)), float(np.arctan2(-x, np.hypot(y, z))), start.attitude_rad[2])
    level = max(LEAST_LEVEL_SIGMA_RAD, recording.belief.accelerometer.bias_sigma_ug * UG / STANDARD_GRAVITY)
    heading = UNSTATED_HEADING_SIGMA_RAD if start.attitude_sigma_rad is None else start.attitude_sigma_rad[2]
    standing = replace(start, time_s=end_s, velocity_n=(0.0, 0.0, 0.0), attitude_rad=attitude)
    return standing, np.array([level, level, heading])


def _aligned_sigma(recording: Recording, found) -> np.ndarray:
    """What the filter says, and what the turn-on biases did to it, which the filter cannot know."""
    belief = recording.belief
    level = np.hypot(found.level_sigma_rad, belief.accelerometer.bias_sigma_ug * UG / STANDARD_GRAVITY)
    east_rate = EARTH_RATE * np.cos(recording.start.latitude_rad)
    heading = np.hypot(found.heading_sigma_rad, belief.gyro.bias_sigma_deg_per_h * DEG_PER_H / east_rate)
    return np.array([level, level, heading])
