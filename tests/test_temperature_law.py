"""The line of a channel against temperature: its slope, and how often the interval holds where noise remembers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binomtest

from ins_eval.temperature_law import temperature_laws

STEP_S, MEANS, SIZE = 1.0, 90, 10
SLOPE = -3.0  # a degree
KEEPS = 0.5  # of the residual from one mean to the next
RUNS, LEAST, MOST = 200, 0.85, 0.99  # a bootstrap of runs is somewhat short where noise remembers
ROWS = [slice(0, MEANS * SIZE)]


def warming(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Six channels (6, n) of one law with residuals of memory, and the temperature (n,)."""
    temperature_c = 10.0 + 5.0 * (1.0 - np.exp(-np.arange(MEANS) / 40.0))
    noise = lfilter([1.0], [1.0, -KEEPS], rng.standard_normal((6, MEANS)), axis=1)
    return np.repeat(SLOPE * temperature_c + noise, SIZE, axis=1), np.repeat(temperature_c, SIZE)


def test_intervals_hold_the_law_about_as_often_as_they_say() -> None:
    rng = np.random.default_rng(0)
    held = 0
    for _ in range(RUNS // 6 + 1):
        laws = temperature_laws("abcdef", *warming(rng), ROWS, STEP_S)
        held += sum(law.interval95[0] < SLOPE < law.interval95[1] for law in laws)
    interval = binomtest(held, 6 * (RUNS // 6 + 1)).proportion_ci()
    assert interval.high > LEAST + 0.05 and LEAST < held / (6 * (RUNS // 6 + 1)) < MOST


def test_the_line_is_that_of_least_squares() -> None:
    columns, temperature_c = warming(np.random.default_rng(1))
    law = temperature_laws("abcdef", columns, temperature_c, ROWS, STEP_S)[0]
    slope, offset = np.polyfit(temperature_c, columns[0], 1)
    assert law.slope == pytest.approx(slope, rel=1e-9)
    assert law.offset == pytest.approx(offset + slope * law.reference_c, rel=1e-9)


def test_no_law_without_a_change_of_temperature() -> None:
    columns, temperature_c = warming(np.random.default_rng(2))
    assert temperature_laws("abcdef", columns, 0.01 * temperature_c, ROWS, STEP_S) == ()
    assert temperature_laws("abcdef", columns, temperature_c, [slice(0, 50)], STEP_S) == ()
