"""Paper A as an inverse problem: one flight names the thermal physics that a belief leaves out; later ones gain."""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from benchmark.runners.diagnosed_belief import (
    COUNT,
    SEED,
    STATISTICS,
    DiagnosedUnit,
    InverseProblem,
    compared,
    diagnosed,
    population,
    shares,
)
from ins_eval.laboratory import Chamber
from ins_eval.parallel import in_order
from ins_eval.units import MINUTE

pytestmark = pytest.mark.slow

LEAST_SHARE = 0.5  # of what the hysteresis compensation gains, calibrated in the chamber
LEAST_NAMED = 0.9  # of the instruments
THERMAL = ("temperature", "creep", "hysteresis")  # in the name of an effect
EPSILON, ALPHA = (f"accelerometer.scale_temperature_rate{power}" for power in ("", "_quadratic"))
SEED_OF_CHAMBERS, CHAMBERS = 17, 6
WITHIN = 0.4  # of the truth: the magnet has loops of several widths, of which one branch width is believed


@pytest.fixture(scope="module")
def found() -> list[DiagnosedUnit]:
    return list(population(SEED, COUNT, os.cpu_count() or 1))


def test_thermal_physics_is_named_from_one_flight(found: list[DiagnosedUnit]):
    assert all(one.answer["verdict"] != "no mismatch" for one in found)
    thermal = [any(word in name for name in one.named for word in THERMAL) for one in found]
    assert np.mean(thermal) >= LEAST_NAMED


def test_later_flights_gain_half_of_what_the_chamber_gains(found: list[DiagnosedUnit]):
    comparison = compared(found)
    for measure, (share, *_) in shares(found).items():
        assert comparison.ratios["hysteresis/simple"][measure].high < 1.0, measure
        assert comparison.ratios["diagnosed/simple"][measure].high < 1.0, measure
        assert share >= LEAST_SHARE, measure


def test_nothing_beats_the_oracle(found: list[DiagnosedUnit]):
    comparison = compared(found)
    for measure in STATISTICS:
        ratios = {pair: ratio[measure].ratio for pair, ratio in comparison.ratios.items() if pair.endswith("/simple")}
        assert min(ratios, key=ratios.__getitem__) == "oracle/simple"


@dataclass(frozen=True)
class InChamber:
    """What the chamber tells of one accelerometer: values by name, beside its true ones in ppm, degC and minutes."""

    found: dict[str, float]
    epsilon: float
    alpha: float
    mu: float


def of_chamber(index: int) -> InChamber:
    with tempfile.TemporaryDirectory() as folder:
        problem = InverseProblem(Path(folder), SEED_OF_CHAMBERS)
        units = [one.units["scale_polynomial"] for one in problem.world.instrument(index).accelerometers]
        k = max(range(3), key=lambda k: units[k][0] / units[k][5])
        alpha, _, _, epsilon, mu, gamma = units[k]
        answer, _ = diagnosed([problem.chamber(index, "xyz"[k])], problem.flight(index), Path(folder))
    found = {one["name"]: one["parameters"]["value"] for one in answer["effects"]}
    return InChamber(found, *(1e6 * one / gamma for one in (epsilon, alpha, mu)))


@pytest.fixture(scope="module")
def in_chambers() -> list[InChamber]:
    """The accelerometer of each instrument whose rate terms are those of JB-KT8 #1, the largest."""
    return list(in_order(of_chamber, ((index,) for index in range(CHAMBERS))))


def test_the_chamber_names_epsilon_and_alpha(in_chambers: list[InChamber]):
    for one in in_chambers:
        assert {EPSILON, ALPHA} <= set(one.found)
        assert one.found[ALPHA] == pytest.approx(one.alpha, rel=WITHIN)


def test_the_chamber_measures_how_the_scale_factor_follows_the_rate(in_chambers: list[InChamber]):
    """A body that is late carries the scale factor along its slope as epsilon does, and epsilon counts from there.

    The answer is of the reading: the thermometer is late itself, and elements with a lag follow it. In truth only the
    bias follows the elements, and the scale factor the surface.
    """
    late_s = Chamber().thermometer.lag_s
    for one in in_chambers:
        found = one.found[EPSILON] - one.mu * one.found.get("temperature.lag", 0.0) / MINUTE
        assert found == pytest.approx(one.epsilon + one.mu * late_s / MINUTE, rel=WITHIN)
