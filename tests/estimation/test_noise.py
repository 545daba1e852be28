"""Noise levels come back from a recording that was made with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ins_eval.diagnosis.answer.judge import judge
from ins_eval.diagnosis.answer.verdict import UNEXPLAINED
from ins_eval.earth import radii
from ins_eval.estimation import case as cases
from ins_eval.random_processes import gauss_markov
from ins_eval.recording import Recording
from ins_eval.units import DEG_PER_SQRT_H, STANDARD_GRAVITY, UG
from tests.ideal import ANGLE_RANDOM_WALK, VELOCITY_RANDOM_WALK_UG

POSITION_M, VELOCITY_MPS, SLOW_MPS, SLOW_S = 2.5, 0.05, 0.015, 60.0
WALK_UG, ANGLE_WALK = 40.0, 0.002
HEIGHT_SHARE = 0.004
OFF_S, OFF_MPS, EDGE_S = (3950.0, 4440.0), 3.0, 20.0
WAVE_UG, WAVE_C, COOLED_C = 60.0, 25.0, 20.0
STICKING_UG, STICKING_G = 400.0, 0.03
STOOD_S, WALK_AGREES = 1800.0, 0.2
AWRY_S, AWRY_UG, AWRY_ENDS_S = (1800.0, 2500.0), 1000.0, 3200.0
ROUGH_S, SHAKE_MPS2, SHARE, SHARE_AGREES = 200.0, 2.0, 0.5, 0.3
MEMS_ANGLE_WALK, LOUDER, LOUDNESS_AGREES, EDGE_EPOCHS = 0.3, 3.0, 0.3, 40
SHORT_EPOCH = 1e-3  # of a walk of phi, that the Earth turns within an epoch
COARSE = {"bias_sigma_deg_per_h": 20.0}


@pytest.fixture(scope="module")
def noisy(flight) -> Recording:
    """White and slow receiver noise, random walks above the sheet, a few wild fixes."""
    rng = np.random.default_rng(7)
    imu, fixes = flight.imu, flight.gps
    dt = np.diff(imu.time_s, prepend=flight.start.time_s)[:, None]
    gyro = imu.gyro + DEG_PER_SQRT_H * ANGLE_WALK * np.sqrt(dt) * rng.standard_normal(imu.gyro.shape)
    force = imu.accelerometer + UG * WALK_UG * np.sqrt(dt) * rng.standard_normal(imu.gyro.shape)
    position = POSITION_M * rng.standard_normal((fixes.time_s.size, 3))
    slow = np.column_stack([gauss_markov(fixes.time_s, SLOW_MPS, SLOW_S, rng) for _ in range(3)])
    velocity = VELOCITY_MPS * rng.standard_normal(position.shape) + slow
    velocity[500::1000] += 2.0
    meridian, transverse = radii(fixes.latitude_rad)
    received = replace(
        fixes,
        latitude_rad=fixes.latitude_rad + position[:, 0] / meridian,
        longitude_rad=fixes.longitude_rad + position[:, 1] / transverse / np.cos(fixes.latitude_rad),
        height_m=fixes.height_m - position[:, 2],
        velocity_n=fixes.velocity_n + velocity,
    )
    return replace(flight, imu=replace(imu, gyro=gyro, accelerometer=force), gps=received)


def test_levels_are_found_and_nothing_else(noisy) -> None:
    case = cases.prepare(noisy)
    judgement = judge([case])
    levels = case.noise.values(judgement.null[0].noise_point)
    assert levels["slow_velocity"] == pytest.approx(SLOW_MPS, rel=0.2)
    assert levels["slow_velocity_time"] == pytest.approx(SLOW_S, rel=0.5)
    assert levels["velocity_random_walk"] < 2.0 * WALK_UG * UG  # from below it is hidden by the slow error of velocity
    assert levels["angle_random_walk"] == pytest.approx(ANGLE_WALK * DEG_PER_SQRT_H, rel=0.5)
    white = np.nanmedian(case.noise.white[1:], axis=0)[:6]
    np.testing.assert_allclose(white, [POSITION_M] * 3 + [VELOCITY_MPS] * 3, rtol=0.05)
    assert 24 <= case.outliers <= 36  # eight wild fixes in three channels, and a few of the tail
    assert judgement.mismatches == ()
    rms = np.sqrt(np.nanmean(judgement.innovations[0][:, :6] ** 2, axis=0))
    np.testing.assert_allclose(rms, 1.0, atol=0.08)


@pytest.mark.slow
def test_a_disturbance_of_one_axis_is_located(noisy) -> None:
    begin_s, end_s = 3000.0, 5000.0
    imu = noisy.imu
    inside = (imu.time_s > begin_s) & (imu.time_s <= end_s)
    force = imu.accelerometer.copy()
    force[inside, 1] += 60.0 * UG / 20.0
    found = judge([cases.prepare(replace(noisy, imu=replace(imu, accelerometer=force)))]).mismatches
    assert {one.channel for one in found} == {"accelerometer.y"}
    edges_s = sorted({one.begin_s for one in found} | {one.end_s for one in found} - {imu.time_s[-1]})
    assert edges_s == pytest.approx([begin_s, end_s], abs=200.0)  # of one interval, or of a jump there and one back
    assert all(one.where in ("level", "all phases") for one in found)


@pytest.mark.slow
def test_an_accelerometer_that_sticks_is_told_from_the_laws_of_its_model(noisy) -> None:
    imu = noisy.imu
    rate_hz = 1.0 / float(np.median(np.diff(imu.time_s)))
    felt_g = imu.accelerometer[:, 0] * rate_hz / STANDARD_GRAVITY
    force = imu.accelerometer.copy()
    force[:, 0] -= STICKING_UG * UG * felt_g / (np.abs(felt_g) + STICKING_G) / rate_hz
    found = judge([cases.prepare(replace(noisy, imu=replace(imu, accelerometer=force)))])
    assert (found.verdict, found.effects) == (UNEXPLAINED, ())
    assert found.mismatches[0].channel == "accelerometer.x"
    assert "it follows the side of its own input" in found.mismatches[0].where


@pytest.mark.slow
def test_a_height_that_is_wrong_in_proportion_to_height_is_no_effect_of_the_instrument(noisy) -> None:
    """Temperature follows height too: what is the receiver's must not become a thermal law of an accelerometer."""
    fixes = noisy.gps
    climbed = fixes.height_m - noisy.start.height_m
    wrong = replace(fixes, height_m=fixes.height_m + HEIGHT_SHARE * climbed)
    found = judge([cases.prepare(replace(noisy, gps=wrong))])
    assert (found.verdict, found.effects) == (UNEXPLAINED, ())
    assert found.mismatches[0].channel == "gps.position"
    assert "it follows height" in found.mismatches[0].where


