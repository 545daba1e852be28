"""A scale factor that storage has changed: one of those given, in flight only, and nothing unless stated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chisquare

from ins_eval.accelerometer import Population, ThermalRun
from ins_eval.accelerometer.loop_gain import LoopGain
from ins_eval.errors import UsageError
from ins_eval.streams import Streams

STREAMS = Streams(11).at("instrument", 0)
DRIFTS_PPM = (-300.0, -20.0, 100.0, 250.0)
ROUNDING = 1e-9  # relative
CHANCE = 1e-4  # that each of four equally likely drifts is drawn as often as seen


def stored(population: Population, *scale_ppm: float) -> Population:
    return population.replacing(LoopGain(scale_ppm=scale_ppm))


def scale(population: Population, run: ThermalRun, axis: int = 0) -> np.ndarray:
    return population.draw(STREAMS)[axis].slow(run, STREAMS.at(run.kind)).scale


def test_unless_stated_it_does_nothing_to_the_last_bit(population: Population, flight: ThermalRun) -> None:
    assert np.array_equal(scale(population, flight), scale(population.without("loop_gain"), flight))


def test_in_flight_the_scale_factor_is_multiplied(population: Population, flight: ThermalRun) -> None:
    polynomial_only = population.only("loop_gain")
    fresh = scale(polynomial_only, flight)
    for ppm in DRIFTS_PPM:
        changed = scale(stored(polynomial_only, ppm), flight)
        assert changed == pytest.approx(fresh * (1.0 + 1e-6 * ppm), rel=ROUNDING)


@pytest.mark.parametrize("kind", ["chamber", "oven"])
def test_chamber_and_oven_come_before_storage(population: Population, flight: ThermalRun, kind: str) -> None:
    before = ThermalRun(flight.time_s, flight.temperature_c, kind)
    assert np.array_equal(scale(stored(population, *DRIFTS_PPM), before), scale(population, before))


def test_each_accelerometer_has_one_of_the_drifts_all_equally_often(population: Population) -> None:
    units = [unit.units["loop_gain"] for i in range(400) for unit in stored(population, *DRIFTS_PPM).draw(Streams(i))]
    drawn, counts = np.unique(units, return_counts=True)
    assert tuple(drawn) == DRIFTS_PPM
    assert chisquare(counts).pvalue > CHANCE


def test_two_lists_of_one_length_give_drifts_of_the_same_loop(population: Population) -> None:
    after = tuple(0.1 * ppm + 7.0 for ppm in DRIFTS_PPM)
    for i in range(20):
        pairs = zip(*(stored(population, *ppm).draw(Streams(i)) for ppm in (DRIFTS_PPM, after)), strict=True)
        for one, other in pairs:
            assert other.units["loop_gain"] == 0.1 * one.units["loop_gain"] + 7.0


def test_a_file_may_state_it(tmp_path: Path, flight: ThermalRun, population: Population) -> None:
    path = tmp_path / "mine.toml"
    path.write_text('extends = "jb-kt8"\n[loop_gain]\nscale_ppm = [80.0]\n', encoding="utf-8")
    change = scale(Population.load(path), flight) - scale(population, flight)
    gamma = population.draw(STREAMS)[0].gamma
    assert change == pytest.approx(np.full(change.size, 80e-6 * gamma), rel=1e-6)
    path.write_text('extends = "jb-kt8"\n[loop_gain]\nscale_ppm = []\n', encoding="utf-8")
    with pytest.raises(UsageError, match=r"loop_gain\.scale_ppm"):
        Population.load(path)
