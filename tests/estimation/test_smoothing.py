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
from ins_eval.error_model.observations import SMOOTHED_S, smoothing
from ins_eval.estimation.case import prepare
from ins_eval.recording import form

TIME_S = np.arange(0.0, 60.0)
ROUNDING = 1e-12
RATE_HZ, LENGTH_S = 25.0, 700.0
FORGETS = np.exp(-1.0)  # of a fix a second before: a filter of first order with a time constant of 1 s
SIGMAS = 4.0
IN_PHASE = 0.15  # of what is left out: the other columns have a part of it


def left_out(velocity: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """Of one component of velocity (n,) at each second, (n, 3)."""
    return smoothing(
        SimpleNamespace(
            time_s=TIME_S,
            velocity_n=np.column_stack([velocity] * 3),
            acceleration_n=np.column_stack([acceleration] * 3),
        )
    )[:, :, 3]


def test_nothing_is_left_out_of_a_steady_acceleration() -> None:
    assert left_out(3.0 + 0.5 * TIME_S, np.full(TIME_S.size, 0.5)) == pytest.approx(0.0, abs=ROUNDING * 60.0)


def test_of_a_sine_is_left_out_what_means_leave_of_it() -> None:
    """Of sin(w t) a mean of two instants h apart from t leaves (1 - cos(w h)) sin(w t)."""
    w, (near_s, far_s) = 0.7, SMOOTHED_S
    inside = slice(round(far_s), -round(far_s))
    sine, cosine = np.sin(w * TIME_S), np.cos(w * TIME_S)
    skew = np.sin(w * far_s) - far_s / near_s * np.sin(w * near_s)
    expected = np.outer(sine, [1.0 - np.cos(w * near_s), 1.0 - np.cos(w * far_s), 0.0]) + np.outer(cosine, [0, 0, skew])
    np.testing.assert_allclose(left_out(sine, w * cosine)[inside], expected[inside], atol=ROUNDING)


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
    over_near, over_far, _ = (one.found for one in turned_on(found, 0) if one.name.startswith("velocities"))
    w, (near_s, far_s) = 1.0, SMOOTHED_S
    in_phase = over_near * (1.0 - np.cos(w * near_s)) + over_far * (1.0 - np.cos(w * far_s))
    response = (1.0 - FORGETS) / (1.0 - FORGETS * np.exp(-1j * w))
    assert in_phase == pytest.approx(1.0 - response.real, rel=IN_PHASE)
