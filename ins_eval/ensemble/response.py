"""What a constant scale-factor error of one accelerometer does to a flight that is otherwise without errors.

The answer is linear as long as the error is small, so the flight is navigated once for each axis and every instrument
follows from its three scale-factor errors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ins_eval.ensemble.changes import Attitude
from ins_eval.ensemble.world import beginning
from ins_eval.imu import Mission
from ins_eval.navigation import evaluate
from ins_eval.recording import Imu, Recording
from ins_eval.recording.belief import NAVIGATION_GRADE
from ins_eval.units import PPM

STEP_PPM = 100.0


@dataclass(frozen=True, eq=False)
class Response:
    """Of each ppm on x, y and z, at `time_s` (m,), north-east-down; `errors` of an instrument follow by ``ppm @ ...``.

    velocity, position   (3, m, 3) errors of the navigated flight in m/s and m
    fed_in               (3, m, 3) what the accelerometers have put into the velocity so far, integral of C s f dt in
                         m/s: before gravity, through a platform that tilts, answers to it
    """

    time_s: np.ndarray
    velocity: np.ndarray
    position: np.ndarray
    fed_in: np.ndarray


def response(mission: Mission, alignment: Attitude) -> Response:
    """Errors for each ppm on one axis, every second, with the attitude found on the stand or given."""
    perfect = _perfect(mission)
    begin = beginning(mission, perfect, alignment)

    def errors(scale_ppm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found = evaluate(perfect, perfect.imu.accelerometer * (1.0 + PPM * scale_ppm), **begin).errors
        return found.velocity_n, np.column_stack([found.north_m, found.east_m, found.down_m])

    none = errors(np.zeros(3))
    each = [errors(axis) for axis in STEP_PPM * np.eye(3)]
    velocity, position = (np.stack([found[k] - none[k] for found in each]) / STEP_PPM for k in range(2))
    time_s = mission.truth(0.0).time_s
    return Response(time_s, velocity, position, _fed_in(mission, time_s))


def _fed_in(mission: Mission, time_s: np.ndarray) -> np.ndarray:
    true = mission.increments
    middle_s = true.time_s - 0.5 / mission.rate_hz
    roll_pitch_heading = mission.trajectory.truth(middle_s).attitude_rad
    turning = Rotation.from_euler("ZYX", roll_pitch_heading[:, ::-1]).as_matrix()
    fed = PPM * np.cumsum(turning * true.dv_b[:, None, :], axis=0)  # (n, NED, axis)
    at = np.searchsorted(true.time_s, time_s + 1e-6) - 1
    return np.moveaxis(fed[at] - fed[at[0]], 2, 0)


def _perfect(mission: Mission) -> Recording:
    """What an IMU without any error records from the stand on, with the truth every second to compare with."""
    true = mission.increments
    return Recording(
        name=f"{mission.profile.name}, no errors",
        kind="flight",
        start=mission.start(mission.trajectory.start_s, aligned=False, still_until_s=0.0),
        imu=Imu(
            time_s=true.time_s,
            gyro=true.dtheta_b,
            accelerometer=true.dv_b,
            accelerometer_form="increment",
            height_baro_m=mission.height_m,
        ),
        reference=mission.truth(0.0),
        belief=NAVIGATION_GRADE,
    )
