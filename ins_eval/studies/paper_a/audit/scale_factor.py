"""Eqs (6)-(17) and Table 4, computed again: what the printed equations imply of one another.

The rate is taken in degC/min and T0 as 22 degC wherever a function does not take them; neither is printed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ins_eval.calibration.fits import REFERENCE_C
from ins_eval.calibration.sensitivity import change_ppm
from ins_eval.scale_factor import TERMS, scale_factor, scale_factor_terms
from ins_eval.studies.paper_a.printed import PRINTED, UNITS, coefficients, span_c

POINTS = 2001  # of a curve over a range of temperature; its extremes are then good to 1e-6 of their difference
POWERS = {"alpha": (2, 0), "beta": (0, 2), "eta": (1, 1), "epsilon": (1, 0), "mu": (0, 1), "gamma": (0, 0)}
RANK_TOLERANCE = 1e-9  # of the largest singular value, columns scaled to unit length

# ---------------------------------------------------------------------------------------- eqs (7)-(11)


def expanded(brackets: Sequence[tuple[float, float]], squared: bool) -> dict[tuple[int, int], float]:
    """Coefficients by (power of r, power of dT) of K1 = A dT^2 + B dT + C.

    `brackets` are (a, b), (c, d), (e, f): a r + b and so on. A, B, C are their squares, as eq. (7) has it
    (`squared`), or the brackets themselves, as eqs (8)-(10) put into eq. (6) have it.
    """
    found = {}
    for power, (slope, constant) in zip((2, 1, 0), brackets, strict=True):
        bracket = np.polynomial.Polynomial((constant, slope))
        for rate_power, value in enumerate((bracket**2 if squared else bracket).coef):
            found[rate_power, power] = float(value)
    return found


class Constraint(NamedTuple):
    """What eq. (7) demands of the coefficients of eq. (11), beside what is printed for a unit."""

    epsilon_demanded: float  # epsilon^2 = (2 e f)^2 = 4 alpha gamma
    epsilon_printed: float
    mu_at_least: float  # mu = d^2
    mu_printed: float


def constraint(unit: str) -> Constraint:
    """Eq. (7) against the printed coefficients: alpha = e^2, epsilon = 2 e f, gamma = f^2, mu = d^2."""
    c = _named(unit)
    return Constraint(2.0 * np.sqrt(c["alpha"] * c["gamma"]), c["epsilon"], 0.0, c["mu"])


def omitted_coefficient(unit: str) -> float:
    """c^2 of r^2 dT that eq. (7) demands, from eta = 2 c d and |mu| = d^2 (mu itself is negative), pulse/g."""
    c = _named(unit)
    return c["eta"] ** 2 / (4.0 * abs(c["mu"]))


# ---------------------------------------------------------------------------------------- eq. (11): what is seen


def rank(rates_c_per_min: Sequence[float], terms: Sequence[str] = TERMS) -> int:
    """How many of the `terms` of eq. (11) are determined over the printed range at these constant signed rates."""
    low, high = PRINTED["chamber"]["from_to_c"]
    difference = np.linspace(low, high, 131) - REFERENCE_C
    design = np.concatenate([scale_factor_terms(difference, rate) for rate in rates_c_per_min])
    design = design[:, [TERMS.index(term) for term in terms]]
    length = np.linalg.norm(design, axis=0)
    return int(np.linalg.matrix_rank(design / np.where(length > 0.0, length, 1.0), tol=RANK_TOLERANCE * len(design)))


# ---------------------------------------------------------------------------------------- eqs (15)-(17) and Table 4


def printed_sensitivity(unit: str, reference_c: float = REFERENCE_C) -> float:
    """(X - Y) / (A T) in ppm/degC: a unit's printed curve at rest from the cold to the hot end of its quoted range."""
    low, high = PRINTED[unit]["range_c"]
    curve = scale_factor(coefficients(unit), np.linspace(low, high, POINTS) - reference_c, 0.0)
    return 1e6 * float((curve[0] - curve[-1]) / curve.mean()) / (high - low)


