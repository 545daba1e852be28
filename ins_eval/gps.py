"""The reference receiver of a simulated flight: fixes with noise, lost while the aircraft banks."""

from __future__ import annotations

import numpy as np

from ins_eval.earth import radii
from ins_eval.many_streams import ManyStreams, normal_sums, normals
from ins_eval.profile import Gps
from ins_eval.random_processes import gauss_markov, gauss_markov_of
from ins_eval.recording import Fixes
from ins_eval.streams import Streams
from ins_eval.trajectory import Trajectory
from ins_eval.units import DEG, through_degrees


def receive(trajectory: Trajectory, streams: Streams) -> Fixes:
    """Fixes of a flight from time 0 on; position and velocity errors have one sigma on each of north, east, down.

    They are white; beside them stands a Gauss-Markov error with the memory ``gps.memory_s`` where the profile has one.

    Positions are those that a file in degrees can hold to the last bit, so that a flight written and read is the same.
    While the roll exceeds ``gps.lost_beyond_roll_deg`` a fix is marked invalid and holds NaN (Paper A: the antenna
    inside the cabin loses the satellites beyond 30 degrees).
    """
    gps = trajectory.profile.gps
    truth = trajectory.truth(np.arange(0.0, trajectory.end_s + 0.5 * gps.period_s, gps.period_s))
    noise_n = gps.position_sigma_m * streams.at("gps.position").rng().standard_normal((truth.time_s.size, 3))
    velocity = truth.velocity_n + gps.velocity_sigma_mps * streams.at("gps.velocity").rng().standard_normal(
        noise_n.shape
    )
    noise_n = noise_n + _remembered(truth.time_s, gps.position_memory_m, gps.memory_s, streams.at("gps.position"))
    velocity = velocity + _remembered(truth.time_s, gps.velocity_memory_mps, gps.memory_s, streams.at("gps.velocity"))
    meridian, transverse = radii(truth.latitude_rad)
    valid = np.abs(truth.attitude_rad[:, 0]) <= gps.lost_beyond_roll_deg * DEG
    lost = np.where(valid, 1.0, np.nan)
    return Fixes(
        time_s=truth.time_s,
        latitude_rad=lost * through_degrees(truth.latitude_rad + noise_n[:, 0] / (meridian + truth.height_m)),
        longitude_rad=lost
        * through_degrees(
            truth.longitude_rad + noise_n[:, 1] / ((transverse + truth.height_m) * np.cos(truth.latitude_rad))
        ),
        height_m=lost * (truth.height_m - noise_n[:, 2]),
        velocity_n=lost[:, None] * velocity,
        valid=valid,
    )


def errors_of(gps: Gps, time_s: np.ndarray, streams: ManyStreams) -> tuple[np.ndarray, np.ndarray]:
    """Errors of position in m and velocity in m/s of m receivers at `time_s` (n,), (n, 3, m) each, from their streams.

    Those of `receive` for the same streams, north-east-down, whether or not a fix is lost.
    """
    found = []
    for name, sigma, memory in (
        ("gps.position", gps.position_sigma_m, gps.position_memory_m),
        ("gps.velocity", gps.velocity_sigma_mps, gps.velocity_memory_mps),
    ):
        node = streams.at(name)
        error = normal_sums(node.begin(), time_s.size, 1, 3)
        error *= sigma
        if memory:
            for axis in range(3):
                normal = normals(node.at("memory", axis).begin(), time_s.size)
                error[:, axis] += gauss_markov_of(normal, time_s, memory, gps.memory_s)
        found.append(error)
    return found[0], found[1]


def _remembered(time_s: np.ndarray, sigma: float, memory_s: float, streams: Streams) -> np.ndarray | float:
    """First-order Gauss-Markov error (n, 3) on north, east, down; 0 where there is none."""
    if sigma == 0.0:
        return 0.0
    axes = (gauss_markov(time_s, sigma, memory_s, streams.at("memory", axis).rng()) for axis in range(3))
    return np.column_stack(list(axes))
