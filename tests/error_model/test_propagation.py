"""The linear error model against the full mechanization, one error of sensor, start, Earth or receiver at a time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.error_model import columns, drives, geometry, null, observations, propagation
from ins_eval.error_model.columns import Column, Drive, Elapsed, Measured, Missing, SlowFactor
from ins_eval.estimation import case as cases
from ins_eval.estimation import whitening
from ins_eval.output_equation import SENSOR_AXES
from ins_eval.recording.belief import EarthBelief
from ins_eval.units import DEG_PER_H, DEG_PER_SQRT_H, UG

# how well an error in the mechanization comes back from its own column, and how much of its energy the column leaves
COEFFICIENT, LEFT_OVER = 3e-3, 1e-4
# first order only: the square of a whole missing term of the Earth shows
EARTH_COEFFICIENT = 0.02
STOOD_S, BIAS_UG, NOTHING_SHOWN = 600.0, 200.0, 1e-4
ARC_SAMPLES, IN_ARCS = 400, 0.01


def fitted(believed: null.Believed, column: Column, slow=None) -> tuple[float, float]:
    """Coefficient of `column` in the residual of `believed`, and the share of the residual's energy that it leaves."""
    solution = null.solve(believed)
    end_s = solution[-1].time_s[-1]
    measured = observations.sources(believed, end_s)
    model = propagation.build(believed, solution, observations.nodes(believed, measured, end_s))
    seen = observations.observe(believed, model.states, model.arc, measured)
    dt = model.interval_s
    levels = whitening.NoiseLevels(
        white=seen.sigma,
        force=(2.0 * UG) ** 2 * dt,
        rate=(0.001 * DEG_PER_SQRT_H) ** 2 * dt,
        steps=np.zeros((dt.size, 3, 3)),
        slow_sigma=np.repeat([1.0, 0.02, 0.0], 3),
        slow_time_s=np.repeat([100.0, 20.0, 1.0], 3),
        jumps=np.zeros((dt.size, 3)),
        wander_sigma=np.zeros(6),
        wander_time_s=np.full(6, 1800.0),
    )
    factors = SlowFactor()
    for name, of_time in (slow or {}).items():
        factors.add(name, of_time, model)
    sums = whitening.whiten(columns.assemble(model, seen, factors, [column]), levels)
    a, b = sums.normal[0, 0], sums.projection[0]
    return b / a, 1.0 - b * b / a / sums.square


def check(believed: null.Believed, column: Column, value: float, tolerance: float = COEFFICIENT, slow=None) -> None:
    found, left = fitted(believed, column, slow)
    assert found == pytest.approx(value, rel=tolerance)
    assert left < (LEFT_OVER if tolerance == COEFFICIENT else tolerance)


@pytest.fixture(scope="module")
def believed(flight) -> null.Believed:
    return null.believe(flight)


@pytest.mark.parametrize(
    ("axis", "multiplier", "value"),
    [("x", "1", 20.0 * UG), ("y", "1", 20.0 * UG), ("z", "f", 1e-4), ("x", "f_pendulous", 1e-4), ("z", "f^2", 1e-6)],
)
def test_an_error_of_an_accelerometer(believed, axis: str, multiplier: str, value: float) -> None:
    own, pendulous, _ = SENSOR_AXES[axis]
    dt = _interval_s(believed)
    force = believed.velocity / dt[:, None]
    shape = {"1": np.ones_like(dt), "f": force[:, own], "f^2": force[:, own] ** 2, "f_pendulous": force[:, pendulous]}
    velocity = believed.velocity.copy()
    velocity[:, own] += value * shape[multiplier] * dt
    check(replace(believed, velocity=velocity), Column("", (Drive("accelerometer", own, multiplier, 1.0),)), value)


@pytest.mark.parametrize(
    ("axis", "multiplier", "value"),
    [(0, "1", 0.01 * DEG_PER_H), (2, "1", 0.01 * DEG_PER_H), (2, "w", 1e-4), (1, "w_next", 1e-4), (1, "f_next", 5e-9)],
)
def test_an_error_of_a_gyro(believed, axis: int, multiplier: str, value: float) -> None:
    dt = _interval_s(believed)
    rate, force = believed.gyro / dt[:, None], believed.velocity / dt[:, None]
    ahead = (axis + 1) % 3
    shape = {"1": np.ones_like(dt), "w": rate[:, axis], "w_next": rate[:, ahead], "f_next": force[:, ahead]}
    gyro = believed.gyro.copy()
    gyro[:, axis] += value * shape[multiplier] * dt
    check(replace(believed, gyro=gyro), Column("", (Drive("gyro", axis, multiplier, 1.0),)), value)


