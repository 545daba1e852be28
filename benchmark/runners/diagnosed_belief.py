"""Paper A as an inverse problem: `python -m benchmark.runners.diagnosed_belief [--count 36] [--seed 14] [--workers 2]`.

An instrument with all the thermal physics of its accelerometers is believed `simple`, straight lines through the
chamber's points. `diagnose` gets one flight of it (with ``--chamber`` the three chamber recordings as well) and writes
what it believes then. Further flights of the same instrument, each switched on afresh, on a warmer day and another
course, are navigated with

    simple                the belief
    hysteresis            the hysteresis compensation, calibrated in the chamber
    hysteresis_refined    the same after an oven run
    diagnosed             the belief that `diagnose` wrote
    oracle                K1 and K0 themselves, but for what is drawn anew at each switch-on

and velocity RMS and radial error rate, each the RMS over these flights, are compared over instruments, paired. One
flight would do, but what a switch-on draws anew is as large as what is looked for, and averages out over several.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ins_eval import metrics
from ins_eval.cli import main as ins_eval
from ins_eval.compensation.file import believed_model, read_model
from ins_eval.effects import without_effects
from ins_eval.ensemble import Plan, World
from ins_eval.imu import Mission
from ins_eval.navigation import compensate, evaluate, measures, samples, standstill_to_align_on
from ins_eval.parallel import in_order
from ins_eval.profile import Anchor, Profile, load
from ins_eval.recording import Recording, form
from ins_eval.recording.belief import Belief
from ins_eval.streams import Streams
from ins_eval.tables import parse, read_toml
from ins_eval.units import STANDARD_GRAVITY, UG

PROFILE, SEED, COUNT = "climb-cruise-landing", 14, 36
RATE_HZ, LATER_RATE_HZ = 20.0, 10.0
FLIGHTS = 4  # after the one that is diagnosed
HEADING_DEG, GROUND_C, COLDEST_C = 200.0, 14.0, -6.0  # of the other day: the first has 60 degrees, 8 and -11 degC
COMPENSATIONS = ("simple", "hysteresis", "hysteresis_refined")
OF_A_RUN = ("turn_on", "in_run", "scale_repeatability", "noise", "quantisation")  # what no calibration can know
STATISTICS = {
    "velocity_rms_mps": metrics.root_mean_square,
    "radial_error_rate_nmi_per_h": metrics.root_mean_square,
}
RESAMPLES, INTERVAL = 2000, (2.5, 97.5)
Errors = dict[str, float]


def another_day() -> Profile:
    """The same flight on another course and a warmer day."""
    profile = load(PROFILE)
    anchor = Anchor(time_s=profile.thermal.anchor.time_s, temperature_c=COLDEST_C)
    return profile.model_copy(
        update={
            "name": f"{profile.name}, another day",
            "start": profile.start.model_copy(update={"heading_deg": HEADING_DEG}),
            "thermal": profile.thermal.model_copy(update={"ground_c": GROUND_C, "anchor": anchor}),
        }
    )


@dataclass(frozen=True)
class DiagnosedUnit:
    """What came of one instrument: errors of the later flights by arm, and the answer of `diagnose`."""

    errors: dict[str, Errors]
    answer: dict[str, Any]

    @property
    def named(self) -> list[str]:
        return [f"{one['name']} {one['axis'] or ''}".strip() for one in self.answer["effects"]]


class InverseProblem:
    """Instruments of one seed, their first flight on disk and the later ones in memory."""

    def __init__(self, folder: Path, seed: int = SEED):
        self.folder, self.seed = folder, seed
        self.world = World(Plan(profile=PROFILE, seed=seed, rate_hz=RATE_HZ))
        self.later = Mission(another_day(), LATER_RATE_HZ)

    def unit(self, index: int, chamber: bool = False) -> DiagnosedUnit:
        """Instrument `index`: recorded, diagnosed from its first flight, flown again."""
        where = self.folder / f"{index}"
        first = self.flight(index)
        recordings = [first, *(self.chamber(index, axis) for axis in "xyz")] if chamber else [first]
        answer, model = diagnosed(recordings, first, where)
        believed = form.read_belief(first)
        after = parse(Belief, read_toml(model), str(model))
        triads = {
            name: [read_model(first / "compensation" / f"{name}.toml", axis) for axis in "xyz"]
            for name in COMPENSATIONS
        }
        triads["diagnosed"] = [believed_model(after, axis, where) for axis in "xyz"]
        found: dict[str, list[Errors]] = {}
        for number in range(FLIGHTS):
            streams = self.world.streams(index).at("another day", number)
            recording = self.later.record(self.world.instrument(index), streams)
            seen, interval_s = list(samples(recording)), recording.interval_s  # for each arm
            for name, triad in triads.items():
                of_arm = replace(recording, belief=after if name == "diagnosed" else believed)
                found.setdefault(name, []).append(errors(of_arm, compensate(seen, triad, interval_s)))
            of_arm = replace(recording, belief=believed)
            found.setdefault("oracle", []).append(errors(of_arm, self._known(recording, index)))
        pooled = {
            arm: {measure: float(of([one[measure] for one in each])) for measure, of in STATISTICS.items()}
            for arm, each in found.items()
        }
        return DiagnosedUnit(pooled, answer)

    def flight(self, index: int) -> Path:
        """The first flight of an instrument."""
        return self._simulated(self.folder / f"{index}", "flight", index)

    def chamber(self, index: int, axis: str) -> Path:
        """The chamber recording of one accelerometer of an instrument."""
        return self._simulated(self.folder / f"{index}", "chamber", index, "--axis", axis)

    def _simulated(self, where: Path, kind: str, index: int, *more: str) -> Path:
        out = where / "-".join([kind, *more[1:]])
        rate = ["--rate", f"{RATE_HZ:g}", "--profile", PROFILE] if kind == "flight" else []
        arguments = ["--seed", f"{self.seed}", "--instrument", f"{index}", *rate, *more, "-o", str(out), "--quiet"]
        assert not ins_eval(["simulate", kind, *arguments])
        return out

    def _known(self, recording: Recording, index: int) -> np.ndarray:
        """Velocity increments (n, 3) in m/s of one who knows every constant of the accelerometers."""
        time_s, run = recording.imu.time_s, self.later.run
        interval_s = np.diff(time_s, prepend=recording.start.time_s)
        out = np.empty_like(recording.imu.accelerometer)
        for k, unit in enumerate(self.world.instrument(index).accelerometers):
            steady = [one for one in unit.effects if one.name not in OF_A_RUN]
            steady = [one.model_copy(update={"scatter": 0.0}) if one.name == "creep" else one for one in steady]
            slow = replace(unit, effects=tuple(steady)).slow(run, self.world.streams(index))
            scale, bias_ug = (np.interp(time_s, run.time_s, value) for value in slow)
            out[:, k] = STANDARD_GRAVITY * recording.imu.accelerometer[:, k] / scale - UG * bias_ug * interval_s
        return out


def diagnosed(recordings: Sequence[Path], belief: Path, where: Path) -> tuple[dict[str, Any], Path]:
    """The answer of `diagnose` to recordings of one instrument, and the belief that it writes."""
    answer, model = where / f"answer-{len(recordings)}.json", where / f"model-{len(recordings)}.toml"
    folders, files = [str(one) for one in recordings], ["--json", str(answer), "--write-model", str(model)]
    assert not ins_eval(["diagnose", *folders, "--belief", str(belief / "recording.toml"), *files, "--quiet"])
    return json.loads(answer.read_text(encoding="utf-8")), model


def errors(recording: Recording, velocity: np.ndarray) -> Errors:
    """Horizontal velocity RMS and radial error rate of the pure-inertial solution."""
    align_on = standstill_to_align_on(recording)
    found = measures(evaluate(*without_effects(recording, velocity), align_on=align_on))
    return {
        "velocity_rms_mps": found.velocity_rms_mps["horizontal"],
        "radial_error_rate_nmi_per_h": found.radial_error_rate_nmi_per_h["radial_error_rate_rms"],
    }


def compared(found: Sequence[DiagnosedUnit], seed: int = SEED) -> metrics.Comparison:
    """Every arm against `simple`, and `diagnosed` against `hysteresis`, over instruments."""
    arms = {
        arm: {measure: np.array([one.errors[arm][measure] for one in found]) for measure in STATISTICS}
        for arm in found[0].errors
    }
    pairs = [(arm, "simple") for arm in arms if arm != "simple"] + [("diagnosed", "hysteresis")]
    return metrics.paired_bootstrap(arms, STATISTICS, pairs, Streams(seed).at("told backwards", "bootstrap").rng())


def shares(found: Sequence[DiagnosedUnit], seed: int = SEED) -> dict[str, tuple[float, float, float]]:
    """Of what the hysteresis compensation gains on `simple`, the share that `diagnosed` gains, by measure.

    Each with its 95 % interval, a bootstrap over instruments; it means something where the hysteresis compensation
    gains beyond chance.
    """
    rng = Streams(seed).at("told backwards", "shares").rng()
    drawn = [np.arange(len(found)), *rng.integers(0, len(found), (RESAMPLES, len(found)))]
    out = {}
    for measure in STATISTICS:
        simple, diagnosed, hysteresis = (
            _pooled(found, arm, measure, drawn) for arm in ("simple", "diagnosed", "hysteresis")
        )
        share = (simple - diagnosed) / (simple - hysteresis)
        out[measure] = (float(share[0]), *(float(x) for x in np.percentile(share[1:], INTERVAL)))
    return out


def _pooled(found: Sequence[DiagnosedUnit], arm: str, measure: str, drawn: Sequence[np.ndarray]) -> np.ndarray:
    """A measure over all instruments, for each set of their numbers that was drawn."""
    errors = np.array([one.errors[arm][measure] for one in found])
    return np.array([STATISTICS[measure](errors[rows]) for rows in drawn])


def population(seed: int, count: int, workers: int, chamber: bool = False) -> Iterator[DiagnosedUnit]:
    """The first `count` instruments of a seed, in their order."""
    return in_order(_one, ((seed, index, chamber) for index in range(count)), workers)


def _one(seed: int, index: int, chamber: bool) -> DiagnosedUnit:
    with tempfile.TemporaryDirectory() as folder:
        return InverseProblem(Path(folder), seed).unit(index, chamber)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmark.runners.diagnosed_belief", description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT, help=f"instruments ({COUNT})")
    parser.add_argument("--seed", type=int, default=SEED, help=f"of the population ({SEED})")
    parser.add_argument("--workers", type=int, default=2, help="instruments at a time (2)")
    parser.add_argument("--chamber", action="store_true", help="diagnose flight and chamber together")
    options = parser.parse_args(arguments)
    found = []
    for one in population(options.seed, options.count, options.workers, options.chamber):
        rms = {arm: f"{e['velocity_rms_mps']:.2f}" for arm, e in one.errors.items()}
        print(f"{len(found)}: {one.answer['verdict']}: {', '.join(one.named) or 'nothing'}; m/s {rms}", flush=True)
        found.append(one)
    for pair, ratios in compared(found, options.seed).ratios.items():
        for measure, ratio in ratios.items():
            print(f"{pair:28s} {measure:28s} {ratio.ratio:.3f} [{ratio.low:.3f}, {ratio.high:.3f}]")
    for measure, (share, low, high) in shares(found, options.seed).items():
        print(f"share of the hysteresis compensation's gain, {measure}: {share:.2f} [{low:.2f}, {high:.2f}]")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
