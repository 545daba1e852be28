"""The evaluation of a real recording in words, with the same machinery as the flight report."""

from __future__ import annotations

from collections.abc import Mapping

from ins_eval.figures.style import in_order, label
from ins_eval.report.belief import belief_section
from ins_eval.report.content import Block, Picture, Section, definitions_table, paragraphs, table
from ins_eval.report.grade import grade_section
from ins_eval.report.solution import solution_answer, solution_blocks
from ins_eval.tables import pick
from ins_eval.vocabulary import COMPONENTS, MAIN_DEFINITIONS, definition_name
from ins_eval.wording import MISSING, fixed, joined, sentence, small

SCHULER_PERIOD_S = 84.4 * 60.0
SPOKEN_ONE_BY_ONE = 2  # compensations; of more, the first line names the best and the worst
SPOKEN_TIMES_S = (10.0,)
HOPELESS_MPS = 100.0  # horizontal velocity RMS beyond which a pure-inertial solution means nothing
RESTART_TIMES_S = (1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0)
SCATTER = 1.5  # of the fixes beyond their sigmas that is worth a word
SIGMAS = 3.0  # a heading farther than this from the documented one, in its own sigma, is worth a word
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


def evaluation_content(metrics: Mapping) -> tuple[str, list[Section]]:
    """The answer and the sections of the evaluation of one recording; what the metrics lack is left out."""
    sections = [
        belief_section(metrics.get("belief")),
        Section("Result", _result(metrics)),
        grade_section(metrics),
        Section("Between fixes", _restarts(metrics)),
        Section("What the INS put out itself", solution_blocks(metrics["solution"]) if "solution" in metrics else []),
        Section("Alignment", _alignment(metrics)),
        Section("The recording", _recording(metrics)),
        Section("Definitions and windows", definitions_table(metrics)),
    ]
    return _answer(metrics), [section for section in sections if section.blocks]


def _arms(metrics: Mapping) -> dict[str, Mapping]:
    tree = metrics.get("compensations") or {}
    return {name: tree[name] for name in in_order(tree)}


def _called(name: str) -> str:
    return "without compensation" if name == "none" else f"with {label(name)} compensation"


def _answer(metrics: Mapping) -> str:
    arms = _arms(metrics)
    name = pick(metrics, "recording", "name") or "this recording"
    velocities = {arm: v for arm, values in arms.items() if (v := pick(values, "velocity_rms_mps", "horizontal"))}
    solution = solution_answer(metrics["solution"]) if "solution" in metrics else ""
    span = f"over {_span(metrics)}"
    if not arms and solution:
        return f"{name}: {solution}"
    if not velocities and arms:
        attitude = "; ".join(f"{_called(arm)} {said}" for arm, values in arms.items() if (said := _turned(values)))
        said = f": {attitude}, {span}" if attitude else ""
        lines = [f"{name} was navigated, and what it is compared with has no velocity{said}.", solution]
        return "\n".join(lines).strip()
    if not velocities:
        return f"{name} was read, but nothing of it was navigated."
    if len(velocities) <= SPOKEN_ONE_BY_ONE:
        results = "; ".join(f"{_called(arm)} {_spoken(arms[arm])}" for arm in velocities)
        lines = [f"{name}: {results}, {span}."]
    else:
        best, worst = min(velocities, key=velocities.get), max(velocities, key=velocities.get)
        lines = [
            f"{name}: of {len(velocities)} compensations {label(best)} is the best in horizontal velocity, {span}; "
            f"{_called(best)} {_spoken(arms[best])}, {_called(worst)} it is {fixed(velocities[worst])} m/s."
        ]
    if growth := _growth(metrics):
        lines.append(growth)
    elif min(velocities.values()) > HOPELESS_MPS:
        lines.append(
            "That is no navigation: the instrument drifts too fast to be left alone for so long. --restart-every 30 "
            "shows how far it can be trusted between fixes."
        )
    if heading := _heading(metrics):
        lines.append(heading)
    lines.append("This is one run: a single radial error rate, not a CEP." + _short(metrics))
    lines += [solution] if solution else []
    return "\n".join(lines)


