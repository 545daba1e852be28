"""Whether motion is too fast for the samples: what the integration of a step leaves of coning and sculling.

`coning_sculling` integrates two samples by the quintics through them and their neighbours. The cubics through two
fewer samples give other first moments, and so another rotation and velocity,

    rotation:  w0 x d(w1),   velocity:  w0 x d(f1) - d(w1) x f0,

with w0, f0 the increments over the two samples and d the quintic's first moment less the cubic's. For motion slower
than an eighth of the sample rate the difference is small beside any sensor; for faster motion it is as large as the
error that remains. Noise has no mean of such products, so the mean over a recording is held against its scatter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ins_eval.units import DEG_PER_H, UG

PARTS = 40  # of a recording, whose scatter says how well the mean is known
SURE = 5.0  # standard errors; one recording in 200 000 without fast motion in six components of normal scatter
# a hundredth of the turn-on biases of the best inertial grade
LEAST_RATE, LEAST_ACCELERATION = 1e-4 * DEG_PER_H, 0.1 * UG


def _moment_weights(samples: int) -> np.ndarray:
    """Weights (3,) of differences in the inner, next and outer pair of six samples, for the first moment of the inner.

    The integral of (t - 1) p(t) / 2 over 0..2, p the polynomial whose integrals over the inner `samples` samples are
    the increments; it is odd about the middle, so that only differences within pairs enter.
    """
    edges, powers = np.arange(samples + 1.0) - samples // 2 + 1.0, np.arange(1, samples + 1)
    integrals = (edges[1:, None] ** powers - edges[:-1, None] ** powers) / powers
    moments = 0.5 * (2.0 ** (powers + 1) / (powers + 1) - 2.0**powers / powers)
    weights = (moments @ np.linalg.inv(integrals))[samples // 2 :]
    return np.pad(weights, (0, 3 - weights.size))


_DIFFERENCE = _moment_weights(6) - _moment_weights(4)


@dataclass(frozen=True)
class FastMotion:
    """Mean error that motion too fast for the samples may leave, (3,) each, body axes: rad/s and m/s^2.

    A component that its scatter does not tell from zero is zero.
    """

    rate_b: np.ndarray
    acceleration_b: np.ndarray

    @property
    def warned(self) -> bool:
        """Whether it is large enough to warn of."""
        return bool(
            np.linalg.norm(self.rate_b) > LEAST_RATE or np.linalg.norm(self.acceleration_b) > LEAST_ACCELERATION
        )

    def __str__(self) -> str:
        return (
            "The motion is too fast for the sample rate (coning and sculling above an eighth of it): navigation may "
            "err as it would with sensor errors of about "
            f"{np.linalg.norm(self.rate_b) / DEG_PER_H:.1g} deg/h and {np.linalg.norm(self.acceleration_b) / UG:.1g} ug"
            ". A higher sample rate reduces this, a damped mount removes it."
        )


def fast_motion(time_s: np.ndarray, dtheta_b: np.ndarray, dv_b: np.ndarray) -> FastMotion:
    """Estimate what fast motion leaves in the navigation of increments `dtheta_b`, `dv_b` (n, 3) that end at `time_s`.

    Nothing is found in less than a thousand samples.
    """
    count = len(time_s)
    if count < 25 * PARTS:
        return FastMotion(np.zeros(3), np.zeros(3))
    edges = np.linspace(0, count, PARTS + 1).astype(int)
    means = np.array([_left(dtheta_b[a:b], dv_b[a:b]) for a, b in zip(edges[:-1], edges[1:], strict=True)])
    mean, error = means.mean(axis=0), means.std(axis=0, ddof=1) / np.sqrt(PARTS)
    sure = np.where(np.abs(mean) > SURE * error, mean, 0.0) * (count - 1) / (time_s[-1] - time_s[0]) / 2.0
    return FastMotion(sure[:3], sure[3:])


def _left(dtheta_b: np.ndarray, dv_b: np.ndarray) -> np.ndarray:
    """(6,) difference of rotation and velocity over two samples, in the mean."""
    angle, angle_moment = _two_samples(dtheta_b)
    velocity, velocity_moment = _two_samples(dv_b)
    rotation = np.cross(angle, angle_moment)
    return np.concatenate(
        [rotation.mean(axis=0), (np.cross(angle, velocity_moment) - np.cross(angle_moment, velocity)).mean(axis=0)]
    )


def _two_samples(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Increment over every other pair of samples, and the difference of its first moments: (m, 3) each."""
    pairs = (len(x) - 4) // 2
    s = [x[k : k + 2 * pairs : 2] for k in range(6)]
    inner, middle, outer = _DIFFERENCE
    return s[2] + s[3], inner * (s[3] - s[2]) + middle * (s[4] - s[1]) + outer * (s[5] - s[0])
