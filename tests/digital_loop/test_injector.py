"""A resistor is not the gain: the mapping of a non-inverting amplifier, and what the tests then find."""

import pytest

from ins_eval.calibration.loop_gains import forward_drift_ppm, scan_gain
from ins_eval.digital_loop import load
from ins_eval.digital_loop.injector import Injection, non_inverting_ppm
from ins_eval.digital_loop.sampled import scan
from ins_eval.streams import Streams


@pytest.mark.parametrize(("gain", "ppm"), [(2, -100.0), (5, -160.0), (10, -180.0), (50, -196.0)])
def test_non_inverting_amplifier(gain, ppm):
    assert non_inverting_ppm(-200.0, gain) == pytest.approx(ppm)
    feedback, ground = (gain - 1.0) * 1e3, 1e3
    changed = 1.0 + feedback * (1.0 - 200e-6) / ground
    assert 1e6 * (changed / gain - 1.0) == pytest.approx(ppm)


def test_directly_the_gains_change_by_what_is_put_in():
    loop = load()
    drifted = Injection(-200.0, 200.0)(loop)
    assert drifted.forward_gain / loop.forward_gain == pytest.approx(1.0 - 200e-6, rel=1e-12)
    assert drifted.amperes_per_count / loop.amperes_per_count == pytest.approx(1.0 + 200e-6, rel=1e-12)


def test_through_resistors_the_scan_finds_less_than_the_resistor():
    loop = load()
    drifted = Injection(-200.0, 200.0, "resistor")(loop)
    slopes = [scan_gain(*scan(one, Streams(1).rng())).value for one in (loop, drifted)]
    assert forward_drift_ppm(*slopes) == pytest.approx(-180.0, abs=0.3)  # G = 10
    assert drifted.amperes_per_count / loop.amperes_per_count == pytest.approx(1.0 / (1.0 - 200e-6), rel=1e-12)
