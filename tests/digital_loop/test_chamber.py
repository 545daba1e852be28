"""The chamber finds the coefficients that the parts have, by how each part is in a reading."""

import numpy as np
import pytest

from ins_eval.digital_loop import chamber, load, population
from ins_eval.digital_loop.bench import current_test, static_test
from ins_eval.errors import UsageError
from ins_eval.streams import Streams

PLAN = population.ProcedurePlan(seed=5)


@pytest.fixture(scope="module", params=[0, 1, 2])
def unit_and_found(request):
    streams = Streams(PLAN.seed).at("digital loop")
    return population.draw(streams, request.param), chamber.calibrated(PLAN, request.param)


def test_lines_have_the_coefficients_of_the_parts(unit_and_found):
    """ppm/degC to first order; 0.1 from the thermometer, and 3 ug of bias over 40 degC."""
    unit, found = unit_and_found
    of = unit.temperature_ppm_per_c
    bridge = of["bridge_amplifier"] + 0.5 * (of["reference_capacitor_2"] - of["reference_capacitor_1"])
    gain = of["carrier_reference"] + of["carrier_amplifier"] + bridge - of["adc_reference"]
    per_current = of["sampling_resistor"] - of["dac_reference"]
    torquer = of["magnet"] + of["coil_length"] + of["force_arm"]
    assert found.lines["gain"].ppm_per_c.value == pytest.approx(gain, abs=0.15)
    assert found.lines["current_step"].ppm_per_c.value == pytest.approx(per_current + of["reference_current"], abs=0.15)
    assert found.lines["output"].ppm_per_c.value == pytest.approx(per_current - torquer, abs=1.2)  # bridge null too


def test_the_thermometer_reads_the_temperatures_of_the_repetitions(unit_and_found):
    _, found = unit_and_found
    assert found.thermometer_c.shape == (2, 6)
    assert found.far.temperature_c == pytest.approx(np.array([[22.0], [42.0]]))
    assert found.far_thermometer_c == pytest.approx(found.far.temperature_c, abs=0.3)


def test_the_population_is_not_moved():
    before = population.member(PLAN, 0)
    chamber.calibrated(PLAN, 0)
    again = population.member(PLAN, 0)
    for size, of_size in before.items():
        for key, values in of_size.items():
            assert np.array_equal(values, again[size][key])


def test_counts_go_with_the_inverse_of_n_vref():
    """How the output with another code follows from the one that was measured; 1 ug in 1 g."""
    loop = load()
    streams = Streams(3)
    code = int(loop.parameters.feedback.reference_code.value)
    first, second = (static_test(loop.with_compensation(reference_code=c), streams) for c in (code, code - 300))
    assert second * (code - 300) == pytest.approx(first * code, rel=1e-6)
    on, off = current_test(loop, streams)
    assert (on - off).mean() == pytest.approx(-71738.85, rel=1e-5)


def test_a_chamber_without_a_span_is_refused(tmp_path):
    path = tmp_path / "flat.toml"
    path.write_text('extends = "digital-qfa"\n[chamber]\nhighest = { value = 2.0, unit = "degC", source = "test" }\n')
    with pytest.raises(UsageError, match="expected a higher one"):
        load(path)
