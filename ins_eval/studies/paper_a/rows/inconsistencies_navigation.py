"""What does not fit together in Paper A's navigation and tables: A19 to A30, each computed in ``audit``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ins_eval.metrics import DEFINITIONS
from ins_eval.studies.paper_a.audit import devices, navigation
from ins_eval.studies.paper_a.audit import scale_factor as audit
from ins_eval.studies.paper_a.printed import PRINTED
from ins_eval.studies.paper_a.rows.claims_sensors import NOTHING_PERCENT
from ins_eval.studies.paper_a.single import FIRST, SECOND
from ins_eval.studies.papers import (
    CONTRADICTS,
    GIVEN,
    NOT_COMPUTED,
    NOT_REPRODUCED,
    Row,
    as_printed,
    between,
    claimed,
    decided,
    listed,
    number,
    percent_off,
    recalculated,
    row,
    same,
    simulated,
)
from ins_eval.tables import pick
from ins_eval.units import HOUR, NMI


def navigation_rows(results: Mapping, ours: Mapping) -> Iterator[Row]:
    """Flight, CEP, labels, oven."""
    yield from _flight(ours)
    yield from _cep(results)
    yield from _rest(results)


def _flight(ours: Mapping) -> Iterator[Row]:
    thermal = pick(ours, "thermal")
    start = navigation.cruise_start_c()
    rates = [navigation.cruise_rate_c_per_min(t) for t in (15.0, 20.0, 25.0)]
    yield row(
        "A19",
        "Rate of cooling in the cruise",
        NOT_REPRODUCED,
        f"90 min at 0.2 °C/min end at -11 °C only if the cruise begins at {start:+.0f} °C; from 15, 20 or 25 °C "
        f"the rate is {listed(rates, 2)} °C/min. The temperature at the start of the cruise is not printed."
        + (
            f" Ours begins it at {thermal['cruise_start_c']:.1f} °C and cools at "
            f"{number(thermal['mean_rate_cruise'])} °C/min."
            if thermal
            else ""
        ),
        printed=PRINTED["chamber"]["usual_flight_rate_c_per_min"],
        recomputed=listed(rates, 2),
        ours=thermal["mean_rate_cruise"] if thermal else None,
        unit="°C/min",
    )
    of = PRINTED["flight"]
    yield row(
        "A20",
        "Where the INS was installed",
        CONTRADICTS,
        f"The text and the caption of Fig. 12 name {navigation.places()} places. It does not matter for the "
        "navigation.",
        printed=of["ins_installed"][0],
        recomputed=of["ins_installed"][1],
    )
    yield recalculated(
        "A21",
        "Durations, and what begins after 6000 s",
        of["duration_h"],
        navigation.duration_h(),
        0.1,
        f"The phases make {number(navigation.duration_h())} h. At {of['early_late_s']:.0f} s the cruise is "
        f"{of['early_late_s'] - 60 * of['climb_min']:.0f} s old and ends "
        f"{navigation.landing_at_s() - of['early_late_s']:.0f} s later; read as the rest of the cruise and the "
        "landing, the statement fits.",
        unit="h",
    )
    printed, found = [], []
    for table in ("table6", "table7"):
        for axis in navigation.AXES:
            printed.append(PRINTED[table]["reduction_percent"][axis])
            found.append(navigation.reduction_percent(PRINTED[table], axis))
    printed.append(PRINTED["cep"]["reduction_percent"])
    found.append(navigation.reduction_percent(PRINTED["cep"]))
    yield decided(
        "A22",
        "Percentages",
        all(same(p, f, 0.1) for p, f in zip(printed, found, strict=True)),
        "All five reductions follow from the numbers beside them.",
        CONTRADICTS,
        fails="one of them, computed again, rounded to another number",
        printed=as_printed(printed),
        recomputed=listed(found, 4),
        unit="%",
    )


def _cep(results: Mapping) -> Iterator[Row]:
    of, needed = PRINTED["cep"], navigation.flights_for_an_interval()
    gain = pick(results, "flight", "ensemble", "improvement", f"{SECOND}/{FIRST}", "cep_rate_final")
    ours = percent_off(gain)
    yield row(
        "A23",
        "CEP of one flight, improved by at least 16.2 %",
        NOT_REPRODUCED,
        f"A CEP is the radius that holds half of many flights; {PRINTED['flight']['flights']} was flown, and "
        f"{needed} are the fewest from which any 95 % interval of a median follows. "
        f"{navigation.reduction_percent(of):.2f} % is the one value, not a bound."
        + (f" Ours (final, ensemble): {between(ours)} %." if ours else " Our value: not computed in this run."),
        printed=of["reduction_percent"],
        recomputed=navigation.reduction_percent(of),
        ours=ours,
        unit="%",
    )
    for arm, name in (("simple", FIRST), ("hysteresis", SECOND)):
        printed = navigation.cep_to_velocity(arm)
        velocity = pick(results, "flight", "ensemble", name, "velocity_rms_mps", "horizontal")
        rates = pick(results, "flight", "ensemble", name, "cep_rate_nmi_per_h")
        if not (velocity and rates):
            yield row(f"A24/{arm}", _ratio_title(arm), NOT_REPRODUCED, NOT_COMPUTED, recomputed=printed)
            continue
        ratios = {d: _quotient(rates[d], velocity, NMI / HOUR) for d in DEFINITIONS if d in rates}
        others = ", ".join(f"{d.replace('_', ' ')} {number(r['value'])}" for d, r in ratios.items() if d != "final")
        yield simulated(
            f"A24/{arm}",
            _ratio_title(arm),
            printed,
            ratios["final"],
            "the interval of ours for the definition final, from the ends of its two 95 % intervals",
            f"Printed is the quotient of two printed numbers. Other definitions: {others}.",
        )


def _ratio_title(arm: str) -> str:
    return f"CEP rate over horizontal velocity RMS, both in m/s, {arm}"


def _quotient(above: Mapping, below: Mapping, factor: float = 1.0) -> dict:
    """Quotient of two estimates; its interval from the ends of theirs, so wider than one of 95 %."""
    (low, high), (least, most) = above["interval95"], below["interval95"]
    return {
        "value": factor * above["value"] / below["value"],
        "interval95": [factor * low / most, factor * high / least],
    }


def _rest(results: Mapping) -> Iterator[Row]:
    found = devices.gyro_scale_repeatabilities()
    yield row(
        "A25",
        "Scale factor repeatability of the gyro in °/h",
        CONTRADICTS,
        f"Table 5 gives the quantity twice, as {found['deg/h']:g} °/h and as {found['ppm']:g} ppm; the former must "
        "be the bias.",
        printed=found["deg/h"],
        recomputed=found["ppm"],
    )
    for axis in navigation.AXES:
        best = pick(results, "oven", "best_of_ten", "given", axis)
        typical = pick(results, "oven", "median_of_ten", "given", axis)
        yield simulated(
            f"A26/{axis}",
            f"One of the best of ten runs: reduction of the {axis} velocity RMS",
            PRINTED["table6"]["reduction_percent"][axis],
            best,
            "the central 95 % of the best of ten runs of our instruments",
            f"Nine of ten runs are not printed. The median of ten runs is {between(typical)} %." if typical else "",
            unit="%",
        )
    tabled, of_units = devices.scale_sensitivities()
    yield row(
        "A27",
        "Table 1: names and bounds",
        CONTRADICTS,
        f"The title says {PRINTED['table1_names']['title']}, the column {PRINTED['table1_names']['column']}; the "
        f"bandwidth is bounded from {' and from '.join(devices.bandwidth_senses())}. Its {tabled:g} ppm/°C is not "
        f"that of the units that were used ({as_printed(of_units)}).",
        printed=PRINTED["table1_names"]["title"],
        recomputed=PRINTED["table1_names"]["column"],
    )
    yield row(
        "A28",
        "Pulses per g without a time base",
        NOT_REPRODUCED,
        f"{GIVEN}pulses per second and g. If they are, one pulse of #1 is {number(audit.pulse_ug())} µg over a second.",
        recomputed=audit.pulse_ug(),
        unit="µg",
    )
    yield _scale_hysteresis(results)
    yield from _lab_and_flight(results)


def _scale_hysteresis(results: Mapping) -> Row:
    """A29: does the hysteresis of the scale factor matter in navigation?"""
    at_02 = navigation.rate_terms_ppm(PRINTED["chamber"]["usual_flight_rate_c_per_min"])
    tree = pick(results, "flight", "ensemble", "improvement")
    rate = pick(tree, "hysteresis/hysteresis_without_rate", "velocity_rms_horizontal")
    title = "Compensating the hysteresis of the scale factor improves navigation"
    physics = (
        f"The rate terms are {listed(at_02, 2)} ppm at 0.2 °C/min and act on a horizontal specific force of nearly "
        f"0; {number(navigation.force_for_turn_on_g(0.2), 2)} g would be needed for the largest to equal the bias "
        "repeatability."
    )
    ours = percent_off(rate)
    if ours is None:
        return row("A29", title, NOT_REPRODUCED, f"{NOT_COMPUTED} {physics}", unit="%")
    return claimed(
        "A29",
        title,
        ours,
        f"{physics} Ours: the rate terms, added to a model that is otherwise the same, take {between(ours)} % off "
        f"the horizontal velocity RMS; to matter they would have to take more than {NOTHING_PERCENT:g} % with "
        "certainty.",
        above=NOTHING_PERCENT,
        what="what they take off",
        unit="%",
    )


def _lab_and_flight(results: Mapping) -> Iterator[Row]:
    for case in ("given", "aligned"):
        for axis in navigation.AXES:
            printed = navigation.flight_to_oven(FIRST, axis)
            flight = pick(results, "flight", "ensemble", FIRST, "velocity_rms_mps", axis)
            oven = pick(results, "oven", case, FIRST, axis)
            yield simulated(
                f"A30/{case}/{axis}",
                f"{axis.capitalize()} velocity RMS of the flight over that of the oven, simple, oven "
                + ("with the true attitude given" if case == "given" else "self-aligned"),
                printed,
                _quotient(flight, oven) if flight and oven else None,
                "the interval of ours, from the ends of two 95 % intervals",
                "An IMU that stands where it aligned itself hides constant level and east-gyro errors; the paper "
                "does not say how its oven runs were aligned.",
            )
