"""``ins-eval flight-report``: how good is the INS with each compensation, and is the difference real?"""

from __future__ import annotations

import hashlib
import importlib.metadata
import platform
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ins_eval import ensemble, metrics
from ins_eval.commands.flight_figures import path, temperature, traces
from ins_eval.compensation.check import require_sound
from ins_eval.compensation.registry import load_model, model_files
from ins_eval.ensemble import ARMS, SOURCES, Plan, World
from ins_eval.evaluate import Evaluation, compensate, evaluate, measures, samples, standstill_to_align_on
from ins_eval.imu import Mission
from ins_eval.profile import find, load
from ins_eval.recording import Fixes, Recording
from ins_eval.reference import outages, summary
from ins_eval.report import figures
from ins_eval.report.flight import flight_content
from ins_eval.report.results import as_json, write_results
from ins_eval.storage import write_whole
from ins_eval.streams import Streams
from ins_eval.units import ARCSEC, HOUR, NMI

SHOWN_RATE_HZ = 100.0
BUDGET_SIZE = 40
BUDGET_ARMS = ("simple", "simple_refined", "hysteresis", "hysteresis_refined")
SHOWN_ARMS = ("simple", "simple_refined", "hysteresis", "hysteresis_refined")
CEP_TIMES_S = (1800.0, 3600.0, 7200.0)
PAIRS = (
    ("hysteresis_refined", "simple"),
    ("hysteresis", "simple"),
    ("simple_refined", "simple"),
    ("hysteresis_refined", "simple_refined"),
    ("hysteresis", "hysteresis_without_rate"),
    ("hysteresis_scale_only", "simple"),
    ("hysteresis_bias_only", "simple"),
    ("quadratic", "simple"),
    ("simple", "none"),
)
PAPER = {  # Paper A, Table 7 and section 3.2, one flight
    "table7": {"simple": {"east": 1.36, "north": 1.40}, "hysteresis": {"east": 1.09, "north": 1.19}},
    "cep": {"simple": 1.54, "hysteresis": 1.29},
}
SINGLE_FLIGHT = ("final", "least_squares", "radial_error_rate_rms")  # definitions that a single flight has, too
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
) -> int:
    """Compute, write ``metrics.json``, ``manifest.json``, figures, page and text into `output`, print the text."""
    users: tuple[str, ...] = ()
    if model is not None:
        require_sound(load_model(model))
        users = (model, f"{model}_refined")
    names = {spec: load_model(spec).name for spec in ARMS + users}
    plan = Plan(profile=profile, population=population, arms=ARMS + users, seed=seed)
    world = World(plan)  # refuses what cannot be flown before anything is written
    budget = {
        s: (Plan(profile=profile, population=population, arms=BUDGET_ARMS, seed=seed, source=s), min(size, BUDGET_SIZE))
        for s in SOURCES
    }
    members = ensemble.run({"all": (plan, size), **budget}, output / "members", workers, quiet)
    arms = {names[spec]: data for spec, data in ensemble.stacked(members["all"]).items()}
    rng = Streams(seed).at("bootstrap")
    shown = _shown(world, [*SHOWN_ARMS, *users], names)
    result: dict[str, Any] = {
        "format": "ins-eval-metrics/1",
        "profile": load(profile).name,
        "seed": seed,
        "t0_s": 0.0,
        "duration_s": load(profile).duration_s,
        "definitions": _definitions(),
        "floor": _floor(world),
        "ensemble": _ensemble(arms, size, rng, tuple(names[u] for u in users)),
        "budget": {"size": min(size, BUDGET_SIZE), **{s: _budget(ensemble.stacked(members[s]), rng) for s in SOURCES}},
        "flight": {name: measures(e) for name, e in shown.navigated.items()},
        "gps": _gps(shown.recording.gps),
        "alignment": _alignment_errors(shown),
        "paper": {**PAPER, "percentile_of_paper": _percentiles(arms)},
    }
    write_whole(output / "manifest.json", as_json(_manifest(plan, size)))
    answer, sections = flight_content(result)
    drawn = {**_flight_figures(shown, result), **_ensemble_figures(arms, result, rng)}
    write_results(output, f"Flight report: {result['profile']}", answer, sections, result, drawn, quiet)
    return 0


# ------------------------------------------------------------------------------------------------ metrics


