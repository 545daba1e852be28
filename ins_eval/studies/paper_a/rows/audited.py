"""What the audits give that more than one row of Paper A states, from the paper's numbers alone."""

from __future__ import annotations

import functools
from typing import Any

from ins_eval.calibration.fits import LINE
from ins_eval.calibration.labelings import FIGURE_4, TURNED
from ins_eval.studies.paper_a.audit import chamber, devices, epoxy, navigation
from ins_eval.studies.paper_a.audit import scale_factor as audit
from ins_eval.studies.paper_a.printed import INS, PRINTED, UNITS

BOTH_WAYS = (-1.0, 1.0)


@functools.cache
def audited() -> dict[str, Any]:
    """By name; lists are of the three printed units."""
    drift, demanded = devices.drift(), [audit.constraint(unit) for unit in UNITS]
    rates = PRINTED["chamber"]["rates_c_per_min"]
    return {
        "drift": {"span_c": drift.span_c, "bias_mg": drift.bias_ug / 1e3, "scale_ppm": drift.scale_ppm},
        "largest_ratio": devices.largest_ratio(),
        "gyro_scale_repeatabilities": devices.gyro_scale_repeatabilities(),
        "scale_repeatability_ppm": INS.accelerometer.scale_repeatability_ppm,
        "creep": epoxy.of_table("creep_um"),
        "thermal": epoxy.of_table("thermal_um"),
        "caption_differences": epoxy.caption_differences(),
        "sign_differences": epoxy.sign_differences(),
        "positions": {"figure": FIGURE_4, "turned": TURNED},
        "labelled": chamber.labelled(FIGURE_4, 1.0, 0.0),
        "ramps": chamber.ramps(),
        "slew": chamber.slew(),
        "rank": {
            "one": audit.rank([0.3]),
            "both": audit.rank([-0.3, 0.3]),
            "second": audit.rank([-0.3, 0.3, -0.5, 0.5]),
            "all": audit.rank([sign * rate for rate in rates for sign in BOTH_WAYS]),
            "line": audit.rank([0.3], LINE),
        },
        "epsilon_demanded": [c.epsilon_demanded for c in demanded],
        "epsilon_printed": [c.epsilon_printed for c in demanded],
        "mu_printed": [c.mu_printed for c in demanded],
        "sensitivity": [audit.printed_sensitivity(unit) for unit in UNITS],
        "sensitivity_from_zero": [audit.printed_sensitivity(unit, 0.0) for unit in UNITS],
        "reference_needed_c": [audit.reference_needed_c(unit) for unit in UNITS],
        "quoted_sensitivity": [audit.quoted_sensitivity(unit) for unit in UNITS],
        "least_for_a_line": [audit.least_for_a_line(unit) for unit in UNITS],
        "residual_peak_to_peak_ppm": [audit.residual_peak_to_peak_ppm(unit) for unit in UNITS],
        "falling_minus_rising_ppm": [audit.falling_minus_rising_ppm(unit) for unit in UNITS],
        "table4": {
            **{arm: [PRINTED[unit]["table4"][arm] for unit in UNITS] for arm in ("none", "simple", "hysteresis")},
            "simple_over_hysteresis": [audit.table4_ratio(unit) for unit in UNITS],
            "none_over_hysteresis": [audit.table4_ratio(unit, "none") for unit in UNITS],
        },
        "cruise_start_c": navigation.cruise_start_c(),
        "duration_h": navigation.duration_h(),
        "reduction_percent": {
            "oven_horizontal": navigation.reduction_percent(PRINTED["table6"], "horizontal"),
            "cep": navigation.reduction_percent(PRINTED["cep"]),
        },
    }
