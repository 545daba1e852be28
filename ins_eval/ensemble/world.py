"""What all members of a plan share, and what each of them is made of."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from ins_eval import accelerometer
from ins_eval.compensation import CompensationModel
from ins_eval.compensation.guard import working_model
from ins_eval.compensation.refined import OvenRun
from ins_eval.earth import gravity
from ins_eval.ensemble.changes import Attitude, Setting
from ins_eval.ensemble.plan import OVEN_RATE_HZ, SOURCES, Plan
from ins_eval.errors import UsageError
from ins_eval.evaluate import samples, standstill_to_align_on
from ins_eval.gyro import GyroPopulation
from ins_eval.imu import Instrument, Mission, Population
from ins_eval.laboratory import Chamber
from ins_eval.profile import Profile, load
from ins_eval.recording import ChamberReadings, Recording
from ins_eval.streams import Streams


@lru_cache(maxsize=4)
def _missions(profile: Profile, rate_hz: float) -> tuple[Mission, Mission]:
    """The flight and the oven with its temperatures: shared by plans that differ in their sensors only."""
    flight = Mission(profile, rate_hz)
    return flight, flight.in_oven(OVEN_RATE_HZ)


@lru_cache(maxsize=32)
def _measured(
    chamber: Chamber, accelerometers: accelerometer.Population, streams: Streams
) -> tuple[ChamberReadings, ...]:
    """Readings of the three accelerometers of one instrument: shared by plans that differ in anything else."""
    instrument = Population(accelerometers).draw(streams)
    return tuple(chamber.measure(unit, streams) for unit in instrument.accelerometers)


class World:
    """What all members of a plan share."""

    def __init__(self, plan: Plan):
        setting = Setting(accelerometer.Population.load(plan.population), GyroPopulation(), load(plan.profile))
        setting = setting.changed(plan.changes)
        if setting.profile.kind != "flight":
            raise UsageError(f"profile '{plan.profile}' stands still; expected a flight, kind = 'flight'")
        self.plan = plan
        accelerometers, gyros = setting.accelerometers, setting.gyros
        if plan.source is not None:
            effects, gyros_err = SOURCES[plan.source]
            accelerometers = accelerometers.only(*effects, "quantisation")
            gyros = gyros if gyros_err else gyros.perfect()
        self.population = Population(accelerometers, gyros)
        self.alignment = setting.alignment
        self.flight, self.oven = _missions(setting.profile, plan.rate_hz)
        self.chamber = Chamber()

    def instrument(self, index: int) -> Instrument:
        """The instrument with this number."""
        return self.population.draw(self.streams(index))

    def streams(self, index: int) -> Streams:
        """Random streams of the instrument with this number."""
        return Streams(self.plan.seed).at("instrument", index)

    def triads(self, index: int) -> dict[str, list[CompensationModel]]:
        """The compensation models of an instrument, calibrated and refined, one for each accelerometer."""
        chambers = _measured(self.chamber, self.population.accelerometers, self.streams(index))
        ovens = self.oven_runs(index, self.plan.oven_runs)
        triads: dict[str, list[CompensationModel]] = {}
        for arm in self.plan.arms:
            triad = [working_model(arm, f"instrument {index}").fit(readings) for readings in chambers]
            for model, runs in zip(triad, ovens, strict=True):
                if hasattr(model, "refine"):
                    model.refine(runs)
            triads[arm] = triad
        return triads

    def oven_runs(self, index: int, count: int) -> tuple[list[OvenRun], list[OvenRun], list[OvenRun]]:
        """The first `count` refinement runs of an instrument, level and at rest in the oven, for each accelerometer."""
        instrument, node = self.instrument(index), self.streams(index).at("oven")
        recordings = [self.oven.record(instrument, node.at(run)) for run in range(count)]
        seen = [samples(recording) for recording in recordings]
        start = self.oven.start(0.0, aligned=True)
        force = (0.0, 0.0, -gravity(start.latitude_rad, start.height_m))
        x, y, z = ([(of_axes[axis], force[axis]) for of_axes in seen] for axis in range(3))
        return x, y, z


def beginning(mission: Mission, recording: Recording, alignment: Attitude) -> dict[str, Any]:
    """How `evaluate` is to begin: aligned on the stand, or with the true state at time 0."""
    if alignment == "given":
        return {"start": mission.start(0.0, aligned=True)}
    return {"align_on": standstill_to_align_on(recording)}