def _definitions() -> dict[str, dict[str, str]]:
    velocity = {
        "words": "RMS over the instruments of the RMS over each flight of INS minus GPS velocity, without outages",
        "formula": "sqrt(mean_i mean_t (dv_i^2))",
        "window": "0 <= t <= T, every valid epoch alike",
        "source": "the RMS of Paper A's Table 7, which is of one flight",
    }
    described = ("words", "formula", "window", "source")
    return {
        "velocity_rms": velocity,
        **{k: {w: getattr(d, w) for w in described} for k, d in metrics.DEFINITIONS.items()},
    }


def _estimate(estimate: metrics.Estimate) -> dict[str, Any]:
    return {"value": float(estimate.value), "interval95": [float(estimate.low), float(estimate.high)]}


def _arm(estimates: dict[str, metrics.Estimate]) -> dict[str, Any]:
    """One compensation: estimates by measure, sorted into velocity RMS and CEP rates."""
    groups: dict[str, dict[str, Any]] = {"velocity_rms_mps": {}, "cep_rate_nmi_per_h": {}}
    for measure, estimate in estimates.items():
        kind, key = (
            ("velocity_rms_mps", measure[13:])
            if measure.startswith("velocity_rms_")
            else ("cep_rate_nmi_per_h", measure[9:])
        )
        groups[kind][key] = _estimate(estimate)
    return groups


def _ensemble(arms, size: int, rng: Streams, users: tuple[str, ...]) -> dict[str, Any]:
    pairs = list(PAIRS)
    for user in users:
        refined = user.endswith("_refined")
        pairs += [
            (user, "simple_refined" if refined else "simple"),
            (user, "hysteresis_refined" if refined else "hysteresis"),
        ]
    compared = metrics.paired_bootstrap(arms, ensemble.STATISTICS, pairs, rng.at("ensemble").rng())
    result: dict[str, Any] = {"size": size, "rate_hz": ensemble.RATE_HZ, "improvement": {}}
    for arm, estimates in compared.arms.items():
        result[arm] = _arm(estimates)
        track_s = arms[arm]["track_s"][0]
        at = [int(np.argmin(np.abs(track_s - t))) for t in CEP_TIMES_S if t <= track_s[-1]]
        cep = metrics.cep(arms[arm]["track_m"][:, at], rng.at("cep", arm).rng())
        result[arm]["cep_nmi_at_s"] = {
            f"{track_s[k]:.0f}": _estimate(metrics.Estimate(cep.value[i] / NMI, cep.low[i] / NMI, cep.high[i] / NMI))
            for i, k in enumerate(at)
        }
    for pair, ratios in compared.ratios.items():
        first, second = pair.split("/")
        result["improvement"][pair] = {
            **{
                measure: {"ratio": r.ratio, "interval95": [r.low, r.high], "log_sd": r.log_sd}
                for measure, r in ratios.items()
            },
            "fraction_improved": {
                measure: _estimate(metrics.exceedance(0.0, np.log(arms[second][measure] / arms[first][measure])))
                for measure in ("velocity_rms_horizontal", "cep_rate_final", "cep_rate_radial_error_rate_rms")
            },
        }
    return result


def _budget(arms, rng: Streams) -> dict[str, Any]:
    measures = {m: ensemble.STATISTICS[m] for m in ("velocity_rms_horizontal", "cep_rate_final")}
    compared = metrics.paired_bootstrap(arms, measures, (), rng.at("budget").rng())
    return {arm: {m: _estimate(e) for m, e in estimates.items()} for arm, estimates in compared.arms.items()}


def _percentiles(arms) -> dict[str, Any]:
    """Share in percent of our single flights below the published one."""
    of = {"simple": "simple", "hysteresis": "hysteresis_refined"}
    result: dict[str, Any] = {}
    for printed, arm in of.items():
        for definition in SINGLE_FLIGHT:
            above = metrics.exceedance(PAPER["cep"][printed], arms[arm][f"cep_rate_{definition}"])
            result.setdefault(printed, {})[definition] = {
                "value": 100.0 * (1.0 - above.value),
                "interval95": [100.0 * (1.0 - above.high), 100.0 * (1.0 - above.low)],
            }
    return result


