"""Does the fit improve on data that were not used? The belief, the belief with its effects, and a placebo.

The recording is cut into blocks, every other of which is used for the fit, then the others. What is uncertain anyway
and the effects are fitted on the one half, with covariance P, and the other is predicted:

    e = y - X p,   S = I + X P X',   mean squared normalised innovation  e' S^-1 e / n,
    log predictive density  -(e' S^-1 e + log|S| + n log(2 pi)) / 2

so that what the one half does not tell, as the start that lies in the other, counts for what it is. All three have the
same noise. The placebo has as many coefficients as the effects: their own responses, half a recording late.

Source: Gelman and others, Bayesian Data Analysis, 3rd ed., section 7.1 (log predictive density).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.study import Hypothesis

MEASURE = "mean squared normalised innovation on blocks that were not used, one noise model for all three"
BLOCK_S = 600.0
FEWEST_BLOCKS = 8
WIDE = 1e-3  # reciprocal prior sigma of an effect's coefficient: the data alone place it


def held_out(
    cases: Sequence[Case],
    model: Sequence[Hypothesis],
    point: np.ndarray,
    noise_points: Sequence[np.ndarray],
    count: int | None = None,
) -> dict[str, float | str]:
    """`before`, `after` and `placebo` over all recordings; `point` (k,) what was taken off the recordings.

    Only the first `count` of `model` are judged, all without it; the others are what was taken off besides.
    `harm_nats` is by how much the effects lower the log predictive density, `placebo_nats` by how much the placebo
    leads them in it.
    """
    squares, densities, rows = np.zeros(3), np.zeros(3), 0
    for r, (case, noise_point) in enumerate(zip(cases, noise_points, strict=True)):
        own = [k for k, one in enumerate(model) if one.columns[r] is not None]
        judged = np.array([count is None or k < count for k in own], dtype=bool)
        found = _of_recording(case, [model[k].columns[r] for k in own], point[own], judged, noise_point)
        squares, densities, rows = squares + found[0], densities + found[1], rows + found[2]
    before, after, placebo = (float(x) for x in squares / max(rows, 1))
    return {
        "before": before,
        "after": after,
        "placebo": placebo,
        "harm_nats": float(densities[0] - densities[1]),
        "placebo_nats": float(densities[2] - densities[1]),
        "measure": MEASURE,
    }


def _of_recording(
    case: Case, columns: list, point: np.ndarray, judged: np.ndarray, noise_point: np.ndarray
) -> tuple[np.ndarray, np.ndarray, int]:
    known = len(case.nuisances)
    whitened = case.whitened(columns, noise_point, keep=1 + known + len(columns))
    kept = whitened.kept  # (nodes, 9, 1 + nuisances + effects)
    anyway, effects = kept[..., 1 : 1 + known], kept[..., 1 + known :]
    residual = kept[..., 0] + effects @ point
    effects = effects[..., judged]
    late = np.roll(np.nan_to_num(effects), kept.shape[0] // 2, axis=0)
    nodes_s = case.model.nodes_s
    whole_s = float(nodes_s[-1] - nodes_s[0])
    block_s = min(BLOCK_S, whole_s / FEWEST_BLOCKS)
    odd = ((nodes_s - nodes_s[0]) // block_s).astype(int) % 2 == 1
    seen = np.isfinite(residual)
    found = [_crossed(residual, further, anyway, seen, odd) for further in (effects[..., :0], effects, late)]
    squares, densities = np.transpose(found)
    return squares, densities, int(seen.sum())


def _crossed(residual, further, anyway, seen, odd) -> tuple[float, float]:
    """e' S^-1 e of both halves, each predicted by the other, and their log predictive density but for constants."""
    design = np.concatenate([anyway, further], axis=2)
    prior = np.append(np.ones(anyway.shape[2]), np.full(further.shape[2], WIDE**2))
    square = density = 0.0
    for half in (odd, ~odd):
        fit, judge = seen & half[:, None], seen & ~half[:, None]
        x, y = design[fit], residual[fit]
        precision = x.T @ x + np.diag(prior)  # P^-1
        x, e = design[judge], residual[judge] - design[judge] @ np.linalg.solve(precision, x.T @ y)
        both = precision + x.T @ x
        across = x.T @ e
        of_half = float(e @ e - across @ np.linalg.solve(both, across))
        spread = np.linalg.slogdet(both)[1] - np.linalg.slogdet(precision)[1]
        square, density = square + of_half, density - 0.5 * (of_half + spread)
    return square, density
