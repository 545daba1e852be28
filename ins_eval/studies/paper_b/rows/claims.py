"""Values of the rows of what the text of Paper B claims."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy import stats

from ins_eval.studies.paper_b.audit import bridge, electronics, output, pendulum
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.studies.paper_b.rows.audited import audited
from ins_eval.studies.papers import Estimate, same
from ins_eval.tables import pick

LINEAR_PPM = 1000.0
SIX = PRINTED["text"]["repetitions"] - 1
BY_CHANCE = float(np.sqrt(stats.f.ppf(0.975, SIX, SIX)))  # between the scatters of six and six repetitions
PENDULUMS = ((1.0, 4.0), (2.0, 9.0))  # J, C of two with the same D of 2
GAINS = ("forward_ppm", "feedback_ppm")


def values(results: Mapping) -> dict[str, dict[str, Any]]:
    """All of them."""
    return {**_of_paper(results), **_of_loop(pick(results, "exact")), **_of_units(results), **_of_time(results)}


def _of_paper(results: Mapping) -> dict[str, dict[str, Any]]:
    """What follows from the paper's own numbers."""
    steady = [pendulum.steady_state(j, c, 2.0) for j, c in PENDULUMS]
    with_equal = bridge.gain(1.0, bridge.reference_ratio(5e4, 5e4))
    text = PRINTED["text"]
    parts = pick(results, "observability")
    forward = [part for part in parts or () if part["gain"] == "forward" and abs(part["output_ug"]) < 0.1]
    left, limit = PRINTED["output"]["compensated_ug"], PRINTED["static"]["bias_stability_ug"]
    return {
        "B-C7": {"recomputed": steady[0], "holds": same(steady[0], steady[1], 1e-9) and same(steady[0], 0.5, 1e-9)},
        "B-C8": {"holds": same(with_equal, bridge.gain(1.0), 1e-9)},
        "B-C13": {
            "recomputed": abs(output.magnet_and_current_ppm()),
            "holds": text["torquer_ppm_per_year"] < 0.1 * text["year_drift_scale_ppm"],
        },
        "B-C16": {"recomputed": max(audited()["over_claimed_error"]) * text["estimation_error_ppm"]},
        "B-C20": {"passes": (0.0, limit), "holds": left < limit},
        "B-C21": {"parts": parts and str(len(parts)), "forward": parts and str(len(forward))},
        "B-C23": {"recomputed": electronics.amplifier_ppm(10.0, -200.0)},
    }


def _of_loop(exact: Mapping | None) -> dict[str, dict[str, Any]]:
    """Our loop without disturbances."""
    if exact is None:
        return {id: {"holds": None, "linear_ppm": LINEAR_PPM} for id in ("B-C5", "B-C9", "B-C14", "B-C15")}
    across = {"in_the_current_test": abs(exact["forward_current_ppm"]), "in_the_scan": abs(exact["feedback_scan_ppm"])}
    moved = exact["counts_on_less_off"] / exact["counts_on_less_off_expected"]
    return {
        "B-C5": {"holds": abs(exact["feedback_tilted_ppm"] - exact["feedback_ppm"]) < 0.1},
        "B-C9": {"linear_ppm": LINEAR_PPM, "holds": abs(exact["scan_nonlinearity_ppm"]) < LINEAR_PPM},
        "B-C14": {"holds": same(moved, 1.0, 1e-5)},
        "B-C15": {**across, "holds": across["in_the_current_test"] < 0.1 and across["in_the_scan"] < 1.0},
    }


def _of_units(results: Mapping) -> dict[str, dict[str, Any]]:
    """The population against the paper's shares and against a constant temperature."""
    population, quiet = pick(results, "population"), pick(results, "quiet")
    room, known = pick(results, "temperature", "room"), {}
    if room:
        for name, arm in (("unknown", "none"), ("known", "tests")):
            known[name] = [room[arm][gain]["value"] for gain in GAINS]
    scatter = {
        channel: {
            "ours": pick(population, f"{channel}_scatter_ppm") if quiet else None,
            "above": BY_CHANCE * quiet[f"{channel}_scatter_ppm"] if quiet else 0.0,
        }
        for channel in ("forward", "feedback")
    }
    return {
        "B-C1": {"ours": _remainder(pick(population, "forward_residual_percent"))},
        "B-C2": {"ours": _remainder(pick(population, "feedback_residual_percent"))},
        "B-C3": {
            "recomputed": 100.0 - audited()["output"]["inverse_percent"],
            "ours": _remainder(pick(population, "output_residual_percent")),
        },
        "B-C17": {**scatter["feedback"], "by_chance": BY_CHANCE},
        "B-C19": {**scatter["forward"], "unknown": None, "known": None, **known},
    }


def _remainder(percent: Estimate | None) -> Estimate | None:
    """What a residual in % leaves of 100."""
    if percent is None:
        return None
    low, high = percent["interval95"]
    return {"value": 100.0 - percent["value"], "interval95": [100.0 - high, 100.0 - low]}


def _of_time(results: Mapping) -> dict[str, dict[str, Any]]:
    """Stability, attraction, a year, and temperature."""
    limit = PRINTED["text"]["estimation_error_ppm"]
    margins, found, year = (pick(results, key) for key in ("stability", "attraction", "year"))
    restored = margins and margins["compensated"]["crossover_hz"] / margins["nominal"]["crossover_hz"]
    drawn = found and (found["added_scatter_ppm"]["held"] > limit or found["carrier_v"] > found["excited_v"])
    return {
        "B-C11": {"holds": margins and abs(restored - 1.0) < 1e-6},
        "B-C12": {"holds": drawn},
        "B-C22": {"holds": year and year["after_ug"] < 0.5 * year["before_ug"]},
        "B-C24": _calibrated(pick(results, "temperature")),
    }


def _calibrated(found: Mapping | None) -> dict[str, Any]:
    """After the large change: below what the paper asks of an estimate, and below what it has left of its output."""
    if found is None:
        return {"holds": None}
    limits = dict.fromkeys(GAINS, PRINTED["text"]["estimation_error_ppm"])
    limits["output_ug"] = PRINTED["output"]["compensated_ug"]
    arms = found["far"]
    own, other = arms["tests_and_output"], arms["other_unit"]
    return {
        **{arm: [of_arm[name]["value"] for name in limits] for arm, of_arm in arms.items()},
        "floor": [found["floor"][name] for name in limits],
        "holds": all(own[n]["interval95"][1] < most < other[n]["interval95"][0] for n, most in limits.items()),
    }
