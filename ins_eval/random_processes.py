"""Random processes that several sensors share."""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True)
def _gauss_markov(time_s, sigma, time_constant_s, normal, x):
    out = np.empty(time_s.size)
    out[0] = x
    for k in range(1, time_s.size):
        decay = np.exp(-(time_s[k] - time_s[k - 1]) / time_constant_s)
        x = decay * x + sigma * np.sqrt(1.0 - decay * decay) * normal[k]
        out[k] = x
    return out


def gauss_markov(
    time_s: np.ndarray, sigma: float, time_constant_s: float, rng: np.random.Generator, start: float | None = None
) -> np.ndarray:
    """First-order Gauss-Markov process at `time_s` (n,): autocovariance sigma^2 exp(-|dt| / tau), for any spacing.

    Starts in its stationary distribution, or at `start`. Returns (n,) in the unit of `sigma`.
    """
    normal = rng.standard_normal(time_s.size)
    return _gauss_markov(time_s, sigma, time_constant_s, normal, sigma * normal[0] if start is None else start)
