"""What a model is expected to gain, against flights that are flown with the errors it holds possible."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval import metrics
from ins_eval.analysis.predict import EVERY, planned, predict_flight
from ins_eval.effects import without_effects
from ins_eval.errors import UsageError
from ins_eval.navigation import beginning, evaluate
from ins_eval.recording.belief import NAVIGATION_GRADE, EffectBelief

ROOT = np.array([[3.0, 0.0, 0.0], [20.0, 30.0, 0.0], [0.002, 0.0, 0.005]])  # ug/degC, ug, deg/h
VALUES = (4.0, -30.0, 0.01)
NAMES = (("accelerometer.bias_temperature", "x"), ("accelerometer.bias", "y"), ("gyro.bias", "y"))
LINEAR = 0.02  # what draws and second order leave of a mean square


def effects(values, root=None) -> tuple[EffectBelief, ...]:
    rows = [None] * 3 if root is None else [tuple(row[: k + 1]) for k, row in enumerate(root)]
    return tuple(
        EffectBelief(name=name, axis=axis, value=float(value), root=row)
        for (name, axis), value, row in zip(NAMES, values, rows, strict=True)
    )


@pytest.fixture(scope="module")
def flight():
    return planned("straight", NAVIGATION_GRADE)


def flown(flight, values) -> float:
    """Velocity RMS of an instrument with these errors: they are put on with the opposite sign of taking them off."""
    velocity = flight.imu.accelerometer
    begin = beginning(flight, velocity)

    def navigated(of) -> np.ndarray:
        with_them = replace(flight, belief=flight.belief.model_copy(update={"effects": of}))
        return evaluate(*without_effects(with_them, velocity), begin, every=EVERY).solution.velocity_n[:, :2]

    return float(metrics.root_mean_square(np.hypot(*(navigated(effects(-np.array(values))) - navigated(())).T)))


def test_the_prediction_is_what_flights_with_such_errors_show(flight) -> None:
    """The mean square over instruments is that of the mean error and of one flight along each column of the root."""
    found = predict_flight(NAVIGATION_GRADE.model_copy(update={"effects": effects(VALUES, ROOT)}), flight).draws
    squares = [flown(flight, column) ** 2 for column in ROOT.T]
    assert np.mean(found["own_after"] ** 2) == pytest.approx(sum(squares), rel=3 * LINEAR)
    assert np.mean(found["own_before"] ** 2) == pytest.approx(flown(flight, VALUES) ** 2 + sum(squares), rel=3 * LINEAR)
    assert (found["with_switch_on_after"] > 0.0).all()
    assert np.median(found["with_switch_on_after"]) > np.median(found["own_after"])


def test_a_model_without_covariance_is_refused(flight) -> None:
    with pytest.raises(UsageError, match="write it anew"):
        predict_flight(NAVIGATION_GRADE.model_copy(update={"effects": effects(VALUES)}), flight)
