"""The grade of an instrument in words and tables."""

from __future__ import annotations

from math import floor, log10

from ins_eval.allan import TERMS
from ins_eval.figures.results.grade import FIGURE, LAWS
from ins_eval.grade import Grade, NoiseTerm, Offset
from ins_eval.report.content import Block, Picture, Section, paragraphs, table
from ins_eval.wording import alike, rounded, significant

OFFSETS = (
    "Gyros: mean rate less the vertical part of Earth rate; the horizontal part, of unknown direction, is in the "
    "sigma, and so is how the offset wanders. Norm: from normal gravity."
)
NOT_DETERMINED = "not determined"


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
        rows = []
        for name, law in laws.items():
            slope, low, high = alike(law.slope, law.interval95)
            rows.append((name, slope, f"[{low}, {high}]", law.unit))
        note = (
            "Straight lines of means over ten seconds at rest, with 95 % intervals. They say how a channel moved with "
            "temperature in this recording, not why: time passed as well. ins-eval diagnose separates the two."
        )
        blocks += table("Temperature at rest", ("channel", "slope", "95 % interval", "unit"), rows, note)
        blocks.append(Picture(LAWS, "Each channel at rest against temperature, and its straight line."))
    return Section("What grade it is", blocks)


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
    return [(name, *_to_sigma(offset)) for name, offset in found.items()]


def _to_sigma(offset: Offset) -> tuple[str, str]:
    """An offset to the second figure of its sigma, and that."""
    if not offset.sigma > 0.0:
        return significant(offset.value, 4), significant(offset.sigma, 2)
    return rounded(offset.value, 1 - floor(log10(offset.sigma))), significant(offset.sigma, 2)


def _cell(term: NoiseTerm) -> str:
    low, high = term.interval95
    if not term.visible:
        return f"below {significant(high)}"
    return f"{significant(term.value)} [{significant(low)}, {significant(high)}]"
