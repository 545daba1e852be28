"""Many accelerometers of one axis at once: their outputs (n, m) side by side, from the streams that each has anyway.

The same effects, constants and draws as `model.Accelerometer` has one at a time, but for whole pulses: what a count
rounds off is carried into the next, and is left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ins_eval.accelerometer.absent import Absent
from ins_eval.accelerometer.effect import AccelerometerEffect, SharedCourse
from ins_eval.accelerometer.in_run import InRun
from ins_eval.accelerometer.model import Accelerometer, SlowErrors
from ins_eval.accelerometer.noise import Noise
from ins_eval.accelerometer.nonlinearity import Nonlinearity
from ins_eval.accelerometer.quantisation import Quantisation
from ins_eval.accelerometer.run import ThermalRun
from ins_eval.accelerometer.thermal_lag import ThermalLag
from ins_eval.many_streams import ManyStreams, normal_sums, normals
from ins_eval.output_equation import SENSOR_AXES, Coefficients, force_error_ug
from ins_eval.units import PPM

KNOWN = (Absent, ThermalLag, SharedCourse, InRun, Nonlinearity, Noise, Quantisation)  # effects that are made here


@dataclass(frozen=True, eq=False)
class ManyAccelerometers:
    """m accelerometers along the body axis `axis`: their effects, and of each its constants (m, ...)."""

    axis: Literal["x", "y", "z"]
    effects: tuple[AccelerometerEffect, ...]
    units: Mapping[str, Any]
    gamma: np.ndarray

    @classmethod
    def of(cls, units: Sequence[Accelerometer]) -> ManyAccelerometers:
        """Together, accelerometers of one axis that were drawn from one population."""
        effects = units[0].effects
        of_effects = {e.name: np.array([unit.units[e.name] for unit in units], dtype=float) for e in effects}
        return cls(units[0].axis, effects, of_effects, np.array([unit.gamma for unit in units]))

    def slow(self, run: ThermalRun, streams: ManyStreams) -> SlowErrors:
        """Scale factor and bias over one run, (n, m) each: see `Accelerometer.slow`."""
        for effect in self.effects:
            run = effect.inside(run)
        node = streams.at(f"accelerometer.{self.axis}")
        count = self.gamma.size
        courses: dict[str, list[np.ndarray]] = {"scale_ppm": [], "bias_ug": []}
        sizes: dict[str, list[np.ndarray]] = {"scale_ppm": [], "bias_ug": []}
        constant = {"scale_ppm": np.zeros(count), "bias_ug": np.zeros(count)}
        wander_ug: np.ndarray | float = 0.0
        for effect in self.effects:
            if isinstance(effect, SharedCourse):
                normal = normals(node.at(effect.name).begin(), 1)[0] if effect.redrawn else 0.0
                size = effect.sizes(self.units[effect.name], run, normal).T
                course = effect.courses(run)
                if len(course) == 1:
                    constant[effect.quantity] += course[0] @ size
                else:
                    courses[effect.quantity].append(course)
                    sizes[effect.quantity].append(size)
            elif isinstance(effect, InRun):
                wander_ug = effect.wander_ug(normals(node.at(effect.name).begin(), run.time_s.size), run)
        scale_ppm, bias_ug = (
            (np.hstack(courses[q]) @ np.vstack(sizes[q]) if courses[q] else np.zeros((run.time_s.size, 1))) + constant[q]
            for q in ("scale_ppm", "bias_ug")
        )
        return SlowErrors(self.gamma * (1.0 + PPM * scale_ppm), bias_ug + wander_ug)

    def counts(
        self,
        interval_s: np.ndarray,
        specific_force_g: np.ndarray,
        slow: SlowErrors,
        streams: ManyStreams,
        every: int = 1,
    ) -> np.ndarray:
        """Pulses (n, m), not rounded, over intervals of `every` samples: see `Accelerometer.counts`."""
        node = streams.at(f"accelerometer.{self.axis}")
        force_g = np.asarray(specific_force_g, dtype=float)[..., SENSOR_AXES[self.axis]].reshape(-1, 1, 3)
        error_ug = slow.bias_ug
        for effect in self.effects:
            if isinstance(effect, Noise):
                table = node.at(effect.name, "samples").begin()
                mean = normal_sums(table, interval_s.size, every, 1)[:, 0] / every
                error_ug = error_ug + effect.of(mean, interval_s[:, None] / every)
            elif isinstance(effect, Nonlinearity):
                error_ug = error_ug + force_error_ug(Coefficients(*self.units[effect.name].T), force_g)
        return slow.scale * (1e-6 * error_ug + force_g[..., 0]) * interval_s[:, None]
