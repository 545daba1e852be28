"""A calibration in the thermal chamber, in words and tables."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from math import floor, log10

from ins_eval.analysis.calibration_numbers import AccelerometerNumbers, CalibrationNumbers, ChosenModel, NotDetermined
from ins_eval.calibration import Coefficient
from ins_eval.figures.style import label
from ins_eval.report.content import Block, Number, Picture, Section, at_a_glance, paragraphs, table
from ins_eval.wording import MISSING, fixed, joined, sentence

POSITIONS = ("+1", "+0", "-1")
PRINTED = (  # what the paper's equations yield on the two ways to label the angles
    ("Fig. 4", "Fig. 4: 0° is +1 g, 180° is −1 g", ("−K1/2", "K0 − 1/2", "0", "K0")),
    ("turned", "turned by 90°: 90° is +1 g, 270° is −1 g", ("K1/2", "K0 − 1/2", "K1", "K0")),
)
LEFT_OVER_TIME = "What simple and hysteresis compensation leave, over the programme of the chamber."
GREEK = {"alpha": "α", "beta": "β", "eta": "η", "epsilon": "ε", "mu": "μ", "gamma": "γ"}
NEARER = 0.8  # mean rate over commanded rate: below it the dwells have brought the rates together
FEW_RAMPS = 4
PREFIX = "calibration: "  # of sentences that refuse


def calibration_content(found: CalibrationNumbers) -> tuple[str, list[Section]]:
    """The answer and the sections of the calibration of one accelerometer, or of three."""
    units, chosen = found.accelerometers, found.compensation
    sections = [_glance(units, chosen)]
    for unit in units:
        ahead, of = (f"{unit.axis}_", f" of {unit.axis}") if len(units) > 1 else ("", "")
        sections += [
            Section(f"What each model leaves{of}", _models(unit)),
            Section(f"Scale factor{of}", _scale(unit, ahead)),
            Section(f"Bias{of}", _bias(unit, ahead)),
            Section(f"A reading in a new run{of}", _new_run(unit, chosen.model)),
            Section(f"What the readings determine{of}", _determined(unit)),
            Section(f"What they do not determine, and which run would{of}", paragraphs(*_further(unit))),
        ]
    sections.append(Section("Four positions, by specific force", _four_points(units)))
    sections.append(Section("The readings", _recordings(units)))
    answer = "\n".join([*(_in_short(unit, chosen.model) for unit in units), _of_file(chosen, units)]).strip()
    return answer, [section for section in sections if section.blocks]


def _glance(units: Sequence[AccelerometerNumbers], chosen: ChosenModel) -> Section:
    """How far a compensated reading of a new run is off, of each accelerometer; else what the model leaves."""
    numbers, several = [], len(units) > 1
    for unit in units:
        of, model = f", {unit.name}" if several else "", unit.fitted[chosen.model]
        if within := model.new_run_ug:
            for words, most in (("±1 g", max(within["+1"], within["-1"])), ("0 g", within["+0"])):
                value = f"within {fixed(most, 0)} µg"
                numbers.append(Number(f"a compensated reading of a new run at {words}{of}", value, "95 % of readings"))
        else:
            left = f"{fixed(model.bias.residual_rms_ug, 0)} µg"
            numbers.append(Number(f"bias less that of the model, RMS{of}", left, "one ramp, no interval"))
        if (bare := unit.sensitivity_ppm_per_c) is not None:
            after = fixed(model.scale.sensitivity_ppm_per_c, 1)
            sure = f"after {label(chosen.model)} compensation {after} ppm/°C"
            numbers.append(Number(f"scale factor with temperature{of}", f"{fixed(bare, 1)} ppm/°C", sure))
    if several:  # the same number of each axis, side by side
        numbers = numbers[:: len(numbers) // len(units)]
    step = (
        f"ins-eval evaluate DIR --compensation {chosen.file} navigates a recording with this model."
        if chosen.file
        else "--write-model FILE.toml writes the model, for evaluate --compensation and flight-report --model."
    )
    ahead = f"{units[0].axis}_" if several else ""
    return at_a_glance(numbers, Picture(f"{ahead}residual_against_time", LEFT_OVER_TIME), step)


def _in_short(unit: AccelerometerNumbers, chosen: str) -> str:
    parts, fitted = [], unit.fitted
    if (bare := unit.sensitivity_ppm_per_c) is not None:
        after = [
            f"{fixed(left, 1)} after {label(name)} compensation"
            for name in dict.fromkeys(("simple", chosen))
            if name in fitted and (left := fitted[name].scale.sensitivity_ppm_per_c) is not None
        ]
        parts.append(f"the scale factor moves by {', '.join([f'{fixed(bare, 1)} ppm/°C with temperature', *after])}")
    if within := fitted[chosen].new_run_ug:
        most = max(within["+1"], within["-1"])
        parts.append(
            f"with {label(chosen)} compensation 95 % of the readings of a new run are off by no more than "
            f"{fixed(within['+0'], 0)} µg at 0 g and {fixed(most, 0)} µg at ±1 g"
        )
    return sentence(f"{unit.name}: {'; '.join(parts)}")


def _of_file(chosen: ChosenModel, units: Sequence[AccelerometerNumbers]) -> str:
    """Which model the file holds, and why not the one that would be expected."""
    text = ""
    if chosen.asked is None and chosen.model != "hysteresis":
        lacking = [unit.name for unit in units if not unit.determined.hysteresis]
        text = (
            f"The readings of {joined(lacking)} do not determine the hysteresis compensation; the best that they "
            f"determine is {label(chosen.model)}. "
        )
        if all("hysteresis" in unit.fitted for unit in units):
            text += "With --compensation hysteresis it is taken nevertheless. "
    if chosen.file:
        text += (
            f"{chosen.file} holds the {label(chosen.model)} compensation, for evaluate --compensation and "
            "flight-report --model."
        )
    return text


def _models(unit: AccelerometerNumbers) -> list[Block]:
    rows, reasons = [], []
    for name, model in unit.models.items():
        if isinstance(model, NotDetermined):
            reasons.append(f"{label(name)}: {model.reason}")
            continue
        within = model.new_run_ug or {}
        rows.append(
            (
                label(name),
                fixed(model.scale.residual_rms_ppm, 0),
                fixed(model.scale.sensitivity_ppm_per_c, 2),
                fixed(model.bias.residual_rms_ug, 0),
                *(fixed(within.get(position), 0) for position in ("+0", "+1", "-1")),
            )
        )
    header = (
        "compensation",
        "K1 left, RMS [ppm]",
        "K1 left, sensitivity [ppm/°C]",
        "K0 left, RMS [µg]",
        "new run within, 0 g [µg]",
        "+1 g [µg]",
        "−1 g [µg]",
    )
    bare = unit.sensitivity_ppm_per_c
    note = (
        "Sensitivity: largest less smallest mean over a degree of one branch, over mean and span of temperature"
        + (f"; of K1 itself {fixed(bare, 2)} ppm/°C" if bare is not None else "")
        + ". New run: 95 % of compensated readings stay within, as a mean over the programme; each run is a switch-on."
    )
    return [*table("", header, rows, note), *paragraphs(*(sentence(reason) for reason in reasons))]


def _scale(unit: AccelerometerNumbers, ahead: str) -> list[Block]:
    terms = {name: model.scale.terms for name, model in unit.fitted.items()}
    return [
        Picture(
            f"{ahead}scale_against_temperature",
            "K1 against the reading of temperature, falling and rising, with the fits.",
        ),
        *_coefficients(terms, "K1 = α r² + β ΔT² + η r ΔT + ε r + μ ΔT + γ with ΔT = T − 22 °C and its rate r"),
        Picture(f"{ahead}scale_residual", "K1 over the K1 of each model."),
        Picture(f"{ahead}residual_against_time", LEFT_OVER_TIME),
    ]


def _bias(unit: AccelerometerNumbers, ahead: str) -> list[Block]:
    terms = {name: model.bias.terms for name, model in unit.fitted.items()}
    return [
        Picture(f"{ahead}bias_against_temperature", "K0 against the reading of temperature, with the fits."),
        *_coefficients(terms, "K0 = β ΔT² + μ ΔT + γ"),
        *_branches(terms.get("hysteresis", ())),
        Picture(f"{ahead}bias_residual", "K0 less the K0 of each model."),
    ]


def _coefficients(models: Mapping[str, Sequence[Coefficient]], what: str) -> list[Block]:
    """The terms of eq. (11) of each model."""
    rows = [
        (label(name), GREEK[term.name], *with_half_width(term), readable(term.unit))
        for name, terms in models.items()
        for term in terms
        if term.name in GREEK
    ]
    note = f"{what}. Intervals take the readings of one ramp, and of one leg, as belonging together."
    return table("", ("compensation", "coefficient", "value", "± (95 %)", "unit"), rows, note, align="llrrl")


def _branches(terms: Sequence[Coefficient]) -> list[Block]:
    """The falling and the rising bias of the hysteresis model."""
    of_branch = {
        branch: {place: term for term in terms for of, _, place in [term.name.partition(" at ")] if of == branch}
        for branch in ("falling", "rising")
    }
    rows = [
        (readable(place), *with_half_width(falling), *with_half_width(of_branch["rising"][place]))
        for place, falling in of_branch["falling"].items()
    ]
    header = ("temperature", "falling", "± (95 %)", "rising", "± (95 %)")
    return table("Hysteresis compensation: K0 in µg, straight between these temperatures", header, rows, align="rrrrr")


def _new_run(unit: AccelerometerNumbers, chosen: str) -> list[Block]:
    rows = [
        (
            fixed(row.temperature_c, 0),
            row.direction,
            *(" to ".join(fixed(end, 0) for end in row.within_ug[position]) for position in POSITIONS),
        )
        for row in unit.new_run
    ]
    note = (
        "95 % interval of compensated less true specific force in µg, in a run that is still to come: what the model "
        "leaves in the mean of all runs, how runs differ, and the scatter within one."
    )
    header = ("temperature [°C]", "direction", *(f"{position.replace('+0', '0')} g" for position in POSITIONS))
    title = f"Compensation: {label(chosen)}"
    return table(title, [cell.replace("-", "−") for cell in header], rows, note, align="rlrrr")


def _determined(unit: AccelerometerNumbers) -> list[Block]:
    found, models = unit.determined, unit.fitted
    text = (
        f"Rank {found.rank} of {found.terms} for the terms of eq. (11), and {found.steady_rank} of {found.terms} by "
        "the steady legs of the ramps alone. One direction at one rate can give three, both directions at one rate "
        "five, two or more rates six."
    )
    if found.condition is not None:
        text += f" The condition number is {fixed(found.condition, 0)}: the factor by which an error may grow."
    remarks: dict[str, list[str]] = {}
    for name, model in models.items():
        for remark in model.remarks:
            remarks.setdefault(remark, []).append(label(name))
    return paragraphs(
        text,
        *(
            sentence(
                f"{f'{joined(names)}: ' if len(names) < len(models) else ''}{readable(remark.removeprefix(PREFIX))}"
            )
            for remark, names in remarks.items()
        ),
    )


def _further(unit: AccelerometerNumbers) -> list[str]:
    """What these readings do not determine, each with the run that would."""
    found, rates, ramps = unit.determined, unit.determined.mean_rates_c_per_min, unit.recording.ramps_c_per_min
    directions = found.directions
    texts = []
    if len(directions) == 1:
        other = {"falling": "rises", "rising": "falls"}[directions[0]]
        texts.append(
            f"The temperature was only {directions[0]}, so nothing is known of how the accelerometer differs while it "
            f"{other}: that branch of the bias is a copy. Record the way back, in the same run."
        )
    if len(ramps) == 1:
        text = (
            f"One rate ({ramps[0]:g} °C/min) cannot separate alpha from gamma, and one run in each position shows "
            "nothing of how runs differ, so there are no intervals. Add a second rate in all four positions, "
            f"{0.5 * ramps[0]:.2g} or {2.0 * ramps[0]:.2g} °C/min"
        )
        texts.append(f"{text}.")
    elif 1 < len(ramps) < FEW_RAMPS:
        texts.append(
            f"Only {len(ramps)} rates show how runs differ, which makes the intervals wide; each further rate in all "
            "four positions narrows them."
        )
    terms = unit.fitted["hysteresis"].scale.terms if "hysteresis" in unit.fitted else ()
    alpha = next((one.interval95 for one in terms if one.name == "alpha"), None)
    if len(ramps) > 1 and alpha and alpha[0] <= 0.0 <= alpha[1]:
        text = "α cannot be distinguished from 0 here"
        if rates and max(rates) < NEARER * max(ramps):
            text += (
                f": with the dwells the mean rates are {min(rates):.2f} to {max(rates):.2f} °C/min, close together, "
                f"though {min(ramps):g} to {max(ramps):g} were commanded. A run without dwells separates them"
            )
        else:
            text += f": the rates {min(ramps):g} to {max(ramps):g} °C/min are close together. "
            text += "A faster one would show which"
        texts.append(f"{text}.")
    if found.hysteresis:
        texts.append(
            "ε also takes up what follows the direction and not the rate, such as the magnet's hysteresis. A run "
            "several times slower shows which: a loop that stays open does not come from the rate."
        )
    lowest, highest = unit.recording.temperature_c
    texts.append(
        f"Nothing is known below {fixed(lowest, 0)} and above {fixed(highest, 0)} °C or at rates above "
        f"{found.rate_seen_c_per_min:.2f} °C/min: there the terms of the scale factor are an extrapolation, and the "
        "bias keeps the value of its last knot."
    )
    texts.append(
        "Four positions do not show K2, the cross-coupling and the misalignment of the input axis: K2 stays out of K1 "
        "and, thanks to the pair at 0 g, of K0. More positions of the index head would show them."
    )
    return texts


def _four_points(units: Sequence[AccelerometerNumbers]) -> list[Block]:
    text = (
        "K1 = (A(+1 g) − A(−1 g)) / 2 and K0 = (A(0 g) + A'(0 g)) / (2 K1), where A is the output in pulse/s. "
        "Positions are known by the specific force along the input axis, column input_g, never by an angle of the "
        "index head. Paper A prints two pairs of equations with angles, and with the angles of its Fig. 4 three of the "
        "four do not give what they are meant to give; with the head turned by 90° the second pair does."
    )
    rows = []
    for unit in units:
        for key, words, meaning in PRINTED:
            if (printed := unit.printed.get(key)) is not None:
                cells = [
                    f"{fixed(value, digits)} = {equal}"
                    for value, digits, equal in zip(printed, (0, 5, 0, 5), meaning, strict=True)
                ]
                rows.append((f"{unit.name}: {words}" if len(units) > 1 else words, *cells))
    header = ("angles", "eq. (3) [pulse/(g s)]", "eq. (4) [g]", "eq. (13) [pulse/(g s)]", "eq. (14) [g]")
    return [*paragraphs(text), *table("", header, rows, "At the readings nearest to 22 °C.")]


def _recordings(units: Sequence[AccelerometerNumbers]) -> list[Block]:
    rows = []
    for unit in units:
        recording = unit.recording
        ramps = ", ".join(f"{ramp:g}" for ramp in recording.ramps_c_per_min)
        temperature = " to ".join(fixed(end, 1) for end in recording.temperature_c)
        numbers = str(recording.readings), str(recording.runs)
        rows.append((unit.name, unit.axis or MISSING, *numbers, ramps or MISSING, temperature))
    header = ("accelerometer", "axis", "readings", "runs", "ramps [°C/min]", "temperature [°C]")
    return table("", header, rows, align="llrrll")


def with_half_width(term: Coefficient) -> tuple[str, str]:
    """Value and half width of an interval, with two digits that count in the latter; without one, five of the value."""
    value, interval = term.value, term.interval95
    half = 0.0 if interval is None else 0.5 * (interval[1] - interval[0])
    digits = 1 - floor(log10(half)) if half > 0.0 else 4 - floor(log10(abs(value))) if value else 0
    digits = max(digits, 0)
    return fixed(value, digits), MISSING if interval is None else fixed(half, digits)


def readable(text: str) -> str:
    """Negative numbers as a page shows them."""
    return re.sub(r"-(?=\d)", "−", text)
