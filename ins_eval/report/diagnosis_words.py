"""Words for channels, effects, amounts and chances of a diagnosis.

The words for an effect are its name in the vocabulary and the physics that stands there.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from ins_eval.effects import VOCABULARY
from ins_eval.wording import alike, fixed, significant

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
DESCRIBED = {  # effects that are so or are not, with a value above 0 and below
    "recording.axis_sign": ("sign as it is", "sign turned"),
    "recording.axes_exchanged": ("exchanged", "exchanged, the sign turned"),
}
MOST_SIGMAS, MOST_NATS = 1000.0, 1e6  # beyond which nobody can tell the digits
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


def size(one: Mapping) -> tuple[str, str, str]:
    """The value, its 95 % interval as ``low to high``, if known, and its unit; of a wrong description what is wrong."""
    of = one["parameters"]
    interval = of.get("interval95")
    if one["name"] in DESCRIBED:
        return DESCRIBED[one["name"]][of["value"] < 0.0], "", ""
    if interval is None or interval[0] == interval[1]:
        return significant(of["value"]), "", of["unit"]
    value, low, high = alike(of["value"], interval)
    return value, f"{low} to {high}", of["unit"]


def amount(one: Mapping) -> str:
    """The value with its unit and 95 % interval, and the further parameters with theirs."""
    value, interval, unit = size(one)
    ends = f"[{interval.replace(' to ', ', ')}]" if interval else ""
    said = (FRACTION, value, ends) if unit == FRACTION else (value, unit, ends)
    return ", ".join([" ".join(filter(None, said)), *further(one)])


def further(one: Mapping) -> list[str]:
    """The further parameters of an effect, each with its unit and 95 % interval."""
    of, words = one["parameters"], []
    for parameter in VOCABULARY[one["name"]].parameters:
        if parameter.name not in of:
            continue
        value, low, high = alike(of[parameter.name], of.get(f"{parameter.name}_interval95"))
        interval = f" [{low}, {high}]" if low else ""
        words.append(f"{parameter.words} {value} {parameter.unit}".strip() + interval)
    return words


def sigmas(one: Mapping) -> str:
    """How many sigma: the deviate of a probability."""
    value = one["significance_sigma"]
    return f"more than {MOST_SIGMAS:.0f}" if value > MOST_SIGMAS else fixed(value, 1)


def where(one: Mapping) -> str:
    """In what flight condition and at which temperatures an interval lies."""
    return re.sub(r"(?<![\w.])-(?=\d)", "−", one["where"])


def nats(value: float | None) -> str:
    """A log Bayes factor or a difference of two, in three figures from a thousand on."""
    if value is not None and abs(value) > MOST_NATS:
        return "more than 10⁶" if value > 0.0 else "less than −10⁶"
    return fixed(value, 1) if value is None or abs(value) < 1000.0 else significant(value)


def beside_best(below: float) -> str:
    """How far a rival lies below the best, or above it: an answer stays where another is hardly more probable."""
    return f"{nats(abs(below))} nats {'above' if below < 0.0 else 'below'} the best"


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
