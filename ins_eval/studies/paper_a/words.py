"""Paper A in words: each of its statements with a verdict, and what our simulation adds.

The rows come judged (`rows`); here they are counted, grouped and put beside their figures. Every sentence about a
difference is chosen by its ratio and interval (`wording`); what the results lack is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import hypot
from pathlib import Path

from ins_eval.figures.style import in_order, label
from ins_eval.report.content import Block, Picture, Section, at_a_glance, paragraphs, table
from ins_eval.report.flight_answer import headline_numbers
from ins_eval.report.limits import largest_source, weaknesses
from ins_eval.report.missions import substitutes
from ins_eval.report.published import beside_published
from ins_eval.studies.papers import Row
from ins_eval.studies.statements import counted, read_pictures, signed, statement_sections
from ins_eval.tables import pick
from ins_eval.vocabulary import CEP, FIRST, HEADLINE, SECOND, VELOCITY, improvement, measure_name, source_name
from ins_eval.wording import (
    MISSING,
    certainty,
    effect,
    fixed,
    joined,
    percent,
    sentence,
    verdict,
    with_interval,
)

CASE_NAME = {"given": "true attitude given", "aligned": "self-aligned"}
AXES = ("east", "north", "horizontal")
INTERVALS = {  # of the calibration, by their names in the results
    "coefficients": "of a coefficient, with only the fitted model simulated",
    "coefficients_shifted": "of a coefficient, with shifts from run to run added",
    "predictive": "of a compensated reading in a new run, with all errors simulated",
}

PICTURES = read_pictures(Path(__file__).with_name("pictures.toml"))


def paper_a_content(rows: Sequence[Row], results: Mapping) -> tuple[str, list[Section]]:
    """The answer (first line the count, then what matters most, last what it means) and the sections of the page.

    Every row is shown, under its group and in the order in which it comes.
    """
    sections = [_glance(results.get("flight") or {}), *statement_sections(rows, PICTURES)]
    sections += [Section(heading, tell(results)) for heading, tell in OURS.items()]
    return _answer(rows, results), [section for section in sections if section.blocks]


# -------------------------------------------------------------------------------------------------------- the answer


def _answer(rows: Sequence[Row], results: Mapping) -> str:
    flight = results.get("flight") or {}
    return "\n".join(
        filter(None, (counted(rows, "Paper A"), _gain(flight), _one_flight(flight), _cause(flight), _meaning(flight)))
    )


def _glance(flight: Mapping) -> Section:
    """Ours of the paper's headline with intervals, and where to look next."""
    picture = Picture("velocity_rms_by_compensation", PICTURES["A-T7"]["velocity_rms_by_compensation"])
    step = "Filter the rows by the word not or contradicts and read those first; ins-eval flight-report flies "
    return at_a_glance(headline_numbers(flight), picture, f"{step}other places, courses and days.")


def _gain(flight: Mapping) -> str:
    """The paper's headline beside ours."""
    parts, who = [], "hysteresis compensation, refined in the oven,"
    for measure in (VELOCITY, CEP):
        if ratio := improvement(flight, HEADLINE, measure):
            text = effect(who, "the " + measure_name(measure), ratio).strip()
            printed = _printed_change(flight, measure)
            sign = 1.0 if verdict(ratio) == "better" else -1.0  # as `effect` tells it
            beside = "" if printed is None else f"; Paper A: {fixed(sign * printed, 0)} %"
            parts.append(f"{text.removesuffix(')')}{beside})" if text.endswith(")") else text)
            who = ""
    return f"In flight {joined(parts)}, against simple compensation." if parts else ""


def _printed_change(flight: Mapping, measure: str) -> float | None:
    """What the compensation takes off a measure in the paper, in per cent."""
    printed = {}
    for arm in ("simple", "hysteresis"):
        if measure == CEP:
            printed[arm] = pick(flight, "paper", "cep", arm)
        elif velocity := pick(flight, "paper", "table7", arm):
            printed[arm] = hypot(velocity["east"], velocity["north"])
    if not all(printed.get(arm) for arm in ("simple", "hysteresis")):
        return None
    return 100.0 * (1.0 - printed["hysteresis"] / printed["simple"])


