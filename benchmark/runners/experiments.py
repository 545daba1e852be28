"""`python -m benchmark.runners.experiments FOLDER ANSWERS [--workers 2]`: make the experiments that answers recommend.

For each case that one recording does not separate, the first experiment that its answer recommends is made with the
same instrument and the same effect, and both recordings are diagnosed together. It has separated where the truth is
then named first and none of the rivals that were listed before is still listed.

FOLDER is what the maker wrote, ANSWERS the folder of the answers; the joint answers go into ``ANSWERS/experiments``.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from pathlib import Path

from benchmark.runners import again, run
from benchmark.scores.score import SILENT, key, listed, read

ANSWERS = "experiments"


def recommended(answer: dict | None) -> str | None:
    """The experiment that an answer recommends first."""
    rivals = (answer or {}).get("indistinguishable") or ()
    return next((one["experiment"] for one in rivals if one.get("experiment")), None)


def make(folder: Path, answers: Path) -> dict[str, list[Path]]:
    """Make each recommended experiment: case -> the recording at hand and the new one."""
    manifest = json.loads((folder / "truth" / "manifest.json").read_text())
    given, out = read(answers), {}
    for name, truth in read(folder / "truth").items():
        words = recommended(given.get(name))
        if truth["kind"] != "unidentifiable" or words is None:
            continue
        short = hashlib.sha256(words.encode()).hexdigest()[:8]
        place = folder / ANSWERS / f"{name}-{short}"
        if not (place / "recording.toml").exists():
            made = again.experiment(truth, manifest, words)
            if made is None:
                continue
            again.save(made, place)
        out[name] = [folder / "recordings" / truth["recordings"][0]["path"], place]
    return out


def outcomes(truths: dict[str, dict], answers: dict[str, dict], joint: dict[str, dict]) -> list[dict]:
    """Of each case that cannot be separated and was detected: what was recommended, and whether it separated."""
    out = []
    for name, truth in truths.items():
        answer = answers.get(name)
        if truth["kind"] != "unidentifiable" or answer is None or answer["verdict"] == SILENT:
            continue
        (target,) = (key(one) for one in truth["effects"])
        after = joint.get(name)
        first = bool(after and after["effects"]) and key(after["effects"][0]) == target
        left = (listed(after) & (listed(answer) - {target})) if after else set()
        out.append({"case": name, "experiment": recommended(answer), "made": after is not None, "first": first,
                    "separated": first and not left})  # fmt: skip
    return out


def main(arguments: list[str] | None = None) -> int:
    about = __doc__.splitlines()[0]
    parser = argparse.ArgumentParser(prog="python -m benchmark.runners.experiments", description=about)
    parser.add_argument("folder", type=Path, help="what the maker wrote: recordings and truth")
    parser.add_argument("answers", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    chosen = parser.parse_args(arguments)
    run.run(make(chosen.folder, chosen.answers), chosen.answers / ANSWERS, chosen.workers)
    done = outcomes(read(chosen.folder / "truth"), read(chosen.answers), read(chosen.answers / ANSWERS))
    print(f"{sum(one['made'] for one in done)} experiments made, {sum(one['separated'] for one in done)} separated")
    return 0


if __name__ == "__main__":
    sys.exit(main())
