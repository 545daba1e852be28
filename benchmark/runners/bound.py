"""`python -m benchmark.runners.bound FOLDER ANSWERS [--workers 2]`: what could be known with the noise to be estimated.

The oracle of the maker knows the noise of each case, so its D is more than any tool can reach: what an effect does to
a null whose noise is free looks like noise. Here the effects are known and the noise is not: log Bayes factor of the
truth against the null, the noise integrated out of both, from the sums of the installed package. And how much of the
energy of the truth t the answer f would remove from another recording like this one, of the same path and noise,

    1 - (t - f)' A (t - f) / t' A t,   A the information of the recording about all coefficients.

What has no name is drawn again, and what it does to its channel taken for a column of nominal size.
And by how many nats what an answer names stays below a truth that has no name. ``ANSWERS/bound.json`` keeps this for
each case in which the oracle sees something and noise could hide it, and the package that answered.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from tqdm import tqdm

from benchmark.runners import again, run
from benchmark.scores.oracle import nominal
from benchmark.scores.score import CLEAR, SEEN, quantiles, rate, read
from benchmark.worlds.instruments import Departures
from ins_eval.parallel import results
from ins_eval.units import DEG_PER_H, UG

FILE = "bound.json"
BEYOND = 2000.0  # nats of the oracle that no noise can hide
MOST = 0.8  # of the energy
DRIVEN = {  # what a departure of a sensor adds: sensor, multiplier, SI value of its unit
    "accel_ug": ("accelerometer", "1", UG), "accel_ppm": ("accelerometer", "f", 1e-6),
    "gyro_deg_per_h": ("gyro", "1", DEG_PER_H),
}  # fmt: skip
MEASURED = {"gps_position": 0, "gps_velocity": 3}  # first of the channels of a departure of a receiver
FURTHER = ("time_constant_s", "branch_width_c", "branch_begin", "at_s", "other_axis", "rate_filter_s", "driver", "form")


def wanted(truth: dict) -> bool:
    """Effects that the oracle sees, not so large that noise does not matter."""
    d = (truth["oracle"] or {}).get("log_bayes_factor")
    return bool(truth["effects"]) and d is not None and SEEN <= d < BEYOND


def reached(truth: dict, answer: dict, folders: list[Path], manifest: dict) -> dict[str, float | None]:
    """Log Bayes factor of the true effects of a case, in nats, and the share of their energy that the answer removes.

    `manifest` is what the maker keeps of how cases were drawn. The share is None where nothing is named, or what is
    hidden has no name; then `answer_below` is by how many nats what is named stays below the truth, whose very form is
    known: where that is little, the recording hardly tells the two apart. What it costs to have looked for a name
    is in neither.
    """
    from ins_eval.believed import believed
    from ins_eval.estimation.case import prepare
    from ins_eval.estimation.chamber import prepare_chamber
    from ins_eval.estimation.study import fit_noise, marginal
    from ins_eval.recording import form
    from ins_eval.recording.form.description import CHAMBER, open_folder

    cases = [
        prepare_chamber(form.read_chamber(folder), form.read_belief(folder), folder.name, folder)
        if open_folder(folder).description.kind == CHAMBER
        else prepare(believed(form.read(folder)), folder)
        for folder in folders
    ]
    if truth["outside"]:
        truths = [(_nameless(truth, manifest, cases[0]), truth["effects"][0])]
    else:
        truths = [(one, effect) for effect in truth["effects"] if (one := _hypothesis(effect, cases)) is not None]
    told = answer.get("effects", ())
    named = [one for effect in told if (one := answered(effect, cases)) is not None]
    null = fit_noise(cases, [], [None] * len(cases))
    alone = float(marginal(cases, [one.noise_point for one in null], [], [[]], np.zeros(0))[0])
    there, without, beside = _heights(cases, truths, null)
    known = {"log_bayes_factor": beside - max(without, alone), "removed": None, "answer_below": None}
    if truth["outside"] and named and len(named) == len(told):
        known["answer_below"] = beside - _heights(cases, named, null)[2]
    elif named and not truth["outside"]:
        known["removed"] = _removed(cases, there, truths, named)
    return known


def _heights(cases: list, effects: list, null: list) -> tuple[list, float, float]:
    """Noise fitted beside effects, and log Z there without and with them, the noise integrated out."""
    from ins_eval.diagnosis.unnamed.disturbance import with_quiet_sensors
    from ins_eval.estimation.study import fit_noise, marginal

    model = [one for one, _ in effects]
    wide = [one.scaled(max(1.0, abs(effect["value"] / one.candidate.nominal))) for one, effect in effects]
    quiet = [
        replace(one, noise_point=with_quiet_sensors(case, one.noise_point))
        for case, one in zip(cases, null, strict=True)
    ]
    starts = [fit_noise(cases, wide, start) for start in (null, quiet)]
    there = max(starts, key=lambda fitted: sum(one.log_evidence for one in fitted))
    centre = np.array([one.candidate.centre for one in model])
    without, beside = marginal(cases, [one.noise_point for one in there], model, [[], list(range(len(model)))], centre)
    return there, float(without), float(beside)


def _removed(cases: list, noise: list, truth: list, named: list) -> float:
    """Share of the energy of the truth that is gone, from hypotheses with their effects."""
    from ins_eval.estimation.study import sums

    together = [*truth, *named]
    values = np.array([effect["value"] / one.candidate.nominal for one, effect in together])
    known = len(truth)
    values[known:] *= -1.0
    a = sums(cases, [one.noise_point for one in noise], [one for one, _ in together]).normal
    of_truth = float(values[:known] @ a[:known, :known] @ values[:known])
    return 1.0 - float(values @ a @ values) / of_truth


def answered(effect: dict, cases: list):
    """An effect that an answer names, as columns, with its value."""
    parameters = effect["parameters"] | {key: effect[key] for key in FURTHER if key in effect}
    one = _columns(effect["name"], effect["axis"], parameters, cases)
    return None if one is None else (one, parameters)


def _nameless(truth: dict, manifest: dict, case):
    """An effect without a name as a column, drawn again as the maker drew it."""
    from ins_eval.error_model.columns import Column, Drive, Measured
    from ins_eval.error_model.library import Candidate
    from ins_eval.estimation.study import Hypothesis

    drawn = again.drawn(truth, manifest)
    (effect,), (recording,) = drawn.hidden, drawn.made
    felt, departures = recording.felt, Departures()
    at_nominal = nominal(effect)
    at_nominal(felt, departures)
    start_s, nodes_s = recording.shift_s, case.model.nodes_s
    terms: list[Drive | Measured] = []

    def slow(name: str, time_s: np.ndarray, values: np.ndarray) -> str:
        return case.slow.add(name, partial(np.interp, xp=time_s + start_s, fp=values), case.model)

    for name, (sensor, multiplier, si) in DRIVEN.items():
        values = np.zeros((felt.time_s.size, 3)) + getattr(departures, name)
        terms += [
            Drive(sensor, axis, multiplier, si, slow(f"{name} {axis}", felt.time_s, values[:, axis]))
            for axis in np.flatnonzero(values.any(axis=0))
        ]
    for name, first in MEASURED.items():
        if (function := getattr(departures, name)) is not None:
            values = function(felt, nodes_s - start_s)
            terms += [
                Measured(f"channel_{first + axis}", 1.0, slow(f"{name} {axis}", nodes_s - start_s, values[:, axis]))
                for axis in np.flatnonzero(values.any(axis=0))
            ]
    record = truth["effects"][0]
    column = Column(record["name"], tuple(terms))
    return Hypothesis(Candidate(record["name"], record["axis"], record["unit"], at_nominal.value, column), (column,))


def _hypothesis(effect: dict, cases: list):
    """An effect as columns of the recordings, or None where none of them could show it."""
    begin = {"branch_begin": effect["begin"]} if "begin" in effect else {}
    return _columns(effect["name"], effect["axis"], effect | begin, cases)


def _columns(name: str, axis: str | None, parameters: dict, cases: list):
    """One effect as columns of the recordings that can show it, None where none can."""
    from ins_eval.estimation.study import Hypothesis

    further = {key: parameters[key] for key in FURTHER if key in parameters}
    if name == "temperature.lag":
        further["lag_s"] = parameters["value"]
    made = [
        case.member(name, axis, further)
        if any((one.name, one.axis) == (name, axis) for one in case.candidates)
        else None
        for case in cases
    ]
    candidate = next((one for one in made if one is not None), None)
    columns = tuple(None if one is None else one.column for one in made)
    return None if candidate is None else Hypothesis(candidate, columns)


def estimated(truths: dict[str, dict], known: dict[str, dict]) -> dict[str, dict]:
    """The same truths with D where noise is estimated, that of the oracle kept beside it."""
    out = {}
    for name, truth in truths.items():
        oracle = truth["oracle"]
        if name in known:
            d = known[name]["log_bayes_factor"]
            oracle = oracle | {"noise_known": oracle["log_bayes_factor"], "log_bayes_factor": d}
        out[name] = truth | {"oracle": oracle}
    return out


def removed(records: list[dict], known: dict[str, dict]) -> dict:
    """Shares of the energy of the truth that answers remove, of detected effects with D of at least 16."""
    shares = [
        known[one["case"]]["removed"] or 0.0
        for one in records
        if one["case"] in known and one["inside"] and one["heard"] and one["band"] == CLEAR
    ]
    return quantiles(shares) | {"at least 80 %": rate(sum(share >= MOST for share in shares), len(shares))}


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmark.runners.bound", description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="what the maker wrote: recordings and truth")
    parser.add_argument("answers", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of Dask, on whose workers bounds are found")
    chosen = parser.parse_args(arguments)
    place = chosen.answers / FILE
    package = run.package_hash()
    kept = json.loads(place.read_text()) if place.exists() else {}
    known = {name: one for name, one in kept.items() if one.get("package") == package}
    truths = {name: one for name, one in read(chosen.folder / "truth").items() if wanted(one) and name not in known}
    folders = {
        name: [chosen.folder / "recordings" / each["path"] for each in one["recordings"]]
        for name, one in truths.items()
    }
    answers = read(chosen.answers)
    manifest = json.loads((chosen.folder / "truth" / "manifest.json").read_text())
    jobs = {name: (one, answers[name], folders[name], manifest) for name, one in truths.items() if name in answers}
    found = results(reached, jobs, chosen.workers, chosen.scheduler)
    for name, one in tqdm(found, "bounds", len(jobs), file=sys.stderr):
        known[name] = one | {"package": package}
        run.write(place, json.dumps(known, indent=1, sort_keys=True) + "\n")
    print(f"{len(known)} cases with the noise to be estimated")
    return 0


if __name__ == "__main__":
    sys.exit(main())
