"""How sure the coefficients of a fitted curve are.

A four-point value comes out of four runs, so all values of one ramp share what these runs were shifted by, and there
are only as many independent shifts as ramps. Within a ramp the readings of one leg (temperature falling, or rising)
share more: a chamber that stops at each whole degree shows the steps of the thermometer (16 to a degree) the same
phase again and again, so that their error does not average out along the leg. Short-range correlation comes on top.

    value = curve + shift of the ramp + shift of the leg + correlated noise

The error of a coefficient is estimated from how its parts, one from each leg, disagree (a sum over clusters, blind to
whatever happens within a leg), and from the differences between ramps. Few clusters make such an estimate scatter
and, where the fit itself has absorbed part of the shifts, fall short; by how much is found by drawing the three kinds
of error at their estimated sizes and computing the same ratio, error to estimated error, for each draw. Its 95 %
point takes the place of Student's t. The error of a fit that does not describe the unit shows as noise or as shifts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ins_eval.calibration.branches import RIDGE, BranchCurve, piecewise, roughness
from ins_eval.calibration.fits import Polynomial, anchored_line, constant, near_reference
from ins_eval.calibration.four_point import FourPoint
from ins_eval.errors import DataRefused
from ins_eval.streams import Streams

DRAWS = 2000
TURNING = 0.25  # of the fastest rate of a ramp: slower readings belong to the leg before them
ABSORBED = 0.1  # a pattern of shifts of which the fit leaves less than this share tells nothing about them
SIGMAS95 = 1.959964  # of a normal distribution


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Of the p coefficients of a curve, in the order of its `values`.

    `half_width95` (p,) of the 95 % interval; `covariance` (p, p), scaled so that 1.96 of its standard deviations are
    that half width; standard deviations of the shifts of a ramp and of a leg and of the noise (that which white noise
    of the same effect on a slow curve would have), in the unit of the curve.
    """

    half_width95: np.ndarray
    covariance: np.ndarray
    ramp_shift: float
    leg_shift: float
    noise: float


def uncertainty(fit: Callable, curve: Polynomial | BranchCurve, points: FourPoint, values: np.ndarray) -> Uncertainty:
    """How sure a `curve` is that `fit` drew through `values` (n,), the scale factors or biases of `points`.

    The coefficients meant are those that the same fit would give on the same programme without random errors: they
    belong to what the thermometer reads, and those of `constant` and `anchored_line` to the mean reading near T0.

    Raises: DataRefused where the ramps are too few to show how runs differ.
    """
    rows = near_reference(points.temperature_c) if fit is constant else np.ones(values.size, dtype=bool)
    temperature, rate = points.temperature_c[rows], points.rate_c_per_min[rows]
    ramp, leg = (np.unique(number[rows], return_inverse=True)[1] for number in legs(points))
    design = curve.design(temperature, rate)
    residual = values[rows] - curve.evaluate(temperature, rate)
    return _Clusters(design, _weights(fit, curve, design, temperature), ramp, leg).assess(residual)


def legs(points: FourPoint) -> tuple[np.ndarray, np.ndarray]:
    """The number of the ramp and that of the leg, counted through all ramps, of each value: (n,) and (n,)."""
    ramp = np.unique(points.ramp_c_per_min, return_inverse=True)[1]
    leg = np.zeros(ramp.size, dtype=np.int64)
    count = 0
    for number in range(ramp.max() + 1):
        rows = np.flatnonzero(ramp == number)
        rate = points.rate_c_per_min[rows]
        moving = np.abs(rate) > TURNING * np.abs(rate).max()
        if not moving.any():  # the temperature never moved
            moving[0] = True
        latest = np.maximum.accumulate(np.where(moving, np.arange(rate.size), np.argmax(moving)))
        direction = np.sign(rate[latest])
        leg[rows] = count + np.concatenate(([0], np.cumsum(np.diff(direction) != 0)))
        count = leg[rows[-1]] + 1
    return ramp, leg


