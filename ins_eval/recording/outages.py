"""Which rows of fixes are outages that do not say so, or no fixes of their own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ins_eval.recording import Fixes
from ins_eval.recording.computed import without_computed, without_extrapolated
from ins_eval.recording.repeats import without_repeats
from ins_eval.units import DEG

SOLUTION = "solution"
NEAR_RAD = 1.0 * DEG  # of 0 N 0 E: where no fix lies farther away, the place may be real


def measured(fixes: Fixes, name: str) -> tuple[Fixes, list[str]]:
    """The fixes of the table `name` that were measured, and a sentence on each kind of rows that were not."""
    fixes, notes = without_zeros(fixes, name)
    if name != SOLUTION:  # which was computed for every row
        fixes, repeats = without_repeats(fixes, name)
        fixes, held = without_extrapolated(fixes, name)
        fixes, computed = without_computed(fixes, name)
        notes += [*repeats, *held, *computed]
    return fixes, notes


def without_zeros(fixes: Fixes, name: str) -> tuple[Fixes, list[str]]:
    """The fixes with those at exactly 0 N 0 E, which receivers without a fix write, as outages; and what was found.

    Where every fix lies near 0 N 0 E they are taken as a place. `name` is that of the table.
    """
    zero = fixes.valid & (fixes.latitude_rad == 0.0) & (fixes.longitude_rad == 0.0)
    if not zero.any():
        return fixes, []
    far = fixes.valid & (np.maximum(np.abs(fixes.latitude_rad), np.abs(fixes.longitude_rad)) > NEAR_RAD)
    first_s = fixes.time_s[np.argmax(zero)]
    rows = f"Rows of {name} at exactly 0° N 0° E: {np.count_nonzero(zero)}, first at {first_s:.6g} s"
    if not far.any():
        return fixes, [f"{rows}; they are taken as a place, since no fix lies farther than 1° from it."]
    outages = replace(fixes, valid=fixes.valid & ~zero)
    return outages, [f"{rows}; they count as an outage, since a receiver without a fix writes zeros."]


def stated_valid(
    flag: np.ndarray, there: np.ndarray, name: str, number: Callable[[int], int]
) -> tuple[np.ndarray, list[str]]:
    """Which rows a column of validity `flag` (m,) states as valid, and what is to be said of those it leaves open.

    An empty one is an outage. `there` (m,) are the rows that hold a value, `number` gives that of a row in the file.
    """
    stated = np.nan_to_num(flag) != 0.0
    empty = np.isnan(flag) & there
    if not empty.any():
        return stated, []
    return stated, [
        f"Rows of {name} that state nothing in the column of validity: {np.count_nonzero(empty)}, first row "
        f"{number(int(np.argmax(empty)))}; they count as an outage; write 1 where a fix is valid."
    ]
