"""The real recordings, what is concealed in each, and its nulls.

Recordings are read where they lie, beside the checkout, and are no part of the project; what is documented of each
stands in its SOURCE.md. Sizes are drawn log-uniformly about one that is ordinary for the grade: of data sheets of
navigation-grade laser gyros (bias 0.01 deg/h, 25 ug; scale factors tens of ppm), of industrial and consumer MEMS (bias
tens to hundreds of deg/h, some mg; scale factors and axes to 1 %), receivers late by tenths of a second, antennas a
metre away.
"""

from __future__ import annotations

import gzip
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmark.worlds.into_data import Applied, apply
from benchmark.worlds.noise import log_uniform
from benchmark.worlds.recorded import Recorded, merged, part

SPREAD = (0.5, 2.0)  # of the ordinary size
STEP_SHARE = (0.3, 0.7)  # of a recording, where something jumps
NULLS = (
    ("first half", lambda one: part(one, 0.0, 0.5)),
    ("second half", lambda one: part(one, 0.5, 1.0)),
    ("middle half", lambda one: part(one, 0.25, 0.75)),
    ("all, two samples as one", lambda one: merged(one, 2)),
    ("first three quarters, two samples as one", lambda one: merged(part(one, 0.0, 0.75), 2)),
    ("last three quarters, two samples as one", lambda one: merged(part(one, 0.25, 1.0), 2)),
)
DEGREES, PER_G = 57.29578, 1.0 / 9.80665


@dataclass(frozen=True)
class Row:
    """An effect that a recording conceals: `nominal` is its ordinary size there; a `fixed` one is not drawn."""

    name: str
    axis: str | None
    nominal: float
    unit: str
    parameters: tuple[tuple[str, str | float], ...] = ()
    fixed: bool = False

    def drawn(self, rng: np.random.Generator, recorded: Recorded) -> Applied:
        value = self.nominal
        if not self.fixed:
            sign = -1.0 if self.name == "recording.clock_step" else rng.choice((-1.0, 1.0))  # stamps must increase
            value = float(f"{sign * value * log_uniform(rng, *SPREAD):.4g}")
        further = dict(self.parameters)
        if self.name.endswith("_step"):
            further["at_s"] = round(recorded.start_s + recorded.seconds * rng.uniform(*STEP_SHARE), 1)
        return Applied(self.name, self.axis, value, self.unit, further)


def _rows(sensor: str, sizes: str) -> tuple[Row, ...]:
    """Rows of one sensor: `law axes size unit` with semicolons between; two axes are own and other."""
    out = []
    for words in sizes.split(";"):
        law, axes, size, unit = words.split()
        further = (("other_axis", axes[1]),) if len(axes) == 2 else ()
        out.append(Row(f"{sensor}.{law}", axes[0], float(size), unit, further))
    return tuple(out)


def _of_file(name: str, axis: str | None, sensor: str, value: float = -1.0, other: str | None = None) -> Row:
    further = (("sensor", sensor), *((("other_axis", other),) if other else ()))
    return Row(f"recording.{name}", axis, value, "factor", further, fixed=True)


CLOCKS = (Row("recording.clock_step", None, 0.15, "s"), Row("recording.clock_drift", None, 1000.0, "ppm"))
INDUSTRIAL_GYRO = (
    "bias z 1000 deg/h; bias_step z 500 deg/h; bias_step x 500 deg/h; scale z 10000 ppm; misalignment xz 8000 urad"
)
INDUSTRIAL_FORCE = "bias x 10000 ug; bias_step x 10000 ug; bias_step z 10000 ug; scale z 10000 ppm"
# the class of the MPU-6000 (InvenSense PS-MPU-6000A): offsets of degrees a second and tens of mg, 3 % scale, 2 % axes
CONSUMER_GYRO = (
    "bias z 5000 deg/h; bias_step z 3600 deg/h; bias_step x 3600 deg/h; scale z 30000 ppm; misalignment xz 20000 urad"
)
CONSUMER_FORCE = "bias_step x 30000 ug; bias_step z 30000 ug; scale z 30000 ppm; misalignment yz 20000 urad"
FLYING = (
    *_rows("gyro", CONSUMER_GYRO),
    *_rows("accelerometer", CONSUMER_FORCE),
    Row("gps.time_offset", None, 0.15, "s"),
    Row("gps.lever_arm", "x", 1.0, "m"),
    *CLOCKS,
    _of_file("axis_sign", "z", "gyro"),
    _of_file("axis_sign", "y", "accelerometer"),
    _of_file("unit", None, "gyro", DEGREES),
    Row("recording.gps_velocity", None, 1.943844, "factor", fixed=True),  # knots for m/s
)


