"""What the report on concealed effects says, section by section."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmark.runners import targets
from benchmark.runners.figures import short
from benchmark.runners.targets import MET, MISSED, OPEN, TARGETS, spoken, verdict
from benchmark.scores.score import BANDS, SEEN
from ins_eval.effects import VOCABULARY
from ins_eval.report.content import Block, Number, Picture, Section, Table, at_a_glance, paragraphs, table
from ins_eval.report.diagnosis_words import nats
from ins_eval.wording import MISSING, fixed

PARAMETERS = {one.name: f"{one.words} [{one.unit}]" for effect in VOCABULARY.values() for one in effect.parameters}
RATE = ("cases", "share", "95 % interval")


def content(result: dict, log: Sequence[dict]) -> tuple[str, list[Section]]:
    """The answer and the sections; nothing is averaged over kinds without the kinds beside it."""
    sections = [
        _glance(result),
        Section("Outside the vocabulary", _outside(result)),
        Section("Nothing concealed", _nulls(result)),
        Section("What was named", _confusion(result)),
        Section("Detection", _detection(result)),
        Section("Naming", _naming(result)),
        Section("What one recording cannot separate", _alike(result)),
        Section("Several effects at once", [*targets.table(result, "sets"), *_rates("Sets", result["sets"])]),
        Section("Stated probabilities", _probability(result)),
        Section("Intervals", _intervals(result)),
        Section("Where", _where(result)),
        Section("Fit on unused data", _fit(result)),
        Section("Navigation", _navigation(result)),
        Section("The oracle and diagnose", _oracle()),
        Section("Time and failures", seconds(result)),
        Section("All runs on sealed sets", _log(log)),
    ]
    return _answer(result), [section for section in sections if section.blocks]


def _answer(result: dict) -> str:
    said = {one: verdict(one, result) for one in TARGETS}
    missed = [f"{one.line} {one.words}" for one, word in said.items() if word == MISSED]
    met, judged = sum(word == MET for word in said.values()), sum(word != OPEN for word in said.values())
    lines = [f"{result['cases']} concealed cases: {met} of {judged} targets met."]
    if missed:
        lines.append(f"Missed: {'; '.join(missed)}.")
    if result["missing"]:
        lines.append(f"{len(result['missing'])} cases have no answer and count as failures.")
    return "\n".join(lines)


def _glance(result: dict) -> Section:
    """What is detected, what is named wrongly for sure, false alarms; and where to look next."""
    wanted = ("detected, D of at least 16", "confidently wrong inside the vocabulary", "false alarms, plain nulls")
    rates = [(one.words, value) for words in wanted for one in TARGETS
             if one.words == words and (value := targets.found(one, result)) is not None]  # fmt: skip
    picture = Picture(
        "by_band", "Share of the concealed effects that is detected, by how clearly the recording shows them."
    )
    step = "Read first the cases that were missed, below. make concealed QUICK=1 tries 40 fresh ones in minutes."
    return at_a_glance([number(words, value) for words, value in rates], picture, step)


def number(words: str, value: dict) -> Number:
    """A rate with its interval on the first screen."""
    count, share, interval = spoken(value)
    return Number(words, share, f"{count}; 95 %: {interval}")


TWINS_NOTE = (
    "Twins fit as well as the truth at any size, to an oracle that knows the noise; they are counted where D, to the "
    "same oracle, is at least 16."
)


def _rates(title: str, group: dict, starts: str = "", note: str = "") -> list[Table]:
    rows = [(name, *spoken(one)) for name, one in group.items() if name.startswith(starts)]
    return table(title, ("", *RATE), rows, note)


def _words(one: dict) -> str:
    return ", ".join(short(name) for name in one["truth"]) or "nothing"


def case_rows(records: Sequence[dict]) -> list[tuple[str, ...]]:
    return [
        (one["case"].removeprefix("case-"), one["kind"], one["where"], _words(one), nats(one["d"]),
         nats(one["margin"]), one["verdict"], ", ".join(short(name) for name in one["named"]) or MISSING)
        for one in sorted(records, key=lambda one: -(one["d"] or 0.0))
    ]  # fmt: skip


CASES = ("case", "kind", "recording", "concealed", "D", "margin", "verdict", "named")
CASES_ALIGN = "llllrrll"


def _outside(result: dict) -> list[Block]:
    here = [one for one in result["records"] if one["kind"] == "outside"]
    rows = []
    for name in sorted({one["truth"][0].split()[0] for one in here}):
        of = [one for one in here if one["truth"][0].split()[0] == name]
        seen = [one for one in of if (one["d"] or 0.0) >= SEEN]
        rows.append((short(name), str(len(of)), str(len(seen)), str(sum(one["heard"] for one in seen)),
                     str(sum(one["right"] for one in seen)), str(sum(one["wrong"] for one in of))))  # fmt: skip
    header = ("form", "cases", "D ≥ 8", "detected", "right", "confidently wrong")
    note = "Detected and right: of those with D of at least 8. Confidently wrong: of all."
    wrong = [one for one in result["records"] if not one["null"] and not one["inside"] and one["wrong"]]
    other = [one for one in here if (one["d"] or 0.0) >= SEEN and one["named"] and not one["right"]]
    below = [
        (*row, fixed(one.get("answer below"), 1))
        for one in sorted(other, key=lambda one: -(one["d"] or 0.0))
        for row in case_rows([one])
    ]
    told = (
        "Below: by how many nats the named effect is less probable than the truth, with the noise estimated for "
        "each. The form of the truth is known here: where the difference is only a few nats, the recording hardly "
        "separates the two."
    )
    return [
        *targets.table(result, "outside"),
        Picture("outside", "The first answer for effects that are not in the vocabulary."),
        *_rates("By size", result["outside"], note="A disturbance of limited duration is counted separately."),
        *table("Each form", header, rows, note),
        *table("Another name was given, D of at least 8", (*CASES, "below"), below, told, align=CASES_ALIGN + "r"),
        *table("Confidently wrong", CASES, case_rows(wrong), align=CASES_ALIGN),
    ]


def _nulls(result: dict) -> list[Block]:
    alarms = [one for one in result["records"] if one["false alarm"]]
    return [
        *targets.table(result, "false alarms"),
        *_rates("False alarms, by kind and recording", result["false alarms"]),
        *table("Each false alarm", CASES, case_rows(alarms), align=CASES_ALIGN),
    ]


def _confusion(result: dict) -> list[Block]:
    wrong = [one for one in result["records"] if one["inside"] and one["wrong"]]
    return [
        Picture("confusion", "Green: the right name and axis. Grey: nothing was named. Red: another name."),
        *table("Confidently wrong inside the vocabulary", CASES, case_rows(wrong), align=CASES_ALIGN),
    ]


def _bands(title: str, group: dict, first: str, keys: Sequence[str], label: str = "{key}, {band}") -> list[Table]:
    """Counts of hits and cases, a row a key, in the column `first`, and a column a band."""
    names = [name for _, _, name in BANDS]
    rows = []
    for key in keys:
        found = [group.get(label.format(key=key, band=name)) for name in names]
        if any(found):
            rows.append(
                (short(key), *(MISSING if one is None else f"{one['hits']} of {one['count']}" for one in found))
            )
    header = (first, *(name.replace(">=", "≥").replace("<=", "≤") for name in names))
    return table(title, header, rows)


def _detection(result: dict) -> list[Block]:
    kinds = ("single", "limited", "pair", "triple", "four", "multi", "elsewhere", "unidentifiable", "outside",
             "inside the vocabulary", "outside the vocabulary")  # fmt: skip
    effects = sorted({name.split(":")[0] for name in result["by effect"] if not name.startswith("outside")})
    clear = [one for one in result["records"] if one["inside"] and one["band"] == BANDS[-1][2] and not one["heard"]]
    return [
        *targets.table(result, "detection"),
        Picture("by_band", "Detected, each kind of case by itself."),
        *_bands("Detected, by kind and size", result["detection"], "kind", kinds),
        Picture("by_effect", "Each effect of the vocabulary where it can be seen."),
        *_bands("Detected, by effect and size", result["by effect"], "effect", effects, "{key}: detected, {band}"),
        *_bands("Named first, by effect and size", result["by effect"], "effect", effects, "{key}: named, {band}"),
        *_rates("Detected, by what was recorded", _part(result["by recording"], "detected")),
        *table("Not detected although D is at least 16", CASES, case_rows(clear), align=CASES_ALIGN),
    ]


def _part(group: dict, word: str) -> dict:
    return {name: one for name, one in group.items() if word in name}


def _naming(result: dict) -> list[Block]:
    wrong = [one for one in result["records"]
             if "first" in one and one["kind"] != "unidentifiable" and not one["first"] and (one["d"] or 0.0) >= SEEN
             and one["margin"] >= 5.0]  # fmt: skip
    size = result["set size"]
    sizes = [("explanations named or listed", str(size["count"]), fixed(size["mean"], 2), *_quantiles(size, 0))]
    return [
        *targets.table(result, "naming", "set size", "confidently wrong"),
        *_rates("Naming", result["naming"], note=TWINS_NOTE),
        *_rates("Named first where separable, by what was recorded", _part(result["by recording"], "named")),
        *table("Sets", ("", "cases", "mean", *QUANTILES), sizes if size["count"] else []),
        *_rates("Confidently wrong", result["confidently wrong"]),
        *table("Separable, but not named first", CASES, case_rows(wrong), align=CASES_ALIGN),
    ]


QUANTILES = ("10 %", "25 %", "median", "75 %", "90 %")


def _quantiles(one: dict, digits: int = 2) -> list[str]:
    return [fixed(value, digits) for value in (one["quantiles"] or {}).values()]


def _alike(result: dict) -> list[Block]:
    made, rows = result["experiments"]["cases"], []
    for words in sorted({one["experiment"] or "none recommended" for one in made}):
        here = [one for one in made if (one["experiment"] or "none recommended") == words]
        rows.append((words, str(len(here)), str(sum(one["made"] for one in here)),
                     str(sum(one["separated"] for one in here))))  # fmt: skip
    note = (
        "Made with the same instrument and effect, and diagnosed together with the first recording. Separated: the "
        "truth is named first, and no rival that was listed before is still listed. Not made: there is no maker of "
        "it."
    )
    return [
        *targets.table(result, "not identifiable", "experiments"),
        *_rates("Cases that cannot be separated", result["not identifiable"]),
        *table("The recommended experiment", ("experiment", "cases", "made", "separated"), rows, note),
    ]


def _probability(result: dict) -> list[Block]:
    p = result["probability of the truth"]
    rows = [
        (f"{one['from']:g} to {one['to']:g}", fixed(one["stated"], 3), *spoken(one)) for one in result["calibration"]
    ]
    given = [("given to the truth", str(p["count"]), fixed(p["mean"], 2), *_quantiles(p))] if p["count"] else []
    return [
        *targets.table(result, "probability of the truth"),
        Picture("calibration", "Stated probabilities against how often they came true."),
        *table("Probability given to the truth, detected cases", ("", "cases", "mean", *QUANTILES), given),
        *table("Reliability", ("stated", "mean", "came true", *RATE[1:]), rows),
    ]


def _intervals(result: dict) -> list[Block]:
    coverage = {PARAMETERS.get(name, name): one for name, one in result["coverage"].items()}
    return [
        *targets.table(result, "coverage"),
        *_rates("Stated 95 % intervals that contain the truth", coverage),
    ]


def _where(result: dict) -> list[Block]:
    rows = [(name.replace(">=", "≥").replace("<=", "≤"), str(one["count"]), fixed(one["mean"], 2), *_quantiles(one))
            for name, one in result["overlap"].items()]  # fmt: skip
    note = "Intersection over union of the first interval that the answer states with the true one; 0 where silent."
    return [
        *targets.table(result, "location", "overlap"),
        *_rates("Channel and axis right", result["location"], note="Cases limited in axis or time, and steps."),
        *table("Overlap of the interval, by size", ("", "cases", "mean", *QUANTILES), rows, note),
    ]


def _fit(result: dict) -> list[Block]:
    one = result["removed"]
    rows = [("share removed", str(one["count"]), fixed(one["mean"], 2), *_quantiles(one))] if one["count"] else []
    energy = result["energy"]
    gone = [("share of its energy", str(energy["count"]), fixed(energy["mean"], 2), *_quantiles(energy))]
    of_another = (
        "1 − (t − f)' A (t − f) / t' A t of the truth t and the answer f, with the information A of the recording: the "
        "share of the effect that the answer would remove from another recording with the same path and noise. Of "
        "detected effects with D of at least 16 that noise could hide."
    )
    note = (
        "Excess: by how much the mean squared normalised innovation exceeds 1 on blocks that were not used. Share: "
        "what the named effects remove of it. Of detected effects of the vocabulary with D of at least 16."
    )
    return [
        *targets.table(result, "energy", "removed", "held out"),
        *table(
            "Energy of the effect removed",
            ("", "cases", "mean", *QUANTILES),
            gone if energy["count"] else [],
            of_another,
        ),
        *_rates("Of another recording", {"at least 80 % of the energy": energy["at least 80 %"]}),
        *_rates("On unused data, D of at least 16", result["held out"]),
        *table("Share of the excess removed", ("", "cases", "mean", *QUANTILES), rows, note),
    ]


def _navigation(result: dict) -> list[Block]:
    gains, rows = result["navigation"], []
    for measure, words in (("velocity_rms_mps", "horizontal velocity RMS"),
                           ("radial_error_rate_nmi_per_h", "radial error rate")):  # fmt: skip
        one = gains[measure]
        if one["count"]:
            rows.append((words, str(one["count"]), fixed(one["mean"], 2), *_quantiles(one)))
    note = (
        "(before - after) / (before - with nothing concealed) of pure-inertial navigation; single flights and drives "
        "with D of at least 16, detected, in which the truth itself gains more than 5 %. With nothing concealed: the "
        "same recording with the same noise, made without the effect."
    )
    return [
        *targets.table(result, "navigation"),
        *table("Share of the gain that correcting with the truth gives", ("", "cases", "mean", *QUANTILES), rows, note),
    ]


def _oracle() -> list[Block]:
    text = (
        "The oracle knows the effect but has to estimate the noise, as diagnose does, so D is the most that could be "
        "known. Above 2000 nats D is that of an oracle that also knows the noise. The gain of diagnose is computed "
        "with the noise of its answer. Without the effect the noise would be estimated larger and would absorb part "
        "of the gain; only D below 2000 nats allows for this, so most of those points lie above the line. At a point "
        "far below the line diagnose lost evidence."
    )
    return [*paragraphs(text), Picture("oracle", "Log evidence gained by diagnose and by the oracle.")]


def seconds(result: dict) -> list[Block]:
    rows = []
    for where in sorted({one["where"] for one in result["records"]}):
        taken = [one["seconds"] for one in result["records"] if one["where"] == where and one["seconds"] is not None]
        if taken:
            rows.append((where, str(len(taken)), *(fixed(float(x), 1) for x in np.quantile(taken, (0.5, 0.9, 1.0)))))
    failed = [(name.removeprefix("case-"), said.splitlines()[-1]) for name, said in result["failures"].items()]
    return [
        *table("Seconds for a case", ("recordings", "cases", "median", "90 %", "longest"), rows),
        *table("Cases that ended with an error", ("case", "sentence"), failed, align="ll"),
    ]


def _log(log: Sequence[dict]) -> list[Block]:
    rows = []
    for k, one in enumerate(log, start=1):
        verdicts = [row["verdict"] for row in one["found"].values()]
        rows.append((str(k), ", ".join(map(str, one["seeds"])), str(sum(one["cases"].values())),
                     ", ".join(short[:8] for short in one["generator_sha256"]),
                     ", ".join(short[:8] for short in one["package_sha256"]),
                     f"{verdicts.count(MET)} of {len(verdicts) - verdicts.count(OPEN)}"))  # fmt: skip
    header = ("run", "seed", "cases", "maker", "package", "targets met")
    return table(
        "In the order in which they were made", header, rows, "Each run with all its numbers: log.json.", "rrrllr"
    )
