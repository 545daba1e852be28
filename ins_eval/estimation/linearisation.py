"""Recordings navigated with some effects, and everything that can be asked around that point."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import logsumexp

from ins_eval.effects.accelerometer import AT
from ins_eval.estimation.evidence import log_bayes_factors
from ins_eval.estimation.held_out import held_out
from ins_eval.estimation.instants import innovations, remarkable
from ins_eval.estimation.placing import again
from ins_eval.estimation.scatter import scattered
from ins_eval.estimation.search import (
    NULL,
    Explanation,
    Space,
    chi_square_gains,
    conditional,
    explanation,
    log_bayes_factor,
    lost_to_size,
    one_more,
    possible,
    posterior,
    search,
)
from ins_eval.estimation.study import Hypothesis, Sums, space, sums, union

if TYPE_CHECKING:
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.noise_fit import Fitted
    from ins_eval.estimation.placing import Point
    from ins_eval.policy import Policy

SETTLED = 5.0  # sigmas: what the fit of the noise may move a coefficient by; by reasoning
CONSTANTS = ("accelerometer.bias", "accelerometer.scale")


class OwnNoise(NamedTuple):
    """The noise of each recording that is fitted beside a set, () where none is kept, and what the set gains more.

    `taken` is by how much, there, families lower chi-square in the place of what was fitted: those that could be alike.
    """

    more: float
    fitted: tuple[Fitted, ...]
    taken: Mapping[int, float]


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Recordings navigated with some effects, all hypotheses around that point, and the sums at the noise there.

    What was taken off at `refined` are the first hypotheses; `point` (m,) are their coefficients, 0 elsewhere.
    `own_noise` is the noise of its own that a family has beside a set, where it gains more there (module `own_noise`).
    """

    cases: tuple[Case, ...]
    hypotheses: tuple[Hypothesis, ...]
    space: Space
    point: np.ndarray
    fitted: tuple[Fitted, ...]
    here: Sums
    ranked: tuple[Explanation, ...]
    refined: Point | None = None
    own_noise: Mapping[tuple[frozenset[int], int], OwnNoise] = field(default_factory=dict)

    @property
    def best(self) -> Explanation:
        """The most probable set that is not empty; the empty one where each would need a size that no sensor has."""
        return next((one for one in self.ranked if one.members), NULL)

    @property
    def keys(self) -> set[tuple]:
        return {self.hypotheses[k].key for k in self.best.members}

    @cached_property
    def coefficients(self) -> tuple[np.ndarray, np.ndarray]:
        """Of the best set, (k,), and their covariance, at the scales of the prior that are best."""
        m = list(self.best.members)
        a, b, centre = self.here.normal[np.ix_(m, m)], self.here.projection[m], self.space.centre[m]
        _, scales = log_bayes_factor(a, b, centre)
        return posterior(a, b, centre, scales)

    @property
    def settled(self) -> bool:
        """Whether the best set has the coefficients with which the recordings were navigated, to `SETTLED` sigmas.

        At the noise beside it others may be best, so far off that the sums around that point do not tell what they do.
        """
        mean, covariance = self.coefficients
        moved = np.abs(mean - self.point[list(self.best.members)])
        return bool((moved < SETTLED * np.sqrt(np.diag(covariance))).all())

    @cached_property
    def scatter(self) -> np.ndarray:
        """Variance (k,) of the coefficients of the best set by how they scatter from stretch to stretch."""
        m = list(self.best.members)
        mean, covariance = self.coefficients
        noise_points = [one.noise_point for one in self.fitted]
        model = [self.hypotheses[k] for k in m]
        return scattered(self.cases, model, noise_points, mean - self.point[m], covariance)

    def trust(self, k: int) -> float:
        """By how much the sums count in the place of member `k`: the share of its variance that is noise.

        Where it scatters more than the noise allows for, so does all that could stand in its place.
        """
        i = self.best.members.index(k)
        by_noise = self.coefficients[1][i, i]
        return float(by_noise / max(by_noise, self.scatter[i]))

    def trusted(self, k: int) -> Linearisation:
        """The same with sums that count as far as member `k` can be trusted: a likelihood raised to that power.

        What a choice among many instants or sizes costs is no likelihood, and stays.
        """
        share = self.trust(k)
        if share == 1.0:
            return self
        here = replace(self.here, normal=share * self.here.normal, projection=share * self.here.projection)
        own_noise = {of: one._replace(more=share * one.more) for of, one in self.own_noise.items()}
        return replace(self, here=here, own_noise=own_noise)

    def chosen(self, scaled: bool = True) -> list[Hypothesis]:
        """The effects of the best set, each with a prior as wide as what was found."""
        m = list(self.best.members)
        if not scaled:
            return [self.hypotheses[k] for k in m]
        mean, _ = self.coefficients
        return [self.hypotheses[k].scaled(max(1.0, abs(float(p)))) for k, p in zip(m, mean, strict=True)]

    @property
    def where_it_was(self) -> np.ndarray:
        """Coefficients (k,) of the best set with which the recordings were navigated, from where it is refitted.

        An effect at another time, width or lag begins from the size that it had: without it all would be as far off as
        before it was found.
        """
        members = self.best.members
        navigated = [int(k) for k in np.flatnonzero(self.point) if k not in members]
        begin = self.point[list(members)]
        for i, k in enumerate(members):
            one = self.hypotheses[k]
            same = [j for j in navigated if self.hypotheses[j].key == one.key]
            if begin[i] == 0.0 and len(same) == 1:
                begin[i] = self.point[same[0]] * self.hypotheses[same[0]].candidate.nominal / one.candidate.nominal
        return begin

    def name(self) -> str:
        ones = [self.hypotheses[k].candidate for k in self.best.members]
        return " + ".join(f"{one.name} {one.axis or ''}".strip() for one in ones)

    def own_first(self, count: int) -> Linearisation:
        """The same with the set of its first `count` hypotheses best, with which the recordings were navigated.

        A set of the same families with other times, widths or lags is the same explanation.
        """
        families = sorted(self.space.families[:count])
        found = next((one for one in self.ranked if sorted(self.space.families[list(one.members)]) == families), None)
        if found is None:
            gain = self.gain(range(count))
            found = explanation(range(count), gain, self.space.cost)
        own = replace(found, members=tuple(range(count)))
        return replace(self, ranked=(own, *(one for one in self.ranked if one is not found)))

    def gain(self, members: Sequence[int]) -> float:
        """log Bayes factor of these hypotheses together."""
        m = list(members)
        return log_bayes_factor(self.here.normal[np.ix_(m, m)], self.here.projection[m], self.space.centre[m])[0]

    def places(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """log B of every family in the place of member `k`, and its best member; -inf where no sensor is so far off."""
        others = [j for j in self.best.members if j != k]
        sums = self.here.normal, self.here.projection
        of_family, members = one_more(*sums, others, self.space)
        own = self.space.families[k]
        for family in np.flatnonzero(np.isfinite(of_family)):
            if family != own and not possible(*sums, [*others, members[family]], self.space)[-1]:
                of_family[family] = -np.inf
        if own in self.space.families[others]:  # jumps at two instants are of one family
            of_family[own], members[own] = self.gain(self.best.members) - self.gain(others), k
        for (beside, family), own_noise in self.own_noise.items():
            if beside == frozenset(others):
                of_family[family] += own_noise.more
        return of_family, members

    def within_largest(self, k: int, others: np.ndarray) -> np.ndarray:
        """log B (n,) of hypotheses in the place of member `k`, as `places`, if none is larger than any sensor's."""
        rest = [j for j in self.best.members if j != k]
        a, b = conditional(self.here.normal, self.here.projection, rest, self.space.centre)
        return log_bayes_factors(a[others], b[others], largest=self.space.largest[others])

    @cached_property
    def lost_to_size(self) -> float:
        """Nats that the best set gains less for sizes beyond every scale of a search; what has no name has none."""
        m = list(self.best.members)
        return lost_to_size(self.here.normal[np.ix_(m, m)], self.here.projection[m], self.space.centre[m])

    @cached_property
    def log_posterior_of_names(self) -> float:
        """log posterior that the best set is right, or one with another family in the place of one of its effects.

        As if such sizes were expected (`lost_to_size`).
        """
        more = [0.0]
        for k in self.best.members:
            of_family, _ = self.places(k)
            own = int(self.space.families[k])
            more += [nats - of_family[own] for nats in np.delete(of_family, own)]
        return self.best.log_posterior + self.lost_to_size + float(logsumexp(more))

    def unlikelier(self, k: int, shows: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """By how many nats of likelihood each family in the place of member `k` fits worse than it, at any sizes.

        Half of what chi-square is more, (families,): at the noise here, and at that beside another in its place if they
        are more alike there and lower chi-square by `shows`: where the member itself hardly counts all are alike.
        """
        others = [j for j in self.best.members if j != k]
        gains, space = chi_square_gains(self.here.normal, self.here.projection, others, self.space), self.space
        here = 0.5 * (gains[k] - np.maximum.reduceat(gains[space.order], space.first))
        least, own = here.copy(), int(space.families[k])
        known = [there.taken for (beside, _), there in self.own_noise.items() if beside == frozenset(others)]
        for taken in (one for one in known if own in one):
            for family in (one for one, lowers in taken.items() if lowers >= shows):
                least[family] = min(least[family], 0.5 * (taken[own] - taken[family]))
        return here, least

    def without(self, dropped: Collection[int]) -> Linearisation:
        """The same with the best set lessened by the hypotheses `dropped`; what was taken off stays known."""
        kept = tuple(k for k in self.best.members if k not in dropped)
        gain = self.gain(kept)
        return replace(self, ranked=(explanation(kept, gain, self.space.cost), *self.ranked) if kept else ())

    def set_aside(self, dropped: Collection[int]) -> Linearisation:
        """The same with `dropped` no longer in the best set, but in the fit: the others are judged beside them.

        Their coefficients are integrated out of the sums, of which nothing is left for them.
        """
        m, out = list(self.best.members), list(dropped)
        a, b, centre = self.here.normal, self.here.projection, self.space.centre
        _, scales = log_bayes_factor(a[np.ix_(m, m)], b[m], centre[m])
        prior = [scales[m.index(k)] for k in out]
        across = np.linalg.solve(a[np.ix_(out, out)] + np.diag(np.power(prior, -2.0)), a[out])
        shifted = b - a[:, out] @ centre[out]
        normal, projection = a - a[:, out] @ across, shifted - across.T @ shifted[out]
        normal[out], normal[:, out], projection[out] = 0.0, 0.0, 0.0
        # what is set aside is so at this noise
        own_noise = {(them - {*out}, f): one._replace(fitted=())
                     for (them, f), one in self.own_noise.items() if them.issuperset(out)}  # fmt: skip
        here = replace(self.here, normal=normal, projection=projection)
        return replace(self, here=here, own_noise=own_noise).without(out)

    def sure(self, policy: Policy) -> Linearisation:
        """The same without effects that gain too little beside the others of the best set, the least first.

        What is there by chance gains `Policy.sure` nats more than its choice costs once in exp(sure). And where one
        gains little, every other lies near it.
        """
        one, least = self, self.space.cost + policy.sure
        while len(members := one.best.members) > 1:
            whole = one.gain(members)
            gains = {k: whole - one.gain([j for j in members if j != k]) for k in members}
            k = min(gains, key=gains.__getitem__)
            if gains[k] >= least:
                break
            one = one.without({k})
        return one

    def exchanged(self, k: int, other: int) -> Linearisation:
        """The same with hypothesis `other` in the place of member `k` of the best set; what was taken off stays.

        At the noise of its own, where it gains more at that.
        """
        members = tuple(other if member == k else member for member in self.best.members)
        own = self.own_noise.get((frozenset(members) - {other}, int(self.space.families[other])))
        one = self
        if own is not None and own.fitted:
            point = self.point if self.point.any() else None
            here = sums(self.cases, [noise.noise_point for noise in own.fitted], self.hypotheses, point)
            one = replace(self, fitted=own.fitted, here=here, own_noise={})
        return replace(one, ranked=(explanation(members, one.gain(members), self.space.cost), *self.ranked))

    def excluding(self, key: tuple) -> Linearisation:
        """The same without the sets that hold effects of the family `key`."""
        of_family = {k for k, one in enumerate(self.hypotheses) if one.key == key}
        return replace(self, ranked=tuple(one for one in self.ranked if not of_family & set(one.members)))

    @property
    def taken_beside(self) -> list[int]:
        """Hypotheses that were taken off the recordings and are not in the best set."""
        return [int(k) for k in np.flatnonzero(self.point) if k not in self.best.members]

    @cached_property
    def held_out(self) -> dict[str, float | str]:
        """The fit on data that were not used."""
        m = [*self.best.members, *self.taken_beside]
        noise_points = [one.noise_point for one in self.fitted]
        model, count = [self.hypotheses[k] for k in m], len(self.best.members)
        return held_out(self.cases, model, self.point[m], noise_points, count)


def more_probable(a: Linearisation, b: Linearisation) -> float:
    """By how many nats the best set of `b` is more probable than that of `a`, on the measurements that both have.

    Where the nodes differ, as if there were as many of them in `b`.
    """
    both = on_common(a.cases, b.cases)
    heights = [_height(replace(one, cases=tuple(cases))) for one, cases in zip((a, b), both, strict=True)]
    counts = [sum(np.count_nonzero(np.isfinite(case.seen.residual)) for case in cases) for cases in both]
    return heights[1] * counts[0] / max(counts[1], 1) - heights[0]


def on_common(cases: Sequence[Case], others: Sequence[Case]) -> tuple[list[Case], list[Case]]:
    """Both with the measurements that both have: which are outliers depends on what the recordings are navigated with.

    Where the nodes differ, as they are.
    """
    left, right = list(cases), list(others)
    for r, (a, b) in enumerate(zip(cases, others, strict=True)):
        if a.seen.residual.shape == b.seen.residual.shape:
            known = np.isfinite(a.seen.residual) & np.isfinite(b.seen.residual)
            left[r], right[r] = (
                replace(one, seen=replace(one.seen, residual=np.where(known, one.seen.residual, np.nan)))
                for one in (a, b)
            )
    return left, right


def _height(one: Linearisation) -> float:
    """log posterior of the best set, up to what is common to all linearisations."""
    return log_evidence_of_best(one) + one.best.log_posterior - one.best.log_bayes_factor


def log_evidence_of_best(one: Linearisation) -> float:
    """log evidence of the best set at the noise of the linearisation, up to what is common to all linearisations."""
    m, best = [*one.best.members, *one.taken_beside], one.best
    own = list(range(len(best.members)))
    model, noise_points = [one.hypotheses[k] for k in m], [noise.noise_point for noise in one.fitted]
    here = sums(one.cases, noise_points, model, one.point[m])
    centre = one.space.centre[list(best.members)]
    gain, _ = log_bayes_factor(here.normal[np.ix_(own, own)], here.projection[own], centre)
    return here.log_null + gain


def linearise(at: Point, policy: Policy) -> Linearisation:
    """The linearisation around the effects that are taken off, and its search."""
    taken = {one.identity for one in at.taken}
    others = [one for one in union(at.cases) if one.identity not in taken]
    others += _placed_alike(at.cases, at.taken, others)
    others += _jumped(at.cases, at.taken, others, at.fitted)
    hypotheses = (*at.taken, *others)
    of_space = space(hypotheses, policy)
    whole = np.append(at.point, np.zeros(len(others)))
    here = sums(at.cases, [one.noise_point for one in at.fitted], hypotheses, whole if at.point.any() else None)
    share = policy.least_share(case.kind for case in at.cases)
    ranked = search(here.normal, here.projection, of_space, share, policy)
    return Linearisation(at.cases, hypotheses, of_space, whole, at.fitted, here, tuple(ranked), at)


def _placed_alike(cases: Sequence[Case], model: Sequence[Hypothesis], others: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Of every family with the same further parameters as an effect of `model` a member at the values of that effect.

    Between the values that are tried of it a jump of one error would look unlike that of another.
    """
    families = {one.key: one for one in others}
    made = []
    for one in model:
        placed = _numbers(one)
        alike = (f for f in families.values() if placed and f.key != one.key and _numbers(f).keys() == placed.keys())
        made += [again(other, cases, {**other.candidate.parameters, **placed}) for other in alike]
    known = {one.identity for one in (*model, *others)}
    return [one for one in {one.identity: one for one in made}.values() if one.identity not in known]


def _jumped(
    cases: Sequence[Case], model: Sequence[Hypothesis], others: Sequence[Hypothesis], fitted: Sequence[Fitted]
) -> list[Hypothesis]:
    """Of every family of what jumps a member at each instant that the innovations beside `model` show."""
    made = []
    for r, (case, noise) in enumerate(zip(cases, fitted, strict=True)):
        jumping = {one.key: one for one in others if AT.name in one.candidate.parameters and one.columns[r] is not None}
        if not jumping:
            continue
        columns = [one.columns[r] for one in model if one.columns[r] is not None]
        at_s = remarkable(innovations(case, noise.noise_point, columns), case.model.nodes_s)
        made += [again(one, cases, {**one.candidate.parameters, AT.name: t}) for one in jumping.values() for t in at_s]
    return made


def _numbers(one: Hypothesis) -> dict[str, float | str]:
    return {name: x for name, x in one.candidate.parameters.items() if isinstance(x, float | int)}
