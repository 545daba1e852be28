"""A solution at any instant, a start that is moved or turned: what several parts of the diagnosis need."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numba
import numpy as np
from scipy.spatial.transform import Rotation

from ins_eval.coning_sculling import add, cross, multiply, quaternion, rotate, scaled
from ins_eval.earth import radii
from ins_eval.strapdown import SAMPLES_PER_STEP, Solution

if TYPE_CHECKING:
    from ins_eval.recording import Start

STATES = 9  # of a navigation error: of position and velocity in n, and phi
POSITION, VELOCITY, ATTITUDE = slice(0, 3), slice(3, 6), slice(6, 9)
VELOCITY_DEGREE = 5  # of the spline through the solution's velocity
BLOCK, OVERLAP = 1 << 18, 64  # steps
APART_S = 1.0  # between arcs whose splines are found together: any length does, for none depends on it
CLOCK_S = 1e-6  # by which stamps of one instant may differ: rounding
_ROOT3 = np.sqrt(3.0)
_EDGES, _POWERS = np.arange(SAMPLES_PER_STEP + 1) / SAMPLES_PER_STEP, np.arange(1, SAMPLES_PER_STEP + 1)
# of a step of length 1: from its increments to the coefficients of the body rate by powers of time
_OF_INCREMENTS = np.linalg.inv((_EDGES[1:, None] ** _POWERS - _EDGES[:-1, None] ** _POWERS) / _POWERS)


@dataclass(frozen=True, eq=False)
class States:
    """A solution at the instants `time_s` (m,): position, velocity and its derivative (m, 3), body to n (m, 3, 3)."""

    time_s: np.ndarray
    latitude_rad: np.ndarray
    longitude_rad: np.ndarray
    height_m: np.ndarray
    velocity_n: np.ndarray
    acceleration_n: np.ndarray
    mat_nb: np.ndarray


def along(arcs: Sequence[Solution], gyro: np.ndarray, bias: np.ndarray, time_s: np.ndarray) -> States:
    """The solution at `time_s` (m,), which lie inside it, where one arc ends and the next begins at the end.

    `gyro` (n, 3) are the increments of which it was made, less a `bias` (3,) in rad/s. Position: cubic Hermite with the
    solution's own velocity; velocity: spline of fifth degree; attitude: as the gyros turned within the step. One arc
    is taken in blocks of steps: what a spline takes from beyond `OVERLAP` steps is below rounding.
    """
    if len(arcs) > 1:
        return _at(arcs, gyro, bias, time_s)
    (solution,) = arcs
    steps = solution.time_s.size - 1
    if steps <= BLOCK:
        return _at([solution], gyro, bias, time_s)
    edges = [*range(0, steps - BLOCK // 2, BLOCK), steps]
    cuts = [0, *np.searchsorted(time_s, solution.time_s[edges[1:-1]]), time_s.size]
    parts = []
    for k in range(len(edges) - 1):
        low, high = max(0, edges[k] - OVERLAP), min(steps, edges[k + 1] + OVERLAP)
        part = Solution(*(getattr(solution, field.name)[low : high + 1] for field in fields(Solution)))
        rows = slice(SAMPLES_PER_STEP * low, SAMPLES_PER_STEP * high)
        parts.append(_at([part], gyro[rows], bias, time_s[cuts[k] : cuts[k + 1]]))
    return States(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(States)))


def _at(arcs: Sequence[Solution], gyro: np.ndarray, bias: np.ndarray, time_s: np.ndarray) -> States:
    whole = Solution(*(np.concatenate([getattr(arc, field.name) for arc in arcs]) for field in fields(Solution)))
    ends = np.cumsum([arc.time_s.size for arc in arcs])  # rows of `whole`, in which no step leads from arc to arc
    cuts = [0, *np.searchsorted(time_s, [arc.time_s[-1] + CLOCK_S for arc in arcs[:-1]]), time_s.size]
    arc = np.repeat(np.arange(len(arcs)), np.diff(cuts))
    step = np.searchsorted(whole.time_s, time_s, side="right") - 1
    step = np.clip(step, (ends - [one.time_s.size for one in arcs])[arc], ends[arc] - 2)
    meridian, transverse = radii(whole.latitude_rad)
    north, east, down = whole.velocity_n.T
    rates = (
        north / (meridian + whole.height_m),
        east / ((transverse + whole.height_m) * np.cos(whole.latitude_rad)),
        -down,
    )
    values = (whole.latitude_rad, np.unwrap(whole.longitude_rad), whole.height_m)
    latitude, longitude, height = (
        _hermite(whole.time_s, v, r, step, time_s) for v, r in zip(values, rates, strict=True)
    )
    velocity, acceleration = _splined(arcs, arc, time_s)
    increments = gyro[: SAMPLES_PER_STEP * (whole.time_s.size - len(arcs))].reshape(-1, SAMPLES_PER_STEP, 3)
    sample_s = (whole.time_s[step + 1] - whole.time_s[step]) / SAMPLES_PER_STEP
    inside = np.clip((time_s - whole.time_s[step]) / (SAMPLES_PER_STEP * sample_s), 0.0, 1.0)
    turned_by = increments[step - arc] - (sample_s[:, None] * bias)[:, None]
    attitude = _attitudes(whole.quaternion_nb[step], whole.quaternion_nb[step + 1], turned_by, inside)
    return States(time_s, latitude, longitude, height, velocity, acceleration, attitude)


def _splined(arcs: Sequence[Solution], arc: np.ndarray, time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and its derivative (m, 3) at `time_s`, by a not-a-knot spline through the `arc` (m,) of each instant.

    The splines of all arcs of one degree k are one: with arcs moved apart by `APART_S`, and knots of multiplicity k at
    their ends, what lies between two arcs meets their last and first values, k - 1 of its own, and nothing else.
    """
    from scipy.interpolate import make_interp_spline  # imported here, for it takes long and few need it

    velocity, acceleration = np.empty((2, time_s.size, 3))
    degrees = np.array([max(1, min(VELOCITY_DEGREE, (one.time_s.size - 1) // 2 * 2 - 1)) for one in arcs])
    end_s = np.array([one.time_s[-1] for one in arcs])
    seen = np.unique(arc)
    for k in np.unique(degrees[seen]):
        sites: list[np.ndarray] = []
        values, knots = [], []
        for n in seen[degrees[seen] == k]:
            t = arcs[n].time_s + APART_S * n
            if sites:
                sites.append(np.linspace(sites[-1][-1], t[0], k + 1)[1:-1])
                values.append(np.zeros((k - 1, 3)))
            sites.append(t)
            values.append(arcs[n].velocity_n)
            knots += [np.full(k, t[0]), t[(k + 1) // 2 : -(k + 1) // 2], np.full(k, t[-1])]
        knots = [sites[0][:1], *knots, sites[-1][-1:]]
        spline = make_interp_spline(np.concatenate(sites), np.concatenate(values), k=k, t=np.concatenate(knots))
        here = degrees[arc] == k
        moved_s = APART_S * arc[here]
        at = np.minimum(time_s[here] + moved_s, np.nextafter(end_s[arc[here]] + moved_s, -np.inf))
        velocity[here], acceleration[here] = spline(at), spline(at, 1)
    return velocity, acceleration


def _hermite(t: np.ndarray, value: np.ndarray, rate: np.ndarray, step: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """The cubic (m,) through value and rate (n,) at both ends, at times `t`, of the step in which each instant lies."""
    width = t[step + 1] - t[step]
    u = (time_s - t[step]) / width
    before, after = value[step], value[step + 1]
    first, last = width * rate[step] - (after - before), width * rate[step + 1] - (after - before)
    return before + u * (after - before) + u * (1.0 - u) * (first * (1.0 - u) - last * u)


@numba.njit(cache=True)
def _attitudes(before, after, increments, along):
    """Body to n (m, 3, 3) the part `along` (m,) into steps of four `increments` (m, 4, 3).

    `before` and `after` (m, 4) are the quaternions of the solution at the begins and ends of the steps.

        C(t) = exp(u r x) C(t0) exp(phi(u) x),   u = (t - t0) / (t1 - t0)

    phi is the rotation vector of the cubic body rate through the four increments, and r in n is what then lacks to
    C(t1), a small angle: the turning of n, and rounding.
    """
    out = np.empty((along.size, 3, 3))
    for k in range(along.size):
        begin = (before[k, 0], before[k, 1], before[k, 2], before[k, 3])
        end = multiply(begin, quaternion(_turned_by(increments[k], 1.0)))
        back = (end[0], -end[1], -end[2], -end[3])
        lacking = multiply((after[k, 0], after[k, 1], after[k, 2], after[k, 3]), back)
        half = (lacking[1], lacking[2], lacking[3])
        square = half[0] * half[0] + half[1] * half[1] + half[2] * half[2]
        r = scaled(along[k] * np.copysign(2.0 + square / 3.0, lacking[0]), half)
        q = multiply(quaternion(r), multiply(begin, quaternion(_turned_by(increments[k], along[k]))))
        length = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        unit = (q[0] / length, q[1] / length, q[2] / length, q[3] / length)
        x, y, z = rotate(unit, (1.0, 0.0, 0.0)), rotate(unit, (0.0, 1.0, 0.0)), rotate(unit, (0.0, 0.0, 1.0))
        for i in range(3):
            out[k, i, 0], out[k, i, 1], out[k, i, 2] = x[i], y[i], z[i]
    return out


@numba.njit(cache=True)
def _turned_by(increments, u):
    """Rotation vector from the start of a step of four `increments` (4, 3) to the part u of it.

    Fourth-order Magnus: phi = (w1 + w2) u / 2 + sqrt(3)/12 (w1 x w2) u^2, body rates at the two Gauss points.
    Source: Blanes, Casas, Ros, BIT 40 (2000) 434.
    """
    first, second = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    early = late = 1.0
    for p in range(SAMPLES_PER_STEP):
        rate = (0.0, 0.0, 0.0)
        for i in range(SAMPLES_PER_STEP):
            rate = add(rate, _OF_INCREMENTS[p, i], (increments[i, 0], increments[i, 1], increments[i, 2]))
        first, second = add(first, early, rate), add(second, late, rate)
        early, late = early * (0.5 - _ROOT3 / 6.0) * u, late * (0.5 + _ROOT3 / 6.0) * u
    return add(scaled(0.5 * u, add(first, 1.0, second)), _ROOT3 / 12.0 * u * u, cross(first, second))


def apart(after: Sequence[Start], before: States, rows: Sequence[int]) -> np.ndarray:
    """The errors (n, 9) that n states `after` have over `rows` of the states `before`: position, velocity, phi of
    C_after = (I - phi x) C_before."""
    if not after:
        return np.zeros((0, 9))
    rows = np.asarray(rows)
    latitude, longitude, height = (
        np.array([getattr(one, name) for one in after]) for name in ("latitude_rad", "longitude_rad", "height_m")
    )
    meridian, transverse = radii(latitude)
    around = np.remainder(longitude - before.longitude_rad[rows] + np.pi, 2.0 * np.pi) - np.pi
    attitude = Rotation.from_euler("ZYX", [one.attitude_rad[::-1] for one in after])
    turn = attitude * Rotation.from_matrix(before.mat_nb[rows]).inv()
    return np.column_stack([
        (latitude - before.latitude_rad[rows]) * (meridian + height),
        around * (transverse + height) * np.cos(latitude),
        before.height_m[rows] - height,
        np.array([one.velocity_n for one in after]) - before.velocity_n[rows],
        -turn.as_rotvec(),
    ])  # fmt: skip


def moved(start: Start, position_n: np.ndarray, velocity_n: np.ndarray) -> Start:
    """A start shifted by metres north, east, down and by a velocity in m/s."""
    meridian, transverse = radii(start.latitude_rad)
    return replace(
        start,
        latitude_rad=start.latitude_rad + position_n[0] / (meridian + start.height_m),
        longitude_rad=start.longitude_rad
        + position_n[1] / ((transverse + start.height_m) * np.cos(start.latitude_rad)),
        height_m=start.height_m - position_n[2],
        velocity_n=tuple(float(v) for v in np.asarray(start.velocity_n) + velocity_n),
    )


def turned(attitudes_rad: Sequence, rotations_n: np.ndarray) -> list[tuple[float, float, float]]:
    """Roll, pitch, heading (n, 3) after turns of the body by the rotation vectors (n, 3) in n."""
    before = Rotation.from_euler("ZYX", np.asarray(attitudes_rad, dtype=float)[:, ::-1])
    angles = (Rotation.from_rotvec(rotations_n) * before).as_euler("ZYX", suppress_warnings=True)[:, ::-1]
    return [(roll, pitch, heading) for roll, pitch, heading in angles.tolist()]


def turn(before_rad, after_rad) -> np.ndarray:
    """Rotation vector in n by which the body turns from roll, pitch, heading `before_rad` to `after_rad`."""
    before, after = (Rotation.from_euler("ZYX", np.asarray(one, dtype=float)[::-1]) for one in (before_rad, after_rad))
    return (after * before.inv()).as_rotvec()


def cross_matrices(vectors: np.ndarray) -> np.ndarray:
    """(m, 3, 3) matrices that take u to v x u, of `vectors` v (m, 3)."""
    out = np.zeros((vectors.shape[0], 3, 3))
    x, y, z = vectors.T
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -z, y, -x
    out[:, 1, 0], out[:, 2, 0], out[:, 2, 1] = z, -y, x
    return out
