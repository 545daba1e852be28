"""Slow factors: what the error of a sensor follows within minutes and hours, as functions of time.

    1                   1
    t                   t - start.time_s, s
    T, T^2              T - T0 and its square
    r, r^2, r T         filtered rate in degC/min, its square, its product with T - T0; by `rate_filter_s` if given
    creep               y - y(0),  tau y' = T - y,  y(0) = T(0)
    branch              +1 on the falling, -1 on the rising branch: dh = (-sign(dT) - h) |dT| / width, from
                        h(0) = `branch_begin`, and without it from the branch that it follows first
    step                0 before `at_s`, 1 from then on
    NAME^2              square of the recorded column NAME
    change, square, rate, lag, branch of a recorded column: see `composed`

The conventions: docs/effects.md and docs/recording.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

import numba
import numpy as np

from ins_eval.compensation import CompensationModel
from ins_eval.effects.effect import AXES
from ins_eval.effects.temperature import SmoothedTemperature
from ins_eval.thermal import filtered_rate, lagged

OfTime = Callable[[np.ndarray], np.ndarray]
WITHOUT_TEMPERATURE = ("1", "t", "step")
POWERS = {  # of T - T0 and of r
    "T": lambda t, r: t,
    "T^2": lambda t, r: t**2,
    "r": lambda t, r: r,
    "r^2": lambda t, r: r**2,
    "r T": lambda t, r: r * t,
}
START_SHARE = 0.1  # of a width that the temperature must move before it is known on which branch it begins


@dataclass(frozen=True, eq=False)
class Conditions:
    """What a recording tells of the things that drive an effect.

    `columns` are recorded columns (n,) at `time_s` by name; `models` gives the believed compensation of each of the
    accelerometers `axes`, and is None where the output is not in pulses; `bias_sigma` is that of each sensor, in the
    unit of its constant bias.
    """

    start_s: float
    end_s: float
    temperature: SmoothedTemperature | None
    time_s: np.ndarray
    columns: Mapping[str, np.ndarray]
    models: Callable[[str], CompensationModel] | None
    axes: tuple[str, ...] = AXES
    bias_sigma: Mapping[str, float] = field(default_factory=dict)
    _means: dict[tuple[str, int], tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)

    def per_second(self, column: str, power: int = 1) -> tuple[np.ndarray, np.ndarray]:
        """Time and means (m,) over whole seconds of a power of a recorded column."""
        if (column, power) not in self._means:
            self._means[column, power] = per_second(self.time_s, self.columns[column] ** power)
        return self._means[column, power]


def known(slow: str, conditions: Conditions) -> bool:
    """Whether the recording has what a slow factor is made of."""
    if slow in WITHOUT_TEMPERATURE:
        return True
    if slow.endswith("^2") and slow not in POWERS:
        return slow.removesuffix("^2") in conditions.columns
    return conditions.temperature is not None


def slow_factor(slow: str, conditions: Conditions, axis: int, parameters: Mapping[str, float | str]) -> OfTime:
    """A slow factor of an axis as a function of time in s."""
    if slow == "1":
        return np.ones_like
    if slow == "t":
        return lambda time_s: time_s - conditions.start_s
    if slow == "step":
        return lambda time_s: (time_s >= parameters["at_s"]).astype(float)
    seen = conditions.temperature
    if slow.endswith("^2") and slow not in POWERS:
        second, mean = conditions.per_second(slow.removesuffix("^2"), 2)
        return lambda time_s: np.interp(time_s, second, mean)
    values = _of_temperature(slow, seen, axis, parameters)
    return lambda time_s: np.interp(time_s, seen.time_s, values)


def _of_temperature(
    slow: str, seen: SmoothedTemperature, axis: int, parameters: Mapping[str, float | str]
) -> np.ndarray:
    if slow == "creep":
        return seen.in_runs(lambda time_s, smooth_c: creep(time_s, smooth_c, parameters["time_constant_s"]), axis)
    if slow == "branch":
        width, begin = parameters["branch_width_c"], parameters.get("branch_begin")
        return seen.in_runs(lambda _, smooth_c: branch(smooth_c, width, begin), axis)
    t, r = seen.smooth_c[:, axis] - seen.reference_c, seen.rate_c_per_min[:, axis]
    if "rate_filter_s" in parameters:
        r = seen.in_runs(partial(filtered_rate, time_constant_s=parameters["rate_filter_s"]), axis)
    return POWERS[slow](t, r)


def creep(time_s: np.ndarray, signal: np.ndarray, time_constant_s: float) -> np.ndarray:
    """y - y(0) of tau y' = x - y, y(0) = x(0), (n,)."""
    memory = lagged(time_s, signal, time_constant_s)
    return memory - memory[0]


def branch(signal: np.ndarray, width: float, begin: float | None = None) -> np.ndarray:
    """+1 on the falling, -1 on the rising branch: dh = (-sign(dx) - h) |dx| / width.

    It starts at `begin`, or else on the branch that it follows first.
    """
    signal = np.ascontiguousarray(signal, dtype=float)
    if begin is not None:
        return _branch(signal, float(width), float(begin))
    far = np.flatnonzero(np.abs(signal - signal[0]) > START_SHARE * width)
    start = -np.sign(signal[far[0]] - signal[0]) if far.size else 0.0
    return _branch(signal, float(width), float(start))


@numba.njit(cache=True)
def _branch(signal, width, start):
    out = np.empty(signal.size)
    out[0] = start
    for k in range(1, signal.size):
        step = signal[k] - signal[k - 1]
        side = -np.sign(step)
        out[k] = side + (out[k - 1] - side) * np.exp(-abs(step) / width)
    return out


def per_second(time_s: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means over whole seconds (m,), and the mean time of each."""
    second = np.floor(time_s - time_s[0] + 1e-9)
    first = np.append(0, np.flatnonzero(np.diff(second)) + 1)
    count = np.diff(np.append(first, time_s.size))
    return np.add.reduceat(time_s, first) / count, np.add.reduceat(values, first) / count


def of_column(shape: str, conditions: Conditions, driver: str, argument: float) -> tuple[np.ndarray, np.ndarray]:
    """Time and values (m,) of a shape of a recorded column: see `composed`."""
    time_s, u = conditions.per_second(driver)
    if shape == "rate":
        return time_s, filtered_rate(time_s, u, argument)
    if shape == "lag":
        return time_s, creep(time_s, u, argument)
    if shape == "branch":
        return time_s, branch(u, argument)
    change = u - u[0]
    return time_s, change**2 if shape == "square" else change
