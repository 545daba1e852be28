"""The epoxy: the paper's tables, the steady state, and relaxation against closed form and another integrator."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from ins_eval.accelerometer import Population, ThermalRun
from ins_eval.accelerometer.creep import Creep, creep_ratio, epoxy, material_clock
from ins_eval.streams import Streams

# recomputed from Paper A, Tables 2 and 3
MEAN_CREEP_UM = (0.415, 0.783, 3.077)
MEAN_THERMAL_UM = (7.698, 7.486, 12.577)
CREEP_VARIATION_PERCENT = (86.74, 53.48, 77.60)  # (max - min) / #1; the paper prints 84.88, 42.44, 77.60
THERMAL_VARIATION_PERCENT = (1.01, 1.36, 6.95)  # the paper prints 1.01, 1.32, 5.8
CREEP_SCATTER_PERCENT = (29.5, 17.5, 24.1)
RATIO = (0.054, 0.105, 0.245)

OMEGA1_UG_PER_C = 50.0
RELATIVE_TOLERANCE = 1e-5


@pytest.fixture
def creep(population: Population) -> Creep:
    """Without scatter, so that xi = 1."""
    return population["creep"].model_copy(update={"scatter": 0.0})


def bias_ug(creep: Creep, run: ThermalRun) -> np.ndarray:
    return creep.contribution(OMEGA1_UG_PER_C, run, Streams(0)).bias_ug


def test_tables_2_and_3() -> None:
    data = epoxy()
    for key, mean, variation in (
        ("creep_um", MEAN_CREEP_UM, CREEP_VARIATION_PERCENT),
        ("thermal_um", MEAN_THERMAL_UM, THERMAL_VARIATION_PERCENT),
    ):
        values = data[key]
        assert values.shape == (3, 10)
        assert values.mean(axis=1) == pytest.approx(mean, abs=0.5e-3)
        assert 100 * np.ptp(values, axis=1) / values[:, 0] == pytest.approx(variation, abs=0.5e-2)
    scatter = 100 * data["creep_um"].std(axis=1, ddof=1) / data["creep_um"].mean(axis=1)
    assert scatter == pytest.approx(CREEP_SCATTER_PERCENT, abs=0.06)


def test_amplitude_follows_from_the_tables() -> None:
    assert creep_ratio(np.array([-55.0, 30.0, 85.0])) == pytest.approx(RATIO, abs=0.5e-3)
    assert creep_ratio(np.array([-80.0, 120.0])) == pytest.approx((RATIO[0], RATIO[2]), abs=0.5e-3)
    assert creep_ratio(np.array([-12.5])) == pytest.approx((RATIO[0] + RATIO[1]) / 2, abs=0.5e-3)


@pytest.mark.parametrize("temperature_c", [-55.0, 30.0, 85.0])
def test_steady_state(creep: Creep, temperature_c: float) -> None:
    hours = 200.0  # 27 of the longest time constants at -55 degC
    time_s = np.append(0.0, np.arange(60.0, hours * 3600.0, 600.0))
    run = ThermalRun(time_s, np.where(time_s > 0, temperature_c, 22.0), "chamber")
    ratio = dict(zip((-55.0, 30.0, 85.0), RATIO, strict=True))[temperature_c]
    expected = OMEGA1_UG_PER_C * ratio * (temperature_c - 22.0)
    assert bias_ug(creep, run)[-1] == pytest.approx(expected, rel=0.5e-3 / ratio)


def test_a_cold_soak_is_an_equilibrium(creep: Creep) -> None:
    run = ThermalRun(np.arange(0.0, 7200.0, 60.0), np.full(120, -55.0), "flight")
    assert bias_ug(creep, run) == pytest.approx(OMEGA1_UG_PER_C * RATIO[0] * -77.0, rel=0.01)
    assert np.ptp(bias_ug(creep, run)) < 1e-9


@pytest.mark.parametrize("temperature_c", [-40.0, 22.5, 60.0])
def test_relaxation_after_a_step_is_a_sum_of_exponentials(creep: Creep, temperature_c: float) -> None:
    time_s = np.append([0.0, 1e-3], np.arange(60.0, 300.0 * 60.0, 60.0))
    run = ThermalRun(time_s, np.where(time_s > 0, temperature_c, 22.0), "chamber")
    tau_s = np.array([8.0, 40.0, 120.0]) * 60.0 * np.exp(-(temperature_c - 22.0) / 60.0)
    rest = np.exp(-np.outer(time_s, 1.0 / tau_s)) @ [0.3, 0.35, 0.35]
    full = OMEGA1_UG_PER_C * creep_ratio(temperature_c) * (temperature_c - 22.0)
    assert bias_ug(creep, run) == pytest.approx(full * (1.0 - rest), abs=RELATIVE_TOLERANCE * abs(full))


def test_a_ramp_agrees_with_another_integrator(creep: Creep, through) -> None:
    run = through((22.0, -60.0, 70.0), 0.9)
    corners_s = (0.0, 82.0 / 0.9 * 60.0, 212.0 / 0.9 * 60.0)

    def slope(t: float, z: np.ndarray) -> np.ndarray:
        temperature = np.interp(t, corners_s, (22.0, -60.0, 70.0))
        tau_s = np.array([8.0, 40.0, 120.0]) * 60.0 * np.exp(-(temperature - 22.0) / 60.0)
        return (creep_ratio(temperature) * (temperature - 22.0) - z) / tau_s

    z = solve_ivp(slope, (0.0, corners_s[-1]), np.zeros(3), rtol=1e-9, atol=1e-10, max_step=60.0).y[:, -1]
    assert bias_ug(creep, run)[-1] == pytest.approx(OMEGA1_UG_PER_C * z @ [0.3, 0.35, 0.35], rel=1e-4)


def test_the_material_clock_is_exact_on_a_ramp() -> None:
    time_s, difference_c = np.array([0.0, 600.0, 700.0]), np.array([-30.0, 45.0, 45.0])
    on_ramp, _ = quad(lambda t: np.exp((-30.0 + 75.0 * t / 600.0) / 60.0), 0.0, 600.0)
    expected = (0.0, on_ramp, on_ramp + 100.0 * np.exp(45.0 / 60.0))
    assert material_clock(time_s, difference_c, 60.0) == pytest.approx(expected, rel=1e-12)


def test_it_is_driven_by_the_elements_not_by_the_surface(creep: Creep, flight: ThermalRun) -> None:
    late = bias_ug(creep, flight.with_element_lag(600.0))
    element_c = flight.with_element_lag(600.0).element_c
    assert late == pytest.approx(bias_ug(creep, ThermalRun(flight.time_s, element_c, "flight")), abs=1e-9)
    assert np.abs(late - bias_ug(creep, flight)).max() > 0.5


def test_xi_has_mean_one_scatters_by_a_quarter_and_is_redrawn(population: Population, flight) -> None:
    creep = population["creep"]
    at_end = np.array([creep.contribution(OMEGA1_UG_PER_C, flight, Streams(1).at(k)).bias_ug[-1] for k in range(3000)])
    xi = at_end / bias_ug(creep.model_copy(update={"scatter": 0.0}), flight)[-1]
    assert np.mean(xi) == pytest.approx(1.0, abs=4 * 0.25 / np.sqrt(3000))
    assert np.std(xi) == pytest.approx(0.25, rel=0.08)
    assert xi.min() > 0.0


def test_it_takes_the_thermal_coefficient_of_the_same_accelerometer(population: Population, rng) -> None:
    assert population["creep"].draw(rng, {"bias_temperature": np.array([-37.0, 0.1, 0.2])}) == -37.0


def test_each_time_constant_needs_a_weight(population: Population) -> None:
    values = population["creep"].model_dump() | {"weights": (0.5, 0.5)}
    with pytest.raises(ValueError, match="2 weights for 3 time_constants_min"):
        Creep.model_validate(values)
