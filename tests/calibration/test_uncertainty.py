"""Intervals of coefficients against closed forms: Student's t of a few shifts, derivatives of the fits, AR(1)."""

import numpy as np
import pytest
from scipy import stats

from ins_eval.calibration import fits
from ins_eval.calibration.branches import branches
from ins_eval.calibration.four_point import FourPoint, four_point
from ins_eval.calibration.uncertainty import _long_run_variance, _weights, legs, uncertainty
from ins_eval.errors import DataRefused

DRAWN_TOLERANCE = 0.08  # relative: a 95 % point from 2000 draws
RAMPS = (0.3, 0.5, 0.7, 0.9)
EACH = 300
FITS = (fits.polynomial, fits.line, fits.quadratic, fits.constant, fits.anchored_line, branches)


@pytest.fixture
def alike():
    """Four ramps that read the same temperatures, down and up again, without turns."""
    temperature = np.tile(np.append(np.linspace(72.0, -28.0, EACH), np.linspace(-28.0, 72.0, EACH)), len(RAMPS))
    ramp = np.repeat(RAMPS, 2 * EACH)
    rate = np.tile(np.repeat([-1.0, 1.0], EACH), len(RAMPS)) * ramp
    return FourPoint(temperature, rate, 0 * rate, 0 * rate, ramp, np.tile(60.0 * np.arange(2 * EACH), len(RAMPS)))


def test_legs_end_at_the_turns_and_ignore_the_soak(chamber_of):
    points = four_point(chamber_of(lambda t, r: 3e5 + t, lambda t, r: 0 * t, ramps=(0.3, 0.9)))
    ramp, leg = legs(points)
    np.testing.assert_array_equal(ramp, (points.ramp_c_per_min == 0.9).astype(int))
    assert leg.max() == 5 and (np.diff(leg) >= 0).all()
    for number, (start, end) in enumerate([(22.0, -60.0), (-60.0, 70.0), (70.0, 22.0)] * 2):
        of_leg = points.temperature_c[leg == number]
        # the filtered rate turns within three of its time constants of 180 s
        assert of_leg[[0, -1]] == pytest.approx((start, end), abs=0.9 * 9.0)


