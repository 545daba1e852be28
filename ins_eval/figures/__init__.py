"""Figures: each function takes plain arrays and numbers and returns a matplotlib `Figure`; nothing is global.

`traces` draws one flight or recording against time, `ground` its track, `population` many instruments, `sensors` the
channels of an IMU, `noise` their Allan deviation, `side_by_side` values with intervals in rows.
"""

from ins_eval.figures.ground import error_growth, ground_track
from ins_eval.figures.noise import allan_deviation, temperature_laws
from ins_eval.figures.population import (
    cep_over_time,
    error_budget,
    improvement_per_instrument,
    missions_by_temperature,
    single_flight_rates,
    velocity_rms_by_compensation,
)
from ins_eval.figures.sensors import sensor_residuals, sensor_scatter, sensor_signals
from ins_eval.figures.side_by_side import side_by_side
from ins_eval.figures.traces import (
    activity,
    angle_error,
    attitude,
    attitude_error,
    flight_path,
    position_error,
    temperature_and_rate,
    velocity_error,
)

__all__ = [
    "activity",
    "allan_deviation",
    "angle_error",
    "attitude",
    "attitude_error",
    "cep_over_time",
    "error_budget",
    "error_growth",
    "flight_path",
    "ground_track",
    "improvement_per_instrument",
    "missions_by_temperature",
    "position_error",
    "sensor_residuals",
    "sensor_scatter",
    "sensor_signals",
    "side_by_side",
    "single_flight_rates",
    "temperature_and_rate",
    "temperature_laws",
    "velocity_error",
    "velocity_rms_by_compensation",
]