def _weights(fit: Callable, curve: Polynomial | BranchCurve, design: np.ndarray, temperature: np.ndarray) -> np.ndarray:
    """What each reading adds to each coefficient for each unit of its value, (n, p)."""
    if fit is anchored_line:
        near = near_reference(temperature, curve.reference_c)
        at_reference = near / near.sum()
        difference = design[:, 0]
        slope = (difference - difference.sum() * at_reference) / (difference @ difference)
        return np.column_stack((slope, at_reference))
    if fit is piecewise:
        both = design[:, : curve.knots_c.size] + design[:, curve.knots_c.size :]
        return np.tile(np.linalg.solve(both.T @ both, both.T).T, 2)
    if isinstance(curve, BranchCurve):
        return np.linalg.solve(design.T @ design + RIDGE * roughness(curve.knots_c.size), design.T).T
    length = np.linalg.norm(design, axis=0)
    unit = design / length
    return np.linalg.solve(unit.T @ unit, unit.T).T / length


class _Clusters:
    """Readings in `leg` and `ramp` (n,), whose `weights` (n, p) make the coefficients of a `design` (n, p).

    All that is needed of an error e (n,) of the values is, for each leg, z = [W'e, 1'e], (p + 1,).
    """

    def __init__(self, design: np.ndarray, weights: np.ndarray, ramp: np.ndarray, leg: np.ndarray):
        self.count, self.coefficients = design.shape
        self.leg = leg
        self.of_leg = [np.flatnonzero(leg == k) for k in range(leg.max() + 1)]
        self.weights = np.column_stack((weights, np.ones(self.count)))
        p = self.coefficients
        self.gram = np.stack([self.weights[rows].T @ self.weights[rows] for rows in self.of_leg])
        self.taken = np.stack([self.weights[rows].T @ design[rows] for rows in self.of_leg])  # by the fit
        self.shifted = self.gram[:, :, p]  # z of a shift of one leg by 1
        size = self.shifted[:, p]
        ramp_of = np.array([ramp[rows[0]] for rows in self.of_leg])
        self.member = (ramp_of[:, None] == np.arange(ramp.max() + 1)).astype(float)  # (legs, ramps)
        self.ramp_size = self.member.T @ size
        if self.member.shape[1] < 2:
            raise DataRefused(
                "calibration: one commanded rate shows nothing of the shifts between runs, so no interval can be "
                "given; calibrate at two or more rates"
            )
        # residual sums over legs of shifts of legs: what the fit leaves of them
        left = np.diag(size) - self.taken[:, p, :] @ self.shifted[:, :p].T
        left = 0.5 * (left + left.T)
        of_ramps = self.member @ _half_inverse(self.member.T @ left @ self.member, self.ramp_size)
        if not of_ramps.size:
            raise DataRefused(
                f"calibration: {self.member.shape[1]} commanded rates determine the curve but leave nothing over to "
                "show the shifts between runs, so no interval can be given; calibrate at more rates"
            )
        of_legs = _half_inverse(left, size)
        of_both = of_legs.T @ left @ of_ramps
        self.of_ramps, self.of_legs, self.of_both = of_ramps, of_legs, of_both
        # expectations of the two sums of squares (`_sizes`): noise, leg and ramp part
        self.free_ramps, self.free_legs = of_ramps.shape[1], of_legs.shape[1] - np.sum(of_both**2)
        self.legs_in_ramps = np.sum((left @ of_ramps) ** 2)
        self.legs_in_legs = max(np.sum((left @ of_legs) ** 2) - np.sum((left @ of_legs @ of_both) ** 2), 0.0)
        self.ramps_in_ramps = np.sum((self.member.T @ left @ of_ramps) ** 2)
        self.ramp_effect = self.shifted[:, :p].T @ self.member  # of a shift of one ramp on the coefficients

    def assess(self, residual: np.ndarray) -> Uncertainty:
        """The uncertainty that residuals (n,) show."""
        spare = max(self.count - self.coefficients - len(self.of_leg), 1)
        noise = _long_run_variance([residual[rows] for rows in self.of_leg]) * self.count / spare
        z = np.stack([self.weights[rows].T @ residual[rows] for rows in self.of_leg])
        _, scores, ramp, leg = self._statistics(z, noise)
        covariance = scores.T @ scores + ramp * self.ramp_effect @ self.ramp_effect.T
        factor = self._factor(noise, float(leg), float(ramp)) / SIGMAS95
        covariance = covariance * np.outer(factor, factor)
        half_width = SIGMAS95 * np.sqrt(np.diag(covariance))
        return Uncertainty(half_width, covariance, float(np.sqrt(ramp)), float(np.sqrt(leg)), float(np.sqrt(noise)))

    def _statistics(self, z: np.ndarray, noise: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Of z (..., legs, p + 1): coefficients (..., p), score of each leg (..., legs, p), variance of both shifts.

        The mean of its ramp is taken out of the score of a leg, since the shift of a ramp is counted apart.
        """
        p = self.coefficients
        coefficients = z[..., :p].sum(axis=-2)
        left = z - np.einsum("kij,...j->...ki", self.taken, coefficients)
        sums = left[..., p]
        mean = (sums @ self.member) / self.ramp_size @ self.member.T
        scores = left[..., :p] - mean[..., None] * self.shifted[:, :p]
        between = np.sum((sums @ self.of_ramps) ** 2, axis=-1)
        along = sums @ self.of_legs
        within = np.sum(along**2, axis=-1) - np.sum((along @ self.of_both) ** 2, axis=-1)
        leg = np.zeros_like(within)
        if self.legs_in_legs > 0.0:
            leg = np.maximum(within - noise * self.free_legs, 0.0) / self.legs_in_legs
        ramp = np.maximum(between - noise * self.free_ramps - leg * self.legs_in_ramps, 0.0) / self.ramps_in_ramps
        return coefficients, scores, ramp, leg

    def _factor(self, noise: float, leg: float, ramp: float) -> np.ndarray:
        """95 % point of |error| / estimated standard error of each coefficient, (p,)."""
        count, p = len(self.of_leg), self.coefficients
        rng = Streams(0).at("calibration", "uncertainty").rng()
        value, vector = np.linalg.eigh(self.gram)
        half = vector * np.sqrt(np.maximum(noise * value, 0.0))[:, None, :]
        shift = np.sqrt(ramp) * rng.standard_normal((DRAWS, self.member.shape[1])) @ self.member.T
        shift += np.sqrt(leg) * rng.standard_normal((DRAWS, count))
        z = shift[..., None] * self.shifted
        z += (half @ rng.standard_normal((count, p + 1, DRAWS))).transpose(2, 0, 1)
        error, scores, ramps, _ = self._statistics(z, noise)
        estimated = np.sqrt(np.sum(scores**2, axis=-2) + ramps[:, None] * np.sum(self.ramp_effect**2, axis=1))
        ratio = np.divide(np.abs(error), estimated, out=np.full_like(error, SIGMAS95), where=estimated > 0.0)
        return np.quantile(ratio, 0.95, axis=0)


def _half_inverse(left: np.ndarray, size: np.ndarray) -> np.ndarray:
    """H (m, k) with H H' the inverse of `left` (m, m) over the patterns of which the fit leaves enough."""
    scale = 1.0 / np.sqrt(size)
    share, vector = np.linalg.eigh(left * np.outer(scale, scale))
    kept = share > ABSORBED
    return scale[:, None] * vector[:, kept] / np.sqrt(share[kept])


def _long_run_variance(parts: list[np.ndarray]) -> float:
    """Variance that white noise with the same slow part would have, from series with the same correlation.

    Bartlett weights and the bandwidth that the data choose. Source: Newey and West, Review of Economic Studies 61
    (1994) 631.
    """
    parts = [part - part.mean() for part in parts]
    count, longest = sum(part.size for part in parts), max(part.size for part in parts)
    size = 2 ** int(np.ceil(np.log2(2 * longest)))
    power = sum(np.abs(np.fft.rfft(part, size)) ** 2 for part in parts)
    correlation = np.fft.irfft(power, size)[:longest] / count
    if correlation[0] <= 0.0:
        return 0.0
    first = correlation[1 : 1 + int(4.0 * (count / 100.0) ** (2.0 / 9.0))]
    level = correlation[0] + 2.0 * first.sum()
    slope = 2.0 * np.arange(1, first.size + 1) @ first
    ratio = slope / level if abs(level) > 1e-3 * correlation[0] else np.inf
    bandwidth = min(1.1447 * (ratio**2 * count) ** (1.0 / 3.0), longest - 1.0)
    lags = np.arange(1, int(bandwidth) + 1)
    return max(float(correlation[0] + 2.0 * (1.0 - lags / (lags.size + 1.0)) @ correlation[lags]), 0.0)