def _spoken(values: Mapping) -> str:
    rate = pick(values, "radial_error_rate_nmi_per_h", "final")
    numbers = [f"horizontal velocity RMS is {fixed(pick(values, 'velocity_rms_mps', 'horizontal'))} m/s"]
    numbers += [f"the radial error rate (final) {fixed(rate)} nmi/h"] if rate is not None else []
    return joined(numbers)


def _turned(values: Mapping) -> str:
    if (rms := values.get("attitude_rms_deg")) is None:
        return ""
    return f"attitude RMS is {joined([f'{fixed(rms[axis])}° about {axis}' for axis in ('north', 'east', 'down')])}"


def _growth(metrics: Mapping) -> str:
    """How far the best compensation can be trusted between fixes."""
    pieces = metrics.get("restarts") or {}
    if not pieces:
        return ""
    best = min(pieces, key=lambda name: pieces[name]["position_rms_m"][-1])
    after_s, position_m = pieces[best]["after_s"], pieces[best]["position_rms_m"]
    at = [k for k, t in enumerate(after_s) if t in SPOKEN_TIMES_S or k == len(after_s) - 1]
    grown = joined([f"{fixed(position_m[k], 0)} m after {fixed(after_s[k], 0)} s" for k in at])
    return (
        f"Started afresh from a fix, {_called(best)}, it is off by {grown} (RMS over {pieces[best]['count']} starts)."
    )


def _short(metrics: Mapping) -> str:
    """What a run shorter than one Schuler period cannot show."""
    start, end = pick(metrics, "navigation", "start_s"), pick(metrics, "navigation", "end_s")
    if start is None or end is None or end - start >= SCHULER_PERIOD_S:
        return ""
    return (
        f" It lasts {fixed(100.0 * (end - start) / SCHULER_PERIOD_S, 0)} % of a Schuler period (84.4 min), so the "
        "rate says nothing about hours of flight."
    )


def _span(metrics: Mapping) -> str:
    start, end = pick(metrics, "navigation", "start_s"), pick(metrics, "navigation", "end_s")
    if start is None or end is None:
        return "the navigated stretch"
    return f"{end - start:.0f} s of pure-inertial navigation"


def _heading(metrics: Mapping) -> str:
    """Heading found, its uncertainty, and how far it is from the documented one."""
    found, sigma = pick(metrics, "alignment", "heading_deg"), pick(metrics, "alignment", "heading_sigma_deg")
    if found is None:
        return ""
    if pick(metrics, "alignment", "stretch_s") is None and sigma is None:
        return f"Heading at the start, as the recording gives it: {fixed(found)}°."
    if (known := pick(metrics, "alignment", "heading_known")) is False:
        return (
            "The heading is unknown: these gyros do not find north, and no motion shows it. It is taken as "
            f"{fixed(found)}°, so that north and east of this page are directions of the box."
        )
    text = f"Heading from {'self-alignment' if known is None else 'motion and rest'}: {fixed(found)}°"
    if sigma is not None:
        text += f" ± {fixed(sigma)}° (1 σ)"
    documented = pick(metrics, "alignment", "documented_heading_deg")
    if documented is None:
        return text + "; none is documented to compare with."
    off = (found - documented + 180.0) % 360.0 - 180.0
    text += f", {fixed(abs(off))}° from the documented {fixed(documented)}°"
    if sigma:
        text += f", {'within' if abs(off) <= SIGMAS * sigma else 'more than'} {SIGMAS:.0f} σ"
    return text + "."


