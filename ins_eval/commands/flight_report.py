"""``ins-eval flight-report``: how good is the INS with each compensation, and is the difference real?"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from ins_eval import ensemble
from ins_eval.analysis.fly import fly
from ins_eval.analysis.missions import POPULATION
from ins_eval.compensation.registry import model_files
from ins_eval.ensemble import Plan
from ins_eval.files import write_whole
from ins_eval.interface import of_flights
from ins_eval.missions import find as find_missions
from ins_eval.profile import find
from ins_eval.report.results import as_json, made_with


def run(
    output: Path,
    profile: str,
    model: str | None,
    size: int,
    seed: int,
    workers: int | None,
    quiet: bool,
    population: str = "jb-kt8",
    storage_years: float = 1.0,
    missions: int | None = None,
    flights: Sequence[str] = (),
    population_of_missions: str = POPULATION,
) -> int:
    """Compute, write ``metrics.json``, ``manifest.json``, figures, page and text into `output`, print the text."""
    plan = Plan(profile, population, seed=seed, missions=population_of_missions)
    run_members = partial(ensemble.run, folder=output / "members", workers=workers, quiet=quiet)
    found = fly(plan, size, run_members, model, storage_years, missions, flights)
    write_whole(output / "manifest.json", as_json(manifest(found.plan, found.plans)))
    of_flights(found).write(output, quiet)
    return 0


def manifest(plan: Plan, plans: Mapping[str, tuple[Plan, int]]) -> dict[str, Any]:
    """What the numbers were made from: plan, inputs, versions, machine; `plans` holds the others beside it."""
    profiles = {other.profile for other, _ in plans.values()}
    populations = {other.missions for other, _ in plans.values() if other.missions}
    files = [*map(find, sorted(profiles)), *map(find_missions, sorted(populations)), *model_files(plan.arms)]
    return {
        "plan": asdict(plan),
        "key": plan.key(),
        "sizes": {label: size for label, (_, size) in plans.items()},
        "inputs": {Path(f).name: hashlib.sha256(Path(f).read_bytes()).hexdigest() for f in files},
        **made_with(),
    }
