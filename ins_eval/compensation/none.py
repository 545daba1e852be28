"""No temperature compensation: scale factor and bias as they are at the reference temperature."""

from __future__ import annotations

from ins_eval.calibration import FITS
from ins_eval.compensation.scale_and_bias import ScaleAndBias


def none() -> ScaleAndBias:
    """K1 and K0 of the readings nearest to T0, at every temperature."""
    return ScaleAndBias("none", *FITS["none"])
