"""Recordings that are only planned: what the belief would read on them, without noise.

A plan is a motion with a temperature; the increments are those with which the believed equations navigate along it,

    over each sample:  C_0^T exp(w_in dt x) C_1  and  C^T (dv - (g - (w_in + w_ie) x v) dt), C by Simpson's rule,

with the terms of the Earth that the belief contains. Sums A of such a recording say what an experiment would see.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from ins_eval.earth import EARTH_RATE, gravity, radii
from ins_eval.error_model.null import Believed, as_told, triad
from ins_eval.navigation import samples
from ins_eval.profile import HeightChange, Place, Profile, SpeedChange, Thermal, Turn
from ins_eval.recording import PARKED, ChamberReadings, Fixes, Imu, Recording, Start
from ins_eval.recording.belief import AxisBelief, Belief, EarthBelief, ScaleBelief
from ins_eval.thermal import imu_temperature, lagged, thermometer_step
from ins_eval.trajectory import Trajectory
from ins_eval.units import DEG, MINUTE

STILL_HZ = 4.0  # one step of the mechanization an epoch
TURNED_HZ = 10.0  # of a box between faces: with 4 Hz what a tumble tells is 1.4 % less, with 20 Hz the same to 1e-6
MOVING_HZ = 8.0  # a turn that begins at once is integrated to the square of the step
SLEW_S = 20.0  # from one face to the next
SKY_DEG = 40.0  # of roll, beyond which the receiver sees too little of the sky
GROUND_C = 20.0
MOST_LATITUDE_DEG = 80.0
READING_S = 60.0  # of a chamber
CHAMBER_LAG_S = 300.0
BETWEEN_RUNS_S = 600.0
_GAMMA = 1e5  # pulse/(g s) of a chamber's readings: cancels

LEVEL = Rotation.identity()
UPSIDE_DOWN = Rotation.from_euler("x", 180.0, degrees=True)
HEADINGS = tuple(Rotation.from_euler("z", angle, degrees=True) for angle in (0.0, 90.0, 180.0, 270.0))
FACES = tuple(
    Rotation.from_euler(axis, angle, degrees=True)
    for axis, angle in (("x", 0.0), ("x", 90.0), ("x", 180.0), ("x", 270.0), ("y", 90.0), ("y", -90.0))
)


@dataclass(frozen=True, eq=False)
class Motion:
    """States at the edges of the samples, the first being the start: n + 1 rows, radians, metres, m/s."""

    time_s: np.ndarray
    latitude_rad: np.ndarray
    longitude_rad: np.ndarray
    height_m: np.ndarray
    velocity_n: np.ndarray
    attitude: Rotation


def parked(start: Start, faces: Sequence[Rotation], dwell_s: float) -> Motion:
    """The box on each of `faces` in turn, `dwell_s` each; a face is a turn from level at the heading of `start`."""
    level = Rotation.from_euler("z", start.attitude_rad[2])
    end_s = dwell_s * len(faces)
    interval_s = 1.0 / (TURNED_HZ if len(faces) > 1 else STILL_HZ)
    time_s = np.arange(0.0, end_s + 0.5 * interval_s, interval_s)
    knots, there = [0.0], [faces[0]]
    for k, (before, after) in enumerate(zip(faces[:-1], faces[1:], strict=True), start=1):
        knots += [k * dwell_s, k * dwell_s + SLEW_S]
        there += [before, after]
    knots.append(end_s)
    there.append(faces[-1])
    attitude = Slerp(knots, Rotation.concatenate([level * face for face in there]))(np.minimum(time_s, end_s))
    one = np.ones(time_s.size)
    return Motion(
        time_s,
        start.latitude_rad * one,
        start.longitude_rad * one,
        start.height_m * one,
        np.zeros((time_s.size, 3)),
        attitude,
    )


def profile(
    start: Start,
    duration_s: float,
    speed: Sequence[tuple[float, float, float]],
    height: Sequence[tuple[float, float, float]] = (),
    turn: Sequence[tuple[float, float, float]] = (),
    ground_c: float = GROUND_C,
    time_constant_s: float = 1800.0,
) -> Profile:
    """A profile from the place of `start`: speeds (from_s, to_s, m/s), heights above it, turns."""
    bound = MOST_LATITUDE_DEG
    return Profile(
        name="planned",
        duration_s=duration_s,
        start=Place(
            latitude_deg=float(np.clip(start.latitude_rad / DEG, -bound, bound)),
            longitude_deg=start.longitude_rad / DEG,
            height_m=start.height_m,
            heading_deg=start.attitude_rad[2] / DEG,
            stand_s=0.0,
        ),
        speed=tuple(SpeedChange(from_s=a, to_s=b, to_mps=v) for a, b, v in speed),
        height=tuple(HeightChange(from_s=a, to_s=b, to_m=start.height_m + h) for a, b, h in height),
        turn=tuple(Turn(at_s=a, by_deg=by, bank_deg=bank) for a, by, bank in turn),
        thermal=Thermal(ground_c=ground_c, time_constant_s=time_constant_s, self_heating_c=10.0),
    )


def moving(planned: Profile, banked: bool) -> tuple[Motion, np.ndarray]:
    """The motion of a profile and the temperature (n,) of the box at the samples; a car does not bank."""
    trajectory = Trajectory(planned)
    time_s = np.arange(0.0, planned.duration_s + 0.5 / MOVING_HZ, 1.0 / MOVING_HZ)
    truth = trajectory.truth(time_s)
    roll, pitch, heading = truth.attitude_rad.T
    attitude = Rotation.from_euler("ZYX", np.column_stack([heading, pitch, roll if banked else 0.0 * roll]))
    motion = Motion(time_s, truth.latitude_rad, truth.longitude_rad, truth.height_m, truth.velocity_n, attitude)
    felt = imu_temperature(trajectory)
    return motion, np.interp(time_s[1:], felt.time_s, felt.temperature_c)


def increments(motion: Motion, earth: EarthBelief) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (n, 3) in rad and velocity (n, 3) in m/s over the samples, body axes, as the module's text says."""
    dt = np.diff(motion.time_s)[:, None]

    def middle(values: np.ndarray) -> np.ndarray:
        return 0.5 * (values[1:] + values[:-1])

    latitude, height, v = middle(motion.latitude_rad), middle(motion.height_m), middle(motion.velocity_n)
    meridian, transverse = (radius + height for radius in radii(latitude))
    s, c = np.sin(latitude), np.cos(latitude)
    ie = float(earth.rotation) * EARTH_RATE * np.column_stack([c, 0.0 * s, -s])
    en = float(earth.transport_rate) * np.column_stack(
        [v[:, 1] / transverse, -v[:, 0] / meridian, -v[:, 1] * s / c / transverse]
    )
    before, after = motion.attitude[:-1], motion.attitude[1:]
    turned = (before.inv() * Rotation.from_rotvec((ie + en) * dt) * after).as_rotvec()
    gyro = turned - np.cross(turned, np.gradient(turned, axis=0)) / 12.0  # integral of the body rate, which may cone
    halfway = before * Rotation.from_rotvec(0.5 * (before.inv() * after).as_rotvec())
    down = gravity(
        latitude if earth.gravity_latitude else np.full_like(latitude, 0.25 * np.pi),
        height if earth.gravity_height else 0.0 * height,
    )
    free = -np.cross(en + 2.0 * float(earth.coriolis) * ie, v)
    free[:, 2] += down
    force = np.diff(motion.velocity_n, axis=0) - free * dt
    edges = before.inv().apply(force) + after.inv().apply(force)
    return gyro, (edges + 4.0 * halfway.inv().apply(force)) / 6.0


