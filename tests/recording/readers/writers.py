"""Files of logs as their programs write them: by the library where it writes, else byte by byte from the format."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import scipy.io

PI = np.pi


def quaternions(motion: SimpleNamespace) -> np.ndarray:
    """Scalar first, (n, 4), of roll, pitch, heading, by the half-angle formula of textbooks."""
    (cr, cp, ch), (sr, sp, sh) = np.cos(0.5 * motion.attitude.T), np.sin(0.5 * motion.attitude.T)
    return np.column_stack(
        [
            cr * cp * ch + sr * sp * sh,
            sr * cp * ch - cr * sp * sh,
            cr * sp * ch + sr * cp * sh,
            cr * cp * sh - sr * sp * ch,
        ]
    )


def earth_fixed(latitude: np.ndarray, longitude: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Cartesian position on WGS-84, (n, 3) m."""
    a, e2 = 6378137.0, 0.00669437999014
    transverse = a / np.sqrt(1.0 - e2 * np.sin(latitude) ** 2)
    level = (transverse + height) * np.cos(latitude)
    along = ((1.0 - e2) * transverse + height) * np.sin(latitude)
    return np.column_stack([level * np.cos(longitude), level * np.sin(longitude), along])


def north_east_down(latitude: float, longitude: float) -> np.ndarray:
    """The matrix (3, 3) from the Earth-fixed frame to north, east, down."""
    (sl, cl), (so, co) = (np.sin(latitude), np.cos(latitude)), (np.sin(longitude), np.cos(longitude))
    return np.array([[-sl * co, -sl * so, cl], [-so, co, 0.0], [-cl * co, -cl * so, -sl]])


def local(motion: SimpleNamespace) -> np.ndarray:
    """Metres north, east, down of the first position, (n, 3)."""
    place = earth_fixed(motion.latitude, motion.longitude, motion.height)
    return (place - place[0]) @ north_east_down(motion.latitude[0], motion.longitude[0]).T


def table(motion: SimpleNamespace) -> dict[str, np.ndarray]:
    """Every quantity of a motion as a column, in the ways that logs hold it."""
    north, east, down = motion.velocity_n.T
    x, y, z = earth_fixed(motion.latitude, motion.longitude, motion.height).T
    turned = np.stack([north_east_down(lat, lon) for lat, lon in zip(motion.latitude, motion.longitude, strict=True)])
    velocity_e = np.einsum("kji,kj->ki", turned, motion.velocity_n)
    n, e, d = local(motion).T
    q = quaternions(motion)
    return {
        "t": motion.time_s,
        **dict(zip(("wx", "wy", "wz"), motion.rate_b.T, strict=True)),
        **dict(zip(("ax", "ay", "az"), motion.force_b.T, strict=True)),
        **{"lat": np.degrees(motion.latitude), "lon": np.degrees(motion.longitude), "h": motion.height},
        **{"x": x, "y": y, "z": z, "n": n, "e": e, "d": d, "u": -d},
        **{"vn": north, "ve": east, "vd": down, "vu": -down},
        **dict(zip(("vx", "vy", "vz"), velocity_e.T, strict=True)),
        **{"speed": np.hypot(north, east), "course": np.degrees(np.arctan2(east, north)) % 360.0},
        **dict(zip(("roll", "pitch", "heading"), np.degrees(motion.attitude).T, strict=True)),
        **dict(zip(("qw", "qx", "qy", "qz"), q.T, strict=True)),
    }


def csv(columns: dict[str, np.ndarray]) -> bytes:
    rows = zip(
        *([value if isinstance(value, str) else f"{value:.17g}" for value in v] for v in columns.values()), strict=True
    )
    return ("\n".join([",".join(columns), *(",".join(row) for row in rows)]) + "\n").encode()


def matlab_4(columns: dict[str, np.ndarray]) -> bytes:
    file = io.BytesIO()
    scipy.io.savemat(file, columns, format="4")
    return file.getvalue()


def matlab_7_3(variables: dict) -> bytes:
    """HDF5 behind a user block of 512 bytes, matrices transposed, structures as groups, as MATLAB writes it."""
    import h5py

    file = io.BytesIO()
    with h5py.File(file, "w", userblock_size=512) as group:
        for name, value in variables.items():
            if isinstance(value, dict):
                for field, inner in value.items():
                    group[f"{name}/{field}"] = np.atleast_2d(inner)
            else:
                group[name] = np.atleast_2d(value) if np.ndim(value) < 2 else np.asarray(value).T
    raw = bytearray(file.getvalue())
    raw[:128] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    return bytes(raw)


def netcdf_classic(columns: dict[str, np.ndarray]) -> bytes:
    file = io.BytesIO()
    handle = scipy.io.netcdf_file(file, "w")
    handle.createDimension("Time", len(next(iter(columns.values()))))
    for name, values in columns.items():
        handle.createVariable(name, "f8", ("Time",))[:] = values
    handle.flush()
    return file.getvalue()


