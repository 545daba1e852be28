"""One recording: the world felt, measured and written down beside what is believed."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter1d

from benchmark.worlds import heat, instruments, noise, receivers, world
from benchmark.worlds.earth import from_euler, to_euler
from benchmark.worlds.elsewhere import ELSEWHERE
from benchmark.worlds.instruments import Departures, Felt
from benchmark.worlds.trajectories import TRAJECTORIES
from benchmark.worlds.write import write

DEG = math.pi / 180.0
FLAGS = ("rotation", "coriolis", "transport_rate", "gravity_height", "gravity_latitude")


@dataclass
class Unit:
    """What stays the same in all recordings of one instrument."""

    belief: dict
    sheet: dict
    noise: dict
    lever_m: list[float]
    offset_s: float
    pulses: bool = True
    apart: bool = False  # one thermometer for each accelerometer


@dataclass
class Made:
    """A recording with what only its maker knows."""

    name: str
    kind: str
    trajectory: str
    rate_hz: float
    head: dict
    tables: dict
    felt: Felt | None
    departures: Departures
    unit: Unit
    errors: dict = field(default_factory=dict)
    drawn: dict = field(default_factory=dict)
    csv: tuple[str, ...] = ()
    shift_s: float = 0.0

    def save(self, folder: Path) -> None:
        tables = {name: dict(columns) for name, columns in self.tables.items()}
        for name, columns in tables.items():
            if name != "chamber":
                columns["time_s"] = np.round(columns["time_s"] + self.shift_s, 9)
        write(folder, self.head, tables, self.csv)


def extras(rng, truth, time_s) -> dict[str, np.ndarray]:
    """Further sensors: vibration, supply voltage, static pressure, speed, fan."""
    second = np.arange(0.0, truth.duration_s + 1.5)
    lla, velocity, _, _ = truth.state(np.minimum(second, truth.duration_s))
    speed, n = np.linalg.norm(velocity, axis=1), len(second)

    def rough(sigma, size):
        one = gaussian_filter1d(rng.standard_normal(n), sigma, mode="nearest")
        return size * one / max(np.std(one), 1e-12)

    power = np.clip(-velocity[:, 2] / 6.0, -1.0, 1.0)
    shake = 0.02 + speed / 200.0 * rng.uniform(0.15, 0.35) * (1.0 + 0.35 * power + rough(40.0, 0.15))
    shake = np.clip(gaussian_filter1d(shake, 5.0), 0.01, None)
    supply = 28.0 + rough(300.0, 0.35) - 0.5 * (speed > 1.0)
    for _ in range(rng.integers(2, 5)):
        begin = rng.uniform(0.1, 0.9) * n
        supply[int(begin) : int(begin + rng.uniform(200, 1200))] -= rng.uniform(0.4, 1.5)
    supply = gaussian_filter1d(supply, 3.0)
    pressure = 1013.25 * (1.0 - 2.25577e-5 * lla[:, 2]) ** 5.25588 + rough(600.0, 0.8)
    fan = np.clip(40.0 + rough(250.0, 15.0), 0.0, None)
    columns = {"vibration_rms_g": shake, "supply_v": supply, "static_pressure_hpa": pressure, "fan_speed_hz": fan}
    return {name: np.interp(time_s, second, values) for name, values in columns.items()}


def feel(rng, trajectory: str, rate_hz: float, apart: bool, tau: float = 180.0, sway_mps: float = 0.0) -> Felt:
    """The truth of a recording and what acts on the unit in it; a vehicle that stands sways with `sway_mps`."""
    kind, make = {**TRAJECTORIES, **ELSEWHERE}[trajectory]
    truth = make(rng, **({"seconds": float(rng.integers(20, 48) * 180)} if make.__name__ == "parked" else {}))
    if sway_mps > 0.0:
        truth = world.swaying(truth, rng.spawn(1)[0], sway_mps)  # draws of its own: no other changes
    angle, velocity = world.increments(truth, rate_hz)
    time_s = np.arange(1, len(angle) + 1) / rate_hz
    temperature = heat.temperatures(rng, kind, truth, time_s, apart)
    rate = heat.filtered_rate(temperature, 1.0 / rate_hz, tau)
    return Felt(kind, truth, time_s, 1.0 / rate_hz, angle, velocity, temperature, rate, truth.phases,
                extras(rng, truth, time_s))  # fmt: skip


def measure(rng, felt: Felt, unit: Unit, departures: Departures, trajectory: str, name: str, reference: bool = False,
            columns: tuple[str, ...] = ()) -> Made:  # fmt: skip
    """Let the unit and the receivers measure; `columns` are further sensors that the recording shows."""
    rate_hz, sheet, true = round(1.0 / felt.dt, 6), unit.sheet, unit.noise
    gyro, drawn = instruments.gyro_increments(felt, departures, sheet, true, rng)
    accel, more = instruments.accelerometer_output(felt, departures, unit.belief, sheet, true, rng, unit.pulses)
    reading = heat.readings(rng, felt.temperature, felt.dt, true["thermometer"])
    imu = {"time_s": felt.time_s}
    imu |= {f"gyro_{axis}": gyro[:, i] for i, axis in enumerate("xyz")}
    accel = accel.astype(np.int64) if unit.pulses else accel
    imu |= {f"accel_{axis}": accel[:, i] for i, axis in enumerate("xyz")}
    if unit.apart:
        imu |= {f"temperature_{axis}_c": reading[:, i] for i, axis in enumerate("xyz")}
    else:
        imu["temperature_c"] = reading[:, 0]
    tables, errors = {"imu": imu}, {"reading": reading, "accel": accel, "gyro": gyro}
    moving = felt.kind in ("flight", "drive")
    believed_gps = {
        "lever_arm_m": unit.lever_m, "time_offset_s": unit.offset_s,
        "position_sigma_m": sheet["position_m"], "velocity_sigma_mps": sheet["velocity_mps"],
    }  # fmt: skip
    believed_reference = {"time_offset_s": 0.0}
    if moving:
        imu["height_baro_m"] = receivers.baro(felt, sheet, true, rng)
        errors["baro"] = imu["height_baro_m"] - felt.truth.state(felt.time_s)[0][:, 2]
        if reference:
            tables["reference"], errors["reference"] = receivers.reference(
                felt, departures, believed_reference, sheet, true, rng
            )
        else:
            tables["gps"], errors["gps"] = receivers.gps(felt, departures, believed_gps, sheet, true, rng)
    for column in columns:
        imu[column] = departures.extra_columns.get(column, felt.extra.get(column))
    lla, velocity, euler, _ = felt.truth.state([0.0])
    sigma = np.array(sheet["attitude_deg"]) * DEG
    error = sigma * noise.turn_on(rng, true["attitude"])
    tilt = error + departures.attitude_rad
    c = _rotation(-tilt) @ from_euler(*euler[0])
    believed_attitude = np.array([float(one) for one in to_euler(c)]) / DEG
    head = {
        "format": "ins-recording/1", "kind": felt.kind, "name": name,
        "imu": {"rate_hz": rate_hz, "gyro": "increment", "accelerometer": "pulse" if unit.pulses else "increment",
                "axes": "FRD"},
        "start": {
            "time_s": 0.0, "latitude_deg": lla[0, 0] / DEG, "longitude_deg": lla[0, 1] / DEG, "height_m": lla[0, 2],
            "velocity_ned_mps": np.where(np.abs(velocity[0]) < 1e-12, 0.0, velocity[0]),
            "attitude_deg": believed_attitude,
            "attitude_sigma_deg": sheet["attitude_deg"], "position_sigma_m": 0.0, "velocity_sigma_mps": 0.0,
        },
        "gps": believed_gps,
        "height": {"source": "baro" if moving else "none", "sigma_m": sheet["height_m"]},
        "reference": believed_reference,
        "earth": {flag: flag not in departures.earth for flag in FLAGS},
        "gyro": {"bias_radps": [0.0, 0.0, 0.0], "bias_sigma_deg_per_h": sheet["gyro_bias_deg_per_h"],
                 "angle_random_walk_deg_per_sqrt_h": sheet["arw_deg_per_sqrt_h"]},
        "accelerometer": {"reference_temperature_c": 22.0, "rate_filter_s": 180.0,
                          "bias_sigma_ug": sheet["accel_bias_ug"]},
    }  # fmt: skip
    if not reference:
        del head["reference"]
    if not moving or reference:
        del head["gps"]
    if sheet["vrw_stated"]:
        head["accelerometer"]["velocity_random_walk_ug_per_sqrt_hz"] = sheet["vrw_ug_per_sqrt_hz"]
    if unit.pulses:
        head["accelerometer"] |= unit.belief
    errors["start_rad"] = tilt
    drawn = drawn | more | {"start_rad": error.tolist()}
    csv = ("gps",) if rng.random() < 0.15 and "gps" in tables else ()
    return Made(name, felt.kind, trajectory, rate_hz, head, tables, felt, departures, unit, errors, drawn, csv)


def _rotation(v):
    """exp of the cross-product matrix of v."""
    angle = float(np.linalg.norm(v))
    k = np.array(((0.0, -v[2], v[1]), (v[2], 0.0, -v[0]), (-v[1], v[0], 0.0)))
    if angle < 1e-12:
        return np.eye(3) + k
    return np.eye(3) + math.sin(angle) / angle * k + (1.0 - math.cos(angle)) / angle**2 * (k @ k)
