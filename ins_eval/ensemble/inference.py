"""How many instruments a gain takes to be sure, and where one flight lies among those of an ensemble."""

from __future__ import annotations

from math import ceil

import numpy as np
from scipy.special import ndtri

from ins_eval.errors import UsageError
from ins_eval.metrics import CONFIDENCE, Estimate


def power_size(
    log_ratio: float, log_ratio_sd_at_n: float, n: int, confidence: float = CONFIDENCE, power: float = 0.995
) -> int:
    """Ensemble size with which the upper bound of a paired ratio lies below 1 with probability `power`.

    N = ceil( n (sd_n (z_c + z_p) / log_ratio)^2 ),   z_c = z((1 + confidence)/2),   z_p = z(power)

    from log R_N ~ Normal(log_ratio, sd_n^2 n/N) and the bound log R_N + z_c sd_n sqrt(n/N) < 0. To hold k such
    bounds at once with probability P, ask each for 1 - (1 - P)/k and take the largest N.

    Parameters: `log_ratio` < 0, the gain that is there; `log_ratio_sd_at_n`, the standard deviation of the log ratio
    of an ensemble of `n` (`Ratio.log_sd`).

    Raises
    ------
    UsageError
        `log_ratio` is not below 0, so that no ensemble is large enough.
    """
    if not log_ratio < 0.0:
        raise UsageError(f"ensemble size: the log ratio is {log_ratio:g}, expected below 0: no gain to resolve")
    z = float(ndtri((1.0 + confidence) / 2.0) + ndtri(power))
    return max(2, ceil(n * (log_ratio_sd_at_n * z / log_ratio) ** 2))


def exceedance(value: float, distribution: np.ndarray) -> Estimate:
    """Fraction of our flights (n,) that exceed a published `value`, with the exact binomial 95 % interval.

    The published flight stands at the percentile 100 (1 - fraction) of our distribution.
    """
    from scipy.stats import binomtest  # imported here, for it takes long and few ask for it

    above = int(np.count_nonzero(np.asarray(distribution) > value))
    result = binomtest(above, np.size(distribution))
    interval = result.proportion_ci(confidence_level=CONFIDENCE, method="exact")
    return Estimate(float(result.statistic), float(interval.low), float(interval.high))
