"""From rows to increments: the trapezoid, the first row, gaps, stamps that repeat, values that are not numbers."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.errors import DataRefused
from ins_eval.recording.readers.layout import Layout
from ins_eval.recording.readers.sampling import Readings, sampled

RATES, INCREMENTS = Layout("rad/s", "m/s^2"), Layout("rad", "m/s")
STEP_S = 0.01
ROUNDING = 1e-12


def rows(time_s: np.ndarray, **scalars) -> Readings:
    """A rate that grows by 1 rad/s^2 about x and a specific force of 9.8 m/s^2 upwards."""
    gyro = np.column_stack([time_s, 0 * time_s, 0 * time_s])
    return Readings(time_s, gyro, np.tile([0.0, 0.0, -9.8], (len(time_s), 1)), scalars)


def even(n: int) -> np.ndarray:
    return 5.0 + STEP_S * np.arange(n)


def test_rates_are_integrated_by_the_trapezoid():
    """The integral of t over a step is (t1^2 - t0^2) / 2, and the trapezoid has it exactly."""
    time_s = np.array([5.0, 5.01, 5.022, 5.03])
    found = sampled(rows(time_s), RATES, "file")
    assert found.start_s == 5.0
    np.testing.assert_array_equal(found.imu.time_s, time_s[1:])
    np.testing.assert_allclose(found.imu.gyro[:, 0], 0.5 * np.diff(time_s**2), rtol=ROUNDING)
    np.testing.assert_allclose(found.imu.accelerometer[:, 2], -9.8 * np.diff(time_s), rtol=ROUNDING)
    assert found.imu.accelerometer_form == "increment"
    assert "trapezoidal rule" in found.notes[-1]


def test_increments_are_kept_and_the_first_covers_a_step_before_its_stamp():
    found = sampled(rows(even(4)), INCREMENTS, "file")
    assert found.start_s == pytest.approx(5.0 - STEP_S, abs=ROUNDING)
    np.testing.assert_array_equal(found.imu.gyro[:, 0], even(4))
    assert found.notes == ()


def test_one_sensor_in_rates_and_the_other_in_increments():
    found = sampled(rows(even(4)), Layout("rad", "m/s^2"), "file")
    np.testing.assert_array_equal(found.imu.gyro[:, 0], even(4)[1:])
    np.testing.assert_allclose(found.imu.accelerometer[:, 2], [-9.8 * STEP_S] * 3, rtol=1e-9)


def test_other_columns_stay_beside_their_rows():
    time_s = even(5)
    found = sampled(
        rows(time_s, temperature_c=20.0 + time_s, height_baro_m=time_s, supply_v=2.0 * time_s), RATES, "file"
    )
    np.testing.assert_array_equal(found.imu.temperature_c, 20.0 + time_s[1:])
    np.testing.assert_array_equal(found.imu.height_baro_m, time_s[1:])
    np.testing.assert_array_equal(found.imu.further["supply_v"], 2.0 * time_s[1:])


def without(n: int, first: int, lost: int) -> np.ndarray:
    return np.delete(even(n), range(first, first + lost))


def test_a_short_gap_is_bridged_and_the_integral_stays():
    time_s = without(100, 50, 3)
    found = sampled(rows(time_s), RATES, "file")
    assert len(found.imu.time_s) == 99
    np.testing.assert_allclose(np.diff(found.imu.time_s), STEP_S, rtol=1e-9)
    assert found.imu.gyro[:, 0].sum() == pytest.approx(0.5 * (time_s[-1] ** 2 - time_s[0] ** 2), rel=ROUNDING)
    assert "3 samples on straight lines were put in, not measured ones" in "\n".join(found.notes)


def test_bridged_increments_lie_on_a_straight_line():
    found = sampled(rows(without(100, 50, 2)), INCREMENTS, "file")
    np.testing.assert_allclose(found.imu.gyro[:, 0], even(100), rtol=1e-9)


def test_a_long_gap_is_refused_with_both_ways_out():
    with pytest.raises(DataRefused) as refused:
        sampled(rows(without(100, 30, 20)), RATES, "FILE")
    message = str(refused.value)
    for said in ("FILE: 1 gap in time, the longest 0.21 s after 5.29 s", "expected steps of 0.01 s"):
        assert said in message
    assert "--assume gaps=longest keeps the longest part without, 5.5 to 5.99 s" in message
    assert "--assume gaps=bridge" in message


def test_a_long_gap_cut_or_bridged_as_assumed():
    time_s = without(100, 30, 20)
    longest = sampled(rows(time_s), RATES.overridden({"gaps": "longest"}), "file")
    assert longest.start_s == pytest.approx(5.5)
    assert "30 rows were left out" in longest.notes[0]
    bridged = sampled(rows(time_s), RATES.overridden({"gaps": "bridge"}), "file")
    assert (bridged.start_s, len(bridged.imu.time_s)) == (5.0, 99)


def test_no_more_is_made_up_than_was_recorded():
    time_s = np.concatenate([even(50), even(50) + 1000.0])
    with pytest.raises(DataRefused, match="FILE: 999[0-9]{2} rows are missing and 100 are there"):
        sampled(rows(time_s), RATES.overridden({"gaps": "bridge"}), "FILE")


@pytest.mark.parametrize(("shift_s", "how"), [(-STEP_S, "repeats"), (-0.5, "goes back")])
def test_time_that_does_not_go_on_is_refused_or_dropped(shift_s, how):
    time_s = even(100)
    time_s[60:] += shift_s
    with pytest.raises(DataRefused, match=rf"FILE, row 61: time {how} .*--assume stamps=drop"):
        sampled(rows(time_s), RATES, "FILE")
    found = sampled(rows(time_s), RATES.overridden({"stamps": "drop"}), "FILE")
    assert (np.diff(found.imu.time_s) > 0.0).all()
    assert "because you assume stamps=drop" in found.notes[0]


@pytest.mark.parametrize("column", ["time_s", "gyro", "accelerometer", "temperature_c"])
@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300])
def test_a_value_that_is_not_finite_is_refused_with_its_row(column, bad):
    readings = rows(even(20), temperature_c=np.zeros(20))
    values = readings.scalars[column] if column == "temperature_c" else getattr(readings, column)
    values[7] = bad
    with pytest.raises(DataRefused, match="FILE: .* is no finite sensor value in 1 rows, first in row 8"):
        sampled(readings, RATES, "FILE")


def test_too_few_rows_and_a_wild_time():
    with pytest.raises(DataRefused, match="2 rows, expected at least three"):
        sampled(rows(even(2)), RATES, "file")
    with pytest.raises(DataRefused, match="check the unit of the time column"):
        sampled(rows(1e12 * even(20)), RATES, "file")
