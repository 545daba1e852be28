"""The magnet: loops that close, open to twice the amplitude, and do not know time."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.accelerometer import Population, ThermalRun
from ins_eval.accelerometer.magnet_hysteresis import MagnetHysteresis, play
from ins_eval.streams import Streams

AMPLITUDE_PPM = 200.0
TOLERANCE_PPM = 1e-9


@pytest.fixture
def magnet(population: Population) -> MagnetHysteresis:
    return population["magnet_hysteresis"]


def branch(magnet: MagnetHysteresis, run: ThermalRun) -> np.ndarray:
    return magnet.contribution(AMPLITUDE_PPM, run, Streams(0)).scale_ppm


def test_a_full_excursion_opens_the_loop_by_twice_the_amplitude_falling_above(
    magnet: MagnetHysteresis, through
) -> None:
    run = through((70.0, -60.0, 70.0, -60.0), 0.5)
    ppm = branch(magnet, run)
    third = (run.time_s[-1] - run.time_s[0]) / 3.0
    falling = np.interp(0.5 * third + 2 * third, run.time_s, ppm)
    rising = np.interp(1.5 * third, run.time_s, ppm)
    assert falling - rising == pytest.approx(2 * AMPLITUDE_PPM, abs=TOLERANCE_PPM)
    assert falling == pytest.approx(AMPLITUDE_PPM, abs=TOLERANCE_PPM)


def test_the_major_loop_closes(magnet: MagnetHysteresis, through) -> None:
    run = through((22.0, -60.0, 70.0, -60.0, 70.0, -60.0), 0.5)
    cycle_s = 2 * 130.0 / 0.5 * 60.0
    start_s = 82.0 / 0.5 * 60.0
    phase_s = np.linspace(0.0, cycle_s, 500)
    first, second = (np.interp(start_s + k * cycle_s + phase_s, run.time_s, branch(magnet, run)) for k in (0, 1))
    assert second == pytest.approx(first, abs=TOLERANCE_PPM)
    assert np.ptp(first) == pytest.approx(2 * AMPLITUDE_PPM, abs=TOLERANCE_PPM)


def test_a_minor_loop_closes_and_is_forgotten(magnet: MagnetHysteresis, through) -> None:
    with_loop = branch(magnet, through((70.0, 10.0, 25.0, 10.0, -30.0), 0.5, step_s=60.0))
    without = branch(magnet, through((70.0, 10.0, -30.0), 0.5, step_s=60.0))
    detour = int(2 * 15.0 / 0.5)  # points spent on the detour
    at_10_c = int(60.0 / 0.5)
    assert with_loop[at_10_c + detour] == pytest.approx(with_loop[at_10_c], abs=TOLERANCE_PPM)
    assert with_loop[at_10_c + detour :] == pytest.approx(without[at_10_c:], abs=TOLERANCE_PPM)
    assert np.ptp(with_loop[at_10_c : at_10_c + detour]) > 0.5 * AMPLITUDE_PPM


def test_it_does_not_depend_on_the_rate(magnet: MagnetHysteresis, through) -> None:
    turns = (22.0, -60.0, 40.0, 5.0, 70.0)
    slow = branch(magnet, through(turns, 0.1, step_s=60.0))
    fast = branch(magnet, through(turns, 6.0, step_s=1.0))
    assert fast == pytest.approx(slow, abs=1e-6)


def test_a_play_operator_follows_only_when_pushed() -> None:
    temperature_c = np.array([0.0, 2.0, 4.0, 10.0, 8.0, 4.1, 4.0, 0.0, 1.0])
    expected_c = np.array([0.0, 0.0, 1.0, 7.0, 7.0, 7.0, 7.0, 3.0, 3.0])
    assert play(temperature_c, 3.0) == pytest.approx(expected_c)


def test_a_fresh_magnet_is_on_neither_branch(magnet: MagnetHysteresis, through) -> None:
    ppm = branch(magnet, through((22.0, 21.0, 19.0), 0.5))
    assert ppm[0] == 0.0
    at_21_c = 2
    # one degree down: each operator is 1 / h of the way to the falling branch
    assert ppm[at_21_c] == pytest.approx(AMPLITUDE_PPM * np.mean([1 / 3, 1 / 10, 1 / 25]), abs=TOLERANCE_PPM)


def test_amplitudes_are_log_normal(magnet: MagnetHysteresis, rng: np.random.Generator) -> None:
    log_amplitude = np.log([magnet.draw(rng, {}) for _ in range(4000)])
    assert np.exp(np.median(log_amplitude)) == pytest.approx(200.0, rel=0.04)
    assert np.std(log_amplitude) == pytest.approx(0.4, rel=0.05)
