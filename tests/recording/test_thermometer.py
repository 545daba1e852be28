"""A thermometer that is cut off for a while: its readings there, and those that are temperatures."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.recording import Imu
from ins_eval.recording.thermometer import without_faults

TIME_S = np.arange(1.0, 2001.0)
WARMS_C = 22.0 + 30.0 * (1.0 - np.exp(-TIME_S / 600.0))
CUT_OFF_C, SWITCHED_ON_C = -127.0, 85.0  # of the data sheet of the DS18B20
LEFT_C = 0.6  # of a straight line: it sags by 30 degC / 600 s^2 x (120 s)^2 / 8; held for 10 s, 30 degC x 10 s / 600 s


def samples(temperature_c: np.ndarray) -> Imu:
    nothing = np.zeros((TIME_S.size, 3))
    return Imu(TIME_S, nothing, nothing, "increment", temperature_c)


def test_readings_of_a_thermometer_that_is_cut_off_are_left_out() -> None:
    seen = WARMS_C.copy()
    seen[500:560], seen[700:820], seen[:10] = CUT_OFF_C, SWITCHED_ON_C, SWITCHED_ON_C
    left, (said,) = without_faults(samples(seen))
    np.testing.assert_allclose(left.temperature_c, WARMS_C, atol=LEFT_C)
    assert said.startswith("Warning: 190 readings of temperature_c jump away by more than 20 degC")
    assert "the first of 85 degC at 1 s and the last at 820 s" in said


def test_each_axis_has_a_thermometer_of_its_own() -> None:
    seen = np.column_stack([WARMS_C] * 3)
    seen[500:620, 1] = CUT_OFF_C
    left, (said,) = without_faults(samples(seen))
    np.testing.assert_allclose(left.temperature_c[:, 1], WARMS_C, atol=LEFT_C)
    assert np.array_equal(left.temperature_c[:, [0, 2]], seen[:, [0, 2]]) and "temperature_y_c" in said


@pytest.mark.parametrize(
    "seen",
    [
        WARMS_C,
        np.where(TIME_S < 1000.0, WARMS_C, WARMS_C + 40.0),  # another thermometer from then on
        np.where(TIME_S == 1000.0, SWITCHED_ON_C, WARMS_C),  # a single outlier, which is refused
        np.where(TIME_S < 1000.0, np.nan, WARMS_C),
        np.where(abs(TIME_S - 1000.0) < 700.0, CUT_OFF_C, WARMS_C),  # which of the two is right nobody knows
    ],
)
def test_what_may_be_a_temperature_stays(seen: np.ndarray) -> None:
    whole = samples(seen)
    assert without_faults(whole) == (whole, [])
