"""`python -m benchmark.scores.score TRUTH ANSWERS [--json FILE]`: count what answers got right.

TRUTH holds CASE.json of the maker, ANSWERS a CASE.json of each case in the form `ins-diagnosis/1`. Each case becomes
one record of what was right and what was wrong (`judged`), and every rate is a count over records. Nothing is averaged
away: a rate comes with its counts and an exact 95 % interval, a missing answer counts as a failure.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path

import numpy as np
from scipy.stats import beta

BANDS = ((-np.inf, 4.0, "D < 4"), (4.0, 8.0, "4 <= D < 8"), (8.0, 16.0, "8 <= D < 16"), (16.0, np.inf, "D >= 16"))
CLEAR = "D >= 16"
SEEN = 8.0  # D from which an effect can be expected to show
NULLS = ("zero", "null", "adversarial")
SEPARABLE = 5.0  # margin of the oracle above which one recording can tell
ALIKE = 3.0  # and below which it cannot
PLAIN = 12.0  # sigma beside the others from which one of several effects can be expected to be named
SETS_EACH = f"each of at least {PLAIN:g} sigma named or listed"
SETS_ALL = f"all of at least {PLAIN:g} sigma named or listed"
SETS_EXTRA = "something named that is not there"
SETS_MISSING = f"explained, with one of at least {PLAIN:g} sigma missing"
TWINS = f"twins listed, {CLEAR}"
SILENT = "no mismatch"
MEMORY = ("time_constant_s", "branch_width_c", "at_s")
PROBABILITY_EDGES = (0.0, 0.05, 0.2, 0.4, 0.6, 0.8, 0.9, 0.97, 1.0)
LEVELS = (0.1, 0.25, 0.5, 0.75, 0.9)


def rate(hits: int, count: int) -> dict:
    """A proportion with its exact (Clopper-Pearson) 95 % interval."""
    low = float(beta.ppf(0.025, hits, count - hits + 1)) if hits else 0.0
    high = float(beta.ppf(0.975, hits + 1, count - hits)) if hits < count else 1.0
    return {"hits": hits, "count": count, "rate": hits / count if count else None, "interval95": [low, high]}


def quantiles(values) -> dict:
    """Count, mean and quantiles of numbers."""
    values = [one for one in values if one is not None and math.isfinite(one)]
    if not values:
        return {"count": 0, "mean": None, "quantiles": None}
    at = {f"{level:g}": float(np.quantile(values, level)) for level in LEVELS}
    return {"count": len(values), "mean": float(np.mean(values)), "quantiles": at}


def key(entry: dict) -> tuple:
    return entry.get("name"), entry.get("axis")


def words(explanation: tuple) -> str:
    """An explanation (name, axis) as `NAME AXIS`."""
    return " ".join(str(one) for one in explanation if one)


def explanations(answer: dict) -> list[dict]:
    """All that the answer names, then what it lists."""
    return [*(answer.get("effects") or ()), *(answer.get("indistinguishable") or ())]


def listed(answer: dict) -> set:
    """Every explanation that the answer names or lists."""
    return {key(one) for one in explanations(answer)}


def given(answer: dict, truth: tuple) -> float:
    """Probability that the answer gives to the truth."""
    found = [one for one in explanations(answer) if key(one) == truth]
    return max((float(one.get("probability", 0.0)) for one in found), default=0.0)


def confidently_wrong(answer: dict, truths: set, driver: str | None = None) -> bool:
    """`explained`, no rival listed, and the truth absent."""
    if answer["verdict"] != "explained" or answer.get("indistinguishable"):
        return False
    return not (truths & listed(answer)) and not composed(answer, driver)


def composed(answer: dict, driver: str | None) -> bool:
    """Whether the answer names the column that really drives the effect."""
    return driver is not None and any(
        one.get("name") == "composed" and driver in (one.get("driver"), one.get("parameters", {}).get("driver"))
        for one in answer.get("effects", ())
    )


def overlap(first, second) -> float:
    """Intersection over union of two intervals."""
    if not first or not second:
        return 0.0
    inside = min(first[1], second[1]) - max(first[0], second[0])
    whole = max(first[1], second[1]) - min(first[0], second[0])
    return max(inside, 0.0) / whole if whole > 0 else 0.0


def band(d: float | None) -> str:
    return next((name for low, high, name in BANDS if d is not None and low <= d < high), "D unknown")


def rivals_of(truth: dict) -> set:
    """Single rivals that the oracle cannot separate, as (name, axis)."""
    return alike((truth.get("oracle") or {}).get("rivals", ())) - {key(one) for one in truth["effects"]}


def alike(rivals) -> set:
    """Of the oracle's rivals those that it cannot separate, as (name, axis); sets of several are left out."""
    return {explanation(one["rival"]) for one in rivals if one["margin"] < ALIKE and "+" not in one["rival"]}


