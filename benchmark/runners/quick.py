"""`python -m benchmark.runners.quick [--seed 100] [--workers 2] [--without SENSOR]`: a fresh set of 40, in minutes.

Kinds stand in the proportions of the last whole sealed set without mixed noise, whose score
`reports/concealed/log.json` keeps; flights are shorter than there, since a long one takes a quarter of a minute.
Detected, named, confidently wrong and false alarms are held against what that score allows of so many cases, see
`scores.predictive`. Where one of them falls outside, or a case ends with an error, the exit code is 1. Writes a page
with the score, each case, and the five that tell most.

``--without`` cripples the search, which must then fall outside: a check of this check.
"""

from __future__ import annotations

import argparse
import json
import sys
from functools import partial
from pathlib import Path

import numpy as np

from benchmark.runners import bound, crippled, make, quick_page, report, run
from benchmark.runners.targets import TARGETS
from benchmark.scores.predictive import Compared, compare, shares
from benchmark.scores.score import read
from ins_eval.files import write_whole
from ins_eval.report.results import as_json, write_results

TITLE = "Concealed effects: a quick look"
LOG = Path("reports/concealed/log.json")
WHICH, RATE_HZ, COUNT, SEED = "quick", 20.0, 40, 100
# a rate, and the targets whose cases it counts
RATES = {
    "detected, D of at least 16": ("detected, D of at least 16",),
    "truth named or listed, of the detected": ("of the detected, truth named or listed",),
    "confidently wrong": ("confidently wrong inside the vocabulary", "confidently wrong outside the vocabulary"),
    "false alarms": ("false alarms, plain nulls", "false alarms, adversarial nulls"),
}


def whole_set(log: list[dict]) -> dict:
    """The last scoring of a set with most kinds of cases."""
    return max(reversed(log), key=lambda one: len(one["cases"]))


def plain_set(log: list[dict]) -> dict:
    """The same of sets without mixed noise, as a quick set is."""
    return whole_set([one for one in log if not one.get("mixed_noise")])


def drawn(counts: dict[str, int], seed: int, count: int = COUNT) -> dict[str, list[int]]:
    """Kind -> indices of `count` cases, at random among those that the whole set has of each."""
    rng = np.random.default_rng(seed)
    return {
        kind: sorted(int(k) for k in rng.choice(counts[kind], size, replace=False))
        for kind, size in sorted(shares(counts, count).items())
    }


def compared(fresh: dict, whole: dict) -> list[Compared]:
    """The rates of two scorings, each as `report.headline` has it."""

    def counted(found: dict, words: tuple[str, ...]) -> tuple[int, int]:
        rows = [found[f"{one.line} {one.words}"]["found"] or (0, 0) for one in TARGETS if one.words in words]
        return sum(row[0] for row in rows), sum(row[1] for row in rows)

    out = []
    for name, words in RATES.items():
        out.append(compare(name, counted(fresh, words), counted(whole, words), len(RATES)))
    return out


def verdict(found: list[Compared], cases: int, missing: int, seed: int, without: str | None) -> str:
    """One sentence: whether all lie within, and which do not; another where cases have no answer."""
    outside = [one.words for one in found if not one.inside]
    of = f"{cases} fresh cases, seed {seed}" + (
        f", with the effects of the {without} left out of the search" if without else ""
    )
    said = "within the range that the last whole set allows"
    if outside:
        said = f"outside the range that the last whole set allows: {'; '.join(outside)}"
    unanswered = f" {missing} of the cases ended with an error, see the page." if missing else ""
    return f"{of}: the score is {said}.{unanswered}"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmark.runners.quick", description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=SEED, help="of the cases (default: %(default)s)")
    parser.add_argument("--count", type=int, default=COUNT, help="cases (default: %(default)s)")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--without", choices=crippled.SENSORS, help="leave its effects out of the search")
    parser.add_argument("--cases", type=Path, metavar="DIR", help="of cases and answers (default: in .cache)")
    parser.add_argument("-o", "--output", type=Path, default=Path("reports/concealed-quick"))
    parser.add_argument("--quiet", action="store_true")
    chosen = parser.parse_args(arguments)
    folder = chosen.cases or Path(f".cache/concealed/quick-{chosen.seed}")
    answers = folder / ("answers" + (f"-without-{chosen.without}" if chosen.without else ""))
    whole = plain_set(json.loads(LOG.read_text()))
    wanted = drawn(whole["cases"], chosen.seed, chosen.count)
    for name, kind, seconds in make.make(folder, (WHICH, chosen.seed, RATE_HZ, False), wanted, workers=chosen.workers):
        print(f"{name}  {kind:14s} {seconds:5.1f} s", file=sys.stderr)
    work = partial(crippled.diagnose, chosen.without) if chosen.without else run.diagnose
    cases = {path.name: run.recordings(path) for path in sorted((folder / "recordings").iterdir())}
    run.run(cases, answers, chosen.workers, work=work)
    bound.main([str(folder), str(answers), "--workers", str(chosen.workers)])
    result = report.result_of(folder, answers)
    found = compared(report.headline(result), whole["found"])
    said = verdict(found, len(cases), len(result["missing"]), chosen.seed, chosen.without)
    telling = quick_page.telling(result["records"])
    figures = {"score": quick_page.score(found)}
    figures |= quick_page.drawings(telling, read(answers), cases, chosen.workers)
    sections = quick_page.sections(result, found, telling, whole)
    write_whole(chosen.output / "manifest.json", as_json(report.manifest(folder, answers)))
    numbers = ", ".join(f"{one.name.split(',')[0]} {one.fresh[0]} of {one.fresh[1]}" for one in found)
    answer = f"{said}\n{numbers[:1].upper()}{numbers[1:]}."
    write_results(chosen.output, TITLE, answer, sections, result, figures, chosen.quiet)
    well = all(one.inside for one in found) and not result["missing"]
    print(said, file=sys.stdout if well else sys.stderr)
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
