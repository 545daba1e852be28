"""The mechanization against truth, closed forms, linear error equations and python-ins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import pyins.strapdown
import pyins.transform
import pyins.util
import pymap3d
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from scipy.special import j1

from ins_eval.earth import EARTH_RATE, gravity, radii
from ins_eval.imu import Mission
from ins_eval.profile import Profile, load
from ins_eval.recording import Start
from ins_eval.recording.belief import EarthBelief
from ins_eval.strapdown import Solution, attitude_from_quaternion, navigate, navigate_arcs, quaternion_from_attitude
from ins_eval.trajectory import Trajectory
from ins_eval.units import DEG, DEG_PER_H, UG

FLOOR_M = 1e-4  # horizontal, zero sensor error, 8400 s at 100 Hz
FLOOR_MPS = 1e-6
FLOOR_RAD = 1e-9
SCHULER_TOLERANCE = 1e-3  # of the largest value, Earth not turning
COUPLED_TOLERANCE = 0.03  # of a Schuler formula that knows no Earth rate, where the Earth turns
LINEAR_TOLERANCE = 1e-3  # of the largest value, against the linear error equations
VERTICAL_TOLERANCE = 7e-4  # of the largest value: the aid acts one step (0.01 s) late, 3 x 0.01 s / 60 s
GROWTH_TOLERANCE = 0.02  # of the growth of a free vertical channel
CONING_TOLERANCE = 1e-4  # share of the drift of bare increments that is left at 2 Hz, sampled with 100 Hz
SCULLING_TOLERANCE = 1e-6  # of the rectified velocity, as before
THIRD_ORDER = 8.0  # 2^3; the fit of the motion is of higher order, the frame leaves a little of second
SIXTH_ORDER = 50.0  # 2^6 = 64, less for rounding and higher orders
PEER_TOLERANCE_M = 0.1  # python-ins as it is, first order in the sample
PEER_EXTRAPOLATED_TOLERANCE_M = 2e-3  # python-ins extrapolated to infinite rate
SCHULER_PERIOD_S = 84.4 * 60.0
EARTH_AT_REST = EarthBelief(rotation=False, coriolis=False)
FLAT_EARTH = EarthBelief(rotation=False, coriolis=False, transport_rate=False)
PLACE = Start(0.0, np.pi / 4.0, 0.2, 300.0, attitude_rad=(0.0, 0.0, 0.0))


@dataclass(frozen=True)
class Felt:
    """Increments (n, 3) over the samples that end at `time_s` (n,)."""

    time_s: np.ndarray
    gyro: np.ndarray
    velocity: np.ndarray


def navigated(felt: Felt, start: Start, **options) -> Solution:
    return navigate(felt.time_s, felt.gyro, felt.velocity, start, **options)


def at_rest(
    start: Start,
    rate_b=0.0,
    force_b=0.0,
    duration_s: float = SCHULER_PERIOD_S,
    turning: bool = True,
    rate_hz: float = 20.0,
) -> Felt:
    """Increments of a vehicle that stands at `start`, with constant errors of body rate and specific force."""
    time_s = np.arange(1, round(duration_s * rate_hz) + 1) / rate_hz
    turn = EARTH_RATE * turning
    earth_n = [turn * np.cos(start.latitude_rad), 0.0, -turn * np.sin(start.latitude_rad)]
    up_n = [0.0, 0.0, -gravity(start.latitude_rad, start.height_m)]
    to_body = Rotation.from_euler("ZYX", start.attitude_rad[::-1]).inv()
    gyro = (to_body.apply(earth_n) + rate_b) / rate_hz
    velocity = (to_body.apply(up_n) + force_b) / rate_hz
    return Felt(time_s, np.tile(gyro, (time_s.size, 1)), np.tile(velocity, (time_s.size, 1)))


def displacement(solution: Solution, start: Start) -> np.ndarray:
    """(m, 2) north and east of the start, m."""
    meridian, transverse = radii(start.latitude_rad)
    north = (meridian + start.height_m) * (solution.latitude_rad - start.latitude_rad)
    east = (transverse + start.height_m) * np.cos(start.latitude_rad) * (solution.longitude_rad - start.longitude_rad)
    return np.stack([north, east], axis=1)


def misaligned(start: Start, phi_n) -> Start:
    """`start` with the attitude (I - phi x) C, phi in the navigation frame."""
    turned = Rotation.from_rotvec(-np.asarray(phi_n)) * Rotation.from_euler("ZYX", start.attitude_rad[::-1])
    return replace(start, attitude_rad=tuple(turned.as_euler("ZYX")[::-1]))


def horizontal_error_m(solution: Solution, trajectory: Trajectory) -> np.ndarray:
    truth = trajectory.truth(solution.time_s)
    east, north, _ = pymap3d.geodetic2enu(
        solution.latitude_rad, solution.longitude_rad, solution.height_m,
        truth.latitude_rad, truth.longitude_rad, truth.height_m, deg=False,
    )  # fmt: skip
    return np.hypot(north, east)


# ---------------------------------------------------------------------------------------------------- numeric floor


@pytest.mark.parametrize("name", ["climb-cruise-landing", "box", "straight", "wing-rock"])
def test_without_sensor_errors_the_shipped_flights_are_flown_exactly(name: str) -> None:
    """8400 s at 100 Hz against a truth that is independent of the mechanization; wing rock too (0.05 m would do)."""
    mission = Mission(load(name), 100.0)
    ideal = mission.ideal()
    solution = navigate(
        ideal.imu.time_s,
        ideal.imu.gyro,
        ideal.imu.accelerometer,
        ideal.start,
        height_aid_m=ideal.imu.height_baro_m,
        every=25,
    )
    truth = mission.trajectory.truth(solution.time_s)
    assert solution.time_s[-1] == pytest.approx(8400.0)
    assert horizontal_error_m(solution, mission.trajectory).max() < FLOOR_M
    assert np.abs(solution.height_m - truth.height_m).max() < FLOOR_M
    assert np.abs(solution.velocity_n - truth.velocity_n).max() < FLOOR_MPS
    turn = Rotation.from_euler("ZYX", truth.attitude_rad[:, ::-1]).inv() * Rotation.from_quat(
        solution.quaternion_nb, scalar_first=True
    )
    assert turn.magnitude().max() < FLOOR_RAD


def test_without_sensor_errors_a_standing_vehicle_stays_where_it_is() -> None:
    """84.4 min, tilted and turned, closed-form increments."""
    start = replace(PLACE, attitude_rad=(0.3, -0.4, 2.0))
    solution = navigated(at_rest(start), start)
    assert np.abs(displacement(solution, start)).max() < FLOOR_M
    assert np.abs(solution.velocity_n).max() < FLOOR_MPS
    assert solution.attitude_rad == pytest.approx(np.tile([0.3, -0.4, 2.0], (solution.time_s.size, 1)), abs=FLOOR_RAD)


@pytest.mark.parametrize(("name", "rate_hz", "largest_m"), [
    ("climb-cruise-landing", 10.0, 1e-3), ("straight", 10.0, 1e-3), ("wing-rock", 50.0, 1e-4),
])  # fmt: skip
def test_the_navigation_frame_turns_within_a_step(name: str, rate_hz: float, largest_m: float) -> None:
    """Long steps: 0.4 s of a calm flight, 0.08 s of one with wing rock, sums of increments of 100 Hz."""
    assert flown_error_m(Trajectory(load(name)), rate_hz) < largest_m


def test_the_error_falls_at_least_with_the_third_power_of_the_sample() -> None:
    """Wing rock in turns at 5, 10 and 20 Hz."""
    errors = [flown_error_m(Trajectory(rocking_turns()), rate_hz) for rate_hz in (5.0, 10.0, 20.0)]
    assert errors[0] > THIRD_ORDER * errors[1] > THIRD_ORDER**2 * errors[2]
    assert errors[2] < FLOOR_M


def flown_error_m(trajectory: Trajectory, rate_hz: float) -> float:
    """Largest horizontal error, m; the increments are sums of those at 100 Hz, whose quadrature is good enough."""
    fine, count = trajectory.increments(100.0), round(100.0 / rate_hz)
    angle, velocity = (each.reshape(-1, count, 3).sum(axis=1) for each in (fine.dtheta_b, fine.dv_b))
    felt = Felt(fine.time_s[count - 1 :: count], angle, velocity)
    solution = navigated(felt, start_of(trajectory), height_aid_m=trajectory.truth(felt.time_s).height_m)
    return float(horizontal_error_m(solution, trajectory).max())


def rocking_turns() -> Profile:
    return Profile(
        name="wing rock in turns",
        duration_s=960.0,
        start={"latitude_deg": 45.0, "longitude_deg": 10.0, "height_m": 500.0, "heading_deg": 30.0, "stand_s": 0.0},
        speed=({"from_s": 10.0, "to_s": 100.0, "to_mps": 150.0, "edge_s": 20.0},),
        turn=({"at_s": 200.0, "by_deg": 90.0, "bank_deg": 25.0}, {"at_s": 500.0, "by_deg": -120.0, "bank_deg": 25.0}),
        wing_rock={"amplitude_deg": 2.0, "frequency_hz": 0.5, "from_s": 100.0, "to_s": 900.0},
        thermal={"self_heating_c": 1.0},
    )


def start_of(trajectory: Trajectory) -> Start:
    truth = trajectory.truth(np.array([trajectory.start_s]))
    return Start(
        trajectory.start_s,
        float(truth.latitude_rad[0]),
        float(truth.longitude_rad[0]),
        float(truth.height_m[0]),
        tuple(truth.velocity_n[0]),
        tuple(truth.attitude_rad[0]),
    )


# ------------------------------------------------------------------------------------------ Schuler, in closed form

BIAS, DRIFT, TILT, SPEED = 10.0 * UG, 0.01 * DEG_PER_H, 1e-5, 0.05


@dataclass(frozen=True)
class Disturbance:
    """One error source along north, east, or in each; all zero by default."""

    force_n: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rate_n: tuple[float, float, float] = (0.0, 0.0, 0.0)
    phi_n: tuple[float, float, float] = (0.0, 0.0, 0.0)
    velocity_n: tuple[float, float, float] = (0.0, 0.0, 0.0)


def disturbed(disturbance: Disturbance, start: Start, turning: bool) -> Solution:
    to_body = Rotation.from_euler("ZYX", start.attitude_rad[::-1]).inv()
    felt = at_rest(start, to_body.apply(disturbance.rate_n), to_body.apply(disturbance.force_n), turning=turning)
    begin = replace(misaligned(start, disturbance.phi_n), velocity_n=disturbance.velocity_n)
    return navigated(felt, begin, earth=EarthBelief() if turning else EARTH_AT_REST)


@pytest.mark.parametrize(
    ("disturbance", "axis", "law"),
    [
        (Disturbance(force_n=(BIAS, 0.0, 0.0)), 0, lambda t, w, r: BIAS / w**2 * (1.0 - np.cos(w * t))),
        (Disturbance(force_n=(0.0, BIAS, 0.0)), 1, lambda t, w, r: BIAS / w**2 * (1.0 - np.cos(w * t))),
        (Disturbance(rate_n=(0.0, DRIFT, 0.0)), 0, lambda t, w, r: -r * DRIFT * (t - np.sin(w * t) / w)),
        (Disturbance(rate_n=(DRIFT, 0.0, 0.0)), 1, lambda t, w, r: r * DRIFT * (t - np.sin(w * t) / w)),
        (Disturbance(phi_n=(0.0, TILT, 0.0)), 0, lambda t, w, r: r * TILT * (1.0 - np.cos(w * t))),
        (Disturbance(phi_n=(TILT, 0.0, 0.0)), 1, lambda t, w, r: -r * TILT * (1.0 - np.cos(w * t))),
        (Disturbance(velocity_n=(SPEED, 0.0, 0.0)), 0, lambda t, w, r: SPEED / w * np.sin(w * t)),
        (Disturbance(velocity_n=(0.0, SPEED, 0.0)), 1, lambda t, w, r: SPEED / w * np.sin(w * t)),
    ],
    ids=["force N", "force E", "drift E", "drift N", "tilt E", "tilt N", "velocity N", "velocity E"],
)
def test_schuler_oscillation(disturbance: Disturbance, axis: int, law: Callable) -> None:
    """One period on an Earth that does not turn, w^2 = g / R, R the radius of curvature along the motion.

    Accelerometer bias b R / g (1 - cos wt), gyro drift R e (t - sin wt / w), tilt R psi (1 - cos wt), velocity
    dv / w sin wt.
    """
    start = replace(PLACE, attitude_rad=(0.0, 0.0, 0.7))
    radius = radii(start.latitude_rad)[axis] + start.height_m
    w = np.sqrt(gravity(start.latitude_rad, start.height_m) / radius)
    solution = disturbed(disturbance, start, turning=False)
    expected = law(solution.time_s, w, radius)
    error = displacement(solution, start)[:, axis] - expected
    assert np.abs(error).max() < SCHULER_TOLERANCE * np.abs(expected).max()


def test_100_ug_lead_to_1274_m_and_back_in_84_minutes() -> None:
    """2 b R / g at half a period, zero again after a period of 84.4 min, the Earth turning; latitude 45 degrees."""
    solution = disturbed(Disturbance(force_n=(100.0 * UG, 0.0, 0.0)), PLACE, turning=True)
    north = displacement(solution, PLACE)[:, 0]
    meridian, _ = radii(PLACE.latitude_rad)
    assert north.max() == pytest.approx(2.0 * 100.0 * UG * meridian / gravity(PLACE.latitude_rad, 0.0), rel=0.02)
    assert solution.time_s[np.argmax(north)] == pytest.approx(SCHULER_PERIOD_S / 2.0, rel=COUPLED_TOLERANCE)
    assert abs(north[-1]) < COUPLED_TOLERANCE * north.max()


def test_heading_error_acts_as_an_east_gyro() -> None:
    """phi_D Omega cos L in place of a gyro drift: R phi Omega cos L (t - sin wt / w)."""
    phi = 1e-4
    solution = disturbed(Disturbance(phi_n=(0.0, 0.0, phi)), PLACE, turning=True)
    meridian, _ = radii(PLACE.latitude_rad)
    w = np.sqrt(gravity(PLACE.latitude_rad, PLACE.height_m) / (meridian + PLACE.height_m))
    t = solution.time_s
    expected = (meridian + PLACE.height_m) * phi * EARTH_RATE * np.cos(PLACE.latitude_rad) * (t - np.sin(w * t) / w)
    error = displacement(solution, PLACE)[:, 0] - expected
    assert np.abs(error).max() < COUPLED_TOLERANCE * expected.max()


@pytest.mark.parametrize("latitude_deg", [-60.0, 10.0, 45.0])
@pytest.mark.parametrize(
    "disturbance",
    [
        Disturbance(force_n=(BIAS, 0.0, 0.0)),
        Disturbance(force_n=(0.0, BIAS, 0.0)),
        Disturbance(rate_n=(DRIFT, 0.0, 0.0)),
        Disturbance(rate_n=(0.0, DRIFT, 0.0)),
        Disturbance(rate_n=(0.0, 0.0, DRIFT)),
        Disturbance(phi_n=(TILT, -TILT, 0.0)),
        Disturbance(phi_n=(0.0, 0.0, 1e-4)),
        Disturbance(velocity_n=(SPEED, -SPEED, 0.0)),
    ],
    ids=["force N", "force E", "drift N", "drift E", "drift D", "tilt", "heading", "velocity"],
)
def test_errors_at_rest_obey_the_linear_error_equations(latitude_deg: float, disturbance: Disturbance) -> None:
    """Position, velocity and attitude over 84.4 min against the matrix exponential of the static error equations.

    Titterton and Weston, 2nd ed., eq. (12.28), vertical channel held: x' = F x + u, x = [r v phi], (n, 7).
    """
    start = replace(PLACE, latitude_rad=latitude_deg * DEG, attitude_rad=(0.05, -0.1, 2.5))
    solution = disturbed(disturbance, start, turning=True)
    initial = np.array([0.0, 0.0, *disturbance.velocity_n[:2], *disturbance.phi_n])
    drive = np.array([0.0, 0.0, *disturbance.force_n[:2], *(-np.array(disturbance.rate_n))])
    expected = linear_response(start, initial, drive, solution.time_s)
    true_nb = Rotation.from_euler("ZYX", start.attitude_rad[::-1])
    phi = -(Rotation.from_quat(solution.quaternion_nb, scalar_first=True) * true_nb.inv()).as_rotvec()
    for ours, theirs in (
        (displacement(solution, start), expected[:, :2]),
        (solution.velocity_n[:, :2], expected[:, 2:4]),
        (phi, expected[:, 4:]),
    ):
        assert np.abs(ours - theirs).max() < LINEAR_TOLERANCE * np.abs(theirs).max()


def linear_response(start: Start, initial: np.ndarray, drive: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """States (m, 7) r_N r_E v_N v_E phi_N phi_E phi_D at the evenly spaced `time_s`."""
    latitude, height = start.latitude_rad, start.height_m
    g = gravity(latitude, height)
    meridian, transverse = (radius + height for radius in radii(latitude))
    north, down, tangent = EARTH_RATE * np.cos(latitude), -EARTH_RATE * np.sin(latitude), np.tan(latitude)
    f = np.zeros((8, 8))
    f[0, 2] = f[1, 3] = 1.0
    f[2, 3], f[2, 5] = 2.0 * down, g
    f[3, 2], f[3, 4] = -2.0 * down, -g
    f[4, 0], f[4, 3], f[4, 5] = down / meridian, 1.0 / transverse, down
    f[5, 2], f[5, 4], f[5, 6] = -1.0 / meridian, -down, north
    f[6, 0], f[6, 3], f[6, 5] = -north / meridian, -tangent / transverse, -north
    f[:7, 7] = drive
    step = expm(f * (time_s[1] - time_s[0]))
    state = np.empty((time_s.size, 8))
    state[0] = [*initial, 1.0]
    for k in range(1, time_s.size):
        state[k] = step @ state[k - 1]
    return state[:, :7]


# ------------------------------------------------------------------------------------------------- vertical channel


def test_a_wrong_height_is_forgotten_as_a_triple_pole_says() -> None:
    """e = e0 (1 - 2x + x^2 / 2) exp(-x), x = t / 60 s."""
    start = replace(PLACE, height_m=PLACE.height_m + 1.0)
    felt = at_rest(PLACE, duration_s=600.0, rate_hz=400.0)
    solution = navigated(felt, start, height_aid_m=np.full(felt.time_s.size, PLACE.height_m))
    x = solution.time_s / 60.0
    expected = (1.0 - 2.0 * x + 0.5 * x * x) * np.exp(-x)
    assert np.abs(solution.height_m - PLACE.height_m - expected).max() < VERTICAL_TOLERANCE


def test_a_vertical_accelerometer_bias_is_removed_as_a_triple_pole_says() -> None:
    """e = -b t^2 / 2 exp(-t / 60 s): largest after two minutes, b (120 s)^2 / 2 exp(-2), and gone in the end."""
    bias = 100.0 * UG
    felt = at_rest(PLACE, force_b=(0.0, 0.0, bias), duration_s=1200.0, rate_hz=400.0)
    solution = navigated(felt, PLACE)
    expected = -0.5 * bias * solution.time_s**2 * np.exp(-solution.time_s / 60.0)
    error = solution.height_m - PLACE.height_m - expected
    assert np.abs(error).max() < VERTICAL_TOLERANCE * np.abs(expected).max()
    assert abs(solution.velocity_n[-1, 2]) < bias * 0.01  # what the bias makes of a velocity in one step


def test_a_free_vertical_channel_diverges_at_the_known_rate() -> None:
    """h = h0 cosh(t sqrt(2 g / R)): 1 cm grow to 2.9 m in an hour."""
    start = replace(PLACE, height_m=PLACE.height_m + 0.01)
    solution = navigated(at_rest(PLACE, duration_s=3600.0), start, vertical="free")
    growth = np.sqrt(2.0 * gravity(PLACE.latitude_rad, 0.0) / np.mean(radii(PLACE.latitude_rad)))
    later = solution.time_s > 600.0
    ratio = (solution.height_m - PLACE.height_m)[later] / (0.01 * np.cosh(growth * solution.time_s[later]))
    assert np.abs(ratio - 1.0).max() < GROWTH_TOLERANCE


def test_a_frozen_vertical_channel_keeps_its_height() -> None:
    """Whatever the vertical accelerometer says; horizontally nothing changes."""
    felt = at_rest(PLACE, force_b=(0.0, 0.0, 500.0 * UG))
    frozen = navigated(felt, replace(PLACE, velocity_n=(0.0, 0.0, 3.0)), vertical="frozen")
    assert np.all(frozen.height_m == PLACE.height_m)
    assert not np.any(frozen.velocity_n[:, 2])
    forward = at_rest(PLACE, force_b=(10.0 * UG, 0.0, 0.0))
    frozen, damped = navigated(forward, PLACE, vertical="frozen"), navigated(forward, PLACE)
    north, expected = displacement(frozen, PLACE)[:, 0], displacement(damped, PLACE)[:, 0]
    assert np.abs(north - expected).max() < LINEAR_TOLERANCE * expected.max()


# ----------------------------------------------------------------------------------------------- coning and sculling

CONE_RAD, CONE_HZ, RATE_HZ = 1.0 * DEG, 2.0, 100.0


def coning_attitude(time_s: np.ndarray) -> Rotation:
    """Rotation vector a [0, cos wt, sin wt]: the x axis draws a cone."""
    w = 2.0 * np.pi * CONE_HZ
    zero = np.zeros_like(time_s)
    return Rotation.from_rotvec(CONE_RAD * np.stack([zero, np.cos(w * time_s), np.sin(w * time_s)], axis=-1))


def coning(duration_s: float, rate_hz: float = RATE_HZ) -> Felt:
    """Increments of classical coning at one place of a flat Earth.

    Body rate w [cos a - 1, -sin a sin wt, sin a cos wt] (from 2 q* q'), integrated in closed form; specific force
    C^T [0 0 -g] by ten-node quadrature.
    """
    w, a = 2.0 * np.pi * CONE_HZ, CONE_RAD
    edges = np.arange(round(duration_s * rate_hz) + 1) / rate_hz
    dt = np.diff(edges)
    gyro = np.stack(
        [w * (np.cos(a) - 1.0) * dt, np.sin(a) * np.diff(np.cos(w * edges)), np.sin(a) * np.diff(np.sin(w * edges))],
        axis=1,
    )
    nodes, weights = np.polynomial.legendre.leggauss(10)
    up = [0.0, 0.0, -gravity(PLACE.latitude_rad, PLACE.height_m)]
    velocity = sum(
        0.5 * weight * dt[:, None] * coning_attitude(edges[:-1] + 0.5 * (node + 1.0) * dt).inv().apply(up)
        for node, weight in zip(nodes, weights, strict=True)
    )
    return Felt(edges[1:], gyro, velocity)


def test_coning_is_followed() -> None:
    """200 periods of coning: what is left of the drift 1/2 w sin^2 a (1 - sin(w dt) / (w dt)) of bare increments."""
    felt = coning(100.0)
    w, dt = 2.0 * np.pi * CONE_HZ, 1.0 / RATE_HZ
    analytic = 0.5 * w * np.sin(CONE_RAD) ** 2 * (1.0 - np.sin(w * dt) / (w * dt)) * 100.0

    bare = coning_attitude(np.zeros(1))[0]
    for increment in felt.gyro:
        bare = bare * Rotation.from_rotvec(increment)
    true = coning_attitude(felt.time_s[-1:])[0]
    assert (true.inv() * bare).magnitude() == pytest.approx(analytic, rel=0.01)

    error = {rate_hz: coning_error_rad(rate_hz) for rate_hz in (RATE_HZ, 2.0 * RATE_HZ)}
    assert error[RATE_HZ] < CONING_TOLERANCE * analytic
    assert error[RATE_HZ] > SIXTH_ORDER * error[2.0 * RATE_HZ]


def coning_error_rad(rate_hz: float) -> float:
    """Largest error of the navigated attitude over 100 s of coning; it must not move meanwhile."""
    roll_pitch_heading = coning_attitude(np.zeros(1)).as_euler("ZYX")[0, ::-1]
    start = replace(PLACE, attitude_rad=tuple(roll_pitch_heading))
    solution = navigated(coning(100.0, rate_hz), start, earth=FLAT_EARTH)
    assert np.abs(displacement(solution, PLACE)).max() < FLOOR_M
    navigated_nb = Rotation.from_quat(solution.quaternion_nb, scalar_first=True)
    return float((coning_attitude(solution.time_s).inv() * navigated_nb).magnitude().max())


def sculling(angle_rad: float, force: float, frequency_hz: float, duration_s: float, rate_hz: float) -> Felt:
    """Heading angle_rad sin wt and forward specific force `force` sin wt, in closed form, on a flat Earth."""
    w = 2.0 * np.pi * frequency_hz
    edges = np.arange(round(duration_s * rate_hz) + 1) / rate_hz
    zero = np.zeros(edges.size - 1)
    up = np.full(zero.size, -gravity(PLACE.latitude_rad, PLACE.height_m) / rate_hz)
    forward = -force / w * np.diff(np.cos(w * edges))
    return Felt(
        edges[1:],
        np.stack([zero, zero, angle_rad * np.diff(np.sin(w * edges))], axis=1),
        np.stack([forward, zero, up], axis=1),
    )


def test_sculling_is_followed() -> None:
    """Rotation and force in phase rectify to f J1(theta), about theta f / 2, across; bare increments miss a part."""
    angle, force, duration_s = 1.0 * DEG, 5.0, 60.0
    exact = force * j1(angle)
    assert exact == pytest.approx(0.5 * angle * force, rel=1e-3)
    error = {}
    for rate_hz in (0.5 * RATE_HZ, RATE_HZ):
        felt = sculling(angle, force, 2.0, duration_s, rate_hz)
        solution = navigated(felt, PLACE, earth=FLAT_EARTH, vertical="frozen")
        error[rate_hz] = abs(solution.velocity_n[-1, 1] / duration_s / exact - 1.0)
    assert error[RATE_HZ] < SCULLING_TOLERANCE
    assert error[0.5 * RATE_HZ] > SIXTH_ORDER * error[RATE_HZ]

    heading = np.concatenate([[0.0], np.cumsum(felt.gyro[:, 2])])
    middle = 0.5 * (heading[1:] + heading[:-1])
    bare = np.sum(felt.velocity[:, 0] * np.sin(middle)) / duration_s
    assert abs(bare / exact - 1.0) > 1e3 * SCULLING_TOLERANCE


# -------------------------------------------------------------------------------------------- python-ins as an oracle


def with_python_ins(felt: Felt, start: Start) -> np.ndarray:
    """Latitude, longitude (deg) at all samples (n + 1, 2) by python-ins, height held."""
    names = pyins.util.GYRO_COLS + pyins.util.ACCEL_COLS
    rows = np.hstack([felt.gyro, felt.velocity])
    # a reading before the first sample is asked for; the vehicle stands then
    imu = pd.DataFrame(np.vstack([rows[:1], rows]), index=np.concatenate([[0.0], felt.time_s]), columns=names)
    state = [np.rad2deg(start.latitude_rad), np.rad2deg(start.longitude_rad), start.height_m, *start.velocity_n]
    begin = pd.Series([*state, *np.rad2deg(start.attitude_rad)], index=pyins.util.TRAJECTORY_COLS, dtype=float)
    integrator = pyins.strapdown.Integrator(begin, with_altitude=False)
    flown = integrator.integrate(pyins.strapdown.compute_increments_from_imu(imu, "increment"))
    return flown[["lat", "lon"]].to_numpy()


@pytest.mark.filterwarnings("ignore:The copy keyword is deprecated")
def test_python_ins_navigates_to_the_same_place() -> None:
    """A level flight of 15 min with turns, the same increments in both, height held.

    python-ins freezes the Earth at the start of each sample, so its error halves with the sample; extrapolated from
    100 and 200 Hz to infinite rate it agrees much better.
    """
    trajectory = Trajectory(rocking_turns().model_copy(update={"wing_rock": None, "duration_s": 900.0}))
    start = start_of(trajectory)
    apart, theirs = {}, {}
    for rate_hz in (100.0, 200.0):
        increments = trajectory.increments(rate_hz)
        felt = Felt(increments.time_s, increments.dtheta_b, increments.dv_b)
        solution = navigated(felt, start, vertical="frozen")
        theirs[rate_hz] = with_python_ins(felt, start)[:: round(rate_hz / 25.0)]
        ours = solution if rate_hz == 100.0 else navigated(felt, start, vertical="frozen", every=2)
        apart[rate_hz] = distance_m(ours, theirs[rate_hz])
    assert apart[200.0].max() < PEER_TOLERANCE_M
    assert apart[100.0].max() / apart[200.0].max() == pytest.approx(2.0, rel=0.05)
    assert distance_m(ours, 2.0 * theirs[200.0] - theirs[100.0]).max() < PEER_EXTRAPOLATED_TOLERANCE_M


def distance_m(solution: Solution, degrees: np.ndarray) -> np.ndarray:
    east, north, _ = pymap3d.geodetic2enu(
        np.rad2deg(solution.latitude_rad), np.rad2deg(solution.longitude_rad), 500.0, *degrees.T, 500.0
    )
    return np.hypot(north, east)


def test_attitude_has_the_convention_of_python_ins() -> None:
    """Heading, then pitch, then roll; matrix from body to navigation frame."""
    rng = np.random.default_rng(7)
    attitude = rng.uniform([-3.1, -1.5, -3.1], [3.1, 1.5, 3.1], (50, 3))
    for angles in attitude:
        quaternion = quaternion_from_attitude(angles)
        matrix = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
        assert matrix == pytest.approx(pyins.transform.mat_from_rph(np.rad2deg(angles)), abs=1e-12)
        assert attitude_from_quaternion(quaternion) == pytest.approx(angles, abs=1e-12)


# ------------------------------------------------------------------------------------------------- rows and leftovers


def test_rows_of_the_solution() -> None:
    """One row for the start and one for every whole step of four samples, or for so many of them."""
    felt = at_rest(PLACE, duration_s=10.1)  # 202 samples: 50 steps and two samples that are left
    fine, coarse = navigated(felt, PLACE), navigated(felt, PLACE, every=5)
    assert fine.time_s == pytest.approx(np.arange(51) * 0.2)
    assert coarse.time_s == pytest.approx(fine.time_s[::5])
    assert np.array_equal(coarse.velocity_n, fine.velocity_n[::5])


def test_arcs_are_flown_as_each_alone() -> None:
    felt = at_rest(PLACE, duration_s=8.0)
    edges = [0, 40, 100, felt.time_s.size]
    asked: list[tuple[int, int]] = []

    def increments(first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
        asked.append((first, last))
        return felt.gyro[first:last], felt.velocity[first:last]

    starts = [
        replace(PLACE, time_s=0.05 * edge, velocity_n=(float(edge), 1.0, 0.0), attitude_rad=(0.01 * edge, 0.1, 2.0))
        for edge in edges[:-1]
    ]
    aid = np.full(felt.time_s.size, PLACE.height_m)
    arcs = navigate_arcs(felt.time_s, increments, starts, edges, aid, "free")
    assert asked == list(zip(edges[:-1], edges[1:], strict=True))
    for arc, start, first, last in zip(arcs, starts, edges[:-1], edges[1:], strict=True):
        part = Felt(felt.time_s[first:last], felt.gyro[first:last], felt.velocity[first:last])
        alone = navigated(part, start, vertical="free")
        for name in ("time_s", "latitude_rad", "longitude_rad", "height_m", "velocity_n", "quaternion_nb"):
            assert np.array_equal(getattr(arc, name), getattr(alone, name)), name


def test_without_an_aid_the_height_of_the_start_is_held() -> None:
    felt = at_rest(PLACE, force_b=(0.0, 0.0, 50.0 * UG), duration_s=300.0)
    held = navigated(felt, PLACE)
    aided = navigated(felt, PLACE, height_aid_m=np.full(felt.time_s.size, PLACE.height_m))
    assert np.array_equal(held.height_m, aided.height_m)
