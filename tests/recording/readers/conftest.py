"""A vehicle's motion in closed form, the files that each format would hold of it, and the real recordings."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.io

GRAVITY = 9.8
LATITUDE, LONGITUDE, HEIGHT = 0.7, 0.3, 100.0  # rad, rad, m
RADIUS_M = 6.37e6


def drive(rate_hz: float, lasted_s: float) -> SimpleNamespace:
    """Rates, specific force, attitude and velocity of a vehicle that weaves, speeds up and banks, on a flat Earth.

    The body rates are those of Euler angles in the order heading, pitch, roll, as in every textbook.
    """
    t = np.arange(round(lasted_s * rate_hz) + 1) / rate_hz
    heading, heading_rate = 0.5 + 0.9 * np.sin(0.35 * t), 0.9 * 0.35 * np.cos(0.35 * t)
    roll, roll_rate = 0.3 * np.sin(0.5 * t), 0.15 * np.cos(0.5 * t)
    pitch, pitch_rate = 0.08 * np.sin(0.41 * t + 1.0), 0.08 * 0.41 * np.cos(0.41 * t + 1.0)
    speed, acceleration = 12.0 + 4.0 * np.sin(0.27 * t), 4.0 * 0.27 * np.cos(0.27 * t)
    climb, climb_rate = 0.8 * np.sin(0.6 * t), 0.48 * np.cos(0.6 * t)
    rate_b = np.column_stack(
        [
            roll_rate - heading_rate * np.sin(pitch),
            pitch_rate * np.cos(roll) + heading_rate * np.sin(roll) * np.cos(pitch),
            -pitch_rate * np.sin(roll) + heading_rate * np.cos(roll) * np.cos(pitch),
        ]
    )
    north, east = np.cos(heading), np.sin(heading)
    velocity_n = np.column_stack([speed * north, speed * east, -climb])
    felt_n = np.column_stack(
        [
            acceleration * north - speed * heading_rate * east,
            acceleration * east + speed * heading_rate * north,
            -climb_rate - GRAVITY,
        ]
    )
    (cr, sr), (cp, sp) = (np.cos(roll), np.sin(roll)), (np.cos(pitch), np.sin(pitch))
    along, across, down = (
        felt_n[:, 0] * north + felt_n[:, 1] * east,
        felt_n[:, 1] * north - felt_n[:, 0] * east,
        felt_n[:, 2],
    )
    ahead, below = along * cp - down * sp, along * sp + down * cp
    force_b = np.column_stack([ahead, across * cr + below * sr, -across * sr + below * cr])
    way = np.vstack([np.zeros(3), np.cumsum(0.5 * (velocity_n[1:] + velocity_n[:-1]) / rate_hz, axis=0)])
    return SimpleNamespace(
        time_s=t,
        rate_b=rate_b,
        force_b=force_b,
        attitude=np.column_stack([roll, pitch, heading]),
        velocity_n=velocity_n,
        latitude=LATITUDE + way[:, 0] / RADIUS_M,
        longitude=LONGITUDE + way[:, 1] / (RADIUS_M * np.cos(LATITUDE)),
        height=HEIGHT - way[:, 2],
    )


@pytest.fixture(scope="session")
def weaving() -> Callable[[float, float], SimpleNamespace]:
    """The function `drive`: rate in Hz and duration in s to a motion."""
    return drive


def matlab(**variables) -> bytes:
    file = io.BytesIO()
    scipy.io.savemat(file, variables)
    return file.getvalue()


def psins_mat(rate_hz: float = 100.0, lasted_s: float = 100.0, offset_s: float = 0.0) -> bytes:
    """`mimu` and `fogavp`, the reference's stamps `offset_s` beyond the IMU's."""
    fine = drive(10.0 * rate_hz, lasted_s)
    rfu = [1, 0, 2]
    sign = np.array([1.0, 1.0, -1.0])

    def increments(values: np.ndarray) -> np.ndarray:
        middle = 0.5 * (values[1:] + values[:-1]) / (10.0 * rate_hz)
        return middle.reshape(-1, 10, 3).sum(axis=1)[:, rfu] * sign

    stamps = fine.time_s[10::10]
    mimu = np.column_stack([increments(fine.rate_b), increments(fine.force_b), stamps])
    every = slice(round(rate_hz), None, round(rate_hz))  # 10 Hz
    roll, pitch, heading = fine.attitude[every].T
    north, east, down = fine.velocity_n[every].T
    place = [fine.latitude[every], fine.longitude[every], fine.height[every]]
    fogavp = np.column_stack([pitch, roll, -heading, east, north, -down, *place, fine.time_s[every] + offset_s])
    constants = {"eb0": [[1e-3], [2e-3], [3e-3]], "db0": [[0.1], [0.2], [0.3]], "mu0": [[0.0], [0.0], [0.0]]}
    return matlab(mimu=mimu, fogavp=fogavp, **{name: np.array(value) for name, value in constants.items()})


def apm_tables(latency_s: float = 0.25, rate_hz: float = 50.0, lasted_s: float = 120.0) -> dict[str, np.ndarray]:
    """IMU, GPS and ATT with the stamps in ms, the fixes late."""
    motion = drive(rate_hz, lasted_s)
    stamps = 1e3 * motion.time_s
    every = slice(0, None, max(1, round(rate_hz / 5.0)))
    north, east, down = motion.velocity_n[every].T
    m = len(north)
    zeros = np.zeros(m)
    gps = {
        "T": stamps[every] + 1e3 * latency_s,
        "Status": zeros + 3,
        "Lat": np.degrees(motion.latitude[every]),
        "Lng": np.degrees(motion.longitude[every]),
        "Alt": motion.height[every],
        "Spd": np.hypot(north, east),
        "GCrs": np.degrees(np.arctan2(east, north)) % 360.0,
        "VZ": down,
    }
    return {
        "IMU": np.column_stack([stamps, motion.rate_b, motion.force_b]),
        "GPS": np.column_stack(list(gps.values())),
        "ATT": np.column_stack([stamps, np.degrees(motion.attitude)]),
    }


APM_LABELS = {
    "IMU": ["TimeMS", "GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"],
    "GPS": ["T", "Status", "Lat", "Lng", "Alt", "Spd", "GCrs", "VZ"],
    "ATT": ["TimeMS", "Roll", "Pitch", "Yaw"],
}


def apm_mat(**options) -> bytes:
    """The tables with a column LineNo before and their labels beside them."""
    variables = {}
    for name, table in apm_tables(**options).items():
        variables[name] = np.column_stack([np.arange(len(table)), table])
        variables[f"{name}_label"] = np.array([["LineNo"], *([label] for label in APM_LABELS[name])], dtype=object)
    return matlab(**variables)


def apm_text_members(**options) -> dict[str, bytes]:
    tables = apm_tables(**options)
    imu, gps, attitude = (tables[name] for name in ("IMU", "GPS", "ATT"))
    unused = np.zeros((len(gps), 4))
    rows = {
        "IMU": np.column_stack([imu[:, :1], imu]),
        "GPS": np.column_stack([gps[:, :2], unused, gps[:, 2:4], gps[:, 4:5], gps[:, 4:8], unused[:, 0]]),
        "ATT": np.column_stack([attitude[:, :1], attitude, np.zeros((len(attitude), 2))]),
    }
    files = {}
    for name, table in rows.items():
        text = io.StringIO()
        np.savetxt(text, table, fmt="%.9e", newline="\r\n")
        files[f"{name}.txt"] = text.getvalue().encode()
    return files


def zipped(members: dict[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return file.getvalue()


CSV_MAPPING = """
kind = "drive"
axes = "FRD"
time = { column = "t", unit = "s" }
gyro = { columns = ["wx", "wy", "wz"], unit = "rad/s" }
accelerometer = { columns = ["ax", "ay", "az"], unit = "m/s^2" }
[start]
latitude_deg = 40.0
longitude_deg = 17.0
height_m = 100.0
"""


def csv_rows(motion: SimpleNamespace) -> bytes:
    text = io.StringIO()
    np.savetxt(text, np.column_stack([motion.time_s, motion.rate_b, motion.force_b]), fmt="%.12g", delimiter=",")
    return b"t,wx,wy,wz,ax,ay,az\n" + text.getvalue().encode()


@pytest.fixture(scope="session")
def made() -> SimpleNamespace:
    """The functions that make the content of a file of each format."""
    return SimpleNamespace(
        matlab=matlab,
        psins_mat=psins_mat,
        apm_mat=apm_mat,
        apm_text_members=apm_text_members,
        zipped=zipped,
        csv_rows=csv_rows,
        csv_mapping=CSV_MAPPING,
    )


@pytest.fixture(scope="session")
def real() -> Callable[[str], Path]:
    """The path of a real recording, or a skip with the reason."""

    def find(name: str) -> Path:
        path = Path(__file__).resolve().parents[4] / "shared" / "recordings" / name
        if not path.exists():
            pytest.skip(f"the real recording ../shared/recordings/{name} is absent here")
        return path

    return find
