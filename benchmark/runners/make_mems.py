"""`python -m benchmark.runners.make_mems --seed 1 --count 100 -o DIR`: effects concealed in drives and flights of MEMS.

Each journey of `worlds.mems` as it is and with an effect: ``DIR/recordings/CASE`` and, apart from them,
``DIR/truth/CASE.json`` with what the oracle sees of it. What is finished is kept, so that an interrupted run goes on.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from benchmark.runners.make_real import begun, numbers, write
from benchmark.scores.detectable import Oracle
from benchmark.worlds import mems
from benchmark.worlds.into_data import apply
from ins_eval.parallel import in_order

SET = "mems"


def make(folder: Path, seed: int, index: int) -> str:
    """Write the cases of a journey; returns what it is in words."""
    name = folder / "truth" / f"case-mems-{index:03d}-hidden-00.json"
    if name.exists():
        return "there"
    journey = mems.a_journey(seed, index)
    oracle = Oracle(journey.seen, journey.source.arc_s)
    for case in journey.cases:
        seen = None if case.effect is None else numbers(oracle, case, apply(journey.seen, case.effect))
        write(case, folder, case.truth(seed, SET) | {"oracle": seen})
    return f"{journey.source.title}, {journey.recorded.seconds:.0f} s"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmark.runners.make_mems", description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=100, help="journeys")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, required=True)
    chosen = parser.parse_args(arguments)
    begun(parser, chosen.output, SET, chosen.seed)
    jobs = ((chosen.output, chosen.seed, index) for index in range(chosen.count))
    for index, words in enumerate(in_order(make, jobs, chosen.workers)):
        print(f"mems-{index:03d}: {words}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
