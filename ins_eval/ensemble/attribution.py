"""What model and refinement each bring, whichever is added first.

With g the gain of a compensation over `simple`, the logarithm of a ratio of errors, two orders of adding lead from
simple to refined hysteresis compensation:

    model first        g(hysteresis),        then g(hysteresis_refined) - g(hysteresis)
    refinement first   g(simple_refined),    then g(hysteresis_refined) - g(simple_refined)

The Shapley share of a part is its mean over both orders; the two shares add up to the whole.
Source: L. S. Shapley, A value for n-person games (1953), for two players.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ins_eval.metrics import CONFIDENCE

CORNERS = ("simple", "hysteresis", "simple_refined", "hysteresis_refined")
RESAMPLES = 2000


def attribution(
    arms: Mapping[str, Mapping[str, np.ndarray]],
    statistics: Mapping[str, Callable[[np.ndarray], np.ndarray]],
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Of each measure the factors, ``{"ratio", "interval95"}``, by which each part multiplies it.

    ``model_first`` and ``refinement_first`` hold ``model`` and ``refinement`` in that order of adding, ``shapley`` the
    geometric mean of both orders, ``together`` the whole. Paired percentile bootstrap over instruments, as
    `metrics.paired_bootstrap`, whose parameters `arms` and `statistics` are; of arms only `CORNERS` are taken.
    """
    size = len(arms[CORNERS[0]][next(iter(statistics))])
    rows = np.vstack([np.arange(size), rng.integers(0, size, (RESAMPLES, size))])  # the first is the ensemble itself
    found = {}
    for measure, statistic in statistics.items():
        simple, hysteresis, refined, both = (np.log(statistic(arms[arm][measure][rows])) for arm in CORNERS)
        model = {"model_first": hysteresis - simple, "refinement_first": both - refined}
        refinement = {"model_first": both - hysteresis, "refinement_first": refined - simple}
        orders = {o: {"model": _ratio(model[o]), "refinement": _ratio(refinement[o])} for o in model}
        means = {"model": _mean(model), "refinement": _mean(refinement)}
        shares = {part: _ratio(mean) for part, mean in means.items()}
        found[measure] = {**orders, "shapley": shares, "together": _ratio(both - simple)}
    return found


def _mean(orders: Mapping[str, np.ndarray]) -> np.ndarray:
    return np.mean(list(orders.values()), axis=0)


def _ratio(log_ratio: np.ndarray) -> dict[str, Any]:
    """The factor of the ensemble, first of (1 + resamples,), and its interval from the others."""
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = np.exp(np.quantile(log_ratio[1:], [tail, 1.0 - tail]))
    return {"ratio": float(np.exp(log_ratio[0])), "interval95": [float(low), float(high)]}
