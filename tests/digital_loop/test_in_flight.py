"""The sampled loop in flight against its transfer function, a ramp, and the closed form of its delay."""

import numpy as np
import pytest

from ins_eval.digital_loop import in_flight, load, stability
from ins_eval.profile import load as load_profile
from ins_eval.streams import Streams
from ins_eval.trajectory import Trajectory

UG = 9.80665e-6


class Ramp:
    """A specific force that grows steadily on one axis."""

    def __init__(self, slope: float, start: float = 0.0):
        self.slope, self.start = slope, start

    def specific_force(self, time_s):
        return np.column_stack([self.start + self.slope * np.asarray(time_s), 0.0 * time_s, 0.0 * time_s])


@pytest.fixture(scope="module")
def loop():
    return load()


def test_delay_is_that_of_the_phase_at_low_frequency(loop):
    frequency = 0.05
    phase = np.angle(stability.closed_loop(loop).at(frequency, loop.period_s))
    assert in_flight.delay_s(loop) == pytest.approx(-phase / (2.0 * np.pi * frequency), rel=1e-3)


def test_delay_is_one_over_the_velocity_constant_less_a_period(loop):
    """An integrator of rate p i in front of the static gain G of the rest: tau = 1 / (p i G) - T."""
    static = loop.torque_per_ampere * loop.amperes_per_count * loop.forward_gain
    assert in_flight.delay_s(loop) == pytest.approx(1.0 / (0.2442 * 125.7 * static) - 5e-5, rel=1e-3)


def test_a_ramp_is_late_by_the_delay(loop):
    found = in_flight.flown(loop, Ramp(2.0), 0, 1.0, 2.0, 0.01, Streams(1))
    assert found.slope == pytest.approx(np.full(200, 2.0))
    assert found.force[0] == pytest.approx(2.0 * 1.005)
    assert found.time_s[[0, -1]] == pytest.approx([1.01, 3.0])
    assert found.off.mean() == pytest.approx(-2.0 * in_flight.delay_s(loop), abs=0.1 * UG)
    assert found.linear == pytest.approx(np.full(200, -2.0 * in_flight.delay_s(loop)), rel=1e-3)


def test_at_rest_nothing_but_noise_is_left(loop):
    found = in_flight.flown(loop, Ramp(0.0, 9.8), 0, 1.0, 1.0, 0.01, Streams(1))
    assert np.all(found.off == 0.0)
    assert 1.0 * UG < found.noise.std() < 30.0 * UG
    assert abs(found.noise.mean()) < 0.5 * UG


def test_a_flight_is_as_the_transfer_function_says(loop):
    """But for the steps of the converters, which do not add up."""
    trajectory = Trajectory(load_profile("wing-rock"))
    from_s = in_flight.liveliest_s(trajectory, 4.0)
    found = in_flight.flown(loop, trajectory, 1, from_s, 4.0, 0.01, Streams(2))
    assert np.abs(found.linear).max() > 5.0 * UG
    rest = found.off - found.linear
    assert np.sqrt(np.mean(rest**2)) < 4.0 * UG
    assert np.abs(np.cumsum(rest)).max() * 0.01 < 5e-6  # m/s


def test_the_liveliest_stretch_of_the_flight_is_the_reversal():
    trajectory = Trajectory(load_profile("climb-cruise-landing"))
    assert 3944.0 < in_flight.liveliest_s(trajectory, 20.0) < 4103.0
