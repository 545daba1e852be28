"""Where navigation may begin when nobody stated an attitude: the state found from IMU and fixes, with its covariance.

The recording is navigated over a window from a first guess. What fixes and standstills say against that solution is
the measurement of its linear error model, a Kalman filter whose fixed-point smoother corrects the guess:

    dr' = dv
    dv' = phi x f - C (b_a + f_b s_a) - (2 w_ie + w_en) x dv + 2 g/R dr_D + noise
    phi' = -w_in x phi - C (b_g + w_b s_g) + noise

with constant biases b and scale factor errors s of three accelerometers and gyros. The window is navigated again from
the corrected state until nothing changes: least squares, of which the process noise is a part. Levelling, gyro
compassing, offsets at rest and a heading from motion are all what this model makes of the data; where it makes
nothing of the heading, the heading is unknown and its sigma says so.

Source: Titterton and Weston, 2nd ed., chapters 10 and 12; Groves, 2nd ed., chapters 5 and 14.
"""

from ins_eval.initialization.guess import TILT_SIGMA_RAD, stated_heading_sigma
from ins_eval.initialization.search import find, follow, track
from ins_eval.initialization.smoother import filtered
from ins_eval.initialization.state import (
    ACCELEROMETER_BIAS,
    ACCELEROMETER_SCALE,
    ATTITUDE,
    GYRO_BIAS,
    GYRO_SCALE,
    HEADING_SIGMA_RAD,
    POSITION,
    VELOCITY,
    Initialization,
)
from ins_eval.initialization.windows import WIDE_ACCELEROMETER_BIAS_MPS2, WIDE_GYRO_BIAS_RADPS, standstills

__all__ = [
    "ACCELEROMETER_BIAS",
    "ACCELEROMETER_SCALE",
    "ATTITUDE",
    "GYRO_BIAS",
    "GYRO_SCALE",
    "HEADING_SIGMA_RAD",
    "POSITION",
    "TILT_SIGMA_RAD",
    "VELOCITY",
    "WIDE_ACCELEROMETER_BIAS_MPS2",
    "WIDE_GYRO_BIAS_RADPS",
    "Initialization",
    "filtered",
    "find",
    "follow",
    "standstills",
    "stated_heading_sigma",
    "track",
]
