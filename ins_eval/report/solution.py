"""What an INS put out itself, in words: its errors, the offset of its clock, and what would make their curve."""

from __future__ import annotations

from ins_eval.analysis.evaluation_numbers import SolutionNumbers, Untold
from ins_eval.analysis.schuler import SCHULER_PERIOD_S, unit_of
from ins_eval.report.content import Block, Picture, paragraphs, table
from ins_eval.vocabulary import COMPONENTS, MAIN_DEFINITIONS, definition_name
from ins_eval.wording import fixed, joined, sentence, with_interval

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


def solution_answer(solution: SolutionNumbers) -> str:
    """What the INS put out, in a sentence or two."""
    name = solution.name or "The INS's own solution"
    against = AGAINST[solution.reference]
    parts = []
    if means := solution.velocity_mean_mps:
        spoken = joined([f"{fixed(means[axis].value)} m/s {axis}" for axis in ("north", "east")])
        rms = with_interval(solution.velocity_rms_mps["horizontal"])
        parts.append(f"velocity is off by {spoken} in the mean, horizontal velocity RMS {rms} m/s")
    else:
        parts.append("no velocity")
    if rate := solution.radial_error_rate_nmi_per_h.get("final"):
        parts.append(f"the radial error rate (final) is {fixed(rate)} nmi/h")
    return f"{name} against {against} over {solution.span_s:.0f} s: {'; '.join(parts)}.\n" + _rate_words(solution)


def solution_blocks(solution: SolutionNumbers) -> list[Block]:
    """Tables, sentences and figures of the section on the solution."""
    rms, means = solution.velocity_rms_mps, solution.velocity_mean_mps
    rows = [
        (axis, with_interval(rms[axis], 3), with_interval(means.get(axis), 3)) for axis in COMPONENTS if axis in rms
    ]
    rates = solution.radial_error_rate_nmi_per_h
    return [
        *paragraphs(
            f"What the INS put out itself, against {AGAINST[solution.reference]}; {solution.epochs} epochs.",
            *solution.notes,
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


def _rate_words(solution: SolutionNumbers) -> str:
    """Why there is no rate, or that a rate is no CEP."""
    share = 100.0 * solution.span_s / SCHULER_PERIOD_S
    if solution.radial_error_rate_nmi_per_h:
        return "This is one run: a single radial error rate, not a CEP."
    if share < 50.0:
        return (
            f"It covers {fixed(share, 0)} % of a Schuler period (84.4 min), less than half of one: no radial error "
            "rate and no CEP follow from it."
        )
    return "Positions are missing: no radial error rate and no CEP follow."


def _clock_words(solution: SolutionNumbers) -> str:
    clock = solution.clock
    whose = {"gps": "GPS"}.get(solution.reference, "the reference")
    if clock.found_s is None:
        return f"Offset of the clocks of {whose} and solution: not found, {clock.reason}."
    found, (low, high) = 1e3 * clock.found_s, (1e3 * x for x in clock.interval95_s)
    text = (
        f"Stamps of {whose} are {fixed(found, 0)} ms [{fixed(low, 0)}, {fixed(high, 0)}] later than those of the "
        f"solution at the same instant, from how the velocity error follows the acceleration; "
        f"{fixed(1e3 * clock.believed_s, 0)} ms was believed and used."
    )
    constant = clock.velocity_constant_mps
    return text + " With that offset taken out, velocity is off by " + joined(
        [f"{with_interval(constant[axis], 3)} m/s {axis}" for axis in ("north", "east")]
    ) + "."  # fmt: skip


def _schuler(solution: SolutionNumbers) -> list[Block]:
    """Which errors would make this curve, and which of them cannot be separated."""
    fit = solution.schuler
    if isinstance(fit, Untold):
        return paragraphs(f"Start and sensor errors were not fitted: {fit.reason}.")
    rows = []
    for name, one in fit.estimates.items():
        told, unit = one.known and not one.low <= 0.0 <= one.high, unit_of(name)
        rows.append((error_name(name), with_interval(one, DIGITS[unit]), unit, "yes" if told else "no"))
    share = 100.0 * fit.span_s / SCHULER_PERIOD_S
    return [
        *table(
            "Start and sensor errors that would make this curve",
            ("error", "value", "unit", "differs from 0"),
            rows,
            f"Least squares over {fit.span_s:.0f} s, {fixed(share, 0)} % of a Schuler period; "
            f"{fixed(100.0 * fit.explained, 0)} % of the mean square is explained. What the offset of the clocks "
            "makes is taken out first. Values hold if nothing but constant errors acts. Axes x, y, z are forward, "
            "right, down.",
            align="lrll",
        ),
        *paragraphs(
            *(
                sentence(
                    f"{joined([error_name(one) for one in group])} make the same curve and cannot be separated: each "
                    "stands there as if it made all of it"
                )
                for group in fit.alike
            ),
            *(
                sentence(f"over this span only combinations of {joined([error_name(one) for one in group])} are known")
                for group in fit.inseparable
            ),
        ),
    ]
