"""The section of the flight report on ageing: drift of the loop gains, self-calibration, and where either shows."""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot, radians, sin

from ins_eval.analysis.ageing import AGED, AgeingNumbers
from ins_eval.figures.style import label
from ins_eval.metrics import Ratio
from ins_eval.report.content import Block, Paragraph, table
from ins_eval.units import UG
from ins_eval.vocabulary import CEP, FIRST, SECOND, VELOCITY, measure_name
from ins_eval.wording import MISSING, SHORT_VERDICT, at_most, change, fixed, small, verdict, with_interval

STATE_NAME = {"fresh": "fresh", "drifted": "stored", "self_calibrated": "self-calibrated"}
DOWN = "velocity_rms_down"
MOST_MANOEUVRES = 6
STAND_TILT_DEG = 1.0
INVISIBLE = 0.1  # of the velocity RMS: adds 0.5 % in squares
LEFT_OUT = Paragraph(
    "The paper also prints 100 µg of bias a year. No test of the loop sees a bias, and an alignment hides one only "
    "until the course changes; it would outweigh the scale factor, but belongs to no gain and is left out.",
    "Not in it.",
)
ALIKE = 0.05  # of what the drift makes: the largest difference between two alignments that do not matter


def ageing_blocks(ageing: AgeingNumbers) -> list[Block]:
    """What ageing does to the flight."""
    parts = (_gains, _in_flight, _states, _changes, _where, _alignment, _vertical)
    return [*(block for part in parts for block in part(ageing)), LEFT_OUT]


def _gains(ageing: AgeingNumbers) -> list[Block]:
    gains, years = ageing.gains, ageing.years
    text = (
        f"Digital accelerometers (Paper B) after {years:g} year{'' if years == 1.0 else 's'} between calibration and "
        f"flight. The gain of the feedback has drifted by {gains.feedback_ppm:.0f} ppm RMS, and the scale factor "
        f"with it; that of the forward channel by {gains.forward_ppm:.0f} ppm, which moves no output, since the "
        "loop integrates. A self-calibration against the constant current finds the first to "
        f"{gains.estimate_error_ppm:.0f} ppm RMS. It does not see the torquer ({gains.torquer_ppm:.0f} ppm), it "
        f"takes a drift of the current source ({gains.current_ppm:.0f} ppm) for one of the gain, and each degree "
        f"between reference and estimate costs {gains.estimate_error_ppm_per_c:.1f} ppm RMS; here they are "
        f"{gains.warmer_c:.1f} °C apart, as on the paper's bench."
    )
    return [Paragraph(text)]


def _in_flight(ageing: AgeingNumbers) -> list[Block]:
    """How much ageing changes, and how much is to be expected of errors that add in squares."""
    alone, texts = ageing.alone.whole_mps.found, []
    for name, states in ageing.compensations.items():
        ratio, fresh = ageing.change[name]["drifted/fresh"][VELOCITY], states["fresh"][VELOCITY].value
        expected = 100.0 * (hypot(1.0, alone["drifted"] / fresh) - 1.0)
        texts.append(
            f"With {label(name)} compensation storage changes the {measure_name(VELOCITY)} by {change(ratio)}, at most "
            f"{fixed(at_most(ratio), 1)} % either way; added in squares to {fixed(fresh)} m/s it would be "
            f"+{fixed(expected, 2)} %."
        )
    least = min(states["fresh"][VELOCITY].value for states in ageing.compensations.values())
    text = (
        f"The drift by itself makes {_cm(alone['drifted'])} cm/s of horizontal velocity error, "
        f"{_cm(alone['self_calibrated'])} cm/s after self-calibration: "
        f"{'nearly invisible' if alone['drifted'] < INVISIBLE * least else 'not small'} beside the other errors. "
    )
    return [Paragraph(text + " ".join(texts), "In flight.")]


def _states(ageing: AgeingNumbers) -> list[Block]:
    rows = []
    for name, states in ageing.compensations.items():
        for state, estimates in states.items():
            aged = state in AGED
            rows.append(
                (
                    label(name),
                    STATE_NAME[state],
                    fixed(ageing.scale_ppm[state], 0) if aged else MISSING,
                    *(with_interval(estimates[measure], 3) for measure in (VELOCITY, CEP)),
                    fixed(ageing.final_m[name][state], 0) if aged else MISSING,
                )
            )
    return table(
        "The same flights fresh, after storage and after self-calibration",
        (
            "compensation",
            "state",
            "scale factor [ppm RMS]",
            f"{measure_name(VELOCITY)} [m/s]",
            f"{measure_name(CEP)} [nmi/h]",
            "last position [m RMS]",
        ),
        rows,
        f"{ageing.size} instruments, the first of the ensemble above; in brackets the 95 % interval. Scale factor "
        "and last position: by how much they differ from fresh.",
        "llrrrr",
    )


