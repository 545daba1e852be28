"""Margins, bandwidth and step response of the closed loop against drift of the forward gain.

A static test cannot judge the forward channel: the integral action hides its gain. This is what it does change.

    L(z) = k_t k_VI k_DA D(z) k P(z) / z      P: the pendulum behind a zero-order hold, torque to deflection
                                              k: deflection to demodulated counts; 1/z: the current is one period late
    D(z) = p (1 + T i / (1 - 1/z) + (1 - 1/z) d / T)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.signal import lfilter, ss2tf

from ins_eval.digital_loop.model import Loop
from ins_eval.digital_loop.pendulum import discrete
from ins_eval.errors import UsageError
from ins_eval.units import PPM

LOWEST_HZ = 0.1
GRID = 4000
STEP_S = 0.2
RISEN = 0.9


class Margins(NamedTuple):
    """Of the loop that is cut at the torquer, and of its closed response from specific force to output."""

    crossover_hz: float
    phase_margin_deg: float
    gain_margin_db: float
    bandwidth_hz: float
    rise_s: float
    overshoot: float


class Transfer(NamedTuple):
    """A quotient of polynomials in 1/z, lowest power first."""

    numerator: np.ndarray
    denominator: np.ndarray

    def at(self, frequency_hz: np.ndarray | float, period_s: float) -> np.ndarray:
        """Complex response at frequencies below half the sampling rate."""
        z = np.exp(2j * np.pi * np.asarray(frequency_hz) * period_s)
        return np.polyval(self.numerator[::-1], 1.0 / z) / np.polyval(self.denominator[::-1], 1.0 / z)


def open_loop(loop: Loop, forward_ppm: float = 0.0) -> Transfer:
    """L(z) with the forward gain off by `forward_ppm`."""
    forward = _forward(loop, forward_ppm)
    delayed = np.concatenate([[0.0], forward.numerator])
    return Transfer(loop.torque_per_ampere * loop.amperes_per_count * delayed, forward.denominator)


def closed_loop(loop: Loop, forward_ppm: float = 0.0) -> Transfer:
    """From specific force to output, both in g: unity where it is slow."""
    forward, cut = _forward(loop, forward_ppm), open_loop(loop, forward_ppm)
    scale = loop.torque_per_ampere * loop.amperes_per_count
    return Transfer(scale * forward.numerator, _sum(cut.denominator, cut.numerator))


def margins(loop: Loop, forward_ppm: float = 0.0) -> Margins:
    """Margins with the forward gain off by `forward_ppm`.

    bandwidth_hz: -3 dB; rise_s: a step of specific force reaches 90 % of its output; overshoot: share of the step.
    Raises UsageError for a loop that is unstable or whose gain never crosses 1.
    """
    period_s = loop.period_s
    cut, closed = open_loop(loop, forward_ppm), closed_loop(loop, forward_ppm)
    if not np.isfinite([*cut.numerator, *cut.denominator, *closed.numerator, *closed.denominator]).all():
        raise UsageError("the loop has a gain or a time constant beyond all numbers; mind the units of its parts")
    if np.abs(np.roots(closed.denominator)).max() >= 1.0:
        raise UsageError("the loop is unstable: a pole lies on or outside the unit circle; lower its gain")
    frequency = np.geomspace(LOWEST_HZ, 0.499 / period_s, GRID)
    crossover = _crossing(lambda f: np.log(np.abs(cut.at(f, period_s))), frequency, "the gain of the loop never is 1")
    above = frequency[frequency > crossover]
    reversal = _crossing(  # where L is real and negative; the angle of -L then goes through zero
        lambda f: np.angle(-cut.at(f, period_s)), above, "the phase of the loop never is 180 deg"
    )
    bandwidth = _crossing(
        lambda f: np.log(np.abs(closed.at(f, period_s)) * np.sqrt(2.0)), frequency, "the response never falls by 3 dB"
    )
    step = step_response(loop, forward_ppm)
    return Margins(
        crossover,
        float(np.degrees(np.angle(-cut.at(crossover, period_s)))),
        float(-20.0 * np.log10(np.abs(cut.at(reversal, period_s)))),
        bandwidth,
        float(np.argmax(step >= RISEN) * period_s),
        float(step.max() - 1.0),
    )


def step_response(loop: Loop, forward_ppm: float = 0.0, duration_s: float = STEP_S) -> np.ndarray:
    """Output (n,) in g, one value a control period, after a step of specific force by 1 g; no rounding, no stops."""
    closed = closed_loop(loop, forward_ppm)
    return lfilter(closed.numerator, closed.denominator, np.ones(round(duration_s / loop.period_s)))


def _forward(loop: Loop, forward_ppm: float) -> Transfer:
    """From torque on the pendulum to N_out, without feedback: D(z) k P(z)."""
    a, b = discrete(loop, loop.period_s)
    numerator, denominator = ss2tf(a, b[:, None], np.array([[1.0, 0.0]]), np.zeros((1, 1)))
    controller, period_s = loop.parameters.controller, loop.period_s
    derivative = controller.derivative.value / period_s
    action = controller.proportional.value * np.array(
        [1.0 + controller.integral.value * period_s + derivative, -1.0 - 2.0 * derivative, derivative]
    )
    gain = loop.forward_gain_per_rad * (1.0 + PPM * forward_ppm)
    return Transfer(gain * np.convolve(action, numerator[0]), np.convolve([1.0, -1.0], denominator))


def _sum(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    longer = max(one.size, other.size)
    return np.pad(one, (0, longer - one.size)) + np.pad(other, (0, longer - other.size))


def _crossing(of, frequency: np.ndarray, otherwise: str) -> float:
    """The first frequency at which `of`, positive before, falls through zero."""
    falls = np.flatnonzero((of(frequency[:-1]) > 0.0) & (of(frequency[1:]) <= 0.0))
    if not falls.size:
        raise UsageError(f"{otherwise} between {frequency[0]:.3g} and {frequency[-1]:.3g} Hz; check the controller")
    return float(brentq(of, frequency[falls[0]], frequency[falls[0] + 1], xtol=1e-9))
