"""What the flight report answers, of a user's own model first: the verdict, three numbers, what to do next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, log
from typing import NamedTuple

from ins_eval.figures.style import label
from ins_eval.report import missions
from ins_eval.report.content import Block, Number, Picture, Section, at_a_glance, table
from ins_eval.tables import pick
from ins_eval.vocabulary import CEP, FIRST, HEADLINE, SECOND, VELOCITY, improvement, measure_name, of_ensemble
from ins_eval.wording import (
    MISSING,
    SHORT_VERDICT,
    certainty,
    change,
    effect,
    joined,
    percent,
    sentence,
    verdict,
    with_interval,
)

UNITS = {VELOCITY: "m/s", CEP: "nmi/h"}
MOST_INSTRUMENTS = 100_000  # that anybody would fly to tell two compensations apart


class Rivals(NamedTuple):
    """A compensation and what it is held against, all calibrated alike; `how` says how."""

    own: str
    others: tuple[str, ...]
    how: str


def rivals(metrics: Mapping) -> list[Rivals]:
    """The user's own model beside simple and hysteresis, first as the chamber left them; empty without one."""
    alike = (
        (("simple", "hysteresis"), "all as the chamber left them"),
        (("simple_refined", "hysteresis_refined"), "all with the same oven run"),
    )
    return [Rivals(own, *of) for own, of in zip(metrics.get("own_models", ()), alike, strict=False)]


def answer(metrics: Mapping) -> str:
    """First line the verdict, the others its terms; of the user's own model first."""
    own = [line for of in rivals(metrics) for line in _about(metrics, of)]
    return "\n".join([*own, *_on_missions(metrics), *_built_in(metrics, bool(own))])


def _about(metrics: Mapping, of: Rivals) -> list[str]:
    """What a model of the user's does against the others of its kind."""
    said: list[str] = []
    for other in of.others:
        if ratio := improvement(metrics, f"{of.own}/{other}", VELOCITY):
            who = "It" if said else f"Your model “{label(of.own)}”"
            text = effect(who, "the " + measure_name(VELOCITY), ratio)
            said.append(f"{text} against {label(other)} compensation; {certainty(ratio)}.")
    return [" ".join([*said, f"Over {instruments(metrics)}, {of.how}."])] if said else []


def _on_missions(metrics: Mapping) -> list[str]:
    """What the user's own model does on missions."""
    tree = metrics.get("missions") or {}
    lines = []
    for of in rivals(metrics)[:1]:
        ratios = [(other, improvement(tree, f"{of.own}/{other}", VELOCITY)) for other in of.others]
        texts = [f"{change(r)} against {label(other)} ({SHORT_VERDICT[verdict(r)]})" for other, r in ratios if r]
        if texts:
            where = f"On {pick(tree, 'ensemble', 'size')} missions of other places, courses and days"
            lines.append(f"{where} “{label(of.own)}” changes the {measure_name(VELOCITY)} by {joined(texts)}.")
    return lines


def _built_in(metrics: Mapping, beside: bool) -> list[str]:
    """What hysteresis compensation does against simple; `beside` a model of the user's."""
    velocity, cep = (improvement(metrics, HEADLINE, measure) for measure in (VELOCITY, CEP))
    if not velocity and not cep:
        return [] if beside else ["These metrics hold no paired comparison of hysteresis and simple compensation."]
    parts: list[str] = []
    who = "Of the compensations beside it, hysteresis compensation" if beside else "Hysteresis compensation"
    for measure, ratio in ((VELOCITY, velocity), (CEP, cep)):
        if ratio:
            against = "" if parts else f" against simple compensation over {instruments(metrics)}"
            parts.append(f"{effect(who, 'the ' + measure_name(measure), ratio)}{against}; {certainty(ratio)}.")
            who = "It"
    terms = (
        "As the paper compares them: hysteresis is calibrated in the chamber and refined in one oven run, simple is "
        "calibrated in the chamber only."
    )
    if twin := improvement(metrics, f"{SECOND}/simple_refined", VELOCITY):
        terms += (
            f" With the same oven run on both sides, {effect('hysteresis', 'the ' + measure_name(VELOCITY), twin)}; "
            f"{certainty(twin)}."
        )
    return list(filter(None, (" ".join(parts), missions.answer(metrics), _levels(metrics), terms)))


def _levels(metrics: Mapping) -> str:
    """How good the INS is with each compensation that the answer names."""
    own = [of.own for of in rivals(metrics)[:1]]
    texts = []
    for measure, unit in UNITS.items():
        arms = {name: of_ensemble(metrics, name, measure) for name in (*own, FIRST, SECOND)}
        if all(arms.values()):
            called = {**dict.fromkeys(arms, ""), FIRST: "simple", SECOND: "hysteresis"}
            each = [f"{with_interval(of)} {unit} with {called[name] or label(name)}" for name, of in arms.items()]
            texts.append(f"{measure_name(measure)} {joined(each)}")
    return sentence("; ".join(texts)) if texts else ""


