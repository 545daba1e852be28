"""`python -m benchmark.runners.short --count 100 --seed 1`: does every short recording get an answer?

Random recordings of 30 to 120 s, cut out of journeys of units of every grade of `benchmark.worlds.grades`, half of them
with a wrong description: a column with the other sign, two columns exchanged, rates in degrees, forces in g. Each is
diagnosed, and must end with a verdict or with one sentence. Anything else is a defect, printed with its traceback.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmark.worlds import grades
from benchmark.worlds.elsewhere import ELSEWHERE
from benchmark.worlds.record import Made
from benchmark.worlds.trajectories import TRAJECTORIES
from ins_eval.parallel import results

LENGTHS_S = (30.0, 120.0)
RATE_HZ = 50.0
GRAVITY = 9.80665  # m/s^2, CGPM 1901
WRONG_SHARE = 0.5
SENTENCE, DEFECT = "refused", "defect"


def reversed_axis(rng: np.random.Generator, imu: dict) -> str:
    """One column with the other sign."""
    column = f"{rng.choice(['gyro', 'accel'])}_{rng.choice(list('xyz'))}"
    imu[column] = -imu[column]
    return f"{column} reversed"


def exchanged_axes(rng: np.random.Generator, imu: dict) -> str:
    """Two columns of a sensor that stand for each other."""
    sensor, (a, b) = rng.choice(["gyro", "accel"]), rng.choice(list("xyz"), 2, replace=False)
    imu[f"{sensor}_{a}"], imu[f"{sensor}_{b}"] = imu[f"{sensor}_{b}"], imu[f"{sensor}_{a}"]
    return f"{sensor} {a} and {b} exchanged"


def other_unit(rng: np.random.Generator, imu: dict) -> str:
    """Rates in deg/s, or specific forces in g."""
    sensor, factor = (("gyro", np.rad2deg(1.0)), ("accel", 1.0 / GRAVITY))[rng.integers(2)]
    for axis in "xyz":
        imu[f"{sensor}_{axis}"] = factor * imu[f"{sensor}_{axis}"]
    return f"{sensor} times {factor:.4g}"


WRONG: tuple[Callable[[np.random.Generator, dict], str], ...] = (reversed_axis, exchanged_axes, other_unit)


def a_short_recording(seed: int, index: int) -> tuple[Made, str]:
    """Recording number `index`, and what it is in words."""
    rng = np.random.default_rng([seed, index])
    grade, trajectory = str(rng.choice(list(grades.RANGES))), str(rng.choice([*TRAJECTORIES, *ELSEWHERE]))
    made = grades.a_recording(rng, grade, trajectory, RATE_HZ)
    length_s = float(rng.uniform(*LENGTHS_S))
    begin_s = round(float(rng.uniform(0.0, made.felt.time_s[-1] - length_s)))
    grades.cut(made, begin_s, length_s)
    wrong = WRONG[rng.integers(len(WRONG))](rng, made.tables["imu"]) if rng.random() < WRONG_SHARE else "as it is"
    return made, f"{grade}, {trajectory}, {length_s:.0f} s from {begin_s} s, {wrong}"


def outcome(made: Made, folder: Path) -> tuple[str, str]:
    """The verdict, `refused` or `defect`, and the words that belong to it."""
    from ins_eval.analysis.diagnose import diagnose_folders
    from ins_eval.errors import InsEvalError

    made.save(folder)
    try:
        return diagnose_folders([folder]).answer["verdict"], ""
    except InsEvalError as refusal:
        words = str(refusal)
        return (SENTENCE if words and "\n" not in words else DEFECT), words
    except Exception:  # whatever else it is, it is what this looks for
        return DEFECT, traceback.format_exc()


def tried(seed: int, index: int) -> tuple[str, str, str]:
    """Recording number `index` in words, and its outcome."""
    made, words = a_short_recording(seed, index)
    with tempfile.TemporaryDirectory() as folder:
        return words, *outcome(made, Path(folder) / "recording")


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmark.runners.short", description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="index of the first recording")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    chosen = parser.parse_args(arguments)
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    counts: Counter[str] = Counter()
    jobs = {index: (chosen.seed, index) for index in range(chosen.first, chosen.first + chosen.count)}
    for index, (words, found, told) in results(tried, jobs, chosen.workers):
        counts[found] += 1
        print(f"{index}  {words}: {found}", told, flush=True)
    print(", ".join(f"{n} {what}" for what, n in counts.most_common()))
    return int(counts[DEFECT] > 0)


if __name__ == "__main__":
    sys.exit(main())
