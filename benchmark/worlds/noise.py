"""Random forms: what the sheet promises, and what instruments do beside it."""

from __future__ import annotations

import math

import numpy as np
from scipy.signal import lfilter


def white(rng, n, size=3):
    return rng.standard_normal((n, size))


def turn_on(rng, factor):
    """Drawn at switching on: three values in units of the sheet's sigma, never beyond what the sheet allows."""
    return np.clip(factor * rng.standard_normal(3), -2.5, 2.5)


def markov(rng, n, dt, sigma, tau, size=3, at_rest=False):
    """Gauss-Markov, (n, size), stationary or starting from zero."""
    keep = math.exp(-dt / tau)
    drive = sigma * math.sqrt(1.0 - keep * keep) * rng.standard_normal((n, size))
    drive[0] = 0.0 if at_rest else sigma * rng.standard_normal(size)
    return lfilter([1.0], [1.0, -keep], drive, axis=0)


def flicker(rng, n, dt, sigma, size=3):
    """1/f between the sample and the whole record: Markov processes a factor of 4 apart in time."""
    taus = []
    tau = 4.0 * dt
    while tau < n * dt:
        taus.append(tau)
        tau *= 4.0
    return sum(markov(rng, n, dt, sigma / math.sqrt(len(taus)), tau, size) for tau in taus)


def walk(rng, n, dt, at_hour, size=3):
    """Random walk that has a standard deviation of `at_hour` after an hour."""
    return np.cumsum(at_hour * math.sqrt(dt / 3600.0) * rng.standard_normal((n, size)), axis=0)


def jumps(rng, n, dt, every_s, sigma, size=3):
    """Steps at random times to a new level, as when the satellites in use change."""
    change = rng.random(n) < dt / every_s
    change[0] = True
    levels = sigma * rng.standard_normal((int(change.sum()), size))
    return levels[np.cumsum(change) - 1]


