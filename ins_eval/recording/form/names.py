"""Names of the columns of the form."""

from __future__ import annotations

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
AIR = "chamber_c"  # of a chamber, beside the readings
UNIT = "unit_id"
