"""Eq. (1) there and back."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from ins_eval.accelerometer import Population
from ins_eval.errors import DataRefused
from ins_eval.output_equation import Coefficients, force_error_ug, specific_force_g
from ins_eval.streams import Streams

SCALE, BIAS_UG = np.array([320320.0, 308000.0, 328000.0]), np.array([70.0, -1200.0, 400.0])
# far beyond what an accelerometer has: some 1 %/g
LARGE = (
    Coefficients(3000.0, -800.0, 2000.0, -1500.0, 900.0, -700.0),
    Coefficients(-2500.0, 500.0, -900.0, 1800.0, -3000.0, 2500.0),
    Coefficients(1000.0, 300.0, 700.0, -600.0, 500.0, 400.0),
)
EXACT_G = 1e-11


def output(c: Coefficients, force_g: np.ndarray, scale: float, bias_ug: float) -> np.ndarray | float:
    """E of eq. (1); `force_g` (..., 3) along input, pendulous and output axis."""
    return scale * (1e-6 * (bias_ug + force_error_ug(c, force_g)) + force_g[..., 0])


@pytest.fixture
def force_b() -> np.ndarray:
    """Specific force in g along the body axes, (200, 3)."""
    return np.random.default_rng(4).uniform(-5.0, 5.0, (200, 3))


def along_x(c: Coefficients, x: np.ndarray | float, y: np.ndarray | float, z: np.ndarray | float) -> np.ndarray:
    """ai in g (n,) of the accelerometer x with the output `x`, where y and z feel the forces `y` and `z` exactly."""
    outputs = np.column_stack(np.broadcast_arrays(x, SCALE[1] * np.asarray(y), SCALE[2] * np.asarray(z)))
    perfect = Coefficients()
    return specific_force_g((c, perfect, perfect), outputs, SCALE, BIAS_UG * np.array([1.0, 0.0, 0.0]))[:, 0]


def test_by_hand() -> None:
    c = Coefficients(10.0, 20.0, 30.0, 40.0, 50.0, 60.0)
    ai, ap, ao = 2.0, 3.0, -1.0
    extra_ug = 10.0 * 4.0 + 20.0 * 8.0 + 30.0 * 6.0 + 40.0 * -2.0 + 50.0 * 3.0 - 60.0 * -1.0
    assert output(c, np.array([ai, ap, ao]), 1e6, 5.0) == pytest.approx(2e6 + 5.0 + extra_ug, rel=1e-14)
    assert output(Coefficients(), np.array([ai, ap, ao]), 1e6, 5.0) == pytest.approx(2e6 + 5.0, rel=1e-14)


@pytest.mark.parametrize("c", LARGE)
def test_one_axis_back_where_the_other_forces_are_known(c: Coefficients, force_b: np.ndarray) -> None:
    measured = output(c, force_b, SCALE[0], BIAS_UG[0])
    back = along_x(c, measured, force_b[:, 2], force_b[:, 1])  # the pendulous axis of x is z
    assert back == pytest.approx(force_b[:, 0], abs=EXACT_G)
    assert np.abs(measured / SCALE[0] - 1e-6 * BIAS_UG[0] - force_b[:, 0]).max() > 0.05  # there was something to undo


def test_the_inverse_agrees_with_a_bracketing_root_finder() -> None:
    c, ap, ao = LARGE[0], 0.7, -0.3

    def miss(ai: float) -> float:
        cubic = 3000.0 * ai**2 - 800.0 * ai**3 + 2000.0 * ai * ap - 1500.0 * ai * ao + 900.0 * ap + 700.0 * ao
        return 1e-6 * (BIAS_UG[0] + cubic) + ai - 4.0

    expected = brentq(miss, 3.0, 5.0, xtol=1e-14)
    assert along_x(c, 4.0 * SCALE[0], ao, ap) == pytest.approx(expected, abs=1e-12)


def test_three_axes_back_together(force_b: np.ndarray) -> None:
    # input, pendulous, output axis of x, y, z: Paper A leaves them open, `accelerometer` says which
    axes = ([0, 2, 1], [1, 2, 0], [2, 0, 1])
    measured = np.column_stack(
        [output(c, force_b[:, a], SCALE[k], BIAS_UG[k]) for k, (c, a) in enumerate(zip(LARGE, axes, strict=True))]
    )
    assert specific_force_g(LARGE, measured, SCALE, BIAS_UG) == pytest.approx(force_b, abs=EXACT_G)
    # solved axis by axis with the others unknown it would be wrong by the coupling
    alone = along_x(LARGE[0], measured[:, 0], 0.0, 0.0)
    assert np.abs(alone - force_b[:, 0]).max() > 0.01


def test_it_inverts_the_simulated_accelerometers(force_b: np.ndarray) -> None:
    population = Population.load()
    sigmas = {"k3_sigma_ug_per_g3": 50.0, "kip_sigma_ug_per_g2": 40.0, "kio_sigma_ug_per_g2": 30.0}
    sigmas |= {"delta_o_sigma_urad": 400.0, "delta_p_sigma_urad": 300.0}
    population = population.replacing(population["nonlinearity"].model_copy(update=sigmas))
    units = population.draw(Streams(9))
    measured = np.column_stack([u.output(force_b, SCALE[k], BIAS_UG[k]) for k, u in enumerate(units)])
    back = specific_force_g([u.units["nonlinearity"] for u in units], measured, SCALE, BIAS_UG)
    assert back == pytest.approx(force_b, abs=EXACT_G)
    neglected = [Coefficients(k2=u.units["nonlinearity"].k2) for u in units]
    assert np.abs(specific_force_g(neglected, measured, SCALE, BIAS_UG) - force_b).max() > 1e-4


def test_without_the_small_terms_it_is_equation_5() -> None:
    pulse_per_s = np.array([-320000.0, 0.0, 64.0])
    expected = pulse_per_s / SCALE[0] - 1e-6 * BIAS_UG[0]
    assert along_x(Coefficients(), pulse_per_s, 0.0, 0.0) == pytest.approx(expected, rel=1e-15)


def test_one_sample_and_slow_errors_of_each_sample(force_b: np.ndarray) -> None:
    one = specific_force_g((Coefficients(),) * 3, np.array([320320.0, 308000.0, 328000.0]), SCALE, 0.0)
    assert one == pytest.approx(np.ones((1, 3)))
    scale = SCALE + np.linspace(-300.0, 300.0, 200)[:, None]
    assert specific_force_g((Coefficients(),) * 3, scale * force_b, scale, np.zeros((200, 3))) == pytest.approx(force_b)


@pytest.mark.filterwarnings("ignore:divide by zero", "ignore:invalid value", "ignore:overflow")
def test_what_no_force_can_give_is_refused() -> None:
    # a + 0.1 a^2 is nowhere below -2.5
    with pytest.raises(DataRefused, match=r"^eq\. \(1\): no specific force found [^\n]+units[^\n]+$"):
        specific_force_g((Coefficients(k2=1e5), Coefficients(), Coefficients()), -4.0 * SCALE, SCALE, 0.0)
    with pytest.raises(DataRefused, match=r"^eq\. \(1\): "):
        specific_force_g((Coefficients(k2=1e5),) * 3, -4.0 * SCALE, SCALE, 0.0)
