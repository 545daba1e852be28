"""Creep of the epoxy that bonds the coil to the pendulum: viscoelastic memory of the bias.

tau_j(T) z_j' = R(T) (T - T0) - z_j,   z_j(0) in equilibrium
K0 = omega1 xi sum_j w_j z_j,   tau_j(T) = tau_j exp(-(T - T0) / c)

T is the temperature of the elements, omega1 the thermal bias coefficient of the same accelerometer
(`bias_temperature`): the joint that expands is the joint that creeps. R(T) is the creep of the epoxy in parts of its
thermal deformation, measured (Paper A, Tables 2 and 3, in ``epoxy.toml``), so the amplitude is no free parameter.
xi has mean 1 and is redrawn at each run: Table 2 scatters by 17-30 % between repetitions of one experiment.
Assumed: three time constants and their weights, which give the 300 min of Paper A's Fig. 3, and c, faster when hot.
"""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numba
import numpy as np
from pydantic import Field, model_validator

from ins_eval.accelerometer.effect import NotNegative, Positive, SharedCourse
from ins_eval.accelerometer.run import ThermalRun
from ins_eval.units import MINUTE


@functools.cache
def epoxy() -> dict[str, np.ndarray]:
    """Paper A, Tables 2 and 3: `temperature_c` and true `direction` (3,), sizes `creep_um` and `thermal_um` (3, 10)."""
    table = tomllib.loads((Path(__file__).parent / "epoxy.toml").read_text(encoding="utf-8"))
    return {key: np.array(value) for key, value in table.items()}


@functools.cache
def _measured_ratio() -> tuple[np.ndarray, np.ndarray]:
    data = epoxy()
    return data["temperature_c"], data["creep_um"].mean(axis=1) / data["thermal_um"].mean(axis=1)


def creep_ratio(temperature_c: np.ndarray) -> np.ndarray:
    """R(T): final creep in parts of the thermal deformation; straight between the measured points, held beyond."""
    return np.interp(temperature_c, *_measured_ratio())


def scattered(scatter: np.ndarray | float, normal: np.ndarray | float) -> np.ndarray | float:
    """xi: log-normal with mean 1 and standard deviation `scatter`, made from standard normal draws."""
    log_variance = np.log1p(scatter**2)
    return np.exp(np.sqrt(log_variance) * normal - 0.5 * log_variance)


@numba.njit(cache=True)
def relax(clock, drive):
    """z' = u - z in the time of `clock` (n,), exact for a `drive` u (n,) that is straight between the points."""
    z = np.empty(drive.size)
    z[0] = drive[0]
    for k in range(1, drive.size):
        step = clock[k] - clock[k - 1]
        slope = (drive[k] - drive[k - 1]) / step
        z[k] = drive[k] - slope + (z[k - 1] - drive[k - 1] + slope) * np.exp(-step)
    return z


def material_clock(time_s: np.ndarray, difference_c: np.ndarray, faster_per_c: float) -> np.ndarray:
    """Time as the epoxy counts it, s: integral of exp(dT / c) dt, exact for a temperature straight between the points.

    With it the relaxation times become constants (time-temperature superposition).
    """
    x = difference_c / faster_per_c
    step = np.diff(x)
    level = np.abs(step) < 1e-9
    mean_speed = np.exp(x[:-1]) * np.where(level, 1.0 + 0.5 * step, np.expm1(step) / np.where(level, 1.0, step))
    return np.concatenate(([0.0], np.cumsum(mean_speed * np.diff(time_s))))


class Creep(SharedCourse):
    """Sum of relaxations in proportion to the thermal bias coefficient of the same accelerometer."""

    name: ClassVar[str] = "creep"
    quantity = "bias_ug"
    redrawn = True
    reference_temperature_c: float
    time_constants_min: Annotated[tuple[Positive, ...], Field(min_length=1)]  # at the reference temperature
    weights: Annotated[tuple[NotNegative, ...], Field(min_length=1)]
    faster_per_c: Annotated[float, Field(ge=1.0)]  # c: the degrees that make it e times as fast
    scatter: NotNegative  # standard deviation of xi, whose mean is 1

    @model_validator(mode="after")
    def _one_weight_each(self) -> Creep:
        if len(self.weights) != len(self.time_constants_min):
            raise ValueError(
                f"{len(self.weights)} weights for {len(self.time_constants_min)} time_constants_min; give one each"
            )
        return self

    def draw(self, rng: np.random.Generator, drawn: Mapping[str, Any]) -> float:
        """omega1 in ug/degC."""
        return drawn["bias_temperature"][0]

    def sizes(self, unit: np.ndarray | float, run: ThermalRun, normal: np.ndarray | float) -> np.ndarray:
        return np.asarray(unit * scattered(self.scatter, normal))[..., None]

    def courses(self, run: ThermalRun) -> np.ndarray:
        return self._memory(run)[:, None]

    def relaxed(self, time_s: np.ndarray, temperature_c: np.ndarray, stable_at_c: float) -> np.ndarray:
        """sum_j w_j z_j in degC, (n,), of an epoxy whose creep is counted from its stable state at `stable_at_c`.

        `time_s` (n,) and the temperature of the epoxy `temperature_c` (n,), straight between the points. At the first
        point it is in equilibrium.
        """
        clock = material_clock(time_s, temperature_c - self.reference_temperature_c, self.faster_per_c)
        drive = creep_ratio(temperature_c) * (temperature_c - stable_at_c)
        parts = zip(self.weights, self.time_constants_min, strict=True)
        return sum(w * relax(clock / (tau * MINUTE), drive) for w, tau in parts)

    def _memory(self, run: ThermalRun) -> np.ndarray:
        def compute(run: ThermalRun) -> np.ndarray:
            whole = run.whole
            return run.cut(self.relaxed(whole.time_s, whole.element_c, self.reference_temperature_c))

        return run.state((self.name, self), compute)
