"""Values of the rows of the experiments and procedures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ins_eval.studies.paper_a.audit import epoxy
from ins_eval.studies.paper_a.printed import PRINTED, UNITS
from ins_eval.studies.paper_a.rows.audited import audited
from ins_eval.studies.paper_a.rows.claims import NOTHING_PERCENT, budget, unseen
from ins_eval.tables import pick
from ins_eval.thermal import Thermometer


def values(results: Mapping, ours: Mapping) -> dict[str, dict[str, Any]]:
    """All of them."""
    creep, hot, improved = pick(ours, "creep"), pick(ours, "thermal"), pick(results, "oven", "runs_improved")
    ramps, rank = audited()["ramps"], audited()["rank"]
    (low, high), (cold, hottest) = (PRINTED["chamber"][key] for key in ("oven_c", "from_to_c"))
    rises = hot and hot["rise_c"] > 0.0 and hot["landing_rise_c"] > 0.0 and hot["falling_share_of_cruise"] == 1.0
    return {
        "A-P1/first": _first_repetition(),
        **{
            f"A-P1/stable/{celsius:g}": {"celsius": celsius, "ours": creep and 100.0 * creep["finished_share"][k]}
            for k, celsius in enumerate(PRINTED["creep"]["temperature_c"])
        },
        "A-P2/range": {"low": low, "high": high, "cold": cold, "hot": hottest, "holds": low <= cold < hottest <= high},
        "A-P2/sensor": {"ours": Thermometer().step_c},
        "A-P3": {
            "first_at_rest": 100 * (1 - ramps.moving_share[0]),
            "last_at_rest": 100 * (1 - ramps.moving_share[-1]),
        },
        "A-P5": {
            "line": rank["line"],
            "holds": rank["line"] == 2,
            "left": [pick(results, "chamber", "residual_rms_ppm", unit, "simple") for unit in UNITS],
        },
        "A-P7": _refinement(results),
        "A-P8": {case: improved and 100 * improved[case] for case in ("given", "aligned")},
        "A-P9/temperature": {"holds": hot and bool(rises)},
        "A-P10": _one_temperature(results),
    }


def _first_repetition() -> dict[str, Any]:
    of = PRINTED["creep"]
    tables = {key: epoxy.of_first(key) for key in ("thermal_um", "creep_um")}
    low, high = of["chamber_c"]
    inside = all(low <= t <= high for t in of["temperature_c"])
    return {**tables, "low": low, "high": high, "holds": inside and all(list(of[k]) == t for k, t in tables.items())}


def _refinement(results: Mapping) -> dict[str, Any]:
    runs, unrefined = pick(results, "oven", "refinement"), pick(results, "oven", "given", "hysteresis", "horizontal")
    if not (runs and unrefined):
        return {"holds": None}
    counts = sorted(runs, key=int)
    first = runs[counts[0]]
    return {
        **{"ours": first, "last": runs[counts[-1]], "runs": counts[-1], "unrefined": unrefined},
        "holds": first["interval95"][1] < unrefined["value"],
    }


def _one_temperature(results: Mapping) -> dict[str, Any]:
    """What axes that are unequally warm do: thermal bias alone, with one temperature and with a spread of it."""
    even, uneven = (budget(results, f"accelerometer_bias_thermal{spread}") for spread in ("", "_with_gradient"))
    limit = unseen(results)
    known = even and uneven and limit
    allowed = float(np.hypot(even["value"], limit)) if known else 0.0
    return {"even": even, "ours": uneven if known else None, "below": allowed, "nothing_percent": NOTHING_PERCENT}