def instruments(metrics: Mapping) -> str:
    """Over how many instruments a figure is."""
    size = pick(metrics, "ensemble", "size")
    return f"{size} paired instruments" if size else "the paired instruments"


def glance(metrics: Mapping) -> Section:
    """Three numbers, one figure and what to do next."""
    picture = Picture(
        "improvement_per_instrument",
        "Each instrument flies once with either compensation. The height of a curve at ratio 1 is the share that "
        "improved; its width shows how far a single flight can mislead.",
    )
    if own := rivals(metrics)[:1]:
        plain, (simple, hysteresis) = own[0].own, own[0].others
        wanted = [(f"{plain}/{simple}", VELOCITY), (f"{plain}/{hysteresis}", VELOCITY), (f"{plain}/{hysteresis}", CEP)]
        return at_a_glance(_changes(metrics, wanted), picture, _next_of_own(metrics, own[0]))
    numbers = _changes(metrics, [(HEADLINE, VELOCITY), (HEADLINE, CEP)])
    if share := pick(metrics, "ensemble", "improvement", HEADLINE, "fraction_improved", VELOCITY):
        value, _, interval = percent(share).partition(" [")
        numbers.append(Number("single flights on which it is better", value, _bracketed(interval)))
    return at_a_glance(numbers, picture if numbers else None, missions.advice(metrics.get("missions") or {}))


def _changes(metrics: Mapping, wanted: Sequence[tuple[str, str]]) -> list[Number]:
    """Changes of pairs in a measure, each with its interval and verdict."""
    numbers = []
    for pair, measure in wanted:
        if ratio := improvement(metrics, pair, measure):
            new, _, old = pair.partition("/")
            value, _, interval = change(ratio).partition(" [")
            what = f"{measure_name(measure)}: {label(new)} against {label(old)}"
            numbers.append(Number(what, value, f"{_bracketed(interval)} {SHORT_VERDICT[verdict(ratio)]}"))
    return numbers


def _bracketed(interval: str) -> str:
    return f"[{interval}" if interval else ""


def _next_of_own(metrics: Mapping, of: Rivals) -> str:
    """What to do with a model of the user's, by how it stands against hysteresis."""
    against = of.others[-1]
    ratio = improvement(metrics, f"{of.own}/{against}", VELOCITY)
    if not ratio:
        return ""
    who, other = f"“{label(of.own)}”", f"{label(against)} compensation"
    judged = verdict(ratio)
    if judged == "better":
        return (
            f"Take {who} instead of {other} on this flight, and see on more missions whether the gain travels "
            "(MISSIONS=400)."
        )
    if judged == "worse":
        return f"Keep {other} on this flight: {who} is worse. The table of every compensation shows in what."
    if judged == "equal" or not (enough := _instruments_needed(ratio, pick(metrics, "ensemble", "size"))):
        return f"{who} and {other} do the same here: take the one that is cheaper to calibrate."
    return (
        f"Whether {who} or {other} is better is open. If the ratio stays {with_interval(ratio).split()[0]}, about "
        f"{enough} instruments would tell (INSTRUMENTS={enough})."
    )


def _instruments_needed(ratio: Mapping, size: int | None) -> int:
    """So many that the interval of a ratio would leave 1 out, its width falling with the root; 0 where too many."""
    low, high = ratio["interval95"]
    off, half = abs(log(ratio["ratio"])), 0.5 * (log(high) - log(low))
    if not size or off == 0.0:
        return 0
    needed = ceil(size * (half / off) ** 2)
    digits = 10 ** max(0, len(str(needed)) - 2)
    needed = ceil(needed / digits) * digits
    return needed if needed <= MOST_INSTRUMENTS else 0


def comparison(metrics: Mapping) -> list[Block]:
    """A table for each way of calibrating: the user's own model against the others of its kind."""
    blocks: list[Block] = []
    for of in rivals(metrics):
        rows = []
        for measure, unit in UNITS.items():
            levels = [with_interval(of_ensemble(metrics, name, measure)) for name in (of.own, *of.others)]
            ratios = [improvement(metrics, f"{of.own}/{other}", measure) for other in of.others]
            judged = [f"{change(r)}, {SHORT_VERDICT[verdict(r)]}" if r else MISSING for r in ratios]
            rows.append((f"{measure_name(measure)} [{unit}]", *levels, *judged))
        head = ("measure", label(of.own), *map(label, of.others), *(f"against {label(other)}" for other in of.others))
        note = f"In brackets: 95 % paired bootstrap interval over {instruments(metrics)}. Negative is better."
        blocks += table(f"Your model beside simple and hysteresis, {of.how}", head, rows, note, "lrrrll")
    return blocks
