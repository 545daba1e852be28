"""Evidence of models that are linear in what is unknown, from the whitened sums alone.

With e = X p + n, n ~ N(0, I), p ~ N(0, I) (a column carries the sigma of its prior in its scale):

    log Z = -(e'e - b'(I + A)^-1 b) / 2 - log|I + A| / 2 - log|S| / 2 - n log(2 pi) / 2

For one more column after the nuisances are integrated out, with a prior sigma s on its coefficient,

    log B = b^2 / (a + 1/s^2) / 2 - log(1 + s^2 a) / 2,   a = A_jj - A_jn (I + A_nn)^-1 A_nj,   b likewise,

and with a prior that is a mixture of several s the mean of B over them.

Sources: de Jong and Penzer 1998 (the reduced sums); Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.special import log_ndtr, softmax

if TYPE_CHECKING:
    from ins_eval.estimation.whitening import Whitened

SCALES = (0.3, 1.0, 4.0, 16.0, 64.0)  # of the nominal size; one Gaussian of nominal size loses large effects
# Effects up to which every combination of scales is summed over, 5^4 = 625 matrices; beyond, sweeps over the scales of
# one at a time. By reasoning.
PRODUCT, SWEEPS = 4, 4


def log_evidence(whitened: Whitened) -> float:
    """log Z of the model that has all columns, each with a standard normal prior."""
    factor = np.linalg.cholesky(np.eye(len(whitened.projection)) + whitened.normal)
    explained = solve_triangular(factor, whitened.projection, lower=True)
    return float(
        -0.5 * (whitened.square - explained @ explained)
        - np.log(np.diag(factor)).sum()
        - 0.5 * whitened.log_determinant
        - 0.5 * whitened.rows * np.log(2.0 * np.pi)
    )


def log_evidence_of(whitened: Whitened, chosen: slice) -> float:
    """log Z of the model that has only the `chosen` columns."""
    return log_evidence(
        replace(whitened, normal=whitened.normal[chosen, chosen], projection=whitened.projection[chosen])
    )


@dataclass(frozen=True, eq=False)
class Reduced:
    """What is left of A and b for the columns of interest once the nuisances are integrated out."""

    normal: np.ndarray
    projection: np.ndarray

    @property
    def score(self) -> np.ndarray:
        """b / sqrt(a): standard normal under the null, one for each column; 0 where the data know nothing of it."""
        a = np.diag(self.normal)
        return np.where(a > 1e-12, self.projection / np.sqrt(np.maximum(a, 1e-12)), 0.0)


def reduce(whitened: Whitened, nuisances: int) -> Reduced:
    """Integrate out the first `nuisances` columns, each with a standard normal prior."""
    a, b, n = whitened.normal, whitened.projection, nuisances
    factor = cho_factor(np.eye(n) + a[:n, :n])
    across = cho_solve(factor, a[:n, n:])
    normal = a[n:, n:] - a[n:, :n] @ across
    return Reduced(0.5 * (normal + normal.T), b[n:] - across.T @ b[:n])


class Gained(NamedTuple):
    """What columns gain in nats by their reduced sums, and the first and second moment of their coefficients.

    `best` is the prior of a mixture that gains most.
    """

    nats: float
    mean: np.ndarray
    second: np.ndarray
    best: int = 0


Gain = Callable[[np.ndarray, np.ndarray], Gained]


def mixture(a: np.ndarray, b: np.ndarray, roots: Sequence[np.ndarray]) -> Gained:
    """log B of columns with the prior N(0, LL'), the mean over the `roots` L."""
    nats, means, seconds = [], [], []
    for root in roots:
        factor = cho_factor(np.eye(b.size) + root.T @ a @ root, lower=True)
        covariance = root @ cho_solve(factor, root.T)
        mean = covariance @ b
        nats.append(0.5 * b @ mean - np.log(np.diag(factor[0])).sum())
        means.append(mean)
        seconds.append(covariance + np.outer(mean, mean))
    share = softmax(nats)
    total = float(np.logaddexp.reduce(nats) - np.log(len(nats)))
    return Gained(total, share @ np.array(means), np.tensordot(share, seconds, 1), int(np.argmax(nats)))


def free(a: np.ndarray, b: np.ndarray) -> Gained:
    """Half of what one column of any size takes off the chi-square."""
    mean = b / np.maximum(a[0], 1e-12)
    return Gained(0.5 * float(b @ mean), mean, np.outer(mean, mean))


def log_evidence_with(whitened: Whitened, known: int, gain: Gain) -> float:
    """log Z of the first `known` columns with a standard normal prior, and what the others gain."""
    left = reduce(whitened, known)
    return log_evidence_of(whitened, slice(0, known)) + gain(left.normal, left.projection).nats


def sensitivity(whitened: Whitened, known: int | None = None, gain: Gain | None = None) -> tuple[float, np.ndarray]:
    """`log_evidence`, or that of the `known` columns with a `gain`, and how it changes with the sums.

    These are those of residual and columns, S = [e X]'[e X]; with v = (1, -p) of the mean coefficients p of n known
    columns, their covariance C and, for what is left of further columns, Q = (0, -A_kn C, I),

        dL/dS = -(vv' + C) / 2 - Q' E[cc'] Q / 2 + (Q' E[c] v' + v E[c]' Q) / 2
    """
    count = len(whitened.projection)
    n = count if known is None else known
    covariance = cho_solve(cho_factor(np.eye(n) + whitened.normal[:n, :n]), np.eye(n))
    v = np.zeros(1 + count)
    v[0], v[1 : 1 + n] = 1.0, -covariance @ whitened.projection[:n]
    by_sums = -0.5 * np.outer(v, v)
    by_sums[1 : 1 + n, 1 : 1 + n] -= 0.5 * covariance
    if gain is None:
        return log_evidence(whitened), by_sums
    left = reduce(whitened, n)
    gained = gain(left.normal, left.projection)
    q = np.zeros((count - n, 1 + count))
    q[:, 1 : 1 + n], q[:, 1 + n :] = -whitened.normal[n:, :n] @ covariance, np.eye(count - n)
    across = np.outer(gained.mean @ q, v)
    by_sums += 0.5 * (across + across.T - q.T @ gained.second @ q)
    return log_evidence_of(whitened, slice(0, n)) + gained.nats, by_sums


def log_bayes_factors(
    a: np.ndarray, b: np.ndarray, centre: np.ndarray | float = 0.0, largest: np.ndarray | None = None
) -> np.ndarray:
    """log B of columns that carry their nominal size in their scale, one by one, prior a mixture over `SCALES`.

    `a` and `b` (m,) are the reduced sums; a `centre` other than 0 is a sharp prior around that coefficient. Every prior
    ends at the `largest` coefficients (m,), if given: the shares of posterior and prior within them are then

        log B = log B' + log P(|c| <= largest | data) - log P(|c| <= largest)
    """
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    one = []
    for scale in SCALES if np.ndim(centre) == 0 and centre == 0.0 else (1.0,):
        variance = scale**2
        shifted = b - a * centre
        nats = (
            0.5 * shifted**2 * variance / (1.0 + variance * a)
            - 0.5 * np.log1p(variance * a)
            + centre * b
            - 0.5 * a * centre**2
        )
        if largest is not None:
            left = variance / (1.0 + variance * a)
            nats += _log_within(centre + left * shifted, np.sqrt(left), largest)
            nats -= _log_within(centre, scale, largest)
        one.append(nats)
    return np.logaddexp.reduce(one, axis=0) - np.log(len(one))


def _log_within(mean: np.ndarray | float, sigma: np.ndarray | float, largest: np.ndarray) -> np.ndarray:
    """log P(|c| <= largest) of normal c, also far in a tail."""
    high, low = (log_ndtr((end - np.abs(mean)) / sigma) for end in (largest, -largest))
    return high + np.log1p(-np.exp(low - high))


def expected_log_evidence(
    normal: np.ndarray, truth: Mapping[int, float], model: Sequence[int], centre: np.ndarray
) -> float:
    """Expected log Z of the columns `model`, coefficients `truth` by column, as `answer.experiments` derives it.

    `normal` (m, m) is the reduced A of all columns, `centre` (m,) the coefficients that physics fixes, else 0. Of more
    than `PRODUCT` columns the scales of one at a time are summed over, those of the others at their best.
    """
    m = list(model)
    if not m:
        return 0.0
    a = normal[np.ix_(m, m)]
    v = np.zeros(len(normal))
    v[list(truth)] = list(truth.values())
    mean, c = normal[m] @ v, centre[m]
    left = mean - a @ c

    def at(scales: np.ndarray) -> np.ndarray:
        spread = np.eye(len(m)) + scales[:, :, None] * a * scales[:, None, :]
        second = scales[:, :, None] * (np.outer(left, left) + a) * scales[:, None, :]
        gain = 0.5 * np.trace(np.linalg.solve(spread, second), axis1=1, axis2=2)
        return c @ mean - 0.5 * c @ a @ c + gain - 0.5 * np.linalg.slogdet(spread)[1]

    choices = [SCALES if x == 0.0 else (1.0,) for x in c]
    if len(m) <= PRODUCT:
        return _mean(at(np.array(list(product(*choices)))))
    best = np.array([one[len(one) // 2] for one in choices])
    for _ in range(SWEEPS):
        means = []
        for k, one in enumerate(choices):
            scales = np.tile(best, (len(one), 1))
            scales[:, k] = one
            each = at(scales)
            best = scales[int(np.argmax(each))]
            means.append(_mean(each) - float(each.max()))
    return float(at(best[None])[0]) + sum(means)


def _mean(nats: np.ndarray) -> float:
    """Logarithm of the mean of what has these logarithms."""
    return float(np.logaddexp.reduce(nats) - np.log(len(nats)))
