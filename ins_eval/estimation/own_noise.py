"""What another effect in the place of one that was found gains at a noise of its own.

The noise is fitted beside the best set; there, whatever is not quite the same fits worse than it need to: a wander that
is a little louder would take up the difference. So the noise is fitted anew beside each effect that could be near. With
the coefficients c of the effects around c0 = -point, what was taken off the recordings, and variances s^2,

    log B = b'c0 - c0'A c0 / 2 + d'(A + S^-1)^-1 d / 2 - log|I + A S| / 2,   d = b - A c0,   S = diag(s^2),

which is the gain that the fit adds to the log evidence of what is uncertain anyway.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.estimation.evidence import Gained, mixture
from ins_eval.estimation.linearisation import log_evidence_of_best
from ins_eval.estimation.search import one_more

if TYPE_CHECKING:
    from ins_eval.estimation.linearisation import Linearisation
    from ins_eval.estimation.noise_fit import Fitted
    from ins_eval.policy import Policy

# nats within which another lies at the noise of the belief, which nothing has made quiet: what lies farther is no rival
# at its own noise either; and the most beside which the noise is fitted anew; both by reasoning
NEAR, MOST = 6.0, 6


def with_own_noise(linearisation: Linearisation, around_belief: Linearisation, policy: Policy) -> Linearisation:
    """The same, knowing what those that could be near in the place of each member gain at a noise of their own."""
    own_noise = {}
    here = log_evidence_of_best(linearisation) - linearisation.gain(linearisation.best.members)
    for k in linearisation.best.members:
        beside = frozenset(j for j in linearisation.best.members if j != k)
        for family, j in _near(linearisation, k, around_belief, policy):
            other = linearisation.exchanged(k, j)
            there = log_evidence_of_best(replace(other, fitted=_fitted(other))) - other.gain(other.best.members)
            own_noise[beside, family] = max(there - here, 0.0)
    return replace(linearisation, own_noise=own_noise)


def _near(linearisation: Linearisation, k: int, around_belief: Linearisation, policy: Policy) -> list[tuple[int, int]]:
    """Families in the place of member `k` that are no rivals yet and could be, likeliest first, with their members."""
    of_family, members = linearisation.places(k)
    own = int(linearisation.space.families[k])
    below = of_family[own] - of_family
    believed = _below_around_belief(linearisation, k, around_belief)
    near = (believed < NEAR) & np.isfinite(below) & (below >= policy.near)
    near[own] = False
    ranked = sorted(np.flatnonzero(near), key=lambda family: believed[family])
    return [(int(family), int(members[family])) for family in ranked[:MOST]]


def _below_around_belief(linearisation: Linearisation, k: int, around_belief: Linearisation) -> np.ndarray:
    """By how many nats each family (families,) lies below that of member `k` around the belief; inf where it is not."""
    beside = {linearisation.hypotheses[j].key for j in linearisation.best.members if j != k}
    theirs = around_belief.hypotheses
    others = [j for j in around_belief.best.members if theirs[j].key in beside]
    of_family, _ = one_more(around_belief.here.normal, around_belief.here.projection, others, around_belief.space)
    gains = {one.key: float(of_family[f]) for one, f in zip(theirs, around_belief.space.families, strict=True)}
    own = gains.get(linearisation.hypotheses[k].key, np.inf)
    out = np.full(int(linearisation.space.families.max()) + 1, np.inf)
    for one, family in zip(linearisation.hypotheses, linearisation.space.families, strict=True):
        out[family] = own - gains.get(one.key, -np.inf)
    return np.where(np.isnan(out), np.inf, out)


def _fitted(one: Linearisation) -> tuple[Fitted, ...]:
    """The noise of each recording beside the best set, with all else that was taken off put back."""
    members, m = one.best.members, [*one.best.members, *one.taken_beside]
    mean, _ = one.coefficients
    spread = np.zeros(len(m))
    spread[: len(members)] = np.maximum(1.0, np.abs(mean))
    fitted = []
    for r, case in enumerate(one.cases):
        own = [i for i, k in enumerate(m) if one.hypotheses[k].columns[r] is not None]
        centre, s = -one.point[[m[i] for i in own]], spread[own]
        columns = [one.hypotheses[m[i]].columns[r] for i in own]

        def gain(a: np.ndarray, b: np.ndarray, centre: np.ndarray = centre, s: np.ndarray = s) -> Gained:
            return _around(a, b, centre, s)

        fitted.append(case.fitted(columns, one.fitted[r], gain) if own else one.fitted[r])
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
