"""Rows of the experiments and procedures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ins_eval.calibration.fits import LINE
from ins_eval.studies.paper_a.audit import chamber, epoxy, navigation
from ins_eval.studies.paper_a.audit import scale_factor as audit
from ins_eval.studies.paper_a.printed import PRINTED, UNITS
from ins_eval.studies.paper_a.rows.claims_sensors import NOTHING_PERCENT, VELOCITY, unseen
from ins_eval.studies.paper_a.single import FIRST
from ins_eval.studies.papers import (
    CONTRADICTS,
    NOT_REPRODUCED,
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
)
from ins_eval.tables import pick
from ins_eval.thermal import Thermometer


def procedure_rows(results: Mapping, ours: Mapping) -> Iterator[Row]:
    """All of them."""
    yield from _creep(ours)
    yield from _chamber(results)
    yield from _oven(results)
    yield from _flight(results, ours)


def _creep(ours: Mapping) -> Iterator[Row]:
    of = PRINTED["creep"]
    tables = [epoxy.of_first(key) for key in ("thermal_um", "creep_um")]
    holds = list(of["thermal_um"]) == list(tables[0]) and list(of["creep_um"]) == list(tables[1])
    low, high = of["chamber_c"]
    inside = all(low <= t <= high for t in of["temperature_c"])
    yield decided(
        "A-P1/first",
        "Creep experiment: deformations of the first repetition, in text and tables",
        holds and inside,
        f"Text and first rows of Tables 2 and 3 agree ({listed(tables[0], 4)} and {listed(tables[1])} µm), and the "
        f"three temperatures lie within the chamber's {low:g} to {high:g} °C.",
        CONTRADICTS,
        fails="a number of the text were not that of the table, or a temperature outside the range",
    )
    yield from _stable(ours)
    differ = epoxy.sign_differences()
    yield row(
        "A-P1/sign",
        "Creep experiment: sign of the camera",
        CONTRADICTS,
        f"Every deformation stands with a minus sign; by the text {differ} of the three blocks expanded. Sizes and "
        "true directions are kept apart here.",
        printed="-, -, -",
        recomputed="-, +, +",
    )


def _stable(ours: Mapping) -> Iterator[Row]:
    creep, read_min = pick(ours, "creep"), PRINTED["creep"]["stable_after_min"]
    for k, celsius in enumerate(PRINTED["creep"]["temperature_c"]):
        share = creep and 100.0 * creep["finished_share"][k]
        yield given(
            f"A-P1/stable/{celsius:g}",
            f"Creep experiment: settled after {read_min:.0f} min at {celsius:g} °C",
            "the time constants of the simulation were chosen so, one set for all temperatures and faster when "
            "warm." + (f" {share:.0f} % of the final creep is there by then." if creep else ""),
            ours=share,
            unit="%",
        )


def _chamber(results: Mapping) -> Iterator[Row]:
    of = PRINTED["chamber"]
    low, high = of["oven_c"]
    cold, hot = of["from_to_c"]
    yield decided(
        "A-P2/range",
        "Chamber: range of temperature",
        low <= cold and hot <= high,
        f"The cycle from {cold:g} to {hot:g} °C lies within {low:g} to {high:g} °C.",
        CONTRADICTS,
        fails="the cycle left that range",
    )
    slew = chamber.slew()
    yield row(
        "A-P2/slew",
        "Chamber: slew rate",
        CONTRADICTS,
        f"The chamber is said to have ±{slew.oven_slowest:g} to ±{of['slew_c_per_min'][1]:g} °C/min; all rates of "
        f"the steps lie below that, the fastest at {slew.fastest_step:g} °C/min.",
        printed=slew.oven_slowest,
        recomputed=slew.fastest_step,
        unit="°C/min",
    )
    yield given(
        "A-P2/accuracy",
        "Chamber: accuracy of temperature",
        "a specification of the chamber; here the surface sensor is what counts.",
        printed=of["accuracy_c"],
        unit="°C",
    )
    yield given(
        "A-P2/sensor",
        "DS18B20 on the surface of the accelerometer",
        f"simulated with steps of {Thermometer().step_c:g} °C; the paper prints no resolution.",
        ours=Thermometer().step_c,
        unit="°C",
    )
    ramps = chamber.ramps()
    yield row(
        "A-P3",
        "Steps 1 to 6: ramps of constant rate with 3 min at each whole degree",
        CONTRADICTS,
        "The text takes the rate as constant; with the dwells it is 0 for "
        f"{number(100 * (1 - ramps.moving_share[0]), 2)} to {number(100 * (1 - ramps.moving_share[-1]), 2)} % of "
        f"the time and {listed(ramps.mean_c_per_min)} °C/min on average where "
        f"{as_printed(ramps.commanded_c_per_min)} is commanded. Ours runs the steps as printed.",
        printed=as_printed(ramps.commanded_c_per_min),
        recomputed=listed(ramps.mean_c_per_min),
        unit="°C/min",
    )
    one, both = audit.rank([0.3]), audit.rank([-0.3, 0.3])
    pooled = audit.rank([sign * r for r in of["rates_c_per_min"] for sign in (-1.0, 1.0)])
    yield row(
        "A-P4",
        "Least squares of the six terms, the rate being constant",
        CONTRADICTS,
        f"At one constant rate {one} of the 6 coefficients are determined, at one rate in both directions {both}; "
        f"six are printed. Pooled over the four rates in both directions all {pooled} are, and so it is done here.",
        printed=6,
        recomputed=one,
    )
    residual = [pick(results, "chamber", "residual_rms_ppm", unit, "simple") for unit in UNITS]
    line = audit.rank([0.3], LINE)
    yield decided(
        "A-P5",
        "Simple linear regression",
        line == 2,
        f"At one constant rate both coefficients are determined (rank {line} of 2), where of the six terms of A-P4 "
        f"only {one} are."
        + (
            f" It leaves {' / '.join(between(r) for r in residual)} ppm RMS of the three units."
            if all(residual)
            else ""
        ),
        fails="the readings at one rate left a coefficient open, as they do with the six terms",
    )


def _oven(results: Mapping) -> Iterator[Row]:
    runs = pick(results, "oven", "refinement")
    counts = sorted(runs, key=int) if runs else []
    first, last = (runs[counts[0]], runs[counts[-1]]) if counts else (None, None)
    unrefined = pick(results, "oven", "given", "hysteresis", "horizontal")
    known = first and unrefined
    yield decided(
        "A-P7",
        "System-level oven runs refine the model",
        known and first["interval95"][1] < unrefined["value"],
        known
        and f"Horizontal velocity RMS in the oven, true attitude given: {between(unrefined)} m/s unrefined, "
        f"{between(first)} after one run, {between(last)} after {counts[-1]}.",
        fails="the interval after one run reached the value of the unrefined model",
        ours=first,
        unit="m/s",
    )
    improved = pick(results, "oven", "runs_improved")
    yield given(
        "A-P8",
        "Ten oven runs with both compensations and the same algorithm",
        "a procedure, carried out as printed; what comes of it is judged in A-T6. The paper shows one of ten."
        + (
            f" Of all runs of our {pick(results, 'oven', 'size'):g} instruments {100 * improved['given']:.0f} % "
            f"improve with the true attitude given, {100 * improved['aligned']:.0f} % with self-alignment."
            if improved
            else ""
        ),
        printed=PRINTED["table6"]["runs"],
        ours=pick(results, "oven", "runs"),
    )


def _flight(results: Mapping, ours: Mapping) -> Iterator[Row]:
    of, hot = PRINTED["flight"], pick(ours, "thermal")
    yield recalculated(
        "A-P9/duration",
        "Flight: the three phases make the duration",
        of["duration_h"],
        navigation.duration_h(),
        0.1,
        f"{of['climb_min']:g} min, {of['cruise_h']:g} h and {of['landing_min']:g} min make "
        f"{number(navigation.duration_h())} h.",
        unit="h",
    )
    yield given(
        "A-P9/height",
        "Flight: altitude of the cruise",
        "the simulated flight climbs to it.",
        printed=of["altitude_m"],
        unit="m",
    )
    rises = hot and hot["rise_c"] > 0.0 and hot["landing_rise_c"] > 0.0 and hot["falling_share_of_cruise"] == 1.0
    yield decided(
        "A-P9/temperature",
        "Flight: temperature rises, falls through the cruise, rises while landing",
        hot and bool(rises),
        hot
        and f"{hot['start_c']:.1f} °C when switched on, {hot['peak_c']:.1f} at {hot['peak_s']:.0f} s, "
        f"{hot['cruise_start_c']:.1f} at the start of the cruise, {hot['cruise_end_c']:.1f} at its end and "
        f"{hot['end_c']:.1f} on the ground again.",
        fails="our heat balance, set only so that it ends the cruise at the printed temperature, went another way",
    )
    yield _one_temperature(results)
    gps = pick(results, "flight", "gps")
    limit = of["gps_lost_beyond_roll_deg"]
    yield given(
        "A-P11",
        "GPS as reference, lost while the roll exceeds 30°",
        f"the limit of {limit:g}° is put in, and the bank of our turns, which is assumed, exceeds it."
        + (
            f" That gives {gps['outages']:.0f} outages of {gps['outage_s']:.0f} s together, the longest "
            f"{gps['longest_s']:.0f} s. They are left out of the RMS, and position curves are bridged by a line "
            "through the difference of INS and GPS."
            if gps
            else ""
        ),
        printed=limit,
        unit="°",
    )
    yield row(
        "A-P13",
        "Measures: velocity RMS, reductions, CEP rate",
        NOT_REPRODUCED,
        "Velocity RMS and reductions are computed as printed; the CEP is not defined, and one flight has none. "
        "Seven definitions stand beside one another in A-CEP.",
    )


def _one_temperature(results: Mapping) -> Row:
    """What axes that are unequally warm do: thermal bias alone, with one temperature and with a spread of it."""
    even, uneven = (
        pick(results, "flight", "budget", f"accelerometer_bias_thermal{spread}", FIRST, VELOCITY)
        for spread in ("", "_with_gradient")
    )
    limit = unseen(results)
    known = even and uneven and limit
    allowed = float(np.hypot(even["value"], limit)) if known else 0.0
    return claimed(
        "A-P10",
        "IMU at one temperature, which is that of the accelerometers' surface",
        uneven if known else None,
        known
        and f"How even it was is not printed. The thermal bias alone gives {between(even)} m/s of horizontal velocity; "
        "with accelerometers that are warmer than the thermometer by 2 % of the excess of the IMU over the air (one "
        f"sigma, assumed; 1 °C at 50) it gives {between(uneven)}; below {number(allowed)} that is less than "
        f"{NOTHING_PERCENT:g} % of a whole flight, in squares.",
        below=allowed,
        what="the velocity RMS with a spread",
        unit="m/s",
    )
