"""What a diagnosis says: verdict, located mismatches, effects, rivals, and what remains."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from threadpoolctl import threadpool_limits

from ins_eval.estimation.forecast import forecast, lower, persistent
from ins_eval.estimation.placing import again

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ins_eval.diagnosis.unnamed.mismatch import Mismatch, UnnamedDisturbance
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.forecast import Forecast
    from ins_eval.estimation.linearisation import Linearisation
    from ins_eval.estimation.noise_fit import Fitted
    from ins_eval.estimation.study import Hypothesis
    from ins_eval.policy import Policy
    from ins_eval.recording.belief import EffectBelief

NO_MISMATCH, EXPLAINED, NOT_IDENTIFIABLE = "no mismatch", "explained", "not identifiable"
PARTLY, UNEXPLAINED = "partly explained", "unexplained"
Q95 = 1.96  # sigmas to either end of a 95 % interval
DIGITS = 5  # of what is written of a covariance


@dataclass(frozen=True, eq=False)
class FoundEffect:
    """One effect of the explanation: `value` with `sigma` in its unit."""

    hypothesis: Hypothesis
    value: float
    sigma: float
    probability: float
    log_evidence_gain: float
    false_alarm_probability: float
    spread: dict[str, tuple[float, float]] = field(default_factory=dict)  # 95 % of times, widths and lags


@dataclass(frozen=True, eq=False)
class Rival:
    """What could stand in the place of an effect; `of` None: in that of noise, as other sensors have it."""

    of: Hypothesis | None
    hypothesis: Hypothesis
    probability: float
    below_best: float
    by_prior_only: bool
    experiment: str | None = None  # the cheapest that would tell them apart
    expected_log_bayes_factor: float | None = None
    beside: tuple[Hypothesis, ...] = ()  # what has to stand beside it
    value: float | None = None  # in the unit of its effect, where it is known
    sigma: float | None = None  # of the value, likewise
    spread: dict[str, tuple[float, float]] = field(default_factory=dict)  # as of an effect, by the values tried


@dataclass(frozen=True, eq=False)
class Withdrawn:
    """An effect that was found and is not named, with the invariant that it would violate."""

    effect: FoundEffect
    reason: str


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The verdict over all recordings, and what led to it.

    `null` and `fitted` are the noise of each recording under the belief and under the answer; `innovations` of the
    null (nodes, 9) of each recording, everything uncertain at its best; `statistics` the numbers of the search;
    `policy` the thresholds that decided; `described` wrong descriptions: `cases` are of the recordings as mended;
    `withdrawn` what was found and is not named (`invariants`), `departure_sigma` the significance of what no name
    explained before; `around_belief` is where the search began.
    """

    cases: tuple[Case, ...]
    verdict: str
    effects: tuple[FoundEffect, ...]
    rivals: tuple[Rival, ...]
    mismatches: tuple[Mismatch, ...]
    unnamed: UnnamedDisturbance
    null: tuple[Fitted, ...]
    fitted: tuple[Fitted, ...]
    innovations: tuple[np.ndarray, ...]
    statistics: dict[str, float | str]
    held_out: dict[str, float | str]
    after: tuple[Case, ...]
    linearisation: Linearisation | None
    policy: Policy
    described: tuple[FoundEffect, ...] = ()  # wrong descriptions, mended before anything else
    withdrawn: tuple[Withdrawn, ...] = ()
    departure_sigma: float = 0.0
    around_belief: Linearisation | None = None

    def believed_in(self, r: int) -> list[EffectBelief]:
        """The effects that act in recording `r`, as a belief states them."""
        return [
            one.hypothesis.believed(one.value / one.hypothesis.candidate.nominal, self.cases)
            for one in self.effects
            if one.hypothesis.acts_in(r)
        ]

    @property
    def forecast(self) -> list[EffectBelief]:
        """What is believed of the instrument's next recordings.

        Wrong descriptions and named effects that are not of a sensor, or of one recording only, as they are stated; of
        the sensors the posterior of all persistent effects, see `estimation.forecast`: to it those that stand in the
        place of noise are named as well, for which of two searches leads by a fraction of a nat is chance. The chance
        that sensors have stands in `root`: the rows of a root of the covariance, in units of the values.
        """
        known, found = self.linearisation, [self._of_recording(one) for one in self.described]
        values = {one.hypothesis: one.value / one.hypothesis.candidate.nominal for one in self.effects}
        found += [one.believed(x, self.cases) for one, x in values.items() if not persistent(one)]
        named: list[tuple[Hypothesis, float, float]] = []
        if known is not None:
            off = dict(zip(known.hypotheses, known.point.tolist(), strict=True))
            named = [(one, values.get(one, x), x) for one, x in off.items() if one in values or x != 0.0]
        around = self.cases if known is None else known.cases
        named += [
            (again(one.hypothesis, around), one.value / one.hypothesis.candidate.nominal, 0.0)
            for one in self.rivals
            if one.of is None and one.value is not None
        ]
        with threadpool_limits(1):  # as in `judge`
            posterior = forecast(around, self.fitted, named)
        return [*found, *_with_roots(posterior, self.cases)]

    def _of_recording(self, one: FoundEffect) -> EffectBelief:
        """A wrong description as a belief states it: of one recording, where not all have it."""
        here = [
            case.name for case, column in zip(self.cases, one.hypothesis.columns, strict=True) if column is not None
        ]
        effect = one.hypothesis.believed(one.value, self.cases)
        return effect if len(here) == len(self.cases) else effect.model_copy(update={"recording": here[0]})


def _with_roots(posterior: Forecast, cases: Sequence[Case]) -> list[EffectBelief]:
    """The effects of a posterior as a belief states them, each with its row of a root of the covariance."""
    nominal = np.array([one.candidate.nominal for one in posterior.effects])
    root = lower(nominal[:, None] * posterior.root)
    return [
        one.believed(float(mean), cases).model_copy(
            update={"root": tuple(float(f"{x:.{DIGITS}g}") for x in row[: k + 1])}
        )
        for k, (one, mean, row) in enumerate(zip(posterior.effects, posterior.mean, root, strict=True))
    ]
