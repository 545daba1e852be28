"""Recordings of one instrument judged together: the same columns in each, summed.

Reduced sums add: with everything that belongs to one recording only (turn-on biases, alignment, noise) integrated out
of it, A and b of the coefficients that all recordings share are the sums of those of each. What belongs to one
recording has a column of zeros in the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.effects.composed import NAME as COMPOSED
from ins_eval.effects.lag import NAME as LAG
from ins_eval.effects.parts import SENSORS
from ins_eval.estimation.blocks import EACH
from ins_eval.estimation.evidence import log_evidence_of, reduce
from ins_eval.estimation.search import NO_SENSOR, Space, log_bayes_factor
from ins_eval.recording.belief import EffectBelief

if TYPE_CHECKING:
    from ins_eval.error_model.columns import Column
    from ins_eval.error_model.library import Candidate
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.noise_fit import Fitted
    from ins_eval.estimation.whitening import Whitened
    from ins_eval.policy import Policy

# geometry, clocks and the equations themselves: their form is exact
EXACT = ("earth.", "alignment.", "gps.", "reference.", "recording.")
STAR = 0.25  # prior sigmas from the centre to the points of the quadrature
LEAST_CURVATURE = 0.3  # of a log posterior whose prior has 1
_THREADS = 2


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One effect with its column in each recording, None where it cannot occur."""

    candidate: Candidate
    columns: tuple[Column | None, ...]

    @property
    def key(self) -> tuple:
        return self.candidate.key

    @property
    def identity(self) -> tuple:
        """Its family, and the times, widths and lags that it has."""
        return self.key, *sorted(self.candidate.parameters.items(), key=str)

    def believed(self, coefficient: float, cases: Sequence[Case]) -> EffectBelief:
        """The effect with its coefficient as a belief states it."""
        candidate = self.candidate
        value = coefficient * candidate.nominal
        known = {name: p for name, p in candidate.parameters.items() if name in EffectBelief.model_fields}
        local = None
        if candidate.local:
            local = next(case.name for case, column in zip(cases, self.columns, strict=True) if column is not None)
        if candidate.name.startswith("earth."):
            value = 1.0
        if candidate.name == LAG:
            value = max(value, 0.0)
        return EffectBelief(name=candidate.name, axis=candidate.axis, value=value, recording=local, **known)

    def acts_in(self, r: int) -> bool:
        """Whether it can act in recording `r`: what a column drives does where that column was recorded."""
        return self.candidate.name != COMPOSED or self.columns[r] is not None

    def scaled(self, factor: float) -> Hypothesis:
        """The hypothesis with a nominal size that is larger by a factor."""
        return replace(self, columns=tuple(None if c is None else wide(c, factor) for c in self.columns))


def wide(column: Column, factor: float) -> Column:
    """The column with its prior sigma times `factor`."""
    return replace(
        column,
        terms=tuple(term._replace(weight=factor * term.weight) for term in column.terms),
        start=tuple(factor * x for x in column.start),
    )


def union(cases: Sequence[Case]) -> list[Hypothesis]:
    """Every effect that one of the recordings could show; what they share has one entry."""
    found: dict[tuple, list[Candidate | None]] = {}
    for r, case in enumerate(cases):
        for one in case.candidates:
            which = (*one.key, tuple(sorted(one.parameters.items())), r if one.local else None)
            found.setdefault(which, [None] * len(cases))[r] = one
    return [
        Hypothesis(
            next(one for one in of_cases if one is not None),
            tuple(None if one is None else one.column for one in of_cases),
        )
        for of_cases in found.values()
    ]


def space(hypotheses: Sequence[Hypothesis], policy: Policy) -> Space:
    """Families by key; what is composed of a recorded column, or repeats what is simpler, pays a handicap."""
    numbers: dict[tuple, int] = {}
    channels = [one.candidate.channel for one in hypotheses]
    families = np.array([numbers.setdefault(one.key, len(numbers)) for one in hypotheses])
    return Space(
        families=families,
        centre=np.array([one.candidate.centre for one in hypotheses]),
        handicap=np.array(
            [
                policy.handicap * (one.candidate.name == COMPOSED) + policy.repeats * one.candidate.repeats
                for one in hypotheses
            ]
        ),
        exact=np.array([one.candidate.name.startswith(EXACT) for one in hypotheses]),
        sensor=np.array([one if one.startswith(SENSORS) else NO_SENSOR for one in channels]),
        odds=policy.odds,
        largest=np.array([one.candidate.largest for one in hypotheses]),
    )


@dataclass(frozen=True, eq=False)
class Sums:
    """Reduced sums of all recordings at a noise; `log_null` of the null there, its prior included."""

    normal: np.ndarray
    projection: np.ndarray
    log_null: float


