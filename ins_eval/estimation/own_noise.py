"""What another effect in the place of one that was found gains at a noise of its own.

The noise is fitted beside the best set; there, whatever is not quite the same fits worse than it need to: a wander that
is a little louder would take up the difference. So the noise is fitted anew beside each effect that could be near. That
of an effect that explains a part lies between the noise beside the best set and that beside the rest of it; what is far
behind at both is no rival at its own. With the coefficients c of the effects around c0 = -point, what was taken off the
recordings, and variances s^2,

    log B = b'c0 - c0'A c0 / 2 + d'(A + S^-1)^-1 d / 2 - log|I + A S| / 2,   d = b - A c0,   S = diag(s^2),

which is the gain that the fit adds to the log evidence of what is uncertain anyway.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.estimation.evidence import Gained, mixture
from ins_eval.estimation.linearisation import OwnNoise, log_evidence_of_best
from ins_eval.estimation.search import chi_square_gains, log_bayes_factor, one_more
from ins_eval.estimation.study import space, sums

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ins_eval.estimation.linearisation import Linearisation
    from ins_eval.estimation.noise_fit import Fitted
    from ins_eval.policy import Policy

# Nats below the best set, at the noise beside it and at that beside the rest of it, up to which another could be near
# at its own, which added at most 9 to the better of the two in development; and the most beside which the noise is
# fitted anew, by reasoning.
FAR, MOST = 15.0, 6
# More of chi-square, up to which another is asked for at each such noise: twice the 47 of 53 that one took up of an
# offset beside a branch of the magnet, the most of four cases of sealed sets that were looked at. It decides what is
# computed, `Policy.twin` what is listed.
ALIKE = 100.0


def with_own_noise(linearisation: Linearisation, policy: Policy) -> Linearisation:
    """The same, knowing what those that could be near in the place of each member gain at a noise of their own."""
    own_noise = {}
    here = log_evidence_of_best(linearisation)
    at_its_noise = here - linearisation.gain(linearisation.best.members)
    for k in linearisation.best.members:
        beside = frozenset(j for j in linearisation.best.members if j != k)
        alike = _alike(linearisation, k)
        for family, j, start in _near(linearisation, k, here, policy):
            other = replace(linearisation.exchanged(k, j), fitted=start)
            fitted = _fitted(other, (k, j))
            there = log_evidence_of_best(replace(other, fitted=fitted)) - other.gain(other.best.members)
            more = there - at_its_noise - _beside(linearisation, j, fitted)
            if more > 0.0:
                own_noise[beside, family] = OwnNoise(more, fitted, _taken(linearisation, k, alike, fitted, policy))
    return replace(linearisation, own_noise=own_noise)


def _beside(linearisation: Linearisation, j: int, fitted: Sequence[Fitted]) -> float:
    """What hypothesis `j` gains beside the whole best set at a noise: that it would in no effect's place."""
    m = [*linearisation.best.members, j, *linearisation.taken_beside]
    model, points = [linearisation.hypotheses[i] for i in m], [noise.noise_point for noise in fitted]
    here = sums(linearisation.cases, points, model, linearisation.point[m])
    own = len(linearisation.best.members)
    centre = linearisation.space.centre[m]
    gains = [log_bayes_factor(here.normal[:n, :n], here.projection[:n], centre[:n])[0] for n in (own, own + 1)]
    return max(gains[1] - gains[0], 0.0)


def _alike(linearisation: Linearisation, k: int) -> dict[int, int]:
    """Families that lower chi-square in the place of member `k` within `ALIKE` of what it does, at the noise here.

    Each with the hypothesis that does so most, at any size, and that of `k` with itself.
    """
    beside, families = [j for j in linearisation.best.members if j != k], linearisation.space.families
    gains = chi_square_gains(linearisation.here.normal, linearisation.here.projection, beside, linearisation.space)
    near = [int(j) for j in np.argsort(gains) if gains[j] > gains[k] - ALIKE and j not in beside]
    return {int(families[j]): j for j in near} | {int(families[k]): k}


