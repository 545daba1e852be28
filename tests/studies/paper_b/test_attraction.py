"""What attraction does to the rejected test: the free plate is the control, and more carrier is worse."""

import numpy as np
import pytest

from ins_eval.digital_loop import load
from ins_eval.streams import Streams
from ins_eval.studies.paper_b.attraction import attracted


@pytest.fixture(scope="module")
def found():
    return attracted(load(), [Streams(2).at(k) for k in range(8)])


def test_a_free_plate_is_untouched(found):
    assert found["stiffness_ppm"]["free"] == 0.0
    assert found["added_scatter_ppm"]["free"] == 0.0


def test_a_loaded_plate_is_between_free_and_held(found):
    """s / (2 + s) of the held plate's negative stiffness: a third for C_s = C0."""
    assert found["stiffness_ppm"]["as much as C0"] == pytest.approx(found["stiffness_ppm"]["held"] / 3.0)
    assert 0.0 < found["gain_ppm"]["as much as C0"]["value"] < found["gain_ppm"]["held"]["value"]


def test_stiffness_and_drift_go_with_the_square_of_the_carrier(found):
    ratio = found["drift_ppm"] / found["gain_ppm"]["held"]["value"]
    assert ratio == pytest.approx(2.0 * 200e-6, rel=0.02)
    shape = found["by_carrier"]
    low = np.array(shape["volts"]) < 0.5
    power = np.polyfit(np.log(np.array(shape["volts"])[low]), np.log(np.array(shape["gain_ppm"])[low]), 1)[0]
    assert power == pytest.approx(2.0, abs=0.01)


def test_the_test_is_spoiled_before_the_plate_is_pulled_in(found):
    assert found["carrier_v"] < found["spoiling_v"] < found["excited_v"] < found["pull_in_v"]
    assert max(found["by_carrier"]["volts"]) < 1.02 * found["excited_v"]  # the bias moves the plate a little
