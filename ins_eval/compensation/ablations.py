"""The hysteresis compensation with a part left out or exchanged: what each part of it is worth."""

from __future__ import annotations

from ins_eval.calibration.branches import branches, piecewise
from ins_eval.calibration.fits import line, polynomial, quadratic
from ins_eval.compensation.scale_and_bias import ScaleAndBias


def hysteresis_scale_only() -> ScaleAndBias:
    """The six-term scale factor of `hysteresis`, the bias of `simple`."""
    return ScaleAndBias("hysteresis_scale_only", scale=polynomial, bias=line)


def hysteresis_bias_only() -> ScaleAndBias:
    """The scale factor of `simple`, the two-branch bias of `hysteresis`."""
    return ScaleAndBias("hysteresis_bias_only", scale=line, bias=branches)


def hysteresis_without_rate() -> ScaleAndBias:
    """`hysteresis` with a scale factor that does not know the rate: eq. (6) in place of eq. (11)."""
    return ScaleAndBias("hysteresis_without_rate", scale=quadratic, bias=branches)


def hysteresis_blind() -> ScaleAndBias:
    """`hysteresis` with a bias as piecewise, but blind to the direction of the temperature."""
    return ScaleAndBias("hysteresis_blind", scale=polynomial, bias=piecewise)


def hysteresis_piecewise_scale() -> ScaleAndBias:
    """`hysteresis` with a scale factor drawn as its bias is: piecewise, a branch for either direction."""
    return ScaleAndBias("hysteresis_piecewise_scale", scale=branches, bias=branches)
