"""What weakens the claim of the flight report, in words that follow the numbers."""

from __future__ import annotations

from collections.abc import Mapping

from ins_eval.report.content import Paragraph
from ins_eval.report.missions import substitutes
from ins_eval.tables import pick
from ins_eval.vocabulary import (
    CEP,
    DEFINITIONS,
    FIRST,
    HEADLINE,
    NOT_IN_THE_FLIGHT,
    SECOND,
    VELOCITY,
    definition_name,
    improvement,
    measure_name,
    source_name,
)
from ins_eval.wording import at_most, certainty, effect, fixed, joined, percent, sentence, verdict

SHOWS_THE_SIGN = 0.975  # share of instruments improved from which one flight nearly always shows the sign
BEYOND_REFINEMENT = {
    "better": "So in velocity the hysteresis model helps beyond what the refinement gives.",
    "worse": "So, given the same refinement, the hysteresis model is worse in velocity than the simple one.",
    "open": "So it is not established that the hysteresis model adds anything in velocity to the refinement.",
    "equal": "So the hysteresis model adds nothing in velocity to the refinement.",
}
TOO_LITTLE_PERCENT = 1.0  # an effect on navigation that is at most so large is real, but does not matter
UNTOUCHED = 0.02  # relative: a source that a compensation changes by less is not acted upon


def weaknesses(metrics: Mapping) -> list[Paragraph]:
    """Refinement, scale-factor hysteresis, single flight and definition, each where the metrics hold it."""
    parts = (
        ("The refinement.", _refinement(metrics)),
        ("The hysteresis of the bias.", _bias_hysteresis(metrics)),
        ("The hysteresis of the scale factor alone.", _scale_factor_hysteresis(metrics)),
        ("A single flight.", _single_flight(metrics)),
        ("The definition.", _definition(metrics)),
    )
    return [Paragraph(text, lead) for lead, text in parts if text]


def _effects(metrics: Mapping, pair: str, who: str) -> str:
    """What a pair does to velocity and CEP, joined by "and"; empty where the metrics hold neither."""
    ratios = [(measure, r) for measure in (VELOCITY, CEP) if (r := improvement(metrics, pair, measure))]
    effects = [effect("" if k else who, "the " + measure_name(m), r).strip() for k, (m, r) in enumerate(ratios)]
    return joined(effects) if effects else ""


def _refinement(metrics: Mapping) -> str:
    """What the model and what the oven run bring to the headline."""
    alone = improvement(metrics, "simple_refined/simple", VELOCITY)
    twin = improvement(metrics, f"{SECOND}/simple_refined", VELOCITY)
    if not alone and not twin:
        return ""
    parts = ["The two sides of the headline differ in two things, the model and the oven run.", substitutes(metrics)]
    if alone:
        text = _effects(metrics, "simple_refined/simple", "the oven run, given to simple compensation too,")
        parts.append(sentence(text))
    if twin:
        text = _effects(metrics, f"{SECOND}/simple_refined", "hysteresis")
        parts.append(f"With the same oven run on both sides {text}.")
        parts.append(BEYOND_REFINEMENT[verdict(twin)])
    parts.append("The oven repeats the temperatures of this very flight; over missions it does not, see there.")
    return " ".join(filter(None, parts))


def _bias_hysteresis(metrics: Mapping) -> str:
    """The ablation that isolates the physics: a bias as piecewise, but blind to the direction of the temperature."""
    blind = improvement(metrics, "hysteresis_blind/simple", VELOCITY)
    seeing = improvement(metrics, "hysteresis/hysteresis_blind", VELOCITY)
    if not blind or not seeing:
        return ""
    who = "a bias drawn as piecewise as that of the hysteresis model, but blind to the direction of the temperature,"
    text = sentence(_effects(metrics, "hysteresis_blind/simple", who))
    text += " " + sentence(_effects(metrics, "hysteresis/hysteresis_blind", "giving it a branch for either direction"))
    if verdict(seeing) == "better" and verdict(blind) != "better":
        text += " So it is the hysteresis of the bias that gains, and not the finer curve."
    return text


