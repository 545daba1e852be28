"""Samples that were filled in: what lines miss of white noise and of a random walk, and a drive with gaps."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from benchmark.worlds.grades import a_recording, cut
from ins_eval.believed import believed
from ins_eval.diagnosis.answer.judge import judge
from ins_eval.estimation.case import prepare
from ins_eval.estimation.missing import filled_in
from ins_eval.recording import form

RATE_HZ, LENGTH_S = 25.0, 450.0
SAMPLES, LONG = 200_000, 32  # of 1 s, and of the run
GAPS = ((200.0, 8.0), (330.0, 5.0), (400.0, 8.0))  # in turns of the drive
STATISTICAL = 0.05


@pytest.mark.parametrize("kind", ["white", "random walk"])
def test_the_variance_of_a_run_is_what_a_straight_line_misses(kind: str) -> None:
    """It is held against lines through another draw; of white noise of sigma 1 it is L^2 (1/L + 1/2)."""
    rates, others = np.random.default_rng(3).normal(size=(2, SAMPLES, 3))
    if kind == "random walk":
        rates, others = np.cumsum(rates, axis=0), np.cumsum(others, axis=0)
    runs = others[: SAMPLES // (LONG + 2) * (LONG + 2)].reshape(-1, LONG + 2, 3)
    missed = (runs[:, 1:-1] - 0.5 * (runs[:, :1] + runs[:, -1:])).sum(axis=1)
    begins = np.arange(1000, SAMPLES - 1000, 1000)
    filled = np.zeros(SAMPLES, dtype=bool)
    filled[begins[:, None] + np.arange(LONG)] = True
    time_s = np.arange(1.0, SAMPLES + 1.0)
    navigated = SimpleNamespace(
        recording=SimpleNamespace(imu=SimpleNamespace(filled=filled, time_s=time_s)),
        time_s=time_s,
        gyro=rates,
        velocity=2.0 * rates,
    )
    nodes_s = np.arange(0.0, SAMPLES + 1.0, 8.0)
    found = filled_in(navigated, nodes_s)
    assert np.flatnonzero(found[:, 1])[:5].tolist() == [125, 126, 127, 128, 250]
    assert found[:, 1].sum() / begins.size == pytest.approx(np.square(missed).mean(), rel=STATISTICAL)
    np.testing.assert_allclose(found[:, 0], 4.0 * found[:, 1])
    if kind == "white":
        assert found[:, 1].sum() / begins.size == pytest.approx(LONG**2 * (1.0 / LONG + 0.5), rel=STATISTICAL)
    handled = np.where(time_s < 0.25 * SAMPLES, 100.0, 1.0)  # an hour before, it was carried about
    navigated.gyro = handled[:, None] * rates
    np.testing.assert_allclose(filled_in(navigated, nodes_s)[-SAMPLES // 16 :, 1], found[-SAMPLES // 16 :, 1])
    navigated.recording.imu.filled = None
    assert not filled_in(navigated, nodes_s).any()


def test_samples_that_were_filled_in_are_not_measured(tmp_path) -> None:
    """A drive without an error, of which turns were lost: nothing is found, and without the mark that is found."""
    made = a_recording(np.random.default_rng([0, 4]), "industrial", "drive", RATE_HZ)
    cut(made, 0.0, LENGTH_S)
    made.save(tmp_path / "recording")
    recording = form.read(tmp_path / "recording")
    imu = recording.imu
    lost = np.any([(imu.time_s > at_s) & (imu.time_s < at_s + lasts_s) for at_s, lasts_s in GAPS], axis=0)

    def on_lines(values: np.ndarray) -> np.ndarray:
        return np.column_stack([np.interp(imu.time_s, imu.time_s[~lost], column[~lost]) for column in values.T])

    bridged = replace(imu, gyro=on_lines(imu.gyro), accelerometer=on_lines(imu.accelerometer))
    verdicts = [
        judge([prepare(believed(replace(recording, imu=replace(bridged, filled=mark))))]).verdict
        for mark in (lost, None)
    ]
    assert verdicts == ["no mismatch", "unexplained"]
