"""The chamber experiment: Table 4 against the printed polynomials, and what 95 % intervals are worth.

The constants of the units are the authority: they were drawn before any reading was made.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.accelerometer import Population
from ins_eval.calibration.fits import polynomial
from ins_eval.calibration.four_point import four_point
from ins_eval.ensemble import Plan, World, chamber, stacked
from ins_eval.laboratory import Chamber, draw_printed_units
from ins_eval.streams import Streams

TARGET = (0.93, 0.97)  # acceptance of the calibration: 95 % intervals cover
FEW_DRAWS = 12  # of three units each, in the default tests
MANY_DRAWS = 100
UNITS = ("JB-KT8 #1", "JB-KT8 #2", "JB-KT8 #3")


@pytest.fixture(scope="module")
def world() -> World:
    return World(chamber.PLAN)


@pytest.fixture(scope="module")
def members(world: World) -> list[chamber.Member]:
    return [chamber.member(world, index) for index in range(3)]


def coefficients(effects, draws: int, seed: int) -> np.ndarray:
    """Share of the coefficients of all curves that each unit's intervals cover, (units,)."""
    population = chamber.reduced_to(Population.load(), effects)
    shares = []
    for index in range(draws):
        for name, unit in draw_printed_units(Streams(seed).at(index), population).items():
            node = Streams(seed).at(index, name)
            heating_c = node.at("heat").rng().uniform(*chamber.SELF_HEATING_C)
            hits = chamber.covered(Chamber(self_heating_c=float(heating_c)), unit, node)
            shares.append(np.concatenate(list(hits.values())).mean())
    return np.array(shares)


def new_runs(draws: int, seed: int) -> np.ndarray:
    """Share of the readings of each new run of each unit that its predicted interval covers, (units, 4)."""
    shares = []
    for index in range(draws):
        for name, unit in draw_printed_units(Streams(seed).at(index)).items():
            node = Streams(seed).at(index, name)
            readings = Chamber().measure(unit, node)
            shares.append(chamber.predicted(Chamber(), unit, readings, node.at("another day")))
    return np.array(shares)


def interval(shares: np.ndarray) -> tuple[float, float]:
    """95 % interval of the mean share with units as clusters (bootstrap)."""
    estimate = chamber.mean_of_units(shares, Streams(0).at("test"))
    return tuple(estimate["interval95"])


def widened(shares: np.ndarray) -> tuple[float, float]:
    """The target, widened by three standard errors of few units."""
    error = shares.std() / np.sqrt(shares.size)
    return TARGET[0] - 3.0 * error, TARGET[1] + 3.0 * error


@pytest.mark.parametrize("effects", [chamber.WITHIN, chamber.WITHIN + chamber.SHIFTS], ids=["noise", "shifts"])
def test_intervals_of_coefficients_cover(effects):
    shares = coefficients(effects, FEW_DRAWS, seed=41)
    low, high = widened(shares)
    assert low < shares.mean() < high
    assert low > 0.85  # else this would say little


def test_least_squares_with_independent_readings_would_not_cover():
    """The classical covariance misses most coefficients once runs are shifted."""
    population = chamber.reduced_to(Population.load(), chamber.WITHIN + chamber.SHIFTS)
    covered = []
    for index in range(FEW_DRAWS):
        for name, unit in draw_printed_units(Streams(7).at(index), population).items():
            prompt = replace(Chamber(), thermometer=replace(Chamber().thermometer, lag_s=0.0))
            points = four_point(prompt.measure(unit, Streams(7).at(index, name)))
            curve = polynomial(points.temperature_c, points.rate_c_per_min, points.scale)
            design = curve.design(points.temperature_c, points.rate_c_per_min)
            residual = points.scale - design @ curve.values
            sigma = np.sqrt(residual @ residual / (residual.size - 6) * np.diag(np.linalg.inv(design.T @ design)))
            covered.append(np.abs(curve.values - unit.units["scale_polynomial"]) <= 1.96 * sigma)
    assert np.mean(covered) < 0.7


