"""The pendulum against an integration of its differential equation, and the printed solution against both."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ins_eval.digital_loop import load
from ins_eval.digital_loop.pendulum import discrete, poles, step_response

TORQUE = 1e-7  # N m
INTEGRATION_TOLERANCE = 1e-8  # relative to M / D
ROUNDING = 1e-12


@pytest.fixture(scope="module")
def loop():
    return load()


@pytest.fixture(scope="module")
def constants(loop):
    pendulum = loop.parameters.pendulum
    return pendulum.inertia.value, pendulum.damping.value, pendulum.stiffness.value


def integrated(constants, time_s, torque, start=(0.0, 0.0)):
    j, c, d = constants
    found = solve_ivp(
        lambda t, x: (x[1], (torque - c * x[1] - d * x[0]) / j),
        (0.0, time_s[-1]),
        start,
        t_eval=time_s,
        method="DOP853",
        rtol=1e-11,
        atol=1e-18,
    )
    return found.y


def test_poles_are_real_and_solve_the_characteristic_equation(loop, constants):
    j, c, d = constants
    for pole in poles(loop):
        assert abs(j * pole**2 + c * pole + d) < ROUNDING * d * abs(pole)
    assert poles(loop) == pytest.approx((-10.06, -1808.0), rel=1e-3)


def test_step_response_is_that_of_the_differential_equation(loop, constants):
    time_s = np.linspace(0.0, 0.5, 200)
    theta, _ = integrated(constants, time_s, TORQUE)
    steady = TORQUE / constants[2]
    np.testing.assert_allclose(step_response(loop, time_s, TORQUE), theta, atol=INTEGRATION_TOLERANCE * steady)


def test_steady_deflection_is_torque_over_stiffness_and_the_printed_one_is_not(loop, constants):
    j, _, d = constants
    late = np.array([10.0])
    assert step_response(loop, late, TORQUE)[0] == pytest.approx(TORQUE / d, rel=ROUNDING)
    a, b = (-pole for pole in poles(loop))
    printed = TORQUE / (b - a) * (1.0 / a - 1.0 / b)  # eq. (2) for late times, as printed
    assert printed == pytest.approx(TORQUE * j / d, rel=1e-9)


def test_discrete_step_is_exact_for_a_torque_that_is_held(loop, constants):
    interval_s, held = 2e-3, (1e-7, -3e-7, 0.5e-7)
    a, b = discrete(loop, interval_s)
    state = np.zeros(2)
    for torque in held:
        state = a @ state + b * torque
    expected = np.zeros(2)
    for torque in held:  # each piece by itself, so that the integrator meets no jump
        expected = integrated(constants, np.array([interval_s]), torque, expected)[:, -1]
    np.testing.assert_allclose(state, expected, rtol=1e-8)
