"""Reader of an ArduPilot DataFlash log (.bin): messages by name, stamps in microseconds since boot.

    IMU, or IMU IMU2 IMU3   gyro [rad/s], accelerometer [m/s^2], temperature [degC], forward-right-down
    GPS                     latitude longitude [deg], height [m] above sea level, speed [m/s], course [deg], down [m/s]
    ATT                     the autopilot's roll, pitch, yaw [deg]

A file may hold several boots, time beginning anew in each; the longest is read, or with --assume boot=2 the second.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ins_eval.boundary import content
from ins_eval.errors import DataRefused, UsageError
from ins_eval.readers import assembly, autopilot
from ins_eval.readers.apm_log import ATTITUDE_SIGMA_RAD, GOOD_FIX
from ins_eval.readers.autopilot import US
from ins_eval.readers.fix_columns import checked_groups, groups_found
from ins_eval.readers.layout import Layout
from ins_eval.readers.optional import library
from ins_eval.readers.options import number
from ins_eval.readers.sampling import Readings
from ins_eval.recording import Fixes, Recording
from ins_eval.units import DEG

KEYS = (*autopilot.KEYS, "boot")
EXPECTED = "an ArduPilot DataFlash log (.bin) with IMU messages"
FIELDS = {
    "IMU": ("TimeUS", "GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"),
    "GPS": ("TimeUS", "Status", "Lat", "Lng", "Alt", "Spd", "GCrs", "VZ"),
    "ATT": ("TimeUS", "Roll", "Pitch", "Yaw"),
}
NUMBERED = {"IMU": ("IMU", 0), "IMU2": ("IMU", 1), "IMU3": ("IMU", 2), "GPS": ("GPS", 0), "ATT": ("ATT", 0)}
TEMPERATURE = "T"
MAGIC = b"\xa3\x95"
BACK_US = 1e6  # by which time goes back at a boot
LAYOUT = Layout("rad/s", "m/s^2", "FRD")

Rows = dict[tuple[str, int], list[tuple[float, ...]]]  # by message and instance


def read(path: Path, assumed: Mapping[str, str]) -> Recording:
    """One boot of the log as one flight."""
    boots = [boot for boot in _boots(path) if any(name == "IMU" for name, _ in boot)]
    if not boots:
        raise DataRefused(f"{path}: holds no IMU messages, expected {EXPECTED}; set the logger to write them")
    boot, chosen = _chosen(path, boots, assumed)
    known = sorted(number for name, number in boot if name == "IMU")
    which = autopilot.instance(assumed, str(path), known)
    imu = np.array(boot["IMU", which])
    readings = Readings(US * imu[:, 0], imu[:, 1:4], imu[:, 4:7])
    if np.isfinite(imu[:, 7]).all():
        readings.scalars["temperature_c"] = imu[:, 7]
    gps, gps_note = _gps(path, boot)
    attitude = np.array(boot.get(("ATT", 0), np.zeros((0, 4))))
    reference = autopilot.of_attitude(
        US * attitude[:, 0], DEG * np.column_stack([attitude[:, 1:3], attitude[:, 3] % 360.0])
    )
    return assembly.recording(
        assembly.Tables(
            name=path.name.removesuffix(".gz").rpartition(".")[0] or path.stem,
            kind=assumed.get("kind", "flight"),
            readings=readings,
            layout=LAYOUT,
            gps=gps,
            reference=reference,
            belief=autopilot.belief(gps),
            attitude_sigma_rad=ATTITUDE_SIGMA_RAD,
            notes=(
                f"The file {path.name} is an ArduPilot log of {len(boots)} boot{'s' * (len(boots) > 1)}, of which "
                f"number {chosen} is read; stamps are seconds since boot.",
                f"IMU {which} of {', '.join(map(str, known))} is read; --assume imu.instance=N reads another.",
                gps_note,
                *(
                    [
                        f"The autopilot's own attitude, {len(reference.time_s)} rows, is the reference: it is no "
                        "better navigator, but something to start from."
                    ]
                    if reference is not None
                    else []
                ),
                "The antenna's lever arm is not documented and taken as 0; sigmas of a MEMS unit and of a "
                "single-frequency receiver are assumed.",
            ),
        ),
        str(path),
        assumed,
        "this is the format's convention",
    )


def _boots(path: Path) -> list[Rows]:
    """The messages of each boot as rows of numbers; a row of IMU ends with its temperature."""
    reader = library("pymavlink.DFReader", f"{path}")
    raw = content(path, EXPECTED)
    if not raw.startswith(MAGIC):
        raise DataRefused(f"{path}: is no DataFlash log, expected {EXPECTED}; check that this is the format named")
    boots: list[Rows] = [{}]
    failed = False
    with tempfile.TemporaryDirectory() as folder, autopilot.quiet():
        plain = Path(folder) / "log.bin"  # the library wants a file that is not packed
        plain.write_bytes(raw)
        log = reader.DFReader_binary.__new__(reader.DFReader_binary)  # at hand to be closed where its making fails
        try:
            log.__init__(str(plain), zero_time_base=True)
            _collect(log, boots)
        except Exception:  # a damaged file makes the library fail in many ways
            failed = True
        for part in (getattr(log, "data_map", None), getattr(log, "filehandle", None)):
            if part is not None:
                with contextlib.suppress(BufferError):  # a message still looks into the map
                    part.close()
    if failed:
        raise DataRefused(f"{path}: cannot be read as a DataFlash log, expected {EXPECTED}; copy it again")
    return boots


def _collect(log, boots: list[Rows]) -> None:
    """Add the messages to the last of `boots`, to a new one where time goes back."""
    latest = -np.inf
    while (message := log.recv_match(type=list(NUMBERED))) is not None:
        name, instance = NUMBERED[message.get_type()]
        row = tuple(float(getattr(message, field, np.nan)) for field in FIELDS[name])
        if not np.isfinite(row[0]):
            continue
        if row[0] < latest - BACK_US:
            boots.append({})
        latest = row[0]
        if name == "IMU":
            row = (*row, float(getattr(message, TEMPERATURE, np.nan)))
        boots[-1].setdefault((name, int(getattr(message, "I", instance))), []).append(row)


def _chosen(path: Path, boots: list[Rows], assumed: Mapping[str, str]) -> tuple[Rows, int]:
    """The boot that is assumed, or the one with most IMU messages, and its number, from 1."""
    lengths = [max(len(rows) for (name, _), rows in boot.items() if name == "IMU") for boot in boots]
    chosen = number(assumed, "boot", float(np.argmax(lengths) + 1))
    if chosen not in range(1, len(boots) + 1):
        raise UsageError(f"--assume boot={assumed['boot']}: {path} has {len(boots)} boots; choose 1 to {len(boots)}")
    return boots[int(chosen) - 1], int(chosen)


def _gps(path: Path, boot: Rows) -> tuple[Fixes | None, str]:
    if ("GPS", 0) not in boot:
        return None, "The log holds no fixes of a receiver."
    stamps, status, latitude, longitude, height, speed, course, down = np.array(boot["GPS", 0]).T
    keep = autopilot.later(stamps)
    position = np.column_stack([DEG * latitude, DEG * longitude, height])
    velocity_n = np.column_stack([speed * np.cos(course * DEG), speed * np.sin(course * DEG), down])
    valid = (status >= GOOD_FIX) & groups_found(position, velocity_n, None)
    fixes = Fixes.of(US * stamps[keep], position[keep], velocity_n[keep], valid[keep])
    note = (
        f"Found {int(keep.sum())} fixes, {int((~fixes.valid).sum())} of them without a three-dimensional position, "
        "stamped with the autopilot's time; their heights are above mean sea level and taken as ellipsoidal."
    )
    if not fixes.valid.any():
        return None, note + " None is usable, so there is no table gps."
    return checked_groups(fixes, f"{path}, GPS"), note