def netcdf_4(columns: dict[str, np.ndarray]) -> bytes:
    import h5py

    file = io.BytesIO()
    with h5py.File(file, "w") as group:
        for name, values in columns.items():
            group[name] = values
    return file.getvalue()


class Ulog:
    """A PX4 log message by message (PX4 user guide, ULog file format)."""

    def __init__(self) -> None:
        self.definitions, self.data, self.ids = b"", b"", {}

    @staticmethod
    def _message(kind: bytes, content: bytes) -> bytes:
        return struct.pack("<Hc", len(content), kind) + content

    def topic(self, name: str, fields: str, packed: str, rows: list[tuple], instance: int = 0) -> Ulog:
        if name not in {topic for topic, _ in self.ids}:
            self.definitions += self._message(b"F", f"{name}:uint64_t timestamp;{fields}".encode())
        number = len(self.ids)
        self.ids[name, instance] = number
        self.data += self._message(b"A", struct.pack("<BH", instance, number) + name.encode())
        for row in rows:
            self.data += self._message(b"D", struct.pack("<H", number) + struct.pack(f"<Q{packed}", *row))
        return self

    def dropout(self, lasted_ms: int) -> Ulog:
        self.data += self._message(b"O", struct.pack("<H", lasted_ms))
        return self

    def content(self) -> bytes:
        flags = self._message(b"B", bytes(40))
        return b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + flags + self.definitions + self.data


def ulog(motion: SimpleNamespace, boot_s: float = 100.0) -> bytes:
    """IMU, a second IMU 1 % larger, fixes, attitude, local position; `boot_s` after boot."""
    stamps = [int(round(1e6 * (boot_s + t))) for t in motion.time_s]
    step_s = float(motion.time_s[1])
    every = range(0, len(stamps), 5)
    place = local(motion)
    lat, lon, height = np.degrees(motion.latitude), np.degrees(motion.longitude), motion.height
    vn = motion.velocity_n
    felt = list(zip(stamps, motion.rate_b, motion.force_b, strict=True))
    step_us = round(1e6 * step_s)
    return (
        Ulog()
        .topic(
            "sensor_combined",
            "float[3] gyro_rad;float[3] accelerometer_m_s2;uint32_t gyro_integral_dt;"
            "uint32_t accelerometer_integral_dt;",
            "6fII",
            [(t, *w, *f, step_us, step_us) for t, w, f in felt],
        )
        .topic(
            "vehicle_imu",
            "float[3] delta_angle;float[3] delta_velocity;",
            "6f",
            [(t, *(1.01 * step_s * w), *(1.01 * step_s * f)) for t, w, f in felt],
            1,
        )
        .topic(
            "sensor_gps",
            "double latitude_deg;double longitude_deg;double altitude_ellipsoid_m;float vel_n_m_s;float vel_e_m_s;"
            "float vel_d_m_s;uint8_t fix_type;",
            "dddfffB",
            [(stamps[k], lat[k], lon[k], height[k], *vn[k], 3) for k in every],
        )
        .topic("vehicle_attitude", "float[4] q;", "4f", list(zip(stamps, *quaternions(motion).T, strict=True)))
        .topic(
            "vehicle_local_position",
            "double ref_lat;double ref_lon;float ref_alt;float x;float y;float z;float vx;float vy;float vz;"
            "uint8_t xy_valid;uint8_t v_xy_valid;uint8_t v_z_valid;uint8_t xy_global;uint8_t z_global;",
            "dd7f5B",
            [(stamps[k], lat[0], lon[0], height[0], *place[k], *vn[k], 1, 1, 1, 1, 1) for k in every],
        )
        .dropout(40)
        .content()
    )


SIZES = {"Q": 8, "f": 4, "L": 4, "B": 1, "d": 8}


