"""What all members of a plan share, and what each of them is made of."""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any

from ins_eval import accelerometer
from ins_eval.compensation import CompensationModel
from ins_eval.compensation.guard import working_model
from ins_eval.compensation.refined import OvenRun, Refined
from ins_eval.compensation.registry import BUILT_IN, REFINED, load_model
from ins_eval.earth import gravity
from ins_eval.ensemble.changes import Attitude, Change, Setting
from ins_eval.ensemble.plan import OVEN_RATE_HZ, SOURCES, Plan
from ins_eval.errors import UsageError
from ins_eval.gyro import GyroPopulation
from ins_eval.imu import Instrument, InstrumentPopulation, Mission
from ins_eval.laboratory import Chamber
from ins_eval.missions import Gradient, Gyro, Missions
from ins_eval.navigation import samples, standstill_to_align_on
from ins_eval.profile import Profile, load
from ins_eval.recording import ChamberReadings, Recording
from ins_eval.streams import Streams


@lru_cache(maxsize=8)
def _flight(profile: Profile, rate_hz: float) -> Mission:
    """A flight: shared by all instruments that fly it, and by plans that differ in their sensors only."""
    return Mission(profile, rate_hz)


@lru_cache(maxsize=8)
def _oven(profile: Profile, rate_hz: float) -> Mission:
    """The oven with the temperatures of a flight, shared likewise."""
    return _flight(profile, rate_hz).in_oven(OVEN_RATE_HZ)


@lru_cache(maxsize=8)
def _instrument(population: InstrumentPopulation, streams: Streams) -> Instrument:
    """The instrument of a node, which its chamber, its oven and its flight share."""
    return population.draw(streams)


@lru_cache(maxsize=8)
def _measured(
    chamber: Chamber, accelerometers: accelerometer.Population, streams: Streams
) -> tuple[ChamberReadings, ...]:
    """Readings of the three accelerometers of one instrument: shared by plans that differ in anything else."""
    instrument = InstrumentPopulation(accelerometers).draw(streams)
    return tuple(chamber.measure(unit, streams) for unit in instrument.accelerometers)


@lru_cache(maxsize=64)
def _calibrated(
    chamber: Chamber, accelerometers: accelerometer.Population, streams: Streams, model: str
) -> tuple[CompensationModel, ...]:
    """A built-in model of each accelerometer, as the chamber leaves it; shared likewise, with its refined twin, too."""
    return tuple(load_model(model).fit(readings) for readings in _measured(chamber, accelerometers, streams))


@lru_cache(maxsize=8)
def _oven_runs(
    population: InstrumentPopulation, oven: Mission, streams: Streams, count: int
) -> tuple[list[OvenRun], ...]:
    """The first `count` refinement runs of an instrument, level and at rest in the oven, for each accelerometer."""
    instrument, node = _instrument(population, streams), streams.at("oven")
    seen = [tuple(samples(oven.record(instrument, node.at(run)))) for run in range(count)]
    start = oven.start(0.0, aligned=True)
    force = (0.0, 0.0, -gravity(start.latitude_rad, start.height_m))
    return tuple([(of_axes[axis], force[axis]) for of_axes in seen] for axis in range(3))


class World:
    """What all members of a plan share."""

    def __init__(self, plan: Plan):
        self.missions = Missions.load(plan.missions).without(*plan.missions_off) if plan.missions else None
        setting = Setting(accelerometer.Population.load(plan.population), GyroPopulation(), load(plan.profile))
        source = SOURCES[plan.source] if plan.source is not None else None
        setting = setting.changed((source.changes if source else ()) + plan.changes + _of_instruments(self.missions))
        if setting.profile.kind != "flight":
            raise UsageError(f"profile '{plan.profile}' stands still; expected a flight, kind = 'flight'")
        self.plan = plan
        accelerometers, gyros = setting.accelerometers, setting.gyros
        if source is not None:
            accelerometers = accelerometers.only(*source.effects, "quantisation")
            gyros = gyros if source.gyros else gyros.perfect()
        self.population = InstrumentPopulation(accelerometers, gyros, setting.gradient)
        self.alignment = setting.alignment
        self.flight = _flight(setting.profile, plan.rate_hz)
        heated = setting.profile if plan.oven is None else load(plan.oven)
        self.oven = _oven(heated, plan.rate_hz)
        self.chamber = Chamber()

    def instrument(self, index: int) -> Instrument:
        """The instrument with this number."""
        return _instrument(self.population, self.streams(index))

    def streams(self, index: int) -> Streams:
        """Random streams of the instrument with this number."""
        return Streams(self.plan.seed).at("instrument", index)

    def mission(self, index: int) -> Mission:
        """What the instrument with this number flies: the flight of all, or a mission of its own."""
        if self.missions is None:
            return self.flight
        return _flight(self.missions.draw(self._first, self.streams(index).at("mission")), self.plan.rate_hz)

    @cached_property
    def _first(self) -> Profile:
        """The profile that missions begin with: the own heat of the IMU is that of the flight, whatever the day."""
        own = {"anchor": None, "same_as": None, "self_heating_c": self.flight.temperature.self_heating_c}
        profile = self.flight.profile
        return profile.model_copy(update={"thermal": profile.thermal.model_copy(update=own)})

    def triads(self, index: int) -> dict[str, list[CompensationModel]]:
        """The compensation models of an instrument, calibrated and refined, one for each accelerometer."""
        measured = (self.chamber, self.population.accelerometers, self.streams(index))
        ovens = self.oven_runs(index, self.plan.oven_runs)
        triads: dict[str, list[CompensationModel]] = {}
        for arm in self.plan.arms:
            if (model := arm.removesuffix(REFINED)) in BUILT_IN:
                fitted = _calibrated(*measured, model)
                triad: list[CompensationModel] = list(fitted) if model == arm else [Refined(one) for one in fitted]
            else:
                triad = [working_model(arm, f"instrument {index}").fit(readings) for readings in _measured(*measured)]
            for model, runs in zip(triad, ovens, strict=True):
                if hasattr(model, "refine"):
                    model.refine(runs)
            triads[arm] = triad
        return triads

    def oven_runs(self, index: int, count: int) -> tuple[list[OvenRun], ...]:
        """The first `count` refinement runs of an instrument in the oven, for each accelerometer."""
        return _oven_runs(self.population, self.oven, self.streams(index), count)


def _of_instruments(missions: Missions | None) -> tuple[Change, ...]:
    """What the sources of difference change in the instruments themselves."""
    changes: list[Change] = []
    for source in (missions.sources if missions else {}).values():
        if isinstance(source, Gyro):
            changes.append(("gyro.thermal_deg_per_h_per_c", source.thermal_deg_per_h_per_c))
        elif isinstance(source, Gradient):
            changes.append(("gradient", source.sigma))
    return tuple(changes)


def beginning(mission: Mission, recording: Recording, alignment: Attitude) -> dict[str, Any]:
    """How `evaluate` is to begin: aligned on the stand, or with the true state at time 0."""
    if alignment == "given":
        return {"start": mission.start(0.0, aligned=True)}
    return {"align_on": standstill_to_align_on(recording)}
