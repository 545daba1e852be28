"""One statement of a paper beside what it gives when computed again, and beside ours."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

Verdict = Literal[
    "reproduced", "compatible, but the test has little power", "not reproduced", "the paper contradicts itself"
]
REPRODUCED: Verdict = "reproduced"
COMPATIBLE: Verdict = "compatible, but the test has little power"
NOT_REPRODUCED: Verdict = "not reproduced"
CONTRADICTS: Verdict = "the paper contradicts itself"
VERDICTS: tuple[Verdict, ...] = (REPRODUCED, COMPATIBLE, NOT_REPRODUCED, CONTRADICTS)

VERDICT_RULE = """\
"The paper contradicts itself": a number computed again from the paper's own numbers is not the printed one, or two \
of its statements exclude one another. This goes before the other three.
"Reproduced": a test that could have failed has passed. Our simulation gives the printed number inside the interval \
stated, or the printed arithmetic, statement or procedure holds when it is computed again. Each row says which printed \
values would have passed, or what would have made it fail.
"Compatible, but the test has little power": the test passed, but it could hardly have failed. This holds for a row \
whose passing range includes zero (or the injected value, where the finding is the distance from it), or both half and \
double the printed number; for a claim that only part of our interval supports; and for a row for which a number of \
the simulation was chosen after seeing the printed one. A printed number of a single unit, flight or oven run is \
compared with the central 95 % of ours, which is often that wide.
"Not reproduced": everything else, including what cannot be computed here, what is not a claim that could fail, and \
what went into the simulation ("taken as given"). "About x" means x to its last printed digit.
"""

NOT_COMPUTED = "Not computed in this run."
GIVEN = "Taken as given: "


@dataclasses.dataclass(frozen=True)
class Row:
    """One statement; `printed`, `recomputed` and `ours` in `unit`, or in words where a number cannot say it.

    `recomputed` follows from the paper's own numbers alone. `interval95` belongs to `ours`; `reason` says of what.
    `passes` are the ends of the printed values that would have passed the test, `fails` says what would have made a
    claim in words fail ("it would have failed if ..."), and `chosen` which numbers of the simulation were chosen with
    the printed ones in view.
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
    passes: tuple[float, float] | None = None
    fails: str = ""
    chosen: str = ""


Number = float | str | None
Estimate = Mapping[str, Any]


def assembled(rows: Iterable[Row], required: Sequence[str], chosen: Mapping[str, str]) -> list[Row]:
    """The rows in the order of `required`, where their ids stand, or what is before the first "/" of them.

    `chosen` says by the same which numbers of the simulation were chosen with these rows in view.
    """
    marked = [_marked(row, chosen.get(head(row.id), "")) for row in rows]
    return sorted(marked, key=lambda row: required.index(head(row.id)))


def head(id: str) -> str:
    """The table, equation, figure or claim to which a row belongs."""
    return id.partition("/")[0]


def _marked(row: Row, chosen: str) -> Row:
    """The row with the mark, where it has a number of the simulation; then it is not reproduced, at most compatible."""
    if not chosen or row.ours is None or row.verdict == CONTRADICTS:
        return row
    verdict = COMPATIBLE if row.verdict == REPRODUCED else row.verdict
    return dataclasses.replace(row, chosen=chosen, verdict=verdict)


def weakness(printed: float, passes: Sequence[float], nothing: float = 0.0) -> str:
    """Why a test that lets a range of printed values pass could hardly have failed; empty where it could.

    The range holds zero, or both half and double the printed value; or that is so of the distances from `nothing`, the
    value that would say that there is nothing to be found.
    """
    low, high = passes
    for origin in dict.fromkeys((0.0, nothing)):
        of = "" if origin == 0.0 else f" the distance from {number(origin)}"
        if low <= origin <= high:
            return f"The range that passes holds {'zero' if not of else f'{number(origin)}, where nothing is found'}."
        if all(low <= origin + part * (printed - origin) <= high for part in (0.5, 2.0)):
            return f"The range that passes holds both half and double{of or ' the printed value'}."
    return ""


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
    """A row whose verdict is known and needs no test; `judged` adds one.

    Its group is set when the groups are put together. Raises ValueError for a reproduced row, which takes a test.
    """
    if verdict == REPRODUCED:
        raise ValueError(f"{id}: reproduced, but nothing says how it could have failed; use `judged`")
    value, interval = _split(ours)
    return Row(id, "", title, _plain(printed), _plain(recomputed), value, interval, verdict, reason, unit)


def judged(
    untested: Row, verdict: Verdict, *, passes: Sequence[float] | None = None, nothing: float = 0.0, fails: str = ""
) -> Row:
    """A row with the verdict of a test, but that it is compatible and not reproduced where that has a `weakness`.

    Raises ValueError where a reproduced row states neither what would have passed nor what would have made it fail.
    """
    reason = untested.reason
    if verdict == REPRODUCED:
        if passes is None and not fails:
            raise ValueError(
                f"{untested.id}: reproduced, but nothing says how it could have failed; give `passes` or `fails`"
            )
        if passes is not None and (weak := weakness(untested.printed, passes, nothing)):
            verdict, reason = COMPATIBLE, f"{reason} {weak}"
    ends = None if passes is None else (float(passes[0]), float(passes[1]))
    return dataclasses.replace(untested, verdict=verdict, reason=reason, passes=ends, fails=fails)


