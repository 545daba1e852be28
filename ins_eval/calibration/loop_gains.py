"""Gains of a digital accelerometer loop from its own tests, and how to compensate their drift.

Nothing here knows where the counts come from. Forward gain: the slope of N_out against N_FPGA with the plate on its
stop, eqs. (17)-(21). Feedback gain: N_out with a constant reference current on and off, eqs. (24)-(28). Compensation:
the gain of the controller, eq. (22), and the code N_VREF of the DAC that feeds the feedback DAC, eqs. (29)-(30).

    drift of the forward gain     delta = k1 / k0 - 1
    drift of the feedback gain    delta = dN0 / dN1 - 1,   since dN = N_on - N_off = -I_ref / (k_VI k_DA)

Source: Paper B, section III. Its Table 4 has the other sign: |dN| that rises means a gain that falls.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from ins_eval.units import PPM

UNSEEN = (
    "the torquer: magnet, coil and arm cancel in N_on - N_off; their drift stays in the output, 1 ug at 1 g for 1 ppm",
    "the reference current itself: its drift is taken for one of the feedback gain, and compensation puts it into the "
    "output",
    "the hinge and the gap of the pick-off: in the scan the plate lies on its stop; they change stability only",
    "the bias, and the mass and arm of the pendulum",
    "where a drift of the scan comes from: reference capacitors that part by 1 ppm show as 0.5 ppm, but change the "
    "bias of the closed loop and not its gain",
)


class Gain(NamedTuple):
    """An estimate, its standard deviation and its two-sided 95 % interval."""

    value: float
    sigma: float
    low: float
    high: float


def scan_gain(n_fpga: np.ndarray, n_out: np.ndarray) -> Gain:
    """Slope of N_out (p,) against N_FPGA (p,), p > 2, eq. (19)."""
    return slope(n_fpga, n_out)


def slope(x: np.ndarray, y: np.ndarray) -> Gain:
    """Slope of y (p,) against x (p,), p > 2, by centred least squares.

    slope = sum (x - mean x) (y - mean y) / sum (x - mean x)^2; the interval is Student's with p - 2 degrees of freedom.
    """
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    x, y = x - x.mean(), y - y.mean()
    spread = x @ x
    found = (x @ y) / spread
    freedom = x.size - 2
    sigma = float(np.sqrt(np.sum((y - found * x) ** 2) / (freedom * spread)))
    return _student(found, sigma, freedom)


def current_step(on_counts: np.ndarray, off_counts: np.ndarray) -> Gain:
    """N_on - N_off, eq. (26), from readings with the current on (b,) and off (c,).

    The interval is Welch's; a single reading of either has none, and gives NaN.
    """
    on, off = np.asarray(on_counts, dtype=float), np.asarray(off_counts, dtype=float)
    step = float(on.mean() - off.mean())
    if min(on.size, off.size) < 2:
        return Gain(step, np.nan, np.nan, np.nan)
    variances = on.var(ddof=1) / on.size, off.var(ddof=1) / off.size
    total = sum(variances)
    if total == 0.0:
        return Gain(step, 0.0, step, step)
    freedom = total**2 / (variances[0] ** 2 / (on.size - 1) + variances[1] ** 2 / (off.size - 1))
    return _student(step, float(np.sqrt(total)), freedom)


def forward_drift_ppm(reference: np.ndarray | float, test: np.ndarray | float) -> np.ndarray | float:
    """Drift of the forward gain in ppm from the slopes of two scans, eqs. (17)-(21): k1 / k0 - 1."""
    return (test / reference - 1.0) / PPM


def feedback_drift_ppm(reference: np.ndarray | float, test: np.ndarray | float) -> np.ndarray | float:
    """Drift of k_VI k_DA in ppm from N_on - N_off of two tests, eqs. (27), (28): dN0 / dN1 - 1."""
    return (reference / test - 1.0) / PPM


def forward_drift(n_fpga: np.ndarray, reference: np.ndarray, test: np.ndarray) -> Gain:
    """Drift of the forward gain in ppm from scans at `n_fpga` (p,): N_out (r, p) of r repetitions, before and after.

    With several repetitions the interval is that of their mean. With one it is that of the slope of the difference,
    point by point: what the carrier's DAC rounds is in both scans, and cancels.
    """
    slopes = np.array([scan_gain(n_fpga, one).value for one in reference])
    changes = [scan_gain(n_fpga, after - before) for before, after in zip(reference, test, strict=True)]
    if len(changes) > 1:
        return over_repetitions(np.array([one.value for one in changes]) / slopes / PPM)
    per_ppm, only = abs(slopes[0]) * PPM, changes[0]
    drift_ppm, half = only.value / (slopes[0] * PPM), (only.high - only.low) / (2.0 * per_ppm)
    return Gain(float(drift_ppm), only.sigma / per_ppm, float(drift_ppm - half), float(drift_ppm + half))


def feedback_drift(reference: Sequence[Gain], test: Sequence[Gain]) -> Gain:
    """Drift of k_VI k_DA in ppm from N_on - N_off of r repetitions, before and after.

    With several repetitions the interval is that of their mean. With one it comes from the intervals of both.
    """
    drift_ppm = np.array(
        [feedback_drift_ppm(before.value, after.value) for before, after in zip(reference, test, strict=True)]
    )
    if drift_ppm.size > 1:
        return over_repetitions(drift_ppm)
    relative = [(one.sigma / one.value, (one.high - one.low) / (2.0 * one.value)) for one in (reference[0], test[0])]
    sigma, half = np.hypot(*relative) / PPM
    return Gain(float(drift_ppm[0]), float(sigma), float(drift_ppm[0] - half), float(drift_ppm[0] + half))


def over_repetitions(values: np.ndarray) -> Gain:
    """Mean of repetitions (r,), r > 1, with Student's interval: what scatters between them is in it."""
    values = np.asarray(values, dtype=float)
    return _student(float(values.mean()), float(values.std(ddof=1) / np.sqrt(values.size)), values.size - 1)


def controller_gain(forward_ppm: np.ndarray | float) -> np.ndarray | float:
    """Factor 1 / (1 + delta) on k(D(z)) that restores the forward gain, eq. (22)."""
    return 1.0 / (1.0 + PPM * np.asarray(forward_ppm))


def reference_code(code: float, feedback_ppm: np.ndarray | float) -> np.ndarray:
    """N'_VREF = N_VREF / (1 + delta), eq. (30), the nearest whole number."""
    return np.round(code / (1.0 + PPM * np.asarray(feedback_ppm))).astype(int)


def rounding_ppm(code: float) -> float:
    """By how many ppm of the feedback gain a whole number near `code` can be off: half a step."""
    return 0.5 / code / PPM


def _student(value: float, sigma: float, freedom: float) -> Gain:
    half = float(stdtrit(freedom, 0.975)) * sigma
    return Gain(float(value), sigma, float(value - half), float(value + half))
