"""The shipped populations against the tables that they name."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval import datasheets
from ins_eval.accelerometer import Population
from ins_eval.accelerometer.model import PRESETS
from ins_eval.scale_factor import TERMS, scale_factor
from ins_eval.streams import Streams

# Paper A, section 3.1 and Table 4
RANGES_C = ((-54.0, 81.0), (-52.0, 82.0), (-53.0, 82.0))
TABLE_4_PPM_PER_C = (74.14, 104.22, 105.79)
SHIPPED = {"jb-kt8", "table4-scaled", "qa3000-030", "gjn096-d"}


@pytest.mark.parametrize("k", range(3))
def test_table4_scaled_has_the_printed_sensitivities(k: int) -> None:
    effect = Population.load("table4-scaled")["scale_polynomial"]
    assert effect.reference_temperature_c == 22.0
    low_c, high_c = RANGES_C[k]
    scale = scale_factor(effect.coefficients(effect.units[k]), np.linspace(low_c, high_c, 20001) - 22.0, 0.0)
    sensitivity = 1e6 * (scale[0] - scale[-1]) / (scale.mean() * (high_c - low_c))
    assert sensitivity == pytest.approx(TABLE_4_PPM_PER_C[k], abs=0.005)
    assert np.all(np.diff(scale) < 0.0)  # the ends are the extremes, so (max - min) says the same


def test_table4_scaled_changes_mu_alone() -> None:
    ours, scaled = Population.load(), Population.load("table4-scaled")
    for unit, other in zip(ours["scale_polynomial"].units, scaled["scale_polynomial"].units, strict=True):
        assert unit.name == other.name
        assert [term for term in TERMS if getattr(unit, term) != getattr(other, term)] == ["mu"]
    assert all(a == b for a, b in zip(ours.effects, scaled.effects, strict=True) if a.name != "scale_polynomial")


@pytest.mark.parametrize(
    ("name", "bias_tc", "bias_repeat", "scale_tc", "scale_repeat"),
    [("qa3000-030", 15.0, 40.0, 120.0, 80.0), ("gjn096-d", 50.0, 60.0, 50.0, 80.0)],
)
def test_populations_of_table_1(
    name: str, bias_tc: float, bias_repeat: float, scale_tc: float, scale_repeat: float
) -> None:
    population, sheet = Population.load(name), datasheets.load(name)
    assert population["bias_temperature"].omega1_ug_per_c == sheet.bias_temperature_ug_per_c == bias_tc
    assert population["turn_on"].sigma_ug == sheet.bias_repeatability_ug == bias_repeat
    assert population["scale_repeatability"].sigma_ppm == sheet.scale_repeatability_ppm == scale_repeat
    assert sheet.scale_temperature_ppm_per_c == scale_tc
    slopes = []
    for i in range(100):
        for unit in population.draw(Streams(i)):
            k1 = unit.units["scale_polynomial"]
            slopes.append(1e6 * k1[4] / k1[5])
    assert np.median(slopes) == pytest.approx(-scale_tc, rel=0.03)
    # what is assumed: the remaining terms of JB-KT8 #1, eq. (15)
    alpha, beta, eta, epsilon = 1e6 * np.array([273.0, 0.1008, -0.02409, 88.14]) / 320320.0
    (unit,) = population["scale_polynomial"].units
    assert [unit.alpha, unit.beta, unit.eta, unit.epsilon] == pytest.approx([alpha, beta, eta, epsilon], rel=5e-5)


def test_every_shipped_population_can_be_drawn() -> None:
    assert {path.stem for path in PRESETS.glob("*.toml")} == SHIPPED
    for name in SHIPPED:
        population = Population.load(name)
        assert population.name == name
        assert all(290e3 < unit.gamma < 340e3 for unit in population.draw(Streams(1)))
