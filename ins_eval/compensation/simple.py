"""The simple compensation of Paper A: straight lines in temperature."""

from __future__ import annotations

from ins_eval.calibration.fits import anchored_line, line
from ins_eval.compensation.scale_and_bias import ScaleAndBias


def simple(anchored: bool = False) -> ScaleAndBias:
    """K1 = phi dT + K1(T0) and K0 = omega dT + K0(T0), Paper A eqs (3)-(5).

    The intercepts are fitted with the slopes; `anchored` takes the values measured at T0 for them instead. The
    paper's wording allows both.
    """
    if anchored:
        return ScaleAndBias("simple_anchored", scale=anchored_line, bias=anchored_line)
    return ScaleAndBias("simple", scale=line, bias=line)
