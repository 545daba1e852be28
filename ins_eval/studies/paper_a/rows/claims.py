"""Values of the rows of what the text of Paper A claims."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ins_eval.studies.paper_a.audit import navigation
from ins_eval.studies.paper_a.audit import scale_factor as audit
from ins_eval.studies.paper_a.printed import PRINTED, UNITS
from ins_eval.studies.paper_a.rows.audited import audited
from ins_eval.studies.paper_a.single import FIRST, SECOND
from ins_eval.studies.papers import Estimate, percent_off, same
from ins_eval.tables import pick

VELOCITY = "velocity_rms_horizontal"
NOTHING_PERCENT = 1.0  # an effect on the velocity RMS that is at most so large does not matter
REPEATABLE_PERCENT = 5.0  # scatter up to which a deformation counts as repeatable
KELVIN = 273.15
OTHER_SOURCES = ("accelerometer_bias_of_the_run", "accelerometer_scale_factor")
OMITTED = ("rate2_difference", "rate2_difference2", "rate_difference2")  # terms of eq. (7) that eq. (11) leaves out

OF_TEMPERATURE = ("A-C18", "A-C19", "A-C31", "A-C32/falls", "A-C33", "A-C38/temperature")


def values(results: Mapping, ours: Mapping) -> dict[str, dict[str, Any]]:
    """All of them."""
    return {**_sensors(results, ours), **_laboratory(results, ours), **_system(results), **_course(ours)}


def unseen(results: Mapping) -> float | None:
    """Velocity RMS in m/s that adds `NOTHING_PERCENT` in squares to that of a flight with simple compensation."""
    whole = pick(results, "flight", "ensemble", FIRST, "velocity_rms_mps", "horizontal", "value")
    return whole and whole * float(np.sqrt((1.0 + NOTHING_PERCENT / 100.0) ** 2 - 1.0))


def budget(results: Mapping, source: str, measure: str = VELOCITY) -> Estimate | None:
    """What a source of error alone makes with simple compensation."""
    return pick(results, "flight", "budget", source, FIRST, measure)


def _sensors(results: Mapping, ours: Mapping) -> dict[str, dict[str, Any]]:
    """Sources of error, and terms that the paper leaves out."""
    thermal, others = budget(results, "accelerometer_bias_thermal"), [budget(results, s) for s in OTHER_SOURCES]
    main = None
    if thermal and all(others):
        main = thermal["interval95"][0] > max(other["interval95"][1] for other in others)
    of_gyro = budget(results, "gyro", "cep_rate_final")
    sensors = [budget(results, s, "cep_rate_final") for s in ("accelerometer_bias_thermal", *OTHER_SOURCES)]
    less = None
    if of_gyro and all(sensors):
        less = of_gyro["interval95"][1] < float(np.sqrt(sum(sensor["value"] ** 2 for sensor in sensors)))
    simple, proposed = (_improvement(results, pair) for pair in ("simple/none", f"{SECOND}/{FIRST}"))
    slight = simple["value"] > proposed["value"] if simple and proposed else None
    invisible = unseen(results)
    terms = budget(results, "accelerometer_cross_terms") if invisible else None
    demanded = [audit.omitted_coefficient(unit) for unit in UNITS]
    return {
        "A-C4": {"ours": thermal, "of_the_run": others[0], "scale_factor": others[1], "holds": main},
        "A-C5": {"ours": of_gyro, "sensors": sensors, "holds": less},
        "A-C6": {
            "ours": simple["value"] if slight is not None else None,
            "proposed": proposed and proposed["value"],
            "holds": slight,
        },
        "A-C7": {"shares": [pick(results, "chamber", "magnet_share", unit) for unit in UNITS]},
        "A-C9": {"ours": terms, "below": invisible or 0.0, "nothing_percent": NOTHING_PERCENT},
        "A-C11/coefficients": _omitted(pick(ours, "high_order")),
        "A-C11/printed": {"demanded": demanded, "holds": all(map(_of_magnitude, demanded))},
    }


def _omitted(high: Mapping | None) -> dict[str, Any]:
    if high is None:
        return {"holds": None, "of_gamma": None}
    of_gamma = [high[f"{key}_of_gamma"]["value"] for key in OMITTED]
    sizes = [high[key]["value"] for key in OMITTED]
    return {"sizes": sizes, "of_gamma": of_gamma, "holds": any(all(map(_of_magnitude, of)) for of in (sizes, of_gamma))}


def _of_magnitude(coefficient: float) -> bool:
    printed = PRINTED["high_order"]["coefficient"]
    return 0.3 * printed <= coefficient <= 3.0 * printed


def _laboratory(results: Mapping, ours: Mapping) -> dict[str, dict[str, Any]]:
    """Epoxy, chamber, Table 4."""
    slow, fast, table4, text = audited()["creep"], audited()["thermal"], audited()["table4"], PRINTED["table4_text"]
    kelvin = np.array(PRINTED["creep"]["temperature_c"]) + KELVIN
    speed, warm = slow.mean_um / slow.mean_um[0], kelvin / kelvin[0]
    share, scale = pick(ours, "creep", "finished_share"), pick(ours, "scale")
    about = text["simple_about_ppm_per_c"]
    return {
        "A-C13": {"holds": bool(np.all(np.diff(slow.mean_um) > 0.0))},
        "A-C14": {"speed": speed, "warm": warm, "holds": bool(np.allclose(speed, warm, rtol=0.1))},
        "A-C15": {"holds": bool(slow.cv_percent.min() > 5.0 * fast.cv_percent.max())},
        "A-C16": {
            "repeatable_percent": REPEATABLE_PERCENT,
            "holds": bool(fast.cv_percent.max() < REPEATABLE_PERCENT),
        },
        "A-C17": {"share": share and [round(100 * s) for s in share]},
        "A-C20": {
            "larger_percent": scale and 100 * scale["falls_share"],
            "holds": all(map(audit.falls_throughout, UNITS)),
        },
        **{f"A-C22/{unit.removeprefix('JB-KT8 ')}": _quoted(k, unit, results) for k, unit in enumerate(UNITS)},
        "A-C24": {"holds": min(table4["simple_over_hysteresis"]) >= text["at_least_times_better"]},
        "A-C25": {"holds": all(same(about, simple, 1.0) for simple in table4["simple"])},
        "A-C26": {"holds": all(left < text["proposed_below_ppm_per_c"] for left in table4["hysteresis"])},
    }


def _quoted(k: int, unit: str, results: Mapping) -> dict[str, Any]:
    of = PRINTED[unit]
    low, high = of["range_c"]
    return {
        **{"name": unit, "low": low, "high": high, "printed": of["change_ppm"]},
        "recomputed": audited()["sensitivity"][k] * (high - low),
        "quoted": audited()["quoted_sensitivity"][k],
        "text_ppm_per_c": of["text_ppm_per_c"],
        "beside": pick(results, "chamber", "table4", unit, "none"),
    }


def _system(results: Mapping) -> dict[str, dict[str, Any]]:
    """Oven and flight of the INS."""
    found: dict[str, dict[str, Any]] = {}
    for id, table in (("A-C27", "table6"), ("A-C35", "table7")):
        for axis in navigation.AXES:
            recomputed = navigation.reduction_percent(PRINTED[table], axis)
            printed = PRINTED[table]["reduction_percent"][axis]
            found[f"{id}/{axis}"] = {"axis": axis, "printed": printed, "recomputed": recomputed}
    oven = [pick(results, "oven", "gain", "given", axis) for axis in navigation.AXES]
    flight = [_improvement(results, f"{SECOND}/{FIRST}", f"velocity_rms_{axis}") for axis in navigation.AXES]
    return found | {
        "A-C28": {"below": 0.5 * audited()["reduction_percent"]["oven_horizontal"]},
        "A-C29/oven": _east_more("Oven", "table6", *oven),
        "A-C29/flight": _east_more("Flight", "table7", *flight),
        "A-C36/at_least": {"ours": percent_off(_improvement(results, f"{SECOND}/{FIRST}", "cep_rate_final"))},
        "A-C39": {"ours": _improvement(results, f"{SECOND}/hysteresis")},
        "A-C40": {
            "ours": _improvement(results, f"{SECOND}/{FIRST}"),
            "same_refinement": _improvement(results, f"{SECOND}/simple_refined"),
        },
    }


def _improvement(results: Mapping, pair: str, measure: str = VELOCITY) -> Estimate | None:
    """A ratio of the comparison as an estimate."""
    ratio = pick(results, "flight", "ensemble", "improvement", pair, measure)
    return ratio and {"value": ratio["ratio"], "interval95": ratio["interval95"]}


def _east_more(where: str, table: str, east: Estimate | None, north: Estimate | None) -> dict[str, Any]:
    """Does east improve more than north? The interval of the difference is from the ends of those of the two ratios."""
    printed = [navigation.reduction_percent(PRINTED[table], axis) for axis in navigation.AXES]
    found = {"where": where, "printed_east": printed[0], "printed_north": printed[1], "east": east, "north": north}
    if east and north:
        (least, most), (low, high) = east["interval95"], north["interval95"]
        found["ours"] = {
            "value": 100.0 * (north["value"] - east["value"]),
            "interval95": [100.0 * (low - most), 100.0 * (high - least)],
        }
    return {**found, "recomputed": printed[0] - printed[1]}


def _course(ours: Mapping) -> dict[str, dict[str, Any]]:
    """Temperatures over the flight."""
    usual, improved = PRINTED["chamber"]["usual_flight_rate_c_per_min"], pick(ours, "oven_position")
    found = {"A-C30": {"improved": improved and 100.0 * improved["improved_horizontal"]}}
    thermal = pick(ours, "thermal")
    if thermal is None:
        return found | {id: {"holds": None} for id in OF_TEMPERATURE}
    rate, falling = thermal["mean_rate"], thermal["falling_share_of_cruise"]
    alone = thermal["rise_without_own_heat_c"] < 0.5 * thermal["rise_c"]
    return found | {
        "A-C18": {"holds": same(usual, rate, 0.1), "passes": (rate - 0.05, rate + 0.05)},
        "A-C19": {"holds": thermal["max_rate"] <= audited()["slew"].fastest_step},
        "A-C31": {"holds": thermal["rise_c"] > 0.0 and alone},
        "A-C32/falls": {"ours": 100 * falling, "holds": falling == 1.0},
        "A-C33": {"holds": thermal["landing_rise_c"] > 0.0},
        "A-C38/temperature": {"holds": thermal["late_rate"] > thermal["early_rate"]},
    }