def sums(
    cases: Sequence[Case],
    noise_points: Sequence[np.ndarray],
    hypotheses: Sequence[Hypothesis],
    point: np.ndarray | None = None,
    coarse: bool = False,
    lasting: int = 0,
) -> Sums:
    """One pass over each recording.

    So many of the `hypotheses`, the first, are `lasting`: the next pass at this noise has them as well.

    `point` (m,) are the coefficients at which the recordings were navigated, where that is not the belief; what they
    took off is added back, so that every prior stays around the belief.
    """
    parts = [
        of_case(case, r, noise_point, hypotheses, coarse, lasting)
        for r, (case, noise_point) in enumerate(zip(cases, noise_points, strict=True))
    ]
    return total(parts, point)


def of_case(
    case: Case, r: int, noise_point: np.ndarray, hypotheses: Sequence[Hypothesis], coarse: bool, lasting: int = 0
) -> Sums:
    """The sums of recording `r` alone."""
    here = [k for k, one in enumerate(hypotheses) if one.columns[r] is not None]
    columns, first = [hypotheses[k].columns[r] for k in here], sum(k < lasting for k in here)
    whitened = case.whitened(columns, noise_point, case.blocks if coarse else EACH, lasting=first)
    return reduced_sums(whitened, len(case.nuisances), here, len(hypotheses), noise_point)


def reduced_sums(whitened: Whitened, known: int, here: list[int], count: int, noise_point: np.ndarray) -> Sums:
    left = reduce(whitened, known)
    normal, projection = np.zeros((count, count)), np.zeros(count)
    normal[np.ix_(here, here)] = left.normal
    projection[here] = left.projection
    return Sums(normal, projection, log_evidence_of(whitened, slice(0, known)) - 0.5 * float(noise_point @ noise_point))


def total(parts: Sequence[Sums], point: np.ndarray | None) -> Sums:
    normal = sum(part.normal for part in parts)
    projection = sum(part.projection for part in parts)
    log_null = sum(part.log_null for part in parts)
    if point is not None:
        pushed = normal @ point
        log_null -= float(point @ projection + 0.5 * point @ pushed)
        projection = projection + pushed
    return Sums(normal, projection, log_null)


def fit_noise(
    cases: Sequence[Case],
    model: Sequence[Hypothesis],
    starts: Sequence[Fitted | None],
    hills: bool = False,
    close: bool = False,
) -> list[Fitted]:
    """Noise of each recording with the effects of `model` free; with `hills` on more hills than those of the starts."""
    out = []
    for r, (case, start) in enumerate(zip(cases, starts, strict=True)):
        columns = [one.columns[r] for one in model if one.columns[r] is not None]
        out.append(case.fitted(columns, start, hills=hills, close=close))
    return out


def marginal(
    cases: Sequence[Case],
    noise_points: Sequence[np.ndarray],
    hypotheses: Sequence[Hypothesis],
    models: Sequence[Sequence[int]],
    centre: np.ndarray,
    point: np.ndarray | None = None,
) -> np.ndarray:
    """log Z (models,) with the noise integrated out, from the same points for all models.

    In each level of the noise the log posterior is taken for a parabola through the centre and one point on either
    side: Laplace's approximation with the curvature and the maximum of each model its own.
    """

    def heights(parts: Sequence[Sums]) -> np.ndarray:
        whole = total(parts, point)
        return np.array([
            whole.log_null + log_bayes_factor(whole.normal[np.ix_(m, m)], whole.projection[m], centre[m])[0]
            for m in (list(one) for one in models)
        ])  # fmt: skip

    at_centre = [of_case(case, r, noise_points[r], hypotheses, True) for r, case in enumerate(cases)]
    base = heights(at_centre)
    out = base.copy()
    for r, case in enumerate(cases):
        whitened_at = case.ready([one.columns[r] for one in hypotheses if one.columns[r] is not None])
        here = [k for k, one in enumerate(hypotheses) if one.columns[r] is not None]

        def of(noise_point: np.ndarray, r=r, case=case, whitened_at=whitened_at, here=here) -> np.ndarray:
            whitened = whitened_at(noise_point)
            part = reduced_sums(whitened, len(case.nuisances), here, len(hypotheses), noise_point)
            return heights([*at_centre[:r], part, *at_centre[r + 1 :]])

        steps = STAR * np.eye(noise_points[r].size)
        with ThreadPoolExecutor(_THREADS) as pool:
            sides = list(pool.map(of, [noise_points[r] + sign * one for one in steps for sign in (1.0, -1.0)]))
        for above, below in zip(sides[::2], sides[1::2], strict=True):
            slope = (above - below) / (2.0 * STAR)
            curvature = np.maximum(-(above + below - 2.0 * base) / STAR**2, LEAST_CURVATURE)
            out += 0.5 * np.minimum(slope**2 / curvature, 4.0) - 0.5 * np.log(curvature)
    return out
