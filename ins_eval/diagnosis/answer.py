"""The answer in the form `ins-diagnosis/1`.

Source of the form: EFFECTS.md, "The answer".
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ins_eval.diagnosis.judge import Judgement, Mismatch
from ins_eval.metrics import radial_error_rates

FORMAT = "ins-diagnosis/1"
NO_MISMATCH, UNEXPLAINED = "no mismatch", "unexplained"


def answer(judgements: Sequence[Judgement]) -> dict[str, Any]:
    """One answer for all recordings of a command line."""
    mismatch = [_mismatch(judgement, one) for judgement in judgements for one in judgement.mismatches]
    mismatch.sort(key=lambda one: -one["significance_sigma"])
    worst = mismatch[0] if mismatch else None
    return {
        "format": FORMAT,
        "verdict": UNEXPLAINED if mismatch else NO_MISMATCH,
        "mismatch": mismatch,
        "effects": [],
        "indistinguishable": [],
        "unexplained": {
            "significance_sigma": worst["significance_sigma"] if worst else _largest(judgements),
            "channel": worst["channel"] if worst else None,
            "interval_s": worst["interval_s"] if worst else None,
        },
        "fit": _fit(judgements),
    }


def _mismatch(judgement: Judgement, one: Mismatch) -> dict[str, Any]:
    return {
        "recording": judgement.case.name,
        "channel": one.channel,
        "interval_s": [round(one.begin_s, 3), round(one.end_s, 3)],
        "where": one.where,
        "significance_sigma": round(one.significance_sigma, 2),
    }


def _largest(judgements: Sequence[Judgement]) -> float:
    return round(max((float(j.statistics["significance_sigma"]) for j in judgements), default=0.0), 2)


def _fit(judgements: Sequence[Judgement]) -> dict[str, Any]:
    """Of the belief, over all recordings: velocity RMS and radial error rate of the pure-inertial solution."""
    squares, rates = [], []
    for judgement in judgements:
        case = judgement.case
        if case.believed is None:
            continue
        y = case.seen.residual
        known = np.isfinite(y[:, :6]).all(axis=1)
        after_s = case.model.nodes_s - case.model.nodes_s[0]
        known &= after_s > 0.0
        if not known.any():
            continue
        squares.append(y[known, 3:5] ** 2)
        rates.append(float(radial_error_rates(y[known, :2], after_s[known]).rms))
    if not squares:
        return {}
    north, east = np.sqrt(np.concatenate(squares).mean(axis=0))
    return {
        "velocity_rms_mps": {"before": {"north": float(north), "east": float(east)}},
        "radial_error_rate_nmi_per_h": {"before": float(np.sqrt(np.mean(np.square(rates))))},
    }
