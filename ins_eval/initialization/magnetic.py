"""A heading from a magnetometer, for those who ask for it: iron near it makes any compass lie.

With the magnetometer's means m and the specific force f at the beginning, both in body axes (forward, right, down),

    D = -f / |f|,   E = D x m / |D x m|,   N = E x D,   heading = atan2(E_x, N_x) + declination

where E_x and N_x are the parts of east and north along the forward axis. Source: Groves, Principles of GNSS, Inertial,
and Multisensor Integrated Navigation Systems, 2nd ed. 2013, section 6.1.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ins_eval.errors import DataRefused, UsageError, did_you_mean
from ins_eval.printable import shown
from ins_eval.recording import Recording
from ins_eval.units import DEG

MEAN_S = 1.0  # from the first sample on
# of a level from consumer accelerometers (30 mg), and of a magnetometer that nobody calibrated in its vehicle
SIGMA_RAD = (2.0 * DEG, 2.0 * DEG, 10.0 * DEG)  # roll, pitch, heading


def with_magnetic_heading(recording: Recording, columns: Sequence[str], declination_rad: float) -> Recording:
    """The recording with an attitude of its start that the magnetometer gives, where it states none.

    Parameters
    ----------
    columns : the three columns of `imu` in body axes, in any unit
    declination_rad : of the magnetic field, east positive

    Raises: UsageError where a column is not there, DataRefused where they hold no horizontal field.
    """
    if recording.start.attitude_rad is not None:
        return recording
    imu = recording.imu
    for name in columns:
        if imu is None or name not in imu.further:
            known = () if imu is None else tuple(imu.further)
            raise UsageError(
                f"{recording.name}: imu has no column {shown(name)} for a magnetometer{did_you_mean(name, known)}"
            )
    rows = imu.time_s <= imu.time_s[0] + MEAN_S
    field_b = np.array([imu.further[name][rows].mean() for name in columns])
    force_b = imu.accelerometer[rows].sum(axis=0)
    down_b = -force_b / np.linalg.norm(force_b)
    east_b = np.cross(down_b, field_b)
    if not np.linalg.norm(east_b) > 0.0:
        raise DataRefused(
            f"{recording.name}: the magnetometer shows {field_b} in the first second, expected a field that is not "
            "vertical; name its three columns in body axes"
        )
    east_b /= np.linalg.norm(east_b)
    heading = float(np.arctan2(east_b[0], np.cross(east_b, down_b)[0]) + declination_rad)
    level = float(np.arctan2(down_b[1], down_b[2])), float(-np.arcsin(np.clip(down_b[0], -1.0, 1.0)))
    note = f"The heading of the start is that of the magnetometer, {np.degrees(heading) % 360.0:.1f} degrees."
    start = replace(recording.start, attitude_rad=(*level, heading), attitude_sigma_rad=SIGMA_RAD)
    return replace(recording, start=start, notes=(*recording.notes, note))
