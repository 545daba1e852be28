"""Compensation models: from the output of an accelerometer and a temperature to specific force.

A model is any object with a ``name`` and two methods; there is nothing to inherit::

    class MyModel:
        name = "mine"
        def fit(self, chamber): ...               # ChamberReadings of this accelerometer; returns self
        def specific_force(self, samples): ...    # Samples -> (n,) m/s^2 along the input axis

It sees samples and chamber readings only, never the truth. A fitted attribute ends in an underscore.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from ins_eval.recording import ChamberReadings


class Curve(Protocol):
    """A quantity against temperature and its rate."""

    def evaluate(self, temperature_c: np.ndarray, rate_c_per_min: np.ndarray) -> np.ndarray: ...


@dataclass(frozen=True)
class Samples:
    """What a model may see of one accelerometer, all of shape (n,).

    `rate_c_per_min` is the causal, first-order filtered derivative of the reading (`thermal.filtered_rate`).
    """

    time_s: np.ndarray
    output: np.ndarray  # pulse/s, mean over the sample
    temperature_c: np.ndarray
    rate_c_per_min: np.ndarray


class SharedSamples(Samples):
    """Samples that several models see: a curve that they have in common is evaluated once, and its values are kept."""

    __slots__ = ("_kept",)
    _kept: dict[int, tuple[Curve, np.ndarray]]


def evaluated(curve: Curve, samples: Samples) -> np.ndarray:
    """A curve at samples, (n,), not to be written into."""
    if not isinstance(samples, SharedSamples):
        return curve.evaluate(samples.temperature_c, samples.rate_c_per_min)
    if not hasattr(samples, "_kept"):
        object.__setattr__(samples, "_kept", {})
    if id(curve) not in samples._kept:  # kept with the curve, so that no other takes its place
        samples._kept[id(curve)] = curve, curve.evaluate(samples.temperature_c, samples.rate_c_per_min)
    return samples._kept[id(curve)][1]


@runtime_checkable
class CompensationModel(Protocol):
    """The contract of a compensation model; `check.check_model` tests it."""

    name: str

    def fit(self, chamber: ChamberReadings) -> CompensationModel: ...

    def specific_force(self, samples: Samples) -> np.ndarray: ...
