"""A mission recorded by an instrument: what is in the recording, and that its parts do not disturb each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from ins_eval.accelerometer import EFFECTS
from ins_eval.accelerometer import Population as AccelerometerPopulation
from ins_eval.earth import EARTH_RATE, gravity
from ins_eval.gyro import GyroPopulation
from ins_eval.imu import InstrumentPopulation, Mission
from ins_eval.profile import Baro, load
from ins_eval.recording import Recording
from ins_eval.streams import Streams
from ins_eval.thermal import imu_temperature
from ins_eval.trajectory import Trajectory
from ins_eval.units import STANDARD_GRAVITY

RATE_HZ = 10.0
CHANCE = 1e-3  # of a chi-square bound, each side; seeds are fixed
COUNT = 1.0  # one pulse
EXACT = 1e-12


@pytest.fixture(scope="module")
def mission() -> Mission:
    return Mission(load("climb-cruise-landing"), RATE_HZ)


@pytest.fixture(scope="module")
def accelerometers() -> AccelerometerPopulation:
    return AccelerometerPopulation.load()


@pytest.fixture(scope="module")
def recording(mission: Mission, accelerometers: AccelerometerPopulation) -> Recording:
    return recorded(mission, InstrumentPopulation(accelerometers))


def recorded(mission: Mission, population: InstrumentPopulation, seed: int = 1) -> Recording:
    streams = Streams(seed)
    return mission.record(population.draw(streams), streams.at("flight"))


def test_a_recording_covers_the_flight_from_switching_on(mission: Mission, recording: Recording) -> None:
    imu = recording.imu
    assert recording.kind == "flight"
    assert recording.start.time_s == -900.0
    assert recording.start.still_until_s == 0.0
    assert recording.start.attitude_rad is None
    assert imu.time_s == pytest.approx(-900.0 + np.arange(1, 93001) / RATE_HZ)
    for column in (imu.gyro, imu.accelerometer, imu.temperature_c, imu.height_baro_m):
        assert len(column) == imu.time_s.size
        assert np.all(np.isfinite(column))
    assert imu.accelerometer_form == "pulse"
    assert np.array_equal(imu.temperature_c / 0.0625, np.round(imu.temperature_c / 0.0625))


def test_counts_are_whole_and_hold_the_specific_force_within_one(
    mission: Mission, accelerometers: AccelerometerPopulation
) -> None:
    """With quantisation alone, all counts so far over K1 are the velocity so far, within one count, at any time."""
    kept = accelerometers.only("scale_polynomial", "quantisation")
    streams = Streams(1)
    instrument = InstrumentPopulation(kept, GyroPopulation().perfect()).draw(streams)
    imu = mission.record(instrument, streams.at("flight")).imu
    assert np.array_equal(imu.accelerometer, np.round(imu.accelerometer))
    for axis, unit in enumerate(instrument.accelerometers):
        slow = unit.slow(mission.run, streams.at("flight"))
        scale = np.interp(imu.time_s, mission.run.time_s, slow.scale)
        ideal = np.cumsum(scale * mission.increments.dv_b[:, axis] / STANDARD_GRAVITY)
        assert np.abs(np.cumsum(imu.accelerometer[:, axis]) - ideal).max() <= COUNT + 1e-3


def test_the_same_streams_give_the_same_bytes(mission: Mission, accelerometers: AccelerometerPopulation) -> None:
    population = InstrumentPopulation(accelerometers)
    one, again, other = (recorded(mission, population, seed) for seed in (1, 1, 2))
    for name in ("gyro", "accelerometer", "height_baro_m"):
        assert getattr(one.imu, name).tobytes() == getattr(again.imu, name).tobytes()
        assert getattr(one.imu, name).tobytes() != getattr(other.imu, name).tobytes()
    assert one.gps.latitude_rad.tobytes() == again.gps.latitude_rad.tobytes()


@pytest.mark.parametrize("effect", [effect.name for effect in EFFECTS])
def test_an_accelerometer_effect_moves_no_other_draw(
    mission: Mission, recording: Recording, accelerometers: AccelerometerPopulation, effect: str
) -> None:
    """Gyros, barometer and receiver stay as they are to the last bit, whichever effect is switched off."""
    other = recorded(mission, InstrumentPopulation(accelerometers.without(effect)))
    assert np.array_equal(other.imu.gyro, recording.imu.gyro)
    assert np.array_equal(other.imu.height_baro_m, recording.imu.height_baro_m)
    assert np.array_equal(other.gps.velocity_n, recording.gps.velocity_n, equal_nan=True)


def test_gyro_errors_move_no_accelerometer(
    mission: Mission, recording: Recording, accelerometers: AccelerometerPopulation
) -> None:
    other = recorded(mission, InstrumentPopulation(accelerometers, GyroPopulation().perfect()))
    assert np.array_equal(other.imu.accelerometer, recording.imu.accelerometer)
    assert np.array_equal(other.imu.gyro, mission.increments.dtheta_b)
    one_more = recorded(mission, InstrumentPopulation(accelerometers, replace(GyroPopulation(), scale_ppm=0.0)))
    assert np.array_equal(one_more.imu.accelerometer, recording.imu.accelerometer)


# ------------------------------------------------------------------------------------------------------- barometer


def test_the_barometer_agrees_at_the_start_and_then_wanders(mission: Mission, recording: Recording) -> None:
    """A wander that begins at zero: sigma sqrt(1 - exp(-2 t / tau)) after t."""
    wander = recording.imu.height_baro_m - mission.height_m
    assert abs(wander[0]) < 0.05
    assert np.abs(np.diff(wander)).max() < 0.1
    assert np.abs(wander).max() > 1.0


def test_the_barometer_has_the_stated_sigma(mission: Mission, accelerometers: AccelerometerPopulation) -> None:
    """Over 40 flights, 20 and 155 minutes after switching on."""
    slow, population = Mission(mission.profile, 1.0), InstrumentPopulation(accelerometers.only("scale_polynomial"))
    heights = [recorded(slow, population, seed).imu.height_baro_m[[1199, 9299]] for seed in range(40)]
    draws = np.array(heights) - slow.height_m[[1199, 9299]]
    sigma = 2.0 * np.sqrt(1.0 - np.exp(-2.0 * np.array([1200.0, 9300.0]) / 1800.0))
    low, high = chi2.ppf([CHANCE, 1.0 - CHANCE], 40)
    squares = np.sum((draws / sigma) ** 2, axis=0)
    assert np.all((squares > low) & (squares < high))


def test_a_barometer_without_error_reads_the_height(mission: Mission, accelerometers: AccelerometerPopulation) -> None:
    perfect = Mission(mission.profile.model_copy(update={"baro": Baro(sigma_m=0.0)}), RATE_HZ)
    found = recorded(perfect, InstrumentPopulation(accelerometers))
    assert np.array_equal(found.imu.height_baro_m, perfect.height_m)


# ------------------------------------------------------------------------------------------------- ideal and in oven


def test_the_ideal_recording_has_no_errors(mission: Mission) -> None:
    """Increments, height and reference are the truth itself, from time 0 on, with the attitude given."""
    ideal = mission.ideal()
    late = mission.increments.time_s > 0.5 / RATE_HZ
    assert np.count_nonzero(late) == 84000
    assert ideal.start.time_s == 0.0
    assert ideal.imu.accelerometer_form == "increment"
    assert np.array_equal(ideal.imu.time_s, mission.increments.time_s[late])
    assert ideal.imu.time_s[0] == pytest.approx(1.0 / RATE_HZ)
    assert np.array_equal(ideal.imu.gyro, mission.increments.dtheta_b[late])
    assert np.array_equal(ideal.imu.accelerometer, mission.increments.dv_b[late])
    truth = Trajectory(mission.profile).truth(ideal.reference.time_s)
    assert np.array_equal(ideal.reference.latitude_rad, truth.latitude_rad)
    assert np.array_equal(ideal.reference.velocity_n, truth.velocity_n)
    assert ideal.start.attitude_rad == pytest.approx((0.0, 0.0, np.deg2rad(60.0)), abs=EXACT)
    height = Trajectory(mission.profile).truth(ideal.imu.time_s).height_m
    assert ideal.imu.height_baro_m == pytest.approx(height, abs=1e-9)


def test_the_oven_is_level_at_rest_and_as_warm_as_the_flight(mission: Mission) -> None:
    """Gravity straight up the z axis, Earth's rate in heading 60 degrees, the temperatures of the flight."""
    oven = mission.in_oven(RATE_HZ)
    latitude = np.deg2rad(34.65)
    force = oven.increments.dv_b * RATE_HZ
    up = np.broadcast_to([0.0, 0.0, -gravity(latitude, 400.0)], force.shape)
    assert force == pytest.approx(up, abs=1e-9)
    north, heading = EARTH_RATE * np.cos(latitude), np.deg2rad(60.0)
    rate = [north * np.cos(heading), -north * np.sin(heading), -EARTH_RATE * np.sin(latitude)]
    assert oven.increments.dtheta_b * RATE_HZ == pytest.approx(np.broadcast_to(rate, force.shape), abs=EXACT)
    assert np.array_equal(oven.temperature.temperature_c, imu_temperature(mission.trajectory).temperature_c)
    assert np.array_equal(oven.reading_c, mission.reading_c)
    assert not np.any(oven.trajectory.truth(oven.increments.time_s).velocity_n)
    assert np.ptp(oven.height_m) == 0.0
    assert oven.run.kind == "oven"