def reference_needed_c(unit: str) -> float:
    """The T0 with which the printed curve has the sensitivity that Table 4 gives without compensation."""
    wanted = PRINTED[unit]["table4"]["none"]
    return float(brentq(lambda reference: printed_sensitivity(unit, reference) - wanted, -300.0, 100.0))


def falls_throughout(unit: str) -> bool:
    """Whether the printed curve at rest falls with temperature over the whole quoted range."""
    difference = np.linspace(*PRINTED[unit]["range_c"], POINTS) - REFERENCE_C
    return bool(np.all(np.diff(scale_factor(coefficients(unit), difference, 0.0)) < 0.0))


def quoted_sensitivity(unit: str) -> float:
    """The change that the text quotes over the range that it quotes, ppm/degC."""
    return PRINTED[unit]["change_ppm"] / span_c(unit)


def least_for_a_line(unit: str) -> float:
    """Sensitivity that the best straight line leaves of the printed curve at rest, ppm/degC.

    No line leaves less of a parabola than beta L^2 / 4 from peak to peak over L degrees; least squares leaves that.
    """
    low, high = PRINTED[unit]["range_c"]
    difference = np.linspace(low, high, POINTS) - REFERENCE_C
    curve = scale_factor(coefficients(unit), difference, 0.0)
    residual = curve - np.polynomial.Polynomial.fit(difference, curve, 1)(difference)
    return change_ppm(curve.mean() + residual) / (high - low)


def residual_peak_to_peak_ppm(unit: str) -> float:
    """Residual that Table 4's proposed method implies over the quoted range."""
    return PRINTED[unit]["table4"]["hysteresis"] * span_c(unit)


def table4_ratio(unit: str, over: str = "simple") -> float:
    """Table 4: sensitivity of another arm in units of the proposed one."""
    row = PRINTED[unit]["table4"]
    return row[over] / row["hysteresis"]


# ---------------------------------------------------------------------------------------- the rate


def falling_minus_rising_ppm(unit: str, rate_c_per_min: float = 0.3, difference_c: float = 0.0) -> float:
    """Printed curve at the falling rate minus that at the rising one, in ppm of gamma."""
    falling, rising = scale_factor(coefficients(unit), difference_c, np.array([-rate_c_per_min, rate_c_per_min]))
    return 1e6 * (falling - rising) / coefficients(unit)[-1]


def crossing_c(unit: str) -> float:
    """T - T0 at which the two printed branches change places: -epsilon / eta."""
    c = _named(unit)
    return -c["epsilon"] / c["eta"]


def equivalent_lag_min(unit: str) -> float:
    """Lag of the magnet behind the sensor that would make the printed epsilon of the printed mu: -epsilon / mu."""
    c = _named(unit)
    return -c["epsilon"] / c["mu"]


def linear_rate_term_ppm(unit: str, rate_c_per_min: float, rate_unit: str) -> float:
    """epsilon r in ppm of gamma if the printed coefficient is per ``"degC/min"`` or per ``"degC/s"``."""
    c = _named(unit)
    return 1e6 * c["epsilon"] * rate_c_per_min / {"degC/min": 1.0, "degC/s": 60.0}[rate_unit] / c["gamma"]


def square_rate_term_ppm(unit: str, rate_c_per_min: float) -> float:
    """alpha r^2 in ppm of gamma, the same on both branches."""
    c = _named(unit)
    return 1e6 * c["alpha"] * rate_c_per_min**2 / c["gamma"]


def pulse_ug(gate_s: float = 1.0) -> float:
    """What one pulse of unit #1 is worth if gamma is counted over `gate_s`; no time base is printed."""
    return 1e6 / (coefficients(UNITS[0])[-1] * gate_s)


def _named(unit: str) -> dict[str, float]:
    return dict(zip(TERMS, coefficients(unit).tolist(), strict=True))
