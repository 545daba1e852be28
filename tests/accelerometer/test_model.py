"""Drawing instruments, switching effects off, the pulse convention, and parameter files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ins_eval.accelerometer import EFFECTS, Absent, Population, SlowErrors, ThermalRun
from ins_eval.errors import UsageError
from ins_eval.streams import Streams

STREAMS = Streams(11).at("instrument", 0)
FLIGHT = STREAMS.at("flight")
NAMES = tuple(effect.name for effect in EFFECTS)
SLOW = NAMES[1:8]
BIAS_TOLERANCE_UG = 1e-6
PPM_TOLERANCE = 1e-6
G = 9.80665


def slow(population: Population, run: ThermalRun, axis: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Bias in ug and scale factor in ppm of gamma."""
    unit = population.draw(STREAMS)[axis]
    scale, bias_ug = unit.slow(run, FLIGHT)
    return bias_ug, 1e6 * (scale / unit.gamma - 1.0)


def test_effects_stand_in_a_stated_order() -> None:
    assert SLOW == (
        "scale_polynomial",
        "magnet_hysteresis",
        "scale_repeatability",
        "bias_temperature",
        "creep",
        "turn_on",
        "in_run",
    )


def test_the_same_streams_give_the_same_instrument_and_others_another(population: Population, flight) -> None:
    first, again = (slow(population, flight) for _ in range(2))
    assert np.array_equal(first, again)
    other = population.draw(Streams(11).at("instrument", 1))[0]
    assert not np.array_equal(other.units["bias_temperature"], population.draw(STREAMS)[0].units["bias_temperature"])
    x, y = population.draw(STREAMS)[:2]
    assert x.slow(flight, FLIGHT).bias_ug[0] != x.slow(flight, STREAMS.at("oven")).bias_ug[0]
    assert x.units["magnet_hysteresis"] != y.units["magnet_hysteresis"]
    in_run = [unit.slow(flight, FLIGHT).bias_ug for unit in population.only("in_run").draw(STREAMS)]
    assert abs(np.corrcoef(in_run[0], in_run[1])[0, 1]) < 0.99


@pytest.mark.parametrize("name", SLOW)
def test_switching_an_effect_off_removes_it_and_moves_nothing_else(population: Population, flight, name: str) -> None:
    for axis in range(3):
        full, without = slow(population, flight, axis), slow(population.without(name), flight, axis)
        alone, nothing = slow(population.only("thermal_lag", name), flight, axis), slow(population.only(), flight, axis)
        assert np.all(nothing[0] == 0.0) and np.all(nothing[1] == 0.0)
        assert max(np.abs(part).max() for part in alone) > 0.1  # it was there
        assert full[0] - without[0] == pytest.approx(alone[0], abs=BIAS_TOLERANCE_UG)
        assert full[1] - without[1] == pytest.approx(alone[1], abs=PPM_TOLERANCE)


@pytest.mark.parametrize("name", NAMES)
def test_an_absent_effect_still_draws(population: Population, name: str) -> None:
    for full, without in zip(population.draw(STREAMS), population.without(name).draw(STREAMS), strict=True):
        assert list(full.units) == list(without.units) == list(NAMES)
        for key in NAMES:
            assert np.array_equal(full.units[key], without.units[key]) or full.units[key] is None


def test_without_the_thermal_lag_the_elements_are_at_the_surface(population: Population, flight) -> None:
    thermal = population.only("bias_temperature")
    omega = thermal.draw(STREAMS)[0].units["bias_temperature"]
    d = flight.temperature_c - 22.0
    by_hand = omega[0] * d + omega[1] * d**2 + omega[2] * d**3
    assert slow(thermal, flight)[0] == pytest.approx(by_hand, abs=BIAS_TOLERANCE_UG)
    assert np.abs(slow(population.only("bias_temperature", "thermal_lag"), flight)[0] - by_hand).max() > 5.0


def test_creep_stays_when_the_thermal_bias_is_off(population: Population, flight) -> None:
    unit = population.only("creep").draw(STREAMS)[1]
    assert unit.units["creep"] == unit.units["bias_temperature"][0] != 0.0
    assert np.ptp(unit.slow(flight, FLIGHT).bias_ug) > 1.0


def pulses(population: Population, run: ThermalRun, force_g: tuple[float, float, float], axis: int) -> np.ndarray:
    unit = population.draw(STREAMS)[axis]
    time_s = 0.01 * np.arange(1, 20001)
    increment = np.tile(np.array(force_g) * G * 0.01, (time_s.size, 1))
    return unit.pulses(time_s, 0.0, increment, run, unit.slow(run, FLIGHT), FLIGHT)


def test_an_accelerometer_without_errors_counts_force_times_gamma(population: Population, flight) -> None:
    for axis, gamma in enumerate(unit.gamma for unit in population.draw(STREAMS)):
        force = (0.25, -0.5, -1.0)
        exact = pulses(population.only(), flight, force, axis)
        assert exact == pytest.approx(np.full(20000, gamma * force[axis] * 0.01), rel=1e-12)


def test_level_and_at_rest_the_counts_of_z_are_whole_and_negative(population: Population, flight) -> None:
    counts = pulses(population, flight, (0.0, 0.0, -1.0), 2)
    assert np.all(counts == np.round(counts))
    assert counts.mean() == pytest.approx(-3200.0, rel=0.05)