def decided(
    id: str,
    title: str,
    holds: bool | None,
    reason: str | None,
    otherwise: Verdict = NOT_REPRODUCED,
    *,
    fails: str,
    passes: Sequence[float] | None = None,
    **numbers: Any,
) -> Row:
    """Reproduced where the statement `holds`, else `otherwise`; None where what decides was not computed.

    So ``tree and tree["a"] > tree["b"]`` and ``tree and f"..."`` may be given for `holds` and `reason`.
    `fails` ends the sentence "It would have failed if ...".
    """
    if holds is None:
        missing = row(id, title, NOT_REPRODUCED, NOT_COMPUTED, **{**numbers, "ours": None})
        return judged(missing, NOT_REPRODUCED, passes=passes, fails=fails)
    untested = row(id, title, otherwise, reason, **numbers)
    return judged(untested, REPRODUCED if holds else otherwise, passes=passes, fails=fails)


def claimed(
    id: str,
    title: str,
    ours: Estimate | None,
    reason: str | None,
    *,
    above: float | None = None,
    below: float | None = None,
    what: str = "ours",
    **numbers: Any,
) -> Row:
    """A claim that a quantity of ours lies `above` or `below` a value.

    Reproduced where its whole interval does, not reproduced where none of it does, and compatible between the two:
    then the interval allows the claim and its opposite. `what` names the quantity.
    """
    side, limit = ("above", above) if above is not None else ("below", below)
    fails = f"the interval of {what} had reached {number(limit)}"
    if ours is None:
        return judged(row(id, title, NOT_REPRODUCED, NOT_COMPUTED, **numbers), NOT_REPRODUCED, fails=fails)
    low, high = ours["interval95"] if above is not None else [-end for end in reversed(ours["interval95"])]
    least = limit if above is not None else -limit
    verdict = REPRODUCED if low > least else COMPATIBLE if high > least else NOT_REPRODUCED
    if verdict != REPRODUCED:
        part = "only a part of it does" if verdict == COMPATIBLE else "none of it does"
        reason = f"{reason} The interval of {what} has to lie {side} {number(limit)}; {part}."
    return judged(row(id, title, NOT_REPRODUCED, reason, ours=ours, **numbers), verdict, fails=fails)


def simulated(
    id: str,
    title: str,
    printed: float,
    ours: Estimate | None,
    interval_of: str,
    reason: str = "",
    nothing: float = 0.0,
    **numbers: Any,
) -> Row:
    """A printed number against the interval of ours: reproduced where it lies inside, if the test could have failed."""
    if ours is None:
        return row(id, title, NOT_REPRODUCED, NOT_COMPUTED, printed=printed, **numbers)
    low, high = ours["interval95"]
    inside = low <= printed <= high
    sentence = (
        f"The printed {printed:.5g} lies {'inside' if inside else 'outside'} {interval_of}, "
        f"{number(low)} to {number(high)}."
    )
    verdict = REPRODUCED if inside else NOT_REPRODUCED
    untested = row(id, title, NOT_REPRODUCED, f"{sentence} {reason}".strip(), printed=printed, ours=ours, **numbers)
    return judged(untested, verdict, passes=(low, high), nothing=nothing)


def recalculated(
    id: str,
    title: str,
    printed: float,
    computed: float,
    last_digit: float,
    reason: str,
    **numbers: Any,
) -> Row:
    """A printed number against what the paper's own numbers give: it has to be that, rounded to its last digit."""
    slack = 0.5 * last_digit * (1.0 + 1e-9)
    verdict = REPRODUCED if same(printed, computed, last_digit) else CONTRADICTS
    passes = (computed - slack, computed + slack)
    untested = row(id, title, CONTRADICTS, reason, printed=printed, recomputed=computed, **numbers)
    return judged(untested, verdict, passes=passes)


def given(id: str, title: str, why: str, **numbers: Any) -> Row:
    """What went into the simulation, cannot be computed here, or is a definition or a step that cannot fail."""
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


def percent_off(ratio: Mapping | None) -> dict[str, Any] | None:
    """What a ratio ("ratio" or "value", "interval95") of new over old takes off the old, in %, as an estimate."""
    if ratio is None:
        return None
    low, high = ratio["interval95"]
    value = ratio["ratio"] if "ratio" in ratio else ratio["value"]
    return {"value": 100.0 * (1.0 - value), "interval95": [100.0 * (1.0 - high), 100.0 * (1.0 - low)]}


def _split(ours: Any) -> tuple[float | str | None, tuple[float, float] | None]:
    if isinstance(ours, Mapping):
        low, high = ours["interval95"]
        return float(ours["value"]), (float(low), float(high))
    return _plain(ours), None


def _plain(value: Any) -> float | str | None:
    return value if value is None or isinstance(value, str) else float(value)
