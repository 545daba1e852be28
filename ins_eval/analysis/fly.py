"""How good an INS is with each compensation: instruments on one flight, after ageing and over missions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ins_eval.analysis import ageing, both_ways, flight, missions
from ins_eval.analysis.ageing import AgeingNumbers
from ins_eval.analysis.flight import SHOWN_ARMS, Shown
from ins_eval.compensation.check import require_sound
from ins_eval.compensation.registry import load_model
from ins_eval.ensemble import ARMS, Plan, World
from ins_eval.ensemble.ageing import Aged, aged
from ins_eval.ensemble.linear import Agreement
from ins_eval.metrics import DEFINITIONS, VelocityRms
from ins_eval.tree import as_tree

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class FlightStudy:
    """Instruments that were flown.

    `members` are the finished members of `plans`, those of the flight of all under "all"; `names` are the names of the
    compensations by what a plan calls them, `users` those that a user brought; `shown` is the first instrument in full;
    `units` are the loops whose drifts age the instruments, None where nothing is said of ageing. `agreed` says, of
    ensembles that were flown linearly, how far the instruments are from the same flown in full.
    """

    plan: Plan
    plans: Mapping[str, tuple[Plan, int]]
    members: Mapping[str, list[dict[str, Any]]]
    names: Mapping[str, str]
    users: tuple[str, ...]
    shown: Shown
    units: Aged | None
    agreed: Mapping[str, Agreement]

    @property
    def size(self) -> int:
        """How many instruments flew the flight of all."""
        return both_ways.size(self.plans, "all")

    @cached_property
    def arms(self) -> dict[str, dict[str, np.ndarray]]:
        """What each instrument contributes to every measure, by compensation."""
        return flight.by_arm(self.members, self.names, self.size)

    def to_frame(self) -> pd.DataFrame:
        """One row an instrument and compensation: velocity RMS of its flight in m/s, what it adds to CEP rates."""
        import pandas as pd

        columns = [f"velocity_rms_{axis}" for axis in VelocityRms._fields]
        columns += [f"cep_rate_{key}" for key in DEFINITIONS]
        frames = {
            arm: pd.DataFrame({key: data[key] for key in columns if data[key].ndim == 1}).rename_axis("instrument")
            for arm, data in self.arms.items()
        }
        return pd.concat(frames, names=["compensation"])

    @cached_property
    def ageing(self) -> AgeingNumbers | None:
        """What ageing does to the flight, None where nothing is said of it."""
        return None if self.units is None else ageing.numbers(self.plans, self.members, self.units)

    @cached_property
    def tree(self) -> dict[str, Any]:
        """The tree ``ins-eval-metrics/1`` of ``metrics.json``."""
        result = flight.numbers(self.plan, self.size, self.members, self.shown, self.names, self.users, self.agreed)
        if self.ageing is not None:
            result["storage"] = as_tree(self.ageing)
        if missions.LABEL in self.plans:
            result["missions"] = missions.numbers(self.plans, self.members, self.names, self.users, self.agreed)
        return result


def fly(
    plan: Plan,
    size: int,
    run: Callable[[Mapping[str, tuple[Plan, int]]], Mapping[str, list[dict[str, Any]]]],
    model: str | None = None,
    ageing_years: float = 1.0,
    missions_flown: int | None = None,
    flights: Sequence[str] = (),
) -> FlightStudy:
    """Fly `size` instruments with every shipped compensation, and with a user's `model` beside them.

    Large ensembles are flown linearly, a part of them in full as well (`both_ways.LINEARLY`); where any of these
    differs by more than 1 % all are flown in full.

    Parameters
    ----------
    plan : what is flown; ``plan.missions`` names the population of missions, None: the usual one
    run : computes the members of plans, see `ensemble.run`
    ageing_years : also with loop gains that have drifted as long; 0: nothing is said of ageing
    missions_flown : how many fly a mission of their own; None: the usual number, or `size` where that is less
    flights : other profiles to fly, the oven keeping to that of the plan

    Raises: UsageError, StorageError.
    """
    users: tuple[str, ...] = ()
    if model is not None:
        require_sound(load_model(model))
        users = (model, f"{model}_refined")
    names = {spec: load_model(spec).name for spec in ARMS + users}
    population, plan = plan.missions or missions.POPULATION, replace(plan, arms=ARMS + users, missions=None)
    world = World(plan)  # refuses what cannot be flown before anything is written
    units = aged(ageing_years, plan.seed)
    plans = flight.plans(plan, size)
    if ageing_years:
        plans |= ageing.plans(plan, size, units)
    missions_flown = min(size, missions.SIZE) if missions_flown is None else missions_flown
    plans |= missions.plans(plan, missions_flown, flights, population)
    with ThreadPoolExecutor(1) as beside:  # the workers compute the members meanwhile
        first = beside.submit(flight.fly_shown, world, [*SHOWN_ARMS, *users], names)
        flown, members, agreed = both_ways.run(plans, run)
        shown = first.result()
    named = tuple(names[user] for user in users)
    return FlightStudy(plan, flown, members, names, named, shown, units if ageing_years else None, agreed)
