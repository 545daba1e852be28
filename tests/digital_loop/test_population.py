"""The population: what it is drawn from, the same digits however it is computed, and its summary."""

import numpy as np
import pytest

from ins_eval.digital_loop import PARTS, load, population
from ins_eval.digital_loop.population import ProcedurePlan, draw, per_unit, run, summary
from ins_eval.streams import Streams

SIZE = 12
WARM_UP_C = 2.0


@pytest.fixture(scope="module")
def members():
    return run(ProcedurePlan(seed=3), SIZE, workers=2)


def test_coefficients_are_drawn_as_the_file_says():
    units, loop = 400, load()
    drawn = [draw(Streams(1), i, loop) for i in range(units)]
    for quantity, sigmas in (
        ("temperature_ppm_per_c", loop.parameters.temperature_coefficient_sigma),
        ("ageing_ppm_per_year", loop.parameters.ageing_sigma),
    ):
        for part in PARTS:
            values = np.array([getattr(unit, quantity)[part] for unit in drawn])
            sigma = getattr(sigmas, part).value
            assert values.std() == pytest.approx(sigma, rel=4.0 / np.sqrt(2.0 * units))
            assert abs(values.mean()) <= 4.0 * sigma / np.sqrt(units)


def test_a_new_part_moves_no_other_draw():
    unit = draw(Streams(1), 5)
    assert unit.temperature_ppm_per_c["magnet"] == draw(Streams(1), 5, load()).temperature_ppm_per_c["magnet"]
    expected = 20.0 * Streams(1).at("unit", 5, "temperature", "magnet").rng().standard_normal()
    assert unit.temperature_ppm_per_c["magnet"] == expected


def test_the_paper_unit_is_one_unit():
    first, other = (draw(Streams(seed), seed, load("paper-unit")) for seed in (1, 2))
    assert first.temperature_ppm_per_c == other.temperature_ppm_per_c
    assert first.temperature_ppm_per_c["bridge_amplifier"] == 9.75


def test_same_digits_whatever_the_number_of_workers(members):
    again = run(ProcedurePlan(seed=3), 3, workers=1)
    for one, other in zip(members, again, strict=False):
        for size in one:
            for key, values in one[size].items():
                np.testing.assert_array_equal(values, other[size][key])


def test_shifts_of_each_unit_are_those_of_its_coefficients(members):
    """Sum of the coefficients of the parts that the scan sees, times how much warmer it was."""
    found = per_unit(members, 200.0)
    warmer_c = found["temperature_c"][:, 1] - found["temperature_c"][:, 0]
    for i in range(SIZE):
        c = draw(Streams(3).at("digital loop"), i).temperature_ppm_per_c
        scan = c["carrier_reference"] + c["carrier_amplifier"] + c["bridge_amplifier"] - c["adc_reference"]
        scan += 0.5 * (c["reference_capacitor_2"] - c["reference_capacitor_1"])
        current = c["dac_reference"] - c["sampling_resistor"] - c["reference_current"]
        assert found["forward_shift_ppm"][i] == pytest.approx(scan * warmer_c[i], abs=1.2)
        assert found["feedback_shift_ppm"][i] == pytest.approx(current * warmer_c[i], abs=1.2)


def test_summary_counts_units_and_says_how_the_shift_behaves(members):
    found = summary(members, 3)
    assert found["units"] == SIZE
    assert found["injected_ppm"] == [200.0, 1000.0]
    low, high = found["forward_shift_ppm"]["interval95"]
    assert low < 0.0 < high  # either sign
    growth = found["shift_grows_ppm"]["1000"]
    for channel in ("forward", "feedback"):
        assert abs(growth[channel]["value"]) < 0.1  # a share would have grown by four times the shift
    assert abs(found["closure_ug"]["value"]) < 3.0
    assert found["warm_up_c"]["value"] == pytest.approx(WARM_UP_C, abs=0.3)
    assert found == summary(members, 3)
    assert found["mean_forward_shift_ppm"]["value"] == pytest.approx(
        per_unit(members, 200.0)["forward_shift_ppm"].mean()
    )


def test_residuals_of_the_summary_are_recomputed_by_hand(members):
    shifts = np.array([m["200"]["feedback_shift_ppm"].mean() for m in members])
    assert summary(members, 1)["feedback_residual_percent"]["value"] == pytest.approx(
        np.median(np.abs(shifts)) / 2.0, rel=1e-12
    )


@pytest.mark.slow
def test_the_paper_lies_within_the_population():
    """200 units: the printed shifts, change and remainder are ordinary, and half the units err the other way."""
    found = summary(run(population.PLAN, population.SIZE), 1)
    printed = {"forward_shift_ppm": 19.47, "feedback_shift_ppm": 18.15, "change_ug": -193.0, "remaining_ug": 24.0}
    for key, value in printed.items():
        low, high = found[key]["interval95"]
        assert low < value < high
    for channel in ("forward", "feedback"):
        low, high = found[f"{channel}_share_positive"]["interval95"]
        assert 0.35 < low < high < 0.65
