"""`python -m tests.challenge.score TRUTH ANSWERS [--json FILE]`: count what answers got right.

TRUTH holds CASE.json of the maker, ANSWERS a CASE.json of each case in the form `ins-diagnosis/1`. Nothing is averaged
away: every rate comes with its counts and an exact 95 % interval, a missing answer counts as a failure.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
from scipy.stats import beta

BANDS = ((-np.inf, 4.0, "D < 4"), (4.0, 8.0, "4 <= D < 8"), (8.0, 16.0, "8 <= D < 16"), (16.0, np.inf, "D >= 16"))
NULLS = ("zero", "null", "adversarial")
SEPARABLE = 5.0  # margin of the oracle above which one recording can tell
ALIKE = 3.0  # and below which it cannot
SILENT = "no mismatch"


def rate(hits: int, count: int) -> dict:
    """A proportion with its exact (Clopper-Pearson) 95 % interval."""
    low = float(beta.ppf(0.025, hits, count - hits + 1)) if hits else 0.0
    high = float(beta.ppf(0.975, hits + 1, count - hits)) if hits < count else 1.0
    return {"hits": hits, "count": count, "rate": hits / count if count else None, "interval95": [low, high]}


def key(entry: dict) -> tuple:
    return entry.get("name"), entry.get("axis")


def listed(answer: dict) -> set:
    """Every explanation that the answer names or lists."""
    return {key(one) for one in (*answer.get("effects", ()), *answer.get("indistinguishable", ()))}


def given(answer: dict, truth: tuple) -> float:
    """Probability that the answer gives to the truth."""
    found = [one for one in (*answer.get("effects", ()), *answer.get("indistinguishable", ())) if key(one) == truth]
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


def band(d: float) -> str:
    return next(name for low, high, name in BANDS if low <= d < high)


def rivals_of(truth: dict) -> set:
    """Single rivals that the oracle cannot separate, as (name, axis)."""
    out = set()
    for one in (truth.get("oracle") or {}).get("rivals", ()):
        words = one["rival"].split()
        if one["margin"] < ALIKE and "+" not in words:
            axis = words[1] if len(words) > 1 else None
            out.add((words[0], axis))
    return out - {key(one) for one in truth["effects"]}


class Count:
    """Hits and trials by what they are of."""

    def __init__(self) -> None:
        self.rows: dict[str, list[bool]] = {}

    def add(self, name: str, hit: bool) -> None:
        self.rows.setdefault(name, []).append(bool(hit))

    def rates(self) -> dict:
        return {name: rate(sum(hits), len(hits)) for name, hits in self.rows.items()}


def score(truths: list[dict], answers: dict[str, dict]) -> dict:
    """All rates, by kind, band and effect."""
    alarms, detection, naming, outside, place, covered, alike, pairs = (Count() for _ in range(8))
    wrong, by_effect, fits = Count(), Count(), Count()
    sizes, probabilities, overlaps, missing = [], [], {}, []
    for truth in truths:
        kind, name = truth["kind"], truth["case"]
        answer = answers.get(name)
        if answer is None:
            missing.append(name)
            answer = {"verdict": "missing"}
        heard = answer["verdict"] not in (SILENT, "missing")
        if kind in NULLS:
            alarms.add(kind, answer["verdict"] != SILENT)
            for one in truth["recordings"]:
                alarms.add(f"{kind}, {one['kind']}", answer["verdict"] != SILENT)
            continue
        oracle = truth["oracle"] or {"log_bayes_factor": np.nan, "margin": np.nan}
        d, margin = oracle["log_bayes_factor"], oracle["margin"]
        in_band = band(d) if np.isfinite(d) else "D unknown"
        detection.add(f"{kind}, {in_band}", heard)
        targets = {key(one) for one in truth["effects"]}
        names = listed(answer)
        if kind == "outside":
            driver = truth["effects"][0].get("driver")
            right = answer["verdict"] == "unexplained" or composed(answer, driver)
            if d >= 8.0:
                outside.add("unexplained or the driving column, D >= 8", heard and right)
            outside.add("confidently wrong", confidently_wrong(answer, targets, driver))
            by_effect.add(f"{truth['effects'][0]['name']}: right, {in_band}", heard and right)
        elif not truth["outside"]:
            wrong.add(f"inside, {kind}", confidently_wrong(answer, targets))
            if len(targets) == 1:
                (target,) = targets
                first = bool(answer.get("effects")) and key(answer["effects"][0]) == target
                label = f"{target[0]}, {in_band}"
                by_effect.add(f"{label}: detected", heard)
                by_effect.add(f"{label}: named", first)
                if kind == "unidentifiable":
                    rivals = {(one["name"], one["axis"]) for one in truth.get("alike", ())}
                    alike.add("detected", heard)
                    said = answer["verdict"] in ("not identifiable", "partly explained")
                    said = said and target in names and bool(rivals & names)
                    alike.add("said so, with the truth and a true rival", said)
                elif d >= 8.0:
                    where = "several recordings" if len(truth["recordings"]) > 1 else "one recording"
                    if margin >= SEPARABLE:
                        naming.add(f"named first where separable, {where}", first)
                if heard:
                    naming.add("named or listed, of the detected", target in names)
                    sizes.append(len(names))
                    probabilities.append(given(answer, target))
                    for rival in rivals_of(truth):
                        naming.add("inseparable rival listed", rival in names)
            else:
                both = [key(one) for one in answer.get("effects", ())]
                pairs.add(f"both named, {in_band}", targets <= set(both))
                pairs.add(f"nothing else named, {in_band}", set(both) <= targets)
            for effect in truth["effects"]:
                for one in answer.get("effects", ()):
                    if key(one) == key(effect):
                        _cover(covered, one, effect)
        if heard and d >= 16.0 and not truth["outside"]:
            _fit(fits, answer)
        if truth["channel"] and (kind == "limited" or truth["interval_s"]):
            seen = answer.get("mismatch") or [{}]
            place.add(f"channel, {in_band}", heard and _same_place(seen[0].get("channel"), truth["channel"]))
            if truth["interval_s"]:
                overlaps.setdefault(in_band, []).append(overlap(seen[0].get("interval_s"), truth["interval_s"]))
    return {
        "cases": len(truths), "missing": missing,
        "outside": outside.rates(), "false alarms": alarms.rates(), "detection": detection.rates(),
        "naming": naming.rates(), "confidently wrong": wrong.rates(), "pairs": pairs.rates(),
        "not identifiable": alike.rates(), "location": place.rates(),
        "median overlap": {name: float(np.median(one)) for name, one in overlaps.items()},
        "coverage": covered.rates(), "held out, D >= 16": fits.rates(),
        "mean set": float(np.mean(sizes)) if sizes else None,
        "mean probability of the truth": float(np.mean(probabilities)) if probabilities else None,
        "by effect": by_effect.rates(),
    }  # fmt: skip


def _same_place(seen: str | None, truth: str) -> bool:
    return seen is not None and (seen == truth or (truth.startswith("gps") and seen.startswith("gps")))


def _fit(fits: Count, answer: dict) -> None:
    """On data that was not used: 80 % of what exceeds white noise removed, and more than the placebo removes."""
    held = (answer.get("fit") or {}).get("held_out") or {}
    before, after, placebo = (held.get(name, np.nan) for name in ("before", "after", "placebo"))
    fits.add("80 % of the excess removed", before - after >= 0.8 * (before - 1.0))
    fits.add("better than the placebo", after < placebo)


def _cover(covered: Count, answer: dict, effect: dict) -> None:
    """Whether stated 95 % intervals hold the truth; creep of another law has no one time constant."""
    parameters = answer.get("parameters", {})
    low_high = parameters.get("interval95")
    if low_high:
        covered.add("value", low_high[0] <= effect["value"] <= low_high[1])
    if effect.get("law", "one") == "one":
        for name in ("time_constant_s", "branch_width_c", "at_s"):
            interval = parameters.get(f"{name}_interval95")
            if interval and name in effect:
                covered.add(name, interval[0] <= effect[name] <= interval[1])


def text(result: dict) -> str:
    """The result as lines."""
    lines = [f"{result['cases']} cases, {len(result['missing'])} without an answer"]
    for group, rows in result.items():
        if group in ("cases", "missing"):
            continue
        if not isinstance(rows, dict):
            lines.append(f"{group}: {'-' if rows is None else format(rows, '.2f')}")
            continue
        lines += ["", group] if rows else []
        for name, one in rows.items():
            if isinstance(one, dict):
                low, high = one["interval95"]
                lines.append(f"  {name:70s} {one['hits']:4d} of {one['count']:4d}   [{low:.3f}, {high:.3f}]")
            else:
                lines.append(f"  {name:70s} {one:.3f}")
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.challenge.score", description=__doc__.splitlines()[0])
    parser.add_argument("truth", type=Path, help="folder of the maker's CASE.json")
    parser.add_argument("answers", type=Path, help="folder of the answers, CASE.json each")
    parser.add_argument("--json", type=Path)
    chosen = parser.parse_args(arguments)
    truths = [json.loads(path.read_text()) for path in sorted(chosen.truth.glob("case-*.json"))]
    answers = {path.stem: json.loads(path.read_text()) for path in sorted(chosen.answers.glob("case-*.json"))}
    result = score(truths, answers)
    print(text(result))
    if chosen.json:
        chosen.json.write_text(json.dumps(result, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
