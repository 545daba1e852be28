"""Results that no loop gave: invented, near the printed numbers, with wide distributions."""

from __future__ import annotations

import pytest

PARTS = {
    "pendulous_mass": ("pendulosity", 0.0, 0.0, 200.0, ["output"]),
    "bending_stiffness": ("forward", 0.0, 0.0, 0.0, []),
    "plate_spacing": ("forward", 0.0, 0.0, 0.0, []),
    "carrier_reference": ("forward", 200.0, 0.0, 0.0, ["scan"]),
    "reference_capacitor_1": ("forward", -100.0, 0.0, -4.6, ["scan", "output"]),
    "bridge_amplifier": ("forward", 200.0, 0.0, 0.0, ["scan"]),
    "adc_reference": ("forward", -199.96, 0.0, 0.0, ["scan"]),
    "dac_reference": ("feedback", 0.0, 200.0, -199.96, ["current", "output"]),
    "sampling_resistor": ("feedback", 0.0, -199.96, 200.0, ["current", "output"]),
    "magnet": ("torquer", 0.0, 0.0, -199.96, ["output"]),
    "coil_length": ("torquer", 0.0, 0.0, -199.96, ["output"]),
    "reference_current": ("current reference", 0.0, -199.96, 0.0, ["current"]),
}
MARGINS = {
    "crossover_hz": 122.0,
    "phase_margin_deg": 55.0,
    "gain_margin_db": 24.0,
    "bandwidth_hz": 208.0,
    "rise_s": 0.00195,
    "overshoot": 0.18,
}


def estimate(value: float, half: float) -> dict:
    return {"value": value, "interval95": [value - half, value + half]}


def make_temperature() -> dict:
    """Errors after a change in the room and a large one, by arm."""
    arms = {"none": 1.0, "tests": 0.01, "tests_and_output": 0.01, "other_unit": 1.4}

    def errors(change_c: float) -> dict:
        sizes = {"forward_ppm": 10.0 * change_c, "feedback_ppm": 8.0 * change_c, "output_ug": 20.0 * change_c}
        return {
            arm: {
                **{name: estimate(share * size, 0.1 * share * size) for name, size in sizes.items()},
                **{f"{name}_ratio": estimate(share, 0.1 * share) for name in sizes},
            }
            for arm, share in arms.items()
        }

    return {
        "room": errors(2.0),
        "far": errors(20.0),
        "floor": {"forward_ppm": 0.5, "feedback_ppm": 0.2, "output_ug": 3.8},
        "ppm_per_c": {"gain": 10.0, "current_step": 8.0, "output": 20.0},
        "large_change_c": 20.0,
        "chamber_c": [2.0, 42.0],
        "temperatures": 5,
    }


def make_flight(axis: str, from_s: float, rms_ug: float, largest_mm_s: float) -> dict:
    """The loop less its steady state over one stretch."""
    return {
        "axis": axis,
        "from_s": from_s,
        "change_g": 0.2,
        "mean_ug": estimate(0.01, 0.002),
        "rms_ug": estimate(rms_ug, 0.02),
        "rest_ug": estimate(1.9, 0.03),
        "delay_us": estimate(47.4, 0.1),
        "end_mm_s": estimate(0.002, 0.0003),
        "largest_mm_s": estimate(largest_mm_s, 0.0003),
        "noise_ug": estimate(8.3, 0.2),
        "noise_mm_s": estimate(0.001, 0.001),
        "rock_ppm": 86.0,
    }


