"""From rows to increments: the trapezoid, the first row, gaps, stamps that repeat, values that are not numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.errors import DataRefused
from ins_eval.readers.layout import Layout
from ins_eval.readers.sampling import Readings, sampled
from ins_eval.readers.stretches import stretches
from ins_eval.recording import Fixes, Imu, Recording, Start

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
    notes = "\n".join(found.notes)
    assert "3 samples on straight lines were put in, not measured ones." in notes
    assert f"{found.imu.filled.sum()} increments rest on samples that were put in" in notes
    assert found.imu.filled.sum() == 4  # a sample is an end of two of them


def test_bridged_increments_lie_on_a_straight_line():
    found = sampled(rows(without(100, 50, 2)), INCREMENTS, "file")
    np.testing.assert_allclose(found.imu.gyro[:, 0], even(100), rtol=1e-9)


LOST = 80  # rows: more than is filled


def test_a_long_gap_is_refused_where_that_is_assumed_with_every_way_out():
    with pytest.raises(DataRefused) as refused:
        sampled(rows(without(200, 30, LOST)), RATES.overridden({"gaps": "refuse"}), "FILE")
    message = str(refused.value)
    for said in ("FILE: 1 gap in time, the longest 0.81 s after 5.29 s", "expected steps of 0.01 s"):
        assert said in message
    assert "--assume gaps=longest keeps the longest part without, 6.1 to 6.99 s" in message
    assert "--assume gaps=bridge" in message and "--assume gaps=cut" in message


def test_a_long_gap_stays_or_is_left_out_or_bridged_as_assumed():
    time_s = without(200, 30, LOST)
    cut = sampled(rows(time_s), RATES, "file")
    np.testing.assert_array_equal(cut.imu.time_s, time_s[1:])
    assert cut.imu.filled is None
    longest = sampled(rows(time_s), RATES.overridden({"gaps": "longest"}), "file")
    assert longest.start_s == pytest.approx(6.1)
    assert "30 rows were left out" in longest.notes[0]
    bridged = sampled(rows(time_s), RATES.overridden({"gaps": "bridge"}), "file")
    assert (bridged.start_s, len(bridged.imu.time_s)) == (5.0, 199)
    filled = sampled(rows(time_s), RATES.overridden({"fill_s": "1.0"}), "file")
    np.testing.assert_array_equal(filled.imu.time_s, bridged.imu.time_s)


def test_filled_samples_are_marked():
    """A rate at a filled stamp enters the samples on both of its sides."""
    found = sampled(rows(without(100, 50, 2)), RATES, "file")
    np.testing.assert_array_equal(np.flatnonzero(found.imu.filled), [49, 50, 51])
    found = sampled(rows(without(100, 50, 2)), INCREMENTS, "file")
    np.testing.assert_array_equal(np.flatnonzero(found.imu.filled), [50, 51])
    assert sampled(rows(even(100)), RATES, "file").imu.filled is None


@pytest.mark.parametrize("column", ["gyro", "accelerometer"])
def test_a_row_without_a_number_counts_as_missing(column):
    readings = rows(even(100))
    getattr(readings, column)[50, 1] = np.nan
    found = sampled(readings, RATES, "FILE")
    assert found.imu.filled.sum() == 2
    np.testing.assert_allclose(found.imu.gyro[:, 0], 0.5 * np.diff(even(100) ** 2), rtol=1e-9)
    assert "1 rows hold no number for gyro or accelerometer, first row 51" in found.notes[0]


def test_a_temperature_without_a_number_lies_on_a_line():
    readings = rows(even(100), temperature_c=even(100))
    readings.scalars["temperature_c"][40:50] = np.nan
    found = sampled(readings, RATES, "FILE")
    np.testing.assert_allclose(found.imu.temperature_c, even(100)[1:], rtol=1e-12)
    assert found.imu.filled is None
    assert "10 values of temperature_c were no number and lie on straight lines now." in found.notes


def recorded(lost: int, kind: str = "drive") -> Recording:
    """Ten minutes at 10 Hz, a gap after five, and fixes that go north."""
    time_s = np.delete(0.1 * np.arange(1, 6001), range(3000, 3000 + lost))
    n, at_s = len(time_s), np.arange(0.0, 600.0)
    imu = Imu(time_s, np.zeros((n, 3)), np.tile([0.0, 0.0, -0.98], (n, 1)), "increment", further={"supply_v": time_s})
    fixes = Fixes(at_s, 0.5 + 1e-6 * at_s, 0.0 * at_s, 0.0 * at_s, np.tile([6.4, 0.0, 0.0], (600, 1)), at_s >= 0.0)
    start = Start(0.0, 0.5, 0.0, 0.0, attitude_rad=(0.0, 0.0, 1.0))
    return Recording("log", kind, start, imu, gps=fixes)


def test_a_long_gap_cuts_a_recording_into_stretches():
    one, two = stretches(recorded(200))
    assert (one.name, two.name) == ("log-1", "log-2")
    assert (one.start.time_s, one.imu.time_s[-1]) == (0.0, pytest.approx(300.0))
    assert two.start.time_s == pytest.approx(320.1)
    assert two.imu.time_s[0] == pytest.approx(320.2)
    np.testing.assert_array_equal(two.imu.further["supply_v"], two.imu.time_s)
    assert two.start.latitude_rad == pytest.approx(0.5 + 320e-6)
    assert two.start.attitude_rad is None and one.start.attitude_rad is not None
    assert two.gps.time_s[0] >= 319.0 and one.gps.time_s[-1] <= 301.0
    assert "this is stretch 2 of 2" in two.notes[-1]
    parked = stretches(recorded(200, "static"))[1]
    assert parked.start.attitude_rad == (0.0, 0.0, 1.0)


def test_a_recording_without_gaps_or_of_crumbs():
    whole = recorded(0)
    assert stretches(whole) == [whole]
    time_s = np.concatenate([100.0 * k + 0.1 * np.arange(50) for k in range(5)])
    imu = Imu(time_s, np.zeros((250, 3)), np.zeros((250, 3)), "increment")
    with pytest.raises(DataRefused, match="no stretch lasts 10 s; --assume gaps=bridge"):
        stretches(replace(whole, imu=imu))


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
@pytest.mark.parametrize("bad", [-np.inf, np.inf, 1e300])
def test_a_value_that_no_sensor_has_is_refused_with_its_row(column, bad):
    readings = rows(even(20), temperature_c=np.zeros(20))
    values = readings.scalars[column] if column == "temperature_c" else getattr(readings, column)
    values[7] = bad
    of = "number of seconds" if column == "time_s" else "sensor value"
    with pytest.raises(DataRefused, match=f"FILE: .* is no finite {of} in 1 rows, first in row 8"):
        sampled(readings, RATES, "FILE")


@pytest.mark.parametrize("stamps", ["refuse", "drop"])
def test_rows_that_run_backwards_are_to_be_sorted(stamps):
    """To leave out what goes back would leave the last sample alone."""
    with pytest.raises(DataRefused, match="FILE, row 2: time goes back .* in 99 of 100 rows.*; sort the rows by their"):
        sampled(rows(even(100)[::-1]), RATES.overridden({"stamps": stamps}), "FILE")


def test_too_few_rows_and_a_wild_time():
    with pytest.raises(DataRefused, match="2 rows, expected at least three"):
        sampled(rows(even(2)), RATES, "file")
    with pytest.raises(DataRefused, match="check the unit of the time column"):
        sampled(rows(1e12 * even(20)), RATES, "file")
