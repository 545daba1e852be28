"""Wrong descriptions: files that say something else than `recording.toml` does, written after the truth was made."""

from __future__ import annotations

import math

import numpy as np

AXES = ("x", "y", "z")
COLUMN = {"gyro": "gyro", "accelerometer": "accel"}
UNITS = {"gyro": (180.0 / math.pi, "deg"), "accelerometer": (1.0 / 9.80665, "g")}  # what is written for 1 rad, 1 m/s
KMH = 3.6  # what is written for 1 m/s
MEASURED = ("gps", "reference")
VELOCITY = ("velocity_n_mps", "velocity_e_mps", "velocity_d_mps")


def a_description(rng: np.random.Generator, name: str, axis: str | None) -> tuple[float, dict]:
    """Value and further parameters of a wrong description, drawn."""
    sensor = str(rng.choice(list(COLUMN)))
    if name == "recording.axis_sign":
        return -1.0, {"sensor": sensor}
    if name == "recording.axes_exchanged":
        return float(rng.choice((-1.0, 1.0))), {
            "sensor": sensor,
            "other_axis": str(rng.choice([a for a in AXES if a != axis])),
        }
    if name == "recording.unit":
        return UNITS[sensor][0], {"sensor": sensor, "unit_found": UNITS[sensor][1]}
    if name == "recording.clock_step":
        return float(np.round(rng.uniform(0.05, 0.3), 3)), {"at_share": float(rng.uniform(0.25, 0.75))}
    if name == "recording.clock_drift":
        return float(np.round(rng.choice((-1.0, 1.0)) * rng.uniform(20.0, 120.0), 1)), {}
    if name == "recording.gps_velocity":
        return (-1.0 if axis == "down" else KMH), {}
    if rng.random() < 0.5:
        return 0.0, {"frame_found": "ENU"}
    return float(np.round(rng.choice((-1.0, 1.0)) * rng.uniform(2.0, 15.0), 2)), {"frame_found": "magnetic north"}


def misdescribe(tables: dict, name: str, axis: str | None, value: float, parameters: dict) -> None:
    """Change the tables of a recording, dictionaries of columns, in place."""
    imu, what = tables["imu"], name.partition(".")[2]
    column = COLUMN.get(parameters.get("sensor", ""), "")
    if what == "axis_sign":
        imu[f"{column}_{axis}"] = -imu[f"{column}_{axis}"]
    elif what == "axes_exchanged":
        one, other = f"{column}_{axis}", f"{column}_{parameters['other_axis']}"
        imu[one], imu[other] = value * imu[other], value * imu[one]
    elif what == "unit":
        for one in AXES:
            imu[f"{column}_{one}"] = value * imu[f"{column}_{one}"]
    elif what == "clock_drift":
        imu["time_s"] = imu["time_s"] * (1.0 + 1e-6 * value)
    else:
        for table in MEASURED:
            if table in tables:
                tables[table] = _of_fixes(tables[table], what, axis, value, parameters)


def _of_fixes(fixes: dict, what: str, axis: str | None, value: float, parameters: dict) -> dict:
    fixes = dict(fixes)
    north, east, down = VELOCITY
    if what == "clock_step":  # the IMU counts on, and what measures is stamped early from then on
        stamp = fixes["time_s"] - value * (fixes["time_s"] >= parameters["at_s"])
        later = stamp > np.maximum.accumulate(np.append(-np.inf, stamp[:-1]))
        return {key: values[later] for key, values in (fixes | {"time_s": stamp}).items()}
    if what == "gps_velocity":
        for one in (down,) if axis == "down" else VELOCITY:
            fixes[one] = value * fixes[one]
    elif parameters["frame_found"] == "ENU":
        fixes[north], fixes[east], fixes[down] = fixes[east], fixes[north], -fixes[down]
    else:
        fixes["heading_deg"] = (fixes["heading_deg"] + value) % 360.0
    return fixes
