"""The flight report in words: from `metrics.json` to an answer and sections.

Nothing here is a result: each sentence about a difference is chosen by its ratio and interval (`wording`),
and what the metrics lack is left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ins_eval.analysis.ageing import AgeingNumbers
from ins_eval.figures.style import in_order, label
from ins_eval.report import missions
from ins_eval.report.ageing import ageing_blocks
from ins_eval.report.content import Block, Paragraph, Picture, Section, definitions_table, paragraphs, table
from ins_eval.report.flight_answer import UNITS, answer, comparison, glance, instruments, rivals
from ins_eval.report.limits import largest_source, weaknesses
from ins_eval.report.published import beside_published
from ins_eval.tables import pick
from ins_eval.vocabulary import (
    CEP,
    COMPONENTS,
    DEFINITIONS,
    FIRST,
    HEADLINE,
    MAIN_DEFINITIONS,
    SECOND,
    VELOCITY,
    definition_name,
    improvement,
    linearly,
    measure_name,
    of_ensemble,
    single_flight_name,
    source_name,
)
from ins_eval.wording import (
    MISSING,
    SHORT_VERDICT,
    change,
    fixed,
    percent,
    sentence,
    small,
    verdict,
    with_interval,
)


def flight_content(metrics: Mapping, ageing: AgeingNumbers | None = None) -> tuple[str, list[Section]]:
    """The answer (first line the verdict, second its terms) and the sections of the flight report.

    `metrics` is the content of ``metrics.json``; a key that it lacks leaves out what needs it, and so does `ageing`.
    """
    sections = [
        glance(metrics),
        Section("The comparison", _comparison(metrics)),
        Section("Over missions", missions.over_missions(metrics)),
        Section("What weakens the claim", weaknesses(metrics)),
        Section("Model and refinement", missions.attribution(metrics)),
        Section("Every compensation", _every_compensation(metrics)),
        Section("One flight proves little", _one_flight(metrics)),
        Section("Beside the published flight", beside_published(metrics)),
        Section("Where the error comes from", _budget(metrics)),
        Section("After storage", [] if ageing is None else ageing_blocks(ageing)),
        Section("The flight shown", _shown(metrics)),
        Section("Definitions and windows", definitions_table(metrics)),
        Section("Numeric floor and conditions", _conditions(metrics)),
    ]
    return answer(metrics), [section for section in sections if section.blocks]


def _compensations(metrics: Mapping, branch: str) -> list[str]:
    """Compensations for which `branch` has results, in their fixed order."""
    tree = metrics.get(branch) or {}
    return in_order(k for k, v in tree.items() if isinstance(v, Mapping) and "velocity_rms_mps" in v)


def _comparison(metrics: Mapping) -> list[Block]:
    rows = []
    for measure in [f"velocity_rms_{c}" for c in COMPONENTS] + [f"cep_rate_{d}" for d in DEFINITIONS]:
        arms = [of_ensemble(metrics, name, measure) for name in (FIRST, SECOND)]
        ratio = improvement(metrics, HEADLINE, measure)
        if ratio or any(arms):
            unit = "m/s" if measure.startswith("velocity") else "nmi/h"
            judged = (change(ratio), SHORT_VERDICT[verdict(ratio)]) if ratio else (MISSING, MISSING)
            rows.append((f"{measure_name(measure)} [{unit}]", *map(with_interval, arms), *judged))
    note = f"In brackets: 95 % paired bootstrap interval over {instruments(metrics)}."
    if "duration_s" in metrics:
        note += (
            f" Window: {metrics.get('t0_s', 0.0):.0f} to {metrics['duration_s']:.0f} s after the start of navigation."
        )
    if (floor := pick(metrics, "floor", "ensemble", "horizontal_m")) is not None:
        note += f" Numeric floor of the ensemble: {small(floor, 'm')} in position."
    if linear := pick(metrics, "ensemble", "linear"):
        note += f" {linearly(linear)}"
    if not rows:
        return []
    return [
        *comparison(metrics),
        *table(
            "Simple and refined hysteresis compensation, as the paper compares them",
            ("measure", label(FIRST), label(SECOND), "change", "verdict"),
            rows,
            note,
            "lrrrl",
        ),
        Picture(
            "cep_over_time",
            "CEP(t) of each compensation with its 95 % band. Bands that overlap do not make a "
            "difference doubtful: the instruments are paired, and the table above is the test.",
        ),
        *_cep_at_times(metrics),
    ]


def _cep_at_times(metrics: Mapping) -> list[Block]:
    compared = (*metrics.get("own_models", ()), FIRST, "simple_refined", "hysteresis", SECOND)
    names = [name for name in compared if pick(metrics, "ensemble", name, "cep_nmi_at_s")]
    arms = [metrics["ensemble"][name]["cep_nmi_at_s"] for name in names]
    times = sorted({time for arm in arms for time in arm}, key=float)
    rows = [(f"{float(time):.0f}", *(with_interval(arm.get(time)) for arm in arms)) for time in times]
    return table("CEP at fixed times [nmi]", ("time [s]", *map(label, names)), rows, "In brackets: 95 % interval.")


def _every_compensation(metrics: Mapping) -> list[Block]:
    names = _compensations(metrics, "ensemble")
    if not names:
        return []

    def by_name(title: str, branch: str, keys: Sequence[str], heads: Sequence[str], note: str = "") -> list[Block]:
        keys = [k for k in keys if any(pick(metrics, "ensemble", n, branch, k) for n in names)]
        rows = [(label(n), *(with_interval(pick(metrics, "ensemble", n, branch, k)) for k in keys)) for n in names]
        return table(title, ("compensation", *(dict(heads)[k] for k in keys)), rows, note) if keys else []

    components = [(c, c) for c in COMPONENTS]
    definitions = [(d, definition_name(d)) for d in DEFINITIONS]
    others = [d for d in DEFINITIONS if d not in MAIN_DEFINITIONS]
    return [
        Paragraph(
            "“Refined” means that the residual of one oven run with the temperatures of the flight was taken out "
            "after the calibration in the chamber. The published comparison is refined hysteresis against simple."
        ),
        *by_name(
            "Velocity RMS [m/s]",
            "velocity_rms_mps",
            COMPONENTS,
            components,
            f"RMS over {instruments(metrics)} of the RMS over each flight; in brackets the 95 % interval.",
        ),
        Picture(
            "velocity_rms_by_compensation",
            "Velocity RMS of every compensation beside the two published ones. A light "
            "bar against its dark twin shows the refinement, blue against red the model.",
        ),
        *by_name("CEP rate [nmi/h]", "cep_rate_nmi_per_h", MAIN_DEFINITIONS, definitions),
        *by_name("CEP rate [nmi/h], other definitions", "cep_rate_nmi_per_h", others, definitions),
        *_changes(metrics),
    ]


def _changes(metrics: Mapping) -> list[Block]:
    rows = []
    for pair in pick(metrics, "ensemble", "improvement") or {}:
        new, _, old = pair.partition("/")
        ratios = [improvement(metrics, pair, measure) for measure in (VELOCITY, CEP)]
        judged = [(change(r), SHORT_VERDICT[verdict(r)]) if r else (MISSING, MISSING) for r in ratios]
        rows.append((f"{label(new)} against {label(old)}", *judged[0], *judged[1]))
    return table(
        "Change from one compensation to another",
        ("new against old", measure_name(VELOCITY), "verdict", measure_name(CEP), "verdict"),
        rows,
        "Paired: both sides have the same instruments, temperatures and noise. Negative is better.",
        "lrlrl",
    )


def _one_flight(metrics: Mapping) -> list[Block]:
    if not pick(metrics, "ensemble", "size"):
        return []
    own = [
        (f"Instruments that improve from {label(other)} to {label(of.own)}", f"{of.own}/{other}")
        for of in rivals(metrics)
        for other in of.others
    ]
    blocks: list[Block] = []
    for title, pair in [*own, ("Instruments that improve from simple to refined hysteresis", HEADLINE)]:
        shares = pick(metrics, "ensemble", "improvement", pair, "fraction_improved") or {}
        rows = [(_on_one_flight(m), percent(entry)) for m, entry in shares.items()]
        note = "In brackets: 95 % interval. 50 % would be chance."
        blocks += table(title, ("measure on one flight", "share"), rows, note)
    return blocks


def _on_one_flight(measure: str) -> str:
    return single_flight_name(measure.removeprefix("cep_rate_")) if measure.startswith("cep") else measure_name(measure)


def _budget(metrics: Mapping) -> list[Block]:
    budget = {source: arms for source, arms in (metrics.get("budget") or {}).items() if isinstance(arms, Mapping)}
    if not budget:
        return []
    names = in_order({name for arms in budget.values() for name in arms})
    blocks: list[Block] = [
        *paragraphs(*(largest_source(budget, measure, unit) for measure, unit in UNITS.items())),
        Picture(
            "error_budget",
            "Each source alone, all others off. A source whose bars are equally long in every colour is "
            "one that no compensation of accelerometers can touch. What is not in the flight shows what it would do"
            + (f", with {beside} instruments." if (beside := pick(metrics, "budget", "size_beside")) else ".")
            + (" A model of your own is flown with all sources together only." if metrics.get("own_models") else ""),
        ),
    ]
    for measure, unit in UNITS.items():
        rows = [
            (source_name(source), *(with_interval(pick(arms, name, measure)) for name in names))
            for source, arms in budget.items()
        ]
        title = f"{sentence(measure_name(measure))[:-1]} of each source alone [{unit}]"
        blocks += table(title, ("source", *map(label, names)), rows)
    return blocks


def _shown(metrics: Mapping) -> list[Block]:
    names = _compensations(metrics, "flight")
    rows = [
        (
            label(n),
            *(fixed(pick(metrics, "flight", n, "velocity_rms_mps", c)) for c in ("east", "north", "horizontal")),
            *(fixed(pick(metrics, "flight", n, "radial_error_rate_nmi_per_h", d)) for d in MAIN_DEFINITIONS),
        )
        for n in names
    ]
    header = (
        "compensation",
        "east [m/s]",
        "north [m/s]",
        "horizontal [m/s]",
        *(f"{single_flight_name(d)} [nmi/h]" for d in MAIN_DEFINITIONS),
    )
    blocks: list[Block] = [
        *paragraphs(_one_drawn(metrics), _gps(metrics)),
        Picture("flight_path", "Path over ground and height. GPS is lost where the aircraft banks too steeply."),
        Picture(
            "temperature_and_rate", "Temperature of the IMU. The sign of its rate decides the branch of the hysteresis."
        ),
        *table(
            "The flight shown",
            header,
            rows,
            "Velocity RMS, then single-flight radial error rates. A rate of one flight is not a CEP.",
        ),
        Picture(
            "east_velocity_error",
            "East velocity error, as in Fig. 12a of the paper. The small panel, where there is one, "
            "shows the vertices that appear when GPS itself is interpolated across its outages.",
        ),
        Picture("north_velocity_error", "North velocity error, as in Fig. 12b of the paper."),
        Picture("latitude_error", "Latitude error, as in Fig. 13a of the paper."),
        Picture("longitude_error", "Longitude error, as in Fig. 13b of the paper."),
        Picture(
            "position_error",
            "Horizontal position error, as in Fig. 13c of the paper. Waves of 84.4 min are Schuler oscillations.",
        ),
        Picture("ground_track", "Where the INS believes it went beside GPS, and its error over ground."),
    ]
    return blocks if any(not isinstance(block, Picture) for block in blocks) else []


def _one_drawn(metrics: Mapping) -> str:
    before, after = (pick(metrics, "flight", n, "velocity_rms_mps", "horizontal") for n in (FIRST, SECOND))
    if not before or after is None:
        return ""
    shift = 100.0 * (after / before - 1.0)
    return (
        f"One instrument on one flight, to show the shape of the errors. Its {measure_name(VELOCITY)} changes by "
        f"{'+' if shift > 0 else ''}{fixed(shift, 0)} % from simple to refined hysteresis compensation; the answer "
        "above is the ensemble's, not this flight's."
    )


def _gps(metrics: Mapping) -> str:
    gps = metrics.get("gps") or {}
    if "fixes" not in gps:
        return ""
    if not gps.get("outages"):
        return f"GPS: {gps['fixes']} fixes, no outage."
    return (
        f"GPS: {gps['fixes']} fixes; {gps['outages']} outages of {fixed(gps.get('outage_s'), 0)} s together, the "
        f"longest {fixed(gps.get('longest_s'), 0)} s. Outage epochs count in no RMS."
    )


def _conditions(metrics: Mapping) -> list[Block]:
    floor = metrics.get("floor") or {}
    parts = []
    if "horizontal_m" in floor:
        rate = f" at {floor['rate_hz']:g} Hz" if "rate_hz" in floor else ""
        parts.append(
            f"With all sensor errors off the same chain stays within {small(floor['horizontal_m'], 'm')} of the "
            f"truth in horizontal position and {small(floor.get('velocity_mps'), 'm/s')} in velocity over the whole "
            f"flight{rate}."
        )
    if (ensemble := floor.get("ensemble")) and "horizontal_m" in ensemble:
        rate = f"runs at {ensemble['rate_hz']:g} Hz" if "rate_hz" in ensemble else "has its own rate"
        parts.append(f"The ensemble {rate}; its floor is {small(ensemble['horizontal_m'], 'm')}.")
    if parts:
        parts.append("No difference below the floor means anything.")
    diagnostics = []
    if free := pick(floor, "vertical", "free"):
        diagnostics.append(
            "Diagnostics, not results: every figure above has the vertical channel damped by baro height. Left free, "
            f"and without any sensor error, the height is off by {small(free['height_m'], 'm')} at the worst and the "
            f"horizontal position by {small(free['horizontal_m'], 'm')};"
        )
        frozen = floor["vertical"]["frozen"]
        diagnostics.append(
            f"with the height frozen at the start they are {small(frozen['height_m'], 'm')} and "
            f"{small(frozen['horizontal_m'], 'm')}, and the velocity {small(frozen['velocity_mps'], 'm/s')}."
        )
    run = [f"{name} {metrics[key]}" for key, name in (("profile", "profile"), ("seed", "seed")) if key in metrics]
    if "duration_s" in metrics:
        run.append(f"duration {metrics['duration_s']:.0f} s")
    return paragraphs(" ".join(parts), " ".join(diagnostics), sentence("Run: " + ", ".join(run)) if run else "")
