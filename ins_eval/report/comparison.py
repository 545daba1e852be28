"""The comparison of a recorded IMU with the one that a reference implies, in words and tables."""

from __future__ import annotations

from math import isfinite

from ins_eval import channels
from ins_eval.analysis.compare import RecordingComparison
from ins_eval.believed import belief_rows
from ins_eval.figures.results.comparison import units
from ins_eval.implied import epoch_spacing_s
from ins_eval.report.belief import belief_section
from ins_eval.report.comparison_answer import answer, glance
from ins_eval.report.comparison_words import (
    all_channels,
    clock_agrees,
    decimals,
    milliseconds,
    stands,
    two_digits,
    with_error,
)
from ins_eval.report.content import Block, Picture, Section, paragraphs, table
from ins_eval.units import DEG, DEG_PER_SQRT_H, STANDARD_GRAVITY, UG
from ins_eval.wording import MISSING, fixed, joined, sentence

AXES = "xyz"
ALTERNATING = -0.2  # a correlation of neighbours below this is the mark of noise at the epochs of the reference
ATTITUDE_WORDS = {
    "reference": "its attitude",
    "given": "the attitude that the recording gives",
    "aligned": "an attitude found by alignment on the recording's own gyros and accelerometers",
}


def comparison_content(found: RecordingComparison) -> tuple[str, list[Section]]:
    """The answer and the sections of a comparison."""
    sections = [
        glance(found),
        belief_section(belief_rows(found.recording)),
        Section("Difference", _difference(found)),
        Section("What remains", _remains(found)),
        Section("Clocks", _clocks(found)),
        Section("How it was compared", _method(found)),
        Section("The recording", _recording(found)),
    ]
    return answer(found), [section for section in sections if section.blocks]


def _difference(found: RecordingComparison) -> list[Block]:
    return [
        *_coefficients(found, "gyro"),
        *_coefficients(found, "accelerometer"),
        *_beliefs(found),
        *paragraphs(_mounting(found)),
        Picture("sensor_scatter", "The difference against the input: its slope is the scale factor error."),
        Picture(
            "sensor_signals",
            "Recorded and implied at the pace of the reference, where motion is largest.",
        ),
    ]


def _coefficients(found: RecordingComparison, sensor: str) -> list[Block]:
    triad, (unit, size), limit = found.channels[sensor], units(found)[sensor], channels.LIMIT
    header, rows = ["axis", f"mean difference [{unit}]"], [[one.axis] for one in triad]
    for row, one in zip(rows, triad, strict=True):
        row.append(with_error(one.fitted.mean_difference, size))
    note = "Recorded minus implied; ± is half the 95 % interval."
    if any(one.fitted.bias for one in triad):
        header += [f"bias at zero input [{unit}]", "scale factor error [ppm]", *(f"from {a} [mrad]" for a in AXES)]
        for row, one in zip(rows, triad, strict=True):
            row += [with_error(one.fitted.bias, size), with_error(one.scale_error, 1e-6)]
            terms = zip(AXES, one.fitted.terms, strict=True)
            row += ["" if other == one.axis else with_error(term, 1e-3) for other, term in terms]
        note += (
            " The mean difference holds what scale factor and misalignment make of the mean input, the bias does not. "
            f"{MISSING}: not determined to {1e6 * limit:.0f} ppm or {1e3 * limit:g} mrad."
        )
    return table(f"{sensor.capitalize()}s", tuple(header), [tuple(row) for row in rows], note)


def _beliefs(found: RecordingComparison) -> list[Block]:
    """Bias found against bias believed, of the channels of which something is believed."""
    rows = []
    for one in all_channels(found):
        unit = units(found)[one.sensor]
        if (difference := one.found_minus_believed) is not None:
            believed = fixed(one.believed_bias / unit.size, decimals(difference, unit.size))
            rows.append((f"{one.sensor} {one.axis} [{unit.text}]", believed, with_error(difference, unit.size)))
    return table("Bias", ("channel", "believed", "found minus believed"), rows)


def _mounting(found: RecordingComparison) -> str:
    if stands(found):
        return ""
    return (
        "A rotation between the housing of the reference and that of the IMU shows as misalignments of opposite sign "
        "in pairs (y from x against x from y), alike for gyros and accelerometers, and as part of the accelerometers' "
        "mean difference, because gravity comes in under another angle."
    )


