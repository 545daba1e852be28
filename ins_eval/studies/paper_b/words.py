"""Paper B in words: each of its statements with a verdict, and what our loop adds.

The rows come judged (`rows`); here they are counted, grouped and put beside their figures. What the results lack is
left out.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ins_eval.report.content import Block, Picture, Section, at_a_glance, measured, paragraphs, table
from ins_eval.studies.filled import blocks_of, possible
from ins_eval.studies.paper_b.rows import TREES
from ins_eval.studies.papers import Row, number
from ins_eval.studies.statements import counted, read_pictures, signed, statement_sections
from ins_eval.tables import pick
from ins_eval.wording import fixed, joined

CHANNELS = ("forward", "feedback")
OF_TEST = {"scan": "scan", "current": "constant current", "output": "output at 1 g"}
MARGINS = {  # of the results: words, unit, decimals, factor
    "crossover_hz": ("crossover [Hz]", 2, 1.0),
    "phase_margin_deg": ("phase margin [°]", 3, 1.0),
    "gain_margin_db": ("gain margin [dB]", 3, 1.0),
    "bandwidth_hz": ("bandwidth, −3 dB [Hz]", 2, 1.0),
    "rise_s": ("rise to 90 % [ms]", 2, 1e3),
    "overshoot": ("overshoot [%]", 2, 100.0),
}
STATES = {"nominal": "as built", "drifted": "−200 ppm", "compensated": "compensated"}

PICTURES = read_pictures(Path(__file__).with_name("pictures.toml"))
WORDS: dict[str, Any] = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


def paper_b_content(rows: Sequence[Row], results: Mapping) -> tuple[str, list[Section]]:
    """The answer (first line the count, then what matters most, last what it means) and the sections of the page."""
    tree = {**dict.fromkeys(TREES), **results, **_derived(results)}
    answer = (counted(rows, "Paper B"), *(possible(line, tree) for line in WORDS["answer"].values()))
    sections = [_glance(results.get("population") or {}), *statement_sections(rows, PICTURES)]
    for heading, tell in OURS.items():
        sections.append(Section(heading, tell(results) if tell else blocks_of(WORDS[heading], tree)))
    return "\n".join(filter(None, answer)), [section for section in sections if section.blocks]


def _glance(population: Mapping) -> Section:
    """How far the estimates of our units are off, and what the compensation leaves."""
    wanted = (
        ("forward_shift_ppm", "forward gain: found less injected drift", "ppm", "units"),
        ("feedback_shift_ppm", "feedback gain: found less injected drift", "ppm", "units"),
        ("compensated_ug", "output change after compensation, magnitude", "ug", "repetitions"),
    )
    numbers = []
    for key, words, unit, over in wanted:
        if key in population:
            found = measured(words, population[key], unit, 0)
            numbers.append(found._replace(interval=found.interval.replace("95 %", f"95 % of {over}", 1)))
    picture = Picture("shift_distribution", "Error of the estimates of our units, and of the paper's.")
    step = "Identify your own loop: ins-eval loop simulate writes tests, ins-eval loop calibrate gains from them."
    return at_a_glance(numbers, picture, step)


def _derived(results: Mapping) -> dict[str, Any]:
    """What the texts say of the results that does not stand in them."""
    population, margins = results.get("population") or {}, results.get("stability")
    larger_ppm, growth = next(iter((population.get("shift_grows_ppm") or {}).items()), (None, None))
    magnet = next((row for row in results.get("observability") or () if row["part"] == "magnet"), None)
    carrier = pick(results, "attraction", "drift_ppm")
    return {
        **{"larger_ppm": larger_ppm, "growth": growth},
        "over": f"{population['units']} units" if "units" in population else "All units",
        "magnet": magnet and {key: abs(magnet[key]) for key in ("output_ug", "current_test_ppm")},
        "margin_change": margins
        and abs(margins["drifted"]["phase_margin_deg"] - margins["nominal"]["phase_margin_deg"]),
        "carrier_drift_ppm": None if carrier is None else abs(carrier),
    }


def _sight(results: Mapping) -> list[Block]:
    seen = results.get("observability") or []
    rows = [
        (
            row["part"].replace("_", " "),
            row["gain"],
            *(_size(row[key]) for key in ("forward_scan_ppm", "current_test_ppm", "output_ug")),
            ", ".join(OF_TEST[test] for test in row["seen_by"]) or "nothing",
        )
        for row in seen
    ]
    blind = [row["part"].replace("_", " ") for row in seen if row["seen_by"] == ["output"]]
    false = [row["part"].replace("_", " ") for row in seen if row["seen_by"] == ["current"]]
    text = ""
    if blind and false:
        text = (
            f"Drifts of {joined(blind)} change the output, and neither test detects them, so they are not compensated. "
            f"A drift of {joined(false)} is taken for one of the feedback gain, so that compensation adds it."
        )
    note = "Each part drifted by 200 ppm on its own, with the same noise in every test. Below 1 % of it: not detected."
    header = ("part", "of", "scan [ppm]", "constant current [ppm]", "output at 1 g [µg]", "detected by")
    return [
        *paragraphs(text),
        *table("Reading of each test when a part drifts by +200 ppm", header, rows, note, "llrrrl"),
    ]


def _size(value: float) -> str:
    return fixed(value, 0) if abs(value) >= 10.0 else (fixed(value, 1) if abs(value) >= 0.05 else "0")


def _identified(results: Mapping) -> list[Block]:
    unit, printed = results.get("unit"), results.get("printed_ppm")
    if not (unit and printed):
        return []
    columns = [values for channel in CHANNELS for values in (printed[channel], unit[f"{channel}_ppm"])]
    rows = [(str(k), *map(fixed, cells)) for k, cells in enumerate(zip(*columns, strict=True), 1)]
    rows.append(("mean", *(fixed(sum(values) / len(values)) for values in columns)))
    header = ("repetition", *(f"{channel}, {whose} [ppm]" for channel in CHANNELS for whose in ("Paper B", "ours")))
    outputs = unit["outputs_ug"]
    note = (
        "Three temperature coefficients of this unit (forward amplifier, current source, magnet) were chosen after "
        "these tables, so the agreement of the means shows nothing; the 24 µg follow from the rest (B21). Its output "
        f"changes by {fixed(outputs['uncompensated'], 0)} µg, and after compensation by "
        f"+{fixed(outputs['compensated'], 0)} µg; Paper B: 193 and 24 µg."
    )
    return table("The identified unit against Tables 3 and 4", header, rows, note)


def _stability(results: Mapping) -> list[Block]:
    margins = results.get("stability") or {}
    rows = [
        (words, *(fixed(factor * margins[state][key], digits) for state in STATES))
        for key, (words, digits, factor) in MARGINS.items()
        if all(state in margins for state in STATES)
    ]
    note = (
        "From the sampled loop with its delay. The overshoot is that of a PI controller without a prefilter. A "
        f"change of the forward gain by {number(margins['degree_percent'], 2)} % changes the phase margin by 1°."
        if margins
        else ""
    )
    return table("Stability and response", ("quantity", *STATES.values()), rows, note)


def _parameters(results: Mapping) -> list[Block]:
    rows = [(symbol, signed(words)) for symbol, words in (results.get("loop") or {}).items()]
    note = "The paper prints none of these values. All are in the preset digital-qfa, with units and sources."
    return table("Values of our loop, by the paper's symbols", ("symbol", "value"), rows, note, "ll")


OURS: Mapping[str, Callable[[Mapping], list[Block]] | None] = {  # None: all of it stands in words.toml
    "Ours: what each test detects": _sight,
    "Ours: many units through the procedure": None,
    "Ours: correction for temperature": None,
    "Ours: electrostatic attraction": None,
    "Ours: the loop in flight": None,
    "Ours: the identified unit": _identified,
    "Ours: stability": _stability,
    "Ours: values of the loop": _parameters,
}
