"""A parked MEMS unit that warms up by itself: its laws of temperature, and what they say of stretches not used.

Documented in `SOURCE.md` beside it. The laws are held against straight lines through means of 20 s, which need no
navigation, and what is told against what Gaussian regression on one output alone expects.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.special import softmax
from scipy.stats import multivariate_normal

from benchmark.worlds import recorded as recorded_worlds
from ins_eval.analysis.diagnose import diagnose_folders
from ins_eval.diagnosis.answer import collect
from ins_eval.effects import without_effects
from ins_eval.recording import Recording
from ins_eval.units import DEG_PER_H, UG
from tests.diagnosis.real_recordings import diagnosed, imported, values

SETTLED_S = 65.0  # until which the unit was carried
MEANS_S = 20.0
# standard deviations of means over a stretch that was not used; a straight line through the others leaves 74 ug
LEFT_UG, VARIES_DEG_PER_H, SECOND_HALF_DEG_PER_H = 50.0, (9.0, 11.0, 9.0), 10.0
# What can be told of an accelerometer: a constant, a share of a line (a tenth to all of it expect 64 to 99 ug of the
# second half), times and sizes of wander, noise of means of 20 s.
CONSTANT_UG, BESIDE, WANDER_S = 1e5, 0.2, (100.0, 300.0, 1000.0, 3000.0)
WANDER_UG, WHITE_UG = (0.0, 20.0, 40.0, 80.0, 150.0, 300.0), (30.0, 40.0, 50.0, 70.0, 100.0)
OF_CHANCE = 0.5  # nats between two searches: processors with other vectors differ by 0.7
SLOPE_AGREES = 0.25  # of a line beside those of the other sensors, tilt and wander


@pytest.fixture(scope="module")
def warm_up(tmp_path_factory: pytest.TempPathFactory) -> tuple[Recording, Path]:
    folder = tmp_path_factory.mktemp("warm_up") / "recording"
    return imported("warm-up", folder), folder


def slope(time_s: np.ndarray, output: np.ndarray, temperature_c: np.ndarray) -> float:
    """Of a straight line through means over `MEANS_S` of an output against the temperature."""
    rows = time_s > SETTLED_S
    output, temperature_c = (means(one[rows], time_s) for one in (output, temperature_c))
    return float(np.polyfit(temperature_c, output, 1)[0])


def means(values: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Over `MEANS_S` of values in a row, at the rate of `time_s`."""
    count = round(MEANS_S / float(np.median(np.diff(time_s))))
    return values[: len(values) // count * count].reshape(-1, count).mean(axis=1)


@pytest.mark.slow
def test_a_parked_unit_that_warms_up_has_its_laws_of_temperature(warm_up) -> None:
    """Of gyro z the temperature and its rate are too much alike in one warm-up to say which: one is named or listed."""
    found = diagnosed(*warm_up)
    imu, interval_s = warm_up[0].imu, warm_up[0].interval_s
    temperature = np.asarray(imu.temperature_c).reshape(len(imu.time_s), -1)[:, 0]
    gyro = slope(imu.time_s, imu.gyro[:, 2] / interval_s / DEG_PER_H, temperature)
    force = slope(imu.time_s, imu.accelerometer[:, 2] / interval_s / UG, temperature)
    assert values(found)["accelerometer.bias_temperature", "z"] == pytest.approx(force, rel=SLOPE_AGREES)
    said = [(one.hypothesis.candidate, one.value) for one in (*found.effects, *found.rivals)]
    laws = {one.name: value for one, value in said if one.axis == "z"}
    assert laws["gyro.bias_temperature"] * gyro > 0.0
    assert "gyro.bias_temperature_rate" in laws
    # what gyros x and y do by the eye loud wander does nearly as well: it is listed, if not named
    slow = {(one.name, one.axis) for one, _ in said if one.name.startswith("gyro.") and one.axis in "xy"}
    assert {axis for _, axis in slow} == {"x", "y"}


def told(warm_up: tuple[Recording, Path], parts: list[tuple[float, float]], of: tuple[float, float], where: Path):
    """What the model that is written of `parts` leaves of a stretch `of` a recording; all are shares of its length.

    The standard deviations of means of force z in ug and of rates in deg/h (3,): a recording has constants of its own.
    """
    recording, folder = warm_up
    whole = recorded_worlds.read(folder)
    folders = [where / str(begin) for begin, _ in parts]
    for part, (begin, end) in zip(folders, parts, strict=True):
        recorded_worlds.part(whole, begin, end).save(part)
    model = diagnose_folders(folders).diagnosis.forecast
    imu, interval_s = recording.imu, recording.interval_s
    believing = replace(recording, belief=recording.belief.model_copy(update={"effects": tuple(model)}))
    compensated, velocity = without_effects(believing, imu.accelerometer.copy(), folder)
    share = (imu.time_s - whole.start_s) / whole.seconds
    stretch = (share > of[0]) & (share <= of[1])
    force, rate = velocity[:, 2] / interval_s / UG, compensated.imu.gyro / interval_s[:, None] / DEG_PER_H
    rates = np.array([means(rate[stretch, axis], imu.time_s).std() for axis in range(3)])
    return means(force[stretch], imu.time_s).std(), rates


@pytest.mark.slow
@pytest.mark.parametrize("lead", [-OF_CHANCE, OF_CHANCE])
def test_what_the_rest_of_a_warm_up_tells_says_its_middle(warm_up, tmp_path, monkeypatch, lead) -> None:
    """Six effects, or one and a gyro that wanders more, are as probable: rounding decides which of them are named."""
    compared = collect.more_probable
    monkeypatch.setattr(collect, "more_probable", lambda a, b: compared(a, b) + lead)
    third = 1.0 / 3.0
    force, rates = told(warm_up, [(0.0, third), (2.0 * third, 1.0)], (third, 2.0 * third), tmp_path)
    assert force < LEFT_UG
    assert (rates < VARIES_DEG_PER_H).all()


def to_be_expected(time_s: np.ndarray, temperature_c: np.ndarray, output: np.ndarray, used: np.ndarray) -> float:
    """Standard deviation (ug) of means (n,) that are not `used` about what those tell that are, by Gaussian regression.

    What is expected by who reads this output alone: a constant and a line of the temperature; beside them nothing, the
    square of the temperature, its rate or the time, of `BESIDE` of what the line makes; wander of sigma^2 exp(-|dt| /
    tau) and white noise, of levels on a grid. All are as likely before, and weigh w after; with their predictions m and
    covariances C,  V = sum w (C + (m - M)(m - M)'),  M = sum w m.
    """
    x, t = temperature_c - temperature_c[used].mean(), time_s - time_s[used].mean()
    line = np.abs(np.polyfit(x[used], output[used], 1)[0])
    besides = (None, x**2, np.gradient(temperature_c, time_s), t)
    apart, there = np.abs(np.subtract.outer(time_s, time_s)), ~used
    seen = output[used] - output[used].mean()
    log, mean, variance = [], [], []
    for beside, wander, tau, white in product(besides, WANDER_UG, WANDER_S, WHITE_UG):
        columns = [np.full(x.size, CONSTANT_UG), line * x]
        columns += [] if beside is None else [BESIDE * line * x.std() / beside.std() * beside]
        known = np.transpose(columns) @ columns + wander**2 * np.exp(-apart / tau)
        of_used = known[np.ix_(used, used)] + white**2 * np.eye(seen.size)
        gain = np.linalg.solve(of_used, known[np.ix_(used, there)]).T
        log.append(multivariate_normal(np.zeros(seen.size), of_used).logpdf(seen))
        mean.append(gain @ seen)
        left = known[np.ix_(there, there)] - gain @ known[np.ix_(used, there)]
        variance.append(left + white**2 * np.eye(there.sum()))
    weight = softmax(log)
    off = mean - weight @ mean
    whole = np.tensordot(weight, variance, 1) + (weight[:, None] * off).T @ off
    return float(np.sqrt(np.trace(whole - whole.mean(axis=0)) / there.sum()))


@pytest.mark.slow
def test_the_first_half_of_a_warm_up_says_z_of_the_second(warm_up, tmp_path) -> None:
    """Of the force no more can be promised than what is expected by who knows that it follows the temperature."""
    force, rates = told(warm_up, [(0.0, 0.5)], (0.5, 1.0), tmp_path)
    imu, interval_s = warm_up[0].imu, warm_up[0].interval_s
    rows = imu.time_s > SETTLED_S
    outputs = (
        imu.time_s,
        np.asarray(imu.temperature_c).reshape(len(rows), -1)[:, 0],
        imu.accelerometer[:, 2] / interval_s / UG,
    )
    time_s, temperature_c, output = (means(one[rows], imu.time_s) for one in outputs)
    assert force < to_be_expected(time_s, temperature_c, output, time_s < time_s.mean())
    assert rates[2] < SECOND_HALF_DEG_PER_H


@pytest.mark.slow
def test_a_temperature_of_another_time_is_no_cause(warm_up) -> None:
    recording, folder = warm_up
    temperature = np.roll(recording.imu.temperature_c, len(recording.imu.time_s) // 2, axis=0)
    elsewhere = replace(recording, imu=replace(recording.imu, temperature_c=temperature))
    assert not [name for name, _ in values(diagnosed(elsewhere, folder)) if "temperature" in name]