def _changes(ageing: AgeingNumbers) -> list[Block]:
    rows = [
        (label(name), " against ".join(STATE_NAME[state] for state in step.split("/")), *_judged(ratios))
        for name, steps in ageing.change.items()
        for step, ratios in steps.items()
    ]
    rows += [
        (STATE_NAME[state], f"{label(SECOND)} against {label(FIRST)}", *_judged(ratios))
        for state, ratios in ageing.hysteresis.items()
    ]
    return table(
        "What storage, self-calibration and hysteresis compensation change",
        ("with", "new against old", measure_name(VELOCITY), "verdict", measure_name(CEP), "verdict"),
        rows,
        "Paired: both sides have the same instruments, flights and noise. Negative is better.",
        "llrlrl",
    )


def _judged(ratios: Mapping[str, Ratio]) -> list[str]:
    found = [ratios[measure] for measure in (VELOCITY, CEP)]
    return [text for ratio in found for text in (change(ratio), SHORT_VERDICT[verdict(ratio)])]


def _where(ageing: AgeingNumbers) -> list[Block]:
    phases, manoeuvres = ageing.alone.phases, ageing.alone.manoeuvres
    shown = manoeuvres[:MOST_MANOEUVRES]
    rows = [
        (
            entry.name,
            f"{entry.from_s:.0f} to {entry.to_s:.0f}",
            _cm(entry.drifted_mps),
            _cm(entry.self_calibrated_mps),
            *(map(_cm, entry.axes_mps) if entry.axes_mps else [MISSING] * 3),
        )
        for entry in (*phases, *shown)
    ]
    return table(
        "Where a drift of the scale factor shows: horizontal velocity error [cm/s]",
        ("phase or manoeuvre", "time [s]", "stored", "self-calibrated", "100 ppm on x", "on y", "on z"),
        rows,
        "RMS over the instruments, of a flight without any other error. Of a phase: the error in it. Of a manoeuvre: "
        f"what it feeds in; the largest {len(shown)} of {len(manoeuvres)}, and one inside another counts in both. "
        "Climb and descent let x and z feel gravity through the pitch; speeding up and braking are felt along x; a "
        "turn is felt along z, which leans into it. Level flight at constant speed feeds in nothing.",
    )


def _alignment(ageing: AgeingNumbers) -> list[Block]:
    whole, ppm = ageing.alone.whole_mps, ageing.scale_ppm["drifted"]
    found, given, difference = (_cm(of["drifted"], 2) for of in (whole.found, whole.given, whole.difference))
    alike = whole.difference["drifted"] < ALIKE * whole.given["drifted"]
    text = (
        f"The drift by itself makes {found} cm/s with the attitude found on the stand and {given} cm/s with it given, "
        f"never more than {difference} cm/s apart{': the alignment neither hides nor adds it' if alike else ''}. On a "
        f"level stand the horizontal accelerometers feel nothing that could be scaled; on one tilted by "
        f"{STAND_TILT_DEG:g}° they would be wrong by {ppm * sin(radians(STAND_TILT_DEG)):.1f} µg RMS, which an "
        "alignment takes for a tilt."
    )
    return [Paragraph(text, "Alignment.")]


def _vertical(ageing: AgeingNumbers) -> list[Block]:
    vertical = ageing.alone.vertical["drifted"]
    flown = [
        f"{change(steps['drifted/fresh'][DOWN])} with {label(name)} compensation"
        for name, steps in ageing.change.items()
    ]
    text = (
        f"There the drift shows at once, as {vertical.felt_mps2 / UG:.0f} µg RMS of gravity. Damped by baro height "
        f"it stays at {_cm(vertical.down_mps)} cm/s and {small(vertical.height_m, 'm')}; in flight the "
        f"{measure_name(DOWN)} changes by {' and by '.join(flown)}. A free channel would be off by "
        f"{small(vertical.free_height_m, 'm')} after 10 min."
    )
    return [Paragraph(text, "Vertical channel.")]


def _cm(metres: float, digits: int = 1) -> str:
    return fixed(100.0 * metres, digits)
