"""The motions of `corpus` as the logs of autopilots, receivers, robots and programs hold them.

Written from the formats' own descriptions with the helpers of `readers.writers`; what a user must state beside such a
file is what `assumed` gives.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.readers.novatel import crc32
from tests.recording.readers import writers

if TYPE_CHECKING:
    from tests.recording.corpus import Columns

EPOCH, LEAP_S = 1714558830, 18  # 2024-05-01T10:20:30Z; GPS minus UTC
WEEK, SECOND = divmod(EPOCH - 315964800 + LEAP_S, 604800)
BOOT_S = 100.0
FLU = np.array([1.0, -1.0, -1.0])
KNOT = 1852.0 / 3600.0
GYRO_COUNT, FORCE_COUNT = 2.0**-33, 0.3048 * 2.0**-27  # rad and m/s, HG1700-AG58
ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


def place_deg(c: Columns) -> np.ndarray:
    return np.column_stack([np.degrees(c.latitude), np.degrees(c.longitude), c.height_m])


def increments(c: Columns) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ends of samples, angles and velocities by trapezoids."""
    dt = np.diff(c.time_s)[:, None]
    return c.time_s[1:], *(0.5 * dt * (one[1:] + one[:-1]) for one in (c.gyro, c.force))


def course(c: Columns) -> tuple[np.ndarray, np.ndarray]:
    """Speed in m/s, and the course as it is written."""
    north, east, _ = c.velocity.T
    return np.hypot(north, east), c.course_scale * (np.degrees(np.arctan2(east, north)) % 360.0)


# ---------------------------------------------------------------------------------------------- autopilots


def write_ulog(c: Columns, folder: Path) -> Path:
    step_us = round(1e6 * float(np.median(np.diff(c.time_s))))
    stamp = [round(1e6 * (BOOT_S + t)) for t in c.time_s]
    fixed = [round(1e6 * (BOOT_S + t)) for t in c.fix_s]
    log = writers.Ulog().topic(
        "sensor_combined",
        "float[3] gyro_rad;float[3] accelerometer_m_s2;uint32_t gyro_integral_dt;uint32_t accelerometer_integral_dt;",
        "6fII",
        [(t, *w, *f, step_us, step_us) for t, w, f in zip(stamp, c.gyro, c.force, strict=True)],
    )
    log.topic(
        "sensor_gps",
        "double latitude_deg;double longitude_deg;double altitude_ellipsoid_m;float vel_n_m_s;float vel_e_m_s;"
        "float vel_d_m_s;uint8_t fix_type;",
        "dddfffB",
        [(t, *at, *v, 3) for t, at, v in zip(fixed, place_deg(c), c.velocity, strict=True)],
    )
    (folder / "log.ulg").write_bytes(log.content())
    return folder / "log.ulg"


