"""``ins-eval flight-report``: how good is the INS with each compensation, and is the difference real?"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ins_eval import ensemble, metrics
from ins_eval.commands import after_storage, flight_study, missions_study
from ins_eval.commands.flight_figures import path, temperature, traces
from ins_eval.commands.flight_study import PAPER, SHOWN_ARMS, SINGLE_FLIGHT, Shown, by_arm
from ins_eval.compensation.check import require_sound
from ins_eval.compensation.registry import load_model, model_files
from ins_eval.ensemble import ARMS, SOURCES, Plan, World
from ins_eval.ensemble.stored import stored
from ins_eval.missions import find as find_missions
from ins_eval.profile import find
from ins_eval.report import figures
from ins_eval.report.flight import flight_content
from ins_eval.report.results import as_json, made_with, write_results
from ins_eval.storage import write_whole
from ins_eval.streams import Streams

DRAWN = ("simple", "simple_refined", "hysteresis", "hysteresis_refined")  # in figures with one curve for each


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
    population_of_missions: str = missions_study.POPULATION,
) -> int:
    """Compute, write ``metrics.json``, ``manifest.json``, figures, page and text into `output`, print the text.

    With `storage_years` of 0 nothing is said of storage, with 0 `missions` nothing of missions and other `flights`;
    None means the usual number of missions, or `size` where that is less.
    """
    users: tuple[str, ...] = ()
    if model is not None:
        require_sound(load_model(model))
        users = (model, f"{model}_refined")
    names = {spec: load_model(spec).name for spec in ARMS + users}
    plan = Plan(profile=profile, population=population, arms=ARMS + users, seed=seed)
    world = World(plan)  # refuses what cannot be flown before anything is written
    units = stored(storage_years, seed)
    plans = flight_study.plans(plan, size)
    if storage_years:
        plans |= after_storage.plans(plan, size, units)
    missions = min(size, missions_study.SIZE) if missions is None else missions
    plans |= missions_study.plans(plan, missions, flights, population_of_missions)
    with ThreadPoolExecutor(1) as beside:  # the workers compute the members meanwhile
        first = beside.submit(flight_study.fly_shown, world, [*SHOWN_ARMS, *users], names)
        members = ensemble.run(plans, output / "members", workers, quiet)
        shown = first.result()
    result = flight_study.numbers(plan, size, members, shown, names, tuple(names[u] for u in users))
    if storage_years:
        result["storage"] = after_storage.numbers(plans, members, units)
    if missions:
        result["missions"] = missions_study.numbers(plans, members, names, tuple(names[u] for u in users))
    write_whole(output / "manifest.json", as_json(manifest(plan, plans)))
    answer, sections = flight_content(result)
    arms = by_arm(members, names)
    drawn = {**flight_figures(shown, result), **ensemble_figures(arms, result, Streams(seed).at("bootstrap"))}
    if missions:
        drawn |= missions_study.drawn(members, names, Streams(seed).at("missions"))
    write_results(output, f"Flight report: {result['profile']}", answer, sections, result, drawn, quiet)
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


def flight_figures(shown: Shown, result: dict[str, Any]) -> dict[str, Any]:
    """Figures of the flight shown."""
    recording, profile = shown.recording, shown.mission.profile
    gaps = next(iter(shown.navigated.values())).errors.gaps
    return {
        **path(recording.gps, 0.0, [(gap.start_s, gap.end_s) for gap in gaps]),
        **temperature(recording, [(p.name, p.from_s, p.to_s) for p in profile.phase], shown.mission.temperature),
        **traces(
            recording,
            shown.navigated,
            floor_m=result["floor"]["horizontal_m"],
            rms_mps={name: single["velocity_rms_mps"] for name, single in result["flight"].items()},
            raw=("simple", "hysteresis_refined"),
        ),
    }


def ensemble_figures(arms, result: dict[str, Any], rng: Streams) -> dict[str, Any]:
    """Figures of all instruments."""
    of_all = result["ensemble"]
    shown = [name for name in arms if name in DRAWN or name not in ARMS]
    ceps = {n: metrics.cep(arms[n]["track_m"], rng.at("cep_band", n).rng()) for n in shown}
    headline = of_all["improvement"]["hysteresis_refined/simple"]
    measures = ("velocity_rms_horizontal", "cep_rate_final", "cep_rate_radial_error_rate_rms")
    budget = {source: result["budget"][source] for source in SOURCES}
    return {
        "cep_over_time": figures.cep_over_time(
            time_s=arms["simple"]["track_s"][0],
            cep_m={n: c.value for n, c in ceps.items()},
            band_m={n: np.column_stack([c.low, c.high]) for n, c in ceps.items()},
            size=of_all["size"],
        ),
        "improvement_per_instrument": figures.improvement_per_instrument(
            ratios={m: arms["hysteresis_refined"][m] / arms["simple"][m] for m in measures},
            fraction_improved=headline["fraction_improved"],
        ),
        "error_budget": figures.error_budget(budget=budget, size=result["budget"]["size"]),
        "velocity_rms_by_compensation": figures.velocity_rms_by_compensation(
            rms_mps={n: of_all[n]["velocity_rms_mps"] for n in arms if n != "none"},
            paper_mps=PAPER["table7"],
            size=of_all["size"],
        ),
        "single_flight_rates": figures.single_flight_rates(
            rates_nmi_per_h={
                d: {n: arms[n][f"cep_rate_{d}"] for n in ("simple", "hysteresis_refined")} for d in SINGLE_FLIGHT
            },
            paper_nmi_per_h=PAPER["cep"],
        ),
    }