@pytest.mark.slow
def test_a_bias_that_waves_with_temperature_is_a_curve_without_a_name(noisy) -> None:
    """Four fifths of a wave: with no curve to hold against it a parabola is named."""
    imu = noisy.imu
    rate_hz = 1.0 / float(np.median(np.diff(imu.time_s)))
    reading_c = 10.0 - COOLED_C * np.sin(np.pi * imu.time_s / imu.time_s[-1])
    force = imu.accelerometer.copy()
    force[:, 0] += WAVE_UG * UG * np.sin(2.0 * np.pi * reading_c / WAVE_C) / rate_hz
    waving = replace(imu, accelerometer=force, temperature_c=reading_c)
    found = judge([cases.prepare(replace(noisy, imu=waving))])
    assert (found.verdict, found.effects) == (UNEXPLAINED, ())
    assert found.mismatches[0].channel == "accelerometer.x"
    assert "it follows a curve of its temperature" in found.mismatches[0].where


@pytest.mark.slow
def test_a_receiver_that_is_off_for_a_time_does_not_pass_for_one_with_slow_errors(noisy) -> None:
    """So large that noise fitted without it takes it over: nothing is remarkable then."""
    begin_s, end_s = OFF_S
    fixes = noisy.gps
    velocity = fixes.velocity_n.copy()
    velocity[(fixes.time_s > begin_s) & (fixes.time_s <= end_s), 1] += OFF_MPS
    found = judge([cases.prepare(replace(noisy, gps=replace(fixes, velocity_n=velocity)))])
    assert (found.verdict, found.effects) == (UNEXPLAINED, ())
    (one,) = found.mismatches
    assert (one.channel, one.axis) == ("gps.velocity", "E")
    assert (one.begin_s, one.end_s) == pytest.approx(OFF_S, abs=EDGE_S)


def test_a_sensor_that_is_off_for_a_time_does_not_pass_for_one_that_wanders(noisy) -> None:
    """With the wander that it feigns a gyro that tilts at one end and tilts back at the other does as well."""
    noisy = replace(noisy, gps=noisy.gps.rows(noisy.gps.time_s <= AWRY_ENDS_S))
    imu = noisy.imu.rows(noisy.imu.time_s <= AWRY_ENDS_S)
    rate_hz = 1.0 / float(np.median(np.diff(imu.time_s)))
    inside = (imu.time_s > AWRY_S[0]) & (imu.time_s <= AWRY_S[1])
    force = imu.accelerometer.copy()
    force[inside, 0] += AWRY_UG * UG / rate_hz
    found = judge([cases.prepare(replace(noisy, imu=replace(imu, accelerometer=force)))])
    assert (found.verdict, found.effects) == (UNEXPLAINED, ())
    (one,) = found.mismatches
    assert one.channel == "accelerometer.x"
    assert (one.begin_s, one.end_s) == pytest.approx(AWRY_S, abs=EDGE_S)


