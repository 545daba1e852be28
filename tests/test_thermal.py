"""Lag, rate and thermometer against closed forms and scipy; the heat balance against itself differentiated."""

from __future__ import annotations

import numpy as np
import pytest
from ambiance import Atmosphere
from scipy.signal import lsim

from ins_eval.errors import UsageError
from ins_eval.imu import Mission
from ins_eval.profile import Anchor, Before, load
from ins_eval.thermal import AIR_HEAT_CAPACITY, Temperature, Thermometer, filtered_rate, imu_temperature, lagged
from ins_eval.trajectory import Trajectory

EXACT_C = 1e-9
BALANCE_TOLERANCES_C = (1e-3, 0.02)  # residual of the heat balance: spread, worst (a kink of the ambient, 1 s grid)
STEP_C = 0.0625
ANCHOR_TOLERANCE_C = 1e-9
GRID_TOLERANCE_C = 0.1  # a step of the air is a ramp over one point of the grid, 60 s of tau = 4500 s
PAPER_RATE_C_PER_MIN = 0.2  # Paper A: about 0.2 degC/min


@pytest.fixture(scope="module")
def trajectory() -> Trajectory:
    return Trajectory(load("climb-cruise-landing"))


@pytest.fixture(scope="module")
def flight(trajectory: Trajectory) -> Temperature:
    return imu_temperature(trajectory)


# ----------------------------------------------------------------------------------------------------- lag and rate


def test_lag_of_a_step() -> None:
    """y = y0 exp(-t / tau), with any spacing of the samples."""
    time_s = np.cumsum(np.random.default_rng(1).exponential(5.0, 400))
    response = lagged(time_s, np.zeros(400), 70.0, start=3.0)
    assert response == pytest.approx(3.0 * np.exp(-(time_s - time_s[0]) / 70.0), abs=EXACT_C)


def test_lag_of_a_ramp() -> None:
    """y = s (t - tau (1 - exp(-t / tau))): it ends up tau behind."""
    time_s = np.cumsum(np.random.default_rng(2).exponential(5.0, 400))
    t = time_s - time_s[0]
    expected = 0.02 * (t - 70.0 * (1.0 - np.exp(-t / 70.0)))
    assert lagged(time_s, 0.02 * t, 70.0) == pytest.approx(expected, abs=EXACT_C)


def test_lag_of_any_signal_is_that_of_scipy() -> None:
    """1 / (tau s + 1) with the signal straight between samples (scipy.signal.lsim, first-order hold)."""
    time_s = np.arange(0.0, 1000.0, 2.5)
    signal = np.cumsum(np.random.default_rng(3).standard_normal(time_s.size))
    signal -= signal[0]
    _, expected, _ = lsim(([1.0], [45.0, 1.0]), signal, time_s)
    assert lagged(time_s, signal, 45.0) == pytest.approx(expected, abs=EXACT_C)


def test_lag_between_irregular_samples_is_exact() -> None:
    """Leaving out samples of a piecewise straight signal between its corners changes nothing where they remain."""
    fine_s = np.arange(0.0, 601.0, 1.0)
    signal = np.interp(fine_s, [0.0, 120.0, 400.0, 600.0], [10.0, -3.0, -3.0, 22.0])
    kept = np.unique(np.concatenate([[0, 120, 400, 600], np.random.default_rng(4).integers(0, 600, 60)]))
    assert lagged(fine_s[kept], signal[kept], 33.0) == pytest.approx(lagged(fine_s, signal, 33.0)[kept], abs=EXACT_C)


def test_rate_of_a_ramp_reaches_its_slope() -> None:
    """r = s (1 - exp(-t / tau)) in degC/min, tau 180 s if nothing else is said."""
    time_s = np.arange(0.0, 3600.0, 0.5)
    slope_c_per_min = -0.4
    rate = filtered_rate(time_s, 22.0 + slope_c_per_min / 60.0 * time_s)
    assert rate == pytest.approx(slope_c_per_min * (1.0 - np.exp(-time_s / 180.0)), abs=EXACT_C)
    quick = filtered_rate(time_s, 22.0 + slope_c_per_min / 60.0 * time_s, 60.0)
    assert quick == pytest.approx(slope_c_per_min * (1.0 - np.exp(-time_s / 60.0)), abs=EXACT_C)


def test_rate_is_causal() -> None:
    """What comes later changes nothing before it."""
    time_s = np.arange(0.0, 600.0)
    signal = np.sin(time_s / 50.0)
    changed = np.where(time_s >= 300.0, 40.0, signal)
    same = time_s < 300.0
    assert np.array_equal(filtered_rate(time_s, signal)[same], filtered_rate(time_s, changed)[same])
    assert filtered_rate(time_s, changed)[300] != filtered_rate(time_s, signal)[300]


