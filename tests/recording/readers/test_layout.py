"""Units and axes: vectors turned by hand, and names that are not known."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.errors import UsageError
from ins_eval.readers.layout import ACCELEROMETER_UNITS, GYRO_UNITS, Layout, frd_from

IN_FILE = np.array([1.0, 2.0, 3.0])  # what the file holds in x, y, z
EXACT = 1e-15


@pytest.mark.parametrize(
    ("axes", "forward_right_down"),
    [
        ("FRD", (1, 2, 3)),
        ("frd", (1, 2, 3)),
        ("RFU", (2, 1, -3)),  # x is right, y is forward, z is up
        ("FLU", (1, -2, -3)),
        ("LBU", (-2, -1, -3)),
        ("BRU", (-1, 2, -3)),
        ("UFL", (2, -3, -1)),
        ("DFR", (2, 3, 1)),
        ("x=y,y=x,z=-z", (2, 1, -3)),
        ("x = +x, z = -z, y = -y", (1, -2, -3)),
        ("x=-z,y=-y,z=-x", (-3, -2, -1)),
    ],
)
def test_a_vector_of_the_file_becomes_forward_right_down(axes, forward_right_down):
    np.testing.assert_array_equal(frd_from(axes) @ IN_FILE, forward_right_down)


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        ("FRU", "left-handed"),
        ("x=y,y=x,z=z", "left-handed"),
        ("FRF", "one direction twice"),
        ("FBD", "one direction twice"),
        ("x=y,y=y,z=z", "one direction twice"),
        ("FR", "expected three letters"),
        ("XYZ", "expected three letters"),
        ("", "expected three letters"),
        ("x=y,y=x", "expected one equation for each"),
        ("x=y,x=x,z=z", "expected one equation for each"),
        ("x=2y,y=x,z=z", "expected one equation for each"),
    ],
)
def test_axes_that_are_no_axes(axes, said):
    with pytest.raises(UsageError, match=said):
        frd_from(axes)


@pytest.mark.parametrize(
    ("units", "name", "form", "value", "si"),
    [
        (GYRO_UNITS, "deg/s", "rate", 180.0, np.pi),
        (GYRO_UNITS, "deg/h", "rate", 648000.0, np.pi),
        (GYRO_UNITS, "arcsec", "increment", 648000.0, np.pi),
        (GYRO_UNITS, "deg", "increment", 180.0, np.pi),
        (ACCELEROMETER_UNITS, "g", "rate", 2.0, 19.6133),
        (ACCELEROMETER_UNITS, "milli-g", "rate", 2000.0, 19.6133),
        (ACCELEROMETER_UNITS, "g s", "increment", 2.0, 19.6133),
        (ACCELEROMETER_UNITS, "m/s", "increment", 2.0, 2.0),
    ],
)
def test_units(units, name, form, value, si):
    assert units[name][0] == form
    assert units[name][1] * value == pytest.approx(si, rel=10 * EXACT)


@pytest.mark.parametrize(
    ("key", "value", "meant"),
    [
        ("gyro.unit", "degs/s", "deg/s"),
        ("accelerometer.unit", "m/s2", "m/s^2"),
        ("gaps", "bridged", "bridge"),
        ("stamps", "dropp", "drop"),
    ],
)
def test_a_name_that_is_not_known_is_answered_by_the_nearest(key, value, meant):
    with pytest.raises(UsageError, match=f"did you mean '{meant.replace('^', '.')}'"):
        Layout("rad/s", "m/s^2").overridden({key: value})


def test_notes_say_on_whose_word():
    notes = "\n".join(
        Layout("deg/s", "g", "RFU").overridden({"axes": "FLU"}).notes({"axes": "FLU"}, "the mapping says so")
    )
    assert "rates in deg/s, because the mapping says so" in notes
    assert "FLU and were turned to forward-right-down, because you assume so" in notes
