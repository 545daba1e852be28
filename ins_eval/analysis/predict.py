"""What a written model is expected to gain on a flight, before it is flown.

A model states the errors c of the sensors, c = m + L z, z ~ N(0, I), with m the values of its effects and L the root of
their covariance. The horizontal velocity error of a flight is linear in them, v = R c, so that its RMS is

    before:  sqrt((m + L z)' G (m + L z)),     after:  sqrt((L z)' G (L z)),     G = mean of R'R over the flight

where after is what the model leaves once its values are taken off. A column of R is the difference of two navigated
flights, one with an effect of one sigma and one without, as `evaluate` navigates them: with its alignment, where there
is one. What a switch-on draws anew, N(0, sigma^2) for the bias of each sensor, is added where it is asked for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ins_eval.compensation.file import believed_model
from ins_eval.earth import EARTH_RATE
from ins_eval.effects import without_effects
from ins_eval.errors import UsageError
from ins_eval.imu import Mission
from ins_eval.navigation import NORTH_RAD, beginning, compensate, evaluate, samples
from ins_eval.profile import load
from ins_eval.recording import Imu, Recording
from ins_eval.recording.belief import NAVIGATION_GRADE, Belief, EffectBelief
from ins_eval.streams import Streams
from ins_eval.units import DEG_PER_H

DRAWS = 4000
PERCENT = (2.5, 50.0, 97.5)
RATE_HZ = 10.0  # at which a profile is flown: the errors are smooth
EVERY = 25  # steps from one velocity that counts to the next
LEAST = 1e-12  # of an error that has no chance


@dataclass(frozen=True, eq=False)
class Prediction:
    """Velocity errors that a model expects on a flight.

    `draws` (n,) horizontal velocity RMS in m/s of possible instruments: `own` errors before and after the model, and
    with what each switch-on draws anew; `share` is what is left of the own errors.
    """

    flight: str
    draws: Mapping[str, np.ndarray]

    @cached_property
    def tree(self) -> dict[str, Any]:
        """Median and 95 % interval of each, as JSON has it."""
        each = {
            name: dict(zip(("low", "median", "high"), np.percentile(x, PERCENT).tolist(), strict=True))
            for name, x in self.draws.items()
        }
        return {"flight": self.flight, "velocity_rms": each}

    def to_frame(self) -> pd.DataFrame:
        """One row a figure: median and 95 % interval; m/s, the share as a part of 1."""
        return pd.DataFrame(self.tree["velocity_rms"]).T


def predict_flight(model: Belief, flight: Recording, folder: str | Path = ".", seed: int = 0) -> Prediction:
    """What `model` expects on a flight of which course and temperature are known; `folder` is that of its files.

    `flight` is an ideal or a recorded flight; what its sensors got wrong does not matter, for differences are taken.

    Raises: UsageError for a model without the covariance of its effects.
    """
    uncertain = [one for one in model.effects if one.root is not None]
    if not uncertain:
        raise UsageError(
            "predict: the model states no covariance of its effects, expected one that ins-eval diagnose --write-model "
            "wrote; write it anew"
        )
    root = root_of(uncertain)
    values = np.array([one.value for one in uncertain])
    size = np.maximum(np.sqrt((root**2).sum(axis=1)), LEAST)
    responses = np.stack(_responses(model, flight, folder, uncertain, size))  # (k, n, 2) of one sigma of each
    square = np.einsum("ink,jnk->ij", responses, responses) / responses.shape[1] / np.outer(size, size)
    rng = Streams(seed).at("predict").rng()
    left = rng.standard_normal((DRAWS, root.shape[1])) @ root.T
    day = _switched_on(model, uncertain) * rng.standard_normal((DRAWS, len(uncertain)))

    def rms(errors: np.ndarray) -> np.ndarray:
        return np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", errors, square, errors, optimize=True), 0.0))

    before, after = rms(values + left), rms(left)
    return Prediction(
        flight.name,
        {
            "own_before": before,
            "own_after": after,
            "share": after / before,
            "with_switch_on_before": rms(values + left + day),
            "with_switch_on_after": rms(left + day),
        },
    )


def planned(profile: str, model: Belief) -> Recording:
    """The flight of a profile as an instrument without errors would record it.

    It stands and is aligned first where the gyros of `model` find north; else it begins with the true attitude.
    """
    mission = Mission(load(profile), RATE_HZ)
    true, begin_s = mission.increments, mission.trajectory.start_s
    start = mission.start(begin_s, aligned=False, still_until_s=0.0)
    keep = np.ones(true.time_s.size, dtype=bool)
    sigma = DEG_PER_H * (model.gyro.bias_sigma_deg_per_h or 0.0)
    if sigma >= NORTH_RAD * EARTH_RATE * np.cos(start.latitude_rad) or mission.profile.kind == "static":
        start, keep = mission.start(0.0, aligned=True), true.time_s > 0.5 / RATE_HZ
    return Recording(
        name=mission.profile.name,
        kind="oven" if mission.profile.kind == "static" else "flight",
        start=start,
        imu=Imu(
            time_s=true.time_s[keep],
            gyro=true.dtheta_b[keep],
            accelerometer=true.dv_b[keep],
            accelerometer_form="increment",
            temperature_c=mission.imu_c[keep],
            height_baro_m=mission.height_m[keep],
        ),
        reference=mission.truth(0.0),
        belief=NAVIGATION_GRADE,
    )


def root_of(effects: Sequence[EffectBelief]) -> np.ndarray:
    """The root (k, m) of the covariance of effects that state their rows."""
    out = np.zeros((len(effects), max(len(one.root) for one in effects)))
    for row, one in zip(out, effects, strict=True):
        row[: len(one.root)] = one.root
    return out


def _switched_on(model: Belief, effects: Sequence[EffectBelief]) -> np.ndarray:
    """One sigma (k,) of what a switch-on draws anew of each effect: of the biases, else 0."""
    stated = {
        "accelerometer.bias": model.accelerometer.bias_sigma_ug,
        "gyro.bias": model.gyro.bias_sigma_deg_per_h,
    }
    return np.array([stated.get(one.name) or 0.0 for one in effects])


def _responses(
    model: Belief, flight: Recording, folder: str | Path, effects: Sequence[EffectBelief], size: np.ndarray
) -> list[np.ndarray]:
    """Horizontal velocity (n, 2) in m/s that each effect adds at its `size` (k,)."""
    flight = replace(flight, belief=_navigated_with(model, flight.belief))
    velocity = flight.imu.accelerometer
    if flight.imu.accelerometer_form == "pulse":
        triad = [believed_model(flight.belief, axis, folder) for axis in "xyz"]
        velocity = compensate(samples(flight), triad, flight.interval_s)
    begin = beginning(flight, velocity)

    def navigated(added: Sequence[EffectBelief]) -> np.ndarray:
        with_them = replace(flight, belief=flight.belief.model_copy(update={"effects": tuple(added)}))
        found = evaluate(*without_effects(with_them, velocity, folder), align_on=begin, every=EVERY)
        return found.solution.velocity_n[:, :2]

    without = navigated([])
    return [
        without - navigated([one.model_copy(update={"value": float(x)})]) for one, x in zip(effects, size, strict=True)
    ]


def _navigated_with(model: Belief, own: Belief) -> Belief:
    """The belief with which a flight is navigated: its own receiver, Earth and height, and the sensors of the model."""
    return own.model_copy(update={"gyro": model.gyro, "accelerometer": model.accelerometer, "effects": ()})
