"""`python -m benchmark.runners.make_real --seed 1 -o DIR [--only laser,drive]`: effects concealed in real recordings.

Each recording of `--recordings`, by default ../shared/recordings, as it is, its nulls, and one case for each effect:
``DIR/recordings/CASE`` and, apart from them, ``DIR/truth/CASE.json`` with what the oracle sees of it. A recording that
is absent is left out and said. What is finished is kept, so a run that was interrupted goes on.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import time
from pathlib import Path

from benchmark.runners import imported
from benchmark.runners.make import code_hash
from benchmark.scores.detectable import Oracle
from benchmark.worlds import real
from benchmark.worlds.cases import plain
from benchmark.worlds.recorded import Recorded

SET, MANIFEST = "real", "manifest.json"


def make(source: real.Source, recordings: Path, folder: Path, seed: int) -> int:
    """Write the cases of a source; returns how many there are, 0 where its recording is absent."""
    recorded = imported.recorded(source, recordings, folder / "imported" / source.name)
    if recorded is None:
        return 0
    drawn = list(real.cases(source, recorded, seed))
    if all((folder / "truth" / f"{case.name}.json").exists() for case in drawn):
        return len(drawn)
    oracle = Oracle(recorded, source.arc_s)
    for case in real.cases(source, recorded, seed, oracle.delay_s):
        if not (folder / "truth" / f"{case.name}.json").exists():
            seen = None if case.effect is None else numbers(oracle, case, case.recorded)
            write(case, folder, case.truth(seed, SET) | {"oracle": seen})
    return len(drawn)


def write(case: real.Case, folder: Path, truth: dict) -> None:
    """A case, and its truth once it is whole."""
    shutil.rmtree(folder / "recordings" / case.name, ignore_errors=True)  # a half of it
    case.recorded.save(folder / "recordings" / case.name)
    (folder / "truth" / f"{case.name}.json").write_text(json.dumps(plain(truth), indent=1) + "\n")


def numbers(oracle: Oracle, case: real.Case, after: Recorded) -> dict | None:
    """The oracle's numbers of what the effect of a case made `after` of its recording, in the unit of the effect.

    `own`: what the recording shows of it before, where it is known. Of a clock offset it is the delay that the oracle
    fitted. Constants and laws of temperature are taken off the unmodified recording as its own: nothing is known of
    them.
    """
    seen, effect = oracle.seen(after), case.effect
    if seen is None:
        return None
    own: float | None = effect.value * seen.own
    if effect.name.endswith("time_offset"):
        own += oracle.delay_s
    elif effect.name.endswith(".bias") or "_temperature" in effect.name:
        own = None
    return {"log_bayes_factor": seen.d, "open_log_bayes_factor": seen.open_d, "own": own,
            "sigma": abs(effect.value) * seen.sigma}  # fmt: skip


def begun(parser: argparse.ArgumentParser, folder: Path, of_set: str, seed: int) -> dict:
    """What the cases of a folder are made from, written down before the first; ends where it holds others."""
    made_from = {"set": of_set, "seed": seed, "generator_sha256": code_hash()}
    manifest = folder / MANIFEST
    before = json.loads(manifest.read_text()) if manifest.exists() else made_from
    if not made_from.items() <= before.items():
        parser.error(f"{folder}: holds cases of another seed or maker; remove it, or name another folder")
    for part in ("truth", "recordings"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    manifest.write_text(json.dumps(before, indent=1) + "\n")
    return before


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmark.runners.make_real", description=__doc__.splitlines()[0])
    parser.add_argument("--recordings", type=Path, default=imported.RECORDINGS)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default=",".join(one.name for one in real.SOURCES), help="recordings, with commas")
    parser.add_argument("-o", "--output", type=Path, required=True)
    chosen = parser.parse_args(arguments)
    names = chosen.only.split(",")
    unknown = set(names) - {one.name for one in real.SOURCES}
    if unknown:
        known = ", ".join(one.name for one in real.SOURCES)
        parser.error(f"--only {sorted(unknown)[0]}: no such recording; expected some of {known}")
    before = begun(parser, chosen.output, SET, chosen.seed)
    made = before.get("cases", {})
    for source in real.SOURCES:
        if source.name not in names:
            continue
        begin = time.perf_counter()
        made[source.name] = make(source, chosen.recordings, chosen.output, chosen.seed)
        said = f"{made[source.name]} cases, {time.perf_counter() - begin:.0f} s"
        print(f"{source.name}: {said if made[source.name] else f'left out, {source.file} is absent here'}", flush=True)
        (chosen.output / MANIFEST).write_text(json.dumps(before | {"cases": made}, indent=1) + "\n")
    return 0 if any(made.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