def recording(name: str, kind: str, motion: Motion, temperature_c: np.ndarray, like: Believed) -> Recording:
    """What the belief of `like` would record on `motion`, its output in the form of `like`.

    `temperature_c` (n,) or (n, 3) at the samples is read in the steps of the thermometer of `like`, if it has one.
    """
    other = like.recording
    belief = other.belief.model_copy(update={"effects": ()})
    gyro, velocity = increments(motion, belief.earth)
    dt = np.diff(motion.time_s)[:, None]
    heading, pitch, roll = motion.attitude[0].as_euler("ZYX", suppress_warnings=True)
    start = replace(
        like.start,
        time_s=0.0,
        latitude_rad=float(motion.latitude_rad[0]),
        longitude_rad=float(motion.longitude_rad[0]),
        height_m=float(motion.height_m[0]),
        velocity_n=tuple(float(v) for v in motion.velocity_n[0]),
        attitude_rad=(float(roll), float(pitch), float(heading)),
        attitude_sigma_rad=like.start.attitude_sigma_rad or tuple(float(s) for s in like.attitude_sigma_n),
        still_until_s=None,
    )
    given = None
    if other.imu.temperature_c is not None:
        step = thermometer_step(other.imu.temperature_c)
        given = np.round(temperature_c / step) * step if step > 0.0 else temperature_c
    fixes = None if kind in PARKED else _fixes(motion, other)
    in_pulses = other.imu.accelerometer_form == "pulse"
    imu = Imu(
        time_s=motion.time_s[1:],
        gyro=gyro + np.asarray(belief.gyro.bias_radps) * dt,
        accelerometer=velocity if in_pulses else velocity + np.asarray(belief.accelerometer.bias_mps2) * dt,
        accelerometer_form="increment",
        temperature_c=given,
        height_baro_m=motion.height_m[1:],
    )
    by_reference = other.gps is None and other.reference is not None
    made = Recording(
        name=name,
        kind=kind,
        start=start,
        imu=imu,
        gps=None if by_reference else fixes,
        reference=fixes if by_reference else None,
        belief=belief,
    )
    return _in_pulses(made, like) if in_pulses else made