def test_epochs_of_a_day_follow_turns_as_well(believed, monkeypatch) -> None:
    monkeypatch.setattr(observations, "MOST_EPOCHS", 2000)
    assert np.diff(_modelled(believed).nodes_s).max() > 0.6 * observations.LONGEST_EPOCH_S
    test_an_error_of_an_accelerometer(believed, "y", "1", 50.0 * UG)
    test_an_error_of_an_accelerometer(believed, "z", "f", 1e-4)
    test_an_error_of_a_gyro(believed, 0, "1", 0.01 * DEG_PER_H)
    test_an_error_of_a_gyro(believed, 2, "w", 1e-4)


@pytest.mark.parametrize(
    ("sensor", "axis", "value"),
    [("gyro", 0, 300.0 * DEG_PER_H), ("gyro", 2, 300.0 * DEG_PER_H), ("accelerometer", 0, 2e4 * UG)],
)
def test_a_large_error_is_found_in_arcs_and_only_there(believed, sensor: str, axis: int, value: float) -> None:
    """One arc turns by degrees and the sum of all by a turn or more, so that nothing is small but the arcs."""
    (path,) = null.solve(believed)
    what = {"gyro": "gyro", "accelerometer": "velocity"}[sensor]
    increments = getattr(believed, what).copy()
    increments[:, axis] += value * _interval_s(believed)
    wrong = replace(believed, **{what: increments})
    begins = believed.time_s[ARC_SAMPLES - 1 : -ARC_SAMPLES : ARC_SAMPLES]
    column = Column("", (Drive(sensor, axis, "1", 1.0),))
    check(replace(wrong, arcs=tuple(null.start_at(path, t) for t in begins)), column, value, IN_ARCS)
    with pytest.raises(AssertionError):
        check(wrong, column, value, IN_ARCS)


@pytest.mark.parametrize(("state", "value"), [(0, 1.0), (2, 1.0), (4, 0.01), (6, 1e-5), (8, 1e-5)])
def test_an_error_of_the_start(believed, state: int, value: float) -> None:
    error = np.zeros(9)
    error[state] = value
    start = geometry.moved(believed.start, error[:3], error[3:6])
    start = replace(start, attitude_rad=geometry.turned([start.attitude_rad], -error[None, 6:])[0])
    check(replace(believed, start=start), Column("", start=tuple(error / value)), value)


@pytest.mark.parametrize("term", ["coriolis", "gravity_height", "gravity_latitude"])
def test_a_term_of_the_earth_that_is_left_out(believed, term: str) -> None:
    belief = believed.recording.belief.model_copy(update={"earth": EarthBelief(**{term: False})})
    lacking = replace(believed, recording=replace(believed.recording, belief=belief))
    check(lacking, Column("", (Missing(term),)), 1.0, EARTH_COEFFICIENT)


@pytest.mark.parametrize("axis", [0, 2])
def test_an_antenna_that_is_elsewhere(believed, axis: int) -> None:
    believed_arm = tuple(-np.eye(3)[axis])  # true minus believed is +1 m
    gps = believed.recording.belief.gps.model_copy(update={"lever_arm_m": believed_arm})
    belief = believed.recording.belief.model_copy(update={"gps": gps})
    elsewhere = replace(believed, recording=replace(believed.recording, belief=belief))
    check(elsewhere, Column("", (Measured(f"arm_{'xyz'[axis]}", 1.0),)), 1.0)


def test_stamps_that_are_late(believed) -> None:
    delay_s = 0.02
    fixes = believed.recording.gps
    late = replace(believed, recording=replace(believed.recording, gps=replace(fixes, time_s=fixes.time_s + delay_s)))
    check(late, Column("", (Measured("delay", 1.0),)), delay_s)


