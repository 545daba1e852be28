"""Which test sees which part: the derivatives of eqs. (6), (7), (13), (16) and (26), written out by hand."""

import pytest

from ins_eval.digital_loop import PARTS, load
from ins_eval.digital_loop.observability import table

SCAN_TOLERANCE_PPM = 0.3  # rounding of the ADC differs, its noise does not
CURRENT_TOLERANCE_PPM = 0.01
OUTPUT_TOLERANCE_UG = 0.1
CAPACITOR_UG = 4.552  # D (d / l) 1e-4 / (k0 g): what the hinge pulls where the bridge then balances

# for +1 ppm: slope of the scan, k_VI k_DA as the current test has it, output at 1 g in ug
EXPECTED = {
    "pendulous_mass": (0, 0, 1),
    "bending_stiffness": (0, 0, 0),
    "plate_spacing": (0, 0, 0),
    "carrier_reference": (1, 0, 0),
    "carrier_amplifier": (1, 0, 0),
    "reference_capacitor_1": (-0.5, 0, -CAPACITOR_UG / 200),
    "reference_capacitor_2": (0.5, 0, CAPACITOR_UG / 200),
    "bridge_amplifier": (1, 0, 0),
    "adc_reference": (-1, 0, 0),
    "dac_reference": (0, 1, -1),
    "sampling_resistor": (0, -1, 1),
    "magnet": (0, 0, -1),
    "coil_length": (0, 0, -1),
    "force_arm": (0, 0, -1),
    "reference_current": (0, -1, 0),
}


@pytest.fixture(scope="module")
def rows():
    return {row.part: row for row in table(load())}


def test_every_part_has_a_row(rows):
    assert list(rows) == list(PARTS) == list(EXPECTED)


@pytest.mark.parametrize("part", EXPECTED)
def test_each_test_sees_what_the_equations_say(rows, part):
    row, (scan, current, output) = rows[part], EXPECTED[part]
    second_order = 200.0**2 * 1e-6
    assert row.forward_scan_ppm == pytest.approx(200.0 * scan, abs=SCAN_TOLERANCE_PPM)
    assert row.current_test_ppm == pytest.approx(
        200.0 * current, abs=CURRENT_TOLERANCE_PPM + second_order * abs(current)
    )
    assert row.output_ug == pytest.approx(200.0 * output, abs=OUTPUT_TOLERANCE_UG)
    named = {"scan": scan, "current": current, "output": output}
    assert row.seen_by == tuple(name for name, size in named.items() if size)


def test_the_magnet_is_seen_by_the_output_alone(rows):
    assert rows["magnet"].seen_by == ("output",)
    assert abs(rows["magnet"].current_test_ppm) < CURRENT_TOLERANCE_PPM
