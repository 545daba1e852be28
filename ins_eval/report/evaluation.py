"""The evaluation of a real recording in words, with the same machinery as the flight report."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ins_eval.analysis.evaluation_numbers import (
    LOST_MPS,
    EvaluationNumbers,
    FoundStart,
    NavigatedSpan,
    RecordingFacts,
    SolutionNumbers,
    StartAttitude,
)
from ins_eval.analysis.schuler import SCHULER_PERIOD_S
from ins_eval.believed import NOT_STATED
from ins_eval.figures.style import in_order, label
from ins_eval.navigation import Measures
from ins_eval.report.belief import belief_section
from ins_eval.report.content import Block, Picture, Section, paragraphs, table
from ins_eval.report.evaluation_glance import evaluation_glance, solution_glance
from ins_eval.report.grade import grade_section
from ins_eval.report.solution import solution_answer, solution_blocks
from ins_eval.restarts import Restarts
from ins_eval.vocabulary import COMPONENTS, MAIN_DEFINITIONS, definition_name
from ins_eval.wording import MISSING, fixed, in_three, joined, sentence, significant, small

SOLUTION = "What the INS put out itself"
AXES = ("north", "east", "down")
SPOKEN_ONE_BY_ONE = 2  # compensations; of more, the first line names the best and the worst
SPOKEN_TIMES_S = (10.0,)
RESTART_TIMES_S = (1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0)
SCATTER = 1.5  # of the fixes beyond their sigmas that is mentioned
SIGMAS = 3.0  # a heading farther than this from the documented one, in its own sigma, is mentioned
REFERENCE_WORDS = {
    "standstill": "the known standstill: velocity zero, position that of the start",
    "gps": "GPS",
    "ins": "a better INS",
    "attitude": "a reference of attitude alone",
}
ATTITUDE_NOTE = (
    "Attitude navigated against that of the reference, about north, east and down (heading). How the reference is "
    "mounted beside the IMU is in it, less what is believed of that."
)


def evaluation_content(found: EvaluationNumbers) -> tuple[str, list[Section]]:
    """The answer and the sections of the evaluation of one recording."""
    sections = [
        evaluation_glance(found),
        belief_section(found.belief),
        Section("Result", _result(found)),
        grade_section(found.grade),
        Section("Between fixes", _restarts(found)),
        Section(SOLUTION, [] if found.solution is None else solution_blocks(found.solution)),
        Section("Alignment", _alignment(found.alignment)),
        _recording(found.recording),
    ]
    return _answer(found), [section for section in sections if section.blocks]


def solution_content(recording: RecordingFacts, solution: SolutionNumbers) -> tuple[str, list[Section]]:
    """The answer and the sections of a recording that holds the solution of an INS alone."""
    sections = [solution_glance(solution), Section(SOLUTION, solution_blocks(solution)), _recording(recording)]
    return f"{recording.name}: {solution_answer(solution)}", sections


def _arms(found: EvaluationNumbers) -> dict[str, Measures]:
    return {name: found.compensations[name] for name in in_order(found.compensations)}


def _called(name: str) -> str:
    return "without compensation" if name == "none" else f"with {label(name)} compensation"


def _answer(found: EvaluationNumbers) -> str:
    arms, name, span = _arms(found), found.recording.name, f"over {_span(found)}"
    velocities = {arm: rms for arm, one in arms.items() if (rms := one.velocity_rms_mps.get("horizontal"))}
    solution = "" if found.solution is None else solution_answer(found.solution)
    if not velocities:
        attitude = "; ".join(f"{_called(arm)} {said}" for arm, one in arms.items() if (said := _turned(one)))
        said = f": {attitude}, {span}" if attitude else ""
        lines = [f"{name} was navigated, and what it is compared with has no velocity{said}.", solution]
        return "\n".join(lines).strip()
    if len(velocities) <= SPOKEN_ONE_BY_ONE:
        whole = f"{'; '.join(f'{_called(arm)} {_spoken(arms[arm])}' for arm in velocities)}, {span}."
    else:
        best, worst = min(velocities, key=velocities.get), max(velocities, key=velocities.get)
        whole = (
            f"of {len(velocities)} compensations “{label(best)}” is the best in horizontal velocity, {span}; "
            f"{_called(best)} {_spoken(arms[best])}, {_called(worst)} it is {fixed(velocities[worst])} m/s."
        )
    if isinstance(found.alignment, FoundStart):
        taken_off = "the gyro and accelerometer biases estimated at the start (see Alignment) are taken off throughout"
        whole = f"{whole.removesuffix('.')}; {taken_off}."
    growth = _growth(found.restarts)
    if min(velocities.values()) <= LOST_MPS:
        lines = [f"{name}: {whole}", *([sentence(growth)] if growth else [])]
    elif growth:
        lines = [f"{name}: {growth}", f"Left alone for longer it is lost: {whole}"]
    else:
        lines = [f"{name} drifts too fast to be left alone for so long: {whole}"]
    lines.append(_heading(found.alignment))
    lines.append("This is one run: a single radial error rate, not a CEP." + _short(found.navigation))
    lines += [solution] if solution else []
    return "\n".join(lines)


def _spoken(one: Measures) -> str:
    rate = one.radial_error_rate_nmi_per_h.get("final")
    numbers = [f"horizontal velocity RMS is {fixed(one.velocity_rms_mps['horizontal'])} m/s"]
    numbers += [f"the radial error rate (final) {fixed(rate)} nmi/h"] if rate is not None else []
    return joined(numbers)


def _turned(one: Measures) -> str:
    rms = one.attitude_rms_deg
    if not rms:
        return ""
    return f"attitude RMS is {joined([f'{fixed(rms[axis])}° about {axis}' for axis in AXES])}"


def _growth(pieces: Mapping[str, Restarts]) -> str:
    """How far the best compensation can be trusted between fixes."""
    if not pieces:
        return ""
    best = min(pieces, key=lambda name: pieces[name].position_rms_m[-1])
    after_s = pieces[best].after_s
    at = [k for k, t in enumerate(after_s) if t in SPOKEN_TIMES_S or k == len(after_s) - 1]
    grown = joined([f"{_metres(pieces[best], k)} after {fixed(after_s[k], 0)} s" for k in at])
    return f"started afresh from a fix, {_called(best)}, it is off by {grown} (RMS over {pieces[best].count} starts)."


def _metres(piece: Restarts, k: int) -> str:
    """The position error at one time since the start, with its interval where there is one."""
    text, interval = f"{in_three(piece.position_rms_m[k], 0)} m", piece.position_interval_m[:, k]
    if not _known(interval):
        return text
    return f"{text} (95 % interval {in_three(interval[0], 0)} to {in_three(interval[1], 0)} m)"


def _short(navigation: NavigatedSpan) -> str:
    """What a run shorter than one Schuler period cannot show."""
    if navigation.duration_s >= SCHULER_PERIOD_S:
        return ""
    return (
        f" It lasts {fixed(100.0 * navigation.duration_s / SCHULER_PERIOD_S, 0)} % of a Schuler period (84.4 min), so "
        "the rate says nothing about hours of navigation."
    )


def _span(found: EvaluationNumbers) -> str:
    return f"{found.navigation.duration_s:.0f} s of pure-inertial navigation"


def _heading(start: StartAttitude) -> str:
    """Heading found, its uncertainty, and how far it is from the documented one."""
    found, sigma = start.heading_deg, start.heading_sigma_deg
    if sigma is None:
        return f"Heading at the start, as the recording gives it: {fixed(found)}°."
    if isinstance(start, FoundStart) and not start.heading_known:
        return (
            "The heading is unknown: these gyros do not find north, and no motion shows it. It is taken as "
            f"{fixed(found, 0)}°, so that north and east of this page are directions of the box."
        )
    how = "motion and rest" if isinstance(start, FoundStart) else "self-alignment"
    text = f"Heading from {how}: {fixed(found)}° ± {fixed(sigma)}° (1 σ)"
    documented = start.documented_heading_deg
    if documented is None:
        return text + "; none is documented to compare with."
    off = (found - documented + 180.0) % 360.0 - 180.0
    text += f", {fixed(abs(off))}° from the documented {fixed(documented)}°"
    return text + f", {'within' if abs(off) <= SIGMAS * sigma else 'more than'} {SIGMAS:.0f} σ."


def _result(found: EvaluationNumbers) -> list[Block]:
    arms, floor = _arms(found), found.floor
    what = (
        "the same navigation"
        if floor.profile == "standstill"
        else f"as much of the flight '{floor.profile}' at this rate"
    )
    note = (
        f"Window: {_span(found)}. Numeric floor, {what} without sensor errors: {small(floor.horizontal_m, 'm')} in "
        "position."
    )
    velocity = {f"{c} [m/s]": [one.velocity_rms_mps.get(c) for one in arms.values()] for c in COMPONENTS}
    radial = {
        f"{definition_name(d)} [nmi/h]": [one.radial_error_rate_nmi_per_h.get(d) for one in arms.values()]
        for d in MAIN_DEFINITIONS
    }
    last = {"at the end [m]": [one.final_radial_error_m for one in arms.values()]}
    attitude = {f"{axis} [°]": [one.attitude_rms_deg.get(axis) for one in arms.values()] for axis in AXES}
    return [
        *paragraphs(_against(found)),
        *_by_compensation("Velocity RMS", arms, _cells(velocity, 3), note),
        *_by_compensation(
            "Radial error and its rate", arms, _cells(radial, 2) | _cells(last, 0), "A rate of one run is not a CEP."
        ),
        *_by_compensation("Attitude error, RMS", arms, _cells(attitude, 3), ATTITUDE_NOTE),
        Picture("attitude_error", "Attitude error about north, east and down, which is that of heading."),
        Picture("east_velocity_error", "East velocity error. A wave of 84.4 min is the Schuler oscillation."),
        Picture("north_velocity_error", "North velocity error."),
        Picture("latitude_error", "Latitude error."),
        Picture("longitude_error", "Longitude error."),
        Picture("position_error", "Horizontal distance from the reference."),
        Picture("ground_track", "Where the INS believes it went beside the reference, and its error over ground."),
    ]


def _cells(columns: Mapping[str, Sequence[float | None]], digits: int) -> dict[str, list[str]]:
    return {head: [fixed(value, digits) for value in values] for head, values in columns.items()}


def _by_compensation(title: str, arms: Iterable[str], columns: Mapping[str, Sequence[str]], note: str) -> list[Block]:
    """A row for each compensation; a measure that none of them has is left out."""
    kept = {head: cells for head, cells in columns.items() if set(cells) != {MISSING}}
    rows = [(label(name), *cells) for name, *cells in zip(arms, *kept.values(), strict=True)]
    return table(title, ("compensation", *kept), rows, note) if kept else []


def _with_interval(value: float, interval: np.ndarray, digits: int) -> str:
    """A value with its 95 % interval, where there is one."""
    text = in_three(value, digits)
    return text + (f" ({in_three(interval[0], digits)} to {in_three(interval[1], digits)})" if _known(interval) else "")


def _known(interval: np.ndarray) -> bool:
    return bool(np.isfinite(interval).all())


def _restarts(found: EvaluationNumbers) -> list[Block]:
    """How far the instrument can be trusted by itself: errors against the time since a start afresh."""
    if not found.restarts:
        return []
    pieces = {name: found.restarts[name] for name in in_order(found.restarts)}
    first = next(iter(pieces.values()))
    columns = {}
    for name, piece in pieces.items():
        columns[f"{label(name)}: position [m]"] = piece.position_rms_m, piece.position_interval_m, 1
        if all(one.has_velocity for one in pieces.values()):
            columns[f"{label(name)}: velocity [m/s]"] = piece.velocity_rms_mps, piece.velocity_interval_mps, 2
    rows = [
        (
            fixed(first.after_s[k], 0),
            *(_with_interval(rms[k], interval[:, k], digits) for rms, interval, digits in columns.values()),
        )
        for k, t in enumerate(first.after_s)
        if t in RESTART_TIMES_S or k == len(first.after_s) - 1
    ]
    return [
        *paragraphs(
            f"Navigated afresh {first.count} times, each time from a fix and the attitude that the reference "
            "has then, or, without one, from the state that all fixes before give. This is how far the instrument can "
            "be trusted by itself."
        ),
        *table(
            "Growth of the horizontal error",
            ["time since the start afresh [s]", *columns],
            rows,
            "RMS over the pieces, in brackets its 95 % interval by a bootstrap over them, where they are five or more. "
            "Errors are relative to the fix each piece started from, whose noise is in them twice.",
        ),
        Picture("error_growth", "The same against time."),
    ]


def _against(found: EvaluationNumbers) -> str:
    reference = found.reference
    text = f"Measured against {REFERENCE_WORDS[reference.kind]}"
    if reference.epochs:
        text += f"; {reference.epochs} epochs"
    if reference.attitude_epochs:
        text += f"; {reference.attitude_epochs} epochs of attitude"
    if outages := reference.outages:
        text += f", {outages} outage{'s' if outages > 1 else ''}, whose epochs count in no RMS"
    return f"{text}. The vertical channel is {found.navigation.vertical}."


def _alignment(start: StartAttitude) -> list[Block]:
    where = ""
    if start.stretch_s is not None:
        begin_s, end_s = start.stretch_s
        where = f"Aligned on {begin_s:.0f} to {end_s:.0f} s of the recording, the quiet stretch that the rule found."
    elif isinstance(start, FoundStart):
        where = _found_start(start)
    angles = {
        "heading [°]": start.heading_deg,
        "heading, 1 σ [°]": start.heading_sigma_deg,
        "heading, documented [°]": start.documented_heading_deg,
        "roll [°]": start.roll_deg,
        "pitch [°]": start.pitch_deg,
    }
    rows = [(name, fixed(angle, 3)) for name, angle in angles.items() if angle is not None]
    if isinstance(start, FoundStart) and not start.heading_known:
        rows = [("heading, taken as [°]", fixed(start.heading_deg, 0)), *rows[2:]]
    return [
        *paragraphs(where, _heading(start)),
        *table("Attitude at the end of the alignment", ("angle", "value"), rows),
        Picture(
            "activity",
            "Standard deviation of specific force and angular rate in windows of a second; the shaded stretch was used "
            "for the alignment.",
        ),
        Picture(
            "attitude",
            "Roll, pitch and heading while navigating. Of a parked vehicle a slow drift is the gyros'; a step is "
            "somebody moving it.",
        ),
    ]


def _found_start(start: FoundStart) -> str:
    """How a start was found that the recording does not state."""

    def triad(values: Sequence[float], sigmas: Sequence[float]) -> str:
        pairs = zip(values, sigmas, strict=True)
        return ", ".join(f"{fixed(value, 0)} ± {significant(sigma, 2)}" for value, sigma in pairs)

    heading = f"heading to {fixed(start.heading_sigma_deg)}°" if start.heading_known else "heading not known"
    gyro_bias = triad(start.gyro_bias_deg_per_h, start.gyro_bias_sigma_deg_per_h)
    accelerometer_bias = triad(start.accelerometer_bias_ug, start.accelerometer_bias_sigma_ug)
    gyro_scale = triad(start.gyro_scale_ppm, start.gyro_scale_sigma_ppm)
    accelerometer_scale = triad(start.accelerometer_scale_ppm, start.accelerometer_scale_sigma_ppm)
    text = (
        f"The recording states no attitude. It was found from {start.window_s[0]:.0f} to {start.window_s[1]:.0f} s by "
        f"least squares, from rest, motion and the fixes: roll and pitch to {fixed(start.roll_pitch_sigma_deg)}°, "
        f"{heading}, velocity to {fixed(max(start.velocity_sigma_mps))} m/s (1 σ). "
        f"Taken off are gyro biases of {gyro_bias} deg/h and accelerometer biases of {accelerometer_bias} µg, scale "
        f"factor errors of {gyro_scale} ppm (gyros) and {accelerometer_scale} ppm (accelerometers) (x, y, z, with "
        "1 σ)."
    )
    if rivals := start.rival_headings_deg:
        text += f" As likely are headings of {', '.join(fixed(one, 0) for one in rivals)}°."
    position, velocity = start.fix_scale
    if max(position, velocity) > SCATTER:
        text += (
            f" The fixes scatter {fixed(position, 1)} (position) and {fixed(velocity, 1)} (velocity) times as much as "
            "their stated sigmas: a clock offset, a lever arm or the receiver; the sigmas above allow for it."
        )
    return text


def _recording(recording: RecordingFacts) -> Section:
    facts = [f"kind {recording.kind}"]
    facts += [] if recording.rate_hz is None else [f"rate {recording.rate_hz:g} Hz"]
    facts.append(f"length {recording.duration_s:g} s")
    if filled := recording.filled_samples:
        facts.append(f"{filled} increments that rest on samples on straight lines, which were not recorded")
    notes = [note for note in recording.notes if not note.startswith(NOT_STATED)]  # a table has those
    blocks = [
        *paragraphs(sentence(", ".join(facts)), *map(sentence, notes)),
        Picture("flight_path", "Path over ground and height, from the reference."),
        Picture("temperature_and_rate", "Temperature of the IMU as read, and the rate that every compensation uses."),
    ]
    return Section("The recording", blocks)
