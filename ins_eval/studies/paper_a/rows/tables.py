"""Values of the rows of Tables 1 to 7 and of the CEP."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ins_eval.accelerometer import Population
from ins_eval.datasheets import AccelerometerSheet
from ins_eval.gyro import GyroPopulation
from ins_eval.metrics import DEFINITIONS
from ins_eval.studies.paper_a.audit import epoxy, navigation
from ins_eval.studies.paper_a.printed import GJN096, INS, PRINTED, QA3000, UNITS
from ins_eval.studies.paper_a.rows.audited import audited
from ins_eval.studies.paper_a.single import FIRST, SECOND
from ins_eval.studies.papers import Estimate, percent_off, same
from ins_eval.tables import pick

PAPER_ARM = {"simple": FIRST, "hysteresis": SECOND}  # the paper's compensated arm was refined in the oven
TABLE1 = {  # row of the table: field of the sheet, its name and unit
    "range": ("input_range_g", "input range", "g"),
    "bias_repeatability": ("bias_repeatability_ug", "bias repeatability, below", "µg"),
    "bias_sensitivity": ("bias_temperature_ug_per_c", "temperature sensitivity of bias", "µg/°C"),
    "scale_repeatability": ("scale_repeatability_ppm", "scale factor repeatability, below", "ppm"),
    "scale_sensitivity": ("scale_temperature_ppm_per_c", "temperature sensitivity of the scale factor", "ppm/°C"),
    "shock": ("shock_g", "shock", "g"),
    "resolution": ("resolution_ug", "resolution or threshold, below", "µg"),
}
EPOXY = {  # table: what it holds, where it stands, and its last digits
    2: ("creep", "creep_um", (0.01, 0.01, 0.01)),
    3: ("thermal deformation", "thermal_um", (0.01, 0.01, 0.1)),
}
STABILITY, REPEATABILITY, LINEARITY = "bias stability", "scale factor repeatability", "scale factor linearity"
DRAWN = "the scale factor of a switch-on is drawn with it."


def values(results: Mapping, ours: Mapping) -> dict[str, dict[str, Any]]:
    """All of them."""
    return {
        **_sheet(QA3000),
        **_sheet(GJN096),
        **{id: row for table in EPOXY for id, row in _epoxy(table, ours).items()},
        **{id: row for k, unit in enumerate(UNITS) for id, row in _table4(k, unit, results).items()},
        **_table5(),
        **_table6(results),
        **_table7(results),
        **_cep(results),
    }


def _sheet(sheet: AccelerometerSheet) -> dict[str, dict[str, Any]]:
    why = "a data-sheet value, which nothing in the paper or here measures."
    above, (low, high) = sheet.bandwidth_at_least_hz, sheet.operating_c
    found = {
        key: {"index": title, "printed": getattr(sheet, field), "unit": unit, "why": why}
        for key, (field, title, unit) in TABLE1.items()
    }
    found["operating"] = {
        "index": "operating temperature",
        "printed": f"{low:g} to {high:g}",
        "unit": "°C",
        "why": "a data-sheet value.",
    }
    found["bandwidth"] = {
        "index": "bandwidth",
        "printed": f"above {above:g}" if above else f"below {sheet.bandwidth_at_most_hz:g}",
        "unit": "Hz",
        "why": "a data-sheet value; the table bounds one device from below and the other from above.",
    }
    return {f"A-T1/{sheet.name}/{key}": {"device": sheet.name, **of} for key, of in found.items()}


def _epoxy(table: int, ours: Mapping) -> dict[str, dict[str, Any]]:
    """Table 2 or 3: the variations, which the table prints, and mean and scatter, which it does not."""
    what, key, digits = EPOXY[table]
    printed, found, pairs = PRINTED["creep"][f"table{table}_variation_percent"], epoxy.of_table(key), {}
    for k, pair in enumerate(epoxy.missed_extremes(key)):
        if pair and not same(printed[k], found.variation_percent[k], digits[k]):
            pairs[k] = f"{pair[0]:g} and {pair[1]:g}"
    virtual = pick(ours, "creep", f"{key}_variation_percent")
    return {
        f"A-T{table}/{celsius:g}": {
            "what": what,
            "celsius": celsius,
            "printed": printed[k],
            "recomputed": found.variation_percent[k],
            "digit": digits[k],
            "mean_um": found.mean_um[k],
            "scatter_percent": found.cv_percent[k],
            "extremes": pairs.get(k),
            "ours": virtual[k] if virtual else None,
        }
        for k, celsius in enumerate(PRINTED["creep"]["temperature_c"])
    }


def _table4(k: int, unit: str, results: Mapping) -> dict[str, dict[str, Any]]:
    audit, of_arm = audited(), {}
    for arm, printed in PRINTED[unit]["table4"].items():
        of_arm[arm] = {"name": unit, "printed": printed, "ours": pick(results, "chamber", "table4", unit, arm)}
    of_arm["none"] |= {
        "recomputed": audit["sensitivity"][k],
        "needed_c": audit["reference_needed_c"][k],
        "scaled": pick(results, "chamber", "table4_scaled", unit, "none"),
    }
    least = audit["least_for_a_line"][k]
    impossible = least > of_arm["simple"]["printed"]
    of_arm["simple"] |= {
        "kind": "contradicts" if impossible else "simulated",
        "recomputed": least,
        "beside": of_arm["simple"]["ours"] if impossible else None,
    }
    of_arm["hysteresis"]["implied"] = audit["residual_peak_to_peak_ppm"][k]
    return {f"A-T4/{unit.removeprefix('JB-KT8 ')}/{arm}": of for arm, of in of_arm.items()}


def _table5() -> dict[str, dict[str, Any]]:
    """What the simulation draws with each index of the tested INS."""
    population, gyros = Population.load(), GyroPopulation()
    wanders = "the bias wanders by less than it allows; how much less is assumed."
    switched = "the bias of a switch-on is drawn with stability and repeatability together."
    signed = "a scale factor error that changes sign with the rate is drawn with it."
    rows = {
        "accelerometer/bias_stability_ug": (STABILITY, "µg", population["in_run"].sigma_ug, wanders),
        "accelerometer/bias_repeatability_ug": (
            *("bias repeatability", "µg", population["turn_on"].sigma_ug),
            "the bias of a switch-on is drawn with it.",
        ),
        "accelerometer/scale_linearity_ppm": (
            *(LINEARITY, "ppm", population["nonlinearity"].k2_sigma_ug_per_g2),
            "the quadratic coefficient is drawn with it.",
        ),
        "accelerometer/scale_repeatability_ppm": (
            *(REPEATABILITY, "ppm", population["scale_repeatability"].sigma_ppm),
            DRAWN,
        ),
        "gyro/bias_stability_deg_per_h": (STABILITY, "°/h", gyros.bias_deg_per_h, switched),
        "gyro/scale_linearity_ppm": (LINEARITY, "ppm", gyros.asymmetry_ppm, signed),
        "gyro/scale_repeatability_ppm": (REPEATABILITY, "ppm", gyros.scale_ppm, DRAWN),
    }
    found = {}
    for id, (index, unit, ours, why) in rows.items():
        group, field = id.split("/")
        found[f"A-T5/{id}"] = {
            **{"of_what": group.capitalize(), "index": index, "unit": unit, "ours": ours, "why": why},
            "printed": getattr(getattr(INS, group), field),
        }
    return found


def _table6(results: Mapping) -> dict[str, dict[str, Any]]:
    found, oven = {}, pick(results, "oven")
    for case, attitude in (("given", "true attitude given"), ("aligned", "self-aligned")):
        for arm, name in PAPER_ARM.items():
            for axis in navigation.AXES:
                over_all, single = (pick(oven, *path, name, axis) for path in ((case,), ("single", case)))
                found[f"A-T6/{case}/{arm}/{axis}"] = {
                    **{"attitude": attitude, "arm": arm, "axis": axis},
                    **_of_one(PRINTED["table6"][arm][axis], over_all, single, "m/s", "oven runs"),
                }
        for axis in navigation.AXES:
            found[f"A-T6/{case}/reduction/{axis}"] = {
                **{"attitude": attitude, "axis": axis, "typical": percent_off(pick(oven, "gain", case, axis))},
                "printed": PRINTED["table6"]["reduction_percent"][axis],
                "recomputed": navigation.reduction_percent(PRINTED["table6"], axis),
                "ours": pick(oven, "best_of_ten", case, axis),
            }
    return found


def _table7(results: Mapping) -> dict[str, dict[str, Any]]:
    found, flight, of = {}, pick(results, "flight"), PRINTED["table7"]
    for arm, name in PAPER_ARM.items():
        for axis in navigation.AXES:
            over_all = pick(flight, "ensemble", name, "velocity_rms_mps", axis)
            single = pick(flight, "single", name, f"velocity_rms_{axis}")
            found[f"A-T7/{arm}/{axis}"] = {"arm": arm, "axis": axis, **_of_one(of[arm][axis], over_all, single, "m/s")}
    for axis in navigation.AXES:
        recomputed = navigation.reduction_percent(of, axis)
        reduction = _reduction(flight, of["reduction_percent"][axis], f"velocity_rms_{axis}")
        found[f"A-T7/reduction/{axis}"] = {"axis": axis, "recomputed": recomputed, **reduction}
    return found


def _cep(results: Mapping) -> dict[str, dict[str, Any]]:
    found, flight, of = {}, pick(results, "flight"), PRINTED["cep"]
    for definition, meaning in DEFINITIONS.items():
        words = {"definition": definition.replace("_", " "), "formula": meaning.formula}
        for arm, name in PAPER_ARM.items():
            over_all = pick(flight, "ensemble", name, "cep_rate_nmi_per_h", definition)
            single = pick(flight, "single", name, f"cep_rate_{definition}")
            found[f"A-CEP/{definition}/{arm}"] = {**words, "arm": arm, **_of_one(of[arm], over_all, single, "nmi/h")}
        reduction = _reduction(flight, of["reduction_percent"], f"cep_rate_{definition}")
        recomputed = navigation.reduction_percent(of)
        found[f"A-CEP/{definition}/reduction"] = {**words, "recomputed": recomputed, **reduction}
    return found


def _reduction(flight: Any, printed: float, measure: str) -> dict[str, Any]:
    """What refined hysteresis takes off simple compensation, %."""
    ratio = pick(flight, "ensemble", "improvement", f"{SECOND}/{FIRST}", measure)
    return _of_one(printed, percent_off(ratio), pick(flight, "single", "gain_percent", measure), "%")


def _of_one(
    printed: float, over_all: Estimate | None, single: Estimate | None, unit: str, what: str = "flights"
) -> dict[str, Any]:
    """A printed number of one flight or oven run against the central 95 % of ours; ours is the ensemble's value.

    Where single ones were not kept, the interval of the ensemble's value stands for them, narrower and named.
    """
    if over_all is None:
        return {"printed": printed, "of": "", "over_all": None, "apart": None}
    apart = f"Ours is {over_all['value'] - printed:+.2f} {unit} from it."
    if single is None:
        of = f"the 95 % interval of the value over all our {what}"
        return {"printed": printed, "ours": over_all, "of": of, "over_all": None, "apart": apart}
    ours = {"value": over_all["value"], "interval95": single["interval95"]}
    of = f"the central 95 % of our single {what}"
    return {"printed": printed, "ours": ours, "of": of, "over_all": over_all, "apart": apart}
