"""Loops after storage against the closed forms of their gains, and against the simulated procedure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from ins_eval.digital_loop import Loop, bench, load, population
from ins_eval.digital_loop.injector import Injection
from ins_eval.ensemble.ageing import Aged, aged
from ins_eval.errors import UsageError
from ins_eval.streams import Streams

CHANCE = 1e-4
CODE_PPM = 0.5 / 524288 / 1e-6  # N_VREF is rounded to a whole number of 2^19
ROUNDING_PPM = 1e-6
NOISE_PPM = 0.3  # of one estimate by the sampled loop; its own tests say 0.1 ug and less


@pytest.fixture(scope="module")
def year() -> Aged:
    return aged(1.0, seed=1)


@pytest.fixture
def without_temperature(tmp_path: Path) -> Loop:
    """The default loop, whose parts follow no temperature."""
    sigmas = load().parameters.temperature_coefficient_sigma
    lines = [f'{part} = {{ value = 0.0, unit = "ppm/degC", source = "test" }}' for part, _ in sigmas]
    path = tmp_path / "cold.toml"
    path.write_text("\n".join(['extends = "digital-qfa"', "[temperature_coefficient_sigma]", *lines]))
    return load(path)


def test_scale_factor_is_the_inverse_of_the_feedback(year: Aged) -> None:
    """k0 g / (k_t k_VI k_DA), Paper B eq. (13), whatever the forward gain has done."""
    expected = 1.0 / ((1.0 + 1e-6 * year.feedback_ppm) * (1.0 + 1e-6 * year.torquer_ppm))
    assert year.drifted_ppm == pytest.approx(1e6 * (expected - 1.0), abs=ROUNDING_PPM)
    assert np.std(year.forward_ppm) > 50.0
    assert abs(np.corrcoef(year.forward_ppm, year.drifted_ppm)[0, 1]) < 0.3


def test_what_self_calibration_leaves_where_temperature_does_nothing(without_temperature: Loop) -> None:
    """The gain is gone; the torquer is not seen and the current source is believed: 1 / ((1 + t) (1 + i))."""
    found = aged(3.0, seed=2, size=40, loop=without_temperature)
    torquer, current = 1.0 + 1e-6 * found.torquer_ppm, 1.0 + 1e-6 * found.current_ppm
    assert found.self_calibrated_ppm == pytest.approx(1e6 * (1.0 / (torquer * current) - 1.0), abs=1.1 * CODE_PPM)
    assert found.estimate_ppm == pytest.approx(
        1e6 * ((1.0 + 1e-6 * found.feedback_ppm) / current - 1.0), abs=ROUNDING_PPM
    )


def test_what_remains_is_the_change_of_the_output_and_the_estimate(year: Aged) -> None:
    """The closure of Paper B: 24 = -193 + 218, to second order and the rounding of N_VREF."""
    second_order = 1e-6 * np.abs(year.drifted_ppm * year.estimate_ppm).max()
    assert year.self_calibrated_ppm == pytest.approx(
        year.drifted_ppm + year.estimate_ppm, abs=1.1 * CODE_PPM + 2.0 * second_order
    )


@pytest.mark.parametrize(
    ("gain", "sigma_ppm"),
    [("feedback_ppm", 100.0), ("torquer_ppm", 5.0), ("current_ppm", 5.0)],
)
def test_a_year_has_the_sizes_that_the_paper_prints(year: Aged, gain: str, sigma_ppm: float) -> None:
    squares = np.sum((getattr(year, gain) / sigma_ppm) ** 2)
    low, high = chi2.ppf([CHANCE, 1.0 - CHANCE], 200)
    assert low < squares < high


def test_drifts_grow_in_proportion_to_time(year: Aged) -> None:
    longer = aged(4.0, seed=1)
    second_order_ppm = 1e-6 * np.abs(longer.feedback_ppm).max() ** 2
    assert longer.feedback_ppm == pytest.approx(4.0 * year.feedback_ppm, abs=2.0 * second_order_ppm)
    assert np.array_equal(longer.warmer_c, year.warmer_c)


def test_fresh_units_keep_their_scale_factor_and_the_estimate_errs_alike() -> None:
    fresh, year = aged(0.0, seed=1, size=30), aged(1.0, seed=1, size=30)
    assert np.all(fresh.drifted_ppm == 0.0)
    error_ppm = year.estimate_ppm - year.feedback_ppm + year.current_ppm
    assert error_ppm == pytest.approx(fresh.estimate_ppm, abs=0.1)  # additive: products of drifts are left
    assert 10.0 < np.sqrt(np.mean(fresh.estimate_ppm**2)) < 30.0  # Paper B finds a shift of 18 to 20 ppm


@pytest.mark.parametrize("index", [0, 7])
def test_estimate_is_that_of_the_simulated_bench(index: int) -> None:
    """The sampled, quantised and noisy loop through the same two tests at the same temperatures."""
    streams = Streams(1).at("digital loop")
    unit, node = population.draw(streams, index), streams.at("unit", index, "bench")
    first = bench.temperatures(unit.loop, node)[:, :1]
    simulated = bench.procedure(unit, node, Injection(0.0, 0.0), first).feedback_ppm[0]
    assert aged(0.0, seed=1, size=index + 1).estimate_ppm[index] == pytest.approx(simulated, abs=NOISE_PPM)


@pytest.mark.parametrize("years", [-1.0, float("nan"), float("inf")])
def test_time_that_cannot_be_is_refused(years: float) -> None:
    with pytest.raises(UsageError, match="years, expected 0 to 100"):
        aged(years, seed=1)
