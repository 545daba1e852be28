"""The simple compensation of Paper A: straight lines in temperature."""

from __future__ import annotations

from ins_eval.calibration import FITS
from ins_eval.compensation.scale_and_bias import ScaleAndBias


def simple(anchored: bool = False) -> ScaleAndBias:
    """K1 = phi dT + K1(T0) and K0 = omega dT + K0(T0), Paper A eqs (3)-(5).

    The intercepts are fitted with the slopes; `anchored` takes the values measured at T0 for them instead. The
    paper's wording allows both.
    """
    name = "simple_anchored" if anchored else "simple"
    return ScaleAndBias(name, *FITS[name])
