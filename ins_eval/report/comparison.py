"""The comparison of a recorded IMU with the one that a reference implies, in words and tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import floor, log10
from typing import NamedTuple

from ins_eval.report.belief import belief_section
from ins_eval.report.content import Block, Picture, Section, paragraphs, table
from ins_eval.tables import pick
from ins_eval.units import DEG, DEG_PER_H, DEG_PER_SQRT_H, STANDARD_GRAVITY, UG
from ins_eval.wording import MISSING, fixed, joined, sentence

AXES = "xyz"
COARSE_GYRO, COARSE_ACCELEROMETER = 0.01 * DEG, 1e-3  # rad/s, m/s^2: from here on in °/s and m/s²
ALTERNATING = -0.2  # a correlation of neighbours below this is the mark of noise at the epochs of the reference
ATTITUDE_WORDS = {
    "reference": "its attitude",
    "given": "the attitude that the recording gives",
    "aligned": "an attitude found by alignment on the recording's own gyros and accelerometers",
}


class DisplayUnit(NamedTuple):
    """A readable unit; a value in SI divided by `size` is in it."""

    text: str
    size: float


def units(metrics: Mapping) -> dict[str, DisplayUnit]:
    """The unit of the differences of each sensor, by their size."""
    gyro = _largest(metrics, "gyro")
    accelerometer = _largest(metrics, "accelerometer")
    return {
        "gyro": DisplayUnit("°/s", DEG) if gyro >= COARSE_GYRO else DisplayUnit("°/h", DEG_PER_H),
        "accelerometer": DisplayUnit("m/s²", 1.0) if accelerometer >= COARSE_ACCELEROMETER else DisplayUnit("µg", UG),
    }


def comparison_content(metrics: Mapping) -> tuple[str, list[Section]]:
    """The answer and the sections of a comparison; what the metrics lack is left out."""
    sections = [
        belief_section(metrics.get("belief")),
        Section("Difference", _difference(metrics)),
        Section("What remains", _remains(metrics)),
        Section("Clocks", _clocks(metrics)),
        Section("How it was compared", _method(metrics)),
        Section("The recording", _recording(metrics)),
    ]
    return _answer(metrics), [section for section in sections if section.blocks]


def _answer(metrics: Mapping) -> str:
    name = pick(metrics, "recording", "name") or "this recording"
    unit = units(metrics)
    triads = [(sensor, _channels(metrics, sensor)) for sensor in ("gyro", "accelerometer")]
    reads = [f"the {sensor}s read {_reads(channels, unit[sensor])}" for sensor, channels in triads if channels]
    if not reads:
        return f"{name} was read, but nothing of it was compared."
    parts = [", ".join(reads)]
    if clock := _clock_in_short(metrics):
        parts.append(clock)
    parts.append(_remaining(metrics))
    against = "the standstill" if _stands(metrics) else "the reference"
    lines = [f"{name}: against {against} {'; '.join(parts)}."]
    if limits := _no_scale(metrics):
        lines.append(limits)
    return "\n".join(lines)


def _reads(channels: Mapping[str, Mapping], unit: DisplayUnit) -> str:
    """``0.0444 °/s high on x, no more than 0.002 °/s off on y and z``, as far as the intervals tell."""
    determined, undetermined, most = [], [], 0.0
    for axis, channel in channels.items():
        low, high = channel["mean_difference"]["interval95"]
        if low <= 0.0 <= high:
            undetermined.append(axis)
            most = max(most, -low, high)
            continue
        value, digits = channel["mean_difference"]["value"] / unit.size, _digits(high - low, unit.size)
        determined.append(f"{fixed(abs(value), digits)} {unit.text} {'high' if value > 0.0 else 'low'} on {axis}")
    if undetermined:
        within = f"no more than {_significant(most / unit.size)} {unit.text} off on {joined(undetermined)}"
        return f"{joined(determined)}, {within}" if determined else within
    return joined(determined)


def _clock_in_short(metrics: Mapping) -> str:
    clock = metrics.get("clock") or {}
    if clock.get("found_s") is None:
        return ""
    if _clock_agrees(clock):
        return f"the two clocks differ by the believed {fixed(abs(1e3 * clock['believed_s']), 1)} ms"
    believed = f" where {fixed(1e3 * clock['believed_s'], 1)} ms are believed" if clock["believed_s"] else ""
    return f"the two clocks differ by {_milliseconds(clock)} ms{believed}"


def _remaining(metrics: Mapping) -> str:
    """The largest RMS of each sensor after the fit; with the clock found too, where that was not used."""
    length = pick(metrics, "reference", "window_s")
    clock = metrics.get("clock") or {}
    text = f"what remains is {_worst(metrics, 'after_fit')} RMS" + (f" over {length:g} s" if length else "")
    if clock.get("found_s") is None or clock.get("used_s") == clock["found_s"] or _clock_agrees(clock):
        return text
    return f"{text}, with the clock set right {_worst(metrics, 'after_fit_found_clock')}"


def _worst(metrics: Mapping, key: str) -> str:
    unit = units(metrics)
    worst = [
        (max(channel["rms"][key] for channel in channels.values()) / unit[sensor].size, unit[sensor].text)
        for sensor in ("gyro", "accelerometer")
        if (channels := _channels(metrics, sensor))
    ]
    return joined([f"{_significant(value)} {text}" for value, text in worst])


def _stands(metrics: Mapping) -> bool:
    return pick(metrics, "reference", "kind") == "standstill"


def _no_scale(metrics: Mapping) -> str:
    """What the motion was too small for."""
    missing = {
        sensor: [axis for axis, channel in _channels(metrics, sensor).items() if channel.get("scale_error") is None]
        for sensor in ("gyro", "accelerometer")
    }
    limit = pick(metrics, "reference", "scale_limit")
    if not any(missing.values()) or limit is None:
        return ""
    who = [f"{sensor} {axis}" for sensor, axes in missing.items() for axis in axes]
    of_whom = "any channel" if len(who) == 6 else joined(who)
    return (
        f"No scale factor of {of_whom} is given: the motion is too small to tell it to {100.0 * limit:g} %, so it "
        "stands within the difference."
    )


def _difference(metrics: Mapping) -> list[Block]:
    blocks: list[Block] = []
    for sensor in ("gyro", "accelerometer"):
        blocks += _coefficients(metrics, sensor)
    blocks += _beliefs(metrics)
    if blocks:
        blocks += [
            *paragraphs(_mounting(metrics)),
            Picture("sensor_scatter", "The difference against the input: its slope is the scale factor error."),
            Picture("sensor_signals", "Recorded and implied at the pace of the reference, in the liveliest stretch."),
        ]
    return blocks


def _coefficients(metrics: Mapping, sensor: str) -> list[Block]:
    channels, size = _channels(metrics, sensor), units(metrics)[sensor].size
    unit, limit = units(metrics)[sensor].text, pick(metrics, "reference", "scale_limit")
    columns = [(f"mean difference [{unit}]", lambda _, c: _with_error(c["mean_difference"], size))]
    if any(channel.get("bias") for channel in channels.values()):
        columns.append((f"bias at zero input [{unit}]", lambda _, c: _with_error(c.get("bias"), size)))
    note = "Recorded minus implied; ± is half the 95 % interval."
    if any(channel.get("bias") for channel in channels.values()):
        columns.append(("scale factor error [ppm]", lambda _, c: _with_error(c.get("scale_error"), 1e-6)))
        columns += [(f"from {other} [mrad]", _misalignment(other)) for other in AXES]
        note += (
            " The mean difference holds what scale factor and misalignment make of the mean input, the bias does not. "
            f"{MISSING}: not determined" + (f" to {1e6 * limit:.0f} ppm or {1e3 * limit:g} mrad." if limit else ".")
        )
    rows = [(axis, *(cell(axis, channel) for _, cell in columns)) for axis, channel in channels.items()]
    return table(f"{sensor.capitalize()}s", ("axis", *(name for name, _ in columns)), rows, note)


def _beliefs(metrics: Mapping) -> list[Block]:
    """Bias found against bias believed, of the channels of which something is believed."""
    rows = []
    for sensor in ("gyro", "accelerometer"):
        unit = units(metrics)[sensor]
        for axis, channel in _channels(metrics, sensor).items():
            if estimate := channel.get("found_minus_believed"):
                low, high = estimate["interval95"]
                digits = _digits(high - low, unit.size)
                believed = fixed(channel["believed_bias"] / unit.size, digits)
                rows.append((f"{sensor} {axis} [{unit.text}]", believed, _with_error(estimate, unit.size)))
    return table("Bias", ("channel", "believed", "found minus believed"), rows)


def _misalignment(other: str) -> Callable[[str, Mapping], str]:
    return lambda axis, c: "" if axis == other else _with_error(pick(c, "misalignment", other), 1e-3)


def _mounting(metrics: Mapping) -> str:
    if _stands(metrics):
        return ""
    return (
        "A rotation between the housing of the reference and that of the IMU shows as misalignments of opposite sign "
        "in pairs (y from x against x from y), alike for gyros and accelerometers, and as part of the accelerometers' "
        "mean difference, because gravity comes in under another angle."
    )


def _remains(metrics: Mapping) -> list[Block]:
    rows, moving = [], pick(metrics, "clock", "found_s") is not None
    for sensor in ("gyro", "accelerometer"):
        unit = units(metrics)[sensor]
        for axis, channel in _channels(metrics, sensor).items():
            rms, largest = channel["rms"], channel["largest"]
            density, density_unit = _density(channel["noise_density"], sensor)
            rows.append(
                (
                    f"{sensor} {axis} [{unit.text}]",
                    *(_significant(rms[key] / unit.size) for key in ("as_recorded", "without_mean", "after_fit")),
                    *([_significant(_over(rms.get("after_fit_found_clock"), unit.size))] if moving else []),
                    f"{_significant(density)} {density_unit}",
                    f"{_significant(largest['value'] / unit.size)} at {fixed(largest['time_s'], 1)} s",
                )
            )
    length = pick(metrics, "reference", "window_s")
    note = "The noise density is read off the Allan deviation" + (f" at {length:g} s" if length else "")
    note += " of what remains" + ("." if _stands(metrics) else ", noise of the reference included.")
    header = (
        "channel",
        "RMS as recorded",
        "less its mean",
        "after the fit",
        *(["after the fit, with the clock found"] if moving else []),
        "noise density",
        "largest departure",
    )
    return [
        *table("RMS of recorded minus implied", header, rows, note),
        *paragraphs(_alternating(metrics)),
        *([Picture("sensor_residuals", "Recorded minus implied over the whole recording.")] if rows else []),
    ]


def _alternating(metrics: Mapping) -> str:
    marked = [
        f"{sensor} {axis} {fixed(channel['neighbour_correlation'])}"
        for sensor in ("gyro", "accelerometer")
        for axis, channel in _channels(metrics, sensor).items()
        if channel.get("neighbour_correlation", 0.0) < ALTERNATING
    ]
    if not marked or _stands(metrics):
        return ""
    return (
        f"Neighbouring windows depart in opposite senses (correlation: {joined(marked)}; −0.5 for noise at the ends of "
        "windows alone). That is the mark of reading noise and vibration in the reference's attitude and velocity, so "
        "these densities are upper limits for the sensors."
    )


def _clocks(metrics: Mapping) -> list[Block]:
    clock = metrics.get("clock") or {}
    if "used_s" not in clock:
        return []
    believed = f"{fixed(1e3 * clock['believed_s'], 1)} ms"
    if clock.get("found_s") is None:
        why = clock.get("reason") or "the motion does not determine it"
        return paragraphs(f"The offset between the two clocks was not found: {why}. The believed {believed} was used.")
    text = (
        f"The reference stamps the same instant {_milliseconds(clock)} ms {_later(clock)} than the IMU (± is half the "
        "95 % interval, from the gyros alone; which instant of a sample a stamp means is part of it); believed were "
        f"{believed}"
    )
    if _clock_agrees(clock):
        return paragraphs(f"{text}, which agrees.")
    if clock["used_s"] == clock["believed_s"]:
        return paragraphs(
            f"{text}. All else was compared with the believed offset: an offset mixes motion into every channel, so "
            f"set time_offset_s = {clock['found_s']:.4f} in [reference] and compare again."
        )
    return paragraphs(f"{text}. The offset found was used.")


def _method(metrics: Mapping) -> list[Block]:
    reference = metrics.get("reference") or {}
    window, spacing = reference.get("window_s"), reference.get("epoch_spacing_s")
    if window is None:
        return []
    attitude = ATTITUDE_WORDS.get(reference.get("attitude"), "its attitude")
    still = reference.get("kind") == "standstill"
    compared = f"{reference['windows'] * window:.0f} s were compared" if "windows" in reference else ""
    texts = [
        f"The reference is {'the known standstill with ' if still else 'a better navigator with '}{attitude}. "
        + (f"{compared}, as means over {window:g} s. " if compared else "")
        + (
            ""
            if still or spacing is None
            else f"Its epochs are {spacing:g} s apart, so it shows nothing faster than {0.5 / spacing:.3g} Hz; smooth "
            "curves through them give the rates and the specific force, windows begin and end on epochs. Gaps are not "
            "bridged. "
        ),
        f"Errors come from leaving out one of {reference.get('blocks', 20)} blocks of consecutive windows at a time "
        "(jackknife), because what remains is not white.",
        _hidden(reference),
        _attenuation(metrics),
    ]
    return paragraphs(*texts)


def _hidden(reference: Mapping) -> str:
    """What the attitude of a standstill keeps from view."""
    if reference.get("kind") != "standstill":
        return ""
    if reference.get("attitude") == "aligned":
        return (
            "Because the attitude was found from the same sensors, stretch by stretch, the bias of a horizontal "
            "accelerometer and of the east gyro went into it: only what lies along gravity and along the Earth's rate "
            "can be seen here."
        )
    sigma = reference.get("level_sigma_deg")
    if not sigma:
        return "The attitude was taken as exact."
    return (
        f"The attitude is known to {sigma:.2g}° (1 σ), so biases of the horizontal accelerometers below "
        f"{_significant(sigma * DEG * STANDARD_GRAVITY / UG)} µg (1 σ) do not show."
    )


def _attenuation(metrics: Mapping) -> str:
    """How far noise of the reference could have lowered the scale factors that are given."""
    given = [
        (f"{sensor} {axis}", 1e6 * channel["attenuation"])
        for sensor in ("gyro", "accelerometer")
        for axis, channel in _channels(metrics, sensor).items()
        if channel.get("scale_error") is not None and channel.get("attenuation") is not None
    ]
    if not given:
        return ""
    return (
        "Noise in the reference's own rates lowers a fitted scale factor. If all that remains were such noise, that "
        f"would be by {joined([f'{_significant(value)} ppm for {name}' for name, value in given])}; this is not in the "
        "intervals."
    )


def _recording(metrics: Mapping) -> list[Block]:
    recording = metrics.get("recording") or {}
    facts = [
        f"{name} {recording[key]:g}{unit}" if isinstance(recording[key], int | float) else f"{name} {recording[key]}"
        for key, name, unit in (("kind", "kind", ""), ("rate_hz", "rate", " Hz"), ("duration_s", "length", " s"))
        if recording.get(key) is not None
    ]
    return paragraphs(
        sentence(", ".join(facts)) if facts else "", *(sentence(note) for note in recording.get("notes") or ())
    )


def _channels(metrics: Mapping, sensor: str) -> dict[str, Mapping]:
    triad = metrics.get(sensor) or {}
    return {axis: triad[axis] for axis in AXES if axis in triad}


def _largest(metrics: Mapping, sensor: str) -> float:
    return max(
        (
            max(abs(channel["mean_difference"]["value"]), channel["rms"]["after_fit"])
            for channel in _channels(metrics, sensor).values()
        ),
        default=0.0,
    )


def _clock_agrees(clock: Mapping) -> bool:
    low, high = clock["interval95_s"]
    return low <= clock["believed_s"] <= high


def _milliseconds(clock: Mapping) -> str:
    low, high = clock["interval95_s"]
    digits = _digits(high - low, 1e-3)
    return f"{fixed(1e3 * abs(clock['found_s']), digits)} ± {fixed(0.5e3 * (high - low), digits)}"


def _later(clock: Mapping) -> str:
    return "later" if clock["found_s"] >= 0.0 else "earlier"


def _density(value: float | None, sensor: str) -> tuple[float | None, str]:
    if sensor == "gyro":
        return _over(value, DEG_PER_SQRT_H), "°/√h"
    return _over(value, UG), "µg/√Hz"


def _over(value: float | None, size: float) -> float | None:
    return None if value is None else value / size


def _digits(width: float, size: float) -> int:
    """Decimals at which half of an interval of this `width` in SI has two digits in the unit of this `size`."""
    half = 0.5 * width / size
    return 0 if half <= 0.0 else max(0, 1 - floor(log10(half)))


def _with_error(estimate: Mapping | None, size: float) -> str:
    if estimate is None:
        return MISSING
    low, high = estimate["interval95"]
    digits = _digits(high - low, size)
    return f"{fixed(estimate['value'] / size, digits)} ± {fixed(0.5 * (high - low) / size, digits)}"


def _significant(value: float | None) -> str:
    """Two digits that count."""
    if value is None or value == 0.0:
        return MISSING if value is None else "0"
    return fixed(value, max(0, 1 - floor(log10(abs(value)))))


def axis_units(metrics: Mapping) -> Sequence[str]:
    """The units of `units` as text, gyro first: for the figures."""
    return tuple(unit.text for unit in units(metrics).values())
