"""Paper B in words: each of its statements with a verdict, and what our loop adds.

The rows come judged (`ins_eval.paper_b`); here they are counted, grouped and put beside their figures. What the
results lack is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from ins_eval.papers import Row
from ins_eval.papers import number as significant
from ins_eval.report.content import Block, Section, paragraphs, table
from ins_eval.report.statements import Pictures, counted, signed, statement_sections
from ins_eval.report.wording import listed, number, with_interval

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

PICTURES: Pictures = {
    "B-T3": {
        "estimates_by_repetition": "The six repetitions of Tables 3 and 4 among those of our units, which nothing "
        "but temperature moves away from what was put in."
    },
    "B-F2": {"loop_structure": "The loop as it is modelled."},
    "B-F3": {"bridge_chain": "The chain as it is modelled."},
    "B-F4": {"open_loop_chain": "The chain as it is modelled; grey is what the plate on its stop cuts off."},
    "B-F5": {"scan_schedule": "The scan as it is carried out."},
    "B-F6": {"excited_open_loop": "The rejected method as it is modelled."},
    "B-F7": {"loop_with_current": "The loop as it is modelled while the current is on."},
    "B-F8": {"loop_with_compensation": "Where both corrections act."},
    "B-F9": {"procedure_steps": "The procedure as it is carried out."},
    "B-F11": {
        "forward_estimation": "As Fig. 11 of the paper; the difference has a panel of its own, since 200 ppm cannot be "
        "seen in the scan."
    },
    "B-F12": {"feedback_estimation": "As Fig. 12 of the paper, for all six repetitions, beside the printed counts."},
    "B-F13": {"static_output": "As Fig. 13 of the paper. Compensation overshoots: what is left has the other sign."},
    "B-S1": {"stability_against_drift": "What a drift of the forward gain does change, and how large it has to be."},
    "B10": {
        "shift_distribution": "The paper's two shifts among those of our units.",
        "shift_and_size": "A shift that comes with the state of the room stays the same whatever is injected.",
    },
}


def paper_b_content(rows: Sequence[Row], results: Mapping) -> tuple[str, list[Section]]:
    """The answer (first line the count, then what matters most, last what it means) and the sections of the page."""
    answer = (counted(rows, "Paper B"), *(tell(results) for tell in (_shift, _output, _unseen, _stable, _meaning)))
    sections = [
        *statement_sections(rows, PICTURES),
        *(Section(heading, tell(results)) for heading, tell in OURS.items()),
    ]
    return "\n".join(filter(None, answer)), [section for section in sections if section.blocks]


# -------------------------------------------------------------------------------------------------------- the answer


def _shift(results: Mapping) -> str:
    population = results.get("population")
    if not population:
        return ""
    growth = next(iter(population["shift_grows_ppm"].items()))
    ours = listed([f"{words} {with_interval(population[f'{c}_shift_ppm'], 0)} ppm" for c, words in _names()])
    changes = listed([with_interval(growth[1][channel]) for channel in CHANNELS])
    return (
        "The paper's residuals of 9.74 and 9.08 % are no share of a drift (of the feedback gain 109 % were found) but "
        "a shift of +19.5 and +18.2 ppm, for which a warm-up within the paper's 3 °C suffices: over "
        f"{population['units']} units of ours, warmed up by "
        f"{number(population['warm_up_c']['value'], 1)} °C, the shift is {ours} (median, central 95 %), of either "
        f"sign, and with {growth[0]} ppm injected it changes by {changes} ppm (means, 95 % interval)."
    )


def _names() -> list[tuple[str, str]]:
    return [(channel, f"of the {channel} gain") for channel in CHANNELS]


def _output(results: Mapping) -> str:
    unit, population = results.get("unit"), results.get("population")
    if not (unit and population):
        return ""
    outputs = unit["outputs_ug"]
    return (
        f"Of 193 µg the paper keeps 24; the unit identified from its tables has {number(outputs['uncompensated'], 0)} "
        f"and keeps +{number(outputs['compensated'], 0)} µg, over-compensated by the same closure as the printed "
        f"numbers (−193 + 218 = +25). Our units have {with_interval(population['uncompensated_ug'], 0)} and keep "
        f"{with_interval(population['compensated_ug'], 0)} µg (sizes in single repetitions: median, central 95 %)."
    )


def _unseen(results: Mapping) -> str:
    seen = results.get("observability")
    if not seen:
        return ""
    magnet = next(row for row in seen if row["part"] == "magnet")
    return (
        f"A drift of the magnet is not seen by either test: {significant(200.0)} ppm of it change the output by "
        f"{number(abs(magnet['output_ug']), 0)} µg and the test with the constant current by "
        f"{significant(abs(magnet['current_test_ppm']), 1)} ppm."
    )


def _stable(results: Mapping) -> str:
    margins = results.get("stability")
    if not margins:
        return ""
    change = margins["drifted"]["phase_margin_deg"] - margins["nominal"]["phase_margin_deg"]
    return (
        f"For the stability of the loop 200 ppm of the forward gain do not matter: the phase margin changes by "
        f"{significant(abs(change), 1)}° of {number(margins['nominal']['phase_margin_deg'], 0)}°, and the output of "
        "a static test does not change at all."
    )


def _meaning(results: Mapping) -> str:
    if not (results.get("year") and results.get("population")):
        return ""
    year = results["year"]
    return (
        "What it means: the test with the constant current is worth building in, if it is made at the temperature of "
        f"its reference (a year's drift at 1 g then falls from {number(year['before_ug'], 0)} to "
        f"{number(year['after_ug'], 0)} µg, magnet and current source being left); elsewhere the room decides. "
        "The scan of the forward gain may be left out."
    )


# ------------------------------------------------------------------------------------------- what our results add


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
            f"Drifts of {listed(blind)} change the output and are seen by neither test, so they are not compensated. A "
            f"drift of {listed(false)} is seen as one of the feedback gain, so that compensation puts it in."
        )
    note = "Each part drifted by 200 ppm alone; with the same noise in every test. Below 0.01 of it counts as not seen."
    header = ("part", "of", "scan [ppm]", "constant current [ppm]", "output at 1 g [µg]", "seen by")
    return [*paragraphs(text), *table("What each test reads of a drift by +200 ppm", header, rows, note, "llrrrl")]


def _size(value: float) -> str:
    return number(value, 0) if abs(value) >= 10.0 else (number(value, 1) if abs(value) >= 0.05 else "0")


def _population(results: Mapping) -> list[Block]:
    found = results.get("population") or {}
    words = {
        "shift_ppm": ("found less injected drift [ppm]", 1),
        "error_ppm": ("found drift less what the gain did change by [ppm]", 1),
        "residual_percent": ("the same as the paper counts it, size over 200 ppm [%]", 1),
        "scatter_ppm": ("scatter of the six repetitions [ppm]", 1),
        "baseline_scatter_ppm": ("scatter of the reference [ppm]", 1),
    }
    rows = [
        (text, *(with_interval(found.get(f"{channel}_{key}"), digits) for channel in CHANNELS))
        for key, (text, digits) in words.items()
        if f"forward_{key}" in found
    ]
    if "mean_forward_shift_ppm" in found:
        cells = (with_interval(found[f"mean_{channel}_shift_ppm"], 1) for channel in CHANNELS)
        rows.append(("mean shift over the units, 95 % interval [ppm]", *cells))
    for size, growth in (found.get("shift_grows_ppm") or {}).items():
        cells = (with_interval(growth[channel]) for channel in CHANNELS)
        rows.append((f"change of the shift with {size} ppm injected, mean and 95 % interval [ppm]", *cells))
    over = f"{found['units']} units" if "units" in found else "All units"
    note = f"{over}, six repetitions; median and central 95 % of units where nothing else is said."
    blocks = table("Estimates of both gains over our units", ("quantity", *CHANNELS), rows, note)
    outputs = {
        "uncompensated_ug": ("change of the output, uncompensated, size [µg]", 0),
        "compensated_ug": ("compensated, size [µg]", 0),
        "output_residual_percent": ("compensated over uncompensated [%]", 0),
        "closure_ug": ("compensated less (uncompensated + feedback estimate), of units [µg]", 1),
    }
    rows = [(text, with_interval(found[key], digits)) for key, (text, digits) in outputs.items() if key in found]
    note = "Median and central 95 % of single repetitions. Paper B: 193 and 24 µg, 12.44 %; its closure is −1.2 µg."
    return [*blocks, *table("Output at 1 g over our units", ("quantity", "ours"), rows, note)]


def _identified(results: Mapping) -> list[Block]:
    unit, printed = results.get("unit"), results.get("printed_ppm")
    if not (unit and printed):
        return []
    columns = [values for channel in CHANNELS for values in (printed[channel], unit[f"{channel}_ppm"])]
    rows = [(str(k), *map(number, cells)) for k, cells in enumerate(zip(*columns, strict=True), 1)]
    rows.append(("mean", *(number(sum(values) / len(values)) for values in columns)))
    header = ("repetition", *(f"{channel}, {whose} [ppm]" for channel in CHANNELS for whose in ("Paper B", "ours")))
    outputs = unit["outputs_ug"]
    note = (
        "Three temperature coefficients of this unit (forward amplifier, current source, magnet) were chosen after "
        "these tables, so that the means agree shows nothing; the 24 µg follow from the rest (B21). Its output changes "
        f"by {number(outputs['uncompensated'], 0)} µg, and by +{number(outputs['compensated'], 0)} after compensation; "
        "Paper B: 193 and 24."
    )
    return table("The identified unit against Tables 3 and 4", header, rows, note)


def _stability(results: Mapping) -> list[Block]:
    margins = results.get("stability") or {}
    rows = [
        (words, *(number(factor * margins[state][key], digits) for state in STATES))
        for key, (words, digits, factor) in MARGINS.items()
        if all(state in margins for state in STATES)
    ]
    note = (
        "From the sampled loop with its delay. An overshoot without a prefilter is that of a PI controller. It takes "
        f"{significant(margins['degree_percent'], 2)} % of forward gain to change the phase margin by a degree."
        if margins
        else ""
    )
    return table("Stability and response", ("quantity", *STATES.values()), rows, note)


def _parameters(results: Mapping) -> list[Block]:
    rows = [(symbol, signed(words)) for symbol, words in (results.get("loop") or {}).items()]
    note = "The paper prints no value. All stand with unit and source in the preset digital-qfa."
    return table("Values of our loop, by the paper's symbols", ("symbol", "value"), rows, note, "ll")


OURS: Mapping[str, Callable[[Mapping], list[Block]]] = {
    "Ours: what each test sees": _sight,
    "Ours: many units through the procedure": _population,
    "Ours: the identified unit": _identified,
    "Ours: stability": _stability,
    "Ours: values of the loop": _parameters,
}
