"""Rows of Tables 1 to 7 and of the CEP."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from ins_eval.accelerometer import Population
from ins_eval.datasheets import AccelerometerSheet
from ins_eval.gyro import GyroPopulation
from ins_eval.metrics import DEFINITIONS
from ins_eval.studies.paper_a.audit import devices, epoxy, navigation
from ins_eval.studies.paper_a.audit import scale_factor as audit
from ins_eval.studies.paper_a.printed import GJN096, INS, PRINTED, QA3000, UNITS
from ins_eval.studies.paper_a.single import FIRST, SECOND
from ins_eval.studies.papers import (
    CONTRADICTS,
    NOT_COMPUTED,
    NOT_REPRODUCED,
    Estimate,
    Row,
    between,
    given,
    number,
    percent_off,
    recalculated,
    row,
    same,
    simulated,
)
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


class OfMany(NamedTuple):
    """Ours beside a printed number of one flight or oven run: the value over all of them, and single ones."""

    ensemble: Estimate | None
    single: Estimate | None
    what: str = "flights"


def table_rows(results: Mapping, ours: Mapping) -> Iterator[Row]:
    """All of them."""
    yield from _table1()
    yield from _epoxy("A-T2", "creep_um", "creep", ours)
    yield from _epoxy("A-T3", "thermal_um", "thermal deformation", ours)
    yield from _table4(results)
    yield from _table5()
    yield from _table6(results)
    yield from _table7(results)
    yield from _cep(results)


def _table1() -> Iterator[Row]:
    drift = devices.drift()
    for key, value, unit, printed, digit in (
        ("bias", drift.bias_ug / 1e3, "mg", PRINTED["drift"]["bias_mg"], 0.01),
        ("scale", drift.scale_ppm, "ppm", PRINTED["drift"]["scale_ppm"], 100.0),
    ):
        yield recalculated(
            f"A-T1/drift/{key}",
            f"QA3000-030: largest drift of {'bias' if key == 'bias' else 'the scale factor'} without compensation",
            printed,
            value,
            digit,
            f"Sensitivity times {drift.span_c:g} °C gives {number(value)} {unit}.",
            unit=unit,
        )
    yield row(
        "A-T1/names",
        "Name of the second device",
        CONTRADICTS,
        "The title of the table and its column name different devices.",
        printed=PRINTED["table1_names"]["title"],
        recomputed=PRINTED["table1_names"]["column"],
    )
    for sheet in (QA3000, GJN096):
        yield from _sheet(sheet)


def _sheet(sheet: AccelerometerSheet) -> Iterator[Row]:
    for key, (field, title, unit) in TABLE1.items():
        why = "a data-sheet value, which nothing in the paper or here measures."
        value = getattr(sheet, field)
        yield given(f"A-T1/{sheet.name}/{key}", f"{sheet.name}: {title}", why, printed=value, unit=unit)
    low, high = sheet.operating_c
    yield given(
        f"A-T1/{sheet.name}/operating",
        f"{sheet.name}: operating temperature",
        "a data-sheet value.",
        printed=f"{low:g} to {high:g}",
        unit="°C",
    )
    above, below = sheet.bandwidth_at_least_hz, sheet.bandwidth_at_most_hz
    yield given(
        f"A-T1/{sheet.name}/bandwidth",
        f"{sheet.name}: bandwidth",
        "a data-sheet value; the table bounds one device from below and the other from above.",
        printed=f"above {above:g}" if above else f"below {below:g}",
        unit="Hz",
    )


def _epoxy(id: str, key: str, what: str, ours: Mapping) -> Iterator[Row]:
    """Table 2 or 3: the variations, which the table prints, and mean and scatter, which it does not."""
    printed = PRINTED["creep"]["table2_variation_percent" if key == "creep_um" else "table3_variation_percent"]
    digits = (0.01, 0.01, 0.01) if key == "creep_um" else (0.01, 0.01, 0.1)
    found, pairs = epoxy.of_table(key), epoxy.missed_extremes(key)
    for k, celsius in enumerate(PRINTED["creep"]["temperature_c"]):
        holds = same(printed[k], found.variation_percent[k], digits[k])
        reason = (
            f"The mean is {number(found.mean_um[k], 4)} µm with a scatter of {number(found.cv_percent[k])} %. "
            f"(Largest - smallest) / #1 is {number(found.variation_percent[k], 4)} %."
        )
        if not holds and pairs[k]:
            high, low = pairs[k]
            reason += f" The printed value comes from {high:g} and {low:g} µm, so an extreme was overlooked."
        virtual = pick(ours, "creep", f"{key}_variation_percent")
        if virtual:
            reason += (
                " Ours: median and central 95 % of virtual experiments that scatter as much as the table, "
                f"{between(virtual[k])} %."
            )
        yield recalculated(
            f"{id}/{celsius:g}",
            f"Variation of the {what} at {celsius:g} °C over ten repetitions",
            printed[k],
            found.variation_percent[k],
            digits[k],
            reason,
            ours=virtual[k] if virtual else None,
            unit="%",
        )


def _table4(results: Mapping) -> Iterator[Row]:
    for unit in UNITS:
        for arm in ("none", "simple", "hysteresis"):
            yield _of_table4(unit, arm, pick(results, "chamber", "table4", unit, arm), results)


def _of_table4(unit: str, arm: str, est: Mapping | None, results: Mapping) -> Row:
    printed = PRINTED[unit]["table4"][arm]
    id = f"A-T4/{unit.removeprefix('JB-KT8 ')}/{arm}"
    words = {"none": "without", "simple": "with simple", "hysteresis": "with the proposed"}[arm]
    title = f"{unit}: temperature sensitivity of the scale factor {words} compensation"
    mine = f" Ours: {between(est)}, median and central 95 % of the draws." if est else ""
    if arm == "none":
        recomputed = audit.printed_sensitivity(unit)
        scaled = pick(results, "chamber", "table4_scaled", unit, arm)
        reason = (
            f"The printed polynomial gives {number(recomputed)} over the quoted range with T0 = 22 °C; T0 would "
            f"have to be {number(audit.reference_needed_c(unit))} °C.{mine}"
        )
        if scaled:
            reason += f" With the slope scaled to the table ours is {between(scaled)}."
        return row(id, title, CONTRADICTS, reason, printed=printed, recomputed=recomputed, ours=est, unit="ppm/°C")
    if arm == "simple":
        least = audit.least_for_a_line(unit)
        reason = f"No straight line leaves less than {number(least)} of the printed polynomial."
        if least > printed:
            return row(
                id, title, CONTRADICTS, reason + mine, printed=printed, recomputed=least, ours=est, unit="ppm/°C"
            )
        of = "the central 95 % of our draws of this unit"
        return simulated(id, title, printed, est, of, reason, recomputed=least, unit="ppm/°C")
    reason = (
        f"Implied: {number(audit.residual_peak_to_peak_ppm(unit))} ppm from peak to peak.{mine} The size of the "
        "magnet's loop in the simulation was chosen after this column, so an agreement would show nothing."
    )
    if est is None:
        return row(id, title, NOT_REPRODUCED, NOT_COMPUTED, printed=printed, unit="ppm/°C")
    return row(id, title, NOT_REPRODUCED, reason, printed=printed, ours=est, unit="ppm/°C")


def _table5() -> Iterator[Row]:
    population, gyros = Population.load(), GyroPopulation()
    simulated_as = {
        ("accelerometer", "bias_stability_ug"): (
            "bias stability",
            "µg",
            population["in_run"].sigma_ug,
            "the bias wanders by less than it allows; how much less is assumed.",
        ),
        ("accelerometer", "bias_repeatability_ug"): (
            "bias repeatability",
            "µg",
            population["turn_on"].sigma_ug,
            "the bias of a switch-on is drawn with it.",
        ),
        ("accelerometer", "scale_linearity_ppm"): (
            "scale factor linearity",
            "ppm",
            population["nonlinearity"].k2_sigma_ug_per_g2,
            "the quadratic coefficient is drawn with it.",
        ),
        ("accelerometer", "scale_repeatability_ppm"): (
            "scale factor repeatability",
            "ppm",
            population["scale_repeatability"].sigma_ppm,
            "the scale factor of a switch-on is drawn with it.",
        ),
        ("gyro", "bias_stability_deg_per_h"): (
            "bias stability",
            "°/h",
            gyros.bias_deg_per_h,
            "the bias of a switch-on is drawn with stability and repeatability together.",
        ),
        ("gyro", "scale_linearity_ppm"): (
            "scale factor linearity",
            "ppm",
            gyros.asymmetry_ppm,
            "a scale factor error that changes sign with the rate is drawn with it.",
        ),
        ("gyro", "scale_repeatability_ppm"): (
            "scale factor repeatability",
            "ppm",
            gyros.scale_ppm,
            "the scale factor of a switch-on is drawn with it.",
        ),
    }
    for (group, field), (title, unit, ours, why) in simulated_as.items():
        printed = getattr(getattr(INS, group), field)
        yield given(
            f"A-T5/{group}/{field}", f"{group.capitalize()}: {title}", why, printed=printed, ours=ours, unit=unit
        )
    found = devices.gyro_scale_repeatabilities()
    yield row(
        "A-T5/gyro/second_row",
        "Gyro: what the table calls scale factor repeatability in °/h",
        CONTRADICTS,
        f"The table gives the scale factor repeatability twice, {found['deg/h']:g} °/h and {found['ppm']:g} ppm; "
        "only the latter has the unit of one. The former is taken as that of the bias.",
        printed=found["deg/h"],
        unit="°/h",
    )


def _table6(results: Mapping) -> Iterator[Row]:
    oven = pick(results, "oven")
    for case, words in (("given", "true attitude given"), ("aligned", "self-aligned")):
        for printed_arm, arm in PAPER_ARM.items():
            for axis in navigation.AXES:
                yield _of_one(
                    f"A-T6/{case}/{printed_arm}/{axis}",
                    f"Oven, {printed_arm}, {words}: {axis} velocity RMS",
                    PRINTED["table6"][printed_arm][axis],
                    OfMany(pick(oven, case, arm, axis), pick(oven, "single", case, arm, axis), "oven runs"),
                    "m/s",
                    "The printed run is one of the best of ten.",
                )
        for axis in navigation.AXES:
            yield simulated(
                f"A-T6/{case}/reduction/{axis}",
                f"Oven, {words}: reduction of the {axis} velocity RMS, best of ten runs",
                PRINTED["table6"]["reduction_percent"][axis],
                pick(oven, "best_of_ten", case, axis),
                "the central 95 % of the best of ten runs of our instruments",
                _typical(oven, case, axis),
                recomputed=navigation.reduction_percent(PRINTED["table6"], axis),
                unit="%",
            )


def _typical(oven: Any, case: str, axis: str) -> str:
    gain = pick(oven, "gain", case, axis)
    return f"Over all runs and instruments it is {between(percent_off(gain))} %." if gain else ""


def _table7(results: Mapping) -> Iterator[Row]:
    for printed_arm, arm in PAPER_ARM.items():
        for axis in navigation.AXES:
            yield _of_one(
                f"A-T7/{printed_arm}/{axis}",
                f"Flight, {printed_arm}: {axis} velocity RMS",
                PRINTED["table7"][printed_arm][axis],
                OfMany(
                    pick(results, "flight", "ensemble", arm, "velocity_rms_mps", axis),
                    pick(results, "flight", "single", arm, f"velocity_rms_{axis}"),
                ),
                "m/s",
            )
    for axis in navigation.AXES:
        yield _reduction(
            results,
            f"A-T7/reduction/{axis}",
            f"Flight: reduction of the {axis} velocity RMS",
            PRINTED["table7"]["reduction_percent"][axis],
            navigation.reduction_percent(PRINTED["table7"], axis),
            f"velocity_rms_{axis}",
        )


def _cep(results: Mapping) -> Iterator[Row]:
    for definition, meaning in DEFINITIONS.items():
        measure, name = f"cep_rate_{definition}", definition.replace("_", " ")
        for printed_arm, arm in PAPER_ARM.items():
            yield _of_one(
                f"A-CEP/{definition}/{printed_arm}",
                f"CEP rate ({name}: {meaning.formula}), {printed_arm}",
                PRINTED["cep"][printed_arm],
                OfMany(
                    pick(results, "flight", "ensemble", arm, "cep_rate_nmi_per_h", definition),
                    pick(results, "flight", "single", arm, measure),
                ),
                "nmi/h",
                "The paper does not define its CEP.",
            )
        yield _reduction(
            results,
            f"A-CEP/{definition}/reduction",
            f"Reduction of the CEP rate ({name}: {meaning.formula})",
            PRINTED["cep"]["reduction_percent"],
            navigation.reduction_percent(PRINTED["cep"]),
            measure,
        )


def _reduction(results: Mapping, id: str, title: str, printed: float, recomputed: float, measure: str) -> Row:
    """What refined hysteresis takes off simple compensation, %."""
    ratio = pick(results, "flight", "ensemble", "improvement", f"{SECOND}/{FIRST}", measure)
    single = pick(results, "flight", "single", "gain_percent", measure)
    return _of_one(id, title, printed, OfMany(percent_off(ratio), single), "%", recomputed=recomputed)


def _of_one(
    id: str, title: str, printed: float, ours: OfMany, unit: str, also: str = "", recomputed: float | None = None
) -> Row:
    """A printed number of one flight or oven run against the central 95 % of ours; ours is the ensemble's value.

    Where single ones were not kept, the interval of the ensemble's value stands for them, narrower and named.
    """
    ensemble, single, what = ours
    if ensemble is None:
        return simulated(id, title, printed, None, "", recomputed=recomputed, unit=unit)
    apart = f"Ours is {ensemble['value'] - printed:+.2f} {unit} from it."
    if single is None:
        of = f"the 95 % interval of the value over all our {what}"
        return simulated(id, title, printed, ensemble, of, f"{apart} {also}", recomputed=recomputed, unit=unit)
    both = {"value": ensemble["value"], "interval95": single["interval95"]}
    of = f"the central 95 % of our single {what}"
    words = f"Over all our {what}: {between(ensemble)} {unit}. {apart} {also}"
    return simulated(id, title, printed, both, of, words, recomputed=recomputed, unit=unit)
