"""Reader of a PX4 log (ULog, also packed as .gz): topics by name, stamps in microseconds since boot.

    sensor_combined       mean rate [rad/s] and specific force [m/s^2] over the sample, of the IMU that PX4 chose
    vehicle_imu           increments of IMU n: --assume imu.instance=n
    sensor_gps, vehicle_gps_position   fixes
    vehicle_attitude      the autopilot's attitude, quaternion w x y z, forward-right-down into north-east-down
    vehicle_local_position   the autopilot's own solution, m north-east-down of its origin

Source: PX4 user guide, ULog file format; message definitions of PX4-Autopilot.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from pymap3d import ned2geodetic

from ins_eval.boundary import content
from ins_eval.errors import DataRefused
from ins_eval.readers import assembly, autopilot
from ins_eval.readers.apm_log import ATTITUDE_SIGMA_RAD
from ins_eval.readers.autopilot import US
from ins_eval.readers.fix_columns import attitude_of, checked_groups, groups_found
from ins_eval.readers.layout import Layout
from ins_eval.readers.optional import library
from ins_eval.readers.sampling import Readings
from ins_eval.recording import Fixes, Recording
from ins_eval.units import DEG

KEYS = autopilot.KEYS
EXPECTED = "a PX4 log (.ulg) with sensor_combined or vehicle_imu"
GPS = ("sensor_gps", "vehicle_gps_position")
TOPICS = ("sensor_combined", "vehicle_imu", *GPS, "vehicle_attitude", "vehicle_local_position")
HEADER_BYTES = 16
MESSAGES = frozenset(b"BFIMPQARDLCSO")  # types of messages
GOOD_FIX = 3  # fix_type: three-dimensional
XYZ = ("[0]", "[1]", "[2]")
LAYOUT = Layout("rad", "m/s", "FRD")

Topics = dict[tuple[str, int], dict[str, np.ndarray]]


def read(path: Path, assumed: Mapping[str, str]) -> Recording:
    """The whole log as one flight."""
    log, lost_bytes = _log(path)
    topics: Topics = {(data.name, data.multi_id): data.data for data in log.data_list}
    try:
        with np.errstate(all="ignore"):  # damaged values overflow, and are refused by their size
            readings, which = _readings(path, topics, assumed)
            gps, gps_note = _gps(path, topics)
            attitude = _attitude(topics)
            solution = _solution(path, topics, attitude)
    except KeyError as missing:
        raise DataRefused(
            f"{path}: a topic has no field {missing}, expected {EXPECTED}; log it with its fields"
        ) from None
    lost_s = 1e-3 * sum(dropout.duration for dropout in log.dropouts)
    return assembly.recording(
        assembly.Tables(
            name=path.name.removesuffix(".gz").removesuffix(".ulg"),
            kind=assumed.get("kind", "flight"),
            readings=readings,
            layout=LAYOUT,
            gps=gps,
            reference=attitude,
            solution=solution,
            belief=autopilot.belief(gps),
            attitude_sigma_rad=ATTITUDE_SIGMA_RAD,
            notes=(
                f"The file {path.name} is a PX4 log with {len(readings.time_s)} samples of {which}; stamps are seconds "
                "since boot.",
                f"Found {len(log.dropouts)} dropouts of the logger, {lost_s:.3g} s in all.",
                *(
                    [f"The file is damaged: the last {lost_bytes} bytes, behind the damage, were left out."]
                    if lost_bytes
                    else []
                ),
                gps_note,
                *_own_notes(attitude, solution),
                "The antenna's lever arm is not documented and taken as 0; sigmas of a MEMS unit and of a "
                "single-frequency receiver are assumed.",
            ),
        ),
        str(path),
        assumed,
        "this is the format's convention",
    )


def _log(path: Path):
    pyulog = library("pyulog", f"{path}")
    raw = content(path, EXPECTED)
    end = _sound_end(raw)
    try:
        with autopilot.quiet():
            log = pyulog.ULog(io.BytesIO(raw[:end]), message_name_filter_list=list(TOPICS), disable_str_exceptions=True)
        return log, len(raw) - end
    except Exception:  # a damaged file makes the library fail in many ways
        raise DataRefused(f"{path}: cannot be read as a PX4 log, expected {EXPECTED}; copy the file again") from None


def _sound_end(raw: bytes) -> int:
    """Where the last whole message of a known type ends: beyond damage the library may search without end.

    message   size of the content (2 bytes), type (1 byte), content
    """
    at = HEADER_BYTES
    while at + 3 <= len(raw):
        size, kind = int.from_bytes(raw[at : at + 2], "little"), raw[at + 2]
        if kind not in MESSAGES or size == 0 or at + 3 + size > len(raw):
            break
        at += 3 + size
    return at


def _readings(path: Path, topics: Topics, assumed: Mapping[str, str]) -> tuple[Readings, str]:
    """Increments over each sample, of the IMU that is assumed or of the one that the autopilot used."""
    single = sorted(number for name, number in topics if name == "vehicle_imu")
    if ("sensor_combined", 0) in topics and "imu.instance" not in assumed:
        table, others = topics["sensor_combined", 0], f" ({len(single)} more as vehicle_imu)" if single else ""
        gyro_s = _seconds(table["gyro_integral_dt"])
        force_s = _seconds(table["accelerometer_integral_dt"])
        gyro = gyro_s * _vectors(table, "gyro_rad")
        force = force_s * _vectors(table, "accelerometer_m_s2")
        return Readings(US * table["timestamp"].astype(float), gyro, force), f"sensor_combined{others}"
    if not single and ("sensor_combined", 0) in topics:
        autopilot.instance(assumed, f"{path}, only sensor_combined, and", [0])
        return _readings(path, topics, {key: value for key, value in assumed.items() if key != "imu.instance"})
    if not single:
        raise DataRefused(
            f"{path}: holds no topic sensor_combined or vehicle_imu, expected {EXPECTED}; log one of them"
        )
    chosen = autopilot.instance(assumed, str(path), single)
    table = topics["vehicle_imu", chosen]
    stamps = US * table.get("timestamp_sample", table["timestamp"]).astype(float)
    readings = Readings(stamps, _vectors(table, "delta_angle"), _vectors(table, "delta_velocity"))
    return readings, f"vehicle_imu {chosen} of {', '.join(map(str, single))}"


def _vectors(table: Mapping[str, np.ndarray], name: str) -> np.ndarray:
    return np.column_stack([table[f"{name}{axis}"].astype(float) for axis in XYZ])


def _seconds(column: np.ndarray) -> np.ndarray:
    """An interval as a column (n, 1): whole numbers are microseconds, as later versions write."""
    return (column.astype(float) * (US if column.dtype.kind in "iu" else 1.0))[:, None]


def _gps(path: Path, topics: Topics) -> tuple[Fixes | None, str]:
    key = next(((name, 0) for name in GPS if (name, 0) in topics), None)
    if key is None:
        return None, "The log holds no fixes of a receiver."
    table = topics[key]
    if "latitude_deg" in table:
        latitude, longitude = DEG * table["latitude_deg"], DEG * table["longitude_deg"]
        height_m = table["altitude_ellipsoid_m"].astype(float)
    else:
        latitude, longitude = 1e-7 * DEG * table["lat"], 1e-7 * DEG * table["lon"]
        height_m = 1e-3 * table["alt_ellipsoid"]
    stamps = US * table["timestamp"].astype(float)
    velocity_n = np.column_stack([table[f"vel_{axis}_m_s"].astype(float) for axis in "ned"])
    keep = autopilot.later(stamps)
    position = np.column_stack([latitude, longitude, height_m])
    valid = (table["fix_type"] >= GOOD_FIX) & groups_found(position, velocity_n, None)
    fixes = Fixes.of(stamps[keep], position[keep], velocity_n[keep], valid[keep])
    return checked_groups(fixes, f"{path}, {key[0]}"), (
        f"Found {int(keep.sum())} fixes in {key[0]}, {int((~fixes.valid).sum())} of them without a three-dimensional "
        "position; heights are ellipsoidal, stamps those of the autopilot."
    )


def _attitude(topics: Topics) -> Fixes | None:
    table = topics.get(("vehicle_attitude", 0))
    if table is None:
        return None
    quaternion = np.column_stack([table[f"q[{k}]"].astype(float) for k in (1, 2, 3, 0)])
    return autopilot.of_attitude(US * table["timestamp"].astype(float), attitude_of(quaternion))


def _solution(path: Path, topics: Topics, attitude: Fixes | None) -> Fixes | None:
    """The autopilot's own position and velocity; position only where its origin is known."""
    table = topics.get(("vehicle_local_position", 0))
    if table is None:
        return None
    stamps = US * table["timestamp"].astype(float)
    north, east, down = (table[axis].astype(float) for axis in "xyz")
    located = (table["xy_global"] > 0) & (table["z_global"] > 0) & (table["xy_valid"] > 0)
    with np.errstate(all="ignore"):
        origin = (table[name].astype(float) for name in ("ref_lat", "ref_lon", "ref_alt"))
        position = np.column_stack(ned2geodetic(north, east, down, *origin)) * [DEG, DEG, 1.0]
    position[~located] = np.nan
    velocity_n = np.column_stack([table[f"v{axis}"].astype(float) for axis in "xyz"])
    velocity_n[table["v_xy_valid"] <= 0, :2] = np.nan
    velocity_n[table["v_z_valid"] <= 0, 2] = np.nan
    keep = autopilot.later(stamps) & groups_found(position, velocity_n, None)
    if not keep.any():
        return None
    nearest = None
    if attitude is not None:
        after = np.clip(np.searchsorted(attitude.time_s, stamps[keep]), 0, len(attitude.time_s) - 1)
        nearest = attitude.attitude_rad[after]
    fixes = Fixes.of(stamps[keep], position[keep], velocity_n[keep], np.ones(int(keep.sum()), dtype=bool), nearest)
    return checked_groups(fixes, f"{path}, vehicle_local_position")


def _own_notes(attitude: Fixes | None, solution: Fixes | None) -> list[str]:
    notes = []
    if attitude is not None:
        notes.append(
            f"The autopilot's own attitude, {len(attitude.time_s)} rows, is the reference: it is no better navigator, "
            "but something to start from."
        )
    if solution is not None:
        where = "with" if np.isfinite(solution.latitude_rad).any() else "without"
        notes.append(
            f"The autopilot's own solution, {len(solution.time_s)} rows of vehicle_local_position {where} an origin on "
            "the Earth, is the table solution."
        )
    return notes
