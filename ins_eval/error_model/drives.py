"""What could drive a navigation error, integrated at the sample rate.

A sensor error of axis i is multiplier(t) slow(t): the multiplier follows the motion and is integrated here sample by
sample, together with the attitude; the slow factor (temperature, its rate, memory, time) changes little within an
epoch and multiplies afterwards. Over the epoch k

    D_k = integral of C(t) e_i multiplier(t) dt

with the attitude at mid-sample. Measured: with the mean attitude of an epoch instead, effects that do not exist
reach log Bayes factors of thousands.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numba
import numpy as np

from ins_eval.output_equation import SENSOR_AXES
from ins_eval.strapdown import SAMPLES_PER_STEP, Solution

if TYPE_CHECKING:
    from ins_eval.error_model.null import Believed

# of specific force f along input, pendulous and output axis, in m/s^2
FORCE_MULTIPLIERS = ("1", "f", "f_pendulous", "f_output", "f^2", "f^3", "f f_pendulous", "f f_output", "|f|")
# of body rate w about the own axis and the two others in turn, in rad/s, and of specific force along them
RATE_MULTIPLIERS = ("1", "w", "w_next", "w_last", "f", "f_next", "f_last", "|w|")  # as many rows as of force: one spare
BLOCK = 1 << 20  # samples, whole steps of them
_AXES = np.array([SENSOR_AXES[axis] for axis in "xyz"])
_PER_AXIS = len(FORCE_MULTIPLIERS)
SOURCES = 2 * 3 * _PER_AXIS


def source(sensor: str, axis: int, multiplier: str) -> int:
    """The row of the integrals for a `sensor` "accelerometer" or "gyro", body axis 0, 1, 2 and multiplier."""
    if sensor == "accelerometer":
        return axis * _PER_AXIS + FORCE_MULTIPLIERS.index(multiplier)
    return (3 + axis) * _PER_AXIS + RATE_MULTIPLIERS.index(multiplier)


def strength(drive: np.ndarray, constant: np.ndarray) -> np.ndarray:
    """The size (epochs,) of a drive (epochs, 3) in that of a `constant` unit error of one sensor, along that error."""
    return np.einsum("kj,kj->k", drive, constant) / np.einsum("kj,kj->k", constant, constant)


def integrate(believed: Believed, arcs: Sequence[Solution], nodes_s: np.ndarray) -> np.ndarray:
    """Integrals (nodes - 1, SOURCES, 3) over the epochs between `nodes_s`, in n; a sample across a node is split."""
    time_s, out = believed.time_s, np.zeros((nodes_s.size - 1, SOURCES, 3))
    begins = np.concatenate([*(arc.quaternion_nb[:-1] for arc in arcs), arcs[-1].quaternion_nb[-1:]])
    rests = _rests(believed)
    felt = partial(_at_rest, believed, rests) if rests else believed.increments
    for first in range(0, time_s.size, BLOCK):
        last = min(first + BLOCK, time_s.size)
        start_s = time_s[first - 1] if first else believed.start.time_s
        gyro, velocity = felt(first, last)
        at_steps = begins[first // SAMPLES_PER_STEP :]
        _integrate(time_s[first:last], start_s, gyro, velocity, at_steps, nodes_s, _AXES, out)
    return out


class _Rest(NamedTuple):
    """The samples `rows` of a stand, and its mean rate, rad/s, and specific force, m/s^2, (3,) each."""

    rows: slice
    rate: np.ndarray
    force: np.ndarray


def _rests(believed: Believed) -> list[_Rest]:
    """The means of every stand, the biases taken off."""
    out = []
    for stand in believed.stands:
        rows = slice(*np.searchsorted(believed.time_s, [stand.start_s, stand.end_s]))
        if rows.start == rows.stop:
            continue
        before_s = believed.time_s[rows.start - 1] if rows.start else believed.start.time_s
        lasted_s = believed.time_s[rows.stop - 1] - before_s
        rate, force = (one[rows].sum(axis=0) / lasted_s for one in (believed.gyro, believed.velocity))
        out.append(_Rest(rows, rate - believed.gyro_bias, force - believed.force_bias))
    return out


def _at_rest(believed: Believed, rests: Sequence[_Rest], first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
    """Increments of the samples from `first` to `last`, those of a stand at its means.

    There what a sample adds to them is noise, which is no drive: with it a column is made of the very noise that the
    residual holds, and a scale factor of per cents "explains" it. Means of a minute hold enough of it in a day.
    """
    gyro, velocity = (one.copy() for one in believed.increments(first, last))
    before_s = believed.time_s[first - 1] if first else believed.start.time_s
    interval_s = np.diff(believed.time_s[first:last], prepend=before_s)[:, None]
    for rest in rests:
        inside = slice(max(rest.rows.start - first, 0), max(rest.rows.stop - first, 0))
        gyro[inside], velocity[inside] = interval_s[inside] * rest.rate, interval_s[inside] * rest.force
    return gyro, velocity


@numba.njit(cache=True, nogil=True)
def _integrate(time_s, start_s, gyro, velocity, quaternions, nodes_s, axes, out):
    epochs = nodes_s.size - 1
    m = np.zeros(SOURCES)
    q = np.empty(4)
    epoch = 0
    t0 = start_s
    for k in range(time_s.size):
        t1 = time_s[k]
        dt = t1 - t0
        if k % SAMPLES_PER_STEP == 0:
            q[:] = quaternions[k // SAMPLES_PER_STEP]
        # attitude at mid-sample: q times half the increment
        hx, hy, hz = 0.25 * gyro[k, 0], 0.25 * gyro[k, 1], 0.25 * gyro[k, 2]
        hw = 1.0 - 0.5 * (hx * hx + hy * hy + hz * hz)
        a = q[0] * hw - q[1] * hx - q[2] * hy - q[3] * hz
        b = q[0] * hx + q[1] * hw + q[2] * hz - q[3] * hy
        c = q[0] * hy - q[1] * hz + q[2] * hw + q[3] * hx
        d = q[0] * hz + q[1] * hy - q[2] * hx + q[3] * hw
        q[0] = a * hw - b * hx - c * hy - d * hz
        q[1] = a * hx + b * hw + c * hz - d * hy
        q[2] = a * hy - b * hz + c * hw + d * hx
        q[3] = a * hz + b * hy - c * hx + d * hw
        columns = (
            (a * a + b * b - c * c - d * d, 2.0 * (b * c + a * d), 2.0 * (b * d - a * c)),
            (2.0 * (b * c - a * d), a * a - b * b + c * c - d * d, 2.0 * (c * d + a * b)),
            (2.0 * (b * d + a * c), 2.0 * (c * d - a * b), a * a - b * b - c * c + d * d),
        )
        for i in range(3):
            p, o = axes[i, 1], axes[i, 2]
            f, fp, fo = velocity[k, i] / dt, velocity[k, p] / dt, velocity[k, o] / dt
            row = _PER_AXIS * i
            m[row], m[row + 1], m[row + 2], m[row + 3] = 1.0, f, fp, fo
            m[row + 4], m[row + 5], m[row + 6], m[row + 7] = (f * f, f * f * f, f * fp, f * fo)
            m[row + 8] = abs(f)
            ahead, last = (i + 1) % 3, (i + 2) % 3
            w = gyro[k, i] / dt
            row = _PER_AXIS * (3 + i)
            m[row], m[row + 1], m[row + 2], m[row + 3] = (1.0, w, gyro[k, ahead] / dt, gyro[k, last] / dt)
            m[row + 4], m[row + 5], m[row + 6] = (f, velocity[k, ahead] / dt, velocity[k, last] / dt)
            m[row + 7] = abs(w)
        # spread over the epochs that the sample touches
        begin = t0
        while begin < t1 - 1e-12:
            while epoch < epochs and nodes_s[epoch + 1] <= begin + 1e-12:
                epoch += 1
            if epoch >= epochs:
                return
            if nodes_s[epoch] >= t1:
                break
            end = min(t1, nodes_s[epoch + 1])
            part = end - max(begin, nodes_s[epoch])
            for i in range(3):
                cx, cy, cz = columns[i]
                for sensor in range(2):
                    first = _PER_AXIS * (3 * sensor + i)
                    for row in range(first, first + _PER_AXIS):
                        x = m[row] * part
                        out[epoch, row, 0] += cx * x
                        out[epoch, row, 1] += cy * x
                        out[epoch, row, 2] += cz * x
            begin = end
        t0 = t1
