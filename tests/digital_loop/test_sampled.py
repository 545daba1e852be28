"""The sampled loop against the balance of torques: what each drift does to each test."""

import numpy as np
import pytest

from ins_eval.calibration.loop_gains import feedback_drift_ppm, forward_drift_ppm, scan_gain
from ins_eval.digital_loop import load
from ins_eval.digital_loop.kernel import demodulated
from ins_eval.digital_loop.sampled import closed_loop, scan
from ins_eval.digital_loop.stability import step_response
from ins_eval.streams import Streams

STANDARD_GRAVITY = 9.80665
SETTLING = 4000  # periods: 0.2 s
LONG_S = 60.0
STEADY_TOLERANCE_UG = 0.01  # what the noise of the loop leaves after a minute
SCAN_TOLERANCE_PPM = 1.0
FEEDBACK_TOLERANCE_PPM = 0.1
MAGNET_TOLERANCE_PPM = 0.01


@pytest.fixture(scope="module")
def loop():
    return load()


def mean_output(loop, seconds=LONG_S, force_g=1.0, on=0.0, seed=1):
    """Mean counts of the working loop, from the plate on its stop."""
    count = SETTLING + round(seconds * 20e3)
    counts = closed_loop(loop, np.full(count, force_g), np.full(count, on), Streams(seed).rng())
    return counts[SETTLING:].mean()


def balanced(loop, force_g, on):
    """Counts from the balance of torques, written out from the nominal values of the file."""
    p = loop.parameters
    k0 = p.pendulum.mass.value * p.pendulum.arm.value
    kt = p.torquer.induction.value * p.torquer.coil_length.value * p.torquer.arm.value
    lsb = 2.5 / 2**19 / p.feedback.resistor.value
    return (k0 * STANDARD_GRAVITY * force_g / kt - on * p.current_source.current.value) / lsb