def test_an_oven_is_recorded_without_receiver_and_with_its_attitude(
    mission: Mission, accelerometers: AccelerometerPopulation
) -> None:
    found = recorded(mission.in_oven(1.0), InstrumentPopulation(accelerometers))
    assert found.kind == "oven"
    assert found.gps is None
    assert found.start.attitude_rad is not None


def test_the_shipped_oven_profile_has_the_temperatures_of_the_flight(mission: Mission) -> None:
    oven = Mission(load("oven"), 1.0)
    assert oven.run.kind == "oven"
    assert np.array_equal(oven.temperature.temperature_c, imu_temperature(mission.trajectory).temperature_c)


def test_a_gradient_warms_each_accelerometer_by_its_share_of_the_excess(
    mission: Mission, accelerometers: AccelerometerPopulation
) -> None:
    """The same heat flows in flight and in an oven with the same temperatures; the thermometer sees none of it."""
    drawn = InstrumentPopulation(accelerometers, gradient=0.02).draw(Streams(1))
    assert np.any(drawn.gradient)
    plain = InstrumentPopulation(accelerometers).draw(Streams(1))
    assert plain.gradient == (0.0, 0.0, 0.0)
    for unit, same in zip(drawn.accelerometers, plain.accelerometers, strict=True):
        np.testing.assert_equal(unit.units, same.units)
    warm = mission.run_at(0.02)
    np.testing.assert_allclose(warm.temperature_c - mission.run.temperature_c, 0.02 * mission.temperature.excess_c)
    oven = mission.in_oven(1.0).run_at(0.02)
    assert np.array_equal(oven.temperature_c, warm.temperature_c)
    found = [mission.record(of, Streams(1).at("flight")) for of in (drawn, plain)]
    assert np.array_equal(found[0].imu.temperature_c, found[1].imu.temperature_c)
    assert not np.array_equal(found[0].imu.accelerometer, found[1].imu.accelerometer)


def test_gradients_have_the_stated_sigma(accelerometers: AccelerometerPopulation) -> None:
    population = InstrumentPopulation(accelerometers.only("quantisation"), gradient=0.02)
    drawn = np.array([population.draw(Streams(7).at(k)).gradient for k in range(200)])
    low, high = chi2.ppf([CHANCE, 1.0 - CHANCE], drawn.size)
    assert low < np.sum((drawn / 0.02) ** 2) < high