def _result(metrics: Mapping) -> list[Block]:
    arms = _arms(metrics)
    if not arms:
        return []
    velocity = [(f"{c} [m/s]", ("velocity_rms_mps", c), 3) for c in COMPONENTS]
    radial = [
        *((f"{definition_name(d)} [nmi/h]", ("radial_error_rate_nmi_per_h", d), 2) for d in MAIN_DEFINITIONS),
        ("at the end [m]", ("final_radial_error_m",), 0),
    ]
    attitude = [(f"{about} [°]", ("attitude_rms_deg", about), 3) for about in ("north", "east", "down")]
    note = f"Window: {_span(metrics)}."
    if (floor := pick(metrics, "floor", "horizontal_m")) is not None:
        of = pick(metrics, "floor", "profile")
        what = "the same navigation" if of in (None, "standstill") else f"the flight '{of}' at this rate"
        note += f" Numeric floor, {what} without sensor errors: {small(floor, 'm')} in position."
    return [
        *paragraphs(_against(metrics)),
        *_by_compensation("Velocity RMS", arms, velocity, note),
        *_by_compensation("Radial error and its rate", arms, radial, "A rate of one run is not a CEP."),
        *_by_compensation("Attitude error, RMS", arms, attitude, ATTITUDE_NOTE),
        Picture("attitude_error", "Attitude error about north, east and down, which is that of heading."),
        Picture("east_velocity_error", "East velocity error. A wave of 84.4 min is the Schuler oscillation."),
        Picture("north_velocity_error", "North velocity error."),
        Picture("latitude_error", "Latitude error."),
        Picture("longitude_error", "Longitude error."),
        Picture("position_error", "Horizontal distance from the reference."),
    ]


def _by_compensation(
    title: str, arms: Mapping[str, Mapping], measures: list[tuple[str, tuple[str, ...], int]], note: str
) -> list[Block]:
    """A row for each compensation; a measure that none of them has is left out."""
    cells = [[fixed(pick(values, *path), digits) for values in arms.values()] for _, path, digits in measures]
    kept = [k for k, column in enumerate(cells) if set(column) != {MISSING}]
    rows = [(label(name), *(cells[k][i] for k in kept)) for i, name in enumerate(arms)]
    return table(title, ("compensation", *(measures[k][0] for k in kept)), rows, note) if kept else []


def _with_interval(piece: Mapping, key: str, interval: str, k: int, digits: int) -> str:
    """A value with its 95 % interval, where there is one."""
    text = fixed(piece[key][k], digits)
    if piece.get(interval):
        low, high = piece[interval][k]
        text += f" ({fixed(low, digits)} to {fixed(high, digits)})"
    return text


def _restarts(metrics: Mapping) -> list[Block]:
    """How far the instrument can be trusted by itself: errors against the time since a start afresh."""
    arms = in_order(metrics.get("restarts") or {})
    if not arms:
        return []
    pieces = [metrics["restarts"][name] for name in arms]
    after_s = pieces[0]["after_s"]
    shown = [k for k, t in enumerate(after_s) if t in RESTART_TIMES_S or k == len(after_s) - 1]
    measures = [
        ("position [m]", "position_rms_m", "position_interval95_m", 1),
        ("velocity [m/s]", "velocity_rms_mps", "velocity_interval95_mps", 2),
    ]
    measures = [one for one in measures if all(one[1] in piece for piece in pieces)]
    header = ["time since the start afresh [s]", *(f"{label(name)}: {one[0]}" for name in arms for one in measures)]
    rows = [
        (
            fixed(after_s[k], 0),
            *(
                cell
                for piece in pieces
                for cell in (
                    _with_interval(piece, value, interval, k, digits) for _, value, interval, digits in measures
                )
            ),
        )
        for k in shown
    ]
    return [
        *paragraphs(
            f"Navigated afresh {pieces[0]['count']} times, each time from a fix and the attitude that the reference "
            "has then, or, without one, from the state that all fixes before give. This is how far the instrument can "
            "be trusted by itself."
        ),
        *table(
            "Growth of the horizontal error",
            header,
            rows,
            "RMS over the pieces, relative to the fix each started from, whose noise is in it twice.",
        ),
    ]


def _against(metrics: Mapping) -> str:
    kind = pick(metrics, "reference", "kind")
    if not kind:
        return ""
    text = f"Measured against {REFERENCE_WORDS.get(kind, kind)}"
    if epochs := pick(metrics, "reference", "epochs"):
        text += f"; {epochs} epochs"
    if epochs := pick(metrics, "reference", "attitude_epochs"):
        text += f"; {epochs} epochs of attitude"
    if outages := pick(metrics, "reference", "outages"):
        text += f", {outages} outage{'s' if outages > 1 else ''}, whose epochs count in no RMS"
    if vertical := pick(metrics, "navigation", "vertical"):
        text += f". The vertical channel is {vertical}"
    return text + "."


