"""``ins-eval paper-report``: each table, equation, procedure, figure and claim of Paper A beside ours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ins_eval import ensemble
from ins_eval.analysis import flight as flight_study
from ins_eval.calibration import FITS
from ins_eval.calibration.four_point import FourPoint, four_point
from ins_eval.ensemble import ARMS, Plan, World, chamber, oven, sensitivity
from ins_eval.figures.results.flight import ensemble_figures, flight_figures
from ins_eval.figures.results.recording import metres_per_arcmin
from ins_eval.files import write_whole
from ins_eval.laboratory import Chamber, draw_printed_units
from ins_eval.laboratory.creep_rig import CreepRig
from ins_eval.laboratory.magnet import loop, opening
from ins_eval.report.json_file import as_json, write_json
from ins_eval.report.manifest import manifest
from ins_eval.report.results import write_results
from ins_eval.streams import Streams
from ins_eval.studies.diagrams import diagrams
from ins_eval.studies.paper_a import figures, oven_figures, paired
from ins_eval.studies.paper_a.printed import PRINTED
from ins_eval.studies.paper_a.rows import rows
from ins_eval.studies.paper_a.single import single_flights, single_runs
from ins_eval.studies.paper_a.words import paper_a_content
from ins_eval.units import DEG

SOAK_C, LOOPS_C = 22.0, ((-60.0, 70.0), (-30.0, 40.0), (-10.0, 30.0), (5.0, 25.0))  # what the magnet is led through


def run(
    output: Path,
    size: int,
    seed: int,
    workers: int | None,
    quiet: bool,
    json: Path | None = None,
    scheduler: str | None = None,
) -> int:
    """Compute, write ``rows.json``, ``metrics.json``, figures, page and text into `output`, print the text."""
    flight = Plan(seed=seed)
    plans = {
        **flight_study.plans(flight, size),
        "oven": (replace(oven.PLAN, seed=seed), oven.SIZE),
        "chamber": (replace(chamber.PLAN, seed=seed), chamber.SIZE),
        **{f"sensitivity/{case}": plan for case, plan in sensitivity.plans(seed).items()},
    }
    members = ensemble.run(plans, output / "members", workers, quiet, scheduler)
    shown = flight_study.fly_shown(World(flight), flight_study.SHOWN_ARMS, {arm: arm for arm in ARMS})
    results = _results(flight, size, members, shown)
    found = rows(results)
    write_whole(output / "rows.json", as_json([asdict(row) for row in found]))
    write_whole(output / "manifest.json", as_json(manifest(flight, plans)))
    answer, sections = paper_a_content(found, results)
    drawn = _figures(members, results, shown)
    write_results(output, "Paper A, statement by statement", answer, sections, results, drawn, quiet)
    write_json(json, results)
    return 0


def _results(plan: Plan, size: int, members: Mapping[str, list], shown: flight_study.Shown) -> dict[str, Any]:
    """The tree from which rows and page are made; an estimate is ``{"value", "interval95"}``."""
    arms = flight_study.by_arm(members, {arm: arm for arm in ARMS})
    flight = flight_study.numbers(plan, size, members, shown, {arm: arm for arm in ARMS})
    streams = Streams(plan.seed)
    return {
        "seed": plan.seed,
        "chamber": chamber.summary(members["chamber"], plan.seed),
        "oven": {
            **oven.summary(members["oven"], plan.seed),
            "single": single_runs(members["oven"]),
            "choice_percent": paired.choice_percent(members["oven"], streams.at("choice")),
        },
        "flight": {
            **flight,
            "single": single_flights(arms),
            **paired.differences(arms, streams.at("difference")),
            **paired.positions(arms, streams.at("position")),
        },
        "sensitivity": sensitivity.summary(
            {case: members[f"sensitivity/{case}"] for case in sensitivity.CASES}, plan.seed
        ),
    }


# ------------------------------------------------------------------------------------------------ figures


def _figures(members: Mapping[str, list], results: dict[str, Any], shown: flight_study.Shown) -> dict[str, Figure]:
    flight = results["flight"]
    arms = flight_study.by_arm(members, {arm: arm for arm in ARMS})
    return {
        **_laboratory_figures(results),
        **_oven_figures(members["oven"], results["oven"], results["seed"]),
        **flight_figures(shown, flight),
        **ensemble_figures(arms, flight, Streams(results["seed"]).at("bootstrap")),
        "sensitivity": oven_figures.sensitivity(cases=results["sensitivity"]),
    }


def _laboratory_figures(results: dict[str, Any]) -> dict[str, Figure]:
    """Figs 1 to 8: the magnet, the creep rig, and one draw of the three printed accelerometers in the chamber."""
    streams = Streams(results["seed"]).at("instrument", 0)  # the first draw of the chamber's ensemble
    units = draw_printed_units(streams)
    points: dict[str, FourPoint] = {n: four_point(Chamber().measure(u, streams.at(n))) for n, u in units.items()}
    columns = {name: vars(of_unit) for name, of_unit in points.items()}
    fitted = {
        name: {
            model: FITS[model][0](p.temperature_c, p.rate_c_per_min, p.scale).evaluate(
                p.temperature_c, p.rate_c_per_min
            )
            for model in ("simple", "hysteresis")
        }
        for name, p in points.items()
    }
    of_chamber = results["chamber"]
    return {
        **diagrams(Path(figures.__file__).with_name("diagrams.toml")),
        "magnet_loops": figures.magnet_loops(
            loops={
                f"{cold:g} to {hot:g} °C".replace("-", "−"): loop((SOAK_C, cold, hot, cold))[1:]
                for cold, hot in LOOPS_C
            }
        ),
        "loop_opening": figures.loop_opening(openings={n: opening(u)._asdict() for n, u in units.items()}),
        "creep_elongation": figures.creep_elongation(runs=[block._asdict() for block in CreepRig().first()]),
        "scale_factor_by_temperature": figures.scale_factor_by_temperature(units=columns),
        "bias_by_temperature": figures.bias_by_temperature(units=columns),
        "compensated_scale_factor": figures.compensated_scale_factor(units=columns, fitted=fitted),
        "temperature_sensitivity": figures.temperature_sensitivity(
            ours=of_chamber["table4"],
            printed={unit: PRINTED[unit]["table4"] for unit in of_chamber["table4"]},
            scaled=of_chamber["table4_scaled"],
            draws=of_chamber["draws"],
        ),
    }


def _oven_figures(members: list, results: dict[str, Any], seed: int) -> dict[str, Figure]:
    """Figs 9 and 10, and what lies behind one of the best of ten."""
    pair = (oven.SIMPLE, oven.HYSTERESIS)
    first = {
        case: {arm: {axis: members[0][f"{arm}/{case}"][f"velocity_rms_{axis}"] for axis in oven.AXES} for arm in pair}
        for case in oven.CASES
    }
    best = {
        case: int(np.argmin(arms[oven.HYSTERESIS]["horizontal"] / arms[oven.SIMPLE]["horizontal"]))
        for case, arms in first.items()
    }
    case = results["shown"]["case"]
    world = World(replace(oven.PLAN, seed=seed, arms=pair))
    errors = [oven.errors_of_run(world, 0, run, case) for run in range(oven.RUNS)]
    time_s = errors[0][pair[0]].time_s
    place = world.oven.profile.start
    per_arcmin = metres_per_arcmin(place.latitude_deg * DEG, place.height_m)

    table6 = PRINTED["table6"]

    def traces(of_errors) -> dict[str, np.ndarray]:
        return {arm: np.array([of_errors(run[arm]) for run in errors]) for arm in pair}

    return {
        "oven_velocity_error": oven_figures.oven_velocity_error(
            time_s=time_s,
            east_mps=traces(lambda e: e.velocity_n[:, 1]),
            north_mps=traces(lambda e: e.velocity_n[:, 0]),
            best=best[case],
            case=case,
        ),
        "oven_position_error": oven_figures.oven_position_error(
            time_s=time_s,
            longitude_arcmin=traces(lambda e: e.east_m / per_arcmin["longitude"]),
            latitude_arcmin=traces(lambda e: e.north_m / per_arcmin["latitude"]),
            best=best[case],
            case=case,
        ),
        "oven_runs": oven_figures.oven_runs(
            rms_mps=first,
            best=best,
            printed_mps={oven.SIMPLE: table6["simple"], oven.HYSTERESIS: table6["hysteresis"]},
        ),
        "best_of_ten": oven_figures.best_of_ten(
            ratios={
                axis: np.array(
                    [
                        m[f"{oven.HYSTERESIS}/{case}"][f"velocity_rms_{axis}"]
                        / m[f"{oven.SIMPLE}/{case}"][f"velocity_rms_{axis}"]
                        for m in members
                    ]
                )
                for axis in ("east", "north", "horizontal")
            },
            printed={axis: table6["hysteresis"][axis] / table6["simple"][axis] for axis in table6["simple"]},
            case=case,
        ),
        "refinement": oven_figures.refinement(
            rms_mps=results["refinement_cases"],
            unrefined_mps={c: results[c]["hysteresis"]["horizontal"] for c in oven.CASES},
            size=results["size"],
        ),
    }
