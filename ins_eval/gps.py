"""The reference receiver of a simulated flight: fixes with noise, lost while the aircraft banks."""

from __future__ import annotations

import numpy as np

from ins_eval.earth import radii
from ins_eval.recording import Fixes
from ins_eval.streams import Streams
from ins_eval.trajectory import Trajectory
from ins_eval.units import DEG, through_degrees


def receive(trajectory: Trajectory, streams: Streams) -> Fixes:
    """Fixes of a flight from time 0 on; position and velocity errors are white, one sigma on each of north, east, down.

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
