"""Names of measures, definitions and sources as the metrics spell them and as a reader sees them."""

from __future__ import annotations

from collections.abc import Mapping

from ins_eval.tables import pick

PAPER = "Paper A (Sensors 2021, 21, 294)"
FIRST, SECOND = "simple", "hysteresis_refined"  # what the paper compares, as far as it tells
HEADLINE = f"{SECOND}/{FIRST}"
# The paper's "compensated" arm was refined in the oven, so it stands beside our refined one.
PAPER_ARM = {"simple": FIRST, "hysteresis": SECOND}
VELOCITY, CEP = "velocity_rms_horizontal", "cep_rate_final"
COMPONENTS = ("east", "north", "horizontal", "down")
CHANNELS_MEASURED = (
    "position north", "position east", "position down",
    "velocity north", "velocity east", "velocity down",
    "attitude north", "attitude east", "attitude down",
)  # fmt: skip

DEFINITION_NAME = {
    "velocity_rms": "velocity RMS",
    "final": "final",
    "rms_08326": "0.8326 RMS",
    "elliptical": "elliptical",
    "circular_05887": "0.5887 (σN + σE)",
    "least_squares": "least squares",
    "radial_error_rate_rms": "radial error rate RMS",
    "trms": "time RMS",
}

MEASURE_NAME = {
    "velocity_rms_north": "north velocity RMS",
    "velocity_rms_east": "east velocity RMS",
    "velocity_rms_down": "down velocity RMS",
    "velocity_rms_horizontal": "horizontal velocity RMS",
    **{f"cep_rate_{key}": f"CEP rate ({name})" for key, name in DEFINITION_NAME.items() if key != "velocity_rms"},
    "radial_error_rate_final": "radial error rate (final)",
    "radial_error_rate_least_squares": "radial error rate (least squares)",
    "radial_error_rate_rms": "radial error rate (RMS)",
}

SOURCE_NAME = {
    "accelerometer_bias_thermal": "accelerometer bias: temperature and creep",
    "accelerometer_bias_thermal_with_gradient": "not in the flight: the same, axes unequally warm",
    "accelerometer_bias_of_the_run": "accelerometer bias: turn-on and in-run",
    "accelerometer_scale_factor": "accelerometer scale factor",
    "accelerometer_cross_terms": "not in the flight: K3, Kip, Kio, misalignment",
    "gyro": "gyros",
}

# Errors of which `predict` expects a horizontal velocity RMS.
PREDICTED = (
    ("own_before", "own errors of the sensors, without the model [m/s]"),
    ("own_after", "own errors of the sensors, with the model [m/s]"),
    ("share", "share that is left"),
    ("with_switch_on_before", "and of a new switch-on, without the model [m/s]"),
    ("with_switch_on_after", "and of a new switch-on, with the model [m/s]"),
)

# What the budget holds beside the sources of the flight, to show what they would do.
NOT_IN_THE_FLIGHT = ("accelerometer_bias_thermal_with_gradient", "accelerometer_cross_terms")

DEFINITIONS = tuple(key for key in DEFINITION_NAME if key != "velocity_rms")  # of a CEP rate
MAIN_DEFINITIONS = ("final", "least_squares", "radial_error_rate_rms")  # those that one flight has too


def definition_name(key: str) -> str:
    return DEFINITION_NAME.get(key, key.replace("_", " "))


def measure_name(key: str) -> str:
    return MEASURE_NAME.get(key, key.replace("_", " "))


def source_name(key: str) -> str:
    return SOURCE_NAME.get(key, key.replace("_", " "))


def single_flight_name(definition: str) -> str:
    """What a definition of a CEP rate is called when there is one flight only."""
    return measure_name("radial_error_rate_" + definition.removeprefix("radial_error_rate_"))


def of_ensemble(metrics: Mapping, name: str, measure: str) -> Mapping | None:
    """The statistic of compensation `name`, by the name its measure has among the improvements, or None."""
    if measure.startswith("velocity_rms_"):
        return pick(metrics, "ensemble", name, "velocity_rms_mps", measure.removeprefix("velocity_rms_"))
    return pick(metrics, "ensemble", name, "cep_rate_nmi_per_h", measure.removeprefix("cep_rate_"))


def improvement(metrics: Mapping, pair: str, measure: str) -> Mapping | None:
    """Ratio and interval of a pair ``new/old`` in one measure, or None."""
    return pick(metrics, "ensemble", "improvement", pair, measure)


def linearly(linear: Mapping) -> str:
    """Whether the instruments were flown linearly, and how far that is from the flights in full."""
    far = (
        f"of {linear['size']} instruments flown both ways, horizontal velocity RMS and RMS radial error differ by at "
        f"most {100.0 * linear['worst']:.2g} % in any, and ratios of compensations by {linear['of_ratio']:.1g}"
    )
    if linear["taken"]:
        return f"Errors were propagated to first order along the true flight; {far}."
    return f"All were flown in full, since first-order errors would not do; {far}."