def explanation(said: str) -> tuple:
    """(name, axis) of the oracle's words NAME [AXIS [OTHER]]."""
    name, *axes = said.split()
    return name, axes[0] if axes else None


def judged(truth: dict, answer: dict | None, seconds: float | None = None) -> dict:
    """What an answer got right of a case: one flat record, numbers and words only."""
    kinds = [one["kind"] for one in truth["recordings"]]
    oracle = truth["oracle"] or {}
    d, margin = (oracle.get(name) for name in ("log_bayes_factor", "margin"))
    answer = answer or {"verdict": "missing"}
    effects = answer.get("effects") or []
    targets = {key(one) for one in truth["effects"]}
    names = listed(answer)
    driver = truth["effects"][0].get("driver") if truth["outside"] else None
    record = {
        "case": truth["case"], "kind": truth["kind"], "where": " + ".join(kinds), "several": len(kinds) > 1,
        "null": truth["kind"] in NULLS, "inside": truth["kind"] not in NULLS and not truth["outside"],
        "truth": [words(key(one)) for one in truth["effects"]], "d": d, "margin": margin, "band": band(d),
        "verdict": answer["verdict"], "heard": answer["verdict"] not in (SILENT, "missing"),
        "named": [words(key(one)) for one in effects], "listed": sorted(words(one) for one in names),
        "gain": float(sum(one.get("log_evidence_gain") or 0.0 for one in effects)) if effects else None,
        "wrong": confidently_wrong(answer, targets, driver), "seconds": seconds,
        "fit": answer.get("fit") or {}, "driver": driver,
        "experiments": [one["experiment"] for one in answer.get("indistinguishable") or () if one.get("experiment")],
    }  # fmt: skip
    record["false alarm"] = record["null"] and answer["verdict"] != SILENT
    if truth["outside"]:
        right = answer["verdict"] == "unexplained" or composed(answer, driver)
        record["right"] = record["heard"] and right
    if record["inside"]:
        record["all named"] = targets <= {key(one) for one in effects}
        record["nothing else"] = {key(one) for one in effects} <= targets
        record["intervals"] = [row for one in truth["effects"] for row in _intervals(answer, one)]
    if record["inside"] and len(targets) > 1:
        said = {key(one) for one in effects}
        each = [(key(one), beside["sigma"], alike(beside["rivals"]))
                for one, beside in zip(truth["effects"], oracle.get("beside") or (), strict=False)]  # fmt: skip
        record["each"] = [(words(one), sigma, one in names or bool(near & said)) for one, sigma, near in each]
        record["not there"] = sorted(words(one) for one in said.difference(targets, *(near for *_, near in each)))
    if record["inside"] and len(targets) == 1:
        (target,) = targets
        record["first"] = bool(effects) and key(effects[0]) == target
        record["found"] = target in names
        record["given"] = given(answer, target)
        record["said"] = [(float(one.get("probability", 0.0)), key(one) == target) for one in explanations(answer)]
        record["rivals"] = [(words(one), one in names) for one in sorted(rivals_of(truth), key=str)]
        clear = band(oracle.get("noise_known", d)) == CLEAR  # to who knows the noise, as the twins are told by him
        twins = {explanation(one) for one in oracle.get("twins", ())} - targets if clear else ()
        record["twins"] = [(words(one), one in names) for one in sorted(twins, key=str)]
        rivals = {(one["name"], one["axis"]) for one in truth.get("alike", ())}
        said = answer["verdict"] in ("not identifiable", "partly explained")
        record["told alike"] = said and record["found"] and bool(rivals & names)
    if truth["channel"] and (truth["kind"] == "limited" or truth["interval_s"]):
        seen = (answer.get("mismatch") or [{}])[0]
        record["place"] = record["heard"] and _same_place(seen.get("channel"), truth["channel"])
        if truth["interval_s"]:
            record["overlap"] = overlap(seen.get("interval_s"), truth["interval_s"])
    return record


def _same_place(seen: str | None, truth: str) -> bool:
    return seen is not None and (seen == truth or (truth.startswith("gps") and seen.startswith("gps")))


def _intervals(answer: dict, effect: dict):
    """(parameter, holds the truth) of stated 95 % intervals; creep of another law has no one time constant."""
    for one in answer.get("effects") or ():
        if key(one) != key(effect):
            continue
        parameters, lawful = one.get("parameters", {}), effect.get("law", "one") == "one"
        interval = parameters.get("interval95")
        if interval:
            yield "value" if lawful else "value, creep of another law", interval[0] <= effect["value"] <= interval[1]
        for name in MEMORY if lawful else ():
            interval = parameters.get(f"{name}_interval95")
            if interval and name in effect:
                yield name, interval[0] <= effect[name] <= interval[1]


