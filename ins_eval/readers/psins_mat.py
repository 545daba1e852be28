"""Reader of a PSINS recording in a MATLAB file: a vehicle's IMU beside a better navigator, both on their own clock.

    mimu    (n, 7)   angle increments x y z [rad], velocity increments x y z [m/s], time [s]
    fogavp  (m, 10)  pitch roll yaw [rad], velocity east north up [m/s], latitude longitude [rad], height [m], time [s]
    eb0, db0, mu0    gyro bias [rad/s], accelerometer bias [m/s^2], installation angles [rad]: the authors' constants

Body axes are right-forward-up, yaw is counter-clockwise from north (as in `psins_text`). The navigator becomes the
reference; the authors' biases become what is believed. The format is the one of the transfer alignment data of the
PSINS toolbox of G. Yan.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ins_eval.errors import DataRefused
from ins_eval.readers.epochs import checked
from ins_eval.readers.files import numbers
from ins_eval.readers.layout import Layout, frd_from
from ins_eval.readers.matlab5 import variables
from ins_eval.readers.options import believed_time_offset
from ins_eval.readers.sampling import Readings, sampled
from ins_eval.recording import Fixes, Imu, Recording, Start
from ins_eval.recording.belief import AccelerometerBelief, Belief, GyroBelief, HeightBelief, ReferenceBelief
from ins_eval.units import DEG

KEYS = (*Layout.KEYS, "reference.time_offset_s")
EXPECTED = "a PSINS recording with the variables mimu and fogavp"
LAYOUT = Layout("rad", "m/s", "RFU")
IMU_COLUMNS = "angle increments [rad], velocity increments [m/s], time [s]"
NAVIGATOR_COLUMNS = "pitch roll yaw [rad], velocity east north up [m/s], latitude longitude [rad], height [m], time [s]"

# What is believed of a MEMS unit and of the navigator beside it, where the file does not say.
ATTITUDE_SIGMA_RAD = (0.5 * DEG, 0.5 * DEG, 0.5 * DEG)  # the installation angles are of this size
POSITION_SIGMA_M, VELOCITY_SIGMA_MPS = 1.0, 0.05
GYRO = {"bias_sigma_deg_per_h": 20.0, "angle_random_walk_deg_per_sqrt_h": 0.3}
ACCELEROMETER = {"bias_sigma_ug": 2000.0, "velocity_random_walk_ug_per_sqrt_hz": 300.0}


def read(path: Path, assumed: Mapping[str, str]) -> Recording:
    """The IMU from the navigator's first epoch on, started there with the navigator's state."""
    tables = variables(path, ("mimu", "fogavp", "eb0", "db0", "mu0"), EXPECTED)
    for name in ("mimu", "fogavp"):
        if name not in tables:
            raise DataRefused(
                f"{path}: has no variable {name}, expected {EXPECTED}; check that this is the format named"
            )
    rows = numbers(f"{path}, mimu", tables["mimu"], 7, IMU_COLUMNS)
    reference = _reference(path, numbers(f"{path}, fogavp", tables["fogavp"], 10, NAVIGATOR_COLUMNS))
    layout = LAYOUT.overridden(assumed)
    samples = sampled(Readings(rows[:, 6], rows[:, :3], rows[:, 3:6]), layout, f"{path}, mimu")
    offset_s, offset_note = believed_time_offset("reference", assumed, "the file does not document it")
    imu, start, left_out = _from_first_epoch(path, samples.imu, samples.start_s, reference, offset_s)
    biases = {name: _constant(path, tables, name, frd_from(layout.axes)) for name in ("eb0", "db0")}
    return Recording(
        name=path.stem,
        kind="drive",
        start=start,
        imu=imu,
        reference=reference,
        belief=Belief(
            height=HeightBelief(source="none"),
            reference=ReferenceBelief(
                time_offset_s=offset_s, position_sigma_m=POSITION_SIGMA_M, velocity_sigma_mps=VELOCITY_SIGMA_MPS
            ),
            gyro=GyroBelief(bias_radps=biases["eb0"], source="bias_radps: the authors' constant eb0", **GYRO),
            accelerometer=AccelerometerBelief(
                bias_mps2=biases["db0"], source="bias_mps2: the authors' constant db0", **ACCELEROMETER
            ),
        ),
        notes=(
            f"The file {path.name} is a PSINS recording: {len(rows)} IMU samples and {len(reference.time_s)} epochs of "
            "a better navigator, taken as the reference.",
            *layout.notes(assumed, "this is the format's convention"),
            *samples.notes,
            "The navigator's angles are pitch, roll and yaw counter-clockwise from north, its velocities east, north, "
            "up, because this is the format's convention.",
            f"The recording starts with the navigator's state at its first epoch; {left_out} earlier samples were "
            "left out.",
            f"The authors' constant biases were taken over as believed, turned to our axes: gyro "
            f"{_shown(biases['eb0'])} rad/s, accelerometer {_shown(biases['db0'])} m/s^2.",
            *(
                [f"The installation angles of the file, {_shown(tables['mu0'].ravel())} rad, were not applied."]
                if "mu0" in tables
                else []
            ),
            offset_note,
            "Sigmas of a MEMS unit are assumed; the file carries no temperature, no barometer and no GPS.",
        ),
    )


def _reference(path: Path, table: np.ndarray) -> Fixes:
    if not np.isfinite(table).all():
        raise DataRefused(f"{path}, fogavp: holds values that are not finite; remove these rows")
    pitch, roll, yaw = table[:, :3].T
    velocity_n = np.column_stack([table[:, 4], table[:, 3], -table[:, 5]])
    attitude = np.column_stack([roll, pitch, np.mod(-yaw, 2.0 * np.pi)])
    valid = np.ones(len(table), dtype=bool)
    return checked(Fixes.of(table[:, 9], table[:, 6:9], velocity_n, valid, attitude), f"{path}, fogavp")


def _from_first_epoch(
    path: Path, imu: Imu, start_s: float, reference: Fixes, offset_s: float
) -> tuple[Imu, Start, int]:
    """The samples after the first epoch that the IMU covers, to the nearest sample, and the state there."""
    edges_s = np.append(start_s, imu.time_s)
    instants_s = reference.time_s - offset_s
    inside = np.flatnonzero((instants_s >= edges_s[0] - 1e-6) & (instants_s < edges_s[-1] - 1e-6))
    if not inside.size:
        raise DataRefused(
            f"{path}: mimu covers {edges_s[0]:.6g} to {edges_s[-1]:.6g} s and fogavp {reference.time_s[0]:.6g} to "
            f"{reference.time_s[-1]:.6g} s, expected an overlap; check both time columns"
        )
    k = int(inside[0])
    first = int(np.argmin(np.abs(edges_s[:-1] - instants_s[k])))
    start = Start(
        time_s=float(edges_s[first]),
        **reference.state(k),
        attitude_rad=tuple(reference.attitude_rad[k].tolist()),
        attitude_sigma_rad=ATTITUDE_SIGMA_RAD,
        position_sigma_m=POSITION_SIGMA_M,
        velocity_sigma_mps=VELOCITY_SIGMA_MPS,
    )
    kept = replace(imu, time_s=imu.time_s[first:], gyro=imu.gyro[first:], accelerometer=imu.accelerometer[first:])
    return kept, start, first


def _constant(path: Path, tables: dict[str, np.ndarray], name: str, turn: np.ndarray) -> tuple[float, float, float]:
    """One of the authors' constants in our axes, zero where the file has none."""
    if name not in tables:
        return (0.0, 0.0, 0.0)
    value = tables[name].ravel()
    if value.shape != (3,) or value.dtype.kind not in "iuf" or not np.isfinite(value).all():
        raise DataRefused(
            f"{path}: {name} has shape {tables[name].shape}, expected three finite numbers; correct or remove it"
        )
    return tuple((turn @ value).tolist())


def _shown(values) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in values) + ")"
