"""Quiet stretches: known bursts in synthetic noise at several rates and noise levels, and the real recording."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.errors import DataRefused
from ins_eval.readers.psins_text import read_imu_text
from ins_eval.recording import Imu
from ins_eval.recording.stillness import Stretch, choose_alignment, still_stretches

WINDOW_S = 1.0  # the rule's resolution: ends may lie one window beside the burst
DURATION_S = 900


def parked(rate_hz: float, noise: float, bursts: list[tuple[float, float, float]], seed: int = 0, start_s: float = 0.0):
    """White noise on gravity and Earth rate; each burst is (from, to, standard deviation times the noise)."""
    rng = np.random.default_rng(seed)
    n = round(DURATION_S * rate_hz)
    time_s = np.arange(1, n + 1) / rate_hz
    gain = np.ones(n)
    for start, end, factor in bursts:
        gain[(time_s > start) & (time_s <= end)] = factor
    gyro = 5e-5 / rate_hz + 1e-3 * noise * gain[:, None] * rng.standard_normal((n, 3))
    accelerometer = np.array([0.0, 0.0, -9.8]) / rate_hz + noise * gain[:, None] * rng.standard_normal((n, 3))
    return Imu(start_s + time_s, gyro, accelerometer, "increment")


def assert_stretches(found: list[Stretch], expected: list[tuple[float, float]]):
    ends = np.array([(stretch.start_s, stretch.end_s) for stretch in found]).reshape(-1, 2)
    assert ends.shape == (len(expected), 2), found
    np.testing.assert_allclose(ends, expected, atol=WINDOW_S)


@pytest.mark.parametrize("rate_hz", [10.0, 50.0, 100.0, 400.0])
@pytest.mark.parametrize("noise", [1e-7, 1e-3])
def test_bursts_split_and_single_steps_do_not(rate_hz, noise):
    bursts = [(0.0, 100.0, 5.0), (200.0, 201.0, 10.0), (300.0, 303.0, 10.0), (400.0, 420.0, 4.0), (600.0, 608.0, 4.0)]
    imu = parked(rate_hz, noise, bursts)
    assert_stretches(still_stretches(imu), [(100.0, 400.0), (420.0, 600.0), (608.0, 900.0)])


def test_short_bursts_in_a_row_are_one_long_burst():
    knocks = [(300.0 + 6.0 * k, 302.0 + 6.0 * k, 8.0) for k in range(4)]
    assert_stretches(still_stretches(parked(100.0, 1e-5, knocks)), [(0.0, 300.0), (320.0, 900.0)])


def test_a_stretch_does_not_begin_or_end_with_a_burst():
    found = still_stretches(parked(100.0, 1e-5, [(0.0, 2.0, 8.0), (898.0, 900.0, 8.0)]))
    assert len(found) == 1
    np.testing.assert_allclose((found[0].start_s, found[0].end_s), (2.0, 898.0), atol=1e-9)


def test_either_sensor_alone_shows_the_disturbance():
    calm, noisy = parked(100.0, 1e-5, []), parked(100.0, 1e-5, [(400.0, 500.0, 5.0)], seed=1)
    for gyro, accelerometer in ((noisy.gyro, calm.accelerometer), (calm.gyro, noisy.accelerometer)):
        assert_stretches(still_stretches(Imu(calm.time_s, gyro, accelerometer, "increment")), [(0, 400), (500, 900)])


def test_undisturbed_noise_is_one_stretch_whatever_the_seed():
    for seed in range(20):
        assert_stretches(still_stretches(parked(50.0, 1e-5, [], seed)), [(0.0, 900.0)])


def test_times_are_those_of_the_recording():
    imu = parked(100.0, 1e-5, [(400.0, 500.0, 5.0)], start_s=1e5)
    assert_stretches(still_stretches(imu), [(1e5, 1e5 + 400.0), (1e5 + 500.0, 1e5 + 900.0)])


def test_coarse_counts_and_ideal_constants_are_quiet():
    """A resolution that hides the noise leaves windows without any variation beside windows with one count."""
    imu = parked(100.0, 1e-5, [])
    coarse = Imu(imu.time_s, 1e-7 * np.round(imu.gyro / 1e-7), 4e-5 * np.round(imu.accelerometer / 4e-5), "increment")
    assert_stretches(still_stretches(coarse), [(0.0, 900.0)])
    constant = Imu(imu.time_s, 0 * imu.gyro + 5e-7 / 3, 0 * imu.accelerometer - 0.098 / 3, "increment")
    assert_stretches(still_stretches(constant), [(0.0, 900.0)])
    pulses = np.diff(np.floor(np.outer(np.arange(len(imu.time_s) + 1), [0.3, 0.001, -3203.4])), axis=0)
    assert_stretches(still_stretches(Imu(imu.time_s, constant.gyro, pulses, "pulse")), [(0.0, 900.0)])


def test_minimum_length():
    imu = parked(100.0, 1e-5, [(150.0, 160.0, 5.0)])
    assert_stretches(still_stretches(imu, minimum_s=200.0), [(160.0, 900.0)])
    assert still_stretches(imu, minimum_s=1000.0) == []
    few = Imu(imu.time_s[:5], imu.gyro[:5], imu.accelerometer[:5], "increment")
    assert still_stretches(few, minimum_s=0.0) == []


@pytest.mark.parametrize(
    ("stretches", "chosen"),
    [
        ([(0, 130), (200, 520), (600, 1000)], (200, 520)),  # the first that is long enough, not the longest
        ([(0, 130), (200, 400), (600, 750)], (200, 400)),  # none is long enough: the longest
        ([(50, 1800)], (50, 650)),  # no more than is needed
    ],
)
def test_choice(stretches, chosen):
    assert choose_alignment([Stretch(*map(float, stretch)) for stretch in stretches]) == Stretch(*map(float, chosen))


def test_nothing_to_choose_from_is_refused():
    with pytest.raises(DataRefused, match=r"no quiet stretch to align on .*; record longer at rest"):
        choose_alignment([])


@pytest.fixture(scope="module")
def imu(laser_gyro):
    return read_imu_text(laser_gyro).imu


class TestRealRecording:
    """SOURCE.md beside the file documents people and engine in 0-540 s and 1500-1847 s, and latitude and heading."""

    DOCUMENTED_QUIET_S = ((540.0, 900.0), (1020.0, 1500.0))
    DOCUMENTED_DISTURBED_S = ((0.0, 540.0), (1500.0, 1847.0))
    HEADING_DEG = 90.6
    HEADING_TOLERANCE_DEG = 0.5
    LATITUDE_TOLERANCE_DEG = 0.5  # a gyro bias of 0.1 deg/h is 0.4 degrees of latitude

    def test_stretches_lie_in_the_documented_quiet_part(self, imu):
        found = still_stretches(imu)
        for first, last in self.DOCUMENTED_DISTURBED_S:
            assert all(stretch.end_s <= first or stretch.start_s >= last for stretch in found), found
        for first, last in self.DOCUMENTED_QUIET_S:
            inside = sum(max(0.0, min(last, s.end_s) - max(first, s.start_s)) for s in found)
            assert inside > 0.4 * (last - first), found

    def test_mean_gravity_and_earth_rate_of_the_chosen_stretch_give_heading_and_latitude(self, imu):
        chosen = choose_alignment(still_stretches(imu))
        rows = (imu.time_s > chosen.start_s) & (imu.time_s <= chosen.end_s)
        down = -imu.accelerometer[rows].sum(axis=0)
        down /= np.linalg.norm(down)
        rate = imu.gyro[rows].sum(axis=0)
        east = np.cross(down, rate)
        north = np.cross(east / np.linalg.norm(east), down)
        heading = np.degrees(np.arctan2(east[0] / np.linalg.norm(east), north[0]))
        latitude = np.degrees(np.arcsin(-down @ rate / np.linalg.norm(rate)))
        assert heading == pytest.approx(self.HEADING_DEG, abs=self.HEADING_TOLERANCE_DEG)
        assert latitude == pytest.approx(34.246048, abs=self.LATITUDE_TOLERANCE_DEG)