def log_uniform(rng, low, high):
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def draw(rng: np.random.Generator, kind: str) -> tuple[dict, dict]:
    """The sheet (what is believed) and the true noise, for `kind` zero, plain or adversarial."""
    sheet = {
        "gyro_bias_deg_per_h": log_uniform(rng, 0.006, 0.025),
        "arw_deg_per_sqrt_h": log_uniform(rng, 0.0007, 0.003),
        "accel_bias_ug": log_uniform(rng, 30.0, 80.0),
        "vrw_ug_per_sqrt_hz": log_uniform(rng, 2.0, 12.0),
        "vrw_stated": bool(rng.random() < 0.5),
        "attitude_deg": [0.003, 0.003, float(np.round(rng.uniform(0.03, 0.09), 3))],
        "position_m": float(np.round(rng.uniform(1.5, 3.5), 1)),
        "velocity_mps": float(np.round(rng.uniform(0.03, 0.07), 3)),
        "height_m": float(np.round(rng.uniform(1.0, 4.0), 1)),
        "gamma": float(np.round(rng.normal(320000.0, 1500.0), 1)),
    }
    for key in ("gyro_bias_deg_per_h", "arw_deg_per_sqrt_h", "accel_bias_ug", "vrw_ug_per_sqrt_hz"):
        sheet[key] = float(f"{sheet[key]:.2g}")
    true = {
        "gyro_bias": 1.0, "arw": 1.0, "accel_bias": 1.0, "vrw": 1.0, "attitude": 1.0,
        "gyro_wander_deg_per_h": 0.05 * sheet["gyro_bias_deg_per_h"], "gyro_wander_tau_s": rng.uniform(1500, 6000),
        "accel_wander_ug": 0.03 * sheet["accel_bias_ug"], "accel_wander_tau_s": rng.uniform(1500, 6000),
        "gyro_flicker_deg_per_h": 0.0, "accel_flicker_ug": 0.0, "gyro_walk_deg_per_h": 0.0, "accel_walk_ug": 0.0,
        "gyro_quantum_rad": 0.0,
        "thermometer": {"step_c": float(rng.choice((0.0, 0.005, 0.01, 0.0625))), "noise_c": 0.002,
                        "lag_s": 0.0, "period_s": 1.0},
        "gps_white": 1.0, "gps_position_markov_m": 0.0, "gps_position_tau_s": 60.0, "gps_velocity_markov_mps": 0.0,
        "gps_velocity_tau_s": 60.0, "gps_flicker": 0.0, "gps_jumps_m": 0.0, "gps_outliers": 0.0,
        "gps_outages": int(rng.integers(0, 3)), "gps_gap": 0.0, "gps_bank_outage": bool(rng.random() < 0.3),
        "baro_sigma": 1.0, "baro_tau_s": rng.uniform(1200, 5000), "baro_white_m": 0.15,
    }  # fmt: skip
    if kind == "zero":
        for key, value in true.items():
            true[key] = None if key == "thermometer" else value if key.endswith("tau_s") else type(value)(0)
    if kind == "adversarial":
        for key in ("gyro_bias", "accel_bias", "attitude"):
            true[key] = log_uniform(rng, 0.5, 1.7)
        for key in ("arw", "vrw"):
            true[key] = log_uniform(rng, 0.3, 5.0)
        true["gyro_wander_deg_per_h"] = sheet["gyro_bias_deg_per_h"] * log_uniform(rng, 0.02, 0.4)
        true["accel_wander_ug"] = sheet["accel_bias_ug"] * log_uniform(rng, 0.01, 0.3)
        true["gyro_wander_tau_s"], true["accel_wander_tau_s"] = log_uniform(rng, 200, 2e4), log_uniform(rng, 200, 2e4)
        some = lambda p: rng.random() < p  # noqa: E731
        if some(0.4):
            true["gyro_flicker_deg_per_h"] = sheet["gyro_bias_deg_per_h"] * log_uniform(rng, 0.02, 0.2)
            true["accel_flicker_ug"] = sheet["accel_bias_ug"] * log_uniform(rng, 0.01, 0.15)
        if some(0.3):
            true["gyro_walk_deg_per_h"] = sheet["gyro_bias_deg_per_h"] * log_uniform(rng, 0.03, 0.3)
            true["accel_walk_ug"] = sheet["accel_bias_ug"] * log_uniform(rng, 0.02, 0.2)
        if some(0.25):
            sheet["gamma"] = float(np.round(log_uniform(rng, 15000, 80000), 1))
        if some(0.25):
            true["gyro_quantum_rad"] = float(rng.choice((1e-6, 3e-6, 8e-6)))
        true["thermometer"] = {
            "step_c": float(rng.choice((0.01, 0.0625, 0.125))), "noise_c": log_uniform(rng, 0.002, 0.03),
            "lag_s": float(rng.choice((0.0, 0.0, 0.5))), "period_s": float(rng.choice((0.5, 1.0, 2.0))),
        }  # fmt: skip
        true["gps_white"] = log_uniform(rng, 0.5, 3.0)
        if some(0.75):
            share = rng.uniform(0.3, 1.2)
            true["gps_position_markov_m"] = share * sheet["position_m"]
            true["gps_velocity_markov_mps"] = share * rng.uniform(0.2, 1.0) * sheet["velocity_mps"]
            true["gps_position_tau_s"] = log_uniform(rng, 10, 300)
            true["gps_velocity_tau_s"] = log_uniform(rng, 10, 300)
        if some(0.3):
            true["gps_flicker"] = rng.uniform(0.1, 0.5)
        if some(0.4):
            true["gps_jumps_m"] = rng.uniform(0.2, 0.8) * sheet["position_m"]
        if some(0.4):
            true["gps_outliers"] = log_uniform(rng, 1e-4, 5e-3)
        if some(0.4):
            true["gps_gap"] = log_uniform(rng, 1e-4, 5e-3)
        true["gps_outages"] = int(rng.integers(0, 5))
        true["gps_bank_outage"] = bool(some(0.4))
        true["baro_sigma"], true["baro_tau_s"] = log_uniform(rng, 0.4, 2.0), log_uniform(rng, 300, 1e4)
        true["baro_white_m"] = log_uniform(rng, 0.05, 1.0)
    return sheet, true