def _in_pulses(made: Recording, like: Believed) -> Recording:
    """The same in pulses; force is linear in the output at a given temperature, so two values give the inverse."""
    dt = made.interval_s
    counts = np.empty_like(made.imu.accelerometer)
    for axis, (model, given) in enumerate(zip(triad(like), samples(as_told(made)), strict=True)):
        none, some = (model.specific_force(replace(given, output=np.full(dt.size, output))) for output in (0.0, _GAMMA))
        counts[:, axis] = (made.imu.accelerometer[:, axis] - none * dt) / (some - none) * _GAMMA
    return replace(made, imu=replace(made.imu, accelerometer=counts, accelerometer_form="pulse"))


def _fixes(motion: Motion, like: Recording) -> Fixes:
    """A fix every second at the believed antenna, on the believed clock; with attitude where `like` has it."""
    source, belief = (like.gps, like.belief.gps) if like.gps is not None else (like.reference, like.belief.reference)
    if source is None:
        belief = like.belief.gps
    every = slice(None, None, int(MOVING_HZ))
    arm_n = motion.attitude.apply(belief.lever_arm_m)
    swing_n = np.gradient(arm_n, motion.time_s, axis=0)
    meridian, transverse = radii(motion.latitude_rad)
    angles = motion.attitude.as_euler("ZYX", suppress_warnings=True)[:, ::-1]
    known = source is not None and source.attitude_rad is not None
    return Fixes(
        time_s=(motion.time_s + belief.time_offset_s)[every],
        latitude_rad=(motion.latitude_rad + arm_n[:, 0] / (meridian + motion.height_m))[every],
        longitude_rad=(
            motion.longitude_rad + arm_n[:, 1] / ((transverse + motion.height_m) * np.cos(motion.latitude_rad))
        )[every],
        height_m=(motion.height_m - arm_n[:, 2])[every],
        velocity_n=(motion.velocity_n + swing_n)[every],
        valid=(np.abs(angles[:, 0]) <= SKY_DEG * DEG)[every],
        attitude_rad=angles[every] if known else None,
    )


def ramps(
    rates_c_per_min: Sequence[float], low_c: float, high_c: float, soak_s: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Temperature that goes down and up in turn, a leg for each rate, with soaks between: instants (s) and degC."""
    time_s, given = [0.0], [high_c]
    for k, rate in enumerate(rates_c_per_min):
        time_s.append(time_s[-1] + MINUTE * (high_c - low_c) / rate)
        given.append(high_c if k % 2 else low_c)
        if soak_s:
            time_s.append(time_s[-1] + soak_s)
            given.append(given[-1])
    return np.array(time_s), np.array(given)


def chamber(axis: str, schedule: Sequence[tuple[float, np.ndarray, np.ndarray]]) -> ChamberReadings:
    """Readings of one accelerometer: a run for each (input in g, instants, degC) of `schedule`."""
    columns: dict[str, list[np.ndarray]] = {name: [] for name in ("time_s", "run", "g", "rate", "reading_c")}
    begin = 0.0
    for run, (input_g, knots_s, given) in enumerate(schedule):
        t = np.arange(READING_S, knots_s[-1], READING_S)
        air = np.interp(t, knots_s, given)
        columns["time_s"].append(begin + t)
        columns["run"].append(np.full(t.size, run))
        columns["g"].append(np.full(t.size, input_g))
        columns["rate"].append(MINUTE * np.gradient(air, t))
        columns["reading_c"].append(lagged(t, air, CHAMBER_LAG_S))
        begin += float(t[-1]) + BETWEEN_RUNS_S
    time_s, run, input_g, rate, given = (np.concatenate(column) for column in columns.values())
    return ChamberReadings(time_s, run, input_g, rate, given, _GAMMA * input_g, axis=axis)


def chamber_belief(belief: Belief, axis: str) -> Belief:
    """The same with an accelerometer of plain scale, in which the readings of `chamber` are made."""
    plain = AxisBelief(scale=ScaleBelief(gamma=_GAMMA))
    return belief.model_copy(
        update={"accelerometer": belief.accelerometer.model_copy(update={axis: plain}), "effects": ()}
    )
