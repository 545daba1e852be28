"""The procedure: exact where nothing disturbs, and shifts that the temperature coefficients predict."""

import numpy as np
import pytest

from ins_eval.digital_loop import PARTS, bench, load, population
from ins_eval.digital_loop.injector import Injection
from ins_eval.digital_loop.unit import Unit
from ins_eval.streams import Streams

NOTHING = dict.fromkeys(PARTS, 0.0)
SCAN_SIGMA_PPM = 0.6  # of the drift from a pair of scans
CURRENT_SIGMA_PPM = 0.2
BIAS_UG = 3.0
FORWARD_WEIGHTS = {  # what +1 ppm of a part does to the slope of the scan
    "carrier_reference": 1.0,
    "carrier_amplifier": 1.0,
    "bridge_amplifier": 1.0,
    "adc_reference": -1.0,
    "reference_capacitor_1": -0.5,
    "reference_capacitor_2": 0.5,
}
FEEDBACK_WEIGHTS = {"dac_reference": 1.0, "sampling_resistor": -1.0, "reference_current": -1.0}
OUTPUT_WEIGHTS = {"dac_reference": -1.0, "sampling_resistor": 1.0, "magnet": -1.0, "force_arm": -1.0}

# Paper B, Tables 3 and 4: estimates of the six repetitions, ppm
TABLE_3 = (-177.04, -187.90, -181.43, -179.96, -178.50, -178.29)
TABLE_4 = (223.03, 212.99, 218.01, 214.94, 224.98, 214.94)


@pytest.fixture(scope="module")
def still(tmp_path_factory):
    """A loop whose bias stays."""
    return without_bias(tmp_path_factory)


def without_bias(tmp_path_factory, further=""):
    path = tmp_path_factory.mktemp("loop") / "still.toml"
    path.write_text(
        f'extends = "digital-qfa"\n[bench]\nbias_sigma = {{ value = 0, unit = "ug", source = "test" }}\n{further}\n'
    )
    return load(path)


def weighted(unit, weights):
    return sum(weight * unit.temperature_ppm_per_c[part] for part, weight in weights.items())


def test_without_disturbances_the_procedure_is_exact(tmp_path_factory):
    patient = without_bias(tmp_path_factory, 'current_test = { value = 3.0, unit = "s", source = "test" }')
    done = bench.procedure(Unit(patient, NOTHING, NOTHING), Streams(1), temperature_c=np.full((2, 6), 22.0))
    np.testing.assert_allclose(done.forward_ppm, -200.0, atol=4.0 * SCAN_SIGMA_PPM)
    assert done.forward_ppm.mean() == pytest.approx(-200.0, abs=1.0)
    np.testing.assert_allclose(done.feedback_ppm, 200.0, atol=0.1)
    np.testing.assert_allclose(done.change_ug, -199.96, atol=0.6)
    np.testing.assert_allclose(done.remaining_ug, 0.0, atol=0.6 + 0.95)  # half a step of DA0
    np.testing.assert_allclose(done.forward_true_ppm, -200.0, atol=1e-6)


@pytest.mark.parametrize("index", range(4))
def test_shifts_are_those_of_the_temperature_coefficients(still, index):
    unit = population.draw(Streams(9), index, still)
    done = bench.procedure(unit, Streams(9).at("bench", index))
    warmer_c = done.temperature_c[1] - done.temperature_c[0]
    second_order = 0.05
    np.testing.assert_allclose(
        done.forward_shift_ppm, weighted(unit, FORWARD_WEIGHTS) * warmer_c, atol=4.5 * SCAN_SIGMA_PPM + second_order
    )
    np.testing.assert_allclose(
        done.feedback_shift_ppm,
        weighted(unit, FEEDBACK_WEIGHTS) * warmer_c,
        atol=4.5 * CURRENT_SIGMA_PPM + second_order,
    )
    null_ug = 0.02276 * (  # per ppm that the reference capacitors part: D (d / l) / (2 k0 g)
        unit.temperature_ppm_per_c["reference_capacitor_2"] - unit.temperature_ppm_per_c["reference_capacitor_1"]
    )
    output_ug = -199.96 + (weighted(unit, OUTPUT_WEIGHTS) + null_ug) * warmer_c
    np.testing.assert_allclose(done.change_ug, output_ug, atol=1.0)
    closure = done.remaining_ug - done.change_ug - done.feedback_ppm
    np.testing.assert_allclose(closure, 0.0, atol=1.2 + 0.95)