def _remains(found: RecordingComparison) -> list[Block]:
    rows, moving = [], found.clock is not None
    for one in all_channels(found):
        unit, fit = units(found)[one.sensor], one.fitted
        size, density_unit = (DEG_PER_SQRT_H, "°/√h") if one.sensor == "gyro" else (UG, "µg/√Hz")
        density = two_digits(fit.density / size) if isfinite(fit.density) else MISSING
        clock = None if one.rms_with_clock is None else one.rms_with_clock / unit.size
        rows.append(
            (
                f"{one.sensor} {one.axis} [{unit.text}]",
                *(two_digits(rms / unit.size) for rms in (fit.rms_before, fit.rms_without_mean, fit.rms_after)),
                *([two_digits(clock)] if moving else []),
                f"{density} {density_unit}",
                f"{two_digits(fit.largest / unit.size)} at {fixed(fit.largest_s, 1)} s",
            )
        )
    note = f"The noise density is read off the Allan deviation at {found.windows.length_s:g} s of what remains"
    note += "." if stands(found) else ", noise of the reference included."
    header = (
        *("channel", "RMS as recorded", "less its mean", "after the fit"),
        *(["after the fit, with the clock found"] if moving else []),
        *("noise density", "largest departure"),
    )
    return [
        *table("RMS of recorded minus implied", header, rows, note),
        *paragraphs(_alternating(found)),
        Picture("sensor_residuals", "Recorded minus implied over the whole recording."),
    ]


def _alternating(found: RecordingComparison) -> str:
    marked = [
        f"{one.sensor} {one.axis} {fixed(one.fitted.neighbour_correlation)}"
        for one in all_channels(found)
        if one.fitted.neighbour_correlation < ALTERNATING
    ]
    if not marked or stands(found):
        return ""
    return (
        f"Neighbouring windows depart in opposite senses (correlation: {joined(marked)}; −0.5 for noise at the ends of "
        "windows alone). That is the mark of reading noise and vibration in the reference's attitude and velocity, so "
        "these densities are upper limits for the sensors."
    )


def _clocks(found: RecordingComparison) -> list[Block]:
    clock, believed = found.clock, f"{fixed(1e3 * found.known.time_offset_s, 1)} ms"
    if clock is None:
        text = f"The offset between the two clocks was not found: {found.clock_reason}."
        return paragraphs(f"{text} The believed {believed} was used.")
    text = (
        f"The reference stamps the same instant {milliseconds(clock)} ms "
        f"{'later' if clock.value >= 0.0 else 'earlier'} than the IMU (± is half the 95 % interval, from the gyros "
        f"alone; which instant of a sample a stamp means is part of it); believed were {believed}"
    )
    if clock_agrees(found, clock):
        return paragraphs(f"{text}, which agrees.")
    if found.used_s == found.known.time_offset_s:
        return paragraphs(
            f"{text}. All else was compared with the believed offset: an offset mixes motion into every channel, so "
            f"set time_offset_s = {clock.value:.4f} in [reference] and compare again."
        )
    return paragraphs(f"{text}. The offset found was used.")


def _method(found: RecordingComparison) -> list[Block]:
    window_s, spacing_s, still = found.windows.length_s, epoch_spacing_s(found.known.fixes), stands(found)
    text = (
        f"The reference is {'the known standstill with ' if still else 'a better navigator with '}"
        f"{ATTITUDE_WORDS[found.known.attitude]}. {found.windows.time_s.size * window_s:.0f} s were compared, as means "
        f"over {window_s:g} s. "
    )
    if not still:
        text += (
            f"Its epochs are {spacing_s:g} s apart, so it shows nothing faster than {0.5 / spacing_s:.3g} Hz; smooth "
            "curves through them give the rates and the specific force, windows begin and end on epochs. Gaps are not "
            "bridged. "
        )
    jackknife = (
        f"Errors come from leaving out one of {channels.BLOCKS} blocks of consecutive windows at a time (jackknife), "
        "because what remains is not white."
    )
    return paragraphs(text, jackknife, _hidden(found) if still else "", _attenuation(found))


def _hidden(found: RecordingComparison) -> str:
    """What the attitude of a standstill keeps from view."""
    if found.known.attitude == "aligned":
        return (
            "Because the attitude was found from the same sensors, stretch by stretch, the bias of a horizontal "
            "accelerometer and of the east gyro went into it: only what lies along gravity and along the Earth's rate "
            "can be seen here."
        )
    sigma = found.level_sigma_deg
    if not sigma:
        return "The attitude was taken as exact."
    return (
        f"The attitude is known to {sigma:.2g}° (1 σ), so biases of the horizontal accelerometers below "
        f"{two_digits(sigma * DEG * STANDARD_GRAVITY / UG)} µg (1 σ) do not show."
    )


def _attenuation(found: RecordingComparison) -> str:
    """How far noise of the reference could have lowered the scale factors that are given."""
    given = [
        f"{two_digits(1e6 * one.fitted.attenuation)} ppm for {one.sensor} {one.axis}"
        for one in all_channels(found)
        if one.scale_error is not None and isfinite(one.fitted.attenuation)
    ]
    if not given:
        return ""
    return (
        "Noise in the reference's own rates lowers a fitted scale factor. If all that remains were such noise, that "
        f"would be by {joined(given)}; this is not in the intervals."
    )


def _recording(found: RecordingComparison) -> list[Block]:
    recording = found.recording
    facts = f"kind {recording.kind}, rate {found.rate_hz:g} Hz, length {found.duration_s:g} s"
    return paragraphs(sentence(facts), *(sentence(note) for note in recording.notes))
