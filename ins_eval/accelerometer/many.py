"""Many accelerometers of one axis at once: their outputs (n, m) side by side, from the streams that each has anyway.

The same effects, constants and draws as `model.Accelerometer` has one at a time, but for whole pulses: what a count
rounds off is carried into the next, and is left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numba
import numpy as np

from ins_eval.accelerometer.absent import Absent
from ins_eval.accelerometer.effect import AccelerometerEffect, SharedCourse
from ins_eval.accelerometer.in_run import InRun
from ins_eval.accelerometer.model import Population, SlowErrors, overridden
from ins_eval.accelerometer.noise import Noise
from ins_eval.accelerometer.nonlinearity import Nonlinearity
from ins_eval.accelerometer.quantisation import Quantisation
from ins_eval.accelerometer.run import ThermalRun
from ins_eval.accelerometer.scale_polynomial import ScalePolynomial
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
    units: Mapping[str, np.ndarray]

    @property
    def gamma(self) -> np.ndarray:
        """Scale factors at the reference temperature, (m,) in pulse/(g s)."""
        return self.units[ScalePolynomial.name][:, -1]

    def slow(self, run: ThermalRun, streams: ManyStreams) -> SlowErrors:
        """Scale factor and bias over one run, (n, m) each: see `Accelerometer.slow`."""
        for effect in self.effects:
            run = effect.inside(run)
        node = streams.at(f"accelerometer.{self.axis}")
        count = self.gamma.size
        courses: dict[str, list[np.ndarray]] = {"scale_ppm": [], "bias_ug": []}
        sizes: dict[str, list[np.ndarray]] = {"scale_ppm": [], "bias_ug": []}
        constant = {"scale_ppm": np.zeros(count), "bias_ug": np.zeros(count)}
        wander_ug = np.zeros((1, count))
        for effect in self.effects:
            if isinstance(effect, SharedCourse):
                normal = normals(node.at(effect.name).begin(), 1)[0] if effect.redrawn else 0.0
                size = effect.sizes(self.units.get(effect.name), run, normal).T
                course = effect.courses(run)
                if len(course) == 1:
                    constant[effect.quantity] += course[0] @ size
                else:
                    courses[effect.quantity].append(course)
                    sizes[effect.quantity].append(size)
            elif isinstance(effect, InRun):
                wander_ug = effect.wander_ug(normals(node.at(effect.name).begin(), run.time_s.size), run)
        (of_scale, scale_sizes), (of_bias, bias_sizes) = (
            (np.hstack(courses[q]), np.vstack(sizes[q]))
            if courses[q]
            else (np.zeros((run.time_s.size, 0)), np.zeros((0, count)))
            for q in ("scale_ppm", "bias_ug")
        )
        factor, level = PPM * self.gamma, self.gamma * (1.0 + PPM * constant["scale_ppm"])
        return SlowErrors(
            _scaled(of_scale @ scale_sizes, factor, level, np.zeros((1, count))),
            _scaled(of_bias @ bias_sizes, np.ones(count), constant["bias_ug"], wander_ug),
        )

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
        noise_ug = np.zeros((1, self.gamma.size))
        further_ug: np.ndarray = noise_ug
        for effect in self.effects:
            if isinstance(effect, Noise):
                noise_ug = normal_sums(node.at(effect.name, "samples").begin(), interval_s.size, every, 1)[:, 0]
                noise_ug *= effect.of(1.0 / every, interval_s / every)[:, None]
            elif isinstance(effect, Nonlinearity):
                further_ug = np.asarray(force_error_ug(Coefficients(*self.units[effect.name].T), force_g))
        return _pulses(slow.scale, slow.bias_ug, noise_ug, further_ug, force_g[:, 0, 0], interval_s)


def draw(population: Population, streams: ManyStreams) -> tuple[ManyAccelerometers, ...]:
    """The accelerometers x, y, z of many instruments, whose nodes are `streams`: those of `Population.draw`."""
    for effect in population.effects:
        if not isinstance(effect, KNOWN):
            raise ValueError(f"effect '{effect.name}' is made for one accelerometer at a time only")
    count = len(streams.words)
    dealt = {
        effect.name: [effect.for_axes(rng) for rng in streams.at("accelerometer", effect.name).generators()]
        if overridden(effect, "for_axes")
        else [(effect, effect, effect)] * count
        for effect in population.effects
    }
    axes: tuple[Literal["x", "y", "z"], ...] = ("x", "y", "z")
    found = []
    for number, axis in enumerate(axes):
        units: list[dict[str, Any]] = [{} for _ in range(count)]
        for effect in population.effects:
            if overridden(effect, "draw"):
                rngs = streams.at(f"accelerometer.{axis}", effect.name, "unit").generators()
                for unit, of_axes, rng in zip(units, dealt[effect.name], rngs, strict=True):
                    unit[effect.name] = of_axes[number].draw(rng, unit)
        of_effects = {name: np.array([unit[name] for unit in units], dtype=float) for name in units[0]}
        found.append(ManyAccelerometers(axis, population.effects, of_effects))
    return tuple(found)


@numba.njit(cache=True, nogil=True)
def _scaled(values, factor, constant, wander):
    """Values (n, m) times factor (m,), + constant (m,) + wander (n, m) or (1, m): in place."""
    for row in range(values.shape[0]):
        w = wander[row % wander.shape[0]]
        for j in range(values.shape[1]):
            values[row, j] = values[row, j] * factor[j] + constant[j] + w[j]
    return values


@numba.njit(cache=True, nogil=True)
def _pulses(scale, bias_ug, noise_ug, further_ug, force_g, interval_s):
    """Eq. (1) times the interval, (n, m); noise and further errors (n, m) or (1, m), force (n,) or (1,)."""
    out = np.empty(scale.shape)
    for k in range(scale.shape[0]):
        noise, further = noise_ug[k % noise_ug.shape[0]], further_ug[k % further_ug.shape[0]]
        force, interval = force_g[k % force_g.shape[0]], interval_s[k]
        for j in range(scale.shape[1]):
            error = bias_ug[k, j] + noise[j] + further[j]
            out[k, j] = scale[k, j] * (1e-6 * error + force) * interval
    return out
