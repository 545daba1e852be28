"""``ins-eval flight-report``: how good is the INS with each compensation, and is the difference real?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ins_eval import ensemble
from ins_eval.analysis.fly import fly
from ins_eval.analysis.missions import POPULATION
from ins_eval.commands.delivery import deliver
from ins_eval.ensemble import Plan
from ins_eval.files import write_whole
from ins_eval.interface.fly import of_flights
from ins_eval.report.json_file import as_json
from ins_eval.report.manifest import manifest


@dataclass(frozen=True)
class Options:
    """What is flown, as ``ins-eval flight-report --help`` says it."""

    profile: str
    size: int
    seed: int
    model: str | None = None
    population: str = "jb-kt8"
    storage_years: float = 1.0
    missions: int | None = None
    flights: Sequence[str] = ()
    population_of_missions: str = POPULATION


def run(
    output: Path,
    workers: int | None,
    quiet: bool,
    json: Path | None = None,
    export: Sequence[str] = (),
    scheduler: str | None = None,
    **options: Any,
) -> int:
    """Compute, write ``metrics.json``, ``manifest.json``, figures, page and text into `output`, print the text.

    `options` are the fields of `Options`.
    """
    of = Options(**options)
    plan = Plan(of.profile, of.population, seed=of.seed, missions=of.population_of_missions)
    run_members = partial(ensemble.run, folder=output / "members", workers=workers, quiet=quiet, scheduler=scheduler)
    found = fly(plan, of.size, run_members, of.model, of.storage_years, of.missions, of.flights)
    write_whole(output / "manifest.json", as_json(manifest(found.plan, found.plans)))
    deliver(of_flights(found), output, quiet, json, export)
    return 0
