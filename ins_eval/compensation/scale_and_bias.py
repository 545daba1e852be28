"""What the built-in models share: a curve for the scale factor, a curve for the bias, and eq. (5)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from ins_eval.calibration.four_point import FourPoint, four_point
from ins_eval.calibration.models import with_covariance
from ins_eval.compensation import Curve, Samples, evaluated
from ins_eval.recording import ChamberReadings
from ins_eval.units import STANDARD_GRAVITY, UG

CurveFit = Callable[[np.ndarray, np.ndarray, np.ndarray], Curve]  # of temperature, rate and values, all (n,)


@lru_cache(maxsize=48)  # by identity of the points: models of an accelerometer have curves in common
def _drawn(fit: CurveFit, points: FourPoint, quantity: str) -> Curve:
    return fit(points.temperature_c, points.rate_c_per_min, getattr(points, quantity))


@dataclass(eq=False)
class ScaleAndBias:
    """a = g0 (E / K1(T, r) - K0(T, r)), Paper A eq. (5).

    E: output in pulse/s; K1: `scale_` in pulse/(g s); K0: `bias_ug_` in micro-g; g0: standard gravity. Both
    curves are drawn by `scale` and `bias` through the four-point points of the chamber.
    """

    name: str
    scale: CurveFit
    bias: CurveFit
    scale_: Curve = field(init=False, repr=False)
    bias_ug_: Curve = field(init=False, repr=False)
    points_: FourPoint | None = field(init=False, repr=False, default=None)  # that the curves were drawn through

    def fit(self, chamber: ChamberReadings) -> ScaleAndBias:
        """Draw both curves; raises DataRefused where the readings do not determine them."""
        points = self.points_ = four_point(chamber)
        self.scale_, self.bias_ug_ = _drawn(self.scale, points, "scale"), _drawn(self.bias, points, "bias_ug")
        return self

    def curves_with_covariance(self) -> tuple[Curve, Curve]:
        """Scale factor and bias; after a fit with the covariance of their coefficients, which costs more than the fit.

        A covariance is None where the readings are too few to tell, or a curve is of a kind that has none.
        """
        points = self.points_
        if points is None:
            return self.scale_, self.bias_ug_
        return (
            with_covariance(self.scale, self.scale_, points, points.scale),
            with_covariance(self.bias, self.bias_ug_, points, points.bias_ug),
        )

    def specific_force(self, samples: Samples) -> np.ndarray:
        """Specific force along the input axis, (n,) m/s^2."""
        scale, bias_ug = (evaluated(curve, samples) for curve in (self.scale_, self.bias_ug_))
        force = STANDARD_GRAVITY * samples.output
        force /= scale  # in place: this is done for every sample of every flight
        force -= UG * bias_ug
        return force