def test_slow_errors_are_taken_at_the_end_of_each_sample(population: Population) -> None:
    run = ThermalRun(np.array([0.0, 100.0, 200.0]), np.array([22.0, 22.0, 22.0]), "flight")
    unit = population.only().draw(STREAMS)[0]
    errors = SlowErrors(np.array([3e5, 4e5, 4e5]), np.array([0.0, 0.0, 500.0]))
    time_s = np.array([50.0, 100.0, 150.0])
    counts = unit.pulses(time_s, 0.0, np.zeros((3, 3)) + [50.0 * G, 0, 0], run, errors, FLIGHT)  # noqa: RUF005
    assert counts == pytest.approx([3.5e5 * 50.0, 4e5 * 50.0, 4e5 * 50.0 * (1.0 + 250e-6)], rel=1e-12)


@pytest.mark.parametrize("name", ["nonlinearity", "noise", "quantisation"])
def test_switching_off_what_acts_on_samples(population: Population, flight, name: str) -> None:
    force = (0.1, 0.2, 1.5)
    smooth = population.without("quantisation")
    if name == "quantisation":
        full, without = pulses(population, flight, force, 2), pulses(smooth, flight, force, 2)
        assert np.all(full == np.round(full)) and not np.all(without == np.round(without))
        assert np.abs(np.cumsum(full) - np.cumsum(without)).max() < 1.0 + 1e-5
        return
    change = pulses(smooth, flight, force, 2) - pulses(smooth.without(name), flight, force, 2)
    alone = pulses(population.only(name), flight, force, 2) - pulses(population.only(), flight, force, 2)
    assert np.abs(alone).max() > 1e-3
    assert change == pytest.approx(alone, rel=0.02, abs=1e-6)  # K1 differs from gamma by below 2 %


def test_samples_outside_the_run_are_refused(population: Population, flight) -> None:
    unit = population.draw(STREAMS)[0]
    errors = unit.slow(flight, FLIGHT)
    with pytest.raises(ValueError, match="outside the thermal run"):
        unit.pulses(np.array([8400.0, 8401.0]), 8399.0, np.zeros((2, 3)), flight, errors, FLIGHT)


def test_switching_off_twice_and_only_are_as_said(population: Population) -> None:
    off = {e.name for e in population.without("creep", "noise").without("creep").effects if isinstance(e, Absent)}
    assert off == {"creep", "noise"}
    kept = {e.name for e in population.only("creep").effects if not isinstance(e, Absent)}
    assert kept == {"creep"}
    assert population.without() == population


def test_replacing_an_effect_moves_no_other_draw(population: Population, flight) -> None:
    strong = population.replacing(population["turn_on"].model_copy(update={"sigma_ug": 100.0}))
    turn_on = slow(population.only("turn_on"), flight)[0]
    assert slow(strong, flight)[0] - slow(population, flight)[0] == pytest.approx(turn_on, abs=BIAS_TOLERANCE_UG)


@pytest.mark.parametrize("method", ["without", "only", "__getitem__"])
def test_an_unknown_effect_is_refused_with_the_nearest(population: Population, method: str) -> None:
    with pytest.raises(UsageError, match=r"^no accelerometer effect 'creeep'; did you mean 'creep'\?$"):
        getattr(population, method)("creeep")


def write(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_states_only_what_differs(tmp_path: Path, population: Population) -> None:
    mine = Population.load(write(tmp_path, 'extends = "jb-kt8"\n[creep]\nscatter = 0.5\n[turn_on]\nsigma_ug = 20.0\n'))
    assert mine.name == "mine"
    assert mine["creep"] == population["creep"].model_copy(update={"scatter": 0.5})
    assert mine["turn_on"].sigma_ug == 20.0 and mine["turn_on"].chamber_sigma_ug == 20.0
    changed = {"creep", "turn_on"}
    assert all(mine[name] == population[name] for name in NAMES if name not in changed)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('extends = "jb-kt8"\n[creep]\nscater = 0.5', "unknown key 'creep.scater'; did you mean 'scatter'?"),
        ('extends = "jb-kt8"\n[crep]\nscatter = 0.5', "unknown key 'crep'; did you mean 'creep'?"),
        ('extends = "jb-kt8"\n[in_run]\nsigma_ug = -1.0', "'in_run.sigma_ug' is -1.0: "),
        ('extends = "jb-kt8"\n[in_run]\nsigma_ug = "25 ug"', "'in_run.sigma_ug' is '25 ug': "),
        ('extends = "jb-kt8"\n[scale_polynomial]\nrate_sign = "paper"', "'scale_polynomial.rate_sign' is 'paper': "),
        ('extends = "jb-kt8"\n[creep]\nweights = [1.0]', "1 weights for 3 time_constants_min; give one each"),
        ('extends = "jb-kt9"', "no accelerometer population 'jb-kt9'; did you mean 'jb-kt8'?"),
        ('extends = "mine"', "no accelerometer population 'mine'"),
        ("[noise]\ndensity_ug_per_sqrt_hz = 2.0", "'thermal_lag' is missing; add it"),
        ("[noise", "not valid TOML"),
    ],
)
def test_a_bad_file_is_refused_in_one_sentence(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(UsageError) as refused:
        Population.load(write(tmp_path, text))
    assert sentence in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_circle_of_files_is_refused(tmp_path: Path) -> None:
    (tmp_path / "other.toml").write_text('extends = "mine"\n')
    with pytest.raises(UsageError, match="leads back to itself"):
        Population.load(write(tmp_path, 'extends = "other"\n'))


def test_a_missing_file_or_name_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"no-such\.toml: there is no such file"):
        Population.load(tmp_path / "no-such.toml")
    with pytest.raises(UsageError, match=r"no accelerometer population 'jb-kt'; did you mean 'jb-kt8'\?"):
        Population.load("jb-kt")
