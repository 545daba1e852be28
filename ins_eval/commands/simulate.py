"""``ins-eval simulate``: a flight, an oven run or a chamber test, written as a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ins_eval.calibration.fits import line
from ins_eval.calibration.four_point import four_point
from ins_eval.commands.flight_study import SHOWN_RATE_HZ
from ins_eval.compensation.file import write_model
from ins_eval.ensemble import OVEN_RATE_HZ, Plan, World
from ins_eval.errors import UsageError, did_you_mean
from ins_eval.imu import Mission
from ins_eval.laboratory import Chamber, draw_printed_units
from ins_eval.profile import load
from ins_eval.recording import ChamberReadings, Recording, form
from ins_eval.recording.belief import AxisBelief, Belief, BiasBelief, ScaleBelief

ALL_UNITS = "all"
RAMPS_C_PER_MIN = (0.01, 10.0)  # slower takes weeks, faster is over before its rate can be read
LONGEST_DWELL_S = 3600.0


def run(
    kind: str,
    output: Path,
    profile: str = "climb-cruise-landing",
    population: str = "jb-kt8",
    seed: int = 1,
    instrument: int = 0,
    rate_hz: float | None = None,
    axis: str | None = None,
    unit: str | None = None,
    ramps_c_per_min: Sequence[float] | None = None,
    dwell_s: float | None = None,
    quiet: bool = False,
) -> int:
    """Write one recording of one instrument into `output`; the same seed gives the same bytes.

    A flight at 100 Hz of instrument 0 is the flight that the flight report shows. Beside it, in ``compensation``,
    stand the models calibrated for the instrument; what the recording itself believes is the simple one.
    A chamber holds the accelerometer `axis` (by default x) of the instrument, or the printed `unit` of that name, or
    "all" of these in one table.
    """
    world = World(Plan(profile=profile, population=population, seed=seed))
    if kind == "chamber":
        chamber = _chamber(ramps_c_per_min, dwell_s)
        form.write_chamber(_readings(chamber, world, instrument, axis, unit), output)
    else:
        of_chamber = {"--axis": axis, "--unit": unit, "--ramps": ramps_c_per_min, "--dwell": dwell_s}
        if wrong := [option for option, value in of_chamber.items() if value is not None]:
            raise UsageError(f"simulate {kind}: {wrong[0]} is of a chamber; leave it away or simulate a chamber")
        rate_hz = rate_hz or (SHOWN_RATE_HZ if kind == "flight" else OVEN_RATE_HZ)
        mission = Mission(load(profile), rate_hz)
        if kind == "oven":
            mission = mission.in_oven(rate_hz)
        streams = world.streams(instrument)
        node = streams.at("flight") if kind == "flight" else streams.at("oven", 0)
        recording = mission.record(world.instrument(instrument), node)
        recording = replace(recording, belief=_belief(recording, world, instrument))
        form.write(recording, output, truth=mission.truth(mission.trajectory.start_s))
        for arm, triad in world.triads(instrument).items():
            write_model(output / "compensation" / f"{arm}.toml", triad)
    if not quiet:
        print(f"recording: {output}")
    return 0


def _chamber(ramps_c_per_min: Sequence[float] | None, dwell_s: float | None) -> Chamber:
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
    return [replace(readings, axis=axis or "", further={"chamber_c": chamber.air_c}) for readings in measured]


def _belief(recording: Recording, world: World, instrument: int) -> Belief:
    """What the maker believes of it: receiver and barometer of the profile, accelerometers by simple compensation."""
    believed, profile = recording.belief, world.flight.profile
    axes = {}
    for axis, unit in zip("xyz", world.instrument(instrument).accelerometers, strict=True):
        points = four_point(world.chamber.measure(unit, world.streams(instrument)))
        scale = line(points.temperature_c, points.rate_c_per_min, points.scale)
        bias = line(points.temperature_c, points.rate_c_per_min, points.bias_ug)
        axes[axis] = AxisBelief(
            scale=ScaleBelief(gamma=scale.coefficients["gamma"], mu=scale.coefficients["mu"]),
            bias=BiasBelief(k0_ug=bias.coefficients["gamma"], omega_ug_per_c=bias.coefficients["mu"]),
        )
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
