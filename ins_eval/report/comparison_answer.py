"""What a comparison answers: three numbers, what to do next, and in full what each channel reads."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ins_eval import channels
from ins_eval.analysis.compare import ComparedChannel, RecordingComparison
from ins_eval.channels import ChannelEstimate
from ins_eval.figures.results.comparison import DisplayUnit, units
from ins_eval.report.comparison_words import (
    all_channels,
    clock_agrees,
    decimals,
    milliseconds,
    stands,
    two_digits,
    with_error,
)
from ins_eval.report.content import Number, Picture, Section, at_a_glance
from ins_eval.wording import fixed, joined, sentence


def answer(found: RecordingComparison) -> str:
    """First line the largest differences, then every channel, then what the motion was too small for."""
    unit = units(found)
    reads = [f"the {sensor}s read {_reads(triad, unit[sensor])}" for sensor, triad in found.channels.items()]
    parts = [", ".join(reads)]
    if found.clock is not None:
        parts.append(_clock_in_short(found, found.clock))
    parts.append(_remaining(found))
    against = "the standstill" if stands(found) else "the reference"
    worst = [
        f"{one.sensor} {one.axis} {_reads([one], unit[one.sensor]).removesuffix(f' on {one.axis}')}"
        for one in _largest(found)
    ]
    lines = [
        f"{found.recording.name}: against {against} {joined(worst)} differ most{_clock_verdict(found)}.",
        sentence(f"against {against} {'; '.join(parts)}"),
    ]
    if limits := _no_scale(found):
        lines.append(limits)
    return "\n".join(lines)


def glance(found: RecordingComparison) -> Section:
    """The largest difference of each sensor and the clock, with intervals; a figure; what to do next."""
    unit = units(found)
    numbers = []
    for one in _largest(found):
        mean, (text, size) = one.fitted.mean_difference, unit[one.sensor]
        value, half = with_error(mean, size).split(" ± ")
        numbers.append(Number(f"{one.sensor} {one.axis} less reference, mean", f"{value} {text}", f"± {half} (95 %)"))
    if found.clock is None:
        worst = max(found.channels["gyro"], key=lambda one: one.fitted.rms_after)
        rms = f"{two_digits(worst.fitted.rms_after / unit['gyro'].size)} {unit['gyro'].text}"
        numbers.append(Number(f"what remains of gyro {worst.axis}, RMS", rms, f"over {found.windows.length_s:g} s"))
    else:
        value, half = milliseconds(found.clock).split(" ± ")
        later = "" if found.clock.value >= 0.0 else "−"
        numbers.append(Number("clock of the reference less that of the IMU", f"{later}{value} ms", f"± {half} (95 %)"))
    caption = "Recorded minus implied over the whole recording, before and after the fit."
    return at_a_glance(numbers, Picture("sensor_residuals", caption), *_next_steps(found))


def _largest(found: RecordingComparison) -> list[ComparedChannel]:
    """The channel of each sensor whose mean differs most."""
    return [max(triad, key=lambda one: abs(one.fitted.mean_difference.value)) for triad in found.channels.values()]


def _clock_verdict(found: RecordingComparison) -> str:
    clock = found.clock
    return "" if clock is None or clock_agrees(found, clock) else ", and the clocks are not those believed"


def _next_steps(found: RecordingComparison) -> list[str]:
    clock, steps = found.clock, []
    if clock is not None and not clock_agrees(found, clock) and found.used_s != clock.value:
        steps.append(
            "Compare again with --use-found-offset: a wrong clock mixes motion into every channel. If it holds, set "
            f"time_offset_s = {clock.value:.4f} in [reference]."
        )
    differing = [
        f"{one.sensor} {one.axis}"
        for one in all_channels(found)
        if (difference := one.found_minus_believed or one.fitted.mean_difference)
        and not difference.low <= 0.0 <= difference.high
    ]
    if differing:
        steps.append(
            f"The believed bias of {joined(differing)} is not that found: state it in recording.toml if other "
            "recordings show the same, then evaluate."
        )
    return steps or ["Nothing here asks for a change: evaluate the recording as it is believed."]


def _reads(triad: Sequence[ComparedChannel], unit: DisplayUnit) -> str:
    """``0.0444 °/s high on x, no more than 0.002 °/s off on y and z``, as far as the intervals tell."""
    determined, undetermined, most = [], [], 0.0
    for one in triad:
        mean = one.fitted.mean_difference
        if mean.low <= 0.0 <= mean.high:
            undetermined.append(one.axis)
            most = max(most, -mean.low, mean.high)
            continue
        value, digits = mean.value / unit.size, decimals(mean, unit.size)
        determined.append(f"{fixed(abs(value), digits)} {unit.text} {'high' if value > 0.0 else 'low'} on {one.axis}")
    if undetermined:
        within = f"no more than {two_digits(most / unit.size)} {unit.text} off on {joined(undetermined)}"
        return f"{joined(determined)}, {within}" if determined else within
    return joined(determined)


def _clock_in_short(found: RecordingComparison, clock: ChannelEstimate) -> str:
    believed_ms = 1e3 * found.known.time_offset_s
    if clock_agrees(found, clock):
        return f"the two clocks differ by the believed {fixed(abs(believed_ms), 1)} ms"
    believed = f" where {fixed(believed_ms, 1)} ms are believed" if believed_ms else ""
    return f"the two clocks differ by {milliseconds(clock)} ms{believed}"


def _remaining(found: RecordingComparison) -> str:
    """The largest RMS of each sensor after the fit; with the clock found too, where that was not used."""
    text = f"what remains is {_worst(found, lambda one: one.fitted.rms_after)} RMS over {found.windows.length_s:g} s"
    clock = found.clock
    if clock is None or found.used_s == clock.value or clock_agrees(found, clock):
        return text
    return f"{text}, with the clock set right {_worst(found, lambda one: one.rms_with_clock)}"


def _worst(found: RecordingComparison, rms: Callable[[ComparedChannel], float]) -> str:
    unit = units(found)
    worst = [(max(map(rms, triad)) / unit[sensor].size, unit[sensor].text) for sensor, triad in found.channels.items()]
    return joined([f"{two_digits(value)} {text}" for value, text in worst])


def _no_scale(found: RecordingComparison) -> str:
    """What the motion was too small for."""
    who = [f"{one.sensor} {one.axis}" for one in all_channels(found) if one.scale_error is None]
    if not who:
        return ""
    of_whom = "any channel" if len(who) == 6 else joined(who)
    return (
        f"No scale factor of {of_whom} is given: the motion is too small to determine it to "
        f"{100.0 * channels.LIMIT:g} %, so it stands within the difference."
    )
