"""The answer in the form `ins-diagnosis/1`.

Every key: docs/answer.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ins_eval.diagnosis.answer.verdict import Q95
from ins_eval.metrics import radial_error_rates
from ins_eval.units import DEG_PER_H, UG

if TYPE_CHECKING:
    from ins_eval.diagnosis.answer.verdict import Diagnosis, FoundEffect, Rival, Withdrawn
    from ins_eval.diagnosis.unnamed.mismatch import Mismatch, Wander
    from ins_eval.error_model.library import Candidate
    from ins_eval.estimation.case import Case

FORMAT = "ins-diagnosis/1"
POSITIONS, VELOCITIES = slice(0, 2), slice(3, 5)  # north and east, of the nine channels of a node
WORDS = ("other_axis", "driver", "form", "sensor", "unit_found", "frame_found")  # parameters that are no numbers


def answer(found: Diagnosis) -> dict[str, Any]:
    """One answer for all recordings of a command line."""
    left = found.unnamed
    return {
        "format": FORMAT,
        "verdict": found.verdict,
        "mismatch": [_mismatch(found, one) for one in found.mismatches],
        "effects": [_effect(one) for one in (*found.described, *found.effects)],
        "indistinguishable": [_rival(one) for one in found.rivals],
        "unexplained": {
            "significance_sigma": round(left.significance_sigma, 2),
            "channel": left.mismatch.channel if left.mismatch else None,
            "interval_s": _interval(left.mismatch) if left.mismatch else None,
            "wander": _wander(left.wander) if left.wander else None,
        },
        "fit": _fit(found),
        "withdrawn": [_withdrawn(one) for one in found.withdrawn],
    }


def _interval(one: Mismatch) -> list[float]:
    return [round(one.begin_s, 3), round(one.end_s, 3)]


def _wander(one: Wander) -> dict[str, Any]:
    si, unit = (DEG_PER_H, "deg/h") if one.sensor == "gyro" else (UG, "ug")
    return {"sensor": one.sensor, "sigma": one.sigma / si, "bound": one.bound / si, "unit": unit}


def _mismatch(found: Diagnosis, one: Mismatch) -> dict[str, Any]:
    return {
        "recording": found.cases[one.recording].name,
        "channel": one.channel,
        "interval_s": _interval(one),
        "where": one.where,
        "significance_sigma": round(one.significance_sigma, 2),
    }


def _effect(one: FoundEffect) -> dict[str, Any]:
    candidate = one.hypothesis.candidate
    words = {name: candidate.parameters[name] for name in WORDS if name in candidate.parameters}
    entry = {
        "name": candidate.name,
        "axis": candidate.axis,
        "parameters": _size(candidate, one.value, one.sigma) | words | _numbers(candidate, one.spread),
        "probability": one.probability,
        "log_evidence_gain": one.log_evidence_gain,
        "false_alarm_probability": one.false_alarm_probability,
    }
    return entry | {name: candidate.parameters[name] for name in ("driver", "form") if name in candidate.parameters}


def _withdrawn(one: Withdrawn) -> dict[str, Any]:
    candidate = one.effect.hypothesis.candidate
    return {"name": candidate.name, "axis": candidate.axis, "reason": one.reason}


def _rival(one: Rival) -> dict[str, Any]:
    candidate = one.hypothesis.candidate
    numbers = _numbers(candidate, one.spread)
    together = [{"name": other.candidate.name, "axis": other.candidate.axis} for other in one.beside]
    return (
        ({"together_with": together} if together else {})
        | {
            "from": None if one.of is None else one.of.candidate.name,
            "name": candidate.name,
            "axis": candidate.axis,
            **{name: candidate.parameters[name] for name in WORDS if name in candidate.parameters},
            "probability": one.probability,
            "log_evidence_below_best": one.below_best,
            "told_apart_by_prior_only": one.by_prior_only,
            "experiment": one.experiment,
            "expected_log_bayes_factor": one.expected_log_bayes_factor,
        }
        | ({} if one.value is None else {"parameters": _size(candidate, one.value, one.sigma) | numbers})
    )


def _numbers(candidate: Candidate, spread: Mapping[str, tuple[float, float]]) -> dict[str, Any]:
    """Times, widths and shares of an effect, each with its interval where that is known; a lag is its value itself."""
    out: dict[str, Any] = {}
    for name, x in candidate.parameters.items():
        if name not in (*WORDS, "lag_s"):
            out[name] = x
            if name in spread:
                out[f"{name}_interval95"] = list(spread[name])
    return out


def _size(candidate: Candidate, value: float, sigma: float | None) -> dict[str, Any]:
    """Value of an effect, its 95 % interval where that is known, and its unit."""
    reach = {} if sigma is None else {"interval95": [value - Q95 * sigma, value + Q95 * sigma]}
    return {"value": value} | reach | {"unit": candidate.unit}


def _fit(found: Diagnosis) -> dict[str, Any]:
    before = navigation_errors(found.cases)
    after = navigation_errors(found.after) if found.effects else {}
    given = {name: value for name, value in found.held_out.items() if not name.endswith("_nats")}
    out: dict[str, Any] = {"held_out": given} if given else {}
    for name in before:
        out[name] = {"before": before[name]} | ({"after": after[name]} if name in after else {})
    return out


def navigation_errors(cases: Sequence[Case]) -> dict[str, Any]:
    """Velocity RMS and radial error rate of the pure-inertial solution, over all recordings that move or could.

    Each where what was measured tells it: velocities or positions.
    """
    squares, rates = [], []
    for case in cases:
        if case.believed is None:
            continue
        y = case.inertial()
        after_s = case.model.nodes_s - case.model.nodes_s[0]
        position, velocity = (np.isfinite(y[:, two]).all(axis=1) & (after_s > 0.0) for two in (POSITIONS, VELOCITIES))
        if velocity.any():
            squares.append(y[velocity, VELOCITIES] ** 2)
        if position.any():
            rates.append(float(radial_error_rates(y[position, POSITIONS], after_s[position]).rms))
    found: dict[str, Any] = {}
    if squares:
        north, east = np.sqrt(np.concatenate(squares).mean(axis=0))
        found["velocity_rms_mps"] = {"north": float(north), "east": float(east)}
    if rates:
        found["radial_error_rate_nmi_per_h"] = float(np.sqrt(np.mean(np.square(rates))))
    return found