def write_dataflash(c: Columns, folder: Path) -> Path:
    kinds = {
        "IMU": (129, "QBfffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,T"),
        "GPS": (130, "QBddffff", "TimeUS,Status,Lat,Lng,Alt,Spd,GCrs,VZ"),
    }

    def form(number: int, name: str, codes: str, columns: str) -> bytes:
        length = 89 if number == 128 else 3 + struct.calcsize(f"<{codes}")
        head = struct.pack("<BB4s16s64s", number, length, name.encode(), codes.encode(), columns.encode())
        return b"\xa3\x95\x80" + head

    raw = form(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    raw += b"".join(form(number, name, codes, columns) for name, (number, codes, columns) in kinds.items())
    speed, way = course(c)
    imu = zip(c.time_s, c.gyro, c.force, c.temperature_c, strict=True)
    messages = [(t, "IMU", (0, *w, *f, warm)) for t, w, f, warm in imu]
    fixes = zip(c.fix_s, place_deg(c), speed, way, c.velocity[:, 2], strict=True)
    messages += [(t, "GPS", (3, *at, v, a, d)) for t, at, v, a, d in fixes]
    parts = [raw]
    for t, name, values in sorted(messages, key=lambda one: one[0]):
        number, codes, _ = kinds[name]
        parts.append(b"\xa3\x95" + bytes([number]) + struct.pack(f"<{codes}", round(1e6 * (BOOT_S + t)), *values))
    (folder / "log.bin").write_bytes(b"".join(parts))
    return folder / "log.bin"


# ------------------------------------------------------------------------- receivers and navigation programs


def write_novatel(c: Columns, folder: Path) -> Path:
    """Counts of an HG1700 turned to right-forward-up, y with the opposite sign."""
    end_s, angle, velocity = increments(c)
    (wf, wr, wd), (ff, fr, fd) = angle.T / GYRO_COUNT, velocity.T / FORCE_COUNT
    exact = np.cumsum(np.column_stack([-fd, -ff, fr, -wd, -wf, wr]), axis=0)
    counts = np.diff(np.rint(exact), axis=0, prepend=0.0)
    lines = []

    def sentence(at: float, text: str, brief: bool = False) -> None:
        lines.append((at, f"{'%' if brief else '#'}{text}*{crc32(text.encode()):08x}"))

    for t, row in zip(end_s, counts, strict=True):
        at = SECOND + t
        numbers = ",".join(f"{one:.0f}" for one in row)
        sentence(t, f"RAWIMUSA,{WEEK},{at:.3f};{WEEK},{at:.6f},00000077,{numbers}", brief=True)
    speed, way = course(c)
    for t, (lat, lon, height), v, a, down in zip(c.fix_s, place_deg(c), speed, way, c.velocity[:, 2], strict=True):
        head = f"COM1,0,50.0,FINESTEERING,{WEEK},{SECOND + t:.3f},00000000,0000,0"
        sentence(
            t,
            f"BESTPOSA,{head};SOL_COMPUTED,SINGLE,{lat:.11f},{lon:.11f},{height - 30.0:.4f},30.0000,WGS84,1.0,1.0,2.0,"
            '"",0.0,0.0,9,9',
        )
        sentence(t, f"BESTVELA,{head};SOL_COMPUTED,DOPPLER,0.000,0.000,{v:.6f},{a:.7f},{-down:.6f},0.0")
    text = "\r\n".join(line for _, line in sorted(lines, key=lambda one: one[0]))
    (folder / "log.asc").write_text(text + "\r\n")
    return folder / "log.asc"


def write_kf_gins(c: Columns, folder: Path) -> Path:
    """IMU in increments, and the fixes with velocity as its own text, RTKLIB and NMEA; one of them is assumed."""
    end_s, angle, velocity = increments(c)
    np.savetxt(folder / "imu.txt", np.column_stack([SECOND + end_s, angle, velocity]), fmt="%.12f")
    sigma = np.full((len(c.fix_s), 3), 1.0)
    rows = np.column_stack([SECOND + c.fix_s, place_deg(c), sigma, c.velocity])
    np.savetxt(folder / "gnss.txt", rows, fmt="%.10f")
    _rtklib(c, folder / "rover.pos")
    _nmea(c, folder / "gps.nmea")
    return folder / "imu.txt"


def _rtklib(c: Columns, path: Path) -> None:
    names = "latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)  vn(m/s)  ve(m/s)  vu(m/s)"
    lines = ["% program   : RTKPOST", f"%  GPST                  {names}"]
    for t, at, v in zip(c.fix_s, place_deg(c), c.velocity * FLU[[0, 0, 2]], strict=True):
        numbers = " ".join(f"{one:.9f}" for one in at)
        moving = " ".join(f"{one:.5f}" for one in v)
        lines.append(f"{WEEK} {SECOND + t:.3f} {numbers}   5  12 1.0000 1.0000 1.0000 {moving}")
    path.write_text("\n".join(lines) + "\n")


def _nmea(c: Columns, path: Path) -> None:
    lines = []

    def sentence(text: str) -> None:
        checksum = 0
        for byte in text.encode():
            checksum ^= byte
        lines.append(f"${text}*{checksum:02X}")

    def angle(degrees: float, width: int, letters: str) -> str:
        size = abs(degrees)
        return f"{int(size):0{width}d}{60.0 * (size - int(size)):011.8f},{letters[int(degrees < 0.0)]}"

    speed, way = course(c)
    for t, (lat, lon, height), v, a in zip(c.fix_s, place_deg(c), speed, way, strict=True):
        at = np.datetime64(EPOCH, "s") + np.timedelta64(round(1000 * t), "ms")
        clock = str(at)[11:].replace(":", "")[:10]
        where = f"{angle(lat, 2, 'NS')},{angle(lon, 3, 'EW')}"
        sentence(f"GPGGA,{clock},{where},1,08,0.9,{height - 40.0:.4f},M,40.0,M,,")
        sentence(f"GPRMC,{clock},A,{where},{v / KNOT:.5f},{a:.5f},010524,,,A")
    path.write_text("\r\n".join(lines) + "\r\n")


# ------------------------------------------------------------------------------------------- robots, tables


def write_euroc(c: Columns, folder: Path) -> Path:
    """Axes up-right-forward; the fixes and their attitude are the ground truth in a local east-north-up frame."""
    from scipy.spatial.transform import Rotation

    (folder / "mav0/imu0").mkdir(parents=True)
    (folder / "mav0/state_groundtruth_estimate0").mkdir()
    turned = np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]])
    rows = np.column_stack([c.gyro @ turned.T, c.force @ turned.T])
    _stamped(folder / "mav0/imu0/data.csv", "#timestamp [ns],wx,wy,wz,ax,ay,az", c.time_s, rows)
    roll, pitch, heading = c.attitude.T
    to_ned = Rotation.from_euler("ZYX", np.column_stack([heading, pitch, roll])).as_matrix()
    quaternion = Rotation.from_matrix(ENU @ to_ned @ turned.T).as_quat()[:, [3, 0, 1, 2]]
    origin = np.radians(c.start[:2])
    here = writers.earth_fixed(c.latitude, c.longitude, c.height_m)
    first = writers.earth_fixed(*(np.array([one]) for one in (*origin, c.start[2])))
    local = (here - first) @ writers.north_east_down(*origin).T
    rows = np.column_stack([local @ ENU.T, quaternion, c.velocity @ ENU.T, np.zeros((len(roll), 6))])
    names = "#timestamp," + ",".join(f"c{k}" for k in range(16))
    _stamped(folder / "mav0/state_groundtruth_estimate0/data.csv", names, c.fix_s, rows)
    return folder


