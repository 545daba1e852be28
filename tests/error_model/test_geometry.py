"""A solution between its rows, against the closed form of a coning motion and against a finer mechanization."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ins_eval.error_model import geometry, null
from ins_eval.strapdown import SAMPLES_PER_STEP, Solution

RATE_HZ, DURATION_S = 100.0, 4.0
CONE_RAD, CONE_RATE = 0.1, 2.0 * np.pi * 1.5  # rad/s: turns of 1.5 Hz
ATTITUDE_RAD = 1e-7  # of a cubic rate over 40 ms
SPLINE = 1e-10  # of the size of a velocity and of its derivative: rounding
BETWEEN_RAD, WITHOUT_RAD = 5e-8, 1e-5  # at 20 Hz; what a rotation at even speed would leave of the same turn


def coning(time_s: np.ndarray) -> Rotation:
    """C(t) = exp(-W t z) exp(cone x) exp(W t z): the input axis goes round a cone."""
    turn = np.column_stack([np.zeros_like(time_s), np.zeros_like(time_s), CONE_RATE * time_s])
    return Rotation.from_rotvec(-turn) * Rotation.from_rotvec([CONE_RAD, 0.0, 0.0]) * Rotation.from_rotvec(turn)


def coning_angles(edges_s: np.ndarray) -> np.ndarray:
    """Integral of the body rate of `coning`: w = W (sin(cone) sin(Wt), sin(cone) cos(Wt), 1 - cos(cone)) by signs."""
    fine = 200
    t = np.linspace(edges_s[0], edges_s[-1], (edges_s.size - 1) * fine + 1)
    small = (coning(t[:-1]).inv() * coning(t[1:])).as_rotvec()  # so short that a rotation is its rate
    return np.concatenate([np.zeros((1, 3)), np.cumsum(small, axis=0)])[::fine]


def test_the_attitude_inside_a_step_follows_a_cone() -> None:
    edges = np.arange(int(DURATION_S * RATE_HZ) + 1) / RATE_HZ
    gyro = np.diff(coning_angles(edges), axis=0)
    rows = edges[::SAMPLES_PER_STEP]
    still = np.zeros(rows.size)
    quaternions = coning(rows).as_quat(scalar_first=True)
    solution = Solution(rows, still + 0.6, still, still, np.zeros((rows.size, 3)), quaternions)
    asked = np.random.default_rng(3).uniform(0.0, rows[-1], 500)
    found = Rotation.from_matrix(geometry.along([solution], gyro, np.zeros(3), asked).mat_nb)
    error = (found * coning(asked).inv()).magnitude()
    assert error.max() < ATTITUDE_RAD
    even = Rotation.from_quat(quaternions[:-1], scalar_first=True)
    along = ((asked % (rows[1])) / rows[1])[:, None]
    step = np.minimum((asked / rows[1]).astype(int), rows.size - 2)
    whole = (even[step].inv() * Rotation.from_quat(quaternions[step + 1], scalar_first=True)).as_rotvec()
    slerp = even[step] * Rotation.from_rotvec(along * whole)
    assert (slerp * coning(asked).inv()).magnitude().max() > 100.0 * ATTITUDE_RAD


@pytest.mark.parametrize("later", [1, 3])
def test_between_its_rows_it_is_the_solution_that_starts_there(flight, later: int) -> None:
    believed = null.believe(flight)
    (solution,) = null.solve(believed)
    asked = believed.time_s[later - 1 :: SAMPLES_PER_STEP]
    states = geometry.along([solution], believed.gyro, np.zeros(3), asked)
    rows = np.clip(np.arange(asked.size), 0, solution.time_s.size - 1)
    # every row of the solution turned on by the samples since, one by one
    turned = Rotation.from_quat(solution.quaternion_nb[rows], scalar_first=True)
    for sample in range(later):
        turned = turned * Rotation.from_rotvec(believed.gyro[SAMPLES_PER_STEP * rows + sample])
    error = (Rotation.from_matrix(states.mat_nb) * turned.inv()).magnitude()
    assert np.median(error) < WITHOUT_RAD  # the Earth's turn since the row, and the coning of single samples
    assert error.max() < 1e-4


def test_at_its_rows_it_is_the_solution(flight) -> None:
    believed = null.believe(flight)
    (solution,) = null.solve(believed)
    states = geometry.along([solution], believed.gyro, np.zeros(3), solution.time_s)
    told = Rotation.from_quat(solution.quaternion_nb, scalar_first=True).as_matrix()
    np.testing.assert_allclose(states.mat_nb, told, atol=1e-12)
    np.testing.assert_allclose(states.velocity_n, solution.velocity_n, atol=1e-9)


def test_velocity_is_that_of_each_arc_also_at_its_end() -> None:
    """A spline of degree k is its polynomial of degree k, whatever stands in the arcs beside it."""
    rng = np.random.default_rng(4)
    rows, degrees = [26, 7, 5, 3, 26], [5, 5, 3, 1, 5]
    arcs, asked, expected, begin_s = [], [], [], 100.0
    for n, degree in zip(rows, degrees, strict=True):
        time_s = begin_s + np.append(0.0, np.cumsum(rng.uniform(0.03, 0.05, n - 1)))
        course = np.polynomial.Polynomial(rng.normal(0.0, 10.0, degree + 1), [time_s[0], time_s[-1]])
        still = np.zeros(n)
        velocity = np.column_stack([course(time_s), still, -course(time_s)])
        level = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
        arcs.append(Solution(time_s, still + 0.6, still, still, velocity, level))
        asked.append(np.append(np.sort(rng.uniform(time_s[0] + 1e-5, time_s[-1], 9)), time_s[-1]))
        expected.append(np.column_stack([course(asked[-1]), course.deriv()(asked[-1])]))
        begin_s = time_s[-1]
    gyro = np.zeros((SAMPLES_PER_STEP * sum(n - 1 for n in rows), 3))
    states = geometry.along(arcs, gyro, np.zeros(3), np.concatenate(asked))
    velocity, acceleration = np.concatenate(expected).T
    np.testing.assert_allclose(states.velocity_n[:, [0, 2]].T, [velocity, -velocity], atol=SPLINE * 10.0)
    np.testing.assert_allclose(states.acceleration_n[:, 0], acceleration, atol=SPLINE * 1e3)
