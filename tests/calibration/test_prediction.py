"""The interval of a reading in a new run against Student's closed form, with runs as the only thing that counts."""

import numpy as np
import pytest
from scipy import stats

from ins_eval.calibration.fits import Polynomial
from ins_eval.calibration.prediction import RunErrors, errors_of_runs, predict
from ins_eval.errors import DataRefused

EACH = 200
CURVE_TOLERANCE = 0.02  # relative: a ridge, and knots that few readings touch


def runs(position, shifts, noise=0.0, level=0.0, seed=0):
    """One run for each shift, down and up again between -30 and 30 degC."""
    temperature = np.append(np.linspace(30.0, -30.0, EACH), np.linspace(-30.0, 30.0, EACH))
    rate = np.repeat([-0.3, 0.3], EACH)
    rng = np.random.default_rng(seed)
    return [
        RunErrors(position, 0.3, temperature, rate, level + shift + noise * rng.standard_normal(2 * EACH))
        for shift in shifts
    ]


def half_width(found, position):
    low, high = found.interval95_ug(position, np.array([-20.0, 0.0, 20.0]), np.array([-0.3, 0.3, -0.3]))
    return (high - low) / 2.0


def test_a_new_run_differs_from_the_mean_of_n_by_students_t():
    """0 g: eight runs, t(7) s sqrt(1 + 1/8); +1 and -1 g: four each, t(6) and the mean of both variances."""
    level, plus, minus = (np.random.default_rng(k).normal(0.0, 30.0, n) for k, n in ((1, 8), (2, 4), (3, 4)))
    found = predict(runs(0, level, level=5.0) + runs(1, plus, level=100.0) + runs(-1, minus, level=-70.0))
    expected = stats.t.ppf(0.975, 7) * np.std(level, ddof=1) * np.sqrt(1 + 1 / 8)
    np.testing.assert_allclose(half_width(found, 0), expected, rtol=CURVE_TOLERANCE)
    pooled = np.sqrt((np.var(plus, ddof=1) + np.var(minus, ddof=1)) / 2.0)
    expected = stats.t.ppf(0.975, 6) * pooled * np.sqrt(1 + 1 / 4)
    np.testing.assert_allclose(half_width(found, 1), expected, rtol=CURVE_TOLERANCE)
    np.testing.assert_allclose(half_width(found, -1), expected, rtol=CURVE_TOLERANCE)
    for position, middle in ((0, 5.0 + level.mean()), (1, 100.0 + plus.mean()), (-1, -70.0 + minus.mean())):
        np.testing.assert_allclose(found.middle_ug[position].evaluate(np.array([0.0, 20.0]), 0.3), middle, rtol=1e-6)


def test_where_runs_agree_the_scatter_within_them_counts_and_is_well_known():
    found = predict([run for p in (1, 0, 0, -1) for run in runs(p, np.zeros(4), noise=10.0, seed=p + 7)])
    np.testing.assert_allclose(half_width(found, 0), 1.96 * 10.0, rtol=0.15)


def test_a_run_like_its_own_predecessors_is_covered_in_95_percent():
    """Gaussian shifts and noise: each new run counts once; 200 instruments with one new run each."""
    covered = []
    for seed in range(200):
        rng = np.random.default_rng(1000 + seed)
        past = [
            run for p in (1, 0, -1) for run in runs(p, rng.normal(0, 20.0, 8 if p == 0 else 4), 15.0, seed=seed + p + 1)
        ]
        found = predict(past)
        (new,) = runs(1, rng.normal(0, 20.0, 1), 15.0, seed=5000 + seed)
        low, high = found.interval95_ug(1, new.temperature_c, new.rate_c_per_min)
        covered.append(np.mean((low <= new.error_ug) & (new.error_ug <= high)))
    error = np.std(covered) / np.sqrt(len(covered))
    assert abs(np.mean(covered) - 0.95) < 3.0 * error
    assert error < 0.012


def test_errors_of_runs_are_what_the_model_leaves(chamber_of):
    """A constant model on K1 and K0 that are 100 ppm and 50 ug above it: +-100 + 50 ug at +-1 g."""
    chamber = chamber_of(lambda t, r: 3e5 * 1.0001 + 0 * t, lambda t, r: 250.0 + 0 * t)
    model = [Polynomial(("gamma",), np.array([value]), None, np.nan) for value in (3e5, 200.0)]
    found = errors_of_runs(chamber, *model)
    assert [run.position for run in found] == [1, 0, -1, 0] * 2
    assert [run.ramp_c_per_min for run in found] == [0.3] * 4 + [0.9] * 4
    for run in found:
        expected = 100.0 * run.position + 250.0 * 1.0001 - 200.0
        np.testing.assert_allclose(run.error_ug, expected, atol=1e-6)


def test_one_run_in_a_position_shows_nothing_of_how_runs_differ():
    with pytest.raises(DataRefused, match=r"1 run\(s\) at -1 g show nothing of how runs differ"):
        predict(runs(0, (0.0, 1.0)) + runs(1, (0.0, 1.0)) + runs(-1, (0.0,)))
