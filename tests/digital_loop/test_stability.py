"""Margins against the continuous-time loop, whose sampling is a delay of one and a half periods."""

import numpy as np
import pytest
from scipy.optimize import brentq

from ins_eval.digital_loop import load
from ins_eval.digital_loop.stability import margins, step_response
from ins_eval.errors import UsageError

CROSSOVER_TOLERANCE_HZ = 0.05
PHASE_TOLERANCE_DEG = 0.1
GAIN_TOLERANCE_DB = 0.2
NEGLIGIBLE = {"crossover_hz": 0.03, "phase_margin_deg": 0.005, "gain_margin_db": 0.003, "bandwidth_hz": 0.06}


@pytest.fixture(scope="module")
def loop():
    return load()


def continuous(frequency_hz, gain=1.0):
    """The loop from the numbers of the file, written out.

    The hold delays by half a period, the current comes one late, and a sum that has the present value in it is the
    integral and half a period.
    """
    s = 2j * np.pi * frequency_hz
    pendulum = 1.0 / (5.5e-8 * s**2 + 1e-4 * s + 1e-3)
    volts = 800 / 8192 * 2.5 * 10.0 * 0.5 / 2.5e-3
    forward = volts * 32768 / 5.0 * 47.897757
    torque_per_count = 0.5 * 11.4410917 * 8e-3 * 2.5 / 2**19 / 100.0
    return (
        gain
        * forward
        * torque_per_count
        * 0.2442
        * (1.0 + 125.7 * (1.0 / s + 25e-6))
        * pendulum
        * np.exp(-1.5 * 50e-6 * s)
    )


@pytest.mark.parametrize("drift", [0.0, 1.0, -0.2])
def test_margins_are_those_of_the_continuous_loop(loop, drift):
    found = margins(loop, 1e6 * drift)
    crossover = brentq(lambda f: abs(continuous(f, 1.0 + drift)) - 1.0, 20.0, 2000.0)
    assert found.crossover_hz == pytest.approx(crossover, abs=CROSSOVER_TOLERANCE_HZ)
    margin = 180.0 + np.degrees(np.angle(continuous(crossover, 1.0 + drift)))
    assert found.phase_margin_deg == pytest.approx(margin, abs=PHASE_TOLERANCE_DEG)
    reversal = brentq(lambda f: np.angle(-continuous(f, 1.0 + drift)), 200.0, 3000.0)
    gain_db = -20.0 * np.log10(abs(continuous(reversal, 1.0 + drift)))
    assert found.gain_margin_db == pytest.approx(gain_db, abs=GAIN_TOLERANCE_DB)


def test_the_loop_as_it_is_designed(loop):
    found = margins(loop)
    assert found.crossover_hz == pytest.approx(122.0, abs=0.5)
    assert found.phase_margin_deg == pytest.approx(55.0, abs=0.5)
    assert found.gain_margin_db == pytest.approx(24.0, abs=0.5)
    assert found.bandwidth_hz == pytest.approx(208.0, abs=2.0)
    assert found.rise_s == pytest.approx(1.95e-3, abs=0.05e-3)
    assert found.overshoot == pytest.approx(0.18, abs=0.01)
    assert margins(loop, 1e6).phase_margin_deg == pytest.approx(43.0, abs=0.5)
    assert margins(loop, -2e5).phase_margin_deg == pytest.approx(58.0, abs=0.5)


def test_200_ppm_of_forward_drift_do_not_matter_for_stability(loop):
    fresh = margins(loop)._asdict()
    for forward_ppm in (-200.0, 200.0):
        drifted = margins(loop, forward_ppm)._asdict()
        for name, tolerance in NEGLIGIBLE.items():
            assert abs(drifted[name] - fresh[name]) < tolerance


def test_a_drifted_part_is_a_drift_of_the_forward_gain(loop):
    drifted = margins(loop.with_drift("bridge_amplifier", 1e5))
    assert drifted.crossover_hz == pytest.approx(margins(loop, 1e5).crossover_hz, rel=1e-9)
    assert drifted.crossover_hz > margins(loop).crossover_hz + 5.0


def test_step_settles_at_the_specific_force(loop):
    step = step_response(loop, duration_s=0.5)
    assert step[0] < 0.1
    assert step[-1] == pytest.approx(1.0, abs=1e-9)


def test_an_unstable_loop_is_refused(loop):
    with pytest.raises(UsageError, match="unstable"):
        margins(loop, 20e6)