@pytest.mark.parametrize("fit", FITS)
def test_weights_are_the_derivatives_of_the_fit(fit, alike):
    rng = np.random.default_rng(2)
    values = 3e3 + 50.0 * alike.temperature_c + rng.standard_normal(alike.temperature_c.size)
    columns = alike.temperature_c, alike.rate_c_per_min
    rows = fits.near_reference(alike.temperature_c) if fit is fits.constant else np.ones(values.size, dtype=bool)
    curve = fit(*columns, values)
    weights = _weights(fit, curve, curve.design(*(c[rows] for c in columns)), alike.temperature_c[rows])
    change = rng.standard_normal(values.size)
    moved = fit(*columns, values + change).values - curve.values
    np.testing.assert_allclose(change[rows] @ weights, moved, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("shifts", [(3.0, -1.0, 4.0, -2.0), (10.0, 0.0, 0.5, -8.0)])
def test_shifts_of_four_ramps_give_students_t_with_three_degrees_of_freedom(shifts, alike):
    """The mean of four ramps alike is uncertain by t(3) s / 2."""
    values = 7.0 + 2.0 * (alike.temperature_c - 22.0) + np.repeat(shifts, 2 * EACH)
    values += 1e-3 * np.random.default_rng(1).standard_normal(values.size)
    curve = fits.line(alike.temperature_c, alike.rate_c_per_min, values)
    found = uncertainty(fits.line, curve, alike, values)
    expected = stats.t.ppf(0.975, 3) * np.std(shifts, ddof=1) / 2.0
    assert found.half_width95[1] == pytest.approx(expected, rel=DRAWN_TOLERANCE)
    assert found.ramp_shift == pytest.approx(np.std(shifts, ddof=1), rel=1e-2)
    assert found.half_width95[0] < 1e-3  # the slope comes from within the ramps
    np.testing.assert_allclose(1.959964 * np.sqrt(np.diag(found.covariance)), found.half_width95)


def test_shifts_of_legs_count_where_readings_seem_to_be_many(alike):
    """Eight legs shifted by 1, noise of 0.01: the mean is uncertain by some 1 / sqrt(8), not 0.01 / sqrt(2400)."""
    covered, widths = [], []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        values = np.repeat(rng.standard_normal(8), EACH) + 0.01 * rng.standard_normal(8 * EACH)
        curve = fits.line(alike.temperature_c, alike.rate_c_per_min, values)
        half_width = uncertainty(fits.line, curve, alike, values).half_width95[1]
        covered.append(abs(curve.values[1]) <= half_width)
        widths.append(half_width)
    assert np.mean(covered) >= 0.85  # 95 % less three standard deviations
    assert np.median(widths) == pytest.approx(stats.t.ppf(0.975, 5) / np.sqrt(8), rel=0.35)


def test_white_noise_alone_costs_little_over_least_squares(alike):
    """The classical interval is right there; that of few clusters is wider by the price of not knowing it."""
    ratio, covered = [], []
    for seed in range(40):
        values = np.random.default_rng(seed).standard_normal(alike.temperature_c.size)
        curve = fits.line(alike.temperature_c, alike.rate_c_per_min, values)
        _, classical = np.polyfit(alike.temperature_c - 22.0, values, 1, cov=True)
        half_width = uncertainty(fits.line, curve, alike, values).half_width95
        ratio.append(half_width / (1.96 * np.sqrt(np.diag(classical))))
        covered.append(np.abs(curve.values) <= half_width)
    assert 1.0 < np.median(ratio) < 1.8
    assert np.mean(covered) >= 0.90


def test_correlated_noise_widens_the_interval(alike):
    """AR(1) with 0.9 has 19 times the variance of white noise in a slow sum."""
    rng = np.random.default_rng(5)
    white = rng.standard_normal(alike.temperature_c.size)
    red = np.empty_like(white)
    state = 0.0
    for k, step in enumerate(white):
        state = red[k] = 0.9 * state + np.sqrt(1 - 0.81) * step
    widths = []
    for values in (white, red):
        curve = fits.line(alike.temperature_c, alike.rate_c_per_min, values)
        widths.append(uncertainty(fits.line, curve, alike, values).half_width95)
    assert 2.0 < np.median(widths[1] / widths[0]) < 9.0  # around sqrt(19) = 4.4, from one draw of each


def test_long_run_variance_of_an_autoregression():
    """Unit steps and factor 0.7: 1 / (1 - 0.7)^2; independent: 1."""
    rng = np.random.default_rng(4)
    parts = []
    for _ in range(8):
        part = np.zeros(2000)
        for k, step in enumerate(rng.standard_normal(1999), start=1):
            part[k] = 0.7 * part[k - 1] + step
        parts.append(part)
    assert _long_run_variance(parts) == pytest.approx(1 / 0.3**2, rel=0.15)
    assert _long_run_variance([rng.standard_normal(2000) for _ in range(8)]) == pytest.approx(1.0, rel=0.15)
    assert _long_run_variance([np.zeros(50)]) == 0.0


def test_exact_values_have_no_width(alike):
    values = 7.0 + 2.0 * (alike.temperature_c - 22.0)
    found = uncertainty(fits.line, fits.line(alike.temperature_c, alike.rate_c_per_min, values), alike, values)
    assert (found.half_width95 < 1e-9).all()


def test_one_ramp_shows_nothing_of_the_shifts_between_runs(chamber_of):
    points = four_point(chamber_of(lambda t, r: 3e5 + t, lambda t, r: 0 * t, ramps=(0.5,)))
    curve = fits.line(points.temperature_c, points.rate_c_per_min, points.scale)
    with pytest.raises(DataRefused, match="one commanded rate shows nothing of the shifts between runs"):
        uncertainty(fits.line, curve, points, points.scale)


def test_rates_that_the_curve_uses_up_leave_no_shift_to_be_seen(alike):
    """alpha and gamma take all that two steady ramps differ by."""
    two = alike.ramp_c_per_min < 0.6
    points = FourPoint(*(getattr(alike, name)[two] for name in FourPoint.__dataclass_fields__))
    values = np.random.default_rng(0).standard_normal(two.sum())
    curve = fits.polynomial(points.temperature_c, points.rate_c_per_min, values)
    with pytest.raises(DataRefused, match="2 commanded rates determine the curve but leave nothing over"):
        uncertainty(fits.polynomial, curve, points, values)
