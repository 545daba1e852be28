"""Ensembles that are flown linearly, some of their instruments in full as well, so that each says how far it is off."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ins_eval import ensemble
from ins_eval.ensemble import Plan
from ins_eval.ensemble.linear import AGREED, Agreement, agreement, joined, unfit

Plans = Mapping[str, tuple[Plan, int]]  # a plan and its size in instruments, by label
Members = Mapping[str, list[dict[str, Any]]]  # finished members, by label
Run = Callable[[Plans], Members]


class Linearly(NamedTuple):
    """An ensemble of more than `in_full` instruments is flown linearly, `checked` of them in full as well."""

    in_full: int
    checked: int


LINEARLY = {"all": Linearly(200, 40), "missions": Linearly(10, 10)}
TOO_LARGE = ("none",)  # compensations whose errors, tens of kilometres, are not of first order


def linear(label: str) -> str:
    """Label of an ensemble where it is flown linearly."""
    return f"{label}/linear"


def size(plans: Plans, label: str) -> int:
    """How many instruments an ensemble has, whichever way they are flown."""
    return plans[linear(label) if linear(label) in plans else label][1]


def flown(members: Members, label: str, count: int | None = None) -> dict[str, dict[str, np.ndarray]]:
    """``[arm][key]``, instruments of an ensemble along the first axis; of those flown linearly the first `count`."""
    if linear(label) in members:
        return joined(members[linear(label)], count)
    return ensemble.stacked(members[label])


def run(plans: Plans, run_members: Run) -> tuple[Plans, Members, dict[str, Agreement]]:
    """Fly ensembles, those of `LINEARLY` linearly where that can be, and in full where any instrument differs.

    Returns the plans as they were flown, the members of each, and by label how far the linear flights are from the
    same in full, in whichever way the instruments were flown then.
    """
    linearly = _linearly(plans)
    asked = {**plans, **linearly}
    members = run_members(asked)
    agreed = {label: _agreement(members, label, plans[label][1]) for label in LINEARLY if linear(label) in linearly}
    if apart := [label for label, found in agreed.items() if found.worst > AGREED]:
        for label in apart:
            del asked[linear(label)]
            asked[label] = plans[label]
        members = run_members(asked)
    return asked, members, agreed


def _agreement(members: Members, label: str, count: int) -> Agreement:
    arms = {arm: found for arm, found in flown(members, label, count).items() if arm != ensemble.MISSION}
    return agreement(arms, ensemble.stacked(members[label]))


def _linearly(plans: Plans) -> dict[str, tuple[Plan, int]]:
    found: dict[str, tuple[Plan, int]] = {}
    for label, (in_full, checked) in LINEARLY.items():
        if label in plans and plans[label][1] > in_full and unfit(plans[label][0]) is None:
            plan, count = plans[label]
            arms = tuple(arm for arm in plan.arms if arm not in TOO_LARGE)
            found |= {label: (plan, checked), linear(label): (replace(plan, experiment="linear", arms=arms), count)}
    return found


def as_tree(members: Members, label: str, agreed: Mapping[str, Agreement]) -> dict[str, Any]:
    """What stands beside an ensemble in ``metrics.json``: "linear", or nothing where all were flown in full at once."""
    if label not in agreed:
        return {}
    return {"linear": {"taken": linear(label) in members, **agreed[label].as_tree()}}
