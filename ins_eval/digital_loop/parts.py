"""The parts of the loop that can drift: symbol in the paper, and the gain in which each sits.

Source: Paper B, eqs. (3), (6), (7), (13), (16), (26) and section III-B.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

Gain = Literal["pendulosity", "forward", "feedback", "torquer", "current reference"]


class Part(NamedTuple):
    """A part that can drift: the gain it sits in, its symbol and quantity, and where its nominal value stands."""

    gain: Gain
    symbol: str
    quantity: str
    table: str
    key: str


PARTS: dict[str, Part] = {
    "pendulous_mass": Part("pendulosity", "m", "mass of the pendulum", "pendulum", "mass"),
    "bending_stiffness": Part("forward", "D", "stiffness of the hinge", "pendulum", "stiffness"),
    "plate_spacing": Part("forward", "d", "gap of the pick-off, k1 = 2 C0 l / d", "pickoff", "gap"),
    "carrier_reference": Part("forward", "V_DA1ref", "reference voltage of DA1", "carrier", "reference"),
    "carrier_amplifier": Part("forward", "k_tz", "gain behind DA1", "carrier", "gain"),
    "reference_capacitor_1": Part("forward", "C_ref1", "reference capacitor of the bridge", "bridge", "capacitor_1"),
    "reference_capacitor_2": Part("forward", "C_ref2", "reference capacitor of the bridge", "bridge", "capacitor_2"),
    "bridge_amplifier": Part("forward", "k_amp", "gain of the instrumentation amplifier", "bridge", "gain"),
    "adc_reference": Part("forward", "V_ADref", "reference voltage of the ADC", "adc", "reference"),
    "dac_reference": Part("feedback", "K_DA0", "full scale of DA0, which feeds DA2", "feedback", "full_scale"),
    "sampling_resistor": Part("feedback", "R", "resistor of the voltage-to-current converter", "feedback", "resistor"),
    "magnet": Part("torquer", "B", "magnetic induction in the gap", "torquer", "induction"),
    "coil_length": Part("torquer", "L_coil", "length of the coil winding", "torquer", "coil_length"),
    "force_arm": Part("torquer", "L", "arm of the force on the coil", "torquer", "arm"),
    "reference_current": Part("current reference", "I_ref", "constant-current source", "current_source", "current"),
}
