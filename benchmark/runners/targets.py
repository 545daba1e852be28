"""What the diagnosis must reach on concealed effects, and whether it does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from benchmark.scores.score import CLEAR, SETS_ALL, SETS_EACH, SETS_EXTRA, SETS_MISSING, TWINS
from ins_eval.report.content import Table
from ins_eval.tables import pick
from ins_eval.wording import MISSING, fixed

MET, MISSED, OPEN = "met", "missed", "no cases"
NO_BREAK = "\u00a0"
TONES = {MET: "good", MISSED: "bad", OPEN: "quiet"}


@dataclass(frozen=True)
class Target:
    """A line of the requirement: where its number stands in the result, and the range that it must lie in."""

    line: str
    words: str
    path: tuple[str, ...]
    least: float = 0.0
    most: float = 1.0

    @property
    def goal(self) -> str:
        shown: Callable[[float], str] = _percent if self.path[-1] not in ("mean", "0.5") else lambda x: f"{x:g}"
        if self.least and self.most < 1.0:
            return f"{shown(self.least)} to {shown(self.most)}"
        return f"at least {shown(self.least)}" if self.least else f"at most {shown(self.most)}"


TARGETS = (
    Target("6c", "'unexplained' or the driving column, D of at least 8",
           ("outside", "unexplained or the driving column, D >= 8"), 0.85),
    Target("6c", "confidently wrong outside the vocabulary", ("outside", "confidently wrong"), most=0.10),
    Target("5b", "false alarms, plain nulls", ("false alarms", "null"), most=0.03),
    Target("5b", "false alarms, adversarial nulls", ("false alarms", "adversarial"), most=0.10),
    Target("6a", "detected, D of at least 16", ("detection", f"inside the vocabulary, {CLEAR}"), 0.98),
    Target("6b", "named first where separable, one recording",
           ("naming", "named first where separable, one recording"), 0.95),
    Target("6b", "named first where separable, several recordings",
           ("naming", "named first where separable, several recordings"), 0.98),
    Target("6b", "of the detected, truth named or listed", ("naming", "named or listed, of the detected"), 0.98),
    Target("6b", "explanations named or listed, mean", ("set size", "mean"), most=2.5),
    Target("6b", "rivals that cannot be separated, listed", ("naming", "inseparable rival listed"), 0.80),
    Target("6b", "what at any size fits as well as the truth, listed, D of at least 16", ("naming", TWINS), 0.95),
    Target("6b", "probability given to the truth, mean", ("probability of the truth", "mean"), 0.8),
    Target("6c", "confidently wrong inside the vocabulary", ("confidently wrong", "inside"), most=0.02),
    Target("6e", "said to be not identifiable, with a true rival, D of at least 8",
           ("not identifiable", "said so, with the truth and a true rival, D >= 8"), 0.90),
    Target("6e", "the recommended experiment separates", ("experiments", "separates"), 0.80),
    Target("6d", "95 % intervals that hold the truth", ("coverage", "all"), 0.90, 0.98),
    Target("5c", "channel and axis right, D of at least 16", ("location", f"channel, {CLEAR}"), 0.95),
    Target("5c", "intersection over union, median, D of at least 16", ("overlap", CLEAR, "quantiles", "0.5"), 0.85),
    Target("6d", "share of its energy that an answer removes from another such recording, median",
           ("energy", "quantiles", "0.5"), 0.80),
    Target("6d", "share of the excess removed on unused data, median", ("removed", "quantiles", "0.5"), 0.80),
    Target("6d", "better than the placebo on unused data", ("held out", "better than the placebo"), 0.95),
    Target("6d", "velocity RMS: share of what the truth gains, median",
           ("navigation", "velocity_rms_mps", "quantiles", "0.5"), 0.50),
    Target("7a", "of several effects each of at least 12 sigma beside the others, named or listed",
           ("sets", SETS_EACH), 0.90),
    Target("7b", "all of at least 12 sigma, two effects", ("sets", f"pair: {SETS_ALL}"), 0.80),
    Target("7b", "all of at least 12 sigma, three effects", ("sets", f"triple: {SETS_ALL}"), 0.70),
    Target("7b", "all of at least 12 sigma, four effects", ("sets", f"four: {SETS_ALL}"), 0.70),
    Target("7c", "something named that is not there, several effects", ("sets", SETS_EXTRA), most=0.05),
    Target("7d", "'explained' with one of at least 12 sigma missing", ("sets", SETS_MISSING), most=0.03),
)  # fmt: skip


def found(target: Target, result: dict):
    """The rate or the number that a target is about, None where no case has it."""
    value = pick(result, *target.path)
    return None if isinstance(value, dict) and not value["count"] else value


def verdict(target: Target, result: dict) -> str:
    """Whether the point estimate lies in the range; its interval stands beside it."""
    value = found(target, result)
    if value is None:
        return OPEN
    at = value["rate"] if isinstance(value, dict) else value
    top = float("inf") if target.least and target.most == 1.0 else target.most
    return MET if target.least <= at <= top else MISSED


def table(result: dict, *paths: str) -> list[Table]:
    """The targets whose numbers stand in the groups `paths`."""
    chosen = [one for one in TARGETS if one.path[0] in paths or one.words in paths]
    return [rows(chosen, result)] if chosen else []


def rows(targets: Sequence[Target], result: dict) -> Table:
    cells, tones = [], []
    for one in targets:
        value, said = found(one, result), verdict(one, result)
        cells.append((one.line, one.words, one.goal.replace(" ", NO_BREAK), *_spoken(one, value, result), said))
        tones.append(TONES[said])
    header = ("line", "what", "target", "cases", "found", "95 % interval", "verdict")
    return Table("Targets", header, cells, align="lllrrrl", tones=tones)


def _spoken(target: Target, value, result: dict) -> tuple[str, str, str]:
    """As `spoken`; the cases of a mean or a median stand beside it in the result."""
    if value is None or isinstance(value, dict):
        return spoken(value)
    above = pick(result, *target.path[: -2 if "quantiles" in target.path else -1])
    return str(above["count"]), fixed(value, 2), MISSING


def spoken(value) -> tuple[str, str, str]:
    """Cases, value and interval of a rate."""
    if value is None:
        return MISSING, MISSING, MISSING
    if not value["count"]:
        return "0", MISSING, MISSING
    low, high = value["interval95"]
    return f"{value['hits']} of {value['count']}", _percent(value["rate"]), f"{_percent(low)} to {_percent(high)}"


def _percent(value: float) -> str:
    return f"{100.0 * value:.2g} %" if value < 0.01 else f"{100.0 * value:.1f} %".replace(".0 %", " %")
