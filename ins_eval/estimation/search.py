"""Which effects together explain the sums: exact evidence of sets of effects, and a beam search over them.

With reduced sums A, b (everything that is uncertain anyway integrated out) a set S of effects with coefficients
p ~ N(c, diag(s^2)) has against the null

    log B = c'b - c'Ac / 2 + (b - Ac)'(A + diag(s^-2))^-1 (b - Ac) / 2 - log|I + diag(s^2) A| / 2,

and B is the mean over the scales s of every effect (`SCALES`); c is 0 but where physics fixes a coefficient, and then
a further effect has the sign of c: its prior is cut off at 0. An effect
that is right by chance alone has to pay for the choice: each effect of a set costs log(families / `Policy.odds`).
Effects that differ only in a time, a width or a lag are one family, whose B is the mean over its members.

Greedy selection fails where two effects share a signature, so the best `Policy.beam` sets of each size are carried on.

Sources: Kass and Raftery 1995; George and McCulloch, J. Am. Stat. Assoc. 88 (1993) 881 (evidence of subsets).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import islice, product
from typing import TYPE_CHECKING

import numba
import numpy as np
from scipy.special import log_ndtr

from ins_eval.estimation.evidence import PRODUCT, SCALES, SWEEPS, log_bayes_factors

if TYPE_CHECKING:
    from ins_eval.policy import Policy

FREE = 1e4  # prior sigma, in nominal sizes, of what may have any size
NO_SENSOR = ""
NEGLIGIBLE = 1.0  # nats that another scale has to add before it is summed over; by reasoning


@dataclass(frozen=True, eq=False)
class Space:
    """The hypotheses of a search: `families` (m,) number of the family of each column, `centre` (m,) as in the text.

    `handicap` (m,) nats that a column pays more than others, `exact` (m,) whether its form is geometry, of which
    nothing is left over, `sensor` (m,) the one that it acts on, `NO_SENSOR` where it acts on none, `odds` of a further
    effect being there at all, `largest` (m,) coefficients that no sensor of its grade exceeds.
    """

    families: np.ndarray
    centre: np.ndarray
    handicap: np.ndarray
    exact: np.ndarray
    sensor: np.ndarray
    odds: float
    largest: np.ndarray

    @cached_property
    def order(self) -> np.ndarray:
        """The columns sorted by family."""
        return np.argsort(self.families, kind="stable")

    @cached_property
    def first(self) -> np.ndarray:
        """Where each family begins in `order`."""
        return np.searchsorted(self.families[self.order], np.arange(int(self.families.max()) + 1))

    @property
    def cost(self) -> float:
        """Nats that each effect of a set costs."""
        return float(np.log(max(1, np.unique(self.families).size) / self.odds))


@dataclass(frozen=True)
class Explanation:
    """A set of columns, in the order found; `log_bayes_factor` of their families against the null.

    `log_posterior` is the same less what the effects cost; the null has 0. `judged` is that less what further effects
    of one sensor have to bring, by which sets are ranked.
    """

    members: tuple[int, ...]
    log_bayes_factor: float
    log_posterior: float
    judged: float


NULL = Explanation((), 0.0, 0.0, 0.0)


def log_bayes_factor(a: np.ndarray, b: np.ndarray, centre: np.ndarray) -> tuple[float, np.ndarray]:
    """log Bayes factor of one set, from its own A (k, k) and b (k,), and the prior scales (k,) that make it highest."""
    if b.size == 0:
        return 0.0, np.zeros(0)
    choices = [SCALES if c == 0.0 else (1.0,) for c in centre]
    if b.size > PRODUCT:
        return _one_at_a_time(a, b, centre, choices)
    scales = _combinations(tuple(choices))
    each = _at_scales(a, b, centre, scales)
    return float(np.logaddexp.reduce(each) - np.log(len(scales))), scales[int(np.argmax(each))]


def lost_to_size(a: np.ndarray, b: np.ndarray, centre: np.ndarray) -> float:
    """Nats that a set gains less than with a prior as wide as its coefficients that lie beyond the widest of `SCALES`.

    A unit worse than its grade, or one of which nothing is believed, has errors of a thousand usual sizes.
    """
    _, scales = log_bayes_factor(a, b, centre)
    mean, _ = posterior(a, b, centre, scales)
    beyond = (centre == 0.0) & (np.abs(mean) > SCALES[-1])
    wide = np.where(beyond, np.abs(mean), scales)
    as_they_are, as_expected = _at_scales(a, b, centre, np.array([wide, scales]))
    return float(as_they_are - as_expected)


@cache
def _combinations(choices: tuple[tuple[float, ...], ...]) -> np.ndarray:
    """Every combination (n, k) of the scales of k effects."""
    return np.array(list(product(*choices)))


def _one_at_a_time(
    a: np.ndarray, b: np.ndarray, centre: np.ndarray, choices: Sequence[Sequence[float]]
) -> tuple[float, np.ndarray]:
    """log Bayes factor of a set, summed over the scales of one effect at a time, those of the others at their best.

    Another scale of effect k adds d to M_kk of M = A + diag(s^-2). With C = M^-1 and m = C (b - Ac):

        m'M m -> m'M m - d m_k^2 / (1 + d C_kk),   log|M| -> log|M| + log(1 + d C_kk)
    """
    best = np.array([one[len(one) // 2] for one in choices])
    counts = np.array([len(one) for one in choices])
    scales = np.ones((len(choices), counts.max()))
    for k, one in enumerate(choices):
        scales[k, : len(one)] = one
    covariance = np.linalg.inv(a + np.diag(best**-2.0))
    gain = _swept(covariance, covariance @ (b - a @ centre), best, scales, counts)
    return float(_at_scales(a, b, centre, best[None])[0] + gain), best


@numba.njit(cache=True)
def _swept(covariance, mean, best, scales, counts):
    """What the other scales of each effect add to log B at the best ones; those come to stand in `best`."""
    gain = 0.0
    for _ in range(SWEEPS):
        gain, moved = 0.0, False
        for k in range(best.size):
            highest, total, chosen = -np.inf, 0.0, 0
            each = np.empty(counts[k])
            for n in range(counts[k]):
                d = 1.0 / (scales[k, n] * scales[k, n]) - 1.0 / (best[k] * best[k])
                grown = 1.0 + d * covariance[k, k]
                each[n] = -0.5 * (d * (mean[k] * mean[k]) / grown + np.log(grown)) - np.log(scales[k, n] / best[k])
                if each[n] > highest:
                    highest, chosen = each[n], n
            for n in range(counts[k]):
                total += np.exp(each[n] - highest)
            gain += np.log(total / counts[k])
            if scales[k, chosen] != best[k]:
                d = 1.0 / (scales[k, chosen] * scales[k, chosen]) - 1.0 / (best[k] * best[k])
                shrunk = d / (1.0 + d * covariance[k, k])
                column = covariance[k].copy()
                mean -= shrunk * mean[k] * column
                for i in range(best.size):
                    covariance[i] -= shrunk * column[i] * column
                best[k], moved = scales[k, chosen], True
        if not moved:
            break
    return gain


def _at_scales(a: np.ndarray, b: np.ndarray, centre: np.ndarray, scales: np.ndarray) -> np.ndarray:
    """log B (n,) with the scales of each row (n, k)."""
    left = b - a @ centre
    inverse = np.repeat(a[None], len(scales), axis=0)
    inverse[:, range(b.size), range(b.size)] += scales**-2.0
    gain = 0.5 * np.einsum(
        "k,nk->n", left, np.linalg.solve(inverse, np.broadcast_to(left, scales.shape)[..., None])[..., 0]
    )
    volume = 0.5 * (np.linalg.slogdet(inverse)[1] + 2.0 * np.log(scales).sum(axis=1))
    return centre @ b - 0.5 * centre @ a @ centre + gain - volume


def posterior(a: np.ndarray, b: np.ndarray, centre: np.ndarray, scales: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (k,) of one set with the prior N(centre, diag(scales^2)), and their covariance."""
    covariance = np.linalg.inv(a + np.diag(scales**-2.0))
    return covariance @ (b + centre / scales**2), covariance