def dataflash(motion: SimpleNamespace, boots: tuple[int, ...] = (1,), boot_s: float = 80.0) -> bytes:
    """IMU, a second IMU 1 % larger, GPS, ATT; the motion is repeated as often as each of `boots` says, shortened.

    Boot k holds one k-th of the motion: (2, 1) is a short boot and then the whole motion.
    """
    kinds = {
        "IMU": (129, "QBfffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,T"),
        "GPS": (130, "QBLLffff", "TimeUS,Status,Lat,Lng,Alt,Spd,GCrs,VZ"),
        "ATT": (131, "Qfff", "TimeUS,Roll,Pitch,Yaw"),
    }

    def fmt(number: int, name: str, form: str, columns: str) -> bytes:
        length = 89 if number == 128 else 3 + sum(SIZES[code] for code in form)
        return b"\xa3\x95\x80" + struct.pack(
            "<BB4s16s64s", number, length, name.encode(), form.encode(), columns.encode()
        )

    raw = fmt(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    raw += b"".join(fmt(number, name, form, columns) for name, (number, form, columns) in kinds.items())

    def message(name: str, *values: float) -> bytes:
        number, form, _ = kinds[name]
        codes = form.replace("L", "i")
        whole = [
            int(round(v * 1e7)) if c == "L" else int(v) if c in "QB" else v for c, v in zip(form, values, strict=True)
        ]
        return b"\xa3\x95" + bytes([number]) + struct.pack(f"<{codes}", *whole)

    for part in boots:
        for k in range(len(motion.time_s) // part):
            us = round(1e6 * (boot_s + motion.time_s[k]))
            raw += message("IMU", us, 0, *motion.rate_b[k], *motion.force_b[k], 25.0)
            raw += message("IMU", us, 1, *(1.01 * motion.rate_b[k]), *(1.01 * motion.force_b[k]), 26.0)
            raw += message("ATT", us, *(np.degrees(motion.attitude[k]) % 360.0))
            if k % 5 == 0:
                north, east, down = motion.velocity_n[k]
                place = np.degrees([motion.latitude[k], motion.longitude[k]])
                course = np.degrees(np.arctan2(east, north)) % 360.0
                raw += message("GPS", us, 3, *place, motion.height[k], np.hypot(north, east), course, down)
    return raw


FLU = np.array([1.0, -1.0, -1.0])


def rosbag(folder: Path, motion: SimpleNamespace, version: int) -> Path:
    """A bag of ROS 1 or 2, written by rosbags: IMU and its orientation, fixes, their velocity, odometry."""
    from rosbags import rosbag1, rosbag2
    from rosbags.typesys import Stores, get_typestore
    from scipy.spatial.transform import Rotation

    store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)
    kinds = store.types
    header, stamp = kinds["std_msgs/msg/Header"], kinds["builtin_interfaces/msg/Time"]
    vector, turn = kinds["geometry_msgs/msg/Vector3"], kinds["geometry_msgs/msg/Quaternion"]
    twist = kinds["geometry_msgs/msg/Twist"]
    roll, pitch, heading = motion.attitude.T
    to_ned = Rotation.from_euler("ZYX", np.column_stack([heading, pitch, roll])).as_matrix()
    to_enu = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    matrix = to_enu @ to_ned @ np.diag(FLU)
    quaternion = Rotation.from_matrix(matrix).as_quat()
    enu = motion.velocity_n @ to_enu.T
    body = np.einsum("kji,kj->ki", matrix, enu)
    epoch, none9, none36 = 1714558830, np.zeros(9), np.zeros(36)

    def head(k: int):
        ns = epoch * 10**9 + round(1e9 * motion.time_s[k])
        at = stamp(ns // 10**9, ns % 10**9)
        return ns, header(k, at, "base") if version == 1 else header(at, "base")

    path = folder / ("drive.bag" if version == 1 else "drive")
    writer = rosbag1.Writer(path) if version == 1 else rosbag2.Writer(path, version=8)
    with writer as bag:
        names = {
            "sensor_msgs/msg/Imu": "/imu/data",
            "sensor_msgs/msg/NavSatFix": "/fix",
            "geometry_msgs/msg/TwistStamped": "/vel",
            "nav_msgs/msg/Odometry": "/odometry",
        }
        connections = {kind: bag.add_connection(topic, kind, typestore=store) for kind, topic in names.items()}

        def put(kind: str, ns: int, message) -> None:
            raw = store.serialize_ros1(message, kind) if version == 1 else store.serialize_cdr(message, kind)
            bag.write(connections[kind], ns, raw)

        for k in range(len(motion.time_s)):
            ns, here = head(k)
            q = turn(*quaternion[k])
            rate, force = vector(*(FLU * motion.rate_b[k])), vector(*(FLU * motion.force_b[k]))
            put("sensor_msgs/msg/Imu", ns, kinds["sensor_msgs/msg/Imu"](here, q, none9, rate, none9, force, none9))
            if k % 5:
                continue
            status = kinds["sensor_msgs/msg/NavSatStatus"](0, 1)
            place = np.degrees([motion.latitude[k], motion.longitude[k]])
            fix = kinds["sensor_msgs/msg/NavSatFix"](here, status, *place, motion.height[k], none9, 0)
            put("sensor_msgs/msg/NavSatFix", ns, fix)
            still = vector(0.0, 0.0, 0.0)
            moving = kinds["geometry_msgs/msg/TwistStamped"](here, twist(vector(*enu[k]), still))
            put("geometry_msgs/msg/TwistStamped", ns, moving)
            pose = kinds["geometry_msgs/msg/Pose"](kinds["geometry_msgs/msg/Point"](0.0, 0.0, 0.0), q)
            odometry = kinds["nav_msgs/msg/Odometry"](
                here,
                "base",
                kinds["geometry_msgs/msg/PoseWithCovariance"](pose, none36),
                kinds["geometry_msgs/msg/TwistWithCovariance"](twist(vector(*body[k]), still), none36),
            )
            put("nav_msgs/msg/Odometry", ns, odometry)
    return path
