"""Reader of a ROS bag, version 1 (.bag) or 2 (its folder): messages by type, stamps of their headers.

    sensor_msgs/Imu              rate [rad/s], specific force [m/s^2], forward-left-up; its orientation is the reference
    sensor_msgs/NavSatFix        latitude longitude [deg], height [m] above the ellipsoid
    geometry_msgs/TwistStamped   velocity of the receiver, east-north-up [m/s]; one fix with a NavSatFix of its stamp
    nav_msgs/Odometry            the solution: orientation in east-north-up, velocity in body axes

Where several topics have a type, the one with most messages is read; --assume imu.topic=/NAME names another. Source:
REP 103 and REP 105 of ROS for frames and axes, message definitions of ROS.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ins_eval.boundary import check_regular, check_unpacked
from ins_eval.errors import DataRefused, StorageError, UsageError, did_you_mean
from ins_eval.readers import assembly, autopilot
from ins_eval.readers.fix_columns import ENU, attitude_of, checked_groups, groups_found
from ins_eval.readers.layout import Layout
from ins_eval.readers.optional import library
from ins_eval.readers.sampling import Readings
from ins_eval.recording import Fixes, Recording
from ins_eval.units import DEG

TYPES = {
    "imu": "sensor_msgs/msg/Imu",
    "gps": "sensor_msgs/msg/NavSatFix",
    "velocity": "geometry_msgs/msg/TwistStamped",
    "solution": "nav_msgs/msg/Odometry",
}
KEYS = (*assembly.KEYS, *(f"{name}.topic" for name in TYPES))
EXPECTED = "a ROS bag with sensor_msgs/Imu"
ORIGIN_S = 1e7  # stamps beyond it are counted from the first
NO_FIX = -1


def read(path: Path, assumed: Mapping[str, str]) -> Recording:
    """The whole bag as one drive."""
    topics, rows = _messages(path, assumed)
    if not rows["imu"]:
        raise DataRefused(f"{path}: holds no messages of sensor_msgs/Imu, expected {EXPECTED}; record the IMU too")
    imu = np.array(rows["imu"])
    origin_s = float(np.floor(imu[0, 0])) if imu[0, 0] > ORIGIN_S else 0.0
    for table in rows.values():
        table[:] = [(row[0] - origin_s, *row[1:]) for row in table]
    imu = np.array(rows["imu"])
    known = imu[imu[:, 11] != -1.0]
    reference = autopilot.of_attitude(known[:, 0], attitude_of(known[:, 7:11], "ENU", "FLU"))
    gps = _gps(path, rows["gps"], rows["velocity"])
    solution = _solution(path, rows["solution"])
    named = ", ".join(f"{len(rows[name])} of {topic}" for name, topic in topics.items() if rows[name])
    return assembly.recording(
        assembly.Tables(
            name=path.stem,
            kind=assumed.get("kind", "drive"),
            readings=Readings(imu[:, 0], imu[:, 1:4], imu[:, 4:7]),
            layout=Layout("rad/s", "m/s^2", "FLU"),
            gps=gps,
            reference=reference,
            solution=solution,
            notes=(
                f"The file {path.name} is a ROS bag with {named}.",
                f"All times are counted from {origin_s:.0f} s of the headers' clock.",
                *(["The orientation that the IMU reports is the reference, of attitude only."] * bool(reference)),
                *(["The messages of Odometry are the table solution, without position."] * bool(solution)),
            ),
        ),
        str(path),
        assumed,
        "this is the convention of ROS",
    )


def _messages(path: Path, assumed: Mapping[str, str]) -> tuple[dict[str, str], dict[str, list[tuple[float, ...]]]]:
    """The topic read for each table, and its rows: stamp in s, then the values."""
    highlevel, typesys = library("rosbags.highlevel", f"{path}"), library("rosbags.typesys", f"{path}")
    check_unpacked(path, sum(check_regular(file, EXPECTED) for file in (path.iterdir() if path.is_dir() else [path])))
    rows: dict[str, list[tuple[float, ...]]] = {name: [] for name in TYPES}
    try:
        with (
            autopilot.quiet(),
            highlevel.AnyReader([path], default_typestore=typesys.get_typestore(typesys.Stores.LATEST)) as bag,
        ):
            topics = {name: _topic(path, bag, name, assumed) for name in TYPES}
            topics = {name: topic for name, topic in topics.items() if topic}
            wanted = {topic: name for name, topic in topics.items()}
            chosen = [connection for connection in bag.connections if connection.topic in wanted]
            for connection, _, raw in bag.messages(connections=chosen) if chosen else ():
                name = wanted[connection.topic]
                message = bag.deserialize(raw, connection.msgtype)
                stamp = message.header.stamp
                rows[name].append((stamp.sec + 1e-9 * stamp.nanosec, *ROWS[name](message)))
    except UsageError:
        raise
    except OSError as failure:
        raise StorageError(f"{path}: cannot be read ({failure.strerror}); check its permissions") from None
    except Exception:  # a damaged bag makes the library fail in many ways
        raise DataRefused(f"{path}: cannot be read as a ROS bag, expected {EXPECTED}; copy it again") from None
    return topics, rows


def _topic(path: Path, bag, name: str, assumed: Mapping[str, str]) -> str | None:
    """The topic of a table: the one that is assumed, or that with most messages of its type."""
    counts: dict[str, int] = {}
    for connection in bag.connections:
        if connection.msgtype == TYPES[name]:
            counts[connection.topic] = counts.get(connection.topic, 0) + connection.msgcount
    asked = assumed.get(f"{name}.topic")
    if asked is not None and asked not in counts:
        raise UsageError(
            f"--assume {name}.topic={asked}: {path} has no such topic of {TYPES[name]}{did_you_mean(asked, counts)}"
        )
    return asked or max(counts, key=counts.__getitem__, default=None)


def _vector(vector) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


ROWS = {
    "imu": lambda m: (
        *_vector(m.angular_velocity),
        *_vector(m.linear_acceleration),
        *_vector(m.orientation),
        m.orientation.w,
        float(m.orientation_covariance[0]),
    ),
    "gps": lambda m: (m.latitude, m.longitude, m.altitude, float(m.status.status)),
    "velocity": lambda m: _vector(m.twist.linear),
    "solution": lambda m: (
        *_vector(m.pose.pose.orientation),
        m.pose.pose.orientation.w,
        *_vector(m.twist.twist.linear),
    ),
}


def _gps(path: Path, places: list[tuple[float, ...]], velocities: list[tuple[float, ...]]) -> Fixes | None:
    """A position and a velocity of one stamp, to the microsecond, are one fix."""
    epochs: dict[float, np.ndarray] = {}
    for time_s, latitude, longitude, height_m, status in places:
        row = epochs.setdefault(round(time_s, 6), np.full(6, np.nan))
        if status > NO_FIX:
            row[:3] = DEG * latitude, DEG * longitude, height_m
    for time_s, east, north, up in velocities:
        epochs.setdefault(round(time_s, 6), np.full(6, np.nan))[3:] = north, east, -up
    if not epochs:
        return None
    times = np.array(sorted(epochs))
    table = np.array([epochs[time] for time in times])
    valid = groups_found(table[:, :3], table[:, 3:], None)
    latitude, longitude, height = table[:, :3].T
    return checked_groups(Fixes(times, latitude, longitude, height, table[:, 3:], valid), f"{path}, NavSatFix")


def _solution(path: Path, rows: list[tuple[float, ...]]) -> Fixes | None:
    """Attitude and velocity of Odometry; its position is local and not brought to the Earth."""
    if not rows:
        return None
    table = np.array(rows)
    table = table[autopilot.later(table[:, 0])]
    attitude_rad = attitude_of(table[:, 1:5], "ENU", "FLU")
    sound = np.isfinite(attitude_rad).all(axis=1)
    velocity_n = np.full((len(table), 3), np.nan)
    if sound.any():
        velocity_n[sound] = Rotation.from_quat(table[sound, 1:5]).apply(table[sound, 5:8]) @ ENU.T
    unknown = np.full(len(table), np.nan)
    valid = groups_found(np.column_stack([unknown] * 3), velocity_n, attitude_rad)
    if not valid.any():
        return None
    fixes = Fixes(table[:, 0], unknown, unknown, unknown, velocity_n, valid, attitude_rad)
    return checked_groups(fixes, f"{path}, Odometry")
