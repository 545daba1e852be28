"""The pendulum's step response, eqs (1)-(3), computed again.

G(s) = 1/(J s^2 + C s + D) with J in kg m^2, C in N m s, D in N m/rad; theta in rad for a moment M in N m.
"""

from __future__ import annotations

import numpy as np


def poles(j: float, c: float, d: float) -> np.ndarray:
    """s1, s2 below eq. (1), (2,) complex, the slower first."""
    root = np.sqrt(complex(c * c - 4.0 * d * j))
    return np.array([-c + root, -c - root]) / (2.0 * j)


def divisor(j: float, c: float, d: float) -> float:
    """|s2| - |s1| of eqs (1), (2)."""
    slow, fast = np.abs(poles(j, c, d))
    return float(fast - slow)


def step(j: float, c: float, d: float, time_s: np.ndarray, *, printed: bool = False) -> np.ndarray:
    """Deflection theta(t) (n,) for each N m, from eq. (2): as printed, or with the 1/J that eq. (1) lost.

    theta = (M/J)/(b - a) [(1 - e^(-a t))/a - (1 - e^(-b t))/b], a = |s1|, b = |s2|.
    """
    a, b = np.abs(poles(j, c, d))
    bracket = (1.0 - np.exp(-a * time_s)) / a - (1.0 - np.exp(-b * time_s)) / b
    return bracket / (b - a) / (1.0 if printed else j)


def steady_state(j: float, c: float, d: float, *, printed: bool = False) -> float:
    """Limit of `step`: 1/(|s1| |s2|) as printed, which is J/D; 1/D with the 1/J."""
    a, b = np.abs(poles(j, c, d))
    return float(1.0 / (a * b) / (1.0 if printed else j))
