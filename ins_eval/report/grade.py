"""The grade of an instrument in words, tables and the figure of its Allan deviation."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ins_eval import figures
from ins_eval.allan import TERMS
from ins_eval.grade import Grade, NoiseTerm, units_of
from ins_eval.report.content import Block, Picture, Section, paragraphs, table
from ins_eval.report.diagnosis_words import figures as spoken
from ins_eval.temperature_law import TemperatureLaw
from ins_eval.units import DEG_PER_H, UG

FIGURE, LAWS = "allan_deviation", "temperature_laws"
OFFSETS = (
    "Gyros: mean rate less the vertical part of Earth rate; the horizontal part, of unknown direction, is in the "
    "sigma, and so is how the offset wanders. Norm: from normal gravity."
)
NOT_DETERMINED = "not determined"
LETTERS = {"quantisation": "Q", "white": "N", "flicker": "B", "random_walk": "K"}


def grade_section(grade: Grade | None) -> Section:
    """What the stretches at rest show; empty where no grade was measured."""
    if grade is None:
        return Section("What grade it is", [])
    blocks: list[Block] = [*paragraphs(grade.words, _where(grade))]
    blocks += table("Offsets at rest", ("channel", "offset", "one sigma"), _offsets(grade), OFFSETS)
    shown = [term for term in TERMS if term != "quantisation"]
    rows = [
        (one.name, *(_cell(one.terms[term]) if one.fit else NOT_DETERMINED for term in shown))
        for one in grade.channels
        if one.fit is not None or (one.allan.deviation > 0.0).any()
    ]
    note = (
        "Value [95 % interval]; below: no more than that is seen; not determined: too short a rest, or not noise of "
        "this kind. Gyros in deg/sqrt(h), deg/h and deg/h/sqrt(h), accelerometers in µg/√Hz, µg and µg/√s."
    )
    blocks += table("Noise at rest", ("channel", "white noise N", "flicker B", "random walk K"), rows, note)
    if rows:
        caption = "Allan deviation of each channel at rest, and the noise terms that make it."
        blocks.append(Picture(FIGURE, caption))
    if laws := grade.laws_in_units:
        rows = [
            (name, spoken(law.slope, 4), "[" + ", ".join(spoken(end, 4) for end in law.interval95) + "]", law.unit)
            for name, law in laws.items()
        ]
        note = (
            "Straight lines of means over ten seconds at rest, with 95 % intervals. They say how a channel moved with "
            "temperature in this recording, not why: time passed as well. ins-eval diagnose separates the two."
        )
        blocks += table("Temperature at rest", ("channel", "slope", "95 % interval", "unit"), rows, note)
        blocks.append(Picture(LAWS, "Each channel at rest against temperature, and its straight line."))
    return Section("What grade it is", blocks)


def grade_figures(grade: Grade) -> dict[str, Figure]:
    """The Allan deviation of every channel, and its law of temperature; nothing where no rest is long enough."""
    channels = [_channel(one) for one in grade.channels if one.allan.tau_s.size]
    if not channels:
        return {}
    drawn = {FIGURE: figures.allan_deviation(channels=channels, rest_s=grade.rest_s)}
    if grade.laws:
        drawn[LAWS] = figures.temperature_laws(channels=[_law(one) for one in grade.laws])
    return drawn


def _law(one: TemperatureLaw) -> dict[str, Any]:
    unit, si = ("°/h", DEG_PER_H) if one.name.startswith("gyro") else ("µg", UG)
    ends_c = np.array([one.temperature_c.min(), one.temperature_c.max()])
    low, high = (bound / si for bound in one.interval95)
    return {
        "name": one.name,
        "unit": unit,
        "temperature_c": one.temperature_c,
        "change": (one.mean - one.offset) / si,
        "line_c": ends_c,
        "line": one.slope * (ends_c - one.reference_c) / si,
        "words": f"{spoken(one.slope / si, 4)} [{spoken(low, 4)}, {spoken(high, 4)}] {unit}/°C",
    }


def _channel(one) -> dict[str, Any]:
    of = units_of(one.name)
    unit, si = ("°/h", of["flicker"][1]) if one.name.startswith("gyro") else ("µg", of["flicker"][1])
    tau_s, words, terms = one.allan.tau_s, [], {}
    for term in TERMS if one.fit else ():
        found, (name, size) = getattr(one.fit, term), of[term]
        if found.visible and term != "quantisation":
            text = f"{spoken(found.value / size)} [{spoken(found.low / size)}, {spoken(found.high / size)}]"
            words.append(f"{LETTERS[term]} = {text} {name}")
        if found.visible:
            terms[term] = one.fit.deviation(tau_s, term) / si
    return {
        "name": one.name,
        "unit": unit,
        "tau_s": tau_s,
        "deviation": np.asarray(one.allan.deviation) / si,
        "fit": None if one.fit is None else one.fit.deviation(tau_s) / si,
        "terms": terms,
        "words": "\n".join(words),
    }


def _where(grade: Grade) -> str:
    if not grade.rests:
        return ""
    each = ", ".join(f"{rest.end_s - rest.start_s:.0f} s from {rest.start_s:.0f} s" for rest in grade.rests)
    text = f"At rest: {each}."
    if (span := grade.temperature_c) is not None:
        text += f" Thermometer: {span[0]:.2f} to {span[1]:.2f} degC."
    return text


def _offsets(grade: Grade) -> list[tuple[str, str, str]]:
    found = {f"gyro {axis} [deg/h]": offset for axis, offset in grade.gyro_offset_deg_per_h.items()}
    if (force := grade.force_offset_ug) is not None:
        found["norm of specific force [µg]"] = force
    return [(name, spoken(offset.value, 4), spoken(offset.sigma, 2)) for name, offset in found.items()]


def _cell(term: NoiseTerm) -> str:
    low, high = term.interval95
    return f"{spoken(term.value)} [{spoken(low)}, {spoken(high)}]" if term.visible else f"below {spoken(high)}"
