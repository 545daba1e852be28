"""The estimators of the loop's gains against closed forms, printed tables and counts of how often intervals hold."""

import numpy as np
import pytest
from scipy.stats import ttest_ind

from ins_eval.calibration import loop_gains
from ins_eval.calibration.loop_gains import Gain

N_FPGA = 800.0 + 120.0 * np.arange(21)
TRIALS = 2000
COVERAGE = (0.935, 0.965)  # 0.95 and three standard deviations of a binomial share of 2000

# Paper B, Tables 3 and 4
K_PRE = np.array(
    [
        [478.9735, 478.9761, 478.9697, 478.9771, 478.9706, 478.9764],
        [478.8887, 478.8861, 478.8828, 478.8909, 478.8851, 478.8910],
    ]
)
TABLE_3 = np.array([-177.04, -187.90, -181.43, -179.96, -178.50, -178.29])
STEPS = np.array(
    [
        [-71738.78, -71738.14, -71739.28, -71739.21, -71739.03, -71738.67],
        [-71754.78, -71753.42, -71754.92, -71754.63, -71755.17, -71754.09],
    ]
)
TABLE_4 = np.array([223.03, 212.99, 218.01, 214.94, 224.98, 214.94])
PRINTED_DIGITS_PPM = 0.16  # half a unit of the last digit of k_pre is 0.1 ppm, twice


def test_slope_is_that_of_equation_19_and_blind_to_an_offset():
    n_out = 1234.5 + 478.974 * N_FPGA + 3.0 * np.sin(N_FPGA)
    x, n = N_FPGA, N_FPGA.size
    expected = (np.sum(n_out * x) - n * n_out.mean() * x.mean()) / (np.sum(x**2) - n * x.mean() ** 2)
    assert loop_gains.scan_gain(x, n_out).value == pytest.approx(expected, rel=1e-12)
    assert loop_gains.scan_gain(x, 478.974 * x).value == pytest.approx(478.974, rel=1e-13)


def test_interval_of_a_slope_holds_in_95_percent():
    rng, held = np.random.default_rng(1), 0
    for _ in range(TRIALS):
        found = loop_gains.scan_gain(N_FPGA[::4], 5.0 * N_FPGA[::4] + rng.standard_normal(6))
        held += found.low < 5.0 < found.high
    assert COVERAGE[0] < held / TRIALS < COVERAGE[1]


@pytest.mark.parametrize("repetitions", [1, 4])
def test_interval_of_a_forward_drift_holds_in_95_percent(repetitions):
    """What the carrier's DAC rounds is in both scans and makes the interval no wider."""
    rng, held, width = np.random.default_rng(2), 0, []
    rounding = 30.0 * np.sin(7.0 * N_FPGA)
    for _ in range(TRIALS):
        noise = 0.5 * rng.standard_normal((2, repetitions, N_FPGA.size))
        reference = 479.0 * N_FPGA + rounding + noise[0]
        test = (1.0 - 2e-4) * (479.0 * N_FPGA + rounding) + noise[1]
        found = loop_gains.forward_drift(N_FPGA, reference, test)
        held += found.low < -200.0 < found.high
        width.append(found.high - found.low)
    assert COVERAGE[0] < held / TRIALS < COVERAGE[1]
    sigma_ppm = 1e6 * 0.5 * np.sqrt(2.0) / 479.0 / np.sqrt(np.sum((N_FPGA - N_FPGA.mean()) ** 2))
    assert np.median(width) < 8.0 * sigma_ppm


@pytest.mark.parametrize("repetitions", [1, 5])
def test_interval_of_a_feedback_drift_holds_in_95_percent(repetitions):
    rng, held = np.random.default_rng(3), 0
    for _ in range(TRIALS):
        states = []
        for level in (-71738.85, -71738.85 / 1.0002):
            on, off = rng.standard_normal((2, repetitions, 30))
            pairs = zip(25166.0 + level + on, 25166.0 + off, strict=True)
            states.append([loop_gains.current_step(*pair) for pair in pairs])
        found = loop_gains.feedback_drift(*states)
        held += found.low < 200.0 < found.high
    assert COVERAGE[0] < held / TRIALS < COVERAGE[1]


def test_printed_drifts_of_table_3():
    found = loop_gains.forward_drift_ppm(*K_PRE)
    np.testing.assert_allclose(found, TABLE_3, atol=PRINTED_DIGITS_PPM + 0.05)
    mean = loop_gains.over_repetitions(found)
    assert mean.value == pytest.approx(-180.53, abs=0.02)
    assert mean.low < -180.5 < mean.high < -170.0  # far from -200: the residual is systematic


def test_printed_drifts_of_table_4_have_the_other_sign():
    """|dN| rises by 218 ppm, so by eq. (26) k_VI k_DA has fallen, although +200 ppm were put in."""
    found = loop_gains.feedback_drift_ppm(*STEPS)
    np.testing.assert_allclose(found, -TABLE_4, atol=0.1)
    np.testing.assert_allclose(1e6 * (STEPS[1] / STEPS[0] - 1.0), TABLE_4, atol=0.03)


def test_step_is_the_difference_of_means_with_its_deviation():
    on, off = np.array([-3.0, -1.0]), np.array([10.0, 14.0, 12.0])
    found = loop_gains.current_step(on, off)
    assert found.value == pytest.approx(-14.0)
    assert found.sigma == pytest.approx(np.sqrt(2.0 / 2 + 4.0 / 3))
    assert found.low < found.value < found.high


def test_welchs_interval_is_that_of_another_library():
    rng = np.random.default_rng(4)
    on, off = rng.standard_normal(7), 3.0 * rng.standard_normal(12)
    expected = ttest_ind(on, off, equal_var=False).confidence_interval(0.95)
    found = loop_gains.current_step(on, off)
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high), rel=1e-9)


def test_one_reading_each_gives_a_step_without_an_interval():
    found = loop_gains.current_step(np.array([-3.0]), np.array([10.0]))
    assert found.value == -13.0
    assert np.isnan(found.sigma)
    assert np.isnan(loop_gains.feedback_drift([found], [found]).low)


def test_students_interval_of_repetitions():
    found = loop_gains.over_repetitions(np.array([1.0, 2.0, 3.0, 4.0]))
    assert found.value == 2.5
    assert (found.high - found.low) / 2.0 == pytest.approx(3.18245 * np.std([1, 2, 3, 4], ddof=1) / 2.0, rel=1e-5)


def test_compensation_is_the_inverse_of_the_drift():
    assert loop_gains.controller_gain(-200.0) * (1.0 - 2e-4) == pytest.approx(1.0, rel=1e-15)
    code = loop_gains.reference_code(524288, np.array([200.0, -200.0, 0.0]))
    assert code.tolist() == [524183, 524393, 524288]
    assert np.all(np.abs(code * (1.0 + 1e-6 * np.array([200.0, -200.0, 0.0])) / 524288 - 1.0) < 0.96e-6)


def test_rounding_of_the_code():
    assert loop_gains.rounding_ppm(524288) == pytest.approx(0.954, abs=0.001)  # 20 bits at mid-scale
    assert loop_gains.rounding_ppm(32768) == pytest.approx(15.26, abs=0.01)  # 16 bits


def test_a_negative_slope_keeps_the_sign_of_its_drift():
    reference, test = -3.0 * N_FPGA[None], -3.0 * 1.0001 * N_FPGA[None]
    found = loop_gains.forward_drift(N_FPGA, reference, test)
    assert isinstance(found, Gain)
    assert found.value == pytest.approx(100.0, rel=1e-6)
    assert found.low <= found.value <= found.high
