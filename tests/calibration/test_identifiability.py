"""Ranks 3, 5 and 6 by direct matrix rank of a steady programme, and what a real one hides."""

import numpy as np
import pytest

from ins_eval.calibration.four_point import FourPoint, four_point
from ins_eval.calibration.identifiability import identifiability
from ins_eval.scale_factor import scale_factor_terms

TEMPERATURE = np.linspace(-60.0, 70.0, 131)


def steady(*rates):
    """Points of steady legs, one for each rate; both directions of one size make one ramp."""
    temperature = np.concatenate([TEMPERATURE if rate > 0 else TEMPERATURE[::-1] for rate in rates])
    rate = np.repeat(rates, 131)
    return FourPoint(temperature, rate, 3e5 + rate, 0.0 * rate, np.abs(rate), np.arange(rate.size) * 60.0)


@pytest.mark.parametrize(
    ("rates", "rank", "words"),
    [
        ((-0.3,), 3, "alpha from epsilon and gamma cannot be separated; eta from mu cannot be separated"),
        ((-0.3, 0.3), 5, "alpha from gamma cannot be separated"),
        ((-0.3, -0.9), 5, "alpha from epsilon and gamma cannot be separated"),
        ((-0.3, 0.3, -0.9, 0.9), 6, ""),
    ],
)
def test_rank_of_steady_legs(rates, rank, words):
    points = steady(*rates)
    design = scale_factor_terms(points.temperature_c - 22.0, points.rate_c_per_min)
    assert np.linalg.matrix_rank(design / np.linalg.norm(design, axis=0)) == rank
    found = identifiability(points)
    assert (found.rank, found.steady_rank, found.words) == (rank, rank, words)
    assert found.sound == (rank == 6)
    assert np.isinf(found.condition) == (rank < 6)
    assert found.rates_c_per_min == tuple(sorted(rates))
    assert found.turning_share == 0.0


def test_a_single_ramp_has_rank_six_by_its_turns_alone(chamber_of):
    chamber = chamber_of(lambda t, r: 3e5 + t, lambda t, r: 0.0 * t, ramps=(0.5,))
    found = identifiability(four_point(chamber))
    assert (found.rank, found.steady_rank, found.sound) == (6, 5, False)
    assert "one rate: alpha from gamma cannot be separated" in found.words
    assert found.condition < 100.0 and np.isinf(found.steady_condition)  # the numbers alone would not warn
    assert 0.0 < found.turning_share < 0.2
    assert f"near turns ({100 * found.turning_share:.0f} % of all)" in found.words


def test_two_ramps_are_sound(chamber_of):
    chamber = chamber_of(lambda t, r: 3e5 + t, lambda t, r: 0.0 * t, ramps=(0.3, 0.9))
    found = identifiability(four_point(chamber))
    assert (found.rank, found.steady_rank, found.words, found.sound) == (6, 6, "", True)
    np.testing.assert_allclose(found.rates_c_per_min, (-0.9, -0.3, 0.3, 0.9), rtol=0.01)


def test_fewer_terms_need_less():
    assert identifiability(steady(-0.3), ("beta", "mu", "gamma")).sound
