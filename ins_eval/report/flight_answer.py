"""What the flight report answers, of a user's own model first: the verdict, three numbers, what to do next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, log
from typing import NamedTuple

from ins_eval.figures.style import REFINED, label
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
    own = _own(metrics)
    return "\n".join([*own, *_built_in(metrics, bool(own))])


def _own(metrics: Mapping) -> list[str]:
    """What the user's own model does: as the chamber left it, with the oven run, on missions."""
    pairs, missions_flown = rivals(metrics), metrics.get("missions") or {}
    where = f"On {pick(missions_flown, 'ensemble', 'size')} missions of other places, courses and days"
    lines: list[str] = []
    for tree, of, begin in [
        *[(metrics, of, f"Over {instruments(metrics)}, {of.how},") for of in pairs],
        *[(missions_flown, of, f"{where}, {of.how},") for of in pairs[:1]],
    ]:
        ratios = [(other, improvement(tree, f"{of.own}/{other}", VELOCITY)) for other in of.others]
        texts = [f"{change(r)} against {_plainly(name)} ({SHORT_VERDICT[verdict(r)]})" for name, r in ratios if r]
        if texts:
            who = "it" if lines else f"your model “{_plainly(of.own)}”"
            lines.append(f"{begin} {who} changes the {measure_name(VELOCITY)} by {joined(texts)}.")
    return lines


def _plainly(name: str) -> str:
    """A name without the refinement that is said of all."""
    return label(name.removesuffix(REFINED))


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
    more = [] if beside else [missions.answer(metrics), _levels(metrics)]  # the sections below have them
    return list(filter(None, (" ".join(parts), *more, terms)))


def _levels(metrics: Mapping) -> str:
    """How good the INS is with either compensation."""
    texts = []
    for measure, unit in UNITS.items():
        arms = [of_ensemble(metrics, name, measure) for name in (FIRST, SECOND)]
        if all(arms):
            first, second = map(with_interval, arms)
            texts.append(f"{measure_name(measure)} {first} {unit} with simple and {second} {unit} with hysteresis")
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
    numbers = headline_numbers(metrics)
    return at_a_glance(numbers, picture if numbers else None, missions.advice(metrics.get("missions") or {}))


def headline_numbers(metrics: Mapping) -> list[Number]:
    """What refined hysteresis compensation changes against simple, and on how many single flights it is better."""
    numbers = _changes(metrics, [(HEADLINE, VELOCITY), (HEADLINE, CEP)])
    if share := pick(metrics, "ensemble", "improvement", HEADLINE, "fraction_improved", VELOCITY):
        value, _, interval = percent(share).partition(" [")
        numbers.append(Number("single flights on which it is better", value, _interval(interval)))
    return numbers


def _changes(metrics: Mapping, wanted: Sequence[tuple[str, str]]) -> list[Number]:
    """Changes of pairs in a measure, each with its interval and verdict."""
    numbers = []
    for pair, measure in wanted:
        if ratio := improvement(metrics, pair, measure):
            new, _, old = pair.partition("/")
            value, _, interval = change(ratio).partition(" [")
            what = f"{measure_name(measure)}: {label(new)} against {label(old)}"
            numbers.append(Number(what, value, f"{_interval(interval)}; {SHORT_VERDICT[verdict(ratio)]}"))
    return numbers


def _interval(ends: str) -> str:
    """``95 %: −25 to −8 %`` of what stands in brackets, ``−25, −8]``."""
    return f"95 %: {ends.rstrip(']').replace(', ', ' to ')} %" if ends else ""


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
        return f"Keep {other} on this flight: {who} is worse."
    if judged == "equal" or not (enough := _instruments_needed(ratio, pick(metrics, "ensemble", "size"))):
        return f"{who} and {other} do the same here: take the one that is cheaper to calibrate."
    return (
        f"Whether {who} or {other} is better is open. If the ratio stays {with_interval(ratio).split()[0]}, about "
        f"{enough} instruments would show it (INSTRUMENTS={enough})."
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
