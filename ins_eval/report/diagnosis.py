"""The diagnosis in words: where a recording leaves what is believed of it, what was left out, and how sure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ins_eval.effects import VOCABULARY
from ins_eval.policy import Policy
from ins_eval.report.content import Section
from ins_eval.report.diagnosis_glance import diagnosis_glance, worth
from ins_eval.report.diagnosis_sections import sections_of
from ins_eval.report.diagnosis_words import (
    amount,
    beside_best,
    chance,
    channel,
    effect_words,
    nats,
    probability,
    rare,
    sigmas,
    where,
)
from ins_eval.wording import fixed, joined, sentence

TITLE = "Diagnosis"
NAMED = 3  # effects in a heading of some three lines, and a fourth rather than `1 more`; by reasoning


def diagnosis_content(tree: Mapping) -> tuple[str, list[Section]]:
    """The answer, of which the first line is the heading of the page, and the sections of a diagnosis."""
    return _answer(tree), [diagnosis_glance(tree), *sections_of(tree)]


def _answer(tree: Mapping) -> str:
    found = tree["diagnosis"]
    names = joined([one["name"] for one in tree["recordings"]])
    lines = [f"{names}: {_headline(found)}", *_what(found), *_seen(tree), *_how_sure(tree), *_else(tree), *_gain(tree)]
    warnings = [sentence(words) for words in tree.get("warnings", ())]
    return "\n".join([*lines, *_remainder(found), *_withdrawn(found), *warnings])


def _headline(found: Mapping) -> str:
    """What was left out and how much, or that nothing was."""
    effects, verdict = found["effects"], found["verdict"]
    if verdict == "no mismatch":
        return (
            "no mismatch. What is believed accounts for the recording within what noise and stated uncertainty allow."
        )
    if not effects:
        return f"{verdict}. There is a mismatch that nothing named here accounts for."
    words = _named(effects) if len(effects) > 1 else f"{effect_words(effects[0])}: {amount(effects[0])}"
    if verdict == "partly explained":
        return f"partly explained by {words}; something else is wrong, too."
    if verdict == "not identifiable":
        return f"not identifiable. Best explained by {words}; something else fits as well."
    return f"{verdict} by {words}."


def _named(effects: Sequence[Mapping]) -> str:
    """Several effects by their names, of many the first."""
    names = [effect_words(one) for one in effects]
    if len(names) > NAMED + 1:
        names[NAMED:] = [f"{len(names) - NAMED} more"]
    return f"{len(effects)} effects ({'; '.join(names)})"


def _what(found: Mapping) -> list[str]:
    """One line for each effect: how sure, and its physics."""
    several = len(found["effects"]) > 1
    lines = []
    for one in found["effects"]:
        which = f"{effect_words(one)}: {amount(one)}; " if several else ""
        words = f"{which}probability {probability(one['probability'])}; noise alone reaches it in {rare(one)}"
        lines.append(f"{sentence(words)} In words: {VOCABULARY[one['name']].physics}.")
    return lines


def _seen(tree: Mapping) -> list[str]:
    several = len(tree["recordings"]) > 1
    return [_spoken(one, several) for one in tree["diagnosis"]["mismatch"]]


def _spoken(one: Mapping, several: bool) -> str:
    begin, end = one["interval_s"]
    of = f" of {one['recording']}" if several else ""
    words = f"; {where(one)}" if one["where"] else ""
    when = f"{begin:.0f} to {end:.0f} s{words}"
    return sentence(f"{channel(one['channel'])}{of}, {when}: {sigmas(one)} σ, with every channel and interval searched")


def _how_sure(tree: Mapping) -> list[str]:
    """Where nothing is wrong: how near the most remarkable came."""
    statistics = tree["statistics"]
    if tree["diagnosis"]["verdict"] != "no mismatch" or "largest_effect" not in statistics:
        return []
    gain, cost = fixed(statistics["largest_log_bayes_factor"], 1), fixed(statistics["cost_of_an_effect"], 1)
    best = tree["evidence"]["families"][:1]
    name = effect_words(best[0]) if best else statistics["largest_effect"]
    line = f"The effect that would gain most is {name}: {gain} nats, where {cost} are needed"
    smallest = statistics.get("smallest_probability")
    if smallest is not None:
        line += f"; the most remarkable interval has a probability of {chance(smallest)}"
    return [sentence(line)]


def _else(tree: Mapping) -> list[str]:
    found = tree["diagnosis"]
    if not found["effects"]:
        return []
    lines = []
    of_noise = [one for one in found["indistinguishable"] if one["from"] is None]
    of_effects = [one for one in found["indistinguishable"] if one["from"] is not None]
    together = [one for one in of_effects if "together_with" in one]
    if together:
        lines.append(_together(together))
    apart = [one for one in of_effects if "together_with" not in one]
    for one in apart[:3]:
        tie = "separated only by what was expected before the recording" if one["told_apart_by_prior_only"] else ""
        below = beside_best(one["log_evidence_below_best"])
        words = f"It could also be {effect_words(one)} ({'; '.join(filter(None, (below, tie)))})"
        lines.append(sentence(f"{words}: {_experiment(one)}"))
    rest = apart[3:]
    if len(rest) == 1:
        lines.append(sentence(f"Nor can {effect_words(rest[0])} be excluded; it is listed below"))
    elif rest:
        lines.append(sentence(f"{len(rest)} further ones cannot be excluded; they are listed below"))
    lines += [*_of_noise(of_noise), *_unnamed_near(tree)]
    families = tree["evidence"]["families"]
    if not lines and families[0]["named"]:  # else what is wrong was mended before these were tried
        near = next((one for one in families if not one["named"]), None)
        first = families[0]["log_bayes_factor"]
        nearest = ""
        if near is not None:
            nearest = f"; the next, {effect_words(near)}, lies {nats(first - near['log_bayes_factor'])} nats below"
        lines.append(sentence(f"Nothing else that was tried comes near{nearest}"))
    return lines


def _unnamed_near(tree: Mapping) -> list[str]:
    """Where a disturbance that follows nothing known is as probable as a rival."""
    below = tree["statistics"].get("unnamed_below_names")
    if below is None or below >= Policy.near or tree["diagnosis"]["verdict"] == "partly explained":
        return []
    of, size = channel(tree["statistics"]["unnamed_channel"]), nats(abs(below))
    than = "less" if below >= 0.0 else "more"
    return [
        f"A slow disturbance of {of} that follows nothing known is {size} nats {than} probable than all that is named "
        "here together. In another recording an effect would come back, such a disturbance need not."
    ]


def _together(rivals: Sequence[Mapping]) -> str:
    """Constants of one name about several axes that together do the same as an effect."""
    first = rivals[0]
    name, instead = first["name"].replace(".", " "), first["from"].replace(".", " ")
    sizes = [(one["parameters"], one["axis"]) for one in rivals]
    each = joined([f"{fixed(of['value'], 2)} {of['unit']} about {axis}" for of, axis in sizes])
    experiment = _experiment(first)
    return sentence(
        f"Constants of {name} of {each} together would fit as well. The {instead} is preferred because it is known to "
        f"be there, and no {name} of that size is expected of such an instrument: "
        f"{nats(first['log_evidence_below_best'])} nats, by what was believed before the recording only. "
        f"{experiment[:1].upper()}{experiment[1:]}"
    )


def _of_noise(rivals: Sequence[Mapping]) -> list[str]:
    """Effects that are named where the sensors have other noise, each set of them in a sentence."""
    lines = []
    for below in dict.fromkeys(one["log_evidence_below_best"] for one in rivals):
        words = [f"{effect_words(one)}: {amount(one)}" for one in rivals if one["log_evidence_below_best"] == below]
        lines.append(
            sentence(
                f"What is noise of the sensors here may be effects, if they have other noise ({'; '.join(words)}): "
                f"{beside_best(below)}. In another recording an effect would come back, noise would not"
            )
        )
    return lines


def _experiment(one: Mapping) -> str:
    if one["experiment"] is None:
        return "no experiment of the catalogue would separate them"
    expected = nats(one["expected_log_bayes_factor"])
    return f"{one['experiment']} would separate them (expected log Bayes factor {expected})"


def _gain(tree: Mapping) -> list[str]:
    found = tree["diagnosis"]
    parts = worth(tree) if found["effects"] else []
    return [sentence(f"With {_them(found)}, {'; '.join(parts)}")] if parts else []


def _remainder(found: Mapping) -> list[str]:
    left = found["unexplained"]
    if not found["effects"]:
        return []
    sigma = sigmas(left)
    if left["channel"] is None:
        return [f"Nothing significant stays unexplained ({sigma} σ)."]
    begin, end = left["interval_s"]
    place = f"{channel(left['channel'])}, {begin:.0f} to {end:.0f} s"
    return [f"Still unexplained: {place}, {sigma} σ; look there next."]


def _withdrawn(found: Mapping) -> list[str]:
    """What was found and is not named, with the reason; once, though it was withdrawn beside one set and another."""
    said = (
        sentence(f"Not named: {effect_words(one)}, for this does not hold of it: {one['reason'][:1].lower()}"
                 f"{one['reason'][1:]}")
        for one in found.get("withdrawn", ())
    )  # fmt: skip
    return list(dict.fromkeys(said))


def _them(found: Mapping) -> str:
    return "it" if len(found["effects"]) == 1 else "them"
