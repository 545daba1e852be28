"""The numbers of the flight: an ensemble with every compensation, its error budget, and one flight in full.

The flight report and the report of Paper A tell the same flight; both take it from here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from ins_eval import ensemble, metrics
from ins_eval.analysis import both_ways
from ins_eval.ensemble import SOURCES, Plan, World
from ins_eval.ensemble.attribution import attribution
from ins_eval.ensemble.inference import exceedance
from ins_eval.ensemble.linear import Agreement
from ins_eval.imu import Mission
from ins_eval.navigation import (
    Evaluation,
    compensate,
    evaluate,
    measures,
    numeric_floor,
    samples,
    standstill_to_align_on,
)
from ins_eval.profile import load
from ins_eval.published_flight import FLIGHT as PAPER
from ins_eval.recording import Fixes, Recording
from ins_eval.reference import outages, summary
from ins_eval.streams import Streams
from ins_eval.tree import as_tree
from ins_eval.units import ARCSEC, HOUR, NMI

SHOWN_RATE_HZ = 100.0
BUDGET_SIZE = 40
BESIDE_SIZE = 20  # of sources that are not in the flight: these show what they would do
BUDGET_ARMS = ("simple", "simple_refined", "hysteresis", "hysteresis_refined")
SHOWN_ARMS = ("simple", "simple_refined", "hysteresis", "hysteresis_refined")
CEP_TIMES_S = (1800.0, 3600.0, 7200.0)
PAIRS = (
    ("hysteresis_refined", "simple"),
    ("hysteresis", "simple"),
    ("simple_refined", "simple"),
    ("hysteresis_refined", "simple_refined"),
    ("hysteresis_refined", "hysteresis"),
    ("hysteresis", "hysteresis_without_rate"),
    ("hysteresis_scale_only", "simple"),
    ("hysteresis_bias_only", "simple"),
    ("hysteresis", "hysteresis_blind"),
    ("hysteresis_blind", "simple"),
    ("hysteresis", "hysteresis_piecewise_scale"),
    ("quadratic", "simple"),
    ("simple", "none"),
)
SINGLE_FLIGHT = ("final", "least_squares", "radial_error_rate_rms")  # definitions that a single flight has, too


@dataclass(frozen=True)
class Shown:
    """The first instrument of the ensemble, flown once at full rate; the first, not a chosen one."""

    world: World
    mission: Mission
    recording: Recording
    navigated: dict[str, Evaluation]


def plans(plan: Plan, size: int) -> dict[str, tuple[Plan, int]]:
    """The ensembles that are needed: all errors together, and each source of the budget alone."""
    return {
        "all": (plan, size),
        **{name: (replace(plan, arms=BUDGET_ARMS, source=name), _budget_size(name, size)) for name in SOURCES},
    }


def numbers(
    plan: Plan,
    size: int,
    members: Mapping[str, list],
    shown: Shown,
    names: Mapping[str, str],
    users: Sequence[str] = (),
    agreed: Mapping[str, Agreement] = MappingProxyType({}),
) -> dict[str, Any]:
    """The tree ``ins-eval-metrics/1`` from the finished `members` of `plans` and the flight that is shown.

    `names` are the names of the compensations by what the plan calls them; `users` those of the user's own, as the
    chamber left it and with the oven run. `agreed` says how far linear ensembles are from flights in full, by label.
    """
    arms = by_arm(members, names, size)
    rng = Streams(plan.seed).at("bootstrap")
    profile = load(plan.profile)
    return {
        "format": "ins-eval-metrics/1",
        "profile": profile.name,
        "seed": plan.seed,
        "t0_s": 0.0,
        "duration_s": profile.duration_s,
        "own_models": list(users),
        "definitions": _definitions(),
        "floor": _floor(shown.world),
        "ensemble": ensemble_numbers(arms, size, rng, users) | both_ways.as_tree(members, "all", agreed),
        "budget": {
            "size": min(size, BUDGET_SIZE),
            "size_beside": min(size, BESIDE_SIZE),
            **{s: _budget(ensemble.stacked(members[s]), rng) for s in SOURCES},
        },
        "flight": {name: as_tree(measures(e)) for name, e in shown.navigated.items()},
        "gps": _gps(shown.recording.gps),
        "alignment": _alignment_errors(shown),
        "paper": {**PAPER, "percentile_of_paper": _percentiles(arms)},
    }


def by_arm(
    members: Mapping[str, list], names: Mapping[str, str], size: int | None = None
) -> dict[str, dict[str, np.ndarray]]:
    """Contributions of all instruments by the name of the compensation; of those flown linearly of the first `size`."""
    return {names[spec]: data for spec, data in both_ways.flown(members, "all", size).items()}


def fly_shown(world: World, specs: Sequence[str], names: Mapping[str, str]) -> Shown:
    """The first instrument of `world` at full rate with each compensation of `specs`, called as in `names`."""
    mission = Mission(world.flight.profile, SHOWN_RATE_HZ)
    recording = mission.record(world.instrument(0), world.streams(0).at("flight"))
    seen, stand = tuple(samples(recording)), standstill_to_align_on(recording)
    triads = world.triads(0)
    navigated = {}
    for spec in specs:
        velocity = compensate(seen, triads[spec], recording.interval_s)
        navigated[names[spec]] = evaluate(recording, velocity, align_on=stand)
    return Shown(world, mission, recording, navigated)


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


def _arm(estimates: dict[str, metrics.Estimate]) -> dict[str, Any]:
    """One compensation: estimates by measure, sorted into velocity RMS and CEP rates."""
    groups: dict[str, dict[str, Any]] = {"velocity_rms_mps": {}, "cep_rate_nmi_per_h": {}}
    for measure, estimate in estimates.items():
        kind, key = (
            ("velocity_rms_mps", measure[13:])
            if measure.startswith("velocity_rms_")
            else ("cep_rate_nmi_per_h", measure[9:])
        )
        groups[kind][key] = estimate.as_tree()
    return groups


def ensemble_numbers(
    arms, size: int, rng: Streams, users: Sequence[str] = (), pairs: Sequence[tuple[str, str]] = PAIRS
) -> dict[str, Any]:
    """Every compensation with its estimates, the ratios of pairs, and what model and refinement each bring."""
    pairs = [pair for pair in pairs if set(pair) <= set(arms)]
    for user in users:
        refined = user.endswith("_refined")
        pairs += [
            (user, "simple_refined" if refined else "simple"),
            (user, "hysteresis_refined" if refined else "hysteresis"),
        ]
    compared = metrics.paired_bootstrap(arms, ensemble.STATISTICS, pairs, rng.at("ensemble").rng())
    result: dict[str, Any] = {"size": size, "rate_hz": ensemble.RATE_HZ, "improvement": {}}
    main = {measure: ensemble.STATISTICS[measure] for measure in ("velocity_rms_horizontal", "cep_rate_final")}
    result["attribution"] = attribution(arms, main, rng.at("attribution").rng())
    for arm, estimates in compared.arms.items():
        result[arm] = _arm(estimates)
        track_s = arms[arm]["track_s"][0]
        at = [int(np.argmin(np.abs(track_s - t))) for t in CEP_TIMES_S if t <= track_s[-1]]
        cep = metrics.cep(arms[arm]["track_m"][:, at], rng.at("cep", arm).rng())
        result[arm]["cep_nmi_at_s"] = {
            f"{track_s[k]:.0f}": metrics.Estimate(cep.value[i] / NMI, cep.low[i] / NMI, cep.high[i] / NMI).as_tree()
            for i, k in enumerate(at)
        }
    for pair, ratios in compared.ratios.items():
        first, second = pair.split("/")
        result["improvement"][pair] = {
            **{measure: {**r.as_tree(), "log_sd": r.log_sd} for measure, r in ratios.items()},
            "fraction_improved": {
                measure: exceedance(0.0, np.log(arms[second][measure] / arms[first][measure])).as_tree()
                for measure in ("velocity_rms_horizontal", "cep_rate_final", "cep_rate_radial_error_rate_rms")
            },
        }
    return result


def _budget_size(source: str, size: int) -> int:
    return min(size, BESIDE_SIZE if SOURCES[source].changes else BUDGET_SIZE)


def _budget(arms, rng: Streams) -> dict[str, Any]:
    measures = {m: ensemble.STATISTICS[m] for m in ("velocity_rms_horizontal", "cep_rate_final")}
    compared = metrics.paired_bootstrap(arms, measures, (), rng.at("budget").rng())
    return {arm: {m: e.as_tree() for m, e in estimates.items()} for arm, estimates in compared.arms.items()}


def _percentiles(arms) -> dict[str, Any]:
    """Share in percent of our single flights below the published one."""
    of = {"simple": "simple", "hysteresis": "hysteresis_refined"}
    result: dict[str, Any] = {}
    for printed, arm in of.items():
        for definition in SINGLE_FLIGHT:
            above = exceedance(PAPER["cep"][printed], arms[arm][f"cep_rate_{definition}"])
            result.setdefault(printed, {})[definition] = {
                "value": 100.0 * (1.0 - above.value),
                "interval95": [100.0 * (1.0 - above.high), 100.0 * (1.0 - above.low)],
            }
    return result


def _floor(world: World) -> dict[str, Any]:
    """Errors of the whole chain without any sensor error, at the rate of the flight shown and of the ensemble."""
    floors = {}
    for rate_hz in (SHOWN_RATE_HZ, world.plan.rate_hz):
        errors, horizontal_m, velocity_mps = numeric_floor(Mission(world.flight.profile, rate_hz).ideal())
        floors[rate_hz] = {
            "rate_hz": rate_hz,
            "horizontal_m": horizontal_m,
            "velocity_mps": velocity_mps,
            "rate_nmi_per_h": horizontal_m / NMI / (errors.time_s[-1] / HOUR),
        }
    return {**floors[SHOWN_RATE_HZ], "ensemble": floors[world.plan.rate_hz], "vertical": _other_verticals(world)}


def _other_verticals(world: World) -> dict[str, Any]:
    """Diagnostics: the same without any sensor error, with the vertical channel left free or its height frozen."""
    ideal = world.flight.ideal()
    found = {}
    for vertical in ("free", "frozen"):
        errors, horizontal_m, velocity_mps = numeric_floor(ideal, vertical)
        found[vertical] = {
            "height_m": float(np.abs(errors.down_m).max()),
            "horizontal_m": horizontal_m,
            "velocity_mps": velocity_mps,
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


def _alignment_errors(shown: Shown) -> dict[str, float]:
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
