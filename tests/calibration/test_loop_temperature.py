"""Lines over temperature against SciPy's regression, and readings that are put back."""

import numpy as np
import pytest
from scipy import stats

from ins_eval.calibration import loop_temperature

AT_C = np.array([2.0, 12.0, 22.0, 32.0, 42.0])


def test_an_exact_line_is_found_and_taken_out():
    readings = -71738.85 * (1.0 + 1e-6 * 9.0 * (AT_C - 22.0))
    line = loop_temperature.fit(AT_C, readings, 22.0)
    assert line.reading == pytest.approx(-71738.85)
    assert line.ppm_per_c.value == pytest.approx(9.0)
    assert line.put_back(readings, AT_C) == pytest.approx(np.full(5, -71738.85), rel=1e-12)


def test_the_reference_need_not_be_in_the_middle():
    line = loop_temperature.fit(AT_C, 479.0 * (1.0 - 1e-5 * (AT_C - 2.0)), 2.0)
    assert (line.at_c, line.reading) == (2.0, pytest.approx(479.0))
    assert line.ppm_per_c.value == pytest.approx(-10.0)


def test_coefficient_and_interval_are_those_of_a_regression():
    rng = np.random.default_rng(4)
    readings = 479.0 * (1.0 + 1e-6 * (12.0 * (AT_C - 22.0) + rng.standard_normal(5)))
    line = loop_temperature.fit(AT_C, readings, 22.0)
    found = stats.linregress(AT_C - 22.0, readings)
    scale = 1e-6 * found.intercept
    assert line.ppm_per_c.value == pytest.approx(found.slope / scale)
    assert line.ppm_per_c.sigma == pytest.approx(found.stderr / scale)
    half = stats.t.ppf(0.975, 3) * found.stderr / scale
    assert line.ppm_per_c.low == pytest.approx(line.ppm_per_c.value - half)
    assert line.ppm_per_c.high == pytest.approx(line.ppm_per_c.value + half)


def test_an_interval_of_a_negative_reading_is_in_order():
    readings = -100.0 - 1e-3 * AT_C + 1e-5 * np.array([1.0, -1.0, 0.5, -1.0, 1.0])
    line = loop_temperature.fit(AT_C, readings, 22.0)
    assert line.ppm_per_c.low < line.ppm_per_c.value < line.ppm_per_c.high
