"""Values of the rows of what does not fit together in Paper A, each computed in ``audit``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ins_eval.calibration.labelings import FIGURE_4, TURNED
from ins_eval.metrics import DEFINITIONS
from ins_eval.studies.paper_a.audit import chamber, devices, epoxy, navigation
from ins_eval.studies.paper_a.audit import scale_factor as audit
from ins_eval.studies.paper_a.printed import PRINTED, UNITS
from ins_eval.studies.paper_a.rows.audited import audited
from ins_eval.studies.paper_a.rows.claims import NOTHING_PERCENT, VELOCITY
from ins_eval.studies.paper_a.single import FIRST, SECOND
from ins_eval.studies.papers import NOT_COMPUTED, number, percent_off, same
from ins_eval.tables import pick
from ins_eval.units import HOUR, NMI

CRUISE_FROM_C = (15.0, 20.0, 25.0)


def values(results: Mapping, ours: Mapping) -> dict[str, dict[str, Any]]:
    """All of them."""
    return {**_epoxy(), **_equations(results), **_table4(results), **_flight(), **_cep(results), **_rest(results)}


def _epoxy() -> dict[str, dict[str, Any]]:
    found = {}
    for id, key, table in (("A1", "creep_um", "2"), ("A2", "thermal_um", "3")):
        found[id] = {
            "table": table,
            "variation": PRINTED["creep"][f"table{table}_variation_percent"],
            "found": epoxy.of_table(key).variation_percent,
            "pairs": " and from ".join(f"{high:g} and {low:g} µm" for high, low in epoxy.overlooked(key)),
        }
    one, steps = epoxy.expansion_um_per_c(), epoxy.expansion_um_per_c(epoxy.STEPS_FROM_C)
    start, left = epoxy.best_common_start()
    found["A5"] = {
        **{"soak_c": epoxy.SOAK_C, "one": one, "start": start, "left": left, "steps": steps},
        **{"recomputed": epoxy.spread(one), "ours": epoxy.spread(steps)},
        "within_percent": 100 * (epoxy.spread(steps) - 1),
    }
    return found


def _equations(results: Mapping) -> dict[str, dict[str, Any]]:
    hours, offsets = chamber.effort_h(), chamber.surface_offsets_c()
    lags, loops = [audit.equivalent_lag_min(u) for u in UNITS], audited()["falling_minus_rising_ppm"]
    cold, hot = (sum(offset[k] for offset in offsets) / len(offsets) for k in (0, 1))
    figure, turned = (chamber.labelled(force, 1.0, 0.01) for force in (FIGURE_4, TURNED))
    return {
        "A7": {"figure": figure, "turned": turned},
        "A8": {"moving_percent": [100 * share for share in audited()["ramps"].moving_share]},
        "A11": {"recomputed": hours, "days": chamber.days(hours), "steady": chamber.effort_h(dwell=False)},
        "A13": {
            **{"below_ppm": [-v for v in loops], "crossing_c": audit.crossing_c(UNITS[1]), "lags_min": lags},
            "turned": pick(results, "sensitivity", "rate sign/printed", "against_base", SECOND),
        },
        "A14": {
            "per_minute": [audit.linear_rate_term_ppm(u, 0.2, "degC/min") for u in UNITS],
            "per_second": [audit.linear_rate_term_ppm(u, 0.2, "degC/s") for u in UNITS],
            "square": [audit.square_rate_term_ppm(u, 0.9) for u in UNITS],
        },
        "A18": {
            **{"cold": cold, "hot": hot, "ours": chamber.programme().self_heating_c},
            "printed": " / ".join("{:g} to {:g}".format(*PRINTED[u]["range_c"]) for u in UNITS),
            "recomputed": " / ".join("{:+g}, {:+g}".format(*offset) for offset in offsets),
        },
    }


def _table4(results: Mapping) -> dict[str, dict[str, Any]]:
    implied, repeatability = audited()["residual_peak_to_peak_ppm"], audited()["scale_repeatability_ppm"]
    return {
        "A12": {"none": [pick(results, "chamber", "table4", unit, "none") for unit in UNITS]},
        "A16": {
            "times": max(implied) / repeatability,
            "left": [pick(results, "chamber", "residual_rms_ppm", unit, "hysteresis") for unit in UNITS],
        },
        "A17": {"simple": [pick(results, "chamber", "table4", unit, "simple") for unit in UNITS]},
    }


def _flight() -> dict[str, dict[str, Any]]:
    of, printed, found = PRINTED["flight"], [], []
    for table in ("table6", "table7"):
        for axis in navigation.AXES:
            printed.append(PRINTED[table]["reduction_percent"][axis])
            found.append(navigation.reduction_percent(PRINTED[table], axis))
    printed.append(PRINTED["cep"]["reduction_percent"])
    found.append(navigation.reduction_percent(PRINTED["cep"]))
    return {
        "A19": {"rates": [navigation.cruise_rate_c_per_min(start_c) for start_c in CRUISE_FROM_C]},
        "A20": {"places": navigation.places()},
        "A21": {
            "cruise_age_s": of["early_late_s"] - 60 * of["climb_min"],
            "cruise_left_s": navigation.landing_at_s() - of["early_late_s"],
        },
        "A22": {
            **{"percentages": printed, "found": found},
            "holds": all(same(p, f, 0.1) for p, f in zip(printed, found, strict=True)),
        },
    }


def _cep(results: Mapping) -> dict[str, dict[str, Any]]:
    gain = pick(results, "flight", "ensemble", "improvement", f"{SECOND}/{FIRST}", "cep_rate_final")
    found = {"A23": {"fewest": navigation.flights_for_an_interval(), "ours": percent_off(gain)}}
    for arm, name in (("simple", FIRST), ("hysteresis", SECOND)):
        quotient = navigation.cep_to_velocity(arm)
        velocity = pick(results, "flight", "ensemble", name, "velocity_rms_mps", "horizontal")
        rates = pick(results, "flight", "ensemble", name, "cep_rate_nmi_per_h")
        found[f"A24/{arm}"] = of = {"arm": arm, "kind": "open", "recomputed": quotient, "others": None}
        if velocity and rates:
            ratios = {d: _quotient(rates[d], velocity, NMI / HOUR) for d in DEFINITIONS if d in rates}
            of |= {"kind": "simulated", "printed": round(quotient, 3), "recomputed": None, "ours": ratios.pop("final")}
            of["others"] = ", ".join(f"{d.replace('_', ' ')} {number(r['value'])}" for d, r in ratios.items())
    return found


def _quotient(above: Mapping, below: Mapping, factor: float = 1.0) -> dict[str, Any]:
    """Quotient of two estimates; its interval from the ends of theirs, so wider than one of 95 %."""
    (low, high), (least, most) = above["interval95"], below["interval95"]
    return {
        "value": factor * above["value"] / below["value"],
        "interval95": [factor * low / most, factor * high / least],
    }


def _rest(results: Mapping) -> dict[str, dict[str, Any]]:
    tabled, of_units = devices.scale_sensitivities()
    found: dict[str, dict[str, Any]] = {}
    for axis in navigation.AXES:
        found[f"A26/{axis}"] = {
            "axis": axis,
            "printed": PRINTED["table6"]["reduction_percent"][axis],
            "ours": pick(results, "oven", "best_of_ten", "given", axis),
            "typical": pick(results, "oven", "median_of_ten", "given", axis),
        }
    for case, attitude in (("given", "with the true attitude given"), ("aligned", "self-aligned")):
        for axis in navigation.AXES:
            flight = pick(results, "flight", "ensemble", FIRST, "velocity_rms_mps", axis)
            oven = pick(results, "oven", case, FIRST, axis)
            found[f"A30/{case}/{axis}"] = {
                **{
                    "axis": axis.capitalize(),
                    "attitude": attitude,
                    "printed": round(navigation.flight_to_oven(FIRST, axis), 3),
                },
                "ours": _quotient(flight, oven) if flight and oven else None,
            }
    return found | {
        "A27": {"bounds": " and from ".join(devices.bandwidth_senses()), "tabled": tabled, "of_units": of_units},
        "A28": {"recomputed": audit.pulse_ug()},
        "A29": _scale_hysteresis(results),
    }


def _scale_hysteresis(results: Mapping) -> dict[str, Any]:
    """Does the hysteresis of the scale factor matter in navigation?"""
    rate = pick(results, "flight", "ensemble", "improvement", "hysteresis/hysteresis_without_rate", VELOCITY)
    return {
        "kind": "claimed" if rate else "open",
        "not_computed": None if rate else NOT_COMPUTED,
        "rate_terms_ppm": navigation.rate_terms_ppm(PRINTED["chamber"]["usual_flight_rate_c_per_min"]),
        "force_g": navigation.force_for_turn_on_g(0.2),
        "ours": percent_off(rate),
        "nothing_percent": NOTHING_PERCENT,
    }
