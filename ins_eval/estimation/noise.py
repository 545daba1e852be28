"""Levels and correlation of all noise, estimated together with the answer under one prior.

White noise of a measurement channel is read off its second differences, in which an INS that is smooth over seconds
leaves nothing: robust, and the same under every hypothesis. Where navigator or standstill is smoother than the INS, a
random walk is separate. The rest is found by maximising the evidence: level and correlation time of the slow error of
what measures, velocity and angle random walk, level and correlation time of the wander of accelerometers and gyros.
Each has a log-normal prior around what is believed, the same under the null
and under every candidate; a level frozen on the null makes false alarms of what the null cannot fit, and a level that
is taken from the sheet makes them of an instrument that is a little worse.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import uniform_filter1d

from ins_eval.effects.parts import SENSORS
from ins_eval.error_model import drives
from ins_eval.error_model.null import is_coarse
from ins_eval.error_model.observations import CHANNELS, Observations
from ins_eval.estimation.kalman import NoiseLevels
from ins_eval.estimation.receiver_jumps import jumps
from ins_eval.random_processes import NORMAL_MAD
from ins_eval.recording.belief import UNSTATED_DENSITY_UG
from ins_eval.units import DEG_PER_H, DEG_PER_SQRT_H, UG

if TYPE_CHECKING:
    from ins_eval.error_model.null import Believed
    from ins_eval.error_model.propagation import ErrorModel
    from ins_eval.estimation.slope import Slopes
    from ins_eval.recording.belief import Belief

# of the believed sigma of a position, a velocity, an attitude: what measures is not judged by errors far below its own
# statement. A bench stands still enough for a velocity to show the random walk of the best sensors; its attitude is not
# let below the square of a tilt of milliradians. What stands on wheels keeps its place to some millimetres: 2.5 mm by
# reasoning, and chosen so that the parked laser gyros of test_real show the Earth's rotation alone; not calibrated.
LEAST_OF_BELIEVED = {"gps": (0.3,) * 3, "reference": (0.02,) * 3, "standstill": (0.25, 0.005, 0.05)}
WALKING = ("reference", "standstill")  # smoother than the INS, so that its random walk shows between rows
VELOCITIES, HEADING = range(3, 6), 8
FEWEST = 20  # measurements that tell a level
AGITATION_ROWS, AGITATED = 9, 3.0
SECOND_DIFFERENCE = np.sqrt(6.0)  # of white noise of one sigma
WANDER_TIME_S = 1800.0
COARSE_WANDER_TIME_S = 200.0  # of gyros that flicker within a minute: the plateau of their Allan deviation
ALONE, ALONE_SPREAD = "wander_alone", 1.0  # of the logarithm by which sensors of a kind differ: by reasoning
AGITATION_S = 1.0  # within which motion changes faster than fixes tell
SAMPLING = 0.3  # of what changes within a second: between the twelfth that a trapezoid misses and all that is felt
JITTER_S = 0.01  # of stamps that a log gives when a message has arrived; both by reasoning, with wide priors
OUTLIER = 4.5  # sigmas from its neighbours of a measurement that is not believed
NEIGHBOUR_VARIANCE = 0.3  # of the median of four
FIXED_TOGETHER = ((0, 1, 2), (3, 4, 5), (6, 7, 8))  # position, velocity, attitude of a fix
LONGEST_BURST = 5  # fixes in a row that a reflected signal spoils: by reasoning
LATE_S, ANTENNA_M = 0.5, 2.0  # more than receivers are late by, or an antenna is off where it is believed: by reasoning
ONE_LEVEL = 0.5  # of how far a burst stands apart, by which those beside it may differ: it comes back; by reasoning


class Prior(NamedTuple):
    """Log-normal: `centre` in SI, `spread` of the logarithm; a spread of 0 keeps it fixed."""

    centre: float
    spread: float


class SlowNoise(NamedTuple):
    """Slow error of what measures: one sigma of position and velocity in believed sigmas, times, prior spreads."""

    position: float
    position_time_s: float
    velocity: float
    velocity_time_s: float
    spread: float
    time_spread: float


SLOW = {
    "gps": SlowNoise(0.5, 100.0, 0.2, 40.0, 1.2, 1.0),
    "reference": SlowNoise(0.5, 100.0, 0.2, 40.0, 1.2, 1.0),
    "standstill": SlowNoise(1.0, 300.0, 0.5, 10.0, 1.2, 0.0),
}


@dataclass(frozen=True, eq=False)
class NoiseModel:
    """What is known of the noise before the evidence is looked at.

    `white` (nodes, 9) one sigma of each measurement, `down` (9,) the slow error of what measures relative to north,
    `steps` (epochs, 3, 3) what the thermometer adds to velocity, `jumps` (epochs, 3) what jumps of a receiver add to
    its slow position error (`receiver_jumps`), and `agitation` (epochs, 2) the squares of what the
    increments of velocity and angle change within a second, summed over an epoch: where motion changes fast, what was
    sampled is not what was integrated, and sensors err in proportion to it. `filled` (epochs, 2) is the variance of
    what samples that were filled in miss (`missing`). `later` (nodes, 9) is what a stamp that is a second
    late changes.
    """

    priors: dict[str, Prior]
    white: np.ndarray
    down: np.ndarray
    steps: np.ndarray
    jumps: np.ndarray
    agitation: np.ndarray
    filled: np.ndarray
    later: np.ndarray
    interval_s: np.ndarray
    alone: int | None = None

    def with_one_alone(self, sensor: int) -> NoiseModel:
        """The same where accelerometer or gyro number `sensor` of six wanders by a factor more than the others."""
        return replace(self, alone=sensor, priors={**self.priors, ALONE: Prior(1.0, ALONE_SPREAD)})

    @property
    def free(self) -> list[str]:
        return [name for name, prior in self.priors.items() if prior.spread > 0.0]

    def values(self, noise_point: Sequence[float]) -> dict[str, float]:
        """Levels in SI at a position in prior sigmas from the centre, one for each that is free."""
        moved = dict(zip(self.free, noise_point, strict=True))
        return {name: p.centre * np.exp(p.spread * moved.get(name, 0.0)) for name, p in self.priors.items()}

    def levels(self, noise_point: Sequence[float]) -> NoiseLevels:
        """The same as the filter takes it."""
        v = self.values(noise_point)
        dt = self.interval_s
        of = (v.get(f"{sensor}_sampling", 0.0) ** 2 for sensor in SENSORS)
        force, rate = (level * one for level, one in zip(of, self.agitation.T, strict=True))
        force, rate = force + self.filled[:, 0], rate + self.filled[:, 1]
        wander_time_s = v.get("wander_time", WANDER_TIME_S)
        sigma = np.repeat([v["slow_position"], v["slow_velocity"], v["slow_attitude"]], 3) * self.down
        sigma[HEADING] = v.get("slow_heading", sigma[HEADING])
        wander_sigma = np.repeat([v["accelerometer_wander"], v["gyro_wander"]], 3) * self._factors(v)
        return NoiseLevels(
            white=np.hypot(self.white, v["jitter"] * self.later) if "jitter" in v else self.white,
            force=v["velocity_random_walk"] ** 2 * dt + force,
            rate=v["angle_random_walk"] ** 2 * dt + rate,
            steps=self.steps,
            slow_sigma=sigma,
            slow_time_s=np.repeat([v[f"slow_{of}_time"] for of in ("position", "velocity", "attitude")], 3),
            jumps=self.jumps,
            wander_sigma=wander_sigma,
            wander_time_s=np.repeat([wander_time_s, v.get("gyro_wander_time", wander_time_s)], 3),
        )

    def _factors(self, values: dict[str, float]) -> np.ndarray:
        """By how much each of the six sensors wanders more than its kind."""
        factors = np.ones(6)
        if self.alone is not None:
            factors[self.alone] = values[ALONE]
        return factors

    def slope(self, noise_point: np.ndarray, by: Slopes) -> np.ndarray:
        """dL by the noise point from dL `by` what the filter allows for: every level is centre exp(spread x)."""
        v = self.values(noise_point)
        slow, wander = by.slow_sigma * self.down, by.wander_sigma * self._factors(v)
        parts = {
            "slow_position": slow[:3].sum(),
            "slow_velocity": slow[3:6].sum(),
            "slow_attitude": slow[6:].sum(),
            "slow_position_time": by.slow_time_s[:3].sum(),
            "slow_velocity_time": by.slow_time_s[3:6].sum(),
            "slow_attitude_time": by.slow_time_s[6:].sum(),
            "velocity_random_walk": 2.0 * v["velocity_random_walk"] * (by.force @ self.interval_s),
            "angle_random_walk": 2.0 * v["angle_random_walk"] * (by.rate @ self.interval_s),
            "accelerometer_wander": wander[:3].sum(),
            "gyro_wander": wander[3:].sum(),
            "wander_time": by.wander_time_s.sum(),
        }
        if self.alone is not None:
            level = v["accelerometer_wander" if self.alone < 3 else "gyro_wander"]
            parts[ALONE] = level * by.wander_sigma[self.alone]
        if "slow_heading" in v:
            parts["slow_attitude"] = slow[6:HEADING].sum()
            parts["slow_heading"] = by.slow_sigma[HEADING]
        if "jitter" in v:
            white = np.hypot(self.white, v["jitter"] * self.later)
            share = np.divide(self.later**2, white, out=np.zeros_like(white), where=white > 0.0)  # 0: not measured
            parts["jitter"] = v["jitter"] * (by.white * share).sum()
        for sensor, slope, agitation in zip(SENSORS, (by.force, by.rate), self.agitation.T, strict=True):
            if f"{sensor}_sampling" in v:
                parts[f"{sensor}_sampling"] = 2.0 * v[f"{sensor}_sampling"] * (slope @ agitation)
        if "gyro_wander_time" in v:
            parts["wander_time"] = by.wander_time_s[:3].sum()
            parts["gyro_wander_time"] = by.wander_time_s[3:].sum()
        return np.array([parts[name] * v[name] * self.priors[name].spread for name in self.free])


def noise_model(
    belief: Belief,
    model: ErrorModel,
    seen: Observations,
    step_density: np.ndarray,
    agitation: np.ndarray,
    filled: np.ndarray,
) -> NoiseModel:
    """Priors from the belief, white noise from the measurements themselves; the rest is as in `NoiseModel`."""
    level, ratio = white(seen)
    typical = np.array([np.median(column[np.isfinite(column)]) if np.isfinite(column).any() else 1.0 for column in
                        np.where(np.isfinite(seen.residual), seen.sigma, np.nan).T])  # fmt: skip
    attitude = bool(np.isfinite(seen.residual[:, 6:]).any())
    slow = SLOW[seen.measured_by[0] or seen.measured_by[3] or "reference"]
    accelerometer, gyro = belief.accelerometer, belief.gyro
    density = accelerometer.velocity_random_walk_ug_per_sqrt_hz
    axes = np.stack(
        [
            model.integrals[:, drives.source("accelerometer", axis, "1")] / model.interval_s[:, None]
            for axis in range(3)
        ],
        axis=1,
    )  # (epochs, axis, n): unit vectors of the accelerometers, shortened where the body turned
    steps = np.einsum("ka,kai,kaj->kij", step_density * model.interval_s[:, None], axes, axes)
    parked = seen.measured_by[HEADING] == "standstill"  # who enters a vehicle tilts it far more than he turns it
    jerky = (bool(model.arc.any()) or is_coarse(belief)) and not parked
    return NoiseModel(
        priors={
            "slow_position": Prior(slow.position * typical[0], slow.spread),
            "slow_position_time": Prior(slow.position_time_s, slow.time_spread),
            "slow_velocity": Prior(slow.velocity * typical[3], slow.spread),
            "slow_velocity_time": Prior(slow.velocity_time_s, slow.time_spread),
            "slow_attitude": Prior(0.5 * typical[6], 1.2 if attitude else 0.0),
            "slow_attitude_time": Prior(300.0, 1.2 if attitude else 0.0),
            "velocity_random_walk": Prior(UG * (density or UNSTATED_DENSITY_UG), 0.7 if density else 1.2),
            "angle_random_walk": Prior(angle_random_walk(belief), 0.7),
            "accelerometer_wander": Prior(0.2 * UG * max(accelerometer.bias_sigma_ug, 1.0), 1.0),
            "gyro_wander": Prior(0.2 * DEG_PER_H * max(gyro.bias_sigma_deg_per_h, 1e-4), 1.0),
            "wander_time": Prior(WANDER_TIME_S, 1.0),
            **({"slow_heading": Prior(0.5 * typical[HEADING], 1.2)} if parked else {}),
            **({"gyro_wander_time": Prior(COARSE_WANDER_TIME_S, 1.5)} if model.arc.any() else {}),
            **({f"{sensor}_sampling": Prior(SAMPLING, 1.2) for sensor in SENSORS} if jerky else {}),
            **({"jitter": Prior(JITTER_S, 1.2)} if jerky else {}),
        },
        white=level,
        down=np.array([1.0, 1.0, ratio[0], 1.0, 1.0, ratio[1], 1.0, 1.0, 1.0]),
        steps=steps,
        jumps=jumps(seen, level, model),
        agitation=agitation,
        filled=filled,
        later=np.where(np.isfinite(seen.residual), seen.of_delay, 0.0),
        interval_s=model.interval_s,
    )


def agitation(navigated: Believed, nodes_s: np.ndarray) -> np.ndarray:
    """Squares (epochs, 2) of the increments of velocity and angle less their mean of a second, summed over an epoch.

    The mean of axes, as it is on average over that second.
    """
    epoch = np.clip(np.searchsorted(nodes_s, navigated.time_s - 1e-6) - 1, 0, nodes_s.size - 2)
    rows = max(1, round(AGITATION_S / float(np.median(np.diff(navigated.time_s)))))
    out = np.zeros((nodes_s.size - 1, 2))
    for k, increments in enumerate((navigated.velocity, navigated.gyro)):
        changes = np.zeros(epoch.size)
        for column in increments.T:
            change = uniform_filter1d(column, rows)
            np.subtract(column, change, out=change)
            changes += np.square(change, out=change)
        changes /= 3.0
        changes = np.maximum(uniform_filter1d(changes, rows), 0.0)  # running sums round below 0
        out[:, k] = np.bincount(epoch, changes, nodes_s.size - 1)
    return out


def angle_random_walk(belief: Belief) -> float:
    """Believed angle random walk, rad/sqrt(s)."""
    return DEG_PER_SQRT_H * max(belief.gyro.angle_random_walk_deg_per_sqrt_h, 1e-5)


def white(seen: Observations) -> tuple[np.ndarray, tuple[float, float]]:
    """One sigma of each measurement (nodes, 9), and by how much down is noisier than north and east."""
    factor = np.ones(CHANNELS)
    level = seen.sigma.copy()
    for channel, by in enumerate(seen.measured_by):
        here = np.flatnonzero(np.isfinite(seen.residual[:, channel]))
        if here.size <= FEWEST:
            continue
        y = seen.residual[here, channel] / seen.sigma[here, channel]
        inside = seen.arc[here[2:]] == seen.arc[here[:-2]]  # a new arc is a jump
        if inside.sum() <= FEWEST:
            continue
        level_of = _level_less_walk if by in WALKING else _level
        factor[channel] = max(_least(by, channel), level_of(np.diff(y, 2)[inside]))
        level[:, channel] *= factor[channel]
        if by == "standstill" and channel in VELOCITIES:
            level[here, channel] = np.maximum(level[here, channel], seen.sigma[here, channel] * _agitation(y, inside))
    ratios = tuple(float(factor[2 + k] / np.sqrt(factor[k] * factor[k + 1])) for k in (0, 3))
    return level, ratios


def _least(by: str, channel: int) -> float:
    return LEAST_OF_BELIEVED[by][channel // 3] if by in LEAST_OF_BELIEVED else 1.0


def _level(second: np.ndarray) -> float:
    """One sigma of white noise by the median of its `second` differences (n,)."""
    return _deviation(second) / SECOND_DIFFERENCE


def _level_less_walk(second: np.ndarray) -> float:
    """The same beside a random walk: var(d_k) = 6 w^2 + 2 q^2, var(d_k + d_k+1) = 4 w^2 + 2 q^2 of w white, steps q."""
    white = np.sqrt(max(0.0, 0.5 * (_deviation(second) ** 2 - _deviation(second[1:] + second[:-1]) ** 2)))
    return min(white, _level(second))  # a sway faster than the rows alternates and would look larger


def _deviation(values: np.ndarray) -> float:
    return float(np.median(np.abs(values - np.median(values)))) / NORMAL_MAD


def _agitation(y: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """White noise (n,) of a standstill where people, engines or wind disturb it more than is usual, else 0.

    `inside` (n - 2,) tells second differences that lie in one arc.
    """
    second = np.diff(y, 2)
    usual = _deviation(second[inside])
    second = np.pad(np.where(inside, second, 0.0), 1, mode="edge")
    local = np.sqrt(np.maximum(uniform_filter1d(second**2, AGITATION_ROWS), 0.0))  # running sums round below 0
    return np.where(local > AGITATED * usual, local / SECOND_DIFFERENCE, 0.0)


def without_outliers(seen: Observations, longest: int = LONGEST_BURST) -> tuple[Observations, int]:
    """The same without fixes that nothing smooth could explain, and the number of their components.

    Up to `longest` in a row are left out, as where a signal is reflected, if each stands more than `OUTLIER`
    sigmas of what changes from row to row from the median of the two before and the two after them, at either end of
    the four beside them, beyond what a receiver that is late or an antenna elsewhere does in that motion, and these
    four are of one level. A position that is wrong in one component is no position; nor is a velocity.
    """
    residual = seen.residual.copy()
    for channels in FIXED_TOGETHER:
        odd = np.zeros(len(residual), dtype=bool)
        for channel in channels:
            here = np.flatnonzero(np.isfinite(residual[:, channel]))
            by = seen.measured_by[channel]
            if here.size <= FEWEST or by == "standstill":  # nobody reads a standstill wrong
                continue
            sigma = seen.sigma[here, channel]
            sigma = sigma * max(_least(by, channel), _level(np.diff(residual[here, channel] / sigma, 2)))
            moved = np.column_stack([seen.of_delay[here, channel], seen.of_arm[here, :, channel]])
            known = np.column_stack([residual[here, channel], moved * [LATE_S, *[ANTENNA_M] * 3]]) / sigma[:, None]
            for length in range(1, longest + 1):
                odd[here] |= _burst(known, length)
        residual[np.ix_(odd, channels)] = np.nan
    return replace(seen, residual=residual), int(np.isnan(residual).sum() - np.isnan(seen.residual).sum())


def _burst(known: np.ndarray, length: int) -> np.ndarray:
    """(n,) rows in a burst of `length`; `known` (n, 5) holds what was measured and what motion could do, in sigmas.

    At either end all four rows beside it lie on one side: there it stands apart from the line through them, too.
    """
    out = np.zeros(len(known), dtype=bool)
    if len(known) < length + 4:
        return out
    windows = np.moveaxis(sliding_window_view(known, length + 4, axis=0), -1, 1)
    begins = np.flatnonzero(_apart(windows, slice(2, 2 + length)))
    out[(begins[:, None] + 2 + np.arange(length)).ravel()] = True
    out[:length] |= _apart(windows[:1], slice(0, length))[0]
    out[-length:] |= _apart(windows[-1:], slice(4, 4 + length))[0]
    return out


def _apart(windows: np.ndarray, rows: slice) -> np.ndarray:
    """(m,) whether `rows` of each window (m, k, 5) stand apart from the other four."""
    at = np.arange(windows.shape[1])
    others = np.delete(at, np.r_[rows])
    first = np.sort(windows[:, others, 0], axis=1)
    near = np.abs(windows[:, rows, 0] - 0.5 * (first[:, 1] + first[:, 2])[:, None]).min(axis=1)
    out = near > OUTLIER * np.sqrt(1.0 + NEIGHBOUR_VARIANCE)  # what motion could do only lessens it
    if not out.any():
        return out
    windows = windows[out]
    beside = np.sort(windows[:, others], axis=1)
    level = 0.5 * (beside[:, 1] + beside[:, 2])
    expected = np.broadcast_to(level[:, None], windows[:, rows].shape)
    sizes = [_beyond(windows[:, rows] - expected)]
    if rows.start in (0, 4):
        slope, constant = np.polyfit(others, windows[0][others], 1)
        sizes.append(_beyond(windows[:, rows] - (np.outer(at[rows], slope) + constant)))
    size = np.min(sizes, axis=0) / np.sqrt(1.0 + NEIGHBOUR_VARIANCE)
    out[out] = (size > OUTLIER) & (beside[:, 2, 0] - beside[:, 1, 0] < ONE_LEVEL * size)
    return out


def _beyond(apart: np.ndarray) -> np.ndarray:
    """(m,) by how many sigmas the nearest row of (m, k, 5) is off beyond what motion could do."""
    apart = np.abs(apart)
    return (apart[..., 0] - apart[..., 1:].sum(axis=2)).min(axis=1)