def make_results() -> dict:
    """Every key that the rows and the page may ask for."""
    population: dict = {
        "units": 200,
        "warm_up_c": estimate(2.0, 0.4),
        "uncompensated_ug": estimate(200.0, 100.0),
        "compensated_ug": estimate(35.0, 35.0),
        "output_residual_percent": estimate(17.0, 17.0),
        "closure_ug": estimate(0.0, 2.0),
        "estimation_error_ppm": estimate(12.0, 11.0),
        "shift_grows_ppm": {"1000": {"forward": estimate(0.01, 0.03), "feedback": estimate(0.0, 0.02)}},
    }
    for channel, injected in (("forward", -200.0), ("feedback", 200.0)):
        population |= {
            f"{channel}_ppm": estimate(injected, 30.0),
            f"{channel}_repetition_ppm": estimate(injected, 32.0),
            f"{channel}_shift_ppm": estimate(0.0, 30.0),
            f"{channel}_error_ppm": estimate(0.0, 15.0),
            f"{channel}_residual_percent": estimate(7.5, 7.5),
            f"{channel}_scatter_ppm": estimate(5.0, 1.0),
            f"{channel}_baseline_scatter_ppm": estimate(4.0, 2.0),
            f"mean_{channel}_shift_ppm": estimate(0.2, 2.0),
        }
    return {
        "seed": 1,
        "loop": {"J": "5.5e-08 kg m²", "R": "100 Ω", "k_t": "0.0458 N m/A"},
        "exact": {
            "forward_ppm": -199.8,
            "feedback_ppm": 199.99,
            "feedback_tilted_ppm": 200.01,
            "counts_feedback_ppm": -199.95,
            "counts_on": -46573.0,
            "counts_off": 25166.0,
            "counts_per_g": 25166.0,
            "counts_on_less_off": -71738.85,
            "counts_on_less_off_expected": -71738.85,
            "output_feedback_ug": -199.96,
            "output_forward_ug": 0.0,
            "compensated_ug": 0.3,
            "forward_current_ppm": 0.0,
            "feedback_scan_ppm": 0.0,
            "magnet_current_ppm": -2e-4,
            "magnet_output_ug": -199.96,
            "reference_open_ppm": -100.0,
            "reference_output_ug": -4.6,
            "stiffness_scan_ppm": 0.0,
            "spacing_scan_ppm": 0.0,
            "scan_nonlinearity_ppm": 93.0,
            "steady_state_error": 5e-14,
            "poles_rad_s": [-10.06, -1808.1],
            "inertia": 5.5e-8,
            "deflection_over_stop": 22.0,
            "switch_open_ug": 0.0,
            "reference_bits": 20.0,
            "rejected_scatter_ppm": 31.0,
        },
        "attraction": {
            "carrier_v": 0.244,
            "area_mm2": 67.8,
            "stiffness_ppm": {"free": 0.0, "as much as C0": 23.8, "held": 71.5},
            "gain_ppm": {"as much as C0": estimate(28.3, 0.2), "held": estimate(129.5, 0.2)},
            "added_scatter_ppm": {"free": 0.0, "as much as C0": 0.3, "held": 0.3},
            "scatter_ppm": {"free": 31.0, "as much as C0": 31.0, "held": 31.0},
            "drift_ppm": 0.05,
            "pull_in_v": 28.9,
            "excited_v": 5.7,
            "spoiling_v": 5.0,
            "latching_um": 0.085,
            "scanned_um": 0.34,
        },
        "temperature": make_temperature(),
        "in_flight": {
            "delay_us": 47.4,
            "duration_s": 20.0,
            "flight": make_flight("z", 3992.6, 2.4, 0.10),
            "wing rock": make_flight("y", 4132.7, 5.7, 0.03),
        },
        "quiet": {"forward_scatter_ppm": 0.7, "feedback_scatter_ppm": 0.2},
        "stability": {
            "nominal": dict(MARGINS),
            "drifted": {**MARGINS, "crossover_hz": 121.98, "phase_margin_deg": 55.003},
            "compensated": dict(MARGINS),
            "degree_percent": 7.5,
        },
        "observability": [
            {
                "part": part,
                "gain": gain,
                "forward_scan_ppm": scan,
                "current_test_ppm": current,
                "output_ug": output,
                "seen_by": by,
            }
            for part, (gain, scan, current, output, by) in PARTS.items()
        ],
        "year": {"before_ug": 100.0, "after_ug": 7.1},
        "population": population,
        "scaling": {
            "forward_ratio": 0.9995,
            "forward_rms_ppm": 15.0,
            "feedback_ratio": 1.0007,
            "feedback_rms_ppm": 14.0,
        },
        "unit": {
            "forward_ppm": [-179.0, -183.0, -178.0, -180.0, -182.0, -181.0],
            "feedback_ppm": [218.0, 216.0, 220.0, 221.0, 217.0, 219.0],
            "outputs_ug": {"uncompensated": -193.0, "compensated": 25.0},
            "closure_ug": 1.0,
            "static_scatter_ug": 3.0,
        },
        "printed_ppm": {"forward": [-180.0] * 6, "feedback": [218.0] * 6},
    }


@pytest.fixture
def results() -> dict:
    return make_results()
