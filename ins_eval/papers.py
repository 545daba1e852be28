"""One statement of a paper beside what it gives when computed again, and beside ours."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal

Verdict = Literal["reproduced", "not reproduced", "the paper contradicts itself"]
REPRODUCED: Verdict = "reproduced"
NOT_REPRODUCED: Verdict = "not reproduced"
CONTRADICTS: Verdict = "the paper contradicts itself"
VERDICTS: tuple[Verdict, ...] = (REPRODUCED, NOT_REPRODUCED, CONTRADICTS)

VERDICT_RULE = """\
"The paper contradicts itself": a number computed again from the paper's own numbers is not the printed one, or two \
of its statements exclude one another. This goes before the other two.
"Reproduced": our simulation gives the printed number inside the interval stated, and no number of the simulation was \
chosen after it; or the printed arithmetic, statement or procedure holds when it is computed again. A printed number \
of a single unit, flight or oven run is held against the central 95 % of ours; this is said in its row, for such an \
interval is wide and one number inside it proves little.
"Not reproduced": everything else, also what cannot be computed here or went into the simulation ("taken as given"). \
"About x" means x to its last printed digit.
"""

NOT_COMPUTED = "Not computed in this run."
GIVEN = "Taken as given: "


@dataclasses.dataclass(frozen=True)
class Row:
    """One statement; `printed`, `recomputed` and `ours` in `unit`, or in words where a number cannot say it.

    `recomputed` follows from the paper's own numbers alone. `interval95` belongs to `ours`; `reason` says of what.
    """

    id: str
    group: str
    title: str
    printed: float | str | None
    recomputed: float | str | None
    ours: float | str | None
    interval95: tuple[float, float] | None
    verdict: Verdict
    reason: str
    unit: str = ""


Number = float | str | None
Estimate = Mapping[str, Any]
Groups = Mapping[str, Sequence[Callable[..., Iterable[Row]]]]  # what makes the rows of each group


def assembled(groups: Groups, required: Sequence[str], *computed: Mapping) -> list[Row]:
    """All rows that the groups make of what was `computed`, in the order of `required`.

    There stand their ids, or what is before the first "/" of them.
    """
    found = [
        dataclasses.replace(row, group=group)
        for group, parts in groups.items()
        for make in parts
        for row in make(*computed)
    ]
    return sorted(found, key=lambda row: required.index(row.id.partition("/")[0]))


def find(tree: Any, *keys: str) -> Any:
    """What stands below the keys of nested mappings, or None where one of them is missing."""
    for key in keys:
        if not isinstance(tree, Mapping) or key not in tree:
            return None
        tree = tree[key]
    return tree


def row(
    id: str,
    title: str,
    verdict: Verdict,
    reason: str,
    *,
    printed: Number = None,
    recomputed: Number = None,
    ours: Number | Estimate = None,
    unit: str = "",
) -> Row:
    """A row whose verdict is known; its group is set when the groups are put together."""
    value, interval = _split(ours)
    return Row(id, "", title, _plain(printed), _plain(recomputed), value, interval, verdict, reason, unit)


def decided(
    id: str, title: str, holds: bool | None, reason: str | None, otherwise: Verdict = NOT_REPRODUCED, **numbers: Any
) -> Row:
    """Reproduced where the statement `holds`, else `otherwise`; None where what decides was not computed.

    So ``tree and tree["a"] > tree["b"]`` and ``tree and f"..."`` may be given for `holds` and `reason`.
    """
    if holds is None:
        return row(id, title, NOT_REPRODUCED, NOT_COMPUTED, **{**numbers, "ours": None})
    return row(id, title, REPRODUCED if holds else otherwise, reason, **numbers)


def simulated(
    id: str, title: str, printed: float, ours: Estimate | None, interval_of: str, reason: str = "", **numbers: Any
) -> Row:
    """A printed number against the interval of ours: reproduced where it lies inside."""
    if ours is None:
        return row(id, title, NOT_REPRODUCED, NOT_COMPUTED, printed=printed, **numbers)
    low, high = ours["interval95"]
    inside = low <= printed <= high
    sentence = (
        f"The printed {printed:.5g} lies {'inside' if inside else 'outside'} {interval_of}, "
        f"{number(low)} to {number(high)}."
    )
    verdict = REPRODUCED if inside else NOT_REPRODUCED
    return row(id, title, verdict, f"{sentence} {reason}".strip(), printed=printed, ours=ours, **numbers)


def given(id: str, title: str, why: str, **numbers: Any) -> Row:
    """What went into the simulation or cannot be computed here."""
    return row(id, title, NOT_REPRODUCED, GIVEN + why, **numbers)


def same(printed: float, computed: float, last_digit: float) -> bool:
    """Whether a number rounds to the printed one, whose last digit counts `last_digit`."""
    return abs(printed - computed) <= 0.5 * last_digit * (1.0 + 1e-9)


def number(value: float, digits: int = 3) -> str:
    """A number in a sentence: so many significant digits, whole ones never cut."""
    if value == 0.0:
        return "0"
    if abs(value) >= 10.0 ** (digits - 1):
        return f"{value:.0f}"
    return f"{value:#.{digits}g}".rstrip(".") if abs(value) >= 1e-3 else f"{value:.{digits - 1}e}"


def between(estimate: Estimate, digits: int = 3) -> str:
    """An estimate in a sentence, with its interval."""
    low, high = estimate["interval95"]
    return f"{number(estimate['value'], digits)} ({number(low, digits)} to {number(high, digits)})"


def listed(values: Sequence[float], digits: int = 3) -> str:
    """Numbers in a sentence, separated by strokes."""
    return " / ".join(number(v, digits) for v in values)


def percent_off(ratio: Mapping | None) -> dict[str, Any] | None:
    """What a ratio ("ratio" or "value", "interval95") of new over old takes off the old, in %, as an estimate."""
    if ratio is None:
        return None
    low, high = ratio["interval95"]
    value = ratio["ratio"] if "ratio" in ratio else ratio["value"]
    return {"value": 100.0 * (1.0 - value), "interval95": [100.0 * (1.0 - high), 100.0 * (1.0 - low)]}


def as_printed(values: Sequence[float]) -> str:
    """Printed numbers in a sentence, with all their digits."""
    return " / ".join(f"{v:g}" for v in values)


def _split(ours: Any) -> tuple[float | str | None, tuple[float, float] | None]:
    if isinstance(ours, Mapping):
        low, high = ours["interval95"]
        return float(ours["value"]), (float(low), float(high))
    return _plain(ours), None


def _plain(value: Any) -> float | str | None:
    return value if value is None or isinstance(value, str) else float(value)
