"""The gate fails what it is there to find: each mutant spoils a copy of the package, never the gate's own tables."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

FITTED, COMPENSATED = "calibration/models.py", "navigation.py"
SHARED, FLOWN = "ensemble/world.py", "ensemble/flight.py"
NATURE = "accelerometer/presets/jb-kt8.toml"


@dataclass(frozen=True)
class Mutant:
    """Exact replacements of text (file, old, new), and the conditions that must fail with so many instruments.

    A condition is "number, flight, quantity, measure", as the gate says it. Others may fail, too, but none that begins
    with one of `met`: a gate of those alone would have passed. The bands of conditions 3 and 4 widen as instruments
    become fewer and still hold a copy that is not spoiled; a gain needs the size of the gate to be sure, so where
    conditions 1 and 2 are to fail with fewer, the mutant has no gain at all.
    """

    replacements: tuple[tuple[str, str, str], ...]
    fails: tuple[str, ...]
    met: tuple[str, ...] = ()
    size: int = 40


MUTANTS = {
    "hysteresis fitted as simple": Mutant(
        ((FITTED, '"hysteresis": (polynomial, branches)', '"hysteresis": (line, line)'),),
        fails=("2, missions, hysteresis/simple, velocity RMS",),
        size=20,
    ),
    "bias of hysteresis blind to the direction": Mutant(
        ((FITTED, "import BranchCurve, branches", "import BranchCurve, piecewise as branches"),),
        fails=("2, missions, hysteresis/simple, velocity RMS", "4, paper, hysteresis, velocity RMS"),
        size=80,
    ),
    "branches exchanged": Mutant(
        (
            (
                "calibration/branches.py",
                "return BranchCurve(knots, solution[: knots.size], solution[knots.size :])",
                "return BranchCurve(knots, solution[knots.size :], solution[: knots.size])",
            ),
        ),
        fails=("2, missions, hysteresis/simple, velocity RMS", "4, paper, hysteresis, velocity RMS"),
    ),
    "sign of the rate in oven and flight": Mutant(
        ((COMPENSATED, "reading, rate)", "reading, -rate)"),),
        fails=("2, missions, hysteresis/simple, velocity RMS", "4, paper, hysteresis, velocity RMS"),
    ),
    "errors of simple 20 % larger": Mutant(
        (
            (
                FLOWN,
                "result[arm] = contributions(flown.errors)",
                "worse = 1.2 if arm == 'simple' else 1.0\n"
                "        result[arm] = {key: worse * value for key, value in contributions(flown.errors).items()}",
            ),
        ),
        fails=("4, paper, simple, velocity RMS",),
        met=("1, paper", "2, missions", "3, paper", "3, missions"),
        size=150,
    ),
    "refinement that looks at the flight": Mutant(
        (
            (SHARED, "oven.record(instrument, node.at(run))", 'oven.record(instrument, streams.at("flight"))'),
            (
                SHARED,
                "_oven_runs(self.population, self.oven, self",
                "_oven_runs(self.population, self.mission(index).in_oven(OVEN_RATE_HZ), self",
            ),
        ),
        fails=("4, paper, hysteresis_refined, velocity RMS",),
        met=("1, paper",),
        size=150,
    ),
    "half of the hysteresis removed from nature": Mutant(
        (
            (NATURE, "[thermal_lag]\nlag_s = 180.0", "[thermal_lag]\nlag_s = 90.0"),
            (NATURE, "half_opening_ppm = 200.0", "half_opening_ppm = 100.0"),
            (NATURE, "weights = [0.3, 0.35, 0.35]", "weights = [0.15, 0.175, 0.175]"),
        ),
        fails=("4, paper, simple, velocity RMS",),
        size=150,
    ),
    "hysteresis mirrored in simple": Mutant(
        (
            (
                SHARED,
                "            triads[arm] = triad\n",
                "            if arm == 'hysteresis_refined':\n"
                "                from ins_eval.compensation.mirrored import Mirrored\n"
                "                triad = list(map(Mirrored, triads['simple'], triad))\n"
                "            triads[arm] = triad\n",
            ),
        ),
        fails=(
            "1, paper, hysteresis_refined/simple, CEP rate",
            "1, paper, hysteresis_refined/simple, velocity RMS",
            "4, paper, hysteresis_refined, velocity RMS",
        ),
    ),
    "navigation started from the true attitude": Mutant(
        ((SHARED, 'if alignment == "given":', "if True:"),),
        fails=("4, paper, simple, CEP rate", "4, paper, hysteresis_refined, CEP rate"),
        size=60,
    ),
    "gyros without errors": Mutant(
        (
            (
                SHARED,
                "InstrumentPopulation(accelerometers, gyros, setting.gradient)",
                "InstrumentPopulation(accelerometers, gyros.perfect(), setting.gradient)",
            ),
        ),
        fails=("4, paper, hysteresis_refined, velocity RMS",),
        met=("1, paper",),
        size=150,
    ),
}


def copied(repository: Path, folder: Path) -> Path:
    """The folder with a copy of the package, its caches included."""
    for name in ("ins_eval", "trajectories"):
        shutil.copytree(repository / name, folder / name)
    return folder


def replace(folder: Path, file: str, old: str, new: str) -> None:
    """Replace a text that stands once in a file of the package."""
    path = folder / "ins_eval" / file
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, f"{file}: {old!r} stands there {text.count(old)} times"
    path.write_text(text.replace(old, new), encoding="utf-8")


def run(folder: Path, repository: Path, size: int, workers: int = 2) -> subprocess.CompletedProcess[str]:
    """Run the gate of the package in `folder`, held against the committed file of the repository."""
    command = [sys.executable, "-m", "ins_eval.cli", "check-cep", "--ensemble", str(size), "--workers", str(workers)]
    command += ["--committed", str(repository / "ins_eval/gate.toml"), "--output", str(folder / "out")]
    environment = {**os.environ, "PYTHONPATH": str(folder), "OPENBLAS_NUM_THREADS": "1"}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def failed(result: subprocess.CompletedProcess[str]) -> set[str]:
    """The conditions that did not hold."""
    assert result.returncode in (0, 1), result.stderr
    return set(re.findall(r"condition (\d, \w+, [\w/]+, [A-Za-z ]+):", result.stderr))


@pytest.fixture(scope="module")
def unspoiled(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[int], set[str]]:
    """What fails, with so few instruments, of a copy in which nothing was replaced."""
    folder = copied(repository, tmp_path_factory.mktemp("unspoiled"))
    return lambda size: failed(run(folder, repository, size))


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_it_is_the_copy_that_runs(repository: Path, tmp_path: Path, workers: int) -> None:
    copy = copied(repository, tmp_path)
    replace(copy, FLOWN, "    mission = world.mission(index)\n", "    raise InsEvalError(f'this is {__file__}')\n")
    imported = "from ins_eval import metrics\n"
    replace(copy, FLOWN, imported, f"{imported}from ins_eval.errors import InsEvalError\n")
    result = run(copy, repository, size=2, workers=workers)
    assert f"this is {copy / 'ins_eval' / FLOWN}" in result.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", MUTANTS)
def test_the_gate_fails_a_mutant(
    repository: Path, tmp_path: Path, unspoiled: Callable[[int], set[str]], name: str
) -> None:
    mutant, copy = MUTANTS[name], copied(repository, tmp_path)
    for replacement in mutant.replacements:
        replace(copy, *replacement)
    result = run(copy, repository, mutant.size)
    print(result.stdout)
    named = failed(result)
    assert result.returncode == 1
    assert set(mutant.fails) <= named
    bands = {condition for condition in mutant.fails if condition.startswith(("3", "4"))}
    assert not bands or not bands & unspoiled(mutant.size)
    assert not [condition for condition in named if condition.startswith(mutant.met or ("none",))]