@pytest.mark.parametrize(("force_g", "on"), [(1.0, 0.0), (-1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (8.0, 0.0)])
def test_mean_of_the_sampled_loop_is_the_balance_of_torques(loop, force_g, on):
    assert loop.steady_counts(force_g, bool(on)) == pytest.approx(balanced(loop, force_g, on), abs=1e-6)
    error_ug = (mean_output(loop, force_g=force_g, on=on) - balanced(loop, force_g, on)) / 0.0251658
    assert abs(error_ug) < STEADY_TOLERANCE_UG


def test_unequal_reference_capacitors_make_a_bias_and_no_gain(loop):
    """The bridge balances at u = 2 null - 1 = 1e-4, where the hinge pulls with D u d / l."""
    unequal = loop.with_drift("reference_capacitor_1", 200.0)
    u = 2.0 * (1.0002 / 2.0002) - 1.0
    bias_ug = -1e6 * 1e-3 * u * 2.5e-3 / (5.6e-6 * STANDARD_GRAVITY)
    for force_g in (1.0, -1.0):
        change_ug = (mean_output(unequal, force_g=force_g) - mean_output(loop, force_g=force_g)) / 0.0251658
        assert change_ug == pytest.approx(bias_ug, abs=2.0 * STEADY_TOLERANCE_UG)
    scans = [scan_gain(*scan(one, Streams(3).rng())).value for one in (loop, unequal)]
    assert forward_drift_ppm(*scans) == pytest.approx(-1e6 * u, abs=0.2)  # open loop: half of it, and of the gain


def test_forward_drift_is_found_by_the_scan_and_not_in_the_output(loop):
    drifted = loop.with_drift("bridge_amplifier", -200.0)
    for seed in range(3):
        slopes = [
            np.mean([scan_gain(*scan(one, Streams(seed).at(state, i).rng())).value for i in range(6)])
            for state, one in enumerate((loop, drifted))
        ]
        assert forward_drift_ppm(*slopes) == pytest.approx(-200.0, abs=SCAN_TOLERANCE_PPM)
        change = mean_output(drifted, seed=seed + 10) - mean_output(loop, seed=seed + 20)
        assert abs(change / 0.0251658) < STEADY_TOLERANCE_UG


def test_feedback_drift_is_found_by_the_current_and_in_the_output(loop):
    drifted = loop.with_drift("dac_reference", 200.0)
    steps = [mean_output(one, 10.0, on=1.0) - mean_output(one, 10.0, on=0.0) for one in (loop, drifted)]
    assert steps[0] == pytest.approx(-71738.85, abs=0.01)  # Paper B, Table 4
    assert feedback_drift_ppm(*steps) == pytest.approx(200.0, abs=FEEDBACK_TOLERANCE_PPM)
    change_ug = (mean_output(drifted) - mean_output(loop)) / 0.0251658
    assert change_ug == pytest.approx(1e6 * (1.0 / 1.0002 - 1.0), abs=STEADY_TOLERANCE_UG)


def test_drift_of_the_magnet_changes_the_output_and_no_test(loop):
    drifted = loop.with_drift("magnet", 200.0)
    steps = [mean_output(one, on=1.0) - mean_output(one, on=0.0) for one in (loop, drifted)]
    assert abs(feedback_drift_ppm(*steps)) < MAGNET_TOLERANCE_PPM
    change_ug = (mean_output(drifted) - mean_output(loop)) / 0.0251658
    assert change_ug == pytest.approx(-199.96, abs=2.0 * STEADY_TOLERANCE_UG)


def test_scan_starts_on_the_printed_slope(loop):
    slopes = [scan_gain(*scan(loop, Streams(5).at(i).rng())).value for i in range(12)]
    assert np.mean(slopes) == pytest.approx(478.9739, abs=3e-4)  # Paper B, Table 3; 0.6 ppm
    assert np.std(slopes) / np.mean(slopes) < 0.7e-6


@pytest.mark.parametrize("derivative_s", [0.0, 1e-4])
def test_step_of_the_sampled_loop_is_the_linear_one(tmp_path, derivative_s):
    """In working state the loop is linear but for rounding and noise, which the mean of many steps takes out."""
    path = tmp_path / "pid.toml"
    quantity = f'{{ value = {derivative_s}, unit = "s", source = "test" }}'
    path.write_text(f'extends = "digital-qfa"\n[controller]\nderivative = {quantity}\n')
    loop, count, runs = load(path), 400, 300
    force = np.concatenate([np.zeros(SETTLING), np.full(count, 1.0)])
    steps = np.array(
        [closed_loop(loop, force, np.zeros(force.size), Streams(7).at(i).rng())[SETTLING:] for i in range(runs)]
    )
    error = steps.mean(axis=0) / loop.counts_per_g - step_response(loop, duration_s=count * loop.period_s)
    sigma = steps.std(axis=0) / loop.counts_per_g / np.sqrt(runs)
    assert sigma.max() < 1e-3
    assert np.abs(error / sigma).max() < 5.0


def test_pendulum_is_caught_from_either_stop(loop):
    counts = closed_loop(loop, np.full(SETTLING, -6.0), np.zeros(SETTLING), Streams(2).rng())
    assert counts[-500:].mean() == pytest.approx(balanced(loop, -6.0, 0.0), abs=1.0)


def test_demodulation_takes_the_amplitude_and_clips():
    reference = np.sin(2.0 * np.pi * np.arange(16) / 16.0)
    rng = np.random.default_rng(1)
    assert demodulated(1000.0 * reference, reference, 1.5, 2.0**15, 4000, rng) / 4000 / 8.0 == pytest.approx(
        1000.0, abs=5.0 * 1.55 / np.sqrt(4000 * 8.0)
    )
    clipped = demodulated(1e6 * reference, reference, 0.0, 100.0, 1, rng)
    assert clipped <= 100.0 * np.abs(reference).sum()


def test_compensation_restores_what_the_tests_see(loop):
    drifted = loop.with_drift("carrier_amplifier", -300.0).with_drift("sampling_resistor", -200.0)
    repaired = drifted.with_compensation(1.0 / (1.0 - 3e-4), round(524288 * (1.0 - 2e-4)))
    slopes = [scan_gain(*scan(one, Streams(4).rng())).value for one in (loop, repaired)]
    assert abs(forward_drift_ppm(*slopes)) < SCAN_TOLERANCE_PPM
    assert repaired.counts_per_g / loop.counts_per_g == pytest.approx(1.0, abs=1e-6)  # one step of DA0 is 1.9 ppm


def test_coarse_dac0_leaves_its_rounding():
    """At mid-scale a 16-bit DA0 steps by 30 ppm, one of 20 bits by 1.9 ppm."""
    for bits, step_ppm in ((16, 30.5), (20, 1.9)):
        code = 2 ** (bits - 1)
        assert 1e6 / code == pytest.approx(step_ppm, rel=0.01)
        assert abs(round(code / 1.000215) * 1.000215 / code - 1.0) <= 0.5001 / code * 1.000215