def conditional(
    a: np.ndarray, b: np.ndarray, chosen: Sequence[int], centre: np.ndarray, scales: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Diagonal of A and b of every column once those `chosen` are integrated out at `scales`, or their best ones."""
    s = list(chosen)
    if not s:
        return np.diag(a).copy(), b.copy()
    if scales is None:
        _, scales = log_bayes_factor(a[np.ix_(s, s)], b[s], centre[s])
    inner = a[np.ix_(s, s)] + np.diag(scales**-2.0)
    across = np.linalg.solve(inner, a[s])
    shifted = b - a[:, s] @ centre[s]
    return np.diag(a) - np.einsum("km,km->m", a[s], across), shifted - across.T @ shifted[s]


def one_more(a: np.ndarray, b: np.ndarray, chosen: Sequence[int], space: Space) -> tuple[np.ndarray, np.ndarray]:
    """Of each family outside the set: log B given the set, and its best member.

    (families,) each; -inf for families of the set.
    """
    single = _beside(a, b, list(chosen), space.centre) - space.handicap
    order, first = space.order, space.first
    counts = np.diff(np.append(first, order.size))
    of_family = np.logaddexp.reduceat(single[order], first) - np.log(counts)
    # the best member of each: the last one of it when sorted by family, then height
    best = np.lexsort((single, space.families))[first + counts - 1]
    taken = list({int(space.families[k]) for k in chosen})
    of_family[taken] = -np.inf
    return of_family, best


def _beside(a: np.ndarray, b: np.ndarray, chosen: list[int], centre: np.ndarray) -> np.ndarray:
    """log B (m,) of each column given the set: the mean over what is known of its scales, of one effect at a time.

    An effect of the set may be far larger beside another than alone: an offset of a clock and its drift cancel. Another
    scale t of it than the best one s adds d = t^-2 - s^-2 to M_kk, M = A_ss + diag(s^-2). With C = M^-1,
    m = C (b - Ac)_s and x = C A_sj the set alone has less log B, by

        (d m_k^2 / (1 + d C_kk) + log(1 + d C_kk)) / 2 + log(t / s),

    and the sums of column j beside it are a + q x_k^2 and b + q x_k m_k, q = d / (1 + d C_kk).
    """
    if not chosen:
        return _gains(np.diag(a), b, centre)
    inner, own = a[np.ix_(chosen, chosen)], centre[chosen]
    _, best = log_bayes_factor(inner, b[chosen], own)
    covariance = np.linalg.inv(inner + np.diag(best**-2.0))
    mean, across = covariance @ (b[chosen] - inner @ own), covariance @ a[chosen]
    ca, cb = conditional(a, b, chosen, centre, best)
    single = _gains(*_not_taken_over(a, ca, cb), centre)
    other = [(k, t) for k in np.flatnonzero(own == 0.0) for t in SCALES if t != best[k]]
    d = np.array([t**-2.0 - best[k] ** -2.0 for k, t in other])
    grown = np.array([1.0 + x * covariance[k, k] for x, (k, _) in zip(d, other, strict=True)])
    less = np.array([0.5 * x * mean[k] ** 2 / y for x, y, (k, _) in zip(d, grown, other, strict=True)])
    less += 0.5 * np.log(grown) + np.log([t / best[k] for k, t in other])
    share = -less - np.logaddexp.reduce(np.append(-less, 0.0))
    at_best, further = np.ones(single.size), np.full(single.size, -np.inf)
    for (k, _), q, nats in zip(other, d / grown, share, strict=True):
        there = _not_taken_over(a, ca + q * across[k] ** 2, cb + q * across[k] * mean[k])
        gained = 0.5 * (_largest(*there) - _largest(ca, cb))
        near = (gained > NEGLIGIBLE) & (gained + nats > -NEGLIGIBLE)
        if near.any():
            more = _gains(there[0][near], there[1][near], centre[near])
            further[near] = np.logaddexp(further[near], nats + more)
            at_best[near] -= np.exp(nats)
    return np.logaddexp(single + np.log(at_best), further)


def _largest(ca: np.ndarray, cb: np.ndarray) -> np.ndarray:
    """What each column takes off chi-square at any size."""
    return cb**2 / np.maximum(ca, 1e-300)


def _gains(ca: np.ndarray, cb: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """log B (m,) of each column by itself."""
    ca = np.maximum(ca, 0.0)
    single = log_bayes_factors(ca, cb)
    fixed = centre != 0.0
    if fixed.any():  # what has its size from physics has its sign from it as well: no element leads its thermometer
        c, precision, shifted = centre[fixed], ca[fixed] + 1.0, cb[fixed]
        right = log_ndtr(np.sign(c) * (shifted + c) / np.sqrt(precision)) - log_ndtr(np.abs(c))
        single[fixed] = log_bayes_factors(precision - 1.0, shifted, c) + right
    return single


def chi_square_gains(a: np.ndarray, b: np.ndarray, chosen: Sequence[int], space: Space) -> np.ndarray:
    """By how much each column (m,) lowers the chi-square that the set `chosen` leaves, where all sizes are free.

        b^2 / a,   a = A_jj - A_js A_ss^-1 A_sj,   b likewise

    What has its size and sign from physics is not free in the set, and gains nothing with the other sign.
    """
    fixed = space.centre[list(chosen)] != 0.0
    ca, cb = _not_taken_over(a, *conditional(a, b, chosen, space.centre, np.where(fixed, 1.0, FREE)))
    return np.where(space.centre * cb < 0.0, 0.0, _largest(ca, cb))


def explanation(members: Sequence[int], gain: float, cost: float) -> Explanation:
    """A set that gains so many nats, where each of its effects has a `cost`."""
    height = gain - cost * len(members)
    return Explanation(tuple(members), gain, height, height)


def _not_taken_over(a: np.ndarray, ca: np.ndarray, cb: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same with 0 for columns that the set has taken over wholly: they cannot add anything."""
    known = ca > 1e-9 * np.maximum(np.diag(a), 1e-300)
    return np.where(known, ca, 0.0), np.where(known, cb, 0.0)


def search(a: np.ndarray, b: np.ndarray, space: Space, share: float, policy: Policy) -> list[Explanation]:
    """All sets that were looked at, most probable first, the null among them.

    No effect is exactly as in a textbook: one that could be what the first leaves over must gain `share` of its nats.
    That is one of the same sensor, or of none; each sensor has errors of its own.
    """
    cost = space.cost
    found: dict[frozenset[int], Explanation] = {frozenset(): NULL}
    level = [NULL]
    for depth in range(policy.most_effects):
        grown: dict[frozenset[int], Explanation] = {}
        for state in level:
            of_family, best = one_more(a, b, state.members, space)
            likeliest = (family for family in np.argsort(of_family)[::-1] if np.isfinite(of_family[family]))
            sets = ((family, (*state.members, int(best[family]))) for family in likeliest)
            for family, members in islice((one for one in sets if possible(a, b, one[1], space).all()), policy.beam):
                gain = state.log_bayes_factor + float(of_family[family])
                one = explanation(members, gain, cost)
                key = frozenset(members)
                if key not in grown or grown[key].log_posterior < one.log_posterior:
                    grown[key] = one
        level = sorted(grown.values(), key=lambda one: -one.log_posterior)[: policy.beam]
        found.update({key: one for key, one in grown.items() if key not in found})
        if not level or (depth == 0 and level[0].log_bayes_factor < policy.worth_sets):
            break
        before = max((one.log_posterior for one in found.values() if len(one.members) <= depth), default=0.0)
        if depth and level[0].log_posterior < before - 2.0 * cost:
            break  # two more effects at the cost of one is as far as it may go down before it goes up
    alone = log_bayes_factors(np.maximum(np.diag(a), 0.0), b)
    least = share * max((alone[one.members[0]] for one in found.values() if len(one.members) == 1), default=0.0)
    judged = [replace(one, judged=_judged(one, alone, least, space)) for one in found.values()]
    return sorted(judged, key=lambda one: -one.judged)


def possible(a: np.ndarray, b: np.ndarray, members: Sequence[int], space: Space) -> np.ndarray:
    """Whether each effect comes out with the sign that physics gives it, if any, and with a size that sensors have."""
    m = list(members)
    c = space.centre[m]
    if not c.any() and not np.isfinite(space.largest[m]).any():
        return np.ones(len(m), dtype=bool)
    mean, _ = posterior(a[np.ix_(m, m)], b[m], c, np.where(c == 0.0, SCALES[-1], 1.0))
    return (mean * c >= 0.0) & (np.abs(mean) <= space.largest[m])


def _judged(one: Explanation, alone: np.ndarray, least: float, space: Space) -> float:
    """log posterior, less what each has to bring that may be left over of the first, which gains most `alone`."""
    if not one.members:
        return one.log_posterior
    first = max(one.members, key=lambda k: alone[k])
    if space.exact[first]:
        return one.log_posterior
    of, further = space.sensor[first], space.sensor[[k for k in one.members if k != first]]
    return one.log_posterior - max(0.0, least) * sum(NO_SENSOR in (of, it) or it == of for it in further)
