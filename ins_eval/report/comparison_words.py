"""Numbers of a comparison as a reader sees them."""

from __future__ import annotations

from math import floor, log10

from ins_eval.analysis.compare import ComparedChannel, RecordingComparison
from ins_eval.channels import ChannelEstimate
from ins_eval.wording import MISSING, fixed


def stands(found: RecordingComparison) -> bool:
    return found.known.kind == "standstill"


def all_channels(found: RecordingComparison) -> list[ComparedChannel]:
    return [one for triad in found.channels.values() for one in triad]


def clock_agrees(found: RecordingComparison, clock: ChannelEstimate) -> bool:
    return clock.low <= found.known.time_offset_s <= clock.high


def milliseconds(clock: ChannelEstimate) -> str:
    digits = decimals(clock, 1e-3)
    return f"{fixed(1e3 * abs(clock.value), digits)} ± {fixed(0.5e3 * (clock.high - clock.low), digits)}"


def decimals(estimate: ChannelEstimate, size: float) -> int:
    """Decimals at which half of its interval has two digits in the unit of this `size`."""
    half = 0.5 * (estimate.high - estimate.low) / size
    return 0 if half <= 0.0 else max(0, 1 - floor(log10(half)))


def with_error(estimate: ChannelEstimate | None, size: float) -> str:
    if estimate is None:
        return MISSING
    digits = decimals(estimate, size)
    return f"{fixed(estimate.value / size, digits)} ± {fixed(0.5 * (estimate.high - estimate.low) / size, digits)}"


def two_digits(value: float | None) -> str:
    """Two digits that count."""
    if value is None or value == 0.0:
        return MISSING if value is None else "0"
    return fixed(value, max(0, 1 - floor(log10(abs(value)))))
