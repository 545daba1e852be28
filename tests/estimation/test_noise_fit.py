"""The climb to the top of the evidence, on surfaces whose top is known."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import minimize

from ins_eval.estimation.noise_fit import Fitted, fit

BELOW = 0.05  # nats
FACTOR = 3.0  # differences of slopes tell a curvature so closely, and more is not needed
BEGINS = np.array([-1.5, 2.0])


class Ridge:
    """A log evidence that falls off steeply on either side of a curved ridge y = x^2, along which it hardly rises."""

    noise = SimpleNamespace(free=("a", "b"))

    def __init__(self, steep: float):
        self.steep = steep

    def slope(self, noise_point: np.ndarray, _) -> tuple[float, np.ndarray]:
        x, y = noise_point
        aside, ahead = y - x * x, 2.0 - x
        height = -self.steep * aside * aside - ahead * ahead
        return height, np.array([4.0 * self.steep * x * aside + 2.0 * ahead, -2.0 * self.steep * aside])

    def __call__(self, noise_point: np.ndarray) -> None:
        return None

    @property
    def top(self) -> float:
        """With the prior, by a search that knows no slope."""
        options = {"xatol": 1e-9, "fatol": 1e-10, "maxiter": 10_000}

        def down(point: np.ndarray) -> float:
            return 0.5 * float(point @ point) - self.slope(point, None)[0]

        return -float(minimize(down, np.ones(2), method="Nelder-Mead", options=options).fun)


@pytest.mark.parametrize("steep", [30.0, 100.0, 300.0, 1000.0])
def test_what_is_compared_with_others_is_the_top_of_a_ridge(steep: float) -> None:
    """And not where the climb became slow, as what only begins another climb may be."""
    ridge, start = Ridge(steep), Fitted(BEGINS, 0.0, None)
    assert fit(ridge, 0, start=start, close=True).log_evidence == pytest.approx(ridge.top, abs=BELOW)
    assert fit(Ridge(300.0), 0, start=start).log_evidence < Ridge(300.0).top - BELOW


class Bowl:
    """A log evidence that is a parabola in each level, known to 0.01 to 1 prior sigmas; it counts how often asked."""

    sigma = np.geomspace(0.01, 1.0, 8)
    noise = SimpleNamespace(free=tuple("abcdefgh"))

    def __init__(self, centre: float):
        self.centre, self.asked = centre, 0

    def slope(self, noise_point: np.ndarray, _) -> tuple[float, np.ndarray]:
        self.asked += 1
        off = (noise_point - self.centre) / self.sigma
        return -0.5 * float(off @ off), -off / self.sigma

    def __call__(self, noise_point: np.ndarray) -> None:
        return None


def test_a_climb_tells_how_closely_each_level_is_known_and_the_next_is_shorter_for_it() -> None:
    first = fit(Bowl(1.0), 0)
    known = (Bowl.sigma**-2.0 + 1.0) ** -0.5  # with the prior
    assert (np.abs(np.log(first.spread / known)) < np.log(FACTOR)).all()
    without, knowing = Bowl(0.7), Bowl(0.7)
    found = fit(without, 0, start=Fitted(first.noise_point, 0.0, None)), fit(knowing, 0, start=first)
    assert found[1].log_evidence > found[0].log_evidence - BELOW
    assert knowing.asked < 0.7 * without.asked
