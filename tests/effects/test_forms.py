"""What the form of a law leaves open, against other laws of the same physics: those of the accelerometer's own model.

A magnet is a sum of play operators of several widths there, and epoxy creeps by several relaxations; the effects of the
vocabulary have one width and one time constant, defined by the 63 % of a single change. Each is fitted to the other on
histories of temperature as flights and ovens have them, without any noise, so what is missed is the form alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from scipy.optimize import brentq, minimize

from ins_eval.accelerometer import Population
from ins_eval.accelerometer.magnet_hysteresis import play
from ins_eval.effects.accelerometer import BRANCH_WIDTH, CREEP_TIME
from ins_eval.effects.slow import branch, creep
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.thermal import lagged
from ins_eval.units import MINUTE

HISTORIES, STEP_S = 40, 10.0
SLOW_S = 1800.0  # slower than this is not told from bias and slow noise
REACHED = 1.0 - np.exp(-1.0)
ALIKE = (0.6, 1.6)  # the stated form by the measured one
Q95, COVERED = 1.96, 0.8  # what is missed has one sign and is no Gaussian


def histories() -> Iterator[tuple[np.ndarray, np.ndarray, np.random.Generator]]:
    """Time in s and temperature in degC of climbs, cruises and landings, and of ovens."""
    rng = np.random.default_rng(3)
    for k in range(HISTORIES):
        time_s = np.arange(0.0, rng.uniform(1.5, 5.0) * 3600.0, STEP_S)
        share = time_s / time_s[-1]
        if k % 3:
            outside = np.interp(share, [0.0, 0.02, 0.15, 0.8, 0.95], [0.0, 0.0, -1.0, -1.0, 0.0]) * rng.uniform(20, 60)
            own = rng.uniform(0.0, 25.0) * (1.0 - np.exp(-time_s / rng.uniform(1000.0, 4000.0)))
        else:
            levels = np.array([0.0, 1.0, -1.0, 1.0]) * rng.uniform(10.0, 40.0, 4)
            outside = np.interp(share, np.sort(rng.uniform(0.0, 1.0, 4)), levels)
            own = 0.0
        yield time_s, lagged(time_s, outside, rng.uniform(600.0, 2000.0)) + own, rng


def fitted(time_s: np.ndarray, seen: np.ndarray, law: Callable, starts, form: float) -> tuple[float, float, float]:
    """Where `law` of (log parameter, further) comes nearest to `seen`.

    Its log parameter, its size, and by how much the size moves as the log parameter does by `form`.
    """

    def fast(y: np.ndarray) -> np.ndarray:
        return y - lagged(time_s, y, SLOW_S)

    def size(at: np.ndarray) -> float:
        shape = fast(law(at))
        return float(shape @ fast(seen) / (shape @ shape))

    def missed(at: np.ndarray) -> float:
        return float(np.mean((fast(seen) - size(at) * fast(law(at))) ** 2))

    best = min((minimize(missed, start, method="Nelder-Mead") for start in starts), key=lambda one: one.fun).x
    step = np.zeros_like(best)
    step[0] = form
    return float(best[0]), size(best), 0.5 * abs(size(best + step) - size(best - step))


@pytest.fixture(scope="module")
def of_a_magnet() -> np.ndarray:
    """What is missed of width, in its logarithm, and of size, and how that moves with the width: (histories, 3)."""
    half = np.array(Population.load()["magnet_hysteresis"].half_widths_c)
    reached = brentq(lambda change: np.mean(np.minimum(0.5 * change / half, 1.0)) - REACHED, 0.0, 2.0 * half.max())
    found = []
    for time_s, temperature_c, rng in histories():
        width = np.exp(rng.uniform(*np.log([0.7, 7.0])))
        seen = np.mean([(play(temperature_c, h) - temperature_c) / h for h in half * width / reached], axis=0)

        def law(at, temperature_c=temperature_c):
            return branch(temperature_c, np.exp(at[0]), np.clip(at[1], -0.99, 0.99))

        starts = [(np.log(width), begin) for begin in (-0.5, 0.5)]
        log_width, size, sigma = fitted(time_s, seen, law, starts, BRANCH_WIDTH.form)
        found.append((log_width - np.log(width), size - 1.0, sigma))
    return np.array(found)


@pytest.fixture(scope="module")
def of_an_epoxy() -> np.ndarray:
    """The same of time constant and size."""
    epoxy = Population.load()["creep"]
    times_s, weights = MINUTE * np.array(epoxy.time_constants_min), np.array(epoxy.weights)
    reached = brentq(lambda after: 1.0 - weights @ np.exp(-after / times_s) - REACHED, 0.0, 10.0 * times_s.max())
    found = []
    for time_s, temperature_c, rng in histories():
        time_constant_s = np.exp(rng.uniform(*np.log([500.0, 6000.0])))
        each = times_s * time_constant_s / reached
        seen = sum(w * creep(time_s, temperature_c, one) for w, one in zip(weights, each, strict=True))

        def law(at, time_s=time_s, temperature_c=temperature_c):
            return creep(time_s, temperature_c, np.exp(at[0]))

        log_time, size, sigma = fitted(time_s, seen, law, [(np.log(time_constant_s),)], CREEP_TIME.form)
        found.append((log_time - np.log(time_constant_s), size - 1.0, sigma))
    return np.array(found)


@pytest.mark.parametrize(
    ("name", "law"), [("accelerometer.scale_hysteresis", "of_a_magnet"), ("accelerometer.bias_creep", "of_an_epoxy")]
)
def test_the_stated_form_is_what_another_law_is_missed_by(name, law, request):
    effect = VOCABULARY[name]
    missed, of_size, with_parameter = request.getfixturevalue(law).T
    form = effect.parameters[0].form
    assert ALIKE[0] < form / np.sqrt(np.mean(missed**2)) < ALIKE[1]
    assert np.mean(np.abs(missed) < Q95 * form) > COVERED
    assert np.mean(np.abs(of_size) < Q95 * np.hypot(with_parameter, effect.form)) > COVERED
