"""A flight, an oven run or a chamber test, as a recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from ins_eval.analysis.flight import SHOWN_RATE_HZ
from ins_eval.calibration.fits import line
from ins_eval.calibration.four_point import four_point
from ins_eval.compensation import CompensationModel
from ins_eval.compensation.file import write_model
from ins_eval.ensemble import OVEN_RATE_HZ, Plan, World
from ins_eval.errors import UsageError, did_you_mean
from ins_eval.imu import Mission
from ins_eval.laboratory import Chamber, draw_printed_units
from ins_eval.profile import load
from ins_eval.recording import ChamberReadings, Fixes, Recording, form
from ins_eval.recording.belief import AxisBelief, Belief
from ins_eval.recording.form.names import AIR
from ins_eval.tables import parse
from ins_eval.trajectory import MAX_RATE_HZ, MIN_RATE_HZ

ALL_UNITS = "all"
RAMPS_C_PER_MIN = (0.01, 10.0)  # slower takes weeks, faster is over before its rate can be read
LONGEST_DWELL_S = 3600.0


@dataclass(frozen=True, eq=False)
class Simulated:
    """A simulated recording, the truth of it, and the compensation models calibrated for its instrument, by name."""

    recording: Recording
    truth: Fixes
    models: Mapping[str, list[CompensationModel]]

    def write(self, output: str | Path) -> None:
        """Write the recording as a folder, the models in ``compensation`` beside it."""
        form.write(self.recording, Path(output), truth=self.truth)
        for name, triad in self.models.items():
            write_model(Path(output) / "compensation" / f"{name}.toml", triad)


def simulate(
    profile: str = "climb-cruise-landing",
    kind: Literal["flight", "oven"] = "flight",
    population: str = "jb-kt8",
    seed: int = 1,
    instrument: int = 0,
    rate_hz: float | None = None,
) -> Simulated:
    """One recording of one instrument, on a flight or in an oven with its temperatures.

    A flight at 100 Hz, as it is by default, of instrument 0 is the one that the flight report shows. What the
    recording believes of itself is simple compensation. Raises: UsageError.
    """
    world = World(Plan(profile=profile, population=population, seed=seed))
    rate_hz = (SHOWN_RATE_HZ if kind == "flight" else OVEN_RATE_HZ) if rate_hz is None else rate_hz
    if not MIN_RATE_HZ <= rate_hz <= MAX_RATE_HZ:
        raise UsageError(f"a rate of {rate_hz:g} Hz, expected {MIN_RATE_HZ:g} to {MAX_RATE_HZ:g}; give another --rate")
    mission = Mission(load(profile), rate_hz)
    if kind == "oven":
        mission = mission.in_oven(rate_hz)
    streams = world.streams(instrument)
    node = streams.at("flight") if kind == "flight" else streams.at("oven", 0)
    recording = mission.record(world.instrument(instrument), node)
    recording = replace(recording, belief=_belief(recording, world, instrument))
    return Simulated(recording, mission.truth(mission.trajectory.start_s), world.triads(instrument))


def simulate_chamber(
    chamber: Chamber,
    population: str = "jb-kt8",
    seed: int = 1,
    instrument: int = 0,
    axis: str | None = None,
    unit: str | None = None,
) -> list[ChamberReadings]:
    """What `chamber` reads of the accelerometer `axis` (by default x) of an instrument, or of a printed `unit`.

    The unit "all" is each of the printed ones. The temperature of the air is read, too. Raises: UsageError.
    """
    world = World(Plan(population=population, seed=seed))
    return _readings(chamber, world, instrument, axis, unit)


def chamber_of(ramps_c_per_min: Sequence[float] | None = None, dwell_s: float | None = None) -> Chamber:
    """The chamber of Paper A, with other ramps or another dwell where these are given."""
    lowest, highest = RAMPS_C_PER_MIN
    for ramp in ramps_c_per_min or ():
        if not lowest <= ramp <= highest:
            raise UsageError(f"--ramps {ramp:g}: expected {lowest:g} to {highest:g} degC/min; choose another ramp")
    if dwell_s is not None and not 0.0 <= dwell_s <= LONGEST_DWELL_S:
        raise UsageError(f"--dwell {dwell_s:g}: expected 0 to {LONGEST_DWELL_S:g} s at each degree; choose another")
    given = {"rates_c_per_min": ramps_c_per_min and tuple(ramps_c_per_min), "dwell_s": dwell_s}
    return Chamber(**{key: value for key, value in given.items() if value is not None})


def _readings(
    chamber: Chamber, world: World, instrument: int, axis: str | None, unit: str | None
) -> list[ChamberReadings]:
    """What the chamber reads of an accelerometer, or of each of the printed ones; with the temperature of its air."""
    streams = world.streams(instrument)
    if unit is None:
        axis = axis or "x"
        chosen = {f"instrument {instrument} {axis}": world.instrument(instrument).accelerometers["xyz".index(axis)]}
    else:  # a printed unit sits in no IMU, unless an axis is given
        printed = draw_printed_units(streams, world.population.accelerometers)
        if unit not in (ALL_UNITS, *printed):
            raise UsageError(f"no unit is called '{unit}'{did_you_mean(unit, (*printed, ALL_UNITS))}")
        chosen = {name: one for name, one in printed.items() if unit in (ALL_UNITS, name)}
    measured = [chamber.measure(one, streams, unit_id=name) for name, one in chosen.items()]
    return [replace(readings, axis=axis or "", further={AIR: chamber.air_c}) for readings in measured]


def _belief(recording: Recording, world: World, instrument: int) -> Belief:
    """What the maker believes of it: receiver and barometer of the profile, accelerometers by simple compensation."""
    believed, profile = recording.belief, world.flight.profile
    axes = {}
    for axis, unit in zip("xyz", world.instrument(instrument).accelerometers, strict=True):
        points = four_point(world.chamber.measure(unit, world.streams(instrument)))
        scale = line(points.temperature_c, points.rate_c_per_min, points.scale)
        bias = line(points.temperature_c, points.rate_c_per_min, points.bias_ug)
        found = {
            "scale": {"gamma": scale.coefficients["gamma"], "mu": scale.coefficients["mu"]},
            "bias": {"k0_ug": bias.coefficients["gamma"], "omega_ug_per_c": bias.coefficients["mu"]},
        }
        axes[axis] = parse(AxisBelief, found, f"--population {world.plan.population}, accelerometer {axis} calibrated")
    gps = believed.gps.model_copy(
        update={
            "position_sigma_m": profile.gps.position_sigma_m,
            "velocity_sigma_mps": profile.gps.velocity_sigma_mps,
        }
    )
    return believed.model_copy(
        update={
            "gps": gps,
            "height": believed.height.model_copy(update={"sigma_m": profile.baro.sigma_m}),
            "accelerometer": believed.accelerometer.model_copy(update=axes),
        }
    )
