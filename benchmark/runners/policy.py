"""`python -m benchmark.runners.policy RECORDINGS [--rerun 6] [--workers 2] -o FILE.md`: what thresholds decide.

RECORDINGS holds a folder for each case, of a set that was used before. Each case is diagnosed with `Policy` as it is,
then with each threshold halved and doubled, one at a time; counted are the cases whose verdict changes. A threshold of
`decide` is judged again from the same findings, in all cases. One that acts while findings are collected needs the
whole diagnosis again: that is done in the first `--rerun` cases, taken in turn from the verdicts there are.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections import Counter, defaultdict
from dataclasses import replace
from itertools import chain, zip_longest
from pathlib import Path

from tqdm import tqdm

from ins_eval.parallel import results

FACTORS = (0.5, 2.0)
DECIDE = ("least_gain_chamber", "interval", "interval_position", "interval_velocity", "interval_navigation",
          "interval_attitude", "harm", "left_open", "open_margin", "most_of_one", "unusual", "near",
          "probable")  # fmt: skip
COLLECT = ("odds", "worth_sets", "share", "share_chamber", "handicap", "repeats", "worth_refitting", "stay", "earth",
           "most_of_set", "remarkable", "hopeless", "promising", "alone", "stated")  # fmt: skip
OF_WORK = ("most_effects", "beam", "suspects")  # how much is looked at; more of it can only be slower
OF_LISTS = ("twin", "listed", "alike", "experiment_enough", "experiment_worth")  # no verdict asks for them


def findings_of(case: Path, policy):
    """What the recordings of a case hold under `policy`."""
    from threadpoolctl import threadpool_limits

    from ins_eval.analysis.diagnose import prepare_folders
    from ins_eval.diagnosis.answer.collect import collect

    folders = [case] if (case / "recording.toml").exists() else sorted(p.parent for p in case.glob("*/recording.toml"))
    with threadpool_limits(1):
        return collect(prepare_folders(folders), policy)


def verdict(findings, policy) -> str:
    """The verdict that is given, after the invariants."""
    from ins_eval.diagnosis.answer.decision import decide
    from ins_eval.diagnosis.answer.judge import consistent

    return consistent(findings, decide(findings, policy), policy).verdict


def changed(policy, name: str, factor: float):
    """The policy with one threshold times a factor."""
    return replace(policy, **{name: factor * getattr(policy, name)})


def decided(case: Path) -> dict[tuple[str, float], str]:
    """The verdict as it is, under ("", 1), and with each threshold of `decide` halved and doubled."""
    from ins_eval.policy import Policy

    policy = Policy()
    findings = findings_of(case, policy)
    verdicts = {("", 1.0): verdict(findings, policy)}
    for name in DECIDE:
        for factor in FACTORS:
            verdicts[name, factor] = verdict(findings, changed(policy, name, factor))
    return verdicts


def collected(case: Path, name: str, factor: float) -> str:
    """The verdict of a whole diagnosis with one threshold changed."""
    from ins_eval.policy import Policy

    policy = changed(Policy(), name, factor)
    return verdict(findings_of(case, policy), policy)


def moves(before: dict[Path, str], after: dict[Path, str]) -> str:
    """How many verdicts changed, and from what to what."""
    other = Counter((before[case], verdict) for case, verdict in after.items() if before[case] != verdict)
    told = ", ".join(f"{n} x {old} -> {new}" for (old, new), n in sorted(other.items()))
    return f"{other.total()} of {len(after)}" + (f": {told}" if told else "")


def table(before: dict[Path, str], after: dict[tuple[str, float], dict[Path, str]]) -> str:
    """The page."""
    from ins_eval.policy import Policy

    counts = Counter(before.values())
    lines = [
        "# What the thresholds of a diagnosis decide",
        "",
        f"Written by `python -m benchmark.runners.policy` from {len(before)} cases of a set that was used before "
        f"({', '.join(f'{n} {verdict}' for verdict, n in sorted(counts.items()))}). Each threshold of `Policy` "
        "(`ins_eval/policy.py`) was halved and doubled, the others as they are; counted are the cases whose "
        "verdict changed. A verdict that changes is not always a worse one. Where a threshold acts while findings are "
        "collected, the whole diagnosis was done again, in fewer cases.",
        "",
        "| threshold | value | meaning | chosen on | halved | doubled |",
        "|---|---|---|---|---|---|",
    ]
    for name, (value, means, on) in Policy.described().items():
        told = "how much is looked at" if name in OF_WORK else "no verdict asks for it"
        halved, doubled = (moves(before, after[name, f]) if (name, f) in after else told for f in FACTORS)
        lines.append(f"| `{name}` | {value:g} | {means} | {on} | {halved} | {doubled} |")
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmark.runners.policy", description=__doc__.splitlines()[0])
    parser.add_argument("recordings", type=Path, help="folder of the cases")
    parser.add_argument("--rerun", type=int, default=6, help="cases that are diagnosed again")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("-o", "--output", type=Path, required=True, help="the page")
    chosen = parser.parse_args(arguments)
    cases = sorted(path for path in chosen.recordings.glob("*") if path.is_dir())
    if not cases:
        parser.error(f"{chosen.recordings}: no case; expected folders of recordings")
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # the number of threads decides the last bits of a result
    jobs = {case: (case,) for case in cases}
    found = dict(tqdm(results(decided, jobs, chosen.workers), "cases", len(cases)))
    before = {case: found[case]["", 1.0] for case in cases}
    after = {(name, f): {case: found[case][name, f] for case in cases} for name in DECIDE for f in FACTORS}
    by_verdict = defaultdict(list)
    for case, verdict in before.items():
        by_verdict[verdict].append(case)
    again = [case for case in chain(*zip_longest(*by_verdict.values())) if case is not None][: chosen.rerun]
    again_jobs = {(name, f, case): (case, name, f) for name in COLLECT for f in FACTORS for case in again}
    for (name, f, case), verdict in tqdm(results(collected, again_jobs, chosen.workers), "thresholds", len(again_jobs)):
        after.setdefault((name, f), {})[case] = verdict
    chosen.output.write_text(table(before, after))
    return 0


if __name__ == "__main__":
    sys.exit(main())