INDUSTRIAL = (
    *_rows("gyro", INDUSTRIAL_GYRO),
    *_rows("accelerometer", INDUSTRIAL_FORCE),
    Row("gps.time_offset", None, 0.15, "s"),
    *CLOCKS,
    _of_file("axis_sign", "z", "gyro"),
    _of_file("axes_exchanged", "x", "gyro", 1.0, "y"),
    _of_file("unit", None, "gyro", DEGREES),
)


@dataclass(frozen=True)
class Source:
    """A real recording: where it lies below ../shared/recordings, how it is imported, what is concealed in it."""

    name: str
    title: str
    file: str
    format: str
    rows: tuple[Row, ...]
    arc_s: float = 10.0  # for which it is navigated by itself; at rest, over which it is averaged
    mapping: str = ""
    beside: tuple[str, ...] = ()  # files that the mapping names


WARM_UP = """
kind = "static"
axes = "FRD"
time = { file = "F00379_Bt.gz", column = 1, unit = "ms" }
gyro = { columns = ["GyroX", "GyroY", "GyroZ"], unit = "rad/s" }
accelerometer = { columns = ["AccX", "AccY", "AccZ"], unit = "m/s^2" }
temperature = { column = "Temp" }
[start]
latitude_deg = 78.22
longitude_deg = 15.65
height_m = 0.0
"""

SOURCES = (
    Source(
        "laser", "Laser gyros in a parked vehicle", "rlg_static_vehicle/lasergyro.imu", "psins-text",
        (
            *_rows("gyro", "bias_step x 5 deg/h; bias_step y 0.5 deg/h; bias_step z 0.5 deg/h;"
                           "bias_drift x 15 (deg/h)/h; bias_drift z 1 (deg/h)/h; bias z 0.5 deg/h"),
            *_rows("accelerometer", "bias_step z 120 ug; bias_step z 60 ug; bias_drift z 400 ug/h;"
                                    "bias_drift z 200 ug/h; bias z 400 ug; scale z 400 ppm"),
            _of_file("axis_sign", "z", "gyro"),
            _of_file("unit", None, "gyro", DEGREES),
            _of_file("unit", None, "accelerometer", PER_G),
        ),
    ),
    Source(
        "drive", "MEMS beside a fibre-optic navigator, driving", "fog_mems_vehicle/transfer_align_fog_mems.mat",
        "psins-mat",
        (
            *_rows("gyro", INDUSTRIAL_GYRO),
            *_rows("accelerometer", INDUSTRIAL_FORCE),
            Row("reference.time_offset", None, 0.05, "s"),
            Row("reference.misalignment", "x", 5000.0, "urad"),
            *CLOCKS,
            _of_file("axis_sign", "z", "gyro"),
            _of_file("axis_sign", "y", "accelerometer"),
            _of_file("axes_exchanged", "x", "gyro", 1.0, "y"),
            _of_file("unit", None, "gyro", DEGREES),
            Row("recording.reference_frame", None, 5.0, "deg"),
        ),
        arc_s=5.0,
    ),
    Source("plane", "MEMS autopilot of an aeroplane", "plane_flight_gps_latency/TestLog2.mat", "apm-mat", FLYING),
    Source("quadcopter", "MEMS autopilot of a quadcopter", "quad_flight_gps_latency/quad106.zip", "apm-text", FLYING),
    Source(
        "warm-up", "Parked MEMS unit warming up", "mems_static_warmup/F00379_B.gz", "csv",
        (
            *_rows("gyro", "bias x 500 deg/h; bias_step x 50 deg/h; bias_step y 50 deg/h; bias_step z 50 deg/h;"
                           "bias_temperature x 20 (deg/h)/degC; bias_temperature y 20 (deg/h)/degC;"
                           "bias_drift y 300 (deg/h)/h"),
            *_rows("accelerometer", "bias_step x 500 ug; bias_step z 1000 ug; bias_temperature x 300 ug/degC;"
                                    "bias_temperature y 300 ug/degC; bias_temperature z 600 ug/degC;"
                                    "bias z 60000 ug"),
            _of_file("unit", None, "gyro", DEGREES),
            _of_file("unit", None, "accelerometer", PER_G),
        ),
        mapping=WARM_UP, beside=("mems_static_warmup/F00379_Bt.gz",),
    ),
    Source(
        "chamber", "MEMS accelerometer in a chamber", "accel_thermal_chamber/Sample_data.csv.gz", "",
        (
            *_rows("accelerometer", "bias_step z 3000 ug; bias_step z 2000 ug; bias_step z 1000 ug;"
                                    "bias_drift z 60000 ug/h; bias_drift z 40000 ug/h;"
                                    "bias_temperature z 600 ug/degC; bias_temperature z 300 ug/degC;"
                                    "bias_temperature_quadratic z 60 ug/degC^2;"
                                    "bias_temperature_rate z 2000 ug/(degC/min);"
                                    "scale_temperature z 600 ppm/degC; scale_temperature_quadratic z 60 ppm/degC^2"),
            _of_file("unit", None, "accelerometer", 1e-3),
        ),
        arc_s=1.0,
    ),
)  # fmt: skip