def _floor(world: World) -> dict[str, Any]:
    """Errors of the whole chain without any sensor error, at the rate of the flight shown and of the ensemble."""
    floors = {}
    for rate_hz in (SHOWN_RATE_HZ, world.plan.rate_hz):
        ideal = Mission(world.flight.profile, rate_hz).ideal()
        errors = evaluate(ideal, ideal.imu.accelerometer).errors
        horizontal = float(np.hypot(errors.north_m, errors.east_m).max())
        floors[rate_hz] = {
            "rate_hz": rate_hz,
            "horizontal_m": horizontal,
            "velocity_mps": float(np.abs(errors.velocity_n[:, :2]).max()),
            "rate_nmi_per_h": horizontal / NMI / (errors.time_s[-1] / HOUR),
        }
    return {**floors[SHOWN_RATE_HZ], "ensemble": floors[world.plan.rate_hz], "vertical": _other_verticals(world)}


def _other_verticals(world: World) -> dict[str, Any]:
    """Diagnostics: the same without any sensor error, with the vertical channel left free or its height frozen."""
    ideal = world.flight.ideal()
    found = {}
    for vertical in ("free", "frozen"):
        errors = evaluate(ideal, ideal.imu.accelerometer, vertical=vertical).errors
        found[vertical] = {
            "height_m": float(np.abs(errors.down_m).max()),
            "horizontal_m": float(np.hypot(errors.north_m, errors.east_m).max()),
            "velocity_mps": float(np.abs(errors.velocity_n[:, :2]).max()),
        }
    return found


def _gps(fixes: Fixes) -> dict[str, Any]:
    silent = summary(outages(fixes))
    return {
        "fixes": int(fixes.valid.sum()),
        "outages": silent.count,
        "outage_s": silent.total_s,
        "longest_s": silent.longest_s,
    }


def _manifest(plan: Plan, size: int) -> dict[str, Any]:
    needed = [
        r.split(">")[0].split("=")[0].split("<")[0].strip() for r in importlib.metadata.requires("ins-eval") or ()
    ]
    file = find(plan.profile)
    return {
        "plan": asdict(plan),
        "key": plan.key(),
        "size": size,
        "inputs": {
            Path(f).name: hashlib.sha256(Path(f).read_bytes()).hexdigest() for f in [file, *model_files(plan.arms)]
        },
        "versions": {
            "python": platform.python_version(),
            **{n: importlib.metadata.version(n) for n in ["ins-eval", *needed]},
        },
        "machine": {"architecture": platform.machine(), "system": platform.system(), "byte_order": sys.byteorder},
    }


# ------------------------------------------------------------------------------------------------ the flight shown


@dataclass(frozen=True)
class _Shown:
    """The first instrument of the ensemble, flown once at full rate; the first, not a chosen one."""

    mission: Mission
    recording: Recording
    navigated: dict[str, Evaluation]


def _alignment_errors(shown: _Shown) -> dict[str, float]:
    """Error of the attitude found on the stand, for the headline's compensation."""
    alignment = shown.navigated["hysteresis_refined"].alignment
    found = np.array(alignment.start.attitude_rad)
    truth = shown.mission.trajectory.truth(np.array([alignment.start.time_s])).attitude_rad[0]
    roll, pitch, heading = (found - truth + np.pi) % (2.0 * np.pi) - np.pi
    return {
        "roll_error_arcsec": roll / ARCSEC,
        "pitch_error_arcsec": pitch / ARCSEC,
        "heading_error_arcsec": heading / ARCSEC,
        "heading_sigma_arcsec": alignment.heading_sigma_rad / ARCSEC,
    }


def _shown(world: World, specs: list[str], names: dict[str, str]) -> _Shown:
    mission = Mission(world.flight.profile, SHOWN_RATE_HZ)
    recording = mission.record(world.instrument(0), world.streams(0).at("flight"))
    seen, stand = samples(recording), standstill_to_align_on(recording)
    triads = world.triads(0)
    navigated = {}
    for spec in specs:
        velocity = compensate(seen, triads[spec], recording.start.time_s)
        navigated[names[spec]] = evaluate(recording, velocity, align_on=stand)
    return _Shown(mission, recording, navigated)


def _flight_figures(shown: _Shown, result: dict[str, Any]) -> dict[str, Any]:
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


def _ensemble_figures(arms, result: dict[str, Any], rng: Streams) -> dict[str, Any]:
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
