"""The rejected open-loop excitation: the right gain, and a repeatability that the bias alone spoils."""

import numpy as np
import pytest

from ins_eval.calibration.loop_gains import scan_gain
from ins_eval.digital_loop import load
from ins_eval.digital_loop.excitation import excite
from ins_eval.digital_loop.sampled import scan
from ins_eval.errors import UsageError
from ins_eval.streams import Streams

REPEATS = 20


@pytest.fixture(scope="module")
def loop():
    return load()


def slopes(loop):
    return np.array([scan_gain(*excite(loop, Streams(1).at(i))).value for i in range(REPEATS)])


def test_slope_is_the_whole_gain_of_the_loop(loop):
    """- k_pre k_fb: torque of one count over D, in counts of the demodulator."""
    found = slopes(loop)
    torque_per_count = 0.5 * 11.4410917 * 8e-3 * 2.5 / 2**19 / 100.0
    counts_per_rad = 800 / 8192 * 2.5 * 10.0 * 0.5 / 2.5e-3 * 32768 / 5.0 * 47.897757
    expected = -torque_per_count / 1e-3 * counts_per_rad
    rounded_carrier = 1e-4  # sixteen words of DA1
    assert found.mean() == pytest.approx(expected, rel=rounded_carrier)


def test_it_sees_the_magnet_and_the_hinge_that_the_other_tests_do_not(loop):
    """The same noise in both, so that the change is the drift."""
    before = slopes(loop).mean()
    for part, sign in (("magnet", 1.0), ("bending_stiffness", -1.0), ("plate_spacing", -1.0)):
        change_ppm = 1e6 * (slopes(loop.with_drift(part, 2000.0)).mean() / before - 1.0)
        assert change_ppm == pytest.approx(sign * 2000.0, abs=40.0)


def test_repeatability_is_what_the_bias_makes_of_a_small_excitation(loop):
    """Least squares: sigma = 3 ug / (0.6 x 0.0455 g x sqrt(sum of squares of the 21 steps))."""
    relative = slopes(loop).std(ddof=1) / abs(slopes(loop).mean())
    full_g = 1e-3 * 2.5e-3 / (5.6e-6 * 9.80665)
    expected = 3e-6 / (0.6 * full_g * np.sqrt(np.sum(np.linspace(-1, 1, 21) ** 2)))
    assert relative == pytest.approx(expected, rel=0.6)  # of 20 repeats
    scanned = [scan_gain(*scan(loop, Streams(2).at(i).rng())).value for i in range(REPEATS)]
    assert relative > 20.0 * np.std(scanned) / np.mean(scanned)


def test_a_bias_that_moves_the_plate_to_its_stop_is_refused(tmp_path):
    path = tmp_path / "wild.toml"
    path.write_text('extends = "digital-qfa"\n[bench]\nbias_sigma = { value = 5e4, unit = "ug", source = "test" }\n')
    with pytest.raises(UsageError, match="touches a stop"):
        excite(load(path), Streams(1))
