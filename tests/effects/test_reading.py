"""Temperatures told by thermometers with steps and noise, against temperatures that were drawn."""

import gc
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import cholesky_banded

from ins_eval.effects.reading import _KNOWN, _beside, _Readings, _variances, thermometers, told

HOUR_S = 3600.0
TIME_S = np.arange(0.0, 2.0 * HOUR_S)
AT_S = TIME_S[60:-60:60]
DRAWS = 12
# of the errors two standard deviations hold 95 %; neighbours are hardly independent, and S and sigma are fitted
TOO_FEW, TOO_MANY_SIGMA = 0.9, 1.4
LINE_C = 1e-3  # to which a line of readings is itself


def read(temperature_c: np.ndarray, step_c: float, noise_c: float, rng) -> np.ndarray:
    return step_c * np.round((temperature_c + noise_c * rng.standard_normal(temperature_c.size)) / step_c)


def drifting(rng, per_hour_c: float) -> np.ndarray:
    """A temperature of a room: a few slow waves of random phase."""
    waves = [np.sin(2.0 * np.pi * (TIME_S / of_s + rng.random())) * of_s for of_s in (2500.0, 5000.0, 12000.0)]
    course = np.sum(waves, axis=0)
    return 20.0 + rng.random() + per_hour_c / HOUR_S * course / np.std(np.gradient(course, TIME_S))


@pytest.mark.parametrize(
    ("step_c", "noise_c", "of_means"), [(0.125, 0.003, 0.6), (0.0625, 0.02, 0.9), (0.01, 0.03, 0.9)]
)
def test_what_was_drawn_lies_where_the_readings_say(step_c: float, noise_c: float, of_means: float) -> None:
    """And nearer than means over four minutes, which follow steps and miss bends, by the factor `of_means`."""
    rng = np.random.default_rng(1)
    off, inside, smoothed = [], [], []
    for _ in range(DRAWS):
        true_c = drifting(rng, 1.0)
        reading_c = read(true_c, step_c, noise_c, rng)
        seen = told(TIME_S, reading_c)
        deviation = np.sqrt(_variances(cholesky_banded(seen.information)))
        error = seen.at(AT_S) - np.interp(AT_S, TIME_S, true_c)
        off.append(error)
        inside.append(np.abs(error) < 2.0 * np.interp(AT_S, seen.at_s, deviation))
        means = np.convolve(reading_c, np.full(241, 1.0 / 241.0), "same")
        smoothed.append(np.interp(AT_S[2:-2], TIME_S, means - true_c))
    assert np.mean(inside) > TOO_FEW
    assert np.sqrt(np.mean(np.square(off))) < of_means * np.sqrt(np.mean(np.square(smoothed)))


def test_where_it_turns_within_a_step_it_is_as_uncertain_as_it_is_off() -> None:
    """The top of a hump that no reading shows: anywhere within a step, and said so."""
    rng, step_c = np.random.default_rng(2), 0.125
    off = []
    for top in np.linspace(0.1, 0.9, 9):
        true_c = 20.0 + step_c * (0.5 + top - (6.0 * (TIME_S / TIME_S[-1] - 0.5)) ** 2)
        seen = told(TIME_S, read(true_c, step_c, 0.003, rng))
        middle = TIME_S[-1] / 2.0
        deviation = np.interp(middle, seen.at_s, np.sqrt(_variances(cholesky_banded(seen.information))))
        off.append((seen.at(np.array([middle]))[0] - np.interp(middle, TIME_S, true_c)) / deviation)
    assert np.sqrt(np.mean(np.square(off))) < TOO_MANY_SIGMA


def test_exact_and_short_readings_stay_as_they_are() -> None:
    still, short = np.full(TIME_S.size, 21.0), np.array([20.0, 20.1, 20.2])
    assert np.array_equal(told(TIME_S, still).at(AT_S), np.full(AT_S.size, 21.0))
    assert told(TIME_S[:3], short).information is None
    np.testing.assert_allclose(told(TIME_S[:3], short).at(TIME_S[:3]), short)


@pytest.mark.parametrize("length_s", [600, 1200, 3600])
@pytest.mark.parametrize("ends_c", [20.01, 55.0])
def test_a_line_to_the_last_digit_is_that_line(length_s: int, ends_c: float) -> None:
    time_s = np.arange(0.02, length_s, 0.02)
    line = np.linspace(15.0, ends_c, time_s.size)
    np.testing.assert_allclose(told(time_s, line).at(time_s), line, atol=LINE_C)


def test_readings_that_come_seldom_or_not_at_all_for_a_while() -> None:
    rng = np.random.default_rng(3)
    true_c = drifting(rng, 2.0)
    seldom = np.arange(0, TIME_S.size, 60)
    kept = seldom[(seldom < 2000) | (seldom > 2900)]
    seen = told(TIME_S[kept], read(true_c[kept], 0.01, 0.01, rng))
    assert np.abs(seen.at(TIME_S[kept]) - true_c[kept]).max() < 0.03


@pytest.mark.parametrize("seconds", [30, 600])
@pytest.mark.parametrize("moves_c", [0.0, 0.5])
def test_what_was_told_goes_with_the_readings(flight, seconds: int, moves_c: float) -> None:
    """A process that diagnoses many recordings keeps none."""
    time_s = np.arange(0.0, seconds)
    before = set(_KNOWN)
    reading_c = 20.0 + moves_c * np.round(time_s / 10.0)
    read_off = replace(flight, imu=replace(flight.imu, time_s=time_s, temperature_c=reading_c))
    assert thermometers(read_off) is thermometers(read_off) and set(_KNOWN) != before
    del read_off, reading_c
    gc.collect()
    assert set(_KNOWN) == before


def test_variances_are_those_of_the_inverse() -> None:
    count = 40
    readings = _Readings(np.arange(count), np.zeros(count), np.ones(count), 0.1, count, 10.0)
    bands = _beside(readings.smooth(1e-6), np.random.default_rng(4).uniform(1.0, 9.0, count))
    dense = np.diag(bands[2]) + np.diag(bands[1, 1:], 1) + np.diag(bands[0, 2:], 2)
    dense = dense + np.triu(dense, 1).T
    np.testing.assert_allclose(_variances(cholesky_banded(bands)), np.diag(np.linalg.inv(dense)))
