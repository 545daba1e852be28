"""The sampled loop in a short stretch of flight, beside its steady state.

A flight is simulated with the steady state, N_out proportional to the specific force (`model.Loop.steady_counts`). The
loop itself follows with a delay: to first order in frequency its response H(z) is

    N(t) = N_steady(t - tau),    tau = - d arg H / d omega at omega = 0,

so that increments of velocity are off by - tau f' and the velocity by - tau times the change of specific force, which
does not add up. The loop's noise is found apart: it is that of the same loop, with the same random numbers, held at the
specific force with which the stretch begins.

Specific force is constant over each period of the controller, that of its middle. Torques from rotation of the case and
from the other two axes are left out, as everywhere in `digital_loop`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from ins_eval.digital_loop import sampled, stability
from ins_eval.digital_loop.model import Loop
from ins_eval.streams import Streams
from ins_eval.trajectory import Trajectory
from ins_eval.units import STANDARD_GRAVITY

SETTLING_S = 0.5  # flown before the stretch: the plate leaves its stop, and the slowest pole, 136 rad/s, dies away
SEARCH_S = 0.1


class LoopResponse(NamedTuple):
    """One axis over a stretch, m samples of the navigation computer.

    time_s        (m,) at which each ends
    force         (m,) mean specific force of the steady state, m/s^2
    off           (m,) mean of the loop less the steady state, without noise, m/s^2
    linear        (m,) the same by the transfer function H, without the steps of the converters
    noise         (m,) mean of the loop's noise, m/s^2
    slope         (m,) mean rate of change of the specific force, m/s^3
    """

    time_s: np.ndarray
    force: np.ndarray
    off: np.ndarray
    linear: np.ndarray
    noise: np.ndarray
    slope: np.ndarray


def delay_s(loop: Loop) -> float:
    """tau of the closed loop from its transfer function: with H = n(x) / d(x), x = 1/z,

    tau / T = sum k n_k / sum n_k - sum k d_k / sum d_k
    """
    numerator, denominator = stability.closed_loop(loop)
    first = (np.arange(part.size) @ part / part.sum() for part in (numerator, denominator))
    return float((next(first) - next(first)) * loop.period_s)


def liveliest_s(trajectory: Trajectory, duration_s: float) -> float:
    """When the stretch begins over which the specific force changes most, mean square of its rate over all axes."""
    time_s = np.arange(trajectory.start_s + SETTLING_S, trajectory.end_s, SEARCH_S)
    rate = np.gradient(trajectory.specific_force(time_s), SEARCH_S, axis=0)
    total = np.concatenate([[0.0], np.cumsum(np.sum(rate**2, axis=1))])
    width = round(duration_s / SEARCH_S)
    return float(time_s[np.argmax(total[width:] - total[:-width])])


def flown(
    loop: Loop, trajectory: Trajectory, axis: int, from_s: float, duration_s: float, interval_s: float, streams: Streams
) -> LoopResponse:
    """The loop on body axis `axis` from `from_s` on, in samples of `interval_s`; `streams` has its noise."""
    each, settling = round(interval_s / loop.period_s), round(SETTLING_S / loop.period_s)
    count = round(duration_s / interval_s)
    k = np.arange(-settling, count * each)
    force = trajectory.specific_force(from_s + (k + 0.5) * loop.period_s)[:, axis]
    still = np.full(force.size, force[settling])
    moving, held = (_less_steady(loop, one, streams) for one in (force, still))

    def means(values: np.ndarray) -> np.ndarray:
        return values[settling:].reshape(count, each).mean(axis=1)

    numerator, denominator = stability.closed_loop(loop)
    linear = lfilter(numerator, denominator, force - still) - (force - still)  # from rest, as the plate settles
    slope = np.gradient(force, loop.period_s)
    time_s = from_s + interval_s * np.arange(1, count + 1)
    return LoopResponse(time_s, means(force), means(moving - held), means(linear), means(held), means(slope))


def _less_steady(loop: Loop, force: np.ndarray, streams: Streams) -> np.ndarray:
    """Output (n,) of the loop less that of its steady state, m/s^2, always with the same noise."""
    force_g = force / STANDARD_GRAVITY
    counts = sampled.closed_loop(loop, force_g, np.zeros(force.size), streams.rng())
    null = loop.steady_counts(0.0)
    return ((counts - null) / loop.counts_per_g - force_g) * STANDARD_GRAVITY
