"""Eq. (1): the output of a quartz flexible accelerometer with every coefficient, and its inverse.

E = K1 (K0 + ai + K2 ai^2 + K3 ai^3 + Kip ai ap + Kio ai ao + delta_o ap - delta_p ao)

ai, ap, ao: specific force along the input, pendulous and output axis in g. E in pulse/s, K1 in pulse/(g s), K0 in ug.
Both sides need it, the sensor that is simulated and an estimator, so it stands below both.
Source: Paper A (Sensors 2021, 21, 294), eq. (1); the paper neglects all but K0, K1 and K2.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ins_eval.errors import DataRefused

# body axes (0, 1, 2) that are input, pendulous and output axis of the accelerometers x, y and z
SENSOR_AXES = {"x": (0, 2, 1), "y": (1, 2, 0), "z": (2, 0, 1)}

NEWTON_STEPS = 20
CONVERGED_G = 1e-12  # of 1 g or of the specific force, whichever is larger


class Coefficients(NamedTuple):
    """Of one accelerometer, in ug/g^2 (k3: ug/g^3) and urad."""

    k2: float = 0.0
    k3: float = 0.0
    kip: float = 0.0
    kio: float = 0.0
    delta_o: float = 0.0
    delta_p: float = 0.0


def force_error_ug(c: Coefficients, force_g: np.ndarray) -> np.ndarray | float:
    """What the terms beyond K1, K0 and ai add, in ug; `force_g` (..., 3) in g along input, pendulous, output axis.

    With coefficients (m,) of m accelerometers and `force_g` (n, 1, 3) it is (n, m).
    """
    i, p, o = force_g[..., 0], force_g[..., 1], force_g[..., 2]
    if not np.any(c[1:]):  # the usual case, at a third of the cost
        return c.k2 * i * i
    along = i * (i * (c.k2 + c.k3 * i) + c.kip * p + c.kio * o)
    return along + c.delta_o * p - c.delta_p * o


def specific_force_g(
    coefficients: Sequence[Coefficients], pulse_per_s: np.ndarray, scale: np.ndarray, bias_ug: np.ndarray
) -> np.ndarray:
    """Specific force (n, 3) in g along the body axes that gives the outputs of the accelerometers x, y and z.

    Each needs what the others feel, so the three equations are solved together by Newton's method. Parameters:
    the coefficients of x, y, z; `pulse_per_s`, `scale`, `bias_ug` (n, 3) or what broadcasts to it, in that order.
    Raises: DataRefused where no specific force near E / K1 - K0 gives them.
    """
    target = np.atleast_2d(np.asarray(pulse_per_s, dtype=float) / scale - 1e-6 * np.asarray(bias_ug, dtype=float))
    force = target.copy()
    for _ in range(NEWTON_STEPS):
        miss = np.empty_like(force)
        slopes = np.zeros((*force.shape, 3))
        for row, (c, axes) in enumerate(zip(coefficients, SENSOR_AXES.values(), strict=True)):
            along = force[:, axes]
            miss[:, row] = along[:, 0] + 1e-6 * force_error_ug(c, along) - target[:, row]
            slopes[:, row, axes] = np.column_stack(_slopes(c, *along.T))
        step = np.linalg.solve(slopes, miss[..., None])[..., 0]
        force -= step
        if np.all(np.abs(step) <= CONVERGED_G * np.maximum(1.0, np.abs(force))):
            return force
    raise DataRefused(
        f"eq. (1): no specific force found for some output in {NEWTON_STEPS} steps; expected terms that are small "
        "beside ai, so check the units of the coefficients (ug/g^2, ug/g^3, urad) and of the output (pulse/s)"
    )


def _slopes(c: Coefficients, i: np.ndarray, p: np.ndarray, o: np.ndarray) -> tuple[np.ndarray, ...]:
    """Derivatives of E / K1 with respect to ai, ap and ao."""
    along = 1.0 + 1e-6 * (i * (2.0 * c.k2 + 3.0 * c.k3 * i) + c.kip * p + c.kio * o)
    return along, 1e-6 * (c.kip * i + c.delta_o), 1e-6 * (c.kio * i - c.delta_p)
