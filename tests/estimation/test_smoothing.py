"""A receiver that smooths its velocity: what it leaves out of sines, and a drive in which it is late.

Its filter is scipy's, of first order.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmark.worlds.grades import a_recording, cut
from ins_eval.believed import believed
from ins_eval.diagnosis.answer.judge import judge
from ins_eval.diagnosis.answer.summary import turned_on
from ins_eval.error_model.observations import REMEMBERED_S, SMOOTHED_S, smoothing
from ins_eval.estimation.case import prepare
from ins_eval.recording import form

TIME_S = np.arange(0.0, 60.0, 0.05)
ROUNDING = 1e-12
SUMMED = 0.01  # of an amplitude of 1: a straight line between instants, and a sum for an integral
RATE_HZ, LENGTH_S = 25.0, 700.0
FORGETS = np.exp(-1.0)  # of a fix a second before: a filter of first order with a time constant of 1 s
SIGMAS = 4.0
IN_PHASE = 0.15  # of what is left out: the other columns have a part of it


def left_out(velocity: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """Of one component of velocity (n,) at each instant, (n, 5)."""
    return smoothing(
        SimpleNamespace(
            time_s=TIME_S,
            velocity_n=np.column_stack([velocity] * 3),
            acceleration_n=np.column_stack([acceleration] * 3),
        )
    )[:, :, 3]


def test_nothing_is_left_out_of_a_steady_acceleration() -> None:
    assert left_out(3.0 + 0.5 * TIME_S, np.full(TIME_S.size, 0.5)) == pytest.approx(0.0, abs=ROUNDING * 60.0)


def test_of_a_sine_is_left_out_what_filters_leave_of_it() -> None:
    """Of sin(w t) a mean of two instants h apart from t leaves (1 - cos(w h)) sin(w t); a filter of first order has
    the response 1 / (1 + i w m), and is late by m."""
    w = 0.4
    inside = slice(-round(15.0 / 0.05), -round(3.0 / 0.05))
    wave = np.exp(1j * w * TIME_S)
    of_means = [1.0 - np.cos(w * h) for h in SMOOTHED_S]
    of_memories = [1.0 - 1.0 / (1.0 + 1j * w * m) - 1j * w * m for m in REMEMBERED_S]
    expected = np.outer(wave, [*of_means, *of_memories]).imag
    np.testing.assert_allclose(left_out(wave.imag, w * wave.real)[inside], expected[inside], atol=SUMMED)


def test_a_receiver_that_smooths_its_velocity_is_late_and_no_sensor_is_off(tmp_path) -> None:
    """It is late by the mean of its filter; what that leaves out of curves was scale factors of ten sigma.

    The page says what was left out of a sine: of one that is in phase with it 1 - Re H, H the filter's response.
    """
    made = a_recording(np.random.default_rng([0, 4]), "industrial", "drive", RATE_HZ)
    cut(made, 0.0, LENGTH_S)
    made.save(tmp_path / "recording")
    recording = form.read(tmp_path / "recording")
    velocity_n = recording.gps.velocity_n
    smooth = velocity_n[0] + lfilter([1.0 - FORGETS], [1.0, -FORGETS], velocity_n - velocity_n[0], axis=0)
    assert np.diff(recording.gps.time_s) == pytest.approx(1.0, abs=1e-6)
    found = judge([prepare(believed(replace(recording, gps=replace(recording.gps, velocity_n=smooth))))])
    (late,) = found.effects
    assert late.hypothesis.candidate.name == "gps.time_offset"
    assert late.value == pytest.approx(FORGETS / (1.0 - FORGETS), abs=SIGMAS * late.sigma)
    shares = np.array([one.found for one in turned_on(found, 0) if one.name.startswith("velocities")])
    w = 1.0
    of_means = [1.0 - np.cos(w * h) for h in SMOOTHED_S]
    of_memories = [1.0 - (1.0 / (1.0 + 1j * w * m)).real for m in REMEMBERED_S]
    response = (1.0 - FORGETS) / (1.0 - FORGETS * np.exp(-1j * w))
    assert shares @ [*of_means, *of_memories] == pytest.approx(1.0 - response.real, rel=IN_PHASE)
