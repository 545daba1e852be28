"""Whole instruments: every sensor with all its persistent errors at real sizes, flown on several days.

What stays with an instrument from day to day is drawn once, normal about what is believed, with the sigmas of its
population; what each day draws anew (turn-on biases, start attitude, wander, noise, the branch on which a magnet
begins, course, place and temperature) comes from the stream of that day.

The sizes are by reasoning from what is published. Navigation grade: Paper A, Tables 1 to 5, of the slopes of Table 1
what a calibration by straight lines leaves, a tenth. Tactical: brochure of the HG1700, data sheet of the STIM300. A
calibrated constant is a mean over switch-ons, so that of a bias a part of its repeatability is left; what a switch-on
draws anew is that of the day.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmark.worlds import grades, noise
from benchmark.worlds.effects import AXES, VOCABULARY, Effect
from benchmark.worlds.instruments import Departures, believe
from benchmark.worlds.record import Made, Unit, feel, measure
from benchmark.worlds.room import a_chamber

WORD = 20  # of the seeds of these instruments
# one sigma of each axis, in the unit of its name
NAVIGATION = {
    "accelerometer.bias": 20.0,
    "accelerometer.bias_temperature": 5.0,
    "accelerometer.bias_temperature_quadratic": 0.1,
    "accelerometer.bias_temperature_rate": 40.0,
    "accelerometer.bias_creep": 5.0,
    "accelerometer.bias_drift": 8.0,
    "accelerometer.scale": 30.0,
    "accelerometer.scale_temperature": 4.0,
    "accelerometer.scale_temperature_quadratic": 0.08,
    "accelerometer.scale_temperature_rate": 40.0,
    "accelerometer.scale_temperature_rate_quadratic": 100.0,
    "accelerometer.scale_temperature_rate_coupling": 2.0,
    "accelerometer.scale_hysteresis": 20.0,
    "accelerometer.asymmetry": 10.0,
    "accelerometer.quadratic": 15.0,
    "accelerometer.cubic": 10.0,
    "accelerometer.cross_pendulous": 15.0,
    "accelerometer.cross_output": 15.0,
    "accelerometer.misalignment": 30.0,
    "gyro.bias": 0.003,
    "gyro.bias_temperature": 6e-4,
    "gyro.bias_temperature_rate": 0.02,
    "gyro.bias_drift": 0.002,
    "gyro.scale": 20.0,
    "gyro.asymmetry": 5.0,
    "gyro.misalignment": 20.0,
    "gyro.g_sensitivity": 0.005,
}
TACTICAL = {
    "accelerometer.bias": 150.0,
    "accelerometer.bias_temperature": 30.0,
    "accelerometer.bias_temperature_quadratic": 0.5,
    "accelerometer.bias_temperature_rate": 150.0,
    "accelerometer.bias_creep": 10.0,
    "accelerometer.bias_drift": 30.0,
    "accelerometer.scale": 300.0,
    "accelerometer.scale_temperature": 20.0,
    "accelerometer.scale_temperature_quadratic": 0.3,
    "accelerometer.scale_temperature_rate": 100.0,
    "accelerometer.scale_temperature_rate_quadratic": 150.0,
    "accelerometer.scale_temperature_rate_coupling": 5.0,
    "accelerometer.scale_hysteresis": 40.0,
    "accelerometer.asymmetry": 50.0,
    "accelerometer.quadratic": 50.0,
    "accelerometer.cubic": 50.0,
    "accelerometer.cross_pendulous": 50.0,
    "accelerometer.cross_output": 50.0,
    "accelerometer.misalignment": 200.0,
    "gyro.bias": 0.3,
    "gyro.bias_temperature": 0.05,
    "gyro.bias_temperature_rate": 1.0,
    "gyro.bias_drift": 0.2,
    "gyro.scale": 150.0,
    "gyro.asymmetry": 50.0,
    "gyro.misalignment": 200.0,
    "gyro.g_sensitivity": 0.3,
}
POPULATIONS = {"navigation": NAVIGATION, "tactical": TACTICAL}
TACTICAL_ATTITUDE_DEG = (0.02, 0.02, 0.1)  # handed over by the navigator of the carrier
TACTICAL_BIAS = {"gyro_bias_deg_per_h": (0.5, 2.0), "accel_bias_ug": (200.0, 800.0)}  # one sigma of a turn-on
FLIGHT = "climb, cruise, landing"


@dataclass(frozen=True)
class Instrument:
    """One instrument of a population: what is believed of it, and the errors that it has on every day."""

    population: str
    seed: int
    index: int
    unit: Unit
    effects: tuple[Effect, ...]

    def flight(self, day: int, own: bool = True, believed: Sequence[Effect] = (), rate_hz: float = 20.0) -> Made:
        """The flight of a day, with the errors of the instrument or without, and less those that are `believed`.

        Whatever the errors, the day draws the same course, temperature, turn-on biases and noise.
        """
        rng = _stream(self.seed, self.population, self.index, 1 + day)
        felt = feel(rng, FLIGHT, rate_hz, self.unit.apart)
        begin = np.round(rng.uniform(-1.0, 1.0, 3), 2)
        departures = Departures()
        for one in self.effects if own else ():
            of_day(one, begin)(felt, departures)
        for one in believed:
            Effect(one.name, one.axis, -one.value, one.parameters)(felt, departures)
        return measure(rng, felt, self.unit, departures, "flight", f"{self.population} day {day}")

    def chamber(self, axis: str) -> Made:
        """Four positions at three ramps of one accelerometer."""
        rng = _stream(self.seed, self.population, self.index, 100 + AXES.index(axis))
        own = [one for one in self.effects if one.axis == axis and one.name.startswith("accelerometer")]
        return a_chamber(rng, self.unit, axis, own, (0.2, 0.5, 1.0), name=f"{self.population} chamber {axis}")


def of_day(effect: Effect, begin: np.ndarray) -> Effect:
    """The effect with the state in which a magnet begins that day; `begin` (3,) by axis."""
    if "begin" not in effect.parameters:
        return effect
    parameters = {**effect.parameters, "begin": float(begin[AXES.index(effect.axis)])}
    return Effect(effect.name, effect.axis, effect.value, parameters)


def an_instrument(population: str, seed: int, index: int) -> Instrument:
    """Instrument `index` of a population; the same arguments give the same instrument."""
    rng = _stream(seed, population, index, 0)
    sheet, true = noise.draw(rng, "plain")
    true |= {"gps_outages": 0, "gps_bank_outage": False}
    if population == "tactical":
        _, walk, _, density = grades.RANGES["tactical"]
        sheet |= {key: float(f"{noise.log_uniform(rng, *low_high):.2g}") for key, low_high in TACTICAL_BIAS.items()}
        sheet |= {
            "arw_deg_per_sqrt_h": float(f"{noise.log_uniform(rng, *walk):.2g}"),
            "vrw_ug_per_sqrt_hz": float(f"{noise.log_uniform(rng, *density):.2g}"),
            "vrw_stated": True,
            "attitude_deg": list(TACTICAL_ATTITUDE_DEG),
        }
        true |= {
            "gyro_wander_deg_per_h": 0.05 * sheet["gyro_bias_deg_per_h"],
            "accel_wander_ug": 0.03 * sheet["accel_bias_ug"],
        }
    unit = Unit(believe(rng, sheet), sheet, true, [0.0, 0.0, 0.0], 0.0, pulses=True)
    return Instrument(population, seed, index, unit, tuple(persistent(rng, population)))


def persistent(rng: np.random.Generator, population: str) -> list[Effect]:
    """What an instrument of the population has on every day: each error of each sensor."""
    found = []
    for name, sigma in POPULATIONS[population].items():
        for axis in AXES:
            for other in others(name, axis):
                parameters = VOCABULARY[name].parameters(rng)
                parameters |= {} if other is None else {"other_axis": other}
                found.append(Effect(name, axis, float(sigma * rng.standard_normal()), parameters))
    return found


def others(name: str, axis: str) -> list[str | None]:
    """The other axes of which each has an error of its own."""
    if "misalignment" in name:
        return [one for one in AXES if one != axis]
    return list(AXES) if "g_sensitivity" in name else [None]


def _stream(seed: int, population: str, index: int, part: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence([WORD, seed, list(POPULATIONS).index(population), index, part]))
