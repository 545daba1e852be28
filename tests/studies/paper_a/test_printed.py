"""The printed numbers, once more by hand, against the one place where each of them stands."""

from __future__ import annotations

import pytest

from ins_eval.published_flight import FLIGHT
from ins_eval.studies.paper_a.printed import GJN096, INS, PRINTED, QA3000, UNITS, coefficients, span_c

EQUATIONS = {  # eqs (15)-(17): alpha, beta, eta, epsilon, mu, gamma
    "JB-KT8 #1": (273.0, 0.1008, -0.02409, 88.14, -32.76, 320320.0),
    "JB-KT8 #2": (102.76, 0.08, -1.4912, 21.01, -49.81, 308000.0),
    "JB-KT8 #3": (49.12, 0.2385, -0.0972, 48.53, -41.14, 328000.0),
}
TABLE_4 = {
    "JB-KT8 #1": (74.14, 12.78, 2.48),
    "JB-KT8 #2": (104.22, 14.14, 4.23),
    "JB-KT8 #3": (105.79, 14.46, 5.19),
}


@pytest.mark.parametrize("unit", UNITS)
def test_units(unit: str) -> None:
    assert tuple(coefficients(unit)) == EQUATIONS[unit]
    assert tuple(PRINTED[unit]["table4"].values()) == TABLE_4[unit]
    assert span_c(unit) == {"JB-KT8 #1": 135.0, "JB-KT8 #2": 134.0, "JB-KT8 #3": 135.0}[unit]


def test_tables_of_velocities_and_cep() -> None:
    assert [PRINTED["table6"][arm] for arm in ("simple", "hysteresis")] == [
        {"east": 0.98, "north": 1.04},
        {"east": 0.74, "north": 0.92},
    ]
    assert [PRINTED["table7"][arm] for arm in ("simple", "hysteresis")] == [
        {"east": 1.36, "north": 1.40},
        {"east": 1.09, "north": 1.19},
    ]
    assert FLIGHT == {
        "table7": {"simple": {"east": 1.36, "north": 1.40}, "hysteresis": {"east": 1.09, "north": 1.19}},
        "cep": {"simple": 1.54, "hysteresis": 1.29},
    }
    assert (PRINTED["cep"]["simple"], PRINTED["cep"]["hysteresis"]) == (1.54, 1.29)


def test_tables_1_and_5() -> None:
    assert (QA3000.bias_temperature_ug_per_c, QA3000.scale_temperature_ppm_per_c) == (15.0, 120.0)
    assert (GJN096.bias_temperature_ug_per_c, GJN096.scale_temperature_ppm_per_c) == (50.0, 50.0)
    assert tuple(dict(INS.accelerometer).values()) == (50.0, 50.0, 30.0, 30.0)
    assert tuple(dict(INS.gyro).values()) == (0.01, 0.01, 20.0, 20.0)
