"""Does the fit improve on data that were not used? The belief, the belief with its effects, and a placebo.

The recording is cut into blocks, every other of which is used for the fit, then the others. What is uncertain anyway
and the effects are fitted on the one half and the mean squared normalised innovation is taken on the other; all three
have the same noise. The placebo has as many coefficients as the effects: their own responses, half a recording late.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ins_eval.diagnosis.case import Case
from ins_eval.diagnosis.study import Hypothesis

MEASURE = "mean squared normalised innovation on blocks that were not used, one noise model for all three"
BLOCK_S = 600.0
FEWEST_BLOCKS = 8


def held_out(
    cases: Sequence[Case], model: Sequence[Hypothesis], point: np.ndarray, positions: Sequence[np.ndarray]
) -> dict[str, float | str]:
    """`before`, `after` and `placebo` over all recordings; `point` (k,) what was taken off the recordings.

    `harm_nats` is what the effects lose on data that were not used, half the number of rows times after less before.
    """
    sums, rows = np.zeros(3), 0
    for r, (case, position) in enumerate(zip(cases, positions, strict=True)):
        own = [k for k, one in enumerate(model) if one.columns[r] is not None]
        found, count = _of_recording(case, [model[k].columns[r] for k in own], point[own], position)
        sums, rows = sums + found, rows + count
    before, after, placebo = (float(x) for x in sums / max(rows, 1))
    return {
        "before": before,
        "after": after,
        "placebo": placebo,
        "harm_nats": 0.5 * rows * (after - before),
        "measure": MEASURE,
    }


def _of_recording(case: Case, columns: list, point: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, int]:
    known = len(case.nuisances)
    whitened = case.whitened(columns, position, keep=1 + known + len(columns))
    kept = whitened.kept  # (nodes, 9, 1 + nuisances + effects)
    anyway, effects = kept[..., 1 : 1 + known], kept[..., 1 + known :]
    residual = kept[..., 0] + effects @ point
    late = np.roll(np.nan_to_num(effects), kept.shape[0] // 2, axis=0)
    nodes_s = case.model.nodes_s
    whole_s = float(nodes_s[-1] - nodes_s[0])
    block_s = min(BLOCK_S, whole_s / FEWEST_BLOCKS)
    odd = ((nodes_s - nodes_s[0]) // block_s).astype(int) % 2 == 1
    seen = np.isfinite(residual)
    return np.array([
        _crossed(residual, further, anyway, seen, odd) for further in (effects[..., :0], effects, late)
    ]), int(seen.sum())  # fmt: skip


def _crossed(residual, further, anyway, seen, odd) -> float:
    """Sum of squares on each half after a fit on the other."""
    design = np.concatenate([anyway, further], axis=2)
    prior = np.append(np.ones(anyway.shape[2]), np.full(further.shape[2], 1e-6))
    total = 0.0
    for half in (odd, ~odd):
        fit, judge = seen & half[:, None], seen & ~half[:, None]
        x, y = design[fit], residual[fit]
        p = np.linalg.solve(x.T @ x + np.diag(prior), x.T @ y)
        total += float(np.sum((residual[judge] - design[judge] @ p) ** 2))
    return total
