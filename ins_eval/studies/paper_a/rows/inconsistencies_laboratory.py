"""What does not fit together in Paper A's laboratory: A1 to A18, each from a computation in ``audit``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ins_eval.calibration.labelings import FIGURE_4, TURNED
from ins_eval.studies.paper_a.audit import chamber, epoxy
from ins_eval.studies.paper_a.audit import scale_factor as audit
from ins_eval.studies.paper_a.printed import INS, PRINTED, UNITS
from ins_eval.studies.paper_a.single import SECOND
from ins_eval.studies.papers import (
    CONTRADICTS,
    GIVEN,
    NOT_REPRODUCED,
    Row,
    as_printed,
    between,
    given,
    listed,
    number,
    row,
)
from ins_eval.tables import pick


def laboratory_rows(results: Mapping, ours: Mapping) -> Iterator[Row]:
    """Creep, equations, chamber, Table 4."""
    yield from _epoxy()
    yield from _equations()
    yield from _chamber()
    yield from _table4(results, ours)
    yield from _residuals(results)
    yield _surface()


def _epoxy() -> Iterator[Row]:
    for id, key, table in (("A1", "creep_um", 2), ("A2", "thermal_um", 3)):
        printed, found = PRINTED["creep"][f"table{table}_variation_percent"], epoxy.of_table(key).variation_percent
        pairs = epoxy.overlooked(key)
        yield row(
            id,
            f"Variations of Table {table}",
            CONTRADICTS,
            "By the formula below the table they are other numbers; the printed ones come from "
            + " and from ".join(f"{high:g} and {low:g} µm" for high, low in pairs)
            + ", where an extreme was overlooked.",
            printed=as_printed(printed),
            recomputed=" / ".join(f"{f:.2f}" for f in found),
            unit="%",
        )
    of = PRINTED["creep"]
    yield row(
        "A3",
        "Temperatures in the caption of Fig. 3",
        CONTRADICTS,
        f"{epoxy.caption_differences()} of three differ from text and tables.",
        printed=as_printed(of["figure3_caption_c"]),
        recomputed=as_printed(of["temperature_c"]),
        unit="°C",
    )
    yield row(
        "A4",
        "Signs of the deformations",
        CONTRADICTS,
        f"All are negative in the tables; by the text {epoxy.sign_differences()} of three blocks expanded.",
        printed="-, -, -",
        recomputed="-, +, +",
    )
    one, steps = epoxy.expansion_um_per_c(), epoxy.expansion_um_per_c(epoxy.STEPS_FROM_C)
    start, left = epoxy.best_common_start()
    yield row(
        "A5",
        "Thermal deformation per degree",
        NOT_REPRODUCED,
        f"The start temperatures are not printed. From {epoxy.SOAK_C:g} °C the three blocks would expand by "
        f"{listed(one)} µm/°C; the best common start, {number(start)} °C, gives {listed(left)}. Starts of 30, -55 "
        f"and -55 °C give {listed(steps)}, the same within {100 * (epoxy.spread(steps) - 1):.1f} %, and are "
        "assumed here.",
        recomputed=epoxy.spread(one),
        ours=epoxy.spread(steps),
        unit="largest/smallest",
    )


def _equations() -> Iterator[Row]:
    demanded = [audit.constraint(unit) for unit in UNITS]
    yield row(
        "A6",
        "Eq. (7) against eqs (8)-(10) and (11)",
        CONTRADICTS,
        "Eq. (7) squares the brackets that eqs (8)-(10) equate unsquared. Squared, they demand ε² = 4 α γ, so ε = "
        f"{listed([c.epsilon_demanded for c in demanded], 6)}, and μ ≥ 0, where "
        f"{as_printed([c.mu_printed for c in demanded])} is printed; unsquared there is no term in r².",
        printed=as_printed([c.epsilon_printed for c in demanded]),
        recomputed=listed([c.epsilon_demanded for c in demanded], 6),
        unit="ε, pulse/g per °C/min",
    )
    figure, turned = (chamber.labelled(force, 1.0, 0.01) for force in (FIGURE_4, TURNED))
    yield row(
        "A7",
        "Positions of the four-point test",
        CONTRADICTS,
        "With the positions of Fig. 4 and step 5, for K1 = 1 and K0 = 0.01 g, eqs (3), (4), (13), (14) give "
        f"{listed(figure)}: -K1/2, K0 - 1/2, 0 and K0. With the head a quarter turn further they give "
        f"{listed(turned)}. Positions are told by specific force here.",
        printed="K1, K0, K1, K0",
        recomputed="-K1/2, K0 - 1/2, 0, K0",
    )
    ramps = chamber.ramps()
    yield row(
        "A8",
        "Constant rate of temperature in the chamber",
        CONTRADICTS,
        f"3 min at each whole degree leave {listed([100 * share for share in ramps.moving_share], 2)} % of the "
        "time to the ramps.",
        printed=as_printed(ramps.commanded_c_per_min),
        recomputed=listed(ramps.mean_c_per_min),
        unit="°C/min",
    )
    slew = chamber.slew()
    yield row(
        "A9",
        "Rate of temperature: justified, commanded, possible",
        CONTRADICTS,
        f"The text justifies {slew.justified:g} °C/min, which no step uses; the steps go up to "
        f"{slew.fastest_step:g}, all below the {slew.oven_slowest:g} °C/min at which the chamber's specification "
        "begins.",
        printed=slew.justified,
        recomputed=slew.fastest_step,
        unit="°C/min",
    )
    ranks = [audit.rank(rates) for rates in ([0.3], [-0.3, 0.3], [-0.3, 0.3, -0.5, 0.5])]
    yield row(
        "A10",
        "Six coefficients from a constant rate",
        CONTRADICTS,
        f"At one constant rate {ranks[0]} of six are determined, in both directions {ranks[1]} (one rate cannot "
        f"separate α from γ), with a second rate {ranks[2]}.",
        printed=6,
        recomputed=ranks[0],
    )


def _chamber() -> Iterator[Row]:
    hours, steady = chamber.effort_h(), chamber.effort_h(dwell=False)
    yield given(
        "A11",
        "Time that steps 1 to 6 take",
        f"no duration is printed, so nothing is tested. The steps take {hours:.0f} h, {chamber.days(hours):.1f} days, "
        f"and {steady:.0f} h without the dwells: longer than a bias stays the same, so the simulated bias shifts "
        "between the runs.",
        recomputed=hours,
        unit="h",
    )


def _table4(results: Mapping, ours: Mapping) -> Iterator[Row]:
    sensitivity = [audit.printed_sensitivity(unit) for unit in UNITS]
    at_zero = [audit.printed_sensitivity(unit, 0.0) for unit in UNITS]
    needed = [audit.reference_needed_c(unit) for unit in UNITS]
    none = [pick(results, "chamber", "table4", unit, "none") for unit in UNITS]
    yield row(
        "A12",
        "Eqs (15)-(17) against Table 4",
        CONTRADICTS,
        f"T0 = 22 °C gives {listed(sensitivity)} ppm/°C and 0 °C {listed(at_zero)}; the table needs T0 = "
        f"{listed(needed)} °C. The quoted changes give {listed([audit.quoted_sensitivity(u) for u in UNITS], 5)}."
        + (f" Ours, T0 = 22 °C: {' / '.join(between(e) for e in none)}." if all(none) else ""),
        printed=as_printed([PRINTED[unit]["table4"]["none"] for unit in UNITS]),
        recomputed=listed(sensitivity),
        unit="ppm/°C",
    )
    loops = [audit.falling_minus_rising_ppm(unit) for unit in UNITS]
    scale = pick(ours, "scale")
    turned = pick(results, "sensitivity", "rate sign/printed", "against_base", SECOND)
    yield row(
        "A13",
        "Sign of the rate terms",
        CONTRADICTS,
        f"The text has the falling curve above; by the printed signs it lies {listed([-v for v in loops])} ppm "
        f"below at 0.3 °C/min and T0 (for #2 above from ΔT = {number(audit.crossing_c(UNITS[1]))} °C on). The "
        "printed signs agree with a magnet that lags the sensor by "
        f"{listed([audit.equivalent_lag_min(u) for u in UNITS], 2)} min. Both can be selected."
        + (f" Ours: {between(scale['falling_minus_rising_ppm'])} ppm." if scale else "")
        + (f" With the printed signs the horizontal velocity RMS is {between(turned)} times ours." if turned else ""),
        printed="falling above",
        recomputed=listed(loops),
        ours=scale["falling_minus_rising_ppm"] if scale else None,
        unit="ppm",
    )
    per = {unit: [audit.linear_rate_term_ppm(u, 0.2, unit) for u in UNITS] for unit in ("degC/min", "degC/s")}
    yield row(
        "A14",
        "Unit of the rate of temperature",
        NOT_REPRODUCED,
        f"{GIVEN}none is printed. At 0.2 °C/min the linear term is {listed(per['degC/min'], 2)} ppm if it is per "
        f"°C/min and {listed(per['degC/s'], 1)} ppm if it is per °C/s, where no loop could be seen. At 0.9 °C/min "
        f"the square term is {listed([audit.square_rate_term_ppm(u, 0.9) for u in UNITS])} ppm, the same on both "
        "branches.",
        recomputed=listed(per["degC/min"], 2),
        unit="ppm",
    )


def _residuals(results: Mapping) -> Iterator[Row]:
    """What Table 4 says of simple compensation and of the proposed one."""
    ratios = [audit.table4_ratio(unit) for unit in UNITS]
    others = [audit.table4_ratio(unit, "none") for unit in UNITS]
    text = PRINTED["table4_text"]
    yield row(
        "A15",
        "At least an order of magnitude better than simple compensation",
        CONTRADICTS,
        f"Table 4 gives {listed(ratios, 2)}; only against no compensation it is {listed(others)}. Unit #3 is at "
        f"{PRINTED[UNITS[2]]['table4']['hysteresis']:g}, not below {text['proposed_below_ppm_per_c']:g} ppm/°C, "
        f"and simple compensation at {as_printed([PRINTED[u]['table4']['simple'] for u in UNITS])}, not about "
        f"{text['simple_about_ppm_per_c']:g}.",
        printed=text["at_least_times_better"],
        recomputed=listed(ratios, 2),
    )
    implied = [audit.residual_peak_to_peak_ppm(unit) for unit in UNITS]
    residual = [pick(results, "chamber", "residual_rms_ppm", unit, "hysteresis") for unit in UNITS]
    repeatability = INS.accelerometer.scale_repeatability_ppm
    yield row(
        "A16",
        "Residual of the proposed method against repeatability",
        NOT_REPRODUCED,
        f"Table 4 implies {listed(implied)} ppm from peak to peak, up to {number(max(implied) / repeatability, 2)} "
        "times the repeatability of Table 5. Neither excludes the other."
        + (f" Ours: {' / '.join(between(r) for r in residual)} ppm RMS." if all(residual) else ""),
        printed=repeatability,
        recomputed=listed(implied),
        unit="ppm",
    )
    least = [audit.least_for_a_line(unit) for unit in UNITS]
    simple = [pick(results, "chamber", "table4", unit, "simple") for unit in UNITS]
    yield row(
        "A17",
        "What a straight line can leave",
        CONTRADICTS,
        f"Of the printed polynomials no line leaves less than {listed(least)} ppm/°C; for #3 the table has less."
        + (f" Ours: {' / '.join(between(e) for e in simple)}." if all(simple) else ""),
        printed=as_printed([PRINTED[unit]["table4"]["simple"] for unit in UNITS]),
        recomputed=listed(least),
        unit="ppm/°C",
    )


def _surface() -> Row:
    offsets, heating = chamber.surface_offsets_c(), chamber.programme().self_heating_c
    cold, hot = (sum(o[k] for o in offsets) / len(offsets) for k in (0, 1))
    return row(
        "A18",
        "Surface against chamber temperature",
        NOT_REPRODUCED,
        f"The surface is {cold:.1f} °C above the chamber when cold and {hot:.1f} when hot, on average of the "
        f"units. Ours is {heating:g} °C warmer throughout, by its own heat (assumed); the difference between the "
        "ends is not explained.",
        printed=" / ".join(f"{PRINTED[u]['range_c'][0]:g} to {PRINTED[u]['range_c'][1]:g}" for u in UNITS),
        recomputed=" / ".join(f"{o[0]:+g}, {o[1]:+g}" for o in offsets),
        ours=heating,
        unit="°C",
    )
