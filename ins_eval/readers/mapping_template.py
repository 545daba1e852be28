"""A mapping file made for the columns of a table, to be completed by whoever knows the instrument."""

from __future__ import annotations

import re

import numpy as np

from ins_eval.errors import InsEvalError
from ins_eval.readers.columns import DATE, Columns, is_number
from ins_eval.units import STANDARD_GRAVITY

UNKNOWN = "?"
MOST_LISTED = 200
COLUMN = re.compile(r"[^\[]+\[\d+\]")
TIME = re.compile(r"(t|ts|time|times|timestamp|stamp|sec|secs|seconds|timems|timeus|timens|timestampn?s|timestampms)")
GYRO = r"(imu)?(gyro(scope)?|gyr|omega|ang(ular)?(vel(ocity)?|rate)|rotationrate|rate)"
ACCELEROMETER = r"(imu)?(acc(el)?(eration|erometer)?|lin(ear)?acc(el)?(eration)?|specificforce|force)"
SHORT = {"gyro": ("g", "w"), "accelerometer": ("a", "f")}
DEGREES = re.compile(r"deg|dps")
TEMPERATURE = re.compile(r"(imu)?temp(erature)?(c|degc)?")
FORCE_UNITS = {"m/s^2": STANDARD_GRAVITY, "g": 1.0, "milli-g": 1000.0}
TIME_STEPS = {"s": 0.5, "ms": 500.0, "us": 5e5, "ns": np.inf}  # the largest step that looks like the unit

TEXT = """\
# Columns found: {found}
kind = "static"            # static: parked | oven: parked, the temperature varies | drive | flight
axes = "FRD"               # where x, y, z point: Forward Backward Right Left Down Up{up_note}
                           # or three equations, ours = yours: "x=y,y=x,z=-z"
{header}
[time]
column = {time}
{time_unit}# s, ms, us, ns, date, date day first, date month first; week = "w" where it counts from a GPS week

[gyro]
columns = [{gyro}]
{gyro_unit}# rates: rad/s, deg/s, deg/h; increments over the sample: rad, deg, arcsec

[accelerometer]
columns = [{accelerometer}]
{force_unit}# rates: m/s^2, g, milli-g; increments over the sample: m/s, g s{force_note}

{temperature}[temperature]            # degC
{temperature}column = {temperature_column}

[start]                    # where it begins; leave it out where [gps] or [reference] says so
latitude_deg = 0.0
longitude_deg = 0.0
height_m = 0.0
# attitude_deg = [0.0, 0.0, 90.0]      roll, pitch, heading, if known; otherwise it is aligned at rest

# speed = {{ column = "v", unit = "km/h" }}      above [time]: a speedometer; m/s, km/h, knots, mph, ft/s

# [gps]                    # likewise [reference], a better navigator; leave out the groups that it does not have
# file = "gps.csv"         # leave out where the fixes are in the same table
# time = {{ column = "t", unit = "s" }}
# position = {{ columns = ["lat", "lon", "height"], unit = "deg" }}       # deg, rad, 1e-7 deg; height_unit = "m", "mm"
#            {{ columns = ["n", "e", "d"], frame = "NED", origin = {{ latitude_deg = 0.0, longitude_deg = 0.0 }} }}
#            frame: NED, ENU, ECEF in m
# velocity = {{ columns = ["vn", "ve", "vd"], axes = "NED" }}             # or NEU, ENU, ECEF, NE, "speed course",
#            "speed course down"; unit = "m/s", "km/h", "knots", "mph", "ft/s"; course_unit = "deg", "rad"
# attitude = {{ columns = ["roll", "pitch", "heading"], unit = "deg" }}
#            {{ columns = ["qw", "qx", "qy", "qz"], form = "w x y z", frame = "NED", axes = "FRD" }}

# [belief.gyro]            # what is believed of the instrument, as in recording.toml: bias_radps, ...
"""


