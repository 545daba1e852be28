"""What the page of a diagnosis says and draws, as a tree of numbers and as figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from ins_eval.diagnosis.answer.nonparametric import Located, located
from ins_eval.diagnosis.answer.summary import (
    BLOCK_S,
    BeforeAfter,
    EffectEvidence,
    basis,
    before_after,
    block_length_s,
    block_means,
    evidence,
    limits,
    turned_on,
)
from ins_eval.diagnosis.answer.verdict import Diagnosis
from ins_eval.effects import VOCABULARY
from ins_eval.estimation.case import Case
from ins_eval.recording.belief import EffectBelief
from ins_eval.report.diagnosis_words import effect_words, numbered
from ins_eval.units import DEG, DEG_PER_H, UG
from ins_eval.vocabulary import CHANNELS_MEASURED

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIGMAS = 2.0  # of what noise makes, that an excess must have for a share of it to mean something
FAMILIES = 12  # in the figure of the evidence
NOT_SHOWN = ("earth", "any", "recording")  # that no recording would show better


def page(
    diagnosis: Diagnosis, found: Mapping[str, Any], written: Sequence[EffectBelief] = ()
) -> tuple[dict[str, Any], Callable[[], dict[str, Figure]]]:
    """Everything that the page says, and a function that draws its figures.

    `found` is the answer, `written` the effects that a belief was given which was written.
    """
    of = basis(diagnosis)
    count = len(diagnosis.cases)
    first = diagnosis.effects[0] if diagnosis.effects else None
    places = evidence(of, first)
    physics = found["effects"][len(diagnosis.described) :]
    both = [before_after(diagnosis, r) for r in range(count)]
    seen = [
        (entry, located(diagnosis, one))
        for one, entry in zip([*diagnosis.effects, None], [*physics, None], strict=True)
    ]
    seen = [(entry, one) for entry, one in seen if one is not None]
    asked = {one.candidate.name for one in of.hypotheses}
    tree = {
        "diagnosis": found,
        "recordings": [_facts(diagnosis, r, both[r]) for r in range(count)],
        "statistics": diagnosis.statistics,
        **({"gain": _gain(diagnosis, both)} if diagnosis.held_out else {}),
        "evidence": {
            "in_place_of": effect_words(physics[0]) if first is not None else None,
            "threshold": of.space.cost,
            "families": [_family(one) for one in places[:FAMILIES]],
        },
        "located": [_located(entry, one, k, len(diagnosis.effects) > 1) for k, (entry, one) in enumerate(seen)],
        "written": [_written(one) for one in written],
        "limits": [asdict(one) for one in limits(of)],
        # the Earth is asked about where the belief leaves a term out, what is composed where a column suggests it
        "absent": [name for name, one in VOCABULARY.items() if name not in asked and one.enters not in NOT_SHOWN],
    }

    def draw() -> dict[str, Figure]:
        from ins_eval.report.diagnosis_figures import drawn  # imported here, for it takes long and an answer needs none

        return drawn(diagnosis, tree, seen, both)

    return tree, draw


def _facts(
    diagnosis: Diagnosis, r: int, both: BeforeAfter | None
) -> dict[str, Any]:  # fmt: skip
    """What the page says of one recording: its residual, its noise, how white it is."""
    case = diagnosis.cases[r]
    measured = np.isfinite(case.seen.residual)
    explained = diagnosis.fitted[r] is not diagnosis.null[r]
    return {
        "name": case.name,
        "kind": case.kind,
        "channels": _channels(case),
        "measured_by": [source.name for source in case.seen.sources],
        "start_s": float(case.model.nodes_s[0]),
        "end_s": float(case.model.nodes_s[-1]),
        "measurements": int(measured.sum()),
        "outliers": case.outliers,
        "jumps_s": case.model.nodes_s[1:][case.noise.jumps.any(axis=1)].tolist(),
        "noise": _levels(case, diagnosis.null[r].noise_point),
        "noise_of_answer": _levels(case, diagnosis.fitted[r].noise_point) if explained else None,
        "turned_on": [asdict(one) for one in turned_on(diagnosis, r)],
        "whiteness": [_whiteness(column) for column in diagnosis.innovations[r].T],
        "whiteness_after": None if both is None else [_whiteness(column) for column in both.after.T],
    }


def _gain(diagnosis: Diagnosis, both: Sequence[BeforeAfter | None]) -> dict[str, float | None]:
    """Log predictive density gained on data that were not used, and the share of the excess that is removed.

    The excess is by how much the squares of means over a block of the whitened residual, in their own sigma, sum to
    more than their count, at the noise of the answer.
    """
    held = diagnosis.held_out
    pairs = [pair for pair in both if pair is not None]
    before = np.sum([_excess(pair.time_s, pair.before) for pair in pairs], axis=0)
    after = np.sum([_excess(pair.time_s, pair.after) for pair in pairs], axis=0)
    return {
        "nats": -held["harm_nats"],
        "placebo_nats": held["placebo_nats"] - held["harm_nats"],
        "excess_removed": min(1.0, 1.0 - after[0] / before[0]) if before[0] > SIGMAS * before[1] ** 0.5 else None,
    }


def _excess(time_s: np.ndarray, residual: np.ndarray) -> tuple[float, float]:
    """The excess, and the variance that it has where the residual is white."""
    means = np.concatenate([block_means(time_s, column, block_length_s(time_s))[1] for column in residual.T])
    count = int(np.isfinite(means).sum())
    return float(np.nansum(means**2)) - count, 2.0 * count


def _channels(case: Case) -> list[str]:
    """What is measured, as a reader sees it; of a chamber the output of the one accelerometer."""
    if case.believed is None:
        return [f"accelerometer {case.candidates[0].axis or ''}".strip(), *CHANNELS_MEASURED[1:]]
    return list(CHANNELS_MEASURED)


def _levels(case: Case, noise_point: np.ndarray) -> dict[str, float]:
    levels = case.noise.values(noise_point)
    if case.believed is None:
        return {"slow_output_ug": levels["slow_position"] / UG, "slow_output_time_s": levels["slow_position_time"]}
    return {
        "velocity_random_walk_ug_per_sqrt_hz": levels["velocity_random_walk"] / UG,
        "angle_random_walk_deg_per_sqrt_h": levels["angle_random_walk"] / (DEG / 60.0),
        "accelerometer_wander_ug": levels["accelerometer_wander"] / UG,
        "gyro_wander_deg_per_h": levels["gyro_wander"] / DEG_PER_H,
        "slow_position_m": levels["slow_position"],
        "slow_position_time_s": levels["slow_position_time"],
        "slow_velocity_mps": levels["slow_velocity"],
        "slow_velocity_time_s": levels["slow_velocity_time"],
    }


def _whiteness(column: np.ndarray) -> dict[str, float] | None:
    """RMS, correlation of neighbours, and RMS of means over `BLOCK_S` in their own sigma; all near 1, 0, 1 if white."""
    e = column[np.isfinite(column)]
    if e.size < 3:
        return None
    block = int(min(BLOCK_S, e.size // 3))
    means = e[: e.size // block * block].reshape(-1, block).mean(axis=1) * np.sqrt(block)
    return {
        "rms": float(np.sqrt(np.mean(e**2))),
        "correlation": float(np.mean(e[1:] * e[:-1]) / max(float(np.mean(e**2)), 1e-300)),
        "rms_of_means": float(np.sqrt(np.mean(means**2))),
    }


def _family(one: EffectEvidence) -> dict[str, Any]:
    candidate = one.candidate
    return {
        "name": candidate.name,
        "axis": candidate.axis,
        "parameters": candidate.parameters,
        "log_bayes_factor": one.log_bayes_factor,
        "named": one.named,
    }


def _written(one: EffectBelief) -> dict[str, Any]:
    """An effect of a written belief, and one sigma of its value where that is not exact."""
    sigma = {} if one.root is None else {"sigma": float(np.linalg.norm(one.root))}
    return {"unit": VOCABULARY[one.name].unit} | one.model_dump(exclude_none=True, exclude={"root"}) | sigma


def _located(entry: Mapping[str, Any] | None, one: Located, k: int, several: bool) -> dict[str, Any]:
    """How much of the square of what was found the effect accounts for, and under which name it is drawn."""
    share = None
    if entry is not None:
        known = np.isfinite(one.mean)
        left = float(np.sum((one.mean - one.effect)[known] ** 2))
        share = max(0.0, 1.0 - left / max(float(np.sum(one.mean[known] ** 2)), 1e-300))
    return {
        "recording": one.recording,
        "channel": one.channel,
        "axis": one.axis,
        "effect": None if entry is None else effect_words(entry),
        "share": share,
        "figure": "unexplained" if entry is None else numbered("effect_against_drive", k, several),
    }