def test_a_standstill_shows_the_random_walks_of_its_sensors(recording_at_rest) -> None:
    """A bench stands stiller than a vehicle: a sway that is believed in would pass for the noise of a good unit."""
    case = cases.prepare(recording_at_rest(STOOD_S, 3, np.zeros_like))
    found = case.noise.values(case.fitted().noise_point)
    assert found["velocity_random_walk"] == pytest.approx(UG * VELOCITY_RANDOM_WALK_UG, rel=WALK_AGREES)
    assert found["angle_random_walk"] == pytest.approx(DEG_PER_SQRT_H * ANGLE_RANDOM_WALK, rel=WALK_AGREES)


def test_a_parked_coarse_unit_shows_which_of_its_gyros_is_louder_and_when(recording_at_rest) -> None:
    """Gyro y is three times as noisy as the others in the first half."""
    rng, parked = np.random.default_rng(9), recording_at_rest(STOOD_S, 3, np.zeros_like)
    time_s = parked.imu.time_s
    louder = np.ones((time_s.size, 3))
    louder[time_s < parked.start.time_s + 0.5 * STOOD_S, 1] = LOUDER
    root_dt = np.sqrt(np.diff(time_s, prepend=parked.start.time_s))[:, None]
    walk = DEG_PER_SQRT_H * MEMS_ANGLE_WALK
    gyro = parked.imu.gyro + walk * louder * root_dt * rng.standard_normal(louder.shape)
    coarse = {**COARSE, "angle_random_walk_deg_per_sqrt_h": MEMS_ANGLE_WALK}
    belief = parked.belief.model_copy(update={"gyro": parked.belief.gyro.model_copy(update=coarse)})
    case = cases.prepare(replace(parked, imu=replace(parked.imu, gyro=gyro), belief=belief))
    found, half = case.model.loudness, len(case.model.loudness) // 2
    for rows, of_y in ((slice(0, half - EDGE_EPOCHS), LOUDER), (slice(half + EDGE_EPOCHS, None), 1.0)):
        assert np.median(found[rows], axis=0) == pytest.approx([1.0, of_y, 1.0], rel=LOUDNESS_AGREES)
    c = Rotation.from_euler("ZYX", parked.start.attitude_rad[::-1]).as_matrix()
    turned = c @ np.diag(np.square(found[0])) @ c.T
    np.testing.assert_allclose(case.model.walks[0, 1, 6:, 6:], turned, atol=SHORT_EPOCH * LOUDER**2)
    assert case.noise.values(case.fitted().noise_point)["angle_random_walk"] == pytest.approx(walk, rel=WALK_AGREES)


def test_the_gyros_of_a_good_unit_are_alike(recording_at_rest) -> None:
    """What a vehicle sways by is far above the noise of laser gyros, and about roll more than in heading."""
    assert cases.prepare(recording_at_rest(STOOD_S, 3, np.zeros_like)).model.loudness is None


def test_what_a_rough_road_shakes_is_noise_of_a_coarse_unit_in_one_arc_too(flight) -> None:
    """Velocity errs by a share of what it changes to and fro from sample to sample, while it shakes."""
    rng = np.random.default_rng(11)
    inside = flight.imu.time_s <= flight.start.time_s + ROUGH_S
    time_s, force = flight.imu.time_s[inside], flight.imu.accelerometer[inside].copy()
    shaken = np.abs(time_s - time_s.mean()) < 0.25 * ROUGH_S
    shake = SHAKE_MPS2 * np.median(np.diff(time_s)) * (-1.0) ** np.arange(shaken.sum())[:, None]
    force[shaken] += shake + SHARE * np.abs(shake) * rng.standard_normal((shaken.sum(), 3))
    imu = replace(flight.imu, time_s=time_s, gyro=flight.imu.gyro[inside], accelerometer=force, temperature_c=None)
    belief = flight.belief.model_copy(update={"gyro": flight.belief.gyro.model_copy(update=COARSE)})
    case = cases.prepare(replace(flight, imu=imu, belief=belief))
    assert not case.believed.arcs
    found = case.noise.values(case.fitted().noise_point)
    assert found["accelerometer_sampling"] == pytest.approx(SHARE, rel=SHARE_AGREES)
