"""Which experiment would separate two explanations: a catalogue, each judged by its planned recording.

The sums that an experiment would give need no data: A of the columns follows from its motion and temperature. With
A summed over the recordings at hand and the experiment (nuisances of each integrated out), coefficients v true and
noise as believed, b ~ N(A v, A). For a model with the columns M and the prior N(c, S^2) on its coefficients

    E log Z = c'm - c'A c / 2 + tr(W (d d' + A)) / 2 - log|I + S A S| / 2,   W = (A + S^-2)^-1,   d = m - A c,

with A and m = A v those of its columns, up to what is common to all models; c is other than 0 only where physics fixes
a coefficient. Over the scales S of the prior (`evidence.SCALES`, every combination) the mean of Z is taken with log Z
at its expectation, which is never more than the expectation of the log of the mean. The expected log Bayes factor is
that of the truth less that of the rival.

What belongs to one recording alone, a step or its alignment, does not occur in another: a column of zeros there.

Source: Lindley, Ann. Math. Stat. 27 (1956) 986: the value of an experiment before it is made.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.diagnosis.answer import experiments_plans as plans
from ins_eval.diagnosis.answer.experiments_catalogue import MOVING, Experiment, experiments
from ins_eval.error_model.columns import Column
from ins_eval.error_model.observations import CHANNELS
from ins_eval.errors import DataRefused
from ins_eval.estimation.case import Case, prepare
from ins_eval.estimation.chamber import prepare_chamber
from ins_eval.estimation.evidence import expected_log_evidence, reduce
from ins_eval.estimation.study import wide
from ins_eval.recording import ChamberReadings

if TYPE_CHECKING:
    from ins_eval.error_model.library import Candidate
    from ins_eval.policy import Policy
    from ins_eval.recording.belief import Belief

RCOND = 1e-8
FIRST_ORDER = 1e-3  # of a response, below which its first order says nothing
OF_INSTRUMENT = ("velocity_random_walk", "angle_random_walk", "accelerometer_wander", "gyro_wander")


def expected_log_bayes_factor(
    normal: np.ndarray, truth: Mapping[int, float], rival: Sequence[int], centre: np.ndarray
) -> float:
    """Expected log B of the model with the columns of `truth` against that of `rival`; columns may be in both."""
    normal = _not_negative(normal)
    return expected_log_evidence(normal, truth, list(truth), centre) - expected_log_evidence(
        normal, truth, rival, centre
    )


def apart(normal: np.ndarray, truth: Mapping[int, float], rival: Sequence[int]) -> float:
    """Half the energy of the response to `truth` that the columns of `rival` cannot follow at any size (nats).

    The expected log likelihood ratio at the best coefficients of both: what data alone would say, no prior asked. What
    is a small share of the whole response is the error of a response of first order, and counts for nothing.
    """
    normal, m = _not_negative(normal), list(rival)
    # what both have is followed exactly
    v = np.array([0.0 if k in m else truth.get(k, 0.0) for k in range(len(normal))])
    pushed = normal @ v
    scale = np.sqrt(np.maximum(np.diag(normal)[m], 1e-300))
    inner = normal[np.ix_(m, m)] / np.outer(scale, scale)
    whole = float(v @ pushed)
    left = whole - float((pushed[m] / scale) @ np.linalg.pinv(inner, RCOND) @ (pushed[m] / scale))
    return 0.5 * left if left > FIRST_ORDER * whole else 0.0


@dataclass(frozen=True)
class Recommendation:
    """The experiment to make, what it adds (nats), and the expected log Bayes factor together with what is at hand."""

    experiment: str
    gain: float
    expected_log_bayes_factor: float


class Catalogue:
    """The experiments that an instrument permits, judged as it is believed; each is planned once, when asked about.

    `cases` are the recordings at hand, `noise_points` the noise found in each; `belief` is needed where all are of
    chambers.
    """

    def __init__(
        self, cases: Sequence[Case], noise_points: Sequence[np.ndarray], policy: Policy, belief: Belief | None = None
    ):
        self._policy = policy
        self._cases, self._noise_points = list(cases), list(noise_points)
        self._like = max(
            (case for case in cases if case.believed is not None),
            key=lambda case: (case.temperature is not None, case.kind in MOVING),
            default=None,
        )
        self._belief = belief if self._like is None else self._like.believed.recording.belief
        self._planned: dict[str, tuple[Case, np.ndarray]] = {}

    def experiments(self, axes: Sequence[str] = "xyz") -> list[Experiment]:
        """Cheapest first; chambers for the accelerometers `axes`."""
        return experiments(self._cases, self._like, axes)

    def information(self, experiment: Experiment, effects: Sequence[Candidate], at_hand: np.ndarray) -> np.ndarray:
        """Reduced A (m, m) that `experiment` would add; `at_hand` (m, m) is that of the recordings at hand."""
        if experiment.plan is None:
            kept = np.array([not (one.local or one.name.startswith(experiment.anew)) for one in effects], dtype=float)
            return at_hand * np.outer(kept, kept)
        case, noise_point = self._case(experiment)
        return information(case, [planned_column(case, one) for one in effects], noise_point)

    def recommend(
        self,
        effects: Sequence[Candidate],
        at_hand: np.ndarray,
        truth: Mapping[int, float],
        rivals: Sequence[Sequence[int]],
        alike: Sequence[bool] = (),
    ) -> list[Recommendation | None]:
        """Of each rival the cheapest experiment that adds enough, else the best that is worth it (`Policy`), else None.

        `effects` are all that occur; `truth` says which of them are taken as true, with coefficients in nominal sizes,
        and each rival lists its own. `at_hand` (m, m) is their reduced A, summed over the recordings at hand. Of one
        that only priors tell from the truth, `alike`, more of the same priors says nothing: the experiment has to.
        """
        centre = np.array([one.centre for one in effects])
        by_data = [*alike, *([False] * (len(rivals) - len(alike)))]

        def expect(normal: np.ndarray, k: int) -> float:
            if by_data[k]:
                return apart(normal, truth, rivals[k])
            return expected_log_bayes_factor(normal, truth, rivals[k], centre)

        already = [expect(at_hand, k) for k in range(len(rivals))]
        best: list[Recommendation | None] = [None] * len(rivals)
        # of effects that belong to one recording alone another one says nothing
        shared = [k for k, rival in enumerate(rivals) if not all(effects[i].local for i in (*truth, *rival))]
        concerned = [effects[k] for k in sorted({*truth, *(k for rival in rivals for k in rival)})]
        axes = sorted({one.axis for one in concerned if one.name.startswith("accelerometer.")} - {None})
        for experiment in self.experiments(axes):
            open_ones = [k for k in shared if (one := best[k]) is None or one.gain < self._policy.experiment_enough]
            if not open_ones:
                break
            try:
                total = at_hand + self.information(experiment, effects, at_hand)
            except DataRefused:  # the errors of this instrument would grow too large in it
                continue
            for k in open_ones:
                expected = expect(total, k)
                gain, before = expected - already[k], best[k]
                if gain > (self._policy.experiment_worth if before is None else before.gain):
                    best[k] = Recommendation(experiment.name, gain, expected)
        return best

    def _case(self, experiment: Experiment) -> tuple[Case, np.ndarray]:
        if experiment.name not in self._planned:
            made = experiment.plan()
            with np.errstate(invalid="ignore", over="ignore"):  # of levels that are read off no noise, and replaced
                if isinstance(made, ChamberReadings):
                    case = prepare_chamber(made, plans.chamber_belief(self._belief, made.axis), experiment.name)
                else:
                    case = prepare(made, self._like.believed.folder, planned=True)
            self._planned[experiment.name] = self._with_noise(case)
        return self._planned[experiment.name]

    def _with_noise(self, case: Case) -> tuple[Case, np.ndarray]:
        """The noise that was found: of what measures where it is the same, of the instrument in any case."""
        source = case.seen.sources[0].name
        same = next((k for k, one in enumerate(self._cases) if one.seen.sources[0].name == source), None)
        if same is not None:
            known = self._cases[same].noise
            white = _white(self._cases[same], case)
            noise = replace(case.noise, priors=known.priors, down=known.down, white=white)
            return replace(case, noise=noise), self._noise_points[same]
        found: dict[str, float] = {}
        for other, noise_point in zip(self._cases, self._noise_points, strict=True):
            if case.believed is not None and other.believed is not None:
                found = {
                    name: x for name, x in zip(other.noise.free, noise_point, strict=True) if name in OF_INSTRUMENT
                }
        noise = replace(case.noise, down=np.ones(CHANNELS), white=case.seen.sigma)
        return replace(case, noise=noise), np.array([found.get(name, 0.0) for name in noise.free])


def information(case: Case, columns: Sequence[Column], noise_point: np.ndarray) -> np.ndarray:
    """Reduced A (m, m) of `columns` in one recording, nuisances integrated out, noise at `noise_point`."""
    return reduce(case.whitened(columns, noise_point, case.blocks), len(case.nuisances)).normal


def planned_column(case: Case, effect: Candidate) -> Column:
    """The column of an effect of another recording in this one; of zeros where it does not occur."""
    if effect.local or all(one.key != effect.key for one in case.candidates):
        return Column("absent")
    made = case.member(effect.name, effect.axis, effect.parameters)
    return wide(made.column, effect.nominal / made.nominal)  # its coefficient is counted in the sizes of `effect`


def _white(other: Case, case: Case) -> np.ndarray:
    """White noise (nodes, 9) of `case` as in another recording, each channel at its median."""
    measured = np.where(np.isfinite(other.seen.residual), other.noise.white, np.nan)
    known = np.isfinite(measured).any(axis=0)
    out = case.seen.sigma.copy()
    out[:, known] = np.nanmedian(measured[:, known], axis=0)
    return out


def _not_negative(normal: np.ndarray) -> np.ndarray:
    """The nearest matrix without negative eigenvalues, which rounding leaves of columns that nuisances take over."""
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    values, vectors = np.linalg.eigh(normal / np.outer(scale, scale))
    return (vectors * np.maximum(values, 0.0)) @ vectors.T * np.outer(scale, scale)
