"""Least-squares polynomials in temperature and its rate: the terms of eq. (11), all or some of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ins_eval.errors import DataRefused
from ins_eval.scale_factor import TERMS, scale_factor_terms

REFERENCE_C = 22.0  # T0: the soak of step 1, the only reference temperature that Paper A names
RANK_TOLERANCE = 1e-6  # of the largest singular value, columns scaled to unit length
NEAR_REFERENCE_C = 1.0  # readings this close to T0 count as taken at T0

CONSTANT = ("gamma",)
LINE = ("mu", "gamma")
QUADRATIC = ("beta", "mu", "gamma")


@dataclass(frozen=True, eq=False)
class Polynomial:
    """Some of the terms of eq. (11) with their coefficients; the others are zero.

    `values` (p,) and `covariance` (p, p) stand in the order of `terms`. A fit leaves the covariance None: it takes
    more than the fit itself and is computed where it is asked for (`uncertainty`). `residual_rms` is in the unit of
    the curve. Of m units that share the temperatures, `values` is (p, m), the curve (n, m), and `residual_rms` NaN.
    """

    terms: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray | None
    residual_rms: float
    reference_c: float = REFERENCE_C

    @property
    def coefficients(self) -> dict[str, float]:
        """All six coefficients of eq. (11) by name."""
        return {**dict.fromkeys(TERMS, 0.0), **dict(zip(self.terms, self.values.tolist(), strict=True))}

    def evaluate(self, temperature_c: np.ndarray, rate_c_per_min: np.ndarray) -> np.ndarray:
        """The curve at temperatures (n,) in degC and rates (n,) in degC/min; returns (n,)."""
        if self.values.ndim == 2:
            return self.design(temperature_c, rate_c_per_min) @ self.values
        # nested, and without the rate where no term has it: this is done for every sample of every flight
        c = self.coefficients
        difference = np.asarray(temperature_c) - self.reference_c
        curve = (c["beta"] * difference + c["mu"]) * difference + c["gamma"]
        if c["alpha"] or c["eta"] or c["epsilon"]:
            rate = np.asarray(rate_c_per_min)
            curve += (c["alpha"] * rate + c["eta"] * difference + c["epsilon"]) * rate
        return curve

    def design(self, temperature_c: np.ndarray, rate_c_per_min: np.ndarray) -> np.ndarray:
        """What each coefficient is multiplied by: (n, p), the curve is ``design @ values``."""
        chosen = [TERMS.index(term) for term in self.terms]
        return scale_factor_terms(np.asarray(temperature_c) - self.reference_c, rate_c_per_min)[:, chosen]


def polynomial(
    temperature_c: np.ndarray,
    rate_c_per_min: np.ndarray,
    values: np.ndarray,
    terms: tuple[str, ...] = TERMS,
    reference_c: float = REFERENCE_C,
) -> Polynomial:
    """Ordinary least squares of the chosen terms of eq. (11).

    With all six: K1 = alpha r^2 + beta dT^2 + eta r dT + epsilon r + mu dT + gamma. One direction of the ramp
    determines three of them, both directions at one magnitude five, two or more magnitudes all six.

    Parameters: temperature (n,) in degC, its rate (n,) in degC/min, `values` (n,) or (n, m) in any unit.
    Raises: DataRefused where the readings leave a combination of terms open; it says which.
    Source: Paper A, eq. (11) and the fit below step 6.
    """
    chosen = [TERMS.index(term) for term in terms]
    design = scale_factor_terms(np.asarray(temperature_c) - reference_c, rate_c_per_min)[:, chosen]
    length = np.linalg.norm(design, axis=0)
    length[length == 0] = 1.0
    q, r = np.linalg.qr(design / length)
    left, singular, right = np.linalg.svd(r)
    open_rows = right[np.count_nonzero(singular > RANK_TOLERANCE * singular.max(initial=0.0)) :]
    if open_rows.size:
        raise DataRefused(_inseparable(terms, open_rows))
    inverse = (right.T / singular) / length[:, None]
    solution = inverse @ (left.T @ (q.T @ values))
    rms = float(np.sqrt(np.mean((values - design @ solution) ** 2))) if np.ndim(values) == 1 else float("nan")
    return Polynomial(terms, solution, None, rms, reference_c)


def constant(
    temperature_c: np.ndarray, rate_c_per_min: np.ndarray, values: np.ndarray, reference_c: float = REFERENCE_C
) -> Polynomial:
    """The mean of the values within 1 degC of T0, or the value nearest to it: no temperature compensation at all."""
    near = near_reference(temperature_c, reference_c)
    return polynomial(temperature_c[near], rate_c_per_min[near], values[near], CONSTANT, reference_c)


def near_reference(temperature_c: np.ndarray, reference_c: float = REFERENCE_C) -> np.ndarray:
    """Which readings (n,) count as taken at T0."""
    distance = np.abs(temperature_c - reference_c)
    return distance <= max(NEAR_REFERENCE_C, distance.min())


def line(
    temperature_c: np.ndarray, rate_c_per_min: np.ndarray, values: np.ndarray, reference_c: float = REFERENCE_C
) -> Polynomial:
    """A straight line with a free intercept: mu dT + gamma (Paper A, eqs 3 and 4)."""
    return polynomial(temperature_c, rate_c_per_min, values, LINE, reference_c)


def anchored_line(
    temperature_c: np.ndarray, rate_c_per_min: np.ndarray, values: np.ndarray, reference_c: float = REFERENCE_C
) -> Polynomial:
    """A straight line through the value at T0: mu dT + K(T0), the other reading of eqs (3) and (4)."""
    anchor = constant(temperature_c, rate_c_per_min, values, reference_c)
    rest = polynomial(temperature_c, rate_c_per_min, values - anchor.values[0], ("mu",), reference_c)
    return Polynomial(LINE, np.concatenate((rest.values, anchor.values)), None, rest.residual_rms, reference_c)


def quadratic(
    temperature_c: np.ndarray, rate_c_per_min: np.ndarray, values: np.ndarray, reference_c: float = REFERENCE_C
) -> Polynomial:
    """A parabola without the rate: beta dT^2 + mu dT + gamma (Paper A, eq. 6)."""
    return polynomial(temperature_c, rate_c_per_min, values, QUADRATIC, reference_c)


def mixed_up(terms: tuple[str, ...], null_space: np.ndarray) -> str:
    """Which terms the readings mix up, in words; `null_space` (k, p) has orthonormal rows."""
    coupled = np.abs(null_space.T @ null_space) > 1e-3  # two terms of one open combination couple in its projector
    groups: list[list[str]] = []
    left = [i for i in range(len(terms)) if coupled[i, i]]
    while left:
        group = [i for i in left if coupled[left[0], i]]
        groups.append([terms[i] for i in group])
        left = [i for i in left if i not in group]
    parts = [
        " from ".join((group[0], " and ".join(group[1:]))) + " cannot be separated"
        if len(group) > 1
        else f"{group[0]} cannot be seen"
        for group in groups
    ]
    return "; ".join(parts)


def _inseparable(terms: tuple[str, ...], null_space: np.ndarray) -> str:
    return (
        f"calibration: these readings determine {len(terms) - len(null_space)} of {len(terms)} coefficients of "
        f"eq. (11) ({mixed_up(terms, null_space)}); calibrate over a range of temperatures, falling and rising, "
        f"at two or more rates"
    )
