"""The gyro triad: constant bias, bias with temperature, instability, angle random walk, scale factor."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np

from ins_eval.many_streams import ManyStreams, normal_sums, normals
from ins_eval.random_processes import gauss_markov, gauss_markov_of
from ins_eval.streams import Streams
from ins_eval.units import DEG_PER_H, DEG_PER_SQRT_H, PPM

SLOW_S = 10.0  # between the points of the instability
REFERENCE_C = 22.0  # T0, at which the constant bias is meant; as that of the accelerometers


@dataclass(frozen=True)
class GyroPopulation:
    """One sigma of each error over a population of gyros; 0 switches an error off.

    The bias of a switch-on is the stability and the repeatability of Table 5, 0.01 deg/h each, together (the table
    labels the latter "scale factor repeatability"). Instability and random walk are assumed. `asymmetry_ppm` is the
    table's scale factor linearity: an error of the scale factor that changes sign with the rate. The thermal drift is
    what the gyros' own compensation leaves; Paper A has none, so there is none unless it is stated.
    """

    bias_deg_per_h: float = 0.014
    instability_deg_per_h: float = 0.003
    instability_time_s: float = 1800.0
    angle_random_walk_deg_per_sqrt_h: float = 0.001
    scale_ppm: float = 20.0
    asymmetry_ppm: float = 20.0
    thermal_deg_per_h_per_c: float = 0.0

    def perfect(self) -> GyroPopulation:
        """The same population with every error switched off."""
        return replace(
            self,
            bias_deg_per_h=0.0,
            instability_deg_per_h=0.0,
            angle_random_walk_deg_per_sqrt_h=0.0,
            scale_ppm=0.0,
            asymmetry_ppm=0.0,
            thermal_deg_per_h_per_c=0.0,
        )

    def increments(
        self,
        time_s: np.ndarray,
        start_s: float,
        true_increments: np.ndarray,
        streams: Streams,
        temperature_c: np.ndarray | float = REFERENCE_C,
    ) -> np.ndarray:
        """What a triad drawn from this population indicates in one run.

        d = (1 + s + a sign(w)) d_true + (b + c (T - T0) + m(t)) dt + N sqrt(dt) n,   T0 = 22 degC

        `time_s` (n,) ends of the samples, `true_increments` (n, 3) rad, `temperature_c` (n,) of the IMU;
        returns (n, 3) rad.
        """
        dt = np.diff(time_s, prepend=start_s)
        scale = PPM * self.scale_ppm * streams.at("scale").rng().standard_normal(3)
        asymmetry = PPM * self.asymmetry_ppm * streams.at("asymmetry").rng().standard_normal(3)
        bias = DEG_PER_H * self.bias_deg_per_h * streams.at("bias").rng().standard_normal(3)
        per_c, warmer_c = np.zeros(3), np.full(dt.size, temperature_c - REFERENCE_C)
        if self.thermal_deg_per_h_per_c:
            per_c = DEG_PER_H * self.thermal_deg_per_h_per_c * streams.at("thermal").rng().standard_normal(3)
        wander = np.zeros((3, dt.size))
        if self.instability_deg_per_h:
            slow_s = np.arange(start_s, time_s[-1] + SLOW_S, SLOW_S)
            for axis, rng in enumerate(streams.at("instability", axis).rng() for axis in range(3)):
                slow = gauss_markov(slow_s, DEG_PER_H * self.instability_deg_per_h, self.instability_time_s, rng)
                wander[axis] = np.interp(time_s - 0.5 * dt, slow_s, slow)
        noise = np.zeros((1, 3))
        if self.angle_random_walk_deg_per_sqrt_h:
            noise = streams.at("angle_random_walk").rng().standard_normal(true_increments.shape)
        sigma = DEG_PER_SQRT_H * self.angle_random_walk_deg_per_sqrt_h
        return _indicated(true_increments, dt, (scale, asymmetry, bias, per_c), warmer_c, wander, sigma, noise)

    def rate_errors(
        self,
        step_s: float,
        every: int,
        rate_b: np.ndarray,
        turning_b: np.ndarray,
        streams: ManyStreams,
        temperature_c: np.ndarray,
    ) -> np.ndarray:
        """By how much m triads err in one run, each the mean over a step of `every` samples: (3, n, m) in rad/s.

        The same errors of the same streams as those of `increments`, the first step beginning with the run. `rate_b`
        and `turning_b` (n, 3) are means of the true rate and of its size, `temperature_c` (n,) of the IMU.
        """
        count, units = len(rate_b), len(streams.words)
        scale, asymmetry, bias, per_c = (
            size * normals(streams.at(name).begin(), 3)
            for name, size in (
                ("scale", PPM * self.scale_ppm),
                ("asymmetry", PPM * self.asymmetry_ppm),
                ("bias", DEG_PER_H * self.bias_deg_per_h),
                ("thermal", DEG_PER_H * self.thermal_deg_per_h_per_c),
            )
        )
        slow_s = np.arange(0.0, count * step_s + SLOW_S, SLOW_S)
        wander = np.zeros((3, slow_s.size, units))
        if self.instability_deg_per_h:
            sigma = DEG_PER_H * self.instability_deg_per_h
            for axis in range(3):
                normal = normals(streams.at("instability", axis).begin(), slow_s.size)
                wander[axis] = gauss_markov_of(normal, slow_s, sigma, self.instability_time_s)
        noise = np.zeros((1, 3, units))
        if self.angle_random_walk_deg_per_sqrt_h:
            noise = normal_sums(streams.at("angle_random_walk").begin(), count, every, 3)
            noise *= DEG_PER_SQRT_H * self.angle_random_walk_deg_per_sqrt_h / np.sqrt(every * step_s)
        courses = (np.ascontiguousarray(rate_b), np.ascontiguousarray(turning_b), temperature_c - REFERENCE_C)
        return _added(courses, (scale, asymmetry, bias, per_c), wander, step_s / SLOW_S, noise)


@numba.njit(cache=True, nogil=True)
def _indicated(true, dt, sizes, warmer_c, wander, sigma, noise):
    """(1 + s) w + a |w| + b dt + c (T - T0) dt + m dt + N sqrt(dt) n of the increments `true` (n, 3)."""
    scale, asymmetry, bias, per_c = sizes
    out = np.empty(true.shape)
    for k in range(out.shape[0]):
        step, walk, heated = dt[k], sigma * np.sqrt(dt[k]), warmer_c[k] * dt[k]
        row = noise[k % noise.shape[0]]
        for axis in range(3):
            w = true[k, axis]
            given = w * (1.0 + scale[axis]) + np.abs(w) * asymmetry[axis] + bias[axis] * step
            out[k, axis] = given + heated * per_c[axis] + wander[axis, k] * step + walk * row[axis]
    return out


@numba.njit(cache=True, nogil=True)
def _added(courses, sizes, wander, steps, noise):
    """s w + a |w| + b + c (T - T0) + m + n of m triads, (3, n, m); of `wander` a point every 1 / `steps` steps."""
    rate_b, turning_b, warmer_c = courses
    scale, asymmetry, bias, per_c = sizes
    out = np.empty((3, rate_b.shape[0], wander.shape[2]))
    for axis in range(3):
        for k in range(out.shape[1]):
            left = int((k + 0.5) * steps)
            share = (k + 0.5) * steps - left
            rate, turning, warmer = rate_b[k, axis], turning_b[k, axis], warmer_c[k]
            row = noise[k % noise.shape[0], axis]
            for j in range(out.shape[2]):
                slow = (1.0 - share) * wander[axis, left, j] + share * wander[axis, left + 1, j]
                given = rate * scale[axis, j] + turning * asymmetry[axis, j] + bias[axis, j] + warmer * per_c[axis, j]
                out[axis, k, j] = given + slow + row[j]
    return out
