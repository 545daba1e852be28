"""A receiver that was just switched on: its velocity leaps while its box feels nothing.

Second differences over `LAG_S` of a receiver's velocity hold its noise, its slow error and what the box does. The last
is bounded by what the IMU felt around: by how much its specific force changed, and by how far it turned,

    |v(t + h) - 2 v(t) + v(t - h)|  <=  h (range of f + g range of the angles),

angles less those of the rate that gyros usually show where the fixes stand: an offset turns nothing. What goes beyond
is the receiver's own. Where that is several times what it usually is, from the first fix on, it had not settled.
Later in a recording the same may be a sensor that sticks, and is left to be located.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ins_eval.recording import PARKED, Recording
from ins_eval.recording.consistency.alternatives import Finding
from ins_eval.recording.consistency.limits import WARNED
from ins_eval.units import STANDARD_GRAVITY

# by reasoning, held against the receivers of an aeroplane that settles and of a quadcopter and others that had settled
LAG_S = 1.0  # over which a receiver that settles leaps and one that has settled does not
LATE_S = 1.0  # by which fixes may be late
BIN_S = 0.2  # over which vibration averages out
TOGETHER_S, TOGETHER = 4.0, 15  # over which leaps are judged together, and fixes at least
LARGEST = 5.0  # of what is usual: no single leap counts for more
UNSETTLED = 2.5  # root mean square of leaps, of what is usual; 1.1 of white noise
FEWEST = 60  # fixes that tell what is usual
STANDS_MPS, STANDING_S = 0.5, 10.0  # fixes that stand, and as long that tell the offset of gyros
LEAST_MPS = 1e-3  # below any receiver's velocity noise: what is usual of one without noise


def settled_from(recording: Recording) -> float | None:
    """The instant (s) from which the receiver had settled, None where it had from the first fix on."""
    if recording.gps is None or recording.imu is None or recording.imu.accelerometer_form != "increment":
        return None
    if recording.kind in PARKED:  # no effect is looked for in the fixes of what stands
        return None
    fixes = recording.gps
    known = fixes.valid & np.isfinite(fixes.velocity_n).all(axis=1)
    time_s, velocity_n = fixes.time_s[known], fixes.velocity_n[known]
    inside = (time_s > time_s[:1] + LAG_S) & (time_s < time_s[-1:] - LAG_S)
    if inside.sum() < FEWEST:
        return None
    at_s = time_s[inside]
    before, here, after = (_at(at_s + h, time_s, velocity_n) for h in (-LAG_S, 0.0, LAG_S))
    leaps = np.linalg.norm(after - 2.0 * here + before, axis=1)
    felt = LAG_S * _felt(recording, at_s)
    usual = max(float(np.median(leaps[felt <= np.median(felt)])), LEAST_MPS)
    own = np.minimum(np.maximum(leaps - felt, 0.0) / usual, LARGEST)
    rows = max(TOGETHER, round(TOGETHER_S / float(np.median(np.diff(at_s)))))
    together = np.convolve(np.square(own), np.ones(rows) / rows, mode="valid")  # of the rows from each on
    settled = np.flatnonzero(together <= UNSETTLED**2)
    if not settled.size or settled[0] == 0 or settled[0] > at_s.size // 2:
        return None
    odd = np.flatnonzero(own[: settled[0] + rows] > UNSETTLED)
    return float(at_s[odd[-1]] + LAG_S)


def check_settling(recording: Recording) -> Iterator[Finding]:
    """The fixes before a receiver had settled."""
    settled_s = settled_from(recording)
    if settled_s is None:
        return
    early = recording.gps.time_s < settled_s
    fastest = float(np.nanmax(np.linalg.norm(recording.gps.velocity_n[early], axis=1)))
    seen = (
        f"gps: up to {settled_s:.6g} s its velocities, of up to {fastest:.3g} m/s, leap while the IMU feels nothing; "
        f"the receiver had not settled, and no effect is looked for in these {int(early.sum())} fixes"
    )
    yield Finding("gps.settling", seen, f"cut the recording at {settled_s:.6g} s, or mark them valid = 0", WARNED)


def settled(recording: Recording) -> Recording:
    """The recording without the fixes before its receiver had settled."""
    settled_s = settled_from(recording)
    if settled_s is None:
        return recording
    return replace(recording, gps=recording.gps.rows(recording.gps.time_s >= settled_s))


def _at(time_s: np.ndarray, of_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.column_stack([np.interp(time_s, of_s, column) for column in values.T])


def _felt(recording: Recording, at_s: np.ndarray) -> np.ndarray:
    """By how much (m,) in m/s^2 specific force may have changed in n around each instant."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d  # imported here, for it takes long and few need it

    imu, start_s = recording.imu, recording.start.time_s
    ends_s = np.concatenate([[start_s], imu.time_s])
    edges_s = np.arange(start_s, imu.time_s[-1], BIN_S)
    force, angle = (
        np.column_stack([np.interp(edges_s, ends_s, np.append(0.0, np.cumsum(column))) for column in one.T])
        for one in (imu.accelerometer, imu.gyro)
    )
    angle = angle - (edges_s - start_s)[:, None] * _offset(recording, edges_s, angle)
    bins = 2 * round((LAG_S + LATE_S) / BIN_S) + 1
    ranges = (maximum_filter1d(x, bins, axis=0) - minimum_filter1d(x, bins, axis=0)
              for x in (np.diff(force, axis=0) / BIN_S, angle[1:]))  # fmt: skip
    of_force, of_angle = (np.linalg.norm(one, axis=1) for one in ranges)
    here = np.clip(((at_s - start_s) / BIN_S).astype(int), 0, len(of_force) - 1)
    return (of_force + STANDARD_GRAVITY * of_angle)[here]


def _offset(recording: Recording, edges_s: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """The rate (3,) in rad/s that gyros usually show where the fixes stand; 0 where these hardly do.

    `angle` (n, 3) rad is what they turned until `edges_s` (n,).
    """
    fixes = recording.gps
    speed = np.linalg.norm(fixes.velocity_n, axis=1)
    known = fixes.valid & np.isfinite(speed)
    stands = np.interp(edges_s[1:], fixes.time_s[known], speed[known]) < STANDS_MPS
    if BIN_S * stands.sum() < STANDING_S:
        return np.zeros(3)
    return np.median(np.diff(angle, axis=0)[stands], axis=0) / BIN_S
