"""Errors of first order: the Schuler oscillation in closed form, and the mechanization itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ins_eval.earth import EARTH_RATE, gravity, radii
from ins_eval.error_dynamics import DRIVES, STATES, Steps, advance, steps_of
from ins_eval.imu import Mission
from ins_eval.profile import load
from ins_eval.strapdown import navigate
from ins_eval.units import ARCSEC, DEG_PER_H, UG

EQUATOR = """\
name = "equator"
kind = "static"
duration_s = 6000.0
[start]
latitude_deg = 0.0
longitude_deg = 10.0
height_m = 0.0
heading_deg = 0.0
stand_s = 0.0
[thermal]
self_heating_c = 0.0
"""
SECOND_ORDER = 2e-3  # of an error of some kilometres, and of steps of a second
DAMPING = 0.05  # the mechanization damps a height with that at the start of its steps, 2 % of the time that it takes


def propagated(steps: Steps, drives: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Errors (n, 10) of one flight at the end of each step, of drives (n, 7)."""
    x, scratch = start.reshape(STATES, 1).copy(), np.empty((STATES, 1))
    found = []
    for k, u in enumerate(drives):
        advance(x, u.reshape(DRIVES, 1), steps.transition[k], steps.drive[k], scratch)
        found.append(x[:, 0].copy())
    return np.array(found)


def test_a_bias_makes_a_schuler_oscillation(tmp_path: Path) -> None:
    """dr = b / w^2 (1 - cos w t), w^2 = g / R, at rest on the equator; the Earth's turning couples by (W / w)^2."""
    path = tmp_path / "equator.toml"
    path.write_text(EQUATOR)
    mission = Mission(load(path), 1.0)
    steps = steps_of(mission.trajectory, mission.increments, 1)
    bias = 100.0 * UG
    drives = np.zeros((steps.time_s.size, DRIVES))
    drives[:, 0] = bias * steps.step_s
    meridian, _ = radii(0.0)
    north_m = meridian * propagated(steps, drives, np.zeros(STATES))[:, 0]
    square = gravity(0.0, 0.0) / meridian
    expected = bias / square * (1.0 - np.cos(np.sqrt(square) * steps.time_s))
    coupling = EARTH_RATE**2 / square
    assert np.abs(north_m - expected).max() < 4.0 * coupling * expected.max()


def test_errors_are_those_of_the_mechanization() -> None:
    """Offsets of gyros and accelerometers, a turned start and a wrong height aid, on the paper's flight."""
    mission = Mission(load("climb-cruise-landing"), 10.0)
    true, moving = mission.increments, mission.increments.time_s > 1e-6
    bias, drift = UG * np.array([60.0, -40.0, 80.0]), DEG_PER_H * np.array([0.01, -0.02, 0.015])
    turned, aid_m = ARCSEC * np.array([10.0, -15.0, 60.0]), 5.0
    start = mission.start(0.0, aligned=True)
    off = replace(start, attitude_rad=tuple(np.array(start.attitude_rad) + _euler(start.attitude_rad, turned)))
    time_s, dtheta, dv = true.time_s[moving], true.dtheta_b[moving], true.dv_b[moving]
    height = mission.height_m[moving]
    ideal = navigate(time_s, dtheta, dv, start, height, every=5)
    flown = navigate(time_s, dtheta + 0.1 * drift, dv + 0.1 * bias, off, height + aid_m, every=5)

    steps = steps_of(mission.trajectory, true, 10)
    steps = steps[np.searchsorted(steps.time_s, 1e-6) :]
    drives = np.empty((steps.time_s.size, DRIVES))
    drives[:, :3], drives[:, 3:6], drives[:, 6] = steps.mat_nb @ bias, steps.mat_nb @ drift, aid_m
    x = np.zeros(STATES)
    x[6:9] = turned
    found = propagated(steps, drives, x)[1::2]  # every 2 s, as the solutions
    expected = np.column_stack(
        [
            flown.latitude_rad - ideal.latitude_rad,
            flown.longitude_rad - ideal.longitude_rad,
            flown.height_m - ideal.height_m,
            flown.velocity_n - ideal.velocity_n,
        ]
    )[1:]
    for column in range(6):
        largest = np.abs(expected[:, column]).max()
        tolerance = DAMPING if column in (2, 5) else SECOND_ORDER
        assert np.abs(found[:, column] - expected[:, column]).max() < tolerance * largest, column


def _euler(attitude_rad, phi: np.ndarray) -> np.ndarray:
    """Change of roll, pitch and heading that turns C by exp(phi x), for a level vehicle."""
    _, _, heading = attitude_rad
    c, s = np.cos(heading), np.sin(heading)
    return np.array([c * phi[0] + s * phi[1], -s * phi[0] + c * phi[1], phi[2]])


def test_a_step_is_the_same_whatever_else_is_in_the_block() -> None:
    mission = Mission(load("climb-cruise-landing"), 1.0)
    steps = steps_of(mission.trajectory, mission.increments, 1)[:50]
    rng = np.random.default_rng(1)
    x, u = rng.normal(size=(STATES, 9)), rng.normal(size=(DRIVES, 9))
    alone, scratch = x[:, 4:5].copy(), np.empty((STATES, 9))
    advance(x, u, steps.transition[7], steps.drive[7], scratch)
    advance(alone, np.ascontiguousarray(u[:, 4:5]), steps.transition[7], steps.drive[7], np.empty((STATES, 1)))
    assert alone[:, 0] == pytest.approx(x[:, 4], rel=1e-12)
