"""What a standstill shows of itself: its seconds, the noise of their mean rates, and how fast the vehicle sways."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ins_eval.initialization.state import GATE
from ins_eval.recording.stillness import Stretch

FEWEST_SECONDS = 8  # whose spread is believed
ZERO_RATE_RADPS, ZERO_VELOCITY_MPS = 2e-4, 0.02  # of a vehicle that sways, where it stands for fewer of them
OF_MEDIAN = 1.4826  # sigma of normal values, of the median of their sizes
MICROSEISM_MPS = 1e-5  # of the ground itself


@dataclass(frozen=True, eq=False)
class Felt:
    """Increments over samples that end at `time_s` and last `interval_s`: rad and m/s, (n, 3)."""

    time_s: np.ndarray
    dtheta_b: np.ndarray
    dv_b: np.ndarray
    interval_s: np.ndarray


def seconds_at_rest(felt: Felt, rest: Stretch) -> np.ndarray:
    """Begin and end (k, 2) of the whole seconds of a standstill whose specific force is like that of the others.

    A vehicle that begins to roll shows no speed yet: a second more than `GATE` sigmas from the median is left out.
    """
    edges_s = np.arange(rest.start_s, rest.end_s + 1e-9, 1.0)
    second_s = np.column_stack([edges_s[:-1], edges_s[1:]])
    _, force = _forces(felt, second_s)
    if len(force) < max(FEWEST_SECONDS, len(second_s)):
        return second_s
    away = np.abs(force - np.median(force, axis=0))
    middle = np.median(away, axis=0)  # 0 where rounding makes most of them alike, which says nothing of the others
    return second_s[((away <= GATE * OF_MEDIAN * middle) | (middle == 0.0)).all(axis=1)]


def rate_sigma(felt: Felt, second_s: np.ndarray) -> np.ndarray:
    """Sigma (3,) of the mean rate over a second at rest, noise and sway, by differences of neighbouring seconds."""
    angle = np.vstack([np.zeros((1, 3)), np.cumsum(felt.dtheta_b, axis=0)])
    first, last = np.searchsorted(felt.time_s, second_s.T + 1e-6)
    rate = (angle[last] - angle[first])[last > first]
    if len(rate) < FEWEST_SECONDS:
        return np.full(3, ZERO_RATE_RADPS)
    return np.sqrt(0.5 * np.mean(np.diff(rate, axis=0) ** 2, axis=0))


def velocity_sigma(felt: Felt, second_s: np.ndarray) -> float:
    """Sigma (m/s) of the velocity of a vehicle that stands, each axis, by what it gains from second to second.

    y_k = v_k+1 - v_k + constant + noise; with c_j the autocovariance of y, noise and v white from second to second,

        s^2 = c_2 - c_1 = -E[d_k d_k+1] - E[d_k^2] / 2,        d_k = y_k+1 - y_k

    whatever the noise, which differs from that of single samples where engines shake or a filter smooths them. At the
    least it is its own sigma, sqrt(2 / n) c_0 of n values: so short a standstill does not show less.
    """
    edges, force = _forces(felt, second_s)
    joined = edges[1:, 0] == edges[:-1, 1]  # the next standstill may be on another slope
    change = np.diff(force, axis=0)  # of what is gained in a second
    pairs = (change[1:] * change[:-1])[joined[1:] & joined[:-1]]
    if len(pairs) < FEWEST_SECONDS:
        return ZERO_VELOCITY_MPS
    change = change[joined]
    half = 0.5 * float(np.mean(change**2))  # c_0 - c_1
    seen = max(0.0, -float(np.mean(pairs)) - half)
    return float(np.sqrt(max(seen, np.sqrt(2.0 / change.size) * (half - seen), MICROSEISM_MPS**2)))


def _forces(felt: Felt, second_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First row and end (k, 2), and mean specific force (k, 3), of those seconds (k, 2) that have samples."""
    summed = np.vstack([np.zeros((1, 4)), np.cumsum(np.column_stack([felt.dv_b, felt.interval_s]), axis=0)])
    edges = np.searchsorted(felt.time_s, second_s + 1e-6)
    edges = edges[edges[:, 1] > edges[:, 0]]
    gained = summed[edges[:, 1]] - summed[edges[:, 0]]
    return edges, gained[:, :3] / gained[:, 3:]
