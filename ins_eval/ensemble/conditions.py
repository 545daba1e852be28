"""On which missions a compensation helps: errors against what the missions were like."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ins_eval import metrics
from ins_eval.ensemble.inference import exceedance
from ins_eval.imu import Mission
from ins_eval.missions import cruise
from ins_eval.profile import Profile
from ins_eval.streams import Streams
from ins_eval.units import DEG, MINUTE

VELOCITY = "velocity_rms_horizontal"
LEAST = 5  # missions of which a ratio is given
RESAMPLES = 2000

# Groups of missions: the condition, then the ends of each group, round numbers that were set from what the population
# draws, before any result by condition was seen; "warmer_c" around the day that the oven repeats.
GROUPS: dict[str, tuple[float, ...]] = {
    "warmer_c": (-np.inf, -10.0, 10.0, np.inf),
    "span_c": (0.0, 15.0, 25.0, np.inf),
    "turns": (0, 3, 6, np.inf),
    "along_meridian": (0.0, 0.5, 1.0),
    "since_on_h": (0.0, 3.5, np.inf),
}
# What the logarithm of the ratio is regressed on, each in the step stated.
STEPS: dict[str, float] = {"away_c": 10.0, "span_c": 10.0, "turns": 5.0, "along_meridian": 1.0}


def conditions(mission: Mission, oven: Mission) -> dict[str, np.ndarray]:
    """What a mission was like; temperatures from time 0 on, of the IMU.

    warmer_c         mean difference to the oven run with which instruments were refined
    span_c           warmest less coldest
    turns            how many in the cruise
    along_meridian   cos^2 of the heading on the stand: 1 north or south, 0 east or west
    since_on_h       time since it was last switched on; infinite where it never was
    """
    profile, flown, heated = mission.profile, mission.temperature, oven.temperature
    later = flown.time_s >= 0.0
    temperature_c = flown.temperature_c[later]
    oven_c = np.interp(flown.time_s[later], heated.time_s, heated.temperature_c)
    begin_s, end_s = cruise(profile)
    found = {
        "warmer_c": np.mean(temperature_c - oven_c),
        "span_c": np.ptp(temperature_c),
        "turns": sum(begin_s <= turn.at_s < end_s for turn in profile.turn),
        "along_meridian": np.cos(profile.start.heading_deg * DEG) ** 2,
        "since_on_h": _since_on_h(profile),
        "latitude_deg": profile.start.latitude_deg,
        "stand_min": profile.start.stand_s / MINUTE,
    }
    return {key: np.asarray(float(value)) for key, value in found.items()}


def _since_on_h(profile: Profile) -> float:
    hours = 0.0
    for stretch in reversed(profile.thermal.before):
        if stretch.on:
            return hours
        hours += stretch.hours
    return np.inf


def by_condition(
    arms: Mapping[str, Mapping[str, np.ndarray]],
    flown: Mapping[str, np.ndarray],
    pair: tuple[str, str],
    streams: Streams,
) -> dict[str, Any]:
    """Of a pair (new, old) of arms the horizontal velocity RMS on missions of each kind.

    ``groups[condition]`` is a list of {from, to, count, ratio, interval95, improved}; of fewer than `LEAST` missions no
    ratio is given. ``slopes[condition]`` is the factor {ratio, interval95} on a mission's own ratio for each step of
    `STEPS`, the others held: least squares of its logarithm, bootstrap over missions.
    """
    groups = {}
    for condition, ends in GROUPS.items():
        group = np.searchsorted(ends[1:-1], flown[condition], side="right")  # the outer groups hold what lies beyond
        groups[condition] = [
            _group(arms, group == k, (low, high), pair, streams.at(condition, k))
            for k, (low, high) in enumerate(zip(ends, ends[1:], strict=False))
        ]
    return {"groups": groups, "slopes": _slopes(arms, flown, pair, streams.at("slopes").rng())}


def _group(arms, inside: np.ndarray, ends: tuple[float, float], pair: tuple[str, str], streams: Streams):
    low, high = (float(end) if np.isfinite(end) else None for end in ends)
    found: dict[str, Any] = {"from": low, "to": high, "count": int(np.count_nonzero(inside))}
    if found["count"] < LEAST:
        return found
    chosen = {arm: {VELOCITY: arms[arm][VELOCITY][inside]} for arm in pair}
    statistics = {VELOCITY: metrics.root_mean_square}
    ratio = metrics.paired_bootstrap(chosen, statistics, [pair], streams.rng()).ratios["/".join(pair)][VELOCITY]
    new, old = (chosen[arm][VELOCITY] for arm in pair)
    return found | {
        "ratio": ratio.ratio,
        "interval95": [ratio.low, ratio.high],
        "improved": exceedance(0.0, np.log(old / new)).as_tree(),
    }


def _slopes(arms, flown: Mapping[str, np.ndarray], pair: tuple[str, str], rng: np.random.Generator) -> dict[str, Any]:
    new, old = (arms[arm][VELOCITY] for arm in pair)
    regressors = {**flown, "away_c": np.abs(flown["warmer_c"])}
    used = {name: step for name, step in STEPS.items() if np.ptp(regressors[name]) > 0.0}
    size = new.size
    if size < 2 * LEAST * (len(used) + 1):
        return {}
    design = np.column_stack([np.ones(size), *(regressors[name] / step for name, step in used.items())])
    rows = np.vstack([np.arange(size), rng.integers(0, size, (RESAMPLES, size))])
    log_ratio = np.log(new / old)
    normal = np.einsum("rij,rik->rjk", design[rows], design[rows])
    right = np.einsum("rij,ri->rj", design[rows], log_ratio[rows])
    factors = np.exp(np.linalg.solve(normal, right[..., None])[..., 0])
    tail = (1.0 - metrics.CONFIDENCE) / 2.0
    low, high = np.quantile(factors[1:], [tail, 1.0 - tail], axis=0)
    return {
        name: {"ratio": float(factors[0, k]), "interval95": [float(low[k]), float(high[k])], "step": step}
        for k, (name, step) in enumerate(used.items(), start=1)
    }
