"""`python -m benchmark.runners.make --set development --kind zero,null --count 4 --seed 1 -o DIR`.

Writes ``DIR/recordings/CASE[/RECORDING]`` and, apart from them, ``DIR/truth/CASE.json``.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from benchmark.worlds import cases
from ins_eval.parallel import results

WORLDS = Path(cases.__file__).resolve().parent


def code_hash() -> str:
    """SHA-256 of the worlds' modules, so that a frozen one can be known."""
    whole = hashlib.sha256()
    for path in sorted(WORLDS.glob("*.py")):
        whole.update(path.name.encode() + b"\0" + path.read_bytes())
    return whole.hexdigest()


def one(job) -> tuple[str, str, float]:
    """Draw and write a case; returns its name, kind and the seconds it took."""
    which, seed, rate, mixed_noise, kind, index, oracle, folder = job
    start = time.perf_counter()
    case = cases.draw(which, seed, kind, index, rate, mixed_noise)
    place = Path(folder, "recordings", case.name)
    for made in case.made:
        made.save(place if len(case.made) == 1 else place / made.name)
    if oracle and kind != "zero":
        from benchmark.scores import oracle as judge

        case.truth["oracle"] = judge.judge(case)
    (Path(folder, "truth") / f"{case.name}.json").write_text(json.dumps(cases.plain(case.truth), indent=1) + "\n")
    return case.name, kind, time.perf_counter() - start


def make(
    folder: Path,
    drawn: tuple[str, int, float | None, bool],
    wanted: Mapping[str, Sequence[int]],
    oracle: bool = True,
    workers: int = 1,
    scheduler: str | None = None,
) -> Iterator[tuple[str, str, float]]:
    """Make the cases `wanted`, kind -> indices, that `folder` does not hold yet; what `one` returns of each.

    `drawn` are the set, the seed, the samples a second (None for drawn ones) and whether half of the cases that hide
    something have adversarial noise.
    """
    which, seed, rate, mixed_noise = drawn
    (folder / "truth").mkdir(parents=True, exist_ok=True)
    (folder / "recordings").mkdir(parents=True, exist_ok=True)
    jobs = [
        (*drawn, kind, index, oracle, str(folder))
        for kind, indices in wanted.items()
        for index in indices
        if not (folder / "truth" / f"{cases.title(which, seed, kind, index)}.json").exists()
    ]
    for _, found in results(one, {job: (job,) for job in jobs}, workers, scheduler):
        yield found
    manifest = folder / "truth" / "manifest.json"
    made = json.loads(manifest.read_text())["made"] if manifest.exists() else []
    made.append({"set": which, "seed": seed, "wanted": {kind: list(indices) for kind, indices in wanted.items()},
                 "rate_hz": rate, "mixed_noise": mixed_noise, "generator_sha256": code_hash()})  # fmt: skip
    manifest.write_text(json.dumps({"made": made}, indent=1) + "\n")


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmark.runners.make", description=__doc__.splitlines()[0])
    parser.add_argument("--set", choices=list(cases.SETS), default="development", dest="which")
    parser.add_argument("--kind", default="null", help=f"one or more of {', '.join(cases.KINDS)}, with commas")
    parser.add_argument("--count", type=int, default=1, help="cases of each kind")
    parser.add_argument("--first", type=int, default=0, help="index of the first case")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rate", type=float, help="samples a second, instead of a drawn one")
    parser.add_argument("--mixed-noise", action="store_true", help="adversarial noise in half of what hides something")
    parser.add_argument("--no-oracle", action="store_true", help="leave out the oracle's numbers")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of Dask, on whose workers cases are made")
    parser.add_argument("-o", "--output", type=Path, required=True)
    chosen = parser.parse_args(arguments)
    kinds = chosen.kind.split(",")
    unknown = [kind for kind in kinds if kind not in cases.KINDS]
    if unknown:
        parser.error(f"unknown kind {unknown[0]}; expected some of {', '.join(cases.KINDS)}")
    indices = range(chosen.first, chosen.first + chosen.count)
    drawn = chosen.which, chosen.seed, chosen.rate, chosen.mixed_noise
    wanted = {kind: indices for kind in kinds}
    for name, kind, seconds in make(
        chosen.output, drawn, wanted, not chosen.no_oracle, chosen.workers, chosen.scheduler
    ):
        print(f"{name}  {kind:14s} {seconds:5.1f} s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
