"""Files as users have them: the same motions in several formats, each with one or two mistakes in it.

The motions are those of `benchmark.worlds`, a world that shares no line with the tool: a car and an aeroplane of some
minutes with a MEMS unit and a receiver. A quirk changes the columns before they are written; what the doctor must say
of it is a pattern of words.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from benchmark.worlds import trajectories, world
from tests.recording import corpus_logs

DEG = np.pi / 180.0
G0 = 9.80665
RATE_HZ, GPS_HZ, LASTED_S = 50, 5, 150.0
GAMMA = 3e5  # pulse/(g s)
GYRO_NOISE, GYRO_BIAS = 0.05 * DEG, np.array([0.2, -0.03, 0.3]) * DEG  # rad/s at 50 Hz, rad/s
FORCE_NOISE, FORCE_BIAS = 0.03, np.array([0.05, -0.08, 0.06])  # m/s^2
POSITION_NOISE_M, VELOCITY_NOISE_MPS, ATTITUDE_NOISE = 1.0, 0.05, 0.1 * DEG
CORRELATION_S = 30.0  # of the position's error


@dataclass(frozen=True)
class Columns:
    """What a recorder holds: rates in rad/s and m/s^2 at time_s; fixes in rad, m and m/s; attitude of a reference."""

    kind: str
    time_s: np.ndarray
    gyro: np.ndarray
    force: np.ndarray
    temperature_c: np.ndarray
    baro_m: np.ndarray
    fix_s: np.ndarray
    latitude: np.ndarray
    longitude: np.ndarray
    height_m: np.ndarray
    velocity: np.ndarray
    attitude: np.ndarray
    start: tuple[float, float, float]  # latitude and longitude in deg, height in m, known apart
    course_scale: float = 1.0  # of the degrees written; 1 / 57.3 is radians
    lever_m: float = 0.0
    gamma: float = GAMMA


# name of a motion: trajectory, its seed, where the part begins
MOTIONS = {"car": ("drive", 1, 990.0), "van": ("drive", 2, 1040.0), "aeroplane": ("box", 3, 990.0)}


@cache
def motion(name: str, seed: int = 0) -> Columns:
    """`LASTED_S` of a motion as the sensors show it; `seed` draws the noise."""
    trajectory, draw, begin_s = MOTIONS[name]
    kind, make = trajectories.TRAJECTORIES[trajectory]
    truth = make(np.random.default_rng(draw))
    rng = np.random.default_rng([seed, draw])
    angle, speed = _increments(trajectory, draw)
    rows = slice(round(begin_s * RATE_HZ), round((begin_s + LASTED_S) * RATE_HZ))
    n = rows.stop - rows.start
    time_s = np.arange(1, n + 1) / RATE_HZ
    lla, velocity, euler, _ = truth.state(begin_s + np.arange(round(LASTED_S * GPS_HZ)) / GPS_HZ)
    m = len(lla)
    step = np.exp(-1.0 / (GPS_HZ * CORRELATION_S))
    error = np.zeros((m, 3))
    for k in range(m):
        error[k] = step * error[k - 1] + np.sqrt(1.0 - step**2) * POSITION_NOISE_M * rng.standard_normal(3)
    height = truth.state(begin_s + time_s)[0][:, 2]
    # rates at the end of a sample: the mean of the samples on both sides
    gyro, force = (RATE_HZ * 0.5 * (one[rows] + one[rows.start + 1 : rows.stop + 1]) for one in (angle, speed))
    return Columns(
        kind,
        time_s,
        gyro + GYRO_BIAS + GYRO_NOISE * rng.standard_normal((n, 3)),
        force + FORCE_BIAS + FORCE_NOISE * rng.standard_normal((n, 3)),
        30.0 + 0.01 * time_s + 0.05 * rng.standard_normal(n),
        height + 1.0 + 0.3 * rng.standard_normal(n),
        np.arange(m) / GPS_HZ,
        lla[:, 0] + error[:, 0] / 6.37e6,
        lla[:, 1] + error[:, 1] / (6.37e6 * np.cos(lla[:, 0])),
        lla[:, 2] + error[:, 2],
        velocity + VELOCITY_NOISE_MPS * rng.standard_normal((m, 3)),
        euler + ATTITUDE_NOISE * rng.standard_normal((m, 3)),
        (float(np.degrees(lla[0, 0])), float(np.degrees(lla[0, 1])), float(lla[0, 2])),
    )


@cache
def _increments(trajectory: str, draw: int):
    return world.increments(trajectories.TRAJECTORIES[trajectory][1](np.random.default_rng(draw)), float(RATE_HZ))


# ------------------------------------------------------------------------------------------------ quirks


@dataclass(frozen=True)
class Quirk:
    """A mistake: what it does to the columns, what names it, and which formats can have it."""

    name: str
    spoil: Callable[[Columns], Columns]
    named: str  # a pattern of the sentence
    formats: tuple[str, ...] = ("csv", "csv-attitude", "form", "apm-text", "psins-mat")

    @property
    def logs(self) -> tuple[str, ...]:
        """The logs of `corpus_logs` that can have it."""
        return LOGS[OF[self.name]] if self.name in OF else ()


def _imu(gyro=None, force=None) -> Callable[[Columns], Columns]:
    """Gyros and accelerometers multiplied by a number or a matrix."""

    def by(values, change):
        if change is None:
            return values
        return values * change if np.ndim(change) == 0 else values @ np.asarray(change, float).T

    return lambda c: replace(c, gyro=by(c.gyro, gyro), force=by(c.force, force))


def _velocity(matrix) -> Callable[[Columns], Columns]:
    change = np.asarray(matrix, float)
    return lambda c: replace(c, velocity=c.velocity * change if change.ndim == 0 else c.velocity @ change.T)


def _one(column: str, value: float, at: float = 0.5, axis: int | None = None) -> Callable[[Columns], Columns]:
    def spoil(c: Columns) -> Columns:
        values = getattr(c, column).copy()
        k = int(at * len(values))
        values[k if axis is None else (k, axis)] = value
        return replace(c, **{column: values})

    return spoil


def _held(column: str, axis: int, end: float) -> Callable[[Columns], Columns]:
    def spoil(c: Columns) -> Columns:
        values = getattr(c, column).copy()
        part = slice(int(0.4 * len(values)), int(end * len(values)))
        values[part, axis] = values[part.start, axis]
        return replace(c, **{column: values})

    return spoil


def _clipped(c: Columns) -> Columns:
    limit = np.quantile(np.abs(c.gyro[:, 2]), 0.97)
    return replace(c, gyro=np.column_stack([c.gyro[:, :2], np.clip(c.gyro[:, 2], -limit, limit)]))


# logs that can have a quirk, by what of them it spoils: the IMU, a single IMU value, the velocity, its sign of down,
# the course, the position, a single value of the fixes, the clock, the temperature, the barometer
GPS_LOGS = ("ulog", "dataflash", "novatel", "kf-gins", "rtklib", "nmea", "rosbag", "mat", "netcdf")
LOGS = {
    "imu": ("ulog", "dataflash", "novatel", "kf-gins", "nmea", "euroc", "rosbag", "mat", "netcdf"),
    "imu value": ("ulog", "kf-gins", "rosbag", "mat", "netcdf"),
    "velocity": GPS_LOGS,
    "down": tuple(name for name in GPS_LOGS if name != "nmea"),
    "course": ("dataflash", "novatel", "nmea"),
    "position": GPS_LOGS,
    "value": ("ulog", "kf-gins", "rtklib", "rosbag", "mat", "netcdf"),
    "clock": (*GPS_LOGS, "euroc"),
    "temperature": ("dataflash", "mat", "netcdf"),
    "table": ("mat", "netcdf"),
}
OF = {
    **dict.fromkeys(("gyro deg/s", "gyro deg/h", "gyro rad/s as deg/s", "force g", "force mg", "both swapped",
                     "both sign of x", "both FLU", "both turned", "sign of gyro z", "gyros swapped", "sign of force y",
                     "sign of force x"), "imu"),
    **dict.fromkeys(("dead gyro", "stuck force", "clipped gyro"), "imu value"),
    **dict.fromkeys(("sign of east", "velocity swapped", "km/h", "knots"), "velocity"),
    **dict.fromkeys(("latitude and longitude", "position in rad"), "position"),
    **dict.fromkeys(("velocity outlier", "latitude outlier", "height outlier"), "value"),
    **dict.fromkeys(("clock jump", "clock offset"), "clock"),
    **dict.fromkeys(("temperature outlier", "mild temperature outlier"), "temperature"),
    **dict.fromkeys(("baro", "baro in feet"), "table"),
    "sign of down": "down",
    "course in rad": "course",
}  # fmt: skip
SWAP = [[0, 1, 0], [1, 0, 0], [0, 0, 1]]
WITHOUT_PSINS = ("csv", "csv-attitude", "form", "apm-text")
DEGREES = 1.0 / DEG
QUIRKS = [
    Quirk("gyro deg/s", _imu(gyro=DEGREES), r"gyro\.unit=deg(/s)? |gyros by 0\.01745|deg.* read as rad"),
    Quirk(
        "gyro deg/h",
        _imu(gyro=3600.0 * DEGREES),
        r"gyro\.unit=deg/h|gyros by 4\.848\d*e-06|degrees read as radians|check its unit",
    ),
    Quirk("gyro rad/s as deg/s", _imu(gyro=DEG), r"gyros by 57\.29"),
    Quirk(
        "force g",
        _imu(force=1.0 / G0),
        r"accelerometer\.unit=g|g read as m/s\^2|g given for m/s|ers by 9\.80",
    ),
    Quirk("force mg", _imu(force=1e3 / G0), r"accelerometer\.unit=milli-g|milli-g read|accelerometers by 0\.0098"),
    Quirk("both swapped", _imu(SWAP, SWAP), r"x=y,y=x,z=z|left-handed"),
    Quirk("both sign of x", _imu(np.diag([-1, 1, 1]), np.diag([-1, 1, 1])), r"x=-x,y=y,z=z|left-handed"),
    Quirk(
        "both FLU",
        _imu(np.diag([1, -1, -1]), np.diag([1, -1, -1])),
        r"x=x,y=-y,z=-z|axes=x=y,y=-x,z=z|axes=x=z,y=-y,z=x|axes=x=x,y=y,z=z",
    ),
    Quirk(
        "both turned",
        _imu([[0, 1, 0], [-1, 0, 0], [0, 0, 1]], [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
        r"x=-y,y=x,z=z|axes=x=-x,y=y,z=-z",
    ),
    Quirk("sign of gyro z", _imu(gyro=np.diag([1, 1, -1])), r"gyros are x=x,y=y,z=-z"),
    Quirk("gyros swapped", _imu(gyro=SWAP), r"gyros are x=y,y=x,z=z"),
    Quirk("sign of force y", _imu(force=np.diag([1, -1, 1])), r"accelerometers are x=-?x,y=-y,z=z"),
    Quirk("sign of force x", _imu(force=np.diag([-1, 1, 1])), r"accelerometers are x=-x,y=-?y,z=z"),
    Quirk("sign of down", _velocity(np.diag([1, 1, -1])), r"north, -?east, -down"),
    Quirk("sign of east", _velocity(np.diag([1, -1, 1])), r"north, -east, -?down", WITHOUT_PSINS),
    Quirk("velocity swapped", _velocity(SWAP), r"is east, north, down", WITHOUT_PSINS),
    Quirk("km/h", _velocity(3.6), r"velocity is in km/h"),
    Quirk("knots", _velocity(3600.0 / 1852.0), r"velocity is in knots"),
    Quirk("course in rad", lambda c: replace(c, course_scale=DEG), r"course is in radians", ("csv-course", "apm-text")),
    Quirk(
        "latitude and longitude",
        lambda c: replace(c, latitude=c.longitude, longitude=c.latitude),
        r"exchanged|order of the columns|column latitude_deg: .* expected -90 to 90",
    ),
    Quirk(
        "position in rad",
        lambda c: replace(c, latitude=DEG * c.latitude, longitude=DEG * c.longitude),
        r"radians read as degrees|position\.unit=rad|degrees or radians",
        ("csv", "csv-attitude", "form", "apm-text"),
    ),
    Quirk(
        "attitude in rad",
        lambda c: replace(c, attitude=DEG * c.attitude),
        r"attitude\.unit|radians read as degrees|fits it as radians",
        ("csv-attitude",),
    ),
    Quirk(
        "clock jump",
        lambda c: replace(c, fix_s=c.fix_s + 0.3 * (c.fix_s > 0.55 * LASTED_S)),
        r"jump.*[ +]0\.(2[5-9]|3[0-5])\d* s|a clock drifts or jumps",
    ),
    Quirk(
        "clock offset",
        lambda c: replace(c, fix_s=c.fix_s + 0.4),
        r"same instant are \+0\.(3[2-9]|4[0-8])|does not show their offset",
    ),
    Quirk("temperature outlier", _one("temperature_c", 1e5), r"temperature_c: (1e\+05|100000)", ("csv", "form")),
    Quirk("mild temperature outlier", _one("temperature_c", 85.0), r"temperature_c: 85", ("csv", "form")),
    Quirk(
        "velocity outlier", _one("velocity", 3000.0, axis=0), r"velocity_n_mps: 3000", ("csv", "csv-attitude", "form")
    ),
    Quirk("latitude outlier", _one("latitude", 0.0), r"latitude_deg: 0", ("csv", "csv-attitude", "form", "psins-mat")),
    Quirk("height outlier", _one("height_m", 9e4), r"height_m: 90000"),
    Quirk("baro", lambda c: replace(c, baro_m=c.baro_m + 1e9), r"height_baro_m: 1e\+09", ("csv", "form")),
    Quirk(
        "baro in feet",
        lambda c: replace(c, baro_m=c.baro_m / 0.3048),
        r"it is in feet|height_baro_m is \d+ m above",
        ("csv", "form"),
    ),
    Quirk("lever arm", lambda c: replace(c, lever_m=1e6), r"lever_arm_m is 1e\+06", ("form", "form-pulse")),
    Quirk("gamma", lambda c: replace(c, gamma=2.0 * GAMMA), r"accelerometers by 2|scale|gamma", ("form-pulse",)),
    Quirk("dead gyro", _held("gyro", 2, 1.0), r"gyro z channel holds one value", ("csv", "form")),
    Quirk("stuck force", _held("force", 0, 0.5), r"accelerometer x channel holds one value", ("csv", "form")),
    Quirk("clipped gyro", _clipped, r"gyro z channel is at its|gyro z channel holds one value", ("csv", "form")),
]


# ------------------------------------------------------------------------------------------------ formats


def _text(columns: np.ndarray, names: str = "") -> bytes:
    text = io.StringIO()
    np.savetxt(text, columns, fmt="%.10g", delimiter=",")
    return (names + "\n" if names else "").encode() + text.getvalue().encode()


CSV = """kind = "{kind}"
axes = "FRD"
time = {{ column = "t", unit = "s" }}
gyro = {{ columns = ["wx", "wy", "wz"], unit = "rad/s" }}
accelerometer = {{ columns = ["ax", "ay", "az"], unit = "m/s^2" }}
temperature = {{ column = "temp" }}
height_baro = {{ column = "baro" }}
[{table}]
file = "fixes.csv"
time = {{ column = "t", unit = "s" }}
position = {{ columns = ["lat", "lon", "h"], unit = "deg" }}
velocity = {{ columns = ["a", "b", "c"], axes = "{axes}" }}
{attitude}
"""


def write_csv(c: Columns, folder: Path, course: bool = False, attitude: bool = False) -> Path:
    imu = np.column_stack([c.time_s, c.gyro, c.force, c.temperature_c, c.baro_m])
    (folder / "log.csv").write_bytes(_text(imu, "t,wx,wy,wz,ax,ay,az,temp,baro"))
    north, east, down = c.velocity.T
    course_deg = c.course_scale * (np.degrees(np.arctan2(east, north)) % 360.0)
    velocity = np.column_stack([np.hypot(north, east), course_deg, down]) if course else c.velocity
    place = [np.degrees(c.latitude), np.degrees(c.longitude), c.height_m]
    fixes = np.column_stack([c.fix_s, *place, velocity, np.degrees(c.attitude)])
    (folder / "fixes.csv").write_bytes(_text(fixes, "t,lat,lon,h,a,b,c,roll,pitch,heading"))
    mapping = CSV.format(
        kind=c.kind,
        table="reference" if attitude else "gps",
        axes="speed course down" if course else "NED",
        attitude='attitude = { columns = ["roll", "pitch", "heading"], unit = "deg" }' if attitude else "",
    )
    (folder / "log.toml").write_text(mapping)
    return folder / "log.csv"


FORM = """format = "ins-recording/1"
kind = "{kind}"
[imu]
gyro = "{gyro}"
accelerometer = "{force}"
[start]
time_s = 0.0
latitude_deg = {latitude}
longitude_deg = {longitude}
height_m = {height}
[gps]
lever_arm_m = [{lever}, 0.0, 0.0]
{axes}
"""


def write_form(c: Columns, folder: Path, pulses: bool = False) -> Path:
    gyro, force = (c.gyro / RATE_HZ, np.rint(c.force / (G0 * RATE_HZ) * GAMMA)) if pulses else (c.gyro, c.force)
    axes = "[accelerometer]\n" + "\n".join(f"{a} = {{ scale = {{ gamma = {c.gamma} }} }}" for a in "xyz")
    (folder / "recording.toml").write_text(
        FORM.format(
            kind=c.kind,
            gyro="increment" if pulses else "rate",
            force="pulse" if pulses else "rate",
            latitude=c.start[0],
            longitude=c.start[1],
            height=c.start[2],
            lever=c.lever_m,
            axes=axes if pulses else "",
        )
    )
    imu = np.column_stack([c.time_s, gyro, force, c.temperature_c, c.baro_m])
    names = "time_s,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,temperature_c,height_baro_m"
    (folder / "imu.csv").write_bytes(_text(imu, names))
    gps = np.column_stack([c.fix_s, np.degrees(c.latitude), np.degrees(c.longitude), c.height_m, c.velocity])
    names = "time_s,latitude_deg,longitude_deg,height_m,velocity_n_mps,velocity_e_mps,velocity_d_mps"
    (folder / "gps.csv").write_bytes(_text(gps, names))
    return folder


def write_apm(c: Columns, folder: Path) -> Path:
    ms, fix_ms, zeros = 1e3 * c.time_s, 1e3 * c.fix_s, np.zeros(len(c.fix_s))
    north, east, down = c.velocity.T
    course_deg = c.course_scale * (np.degrees(np.arctan2(east, north)) % 360.0)
    place = [np.degrees(c.latitude), np.degrees(c.longitude), c.height_m, c.height_m]
    tables = {
        "IMU": [ms, ms, c.gyro, c.force],
        "GPS": [fix_ms, zeros + 3, *[zeros] * 4, *place, np.hypot(north, east), course_deg, down, zeros],
        "ATT": [fix_ms, fix_ms, np.degrees(c.attitude), zeros, zeros],
    }
    with zipfile.ZipFile(folder / "log.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for name, columns in tables.items():
            archive.writestr(f"{name}.txt", _text(np.column_stack(columns)).replace(b",", b" "))
    return folder / "log.zip"


def write_psins(c: Columns, folder: Path) -> Path:
    import scipy.io

    rfu = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1.0]])
    increments = [(0.5 * (one[1:] + one[:-1]) / RATE_HZ) @ rfu.T for one in (c.gyro, c.force)]
    roll, pitch, heading = c.attitude.T
    north, east, down = c.velocity.T
    place = [c.latitude, c.longitude, c.height_m]
    constants = {name: np.array([[0.0], [0.0], [0.0]]) for name in ("eb0", "db0", "mu0")}
    scipy.io.savemat(
        folder / "log.mat",
        {
            "mimu": np.column_stack([*increments, c.time_s[1:]]),
            "fogavp": np.column_stack([pitch, roll, -heading, east, north, -down, *place, c.fix_s])[1:],
            **constants,
        },
    )
    return folder / "log.mat"


# name of a way to write: the reader's format, the function, what a user states beside the file
WRITERS = {
    "csv": ("csv", write_csv, corpus_logs.nothing),
    "csv-course": ("csv", lambda c, folder: write_csv(c, folder, course=True), corpus_logs.nothing),
    "csv-attitude": ("csv", lambda c, folder: write_csv(c, folder, attitude=True), corpus_logs.nothing),
    "form": ("ins-recording", write_form, corpus_logs.nothing),
    "form-pulse": ("ins-recording", lambda c, folder: write_form(c, folder, pulses=True), corpus_logs.nothing),
    "apm-text": ("apm-text", write_apm, corpus_logs.nothing),
    "psins-mat": ("psins-mat", write_psins, corpus_logs.nothing),
    **corpus_logs.WRITERS,
}


@dataclass(frozen=True)
class File:
    """A file of the corpus: a motion, a way to write it, and its quirks."""

    motion: str
    writer: str
    quirks: tuple[Quirk, ...]

    @property
    def name(self) -> str:
        return f"{self.motion}, {self.writer}: {' and '.join(one.name for one in self.quirks) or 'sound'}"

    def write(self, folder: Path) -> tuple[str, Path, dict[str, str]]:
        """The reader's format, the file, and what a user states beside it."""
        columns = motion(self.motion)
        for quirk in self.quirks:
            columns = quirk.spoil(columns)
        form, write, stated = WRITERS[self.writer]
        folder.mkdir(parents=True, exist_ok=True)
        return form, write(columns, folder), stated(columns, folder)


def singles(logs: bool = False) -> Iterator[File]:
    """Every quirk in every format that can have it, the motion changing from one to the next."""
    for k, quirk in enumerate(QUIRKS):
        for j, writer in enumerate(quirk.logs if logs else quirk.formats):
            yield File(list(MOTIONS)[(k + j) % 3], writer, (quirk,))


def pairs(count: int = 40, logs: bool = False) -> Iterator[File]:
    """Two quirks in one file."""
    rng = np.random.default_rng(22 if logs else 21)
    while count:
        one, other = (QUIRKS[k] for k in rng.choice(len(QUIRKS), 2, replace=False))
        if one.name.split()[0] == other.name.split()[0] and one.name.split()[0] in ("gyro", "force"):
            continue  # two units of one sensor make a third
        of = [quirk.logs if logs else quirk.formats for quirk in (one, other)]
        if common := [writer for writer in of[0] if writer in of[1]]:
            yield File(list(MOTIONS)[count % 3], common[int(rng.integers(len(common)))], (one, other))
            count -= 1


def sound() -> Iterator[File]:
    """Every motion in every way to write it, without a mistake."""
    for name in MOTIONS:
        for writer in WRITERS:
            yield File(name, writer, ())