class Count:
    """Hits and trials by what they are of."""

    def __init__(self) -> None:
        self.rows: dict[str, list[bool]] = {}

    def add(self, name: str, hit: bool) -> None:
        self.rows.setdefault(name, []).append(bool(hit))

    def rates(self) -> dict:
        return {name: rate(sum(self.rows[name]), len(self.rows[name])) for name in sorted(self.rows, key=_by_size)}


def _by_size(name: str) -> tuple:
    """Names in the order of the alphabet, the bands of one name in that of D."""
    of, _, last = name.rpartition(", ")
    bands = [one for _, _, one in BANDS]
    return (of, bands.index(last), last) if last in bands else (name, -1, "")


def removed(record: dict) -> float | None:
    """Share of what exceeds white noise on unused data that the explanation removes."""
    held = record["fit"].get("held_out") or {}
    before, after = held.get("before"), held.get("after")
    if before is None or after is None or before <= 1.0:
        return None
    return (before - after) / (before - 1.0)


def beats_placebo(record: dict) -> bool:
    held = record["fit"].get("held_out") or {}
    return None not in (held.get("after"), held.get("placebo")) and held["after"] < held["placebo"]


def score(truths: list[dict], answers: dict[str, dict], seconds: dict[str, float] | None = None) -> dict:
    """All rates, by kind, band and effect, and the records that they count."""
    return summary([judged(one, answers.get(one["case"]), (seconds or {}).get(one["case"])) for one in truths])


def summary(records: list[dict]) -> dict:
    """The rates of records."""
    groups = ("outside", "false alarms", "detection", "naming", "confidently wrong", "sets", "not identifiable",
              "location", "coverage", "held out", "by effect", "by recording")  # fmt: skip
    counts = {name: Count() for name in groups}
    for one in records:
        _nulls(counts, one) if one["null"] else _hidden(counts, one)
    inside = [one for one in records if "given" in one and one["heard"] and one["kind"] != "unidentifiable"]
    clear = [one for one in records if one["inside"] and one["heard"] and one["band"] == CLEAR]
    said = [pair for one in inside for pair in one["said"]]
    result = {"cases": len(records), "missing": [one["case"] for one in records if one["verdict"] == "missing"]}
    result |= {name: count.rates() for name, count in counts.items()}
    return result | {
        "overlap": {name: quantiles(one["overlap"] for one in records if "overlap" in one and one["band"] == name)
                    for _, _, name in BANDS if any("overlap" in one and one["band"] == name for one in records)},
        "set size": quantiles(len(one["listed"]) for one in inside),
        "probability of the truth": quantiles(one["given"] for one in inside),
        "calibration": calibration(said),
        "removed": quantiles(removed(one) for one in clear),
        "records": records,
    }  # fmt: skip


def calibration(said: list[tuple[float, bool]]) -> list[dict]:
    """Stated probabilities in bins: how many, their mean, and the share that was the truth."""
    out = []
    for k, (low, high) in enumerate(zip(PROBABILITY_EDGES[:-1], PROBABILITY_EDGES[1:], strict=True)):
        last = k == len(PROBABILITY_EDGES) - 2
        here = [(p, hit) for p, hit in said if low <= p < high or (last and p >= high)]
        if here:
            stated = float(np.mean([p for p, _ in here]))
            out.append({"from": low, "to": high, "stated": stated} | rate(sum(hit for _, hit in here), len(here)))
    return out


def _nulls(counts: dict, one: dict) -> None:
    for name in (one["kind"], f"{one['kind']}, {one['where']}"):
        counts["false alarms"].add(name, one["false alarm"])


