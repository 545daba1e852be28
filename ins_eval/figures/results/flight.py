"""Figures of the flight report: the flight shown in full, all instruments, missions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ins_eval import figures, metrics
from ins_eval.analysis.flight import PAPER, SHOWN_ARMS, SINGLE_FLIGHT, Shown
from ins_eval.analysis.fly import FlightStudy
from ins_eval.analysis.missions import by_mission
from ins_eval.ensemble import ARMS, SOURCES
from ins_eval.ensemble.conditions import VELOCITY
from ins_eval.figures.results.recording import path, temperature, traces
from ins_eval.streams import Streams
from ins_eval.vocabulary import FIRST, SECOND

DRAWN = ("simple", "simple_refined", "hysteresis", "hysteresis_refined")  # in figures with one curve for each


def study_figures(study: FlightStudy) -> dict[str, Figure]:
    """Every figure by its name."""
    tree, seed = study.tree, study.plan.seed
    drawn = {
        **flight_figures(study.shown, tree),
        **ensemble_figures(study.arms, tree, Streams(seed).at("bootstrap")),
    }
    if "missions" in tree:
        flown = by_mission(study.members, study.names)
        drawn |= missions_figures(*flown, Streams(seed).at("missions"), study.users)
    return drawn


def flight_figures(shown: Shown, result: dict[str, Any]) -> dict[str, Figure]:
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
            raw=(*result["own_models"][:1], FIRST, SECOND),
        ),
    }


def ensemble_figures(arms, result: dict[str, Any], rng: Streams) -> dict[str, Figure]:
    """Figures of all instruments."""
    of_all = result["ensemble"]
    shown = [name for name in arms if name in DRAWN or name not in ARMS]
    ceps = {n: metrics.cep(arms[n]["track_m"], rng.at("cep_band", n).rng()) for n in shown}
    own = result.get("own_models", ())[:1]
    pairs = [(name, other) for name in own for other in ("simple", "hysteresis")] or [(SECOND, FIRST)]
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
            ratios={f"{a}/{b}": {m: arms[a][m] / arms[b][m] for m in measures} for a, b in pairs},
            fraction_improved={f"{a}/{b}": of_all["improvement"][f"{a}/{b}"]["fraction_improved"] for a, b in pairs},
        ),
        "error_budget": figures.error_budget(budget=budget, size=result["budget"]["size"]),
        "velocity_rms_by_compensation": figures.velocity_rms_by_compensation(
            rms_mps={n: of_all[n]["velocity_rms_mps"] for n in arms if n != "none"},
            paper_mps=PAPER["table7"],
            size=of_all["size"],
        ),
        "single_flight_rates": figures.single_flight_rates(
            rates_nmi_per_h={d: {n: arms[n][f"cep_rate_{d}"] for n in (*own, FIRST, SECOND)} for d in SINGLE_FLIGHT},
            paper_nmi_per_h=PAPER["cep"],
        ),
    }


def missions_figures(
    arms: Mapping[str, Mapping[str, np.ndarray]],
    flown: Mapping[str, np.ndarray],
    streams: Streams,
    users: Sequence[str] = (),
) -> dict[str, Figure]:
    """Figures of missions; `users` are the names of the user's own models."""
    ceps = {n: metrics.cep(arms[n]["track_m"], streams.at("cep_band", n).rng()) for n in (*SHOWN_ARMS, *users)}
    beside = (*users, "hysteresis") if users else [n for n in SHOWN_ARMS if n != "simple"]
    return {
        "missions_cep_over_time": figures.cep_over_time(
            time_s=arms["simple"]["track_s"][0],
            cep_m={n: c.value for n, c in ceps.items()},
            band_m={n: np.column_stack([c.low, c.high]) for n, c in ceps.items()},
            size=flown["warmer_c"].size,
            title="Circular error probable over time, over missions",
        ),
        "missions_by_temperature": figures.missions_by_temperature(
            warmer_c=flown["warmer_c"],
            ratios={n: arms[n][VELOCITY] / arms["simple"][VELOCITY] for n in beside},
            turns=flown["turns"],
        ),
    }
