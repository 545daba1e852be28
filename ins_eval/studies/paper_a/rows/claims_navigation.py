"""What the text of Paper A claims about the INS: budget, oven, temperatures of the flight, flight."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ins_eval.studies.paper_a.audit import navigation
from ins_eval.studies.paper_a.printed import PRINTED
from ins_eval.studies.paper_a.single import FIRST, SECOND
from ins_eval.studies.papers import Estimate, Row, between, claimed, decided, given, number, percent_off, recalculated
from ins_eval.tables import pick


def navigation_rows(results: Mapping, ours: Mapping) -> Iterator[Row]:
    """In the order of the paper."""
    yield from _limits(results)
    yield from _oven(results, ours)
    yield from _temperature(ours)
    yield from _flight(results, ours)
    yield from _system(results)


def _limits(results: Mapping) -> Iterator[Row]:
    thermal, others = _budget(results, "accelerometer_bias_thermal"), {}
    for source in ("accelerometer_bias_of_the_run", "accelerometer_scale_factor"):
        others[source] = _budget(results, source)
    known = True if thermal and all(others.values()) else None
    yield decided(
        "A-C4",
        "Temperature is the main factor that degrades the accelerometer",
        known and thermal["interval95"][0] > max(e["interval95"][1] for e in others.values()),
        known
        and f"With simple compensation the thermal bias alone gives {between(thermal)} m/s of horizontal velocity "
        f"RMS, turn-on and in-run bias {between(others['accelerometer_bias_of_the_run'])}, the scale factor "
        f"{between(others['accelerometer_scale_factor'])}. Vibration is not simulated.",
        fails="its interval were not wholly above those of the other sources",
        ours=thermal,
        unit="m/s",
    )
    gyro = _budget(results, "gyro", "cep_rate_final")
    sensors = [_budget(results, s, "cep_rate_final") for s in ("accelerometer_bias_thermal", *others)]
    known = True if gyro and all(sensors) else None
    yield decided(
        "A-C5",
        "The accelerometers, not the gyros, limit the INS",
        known and gyro["interval95"][1] < float(np.sqrt(sum(s["value"] ** 2 for s in sensors))),
        known
        and "Reproduced only if the whole interval of the gyros lies below the root sum of squares of the others. "
        f"CEP rate (final) with simple compensation from the gyros alone {between(gyro)} nmi/h, from the "
        f"accelerometer sources alone {' / '.join(between(s) for s in sensors)} nmi/h. The gyros are those of "
        "Table 5.",
        fails="the interval of the gyros reached the root sum of squares of the others",
        ours=gyro,
        unit="nmi/h",
    )
    simple = pick(results, "flight", "ensemble", "improvement", "simple/none", "velocity_rms_horizontal")
    proposed = pick(results, "flight", "ensemble", "improvement", f"{SECOND}/{FIRST}", "velocity_rms_horizontal")
    known = simple and proposed
    yield decided(
        "A-C6",
        "Simple linear compensation improves the performance only slightly",
        known and simple["ratio"] > proposed["ratio"],
        known
        and f"Simple compensation lowers the horizontal velocity RMS to {number(simple['ratio'])} of that without "
        f"any, refined hysteresis compensation to {number(proposed['ratio'])} of that with simple: the first step "
        "is the larger one.",
        fails="the first step gained more than the second",
        ours=known and simple["ratio"],
    )


def _budget(results: Mapping, source: str, measure: str = "velocity_rms_horizontal") -> Estimate | None:
    return pick(results, "flight", "budget", source, FIRST, measure)


def _oven(results: Mapping, ours: Mapping) -> Iterator[Row]:
    of = PRINTED["table6"]["reduction_percent"]
    for axis in navigation.AXES:
        found = navigation.reduction_percent(PRINTED["table6"], axis)
        yield recalculated(
            f"A-C27/{axis}",
            f"Oven: the {axis} velocity error is restrained by {of[axis]:g} %",
            of[axis],
            found,
            0.1,
            "It follows from Table 6; what ours gives stands there.",
            unit="%",
        )
    choice = pick(results, "oven", "choice_percent")
    printed = navigation.reduction_percent(PRINTED["table6"], "horizontal")
    yield claimed(
        "A-C28",
        "One of the best of ten runs shows what the compensation does",
        choice,
        choice
        and "What choosing the best of ten runs adds to the reduction of the horizontal velocity RMS in the median "
        f"run: {between(choice)} percentage points, mean over our instruments with its 95 % interval, true attitude "
        f"given. Printed is a reduction by {number(printed)} % in all; up to half of that might be choice.",
        below=0.5 * printed,
        what="what the choice adds",
        recomputed=printed,
        unit="%",
    )
    yield _east_more("A-C29/oven", "Oven", PRINTED["table6"], _gain(results, "east"), _gain(results, "north"))
    ratio = {
        axis: pick(results, "flight", "ensemble", "improvement", f"{SECOND}/{FIRST}", f"velocity_rms_{axis}")
        for axis in navigation.AXES
    }
    flight = {axis: _ratio(r) for axis, r in ratio.items()}
    yield _east_more("A-C29/flight", "Flight", PRINTED["table7"], flight["east"], flight["north"])
    position = pick(ours, "oven_position")
    best = pick(position, "best_horizontal")
    yield claimed(
        "A-C30",
        "Oven: the position error decreases",
        best,
        best
        and f"Of {position['size']:.0f} instruments, true attitude given, the RMS of the radial error shrinks by "
        f"{between(best)} % in the best of ten runs (median and central 95 %) and in "
        f"{100.0 * position['improved_horizontal']:.0f} % of all runs.",
        above=0.0,
        what="the reduction",
        unit="%",
    )


def _gain(results: Mapping, axis: str) -> Estimate | None:
    return pick(results, "oven", "gain", "given", axis)


def _east_more(id: str, where: str, table: Mapping, east: Estimate | None, north: Estimate | None) -> Row:
    """Does east improve more than north? The interval of the difference is from the ends of those of the two ratios."""
    printed = {axis: navigation.reduction_percent(table, axis) for axis in navigation.AXES}
    more = None
    if east and north:
        (least, most), (low, high) = east["interval95"], north["interval95"]
        more = {
            "value": 100.0 * (north["value"] - east["value"]),
            "interval95": [100.0 * (low - most), 100.0 * (high - least)],
        }
    return claimed(
        id,
        f"{where}: east improves more than north",
        more,
        more
        and f"Printed: {number(printed['east'])} against {number(printed['north'])} %, of one run. Ours, refined "
        f"hysteresis over simple: {between(east)} east, {between(north)} north, so that east improves by "
        f"{between(more)} percentage points more.",
        above=0.0,
        what="the difference",
        recomputed=printed["east"] - printed["north"],
        unit="%",
    )


def _temperature(ours: Mapping) -> Iterator[Row]:
    thermal, of = pick(ours, "thermal"), PRINTED["flight"]
    yield decided(
        "A-C31",
        "The temperature rises first because the circuits heat the INS",
        thermal and thermal["rise_c"] > 0.0 and thermal["rise_without_own_heat_c"] < 0.5 * thermal["rise_c"],
        thermal
        and f"Ours rises by {thermal['rise_c']:.1f} °C until {thermal['peak_s']:.0f} s after the start; without "
        f"its own heat it would rise by {thermal['rise_without_own_heat_c']:.1f} °C.",
        fails="it did not rise, or rose by more than half as much without its own heat",
        ours=thermal and thermal["rise_c"],
        unit="°C",
    )
    yield decided(
        "A-C32/falls",
        "The temperature falls constantly through the cruise",
        thermal and thermal["falling_share_of_cruise"] == 1.0,
        thermal and f"It falls in {100 * thermal['falling_share_of_cruise']:.0f} % of the cruise.",
        fails="it rose at any time in the cruise",
        ours=thermal and 100 * thermal["falling_share_of_cruise"],
        unit="%",
    )
    yield given(
        "A-C32/coldest",
        "It falls to -11 °C",
        "the self-heating of the simulated IMU is solved so that it does.",
        printed=of["coldest_c"],
        ours=thermal and thermal["cruise_end_c"],
        unit="°C",
    )
    yield decided(
        "A-C33",
        "The temperature rises while landing",
        thermal and thermal["landing_rise_c"] > 0.0,
        thermal and f"Ours rises by {thermal['landing_rise_c']:.1f} °C from its lowest value to the end.",
        fails="it went on falling to the end",
        ours=thermal and thermal["landing_rise_c"],
        unit="°C",
    )
    yield recalculated(
        "A-C34",
        "30 min of climb, 1.5 h of cruise and 20 min of landing make about 2.3 h",
        of["duration_h"],
        navigation.duration_h(),
        0.1,
        f"They make {number(navigation.duration_h())} h.",
        unit="h",
    )


def _flight(results: Mapping, ours: Mapping) -> Iterator[Row]:
    of = PRINTED["table7"]["reduction_percent"]
    for axis in navigation.AXES:
        found = navigation.reduction_percent(PRINTED["table7"], axis)
        yield recalculated(
            f"A-C35/{axis}",
            f"Flight: the {axis} velocity error is restrained by {of[axis]:g} %",
            of[axis],
            found,
            0.1,
            "It follows from Table 7; what ours gives stands there.",
            unit="%",
        )
    cep, reduction = PRINTED["cep"], navigation.reduction_percent(PRINTED["cep"])
    yield recalculated(
        "A-C36/arithmetic",
        "1.54 to 1.29 nmi/h is 16.2 %",
        cep["reduction_percent"],
        reduction,
        0.1,
        "It follows from the two values.",
        unit="%",
    )
    ratio = pick(results, "flight", "ensemble", "improvement", f"{SECOND}/{FIRST}", "cep_rate_final")
    gain = percent_off(ratio)
    yield claimed(
        "A-C36/at_least",
        "The navigation improves by at least 16.2 %",
        gain,
        gain
        and f"Ours, CEP rate (final) over the ensemble: {between(gain)} %. At least 16.2 % would need the lower "
        "bound above it.",
        above=cep["reduction_percent"],
        what="the reduction",
        printed=cep["reduction_percent"],
        unit="%",
    )
    yield from _early_and_late(results, ours)


def _early_and_late(results: Mapping, ours: Mapping) -> Iterator[Row]:
    tree, thermal = pick(results, "flight", "difference_m"), pick(ours, "thermal")
    at = {s: pick(tree, s) for s in ("1800", "3600", "6000", "8400")}
    early, change = (pick(results, "flight", key) for key in ("early_excess_m", "late_growth_m"))
    yield claimed(
        "A-C37",
        "At the early stage the two compensations differ little in position",
        early,
        early
        and f"Mean position error of simple minus refined hysteresis: {between(at['3600'])} m at 3600 s, "
        f"{between(at['8400'])} m at 8400 s; little means below half of the latter. The former less half of the "
        f"latter, of the same instruments: {between(early)} m.",
        below=0.0,
        what="the former less half of the latter",
        unit="m",
    )
    yield claimed(
        "A-C38/difference",
        "After 6000 s the difference grows",
        change,
        change
        and f"{between(at['6000'])} m at 6000 s, {between(at['8400'])} m at 8400 s; from the one to the other, of the "
        f"same instruments, it changes by {between(change)} m (mean, 95 % interval). At 3600 s it was "
        f"{between(at['3600'])} m (A-C37).",
        above=0.0,
        what="the change",
        unit="m",
    )
    yield decided(
        "A-C38/temperature",
        "After 6000 s the temperature varies more than before",
        thermal and thermal["late_rate"] > thermal["early_rate"],
        thermal
        and f"The mean rate of ours is {number(thermal['early_rate'])} °C/min before and "
        f"{number(thermal['late_rate'])} after; it travels {thermal['early_range_c']:.1f} and "
        f"{thermal['late_range_c']:.1f} °C.",
        fails="the mean rate were smaller after 6000 s than before",
        ours=thermal and thermal["late_rate"],
        unit="°C/min",
    )


def _system(results: Mapping) -> Iterator[Row]:
    tree = pick(results, "flight", "ensemble", "improvement")
    refined, ratio, fair = (
        _ratio(pick(tree, pair, "velocity_rms_horizontal"))
        for pair in (f"{SECOND}/hysteresis", f"{SECOND}/{FIRST}", f"{SECOND}/simple_refined")
    )
    yield claimed(
        "A-C39",
        "The model needs compensation at the level of the INS, too",
        refined,
        refined and f"The oven refinement multiplies the horizontal velocity RMS of the flight by {between(refined)}.",
        below=1.0,
        what="the ratio",
    )
    yield claimed(
        "A-C40",
        "Temperature hysteresis compensation improves the navigation",
        ratio,
        ratio
        and f"Ratio of the horizontal velocity RMS, refined hysteresis over simple: {between(ratio)}."
        + (f" With the same refinement on both sides: {between(fair)}." if fair else ""),
        below=1.0,
        what="the ratio",
    )


def _ratio(of: Mapping | None) -> Estimate | None:
    """A ratio of the comparison as an estimate."""
    return of and {"value": of["ratio"], "interval95": of["interval95"]}
