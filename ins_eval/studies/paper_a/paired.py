"""The two compensations of Paper A on the same instruments: means over these and their bootstrap intervals.

A claim about a change or a ratio is tested by that change or ratio of the same instruments, not by two intervals.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ins_eval import metrics
from ins_eval.streams import Streams
from ins_eval.studies.paper_a.single import FIRST, SECOND

Arms = Mapping[str, Mapping[str, np.ndarray]]  # [arm][name]: (n, ...), a row for each instrument, in one order
TIMES_S = (1800, 3600, 6000, 8400)
EARLY_S, LATE_S, END_S = 3600, 6000, 8400
RESAMPLES = 2000
POSITIONS = ("latitude", "longitude", "position")


def differences(arms: Arms, streams: Streams) -> dict[str, Any]:
    """Position error of simple less that of refined hysteresis compensation, in m, means over the instruments.

    ``difference_m[time in s]``; ``early_excess_m``: what the early difference exceeds half of that at the end by;
    ``late_growth_m``: by how much it grows from 6000 s to the end. Parameter: ``arms[arm]`` has ``track_m`` (n, m, 2)
    and ``track_s`` (n, m).
    """
    simple, refined = (np.linalg.norm(arms[name]["track_m"], axis=2) for name in (FIRST, SECOND))
    time_s = arms[FIRST]["track_s"][0]
    at = {t: (simple - refined)[:, int(np.argmin(np.abs(time_s - t)))] for t in TIMES_S}
    wanted = {
        **{f"{t}": at[t] for t in TIMES_S},
        "early": at[EARLY_S] - 0.5 * at[END_S],
        "late": at[END_S] - at[LATE_S],
    }
    found = dict(zip(wanted, _means(np.column_stack(list(wanted.values())), streams), strict=True))
    early, late = found.pop("early"), found.pop("late")
    return {"difference_m": found, "early_excess_m": early, "late_growth_m": late}


def positions(arms: Arms, streams: Streams) -> dict[str, Any]:
    """RMS over the flight of the errors in latitude, in longitude and of both, refined hysteresis over simple.

    ``position_ratio``: of the RMS over all instruments, with its interval; ``position_improved``: share of single
    flights in which it shrinks. Parameter: as in `differences`, ``track_m`` north and east.
    """
    rms = {}
    for name in (FIRST, SECOND):
        north, east = np.moveaxis(arms[name]["track_m"], 2, 0)
        of = (north, east, np.hypot(north, east))
        rms[name] = {what: metrics.root_mean_square(error) for what, error in zip(POSITIONS, of, strict=True)}
    statistics = dict.fromkeys(POSITIONS, metrics.root_mean_square)
    compared = metrics.paired_bootstrap(rms, statistics, [(SECOND, FIRST)], streams.rng(), RESAMPLES)
    ratios = compared.ratios[f"{SECOND}/{FIRST}"]
    return {
        "position_ratio": {w: metrics.Estimate(r.ratio, r.low, r.high).as_tree() for w, r in ratios.items()},
        "position_improved": {w: float(np.mean(rms[SECOND][w] < rms[FIRST][w])) for w in POSITIONS},
    }


def choice_percent(members: Sequence[Mapping[str, Mapping[str, np.ndarray]]], streams: Streams) -> dict[str, Any]:
    """What choosing the best oven run of an instrument adds to its median run, in percentage points.

    Of the reduction of the horizontal velocity RMS, true attitude given; the mean over the instruments. Parameter:
    members of an oven plan, ``["<arm>/given"]["velocity_rms_horizontal"]`` (runs,).
    """
    ratio = [
        m[f"{SECOND}/given"]["velocity_rms_horizontal"] / m[f"{FIRST}/given"]["velocity_rms_horizontal"]
        for m in members
    ]
    gain = 100.0 * (1.0 - np.array(ratio))
    return _means((gain.max(axis=1) - np.median(gain, axis=1))[:, None], streams)[0]


def _means(values: np.ndarray, streams: Streams) -> list[dict[str, Any]]:
    """Mean of each column of (n, k) and its percentile bootstrap interval, rows resampled together."""
    chosen = streams.rng().integers(len(values), size=(RESAMPLES, len(values)))
    low, high = np.quantile(values[chosen].mean(axis=1), (0.025, 0.975), axis=0)
    return [metrics.Estimate(*one).as_tree() for one in zip(values.mean(axis=0), low, high, strict=True)]
