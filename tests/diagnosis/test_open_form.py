"""A slow disturbance of a channel against the explicit density of a Gaussian process."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from ins_eval.diagnosis.unnamed.open_form import KNOTS, LEAST_RANGE_C, TIMES, open_form, over_temperature
from ins_eval.estimation import case as cases
from ins_eval.estimation.evidence import SCALES
from ins_eval.units import DEG_PER_H, UG

WINDOWS, ROWS = 12, 60
JITTER = 1e-5  # of the root of the covariance
SI = {"accelerometer": UG, "gyro": DEG_PER_H}
COOLED_C = np.array([20.0, -8.0, 13.0])  # of the three thermometers


@pytest.fixture(scope="module")
def seen() -> tuple[np.ndarray, np.ndarray]:
    """Rows (n, windows) of what each window does, and data (n,) that hold a slow wave."""
    rng = np.random.default_rng(2)
    rows = rng.standard_normal((ROWS, WINDOWS))
    wave = 2.0 * np.sin(2.0 * np.pi * np.arange(WINDOWS) / WINDOWS)
    return rows, rows @ wave + rng.standard_normal(ROWS)


@pytest.fixture(scope="module")
def warm(flight) -> cases.Case:
    """A flight with a thermometer for each axis."""
    imu = flight.imu
    wave = np.sin(np.pi * imu.time_s[:, None] / imu.time_s[-1] * np.array([1.0, 1.5, 2.0]))
    return cases.prepare(replace(flight, imu=replace(imu, temperature_c=-COOLED_C * wave)))


def covariances() -> list[np.ndarray]:
    apart = np.abs(np.subtract.outer(np.arange(WINDOWS), np.arange(WINDOWS)))
    return [s**2 * np.exp(-apart / time) for time in TIMES for s in SCALES]


def test_evidence_mean_and_sigma(seen) -> None:
    rows, y = seen
    wholes = [np.eye(ROWS) + rows @ k @ rows.T for k in covariances()]
    heights = [multivariate_normal.logpdf(y, cov=whole) for whole in wholes]
    null = multivariate_normal.logpdf(y, cov=np.eye(ROWS))
    found = open_form(7, rows.T @ rows, rows.T @ y)
    assert found.channel == 7
    assert found.log_bayes_factor == pytest.approx(logsumexp(heights) - np.log(len(heights)) - null, abs=JITTER)
    best = int(np.argmax(heights))
    prior, whole = covariances()[best], wholes[best]
    gain = prior @ rows.T @ np.linalg.inv(whole)
    np.testing.assert_allclose(found.mean, gain @ y, atol=JITTER)
    np.testing.assert_allclose(found.sigma, np.sqrt(np.diag(prior - gain @ rows @ prior)), atol=JITTER)


def test_a_window_that_nothing_saw_keeps_its_prior(seen) -> None:
    """It says nothing of itself: what is known there comes from its neighbours, and is known less well."""
    rows, y = seen
    blind = rows.copy()
    blind[:, 5] = 0.0
    found = open_form(0, blind.T @ blind, blind.T @ y)
    assert found.sigma[5] == found.sigma.max()
    assert found.sigma[5] > 2.0 * found.sigma[4]
    assert min(found.mean[4], found.mean[6]) - found.sigma[5] < found.mean[5]
    assert found.mean[5] < max(found.mean[4], found.mean[6]) + found.sigma[5]


def test_noise_alone_is_no_disturbance() -> None:
    """The mean of the Bayes factor under the null is 1, so it exceeds 100 in one draw of 100 at most (Markov)."""
    rng = np.random.default_rng(4)
    gains = []
    for _ in range(200):
        rows = rng.standard_normal((ROWS, WINDOWS))
        gains.append(open_form(0, rows.T @ rows, rows.T @ rng.standard_normal(ROWS)).log_bayes_factor)
    assert np.median(gains) < 0.0
    assert np.sum(np.array(gains) > np.log(100.0)) <= 8  # binomial (200, 0.01): exceeded once in 10,000


@pytest.mark.parametrize(("sensor", "axis"), [("accelerometer", "y"), ("gyro", "z")])
def test_a_straight_line_is_a_curve_over_the_temperature_of_its_sensor(warm, sensor, axis) -> None:
    """The column of a bias of v (T - T0) is the sum of the columns of the knots, each times v (T_k - T0)."""
    line = next(one for one in warm.candidates if (one.name, one.axis) == (f"{sensor}.bias_temperature", axis))
    channel, curve = next(one for one in over_temperature(warm).items() if one[0].name == f"{sensor}.{axis}")
    smooth_c = warm.temperature.smooth_c[:, "xyz".index(axis)]
    knots_c = np.linspace(smooth_c.min(), smooth_c.max(), KNOTS)
    a = warm.whitened([line.column, *curve], np.zeros(len(warm.noise.free)), warm.blocks).normal
    first = len(warm.nuisances)
    values = line.nominal * SI[sensor] * (knots_c - warm.temperature.reference_c) / channel.size
    np.testing.assert_allclose(a[:, first + 1 :] @ values, a[:, first], rtol=1e-6, atol=1e-6 * a[first, first])


@pytest.mark.parametrize(("share", "count"), [(0.9, 0), (1.1, 6)])
def test_a_temperature_that_hardly_moves_has_no_curve(flight, share, count) -> None:
    imu = flight.imu
    reading_c = np.linspace(20.0, 20.0 + share * LEAST_RANGE_C, imu.time_s.size)
    assert len(over_temperature(cases.prepare(replace(flight, imu=replace(imu, temperature_c=reading_c))))) == count


def test_without_a_temperature_there_is_no_curve(flight) -> None:
    assert over_temperature(cases.prepare(flight)) == {}
