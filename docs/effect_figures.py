"""A figure and a page for each effect: what it adds to its sensor on the shipped flight."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.stats

from ins_eval.effects import VOCABULARY, without_effects
from ins_eval.effects.effect import Effect, Parameter
from ins_eval.figures.style import Drawing, sheet, styled, svg
from ins_eval.imu import Mission
from ins_eval.profile import load
from ins_eval.recording import Recording
from ins_eval.recording.belief import EffectBelief
from ins_eval.units import DEG_PER_H, UG
from ins_eval.wording import in_symbols, unbroken

SENSORS = {"accelerometer": ("accelerometer", UG, "µg"), "gyro": ("gyro", DEG_PER_H, "deg/h")}
RATE_HZ = 10.0
PROFILE = "climb-cruise-landing"
STEP_AT_S = 3000.0
PAGE = """# {name}

{physics}.

The error that it adds to the {axis} {sensor} on the profile `{profile}`, at its usual size, {value:g} {unit}:

````{{container}} wide
```{{image}} {name}.svg
:alt: Error of the {axis} {sensor} by {name} over the flight, with the temperature below
:width: 100%
```
````

What a recording needs to show it: {excited_by}. Source: {reference}.
"""
INDEX = """# Effects, one by one

What each effect of a sensor adds on the shipped flight. All names, units and parameters: [effects.md](../effects.md).

```{{toctree}}
:maxdepth: 1

{names}
```
"""


def draw_effects(folder: Path) -> list[str]:
    """Write a page and a figure for each effect of a sensor that one axis of the flight shows; return their names."""
    folder.mkdir(exist_ok=True)
    mission = Mission(load(PROFILE), RATE_HZ)
    flight, warm = mission.ideal(), mission.temperature
    temperature_c = np.interp(flight.imu.time_s, warm.time_s, warm.temperature_c)
    flight = replace(flight, imu=replace(flight.imu, temperature_c=temperature_c))
    names = []
    for name, effect in VOCABULARY.items():
        if effect.enters in SENSORS and (drawn := _error(flight, effect)) is not None:
            axis, error = drawn
            _, _, unit = SENSORS[effect.enters]
            (folder / f"{name}.svg").write_text(svg(_figure(name, flight, error, unit)), encoding="utf-8")
            words = {"axis": axis, "sensor": effect.enters, "profile": PROFILE, "value": effect.nominal}
            words |= {key: getattr(effect, key) for key in ("name", "unit", "excited_by", "reference")}
            physics = effect.physics[0].upper() + effect.physics[1:]
            text = unbroken(in_symbols(PAGE.format(physics=physics, **words)))
            (folder / f"{name}.md").write_text(text, encoding="utf-8")
            names.append(name)
    (folder / "index.md").write_text(INDEX.format(names="\n".join(names)), encoding="utf-8")
    return names


def _error(flight: Recording, effect: Effect) -> tuple[str, np.ndarray] | None:
    """The axis on which an effect of its usual size does most, and its error there in SI; None where there is none."""
    best: tuple[str, np.ndarray] | None = None
    for axis in effect.axes:
        parameters = {one.name: _usual(one) for one in effect.parameters}
        other = {"other_axis": effect.others(axis)[0]} if len(effect.multipliers) > 1 else {}
        stated = EffectBelief(name=effect.name, axis=axis, value=effect.nominal, **parameters, **other)
        believing = replace(flight, belief=flight.belief.model_copy(update={"effects": (stated,)}))
        without, velocity = without_effects(believing, flight.imu.accelerometer)
        added = flight.imu.gyro - without.imu.gyro if effect.enters == "gyro" else flight.imu.accelerometer - velocity
        error = added[:, "xyz".index(axis)] * RATE_HZ
        if best is None or np.ptp(error) + np.abs(error).max() > np.ptp(best[1]) + np.abs(best[1]).max():
            best = axis, error
    rounding = 10.0 * np.spacing(np.abs(flight.imu.accelerometer).max()) * RATE_HZ  # of the increments
    return best if best is not None and np.abs(best[1]).max() > rounding else None


def _usual(parameter: Parameter) -> float:
    """The middle of the values that are tried."""
    if parameter.low is None or parameter.high is None:
        return STEP_AT_S
    middle = np.mean if parameter.even or parameter.low <= 0.0 else scipy.stats.gmean
    return float(middle([parameter.low, parameter.high]))


@styled
def _figure(name: str, flight: Recording, error: np.ndarray, unit: str) -> Drawing:
    size = {"µg": UG, "deg/h": DEG_PER_H}[unit]
    drawn, (above, below) = sheet(4.2, name, "", rows=2, sharex=True, height_ratios=[2, 1])
    every = slice(None, None, 20)
    hours = flight.imu.time_s[every] / 3600.0
    above.plot(hours, error[every] / size, color="#12508f", linewidth=1.0)
    above.axhline(0.0, color="#666666", linewidth=0.6)  # and a constant is drawn as such
    above.set_ylabel(f"error [{unit}]")
    below.plot(hours, flight.imu.temperature_c[every], color="#b2182b", linewidth=1.0)
    below.set_ylabel("temperature [°C]")
    below.set_xlabel("time [h]")
    return drawn
