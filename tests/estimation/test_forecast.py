"""The posterior of all effects against closed forms of linear problems, solved with numpy as least squares."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from ins_eval.error_model.columns import Column
from ins_eval.error_model.library import Candidate
from ins_eval.estimation import forecast as forecasts
from ins_eval.estimation.forecast import (
    AXIS_SPREAD,
    COMMON,
    FACTOR_SPREAD,
    OF_DAY,
    WITHIN_PRIOR,
    Pool,
    _sums,
    factors,
    lessened,
    lower,
    pool,
    posterior_of,
)
from ins_eval.estimation.study import Hypothesis
from ins_eval.recording import form
from ins_eval.recording.belief import Belief, EffectBelief, GyroBelief
from ins_eval.tables import parse, read_toml

ROWS, COUNT = 40, 6
ROUNDING = 1e-9
FEW_TIMES = 0.03  # what a prior of one moves a logarithm that a hundred values tell


@pytest.fixture
def problem() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns (rows, k), what was seen (rows,) with white noise of one, and one sigma (k,) of each prior."""
    rng = np.random.default_rng(5)
    columns, sigma = rng.standard_normal((ROWS, COUNT)), np.geomspace(0.1, 3.0, COUNT)
    return columns, columns @ (sigma * rng.standard_normal(COUNT)) + rng.standard_normal(ROWS), sigma


def test_the_posterior_is_that_of_least_squares_with_the_prior_as_further_rows(problem) -> None:
    x, y, sigma = problem
    found = posterior_of(x.T @ x, x.T @ y, sigma)
    stacked = np.vstack([x, np.diag(1.0 / sigma)])
    expected, *_ = np.linalg.lstsq(stacked, np.append(y, np.zeros(COUNT)), rcond=None)
    covariance = np.linalg.pinv(stacked) @ np.linalg.pinv(stacked).T
    assert found.mean == pytest.approx(expected, rel=ROUNDING)
    assert found.root @ found.root.T == pytest.approx(covariance, rel=ROUNDING)
    assert lower(found.root) == pytest.approx(np.linalg.cholesky(covariance), rel=ROUNDING)


def test_what_no_column_tells_keeps_its_prior_however_wide_that_is() -> None:
    """Of three columns that are one, of which rounding makes a matrix with negative eigenvalues."""
    rng = np.random.default_rng(4)
    x = rng.standard_normal((ROWS, 1)) @ np.ones((1, 3)) * 1e4
    a, wide = x.T @ x, np.full(3, 1e6)
    a = a - 1e-15 * a[0, 0] * np.eye(3)
    assert np.linalg.eigvalsh(a).min() < 0.0
    found = posterior_of(a, np.zeros(3), wide)
    apart = np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0)
    assert np.linalg.norm(apart @ found.root) == pytest.approx(1e6, rel=1e-6)


def test_the_gain_is_that_of_the_densities(problem) -> None:
    x, y, sigma = problem
    with_them = multivariate_normal(np.zeros(ROWS), np.eye(ROWS) + (x * sigma**2) @ x.T).logpdf(y)
    without = multivariate_normal(np.zeros(ROWS), np.eye(ROWS)).logpdf(y)
    assert posterior_of(x.T @ x, x.T @ y, sigma).nats == pytest.approx(with_them - without, rel=ROUNDING)


def test_what_differs_from_recording_to_recording_stays_with_each(problem) -> None:
    """Two recordings, in each of which every coefficient has a part of its own: free beside the common ones."""
    x, y, sigma = problem
    rng = np.random.default_rng(6)
    other, seen = rng.standard_normal((ROWS, COUNT)), rng.standard_normal(ROWS)
    own = 0.3 * np.ones(COUNT)
    parts = [lessened(a.T @ a, a.T @ b, own**2) for a, b in ((x, y), (other, seen))]
    found = posterior_of(sum(a for a, _ in parts), sum(b for _, b in parts), sigma)
    zero = np.zeros((ROWS, COUNT))
    stacked = np.vstack([
        np.hstack([x, x, zero]), np.hstack([other, zero, other]), np.diag(1.0 / np.concatenate([sigma, own, own]))
    ])  # fmt: skip
    expected, *_ = np.linalg.lstsq(stacked, np.concatenate([y, seen, np.zeros(3 * COUNT)]), rcond=None)
    assert found.mean == pytest.approx(expected[:COUNT], rel=1e-7)
    whole = np.linalg.inv(stacked.T @ stacked)
    assert found.root @ found.root.T == pytest.approx(whole[:COUNT, :COUNT], rel=1e-7)