def test_predicted_intervals_cover_the_readings_of_another_day():
    shares = new_runs(FEW_DRAWS, seed=42).mean(axis=1)
    low, high = widened(shares)
    assert low < shares.mean() < high
    assert low > 0.85


@pytest.mark.slow
@pytest.mark.parametrize("seed", [51, 52, 53])
def test_three_hundred_units_cover_within_the_target(seed):
    found = {
        "coefficients, noise": coefficients(chamber.WITHIN, MANY_DRAWS, seed),
        "coefficients, shifts": coefficients(chamber.WITHIN + chamber.SHIFTS, MANY_DRAWS, seed),
        "readings of a new run": new_runs(MANY_DRAWS, seed).mean(axis=1),
    }
    for what, shares in found.items():
        low, high = interval(shares)
        print(f"seed {seed}, {what}: {shares.mean():.4f} (95 % interval {low:.4f} to {high:.4f}), {shares.size} units")
    for what, shares in found.items():
        assert TARGET[0] <= shares.mean() <= TARGET[1], what


def test_a_member_depends_on_plan_and_number_alone(world, members):
    again = chamber.member(World(Plan(experiment="chamber")), 1)
    assert {name: set(group) for name, group in again.items()} == {n: set(group) for n, group in members[1].items()}
    for name, group in again.items():
        for key, value in group.items():
            np.testing.assert_array_equal(value, members[1][name][key])
    assert set(UNITS) <= set(again) and len(again) == 9
    for name in UNITS:
        assert again[name]["magnet_share"] != members[2][name]["magnet_share"]


@pytest.mark.parametrize(
    ("unit", "expected"),
    [("JB-KT8 #1", 107.5), ("JB-KT8 #2", 165.1), ("JB-KT8 #3", 135.9)],
)
def test_uncompensated_sensitivity_is_that_of_the_printed_polynomial(unit, expected, members):
    """Eqs (15)-(17) with T0 = 22 over the printed ranges; rate terms and magnet add to it in the chamber."""
    printed = next(u for u in Population.load()["scale_polynomial"].units if u.name == unit)
    low, high = {"JB-KT8 #1": (-54.0, 81.0), "JB-KT8 #2": (-52.0, 82.0), "JB-KT8 #3": (-53.0, 82.0)}[unit]
    ends = [printed.beta * d**2 + printed.mu * d + printed.gamma for d in (low - 22.0, high - 22.0)]
    closed = 1e6 * (ends[0] - ends[1]) / printed.gamma / (high - low)
    assert closed == pytest.approx(expected, abs=0.5)
    ours = np.median(stacked(members)[f"table4/{unit}"]["sensitivity_none"])
    assert ours == pytest.approx(closed, rel=0.08)


def test_summary_says_what_members_hold(members):
    found = chamber.summary(members, seed=1)
    assert found["draws"] == 3 and found["coverage"]["units"] == 9
    values = [m["table4/JB-KT8 #2"]["sensitivity_simple"] for m in members]
    assert found["table4"]["JB-KT8 #2"]["simple"]["value"] == np.median(values)
    for kind in ("table4", "table4_scaled", "residual_rms_ppm"):
        assert set(found[kind]) == set(UNITS)
        for of_unit in found[kind].values():
            assert set(of_unit) == set(chamber.TABLE_4)
            assert of_unit["none"]["value"] > of_unit["simple"]["value"] > of_unit["hysteresis"]["value"]
    hit, of = np.sum([m[u][f"reduced/{c}"] for m in members for u in UNITS for c in chamber.CURVES], axis=0)
    assert found["coverage"]["coefficients"]["value"] == pytest.approx(hit / of, abs=1e-3)  # knots differ by a unit
    runs = np.mean([m[u]["predicted"] for m in members for u in UNITS])
    assert found["coverage"]["predictive"]["value"] == pytest.approx(runs)
    for estimate in (found["coverage"]["coefficients"], found["coverage"]["predictive_by_position"]["0 g"]):
        low, high = estimate["interval95"]
        assert low <= estimate["value"] <= high
