"""The truth against itself differentiated in inertial space, and the flight plan against what it should hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pymap3d
import pytest
from scipy.spatial.transform import Rotation

from ins_eval.earth import EARTH_RATE, gravity
from ins_eval.profile import Profile, load
from ins_eval.trajectory import Increments, Trajectory

# The differences lose their order across a joint of the plan, so each quantity has two tolerances: for the median of
# the instants, limited by rounding, and for the worst one.
FORCE_TOLERANCES = (2e-7, 5e-6)  # m/s^2; 0.02 ug, 0.5 ug
RATE_TOLERANCES = (1e-12, 1e-8)  # rad/s; 2e-7 deg/h, 2e-3 deg/h
VELOCITY_TOLERANCES = (1e-8, 5e-6)  # m/s
LOG_TOLERANCE_RAD = 1e-12  # of one increment of 0.01 s
REST_TOLERANCE_MPS = 1e-9
QUADRATURE_TOLERANCE = 1e-9  # rad or m/s over 0.1 s
HEIGHT_TOLERANCE_M = 1e-6
ANGLE_TOLERANCE_RAD = 1e-9
RATE_HZ = 100.0
KNOT_S = 0.25  # positions are differentiated between the knots of their quadrature, which are exact

# central differences over nine points: first and second derivative, eighth order
OFFSETS = np.arange(-4, 5)
FIRST = np.array([3.0, -32.0, 168.0, -672.0, 0.0, 672.0, -168.0, 32.0, -3.0]) / 840.0
SECOND = np.array([-9.0, 128.0, -1008.0, 8064.0, -14350.0, 8064.0, -1008.0, 128.0, -9.0]) / 5040.0


@dataclass(frozen=True)
class Flown:
    """A trajectory with its increments at 100 Hz."""

    trajectory: Trajectory
    increments: Increments


@pytest.fixture(scope="module", params=["wing-rock", "box"])
def flown(request: pytest.FixtureRequest) -> Flown:
    trajectory = Trajectory(load(request.param))
    return Flown(trajectory, trajectory.increments(RATE_HZ))


@pytest.fixture(scope="module")
def flight() -> Trajectory:
    return Trajectory(load("climb-cruise-landing"))


@pytest.fixture(scope="module")
def box() -> Trajectory:
    return Trajectory(load("box"))


def joints(profile: Profile) -> list[float]:
    """Where pieces of the plan begin and end."""
    changes = [t for c in (*profile.speed, *profile.height) for t in (c.from_s, c.from_s + c.edge_s, c.to_s)]
    return [*changes, *(t for turn in profile.turn for t in (turn.at_s, turn.at_s + turn.edge_s))]


def epochs(trajectory: Trajectory) -> np.ndarray:
    """Random instants, all joints and what surrounds them, on the grid of the knots."""
    rng = np.random.default_rng(2)
    near = np.add.outer(joints(trajectory.profile), [-0.5, -0.25, 0.0, 0.25, 0.5, 3.0]).ravel()
    time_s = np.concatenate([rng.uniform(trajectory.start_s, trajectory.end_s, 600), near])
    knots = np.round(time_s / KNOT_S) * KNOT_S
    return np.unique(knots[(knots > trajectory.start_s + 5.0) & (knots < trajectory.end_s - 5.0)])


def assert_within(error: np.ndarray, tolerances: tuple[float, float]) -> None:
    """The worst component of `error` (n, 3), median and maximum over the instants."""
    worst = np.abs(error).max(axis=1)
    assert np.median(worst) < tolerances[0]
    assert worst.max() < tolerances[1]


def position_ecef(trajectory: Trajectory, time_s: np.ndarray) -> np.ndarray:
    """Earth-fixed position (n, 3) m, by pymap3d."""
    truth = trajectory.truth(time_s.ravel())
    return np.stack(pymap3d.geodetic2ecef(truth.latitude_rad, truth.longitude_rad, truth.height_m, deg=False), axis=-1)


def turned(position: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Earth-fixed coordinates (n, 3) in the inertial axes that coincide with them at time 0."""
    sine, cosine = np.sin(EARTH_RATE * time_s), np.cos(EARTH_RATE * time_s)
    x, y, z = position.T
    return np.stack([x * cosine - y * sine, x * sine + y * cosine, z], axis=-1)


def ned_axes(latitude_rad: np.ndarray, longitude_rad: np.ndarray) -> np.ndarray:
    """(n, 3, 3) whose columns are north, east, down in axes that turn with `longitude_rad`."""
    sl, cl = np.sin(latitude_rad), np.cos(latitude_rad)
    so, co = np.sin(longitude_rad), np.cos(longitude_rad)
    zero = np.zeros_like(sl)
    north, east, down = [-sl * co, -sl * so, cl], [-so, co, zero], [-cl * co, -cl * so, -sl]
    return np.stack([np.stack(axis, axis=-1) for axis in (north, east, down)], axis=-1)