def test_what_is_new_in_a_recording_is_a_share_of_the_prior_that_is_believed(problem, monkeypatch) -> None:
    """Where a sensor is found to have a tenth of the usual errors, these change by a tenth of what is usual."""
    x, y, factor = problem
    monkeypatch.setattr(forecasts, "of_case", lambda *_: SimpleNamespace(normal=x.T @ x, projection=x.T @ y))
    ones = tuple(Hypothesis(Candidate("gyro.scale", "x", "ppm", 1.0, Column("", ())), ()) for _ in range(COUNT))
    of = Pool(ones, np.ones(COUNT), np.zeros(COUNT), ())
    a, b = _sums([None], of, [SimpleNamespace(noise_point=None)], factor)
    of_rows = np.linalg.inv(np.eye(ROWS) + (x * (OF_DAY * factor) ** 2) @ x.T)
    assert a == pytest.approx(x.T @ of_rows @ x, rel=ROUNDING, abs=ROUNDING)
    assert b == pytest.approx(x.T @ of_rows @ y, rel=ROUNDING, abs=ROUNDING)


def test_an_effect_that_was_named_is_believed_once() -> None:
    """With a prior as wide as it needs; at a time that was not tried it stands beside those that were."""

    def one(name: str, **parameters: float) -> Candidate:
        return Candidate(name, "x", "ug", 1.0, Column("", ()), parameters)

    tried = [one("gyro.scale"), one("gyro.bias_temperature")]
    tried += [one("accelerometer.bias_creep", time_constant_s=t) for t in (300.0, 900.0)]
    named = [one("gyro.bias_temperature"), one("accelerometer.bias_creep", time_constant_s=500.0)]
    of = pool(
        [SimpleNamespace(candidates=tried, believed=None)],
        [(Hypothesis(candidate, (candidate.column,)), 2.0 * WITHIN_PRIOR, 1.5) for candidate in named],
    )
    times = [each.candidate.parameters.get("time_constant_s") for each in of.persistent]
    assert times == [None, None, 300.0, 900.0, 500.0]
    assert of.sigma == pytest.approx([1.0, 2.0, np.sqrt(0.5), np.sqrt(0.5), 2.0])
    assert of.taken == pytest.approx([0.0, 1.5, 0.0, 0.0, 1.5])


def of_names(*names: tuple[str, str]) -> SimpleNamespace:
    """A pool of effects, each a name and an axis."""
    candidates = [SimpleNamespace(name=name, axis=axis) for name, axis in names]
    return SimpleNamespace(persistent=[SimpleNamespace(candidate=one) for one in candidates], axis_spread=AXIS_SPREAD)


