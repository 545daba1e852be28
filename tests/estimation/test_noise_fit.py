"""The climb to the top of the evidence, on surfaces whose top is known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import ortho_group

from ins_eval.estimation.noise_fit import Fitted, fit

BELOW = 0.05  # nats
FACTOR = 3.0  # differences of slopes tell a curvature so closely, and more is not needed
SHIFT = 0.3  # sigmas
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

    def __init__(self, centre: float | np.ndarray):
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
    told = np.sqrt(np.diag(first.spread @ first.spread.T))
    assert (np.abs(np.log(told / known)) < np.log(FACTOR)).all()
    without, knowing = Bowl(0.7), Bowl(0.7)
    found = fit(without, 0, start=Fitted(first.noise_point, 0.0, None)), fit(knowing, 0, start=first)
    assert found[1].log_evidence > found[0].log_evidence - BELOW
    assert knowing.asked < 0.7 * without.asked


class Tilted(Bowl):
    """A bowl whose axes are no levels: what one level gains, others lose."""

    axes = ortho_group.rvs(8, random_state=7)
    noise = Bowl.noise

    def slope(self, noise_point: np.ndarray, _) -> tuple[float, np.ndarray]:
        self.asked += 1
        off = self.axes.T @ (noise_point - self.centre) / self.sigma
        return -0.5 * float(off @ off), -self.axes @ (off / self.sigma)

    @property
    def top(self) -> float:
        """With the prior: of sum (x - c)^2 / s^2 + x^2 over the axes."""
        return -0.5 * float(np.sum((self.axes.T @ self.centre) ** 2 / (1.0 + self.sigma**2)))


def test_near_a_top_whose_curvature_is_known_one_step_ends_there() -> None:
    """A third of a sigma along each axis, of a parabola; with sizes alone the climb is longer and ends below."""
    begin, known = np.full(8, 0.5), Tilted.axes * (Tilted.sigma**-2.0 + 1.0) ** -0.5
    at = Tilted.axes @ (Tilted.axes.T @ begin / (1.0 + Tilted.sigma**2))
    moved = begin + Tilted.axes @ (SHIFT * Tilted.sigma)
    knowing, sized = Tilted(moved), Tilted(moved)
    start = Fitted(at, 0.0, None, known)
    found = fit(knowing, 0, start=start)
    assert knowing.asked == 2
    assert found.log_evidence == pytest.approx(knowing.top, abs=0.1 * BELOW)
    below = fit(sized, 0, start=replace(start, spread=np.diag(np.linalg.norm(known, axis=1))))
    assert sized.asked > 2 * knowing.asked
    assert below.log_evidence < found.log_evidence
