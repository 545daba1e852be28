"""One uninterrupted run: the true temperature that an accelerometer lives through, switched on once.

What depends on the temperature alone (lagged temperature, rate, state of the magnet, state of the epoxy) is
computed once for each run and shared by every unit, so that a unit costs a few sums and not a simulation.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from ins_eval.thermal import filtered_rate, lagged


@dataclass(frozen=True, eq=False)
class ThermalRun:
    """The true surface temperature of the accelerometers over one run, on a slow grid.

    `time_s` (n,) strictly increasing and `temperature_c` (n,), straight between the points: 1 s apart in an oven
    or in flight, 60 s in a chamber. `element_lag_s` is how late the inner elements follow the surface. `before` is
    what the surface lived through until the accelerometer was switched on. At the first point of all this everything
    inside has the temperature of the surface.
    """

    time_s: np.ndarray
    temperature_c: np.ndarray
    kind: Literal["chamber", "oven", "flight"]
    element_lag_s: float = 0.0
    before: ThermalRun | None = None
    _states: dict[Hashable, Any] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        for name in ("time_s", "temperature_c"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=float))
        if self.time_s.ndim != 1 or self.time_s.shape != self.temperature_c.shape or self.time_s.size < 2:
            raise ValueError(
                f"a thermal run has time_s {self.time_s.shape} and temperature_c {self.temperature_c.shape}; "
                "expected two arrays (n,) of the same length, n >= 2"
            )
        if not (np.all(np.isfinite(self.temperature_c)) and np.all(np.diff(self.time_s) > 0)):
            raise ValueError("a thermal run needs finite temperatures at strictly increasing times")
        if self.before is not None and not self.before.time_s[-1] < self.time_s[0]:
            raise ValueError("a thermal run begins after all that was before it")

    def state(self, key: Hashable, compute: Callable[[ThermalRun], Any]) -> Any:
        """``compute(self)``, computed at the first call with `key` and remembered; not to be written to."""
        if key not in self._states:
            self._states[key] = compute(self)
        return self._states[key]

    @property
    def whole(self) -> ThermalRun:
        """All that the accelerometer remembers: what was before, and the run itself."""
        return self if self.before is None else self.state("whole", ThermalRun._joined)

    def _joined(self) -> ThermalRun:
        time_s, temperature_c = (
            np.concatenate((getattr(self.before, name), getattr(self, name))) for name in ("time_s", "temperature_c")
        )
        return ThermalRun(time_s, temperature_c, self.kind, self.element_lag_s)

    def cut(self, values: np.ndarray) -> np.ndarray:
        """Of `values` (m, ...) of the `whole` those of the run itself, (n, ...)."""
        return values[len(values) - self.time_s.size :]

    @property
    def element_c(self) -> np.ndarray:
        """Temperature of the inner elements in degC, (n,)."""
        if self.element_lag_s == 0.0:
            return self.temperature_c

        def compute(run: ThermalRun) -> np.ndarray:
            return run.cut(lagged(run.whole.time_s, run.whole.temperature_c, run.element_lag_s))

        return self.state("element_c", compute)

    def rate_c_per_min(self, filter_s: float) -> np.ndarray:
        """Rate of the true surface temperature in degC/min, (n,), by the causal filter of `thermal.filtered_rate`."""

        def compute(run: ThermalRun) -> np.ndarray:
            return run.cut(filtered_rate(run.whole.time_s, run.whole.temperature_c, filter_s))

        return self.state(("rate", filter_s), compute)

    def with_element_lag(self, lag_s: float) -> ThermalRun:
        """The same run with inner elements that follow the surface by `lag_s`; one object for all units."""
        return self.state(("with_element_lag", lag_s), lambda run: replace(run, element_lag_s=lag_s))