def template(table: Columns) -> str:
    """The text of a mapping file; what cannot be guessed from the names stands as "?"."""
    names = table.names()
    numbered = all(is_number(name) for name in names)
    time = next((name for name in names if TIME.fullmatch(_plain(name))), UNKNOWN)
    gyro = [_of_axis(names, GYRO, SHORT["gyro"], axis) for axis in "xyz"]
    accelerometer = [_of_axis(names, ACCELEROMETER, SHORT["accelerometer"], axis) for axis in "xyz"]
    temperature = next((name for name in names if TEMPERATURE.fullmatch(_plain(name))), None)
    force_unit, force_note = _force_unit(table, accelerometer)
    return TEXT.format(
        found=", ".join(_listed(names)),
        header="header = false             # the first line holds numbers: name columns by their number, from 1\n"
        if numbered
        else "",
        time=_quoted(time),
        time_unit=_unit(_time_unit(table, time)),
        gyro=", ".join(map(_quoted, gyro)),
        accelerometer=", ".join(map(_quoted, accelerometer)),
        gyro_unit=_unit("deg/s" if DEGREES.search(f"{gyro[0]} {table.units.get(gyro[0])}".lower()) else "rad/s"),
        force_unit=_unit(force_unit),
        force_note=force_note,
        up_note=_up_note(table, accelerometer),
        temperature="" if temperature else "# ",
        temperature_column=_quoted(temperature or "temp"),
    )


def _listed(names: list[str]) -> list[str]:
    """The names, ``m[1]`` to ``m[9]`` of a matrix as one, at most `MOST_LISTED`."""
    matrices: dict[str, list[str]] = {}
    for name in names:
        matrices.setdefault(name.partition("[")[0] if COLUMN.fullmatch(name) else name, []).append(name)
    listed = [_ascii(one[0] if len(one) == 1 else f"{one[0]} to {one[-1]}") for one in matrices.values()]
    return listed[:MOST_LISTED] + ["..."] * (len(listed) > MOST_LISTED)


def _plain(name: str) -> str:
    """A name without unit in brackets, case and signs."""
    return re.sub(r"[^a-z0-9]", "", re.sub(r"[\[(].*", "", name.lower()))


def _of_axis(names: list[str], long: str, short: tuple[str, ...], axis: str) -> str:
    """The first column of one sensor and axis: gyro_x, accel.x_mps2, wx ..."""
    pattern = re.compile(rf"({long}{axis}.*|.*{axis}{long}|({'|'.join(short)}){axis})")
    return next((name for name in names if pattern.fullmatch(_plain(name))), UNKNOWN)


def _values(table: Columns, name: str) -> np.ndarray:
    try:
        return table.numbers(name, "the template")[:100_000]
    except InsEvalError:  # no such column, or one that is no number: nothing can be guessed from it
        return np.zeros(0)


def _unit(name: str) -> str:
    """A line that names a unit, as long as the comments beside it want it."""
    return f'unit = "{name}"'.ljust(27)


def _up_note(table: Columns, columns: list[str]) -> str:
    """Which of x, y, z points up: at rest the specific force does."""
    parts = [_values(table, name) for name in columns]
    if not all(part.size and np.isfinite(part).any() for part in parts):
        return ""
    means = np.array([np.nanmedian(part) for part in parts])
    axis = int(np.argmax(np.abs(means)))
    if means[axis] == 0.0:
        return ""
    return f"; here {'xyz'[axis]} points {'up' if means[axis] > 0.0 else 'down'}, if this is mostly level"


def _force_unit(table: Columns, columns: list[str]) -> tuple[str, str]:
    parts = [_values(table, name) for name in columns]
    if not all(part.size for part in parts):
        return "m/s^2", ""
    length = np.linalg.norm(np.column_stack(parts), axis=1)
    length = length[np.isfinite(length)]
    size = float(np.median(length)) if length.size else 0.0
    for unit, gravity in FORCE_UNITS.items():
        if 0.5 * gravity < size < 2.0 * gravity:
            return unit, f"; looks like {unit}, gravity reads {size:.4g}"
    return "m/s^2", f"; gravity reads {size:.4g}, which looks like none of the rates"


def _time_unit(table: Columns, name: str) -> str:
    values = _values(table, name)
    if not values.size and name in table.names():
        return DATE  # in text
    steps = np.diff(values)
    steps = steps[np.isfinite(steps)]
    step = float(np.median(steps)) if steps.size else 0.0
    return next(unit for unit, largest in TIME_STEPS.items() if step <= largest)


def _ascii(name: str) -> str:
    return name.encode("ascii", "backslashreplace").decode().replace("\n", " ")


def _quoted(name: str) -> str:
    return '"' + _ascii(name).replace("\\", "\\\\").replace('"', '\\"') + '"'
