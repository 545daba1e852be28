"""Units of other grades than navigation: what their sheets state, and the recordings that they make.

Turn-on biases are drawn with the stated sigma. Scale factor errors are constants of the unit, drawn with
`SCALE_PPM`, and act on what is felt, so that they are those of a sensor and no noise.
"""

from __future__ import annotations

import math

import numpy as np

from benchmark.worlds import noise
from benchmark.worlds.instruments import Departures
from benchmark.worlds.noise import log_uniform
from benchmark.worlds.record import Made, Unit, feel, measure

# gyro bias deg/h, angle random walk deg/sqrt(h), accelerometer bias ug, velocity random walk ug/sqrt(Hz)
RANGES = {
    "consumer": ((500.0, 3000.0), (0.3, 1.0), (5e3, 4e4), (120.0, 400.0)),
    "industrial": ((100.0, 700.0), (0.1, 0.4), (1e3, 8e3), (40.0, 150.0)),
    "tactical": ((1.0, 10.0), (0.03, 0.15), (300.0, 2e3), (20.0, 60.0)),
}
# of its sigma that a bias changes in a minute: as much as a start assumes; the parked MEMS unit of
# ../shared/recordings/mems_static_warmup changes by 0.013 of its offsets while it warms up, and sways by 0.8 mm/s
WANDER_IN_MINUTE = 0.003
SWAY_MPS = (2e-4, 1e-3)
SCALE_PPM = {"consumer": 5000.0, "industrial": 2000.0, "tactical": 100.0}


def a_unit(rng: np.random.Generator, grade: str, form: str = "plain") -> Unit:
    """A unit of that grade, in increments, with its receiver; `form` of the noise is plain or adversarial."""
    sheet, true = noise.draw(rng, form)
    gyro, walk, force, density = RANGES[grade]
    sheet |= {
        "gyro_bias_deg_per_h": float(f"{log_uniform(rng, *gyro):.3g}"),
        "arw_deg_per_sqrt_h": float(f"{log_uniform(rng, *walk):.3g}"),
        "accel_bias_ug": float(f"{log_uniform(rng, *force):.3g}"),
        "vrw_ug_per_sqrt_hz": float(f"{log_uniform(rng, *density):.3g}"),
        "vrw_stated": True,
    }
    true |= {
        "gyro_wander_deg_per_h": wander(true["gyro_wander_tau_s"]) * sheet["gyro_bias_deg_per_h"],
        "accel_wander_ug": wander(true["accel_wander_tau_s"]) * sheet["accel_bias_ug"],
        "gps_outages": 0,
        "gps_bank_outage": False,
    }
    lever = np.round(rng.uniform(-2.0, 2.0, 3), 2).tolist() if rng.random() < 0.6 else [0.0, 0.0, 0.0]
    return Unit({}, sheet, true, lever, 0.0, pulses=False)


def wander(tau_s: float) -> float:
    """Standing sigma of a Gauss-Markov process that changes by `WANDER_IN_MINUTE`: 2 s^2 (1 - exp(-60 s / tau))."""
    return WANDER_IN_MINUTE / math.sqrt(-2.0 * math.expm1(-60.0 / tau_s))


def a_recording(
    rng: np.random.Generator, grade: str, trajectory: str, rate_hz: float = 50.0, form: str = "plain"
) -> Made:
    """A drive or flight of a unit of that grade, which states nothing of its attitude."""
    unit = a_unit(rng, grade, form)
    felt = feel(rng, trajectory, rate_hz, unit.apart, sway_mps=log_uniform(rng.spawn(1)[0], *SWAY_MPS))
    ppm = SCALE_PPM[grade] * rng.standard_normal((2, 3))
    departures = Departures(accel_ppm=ppm[0], gyro_deg_per_h=1e-6 * ppm[1] * np.rad2deg(felt.turn) * 3600.0)
    made = measure(rng, felt, unit, departures, trajectory, f"{grade} {trajectory}")
    del made.head["start"]["attitude_deg"], made.head["start"]["attitude_sigma_deg"]
    return made


def cut(made: Made, begin_s: float, length_s: float) -> None:
    """Keep the rows of `length_s` seconds from `begin_s` on; the start is where the unit truly is then."""
    for name, columns in made.tables.items():
        rows = (columns["time_s"] > begin_s) & (columns["time_s"] <= begin_s + length_s)
        made.tables[name] = {key: values[rows] for key, values in columns.items()}
    lla, velocity, _, _ = made.felt.truth.state([begin_s])
    made.head["start"] |= {
        "time_s": begin_s, "latitude_deg": float(np.rad2deg(lla[0, 0])),
        "longitude_deg": float(np.rad2deg(lla[0, 1])), "height_m": float(lla[0, 2]), "velocity_ned_mps": velocity[0],
    }  # fmt: skip