ROWS_PER_S = 500  # of the chamber, as its authors assume
COUNTS = 1000.0  # pulse/(g s): a milli-g is a pulse


def chamber(path: Path) -> Recorded:
    """Means over a second of the vertical axis at rest: sensor, x, y, z [milli-g], temperature [degC], no times."""
    with gzip.open(path) as file:
        rows = np.loadtxt(file, delimiter=",")
    rows = rows[: len(rows) // ROWS_PER_S * ROWS_PER_S].reshape(-1, ROWS_PER_S, rows.shape[1]).mean(axis=1)
    n = len(rows)
    table = {
        "time_s": np.arange(float(n)), "run": np.zeros(n, dtype=np.int64), "input_g": np.ones(n),
        "rate_c_per_min": np.zeros(n), "temperature_c": rows[:, 4], "output": rows[:, 3],
    }  # fmt: skip
    believed = {"reference_temperature_c": float(rows[0, 4]), "z": {"scale": {"gamma": COUNTS}, "bias": {"k0_ug": 0.0}}}
    return Recorded({"format": "ins-recording/1", "kind": "chamber", "name": "ramp", "accelerometer": believed},
                    {"chamber": table})  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A recording that is diagnosed, and what was done to it."""

    name: str
    kind: str  # unmodified, null or single
    source: Source
    what: str
    recorded: Recorded
    effect: Applied | None = None

    def truth(self, seed: int, of_set: str) -> dict:
        """What only the maker knows; the oracle is added later."""
        effects, channels = [], []
        if self.effect is not None:
            effects, channels = [self.effect.record()], list(self.effect.channels)
        return {
            "case": self.name, "kind": self.kind, "set": of_set, "seed": seed, "source": self.source.name,
            "what": self.what, "recordings": [{"name": self.source.title, "kind": self.recorded.kind}],
            "effects": effects, "channels": channels, "outside": False, "oracle": None,
        }  # fmt: skip


def cases(source: Source, recorded: Recorded, seed: int, late_s: float = 0.0) -> Iterator[Case]:
    """The recording as it is, its nulls, and one case a row; the same seed draws the same sizes.

    `late_s` is how late its fixes are as it is: what is concealed in them happened when they were measured.
    """
    yield Case(f"case-{source.name}-unmodified", "unmodified", source, "as it is", recorded)
    for k, (what, changed) in enumerate(NULLS):
        yield Case(f"case-{source.name}-null-{k}", "null", source, what, changed(recorded))
    word = int.from_bytes(hashlib.sha256(source.name.encode()).digest()[:4], "little")
    rng = np.random.default_rng(np.random.SeedSequence([seed, word]))
    for k, row in enumerate(source.rows):
        effect = row.drawn(rng, recorded)
        name = f"case-{source.name}-hidden-{k:02d}"
        yield Case(name, "single", source, "one effect", apply(recorded, effect, late_s), effect)