def _one_flight(flight: Mapping) -> str:
    share = pick(flight, "ensemble", "improvement", HEADLINE, "fraction_improved", VELOCITY)
    if not share:
        return ""
    text = f"The paper has one flight; of our instruments {percent(share)} improve in velocity on theirs"
    return text + ("." if share["value"] >= 0.975 else ", so the sign on one flight may be chance.")


def _cause(flight: Mapping) -> str:
    """Whether it is the hysteresis that gains: the same refinement for both, and the rate terms alone."""
    parts, what = [], "the " + measure_name(VELOCITY)
    if twin := improvement(flight, f"{SECOND}/simple_refined", VELOCITY):
        parts.append(f"With the same oven run on both sides {effect('hysteresis', what, twin)}; {certainty(twin)}.")
    if rate := improvement(flight, "hysteresis/hysteresis_without_rate", VELOCITY):
        who = "adding the rate terms of the scale factor, which are its hysteresis,"
        parts.append(sentence(f"{effect(who, what, rate)}; {certainty(rate)}"))
    return " ".join(parts)


def _meaning(flight: Mapping) -> str:
    """What each step brings, without an order; one flight cannot say what to do on others."""
    text = substitutes(flight)
    return f"{text} The flight report says, over missions, whether either helps on other flights." if text else ""


# -------------------------------------------------------------------------------------------- what our results add


def _chamber(results: Mapping) -> list[Block]:
    chamber = results.get("chamber") or {}
    coverage = chamber.get("coverage") or {}
    rows = [(words, _percent(coverage[key])) for key, words in INTERVALS.items() if coverage.get(key)]
    by_position = coverage.get("predictive_by_position") or {}
    rows += [(f"the same, at {signed(position)}", _percent(entry)) for position, entry in by_position.items()]
    over = f"Pooled over {coverage['units']} units" if "units" in coverage else "Pooled over all units"
    note = f"{over}; in brackets the 95 % interval of the share, over units. 95 % would be exact."
    blocks = table(
        "How often a 95 % interval of the calibration contains the truth [%]", ("interval", "share"), rows, note
    )
    rms = chamber.get("residual_rms_ppm") or {}
    models = in_order({name for entries in rms.values() for name in entries})
    rows = [
        (
            unit,
            *(with_interval(entries.get(name), 0) for name in models),
            with_interval(pick(chamber, "magnet_share", unit)),
        )
        for unit, entries in rms.items()
    ]
    return blocks + table(
        "RMS of measured less modelled scale factor in the chamber [ppm], and the magnet's share of the loop",
        ("unit", *map(label, models), "share of the magnet at 22 °C [1]"),
        rows,
        "Median of the draws; in brackets: central 95 % of them. Without a model: of K1 less its mean.",
    )


def _percent(share: Mapping) -> str:
    return with_interval({"value": 100.0 * share["value"], "interval95": [100.0 * x for x in share["interval95"]]}, 1)


def _oven(results: Mapping) -> list[Block]:
    oven = results.get("oven") or {}
    over = f"{oven['size']} instruments with {oven['runs']} runs each" if {"size", "runs"} <= set(oven) else "all runs"
    blocks: list[Block] = []
    for case, name in CASE_NAME.items():
        arms = oven.get(case) or {}
        rows = [(label(arm), *(with_interval(arms[arm].get(axis)) for axis in AXES)) for arm in in_order(arms)]
        note = f"RMS over {over}; in brackets the 95 % interval."
        blocks += table(f"Velocity RMS in the oven, {name} [m/s]", ("compensation", *AXES), rows, note)
    rows = []
    for case, name in CASE_NAME.items():
        for key, of in (("median_of_ten", "median run"), ("best_of_ten", "best run")):
            if entries := pick(oven, key, case):
                rows.append((f"{of}, {name}", *(with_interval(entries.get(axis), 0) for axis in AXES)))
        if entries := pick(oven, "gain", case):
            rows.append((f"all runs together, {name}", *(_taken_off(entries.get(axis)) for axis in AXES)))
    note = (
        "Median and best run: median of the instruments, in brackets the central 95 % of them; the best run is the one "
        "that gains most horizontally. All together: 95 % interval."
    )
    title = "Reduction of the velocity RMS in the oven by refined hysteresis compensation [%]"
    return blocks + table(title, ("run", *AXES), rows, note)


