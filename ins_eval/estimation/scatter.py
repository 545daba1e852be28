"""How far coefficients scatter from stretch to stretch of a recording, where a model of the noise is a coarse one.

Such a model tells how sure coefficients p are if it holds. Vibration, turns and receivers that filter do not keep to
one, and a delay that changes with the manoeuvre is no constant. The sums over stretches s of a recording,

    g_s = sum over s of z_t (e_t - z_t (p - p0)),   cov(p) = C (sum of g_s g_s') C S / (S - 1)

with whitened rows z of the effects and e of the residual, what is uncertain anyway taken off both, around the p0 with
which it was navigated, tell their covariance whatever the noise is; C is that by the model.

Source: Liang and Zeger, Biometrika 73 (1986) 13 (the sandwich over clusters).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from ins_eval.recording import PARKED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ins_eval.estimation.case import Case
    from ins_eval.estimation.study import Hypothesis

STRETCHES = 20  # of a recording: a sigma from them is known to a sixth


def scattered(
    cases: Sequence[Case],
    model: Sequence[Hypothesis],
    noise_points: Sequence[np.ndarray],
    moved: np.ndarray,
    covariance: np.ndarray,
) -> np.ndarray:
    """Variance (k,) of the coefficients of `model` by their scatter; 0 unless all recordings are moving ones in arcs.

    `moved` (k,) is what coefficients are beyond those with which recordings were navigated, `covariance` (k, k) theirs.
    """
    if any(case.believed is None or not case.believed.arcs or case.kind in PARKED for case in cases):
        return np.zeros(len(model))
    total = np.zeros_like(covariance)
    for r, (case, noise_point) in enumerate(zip(cases, noise_points, strict=True)):
        here = [k for k, one in enumerate(model) if one.columns[r] is not None]
        sums = _of_stretches(case, [model[k].columns[r] for k in here], noise_point, moved[here])
        total[np.ix_(here, here)] += STRETCHES / (STRETCHES - 1) * sums.T @ sums
    return np.diag(covariance @ total @ covariance)


def _of_stretches(case: Case, columns: Sequence, noise_point: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """g (stretches, k) of one recording."""
    known, count = len(case.nuisances), len(columns)
    whitened = case.whitened(columns, noise_point, keep=1 + known + count)
    rows = np.nan_to_num(whitened.kept)  # what was not measured tells nothing
    e, nuisances, z = rows[..., 0], rows[..., 1 : 1 + known], rows[..., 1 + known :]
    factor = cho_factor(np.eye(known) + whitened.normal[:known, :known])
    e = e - nuisances @ cho_solve(factor, whitened.projection[:known])
    z = z - nuisances @ cho_solve(factor, whitened.normal[:known, known:])
    score = (z * (e - z @ moved)[..., None]).sum(axis=1)
    begins = np.linspace(0, score.shape[0], STRETCHES, endpoint=False).astype(int)
    return np.add.reduceat(score, begins, axis=0)
