"""Does the model that `diagnose` writes fly better? `python -m benchmark.runners.whole_instruments [--count 8]`.

Whole instruments of two populations (`worlds.whole`), each flown on three days of other courses, places and
temperatures. `diagnose --write-model` gets the first flight (`one`), the first two (`two`), or the first and chamber
runs of the three accelerometers (`chamber`), and the third flight is navigated

    without    by the belief as it is
    model      with the model
    observer   with what a linear Gaussian observer believes that knows the noise and the priors (`scores.observer`)

The instrument's own errors are those that stay with it from day to day. What they cause on the third flight follows
from its twin: the same day, course, temperature, turn-on biases, start, wander and noise, without them. The velocity
RMS of own errors is that of the difference between the horizontal velocities of a navigated flight and of its
navigated twin; the share that is left is this RMS with the model, over that without. So what a day draws anew, which
nobody could know, is in neither. `ins-eval predict` says before how much is left; `covered` counts how often it is
within its interval. Where `diagnose` fails there is no model, and all is left.
`reachable` is what the observer leaves of other instruments of the population on the same days: its median, and the
chance that a flight gets worse. Turn-on biases hide from every recording what is constant in it.

With `--output` each instrument is written as it comes, and found again by the same package: a run that was ended, or
is asked for more instruments or other modes, goes on.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from benchmark.runners.run import package_hash
from benchmark.scores.observer import observed, reachable, sums
from benchmark.worlds.whole import POPULATIONS, an_instrument
from ins_eval.cli import main as ins_eval
from ins_eval.compensation.file import believed_model
from ins_eval.effects import without_effects
from ins_eval.files import write_whole
from ins_eval.navigation import beginning, compensate, evaluate, samples
from ins_eval.parallel import results
from ins_eval.recording import form
from ins_eval.recording.belief import Belief
from ins_eval.tables import parse, read_toml

MODES = {"one": (0,), "two": (0, 1), "chamber": (0, "x", "y", "z")}
LATER = 2  # the day on which a model is flown
RESAMPLES, INTERVAL = 4000, (2.5, 97.5)
PERCENT = range(1, 100)
ABOUT_A_SECOND = 5  # steps of four samples at 20 Hz
TARGETS = {"one": 0.45, "two": 0.35, "chamber": 0.30}


def velocities(folder: Path, model: Path | None = None) -> np.ndarray:
    """Horizontal velocity (n, 2) in m/s of a flight navigated by pure inertial mechanization, as `evaluate` does."""
    recording = form.read(folder)
    if model is not None:
        recording = replace(recording, belief=parse(Belief, read_toml(model), str(model)))
    triad = [believed_model(recording.belief, axis, folder) for axis in "xyz"]
    velocity = compensate(samples(recording), triad, recording.interval_s)
    begin = beginning(recording, velocity)
    found = evaluate(*without_effects(recording, velocity, folder), align_on=begin, every=ABOUT_A_SECOND)
    return found.solution.velocity_n[:, :2]


def rms(velocity: np.ndarray) -> float:
    return float(np.sqrt((velocity**2).sum(axis=1).mean()))


def unit(population: str, seed: int, index: int, modes: Sequence[str]) -> dict[str, Any]:
    """One instrument, diagnosed in each of the `modes` and flown."""
    instrument = an_instrument(population, seed, index)
    with tempfile.TemporaryDirectory() as place:
        where = Path(place)
        later = instrument.flight(LATER)
        later.save(where / "later")
        instrument.flight(LATER, own=False).save(where / "twin")
        twin = velocities(where / "twin")
        before = rms(velocities(where / "later") - twin)
        out: dict[str, Any] = {"population": population, "index": index, "own_rms_mps": before, "modes": {}}
        seen = {}
        for day in dict.fromkeys(day for mode in modes for day in MODES[mode]):
            made = instrument.chamber(day) if isinstance(day, str) else instrument.flight(day)
            made.save(where / f"{day}")
            seen[day] = sums(instrument, made)
        for mode in modes:
            model, answer, expected = (where / f"{mode}.{kind}" for kind in ("toml", "json", "expected.json"))
            folders = [str(where / f"{day}") for day in MODES[mode]]
            parts = [seen[day] for day in MODES[mode]]
            instrument.flight(LATER, believed=observed(instrument, parts)).save(where / f"seen-{mode}")
            out["modes"][mode] = found = {
                "share": 1.0,
                "observer": rms(velocities(where / f"seen-{mode}") - twin) / before,
                "reachable": np.percentile(reachable(instrument, parts, later), PERCENT).tolist(),
                "covered": False,
            }
            code = ins_eval(["diagnose", *folders, "--write-model", str(model), "--json", str(answer), "--quiet"])
            code = code or ins_eval(["predict", str(model), str(where / "later"), "--json", str(expected), "--quiet"])
            if code:
                found["failed"] = code
                continue
            told = json.loads(expected.read_text())["velocity_rms"]
            found["share"] = share = rms(velocities(where / "later", model) - twin) / before
            found["expected"] = told
            found["covered"] = told["own_after"]["low"] <= share * before <= told["own_after"]["high"]
            found["verdict"] = json.loads(answer.read_text())["verdict"]
    return out


def units(
    population: str, seed: int, count: int, workers: int, modes: Sequence[str], output: Path | None = None
) -> Iterator[dict[str, Any]]:
    """The first `count` instruments of a population, those first that are known already in `output`.

    Each is written there as it comes, and known to the package that found it.
    """
    package, jobs = package_hash(), {}
    known: dict[int, dict[str, Any]] = {}
    for index in range(count):
        path = None if output is None else output / f"{population}-{seed}-{index}.json"
        before = json.loads(path.read_text()) if path is not None and path.exists() else {}
        known[index] = before if before.get("package") == package else {"modes": {}}
        if missing := [mode for mode in modes if mode not in known[index]["modes"]]:
            jobs[index] = population, seed, index, missing
        else:
            yield known[index]
    for index, found in results(unit, jobs, workers):
        one = {**found, "package": package, "modes": {**known[index]["modes"], **found["modes"]}}
        if output is not None:
            output.mkdir(parents=True, exist_ok=True)
            write_whole(output / f"{population}-{seed}-{index}.json", (json.dumps(one, indent=1) + "\n").encode())
        yield one


def summary(found: Sequence[dict[str, Any]], mode: str, seed: int = 0) -> dict[str, Any]:
    """Medians with 95 % intervals by bootstrap over instruments, and counts with exact ones."""
    each = [one["modes"][mode] for one in found if mode in one["modes"]]
    share, observer = (np.array([one[name] for one in each]) for name in ("share", "observer"))
    rng = np.random.default_rng(seed)
    rows = rng.integers(0, share.size, (RESAMPLES, share.size))
    worse, covered = int((share > 1.0).sum()), sum(one["covered"] for one in each)

    def exact(count: int) -> list[float]:
        return list(binomtest(count, share.size).proportion_ci(0.95))

    return {
        "instruments": share.size,
        "share": float(np.median(share)),
        "share_interval": np.percentile(np.median(share[rows], axis=1), INTERVAL).tolist(),
        "observer": float(np.median(observer)),
        "reachable": float(np.median([one["reachable"] for one in each])),
        "reachable_worse": float(np.mean([np.array(one["reachable"]) > 1.0 for one in each])),
        "observer_less": float(np.median(share - observer)),
        "observer_less_interval": np.percentile(np.median((share - observer)[rows], axis=1), INTERVAL).tolist(),
        "worse_than_without": worse,
        "worse_interval": exact(worse),
        "failed": sum("failed" in one for one in each),
        "covered": covered,
        "covered_interval": exact(covered),
        "target": TARGETS[mode],
    }


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmark.runners.whole_instruments", description=__doc__)
    parser.add_argument("--count", type=int, default=8, help="instruments of each population (8)")
    parser.add_argument("--seed", type=int, default=1, help="of the instruments (1)")
    parser.add_argument("--workers", type=int, default=1, help="instruments at a time (1)")
    parser.add_argument("--population", choices=POPULATIONS, action="append", help="one of them (both)")
    parser.add_argument("--mode", choices=MODES, action="append", help="what is diagnosed (all three)")
    parser.add_argument("--output", type=Path, help="folder of the instruments and of whole_instruments.json")
    options = parser.parse_args(arguments)
    modes, found = options.mode or list(MODES), []
    for population in options.population or list(POPULATIONS):
        for one in units(population, options.seed, options.count, options.workers, modes, options.output):
            found.append(one)
            words = ", ".join(f"{m} {x['share']:.2f} (observer {x['observer']:.2f})" for m, x in one["modes"].items())
            print(f"{population} {one['index']}: {one['own_rms_mps']:.2f} m/s; left: {words}", flush=True)
    tables = {mode: summary(found, mode) for mode in modes}
    for mode, table in tables.items():
        print(f"{mode}: {json.dumps(table)}")
    if options.output is not None:
        found.sort(key=lambda one: (one["population"], one["index"]))
        text = json.dumps({"seed": options.seed, "instruments": found, "summary": tables}, indent=1)
        write_whole(options.output / "whole_instruments.json", (text + "\n").encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
