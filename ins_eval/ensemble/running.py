"""Members computed in parallel: what is missing is computed, the rest is read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib import import_module
from pathlib import Path

import numpy as np

from ins_eval import parallel
from ins_eval.ensemble.plan import Plan
from ins_eval.ensemble.store import Store
from ins_eval.ensemble.world import World
from ins_eval.progress import progress


@lru_cache(maxsize=64)
def _world(plan: Plan) -> World:
    return World(plan)


def _members(index: int, plans: Sequence[Plan]) -> list[dict[str, dict[str, np.ndarray]]]:
    """The members of one number, which share an instrument; runs in a worker."""
    return [import_module(f"ins_eval.ensemble.{plan.experiment}").member(_world(plan), index) for plan in plans]


def run(
    plans: Mapping[str, tuple[Plan, int]],
    folder: Path,
    workers: int | None = None,
    quiet: bool = False,
    scheduler: str | None = None,
) -> dict[str, list[dict[str, dict[str, np.ndarray]]]]:
    """Compute what is missing of several ensembles and return all their members, in order of their numbers.

    Parameters: ``plans[label]`` is a plan and its size in instruments, `Plan.together` of them a member; `folder`
    keeps the members; `workers` and `scheduler` as in `parallel.results`; a bar with the time to go is shown unless
    `quiet`.
    Raises: StorageError for a full disk or a folder that cannot be written.
    """
    stores = {label: Store(folder / plan.key()).open() for label, (plan, _) in plans.items()}
    counts = {label: -(-size // plan.together) for label, (plan, size) in plans.items()}
    found = {label: [stores[label].read(index) for index in range(count)] for label, count in counts.items()}
    missing: dict[int, list[str]] = {}
    for index in range(max(counts.values(), default=0)):
        if labels := [label for label in plans if index < counts[label] and found[label][index] is None]:
            missing[index] = labels
    jobs = {index: (index, [plans[label][0] for label in labels]) for index, labels in missing.items()}
    count = sum(map(len, missing.values()))
    with progress(count, "instruments", quiet or not missing) as bar:
        for index, members in parallel.results(_members, jobs, workers, scheduler):
            for label, member in zip(missing[index], members, strict=True):
                stores[label].write(index, member)
                found[label][index] = member
            bar.update(len(members))
    return {label: [member for member in members if member is not None] for label, members in found.items()}


def stacked(members: list[dict[str, dict[str, np.ndarray]]]) -> dict[str, dict[str, np.ndarray]]:
    """``[arm][key]`` with the members along the first axis."""
    return {arm: {key: np.stack([m[arm][key] for m in members]) for key in members[0][arm]} for arm in members[0]}
