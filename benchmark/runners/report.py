"""`python -m benchmark.runners.report FOLDER ANSWERS [--output reports/concealed]`: what was found of what hid.

FOLDER is what `benchmark.runners.make` wrote, ANSWERS what `benchmark.runners.run` made of it, with its ``bound``,
``navigation`` and ``experiments`` where they were made. Writes ``index.html``, ``metrics.json`` (each rate, and the
record of each case), ``manifest.json``, and adds a line to ``log.json``, the list of all runs on sealed sets.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from importlib.metadata import version
from pathlib import Path

from benchmark.runners import bound, experiments, figures, navigation, run
from benchmark.runners.pages import content
from benchmark.runners.targets import TARGETS, found, verdict
from benchmark.scores.score import SEEN, judged, rate, read, summary
from ins_eval.files import write_whole
from ins_eval.report.json_file import as_json
from ins_eval.report.results import write_results

TITLE = "Concealed effects"
LOG = "log.json"


def result_of(folder: Path, answers: Path) -> dict:
    """All numbers of a run."""
    truths, given, runs = read(folder / "truth"), read(answers), run.read_runs(answers)
    limits = answers / bound.FILE
    could = json.loads(limits.read_text()) if limits.exists() else {}
    truths = bound.estimated(truths, could)
    given = {name: one for name, one in given.items() if name in runs}
    records = [
        judged(one, given.get(name), runs.get(name, {}).get("seconds"))
        | {"answer below": could.get(name, {}).get("answer_below")}
        for name, one in truths.items()
    ]
    result = summary(records) | {"energy": bound.removed(records, could)}
    known = answers / navigation.FILE
    result["navigation"] = navigation.gains(records, json.loads(known.read_text()) if known.exists() else {})
    joint = answers / experiments.ANSWERS
    made = experiments.outcomes(truths, given, read(joint) if joint.exists() else {})
    done = [one for one in made if one["made"]]
    result["experiments"] = {
        "cases": made,
        "recommended": rate(sum(one["experiment"] is not None for one in made), len(made)),
        "separates": rate(sum(one["separated"] for one in done), len(done)),
    }
    errors = {path.stem: path.read_text().strip() for path in sorted(answers.glob("*.error"))}
    return result | {"failures": errors}


def manifest(folder: Path, answers: Path) -> dict:
    """What the numbers were made from."""
    made = json.loads((folder / "truth" / "manifest.json").read_text())["made"]
    kinds = Counter(one["kind"] for one in read(folder / "truth").values())
    return {
        "sets": sorted({one["set"] for one in made}), "seeds": sorted({one["seed"] for one in made}),
        "generator_sha256": sorted({one["generator_sha256"] for one in made}), "cases": dict(sorted(kinds.items())),
        "mixed_noise": any(one.get("mixed_noise", False) for one in made),
        "package": f"ins-eval {version('ins-eval')}",
        "package_sha256": sorted({one["package"] for one in run.read_runs(answers).values()}),
    }  # fmt: skip


def drawings(records: list[dict]) -> dict:
    """The figures that the records allow."""
    seen = [one for one in records if not one["null"] and (one["d"] or 0.0) >= SEEN]
    single = [one for one in seen if "first" in one and one["kind"] != "unidentifiable"]
    outside = [one for one in seen if one["kind"] == "outside"]
    hidden = [one for one in records if not one["null"]]
    inside = [one for one in records if one["inside"]]
    out = {}
    if outside:
        note = (
            f"Forms that are not in the vocabulary, D of at least {SEEN:g}, in brackets how many. Right is "
            "'unexplained', or the recorded column that drives the effect."
        )
        out["outside"] = figures.confusion(
            outside, "Answers for effects outside the vocabulary", note, ("unexplained", "composed, right column")
        )
    if single:
        note = (
            f"One effect of the vocabulary, D of at least {SEEN:g}, in brackets how many; cases that one recording "
            "cannot separate by construction are left out. T' is dT/dt."
        )
        out["confusion"] = figures.confusion(single, "Concealed and named first", note)
        out["by_effect"] = figures.by_effect(single)
    if hidden:
        out["by_band"] = figures.by_band(hidden)
    if inside:
        out["oracle"] = figures.oracle(inside)
    return out


def logged(log: list[dict], entry: dict) -> list[dict]:
    """The log with this run at its end; the same run is not written twice."""
    return log if entry in log else [*log, entry]


def headline(result: dict) -> dict:
    """The numbers of the targets, for the log."""
    out = {}
    for one in TARGETS:
        value = found(one, result)
        kept = [value["hits"], value["count"]] if isinstance(value, dict) else value
        out[f"{one.line} {one.words}"] = {"found": kept, "verdict": verdict(one, result)}
    return out


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmark.runners.report", description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="what the maker wrote: recordings and truth")
    parser.add_argument("answers", type=Path)
    parser.add_argument("--output", type=Path, default=Path("reports/concealed"))
    parser.add_argument("--quiet", action="store_true")
    chosen = parser.parse_args(arguments)
    made = manifest(chosen.folder, chosen.answers)
    if len(made["package_sha256"]) != 1:
        parser.error(
            f"{chosen.answers}: answers of {len(made['package_sha256'])} versions of the package, expected one; run "
            "`python -m benchmark.runners.run` again, it makes those anew that are old"
        )
    result = result_of(chosen.folder, chosen.answers)
    drawn = drawings(result["records"])
    if result["calibration"]:
        drawn["calibration"] = figures.calibration(result["calibration"])
    log = json.loads((chosen.output / LOG).read_text()) if (chosen.output / LOG).exists() else []
    if "sealed" in made["sets"]:
        log = logged(log, made | {"found": headline(result)})
        write_whole(chosen.output / LOG, as_json(log))
    answer, sections = content(result, log)
    write_whole(chosen.output / "manifest.json", as_json(made))
    write_results(chosen.output, TITLE, answer, sections, result, drawn, chosen.quiet)
    return 0


if __name__ == "__main__":
    sys.exit(main())
