"""What the text of Paper A claims about accelerometers, magnet, epoxy and chamber."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ins_eval.studies.paper_a.audit import chamber, devices, epoxy, navigation
from ins_eval.studies.paper_a.audit import scale_factor as audit
from ins_eval.studies.paper_a.printed import INS, PRINTED, UNITS
from ins_eval.studies.paper_a.single import FIRST
from ins_eval.studies.papers import (
    CONTRADICTS,
    NOT_REPRODUCED,
    Estimate,
    Row,
    as_printed,
    between,
    claimed,
    decided,
    given,
    listed,
    number,
    recalculated,
    row,
    same,
)
from ins_eval.tables import pick

VELOCITY = "velocity_rms_horizontal"
NOTHING_PERCENT = 1.0  # an effect on the velocity RMS that is at most so large does not matter
HALF = 50.0  # per cent: what "main" or "no explicit relation" has to mean at least
REPEATABLE_PERCENT = 5.0  # scatter up to which a deformation counts as repeatable
KELVIN = 273.15


def sensor_rows(results: Mapping, ours: Mapping) -> Iterator[Row]:
    """In the order of the paper."""
    yield from _data_sheets()
    yield from _hysteresis(results, ours)
    yield from _negligible(results)
    yield from _omitted(ours)
    yield from _epoxy(ours)
    yield from _chamber(results, ours)
    yield from _table4()


def unseen(results: Mapping) -> float | None:
    """Velocity RMS in m/s that adds `NOTHING_PERCENT` in squares to that of a flight with simple compensation."""
    whole = pick(results, "flight", "ensemble", FIRST, "velocity_rms_mps", "horizontal", "value")
    return whole and whole * float(np.sqrt((1.0 + NOTHING_PERCENT / 100.0) ** 2 - 1.0))


def _data_sheets() -> Iterator[Row]:
    drift, of = devices.drift(), PRINTED["drift"]
    for id, what, printed, value, unit, digit in (
        ("A-C1", "bias drifts by nearly 1.35 mg", of["bias_mg"], drift.bias_ug / 1e3, "mg", 0.01),
        ("A-C2", "scale factor drifts by 10 800 ppm", of["scale_ppm"], drift.scale_ppm, "ppm", 100.0),
    ):
        yield recalculated(
            id,
            f"QA3000-030 without compensation: {what}",
            printed,
            value,
            digit,
            f"Sensitivity times range gives {number(value, 5)} {unit}.",
            unit=unit,
        )
    ratio = devices.largest_ratio()
    yield row(
        "A-C3",
        "The two accelerometers of Table 1 perform alike",
        NOT_REPRODUCED,
        f"Their temperature sensitivities, which the paper is about, differ by factors of up to {number(ratio)}.",
        recomputed=ratio,
    )


def _hysteresis(results: Mapping, ours: Mapping) -> Iterator[Row]:
    shares = [pick(results, "chamber", "magnet_share", unit) for unit in UNITS]
    yield given(
        "A-C7",
        "The magnet is the main factor of the scale factor's hysteresis",
        "the size of the simulated magnet's loop was chosen after Table 4."
        + (f" It opens {' / '.join(between(s) for s in shares)} of the loops at 22 °C." if all(shares) else ""),
    )
    bias = pick(ours, "bias")
    yield claimed(
        "A-C8",
        "Viscoelasticity of the epoxy is the main factor of the bias hysteresis",
        bias and bias["creep_share"],
        bias
        and f"In ours creep, whose size follows from Tables 2 and 3, opens {between(bias['creep_share'])} of the "
        "bias loop at 40 °C in the slowest cycle (central 95 % of units); the rest is the lag of the inner "
        "elements, which is assumed.",
        above=HALF / 100.0,
        what="the share of creep",
    )


def _negligible(results: Mapping) -> Iterator[Row]:
    """Terms of the output equation that the paper leaves out."""
    terms, invisible = pick(results, "flight", "budget", "accelerometer_cross_terms", FIRST, VELOCITY), unseen(results)
    yield claimed(
        "A-C9",
        "K3, Kip, Kio, δo and δp are negligible",
        terms if invisible else None,
        terms
        and invisible
        and "No size is printed, and in every other row they are zero. With sizes that we assume (K3 10 µg/g³, Kip and "
        f"Kio 30 µg/g², δ 50 µrad, one sigma each) they alone give {between(terms)} m/s of horizontal velocity RMS "
        f"with simple compensation; below {number(invisible)} they add less than {NOTHING_PERCENT:g} % in squares.",
        below=invisible or 0.0,
        what="their velocity RMS",
        unit="m/s",
    )


def _omitted(ours: Mapping) -> Iterator[Row]:
    """Terms that eq. (11) leaves out."""
    high, printed = pick(ours, "high_order"), PRINTED["high_order"]["coefficient"]
    terms = {"rate2_difference": "r² ΔT", "rate2_difference2": "r² ΔT²", "rate_difference2": "r ΔT²"}
    yield decided(
        "A-C11/coefficients",
        f"Coefficients of {', '.join(terms.values())}, fitted over the flight, are about 1e-5",
        high and any(all(_of_magnitude(high[key + of], printed) for key in terms) for of in ("", "_of_gamma")),
        high
        and "Ours, least squares of all nine terms over the flight, medians of the units: "
        f"{listed([high[key]['value'] for key in terms])} pulse/(g s), or "
        f"{listed([high[f'{key}_of_gamma']['value'] for key in terms])} of γ (in °C and °C/min; no unit is "
        "printed). Reproduced if in either unit all three are within 0.3e-5 to 3e-5.",
        fails="in either unit one of the three were outside 0.3e-5 to 3e-5",
        printed=printed,
        ours=high and listed([high[f"{key}_of_gamma"]["value"] for key in terms]),
    )
    repeatability = INS.accelerometer.scale_repeatability_ppm
    yield claimed(
        "A-C11/size",
        "The terms that eq. (11) omits are small",
        high and high["most_ppm"],
        high
        and f"In the fit over the flight they make up to {between(high['most_ppm'])} ppm together, against a "
        f"repeatability of {repeatability:g} ppm: they take up part of the magnet's memory.",
        below=repeatability,
        what="what they make",
        unit="ppm",
    )
    demanded = [audit.omitted_coefficient(unit) for unit in UNITS]
    yield decided(
        "A-C11/printed",
        "Coefficient of r² ΔT that eq. (7) demands with the printed η and |μ|",
        all(0.3 * printed <= c <= 3.0 * printed for c in demanded),
        f"η² / 4 |μ| is {listed(demanded, 2)} pulse/g for the three units; 1e-5 would have to hold for all.",
        CONTRADICTS,
        fails="one of the three were outside 0.3e-5 to 3e-5",
        printed=printed,
        recomputed=listed(demanded, 2),
    )
    words = PRINTED["flight"]["gradient_in_flight"]
    yield row(
        "A-C12",
        "Rate and range of temperature in flight",
        CONTRADICTS,
        f"Where terms are dropped they are {words[1]}, where the epoxy matters {words[0]} and wide."
        + (
            f" In our flight the temperature is up to {ours['thermal']['farthest_from_reference_c']:.0f} °C from "
            "T0 = 22 °C."
            if pick(ours, "thermal")
            else ""
        ),
        printed=words[1],
        recomputed=words[0],
    )


def _of_magnitude(estimate: Estimate, printed: float) -> bool:
    return 0.3 * printed <= estimate["value"] <= 3.0 * printed


def _epoxy(ours: Mapping) -> Iterator[Row]:
    slow, fast = epoxy.of_table("creep_um"), epoxy.of_table("thermal_um")
    celsius = PRINTED["creep"]["temperature_c"]
    yield decided(
        "A-C13",
        "Creep grows with temperature",
        bool(np.all(np.diff(slow.mean_um) > 0.0)),
        f"The means of Table 2 are {listed(slow.mean_um)} µm at {as_printed(celsius)} °C.",
        CONTRADICTS,
        fails="a mean were smaller than that of a colder block",
        recomputed=listed(slow.mean_um),
        unit="µm",
    )
    kelvin = np.array(celsius) + KELVIN
    speed, warm = slow.mean_um / slow.mean_um[0], kelvin / kelvin[0]
    yield decided(
        "A-C14",
        "The speed of creep is proportional to temperature",
        bool(np.allclose(speed, warm, rtol=0.1)),
        f"Over the same 300 min the mean creep goes as {listed(speed)}, the absolute temperature as "
        f"{listed(warm)}; in °C it changes sign. It grows with temperature, not in proportion.",
        CONTRADICTS,
        fails="the two went apart by more than 10 %",
        recomputed=listed(speed),
    )
    yield decided(
        "A-C15",
        "Creep varies greatly at the same temperature",
        bool(slow.cv_percent.min() > 5.0 * fast.cv_percent.max()),
        f"The scatter is {listed(slow.cv_percent)} %, that of the thermal deformation {listed(fast.cv_percent)} %.",
        CONTRADICTS,
        fails="the smallest scatter were not five times the largest of the thermal deformation",
        recomputed=listed(slow.cv_percent),
        unit="%",
    )
    yield decided(
        "A-C16",
        "Thermal deformation is repeatable",
        bool(fast.cv_percent.max() < REPEATABLE_PERCENT),
        f"The scatter is {listed(fast.cv_percent)} % (repeatable: below {REPEATABLE_PERCENT:g} %); the variation "
        f"at 85 °C is {fast.variation_percent[2]:.2f} %, printed "
        f"{PRINTED['creep']['table3_variation_percent'][2]:g} %.",
        CONTRADICTS,
        fails=f"the scatter of a block reached {REPEATABLE_PERCENT:g} %",
        recomputed=listed(fast.cv_percent),
        unit="%",
    )
    share = pick(ours, "creep", "finished_share")
    yield given(
        "A-C17",
        "How long the slow deformation takes depends on temperature",
        "no durations are printed but one; warm epoxy is assumed to be faster."
        + (
            f" After 300 min {as_printed([round(100 * s) for s in share])} % of the final creep is there at "
            f"{as_printed(celsius)} °C."
            if share
            else ""
        ),
    )


def _chamber(results: Mapping, ours: Mapping) -> Iterator[Row]:
    thermal, scale, bias = (pick(ours, key) for key in ("thermal", "scale", "bias"))
    usual, justified = (PRINTED["chamber"][k] for k in ("usual_flight_rate_c_per_min", "justified_rate_c_per_min"))
    rate = thermal and thermal["mean_rate"]
    yield decided(
        "A-C18",
        "The rate of temperature in flight is about 0.2 °C/min",
        thermal and same(usual, rate, 0.1),
        thermal
        and f"Our heat balance gives {number(thermal['mean_rate'])} °C/min on average over the flight, "
        f"{number(thermal['mean_rate_cruise'])} in the cruise and {number(thermal['max_rate'])} at most.",
        printed=usual,
        recomputed=f"cruise from {navigation.cruise_start_c():+.0f} °C",
        ours=rate,
        passes=rate and (rate - 0.05, rate + 0.05),
        fails="our mean did not round to the printed rate",
        unit="°C/min",
    )
    slew = chamber.slew()
    yield decided(
        "A-C19",
        "A calibration at 1 °C/min covers all rates in flight",
        thermal and thermal["max_rate"] <= slew.fastest_step,
        thermal
        and f"Ours stays below {number(thermal['max_rate'])} °C/min in flight, and the steps reach "
        f"{slew.fastest_step:g} °C/min in both directions. No step uses {justified:g} °C/min (A9).",
        fails="the temperature of our flight changed faster than the fastest step of the chamber",
        printed=justified,
        recomputed=slew.fastest_step,
        ours=thermal and thermal["max_rate"],
        unit="°C/min",
    )
    yield decided(
        "A-C20",
        "The scale factor falls while the temperature rises",
        all(map(audit.falls_throughout, UNITS)),
        "The three printed polynomials fall over their whole range."
        + (
            f" In our chamber it is {between(scale['cold_minus_hot_ppm'])} ppm larger at the cold end than at the "
            f"hot one (central 95 % of units), for {100 * scale['falls_share']:.0f} % of them larger; the slope is "
            "that of eqs (15)-(17)."
            if scale
            else ""
        ),
        CONTRADICTS,
        fails="one of the polynomials rose anywhere in its range",
        ours=scale and scale["cold_minus_hot_ppm"],
        unit="ppm",
    )
    yield row(
        "A-C21",
        "The upper curve of the scale factor is the falling one",
        CONTRADICTS,
        "Falling minus rising by the printed coefficients: "
        f"{listed([audit.falling_minus_rising_ppm(u) for u in UNITS])} ppm at 0.3 °C/min and T0."
        + (f" Ours, signs turned: {between(scale['falling_minus_rising_ppm'])} ppm." if scale else ""),
        printed="above 0",
        recomputed=listed([audit.falling_minus_rising_ppm(u) for u in UNITS]),
        ours=scale and scale["falling_minus_rising_ppm"],
        unit="ppm",
    )
    for unit in UNITS:
        yield _quoted(unit, pick(results, "chamber", "table4", unit, "none"))
    left = bias and bias["open_by_curve_percent"]
    yield claimed(
        "A-C23",
        "There is no explicit relation between bias and temperature",
        left,
        bias
        and f"Of the variance of K0 in the chamber a straight line leaves {between(bias['open_by_line_percent'])} "
        f"% open, one curve for both directions {between(left)} %, a curve for each "
        f"{between(bias['open_by_branches_percent'])} % (central 95 % of units). The thermal slope, "
        f"{between(bias['slope_ug_per_c'])} µg/°C after Table 1, makes it explicit; no slope of the JB-KT8 is "
        "printed.",
        above=HALF,
        what="what one curve leaves",
        unit="%",
    )


def _quoted(unit: str, ours: Estimate | None) -> Row:
    of = PRINTED[unit]
    low, high = of["range_c"]
    computed = audit.printed_sensitivity(unit) * (high - low)
    return row(
        f"A-C22/{unit.removeprefix('JB-KT8 ')}",
        f"{unit}: the scale factor changes by {of['change_ppm']:.0f} ppm from {low:g} to {high:g} °C",
        CONTRADICTS,
        f"The printed polynomial changes by {computed:.0f} ppm over that range with T0 = 22 °C, and the quoted "
        f"change is {number(audit.quoted_sensitivity(unit), 4)} ppm/°C where the text has {of['text_ppm_per_c']:g}."
        + (f" Ours: {between(ours)} ppm/°C." if ours else ""),
        printed=of["change_ppm"],
        recomputed=computed,
        unit="ppm",
    )


def _table4() -> Iterator[Row]:
    text, ratios = PRINTED["table4_text"], [audit.table4_ratio(unit) for unit in UNITS]
    yield decided(
        "A-C24",
        "The proposed model is at least an order of magnitude better than the simple one",
        min(ratios) >= text["at_least_times_better"],
        f"Table 4: {listed(ratios, 2)} times.",
        CONTRADICTS,
        fails="one of the three ratios were smaller",
        printed=text["at_least_times_better"],
        recomputed=listed(ratios, 2),
    )
    simple = [PRINTED[unit]["table4"]["simple"] for unit in UNITS]
    about = text["simple_about_ppm_per_c"]
    yield decided(
        "A-C25",
        "Simple compensation leaves about 10 ppm/°C",
        all(same(about, s, 1.0) for s in simple),
        f"Table 4 has {listed(simple, 4)}.",
        CONTRADICTS,
        fails="one of the three did not round to 10",
        printed=about,
        recomputed=listed(simple, 4),
        unit="ppm/°C",
    )
    proposed = [PRINTED[unit]["table4"]["hysteresis"] for unit in UNITS]
    below = text["proposed_below_ppm_per_c"]
    yield decided(
        "A-C26",
        "The proposed model leaves less than 5 ppm/°C",
        all(p < below for p in proposed),
        f"Table 4 has {listed(proposed)}.",
        CONTRADICTS,
        fails="one of the three were larger",
        printed=below,
        recomputed=listed(proposed),
        unit="ppm/°C",
    )
