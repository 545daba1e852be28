"""What the page shows: the disturbance of a channel and the gain, on recordings whose fault is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.diagnosis.answer.judge import judge
from ins_eval.diagnosis.answer.nonparametric import disturbances, located
from ins_eval.diagnosis.answer.summary import basis, before_after, evidence, limits
from ins_eval.diagnosis.answer.verdict import EXPLAINED, NO_MISMATCH
from ins_eval.diagnosis.estimate.case import prepare
from ins_eval.earth import EARTH_RATE
from ins_eval.units import DEG_PER_H, HOUR, UG

BURST_DEG_PER_H = 0.3
BURST_S = (1200.0, 2400.0)
DRIFT_DEG_PER_H2 = 0.5
RATE_HZ = 20.0
SHARE = 0.15  # by which what data find by themselves may differ from what was put in
EPOCH_SHARE = 1e-3  # what turning within an epoch takes from a drive


@pytest.fixture(scope="module")
def parked(ideal_recording):
    """An hour at rest: sound, with a burst in gyro x, and with gyro x that drifts."""
    whole = ideal_recording("oven")
    rows = whole.imu.time_s <= 3600.0
    imu = replace(
        whole.imu,
        time_s=whole.imu.time_s[rows],
        gyro=whole.imu.gyro[rows],
        accelerometer=whole.imu.accelerometer[rows],
        height_baro_m=None,
    )
    time_s = imu.time_s
    burst = BURST_DEG_PER_H * ((time_s > BURST_S[0]) & (time_s <= BURST_S[1]))
    drift = DRIFT_DEG_PER_H2 * (time_s - whole.start.time_s) / HOUR

    def judged(error_deg_per_h: np.ndarray):
        gyro = imu.gyro.copy()
        gyro[:, 0] += error_deg_per_h * DEG_PER_H / RATE_HZ
        return judge([prepare(replace(whole, imu=replace(imu, gyro=gyro)))])

    return judged(0.0 * drift), judged(burst), judged(drift)


def test_a_sound_recording_has_evidence_and_limits_but_nothing_located(parked) -> None:
    found = parked[0]
    assert found.verdict == NO_MISMATCH
    of = basis(found)
    places = evidence(of, None)
    assert places[0].log_bayes_factor < of.space.cost
    assert not any(one.named for one in places)
    assert located(found) is None
    assert before_after(found, 0) is None
    assert len(limits(of)) == len(places)


def test_what_nothing_explains_is_found_in_size_and_time(parked) -> None:
    found = parked[1]
    found = replace(found, effects=(), linearisation=None, unnamed=replace(found.unnamed, mismatch=found.mismatches[0]))
    one = located(found)
    assert (one.channel, one.unit) == ("gyro.x", "deg/h")
    assert not np.isfinite(one.effect).any()
    inside = (one.time_s > BURST_S[0] + 120.0) & (one.time_s < BURST_S[1] - 120.0)
    outside = (one.time_s < BURST_S[0] - 120.0) | (one.time_s > BURST_S[1] + 120.0)
    height = one.mean[inside].mean() - one.mean[outside].mean()
    assert height == pytest.approx(BURST_DEG_PER_H, rel=SHARE)


def test_an_effect_lies_along_what_data_find(parked) -> None:
    found = parked[2]
    assert found.verdict == EXPLAINED
    effect = found.effects[0]
    assert (effect.hypothesis.candidate.name, effect.hypothesis.candidate.axis) == ("gyro.bias_drift", "x")
    places = evidence(basis(found), effect)
    assert [one.named for one in places[:2]] == [True, False]
    one = located(found, effect)
    assert (one.channel, one.unit, one.drive_unit) == ("gyro.x", "deg/h", "h")
    truth = DRIFT_DEG_PER_H2 * one.time_s / HOUR
    np.testing.assert_allclose(one.drive, one.time_s / HOUR, atol=0.01)
    np.testing.assert_allclose(one.effect, truth, atol=SHARE * truth.max())
    np.testing.assert_allclose(one.mean, truth, atol=SHARE * truth.max())


def test_the_residual_falls_with_the_effect_and_one_noise(parked) -> None:
    before, after = before_after(parked[2], 0)
    squares = [float(np.nansum(e**2)) for e in (before, after)]
    assert squares[1] < 0.5 * squares[0]


def test_a_column_is_the_error_of_its_own_sensor(flight) -> None:
    case = prepare(flight)
    one = case.member("accelerometer.bias", "z", {})
    driven, measured = disturbances(case, one.column)
    np.testing.assert_allclose(driven[:, 2], one.nominal * UG, rtol=EPOCH_SHARE)
    assert np.abs(driven[:, [0, 1]]).max() < 0.1 * one.nominal * UG  # nothing but turning within an epoch
    assert not measured.any()


def test_the_missing_rotation_of_the_earth_is_what_three_gyros_feel(flight) -> None:
    case = prepare(flight)
    one = case.member("earth.rotation", None, {})
    driven, _ = disturbances(case, one.column)
    felt = np.linalg.norm(driven[:, 3:], axis=1) / one.nominal
    np.testing.assert_allclose(felt, EARTH_RATE, rtol=0.02)
