"""GPS, barometer and a better navigator beside the unit."""

from __future__ import annotations

import math

import numpy as np

from benchmark.worlds import noise
from benchmark.worlds.earth import ecef, from_euler, geodetic, radii, to_euler, to_ned
from benchmark.worlds.instruments import Departures, Felt
from benchmark.worlds.world import Path

DEG = math.pi / 180.0


def antenna(truth: Path, time_s: np.ndarray, lever_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Geodetic position (n, 3) and velocity NED (n, 3) of a point `lever_m` from the unit."""
    lla, velocity, euler, turn = truth.state(time_s)
    if not np.any(lever_m):
        return lla, velocity
    place = ecef(lla[:, 0], lla[:, 1], lla[:, 2])
    out, speed = np.empty_like(lla), np.empty_like(lla)
    for k in range(len(lla)):
        c = from_euler(*euler[k])
        arm = c @ lever_m
        point = place[k] + to_ned(lla[k, 0], lla[k, 1]).T @ arm
        out[k] = geodetic(*point)
        speed[k] = velocity[k] + c @ np.cross(turn[k], lever_m)
    return out, speed


def moved(lla: np.ndarray, ned: np.ndarray) -> np.ndarray:
    """Geodetic positions displaced by metres north, east and down."""
    m, n = np.array([radii(one) for one in lla[:, 0]]).T
    return lla + np.column_stack(
        (ned[:, 0] / (m + lla[:, 2]), ned[:, 1] / ((n + lla[:, 2]) * np.cos(lla[:, 0])), -ned[:, 2])
    )


def gps(felt: Felt, departures: Departures, believed: dict, sheet: dict, true: dict, rng, hz: float = 1.0):
    """Columns of the gps table and the true error sizes."""
    offset = believed["time_offset_s"] + departures.gps_offset_s
    first = math.ceil(max(offset, 0.0) * hz) / hz
    stamps = np.arange(first, felt.truth.duration_s + min(offset, 0.0) - 0.02, 1.0 / hz)
    at = stamps - offset
    n, dt = len(at), 1.0 / hz
    lever = np.asarray(believed["lever_arm_m"]) + departures.lever_m
    lla, velocity = antenna(felt.truth, at, lever)
    wp, wv = true["gps_white"] * sheet["position_m"], true["gps_white"] * sheet["velocity_mps"]
    ep, ev = wp * noise.white(rng, n), wv * noise.white(rng, n)
    if true["gps_position_markov_m"] > 0:
        ep += noise.markov(rng, n, dt, true["gps_position_markov_m"], true["gps_position_tau_s"])
        ev += noise.markov(rng, n, dt, true["gps_velocity_markov_mps"], true["gps_velocity_tau_s"])
    if true["gps_flicker"] > 0:
        ep += noise.flicker(rng, n, dt, true["gps_flicker"] * sheet["position_m"])
        ev += noise.flicker(rng, n, dt, 0.5 * true["gps_flicker"] * sheet["velocity_mps"])
    if true["gps_jumps_m"] > 0:
        ep += noise.jumps(rng, n, dt, rng.uniform(200, 1200), true["gps_jumps_m"])
    if true["gps_outliers"] > 0:
        bad = rng.random(n) < true["gps_outliers"]
        size = rng.standard_t(2.0, (int(bad.sum()), 6)) * 8.0
        ep[bad] += size[:, :3] * sheet["position_m"]
        ev[bad] += size[:, 3:] * sheet["velocity_mps"]
    if departures.gps_velocity is not None:
        ev = ev + departures.gps_velocity(felt, at)
    if departures.gps_position is not None:
        ep = ep + departures.gps_position(felt, at)
    lla, velocity = moved(lla, ep), velocity + ev
    valid = np.ones(n)
    for _ in range(true["gps_outages"]):
        begin = rng.uniform(0.05, 0.9) * felt.truth.duration_s
        valid[(at > begin) & (at < begin + noise.log_uniform(rng, 15, 400))] = 0
    if true["gps_bank_outage"]:
        roll = felt.truth.state(at)[2][:, 0]
        valid[np.abs(roll) > rng.uniform(14, 22) * DEG] = 0
    if true["gps_gap"] > 0:
        valid[rng.random(n) < true["gps_gap"]] = 0
    columns = {
        "time_s": stamps, "latitude_deg": lla[:, 0] / DEG, "longitude_deg": lla[:, 1] / DEG, "height_m": lla[:, 2],
        "velocity_n_mps": velocity[:, 0], "velocity_e_mps": velocity[:, 1], "velocity_d_mps": velocity[:, 2],
    }  # fmt: skip
    error = {"at": at, "position": ep, "velocity": ev, "valid": valid > 0, "lever": lever}
    way = rng.integers(3)
    lost = valid == 0
    if lost.any():
        if way == 0:
            columns["valid"] = valid.astype(np.int64)
        elif way == 1:
            for name in list(columns)[1:]:
                columns[name] = np.where(lost, np.nan, columns[name])
        else:
            columns = {name: values[~lost] for name, values in columns.items()}
    return columns, error


def rotations(v: np.ndarray) -> np.ndarray:
    """Rotations (n, 3, 3) by small vectors (n, 3), to third order."""
    k = np.zeros((len(v), 3, 3))
    k[:, 0, 1], k[:, 0, 2], k[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    k -= np.transpose(k, (0, 2, 1))
    return np.eye(3) + k + 0.5 * k @ k + k @ k @ k / 6.0


def baro(felt: Felt, sheet: dict, true: dict, rng) -> np.ndarray:
    """Barometric height (n,) m: true at the start, then wandering."""
    height = felt.truth.state(felt.time_s)[0][:, 2]
    if true["baro_sigma"] == 0:
        return height
    n = int(felt.time_s[-1]) + 3
    sigma = true["baro_sigma"] * sheet["height_m"]
    wander = noise.markov(rng, n, 1.0, sigma, true["baro_tau_s"], 1, at_rest=True)[:, 0]
    wander = np.interp(felt.time_s, np.arange(n), wander)
    return np.round(height + wander + true["baro_white_m"] * rng.standard_normal(len(height)), 3)


def reference(felt: Felt, departures: Departures, believed: dict, sheet: dict, true: dict, rng, hz: float = 10.0):
    """Columns of the reference table: a better navigator, fixed to the same structure."""
    offset = believed["time_offset_s"] + departures.reference_offset_s
    first = math.ceil(max(offset, 0.0) * hz) / hz
    stamps = np.arange(first, felt.truth.duration_s + min(offset, 0.0) - 0.02, 1.0 / hz)
    at = stamps - offset
    n, quiet = len(at), 0.0 if true["gps_white"] == 0 else 1.0
    lla, velocity, euler, _ = felt.truth.state(at)
    c = np.stack([from_euler(*one) for one in euler])
    slow = noise.markov(rng, n, 1.0 / hz, quiet * 0.002 * DEG, 300.0) + quiet * 0.001 * DEG * noise.white(rng, n)
    c = rotations(slow) @ c @ rotations(np.tile(departures.reference_rad, (n, 1)))
    roll, pitch, heading = to_euler(c)
    ep = quiet * (0.05 * noise.white(rng, n) + noise.markov(rng, n, 1.0 / hz, 0.3, 400.0))
    ev = quiet * (0.003 * noise.white(rng, n) + noise.markov(rng, n, 1.0 / hz, 0.004, 100.0))
    lla, velocity = moved(lla, ep), velocity + ev
    columns = {
        "time_s": stamps, "latitude_deg": lla[:, 0] / DEG, "longitude_deg": lla[:, 1] / DEG, "height_m": lla[:, 2],
        "velocity_n_mps": velocity[:, 0], "velocity_e_mps": velocity[:, 1], "velocity_d_mps": velocity[:, 2],
        "roll_deg": roll / DEG, "pitch_deg": pitch / DEG, "heading_deg": np.mod(heading / DEG, 360.0),
    }  # fmt: skip
    return columns, {"at": at, "position": ep, "velocity": ev, "attitude": slow, "valid": np.ones(n, bool)}
