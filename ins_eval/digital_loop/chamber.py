"""A unit's own tests at several temperatures, and a test after a large change of temperature.

The reference is the unit's own, with its own thermometer, and gravity is that of the output. All parts are at the
temperature of the chamber, and their coefficients are constant (`unit.Unit`): curvature is not in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from ins_eval.calibration import loop_gains
from ins_eval.calibration.loop_temperature import TemperatureLine, fit
from ins_eval.digital_loop import bench, population, sampled
from ins_eval.digital_loop.bench import Procedure
from ins_eval.digital_loop.injector import Injection
from ins_eval.digital_loop.model import Loop, load
from ins_eval.digital_loop.unit import Unit
from ins_eval.streams import Streams


@dataclass(frozen=True, eq=False)
class Calibrated:
    """What the chamber gave of one unit; r repetitions of `population`.

    lines             of "gain" (slope of the scan), "current_step" (N_on - N_off) and "output" (N_out at 1 g)
    thermometer_c     (2, r) what the thermometer read at the reference and the test of each repetition
    far               the procedure with the large change of temperature, once
    far_thermometer_c (2, 1)
    """

    lines: dict[str, TemperatureLine]
    thermometer_c: np.ndarray
    far: Procedure
    far_thermometer_c: np.ndarray


def run(plan: population.ProcedurePlan, size: int, workers: int | None = None, quiet: bool = True) -> list[Calibrated]:
    """Each unit of the population in the chamber, in order of their numbers."""
    return population.of_each(partial(calibrated, plan), size, workers, quiet, "in the chamber")


def calibrated(plan: population.ProcedurePlan, index: int) -> Calibrated:
    """Unit number `index` of the population that `plan` describes."""
    streams = Streams(plan.seed).at("digital loop")
    unit = population.draw(streams, index, load(plan.preset))
    node = streams.at("unit", index, "chamber")
    at_c = unit.loop.parameters.bench.temperature.value
    room_c = bench.temperatures(unit.loop, streams.at("unit", index, "bench"))
    far_c = np.array([[at_c], [at_c + unit.loop.parameters.chamber.large_change.value]])
    size = plan.injected_ppm[0]
    return Calibrated(
        lines(unit, node),
        read(unit.loop, room_c, node.at("thermometer", "room")),
        bench.procedure(unit, node.at("far"), Injection(-size, size), far_c),
        read(unit.loop, far_c, node.at("thermometer", "far")),
    )


def lines(unit: Unit, streams: Streams) -> dict[str, TemperatureLine]:
    """How the slope of the scan, N_on - N_off and N_out at 1 g of `unit` follow its thermometer."""
    chamber = unit.loop.parameters.chamber
    true_c = np.linspace(chamber.lowest.value, chamber.highest.value, int(chamber.temperatures.value))
    temperature_c = read(unit.loop, true_c, streams.at("thermometer", "chamber"))
    found = np.array([_tests(unit.at(celsius), streams.at("run", k)) for k, celsius in enumerate(true_c)])
    at_c = unit.loop.parameters.bench.temperature.value
    return {
        name: fit(temperature_c, readings, at_c)
        for name, readings in zip(("gain", "current_step", "output"), found.T, strict=True)
    }


def read(loop: Loop, true_c: np.ndarray, streams: Streams) -> np.ndarray:
    """What the unit's thermometer reads at `true_c` (...)."""
    sigma_c = loop.parameters.chamber.thermometer_sigma.value
    return true_c + sigma_c * streams.rng().standard_normal(true_c.shape)


def _tests(loop: Loop, streams: Streams) -> tuple[float, float, float]:
    gain = loop_gains.scan_gain(*sampled.scan(loop, streams.at("scan").rng())).value
    on_counts, off_counts = bench.current_test(loop, streams.at("current"))
    return gain, on_counts.mean() - off_counts.mean(), bench.static_test(loop, streams.at("static"))