def _scale_factor_hysteresis(metrics: Mapping) -> str:
    """The ablation: the rate terms of the scale factor taken out, and the scale factor alone put in."""
    rate = improvement(metrics, "hysteresis/hysteresis_without_rate", VELOCITY)
    scale = improvement(metrics, "hysteresis_scale_only/simple", VELOCITY)
    parts = []
    if rate:
        who = (
            "adding the rate terms of the scale factor, which are its hysteresis, to a model that is otherwise the same"
        )
        parts.append(sentence(_effects(metrics, "hysteresis/hysteresis_without_rate", who)))
        if verdict(rate) in ("open", "equal"):
            parts.append(
                "That the hysteresis of the scale factor matters for navigation is not established; on the "
                f"velocity RMS its effect is at most {fixed(at_most(rate), 1)} % either way."
            )
            if (whole := improvement(metrics, "hysteresis/simple", VELOCITY)) and verdict(whole) == "better":
                parts.append(
                    "What the model gains over simple compensation comes from its other parts: the bias by "
                    "branch and the curvature of the scale factor."
                )
        elif verdict(rate) == "better":
            parts.append(
                "So the hysteresis of the scale factor is visible in navigation"
                + (
                    f", but at most {fixed(at_most(rate), 1)} %, too little to matter."
                    if at_most(rate) < TOO_LITTLE_PERCENT
                    else "."
                )
            )
        else:
            parts.append("So modelling the hysteresis of the scale factor makes navigation worse.")
    if scale:
        who = "putting the six-term scale factor in place of the linear one, with the bias of simple compensation kept,"
        parts.append(
            sentence(_effects(metrics, "hysteresis_scale_only/simple", who) + f"; in velocity {certainty(scale)}")
        )
        parts.append("That step holds the curvature in temperature too, not the hysteresis alone.")
    return " ".join(parts)


def _single_flight(metrics: Mapping) -> str:
    entry = pick(metrics, "ensemble", "improvement", HEADLINE, "fraction_improved", VELOCITY)
    if not entry:
        return ""
    text = f"{percent(entry)} of the instruments have a smaller {measure_name(VELOCITY)} with hysteresis compensation"
    if entry["value"] >= SHOWS_THE_SIGN:
        return f"{text}: here even a single flight would nearly always show the sign, though not the size."
    return (
        f"{text}; {100.0 * (1.0 - entry['value']):.0f} % do not. A single flight, like the one of the paper, therefore "
        "cannot establish an improvement. One flight has no CEP, which takes many flights; it has a radial error rate."
    )


def _definition(metrics: Mapping) -> str:
    values = {
        d: entry["value"]
        for d in DEFINITIONS
        if isinstance(entry := pick(metrics, "ensemble", FIRST, "cep_rate_nmi_per_h", d), Mapping)
    }
    if len(values) < 2:
        return ""
    low, high = min(values, key=values.get), max(values, key=values.get)
    text = (
        f"The same flights with simple compensation have a CEP rate from {fixed(values[low])} nmi/h "
        f"({definition_name(low)}) to {fixed(values[high])} nmi/h ({definition_name(high)})."
    )
    if printed := pick(metrics, "paper", "cep"):
        spread, gain = values[high] - values[low], printed["simple"] - printed["hysteresis"]
        text += (
            f" The paper does not say which definition it uses. The choice alone moves the number by {fixed(spread)} "
            f"nmi/h, {'more' if spread > gain else 'not more'} than the gain of {fixed(gain)} nmi/h that it reports."
        )
    return text


def largest_source(budget: Mapping, measure: str, unit: str) -> str:
    """The largest single source under simple compensation and what refined hysteresis does to it; may be empty."""
    single = {
        source: arms[FIRST][measure]["value"]
        for source, arms in budget.items()
        if not source.startswith("all") and source not in NOT_IN_THE_FLIGHT and pick(arms, FIRST, measure)
    }
    if not single:
        return ""
    source = max(single, key=single.get)
    before, after = single[source], pick(budget, source, SECOND, measure, "value")
    text = (
        f"In the {measure_name(measure)} the largest single source under simple compensation is "
        f"{source_name(source)}, with {fixed(before)} {unit}"
    )
    if after is None or before == 0.0:
        return text + "."
    if abs(after / before - 1.0) < UNTOUCHED:
        return text + "; refined hysteresis compensation does not act on it, which limits what it can gain here."
    change = "lowers" if after < before else "raises"
    return f"{text}; refined hysteresis compensation {change} it to {fixed(after)} {unit}."
