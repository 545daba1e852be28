"""One flight or run among many: what a published figure of a single one has to be held against."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ins_eval import metrics

FIRST, SECOND = "simple", "hysteresis_refined"
AXES = ("east", "north", "horizontal")
MEASURES = (  # those that a single flight has
    *(f"velocity_rms_{axis}" for axis in AXES),
    *(f"cep_rate_{definition}" for definition in ("final", "least_squares", "radial_error_rate_rms")),
)


def single_flights(arms: Mapping[str, Mapping[str, np.ndarray]], measures: Sequence[str] = MEASURES) -> dict[str, Any]:
    """Median and central 95 % of single flights, for ``results["flight"]["single"]``.

    ``[arm][measure]``, and ``["gain_percent"][measure]``: what refined hysteresis compensation takes off a flight in
    % of simple compensation. Parameter: ``arms[arm][measure]`` is (n,), one value for each flight, in one order.
    """
    gain = {m: 100.0 * (1.0 - arms[SECOND][m] / arms[FIRST][m]) for m in measures}
    return {
        **{arm: {m: central(arms[arm][m]) for m in measures} for arm in (FIRST, SECOND)},
        "gain_percent": {m: central(values) for m, values in gain.items()},
    }


def single_runs(members: Sequence[Mapping[str, Mapping[str, np.ndarray]]]) -> dict[str, Any]:
    """Median and central 95 % of single oven runs of all instruments, for ``results["oven"]["single"]``.

    ``[case][arm][axis]``. Parameter: the members of an oven plan, ``["<arm>/<case>"]["velocity_rms_<axis>"]`` (runs,).
    """
    found: dict[str, Any] = {}
    for arm in (FIRST, SECOND):
        for group in members[0]:
            name, _, case = group.partition("/")
            if name == arm:
                found.setdefault(case, {})[arm] = {
                    axis: central(np.concatenate([m[group][f"velocity_rms_{axis}"] for m in members])) for axis in AXES
                }
    return found


def central(values: np.ndarray) -> dict[str, Any]:
    """`metrics.central` as it stands in the results."""
    return metrics.central(values).as_tree()
