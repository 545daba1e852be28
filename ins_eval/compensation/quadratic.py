"""Parabolas in temperature, blind to its rate."""

from __future__ import annotations

from ins_eval.calibration import FITS
from ins_eval.compensation.scale_and_bias import ScaleAndBias


def quadratic() -> ScaleAndBias:
    """K1 = q dT^2 + w dT + r by Paper A eq. (6), and K0 of the same form."""
    return ScaleAndBias("quadratic", *FITS["quadratic"])
