"""What the page of a quick set says: the score beside that of the whole set, five cases drawn, and every case."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from benchmark.runners import bound
from benchmark.runners.figures import short
from benchmark.runners.pages import CASES, CASES_ALIGN, case_rows, number, seconds
from benchmark.runners.targets import spoken
from benchmark.scores.predictive import Compared
from benchmark.scores.score import CLEAR, rate
from ins_eval.figures.diagnosis import before_and_after, whitened_residuals
from ins_eval.figures.side_by_side import Value, side_by_side
from ins_eval.figures.style import ACCENT
from ins_eval.parallel import results
from ins_eval.report.content import Picture, Section, Table, at_a_glance, table
from ins_eval.report.diagnosis_words import channel, nats
from ins_eval.vocabulary import CHANNELS_MEASURED

SCORE = Picture("score", "The rates of these cases, and the range that the score of the whole set allows.")
MOST = 5
BLOCK_S = 60.0
Record = Mapping[str, Any]
# why a case is worth a look, which cases it holds for, and by what the one is taken: the largest of all
FAILED: tuple[tuple[str, Callable], ...] = (
    ("confidently wrong", lambda one: one["wrong"] and (one["inside"] or one["kind"] == "outside")),
    ("a false alarm", lambda one: one["false alarm"]),
    ("not detected, though D is at least 16", lambda one: one["inside"] and one["band"] == CLEAR and not one["heard"]),
    ("detected, and the truth is neither named nor listed", lambda one: one["heard"] and one.get("found") is False),
)
TELLING: tuple[tuple[str, Callable, int], ...] = (
    ("the faintest effect that is named first", lambda one: one.get("first"), -1),
    ("the clearest effect that is not detected", lambda one: one["inside"] and not one["heard"], 1),
    ("an effect outside the vocabulary", lambda one: one["kind"] == "outside", 1),
    ("an effect of limited duration or axis", lambda one: one["kind"] == "limited", 1),
    ("effects that one recording cannot separate", lambda one: one["verdict"] == "not identifiable", 1),
    ("two effects at once", lambda one: one["kind"] == "pair", 1),
    ("nothing is concealed, and the noise is not as believed", lambda one: one["kind"] == "adversarial", 1),
)


def telling(records: Sequence[dict]) -> list[tuple[str, dict]]:
    """At most `MOST` cases, each with why: all that went wrong first, then one of each kind of answer."""
    found: list[tuple[str, dict]] = []
    ranked = sorted(records, key=lambda one: (-(one["d"] or 0.0), one["case"]))

    def add(why: str, of: Sequence[dict], most: int) -> None:
        new = [one for one in of if all(one is not other for _, other in found)]
        found.extend((why, one) for one in new[:most])

    for why, holds in FAILED:
        add(why, [one for one in ranked if holds(one)], MOST)
    for why, holds, order in TELLING:
        add(why, [one for one in ranked[::order] if holds(one)], 1)
    return found[:MOST]


def sections(
    result: dict, found: Sequence[Compared], chosen: Sequence[tuple[str, dict]], whole: Mapping
) -> list[Section]:
    """The page below its first sentence."""
    rows, tones = [], []
    for one in found:
        count, share, interval = spoken(rate(*one.fresh))
        rows.append((one.name, count, share, interval, f"{one.whole[0]} of {one.whole[1]}",
                     f"{one.least} to {one.most}", "within" if one.inside else "outside"))  # fmt: skip
        tones.append("good" if one.inside else "bad")
    cases = sum(whole["cases"].values())
    note = (
        f"The whole set: seed {', '.join(map(str, whole['seeds']))}, {cases} cases, with longer flights than here. "
        "Allowed: the central range of a beta-binomial distribution after its score; if nothing has changed, all "
        "four rates of 95 % of quick sets are within. The 95 % intervals are exact and use this set alone."
    )
    header = ("rate", "cases", "share", "95 % interval", "whole set", "allowed", "verdict")
    drawn = [Picture(one["case"], f"{why.capitalize()}: {words(one)}") for why, one in chosen]
    numbers = [number(one.name, rate(*one.fresh)) for one in sorted(found, key=lambda one: one.inside) if one.fresh[1]]
    step = "Read first the cases drawn below. If a rate is outside, make concealed scores a whole set, in hours."
    return [
        at_a_glance(numbers, SCORE, step),
        Section("The score", [Table("", header, rows, note, "lrrrrrl", tones=tones)]),
        Section("Five cases", drawn),
        Section("Every case", table("", CASES, case_rows(result["records"]), align=CASES_ALIGN)),
        Section("Time and failures", seconds(result)),
    ]


def score(found: Sequence[Compared]) -> Figure:
    """The rates of these cases with their exact intervals beside what the whole set allows."""
    values = []
    for one in (one for one in found if one.fresh[1]):
        fresh, count = rate(*one.fresh), one.fresh[1]
        own = (100.0 * share for share in (fresh["rate"], *fresh["interval95"]))
        limits = (100.0 * hits / count for hits in (one.least, one.most))
        values.append(Value(one.name, *own, of="these cases"))
        whole = 100.0 * one.whole[0] / one.whole[1]
        values.append(Value(one.name, whole, *limits, of="whole set, with the allowed range", colour=ACCENT))
    return side_by_side(
        values=values, title="The score", rows="rate", axis="share of the cases [%]", note="With 95 % intervals."
    )  # fmt: skip


def words(one: dict) -> str:
    """What is concealed in a case and what is answered, in one sentence."""
    hidden = " and ".join(short(name) for name in one["truth"]) or "nothing"
    d = "" if one["d"] is None or not one["truth"] else f" (D {nats(one['d'])})"
    named = " and ".join(short(name) for name in one["named"])
    return f"{hidden} is concealed{d} in a recording ({one['where']}); answer: {one['verdict']}" + (
        f", {named}." if named else "."
    )


def drawings(chosen: Sequence[tuple[str, dict]], answers: Mapping, cases: Mapping, workers: int) -> dict[str, Figure]:
    """A figure of each case: its whitened residual, with that beside what the answer names where it names something."""
    jobs = {one["case"]: (answers.get(one["case"], {}), cases[one["case"]]) for _, one in chosen}
    seen = dict(results(residuals, jobs, workers))
    return {one["case"]: drawn(one, seen[one["case"]]) for _, one in chosen}


@dataclass(frozen=True)
class Residuals:
    """Whitened residuals (n, 9) at times of nodes, without and with the effects that an answer names, if any.

    `located` is what the answer locates in this recording: begin, end, channel.
    """

    time_s: np.ndarray
    channels: Sequence[str]
    before: np.ndarray
    after: np.ndarray | None
    located: Sequence[tuple[float, float, str]]


def residuals(answer: dict, folders: Sequence[Path]) -> Residuals:
    """Of a recording of a case; of several that in which the mismatch is largest.

    The noise is the same for both; what is uncertain anyway, and the sizes of effects, are at their best.
    """
    from ins_eval.analysis.diagnose import prepare_folders
    from ins_eval.estimation.study import fit_noise

    cases = prepare_folders(list(folders))
    named = [one for effect in answer.get("effects", ()) if (one := bound.answered(effect, cases)) is not None]
    model = [one.scaled(max(1.0, abs(effect["value"] / one.candidate.nominal))) for one, effect in named]
    noise = fit_noise(cases, model, [None] * len(cases))
    seen = [one for one in answer.get("mismatch") or () if one["interval_s"]]
    r = next((k for k, case in enumerate(cases) if seen and case.name == seen[0]["recording"]), 0)
    case, known = cases[r], len(cases[r].nuisances)
    columns = [one.columns[r] for one in model if one.columns[r] is not None]
    kept = case.whitened(columns, noise[r].noise_point, keep=1 + known + len(columns)).kept
    channels = CHANNELS_MEASURED if case.believed is not None else ("accelerometer", *CHANNELS_MEASURED[1:])
    after = at_best(kept) if columns else None
    located = [(*one["interval_s"], channel(one["channel"])) for one in seen if one["recording"] == case.name]
    return Residuals(case.model.nodes_s, channels, at_best(kept[..., : 1 + known]), after, located)


def at_best(kept: np.ndarray) -> np.ndarray:
    """The first column (n, 9) less the others at their best under priors of unit sigma."""
    residual, others = kept[..., 0], kept[..., 1:]
    seen = np.isfinite(residual)
    x = others[seen]
    return residual - others @ np.linalg.solve(np.eye(x.shape[1]) + x.T @ x, x.T @ residual[seen])


def drawn(one: Record, seen: Residuals) -> Figure:
    """Before and after; where nothing is named, the residual with what is located."""
    title = f"Concealed: {', '.join(short(name) for name in one['truth']) or 'nothing'}"
    if seen.after is not None:
        return before_and_after(
            time_s=seen.time_s, before=seen.before, after=seen.after, block_s=BLOCK_S, channels=seen.channels,
            title=title,
        )  # fmt: skip
    return whitened_residuals(
        time_s=seen.time_s, innovations=seen.before, located=seen.located, block_s=BLOCK_S, channels=seen.channels,
        title=title,
    )  # fmt: skip