def test_the_shift_is_additive_and_not_a_share_of_what_is_put_in(still):
    unit, streams = population.draw(Streams(9), 1, still), Streams(4)
    shifts = [bench.procedure(unit, streams, Injection(-size, size)) for size in (0.0, 200.0, 1000.0)]
    assert abs(shifts[1].feedback_shift_ppm.mean()) > 5.0
    for other in (shifts[0], shifts[2]):
        np.testing.assert_allclose(other.forward_shift_ppm, shifts[1].forward_shift_ppm, atol=0.2)
        np.testing.assert_allclose(other.feedback_shift_ppm, shifts[1].feedback_shift_ppm, atol=0.2)


def test_after_compensation_the_scan_finds_the_reference_again(still):
    unit = population.draw(Streams(9), 2, still)
    done = bench.procedure(unit, Streams(5))
    restored = done.gain[1] * done.controller_gain
    np.testing.assert_allclose(restored / done.gain[0], 1.0, atol=1e-9)


def test_years_of_storage_age_the_parts(still):
    unit = Unit(still, NOTHING, {**NOTHING, "dac_reference": 40.0, "magnet": -5.0, "carrier_reference": 70.0})
    done = bench.procedure(unit, Streams(6), Injection(0.0, 0.0), np.full((2, 4), 22.0), years=2.0)
    assert done.forward_ppm.mean() == pytest.approx(140.0, abs=2.0 * SCAN_SIGMA_PPM)
    assert done.feedback_ppm.mean() == pytest.approx(80.0, abs=0.2)
    assert done.change_ug.mean() == pytest.approx(-70.0, abs=0.5)
    assert done.remaining_ug.mean() == pytest.approx(10.0, abs=1.5)  # the magnet is not seen


@pytest.fixture(scope="module")
def paper_unit():
    """The identified unit through the procedure on several seeds: 48 repetitions."""
    unit = population.draw(Streams(1), 0, load("paper-unit"))
    return [bench.procedure(unit, Streams(seed).at("paper")) for seed in range(8)]


def test_the_identified_unit_reads_as_tables_3_and_4(paper_unit):
    for name, printed in (("forward_ppm", TABLE_3), ("feedback_ppm", TABLE_4)):
        ours = np.concatenate([getattr(done, name) for done in paper_unit])
        assert abs(ours.mean() - np.mean(printed)) < 4.0 * ours.std(ddof=1) / np.sqrt(ours.size) + 0.5
        low, high = ours.mean() + 3.0 * ours.std(ddof=1) * np.array([-1.0, 1.0])
        assert low < min(printed)
        assert max(printed) < high


def test_the_identified_unit_ends_with_the_printed_output(paper_unit):
    change, remaining, feedback = (
        np.concatenate([getattr(done, name) for done in paper_unit])
        for name in ("change_ug", "remaining_ug", "feedback_ppm")
    )
    assert change.mean() == pytest.approx(-193.0, abs=2.0)
    assert remaining.mean() == pytest.approx(24.0, abs=4.0)
    single_ug = 3.0 * np.sqrt(2.0) * BIAS_UG
    assert np.all(np.abs(remaining - change - feedback) < 4.0 / 3.0 * single_ug + 1.0)


def test_repetitions_do_not_depend_on_how_many_there_are(still):
    unit, streams = population.draw(Streams(9), 3, still), Streams(8)
    temperature_c = bench.temperatures(still, streams)
    some = bench.procedure(unit, streams, temperature_c=temperature_c[:, :2])
    np.testing.assert_array_equal(some.forward_ppm, bench.procedure(unit, streams).forward_ppm[:2])
