"""The printed four-point equations on outputs E = K1 (K0 + a) with either labels, against the algebra."""

import pytest

from ins_eval.calibration.labelings import FIGURE_4, TURNED, labelings, printed_equations

K1, K0 = 320320.0, 300e-6
ROUND_OFF = 1e-9


def output(force_g):
    return K1 * (K0 + force_g)


@pytest.mark.parametrize(
    ("force_g", "expected"),
    [
        # 0, 90, 180, 270 degrees see +1, 0, -1, 0 g, as printed with Fig. 4: only the sum of eq. (14) comes out
        (FIGURE_4, (-K1 / 2, K0 - 0.5, 0.0, K0)),
        # 0, +1, 0, -1 g: now (13) and (14) are right and (3), (4) are not
        (TURNED, (K1 / 2, K0 - 0.5, K1, K0)),
    ],
)
def test_printed_labels_contradict_the_printed_equations(force_g, expected):
    found = printed_equations([output(force) for force in force_g], K1)
    assert found == pytest.approx(expected, rel=ROUND_OFF, abs=ROUND_OFF)


def test_readings_by_specific_force_go_through_both_labelings():
    found = labelings(output(1.0), output(-1.0), (output(0.0), output(0.0)))
    assert found["Fig. 4"] == pytest.approx((-K1 / 2, K0 - 0.5, 0.0, K0), rel=ROUND_OFF, abs=ROUND_OFF)
    assert found["turned"] == pytest.approx((K1 / 2, K0 - 0.5, K1, K0), rel=ROUND_OFF, abs=ROUND_OFF)


def test_only_the_pair_at_0_g_keeps_the_quadratic_coefficient_out_of_the_bias():
    """K2 = 100 ug/g^2 adds its 100 ug to eq. (14) where its pair stands at +1 and -1 g, and nothing at 0 g."""
    k2 = 100e-6
    plus, minus = (K1 * (K0 + force + k2) for force in (1.0, -1.0))
    found = labelings(plus, minus, (output(0.0), output(0.0)))
    assert found["Fig. 4"].eq14_bias == pytest.approx(K0 + k2, rel=ROUND_OFF)
    assert found["turned"].eq14_bias == pytest.approx(K0, rel=ROUND_OFF)
