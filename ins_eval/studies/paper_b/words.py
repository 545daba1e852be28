"""Paper B in words: each of its statements with a verdict, and what our loop adds.

The rows come judged (`rows`); here they are counted, grouped and put beside their figures. What the results lack is
left out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from ins_eval.report.content import Block, Section, paragraphs, table
from ins_eval.studies.papers import Row, number
from ins_eval.studies.statements import counted, read_pictures, signed, statement_sections
from ins_eval.wording import fixed, joined, with_interval

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
    ours = joined([f"{words} {with_interval(population[f'{c}_shift_ppm'], 0)} ppm" for c, words in _names()])
    changes = joined([with_interval(growth[1][channel]) for channel in CHANNELS])
    return (
        "The paper's residuals of 9.74 and 9.08 % are no share of a drift (of the feedback gain 109 % were found) but "
        "a shift of +19.5 and +18.2 ppm, for which a warm-up within the paper's 3 °C suffices: over "
        f"{population['units']} units of ours, warmed up by "
        f"{fixed(population['warm_up_c']['value'], 1)} °C, the shift is {ours} (median, central 95 %), of either "
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
        f"Of 193 µg the paper keeps 24; the unit identified from its tables has {fixed(outputs['uncompensated'], 0)} "
        f"and keeps +{fixed(outputs['compensated'], 0)} µg, over-compensated by the same closure as the printed "
        f"numbers (−193 + 218 = +25). Our units have {with_interval(population['uncompensated_ug'], 0)} and keep "
        f"{with_interval(population['compensated_ug'], 0)} µg (sizes in single repetitions: median, central 95 %)."
    )


def _unseen(results: Mapping) -> str:
    seen = results.get("observability")
    if not seen:
        return ""
    magnet = next(row for row in seen if row["part"] == "magnet")
    return (
        f"A drift of the magnet is not seen by either test: {number(200.0)} ppm of it change the output by "
        f"{fixed(abs(magnet['output_ug']), 0)} µg and the test with the constant current by "
        f"{number(abs(magnet['current_test_ppm']), 1)} ppm."
    )


def _stable(results: Mapping) -> str:
    margins = results.get("stability")
    if not margins:
        return ""
    change = margins["drifted"]["phase_margin_deg"] - margins["nominal"]["phase_margin_deg"]
    return (
        f"For the stability of the loop 200 ppm of the forward gain do not matter: the phase margin changes by "
        f"{number(abs(change), 1)}° of {fixed(margins['nominal']['phase_margin_deg'], 0)}°, and the output of "
        "a static test does not change at all."
    )


def _meaning(results: Mapping) -> str:
    if not (results.get("year") and results.get("population")):
        return ""
    year = results["year"]
    return (
        "What it means: the test with the constant current is worth building in, if it is made at the temperature of "
        f"its reference or put back to it (a year's drift at 1 g then falls from {fixed(year['before_ug'], 0)} to "
        f"{fixed(year['after_ug'], 0)} µg, magnet and current source being left); elsewhere the room decides. "
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
            f"Drifts of {joined(blind)} change the output and are seen by neither test, so they are not compensated. A "
            f"drift of {joined(false)} is seen as one of the feedback gain, so that compensation puts it in."
        )
    note = "Each part drifted by 200 ppm alone; with the same noise in every test. Below 0.01 of it counts as not seen."
    header = ("part", "of", "scan [ppm]", "constant current [ppm]", "output at 1 g [µg]", "seen by")
    return [*paragraphs(text), *table("What each test reads of a drift by +200 ppm", header, rows, note, "llrrrl")]


def _size(value: float) -> str:
    return fixed(value, 0) if abs(value) >= 10.0 else (fixed(value, 1) if abs(value) >= 0.05 else "0")


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


ARMS = {
    "none": "as measured",
    "tests": "tests put back",
    "tests_and_output": "tests and output put back",
    "other_unit": "with another unit's coefficients",
}
ERRORS = {"forward_ppm": "forward [ppm]", "feedback_ppm": "feedback [ppm]", "output_ug": "output [µg]"}


def _temperature(results: Mapping) -> list[Block]:
    found = results.get("temperature")
    if not found:
        return []
    of = {"room": "In a room", "far": f"After a change of {found['large_change_c']:g} °C"}
    floor = ("no change of temperature", *(fixed(found["floor"][error], 1) for error in ERRORS))
    rows = {
        k: [*((words, *(with_interval(found[k][arm][e], 1) for e in ERRORS)) for arm, words in ARMS.items()), floor]
        for k in of
    }
    low, high = found["chamber_c"]
    per_c = [fixed(found["ppm_per_c"][key], 1) for key in ("gain", "current_step", "output")]
    left = [with_interval(found["far"]["tests_and_output"][f"{error}_ratio"], 4) for error in ERRORS]
    text = (
        f"Each unit's own tests at {found['temperatures']} temperatures from {low:g} to {high:g} °C give a coefficient "
        "of each reading; later readings are put back to the temperature of the reference by what the unit's "
        f"thermometer says. After a change of {found['large_change_c']:g} °C the errors are then {joined(left)} of "
        "what they were (forward, feedback, output). To put back the tests alone does not help the output: as "
        "measured, the current test also takes out what temperature did to k_VI k_DA, and the magnet is in neither. A "
        f"degree between thermometer and parts brings back {joined(per_c)} ppm (RMS over units)."
    )
    note = (
        "RMS over units of estimate less injected drift, and of N_out(1) − N_out(0), with 95 % intervals over units; "
        "the same tests in every line. Room: six repetitions. Our parts have constant coefficients and one temperature."
    )
    tables = [
        block
        for k, words in of.items()
        for block in table(f"{words}: errors", ("", *ERRORS.values()), rows[k], note if k == "far" else "")
    ]
    return [*paragraphs(text), *tables]


def _attraction(results: Mapping) -> list[Block]:
    found = results.get("attraction")
    if not found:
        return []
    rows = [
        (
            name,
            fixed(found["stiffness_ppm"][name], 1),
            with_interval(found["gain_ppm"].get(name, {"value": 0.0}), 1),
            fixed(found["added_scatter_ppm"][name], 2),
            fixed(found["scatter_ppm"][name], 1),
        )
        for name in found["stiffness_ppm"]
    ]
    text = (
        "The carrier lies across both capacitors in series, and the plate is their middle. If nothing loads the plate, "
        "both carry the same charge and draw alike wherever it is. A capacitance to the middle of the bridge makes the "
        "nearer side draw more, F = C0 V²/(4d) s(2 + s)u/(2 + s(1 − u²))², s over C0: a negative stiffness. Plates of "
        f"{fixed(found['area_mm2'], 0)} mm² held at the middle are pulled in by a carrier of "
        f"{fixed(found['pull_in_v'], 1)} V from there, and by {fixed(found['excited_v'], 1)} V from the largest "
        f"excitation; ours has {fixed(found['carrier_v'], 2)} V. A drift of 200 ppm of it changes the excited gain by "
        f"{fixed(abs(found['drift_ppm']), 2)} ppm. At 0 g a plate on its stop would be held there across less than "
        f"{fixed(found['latching_um'], 2)} µm, {fixed(found['scanned_um'], 2)} at the top of the scan."
    )
    header = ("load on the plate", "softer by [ppm of D]", "gain larger by [ppm]", "adds to scatter [ppm]",
              "scatter [ppm]")  # fmt: skip
    note = "Twelve excitations by eq. (23) with the same noise; mean and its 95 % interval. The scatter is the bias's."
    return [*paragraphs(text), *table("The rejected test with attraction", header, rows, note)]


FLOWN = {
    "rms_ug": ("loop less steady state, RMS of 10 ms [µg]", 2),
    "rest_ug": ("of this not in its transfer function, RMS [µg]", 2),
    "mean_ug": ("mean over the stretch [µg]", 3),
    "delay_us": ("fitted delay [µs]", 1),
    "largest_mm_s": ("largest error of velocity on the way [mm/s]", 3),
    "end_mm_s": ("error of velocity at the end [mm/s]", 4),
    "noise_ug": ("noise of the loop, RMS of 10 ms [µg]", 2),
    "noise_mm_s": ("error of velocity at the end by noise [mm/s]", 4),
}


def _in_flight(results: Mapping) -> list[Block]:
    found = results.get("in_flight")
    if not found:
        return []
    flights = {"flight": "climb, cruise, landing", "wing rock": "with wing rock"}
    rows = [(words, *(with_interval(found[f][key], digits) for f in flights)) for key, (words, digits) in FLOWN.items()]
    calm, rock = (found[name] for name in flights)
    text = (
        "Flights are simulated with the steady state of the loop. Sample by sample, over the "
        f"{found['duration_s']:g} s in which the specific force changes most, the steady state stands for the loop to "
        f"{fixed(calm['rms_ug']['value'], 1)} µg RMS and {fixed(calm['largest_mm_s']['value'], 2)} mm/s, with wing "
        f"rock to {fixed(rock['rms_ug']['value'], 1)} µg and {fixed(rock['largest_mm_s']['value'], 2)} mm/s. By its "
        f"transfer function the loop is {fixed(found['delay_us'], 1)} µs late; the velocity is off by that times the "
        "change of specific force, which does not add up. At the frequency of the wing rock its gain is larger by "
        f"{fixed(rock['rock_ppm'], 0)} ppm."
    )
    note = "; ".join(
        f"{words}: from {fixed(found[f]['from_s'], 1)} s, {found[f]['axis']} axis, which changes by "
        f"{fixed(found[f]['change_g'], 2)} g"
        for f, words in flights.items()
    )
    note += ". Means over four realisations of the loop's noise and their 95 % intervals; noise is taken out by the "
    note += "same loop at constant specific force with the same random numbers."
    return [*paragraphs(text), *table("The loop beside its steady state", ("quantity", *flights.values()), rows, note)]


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
        "these tables, so that the means agree shows nothing; the 24 µg follow from the rest (B21). Its output changes "
        f"by {fixed(outputs['uncompensated'], 0)} µg, and by +{fixed(outputs['compensated'], 0)} after compensation; "
        "Paper B: 193 and 24."
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
        "From the sampled loop with its delay. An overshoot without a prefilter is that of a PI controller. It takes "
        f"{number(margins['degree_percent'], 2)} % of forward gain to change the phase margin by a degree."
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
    "Ours: temperature taken out": _temperature,
    "Ours: electrostatic attraction": _attraction,
    "Ours: the loop in flight": _in_flight,
    "Ours: the identified unit": _identified,
    "Ours: stability": _stability,
    "Ours: values of the loop": _parameters,
}
