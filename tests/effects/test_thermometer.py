"""What the steps of a thermometer do to a compensated flight, against the same flight with exact readings."""

from dataclasses import replace

import numpy as np

from ins_eval.error_model.null import believe, triad
from ins_eval.estimation.case import prepare
from ins_eval.navigation import compensate, samples
from ins_eval.recording import Recording
from ins_eval.thermal import filtered_rate
from tests.effects.conftest import RATE_HZ, counts

STEP_C = 0.125
OF_READINGS = 0.35  # of the error that the readings as they stand would make
MOST_SIGMA = 4.0  # of a mode
LEFT = 0.5  # of the error of what is told, beside the modes


def drifting(flight: Recording, step_c: float) -> Recording:
    """The flight in a box that drifts through some steps of its thermometer."""
    ideal, time_s = flight.imu, flight.imu.time_s
    true_c = 20.0 + 0.6 * np.sin(2.0 * np.pi * (time_s - time_s[0]) / 5200.0)
    rate = filtered_rate(time_s, true_c)
    was = filtered_rate(time_s, ideal.temperature_c)
    zero = counts(np.zeros(time_s.size), 1.0 / RATE_HZ, ideal.temperature_c, was)
    gain = counts(np.ones(time_s.size), 1.0 / RATE_HZ, ideal.temperature_c, was) - zero
    felt = (ideal.accelerometer - zero[:, None]) / gain[:, None]
    pulses = np.column_stack([counts(one, 1.0 / RATE_HZ, true_c, rate) for one in felt.T])
    noise_c = 0.003 * np.random.default_rng(5).standard_normal(time_s.size // 20 + 1)
    reading = true_c + np.repeat(noise_c, 20)[: time_s.size]
    reading = step_c * np.round(reading / step_c) if step_c else true_c
    return replace(flight, imu=replace(ideal, accelerometer=pulses, temperature_c=reading))


def test_steps_that_last_long_are_no_errors_and_what_they_hide_is_uncertain(flight) -> None:
    exact, coarse = drifting(flight, 0.0), drifting(flight, STEP_C)
    true, told = believe(exact), believe(coarse)
    read = compensate(samples(coarse), triad(told), coarse.interval_s)[-told.time_s.size :]
    interval_s = np.diff(told.time_s, prepend=told.time_s[0] - 1.0 / RATE_HZ)
    error, of_readings = ((one - true.velocity)[:, 2] / interval_s for one in (told.velocity, read))
    assert np.std(error) < OF_READINGS * np.std(of_readings)

    case = prepare(coarse)
    modes = [one for one in case.nuisances if "thermometer" in one.name]
    assert modes and not any("thermometer" in one.name for one in prepare(exact).nuisances)
    shapes = np.column_stack([case.slow.epochs[one.terms[2].slow] for one in modes])
    middle_s = case.model.middle_s
    seen = np.interp(middle_s, told.time_s, error)
    size, *_ = np.linalg.lstsq(shapes, seen, rcond=None)
    assert np.abs(size).max() < MOST_SIGMA
    assert np.std(seen - shapes @ size) < LEFT * np.std(seen)
