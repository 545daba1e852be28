"""An ArduPilot log as its tables, whatever file they came from: rates of a MEMS IMU, GPS fixes, attitude on board.

    IMU   time [ms], gyro x y z [rad/s], accelerometer x y z [m/s^2]     forward-right-down
    GPS   time of reception [ms], latitude longitude [deg], height [m], speed [m/s], course [deg], velocity down [m/s]
    ATT   time [ms], roll pitch yaw [deg]

The fixes are stamped when they arrive, so their clock offset is the receiver's latency. The logger loses rows now and
then; what a MEMS unit cannot know over half a second is no worse than its own errors, so such gaps are bridged.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ins_eval.errors import DataRefused
from ins_eval.readers.epochs import checked
from ins_eval.readers.layout import Layout
from ins_eval.readers.options import believed_time_offset
from ins_eval.readers.sampling import Readings, sampled
from ins_eval.recording import Fixes, Recording, Start
from ins_eval.recording.belief import AccelerometerBelief, Belief, GpsBelief, GyroBelief, HeightBelief
from ins_eval.units import DEG

KEYS = (*Layout.KEYS, "gps.time_offset_s")
LAYOUT = Layout("rad/s", "m/s^2", "FRD")
MS = 1e-3
GOOD_FIX = 3  # the receiver's status: three-dimensional
AUTHORS_DELAY_S = 0.23  # of velocity, the default of the authors' filter, the same for every log

# What is believed of an autopilot's MEMS unit after its own start-up calibration, and of a single-frequency receiver.
ATTITUDE_SIGMA_RAD = (5.0 * DEG, 5.0 * DEG, 20.0 * DEG)
GYRO = GyroBelief(bias_sigma_deg_per_h=600.0, angle_random_walk_deg_per_sqrt_h=0.3)
ACCELEROMETER = AccelerometerBelief(bias_sigma_ug=20000.0, velocity_random_walk_ug_per_sqrt_hz=400.0)
POSITION_SIGMA_M, VELOCITY_SIGMA_MPS = 2.5, 0.3
SETTLING_S = 20.0  # a receiver just switched on wanders: how far in this time is in the sigmas of the start
HEIGHT_SIGMA_M = 5.0


@dataclass(frozen=True)
class Log:
    """The tables of a log as floats; `height` says what the heights of its fixes are."""

    imu: np.ndarray  # (n, 7) time [ms], gyro, accelerometer
    gps: np.ndarray  # (m, 8) time [ms], status, latitude, longitude, height, speed, course, velocity down
    attitude: np.ndarray  # (k, 4) time [ms], roll, pitch, yaw [deg]
    height: str


def recording(log: Log, path: Path, form: str, assumed: Mapping[str, str]) -> Recording:
    """The recording of a log whose file is in `form`, a few words."""
    where = str(path)
    layout = LAYOUT.overridden(assumed)
    rows = log.imu
    samples = sampled(Readings(MS * rows[:, 0], rows[:, 1:4], rows[:, 4:7]), layout, f"{where}, IMU")
    gps = _fixes(log.gps, f"{where}, GPS")
    offset_s, offset_note = believed_time_offset(
        "gps", assumed, f"the log does not document it (its authors' filter takes {AUTHORS_DELAY_S} s by default)"
    )
    attitude = _attitude(log.attitude, f"{where}, ATT")
    start, start_note = _start(samples.start_s, gps, offset_s, attitude)
    return Recording(
        name=path.stem,
        kind="flight",
        start=start,
        imu=samples.imu,
        gps=gps,
        reference=attitude,
        belief=Belief(
            gps=GpsBelief(
                time_offset_s=offset_s, position_sigma_m=POSITION_SIGMA_M, velocity_sigma_mps=VELOCITY_SIGMA_MPS
            ),
            height=HeightBelief(source="gps", sigma_m=HEIGHT_SIGMA_M),
            gyro=GYRO,
            accelerometer=ACCELEROMETER,
        ),
        notes=(
            f"The file {path.name} is an ArduPilot log {form} with {len(rows)} IMU rows, {len(log.gps)} fixes and "
            f"{len(log.attitude)} attitudes.",
            *layout.notes(assumed, "this is the format's convention"),
            *samples.notes,
            f"Found {len(gps.time_s)} GPS fixes, {int((~gps.valid).sum())} of them without a three-dimensional "
            "position; they are stamped with the autopilot's time of reception.",
            offset_note,
            f"Heights of the fixes are {log.height}; they are taken as ellipsoidal.",
            start_note,
            f"The autopilot's own attitude, {len(attitude.time_s)} rows, is the reference, without position and "
            "velocity: it is no better navigator, but something to start from again.",
            "The antenna's lever arm is not documented and taken as 0; sigmas of a MEMS unit and of a single-frequency "
            "receiver are assumed; the log carries no temperature of the IMU.",
        ),
    )


def _fixes(table: np.ndarray, where: str) -> Fixes:
    stamps, status, latitude, longitude, height, speed, course, down = table.T
    valid = (status >= GOOD_FIX) & np.isfinite(table).all(axis=1)
    with np.errstate(invalid="ignore"):  # of a damaged course; such a fix is not valid
        north, east = speed * np.cos(course * DEG), speed * np.sin(course * DEG)
    velocity_n = np.column_stack([north, east, down])
    return checked(Fixes(MS * stamps, latitude * DEG, longitude * DEG, height, velocity_n, valid), where)


def _attitude(table: np.ndarray, where: str) -> Fixes:
    """The autopilot's attitude, rows that are not finite or not later than those before left out."""
    rows = table[np.isfinite(table).all(axis=1)]
    if not len(rows):
        raise DataRefused(f"{where}: holds no attitude, expected rows of time, roll, pitch, yaw; export them too")
    later = np.concatenate([[True], rows[1:, 0] > np.maximum.accumulate(rows[:, 0])[:-1]])
    time_ms, roll, pitch, yaw = rows[later].T
    return Fixes.of_attitude(MS * time_ms, DEG * np.column_stack([roll, pitch, yaw % 360.0]), valid=False)


def _start(start_s: float, gps: Fixes, offset_s: float, attitude: Fixes) -> tuple[Start, str]:
    """Position and velocity of the fix nearest to the start, attitude of the autopilot nearest to it."""
    valid = np.flatnonzero(gps.valid)
    k = int(valid[np.argmin(np.abs(gps.time_s[valid] - offset_s - start_s))])
    settling = gps.valid & (np.abs(gps.time_s - gps.time_s[k]) <= SETTLING_S)
    near = attitude.attitude_rad[np.argmin(np.abs(attitude.time_s - start_s))]
    start = Start(
        time_s=start_s,
        **gps.state(k),
        attitude_rad=tuple(near.tolist()),
        attitude_sigma_rad=ATTITUDE_SIGMA_RAD,
        position_sigma_m=max(POSITION_SIGMA_M, _wander(gps.height_m[settling] - gps.height_m[k])),
        velocity_sigma_mps=max(VELOCITY_SIGMA_MPS, _wander(gps.velocity_n[settling] - gps.velocity_n[k])),
    )
    roll, pitch, heading = near / DEG
    sigmas = ", ".join(f"{sigma / DEG:.0f}" for sigma in ATTITUDE_SIGMA_RAD)
    return start, (
        f"The start takes position and velocity from the fix stamped {gps.time_s[k]:.4g} s and roll {roll:.4g}, pitch "
        f"{pitch:.4g}, heading {heading:.4g} degrees from the autopilot's own attitude, believed to {sigmas} degrees."
    )


def _wander(differences: np.ndarray) -> float:
    return float(np.sqrt(np.mean(differences**2)))
