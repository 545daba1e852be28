"""The oven experiment of Paper A (section 3.1, Table 6): the IMU stands still and feels the temperatures of the flight.

An instrument is calibrated in the chamber, refined with oven runs, and then tested in ten further ones. Each run is
navigated with every compensation, once aligned on its own stand and once with the true attitude given at time 0. The
paper does not say which: an alignment on the spot hides the constant level errors and the east gyro of a unit that
does not move. The true velocity is zero, so the velocity error is the velocity itself.

The paper shows "one of the best" of ten runs. Here all ten stand beside the best, the run in which the horizontal
velocity RMS shrinks most from `SIMPLE` to `HYSTERESIS`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np

from ins_eval import metrics
from ins_eval.compensation import CompensationModel, Samples
from ins_eval.compensation.refined import OvenRun, Refined
from ins_eval.ensemble.changes import Attitude
from ins_eval.ensemble.plan import Plan
from ins_eval.ensemble.world import World, beginning
from ins_eval.navigation import compensate, evaluate, samples
from ins_eval.recording import Recording
from ins_eval.reference import Errors
from ins_eval.streams import Streams

SIMPLE, HYSTERESIS = "simple", "hysteresis_refined"  # as Paper A compares them
ARMS = ("none", "simple", "simple_anchored", "quadratic", "hysteresis", "simple_refined", "hysteresis_refined")
PLAN = Plan(experiment="oven", arms=ARMS)
SIZE = 40  # instruments
RUNS = 10
MOST_REFINEMENTS = 5  # the refinement is drawn through 1 to so many runs
AXES = ("east", "north", "horizontal")
EPOCH_S = 30.0  # between the epochs at which errors are taken; they change in minutes
CASES: dict[str, Attitude] = {"aligned": "found", "given": "given"}  # names in results; what they mean for a World

Triad = Sequence[CompensationModel]


def member(world: World, index: int) -> dict[str, dict[str, np.ndarray]]:
    """One instrument: ``["<arm>/<case>"]["velocity_rms_<axis>"]`` (runs,) in m/s, for `CASES` and `AXES`.

    Beside the arms of the plan stand ``refined_<n>``, `HYSTERESIS` refined with n runs, and ``free_<n>``, the same
    with a constant of its own for each of these runs: with the attitude given only, since an alignment on the stand
    absorbs the constant.
    """
    triads = world.triads(index)
    calibrated = [refined.model for refined in cast("Sequence[Refined]", triads[HYSTERESIS])]
    triads |= _refinements(calibrated, world.oven_runs(index, MOST_REFINEMENTS))
    cases = {arm: ["given"] if arm.startswith("free_") else list(CASES) for arm in triads}
    rms = {f"{arm}/{case}": np.empty((RUNS, len(AXES))) for arm in triads for case in cases[arm]}
    for run in range(RUNS):
        recording, seen = _recorded(world, index, run)
        for arm, triad in triads.items():
            for case, errors in _navigated(world, recording, seen, triad, cases[arm]).items():
                of_run = metrics.velocity_rms(errors.velocity_n, errors.valid)
                rms[f"{arm}/{case}"][run] = [getattr(of_run, axis) for axis in AXES]
    return {name: {f"velocity_rms_{axis}": v for axis, v in zip(AXES, rms[name].T, strict=True)} for name in rms}


def errors_of_run(world: World, index: int, run: int, case: str = "given") -> dict[str, Errors]:
    """Errors of one run of a member over time, every 30 s from time 0, for each arm of the plan."""
    recording, seen = _recorded(world, index, run)
    return {arm: _navigated(world, recording, seen, t, [case])[case] for arm, t in world.triads(index).items()}


def _recorded(world: World, index: int, run: int) -> tuple[Recording, tuple[Samples, ...]]:
    """A test run, none of those with which the instrument is refined."""
    recording = world.oven.record(world.instrument(index), world.streams(index).at("oven_test", run))
    return replace(recording, reference=world.oven.truth(0.0, EPOCH_S)), tuple(samples(recording))


def _navigated(
    world: World, recording: Recording, seen: Sequence[Samples], triad: Triad, cases: Sequence[str]
) -> dict[str, Errors]:
    """Errors of a run with one compensation, by case."""
    velocity = compensate(seen, triad, recording.interval_s)
    return {c: evaluate(recording, velocity, **beginning(world.oven, recording, CASES[c])).errors for c in cases}


def _refinements(calibrated: Triad, ovens: Sequence[Sequence[OvenRun]]) -> dict[str, Triad]:
    """Three models refined with the first 1 to `MOST_REFINEMENTS` of their runs, by name."""
    return {
        f"{name}_{count}": [
            Refined(model, constant=name == "refined").refine(runs[:count])
            for model, runs in zip(calibrated, ovens, strict=True)
        ]
        for name in ("refined", "free")
        for count in range(1, MOST_REFINEMENTS + 1)
    }


# ------------------------------------------------------------------------------------------------ the whole ensemble


def summary(members: Sequence[dict[str, dict[str, np.ndarray]]], seed: int) -> dict[str, Any]:
    """What the members of an oven plan come to; an estimate is ``{"value", "interval95"}``, velocities in m/s.

    aligned, given      velocity RMS over instruments and runs, by arm and axis
    gain                ratio of `HYSTERESIS` to `SIMPLE`, by case and axis
    best_of_ten         percent by which the velocity RMS shrinks in the best run of an instrument: median over the
                        instruments, and what holds the central 95 % of them
    median_of_ten       the same of the median over the runs of an instrument
    runs_improved       share of all runs with a smaller horizontal RMS
    shown               all runs of the first instrument, attitude given
    refinement          horizontal RMS after refinement with n runs, attitude given
    refinement_cases    the same for both cases ("refined"), and with a constant for each refinement run ("free")
    """
    groups = {name: {key: np.stack([m[name][key] for m in members]) for key in members[0][name]} for name in members[0]}
    # of each instrument, RMS over its runs
    rms = {
        name: {axis: metrics.root_mean_square(data[f"velocity_rms_{axis}"]) for axis in AXES}
        for name, data in groups.items()
    }
    compared = metrics.paired_bootstrap(
        rms,
        dict.fromkeys(AXES, metrics.root_mean_square),
        [(f"{HYSTERESIS}/{case}", f"{SIMPLE}/{case}") for case in CASES],
        Streams(seed).at("oven", "bootstrap").rng(),
    )
    result: dict[str, Any] = {"size": len(members), "runs": RUNS}
    for case in CASES:
        result[case] = {
            arm: {axis: compared.arms[f"{arm}/{case}"][axis].as_tree() for axis in AXES}
            for arm in ARMS
            if f"{arm}/{case}" in groups
        }
        ratios = compared.ratios[f"{HYSTERESIS}/{case}/{SIMPLE}/{case}"]
        gains = {
            axis: 100.0 * (1.0 - groups[f"{HYSTERESIS}/{case}"][f"velocity_rms_{axis}"] / before)
            for axis in AXES
            for before in [groups[f"{SIMPLE}/{case}"][f"velocity_rms_{axis}"]]
        }
        best = gains["horizontal"].argmax(axis=1)[:, None]
        of_best = {axis: np.take_along_axis(gain, best, axis=1) for axis, gain in gains.items()}
        of_case = {
            "gain": {axis: metrics.Estimate(r.ratio, r.low, r.high).as_tree() for axis, r in ratios.items()},
            "best_of_ten": {a: metrics.central(g).as_tree() for a, g in of_best.items()},
            "median_of_ten": {a: metrics.central(np.median(g, axis=1)).as_tree() for a, g in gains.items()},
            "runs_improved": float(np.mean(gains["horizontal"] > 0.0)),
        }
        for key, value in of_case.items():
            result.setdefault(key, {})[case] = value
    result["shown"] = _shown(members[0], "given")
    counts = range(1, MOST_REFINEMENTS + 1)
    result["refinement_cases"] = {
        case: {
            name: {f"{n}": compared.arms[f"{name}_{n}/{case}"]["horizontal"].as_tree() for n in counts}
            for name in ("refined", "free")
            if f"{name}_1/{case}" in groups
        }
        for case in CASES
    }
    result["refinement"] = result["refinement_cases"]["given"]["refined"]
    return result


def _shown(first: dict[str, dict[str, np.ndarray]], case: str) -> dict[str, Any]:
    """All runs of one instrument in two arms, and which of them is the best."""
    arms = {arm: first[f"{arm}/{case}"] for arm in (SIMPLE, HYSTERESIS)}
    gain = arms[HYSTERESIS]["velocity_rms_horizontal"] / arms[SIMPLE]["velocity_rms_horizontal"]
    return {
        "case": case,
        "best": int(gain.argmin()),
        "runs": [
            {arm: {axis: float(data[f"velocity_rms_{axis}"][run]) for axis in AXES} for arm, data in arms.items()}
            for run in range(gain.size)
        ],
    }
