"""One mission of many instruments: aligned, navigated and reduced to measures, to first order in their errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numba
import numpy as np

from ins_eval import gps, metrics
from ins_eval.alignment import COARSE_S, UPDATE_S, filter_weights
from ins_eval.compensation import CompensationModel
from ins_eval.earth import EARTH_RATE, gravity
from ins_eval.ensemble.linear.course import STEP_S, Course, Epochs, epochs_of
from ins_eval.ensemble.linear.instruments import Instruments
from ins_eval.error_dynamics import ATTITUDE, DRIVES, STATES, advance
from ins_eval.many_streams import ManyStreams, normals
from ins_eval.navigation import alignment_noise
from ins_eval.random_processes import gauss_markov_of
from ins_eval.recording.belief import NAVIGATION_GRADE
from ins_eval.strapdown import SAMPLES_PER_STEP
from ins_eval.units import HOUR, NMI

CHUNK = 40_000  # steps times instruments whose errors are worked out together, so that they stay in the cache
BARO_S = 10.0  # between the points of the wandering of the barometer, `imu.Mission`
SQUARES, RADIUS_TIME, RATE_SQUARE, RADIUS_SQUARE, LAST = slice(0, 3), 3, 4, 5, slice(6, 8)
SUMS = 8
SQUARE_NMI = 1.0 / NMI**2  # of a square metre

Measures = dict[str, dict[str, np.ndarray]]


def fly(instruments: Instruments, course: Course, triads: Mapping[str, Sequence[CompensationModel]]) -> Measures:
    """Of each compensation what each flight contributes, as `ensemble.flight.contributions` has it: (m, ...)."""
    node = instruments.streams.at("flight")
    flight = _Flight(instruments, course, list(triads.values()), node)
    x = flight.aligned() if instruments.world.alignment == "found" else np.zeros((STATES, *flight.shape))
    found = flight.navigated(x)
    return {arm: {key: value[number] for key, value in found.items()} for number, arm in enumerate(triads)}


class _Flight:
    """Errors of sensors over the steps of a mission, and what navigation makes of them."""

    def __init__(
        self, instruments: Instruments, course: Course, triads: list[Sequence[CompensationModel]], node: ManyStreams
    ):
        self.course, self.triads, self.node, self.samples = course, triads, node, instruments.samples
        mission, steps = course.mission, course.steps
        self.output = [
            instruments.output(course, unit, instruments.run(mission, axis), node)
            for axis, unit in enumerate(instruments.accelerometers)
        ]
        draws = instruments.draws(course)
        imu_c = course.mean(mission.imu_c)
        self.rate_error = instruments.gyros.rate_errors(
            steps.step_s, draws, steps.rate_b, steps.turning_b, node.at("gyros"), imu_c
        )
        self.shape = (len(triads), len(node.words))
        stand_s = -mission.trajectory.start_s
        self.updates = int(stand_s // UPDATE_S)  # of the alignment
        self.begin = round(self.updates * UPDATE_S / STEP_S)  # the step with which navigation begins

    def force_error(self, rows: slice) -> np.ndarray:
        """Errors of the compensated specific force over some steps, (arms, 3, n, m) in m/s^2."""
        count = self.course.steps.time_s[rows].size
        out = np.empty((self.shape[0], 3, count, self.shape[1]))
        for axis in range(3):
            seen = self.samples(self.course, self.output[axis][rows], rows)
            true = self.course.steps.force_b[rows, axis, None]
            for arm, triad in enumerate(self.triads):
                force = triad[axis].specific_force(seen).reshape(count, -1)
                np.subtract(force, true, out=out[arm, axis])
        return out

    def aligned(self) -> np.ndarray:
        """States at the start of navigation, (10, arms, m), from the alignment on the stand: see `alignment.align`."""
        steps = self.course.steps[: self.begin]
        trajectory = self.course.mission.trajectory
        place = trajectory.truth(np.array([trajectory.start_s]))
        latitude, height = float(place.latitude_rad[0]), float(place.height_m[0])
        force_error = self.force_error(slice(0, self.begin))
        rate_error = self.rate_error[:, : self.begin]
        first = round(min(COARSE_S, -trajectory.start_s) / STEP_S)
        force_n = np.einsum("ij,ajm->iam", steps.mat_nb[0], force_error[:, :, :first].mean(axis=2))
        rate_n = np.einsum("ij,jm->im", steps.mat_nb[0], rate_error[:, :first].mean(axis=1))
        g = gravity(latitude, height)
        north_rate, down_rate = EARTH_RATE * np.cos(latitude), -EARTH_RATE * np.sin(latitude)
        x = np.zeros((STATES, *self.shape))
        x[6], x[7] = -force_n[1] / g, force_n[0] / g
        x[8] = (down_rate * x[6] - rate_n[1]) / north_rate
        every = round(UPDATE_S / STEP_S)
        still = np.zeros((self.begin, self.shape[1]))
        velocity = np.empty((self.updates, 2, *self.shape))
        of_steps = (steps.mat_nb, steps.transition, steps.drive, steps.step_s)
        _stand(x, force_error, rate_error, still, of_steps, every, velocity)
        noise = alignment_noise(NAVIGATION_GRADE)
        weights, _ = filter_weights(latitude, height, UPDATE_S, noise, self.updates)
        begun = np.zeros_like(x)
        begun[ATTITUDE] = x[ATTITUDE] + np.tensordot(weights, velocity, 2)
        return begun

    def navigated(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """What each flight contributes, (arms, m, ...), of the states `x` at the start of navigation."""
        mission, steps = self.course.mission, self.course.steps
        begin_s = mission.trajectory.start_s + self.begin * STEP_S
        samples = round((mission.trajectory.end_s - begin_s) * mission.rate_hz)
        last_s = begin_s + samples // SAMPLES_PER_STEP * SAMPLES_PER_STEP / mission.rate_hz
        epochs = epochs_of(mission, last_s)
        receiver = gps.errors_of(mission.profile.gps, self._receiver_s(), self.node.at("gps"))
        aid_error = self._aid_error()
        sums = np.zeros((SUMS, *self.shape))
        track = np.zeros((epochs.track_s.size, 2, *self.shape))
        of_step = np.full(steps.time_s.size + 1, -1)  # the epoch at which a step ends, the first being the start
        ends = np.rint((epochs.time_s - mission.trajectory.start_s) / STEP_S).astype(int)
        of_step[ends] = np.arange(epochs.time_s.size)
        columns = (epochs.time_s, epochs.metres, epochs.valid, epochs.late, epochs.begin, epochs.track, epochs.weight)
        if of_step[self.begin] >= 0:
            _reduce(x, of_step[self.begin], columns, receiver, sums, track)
        chunk = max(1, CHUNK // self.shape[1])
        for first in range(self.begin, steps.time_s.size, chunk):
            rows = slice(first, first + chunk)
            of = steps[rows]
            _navigate(
                x,
                self.force_error(rows),
                self.rate_error[:, rows],
                aid_error[rows],
                (of.mat_nb, of.transition, of.drive, of.step_s),
                of_step[1:][rows],
                columns,
                receiver,
                sums,
                track,
            )
        return _contributions(sums, track, epochs)

    def _receiver_s(self) -> np.ndarray:
        trajectory, gps_of = self.course.mission.trajectory, self.course.mission.profile.gps
        return np.arange(0.0, trajectory.end_s + 0.5 * gps_of.period_s, gps_of.period_s)

    def _aid_error(self) -> np.ndarray:
        """Error of the barometer at the middle of each step, (n, m) in m: that of `imu.Mission`."""
        mission = self.course.mission
        baro, trajectory = mission.profile.baro, mission.trajectory
        slow_s = np.arange(trajectory.start_s, trajectory.end_s + BARO_S, BARO_S)
        normal = normals(self.node.at("baro").begin(), slow_s.size)
        wander = gauss_markov_of(normal, slow_s, baro.sigma_m, baro.correlation_s, start=0.0)
        middle = self.course.steps.time_s - 0.5 * STEP_S
        left = np.searchsorted(slow_s, middle, side="right") - 1
        share = ((middle - slow_s[left]) / BARO_S)[:, None]
        return (1.0 - share) * wander[left] + share * wander[left + 1]


@numba.njit(cache=True, nogil=True)
def _fed(u, k, force_error, rate_error, aid_error, mat_nb, step_s):
    """Fill the drives `u` (7, arms, m) of step k."""
    for row in range(3):
        a, b, c = step_s * mat_nb[k, row, 0], step_s * mat_nb[k, row, 1], step_s * mat_nb[k, row, 2]
        for arm in range(u.shape[1]):
            for i in range(u.shape[2]):
                force = a * force_error[arm, 0, k, i] + b * force_error[arm, 1, k, i] + c * force_error[arm, 2, k, i]
                u[row, arm, i] = force
                u[3 + row, arm, i] = a * rate_error[0, k, i] + b * rate_error[1, k, i] + c * rate_error[2, k, i]
    for arm in range(u.shape[1]):
        for i in range(u.shape[2]):
            u[6, arm, i] = aid_error[k, i]


@numba.njit(cache=True, nogil=True)
def _stand(x, force_error, rate_error, aid_error, steps, every, velocity):
    """Take the states through the stand and keep north and east velocity after every `every` steps."""
    mat_nb, transition, drive, step_s = steps
    u, scratch = np.empty((DRIVES, *x.shape[1:])), np.empty((STATES, x.shape[1] * x.shape[2]))
    for k in range(transition.shape[0]):
        _fed(u, k, force_error, rate_error, aid_error, mat_nb, step_s)
        advance(x.reshape(STATES, -1), u.reshape(DRIVES, -1), transition[k], drive[k], scratch)
        if (k + 1) % every == 0:
            velocity[(k + 1) // every - 1] = x[3:5]


@numba.njit(cache=True, nogil=True)
def _navigate(x, force_error, rate_error, aid_error, steps, epoch, columns, receiver, sums, track):
    """Take the states through some steps and add up what each epoch gives."""
    mat_nb, transition, drive, step_s = steps
    u, scratch = np.empty((DRIVES, *x.shape[1:])), np.empty((STATES, x.shape[1] * x.shape[2]))
    for k in range(transition.shape[0]):
        _fed(u, k, force_error, rate_error, aid_error, mat_nb, step_s)
        advance(x.reshape(STATES, -1), u.reshape(DRIVES, -1), transition[k], drive[k], scratch)
        if epoch[k] >= 0:
            _reduce(x, epoch[k], columns, receiver, sums, track)


@numba.njit(cache=True, nogil=True)
def _reduce(x, e, columns, receiver, sums, track):
    """Add what the errors against the fix of one epoch give to sums (8, arms, m) and tracks (k, 2, arms, m)."""
    time_s, metres, valid, late, begin, track_of, weight = columns
    position, velocity = receiver
    time_h = time_s[e] / 3600.0
    per_square_hour = 1.0 / (time_h * time_h) if late[e] else 0.0
    for arm in range(x.shape[1]):
        for q in range(begin[e], begin[e + 1]):
            for axis in range(2):
                for i in range(x.shape[2]):
                    error = metres[e, axis] * x[axis, arm, i] - position[e, axis, i]
                    track[track_of[q], axis, arm, i] += weight[q] * error
        if not valid[e]:
            continue
        for axis in range(3):
            for i in range(x.shape[2]):
                error = x[3 + axis, arm, i] - velocity[e, axis, i]
                sums[axis, arm, i] += error * error
        if time_h > 0.0:
            for i in range(x.shape[2]):
                north = metres[e, 0] * x[0, arm, i] - position[e, 0, i]
                east = metres[e, 1] * x[1, arm, i] - position[e, 1, i]
                square = (north * north + east * east) * SQUARE_NMI
                sums[3, arm, i] += np.sqrt(square) * time_h
                sums[4, arm, i] += square * per_square_hour
                sums[5, arm, i] += square
                sums[6, arm, i], sums[7, arm, i] = north, east


def _contributions(sums: np.ndarray, track: np.ndarray, epochs: Epochs) -> dict[str, np.ndarray]:
    """The keys of `ensemble.flight.contributions` from the sums over epochs, (arms, m, ...)."""
    moving = epochs.valid & (epochs.time_s > 0.0)
    time_h = epochs.time_s[moving] / HOUR
    north, east, down = np.sqrt(sums[SQUARES] / np.count_nonzero(epochs.valid))
    final_vector = np.moveaxis(sums[LAST], 0, -1) / NMI / time_h[-1]
    final = np.hypot(final_vector[..., 0], final_vector[..., 1])
    late = np.count_nonzero(epochs.late & moving)
    reduced = {
        metrics.DEFINITIONS["final"].per_flight: final,
        metrics.DEFINITIONS["elliptical"].per_flight: final_vector,
        metrics.DEFINITIONS["least_squares"].per_flight: sums[RADIUS_TIME] / np.sum(time_h**2),
        metrics.DEFINITIONS["trms"].per_flight: np.sqrt(sums[RATE_SQUARE] / late) if late else final,
    }
    shape = sums.shape[1:]
    return {
        **dict(zip((f"velocity_rms_{axis}" for axis in ("north", "east", "down")), (north, east, down), strict=True)),
        "velocity_rms_horizontal": np.hypot(north, east),
        **{f"cep_rate_{key}": reduced[definition.per_flight] for key, definition in metrics.DEFINITIONS.items()},
        "radial_rms_m": NMI * np.sqrt(sums[RADIUS_SQUARE] / time_h.size),
        "track_s": np.broadcast_to(epochs.track_s, (*shape, epochs.track_s.size)),
        "track_m": np.moveaxis(track, (0, 1), (2, 3)),
    }
