"""What a page shows of a diagnosis besides its answer, as plain arrays and numbers.

ground        the hypotheses and sums that the answer rests on
evidence      log Bayes factor of every family in the place of one effect
limits        what the recordings could show of each family
before_after  whitened residual without and with the effects, both with one noise
turned_on     turn-on biases, start attitude, and how a receiver lags and smooths, where the data put them
block_means   a whitened residual averaged, as it is shown
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ins_eval.diagnosis.answer.detectability import Detectability, detectability
from ins_eval.effects.effect import AXES
from ins_eval.estimation.case import LAG, LAG_S, SMOOTHED, SMOOTHING
from ins_eval.estimation.search import Space, one_more
from ins_eval.estimation.study import Hypothesis, Sums, space, sums, union
from ins_eval.units import DEG

if TYPE_CHECKING:
    from ins_eval.diagnosis.answer.verdict import Diagnosis, FoundEffect
    from ins_eval.error_model.library import Candidate

BLOCK_S, FEWEST_BLOCKS = 60.0, 40  # over which a whitened residual is averaged, and into how many short ones fall


@dataclass(frozen=True, eq=False)
class Basis:
    """Hypotheses, their families and sums; `members` is the best set, empty where none is named."""

    hypotheses: tuple[Hypothesis, ...]
    space: Space
    here: Sums
    members: tuple[int, ...]


@dataclass(frozen=True)
class EffectEvidence:
    """One family in the place of an effect: its best member, and whether it is the one that the answer names."""

    candidate: Candidate
    log_bayes_factor: float
    named: bool


def basis(found: Diagnosis) -> Basis:
    """The sums of the answer, or those under the belief where no effect was tried further."""
    linearisation = found.linearisation
    if linearisation is not None:
        return Basis(
            linearisation.hypotheses,
            linearisation.space,
            linearisation.here,
            linearisation.best.members if found.effects else (),
        )
    around = found.around_belief
    if around is not None and all(
        np.array_equal(a.noise_point, b.noise_point) for a, b in zip(around.fitted, found.null, strict=True)
    ):
        return Basis(around.hypotheses, around.space, around.here, ())
    hypotheses = tuple(union(found.cases))
    here = sums(found.cases, [one.noise_point for one in found.null], hypotheses)
    return Basis(hypotheses, space(hypotheses, found.policy), here, ())


def evidence(of: Basis, effect: FoundEffect | None) -> list[EffectEvidence]:
    """Every family in the place of `effect` beside the rest of the best set, or alone without one; best first."""
    others = [k for k in of.members if effect is None or of.hypotheses[k].key != effect.hypothesis.key]
    of_family, members = one_more(of.here.normal, of.here.projection, others, of.space)
    keys = {of.hypotheses[k].key for k in of.members}
    return [
        EffectEvidence(
            of.hypotheses[members[family]].candidate,
            float(of_family[family]),
            of.hypotheses[members[family]].key in keys,
        )
        for family in np.argsort(of_family)[::-1]
        if np.isfinite(of_family[family])
    ]


def limits(of: Basis) -> list[Detectability]:
    """What the recordings could show of each family, least visible first."""
    return detectability([one.candidate for one in of.hypotheses], np.diag(of.here.normal), of.space.cost)


class BeforeAfter(NamedTuple):
    """Whitened residual (nodes, 9) without and with the effects, at `time_s` (nodes,)."""

    time_s: np.ndarray
    before: np.ndarray
    after: np.ndarray


def before_after(found: Diagnosis, r: int) -> BeforeAfter | None:
    """Whitened residual of recording `r` without and with the effects, noise that of the answer.

    The times are those of the recording as it was linearised last: a clock that is set right moves them. What is
    uncertain anyway is at its best in both. None without effects in this recording.
    """
    if not found.effects:
        return None
    linearisation = found.linearisation
    members = [*linearisation.best.members, *linearisation.taken_beside]
    count = len(linearisation.best.members)
    own = [i for i, k in enumerate(members) if linearisation.hypotheses[k].columns[r] is not None]
    if not any(i < count for i in own):
        return None
    mean, _ = linearisation.coefficients
    point = linearisation.point[members][own]
    case = linearisation.cases[r]
    known = len(case.nuisances)
    columns = [linearisation.hypotheses[members[i]].columns[r] for i in own]
    kept = case.whitened(columns, linearisation.fitted[r].noise_point, keep=1 + known + len(own)).kept
    anyway, effects = kept[..., 1 : 1 + known], kept[..., 1 + known :]
    residual = kept[..., 0] + effects @ point
    named = [i for i, k in enumerate(own) if k < count]
    after = residual - effects[..., named] @ mean[[own[i] for i in named]]
    return BeforeAfter(case.model.nodes_s, _at_best(residual, anyway), _at_best(after, anyway))


@dataclass(frozen=True)
class TurnedOn:
    """Something uncertain anyway: what was believed of it and what the data find, each with one sigma, in `unit`."""

    name: str
    unit: str
    believed: float
    believed_sigma: float
    found: float
    found_sigma: float


def turned_on(found: Diagnosis, r: int) -> list[TurnedOn]:
    """Turn-on biases, start attitude and receiver of recording `r` beside the effects of the answer, if any."""
    linearisation = found.linearisation if found.effects else None
    case = found.cases[r] if linearisation is None else linearisation.cases[r]
    if case.believed is None:
        return []
    columns = (
        []
        if linearisation is None
        else [one.columns[r] for one in linearisation.chosen() if one.columns[r] is not None]
    )
    sums_of = case.whitened(columns, found.fitted[r].noise_point)
    covariance = np.linalg.inv(np.eye(sums_of.projection.size) + sums_of.normal)
    mean, sigma = covariance @ sums_of.projection, np.sqrt(np.diag(covariance))
    belief, start = case.believed.recording.belief, case.believed.start
    sizes: dict[Any, Any] = {}
    for sensor, unit, size in (
        ("accelerometer", "ug", belief.accelerometer.bias_sigma_ug),
        ("gyro", "deg/h", belief.gyro.bias_sigma_deg_per_h),
    ):
        sizes |= {f"turn-on bias of {sensor} {axis}": (unit, 0.0, size) for axis in AXES}
    level_n, level_e, heading = (float(one) / DEG for one in case.believed.attitude_sigma_n)
    sizes["start attitude N"], sizes["start attitude E"] = ("deg", 0.0, level_n), ("deg", 0.0, level_e)
    (k,) = (k for k, column in enumerate(case.nuisances) if column.name == "start attitude D")
    stated = float(start.attitude_rad[2]) / DEG - heading * float(case.taken[k])  # around which the errors are told
    sizes["start attitude D"] = ("deg", stated, heading)
    sizes[LAG] = ("s", 0.0, LAG_S)
    sizes |= {name: ("share", 0.0, SMOOTHING) for names in SMOOTHED.values() for name in names}
    words = {
        "start attitude N": "tilt about north",
        "start attitude E": "tilt about east",
        "start attitude D": "heading",
    }
    return [
        TurnedOn(words.get(name, name), unit, middle, size, middle + size * float(mean[k]), size * float(sigma[k]))
        for k, column in enumerate(case.nuisances)
        for name, (unit, middle, size) in sizes.items()
        if column.name == name
    ]


def _at_best(residual: np.ndarray, anyway: np.ndarray) -> np.ndarray:
    """The residual (nodes, 9) less what is uncertain anyway, at its best under its prior."""
    seen = np.isfinite(residual)
    x = anyway[seen]
    return residual - anyway @ np.linalg.solve(np.eye(x.shape[1]) + x.T @ x, x.T @ residual[seen])


def block_length_s(time_s: np.ndarray) -> float:
    """Over how long the whitened residual of a recording is averaged: `BLOCK_S`, of short ones a share of them."""
    return float(max(np.median(np.diff(time_s)), min(BLOCK_S, round((time_s[-1] - time_s[0]) / FEWEST_BLOCKS))))


def block_means(time_s: np.ndarray, e: np.ndarray, block_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Sum of each block over the root of its count; NaN where a block holds nothing."""
    block = np.floor((time_s - time_s[0]) / block_s).astype(int)
    here = np.isfinite(e)
    count = np.bincount(block[here], minlength=block[-1] + 1)
    total = np.bincount(block[here], weights=e[here], minlength=block[-1] + 1)
    mean = np.where(count > 0, total / np.sqrt(np.maximum(count, 1)), np.nan)
    return time_s[0] + (np.arange(count.size) + 0.5) * block_s, mean