def mat_ib(trajectory: Trajectory, time_s: np.ndarray) -> np.ndarray:
    """Body axes in inertial axes (n, 3, 3)."""
    truth = trajectory.truth(time_s)
    mat_nb = Rotation.from_euler("ZYX", truth.attitude_rad[:, ::-1]).as_matrix()
    return ned_axes(truth.latitude_rad, truth.longitude_rad + EARTH_RATE * time_s) @ mat_nb


def at_instant(increments: Increments, start_s: float, values: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Instantaneous value of what `values` (n, 3) are the integrals of, from two means around each instant."""
    k = np.round((time_s - start_s) * RATE_HZ).astype(int)  # the sample that begins at the instant
    assert increments.time_s[k - 1] == pytest.approx(time_s)
    short = (values[k - 1] + values[k]) * RATE_HZ / 2.0
    long = (values[k - 2] + values[k - 1] + values[k] + values[k + 1]) * RATE_HZ / 4.0
    return (4.0 * short - long) / 3.0


def test_specific_force_is_inertial_acceleration_less_gravitation(flown: Flown) -> None:
    """f = r'' - G in inertial space; gravitation G = g + w x (w x r), g along the ellipsoid's normal."""
    trajectory = flown.trajectory
    time_s = epochs(trajectory)
    grid = time_s[:, None] + OFFSETS * KNOT_S
    position = turned(position_ecef(trajectory, grid), grid.ravel()).reshape(*grid.shape, 3)
    acceleration = np.einsum("k,nkj->nj", SECOND, position) / KNOT_S**2
    truth = trajectory.truth(time_s)
    down_i = ned_axes(truth.latitude_rad, truth.longitude_rad + EARTH_RATE * time_s)[:, :, 2]
    centripetal = -(EARTH_RATE**2) * position[:, 4] * [1.0, 1.0, 0.0]
    gravitation = gravity(truth.latitude_rad, truth.height_m)[:, None] * down_i + centripetal
    expected = np.einsum("nij,ni->nj", mat_ib(trajectory, time_s), acceleration - gravitation)
    felt = at_instant(flown.increments, trajectory.start_s, flown.increments.dv_b, time_s)
    assert_within(np.abs(felt - expected), FORCE_TOLERANCES)


def test_body_rate_is_the_derivative_of_the_attitude_in_inertial_space(flown: Flown) -> None:
    """[w x] = C^T C', by an eighth-order difference over 0.08 s."""
    trajectory, step_s = flown.trajectory, 0.01
    time_s = epochs(trajectory)
    derivative = sum(
        weight * mat_ib(trajectory, time_s + k * step_s) for k, weight in zip(OFFSETS, FIRST / step_s, strict=True)
    )
    skew = np.einsum("nji,njk->nik", mat_ib(trajectory, time_s), derivative)
    expected = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=-1)
    felt = at_instant(flown.increments, trajectory.start_s, flown.increments.dtheta_b, time_s)
    assert_within(np.abs(felt - expected), RATE_TOLERANCES)


@pytest.mark.parametrize("from_s", [-450.0, 0.0, 250.0, 2005.0, 3950.0, 4020.0, 5000.0, 7250.0, 8330.0])
def test_gyro_increments_are_the_turns_between_consecutive_attitudes(flown: Flown, from_s: float) -> None:
    """log(C_k^T C_k+1), less what does not commute: 1/24 (a_k-1 x a_k + a_k x a_k+1)."""
    trajectory = flown.trajectory
    first = round((from_s - trajectory.start_s) * RATE_HZ)
    time_s = flown.increments.time_s[first : first + 1000]
    body = mat_ib(trajectory, time_s)
    turn = Rotation.from_matrix(np.swapaxes(body[:-1], 1, 2) @ body[1:]).as_rotvec()
    gyro = flown.increments.dtheta_b[first : first + 1000]
    neighbours = np.cross(gyro[:-2], gyro[1:-1]) + np.cross(gyro[1:-1], gyro[2:])
    assert np.abs(gyro[1:-1] + neighbours / 24.0 - turn[:-1]).max() < LOG_TOLERANCE_RAD


def test_velocity_is_the_derivative_of_the_position(flown: Flown) -> None:
    """v = C_en^T r_e', north-east-down."""
    trajectory = flown.trajectory
    time_s = epochs(trajectory)
    grid = time_s[:, None] + OFFSETS * KNOT_S
    position = position_ecef(trajectory, grid).reshape(*grid.shape, 3)
    derivative = np.einsum("k,nkj->nj", FIRST, position) / KNOT_S
    truth = trajectory.truth(time_s)
    expected = np.einsum("nij,ni->nj", ned_axes(truth.latitude_rad, truth.longitude_rad), derivative)
    assert_within(np.abs(truth.velocity_n - expected), VELOCITY_TOLERANCES)


