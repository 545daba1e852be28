"""Many instruments in one experiment, each with every compensation: paired, in parallel, safe against a crash.

A member of the ensemble is one instrument. It is drawn, calibrated in the chamber, refined in the oven, and then goes
through the experiment of the plan once for each compensation, with the same errors in all of them. Its result depends
on the plan and its number alone, so neither the number of workers nor an interruption can change a digit.

    plan.py           what decides the numbers: profile, population, compensations, seed, experiment
    changes.py        one assumption changed: a dotted key and its value
    world.py          what the members of a plan share
    flight.py         experiment "flight": one flight of all, or a mission of its own for each
    linear/           experiment "linear": the flight of all for thousands, to first order in their errors
    conditions.py     on which missions a compensation helps
    attribution.py    what model and refinement each bring, whichever is added first
    oven.py           experiment "oven": ten runs at rest with the temperatures of the flight
    chamber.py        experiment "chamber": the printed units, calibrated
    sensitivity.py    the flight again, with one assumption changed at a time
    ageing.py         scale factors of digital accelerometers after years of ageing, and what self-calibration leaves
    response.py       what a scale-factor error does to a flight without any other
    running.py        members in parallel
    store.py          members on disk
"""

from ins_eval.ensemble.flight import MISSION, STATISTICS, contributions, fly
from ins_eval.ensemble.plan import ARMS, OVEN_RATE_HZ, RATE_HZ, SOURCES, Plan
from ins_eval.ensemble.running import run, stacked
from ins_eval.ensemble.store import Store
from ins_eval.ensemble.world import World

__all__ = [
    "ARMS",
    "MISSION",
    "OVEN_RATE_HZ",
    "RATE_HZ",
    "SOURCES",
    "STATISTICS",
    "Plan",
    "Store",
    "World",
    "contributions",
    "fly",
    "run",
    "stacked",
]
