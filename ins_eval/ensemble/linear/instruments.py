"""Many instruments at once: their accelerometers side by side, calibrated and refined in one go."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ins_eval.accelerometer import ManyAccelerometers, ThermalRun, draw
from ins_eval.compensation import CompensationModel, Samples, SharedSamples
from ins_eval.compensation.refined import OvenRun, Refined
from ins_eval.compensation.registry import REFINED, load_model
from ins_eval.earth import gravity
from ins_eval.ensemble.linear.course import Course
from ins_eval.ensemble.plan import BLOCK
from ins_eval.ensemble.world import World
from ins_eval.imu import Mission
from ins_eval.many_streams import ManyStreams

SAMPLED = 3 * BLOCK  # as many as anyone flies in full as well


class Instruments:
    """The instruments of a world with the numbers `indexes`, (m,).

    One alone may have models of its own and accelerometers unequally warm (`imu.Instrument.gradient`). Noise of the
    first `SAMPLED` is drawn sample by sample, as in full, so that each is the very one that is flown in full as well
    (`sampled`); of all others once a step, the sum of normal numbers being one.
    """

    def __init__(self, world: World, indexes: Sequence[int]):
        self.world, self.indexes, self.alone = world, indexes, len(indexes) == 1
        self.sampled = indexes[0] < SAMPLED
        self.streams = ManyStreams.of([world.streams(index) for index in indexes])
        self.gyros = world.population.gyros
        self.accelerometers = draw(world.population.accelerometers, self.streams.at("accelerometers"))
        self.gradient = world.instrument(indexes[0]).gradient if world.population.gradient else (0.0, 0.0, 0.0)

    def run(self, mission: Mission, axis: int) -> ThermalRun:
        """What the accelerometers of one axis live through on a mission."""
        return mission.run_at(self.gradient[axis]) if self.gradient[axis] else mission.run

    def triads(self, oven: Course) -> dict[str, list[CompensationModel]]:
        """The models of each compensation, calibrated and refined as `World.triads` has them, one for each axis."""
        if self.alone:
            return self.world.triads(self.indexes[0])
        measured = [self.world.chamber.measure(unit, self.streams) for unit in self.accelerometers]
        arms = self.world.plan.arms
        of_axes: list[dict[str, CompensationModel]] = []
        for axis, readings in enumerate(measured):
            fitted = {name: load_model(name).fit(readings) for name in {arm.removesuffix(REFINED) for arm in arms}}
            runs = self._oven_runs(oven, axis) if any(arm.endswith(REFINED) for arm in arms) else []
            refined = {
                arm: Refined(fitted[arm.removesuffix(REFINED)]).refine(runs) for arm in arms if arm.endswith(REFINED)
            }
            of_axes.append({**fitted, **refined})
        return {arm: [models[arm] for models in of_axes] for arm in arms}

    def _oven_runs(self, oven: Course, axis: int) -> list[OvenRun]:
        """Refinement runs level and at rest in the oven, as `World.oven_runs` has them."""
        start = oven.mission.start(0.0, aligned=True)
        known = (0.0, 0.0, -gravity(start.latitude_rad, start.height_m))[axis]
        run = self.run(oven.mission, axis)
        return [
            (self.samples(oven, self.output(oven, self.accelerometers[axis], run, self.streams.at("oven", k))), known)
            for k in range(self.world.plan.oven_runs)
        ]

    def draws(self, course: Course) -> int:
        """How many numbers are drawn for the noise of a step."""
        return course.every if self.sampled else 1

    def output(self, course: Course, unit: ManyAccelerometers, run: ThermalRun, streams: ManyStreams) -> np.ndarray:
        """Mean outputs (n, m) of accelerometers over the steps of a course, pulse/s."""
        return course.output(unit, run, streams, self.draws(course))

    def samples(self, course: Course, output: np.ndarray, rows: slice = slice(None)) -> Samples:
        """What the models see of outputs (n, m) over some steps of a course; of one instrument alone (n,)."""
        output = output[:, 0] if self.alone else output
        return SharedSamples(course.steps.time_s[rows], output, course.reading_c[rows], course.rate_c_per_min[rows])
