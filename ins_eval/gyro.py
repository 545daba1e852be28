"""The gyro triad: constant bias, bias with temperature, instability, angle random walk, scale factor."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ins_eval.many_streams import ManyStreams, normal_sums, normals
from ins_eval.random_processes import gauss_markov, gauss_markov_of
from ins_eval.streams import Streams
from ins_eval.units import DEG_PER_H, DEG_PER_SQRT_H, PPM

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
        out = np.empty_like(true_increments)
        for axis, true in enumerate(true_increments.T):
            out[:, axis] = true * (1.0 + scale[axis]) + np.abs(true) * asymmetry[axis] + bias[axis] * dt
        if self.thermal_deg_per_h_per_c:
            per_c = DEG_PER_H * self.thermal_deg_per_h_per_c * streams.at("thermal").rng().standard_normal(3)
            out += ((temperature_c - REFERENCE_C) * dt)[:, None] * per_c
        if self.instability_deg_per_h:
            slow_s = np.arange(start_s, time_s[-1] + 10.0, 10.0)
            for axis, rng in enumerate(streams.at("instability", axis).rng() for axis in range(3)):
                wander = gauss_markov(slow_s, DEG_PER_H * self.instability_deg_per_h, self.instability_time_s, rng)
                out[:, axis] += np.interp(time_s - 0.5 * dt, slow_s, wander) * dt
        if self.angle_random_walk_deg_per_sqrt_h:
            noise = streams.at("angle_random_walk").rng().standard_normal(true_increments.shape)
            out += DEG_PER_SQRT_H * self.angle_random_walk_deg_per_sqrt_h * np.sqrt(dt)[:, None] * noise
        return out

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
        count = len(rate_b)
        out = np.empty((3, count, len(streams.words)))
        scale, asymmetry, bias, per_c = (
            normals(streams.at(name).begin(), 3) for name in ("scale", "asymmetry", "bias", "thermal")
        )
        warmer_c = (temperature_c - REFERENCE_C)[:, None]
        slow_s = np.arange(0.0, count * step_s + 10.0, 10.0)
        middle = step_s * (np.arange(count) + 0.5)
        left = np.searchsorted(slow_s, middle, side="right") - 1
        share = ((middle - slow_s[left]) / 10.0)[:, None]
        for axis in range(3):
            out[axis] = DEG_PER_H * (self.bias_deg_per_h * bias[axis] + self.thermal_deg_per_h_per_c * warmer_c * per_c[axis])
            out[axis] += PPM * self.scale_ppm * rate_b[:, [axis]] * scale[axis]
            out[axis] += PPM * self.asymmetry_ppm * turning_b[:, [axis]] * asymmetry[axis]
            if self.instability_deg_per_h:
                normal = normals(streams.at("instability", axis).begin(), slow_s.size)
                sigma = DEG_PER_H * self.instability_deg_per_h
                wander = gauss_markov_of(normal, slow_s, sigma, self.instability_time_s)
                out[axis] += (1.0 - share) * wander[left] + share * wander[left + 1]
        if self.angle_random_walk_deg_per_sqrt_h:
            noise = normal_sums(streams.at("angle_random_walk").begin(), count, every, 3)
            density = DEG_PER_SQRT_H * self.angle_random_walk_deg_per_sqrt_h
            out += density * np.sqrt(step_s / every) / step_s * noise.transpose(1, 0, 2)
        return out