def _taken_off(ratio: Mapping | None) -> str:
    """A ratio of errors as a reduction in per cent."""
    if ratio is None:
        return MISSING
    value, low, high = (100.0 * (1.0 - x) for x in (ratio["value"], *reversed(ratio["interval95"])))
    return with_interval({"value": value, "interval95": [low, high]}, 0)


def _flight(results: Mapping) -> list[Block]:
    flight = results.get("flight") or {}
    return (
        [
            *weaknesses(flight),
            *_compensations(flight),
            *beside_published(flight),
            Picture("cep_over_time", "CEP(t) in flight with its 95 % band."),
            Picture("improvement_per_instrument", "How far a single flight can mislead."),
            *_later(flight),
            *_budget(flight),
        ]
        if flight
        else []
    )


def _compensations(flight: Mapping) -> list[Block]:
    ensemble = flight.get("ensemble") or {}
    rows = []
    for name in in_order(n for n, arm in ensemble.items() if isinstance(arm, Mapping) and "velocity_rms_mps" in arm):
        velocities = (with_interval(pick(ensemble, name, "velocity_rms_mps", axis)) for axis in AXES)
        rows.append((label(name), *velocities, with_interval(pick(ensemble, name, "cep_rate_nmi_per_h", "final"))))
    of = f" of {ensemble['size']} instruments" if "size" in ensemble else ""
    header = ("compensation", *(f"{axis} [m/s]" for axis in AXES), "CEP rate (final) [nmi/h]")
    return table(f"Velocity RMS and CEP rate in flight{of}", header, rows, "In brackets: 95 % interval.")


def _later(flight: Mapping) -> list[Block]:
    of_time = flight.get("difference_m") or {}
    rows = [(time, with_interval(of_time[time], 0)) for time in sorted(of_time, key=float)]
    title = "Position error of simple less that of refined hysteresis compensation"
    return table(title, ("time [s]", "difference [m]"), rows, "Mean over the instruments; in brackets: 95 % interval.")


def _budget(flight: Mapping) -> list[Block]:
    budget = {source: arms for source, arms in (flight.get("budget") or {}).items() if isinstance(arms, Mapping)}
    units = {VELOCITY: "m/s", CEP: "nmi/h"}
    columns = [(measure, name) for measure in units for name in (FIRST, SECOND)]
    rows = [
        (source_name(source), *(with_interval(pick(arms, name, measure)) for measure, name in columns))
        for source, arms in budget.items()
    ]
    header = ("source", *(f"{measure_name(m)}, {label(name)} [{units[m]}]" for m, name in columns))
    return [
        *paragraphs(*(largest_source(budget, measure, unit) for measure, unit in units.items())),
        *([Picture("error_budget", "Each source of error alone, all others off.")] if rows else []),
        *table("Each source of error alone, in flight", header, rows, "In brackets: 95 % interval."),
    ]


def _sensitivity(results: Mapping) -> list[Block]:
    cases = results.get("sensitivity") or {}
    rows = [
        (
            case.get("words", name),
            *(with_interval(pick(case, arm, axis)) for arm in (FIRST, SECOND) for axis in AXES[:2]),
            with_interval(case.get("ratio")),
        )
        for name, case in cases.items()
    ]
    heads = [f"{label(arm)}, {axis} [m/s]" for arm in (FIRST, SECOND) for axis in AXES[:2]]
    blocks = table(
        "Velocity RMS in flight with one assumption changed",
        ("assumption (base value)", *heads, "refined hysteresis / simple, horizontal"),
        rows,
        "The same instruments in every case; in brackets: 95 % interval. Below 1 refined hysteresis helps.",
    )
    return [Picture("sensitivity", "Assumptions in the order of their effect."), *blocks] if blocks else []


OURS: Mapping[str, Callable[[Mapping], list[Block]]] = {
    "Ours: calibration in the chamber": _chamber,
    "Ours: all runs in the oven": _oven,
    "Ours: compensations and error budget in flight": _flight,
    "Ours: sensitivity to the assumptions": _sensitivity,
}