def _stamped(path: Path, names: str, time_s: np.ndarray, rows: np.ndarray) -> None:
    stamps = [EPOCH * 10**9 + round(1e9 * t) for t in time_s]
    text = [names, *(f"{t}," + ",".join(f"{v:.12f}" for v in row) for t, row in zip(stamps, rows, strict=True))]
    path.write_text("\n".join(text) + "\n")


def write_rosbag(c: Columns, folder: Path) -> Path:
    """A bag of ROS 2: IMU without an orientation, fixes and their velocity."""
    from rosbags import rosbag2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    header, stamp = kinds["std_msgs/msg/Header"], kinds["builtin_interfaces/msg/Time"]
    vector = kinds["geometry_msgs/msg/Vector3"]
    none9, nowhere = np.zeros(9), kinds["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    unknown = np.array([-1.0, *np.zeros(8)])  # of a message without an orientation
    imu, fix, moving = "sensor_msgs/msg/Imu", "sensor_msgs/msg/NavSatFix", "geometry_msgs/msg/TwistStamped"
    status = kinds["sensor_msgs/msg/NavSatStatus"](0, 1)
    path = folder / "drive"
    with rosbag2.Writer(path, version=8) as bag:
        topics = {imu: "/imu/data", fix: "/fix", moving: "/vel"}
        connections = {kind: bag.add_connection(topic, kind, typestore=store) for kind, topic in topics.items()}

        def put(kind: str, t: float, *values) -> None:
            ns = EPOCH * 10**9 + round(1e9 * t)
            message = kinds[kind](header(stamp(ns // 10**9, ns % 10**9), "base"), *values)
            bag.write(connections[kind], ns, store.serialize_cdr(message, kind))

        for t, w, f in zip(c.time_s, FLU * c.gyro, FLU * c.force, strict=True):
            put(imu, t, nowhere, unknown, vector(*w), none9, vector(*f), none9)
        still = vector(0.0, 0.0, 0.0)
        for t, at, v in zip(c.fix_s, place_deg(c), c.velocity @ ENU.T, strict=True):
            put(fix, t, status, *at, none9, 0)
            put(moving, t, kinds["geometry_msgs/msg/Twist"](vector(*v), still))
    return path


def columns(c: Columns) -> dict[str, np.ndarray]:
    """Variables of a file without a form of its own; those of the fixes begin with fix."""
    named = {"t": c.time_s, "temp": c.temperature_c, "baro": c.baro_m}
    named |= dict(zip(("wx", "wy", "wz"), c.gyro.T, strict=True)) | dict(
        zip(("ax", "ay", "az"), c.force.T, strict=True)
    )
    named |= {"fix_t": c.fix_s} | dict(zip(("fix_lat", "fix_lon", "fix_h"), place_deg(c).T, strict=True))
    return named | dict(zip(("fix_n", "fix_e", "fix_d"), c.velocity.T, strict=True))


MAPPING = """kind = "{kind}"
axes = "FRD"
time = {{ column = "t", unit = "s" }}
gyro = {{ columns = ["wx", "wy", "wz"], unit = "rad/s" }}
accelerometer = {{ columns = ["ax", "ay", "az"], unit = "m/s^2" }}
temperature = {{ column = "temp" }}
height_baro = {{ column = "baro" }}
[gps]
time = {{ column = "fix_t", unit = "s" }}
position = {{ columns = ["fix_lat", "fix_lon", "fix_h"], unit = "deg" }}
velocity = {{ columns = ["fix_n", "fix_e", "fix_d"], axes = "NED" }}
"""


def write_mat(c: Columns, folder: Path) -> Path:
    (folder / "log.toml").write_text(MAPPING.format(kind=c.kind))
    (folder / "log.mat").write_bytes(writers.matlab_7_3(columns(c)))
    return folder / "log.mat"


def write_netcdf(c: Columns, folder: Path) -> Path:
    (folder / "log.toml").write_text(MAPPING.format(kind=c.kind))
    (folder / "log.nc").write_bytes(writers.netcdf_4(columns(c)))
    return folder / "log.nc"


def nothing(c: Columns, folder: Path) -> dict[str, str]:
    return {}


def kind(c: Columns, folder: Path) -> dict[str, str]:
    return {"kind": c.kind}


def beside(name: str):
    return lambda c, folder: {"kind": c.kind, "gps.file": str(folder / name)}


def place(c: Columns, folder: Path) -> dict[str, str]:
    names = ("latitude_deg", "longitude_deg", "height_m")
    return {"kind": c.kind} | {name: repr(value) for name, value in zip(names, c.start, strict=True)}


def unit(c: Columns, folder: Path) -> dict[str, str]:
    return {"kind": c.kind, "imu.model": "HG1700-AG58"}


# name of a way to write: the reader's format, the function, what a user states beside the file
WRITERS = {
    "ulog": ("ulog", write_ulog, kind),
    "dataflash": ("dataflash", write_dataflash, kind),
    "novatel": ("novatel", write_novatel, unit),
    "kf-gins": ("kf-gins", write_kf_gins, beside("gnss.txt")),
    "rtklib": ("kf-gins", write_kf_gins, beside("rover.pos")),
    "nmea": ("kf-gins", write_kf_gins, beside("gps.nmea")),
    "euroc": ("euroc", write_euroc, place),
    "rosbag": ("rosbag", write_rosbag, kind),
    "mat": ("mat", write_mat, nothing),
    "netcdf": ("netcdf", write_netcdf, nothing),
}