def seen_exactly(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A and b where values (k,) in prior sigmas are known, of nan nothing."""
    certain = np.where(np.isnan(values), 0.0, 1e6)
    return np.diag(certain), certain * np.nan_to_num(values)


def test_a_sensor_whose_errors_are_small_where_they_show_is_small_where_they_do_not() -> None:
    """Of names that are seen exactly many times the factors are known: the others' are conditional means of a normal.

    Of the logarithms of one axis the variance that names of a kind share is p, and q what is of the name and its axis:
    after n names with the logarithm x that of another of the kind is n p x / (n p + q), and of another kind 0.
    """
    times, log, seen = 100, -1.5, ("gyro.scale", "gyro.asymmetry", "gyro.misalignment")
    of = of_names(*[(one, "x") for one in seen for _ in range(times)], ("gyro.g_sensitivity", "x"), ("gyro.bias", "x"))
    signs = np.where(np.arange(len(seen) * times) % 2, 1.0, -1.0)
    found = factors(of, *seen_exactly(np.append(np.exp(log) * signs, [np.nan, np.nan])))
    assert found[:-2] == pytest.approx(log, abs=FEW_TIMES)
    n, p = len(seen), COMMON * FACTOR_SPREAD**2
    q = (1.0 - COMMON) * FACTOR_SPREAD**2 + AXIS_SPREAD**2
    assert found[-2] == pytest.approx(n * p * log / (n * p + q), abs=FEW_TIMES)
    assert found[-1] == pytest.approx(0.0, abs=ROUNDING)


def test_one_axis_may_follow_temperature_more_than_the_next() -> None:
    """Axes share the variance r of their name, and q is of each: after two of logarithms x and y the third has
    r (x + y) / (2 r + q)."""
    times, x, y = 100, 1.0, -0.6
    of = of_names(*[("gyro.scale", axis) for axis in "xy" for _ in range(times)], ("gyro.scale", "z"))
    signs = np.where(np.arange(2 * times) % 2, 1.0, -1.0)
    logs = np.repeat([x, y], times)
    found = factors(of, *seen_exactly(np.append(np.exp(logs) * signs, np.nan)))
    assert found[:-1] == pytest.approx(logs, abs=FEW_TIMES)
    r, q = FACTOR_SPREAD**2, AXIS_SPREAD**2
    assert found[-1] == pytest.approx(r * (x + y) / (2.0 * r + q), abs=FEW_TIMES)


def test_what_a_switch_on_may_have_drawn_makes_no_constant_bias_more_likely() -> None:
    """However far off all axes are alike: what a calibration leaves is known; of a scale factor it is not."""
    of = of_names(*[(name, axis) for name in ("gyro.bias", "accelerometer.bias", "gyro.scale") for axis in "xyz"])
    found = factors(of, *seen_exactly(np.full(9, 5.0)))
    assert (found[:6] == 0.0).all()
    assert found[6:] == pytest.approx(np.log(5.0), rel=0.2)  # the prior of the factor pulls it back


@pytest.mark.parametrize(("stated_deg_per_h", "expected"), [(0.01, 0.2), (0.05, 1.0), (5.0, 1.0), (0.0, 0.1)])
def test_errors_of_a_finer_gyro_are_expected_to_be_as_much_smaller(stated_deg_per_h: float, expected: float) -> None:
    """0.05 deg/h is the usual bias; a bias that is said to be exact tells less of what else a gyro does."""
    belief = Belief(gyro=GyroBelief(bias_sigma_deg_per_h=stated_deg_per_h))
    case = SimpleNamespace(believed=SimpleNamespace(recording=SimpleNamespace(belief=belief)))
    for name in ("gyro.g_sensitivity", "gyro.bias_temperature", "gyro.bias_drift"):
        one = SimpleNamespace(candidate=SimpleNamespace(name=name, nominal=1.0))
        assert forecasts._prior_sigma(one, [case]) == pytest.approx(expected)
    for name in ("gyro.scale", "gyro.misalignment"):
        assert forecasts._prior_sigma(SimpleNamespace(candidate=SimpleNamespace(name=name, nominal=1.0)), [case]) == 1.0


def test_a_written_model_is_read_with_its_covariance(tmp_path) -> None:
    root = np.linalg.cholesky([[4.0, 1.0], [1.0, 9.0]])
    effects = tuple(
        EffectBelief(name="accelerometer.bias", axis=axis, value=k + 1.0, root=tuple(root[k, : k + 1]))
        for k, axis in enumerate("xy")
    )
    file = form.write_belief(tmp_path / "model.toml", Belief(effects=effects))
    assert parse(Belief, read_toml(file), str(file)).effects == effects
