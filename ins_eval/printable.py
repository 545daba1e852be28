"""Text from outside made fit for a terminal, a figure and a page: nothing in it acts, and nothing is without end."""

from __future__ import annotations

import json
import unicodedata
from collections.abc import Collection

# Unicode categories: control, format (text direction), surrogate, line and paragraph separators
ACTING = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})
LONGEST_SENTENCE = 1500  # characters: two paths of the usual 255 and a sentence of a screen's height
LONGEST_VALUE = 40  # characters: half a line of a terminal
MOST_LISTED = 12  # names, for the same reason


def printable(text: str, keep: str = "") -> str:
    """The text with every character that would act rather than print as its escape; those in `keep` stay."""
    acting = {c for c in set(text) if unicodedata.category(c) in ACTING} - set(keep)
    return text.translate({ord(c): c.encode("unicode_escape").decode("ascii") for c in acting}) if acting else text


def shortened(text: str, most: int) -> str:
    """A text of at most `most` characters: its middle is left out, since a sentence begins and ends with sense."""
    if len(text) <= most:
        return text
    head = (most - 5) * 2 // 3
    return f"{text[:head]} ... {text[head + 5 - most :]}"


def shown(value: object) -> str:
    """A value of a file as it can be printed in a sentence: on one line, in ASCII, not long."""
    text = json.dumps(value) if isinstance(value, str) else ascii(value)
    text = f"'{text[1:-1]}'" if isinstance(value, str) else text
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 4]}...{text[-1]}"


def listed(names: Collection[str]) -> str:
    """Names apart by commas; of many the first."""
    first = [shortened(name, LONGEST_VALUE) for name in list(names)[:MOST_LISTED]]
    return ", ".join(first) + (f" and {len(names) - MOST_LISTED} more" if len(names) > MOST_LISTED else "")
