"""Each inconsistency of Paper B, computed by the package, against numbers that were worked out apart from it.

The numbers here are stated by hand or follow from closed forms in the test; the digits to which they are stated are
the tolerances.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import residue, step

from ins_eval.studies.paper_b.audit import bridge, electronics, estimation, loop, output, pendulum, wording
from ins_eval.studies.paper_b.printed import PRINTED

DECI, CENTI, MILLI = 0.05, 0.005, 0.0005  # half of the last digit stated
EXACT = 1e-9
J, C, D = 5.5e-8, 1e-4, 1e-3  # an overdamped pendulum of a plausible size
DRIFT_PPM = 200.0


def test_b1_the_partial_fractions_lack_a_factor() -> None:
    a, b = np.abs(pendulum.poles(J, C, D))
    fractions, poles, _ = residue([1.0], [J, C, D])
    slow = fractions[np.argmin(np.abs(poles))].real
    assert 1.0 / (b - a) == pytest.approx(J * slow, rel=EXACT)  # as printed, and as it is
    assert pendulum.steady_state(J, C, D) == pytest.approx(1.0 / D, rel=EXACT)
    assert pendulum.steady_state(J, C, D, printed=True) == pytest.approx(J / D, rel=EXACT)


def test_b1_the_corrected_response_is_that_of_the_pendulum() -> None:
    time_s = np.linspace(0.0, 1.0, 200)
    _, reference = step(([1.0], [J, C, D]), T=time_s)
    assert pendulum.step(J, C, D, time_s) == pytest.approx(reference, rel=1e-6, abs=1e-9 / D)
    assert pendulum.step(J, C, D, time_s, printed=True) == pytest.approx(J * reference, rel=1e-6, abs=1e-9 * J / D)


def test_b2_needs_real_poles() -> None:
    assert pendulum.poles(J, C, D).real == pytest.approx((-10.06, -1808.13), abs=CENTI)
    assert pendulum.divisor(J, C, D) == pytest.approx(1798.07, abs=CENTI)
    critical = 2.0 * np.sqrt(D * J)
    assert pendulum.divisor(J, 0.9 * critical, D) == pytest.approx(0.0, abs=1e-9)


def test_b3_gain_of_the_bridge_at_null() -> None:
    assert bridge.printed_gain_at_null() == 0.0
    c0 = 30e-12
    assert bridge.gain(c0) == pytest.approx(1.0 / (4.0 * c0), rel=EXACT)
    assert bridge.voltage(0.1 * c0, c0, 0.5) == pytest.approx(0.025, rel=EXACT)


def test_b4_references_in_open_and_closed_loop() -> None:
    assert bridge.closed_loop_gain_ppm(DRIFT_PPM) == pytest.approx(0.0, abs=1e-6)
    assert bridge.open_loop_gain_ppm(DRIFT_PPM) == pytest.approx(-100.0, abs=0.02)
    assert bridge.open_loop_gain_ppm(0.0, DRIFT_PPM) == pytest.approx(100.0, abs=0.02)
    assert bridge.open_loop_gain_ppm(DRIFT_PPM, DRIFT_PPM) == pytest.approx(0.0, abs=1e-6)
    null = bridge.null_shift_ppm(DRIFT_PPM)
    assert null == pytest.approx(200.0, abs=0.05)
    assert bridge.voltage(1e-6 * null, 1.0, bridge.reference_ratio(DRIFT_PPM)) == pytest.approx(0.0, abs=1e-15)


def test_b5_what_is_not_in_the_scan() -> None:
    assert sorted(bridge.not_in_the_scan()) == ["1/D", "M_in", "k1"]


def test_b6_symbols_and_the_centred_least_squares() -> None:
    assert wording.symbols() == {"equivalent_gain": ["k_pre-eg", "k_pre-eq"], "pendulosity": ["K0", "k0"]}
    rng = np.random.default_rng(3)
    steps = np.arange(21.0)
    counts = 478.9 * (800.0 + steps) + rng.normal(size=21)
    reference = np.polyfit(steps, counts, 1)[0]
    for subtracted in (counts[0], 0.999 * counts[0], 0.0):
        assert wording.slope(steps, counts, subtracted) == pytest.approx(reference, rel=EXACT)


def test_b7_references_to_tables() -> None:
    assert wording.wrong_references() == {"TABLE 2": "TABLE 3", "TABLE 3": "TABLE 4"}


@pytest.mark.parametrize("table", ["table3", "table4"])
def test_b8_rows_follow_from_their_gains(table: str) -> None:
    rows, found = PRINTED[table], estimation.of(table)
    assert np.abs(found.drift_ppm - rows["drift_ppm"]).max() < 0.01 < found.rounding_ppm
    assert np.abs(found.residual_percent - rows["residual_percent"]).max() < 0.01
    for column in ("before", "after"):
        assert np.mean(rows[column]) == pytest.approx(rows["mean"][column], abs=CENTI)
    assert found.drift_ppm.mean() == pytest.approx(rows["mean"]["drift_ppm"], abs=0.01)


def test_b8_mean_residuals() -> None:
    assert estimation.mean_residual_percent("table3") == pytest.approx((9.738, 9.735, 9.738), abs=MILLI)
    # of the printed rows 9.07, of the gains 9.08 as printed
    assert estimation.mean_residual_percent("table4") == pytest.approx((9.073, 9.075, 9.076), abs=MILLI)


def test_b9_sign_of_table_4() -> None:
    assert estimation.expected_by_26_ppm() == pytest.approx(-200.0 / 1.0002, rel=EXACT)
    assert estimation.tabled_change_ppm() == pytest.approx(218.15, abs=CENTI)
    assert all(abs(a) > abs(b) for a, b in zip(PRINTED["table4"]["after"], PRINTED["table4"]["before"], strict=True))


def test_b10_the_residuals_are_a_shift() -> None:
    forward, feedback = estimation.shift("table3"), estimation.shift("table4")
    assert (forward.mean_ppm, forward.error_ppm, forward.sigmas) == pytest.approx((19.5, 1.6, 12.2), abs=DECI)
    assert (feedback.mean_ppm, feedback.error_ppm) == pytest.approx((18.15, 1.98), abs=CENTI)
    assert feedback.sigmas == pytest.approx(9.2, abs=DECI)
    assert (forward.scatter_ppm, feedback.scatter_ppm) == pytest.approx((3.9, 4.85), abs=DECI)
    assert (forward.before_scatter_ppm, forward.after_scatter_ppm) == pytest.approx((6.6, 6.9), abs=DECI)
    assert (feedback.before_scatter_ppm, feedback.after_scatter_ppm) == pytest.approx((5.9, 8.9), abs=DECI)
    assert (forward.correlation, feedback.correlation) == pytest.approx((0.83, 0.865), abs=CENTI)
    assert all((estimation.of(table).shift_ppm > 0.0).all() for table in ("table3", "table4"))
    assert estimation.would_read_percent("table3", 1000.0) == pytest.approx(98.05, abs=CENTI)
    assert estimation.would_read_percent("table4", 1000.0) == pytest.approx(98.18, abs=CENTI)
    # as a share it would have to be below 100 in both
    assert estimation.found_share_percent("table3") == pytest.approx(90.26, abs=CENTI)
    assert estimation.found_share_percent("table4") == pytest.approx(109.08, abs=CENTI)


def test_b11_error_of_the_estimates() -> None:
    assert estimation.over_claimed_error() == pytest.approx([1.95, 1.82], abs=CENTI)


def test_b12_equation_31() -> None:
    assert output.residual_percent() == pytest.approx((804.17, 12.435), abs=CENTI)
    assert PRINTED["output"]["residual_percent"] + PRINTED["output"]["restrained_percent"] == pytest.approx(100.0)


def test_b13_24_ug_against_the_stability_and_the_estimate() -> None:
    assert output.feedback_residual_ug() == pytest.approx(18.15, abs=CENTI)
    assert PRINTED["output"]["compensated_ug"] < PRINTED["static"]["bias_stability_ug"] == 50.0


def test_b14_missing_7_ppm() -> None:
    assert output.expected_change_ug() == pytest.approx(199.96, abs=CENTI)
    assert output.missing_ppm() == pytest.approx(-6.96, abs=CENTI)


@pytest.mark.parametrize("gain", [1e2, 1e6])
def test_b15_the_current_test_does_not_see_the_magnet(gain: float) -> None:
    magnet = loop.seen_ppm(gain, k_t=DRIFT_PPM)
    # N_on - N_off = -g/(1 + g) I_ref/(k_VI k_DA): k_t enters through 1/(1 + g) only
    assert magnet.on_less_off == pytest.approx(DRIFT_PPM / (1.0 + gain), rel=1e-3)
    assert magnet.off == pytest.approx(-DRIFT_PPM * gain / (1.0 + gain), rel=1e-3)
    assert loop.not_seen() == ["L_c&F", "B"]


def test_b16_the_output_does_not_see_the_forward_gain() -> None:
    forward = loop.seen_ppm(1e6, k_pre=-DRIFT_PPM)
    assert forward.off == pytest.approx(-DRIFT_PPM / 1e6, rel=1e-3)
    assert forward.on_less_off == pytest.approx(-DRIFT_PPM / 1e6, rel=1e-3)
    assert loop.seen_ppm(1e6, k_vi_da=DRIFT_PPM).off == pytest.approx(-199.96, abs=CENTI)


def test_b17_steps_of_da0() -> None:
    assert [electronics.step_ppm(bits) for bits in (16, 18, 20)] == pytest.approx([30.5, 7.6, 1.9], abs=DECI)
    assert electronics.bits_for(2.0) == 20


def test_b18_table_2_is_that_of_paper_a() -> None:
    assert wording.same_as_paper_a()
    assert list(PRINTED["static"].values()) == [50.0, 50.0, 30.0, 30.0]


def test_b19_two_shares() -> None:
    assert wording.shares() == pytest.approx({"forward": 90.26, "feedback": 90.92})
    assert PRINTED["abstract"]["estimated_percent"] == 90.26


def test_b20_the_room_suffices() -> None:
    low, high = estimation.room_ppm()
    assert (low, high) == (15.0, 30.0)
    assert low < estimation.shift("table4").mean_ppm < estimation.shift("table3").mean_ppm < high


def test_b21_closure() -> None:
    left, open_ug = output.closure_ug()
    assert (left, open_ug) == pytest.approx((25.15, -1.15), abs=CENTI)
    assert abs(open_ug) < estimation.shift("table4").error_ppm
    assert output.magnet_and_current_ppm() == pytest.approx(-25.15, abs=CENTI)


def test_b22_a_resistor_is_not_the_gain() -> None:
    found = [electronics.amplifier_ppm(gain, -DRIFT_PPM) for gain in (2.0, 5.0, 10.0, 50.0)]
    assert found == pytest.approx([-100.0, -160.0, -180.0, -196.0], abs=EXACT)
    for gain, ppm in ((2.0, found[0]), (10.0, found[2])):  # G = 1 + Rf/Rg with the resistor itself
        changed = 1.0 + (gain - 1.0) * (1.0 - 1e-6 * DRIFT_PPM)
        assert 1e6 * (changed / gain - 1.0) == pytest.approx(ppm, rel=1e-6)
    assert electronics.gain_that_explains(-180.53, -200.0) == pytest.approx(10.27, abs=CENTI)


def test_approximations() -> None:
    assert electronics.inverse_error_ppm(DRIFT_PPM) == pytest.approx(-0.04, rel=1e-6)
    assert electronics.product_error_ppm([100.0, 100.0]) == pytest.approx(0.01, rel=1e-3)
    assert electronics.product_error_ppm([DRIFT_PPM]) == pytest.approx(0.0, abs=1e-9)
