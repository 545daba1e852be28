"""The hysteresis compensation that Paper A proposes."""

from __future__ import annotations

from ins_eval.calibration import FITS
from ins_eval.compensation.scale_and_bias import ScaleAndBias


def hysteresis() -> ScaleAndBias:
    """K1 by the six terms of Paper A eq. (11), K0 piecewise linear with a falling and a rising branch."""
    return ScaleAndBias("hysteresis", *FITS["hysteresis"])
