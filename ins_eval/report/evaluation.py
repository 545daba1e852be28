"""The evaluation of a real recording in words, with the same machinery as the flight report."""

from __future__ import annotations

from collections.abc import Mapping

from ins_eval.report.content import Block, Picture, Section, paragraphs, pick, table
from ins_eval.report.style import in_order, label
from ins_eval.report.vocabulary import COMPONENTS, MAIN_DEFINITIONS, definitions_table, single_flight_name
from ins_eval.report.wording import MISSING, listed, number, sentence, small

SCHULER_PERIOD_S = 84.4 * 60.0
SIGMAS = 3.0  # a heading farther than this from the documented one, in its own sigma, is worth a word
REFERENCE_WORDS = {
    "standstill": "the known standstill: velocity zero, position that of the start",
    "gps": "GPS",
    "ins": "a better INS",
}


def evaluation_content(metrics: Mapping) -> tuple[str, list[Section]]:
    """The answer and the sections of the evaluation of one recording; what the metrics lack is left out."""
    sections = [
        Section("Result", _result(metrics)),
        Section("Alignment", _alignment(metrics)),
        Section("The recording", _recording(metrics)),
        Section("Definitions and windows", definitions_table(metrics)),
    ]
    return _answer(metrics), [section for section in sections if section.blocks]


def _arms(metrics: Mapping) -> dict[str, Mapping]:
    tree = metrics.get("compensations") or {}
    return {name: tree[name] for name in in_order(tree)}


def _called(name: str) -> str:
    return "without compensation" if name == "none" else f"with {label(name)} compensation"


def _answer(metrics: Mapping) -> str:
    arms = _arms(metrics)
    span = _span(metrics)
    name = pick(metrics, "recording", "name") or "this recording"
    results = []
    for arm, values in arms.items():
        velocity = pick(values, "velocity_rms_mps", "horizontal")
        rate = pick(values, "radial_error_rate_nmi_per_h", "final")
        numbers = [f"horizontal velocity RMS is {number(velocity)} m/s"] if velocity is not None else []
        numbers += [f"the radial error rate (final) {number(rate)} nmi/h"] if rate is not None else []
        if numbers:
            results.append(f"{_called(arm)} {listed(numbers)}")
    if not results:
        return f"{name} was read, but nothing of it was navigated."
    lines = [f"{name}: {'; '.join(results)}, over {span}."]
    if heading := _heading(metrics):
        lines.append(heading)
    lines.append("This is one run: a single radial error rate, not a CEP." + _short(metrics))
    return "\n".join(lines)


def _short(metrics: Mapping) -> str:
    """What a run shorter than one Schuler period cannot show."""
    start, end = pick(metrics, "navigation", "start_s"), pick(metrics, "navigation", "end_s")
    if start is None or end is None or end - start >= SCHULER_PERIOD_S:
        return ""
    return (
        f" It lasts {number(100.0 * (end - start) / SCHULER_PERIOD_S, 0)} % of a Schuler period (84.4 min), so the rate "
        "says nothing about hours of flight."
    )


def _span(metrics: Mapping) -> str:
    start, end = pick(metrics, "navigation", "start_s"), pick(metrics, "navigation", "end_s")
    if start is None or end is None:
        return "the navigated stretch"
    return f"{end - start:.0f} s of pure-inertial navigation"


def _heading(metrics: Mapping) -> str:
    """Heading found, its uncertainty, and how far it is from the documented one."""
    found, sigma = pick(metrics, "alignment", "heading_deg"), pick(metrics, "alignment", "heading_sigma_deg")
    if found is None:
        return ""
    text = f"Heading from self-alignment: {number(found)}°"
    if sigma is not None:
        text += f" ± {number(sigma)}° (1 σ)"
    documented = pick(metrics, "alignment", "documented_heading_deg")
    if documented is None:
        return text + "; none is documented to compare with."
    off = (found - documented + 180.0) % 360.0 - 180.0
    text += f", {number(abs(off))}° from the documented {number(documented)}°"
    if sigma:
        text += f", {'within' if abs(off) <= SIGMAS * sigma else 'more than'} {SIGMAS:.0f} σ"
    return text + "."


def _result(metrics: Mapping) -> list[Block]:
    arms = _arms(metrics)
    if not arms:
        return []
    measures = [
        *((f"{c} velocity RMS [m/s]", ("velocity_rms_mps", c), 3) for c in COMPONENTS),
        *((f"{single_flight_name(d)} [nmi/h]", ("radial_error_rate_nmi_per_h", d), 2) for d in MAIN_DEFINITIONS),
        ("radial error at the end [m]", ("final_radial_error_m",), 0),
    ]
    rows = [
        (name, *cells)
        for name, path, digits in measures
        if set(cells := [number(pick(values, *path), digits) for values in arms.values()]) != {MISSING}
    ]
    note = f"Window: {_span(metrics)}."
    if (floor := pick(metrics, "floor", "horizontal_m")) is not None:
        note += f" Numeric floor of the same navigation without sensor errors: {small(floor, 'm')} in position."
    return [
        *paragraphs(_against(metrics)),
        *table("Velocity RMS and radial error rate", ("measure", *map(label, arms)), rows, note),
        Picture("east_velocity_error", "East velocity error. A wave of 84.4 min is the Schuler oscillation."),
        Picture("north_velocity_error", "North velocity error."),
        Picture("position_error", "Horizontal distance from the reference."),
    ]


def _against(metrics: Mapping) -> str:
    kind = pick(metrics, "reference", "kind")
    if not kind:
        return ""
    text = f"Measured against {REFERENCE_WORDS.get(kind, kind)}"
    if epochs := pick(metrics, "reference", "epochs"):
        text += f"; {epochs} epochs"
    if outages := pick(metrics, "reference", "outages"):
        text += f", {outages} outages, whose epochs count in no RMS"
    return text + "."


def _alignment(metrics: Mapping) -> list[Block]:
    alignment = metrics.get("alignment") or {}
    stretch = alignment.get("stretch_s")
    where = (
        f"Aligned on {stretch[0]:.0f} to {stretch[1]:.0f} s of the recording, the quiet stretch that the rule found."
        if stretch
        else ""
    )
    names = (
        ("heading_deg", "heading [°]"),
        ("heading_sigma_deg", "heading, 1 σ [°]"),
        ("documented_heading_deg", "heading, documented [°]"),
        ("roll_deg", "roll [°]"),
        ("pitch_deg", "pitch [°]"),
    )
    rows = [(name, number(alignment[key], 3)) for key, name in names if alignment.get(key) is not None]
    return (
        [
            *paragraphs(where, _heading(metrics)),
            *table("Attitude at the end of the alignment", ("angle", "value"), rows),
            Picture(
                "activity", "How restless the recording is over time; the shaded stretch was used for the alignment."
            ),
            Picture(
                "attitude",
                "Roll, pitch and heading while navigating. For a parked vehicle a drift here is the gyros' and the "
                "mechanization's, not motion.",
            ),
        ]
        if where or rows
        else []
    )


def _recording(metrics: Mapping) -> list[Block]:
    recording = metrics.get("recording") or {}
    facts = [
        f"{name} {recording[key]:g}{unit}" if isinstance(recording[key], int | float) else f"{name} {recording[key]}"
        for key, name, unit in (("kind", "kind", ""), ("rate_hz", "rate", " Hz"), ("duration_s", "length", " s"))
        if recording.get(key) is not None
    ]
    return paragraphs(
        sentence(", ".join(facts)) if facts else "", *(sentence(note) for note in recording.get("notes") or ())
    )
