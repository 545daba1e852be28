"""Missions: each instrument on a mission of its own, and named flights other than that whose temperatures the oven has.

The instruments are those of the flight report, with the same calibration and oven run; what differs is what they fly.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from ins_eval import ensemble, metrics
from ins_eval.analysis import both_ways
from ins_eval.analysis.flight import PAIRS as ALL_PAIRS
from ins_eval.analysis.flight import SHOWN_ARMS, ensemble_numbers
from ins_eval.ensemble import MISSION, Plan, World
from ins_eval.ensemble.conditions import VELOCITY, by_condition
from ins_eval.ensemble.linear import Agreement
from ins_eval.errors import UsageError
from ins_eval.missions import Missions
from ins_eval.profile import load
from ins_eval.streams import Streams
from ins_eval.tree import as_tree

POPULATION = "worldwide"
SIZE = 50  # what a report of a minute has time for; a sure sign in velocity takes some 400
LABEL = "missions"
PAIRS = (
    ("hysteresis", "simple"),
    ("simple_refined", "simple"),
    ("hysteresis_refined", "simple"),
    ("hysteresis_refined", "hysteresis"),
    ("hysteresis_refined", "simple_refined"),
)


def plans(fresh: Plan, size: int, flights: Sequence[str], population: str = POPULATION) -> dict[str, tuple[Plan, int]]:
    """The ensembles beside the `fresh` one: `size` missions of the population, and as many on each of `flights`."""
    if size < 2:
        if size or flights:
            raise UsageError(f"missions: {size} of them; expected at least 2, or 0 and no other flights")
        return {}
    oven = fresh.oven or fresh.profile
    Missions.load(population)  # refuses what cannot be flown
    for name in flights:
        World(replace(fresh, profile=name, oven=oven))
    return {
        LABEL: (replace(fresh, missions=population), size),
        **{f"flight/{name}": (replace(fresh, arms=SHOWN_ARMS, profile=name, oven=oven), size) for name in flights},
    }


def numbers(
    plans: Mapping[str, tuple[Plan, int]],
    members: Mapping[str, list[dict[str, Any]]],
    names: Mapping[str, str],
    users: Sequence[str] = (),
    agreed: Mapping[str, Agreement] = MappingProxyType({}),
) -> dict[str, Any]:
    """What missions do, from the finished `members` of `plans`, those of the flight of all under "all".

    `agreed` says how far linear ensembles are from flights in full, by label.

    population   its name and the sources of difference that are on
    ensemble     as that of the flight of all, see `flight_study`
    conditions   ``[pair]``: on which missions it helps, see `ensemble.conditions.by_condition`; in the pair "a/b" the
                 ratio is that of a to b
    range        of the conditions: smallest, median and largest over the missions
    flights      ``[name]``: size, and improvement as in the ensemble, on the flight of all and on those named
    """
    plan, size = plans[LABEL][0], both_ways.size(plans, LABEL)
    streams = Streams(plan.seed).at("missions")
    arms, flown = by_mission(members, names)
    missions = Missions.load(plan.missions).without(*plan.missions_off)
    flights = {label.partition("/")[2]: label for label in plans if label.startswith("flight/")}
    return {
        "population": {"name": missions.name, "sources": list(missions.sources)},
        "ensemble": ensemble_numbers(arms, size, streams.at("bootstrap"), users, _pairs(arms))
        | both_ways.as_tree(members, LABEL, agreed),
        "conditions": {
            f"{new}/{old}": by_condition(arms, flown, (new, old), streams.at("conditions", new, old))
            for new, old in PAIRS
        },
        "range": {key: _range(values) for key, values in flown.items()},
        "flights": {
            name: _on_flight(load(plans[label][0].profile).name, members[label], streams.at("flight", name))
            for name, label in {plan.profile: "all", **flights}.items()
        },
    }


def by_mission(
    members: Mapping[str, list[dict[str, Any]]], names: Mapping[str, str]
) -> tuple[dict[str, dict[str, np.ndarray]], dict[str, np.ndarray]]:
    """Contributions of all missions by the name of the compensation, and what each mission was like."""
    groups = both_ways.flown(members, LABEL)
    flown = groups.pop(MISSION)
    return {names[spec]: data for spec, data in groups.items()}, flown


def _pairs(arms: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The pairs of the flight of all, and every compensation against the simple one."""
    return list(dict.fromkeys([*ALL_PAIRS, *((arm, "simple") for arm in arms if arm != "simple")]))


def _range(values: np.ndarray) -> list[float | None]:
    """Smallest, median and largest; None for what is infinite."""
    ordered = np.sort(values)
    three = (float(ordered[k]) for k in (0, ordered.size // 2, -1))
    return [value if np.isfinite(value) else None for value in three]


def _on_flight(words: str, members: Sequence[dict[str, Any]], streams: Streams) -> dict[str, Any]:
    arms = ensemble.stacked([{arm: member[arm] for arm in SHOWN_ARMS} for member in members])
    statistics = {m: ensemble.STATISTICS[m] for m in (VELOCITY, "cep_rate_final")}
    found = metrics.paired_bootstrap(arms, statistics, PAIRS, streams.rng()).ratios
    return {
        "words": words,
        "size": len(members),
        "improvement": as_tree(found),
    }
