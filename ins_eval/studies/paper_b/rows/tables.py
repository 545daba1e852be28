"""Values of the rows of Tables 1 to 4."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ins_eval.studies.paper_b.audit import estimation
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.tables import pick

CLASSES = {
    "electrostatic": "Electrostatic accelerometer",
    "floated": "Floated pendulous accelerometer",
    "qfa": "QFA",
    "mems": "MEMS",
}
STATIC = {
    "bias_stability_ug": ("bias stability", "µg"),
    "bias_repeatability_ug": ("bias repeatability over a month", "µg"),
    "scale_linearity_ppm": ("scale factor linearity", "ppm"),
    "scale_repeatability_ppm": ("scale factor repeatability over a month", "ppm"),
}


def values(results: Mapping) -> dict[str, dict[str, Any]]:
    """All of them."""
    noise = pick(results, "unit", "static_scatter_ug")
    found = _classes()
    for key, (index, unit) in STATIC.items():
        ours = noise if key == "bias_stability_ug" else None
        found[f"B-T2/{key}"] = {"index": index, "unit": unit, "printed": PRINTED["static"][key], "ours": ours}
    return {
        **found,
        **_gain("B-T3", "table3", "forward", results),
        **_gain("B-T4", "table4", "feedback", results),
        "B-T3/gain": {
            "name": "Forward gain",
            "printed": f"{PRINTED['table3']['mean']['before']:.4f}",  # all its digits
            "meaning": "It stands for no physical unit.",
            "unit": "count per step",
        },
        "B-T4/gain": {
            "name": "Feedback gain",
            "printed": f"{PRINTED['table4']['mean']['before']:.2f}",
            "meaning": "The sign is that of the test current.",
            "unit": "count",
        },
    }


def _classes() -> dict[str, dict[str, Any]]:
    of, static, found = PRINTED["classes"], PRINTED["static"], {}
    for k, (key, name) in enumerate(CLASSES.items()):
        bias, scale = (_range(of[quantity][key]) for quantity in ("bias_stability_ug", "scale_stability_ppm"))
        found[f"B-T1/{key}"] = {
            "name": name,
            "printed": f"{bias} µg, {scale} ppm, {of['cost'][k]}, {of['manufacture'][k]}",
        }
    bias, scale = of["bias_stability_ug"]["qfa"], of["scale_stability_ppm"]["qfa"]
    tested = {"bias": static["bias_stability_ug"], "scale": static["scale_repeatability_ppm"]}
    inside = bias[0] <= tested["bias"] <= bias[1] and scale[0] <= tested["scale"] <= scale[1]
    found["B-T1/tested"] = {**tested, "bias_range": _range(bias), "scale_range": _range(scale), "holds": inside}
    return found


def _range(ends: list[float]) -> str:
    return f"{ends[0]:g} to {ends[1]:g}" if ends[0] < ends[1] else f"{ends[0]:g}"


def _gain(id: str, table: estimation.Table, channel: str, results: Mapping) -> dict[str, dict[str, Any]]:
    """The six repetitions, their mean, the residuals, and their scatter."""
    printed, of, shift = PRINTED[table], estimation.of(table), estimation.shift(table)
    population, unit = pick(results, "population"), pick(results, "unit", f"{channel}_ppm")
    of_rows, _, of_gains = estimation.mean_residual_percent(table)
    rows: dict[str, dict[str, Any]] = {
        f"{k + 1}": {
            "repetition": f"{k + 1}",
            "printed": drift,
            "recomputed": float(of.drift_ppm[k]),
            "ours": pick(population, f"{channel}_repetition_ppm"),
            "nothing": of.injected_ppm,
            "rounding_ppm": of.rounding_ppm,
            "disagrees": "" if abs(drift - of.drift_ppm[k]) <= of.rounding_ppm else ", which is not it",
            "residual_percent": of.residual_percent[k],
            "identified": unit[k] if unit else None,
        }
        for k, drift in enumerate(printed["drift_ppm"])
    }
    rows["mean"] = {
        "printed": printed["mean"]["drift_ppm"],
        "recomputed": float(of.drift_ppm.mean()),
        "ours": pick(population, f"{channel}_ppm"),
        "nothing": of.injected_ppm,
        **{"shift_ppm": shift.mean_ppm, "error_ppm": shift.error_ppm, "sigmas": shift.sigmas},
        "enough_c": _warm_up_needed(population, channel, shift.mean_ppm),
    }
    rows["residual"] = {
        **{"printed": printed["mean"]["residual_percent"], "recomputed": of_gains, "of_rows": of_rows},
        "ours": pick(population, f"{channel}_residual_percent"),
    }
    rows["scatter"] = {"recomputed": shift.scatter_ppm, "ours": pick(population, f"{channel}_scatter_ppm")}
    return {f"{id}/{key}": {"name": f"{channel.capitalize()} gain", **row} for key, row in rows.items()}


def _warm_up_needed(population: Mapping | None, channel: str, shift_ppm: float) -> float | None:
    """Warm-up in degC from which our central 95 % would hold a shift: its ends are in proportion to it."""
    if population is None:
        return None
    low, high = population[f"{channel}_shift_ppm"]["interval95"]
    return population["warm_up_c"]["value"] * shift_ppm / (high if shift_ppm > 0.0 else low)
