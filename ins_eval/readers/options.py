"""Values that a user assumes with ``--assume KEY=VALUE``, read as numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ins_eval.errors import UsageError
from ins_eval.recording.begin import NAMES


def number(assumed: Mapping[str, str], key: str, default: float) -> float:
    """The number assumed for `key`, or `default`."""
    if key not in assumed:
        return default
    try:
        value = float(assumed[key])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UsageError(f"--assume {key}={assumed[key]}: is not a number; give one, such as {key}={default:g}")
    return value


def believed_time_offset(table: str, assumed: Mapping[str, str], otherwise: str) -> tuple[float, str]:
    """The clock offset to believe of gps or reference, s, and the sentence that says why."""
    key, named = f"{table}.time_offset_s", NAMES[table]
    offset_s = number(assumed, key, 0.0)
    if key in assumed:
        return offset_s, f"The clock offset of {named} is believed to be {offset_s:g} s, because you assume so."
    return (
        0.0,
        f"The clock offset of {named} is taken as 0 s, because {otherwise}; --assume {key}=SECONDS sets another.",
    )