# ------------------------------------------------------------------------------------------------------ thermometer


def test_the_thermometer_reads_whole_steps_once_a_period_and_late() -> None:
    """Steps of 0.0625 degC, held for a second, 10 s behind a ramp."""
    time_s = np.arange(0.0, 600.0, 0.1)
    ramp_c_per_s = 0.01
    reading = Thermometer().read(time_s, 15.0 + ramp_c_per_s * time_s)
    assert np.array_equal(reading / STEP_C, np.round(reading / STEP_C))
    assert np.array_equal(reading.reshape(-1, 10), np.repeat(reading[::10, None], 10, axis=1))
    late = 15.0 + ramp_c_per_s * (time_s[::10] - 10.0 * (1.0 - np.exp(-time_s[::10] / 10.0)))
    assert np.abs(reading[::10] - late).max() <= 0.5 * STEP_C + EXACT_C
    assert np.unique(reading).size > 50


def test_a_thermometer_without_lag_and_with_other_steps() -> None:
    time_s = np.arange(0.0, 100.0)
    true = 20.0 + np.sin(time_s / 10.0)
    reading = Thermometer(lag_s=0.0, step_c=0.5, period_s=5.0).read(time_s, true)
    assert np.array_equal(reading, np.round(true[(time_s // 5.0).astype(int) * 5] / 0.5) * 0.5)


# ------------------------------------------------------------------------------------------- temperature of the IMU


def test_the_heat_balance_holds(trajectory: Trajectory, flight: Temperature) -> None:
    """tau T' = T_amb + r V^2 / (2 c_p) + P - T, one P for the whole flight, T' by differences."""
    thermal = trajectory.profile.thermal
    truth = trajectory.truth(flight.time_s)
    ambient = Atmosphere(truth.height_m).temperature - Atmosphere(400.0).temperature + thermal.ground_c
    stream = thermal.recovery_factor * np.sum(truth.velocity_n**2, axis=1) / (2.0 * AIR_HEAT_CAPACITY)
    slope = np.gradient(flight.temperature_c, flight.time_s)
    self_heating = thermal.time_constant_s * slope + flight.temperature_c - ambient - stream
    inner = self_heating[1:-1]
    assert np.std(inner) < BALANCE_TOLERANCES_C[0]
    assert np.abs(inner - inner.mean()).max() < BALANCE_TOLERANCES_C[1]
    assert 0.0 < inner.mean() < 80.0


def test_it_is_switched_on_at_ground_temperature(trajectory: Trajectory, flight: Temperature) -> None:
    assert flight.time_s[0] == -900.0
    assert flight.temperature_c[0] == pytest.approx(trajectory.profile.thermal.ground_c, abs=EXACT_C)


def test_it_rises_at_start_up_falls_to_minus_11_and_rises_in_the_landing(flight: Temperature) -> None:
    """The course of Paper A, section 3.2."""
    temperature, time_s = flight.temperature_c, flight.time_s
    assert np.all(np.diff(temperature[time_s <= 0.0]) > 0.0)
    assert temperature[np.flatnonzero(time_s == 7200.0)[0]] == pytest.approx(-11.0, abs=ANCHOR_TOLERANCE_C)
    assert temperature[-1] > -11.0 + 3.0
    assert np.all(np.diff(temperature[time_s > 7800.0]) > 0.0)
    assert 7200.0 <= time_s[np.argmin(temperature)] < 7800.0  # it lags the warmer air by minutes
    cruise = (time_s > 1800.0) & (time_s < 7200.0)
    assert np.all(np.diff(temperature[cruise]) < 0.0)


def test_mean_size_of_the_rate_is_that_of_the_paper(flight: Temperature) -> None:
    """About 0.2 degC/min in flight."""
    rate = filtered_rate(flight.time_s, flight.temperature_c)[flight.time_s >= 0.0]
    assert np.abs(rate).mean() == pytest.approx(PAPER_RATE_C_PER_MIN, rel=0.4)


def test_self_heating_that_is_given_is_taken() -> None:
    """A vehicle that stands: T = T_ground + P (1 - exp(-t / tau))."""
    oven = load("oven")
    thermal = oven.thermal.model_copy(update={"same_as": None, "self_heating_c": 12.0, "time_constant_s": 1000.0})
    warm = imu_temperature(Trajectory(oven.model_copy(update={"thermal": thermal})))
    expected = thermal.ground_c + 12.0 * (1.0 - np.exp(-(warm.time_s + 900.0) / 1000.0))
    assert warm.temperature_c == pytest.approx(expected, abs=EXACT_C)


def test_the_oven_repeats_the_temperatures_of_the_flight(flight: Temperature) -> None:
    oven = imu_temperature(Trajectory(load("oven")))
    assert np.array_equal(oven.temperature_c, flight.temperature_c)


def test_temperatures_are_not_repeated_twice(tmp_path) -> None:
    """Not from a profile that only repeats those of another, least of all from itself."""
    path = tmp_path / "mine.toml"
    path.write_text(f'extends = "oven"\n[thermal]\nsame_as = "{path}"\n')
    with pytest.raises(UsageError, match="which has none of its own"):
        imu_temperature(Trajectory(load(path)))


def test_period_of_the_grid_does_not_matter(trajectory: Trajectory, flight: Temperature) -> None:
    coarse = imu_temperature(trajectory, period_s=10.0)
    assert coarse.temperature_c == pytest.approx(flight.temperature_c[::10], abs=5e-3)


def test_readings_at_the_samples_are_never_ahead(flight: Temperature) -> None:
    """A sample carries the latest reading of the thermometer, as steps of 0.0625 degC."""
    mission = Mission(load("climb-cruise-landing"), 10.0)
    reading = Thermometer().read(flight.time_s, flight.temperature_c)
    for k in (0, 8, 9, 10, 11, 5000, 92999):
        latest = flight.time_s <= mission.increments.time_s[k] + 1e-9
        assert mission.reading_c[k] == reading[latest][-1]


# ------------------------------------------------------------------------------------- other days, and what was before


def of_day(**thermal: object) -> tuple[Trajectory, Temperature]:
    """The flight with another table of temperatures, its own heat 15 degC."""
    profile = load("climb-cruise-landing")
    table = profile.thermal.model_copy(update={"anchor": None, "self_heating_c": 15.0, **thermal})
    trajectory = Trajectory(profile.model_copy(update={"thermal": table}))
    return trajectory, imu_temperature(trajectory)


def test_the_air_falls_with_the_stated_lapse() -> None:
    """T_amb = ground - lapse (h - h0), found back as T - excess less the stream's recovery."""
    trajectory, temperature = of_day(ground_c=20.0, lapse_c_per_km=5.0, recovery_factor=0.0)
    height_m = trajectory.truth(temperature.time_s).height_m
    air_c = temperature.temperature_c - temperature.excess_c
    assert air_c == pytest.approx(20.0 - 5e-3 * (height_m - 400.0), abs=EXACT_C)
    assert np.ptp(air_c) == pytest.approx(48.0, abs=1e-6)


def test_the_excess_is_what_drives_the_balance() -> None:
    """tau T' = P - (T - T_air)."""
    _, temperature = of_day()
    slope = np.gradient(temperature.temperature_c, temperature.time_s)[1:-1]
    residual = 4500.0 * slope - 15.0 + temperature.excess_c[1:-1]
    assert np.std(residual) < BALANCE_TOLERANCES_C[0]
    assert np.abs(residual).max() < BALANCE_TOLERANCES_C[1]


def test_what_was_before_decides_the_first_temperature() -> None:
    """Warmed for t1 and cooling for t2: 8 + P (1 - exp(-t1 / tau)) exp(-t2 / tau), tau 75 min."""
    before = ({"hours": 40.0, "air_c": 8.0}, {"hours": 2.0, "air_c": 8.0, "on": True}, {"hours": 1.0, "air_c": 8.0})
    before = tuple(Before(**stretch) for stretch in before)
    _, temperature = of_day(ground_c=8.0, before=before)
    expected = 8.0 + 15.0 * (1.0 - np.exp(-120.0 / 75.0)) * np.exp(-60.0 / 75.0)
    assert temperature.temperature_c[0] == pytest.approx(expected, abs=GRID_TOLERANCE_C)
    assert temperature.before.time_s[0] == -900.0 - 43.0 * 3600.0
    assert temperature.before.time_s[-1] < -900.0
    _, cold = of_day(ground_c=8.0)
    late = temperature.time_s > 8000.0
    assert np.abs(temperature.temperature_c - cold.temperature_c)[late].max() < 0.2 * (expected - 8.0)


def test_an_anchor_is_met_whatever_was_before() -> None:
    before = (Before(hours=3.0, air_c=-5.0, on=True),)
    _, temperature = of_day(before=before, self_heating_c=None, anchor=Anchor(time_s=7200.0, temperature_c=-11.0))
    assert np.interp(7200.0, temperature.time_s, temperature.temperature_c) == pytest.approx(-11.0, abs=1e-9)
    assert temperature.temperature_c[0] > -5.0
