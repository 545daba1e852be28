"""The climb to the top of the evidence, on surfaces whose top is known."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import minimize

from ins_eval.estimation.noise_fit import fit

BELOW = 0.05  # nats
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
    ridge, start = Ridge(steep), SimpleNamespace(noise_point=BEGINS)
    assert fit(ridge, 0, start=start, close=True).log_evidence == pytest.approx(ridge.top, abs=BELOW)
    assert fit(Ridge(300.0), 0, start=start).log_evidence < Ridge(300.0).top - BELOW
