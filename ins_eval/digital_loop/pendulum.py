"""The pendulum: J theta'' + C theta' + D theta = M, overdamped.

Source: Paper B, eqs. (1)-(3). The printed partial fractions lack 1/J: as printed (2) tends to M J / D, while (3) says
M / D. Here 1 / (J s^2 + C s + D) = 1 / (J (s + a) (s + b)), a and b the magnitudes of the poles.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from ins_eval.digital_loop.model import Loop


def poles(loop: Loop) -> tuple[float, float]:
    """The two real poles in rad/s, the slow one first: s = (-C +- sqrt(C^2 - 4 D J)) / (2 J)."""
    inertia, damping = loop.parameters.pendulum.inertia.value, loop.parameters.pendulum.damping.value
    root = np.sqrt(damping**2 - 4.0 * loop["bending_stiffness"] * inertia)
    fast = -(damping + root) / (2.0 * inertia)
    return loop["bending_stiffness"] / (inertia * fast), fast  # their product is D / J; no digits cancel


def step_response(loop: Loop, time_s: np.ndarray, torque: float) -> np.ndarray:
    """Deflection (n,) in rad after a step of torque in N m, eq. (2) corrected, without stops:

    theta = (M / J) / (b - a) [(1 - exp(-a t)) / a - (1 - exp(-b t)) / b]
    """
    a, b = (-pole for pole in poles(loop))
    return (
        torque
        / loop.parameters.pendulum.inertia.value
        / (b - a)
        * (-np.expm1(-a * time_s) / a + np.expm1(-b * time_s) / b)
    )


def discrete(loop: Loop, interval_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Exact step of the state (theta, theta') under a torque that is constant over it: x' = A x + b M.

    Returns A (2, 2) and b (2,).
    """
    inertia, damping = loop.parameters.pendulum.inertia.value, loop.parameters.pendulum.damping.value
    continuous = np.zeros((3, 3))
    continuous[0, 1] = 1.0
    continuous[1] = -loop["bending_stiffness"] / inertia, -damping / inertia, 1.0 / inertia
    step = expm(continuous * interval_s)
    return step[:2, :2], step[:2, 2]
