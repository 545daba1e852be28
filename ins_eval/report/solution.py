"""What an INS put out itself, in words: its errors, the offset of its clock, and what would make their curve."""

from __future__ import annotations

from collections.abc import Mapping

from ins_eval.figures.style import in_symbols
from ins_eval.report.content import Block, Picture, paragraphs, table
from ins_eval.tables import pick
from ins_eval.vocabulary import COMPONENTS, MAIN_DEFINITIONS, definition_name
from ins_eval.wording import fixed, joined, sentence, with_interval

SCHULER_PERIOD_S = 84.4 * 60.0
AGAINST = {"ins": "a better INS", "gps": "GPS", "standstill": "the known standstill"}
DIGITS = {"m/s": 3, "arcsec": 0, "ug": 0, "deg/h": 3}
SPOKEN = {
    "velocity": "start velocity {}",
    "tilt": "start tilt about {}",
    "heading": "start heading",
    "accelerometer": "accelerometer {} bias",
    "gyro": "gyro {} drift",
}


def error_name(key: str) -> str:
    """An error of the start or of a sensor as a reader sees it: ``gyro_north`` is ``gyro north drift``."""
    kind, _, axis = key.partition("_")
    return SPOKEN[kind].format(axis)


def solution_answer(solution: Mapping) -> str:
    """What the INS put out, in a sentence or two."""
    name = solution.get("name") or "The INS's own solution"
    against = AGAINST[solution["reference"]]
    parts = []
    if means := solution.get("velocity_mean_mps"):
        spoken = joined([f"{fixed(means[axis]['value'])} m/s {axis}" for axis in ("north", "east")])
        rms = with_interval(solution["velocity_rms_mps"]["horizontal"])
        parts.append(f"velocity is off by {spoken} in the mean, horizontal velocity RMS {rms} m/s")
    else:
        parts.append("no velocity")
    if rate := pick(solution, "radial_error_rate_nmi_per_h", "final"):
        parts.append(f"the radial error rate (final) is {fixed(rate)} nmi/h")
    return f"{name} against {against} over {_span_s(solution):.0f} s: {'; '.join(parts)}.\n" + _rate_words(solution)


def solution_blocks(solution: Mapping) -> list[Block]:
    """Tables, sentences and figures of the section on the solution."""
    rows = []
    for axis in COMPONENTS:
        if (rms := pick(solution, "velocity_rms_mps", axis)) is not None:
            rows.append((axis, with_interval(rms, 3), with_interval(pick(solution, "velocity_mean_mps", axis), 3)))
    rates = solution.get("radial_error_rate_nmi_per_h") or {}
    return [
        *paragraphs(
            f"What the INS put out itself, against {AGAINST[solution['reference']]}; {solution['epochs']} epochs.",
            *solution.get("notes", ()),
        ),
        *table(
            "Velocity error",
            ("component", "RMS [m/s]", "mean [m/s]"),
            rows,
            "95 % intervals allow for the correlation of the error in time; none where too few epochs are independent.",
        ),
        *table(
            "Radial error rate",
            ("definition", "[nmi/h]"),
            [(definition_name(key), fixed(rates[key])) for key in MAIN_DEFINITIONS if key in rates],
            "A rate of one run is not a CEP.",
        ),
        *paragraphs(_clock_words(solution), _rate_words(solution)),
        *_schuler(solution),
        Picture("solution_north_velocity_error", "North velocity error, and the fit of start and sensor errors."),
        Picture("solution_east_velocity_error", "East velocity error, likewise."),
        Picture("solution_position_error", "Horizontal distance of the solution from what it is compared with."),
    ]


def _span_s(solution: Mapping) -> float:
    return solution["end_s"] - solution["start_s"]


def _rate_words(solution: Mapping) -> str:
    """Why there is no rate, or that a rate is no CEP."""
    share = 100.0 * _span_s(solution) / SCHULER_PERIOD_S
    if "radial_error_rate_nmi_per_h" in solution:
        return "This is one run: a single radial error rate, not a CEP."
    if share < 50.0:
        return (
            f"It covers {fixed(share, 0)} % of a Schuler period (84.4 min), less than half of one: no radial error "
            "rate and no CEP follow from it."
        )
    return "Positions are missing: no radial error rate and no CEP follow."


def _clock_words(solution: Mapping) -> str:
    clock = solution["clock"]
    whose = {"gps": "GPS"}.get(solution["reference"], "the reference")
    if clock["found_s"] is None:
        return f"Offset of the clocks of {whose} and solution: not found, {clock['reason']}."
    found, (low, high) = 1e3 * clock["found_s"], (1e3 * x for x in clock["interval95_s"])
    text = (
        f"Stamps of {whose} are {fixed(found, 0)} ms [{fixed(low, 0)}, {fixed(high, 0)}] later than those of the "
        f"solution at the same instant, from how the velocity error follows the acceleration; "
        f"{fixed(1e3 * clock['believed_s'], 0)} ms was believed and used."
    )
    constant = clock["velocity_constant_mps"]
    return text + " With that offset taken out, velocity is off by " + joined(
        [f"{with_interval(constant[axis], 3)} m/s {axis}" for axis in ("north", "east")]
    ) + "."  # fmt: skip


def _schuler(solution: Mapping) -> list[Block]:
    """Which errors would make this curve, and which of them cannot be told apart."""
    fit = solution["schuler"]
    if "estimates" not in fit:
        return paragraphs(f"Start and sensor errors were not fitted: {fit['reason']}.")
    rows = []
    for name, entry in fit["estimates"].items():
        low, high = entry["interval95"] or (None, None)
        told = low is not None and not low <= 0.0 <= high
        unit = in_symbols(entry["unit"])
        rows.append((error_name(name), with_interval(entry, DIGITS[entry["unit"]]), unit, "yes" if told else "no"))
    share = 100.0 * fit["span_s"] / SCHULER_PERIOD_S
    return [
        *table(
            "Start and sensor errors that would make this curve",
            ("error", "value", "unit", "differs from 0"),
            rows,
            f"Least squares over {fit['span_s']:.0f} s, {fixed(share, 0)} % of a Schuler period; "
            f"{fixed(100.0 * fit['explained'], 0)} % of the mean square is explained. What the offset of the clocks "
            "makes is taken out first. Values hold if nothing but constant errors acts. Axes x, y, z are forward, "
            "right, down.",
            align="lrll",
        ),
        *paragraphs(
            *(
                sentence(
                    f"{joined([error_name(one) for one in group])} make the same curve and cannot be told apart: each "
                    "stands there as if it made all of it"
                )
                for group in fit["alike"]
            ),
            *(
                sentence(f"over this span only combinations of {joined([error_name(one) for one in group])} are known")
                for group in fit["inseparable"]
            ),
        ),
    ]
