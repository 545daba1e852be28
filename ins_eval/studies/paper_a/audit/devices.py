"""Tables 1 and 5 computed again: drifts, names and labels."""

from __future__ import annotations

from ins_eval.datasheets import AccelerometerSheet, Drift, worst_case_drift
from ins_eval.studies.paper_a.printed import GJN096, INS, PRINTED, QA3000, UNITS


def drift(sheet: AccelerometerSheet = QA3000) -> Drift:
    """Drift over the range of section 1 without compensation."""
    return worst_case_drift(sheet, *PRINTED["drift"]["between_c"])


def bandwidth_senses() -> tuple[str, str]:
    """How Table 1 bounds the bandwidth of its two devices."""
    return tuple("above" if sheet.bandwidth_at_least_hz else "below" for sheet in (QA3000, GJN096))


def largest_ratio() -> float:
    """Largest ratio between the temperature sensitivities of the two devices that are called similar."""
    keys = ("bias_temperature_ug_per_c", "scale_temperature_ppm_per_c")
    ratios = [getattr(QA3000, key) / getattr(GJN096, key) for key in keys]
    return max(max(r, 1.0 / r) for r in ratios)


def scale_sensitivities() -> tuple[float, list[float]]:
    """That of Table 1's GJN096-D and those of the units of Table 4 without compensation, ppm/degC."""
    return GJN096.scale_temperature_ppm_per_c, [PRINTED[unit]["table4"]["none"] for unit in UNITS]


def gyro_scale_repeatabilities() -> dict[str, float]:
    """The two values that Table 5 gives under one name, by their units; only ppm is a unit of a scale factor."""
    units = PRINTED["table5"]["gyro_row_unit"]
    return {
        units["first_scale_repeatability"]: INS.gyro.bias_repeatability_deg_per_h,
        units["second_scale_repeatability"]: INS.gyro.scale_repeatability_ppm,
    }
