"""The accelerometer: a population of effects, one unit of it, its slow errors over a run, its pulses.

E = K1 (K0 + a + K2 a^2 + ...)      eq. (1), with K1 and K0 that follow temperature and time: eq. (12)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import create_model

from ins_eval.accelerometer.absent import Absent
from ins_eval.accelerometer.bias_temperature import BiasTemperature
from ins_eval.accelerometer.creep import Creep
from ins_eval.accelerometer.effect import AccelerometerEffect
from ins_eval.accelerometer.in_run import InRun
from ins_eval.accelerometer.loop_gain import LoopGain
from ins_eval.accelerometer.magnet_hysteresis import MagnetHysteresis
from ins_eval.accelerometer.noise import Noise
from ins_eval.accelerometer.nonlinearity import Nonlinearity
from ins_eval.accelerometer.quantisation import Quantisation
from ins_eval.accelerometer.run import ThermalRun
from ins_eval.accelerometer.scale_polynomial import ScalePolynomial
from ins_eval.accelerometer.scale_repeatability import ScaleRepeatability
from ins_eval.accelerometer.thermal_lag import ThermalLag
from ins_eval.accelerometer.turn_on import TurnOn
from ins_eval.errors import UsageError, did_you_mean
from ins_eval.output_equation import SENSOR_AXES
from ins_eval.streams import Streams
from ins_eval.tables import Strict, parse, read_extending
from ins_eval.units import PPM, STANDARD_GRAVITY

# in the order in which they are drawn: creep needs the thermal bias coefficient
EFFECTS: tuple[type[AccelerometerEffect], ...] = (
    ThermalLag,
    ScalePolynomial,
    MagnetHysteresis,
    ScaleRepeatability,
    BiasTemperature,
    Creep,
    TurnOn,
    InRun,
    Nonlinearity,
    Noise,
    Quantisation,
    LoopGain,
)
TIME_TOLERANCE_S = 1e-6
PRESETS = Path(__file__).parent / "presets"

# what a file may leave out, and what that means; every other effect is stated
_UNLESS_STATED = {LoopGain.name: LoopGain()}
_EFFECTS: dict[str, Any] = {effect.name: (effect, _UNLESS_STATED.get(effect.name, ...)) for effect in EFFECTS}
_Tables = create_model("_Tables", __base__=Strict, **_EFFECTS)


class SlowErrors(NamedTuple):
    """Scale factor K1 in pulse/(g s) and bias K0 in ug, both (n,) on the grid of a run."""

    scale: np.ndarray
    bias_ug: np.ndarray

    def at(self, run_s: np.ndarray, time_s: np.ndarray) -> SlowErrors:
        """The same at the ends of samples, `time_s` (n,), where their temperatures are read."""
        return SlowErrors(*(np.interp(time_s, run_s, value) for value in self))


@dataclass(frozen=True)
class Accelerometer:
    """One quartz flexible accelerometer: the effects that act in it and its own constants of each.

    `axis` is the body axis of its input. Its random streams lie below ``accelerometer.<axis>``, so the three
    accelerometers of an instrument are given the same node of a run.
    """

    axis: Literal["x", "y", "z"]
    effects: tuple[AccelerometerEffect, ...]
    units: Mapping[str, Any]

    @property
    def gamma(self) -> float:
        """Scale factor at the reference temperature, pulse/(g s)."""
        return float(self.units[ScalePolynomial.name][-1])

    def slow(self, run: ThermalRun, streams: Streams) -> SlowErrors:
        """What this accelerometer does over one run: K1 = gamma (1 + sum of ppm), K0 = sum of biases.

        `streams` is the node of the run; another run of the same instrument needs another node.
        """
        for effect in self.effects:
            run = effect.inside(run)
        node = streams.at(f"accelerometer.{self.axis}")
        scale_ppm, bias_ug = np.zeros(run.time_s.size), np.zeros(run.time_s.size)
        for effect in self._acting("contribution"):
            part = effect.contribution(self.units[effect.name], run, node.at(effect.name))
            scale_ppm += part.scale_ppm
            bias_ug += part.bias_ug
        return SlowErrors(self.gamma * (1.0 + PPM * scale_ppm), bias_ug)

    def _acting(self, place: str) -> list[AccelerometerEffect]:
        """The effects that do something there; for one that does not a generator costs more than most effects."""
        return [effect for effect in self.effects if overridden(effect, place)]

    def output(self, specific_force_g: np.ndarray, scale: np.ndarray, bias_ug: np.ndarray) -> np.ndarray:
        """Eq. (1) and (12) in pulse/s.

        `specific_force_g` (n, 3) or (3,) in g along the body axes; `scale` and `bias_ug` (n,) or constants.
        """
        force = np.moveaxis(np.asarray(specific_force_g, dtype=float), -1, 0)[list(SENSOR_AXES[self.axis])]
        error_ug = bias_ug
        for effect in self._acting("force_error_ug"):
            error_ug = error_ug + effect.force_error_ug(self.units[effect.name], np.moveaxis(force, 0, -1))
        return scale * (1e-6 * error_ug + force[0])

    def counts(
        self, interval_s: np.ndarray, specific_force_g: np.ndarray, slow: SlowErrors, streams: Streams
    ) -> np.ndarray:
        """Counts (n,) over consecutive intervals.

        `interval_s` (n,), the mean specific force of each interval (n, 3) or (3,) in g along the body axes, the
        slow errors (n,) in it, and the node of the run, as in `slow`.
        """
        node = streams.at(f"accelerometer.{self.axis}")
        bias_ug = slow.bias_ug
        for effect in self._acting("noise_ug"):
            bias_ug = bias_ug + effect.noise_ug(interval_s, node.at(effect.name, "samples").rng())
        pulses = self.output(specific_force_g, slow.scale, bias_ug) * interval_s
        for effect in self._acting("counted"):
            pulses = effect.counted(pulses)
        return pulses

    def pulses(
        self,
        time_s: np.ndarray,
        start_time_s: float,
        velocity_increment_b: np.ndarray,
        run: ThermalRun,
        slow: SlowErrors,
        streams: Streams,
    ) -> np.ndarray:
        """Counts (n,) over the samples that end at `time_s` (n,); the first begins at `start_time_s`.

        `velocity_increment_b` (n, 3) is the integral of specific force over each sample in m/s, body axes.
        Slow errors are taken at the end of the sample, where its temperature is read.
        """
        if time_s[0] < run.time_s[0] - TIME_TOLERANCE_S or time_s[-1] > run.time_s[-1] + TIME_TOLERANCE_S:
            raise ValueError(
                f"samples from {time_s[0]:g} s to {time_s[-1]:g} s lie outside the thermal run, "
                f"{run.time_s[0]:g} s to {run.time_s[-1]:g} s; give a run that covers them"
            )
        interval_s = np.diff(time_s, prepend=start_time_s)
        force_g = velocity_increment_b / (STANDARD_GRAVITY * interval_s[:, None])
        return self.counts(interval_s, force_g, slow.at(run.time_s, time_s), streams)


@dataclass(frozen=True)
class Population:
    """Where accelerometers are drawn from: every effect of `EFFECTS` with its parameters, or absent."""

    name: str
    effects: tuple[AccelerometerEffect, ...]

    @classmethod
    def load(cls, name_or_path: str | Path = "jb-kt8") -> Population:
        """A shipped population by name, or one from a TOML file.

        A file may begin with ``extends = "NAME"``: it then states only what differs; lists are replaced.
        Raises UsageError: no such file, not TOML, an unknown or missing key, a value out of its range.
        """
        path = _find(name_or_path)
        tables = parse(_Tables, read_extending(path, _find), str(path))
        return cls(path.stem, tuple(getattr(tables, effect.name) for effect in EFFECTS))

    def __getitem__(self, name: str) -> Any:
        """The effect of that name, with the parameters of its own class."""
        self._check((name,))
        return next(effect for effect in self.effects if effect.name == name)

    def without(self, *names: str) -> Population:
        """The same population with these effects switched off; no other draw moves."""
        self._check(names)
        return replace(self, effects=tuple(_off(effect) if effect.name in names else effect for effect in self.effects))

    def only(self, *names: str) -> Population:
        """The same population with all but these effects switched off; no other draw moves."""
        self._check(names)
        return self.without(*(effect.name for effect in self.effects if effect.name not in names))

    def replacing(self, *effects: AccelerometerEffect) -> Population:
        """The same population with these effects in place of those of the same name."""
        new = {effect.name: effect for effect in effects}
        self._check(tuple(new))
        return replace(self, effects=tuple(new.get(effect.name, effect) for effect in self.effects))

    def draw(self, streams: Streams) -> tuple[Accelerometer, Accelerometer, Accelerometer]:
        """The accelerometers x, y, z of one instrument, whose node in the random streams is `streams`."""
        by_effect = [
            effect.for_axes(streams.at("accelerometer", effect.name).rng())
            if overridden(effect, "for_axes")
            else (effect, effect, effect)
            for effect in self.effects
        ]
        x, y, z = zip(*by_effect, strict=True)
        return _draw_unit("x", x, streams), _draw_unit("y", y, streams), _draw_unit("z", z, streams)

    def _check(self, names: tuple[str, ...]) -> None:
        known = [effect.name for effect in self.effects]
        for name in names:
            if name not in known:
                raise UsageError(f"no accelerometer effect '{name}'{did_you_mean(name, known)}")


def overridden(effect: AccelerometerEffect, place: str) -> bool:
    """Whether an effect does something at one of the places of `AccelerometerEffect`."""
    return getattr(type(effect), place) is not getattr(AccelerometerEffect, place)


def _off(effect: AccelerometerEffect) -> AccelerometerEffect:
    return effect if isinstance(effect, Absent) else Absent(of=effect)


def _draw_unit(
    axis: Literal["x", "y", "z"], effects: tuple[AccelerometerEffect, ...], streams: Streams
) -> Accelerometer:
    units: dict[str, Any] = {}
    for effect in effects:
        if overridden(effect, "draw"):
            units[effect.name] = effect.draw(streams.at(f"accelerometer.{axis}", effect.name, "unit").rng(), units)
        else:
            units[effect.name] = None
    return Accelerometer(axis, effects, units)


def _find(name_or_path: str | Path) -> Path:
    path = Path(name_or_path)
    if path.suffix == ".toml":
        return path
    if (PRESETS / f"{name_or_path}.toml").is_file():
        return PRESETS / f"{name_or_path}.toml"
    known = [preset.stem for preset in PRESETS.glob("*.toml")]
    raise UsageError(f"no accelerometer population '{name_or_path}'{did_you_mean(str(name_or_path), known)}")