def test_position_between_the_knots_is_as_good_as_on_them(flight: Trajectory) -> None:
    """Velocity by differences over 0.01 s, across knots and joints."""
    rng = np.random.default_rng(3)
    time_s = np.concatenate([rng.uniform(0.0, 8390.0, 400), joints(flight.profile)])
    ahead, behind = position_ecef(flight, time_s + 0.01), position_ecef(flight, time_s - 0.01)
    truth = flight.truth(time_s)
    expected = np.einsum("nij,ni->nj", ned_axes(truth.latitude_rad, truth.longitude_rad), (ahead - behind) / 0.02)
    assert np.abs(truth.velocity_n - expected).max() < 1e-4  # truncation of the difference, 0.01^2 / 6 of the jerk


def test_the_motion_is_smooth_at_the_joints(flight: Trajectory) -> None:
    """Neither specific force nor body rate steps anywhere: their second differences are bounded by their curvature.

    A fade over d has a curvature of at most 7.6 / d^2 of its level. Speed: 2 m/s^2 over 5 s; turns: a roll of 0.61 rad
    over 10 s lifts the force by 2.1 m/s^2 and the roll rate, 0.13 rad/s, has a curvature of 53 / d^3 of 0.61 rad.
    """
    increments = flight.increments(RATE_HZ)
    for values, bound in ((increments.dv_b, 2.0), (increments.dtheta_b, 0.1)):
        curvature = np.abs(np.diff(values * RATE_HZ, 2, axis=0)).max() * RATE_HZ**2
        assert curvature < bound


