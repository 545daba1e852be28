"""Numbers into words: every sentence about a difference is derived from its ratio and 95 % interval."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from math import floor, log10
from typing import Any, Literal

from ins_eval import metrics
from ins_eval.metrics import Estimate

Statistic = Mapping[str, Any]  # {"value": float, "interval95": [low, high]}
Ratio = Estimate | metrics.Ratio | Mapping[str, Any]  # {"ratio": float, "interval95": [low, high]}
Verdict = Literal["better", "worse", "open", "equal"]

MISSING = "–"
SYMBOLS = {
    r"\bsqrt\((\w+)\)": r"√\1",
    r"\bdegC\b": "°C",
    r"^deg$|\bdeg(?=/)|(?<=\[)deg(?=\])|(?<=\d) deg(?:rees)?\b(?!/)": "°",
    r"\bug\b": "µg",
    r"\burad\b": "µrad",
    r"\+-": "±",
    r"(?<= )<=(?= )": "≤",
    r"(?<= )>=(?= )": "≥",
    r"(?<=[\w)])\^2\b": "²",
    r"(?<=[\w)])\^3\b": "³",
    r"(?<![\w.,=([−/-])(?<![,=] )-(?=\d)": "−",
}
COPIED = re.compile(r"(--assume \S+)")  # what a user may type as it stands
POWER = re.compile(r"(?<![\w.=])(?<!= )(\d(?:\.\d+)?)e([+−-]?)0*(\d{1,3})\b")  # 4.4e-16
SUPERSCRIPTS = str.maketrans("0123456789-−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁻", "+")
MOST_DECIMALS = 3  # of a change in per cent
SHORT_VERDICT: dict[Verdict, str] = {
    "better": "better",
    "worse": "worse",
    "open": "not established",
    "equal": "no difference",
}


def verdict(ratio: Ratio) -> Verdict:
    """What a ratio of errors (below 1: smaller error) and its 95 % interval establish."""
    _, low, high = _three(ratio)
    if low == high == 1.0:
        return "equal"
    if high < 1.0:
        return "better"
    return "worse" if low > 1.0 else "open"


def change(ratio: Ratio) -> str:
    """A ratio as a change in per cent with its interval, such as ``−19 % [−24, −14]``."""
    value, low, high = _alike([100.0 * (x - 1.0) for x in _three(ratio)], signed=True)
    return f"{value} % [{low}, {high}]"


def effect(who: str, what: str, ratio: Ratio) -> str:
    """``<who> lowers <what> by 19 % (95 % interval 14 to 24 %)``, or what else the interval allows to say."""
    middle, low, high = _three(ratio)
    decided = verdict(ratio)
    if decided == "equal":
        return f"{who} leaves {what} exactly as it is"
    if decided == "better":
        value, least, most = _alike([100.0 * (1.0 - x) for x in (middle, high, low)])
        return f"{who} lowers {what} by {value} % (95 % interval {least} to {most} %)"
    if decided == "worse":
        value, least, most = _alike([100.0 * (x - 1.0) for x in (middle, low, high)])
        return f"{who} raises {what} by {value} % (95 % interval {least} to {most} %)"
    value, least, most = _alike([100.0 * (x - 1.0) for x in (middle, low, high)], signed=True)
    return f"{who} changes {what} by {value} % (95 % interval {least} to {most} %)"


def certainty(ratio: Ratio) -> str:
    """The short judgement that follows `effect`."""
    return {
        "better": "the difference is real",
        "worse": "it is worse, and the difference is real",
        "open": "a difference is not established",
        "equal": "there is no difference",
    }[verdict(ratio)]


def at_most(ratio: Ratio) -> float:
    """The largest change in per cent, of either sign, that the 95 % interval leaves possible."""
    _, low, high = _three(ratio)
    return 100.0 * max(abs(low - 1.0), abs(high - 1.0))


def with_interval(entry: Estimate | Statistic | None, digits: int = 2) -> str:
    """``1.26 [1.18, 1.35]``; the value alone where there is no interval."""
    if entry is None:
        return MISSING
    if isinstance(entry, Estimate):
        entry = entry.as_tree()
    if not isinstance(entry, Mapping):
        return fixed(entry, digits)
    value = entry.get("value", entry.get("ratio"))
    interval = entry.get("interval95")
    text = fixed(value, digits)
    return text if interval is None else f"{text} [{fixed(interval[0], digits)}, {fixed(interval[1], digits)}]"


def fixed(value: float | None, digits: int = 2) -> str:
    """A number with fixed decimals, a real minus sign, and a dash where it is missing."""
    if value is None:
        return MISSING
    text = f"{value:.{digits}f}"
    return (text.lstrip("-") if float(text) == 0.0 else text).replace("-", "−")


def significant(value: float, count: int = 3) -> str:
    """A number with `count` significant figures and no exponent."""
    if value == 0.0:
        return "0"
    return rounded(value, count - 1 - floor(log10(abs(value))))


def rounded(value: float, digits: int) -> str:
    """A number with so many decimals; below none, whole tens, hundreds and so on."""
    return fixed(round(value, digits), max(0, digits))


def in_three(value: float, digits: int) -> str:
    """A number with at most so many decimals and three significant figures."""
    return fixed(value, digits) if abs(value) < 1.0 else rounded(value, min(digits, 2 - floor(log10(abs(value)))))


def alike(value: float, interval: Sequence[float] | None) -> tuple[str, str, str]:
    """A value and its interval with the digits that the interval leaves meaning to; without one in three."""
    if interval is None:
        return significant(value), "", ""
    half = 0.5 * (interval[1] - interval[0])
    digits = min(-floor(log10(half / 2.0)), 6) if half > 0.0 else 6
    return tuple(rounded(x, digits) for x in (value, *interval))


def small(value: float | None, unit: str) -> str:
    """A magnitude of unknown size in two digits and a readable unit: ``0.31 mm``, ``12 m``."""
    if value is None:
        return MISSING
    if value == 0.0:
        return f"below 1 n{unit}"
    for factor, prefix in ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n")):
        if abs(value) >= 0.1 * factor:
            scaled = value / factor
            return f"{scaled:.0f} {prefix}{unit}" if abs(scaled) >= 10.0 else f"{scaled:.2g} {prefix}{unit}"
    return f"{value:.1e} {unit}"


def percent(entry: Statistic | float) -> str:
    """A fraction as ``69 % [62, 75]``, in whole per cent."""
    if not isinstance(entry, Mapping):
        return f"{100.0 * entry:.0f} %"
    text = f"{100.0 * entry['value']:.0f} %"
    interval = entry.get("interval95")
    return text if interval is None else f"{text} [{100.0 * interval[0]:.0f}, {100.0 * interval[1]:.0f}]"


def joined(items: Sequence[str]) -> str:
    """``a, b and c``."""
    return items[0] if len(items) == 1 else ", ".join(items[:-1]) + " and " + items[-1]


def sentence(text: str) -> str:
    """With a capital at the start and one full stop at the end, or its question mark."""
    return text[:1].upper() + text[1:].rstrip(".") + ("" if text.endswith("?") else ".")


def in_symbols(text: str) -> str:
    """Words of the package, which keep to ASCII, with the signs of units as a reader knows them: ``µg/°C²``, ``°/√h``.

    Every page, text and figure passes its words through here.
    """
    parts = COPIED.split(text)
    for k, part in enumerate(parts[::2]):
        for plain, sign in SYMBOLS.items():
            part = re.sub(plain, sign, part)
        parts[2 * k] = POWER.sub(_power, part)
    return "".join(parts)


def _power(found: re.Match[str]) -> str:
    """``4.4 × 10⁻¹⁶`` of ``4.4e-16``, ``10⁶`` of ``1e6``."""
    number, sign, exponent = found.groups()
    power = f"10{(sign + exponent).translate(SUPERSCRIPTS)}"
    return power if number == "1" else f"{number} × {power}"


def unbroken(text: str) -> str:
    """With no-break spaces between a number and its unit, so that no line ends between them; ``Table 7`` too."""
    text = re.sub(r"\b(Paper|Table|Fig\.) (?=[\dA])", "\\1\u00a0", text)
    text = re.sub(
        r"(?<=,) (?=[−+]?[\d.]+\])|(?<=\d) (?=× 10)|(?<=\d ×) (?=10)|(?<=\bnot) (?=established\b)", "\u00a0", text
    )  # [0.5, 0.7]
    text = re.sub(r"(?<=\d) ± (?=\d)", "\u00a0±\u00a0", text)
    units = r"%|m/s²?|nmi/h|nmi|Hz|min|°C|°|°/[sh]|µ?g|ppm|nats?|σ|dB|V|h|[mkµn]?[ms]|[mkµ]m²|mm/s"
    return re.sub(rf"(?<=\d) (?=(?:{units})(?!\w))", "\u00a0", text)


def _three(ratio: Ratio) -> tuple[float, float, float]:
    """Ratio, low and high end."""
    return ratio[:3] if isinstance(ratio, tuple) else (ratio["ratio"], *ratio["interval95"])


def _alike(values: Sequence[float], signed: bool = False) -> list[str]:
    """The values with the fewest common decimals at which none that is not 0 prints as 0."""
    digits = 0
    while digits < MOST_DECIMALS and any(v != 0.0 and round(v, digits) == 0.0 for v in values):
        digits += 1
    if all(round(v, digits) == 0.0 for v in values):
        digits = 0
    return [("+" if signed and round(v, digits) > 0 else "") + fixed(v, digits) for v in values]
