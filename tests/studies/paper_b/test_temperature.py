"""The arms of the temperature calibration: exact tests of exact parts leave nothing, another unit's lines do."""

import numpy as np
import pytest

from ins_eval.calibration.loop_gains import Gain
from ins_eval.calibration.loop_temperature import TemperatureLine
from ins_eval.digital_loop import chamber, population
from ins_eval.studies.paper_b import temperature

CODE = 524288
COEFFICIENT = {"gain": 12.0, "current_step": 9.0, "output": -25.0}  # ppm/degC


def line(ppm_per_c: float, reading: float) -> TemperatureLine:
    return TemperatureLine(22.0, reading, Gain(ppm_per_c, 0.0, ppm_per_c, ppm_per_c))


def invented() -> tuple[dict, np.ndarray, dict]:
    """Tests of a unit that drifts by -200 and +200 ppm and otherwise by temperature alone, without noise."""
    at_c = np.array([[22.0, 22.5], [24.0, 42.0]])
    warm = {name: 1.0 + 1e-6 * c * (at_c - 22.0) for name, c in COEFFICIENT.items()}
    gain = 479.0 * warm["gain"] * np.array([[1.0], [1.0 - 200e-6]])
    step = -71738.85 * warm["current_step"] * np.array([[1.0], [1.0 / (1.0 + 200e-6)]])
    found = 1e6 * (step[0] / step[1] - 1.0)
    output = warm["output"][1] / (1.0 + 200e-6) * CODE / np.round(CODE / (1.0 + 1e-6 * found))
    tests = {"gain": gain, "current_step": step, "remaining_ug": 1e6 * (output / warm["output"][0] - 1.0)}
    return tests, at_c, {name: line(c, 1.0) for name, c in COEFFICIENT.items()}


def test_own_coefficients_leave_the_rounding_of_the_code():
    tests, at_c, lines = invented()
    left = temperature.errors(tests, at_c, lines, "tests_and_output", CODE, 200.0)
    assert left["forward_ppm"] == pytest.approx(0.0, abs=1e-6)
    assert left["feedback_ppm"] == pytest.approx(0.0, abs=1e-6)
    assert left["output_ug"] == pytest.approx(0.0, abs=1.0)  # half a step of N_VREF is 0.95 ppm


def test_without_them_the_errors_are_those_of_the_coefficients():
    tests, at_c, lines = invented()
    left = temperature.errors(tests, at_c, lines, "none", CODE, 200.0)
    change_c = at_c[1] - at_c[0]
    assert left["forward_ppm"] == pytest.approx(12.0 * change_c, rel=1e-3)
    assert left["feedback_ppm"] == pytest.approx(-9.0 * change_c, rel=1e-3)
    assert left["output_ug"] == pytest.approx(tests["remaining_ug"])


def test_the_tests_alone_leave_the_output_its_temperature():
    tests, at_c, lines = invented()
    left = temperature.errors(tests, at_c, lines, "tests", CODE, 200.0)["output_ug"]
    assert left == pytest.approx(-25.0 * (at_c[1] - at_c[0]), abs=1.0)


def test_over_a_population_own_coefficients_help_and_another_unit_s_do_not():
    plan, size = population.ProcedurePlan(seed=2), 12
    members, units = population.run(plan, size), chamber.run(plan, size)
    found = temperature.of_temperature(members, units, 200.0, plan.seed)
    for change in ("room", "far"):
        arms = found[change]
        for name in temperature.ERRORS:
            assert arms["none"][f"{name}_ratio"]["interval95"] == [1.0, 1.0]
            assert arms["tests_and_output"][f"{name}_ratio"]["interval95"][1] < 0.3
            assert arms["other_unit"][f"{name}_ratio"]["interval95"][1] > 1.0  # of independent coefficients sqrt(2)
            assert arms["other_unit"][name]["value"] > 4.0 * arms["tests_and_output"][name]["value"]
            assert arms["tests_and_output"][name]["value"] > 0.5 * found["floor"][name]
        assert arms["tests"]["output_ug_ratio"]["value"] == pytest.approx(1.05, abs=0.3)  # the magnet is in neither
