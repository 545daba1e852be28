"""Names of the columns of the form, and the values they can have."""

from __future__ import annotations

import numpy as np

GYRO = ("gyro_x", "gyro_y", "gyro_z")
ACCELEROMETER = ("accel_x", "accel_y", "accel_z")
TEMPERATURE = "temperature_c"
TEMPERATURES = ("temperature_x_c", "temperature_y_c", "temperature_z_c")
BARO = "height_baro_m"
FILLED = "filled"
POSITION = ("latitude_deg", "longitude_deg", "height_m")
VELOCITY = ("velocity_n_mps", "velocity_e_mps", "velocity_d_mps")
ATTITUDE = ("roll_deg", "pitch_deg", "heading_deg")
SIGMAS = ("position_sigma_m", "velocity_sigma_mps")
VALID = "valid"
READINGS = ("run", "input_g", "rate_c_per_min", TEMPERATURE, "output")
UNIT = "unit_id"

LIMITS = {
    "latitude_deg": (-90.0, 90.0),
    "longitude_deg": (-360.0, 360.0),
    "roll_deg": (-360.0, 360.0),
    "pitch_deg": (-90.0, 90.0),
    "heading_deg": (-360.0, 720.0),
    "position_sigma_m": (0.0, np.inf),
    "velocity_sigma_mps": (0.0, np.inf),
}
