"""Recordings navigated with some effects, and everything that can be asked around that point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ins_eval.diagnosis.case import Case
from ins_eval.diagnosis.held_out import held_out
from ins_eval.diagnosis.noise import Fitted
from ins_eval.diagnosis.refine import Refined
from ins_eval.diagnosis.search import Explanation, Space, log_bayes_factor, one_more, search
from ins_eval.diagnosis.study import Hypothesis, Sums, space, sums, union

HANDICAP = 3.0  # nats of what is composed of a recorded column
LESSER = 1.0  # nats that an effect costs which is believed of an instrument of which its kind is known
THERMAL = ("temperature", "creep", "hysteresis")  # in the name of an effect of an accelerometer


@dataclass(frozen=True, eq=False)
class Stage:
    """Recordings navigated with some effects, all hypotheses around that point, and the sums at the noise there.

    `model` are the first hypotheses, `point` (m,) the coefficients that were taken off, 0 elsewhere; `refined` says how
    sure times, widths and lags of the effects are with which the recordings were navigated.
    """

    cases: tuple[Case, ...]
    hypotheses: tuple[Hypothesis, ...]
    space: Space
    point: np.ndarray
    fitted: tuple[Fitted, ...]
    here: Sums
    ranked: tuple[Explanation, ...]
    refined: Refined | None = None

    @property
    def best(self) -> Explanation:
        """The most probable set that is not empty."""
        return next(one for one in self.ranked if one.members)

    @property
    def keys(self) -> set[tuple]:
        return {self.hypotheses[k].key for k in self.best.members}

    @cached_property
    def coefficients(self) -> tuple[np.ndarray, np.ndarray]:
        """Of the best set, (k,), and their covariance."""
        m = list(self.best.members)
        return _coefficients(self.here.normal[np.ix_(m, m)], self.here.projection[m], self.space.centre[m])

    def chosen(self, scaled: bool = True) -> list[Hypothesis]:
        """The effects of the best set, each with a prior as wide as what was found."""
        m = list(self.best.members)
        if not scaled:
            return [self.hypotheses[k] for k in m]
        mean, _ = self.coefficients
        return [self.hypotheses[k].scaled(max(1.0, abs(float(p)))) for k, p in zip(m, mean, strict=True)]

    def name(self) -> str:
        ones = [self.hypotheses[k].candidate for k in self.best.members]
        return " + ".join(f"{one.name} {one.axis or ''}".strip() for one in ones)

    def own_first(self, count: int, least: float) -> Stage:
        """The same with the set of its first `count` hypotheses best, unless another leads it by `least` nats.

        It is with these that the recordings were navigated: where two effects tie, there is no reason to change. A set
        of the same families with other times, widths or lags is the same explanation.
        """
        families = sorted(self.space.families[:count])
        found = next((one for one in self.ranked if sorted(self.space.families[list(one.members)]) == families), None)
        if found is None or self.best.log_posterior - found.log_posterior > least:
            return self
        own = replace(found, members=tuple(range(count)))
        return replace(self, ranked=(own, *(one for one in self.ranked if one is not found)))

    @property
    def height(self) -> float:
        """log posterior of the best set, up to what is common to all stages."""
        return self.here.log_null + self.best.log_posterior

    def gain(self, members: Sequence[int]) -> float:
        """log Bayes factor of these hypotheses together."""
        m = list(members)
        return log_bayes_factor(self.here.normal[np.ix_(m, m)], self.here.projection[m], self.space.centre[m])[0]

    def places(self, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """log B of every family in the place of member `k`, its best member, and log B where it may have any size."""
        others = [j for j in self.best.members if j != k]
        return one_more(self.here.normal, self.here.projection, others, self.space)

    @cached_property
    def thermal(self) -> np.ndarray:
        """Which of the hypotheses (m,) are thermal effects of accelerometers."""
        names = [one.candidate.name for one in self.hypotheses]
        of_accelerometers = [
            name.startswith("accelerometer.") and any(word in name for word in THERMAL) for name in names
        ]
        return np.array(of_accelerometers) | (np.array(names) == "temperature.lag")

    @cached_property
    def foretold(self) -> list[tuple[Hypothesis, float]]:
        """What is believed of other recordings of the instrument: hypotheses, each with its coefficient.

        To be named, an effect must be sure, for it is one of many that could have been. Once one accelerometer is known
        to have thermal errors that it was not calibrated for, others have them too: beside the effects of the best set
        further thermal ones are sought at the cost `LESSER`, the prior drawing each coefficient towards 0 as far as it
        is not sure. The constant of an accelerometer whose bias has such an error was calibrated as if it had none, so
        it is free.
        """
        a, b, space = self.here.normal, self.here.projection, self.space
        names, thermal = [one.candidate.name for one in self.hypotheses], self.thermal
        m = list(self.best.members)
        if thermal[m].any():
            further = thermal & ~np.isin(space.families, space.families[m])
            _, scales = log_bayes_factor(a[np.ix_(m, m)], b[m], space.centre[m])
            across = np.linalg.solve(a[np.ix_(m, m)] + np.diag(scales**-2.0), a[m])
            left, seen = a - a[:, m] @ across, b - a[:, m] @ space.centre[m]
            seen = seen - across.T @ seen[m]
            found = search(left * np.outer(further, further), seen * further, space, 0.0, LESSER)
            m += found[0].members
        moved = {self.hypotheses[k].candidate.axis for k in m if names[k].startswith("accelerometer.bias_")}
        if any(names[k] == "temperature.lag" for k in m):
            moved |= set("xyz")
        constants = [k for k, name in enumerate(names) if name == "accelerometer.bias" and k not in m]
        m += [k for k in constants if self.hypotheses[k].candidate.axis in moved]
        mean, _ = _coefficients(a[np.ix_(m, m)], b[m], space.centre[m])
        return [(self.hypotheses[k], float(p)) for k, p in zip(m, mean, strict=True)]

    @cached_property
    def held_out(self) -> dict[str, float | str]:
        """The fit on data that were not used."""
        m = list(self.best.members)
        positions = [one.position for one in self.fitted]
        return held_out(self.cases, self.chosen(scaled=False), self.point[m], positions)


def _coefficients(a: np.ndarray, b: np.ndarray, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of a set (k,) and their covariance, at the scales of the prior that are best."""
    _, scales = log_bayes_factor(a, b, centre)
    covariance = np.linalg.inv(a + np.diag(scales**-2.0))
    return covariance @ (b + centre / scales**2), covariance


def staged(
    cases: Sequence[Case],
    model: Sequence[Hypothesis],
    point: np.ndarray,
    fitted: Sequence[Fitted],
    share: float,
) -> Stage:
    """The stage at which the effects of `model` are taken off with coefficients `point`, and its search."""
    taken = {_identity(one) for one in model}
    others = [one for one in union(cases) if _identity(one) not in taken]
    hypotheses = (*model, *others)
    of_space = space(hypotheses, HANDICAP)
    whole = np.append(point, np.zeros(len(others)))
    here = sums(cases, [one.position for one in fitted], hypotheses, whole if point.any() else None)
    ranked = search(here.normal, here.projection, of_space, share)
    return Stage(tuple(cases), hypotheses, of_space, whole, tuple(fitted), here, tuple(ranked))


def _identity(one: Hypothesis) -> tuple:
    return one.key, *sorted(one.candidate.parameters.items(), key=str)
