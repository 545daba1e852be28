"""Words for channels, effects, amounts and chances of a diagnosis.

The words for an effect are its name in the vocabulary and the physics that stands there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import floor, log10

from ins_eval.effects import VOCABULARY
from ins_eval.wording import fixed, rounded, significant

SPOKEN = {
    "gps.position": "GPS position",
    "gps.velocity": "GPS velocity",
    "reference.position": "position of the reference",
    "reference.velocity": "velocity of the reference",
    "reference.attitude": "attitude of the reference",
    "temperature": "temperature",
    "clock": "the clock",
    "recording": "the description of the recording",
    "navigation": "the navigation",
}
FRACTION = "fraction"  # the unit that stands before its number
AS_GOOD_AS_SURE, AS_GOOD_AS_NEVER = 0.999, 1e-6


def channel(name: str) -> str:
    """A channel as a reader sees it."""
    sensor, _, axis = name.partition(".")
    return SPOKEN.get(name, f"{sensor} {axis}".strip())


def effect_words(one: Mapping) -> str:
    """An effect by its name in the vocabulary: ``accelerometer bias creep, z``."""
    of = _parameters(one)
    words = one["name"].replace(".", " ").replace("_", " ").replace("gps", "GPS")
    if of.get("form"):
        words = of["form"]
    axis = one.get("axis")
    towards = f" with {of['other_axis']}" if of.get("other_axis") else ""
    where = " ".join(filter(None, (of.get("sensor"), axis)))
    return f"{words}, {where}{towards}" if where else words


def _parameters(one: Mapping) -> Mapping:
    return {**one, **one.get("parameters", {})}


def amount(one: Mapping) -> str:
    """The value with its unit and 95 % interval, and the further parameters with theirs."""
    of = one["parameters"]
    value, low, high = alike(of["value"], of["interval95"])
    words = [
        f"{value} {of['unit']} [{low}, {high}]" if of["unit"] != FRACTION else f"{FRACTION} {value} [{low}, {high}]"
    ]
    for parameter in VOCABULARY[one["name"]].parameters:
        if parameter.name not in of:
            continue
        value, low, high = alike(of[parameter.name], of.get(f"{parameter.name}_interval95"))
        interval = f" [{low}, {high}]" if low else ""
        words.append(f"{parameter.words} {value} {parameter.unit}".strip() + interval)
    return ", ".join(words)


def alike(value: float, interval: Sequence[float] | None) -> tuple[str, str, str]:
    """A value and its interval with the digits that the interval leaves meaning to; without one in three."""
    if interval is None:
        return significant(value), "", ""
    half = 0.5 * (interval[1] - interval[0])
    digits = min(-floor(log10(half / 2.0)), 6) if half > 0.0 else 6
    return tuple(rounded(x, digits) for x in (value, *interval))


def nats(value: float | None) -> str:
    """A log Bayes factor or a difference of two."""
    return fixed(value, 1 if value is None or abs(value) < 1000.0 else 0)


def probability(value: float) -> str:
    """With two decimals, three near 0 and 1."""
    if not 1.0 - AS_GOOD_AS_SURE <= value <= AS_GOOD_AS_SURE:
        return f"above {AS_GOOD_AS_SURE}" if value > 0.5 else f"below {1.0 - AS_GOOD_AS_SURE:.3f}"
    return fixed(value, 2 if 0.01 <= value <= 0.99 else 3)


def chance(value: float) -> str:
    """A probability that may be very small."""
    if value < AS_GOOD_AS_NEVER:
        return "less than one in a million"
    return significant(value, 2)


def rare(one: Mapping) -> str:
    """In how many recordings without an effect one is found by chance."""
    value = one["false_alarm_probability"]
    if value < AS_GOOD_AS_NEVER:
        return "fewer than one recording in a million"
    return f"{significant(100.0 * value, 2)} % of recordings"


def numbered(name: str, k: int, several: bool) -> str:
    """The name of a figure of recording or effect number `k`."""
    return f"{name}_{k + 1}" if several else name
