"""What is asked of each real recording, and what sources that know nothing of the answer say of it.

A source is a document that came with the recording (its `SOURCE.md`), a constant of nature, or a number computed from
the recording without any error model (`benchmark.scores.independent`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmark.scores import independent
from benchmark.worlds.earth import W
from benchmark.worlds.into_data import DEG_PER_H
from benchmark.worlds.recorded import Recorded

Z95 = 1.96
HANDLED_S = 44.0  # of the warm-up: until then the unit was in somebody's hands (SOURCE.md)
QUIET_S = 300.0  # of the laser gyros, without people and engines


@dataclass(frozen=True)
class Said:
    """What a source says of an effect: value and one sigma in the unit of the effect."""

    name: str
    axis: str | None
    value: float
    sigma: float
    unit: str
    source: str


@dataclass(frozen=True)
class Study:
    """One diagnosis of a recording: what is wrong with it or was removed from its belief, and what others say."""

    source: str
    name: str
    what: str
    change: Callable[[Recorded], Recorded] = lambda recorded: recorded
    said: Callable[[Recorded], list[Said]] = lambda recorded: []
    silent_about: str = ""  # a part of a name that must not be named: the study is a control


def _no_rotation(recorded: Recorded) -> Recorded:
    out = recorded.copy()
    out.head["earth"]["rotation"] = False
    return out


def _no_offsets(recorded: Recorded) -> Recorded:
    out = recorded.copy()
    out.head["gyro"]["bias_radps"] = [0.0, 0.0, 0.0]
    return out


def another_time(recorded: Recorded) -> Recorded:
    """The temperature shifted circularly by half its length: the same curve at another time."""
    out = recorded.copy()
    table = out.tables["chamber" if out.kind == "chamber" else "imu"]
    table["temperature_c"] = np.roll(table["temperature_c"], table["temperature_c"].size // 2)
    return out


def _turning(recorded: Recorded) -> list[Said]:
    rate = independent.earth_rate(recorded, *independent.longest_quiet(recorded, QUIET_S))
    words = f"magnitude of the mean rate of the three gyros in {QUIET_S:g} quiet seconds, over that of the Earth"
    return [
        Said("earth.rotation", None, 1.0, 0.005, "fraction", "the Earth turns (WGS-84)"),
        Said("earth.rotation", None, rate / W, 0.005, "fraction", words),
    ]


def _clock_of_drive(recorded: Recorded) -> list[Said]:
    scan = independent.rate_scan(recorded)
    words = "scan of delays: rates of the two boxes, no navigation"
    authors = "the authors' installation angles, in our axes"
    return [
        Said("reference.time_offset", None, scan.best_s, max(scan.sigma_s, 2e-4), "s", words),
        Said("reference.misalignment", "y", 1540.0, 250.0, "urad", authors),
        Said("reference.misalignment", "z", -5110.0, 250.0, "urad", authors),
    ]


AUTHORS_RADPS = (0.000770503, -0.00103577, -0.000409542)  # of the drive: eb0 of the file, turned to our axes


def _offsets_of_drive(recorded: Recorded) -> list[Said]:
    offsets = [
        Said("gyro.bias", axis, value / DEG_PER_H, 20.0, "deg/h", "the authors' constants of this run")
        for axis, value in zip("xyz", AUTHORS_RADPS, strict=True)
    ]
    return [*_clock_of_drive(recorded), *offsets]


def _late_gps(value: float, sigma: float) -> Callable[[Recorded], list[Said]]:
    def said(recorded: Recorded) -> list[Said]:
        scan = independent.velocity_scan(recorded)
        name, sources = (
            "gps.time_offset",
            ("SOURCE.md: scan by others", "scan of delays: changes of velocity, no navigation"),
        )
        return [
            Said(name, None, value, sigma, "s", sources[0]),
            Said(name, None, scan.best_s, scan.sigma_s, "s", sources[1]),
        ]

    return said


def _laws_of_warm_up(recorded: Recorded) -> list[Said]:
    words = f"line through means of {independent.MEAN_S:g} s against temperature"
    units = {"accelerometer": "ug/degC", "gyro": "(deg/h)/degC"}
    return [
        Said(f"{one.name}.bias_temperature", one.axis, one.slope, one.sigma, units[one.name], words)
        for one in independent.temperature_lines(recorded, HANDLED_S)
        if abs(one.slope) > 5.0 * one.sigma
    ]


STUDIES = (
    Study("laser", "as it is", "Nothing was changed. Parked for half an hour, with people and engines at both ends. "
          "The belief is what import finds at rest."),
    Study("laser", "the Earth does not turn", "Removed from the model: the rotation of the Earth.", _no_rotation,
          _turning),
    Study("drive", "as it is", "Nothing was changed. The offset of the two clocks and the alignment of the two boxes "
          "are not in the belief; the authors' gyro biases are.", said=_clock_of_drive),
    Study("drive", "gyro biases not believed", "Also removed from the belief: the authors' gyro biases.", _no_offsets,
          _offsets_of_drive),
    Study("plane", "as it is", "Nothing was changed. The time stamps are those of reception; their delay is not in the "
          "belief.", said=_late_gps(0.29, 0.011)),
    Study("quadcopter", "as it is", "Nothing was changed. Late time stamps, as in the aeroplane, on a gentler flight "
          "with much vibration.", said=_late_gps(0.20, 0.018)),
    Study("warm-up", "as it is", "Nothing was changed. The unit warms up by 6 °C on its own; the belief has no bias "
          "over temperature. One ramp does not separate temperature from time, nor curvature from rate (SOURCE.md).",
          said=_laws_of_warm_up),
    Study("warm-up", "temperatures shifted in time", "Control: the temperatures are shifted circularly by half of the "
          "recording, so that the errors do not depend on them.", another_time, silent_about="temperature"),
    Study("chamber", "as it is", "The belief has a constant bias and nothing that depends on temperature."),
    Study("chamber", "temperatures shifted in time", "Control: the temperatures are shifted circularly by half of the "
          "recording.", another_time, silent_about="temperature"),
)  # fmt: skip


@dataclass(frozen=True)
class Other:
    """A recording that is not diagnosed: what is done with it, and what its sources say."""

    title: str
    file: str
    format: str
    what: str
    said: str
    mapping: str = ""


RAF = """
kind = "flight"
axes = "FRD"
[solution]
time = { column = "Time", unit = "s" }
velocity = { columns = ["VNS", "VEW"], axes = "NE" }
attitude = { columns = ["ROLL", "PITCH", "THDG"], unit = "deg" }
position = { columns = ["LATC", "LONC", "GGALT"], unit = "deg" }
[gps]
time = { column = "Time", unit = "s" }
velocity = { columns = ["GGVNS", "GGVEW"], axes = "NE" }
"""

OTHERS = (
    Other("Rocket", "rocket_flight_temperature/imu.csv.gz", "cats",
          "0.7 s before lift-off, and a receiver that gives no height, no velocity and, during the boost, no fix.",
          "SOURCE.md: no part at rest, so it proves little; a refusal is right."),
    Other("An aircraft INS's own solution", "irs_solution_flight/RAFdata.nc", "netcdf",
          "No IMU: the solution of a navigation-grade system beside GPS, 5 min at 1 Hz. It is evaluated only.",
          "SOURCE.md: mean of inertial less GPS velocity −0.059 m/s north, −0.052 m/s east.", RAF),
    Other("PX4 log", "log_formats/px4_sample.ulg.gz", "ulog",
          "68 s of an autopilot, with gaps; kept for its format.", "SOURCE.md: no documented constants."),
    Other("ArduPilot log", "log_formats/ardupilot_test.BIN", "dataflash", "45 samples; kept for its format.",
          "SOURCE.md: too short for a verdict."),
)  # fmt: skip
