"""Steps of a converter, gain of an amplifier with a changed resistor, and the errors of the paper's approximations."""

from __future__ import annotations

from math import prod

from ins_eval.units import PPM


def step_ppm(bits: int) -> float:
    """One step of DA0 in ppm of its reference voltage, set to the middle of its range: 1/2^(bits - 1)."""
    return 1.0 / 2 ** (bits - 1) / PPM


def bits_for(step: float) -> int:
    """Fewest bits with which DA0's step is at most `step` ppm."""
    bits = 1
    while step_ppm(bits) > step:
        bits += 1
    return bits


def amplifier_ppm(gain: float, resistor_ppm: float) -> float:
    """Change of a non-inverting amplifier G = 1 + Rf/Rg for a change of Rf: (G - 1)/G times as much."""
    return resistor_ppm * (gain - 1.0) / gain


def gain_that_explains(found_ppm: float, resistor_ppm: float) -> float:
    """G for which a change of Rf would give what was found."""
    return 1.0 / (1.0 - found_ppm / resistor_ppm)


def inverse_error_ppm(drift_ppm: float) -> float:
    """Error of 1 - delta for 1/(1 + delta), eqs (7), (22) and N'_VREF: delta^2."""
    delta = drift_ppm * PPM
    return ((1.0 - delta) * (1.0 + delta) - 1.0) / PPM


def product_error_ppm(drifts_ppm: list[float]) -> float:
    """Error of the sum of drifts for that of the product of gains, "approximately linear" below eq. (7)."""
    return (prod(1.0 + x * PPM for x in drifts_ppm) - 1.0) / PPM - sum(drifts_ppm)