def _hidden(counts: dict, one: dict) -> None:
    """Count a case that conceals something."""
    band_, kind, heard, seen = one["band"], one["kind"], one["heard"], (one["d"] or 0.0) >= SEEN
    counts["detection"].add(f"{kind}, {band_}", heard)
    counts["detection"].add(f"{'inside' if one['inside'] else 'outside'} the vocabulary, {band_}", heard)
    if seen:
        counts["by recording"].add(f"{one['where']}: detected, D >= 8", heard)
    if "place" in one:
        counts["location"].add(f"channel, {band_}", one["place"])
    if not one["inside"]:
        _outside(counts, one)
        return
    counts["confidently wrong"].add(f"inside, {kind}", one["wrong"])
    counts["confidently wrong"].add("inside", one["wrong"])
    for parameter, holds in one["intervals"]:
        counts["coverage"].add(parameter, holds)
        counts["coverage"].add("all", holds)
    if heard and band_ == CLEAR:
        share = removed(one)
        counts["held out"].add("80 % of the excess removed", share is not None and share >= 0.8)
        counts["held out"].add("better than the placebo", beats_placebo(one))
    if "first" not in one:
        _sets(counts["sets"], one)
        return
    (target,) = one["truth"]
    name = target.split()[0]
    counts["by effect"].add(f"{name}: detected, {band_}", heard)
    counts["by effect"].add(f"{name}: named, {band_}", one["first"])
    for _, there in one["twins"] if heard else ():
        counts["naming"].add(TWINS, there)
    if kind == "unidentifiable":
        counts["not identifiable"].add("detected", heard)
        for of in ("", f", {band_}", ", D >= 8")[: 3 if seen else 2]:
            counts["not identifiable"].add(f"said so, with the truth and a true rival{of}", one["told alike"])
        for _, there in one["rivals"] if heard else ():
            counts["not identifiable"].add("inseparable rival listed", there)
        return
    if seen and one["margin"] >= SEPARABLE:
        many = "several recordings" if one["several"] else "one recording"
        counts["naming"].add(f"named first where separable, {many}", one["first"])
        counts["by recording"].add(f"{one['where']}: named first where separable, D >= 8", one["first"])
    if heard:
        counts["naming"].add("named or listed, of the detected", one["found"])
        counts["naming"].add(f"named or listed, of the detected, {band_}", one["found"])
        for _, there in one["rivals"]:  # of what is hardly there the oracle itself tells few effects from none
            counts["naming"].add("inseparable rival listed", there)
            if seen:
                counts["naming"].add("inseparable rival listed, D >= 8", there)


def _sets(count: Count, one: dict) -> None:
    """Count a case that conceals several effects; one counts as named where it is listed, or a rival of it is named."""
    kind, plain = one["kind"], [named for _, sigma, named in one["each"] if sigma >= PLAIN]
    count.add(f"{kind}: all named, {one['band']}", one["all named"])
    count.add(f"{kind}: nothing else named, {one['band']}", one["nothing else"])
    for named in plain:
        count.add(SETS_EACH, named)
        count.add(f"{kind}: {SETS_EACH}", named)
    if len(plain) > 1:
        count.add(f"{kind}: {SETS_ALL}", all(plain))
    count.add(SETS_EXTRA, bool(one["not there"]))
    if one["verdict"] == "explained":
        count.add(SETS_MISSING, not all(plain))


def _outside(counts: dict, one: dict) -> None:
    """A disturbance that merely lasts for a time, of the kind `limited`, is counted by itself."""
    name = one["truth"][0].split()[0]
    of = "" if one["kind"] == "outside" else f"{one['kind']}: "
    counts["outside"].add(f"{of}unexplained or the driving column, {one['band']}", one["right"])
    if (one["d"] or 0.0) >= SEEN:
        counts["outside"].add(f"{of}unexplained or the driving column, D >= 8", one["right"])
        if (one["margin"] or 0.0) >= SEPARABLE:  # the oracle that knows the law tells it from every named one
            counts["outside"].add(f"{of}unexplained or the driving column where separable, D >= 8", one["right"])
    counts["outside"].add(f"{of}confidently wrong", one["wrong"])
    counts["by effect"].add(f"{name}: detected, {one['band']}", one["heard"])
    counts["by effect"].add(f"{name}: right, {one['band']}", one["right"])


def read(folder: Path) -> dict[str, dict]:
    """CASE -> the JSON of each case in a folder."""
    return {path.stem: json.loads(path.read_text()) for path in sorted(folder.glob("case-*.json"))}


def text(result: dict) -> str:
    """The result as lines."""
    lines = [f"{result['cases']} cases, {len(result['missing'])} without an answer"]
    for group, rows in result.items():
        if group in ("cases", "missing", "records", "calibration") or not rows:
            continue
        lines += ["", group]
        for name, one in rows.items() if "count" not in rows else ((group, rows),):
            if "interval95" in one:
                low, high = one["interval95"]
                lines.append(f"  {name:70s} {one['hits']:4d} of {one['count']:4d}   [{low:.3f}, {high:.3f}]")
            elif one["quantiles"]:
                lines.append(f"  {name:70s} {one['quantiles']['0.5']:.3f} median, {one['mean']:.3f} mean")
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmark.scores.score", description=__doc__.splitlines()[0])
    parser.add_argument("truth", type=Path, help="folder of the maker's CASE.json")
    parser.add_argument("answers", type=Path, help="folder of the answers, CASE.json each")
    parser.add_argument("--json", type=Path)
    chosen = parser.parse_args(arguments)
    result = score(list(read(chosen.truth).values()), read(chosen.answers))
    print(text(result))
    if chosen.json:
        chosen.json.write_text(json.dumps(result, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
