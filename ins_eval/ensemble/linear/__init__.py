"""Experiment "linear": flights of instruments by first-order error dynamics along the true flight.

The instruments are those of the experiment "flight", number by number: the same constants and the same random
streams, sample by sample, through chamber, oven and flight. What differs is the arithmetic. Sensors, calibration and
compensation are worked out for a block of instruments at once, and what is left of the errors is put into the
equations of `error_dynamics` once a second, while "flight" navigates every sample with every compensation. Left out
are errors of second order (an error of position of 50 km is no small one) and the rounding to whole pulses.

    course.py        what all instruments share on one mission
    instruments.py   a block of instruments, calibrated and refined
    flight.py        aligned, navigated, reduced to the measures of a flight
    agreement.py     how far it is from the flight in full

A member is a block of `plan.BLOCK` instruments, or one of them where each flies a mission of its own; the memory it
takes does not grow with their number.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from ins_eval.compensation.registry import BUILT_IN, REFINED
from ins_eval.ensemble.conditions import conditions
from ins_eval.ensemble.flight import MISSION
from ins_eval.ensemble.linear.agreement import AGREED, Agreement, agreement, joined
from ins_eval.ensemble.linear.course import Course, unfit_profile
from ins_eval.ensemble.linear.flight import Measures, fly
from ins_eval.ensemble.linear.instruments import Instruments
from ins_eval.ensemble.plan import BLOCK, Plan
from ins_eval.ensemble.world import World
from ins_eval.imu import Mission

__all__ = ["AGREED", "Agreement", "agreement", "fly_linearly", "joined", "member", "unfit"]


@lru_cache(maxsize=8)
def _course(mission: Mission) -> Course:
    """The course of a mission that many instruments share."""
    return Course(mission)


def member(world: World, index: int) -> Measures:
    """One block of m instruments: of each compensation, and `MISSION`, what `ensemble.flight.fly` has, (m, ...)."""
    if world.missions is None:
        return fly_linearly(world, range(BLOCK * index, BLOCK * (index + 1)))
    mission, instrument = world.mission(index), Instruments(world, [index])
    found = fly(instrument, Course(mission), instrument.triads(_course(world.oven)))
    return found | {MISSION: {key: value[None] for key, value in conditions(mission, world.oven).items()}}


def fly_linearly(world: World, indexes: Sequence[int]) -> Measures:
    """What the instruments with these numbers contribute to the measures, by compensation: (m, ...)."""
    instruments = Instruments(world, indexes)
    triads = instruments.triads(_course(world.oven))
    return fly(instruments, _course(world.flight), triads)


def unfit(plan: Plan) -> str | None:
    """Why a plan can be flown in full only, or None."""
    world = World(plan)
    if world.missions is None:
        if users := [arm for arm in plan.arms if arm.removesuffix(REFINED) not in BUILT_IN]:
            return f"{users[0]} is not built in, and sees one instrument at a time"
        if world.population.gradient:
            return "the places of the accelerometers have temperatures of their own"
    return unfit_profile(world.flight)
