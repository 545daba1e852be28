"""Where a mismatch lives, in words: phase, turning temperature, turns, attitude."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ins_eval.units import DEG

if TYPE_CHECKING:
    from ins_eval.effects.temperature import SmoothedTemperature
    from ins_eval.error_model.propagation import ErrorModel

MOST = 0.8  # share of an interval that a word must hold for
CLIMB_MPS = 1.0
STANDING_MPS = 0.5
CHANGING_C_PER_MIN = 0.02
TURNING_DEG = 10.0
SMOOTHED_S = 60


def where(model: ErrorModel, seen: SmoothedTemperature | None, begin_s: float, end_s: float) -> str:
    """What an interval has in common, such as ``descent, dT/dt > 0, 3 to 9 degC``; only what sets it apart."""
    inside = (model.nodes_s >= begin_s) & (model.nodes_s <= end_s)
    if not inside.any():
        return ""
    words = [] if model.states is None else [_phase(model, inside), _turning(model, inside)]
    if seen is not None:
        rows = (seen.time_s >= begin_s) & (seen.time_s <= end_s)
        if rows.any():
            words += _thermal(seen, rows)
    return ", ".join(word for word in words if word)


def _phase(model: ErrorModel, inside: np.ndarray) -> str:
    climb = -model.states.velocity_n[:, 2]
    width = min(climb.size, max(1, int(SMOOTHED_S / float(np.median(model.interval_s)))))
    climb = np.convolve(climb, np.ones(width) / width, mode="same")
    speed = np.hypot(*model.states.velocity_n[:, :2].T)
    phases = {
        "standing": speed < STANDING_MPS,
        "climb": (speed >= STANDING_MPS) & (climb > CLIMB_MPS),
        "descent": (speed >= STANDING_MPS) & (climb < -CLIMB_MPS),
        "level": (speed >= STANDING_MPS) & (np.abs(climb) <= CLIMB_MPS),
    }
    if phases["standing"].mean() > MOST:
        return ""
    held = [name for name, rows in phases.items() if rows[inside].mean() > 1.0 - MOST]
    if len(held) == len([name for name, rows in phases.items() if rows.mean() > 1.0 - MOST]) > 1:
        return "all phases"
    return " and ".join(held)


def _turning(model: ErrorModel, inside: np.ndarray) -> str:
    roll = np.arctan2(model.states.mat_nb[:, 2, 1], model.states.mat_nb[:, 2, 2])
    banked = np.abs(roll) > TURNING_DEG * DEG
    if banked[inside].mean() > 0.5:
        return "turning"
    return "straight" if banked.mean() > 0.02 and not banked[inside].any() else ""


def _thermal(seen: SmoothedTemperature, rows: np.ndarray) -> list[str]:
    rate = seen.rate_c_per_min[:, 0]
    temperature = seen.smooth_c[:, 0]
    words = []
    for word, holds in (
        ("dT/dt > 0", rate > CHANGING_C_PER_MIN),
        ("dT/dt < 0", rate < -CHANGING_C_PER_MIN),
        ("temperature steady", np.abs(rate) <= CHANGING_C_PER_MIN),
    ):
        if holds[rows].mean() > MOST:
            words.append(word)
    low, high = temperature[rows].min(), temperature[rows].max()
    if np.ptp(temperature) > 1.0:
        words.append(f"{low:.1f} to {high:.1f} degC")
    return words
