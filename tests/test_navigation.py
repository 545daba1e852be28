"""From a recording to its navigation errors: what each step sees, takes and gives."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pymap3d
import pytest
from scipy.spatial.transform import Rotation

from ins_eval.compensation import Samples
from ins_eval.earth import gravity, radii
from ins_eval.errors import DataRefused
from ins_eval.navigation import (
    at_antenna,
    compensate,
    evaluate,
    height_aid,
    measures,
    samples,
    standstill_to_align_on,
)
from ins_eval.profile import Profile
from ins_eval.recording import Fixes, Imu, Recording, Start
from ins_eval.recording.stillness import Stretch
from ins_eval.restarts import restarts
from ins_eval.strapdown import navigate
from ins_eval.trajectory import Trajectory
from ins_eval.units import DEG, DEG_PER_H, NMI, UG
from tests.beliefs import navigation_grade

RATE_HZ = 20.0
FLOOR_M = 1e-3
FLOOR_MPS = 1e-5
ALIGNED_RAD = 1e-6
ARM_TOLERANCE_MPS = 1e-3  # the difference over rows 0.2 s apart while rolling in; the turning of the frame is 1e-4
STILL_S = 300.0
STARTED_FROM_FIXES_M = 5.0  # of fixes believed to 2.5 m and 0.05 m/s


@pytest.fixture(scope="module")
def trajectory() -> Trajectory:
    return Trajectory(
        Profile(
            name="a turn",
            duration_s=600.0,
            start={"latitude_deg": 45.0, "longitude_deg": 10.0, "height_m": 500.0, "heading_deg": 30.0,
                   "stand_s": STILL_S},
            speed=({"from_s": 10.0, "to_s": 100.0, "to_mps": 150.0, "edge_s": 20.0},),
            turn=({"at_s": 200.0, "by_deg": 180.0, "bank_deg": 25.0},),
            thermal={"self_heating_c": 1.0},
        )
    )  # fmt: skip


@pytest.fixture(scope="module")
def flight(trajectory: Trajectory) -> Recording:
    """Standing, then a flight, without any error; fixes are the truth every second."""
    increments = trajectory.increments(RATE_HZ)
    begin = trajectory.truth(np.array([-STILL_S]))
    return Recording(
        name="a turn",
        kind="flight",
        start=Start(-STILL_S, float(begin.latitude_rad[0]), float(begin.longitude_rad[0]), float(begin.height_m[0])),
        imu=Imu(
            increments.time_s,
            increments.dtheta_b,
            increments.dv_b,
            "increment",
            height_baro_m=trajectory.truth(increments.time_s).height_m,
        ),
        reference=fixes_of(trajectory),
        belief=navigation_grade(),
    )


def fixes_of(trajectory: Trajectory, from_s: float = -STILL_S) -> Fixes:
    truth = trajectory.truth(np.arange(from_s, trajectory.end_s + 0.5))
    return Fixes(
        truth.time_s,
        truth.latitude_rad,
        truth.longitude_rad,
        truth.height_m,
        truth.velocity_n,
        np.ones(truth.time_s.size, dtype=bool),
        truth.attitude_rad,
    )


def aligned_start(trajectory: Trajectory, time_s: float) -> Start:
    truth = trajectory.truth(np.array([time_s]))
    state = (float(truth.latitude_rad[0]), float(truth.longitude_rad[0]), float(truth.height_m[0]))
    return Start(time_s, *state, tuple(truth.velocity_n[0]), tuple(truth.attitude_rad[0]))


def with_belief(recording: Recording, **tables) -> Recording:
    return replace(recording, belief=navigation_grade(**tables))


# ------------------------------------------------------------------------------------------- samples and compensation


def pulses(temperature_c: np.ndarray | None) -> Recording:
    time_s = np.array([0.5, 1.0, 2.0, 4.0])
    counts = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [4.0, 8.0, 12.0], [8.0, 16.0, 24.0]])
    imu = Imu(time_s, np.zeros((4, 3)), counts, "pulse", temperature_c)
    return Recording("pulses", "static", Start(0.0, 0.5, 0.0, 0.0), imu)


def test_samples_are_pulse_rates_over_each_own_interval() -> None:
    """Intervals of 0.5, 0.5, 1 and 2 s, counts in proportion from the second on."""
    seen = tuple(samples(pulses(None)))
    assert len(seen) == 3
    for axis, of_axis in enumerate(seen, start=1):
        assert of_axis.output == pytest.approx(axis * np.array([2.0, 4.0, 4.0, 4.0]))


def test_samples_carry_temperature_and_its_filtered_rate() -> None:
    """T steps from 20 to 26 degC: rate 60 (T - y) / tau, y by the exact lag of a straight line; tau as believed."""
    one = pulses(np.array([20.0, 20.0, 20.0, 26.0]))
    for recording, tau in ((one, 180.0), (with_belief(one, accelerometer={"rate_filter_s": 60.0}), 60.0)):
        _, seen, _ = samples(recording)
        assert np.array_equal(seen.temperature_c, [20.0, 20.0, 20.0, 26.0])
        behind = 3.0 * tau * (1.0 - np.exp(-2.0 / tau))  # of a ramp of 3 degC/s after 2 s
        assert seen.rate_c_per_min == pytest.approx([0.0, 0.0, 0.0, 60.0 * behind / tau])


def test_each_accelerometer_may_have_its_own_thermometer_or_none() -> None:
    three = np.arange(12.0).reshape(4, 3)
    for axis, of_axis in enumerate(samples(pulses(three))):
        assert np.array_equal(of_axis.temperature_c, three[:, axis])
    for of_axis in samples(with_belief(pulses(None), accelerometer={"reference_temperature_c": 31.0})):
        assert np.all(of_axis.temperature_c == 31.0)
        assert not np.any(of_axis.rate_c_per_min)


@dataclass(frozen=True)
class Gain:
    """Specific force as a multiple of the pulse rate."""

    gain: float

    def specific_force(self, samples: Samples) -> np.ndarray:
        return self.gain * samples.output


def test_compensation_gives_velocity_increments_of_each_axis() -> None:
    """Force times interval: with a gain alone, the counts times it."""
    recording = pulses(None)
    velocity = compensate(samples(recording), [Gain(0.1), Gain(0.2), Gain(-1.0)], recording.interval_s)
    assert velocity == pytest.approx(recording.imu.accelerometer * [0.1, 0.2, -1.0])


# ----------------------------------------------------------------------------------------------- where to align, or not


def test_a_stated_standstill_is_taken(flight: Recording) -> None:
    stated = replace(flight, start=replace(flight.start, still_until_s=-20.0))
    assert standstill_to_align_on(stated) == Stretch(-STILL_S, -20.0)


def test_a_given_attitude_of_a_moving_vehicle_is_taken(flight: Recording) -> None:
    given = replace(flight, start=replace(flight.start, attitude_rad=(0.0, 0.0, 0.5)))
    assert standstill_to_align_on(given) is None


def test_a_parked_vehicle_is_aligned_unless_its_attitude_has_a_sigma(flight: Recording) -> None:
    """An attitude without a sigma is what alignment is compared with; with a sigma it is believed."""
    start = replace(flight.start, attitude_rad=(0.0, 0.0, 0.5))
    rows = slice(0, round(STILL_S * RATE_HZ))
    imu = replace(flight.imu, **{n: getattr(flight.imu, n)[rows] for n in ("time_s", "gyro", "accelerometer")})
    parked = replace(flight, kind="static", start=start, imu=replace(imu, height_baro_m=None))
    found = standstill_to_align_on(parked)
    assert found.start_s == pytest.approx(-STILL_S, abs=1.0)
    assert found.end_s == pytest.approx(0.0, abs=1.0)
    trusted = replace(parked, start=replace(start, attitude_sigma_rad=(1e-4, 1e-4, 1e-3)))
    assert standstill_to_align_on(trusted) is None


def test_a_quiet_stretch_in_which_the_reference_moves_is_no_standstill(flight: Recording) -> None:
    """Noise makes every part of the recording as quiet as another; only what the receiver says is left to judge."""
    rng = np.random.default_rng(1)
    noise = 0.01 * rng.standard_normal(flight.imu.gyro.shape)
    noisy = replace(flight, imu=replace(flight.imu, gyro=noise, accelerometer=noise))
    with pytest.raises(DataRefused, match="no quiet stretch"):
        standstill_to_align_on(noisy)
    still = replace(flight.reference, velocity_n=np.zeros_like(flight.reference.velocity_n))
    assert standstill_to_align_on(replace(noisy, reference=still)) is not None


# -------------------------------------------------------------------------------------------------------- evaluation


def test_without_errors_alignment_and_navigation_leave_none(flight: Recording, trajectory: Trajectory) -> None:
    """From switching on to landing: attitude found at rest, then the flight against its truth."""
    found = evaluate(flight, flight.imu.accelerometer, align_on=Stretch(-STILL_S, 0.0))
    assert found.alignment.start.time_s == pytest.approx(0.0)
    assert found.alignment.start.attitude_rad == pytest.approx((0.0, 0.0, 30.0 * DEG), abs=ALIGNED_RAD)
    assert found.solution.time_s[0] == pytest.approx(0.0)
    assert found.solution.time_s[-1] == pytest.approx(600.0)
    errors = found.errors
    assert errors.valid.all()
    horizontal = np.hypot(errors.north_m, errors.east_m)
    assert horizontal.max() < 0.5 * 9.8 * ALIGNED_RAD * 600.0**2  # what the tolerance of alignment allows
    assert np.abs(errors.down_m).max() < FLOOR_M


def test_with_the_attitude_given_the_floor_is_reached(flight: Recording, trajectory: Trajectory) -> None:
    given = replace(flight, start=aligned_start(trajectory, -STILL_S))
    errors = evaluate(given, flight.imu.accelerometer).errors
    assert errors.time_s[0] == -STILL_S
    assert np.hypot(errors.north_m, errors.east_m).max() < FLOOR_M
    assert np.abs(errors.velocity_n).max() < FLOOR_MPS


def test_it_starts_where_and_ends_when_it_is_told(flight: Recording, trajectory: Trajectory) -> None:
    """In the middle of the flight, from another start than that of the recording."""
    start = aligned_start(trajectory, 150.0)
    found = evaluate(flight, flight.imu.accelerometer, until_s=400.0, every=5, start=start)
    assert found.solution.time_s[[0, -1]] == pytest.approx([150.0, 400.0])
    assert np.diff(found.solution.time_s) == pytest.approx(1.0)
    assert np.hypot(found.errors.north_m, found.errors.east_m).max() < FLOOR_M


def test_an_unknown_attitude_without_standstill_is_refused(flight: Recording) -> None:
    with pytest.raises(DataRefused, match="attitude of the start is unknown") as caught:
        evaluate(flight, flight.imu.accelerometer)
    assert str(caught.value).startswith("a turn: ")
    assert "\n" not in str(caught.value)


def test_a_vehicle_that_moves_needs_something_to_be_compared_with(flight: Recording, trajectory: Trajectory) -> None:
    alone = replace(flight, reference=None, start=aligned_start(trajectory, -STILL_S))
    with pytest.raises(DataRefused, match="nothing to compare with"):
        evaluate(alone, flight.imu.accelerometer)


def test_a_solution_that_is_no_number_any_more_is_refused() -> None:
    """The loop that damps the height is unstable at steps of 80 s, which milliseconds given for seconds make."""
    count, every_s = 1000, 20.0
    force = np.tile([0.0, 0.0, -9.8 * every_s], (count, 1))
    imu = Imu(every_s * np.arange(1, count + 1), np.zeros((count, 3)), force, "increment")
    start = Start(0.0, 0.8, 0.2, 100.0, attitude_rad=(0.0, 0.0, 0.0))
    with pytest.raises(DataRefused, match=r"samples that are 20 s apart, .* \(milliseconds given for seconds\?\)"):
        evaluate(Recording("parked", "static", start, imu), imu.accelerometer)


def test_a_parked_vehicle_is_compared_with_its_place(flight: Recording, trajectory: Trajectory) -> None:
    """An accelerometer bias of 100 ug east for 300 s: b t^2 / 2 less what Schuler takes, within 1 %."""
    rows = slice(0, round(STILL_S * RATE_HZ))
    imu = replace(flight.imu, **{n: getattr(flight.imu, n)[rows] for n in ("time_s", "gyro", "accelerometer")})
    start = aligned_start(trajectory, -STILL_S)
    parked = Recording("parked", "static", start, replace(imu, height_baro_m=None))
    bias_b = Rotation.from_euler("ZYX", start.attitude_rad[::-1]).inv().apply([0.0, 100.0 * UG, 0.0])
    errors = evaluate(parked, imu.accelerometer + bias_b / RATE_HZ).errors
    radius = radii(start.latitude_rad)[1] + start.height_m
    w = np.sqrt(gravity(start.latitude_rad, start.height_m) / radius)
    expected = 100.0 * UG / w**2 * (1.0 - np.cos(w * STILL_S))
    assert errors.east_m[-1] == pytest.approx(expected, rel=0.01)
    assert abs(errors.down_m[-1]) < 0.05  # Coriolis of the velocity east lifts it a little


@pytest.mark.parametrize(
    ("sensor", "bias", "key"),
    [
        ("gyro", np.array([1.0, -2.0, 3.0]) * DEG_PER_H, "bias_radps"),
        ("accelerometer", np.array([100.0, -200.0, 300.0]) * UG, "bias_mps2"),
    ],
    ids=["gyro", "accelerometer"],
)
def test_a_believed_bias_is_taken_out(
    flight: Recording, trajectory: Trajectory, sensor: str, bias: np.ndarray, key: str
) -> None:
    """Adding a bias to either sensor and believing in it changes nothing; not believing in it does."""
    imu = replace(flight.imu, **{sensor: getattr(flight.imu, sensor) + bias / RATE_HZ})
    biased = replace(flight, start=aligned_start(trajectory, -STILL_S), imu=imu)
    believed = with_belief(biased, **{sensor: {key: tuple(bias)}})
    with_it, without = (evaluate(one, imu.accelerometer).errors for one in (believed, biased))
    assert np.hypot(with_it.north_m, with_it.east_m).max() < FLOOR_M
    assert np.hypot(without.north_m, without.east_m).max() > 100.0


def test_a_believed_time_offset_is_applied(flight: Recording, trajectory: Trajectory) -> None:
    """Stamps of the reference 0.4 s late: at 150 m/s, 60 m if nobody knew."""
    late = replace(flight.reference, time_s=flight.reference.time_s + 0.4)
    recording = replace(flight, reference=late, start=aligned_start(trajectory, -STILL_S))
    velocity = flight.imu.accelerometer
    unknown = evaluate(recording, velocity).errors
    known = evaluate(with_belief(recording, reference={"time_offset_s": 0.4}), velocity).errors
    assert np.hypot(unknown.north_m, unknown.east_m).max() == pytest.approx(60.0, rel=0.01)
    assert np.hypot(known.north_m, known.east_m).max() < FLOOR_M


# ------------------------------------------------------------------------------------------------------- height aid


def test_height_comes_from_the_barometer_else_from_the_receiver_else_from_nowhere(flight: Recording) -> None:
    gps = replace(flight.reference, height_m=flight.reference.height_m + 7.0)
    both = replace(flight, gps=gps)
    assert height_aid(both) is flight.imu.height_baro_m
    for recording in (
        with_belief(both, height={"source": "gps"}),
        replace(both, imu=replace(flight.imu, height_baro_m=None)),
    ):
        assert height_aid(recording) == pytest.approx(flight.imu.height_baro_m + 7.0, abs=1e-6)
    assert height_aid(with_belief(both, height={"source": "none"})) is None
    assert height_aid(replace(flight, imu=replace(flight.imu, height_baro_m=None))) is None


def test_without_any_height_a_flight_is_navigated_with_a_free_vertical_channel(
    flight: Recording, trajectory: Trajectory
) -> None:
    """1 m of wrong height grows as cosh(t sqrt(2 g / R)) from 300 s before to 600 s after time 0: 2.5 m."""
    start = aligned_start(trajectory, -STILL_S)
    recording = replace(
        flight,
        imu=replace(flight.imu, height_baro_m=None),
        start=replace(start, height_m=start.height_m + 1.0),
    )
    errors = evaluate(recording, flight.imu.accelerometer).errors
    growth = np.sqrt(2.0 * gravity(start.latitude_rad, 0.0) / np.mean(radii(start.latitude_rad)))
    assert -errors.down_m[-1] == pytest.approx(np.cosh(900.0 * growth), rel=0.02)


# -------------------------------------------------------------------------------------------------------- lever arm


def test_the_solution_is_carried_to_the_antenna(flight: Recording, trajectory: Trajectory) -> None:
    """Position and velocity of a point of the body, in Earth-fixed axes, by pymap3d and differences of the truth."""
    arm = (2.0, -1.5, -1.0)
    start = aligned_start(trajectory, -STILL_S)
    imu = flight.imu
    solution = navigate(imu.time_s, imu.gyro, imu.accelerometer, start, height_aid_m=imu.height_baro_m)
    moved = at_antenna(solution, arm)
    inside = (solution.time_s > 100.0) & (solution.time_s < 590.0)
    time_s = solution.time_s[inside]

    def antenna(at_s: np.ndarray) -> np.ndarray:
        truth = trajectory.truth(at_s)
        down_arm = Rotation.from_euler("ZYX", truth.attitude_rad[:, ::-1]).apply(arm)
        place = (truth.latitude_rad, truth.longitude_rad, truth.height_m)
        north, east, down = down_arm.T
        return np.stack(pymap3d.enu2ecef(east, north, -down, *place, deg=False), axis=1)

    found = pymap3d.geodetic2ecef(moved.latitude_rad, moved.longitude_rad, moved.height_m, deg=False)
    assert np.abs(np.stack(found, axis=1)[inside] - antenna(time_s)).max() < FLOOR_M
    velocity_e = (antenna(time_s + 0.05) - antenna(time_s - 0.05)) / 0.1
    east, north, up = pymap3d.ecef2enuv(
        *velocity_e.T, solution.latitude_rad[inside], solution.longitude_rad[inside], deg=False
    )
    expected = np.stack([north, east, -up], axis=1)
    assert np.abs(moved.velocity_n[inside] - expected).max() < ARM_TOLERANCE_MPS
    assert np.abs(solution.velocity_n[inside] - expected).max() > 50.0 * ARM_TOLERANCE_MPS


def test_no_lever_arm_leaves_the_solution_alone(flight: Recording, trajectory: Trajectory) -> None:
    imu = flight.imu
    solution = navigate(imu.time_s[:80], imu.gyro[:80], imu.accelerometer[:80], aligned_start(trajectory, -STILL_S))
    assert at_antenna(solution, (0.0, 0.0, 0.0)) is solution


# -------------------------------------------------------------------------------------------------------- measures


def test_measures_of_a_velocity_that_is_wrong_by_a_constant(flight: Recording, trajectory: Trajectory) -> None:
    """Errors replaced by a drift of 1 nmi/h north: every radial error rate is 1, the velocity RMS its speed."""
    found = evaluate(replace(flight, start=aligned_start(trajectory, -STILL_S)), flight.imu.accelerometer)
    time_s = found.errors.time_s - found.solution.time_s[0]
    speed = NMI / 3600.0
    drift = replace(
        found.errors,
        north_m=speed * time_s,
        east_m=np.zeros(time_s.size),
        velocity_n=np.tile([speed, 0.0, 0.0], (time_s.size, 1)),
    )
    numbers = measures(replace(found, errors=drift))
    rates = numbers.radial_error_rate_nmi_per_h
    assert rates["final"] == pytest.approx(1.0)
    assert rates["least_squares"] == pytest.approx(1.0)
    assert rates["radial_error_rate_rms"] == pytest.approx(1.0)
    rms = numbers.velocity_rms_mps
    assert (rms["north"], rms["east"], rms["down"]) == pytest.approx((speed, 0.0, 0.0))


def test_restarts_of_an_instrument_without_errors_do_not_drift(flight: Recording) -> None:
    found = restarts(flight, flight.imu.accelerometer, 60.0)
    assert found.count == 14  # whole minutes between the first sample of the IMU, one after the first fix, and the end
    assert found.after_s == pytest.approx(np.arange(1.0, 61.0))
    assert found.position_rms_m.max() < FLOOR_M
    assert found.velocity_rms_mps.max() < FLOOR_MPS


def test_restarts_grow_as_a_bias_says(flight: Recording) -> None:
    """Vertical axis apart, a bias of 1 mg along the wings: b t^2 / 2 and b t, whatever the heading."""
    biased = flight.imu.accelerometer + np.array([1000.0 * UG, 0.0, 0.0]) / RATE_HZ
    found = restarts(flight, biased, 60.0)
    expected_m, expected_mps = 0.5 * 1000.0 * UG * found.after_s**2, 1000.0 * UG * found.after_s
    assert found.position_rms_m == pytest.approx(expected_m, rel=0.02)
    assert found.velocity_rms_mps == pytest.approx(expected_mps, rel=0.02)


def test_restarts_without_an_attitude_start_from_the_fixes(flight: Recording) -> None:
    """The IMU has no errors, so that a piece drifts by what the fixes before it left of its start alone."""
    blind = replace(flight, reference=replace(flight.reference, attitude_rad=None))
    found = restarts(blind, flight.imu.accelerometer, 60.0)
    assert found.count >= 3
    assert found.position_rms_m.max() < STARTED_FROM_FIXES_M


def test_restarts_need_room(flight: Recording) -> None:
    with pytest.raises(DataRefused, match="no stretch of 5000 s"):
        restarts(flight, flight.imu.accelerometer, 5000.0)
