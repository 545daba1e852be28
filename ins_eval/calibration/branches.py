"""A curve with two branches: one for falling temperature, one for rising, blended where it hardly moves."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

KNOTS_C = np.array([-60.0, -40.0, -20.0, -5.0, 10.0, 22.0, 40.0, 55.0, 70.0])
BLEND_C_PER_MIN = 0.24  # from all falling at -0.12 to all rising at +0.12
KNOT_MARGIN_C = 1.0  # a knot nearer than this to the end of the readings would have next to none of its own

RIDGE = 1e-6
MIDDLE_RIDGE = 1e-3  # of the ridge: bridges temperatures that neither branch has seen, and bends nothing else


@dataclass(frozen=True, eq=False)
class BranchCurve:
    """Piecewise linear in temperature for either direction, constant beyond the first and the last knot.

    K(T, r) = w F(T) + (1 - w) R(T),   w = min(1, max(0, 1/2 - r / 0.24))

    F, R: straight between the knots `knots_c` (m,) with the values `falling` (m,) and `rising` (m,); r in
    degC/min, so w = 1 where the temperature falls by 0.12 degC/min or faster. `covariance` (2m, 2m) is that of the
    falling and then the rising values, None where it was not computed (`uncertainty`). Of k units that share the
    temperatures, `falling` and `rising` are (m, k) and the curve (n, k).
    """

    knots_c: np.ndarray
    falling: np.ndarray
    rising: np.ndarray
    covariance: np.ndarray | None = None

    def evaluate(self, temperature_c: np.ndarray, rate_c_per_min: np.ndarray) -> np.ndarray:
        """The curve at temperatures (n,) in degC and rates (n,) or scalar in degC/min; returns (n,)."""
        temperature, rate = np.broadcast_arrays(np.atleast_1d(temperature_c), np.atleast_1d(rate_c_per_min))
        size = self.falling.shape
        falling, rising = (values.reshape(size[0], -1) for values in (self.falling, self.rising))
        curve = _evaluate(self.knots_c, falling, rising, _floats(temperature), _floats(rate))
        return curve.reshape(-1, *size[1:])

    @property
    def values(self) -> np.ndarray:
        """The falling and then the rising values, (2m,)."""
        return np.concatenate((self.falling, self.rising))

    def design(self, temperature_c: np.ndarray, rate_c_per_min: np.ndarray) -> np.ndarray:
        """What each value is multiplied by: (n, 2m), the curve is ``design @ values``; its rows sum to one."""
        return hats(self.knots_c, temperature_c, rate_c_per_min)


def hats(knots_c: np.ndarray, temperature_c: np.ndarray, rate_c_per_min: np.ndarray) -> np.ndarray:
    """Share of each knot of either branch in readings at (n,) degC and (n,) degC/min: (n, 2m), rows sum to one."""
    share = np.column_stack([np.interp(temperature_c, knots_c, row) for row in np.eye(knots_c.size)])
    falling = np.clip(0.5 - np.asarray(rate_c_per_min) / BLEND_C_PER_MIN, 0.0, 1.0)[:, None]
    return np.hstack((falling * share, (1.0 - falling) * share))


def branches(
    temperature_c: np.ndarray,
    rate_c_per_min: np.ndarray,
    values: np.ndarray,
    knots_c: np.ndarray = KNOTS_C,
    ridge: float = RIDGE,
    run: np.ndarray | None = None,
) -> BranchCurve:
    """Least squares of a `BranchCurve`.

    Knots outside the readings are left out and the ends of the readings become knots themselves, so that no value
    is an extrapolation. `ridge` is the weight, in readings, with which the two branches are held together and their
    width is held even: a branch without readings follows the other, at the width that its neighbours have.

    With `run` (n,), which numbers the run of each reading, every run has a constant of its own that is not the
    curve's; the curve then has zero mean over the readings.

    Parameters: temperature (n,) in degC, its rate (n,) in degC/min, `values` (n,) or (n, m), finite.
    Source: the "simple piecewise function" for the bias of Paper A, section 3.1, which it leaves unspecified;
    knots and blending are ours.
    """
    temperature, rate, values = _floats(temperature_c), _floats(rate_c_per_min), _floats(values)
    knots = supported(np.asarray(knots_c, dtype=float), temperature.min(), temperature.max())
    normal = np.zeros((2 * knots.size, 2 * knots.size))
    right = np.zeros((2 * knots.size, *values.shape[1:]))
    weight = np.zeros(2 * knots.size)  # sum of the rows of the design; each row sums to one
    for rows in [slice(None)] if run is None else [run == number for number in np.unique(run)]:
        of_run = values[rows]
        part, part_right = _normal_equations(knots, temperature[rows], rate[rows], of_run.reshape(len(of_run), -1))
        part_right = part_right.reshape(right.shape)
        part_weight = part.sum(axis=1)
        weight += part_weight
        if run is not None:  # take the mean of the run out of design and values
            part -= np.outer(part_weight, part_weight) / part_weight.sum()
            part_right -= np.multiply.outer(part_weight, part_right.sum(axis=0)) / part_weight.sum()
        normal += part
        right += part_right
    normal += ridge * roughness(knots.size)
    if run is not None:
        normal += weight.sum() / normal.shape[0] ** 2  # the constant is open: any value will do, it goes below
    solution = np.linalg.solve(normal, right)
    if run is not None:
        solution -= weight @ solution / weight.sum()
    return BranchCurve(knots, solution[: knots.size], solution[knots.size :])


def piecewise(temperature_c: np.ndarray, rate_c_per_min: np.ndarray, values: np.ndarray) -> BranchCurve:
    """`branches` blind to the direction of the temperature: both branches are the one curve through all readings."""
    both = branches(temperature_c, np.full_like(_floats(temperature_c), BLEND_C_PER_MIN), values)
    return BranchCurve(both.knots_c, both.rising, both.rising)


def supported(knots: np.ndarray, lowest: float, highest: float) -> np.ndarray:
    """The knots that have readings of their own, and the ends of the readings."""
    inside = knots[(knots > lowest + KNOT_MARGIN_C) & (knots < highest - KNOT_MARGIN_C)]
    if highest - lowest < KNOT_MARGIN_C:
        return np.array([0.5 * (lowest + highest)])
    return np.concatenate(([lowest], inside, [highest]))


def roughness(count: int) -> np.ndarray:
    """Quadratic form of a width that is large or uneven and, far weaker, of a middle that is uneven.

    The width is the rising minus the falling branch, the middle their mean.
    """
    step = np.diff(np.eye(count), axis=0)
    width = np.hstack((-np.eye(count), np.eye(count)))
    middle = np.hstack((np.eye(count), np.eye(count))) / 2.0
    rows = np.vstack((width, step @ width, np.sqrt(MIDDLE_RIDGE) * step @ middle))
    return rows.T @ rows


def _floats(array: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(array, dtype=float)


@numba.njit(cache=True)
def _place(knots, temperature):
    """Knots on either side and the share of the upper one."""
    last = knots.size - 1
    if last == 0 or temperature <= knots[0]:
        return 0, 0, 0.0
    if temperature >= knots[last]:
        return last, last, 0.0
    j = 0
    while j < last - 1 and temperature >= knots[j + 1]:
        j += 1
    return j, j + 1, (temperature - knots[j]) / (knots[j + 1] - knots[j])


@numba.njit(cache=True)
def _weight(rate):
    return min(1.0, max(0.0, 0.5 - rate / BLEND_C_PER_MIN))


@numba.njit(cache=True)
def _evaluate(knots, falling, rising, temperature, rate):
    curve = np.empty((temperature.size, falling.shape[1]))
    for k in range(temperature.size):
        i, j, share = _place(knots, temperature[k])
        w = _weight(rate[k])
        for unit in range(curve.shape[1]):
            low = w * falling[i, unit] + (1.0 - w) * rising[i, unit]
            high = w * falling[j, unit] + (1.0 - w) * rising[j, unit]
            curve[k, unit] = low + share * (high - low)
    return curve


@numba.njit(cache=True)
def _normal_equations(knots, temperature, rate, values):
    """Normal matrix and right sides (2m, units); a row of the design has four entries, which sum to one."""
    m = knots.size
    normal = np.zeros((2 * m, 2 * m))
    right = np.zeros((2 * m, values.shape[1]))
    column = np.empty(4, np.int64)
    entry = np.empty(4)
    for k in range(temperature.size):
        i, j, share = _place(knots, temperature[k])
        w = _weight(rate[k])
        column[0], column[1], column[2], column[3] = i, j, m + i, m + j
        entry[0], entry[1] = w * (1.0 - share), w * share
        entry[2], entry[3] = (1.0 - w) * (1.0 - share), (1.0 - w) * share
        for p in range(4):
            for unit in range(values.shape[1]):
                right[column[p], unit] += entry[p] * values[k, unit]
            for s in range(4):
                normal[column[p], column[s]] += entry[p] * entry[s]
    return normal, right
