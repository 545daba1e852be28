"""``ins-eval simulate``: a flight, an oven run or a chamber test, written as a recording."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ins_eval.calibration.fits import line
from ins_eval.calibration.four_point import four_point
from ins_eval.commands.flight_report import SHOWN_RATE_HZ
from ins_eval.compensation.file import write_model
from ins_eval.ensemble import OVEN_RATE_HZ, Plan, World
from ins_eval.imu import Mission
from ins_eval.profile import load
from ins_eval.recording import Recording, form
from ins_eval.recording.belief import AxisBelief, Belief, BiasBelief, ScaleBelief


def run(
    kind: str,
    output: Path,
    profile: str = "climb-cruise-landing",
    population: str = "jb-kt8",
    seed: int = 1,
    instrument: int = 0,
    rate_hz: float | None = None,
    axis: str = "x",
    quiet: bool = False,
) -> int:
    """Write one recording of one instrument into `output`; the same seed gives the same bytes.

    A flight at 100 Hz of instrument 0 is the flight that the flight report shows. Beside it, in ``compensation``,
    stand the models calibrated for the instrument; what the recording itself believes is the simple one.
    """
    world = World(Plan(profile=profile, population=population, seed=seed))
    if kind == "chamber":
        unit = world.instrument(instrument).accelerometers["xyz".index(axis)]
        readings = world.chamber.measure(unit, world.streams(instrument), unit_id=f"instrument {instrument}, {axis}")
        form.write_chamber(readings, output, axis)
    else:
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
