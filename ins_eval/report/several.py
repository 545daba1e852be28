"""Several recordings on one page: a row each, and what they come to as an ensemble of flights."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter
from urllib.parse import quote

from ins_eval.analysis.several import FEWEST_FLIGHTS, FlightsTogether, Refused, Row, SeveralEvaluations
from ins_eval.figures.style import label
from ins_eval.report.content import (
    Block,
    Number,
    Picture,
    Section,
    Table,
    at_a_glance,
    measured,
    paragraphs,
    table,
)
from ins_eval.report.evaluation_glance import ONE_RUN
from ins_eval.vocabulary import COMPONENTS, DEFINITIONS, definition_name
from ins_eval.wording import fixed, joined, with_interval

COLUMNS = (
    ("span [s]", attrgetter("span_s"), 0),
    ("velocity RMS north [m/s]", attrgetter("velocity_rms_north_mps"), 3),
    ("east [m/s]", attrgetter("velocity_rms_east_mps"), 3),
    ("horizontal [m/s]", attrgetter("velocity_rms_horizontal_mps"), 3),
    ("radial error rate, final [nmi/h]", attrgetter("radial_error_rate_final_nmi_per_h"), 2),
    ("at the end [m]", attrgetter("final_radial_error_m"), 0),
)


def several_content(found: SeveralEvaluations) -> tuple[str, list[Section]]:
    """The answer and the sections of the evaluation of several recordings."""
    sections = [
        _glance(found),
        Section("Recordings", _recordings(found.rows)),
        Section("All flights together", _ensemble(found.ensemble)),
    ]
    return _answer(found), [section for section in sections if section.blocks]


def _answer(found: SeveralEvaluations) -> str:
    names = dict.fromkeys(row.name for row in found.rows)
    lines = [f"{len(names)} recordings were evaluated."]
    if refused := sum(isinstance(row, Refused) for row in found.rows):
        done = len(names) - refused
        lines = [f"{done} of {len(names)} recordings were evaluated, {refused} refused: the table says why."]
    for arm, flights in found.ensemble.arms.items():
        if rate := flights.cep_rate_nmi_per_h.get("final"):
            lines.append(f"CEP rate (final) of {flights.size} flights, {called(arm)}: {with_interval(rate)} nmi/h.")
    return "\n".join(lines)


def _glance(found: SeveralEvaluations) -> Section:
    """CEP and velocity RMS of all flights, or of the recordings with the smallest errors where there are too few."""
    numbers = []
    for arm, flights in found.ensemble.arms.items():
        if rate := flights.cep_rate_nmi_per_h.get("final"):
            numbers.append(measured(f"CEP rate (final), {called(arm)}", rate, "nmi/h"))
        if rms := flights.velocity_rms_mps.get("horizontal"):
            numbers.append(measured(f"horizontal velocity RMS, {called(arm)}", rms, "m/s"))
    rows = [row for row in found.rows if isinstance(row, Row) and row.velocity_rms_horizontal_mps is not None]
    best = {row.name: row for row in sorted(rows, key=lambda row: -(row.velocity_rms_horizontal_mps or 0.0))}
    for row in sorted(best.values(), key=lambda row: row.velocity_rms_horizontal_mps or 0.0) if not numbers else ():
        what = f"horizontal velocity RMS, {row.name}, {called(row.compensation)}"
        numbers.append(Number(what, f"{fixed(row.velocity_rms_horizontal_mps, 2)} m/s", ONE_RUN))
    picture = Picture("each_recording", "Horizontal velocity RMS of each recording.")
    step = (
        "ins-eval diagnose on a recording with large errors says what physics is missing from what is believed of it."
    )
    refused = "Read below why recordings were refused." if any(isinstance(row, Refused) for row in found.rows) else ""
    return at_a_glance(numbers, picture, refused, step if rows else "")


def called(arm: str) -> str:
    """A compensation, or the solution beside them, as a reader sees it."""
    return "solution of the INS" if arm == "solution" else f"compensation {label(arm)}"


def _recordings(rows: Sequence[Row | Refused]) -> list[Table]:
    header = ("recording", "compensation", *(words for words, _, _ in COLUMNS))
    evaluated = [row for row in rows if isinstance(row, Row)]
    cells = [
        (row.name, label(row.compensation), *(fixed(value(row), digits) for _, value, digits in COLUMNS))
        for row in evaluated
    ]
    links = tuple(f"{quote(row.name)}/index.html" for row in evaluated)
    found = [
        Table(
            "Each recording",
            header,
            cells,
            'No rate is given of less than half a Schuler period (42 min). "solution" is what the INS put out.',
            "ll" + "r" * len(COLUMNS),
            links=links,
        )
    ] if cells else []  # fmt: skip
    refused = [(row.name, row.refused) for row in rows if isinstance(row, Refused)]
    return [*found, *table("Refused", ("recording", "why"), refused, align="ll")]


def _ensemble(ensemble: FlightsTogether) -> list[Block]:
    """CEP under each definition and velocity RMS, a column a compensation."""
    full = {arm: flights for arm, flights in ensemble.arms.items() if flights.cep_rate_nmi_per_h}
    few = [f"{called(arm)}: {flights.size}" for arm, flights in ensemble.arms.items() if arm not in full]
    words = []
    if short := ensemble.too_short:
        who = f"{short} flights" if short > 1 else "1 flight"
        words.append(f"{who} lasted less than half a Schuler period or had no positions: no CEP follows.")
    if few:
        words.append(
            f"A CEP needs at least {FEWEST_FLIGHTS} flights of half a Schuler period or longer; {joined(few)}."
        )
    heads = [f"{called(arm)}, {flights.size} flights" for arm, flights in full.items()]
    cep = [
        (definition_name(key), *(with_interval(flights.cep_rate_nmi_per_h[key]) for flights in full.values()))
        for key in DEFINITIONS
    ]
    velocity = [
        (axis, *(with_interval(flights.velocity_rms_mps.get(axis), 3) for flights in full.values()))
        for axis in COMPONENTS
    ]
    note = "95 % intervals: bootstrap over the flights."
    return [
        *paragraphs(*words),
        *(table("CEP rate [nmi/h]", ("definition", *heads), cep, note) if full else []),
        *(table("Velocity RMS [m/s]", ("component", *heads), velocity, note) if full else []),
    ]
