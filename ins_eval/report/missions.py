"""The flight report on missions: whether the gain travels, where it helps, and what each part of it brings."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress

from ins_eval.figures.style import in_order, label
from ins_eval.report.content import Block, Paragraph, Picture, paragraphs, table
from ins_eval.tables import pick
from ins_eval.vocabulary import (
    CEP,
    FIRST,
    HEADLINE,
    SECOND,
    VELOCITY,
    improvement,
    linearly,
    measure_name,
    of_ensemble,
)
from ins_eval.wording import (
    MISSING,
    SHORT_VERDICT,
    change,
    fixed,
    joined,
    percent,
    sentence,
    verdict,
    with_interval,
)

MODEL, OVEN = f"hysteresis/{FIRST}", f"simple_refined/{FIRST}"
EQUAL, AFTER_MODEL = f"{SECOND}/simple_refined", f"{SECOND}/hysteresis"
WHO = {
    MODEL: "the hysteresis model, calibrated in the chamber alone,",
    OVEN: "the oven run, given to simple compensation,",
    HEADLINE: "hysteresis compensation, refined in the oven,",
    EQUAL: "the hysteresis model, with the same oven run on both sides,",
    AFTER_MODEL: "the oven run, given to hysteresis compensation,",
}
STEPS = {
    MODEL: "the hysteresis model, as calibrated in the chamber",
    OVEN: "the oven run, with simple compensation",
    AFTER_MODEL: "the oven run, with hysteresis compensation",
    EQUAL: "the hysteresis model, with the oven run on both sides",
}
# Whether the oven run helps with the model in place, whether the model helps with the oven run in place.
TOGETHER = {
    (False, False): "that both together are better than one is not established: take the one that is cheaper to have.",
    (True, True): "both together are better than either.",
    (True, False): "with the model in place the oven run still helps, with the oven run in place the model does not.",
    (False, True): "with the oven run in place the model still helps, with the model in place the oven run does not.",
}
SOURCE_WORDS = {
    "place": "place",
    "heading": "heading",
    "course": "course (out and back, box, survey)",
    "cruise": "height and speed",
    "day": "ground temperature and lapse",
    "stand": "minutes on the stand",
    "history": "the flight before, from which the epoxy still creeps",
    "receiver": "errors of the receiver that last for minutes",
    "gyro": "thermal drift of the gyros",
    "gradient": "a difference of temperature between the axes",
}
# Groups of `ensemble.conditions.GROUPS` in words, in their order.
GROUP_WORDS: dict[str, tuple[str, ...]] = {
    "warmer_c": (
        "more than 10 °C colder than the oven run",
        "within 10 °C of the oven run",
        "more than 10 °C warmer than the oven run",
    ),
    "span_c": (
        "temperature changes by less than 15 °C",
        "temperature changes by 15 to 25 °C",
        "temperature changes by 25 °C or more",
    ),
    "turns": ("at most 2 turns in the cruise", "3 to 5 turns", "6 turns or more"),
    "along_meridian": ("heading nearer to east or west", "heading nearer to north or south"),
    "since_on_h": ("switched on within the last 3.5 h", "switched off for longer"),
}
STEP_WORDS = {
    "away_c": "each 10 °C away from the oven run",
    "span_c": "each 10 °C of change in flight",
    "turns": "each 5 turns",
    "along_meridian": "north or south instead of east or west",
}


def answer(metrics: Mapping) -> str:
    """What the headline says of missions; empty where there were none."""
    missions = metrics.get("missions") or {}
    words = {
        HEADLINE: "with refined hysteresis against simple compensation",
        MODEL: "with hysteresis as the chamber left it",
        EQUAL: "where both are refined alike",
    }
    found = {pair: ratio for pair in words if (ratio := improvement(missions, pair, VELOCITY))}
    if not found:
        return ""
    texts = [f"{change(ratio)} {words[pair]} ({SHORT_VERDICT[verdict(ratio)]})" for pair, ratio in found.items()]
    text = (
        f"On {pick(missions, 'ensemble', 'size')} missions of other places, courses and days, with the same chamber "
        f"and oven run, the {measure_name(VELOCITY)} changes by {joined(texts)}."
    )
    if cep := improvement(missions, HEADLINE, CEP):
        text += f" The {measure_name(CEP)} changes by {change(cep)} in the first case ({SHORT_VERDICT[verdict(cep)]})."
    return text


def over_missions(metrics: Mapping) -> list[Block]:
    """Everything about missions; a part whose numbers the metrics lack is left out."""
    missions = metrics.get("missions")
    if not missions:
        return []
    blocks: list[Block] = []
    for part in (_what, _meaning, _arms, _pictures, _where, _slopes, _flights):
        with suppress(KeyError):
            blocks += part(missions)
    return blocks


def _what(missions: Mapping) -> list[Block]:
    sources = joined([SOURCE_WORDS.get(name, name) for name in missions["population"]["sources"]])
    span = missions["range"]["warmer_c"]
    return [
        Paragraph(
            f"Each of {missions['ensemble']['size']} instruments flies a mission of its own, once with every "
            f"compensation. From one to the next differ: {sources}. Chamber and oven are those of the flight above, "
            "as an analyst has them who calibrates once; on average over a mission the IMU is between "
            f"{fixed(span[0], 0)} and {fixed(span[2], 0)} °C warmer than it was in the oven."
        )
    ]


def _meaning(missions: Mapping) -> list[Block]:
    """What to do, as far as the missions decide it: one of the two measures may gain what the other loses."""
    rows = []
    for pair, words in STEPS.items():
        shares = pick(missions, "ensemble", "improvement", pair, "fraction_improved", VELOCITY)
        ratios = [improvement(missions, pair, measure) for measure in (VELOCITY, CEP)]
        changes = [(change(r), SHORT_VERDICT[verdict(r)]) if r else (MISSING, MISSING) for r in ratios]
        if any(ratios):
            rows.append((words, *changes[0], percent(shares) if shares else MISSING, *changes[1]))
    header = ("what is added", measure_name(VELOCITY), "verdict", "missions on which it helps", measure_name(CEP))
    note = "In brackets: 95 % interval, paired. Negative is better."
    found = advice(missions)
    return [
        *([Paragraph(found, "What to do.")] if found else []),
        *table("What each step changes over missions", (*header, "verdict"), rows, note, "lrlrrl"),
    ]


def advice(missions: Mapping) -> str:
    """What to do, as far as the missions decide it; empty where there were none."""
    said = {measure: _advice(missions, measure) for measure in (VELOCITY, CEP)}
    if said[VELOCITY] == said[CEP]:
        return sentence(said[VELOCITY]) if said[VELOCITY] else ""
    return " ".join(f"For the {measure_name(measure)}: {text}" for measure, text in said.items() if text)


def _advice(missions: Mapping, measure: str) -> str:
    found = {pair: improvement(missions, pair, measure) for pair in (MODEL, OVEN, EQUAL, AFTER_MODEL)}
    if not all(found.values()):
        return ""
    decided = {pair: verdict(ratio) for pair, ratio in found.items()}
    model, oven = decided[MODEL] == "better", decided[OVEN] == "better"
    if not model and not oven:
        return "neither step by itself is established to help on other flights; more missions would show it."
    if model and oven:
        text = "either step is worth having by itself, the model and the oven run; "
        return text + TOGETHER[decided[AFTER_MODEL] == "better", decided[EQUAL] == "better"]
    if model:
        text = "calibrate the hysteresis model; that an oven run alone helps on other flights is not established"
        spoils = "; on top of the model it makes things worse, so leave it out unless the flight is that of the oven."
        return text + (spoils if decided[AFTER_MODEL] == "worse" else ".")
    text = "make the oven run; that the hysteresis model alone helps on other flights is not established"
    return text + ("; on top of the oven run it makes things worse." if decided[EQUAL] == "worse" else ".")


def _arms(missions: Mapping) -> list[Block]:
    tree = missions["ensemble"]
    rows = []
    for name in in_order(n for n, arm in tree.items() if isinstance(arm, Mapping) and "velocity_rms_mps" in arm):
        of = [with_interval(of_ensemble(missions, name, measure)) for measure in (VELOCITY, CEP)]
        pair = f"{name}/{FIRST}"
        ratios = [improvement(missions, pair, measure) for measure in (VELOCITY, CEP)]
        share = pick(tree, "improvement", pair, "fraction_improved", VELOCITY)
        judged = [with_interval(r) if r else MISSING for r in ratios]
        rows.append((label(name), *of, *judged, percent(share) if share else MISSING))
    head = (
        "compensation",
        f"{measure_name(VELOCITY)} [m/s]",
        f"{measure_name(CEP)} [nmi/h]",
        "velocity, ratio to simple",
        "CEP, ratio to simple",
        "missions on which it helps",
    )
    note = (
        "In brackets: 95 % interval; ratios are paired. It helps on a mission where the velocity RMS is smaller than "
        "with simple compensation."
    )
    if linear := tree.get("linear"):
        note += f" {linearly(linear)}"
    return table(f"Every compensation over {tree['size']} missions", head, rows, note)


def _pictures(missions: Mapping) -> list[Block]:
    return [
        Picture("missions_cep_over_time", "CEP(t) over missions, with its 95 % band."),
        Picture(
            "missions_by_temperature",
            "Each mark is one mission: below 1 the compensation was better there than simple compensation. To the "
            "right the IMU was warmer than in the oven run with which the instruments were refined.",
        ),
    ]


def _where(missions: Mapping) -> list[Block]:
    pairs = (MODEL, OVEN, HEADLINE)
    groups = [missions["conditions"][pair]["groups"] for pair in pairs]
    rows = []
    for condition, words in GROUP_WORDS.items():
        for k, text in enumerate(words):
            of_pairs = [group[condition][k] for group in groups]
            rows.append((text, str(of_pairs[0]["count"]), *map(_change_in, of_pairs)))
    names = ("hysteresis", "simple, refined", "hysteresis, refined")
    blocks = table(
        "Where a compensation helps: change of the velocity RMS against simple",
        ("missions", "how many", *names),
        rows,
        "In brackets: 95 % interval, paired; then the share of these missions on which it helps. Negative is better. "
        f"{MISSING}: fewer than five missions.",
    )
    return [*paragraphs(*(_helps_and_hurts(missions, pair) for pair in pairs)), *blocks]


def _change_in(group: Mapping) -> str:
    return f"{change(group)}; {100.0 * group['improved']['value']:.0f} %" if "ratio" in group else MISSING


def _helps_and_hurts(missions: Mapping, pair: str) -> str:
    """Groups of missions on which a pair is better or worse for certain, in one sentence."""
    found: dict[str, list[str]] = {"better": [], "worse": [], "open": []}
    for condition, groups in missions["conditions"][pair]["groups"].items():
        for words, group in zip(GROUP_WORDS[condition], groups, strict=True):
            if "ratio" in group:
                found[{"equal": "open"}.get(judged := verdict(group), judged)].append(words)
    who, better, worse, rest = WHO[pair], found["better"], found["worse"], found["open"]
    if not better and not worse:
        return sentence(f"{who} is in no group of missions below established to help or to hurt")
    hurts = f" hurts where: {'; '.join(worse)}" if worse else ""
    if len(better) > len(rest) + len(worse):  # the exceptions say more
        text = f"{who} helps in {len(better)} of the {len(better) + len(rest) + len(worse)} groups of missions below"
        text += f", and{hurts}" if worse else ""
        return sentence(text + (f". Neither is established where: {'; '.join(rest)}" if rest else ""))
    helps = f" helps where: {'; '.join(better)}" if better else ""
    text = who + helps + (", and" if better and worse else "") + hurts
    return sentence(text) + (" Elsewhere in the table neither is established." if rest else "")


def _slopes(missions: Mapping) -> list[Block]:
    pairs = (MODEL, OVEN, HEADLINE)
    slopes = [missions["conditions"][pair]["slopes"] for pair in pairs]
    rows = [
        (words, *(with_interval(of_pair.get(name)) for of_pair in slopes))
        for name, words in STEP_WORDS.items()
        if any(name in of_pair for of_pair in slopes)
    ]
    return table(
        "What a condition does to the ratio to simple on a mission, the others held",
        ("condition", "hysteresis", "simple, refined", "hysteresis, refined"),
        rows,
        "Factor on the ratio of the velocity RMS of a single mission; below 1 the condition favours the compensation. "
        "Least squares of its logarithm; in brackets: 95 % interval.",
    )


def _flights(missions: Mapping) -> list[Block]:
    flights, pairs = missions["flights"], (HEADLINE, OVEN, MODEL, EQUAL)
    if len(flights) < 2:
        return []
    trees = [(of["words"], of["size"], of["improvement"]) for of in flights.values()]
    trees.append(("missions", missions["ensemble"]["size"], missions["ensemble"]["improvement"]))
    heads = ("hysteresis, refined / simple", "simple, refined / simple", "hysteresis / simple")
    heads += ("hysteresis, refined / simple, refined",)
    blocks: list[Block] = []
    for measure in (VELOCITY, CEP):
        rows = [
            (words, str(size), *(with_interval(pick(tree, pair, measure)) for pair in pairs))
            for words, size, tree in trees
        ]
        title = f"{sentence(measure_name(measure))[:-1]}: ratios on other flights"
        note = "The oven keeps to the first flight. In brackets: 95 % interval; below 1 the first one is better."
        blocks += table(title, ("flight", "instruments", *heads), rows, note)
    return blocks


def attribution(metrics: Mapping) -> list[Block]:
    """What model and refinement bring in either order, on the flight of all and over missions."""
    head = ["what is added"]
    columns = [
        ("model, first", "then refinement", "refinement, first", "then model", "model, either order",
         "refinement, either order", "together")
    ]  # fmt: skip
    for where, tree in (("this flight", metrics), ("missions", metrics.get("missions") or {})):
        for measure in (VELOCITY, CEP):
            of = pick(tree, "ensemble", "attribution", measure)
            if not of:
                continue
            first, second, both = of["model_first"], of["refinement_first"], of["shapley"]
            factors = (first["model"], first["refinement"], second["refinement"], second["model"])
            factors += (both["model"], both["refinement"], of["together"])
            head.append(f"{measure_name(measure)}, {where}")
            columns.append(tuple(map(with_interval, factors)))
    return table(
        "What model and refinement multiply the error by",
        head,
        list(zip(*columns, strict=True)) if len(columns) > 1 else [],
        "Below 1 is better; in brackets: 95 % interval. Either order: the Shapley share, the geometric mean of both "
        "orders; the two multiply to the whole.",
    )


def substitutes(metrics: Mapping) -> str:
    """Model and refinement in words, without an order; empty where the metrics hold no attribution."""
    of = pick(metrics, "ensemble", "attribution", VELOCITY)
    if not of:
        return ""
    first, second, both = of["model_first"], of["refinement_first"], of["shapley"]
    return (
        "The gain of each depends on which is added first: the model multiplies the velocity error by "
        f"{with_interval(first['model'])} without the oven run and by {with_interval(second['model'])} with it; the "
        f"oven run by {with_interval(second['refinement'])} without the model and by "
        f"{with_interval(first['refinement'])} with it. On average over both orders (Shapley), the model "
        f"has {with_interval(both['model'])} and the oven run {with_interval(both['refinement'])} of "
        f"{with_interval(of['together'])}."
    )
