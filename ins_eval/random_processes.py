"""Random processes that several sensors share."""

from __future__ import annotations

import numba
import numpy as np

NORMAL_MAD = 0.6745  # median size of standard normal values: their quantile 0.75


@numba.njit(cache=True)
def _gauss_markov(time_s, sigma, time_constant_s, normal, start):
    out = np.empty(normal.shape)
    out[0] = start
    for k in range(1, time_s.size):
        decay = np.exp(-(time_s[k] - time_s[k - 1]) / time_constant_s)
        fresh = sigma * np.sqrt(1.0 - decay * decay)
        for j in range(normal.shape[1]):
            out[k, j] = decay * out[k - 1, j] + fresh * normal[k, j]
    return out


def gauss_markov(
    time_s: np.ndarray, sigma: float, time_constant_s: float, rng: np.random.Generator, start: float | None = None
) -> np.ndarray:
    """First-order Gauss-Markov process at `time_s` (n,): autocovariance sigma^2 exp(-|dt| / tau), for any spacing.

    Starts in its stationary distribution, or at `start`. Returns (n,) in the unit of `sigma`.
    """
    normal = rng.standard_normal(time_s.size)[:, None]
    return gauss_markov_of(normal, time_s, sigma, time_constant_s, start)[:, 0]


def gauss_markov_of(
    normal: np.ndarray, time_s: np.ndarray, sigma: float, time_constant_s: float, start: float | None = None
) -> np.ndarray:
    """The same of m processes at once, made of the standard normal numbers `normal` (n, m): (n, m)."""
    first = sigma * normal[0] if start is None else np.full(normal.shape[1], start)
    return _gauss_markov(time_s, sigma, time_constant_s, normal, first)
