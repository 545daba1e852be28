"""The three accelerometers of Paper A, JB-KT8 #1, #2 and #3: scale factor as printed, everything else by chance.

Source: Paper A (Sensors 2021, 21, 294), eqs (15)-(17). It prints nothing else of a single accelerometer.
"""

from __future__ import annotations

from dataclasses import replace

from ins_eval.accelerometer import Accelerometer, Population
from ins_eval.streams import Streams


def printed_units(population: Population | None = None) -> dict[str, Population]:
    """A population for each unit that `population` names: its printed coefficients exactly, the rest as ever.

    By default that of Paper A; ``Population.load("table4-scaled")`` has the same names with other slopes.
    """
    population = population or Population.load()
    polynomial = population["scale_polynomial"]
    return {
        unit.name: replace(
            population.replacing(polynomial.model_copy(update={"units": (unit,), "spread": 0.0})), name=unit.name
        )
        for unit in polynomial.units
    }


def draw_printed_units(streams: Streams, population: Population | None = None) -> dict[str, Accelerometer]:
    """One accelerometer of each name, whose node in the random streams is `streams`.

    Each sits on an axis of its own, so that what is left to chance differs between them.
    """
    populations = printed_units(population)
    return {name: each.draw(streams)[k % 3] for k, (name, each) in enumerate(populations.items())}