def _alignment(metrics: Mapping) -> list[Block]:
    alignment = metrics.get("alignment") or {}
    stretch = alignment.get("stretch_s")
    where = (
        f"Aligned on {stretch[0]:.0f} to {stretch[1]:.0f} s of the recording, the quiet stretch that the rule found."
        if stretch
        else _found_start(alignment)
    )
    names = (
        ("heading_deg", "heading [°]"),
        ("heading_sigma_deg", "heading, 1 σ [°]"),
        ("documented_heading_deg", "heading, documented [°]"),
        ("roll_deg", "roll [°]"),
        ("pitch_deg", "pitch [°]"),
    )
    rows = [(name, fixed(alignment[key], 3)) for key, name in names if alignment.get(key) is not None]
    return (
        [
            *paragraphs(where, _heading(metrics)),
            *table("Attitude at the end of the alignment", ("angle", "value"), rows),
            Picture(
                "activity", "How restless the recording is over time; the shaded stretch was used for the alignment."
            ),
            Picture(
                "attitude",
                "Roll, pitch and heading while navigating. Of a parked vehicle a slow drift is the gyros'; a step is "
                "somebody moving it.",
            ),
        ]
        if where or rows
        else []
    )


def _found_start(alignment: Mapping) -> str:
    """How a start was found that the recording does not state."""
    if (window := alignment.get("window_s")) is None:
        return ""

    def triad(key: str) -> str:
        pairs = zip(
            alignment[key],
            alignment[key.replace("_bias_", "_bias_sigma_").replace("_scale_", "_scale_sigma_")],
            strict=True,
        )
        return ", ".join(f"{fixed(value, 0)} ± {sigma:.2g}" for value, sigma in pairs)

    tilt, heading = alignment["roll_pitch_sigma_deg"], alignment["heading_sigma_deg"]
    text = (
        f"The recording states no attitude. It was found from {window[0]:.0f} to {window[1]:.0f} s by least squares, "
        f"from rest, motion and the fixes: roll and pitch to {fixed(tilt)}°, heading to {fixed(heading)}°, velocity to "
        f"{fixed(max(alignment['velocity_sigma_mps']))} m/s (1 σ). Taken off are gyro biases of "
        f"{triad('gyro_bias_deg_per_h')} deg/h and accelerometer biases of {triad('accelerometer_bias_ug')} ug, "
        f"scale factor errors of {triad('gyro_scale_ppm')} ppm (gyros) and {triad('accelerometer_scale_ppm')} ppm "
        "(accelerometers) (x, y, z, with 1 σ)."
    )
    if rivals := alignment.get("rival_headings_deg"):
        text += f" As likely are headings of {', '.join(fixed(one, 0) for one in rivals)}°."
    position, velocity = alignment["fix_scale"]
    if max(position, velocity) > SCATTER:
        text += (
            f" The fixes scatter {fixed(position, 1)} (position) and {fixed(velocity, 1)} (velocity) times as much as "
            "their stated sigmas: a clock offset, a lever arm or the receiver; the sigmas above allow for it."
        )
    return text


def _recording(metrics: Mapping) -> list[Block]:
    recording = metrics.get("recording") or {}
    facts = [
        f"{name} {recording[key]:g}{unit}" if isinstance(recording[key], int | float) else f"{name} {recording[key]}"
        for key, name, unit in (("kind", "kind", ""), ("rate_hz", "rate", " Hz"), ("duration_s", "length", " s"))
        if recording.get(key) is not None
    ]
    if filled := recording.get("filled_samples"):
        facts.append(f"{filled} samples that were not recorded and lie on straight lines")
    words = paragraphs(
        sentence(", ".join(facts)) if facts else "", *(sentence(note) for note in recording.get("notes") or ())
    )
    if not words:
        return []
    return [
        *words,
        Picture("flight_path", "Path over ground and height, from the reference."),
        Picture("temperature_and_rate", "Temperature of the IMU as read, and the rate that every compensation uses."),
    ]
