"""The capacitance bridge, eqs (4)-(6) and (16), computed again.

Reference ratio rho = Cref1/(Cref1 + Cref2); voltages are for V_IN k_amp = 1 V.
"""

from __future__ import annotations

from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.units import PPM


def reference_ratio(cref1_ppm: float = 0.0, cref2_ppm: float = 0.0) -> float:
    """rho, where both references are equal but for these drifts."""
    one, two = 1.0 + cref1_ppm * PPM, 1.0 + cref2_ppm * PPM
    return one / (one + two)


def voltage(difference: float, c0: float, rho: float) -> float:
    """Eq. (4) without its second Delta C: C1/(C1 + C2) - rho with C1,2 = C0 +- Delta C/2, in V."""
    return (c0 + 0.5 * difference) / (2.0 * c0) - rho


def printed_gain_at_null(rho: float = 0.5) -> float:
    """k_CV of eq. (4) as printed, V/F times F: the bracket itself, at C1 = C2."""
    return voltage(0.0, 1.0, rho)


def gain(c0: float, rho: float = 0.5) -> float:
    """k_CV = d(Delta V)/d(Delta C) = 1/(4 C0), in V/F, by a central difference of `voltage`."""
    step = 1e-3 * c0
    return (voltage(step, c0, rho) - voltage(-step, c0, rho)) / (2.0 * step)


def closed_loop_gain_ppm(cref1_ppm: float) -> float:
    """Change of k_CV at null for a drift of Cref1."""
    return (gain(1.0, reference_ratio(cref1_ppm)) / gain(1.0) - 1.0) / PPM


def null_shift_ppm(cref1_ppm: float) -> float:
    """Delta C/C0 at which the bridge is balanced, for a drift of Cref1."""
    return 2.0 * (2.0 * reference_ratio(cref1_ppm) - 1.0) / PPM


def open_loop_gain_ppm(cref1_ppm: float = 0.0, cref2_ppm: float = 0.0) -> float:
    """Change of eq. (16), 1 - rho, for drifts of the references."""
    return ((1.0 - reference_ratio(cref1_ppm, cref2_ppm)) / (1.0 - reference_ratio()) - 1.0) / PPM


def not_in_the_scan() -> list[str]:
    """Factors of eq. (17) that the open-loop chain, eq. (16), does not hold: the plate lies on its stop."""
    factors = PRINTED["factors"]
    return [factor for factor in factors["eq17"] if factor not in factors["open_loop"]]