def _taken(
    linearisation: Linearisation, k: int, alike: Mapping[int, int], fitted: Sequence[Fitted], policy: Policy
) -> dict[int, float]:
    """By how much each of those `alike` in the place of member `k` lowers chi-square at a noise, at any size."""
    beside = [j for j in linearisation.best.members if j != k]
    m = list(dict.fromkeys([*beside, *alike.values(), *linearisation.taken_beside]))
    model = [linearisation.hypotheses[j] for j in m]
    there = sums(linearisation.cases, [noise.noise_point for noise in fitted], model, linearisation.point[m])
    others = list(range(len(beside)))
    taken = chi_square_gains(there.normal, there.projection, others, space(model, policy))
    return {family: float(taken[m.index(j)]) for family, j in alike.items()}


def _near(
    linearisation: Linearisation, k: int, here: float, policy: Policy
) -> list[tuple[int, int, tuple[Fitted, ...]]]:
    """Families in the place of member `k` that are no rivals yet and could be, likeliest first.

    Each with its member and the noise from which its own is sought; `here` is the log evidence of the best set.
    """
    of_family, members = linearisation.places(k)
    below = of_family[int(linearisation.space.families[k])] - of_family
    farther = np.flatnonzero(np.isfinite(below) & (below >= policy.near))
    if not farther.size:
        return []
    rest = linearisation.without({k})
    fitted = _fitted(rest, (k,))
    there = here - _log_evidences(rest, fitted, members[farther], policy)
    nearest = np.minimum(below[farther], there)
    return [
        (int(farther[i]), int(members[farther[i]]), fitted if there[i] < below[farther[i]] else linearisation.fitted)
        for i in np.argsort(nearest, kind="stable")[:MOST]
        if nearest[i] < FAR
    ]


def _log_evidences(one: Linearisation, fitted: Sequence[Fitted], more: np.ndarray, policy: Policy) -> np.ndarray:
    """log evidence (n,) of the best set with each of the hypotheses `more` (n,) beside it, at a noise."""
    own = one.best.members
    m = list(dict.fromkeys([*own, *more.tolist(), *one.taken_beside]))
    hypotheses = [one.hypotheses[k] for k in m]
    here = sums(one.cases, [noise.noise_point for noise in fitted], hypotheses, one.point[m])
    there = space(hypotheses, policy)
    inside = list(range(len(own)))
    gain, _ = log_bayes_factor(here.normal[np.ix_(inside, inside)], here.projection[inside], there.centre[inside])
    of_family, _ = one_more(here.normal, here.projection, inside, there)
    return here.log_null + gain + of_family[there.families[[m.index(j) for j in more.tolist()]]]


def _fitted(one: Linearisation, changed: Sequence[int]) -> tuple[Fitted, ...]:
    """The noise of each recording beside the best set, with all else that was taken off put back.

    Where none of the hypotheses that were `changed` acts it stays.
    """
    members, m = one.best.members, [*one.best.members, *one.taken_beside]
    spread = np.zeros(len(m))
    if members:
        mean, _ = one.coefficients
        spread[: len(members)] = np.maximum(1.0, np.abs(mean))
    fitted = []
    for r, case in enumerate(one.cases):
        if all(one.hypotheses[k].columns[r] is None for k in changed):
            fitted.append(one.fitted[r])
            continue
        own = [i for i, k in enumerate(m) if one.hypotheses[k].columns[r] is not None]
        centre, s = -one.point[[m[i] for i in own]], spread[own]
        columns = [one.hypotheses[m[i]].columns[r] for i in own]

        def gain(a: np.ndarray, b: np.ndarray, centre: np.ndarray = centre, s: np.ndarray = s) -> Gained:
            return _around(a, b, centre, s)

        fitted.append(case.fitted(columns, one.fitted[r], gain if own else None))
    return tuple(fitted)


def _around(a: np.ndarray, b: np.ndarray, centre: np.ndarray, sigma: np.ndarray) -> Gained:
    """log B of columns whose coefficients have the prior N(centre, diag(sigma^2)), and their moments."""
    apart = mixture(a, b - a @ centre, [np.diag(sigma)])
    across = np.outer(centre, apart.mean)
    return Gained(
        float(b @ centre - 0.5 * centre @ a @ centre) + apart.nats,
        centre + apart.mean,
        apart.second + across + across.T + np.outer(centre, centre),
    )
