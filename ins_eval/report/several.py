"""Several recordings on one page: a row each, and what they come to as an ensemble of flights."""

from __future__ import annotations

from collections.abc import Mapping
from urllib.parse import quote

from ins_eval.figures.style import label
from ins_eval.report.content import Section, Table, paragraphs, table
from ins_eval.tables import pick
from ins_eval.vocabulary import COMPONENTS, DEFINITIONS, definition_name
from ins_eval.wording import fixed, joined, with_interval

COLUMNS = (
    ("span [s]", "span_s", 0),
    ("velocity RMS north [m/s]", "velocity_rms_north_mps", 3),
    ("east [m/s]", "velocity_rms_east_mps", 3),
    ("horizontal [m/s]", "velocity_rms_horizontal_mps", 3),
    ("radial error rate, final [nmi/h]", "radial_error_rate_final_nmi_per_h", 2),
    ("at the end [m]", "final_radial_error_m", 0),
)


def several_content(metrics: Mapping) -> tuple[str, list[Section]]:
    """The answer and the sections of the evaluation of several recordings."""
    rows = metrics["recordings"]
    sections = [
        Section("Recordings", _recordings(rows)),
        Section("All flights together", _ensemble(metrics["ensemble"])),
    ]
    return _answer(metrics), [section for section in sections if section.blocks]


def _answer(metrics: Mapping) -> str:
    rows = metrics["recordings"]
    names, refused = list(dict.fromkeys(row["name"] for row in rows)), [row for row in rows if "refused" in row]
    lines = [f"{len(names)} recordings were evaluated."]
    if refused:
        done = len(names) - len(refused)
        lines = [f"{done} of {len(names)} recordings were evaluated, {len(refused)} refused: the table says why."]
    for arm, numbers in _arms(metrics["ensemble"]).items():
        if rate := pick(numbers, "cep_rate_nmi_per_h", "final"):
            lines.append(f"CEP rate (final) of {numbers['size']} flights, {called(arm)}: {with_interval(rate)} nmi/h.")
    return "\n".join(lines)


def _arms(ensemble: Mapping) -> dict[str, Mapping]:
    return {arm: numbers for arm, numbers in ensemble.items() if isinstance(numbers, Mapping)}


def called(arm: str) -> str:
    """A compensation, or the solution beside them, as a reader sees it."""
    return "solution of the INS" if arm == "solution" else f"compensation {label(arm)}"


def _recordings(rows: list[Mapping]) -> list[Table]:
    header = ("recording", "compensation", *(words for words, _, _ in COLUMNS))
    cells = [
        (row["name"], label(row["compensation"]), *(fixed(row.get(key), digits) for _, key, digits in COLUMNS))
        for row in rows
        if "refused" not in row
    ]
    links = tuple(f"{quote(row['name'])}/index.html" for row in rows if "refused" not in row)
    found = [
        Table(
            "Each recording",
            header,
            cells,
            'No rate is given of less than half a Schuler period (42 min). "solution" is what the INS put out.',
            "ll" + "r" * len(COLUMNS),
            links=links,
            sortable=True,
        )
    ] if cells else []  # fmt: skip
    refused = [(row["name"], row["refused"]) for row in rows if "refused" in row]
    return [*found, *table("Refused", ("recording", "why"), refused, align="ll")]


def _ensemble(ensemble: Mapping) -> list:
    """CEP under each definition and velocity RMS, a column a compensation."""
    arms = _arms(ensemble)
    full = {arm: numbers for arm, numbers in arms.items() if "cep_rate_nmi_per_h" in numbers}
    few = [f"{called(arm)}: {numbers['size']}" for arm, numbers in arms.items() if arm not in full]
    words = []
    if short := ensemble["too_short"]:
        words.append(f"{short} lasted less than half a Schuler period or had no positions: no CEP follows from them.")
    if few:
        words.append(
            f"A CEP needs at least {ensemble['fewest']} flights of half a Schuler period or longer; {joined(few)}."
        )
    header = ("definition", *(f"{called(arm)}, {numbers['size']} flights" for arm, numbers in full.items()))
    cep = [
        (definition_name(key), *(with_interval(numbers["cep_rate_nmi_per_h"][key]) for numbers in full.values()))
        for key in DEFINITIONS
    ]
    velocity = [
        (axis, *(with_interval(pick(numbers, "velocity_rms_mps", axis), 3) for numbers in full.values()))
        for axis in COMPONENTS
    ]
    note = "95 % intervals: bootstrap over the flights."
    return [
        *paragraphs(*words),
        *(table("CEP rate [nmi/h]", header, cep, note) if full else []),
        *(table("Velocity RMS [m/s]", ("component", *header[1:]), velocity, note) if full else []),
    ]
