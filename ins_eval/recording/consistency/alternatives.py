"""Alternatives to what a recording was read as, and the odds of each.

An alternative is another order, sign or unit of the channels of one stream. A relation says what a channel should
show, y_i, by what another stream shows; the residual of channel j read with factor s is r = y_i - s x_j. Its scale
sigma_i is robust (median absolute residual of the best j and s), and

    log L_i(j, s) = -(nu + 1) / 2  sum_k log(1 + r_k^2 / (nu sigma_i^2))  m / n,

Student's distribution with nu = 4, m the effective number of n residuals at their lag-one correlation. The odds of
two alternatives are exp of the difference of log L, summed over the channels, and of their log prior.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

BEYOND_DOUBT = float(np.log(1e6))  # log odds: refused
LIKELY = float(np.log(20.0))  # warned of
COUNTED = float(np.log(1e12))  # odds beyond which none are told
NU = 4.0
EXPLAINED = 0.85  # a channel is used only where the best residual is below this share of what it should show
SIZE_FACTOR = 1.35  # between what is read and what should be shown; the units tried differ by more
SMALLEST = 1e-12  # of anything that a channel shows, m or rad/s: below it there is nothing
NO_OFFSET = np.zeros(3)
FEWEST = 8  # residuals of a channel that are worth judging
AXIS_PRIOR, UNIT_PRIOR = -1.0, -2.0  # log prior of each mistake of `MISTAKES` and of each unit that is not as read
LARGEST_CORRELATION = 0.98
CORE = 0.98  # of the residuals; larger ones count as the largest of these

# All 48 orders and signs of a triad: source of each axis (48, 3), its sign, and the matrix, ours = matrix @ read.
_ALL = [(order, sign) for order in itertools.permutations(range(3)) for sign in itertools.product((1, -1), repeat=3)]
SOURCE = np.array([order for order, _ in _ALL])
SIGN = np.array([sign for _, sign in _ALL])
MATRICES = SIGN[:, :, None] * np.eye(3)[SOURCE]


def mistakes(matrices: np.ndarray) -> np.ndarray:
    """The fewest mistakes, of one sign or of two axes exchanged, that make orders and signs (..., 3, 3).

    Each is a reflection, and the fewest of these that make M are rank(M - 1): Carter 1972, Conjugacy classes in the
    Weyl group, lemma 2.
    """
    return np.linalg.matrix_rank(matrices - np.eye(3))


MISTAKES = mistakes(MATRICES)  # (48,); the first order is as read


@dataclass(frozen=True)
class Finding:
    """A contradiction and the alternative that ends it.

    `key` is what a user assumes to mend it or to insist; `mend` says in words what to correct; `factor` is the right
    scale over the one read and `matrix` (3, 3) turns what was read to what is right. Infinite odds: impossible.
    `orders` are such matrices of accelerometers and of gyros, likeliest first; `jump` the instant of a jump of stamps,
    s, its size and one sigma of that, s; `late` by how much more than is believed stamps are, s, and one sigma of it;
    `turned` by how much the way leads to the right of the velocities, rad, and one sigma of it; `rows` are those of
    single values.
    """

    key: str
    seen: str  # one clause: what was seen, expected and suspected
    mend: str
    log_odds: float = np.inf
    value: str | None = None  # of the key, where it does not depend on what was assumed before
    factor: float = 1.0
    matrix: np.ndarray | None = None
    orders: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    jump: tuple[float, float, float] | None = None
    late: tuple[float, float] | None = None
    turned: tuple[float, float] | None = None
    rows: tuple[int, ...] = ()

    @property
    def decided(self) -> bool:
        return self.log_odds >= LIKELY

    @property
    def odds(self) -> str:
        return "beyond 1e12 to 1" if self.log_odds > COUNTED else f"{np.exp(self.log_odds):.2g} to 1"


def channel_scores(
    expected: np.ndarray,
    observed: np.ndarray,
    factors: np.ndarray,
    floor: np.ndarray,
    offset: np.ndarray = NO_OFFSET,
    explained: float = EXPLAINED,
) -> np.ndarray:
    """log L (a, 3, 3, 2, s) of channel i read from column j with either sign and each of s factors.

    `expected` and `observed` are (a, n, 3) under each of a further alternatives, `floor` (3,) the smallest sigma, and
    `offset` (3,) that of the constant that a channel may have, at its best under each alternative. Zero throughout
    where a channel tells nothing: too few finite rows, or no alternative leaves less than the share `explained`.
    """
    signed = np.stack([factors, -factors])
    scores = np.zeros((len(expected), 3, 3, 2, len(factors)))
    finite = np.isfinite(observed).all(axis=(0, 2))
    for i in range(3):
        rows = finite & np.isfinite(expected[:, :, i]).all(axis=0)
        if rows.sum() < FEWEST:
            continue
        wanted = expected[:, rows, i][:, None, None, None, :]
        columns = observed[:, rows].transpose(0, 2, 1)[:, :, None, None, :]
        residual = wanted - signed[None, None, :, :, None] * columns  # (a, 3, 2, s, n)
        constant = _constant(residual, offset[i])
        residual = residual - constant
        # relative to what the channel should show, so that no alternative wins by making everything small
        shown = np.maximum(_core_size(wanted)[..., None], SMALLEST)  # (a, 1, 1, 1, 1)
        residual = residual / shown
        size = _core_size(residual)
        size = np.where(shown[..., 0] < floor[i], np.inf, size)  # too little to be told from noise
        best = np.unravel_index(np.argmin(np.round(size, 6)), size.shape)  # the first of equals
        sized = _of_that_size((wanted[best[0]] - constant[best]).ravel(), residual[best] * shown[best[0]].item())
        if not size[best] < explained or not sized:
            continue
        least = float(floor[i]) / float(shown[best[0]].item())
        sigma = max(float(size[best]), least)
        counted = effective_share(residual[best])
        scores[:, i] = -0.5 * (NU + 1.0) * counted * np.log1p(residual**2 / (NU * sigma**2)).sum(axis=-1)
        if offset[i] > 0.0:
            scores[:, i] -= 0.5 * (constant[..., 0] / offset[i]) ** 2
    return scores


def _constant(residual: np.ndarray, sigma: float) -> np.ndarray:
    """The likeliest constant in residuals (..., n), with a prior of zero mean and `sigma`."""
    if sigma == 0.0:
        return np.zeros((*residual.shape[:-1], 1))
    level = np.median(residual, axis=-1, keepdims=True)
    spread = np.median(np.abs(residual - level), axis=-1, keepdims=True)
    return level * sigma**2 / (sigma**2 + spread**2 / residual.shape[-1])


def _core_size(values: np.ndarray) -> np.ndarray:
    """Root mean square over the last axis, without single outliers."""
    limit = np.quantile(np.abs(values), CORE, axis=-1, keepdims=True)
    return np.sqrt(np.mean(np.minimum(values**2, limit**2), axis=-1))


def _of_that_size(wanted: np.ndarray, residual: np.ndarray) -> bool:
    """Whether the best reading has the size that it should have, so that no unit is named that only comes nearest."""
    read = wanted - residual
    power = float(read @ read)
    return power > 0.0 and 1.0 / SIZE_FACTOR < float(wanted @ read) / power < SIZE_FACTOR


def order_scores(scores: np.ndarray) -> np.ndarray:
    """log L (a, 48, s) of every order and sign of the triad with each factor, from those of its channels."""
    return sum(scores[:, i, SOURCE[:, i], (SIGN[:, i] < 0).astype(int)] for i in range(3))


def prior(factors: np.ndarray) -> np.ndarray:
    """Log prior (48, s): what was read is likelier than any one mistake."""
    return AXIS_PRIOR * MISTAKES[:, None] + UNIT_PRIOR * (factors != 1.0)[None, :]


def effective_share(residual: np.ndarray) -> float:
    """(1 - rho) / (1 + rho), the share of residuals that count as independent at lag-one correlation rho."""
    deviation = np.clip(residual, *np.quantile(residual, [0.02, 0.98]))
    power = float(deviation @ deviation)
    rho = float(deviation[1:] @ deviation[:-1]) / power if power > 0.0 else 0.0
    rho = float(np.clip(rho, 0.0, LARGEST_CORRELATION))
    return (1.0 - rho) / (1.0 + rho)


def undecided_axes(orders: np.ndarray) -> list[int]:
    """Axes of a triad that some of these orders (indices) take from another column or with the other sign."""
    differs = (MATRICES[orders] != np.eye(3)).any(axis=(0, 2)) if len(orders) else np.zeros(3, dtype=bool)
    return np.flatnonzero(differs).tolist()


def undecided(about: str, parts: list[str]) -> list[Finding]:
    """What the motion does not determine, as the last of the findings; nothing where it determines all."""
    return [Finding("undecided", f"{about} does not determine {', '.join(parts)}", "", 0.0)] if parts else []


def equations(matrix: np.ndarray) -> str:
    """An order and signs in words: ``x=y,y=x,z=-z``, ours from those read."""
    parts = []
    for axis, row in zip("xyz", matrix, strict=True):
        source = int(np.argmax(np.abs(row)))
        parts.append(f"{axis}={'-' if row[source] < 0 else ''}{'xyz'[source]}")
    return ",".join(parts)