def test_a_clock_that_is_fast(believed) -> None:
    """Gravity, velocity and the turning of n go on for longer than they did, and the stamps run ahead."""
    fast, start_s = 5e-5, believed.start.time_s
    time_s = start_s + (believed.time_s - start_s) * (1.0 + fast)
    column = Column("", (Measured("delay", -1.0, "t"), Elapsed(1.0)))
    check(replace(believed, time_s=time_s), column, fast, slow={"t": lambda at_s: at_s - start_s})


def test_a_clock_that_jumps(believed) -> None:
    at_s, late_s = 2000.0, 0.05
    fixes = believed.recording.gps
    time_s = fixes.time_s - late_s * (fixes.time_s >= at_s)
    jumped = replace(believed, recording=replace(believed.recording, gps=replace(fixes, time_s=time_s)))
    after = {"after": lambda time_s: (time_s >= at_s - 0.5).astype(float)}
    check(jumped, Column("", (Measured("delay", -1.0, "after"),)), late_s, slow=after)


@pytest.mark.parametrize(("axis", "multiplier", "value"), [("accelerometer", "|f|", 1e-4), ("gyro", "|w|", 1e-4)])
def test_an_error_that_follows_a_magnitude(believed, axis: str, multiplier: str, value: float) -> None:
    errors = {"accelerometer": (believed.velocity, 1), "gyro": (believed.gyro, 2)}
    indicated, k = errors[axis]
    wrong = indicated.copy()
    wrong[:, k] += value * np.abs(indicated[:, k])
    changed = {"accelerometer": {"velocity": wrong}, "gyro": {"gyro": wrong}}[axis]
    check(replace(believed, **changed), Column("", (Drive(axis, k, multiplier, 1.0),)), value)


def test_a_bias_is_taken_off_as_it_is_navigated(believed, monkeypatch) -> None:
    """Solution, states between its steps and drives, these also in blocks, are those without the error."""
    force, rate = np.array([0.0, 30.0 * UG, 0.0]), np.array([1e-6, 0.0, 0.0])
    interval_s = _interval_s(believed)[:, None]
    wrong = replace(
        believed,
        velocity=believed.velocity + force * interval_s,
        gyro=believed.gyro + rate * interval_s,
        force_bias=force,
        gyro_bias=rate,
    )
    without = _modelled(believed)
    monkeypatch.setattr(drives, "BLOCK", ARC_SAMPLES)
    with_it = _modelled(wrong)
    for name in ("velocity_n", "mat_nb"):
        np.testing.assert_allclose(getattr(with_it.states, name), getattr(without.states, name), atol=1e-6)
    np.testing.assert_allclose(with_it.integrals, without.integrals, rtol=1e-6, atol=1e-6)


def _modelled(believed: null.Believed) -> propagation.ErrorModel:
    solution = null.solve(believed)
    end_s = solution[-1].time_s[-1]
    nodes_s = observations.nodes(believed, observations.sources(believed, end_s), end_s)
    return propagation.build(believed, solution, nodes_s)


def _interval_s(believed: null.Believed) -> np.ndarray:
    return np.diff(believed.time_s, prepend=believed.start.time_s)


def test_what_stands_shows_no_heading_where_the_earth_is_not_believed_to_turn(recording_at_rest) -> None:
    """Nothing at rest changes with a turn about the vertical, wherever its tilts and biases were taken to be."""
    parked = recording_at_rest(STOOD_S, 3, np.zeros_like)
    interval_s = np.diff(parked.imu.time_s, prepend=0.0)[:, None]
    tilting = BIAS_UG * UG * np.array([1.0, -1.0, 1.0]) * interval_s
    recording = replace(
        parked,
        imu=replace(parked.imu, accelerometer=parked.imu.accelerometer + tilting),
        belief=parked.belief.model_copy(update={"earth": EarthBelief(rotation=False)}),
    )
    case = cases.prepare(recording)
    normal = case.whitened([], np.zeros(len(case.noise.free))).normal
    covariance = np.linalg.inv(np.eye(len(normal)) + normal)
    heading = next(k for k, one in enumerate(case.nuisances) if one.name == "start attitude D")
    assert covariance[heading, heading] == pytest.approx(1.0, abs=NOTHING_SHOWN)  # that of the prior
