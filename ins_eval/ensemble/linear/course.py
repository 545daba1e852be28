"""What all instruments share on one mission: true steps, epochs of the receiver, temperatures as they are read."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from ins_eval.accelerometer import ManyAccelerometers, ThermalRun
from ins_eval.accelerometer.model import SlowErrors
from ins_eval.earth import radii
from ins_eval.ensemble.flight import TRACK_PERIOD_S
from ins_eval.error_dynamics import Steps, steps_of
from ins_eval.imu import Mission
from ins_eval.many_streams import ManyStreams
from ins_eval.metrics import RATE_WINDOW_FROM_H
from ins_eval.recording import Fixes
from ins_eval.recording.belief import NAVIGATION_GRADE
from ins_eval.reference import outages
from ins_eval.thermal import filtered_rate
from ins_eval.units import DEG, HOUR, STANDARD_GRAVITY

MOTION_HZ = 4.0  # of the samples in which the true motion within a step is integrated: far above that of an aircraft
STEP_S = 1.0  # that of the temperatures of a run (`imu.Mission`)
BRIDGED_FROM_S = 60.0  # on either side of a gap, see `reference.bridge`


@dataclass(frozen=True, eq=False)
class Epochs:
    """Epochs (e,) at which a fix stands beside the solution, and what the measures of a flight take of each.

    metres     (e, 2) along north and east for a radian of latitude and longitude
    valid      whether the receiver has a fix
    late       whether r/t counts in a rate: 1 or 0
    track_s    (k,) instants of the track, each a weighted sum of the errors at epochs, since it is bridged over gaps
    begin      (e + 1,) where the entries of an epoch begin in `track`, the number of an instant, and `weight`
    """

    time_s: np.ndarray
    metres: np.ndarray
    valid: np.ndarray
    late: np.ndarray
    track_s: np.ndarray
    begin: np.ndarray
    track: np.ndarray
    weight: np.ndarray


class Course:
    """One mission in steps of a second."""

    def __init__(self, mission: Mission):
        self.mission = mission
        self.every = round(mission.rate_hz * STEP_S)  # samples in a step
        self.steps: Steps = steps_of(
            mission.trajectory, mission.trajectory.increments(MOTION_HZ), round(MOTION_HZ * STEP_S)
        )
        rate = filtered_rate(mission.time_s, mission.reading_c, NAVIGATION_GRADE.accelerometer.rate_filter_s)
        self.reading_c, self.rate_c_per_min = (self.mean(column) for column in (mission.reading_c, rate))

    def mean(self, samples: np.ndarray) -> np.ndarray:
        """Means of samples (n,) over the steps."""
        count = self.steps.time_s.size
        return samples[: count * self.every].reshape(count, self.every).mean(axis=1)

    def output(self, of: ManyAccelerometers, run: ThermalRun, streams: ManyStreams, draws: int) -> np.ndarray:
        """Mean outputs (n, m) of m accelerometers over the steps, pulse/s; their noise is of `draws` numbers a step."""
        count = self.steps.time_s.size
        before = 0.5 * (self.every - 1.0) / self.every  # weight of the point of the run at which a step begins
        slow = SlowErrors(*(_between(values, before)[:count] for values in of.slow(run, streams)))
        interval_s = np.full(count, self.steps.step_s)
        return of.counts(interval_s, self.steps.force_b / STANDARD_GRAVITY, slow, streams, draws) / STEP_S


@numba.njit(cache=True, nogil=True)
def _between(values, before):
    """Values (n, m) at points between those at n + 1, from the weight of the one before: in place."""
    for k in range(values.shape[0] - 1):
        for j in range(values.shape[1]):
            values[k, j] = before * values[k, j] + (1.0 - before) * values[k + 1, j]
    return values[:-1]


def epochs_of(mission: Mission, last_s: float) -> Epochs:
    """The epochs of the receiver of a mission up to the end of navigation, `last_s`."""
    gps = mission.profile.gps
    time_s = np.arange(0.0, mission.trajectory.end_s + 0.5 * gps.period_s, gps.period_s)
    truth = mission.trajectory.truth(time_s[time_s <= last_s + 1e-6])
    time_s, valid = truth.time_s, np.abs(truth.attitude_rad[:, 0]) <= gps.lost_beyond_roll_deg * DEG
    meridian, transverse = radii(truth.latitude_rad)
    metres = np.column_stack([meridian + truth.height_m, (transverse + truth.height_m) * np.cos(truth.latitude_rad)])
    late = valid & (time_s >= HOUR * RATE_WINDOW_FROM_H)
    at = np.searchsorted(time_s, np.arange(0.0, time_s[-1] + 0.5, TRACK_PERIOD_S) - 1e-6)
    entries = sorted((e, k, weight) for k, one in enumerate(at) for e, weight in _bridged(truth, valid, int(one)))
    of_epoch = np.array([e for e, _, _ in entries])
    return Epochs(
        time_s,
        metres,
        valid,
        late,
        time_s[at],
        np.searchsorted(of_epoch, np.arange(time_s.size + 1)),
        np.array([k for _, k, _ in entries]),
        np.array([weight for _, _, weight in entries]),
    )


def unfit_profile(mission: Mission) -> str | None:
    """Why errors cannot go along a mission in steps of a second, or None."""
    profile = mission.profile
    for name, value_s in (("start.stand_s", profile.start.stand_s), ("gps.period_s", profile.gps.period_s)):
        if value_s % STEP_S:
            return f"{name} = {value_s:g} is not in whole seconds"
    if mission.rate_hz % 1.0:
        return f"a rate of {mission.rate_hz:g} Hz has no whole number of samples in a second"
    return None


def _bridged(truth, valid: np.ndarray, at: int) -> list[tuple[int, float]]:
    """Epochs and weights with which `reference.bridge` makes the error at one epoch of those with a fix."""
    if valid[at]:
        return [(at, 1.0)]
    time_s = truth.time_s
    lost = np.where(valid, 1.0, np.nan)
    fixes = Fixes(time_s, lost, lost, lost, lost[:, None] * truth.velocity_n, valid)
    gap = next(gap for gap in outages(fixes) if gap.start_s <= time_s[at] <= gap.end_s)
    first, last = np.searchsorted(time_s, (gap.start_s - BRIDGED_FROM_S, gap.end_s + BRIDGED_FROM_S + 1e-9))
    around = first + np.flatnonzero(valid[first:last])
    if not (valid[time_s == gap.start_s].all() and valid[time_s == gap.end_s].all()):
        return [(at, np.nan)]  # at the start or the end of the record
    t = time_s[around] - time_s[around].mean()
    weights = 1.0 / t.size + (time_s[at] - time_s[around].mean()) * t / (t @ t)
    return list(zip(around.tolist(), weights.tolist(), strict=True))