def test_specific_force_is_the_rate_of_the_velocity_increments(flight: Trajectory) -> None:
    """Simpson's rule over samples of 10 ms, in the middle of a turn."""
    increments = flight.increments(100.0)
    k = np.searchsorted(increments.time_s, 4010.0) + np.arange(100)
    end_s = increments.time_s[k]
    first, middle, last = (flight.specific_force(end_s - back) for back in (0.01, 0.005, 0.0))
    assert np.allclose(0.01 * (first + 4.0 * middle + last) / 6.0, increments.dv_b[k], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("rate_hz", [10.0, 50.0, 400.0])
def test_increments_add_up_at_any_rate(rate_hz: float) -> None:
    """The sum over 0.1 s is the same integral at 10, 50, 100 and 400 Hz: climb, turns, and wing rock in cruise."""
    profile = load("wing-rock")
    until_s = 2300.0
    kept = {name: tuple(c for c in getattr(profile, name) if c.from_s < until_s) for name in ("speed", "height")}
    turns = tuple(t for t in profile.turn if t.at_s < until_s)
    trajectory = Trajectory(profile.model_copy(update={**kept, "turn": turns, "duration_s": until_s}))
    hundred, other = trajectory.increments(100.0), trajectory.increments(rate_hz)
    for name in ("dtheta_b", "dv_b"):
        ours = getattr(hundred, name).reshape(-1, 10, 3).sum(axis=1)
        theirs = getattr(other, name).reshape(-1, round(rate_hz / 10.0), 3).sum(axis=1)
        assert np.abs(ours - theirs).max() < QUADRATURE_TOLERANCE
    assert other.time_s[-1] == pytest.approx(trajectory.end_s)
    assert other.time_s[0] == pytest.approx(trajectory.start_s + 1.0 / rate_hz)


@pytest.mark.parametrize("rate_hz", [0.5, 401.0])
def test_a_rate_out_of_range_is_refused(flight: Trajectory, rate_hz: float) -> None:
    with pytest.raises(ValueError, match="expected 1 to 400"):
        flight.increments(rate_hz)


def test_standing_before_take_off(flight: Trajectory) -> None:
    """For 900 s nothing moves and the IMU feels gravity and the Earth's rate, heading 60 degrees."""
    truth = flight.truth(np.arange(-900.0, 0.5, 0.5))
    assert not np.any(truth.velocity_n)
    assert np.ptp(truth.latitude_rad) == np.ptp(truth.longitude_rad) == np.ptp(truth.height_m) == 0.0
    latitude, heading = np.deg2rad(34.65), np.deg2rad(60.0)
    still = flight.increments(10.0)
    north, down = EARTH_RATE * np.cos(latitude), -EARTH_RATE * np.sin(latitude)
    rate = [north * np.cos(heading), -north * np.sin(heading), down]
    assert still.dtheta_b[:9000] * 10.0 == pytest.approx(np.broadcast_to(rate, (9000, 3)), abs=1e-15)
    assert still.dv_b[:9000, 2] * 10.0 == pytest.approx(np.full(9000, -gravity(latitude, 400.0)), abs=1e-12)


def test_phases_of_the_flight(flight: Trajectory) -> None:
    """Paper A, section 3.2: 10 000 m after 30 min, cruise to 7200 s, landed at 8400 s."""
    cruise = flight.truth(np.arange(1800.0, 7200.5, 1.0))
    assert cruise.height_m == pytest.approx(np.full(cruise.time_s.size, 10000.0), abs=HEIGHT_TOLERANCE_M)
    ends = flight.truth(np.array([0.0, 8400.0]))
    assert ends.height_m == pytest.approx([400.0, 400.0], abs=HEIGHT_TOLERANCE_M)
    assert np.abs(ends.velocity_n).max() < REST_TOLERANCE_MPS
    whole = flight.truth(np.arange(0.0, 8400.5, 1.0))
    climbing, sinking = whole.time_s < 1800.0, whole.time_s > 7200.0
    assert np.all(np.diff(whole.height_m[climbing]) >= -HEIGHT_TOLERANCE_M)
    assert np.all(np.diff(whole.height_m[sinking]) <= HEIGHT_TOLERANCE_M)


def test_out_and_back_with_turns_beyond_30_degrees_of_bank(flight: Trajectory) -> None:
    """Lands within 5 km of the take-off; at least four separate banks beyond 30 degrees, of both signs, none at 70."""
    take_off, reversal, landing = position_ecef(flight, np.array([0.0, 4000.0, 8400.0]))
    assert np.linalg.norm(landing - take_off) < 5000.0
    assert np.linalg.norm(reversal - take_off) > 500e3
    roll = flight.truth(np.arange(0.0, 8400.0, 0.5)).attitude_rad[:, 0]
    for beyond in (roll > np.deg2rad(30.0), roll < np.deg2rad(-30.0)):
        assert np.count_nonzero(np.diff(beyond.astype(int)) == 1) >= 2
    assert np.abs(roll).max() < np.deg2rad(40.0)


def test_turns_are_coordinated(box: Trajectory) -> None:
    """In a level turn at constant speed the specific force has next to no part across the wings.

    What remains is Coriolis and the difference of local from standard gravity: 0.03 m/s^2.
    """
    truth = box.truth(np.arange(2015.0, 2020.0, 0.01))
    assert np.rad2deg(truth.attitude_rad[:, 0]) == pytest.approx(np.full(500, 35.0), abs=0.1)
    k = round((2015.0 - box.start_s) * 10.0)
    across = box.increments(10.0).dv_b[k : k + 50, 1] * 10.0
    assert np.abs(across).max() < 0.05


def test_the_box_turns_by_90_degrees_every_1000_s(box: Trajectory) -> None:
    """Five turns to the right, each by 90 degrees."""
    heading = box.truth(np.arange(1950.0, 6951.0, 1000.0)).attitude_rad[:, 2]
    turn = np.diff(np.unwrap(heading))
    assert turn == pytest.approx(np.full(5, np.pi / 2.0), abs=ANGLE_TOLERANCE_RAD)


def test_wing_rock_has_half_a_hertz_and_two_degrees() -> None:
    """The spectrum of the roll in straight cruise is one line; nothing of it outside its time."""
    trajectory = Trajectory(load("wing-rock"))
    roll = trajectory.truth(2000.0 + np.arange(0.0, 1000.0, 0.05)).attitude_rad[:, 0]
    spectrum = np.abs(np.fft.rfft(roll)) / (roll.size / 2.0)
    peak = int(np.argmax(spectrum))
    assert np.fft.rfftfreq(roll.size, 0.05)[peak] == pytest.approx(0.5)
    assert np.rad2deg(spectrum[peak]) == pytest.approx(2.0, rel=1e-6)
    calm = np.concatenate([np.arange(1000.0, 1800.0), np.arange(7200.0, 7500.0)])
    assert np.abs(trajectory.truth(calm).attitude_rad[:, 0]).max() < ANGLE_TOLERANCE_RAD


def test_straight_ahead_never_banks() -> None:
    truth = Trajectory(load("straight")).truth(np.arange(-900.0, 8401.0, 1.0))
    assert not np.any(truth.attitude_rad[:, 0])
    assert np.ptp(truth.attitude_rad[:, 2]) < ANGLE_TOLERANCE_RAD


def test_the_oven_stands() -> None:
    truth = Trajectory(load("oven")).truth(np.arange(-900.0, 8401.0, 1.0))
    assert not np.any(truth.velocity_n)
    assert not np.any(truth.attitude_rad)
