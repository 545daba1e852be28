"""The loop: its gains with the drift of every part, its steady output, and where it is compensated.

    torque on the pendulum    M = k0 a - k_t (k_VI k_DA N_out + I_ref)          I_ref only with the switch M1 closed
    bridge                    dV = V_IN k_amp [C1 / (C1 + C2) - C_ref1 / (C_ref1 + C_ref2)]
    C1, C2 = C0 / (1 -+ u)    C1 / (C1 + C2) = (1 + u) / 2 exactly, u = l theta / d in [-1, 1]

Source: Paper B, eqs. (5)-(13), (22), (26), (30); the bridge as corrected, since the printed eq. (4) multiplies by
the change of capacitance twice.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from ins_eval.digital_loop.parameters import DEFAULT, Parameters, read
from ins_eval.digital_loop.parts import PARTS
from ins_eval.errors import UsageError, did_you_mean
from ins_eval.units import PPM, STANDARD_GRAVITY


@dataclass(frozen=True)
class Loop:
    """A digital loop: nominal parameters, the factor by which each part has drifted, and two settings of its FPGA.

    `controller_gain` multiplies k(D(z)), eq. (22); `reference_code` is N_VREF of DA0, eq. (30), None the nominal one.
    """

    parameters: Parameters
    factors: Mapping[str, float] = field(default_factory=dict)
    controller_gain: float = 1.0
    reference_code: int | None = None

    # ------------------------------------------------------------------------------------------ drift and settings

    def with_drift(self, part: str, ppm: float) -> Loop:
        """This loop with `part` drifted by `ppm` of its value; a further drift multiplies.

        Raises UsageError for a part that is not in `PARTS`.
        """
        if part not in PARTS:
            raise UsageError(f"no part of the loop is called '{part}'{did_you_mean(part, PARTS)}")
        return replace(self, factors={**self.factors, part: self.factors.get(part, 1.0) * (1.0 + PPM * ppm)})

    def with_compensation(self, controller_gain: float | None = None, reference_code: int | None = None) -> Loop:
        """This loop with the gain of its controller, N_VREF, or both set anew."""
        return replace(
            self,
            controller_gain=self.controller_gain if controller_gain is None else controller_gain,
            reference_code=self.reference_code if reference_code is None else reference_code,
        )

    def __getitem__(self, part: str) -> float:
        """Present value of a part, SI: nominal times what it has drifted by."""
        at = PARTS[part]
        return getattr(getattr(self.parameters, at.table), at.key).value * self.factors.get(part, 1.0)

    # ------------------------------------------------------------------------------------------ pendulum and pick-off

    @property
    def period_s(self) -> float:
        """Time between two actions of the controller, one period of the carrier."""
        return 1.0 / self.parameters.controller.rate.value

    @property
    def pendulosity(self) -> float:
        """k0 = m L in kg m."""
        return self["pendulous_mass"] * self.parameters.pendulum.arm.value

    @property
    def stop_rad(self) -> float:
        """Deflection d / l at which the plate lies on its stop, u = 1."""
        return self["plate_spacing"] / self.parameters.pickoff.arm.value

    @property
    def capacitance_gain(self) -> float:
        """k1 = 2 C0 l / d in F/rad; C0, too, is in inverse proportion to the gap."""
        pickoff = self.parameters.pickoff
        capacitance = pickoff.capacitance.value * pickoff.gap.value / self["plate_spacing"]
        return 2.0 * capacitance / self.stop_rad

    # ------------------------------------------------------------------------------------------ forward channel

    @property
    def bridge_null(self) -> float:
        """C_ref1 / (C_ref1 + C_ref2), the ratio at which the bridge gives nothing."""
        first, second = self["reference_capacitor_1"], self["reference_capacitor_2"]
        return first / (first + second)

    @property
    def volts_per_count(self) -> float:
        """V_IN of one count of N_FPGA: V_DA1ref / 2^(bits - 1) k_tz."""
        return self["carrier_reference"] / 2.0 ** (self.parameters.carrier.bits.value - 1) * self["carrier_amplifier"]

    @property
    def counts_per_volt(self) -> float:
        """k_AD = 2^(bits - 1) / V_ADref, eq. (7)."""
        return 2.0 ** (self.parameters.adc.bits.value - 1) / self["adc_reference"]

    @property
    def demodulated_per_ratio(self) -> float:
        """Demodulated counts for one count of N_FPGA and a capacitance ratio of 1: the electronics of the channel."""
        demodulator = self.parameters.demodulator.gain.value * self.parameters.controller.gain.value
        return (
            self.volts_per_count * self["bridge_amplifier"] * self.counts_per_volt * demodulator * self.controller_gain
        )

    @property
    def scan_gain(self) -> float:
        """What the scan measures, eq. (17): counts for one count of N_FPGA with the plate on its stop, eq. (16)."""
        return self.demodulated_per_ratio * (1.0 - self.bridge_null)

    @property
    def forward_gain(self) -> float:
        """Demodulated counts for a steady torque of 1 N m on the pendulum without feedback, k_pre of eq. (15)."""
        return self.forward_gain_per_rad / self["bending_stiffness"]

    @property
    def forward_gain_per_rad(self) -> float:
        """Demodulated counts for 1 rad in closed loop: at null the bridge gives u / 2 whatever the capacitors are."""
        return self.demodulated_per_ratio * self.parameters.carrier.amplitude.value * 0.5 / self.stop_rad

    # ------------------------------------------------------------------------------------------ feedback channel

    @property
    def amperes_per_count(self) -> float:
        """k_VI k_DA: N_VREF K_DA0 / 2^(bits - 1) / R, eqs. (9), (10), (30)."""
        feedback = self.parameters.feedback
        code = feedback.reference_code.value if self.reference_code is None else self.reference_code
        volts = code * self["dac_reference"] / 2.0**feedback.reference_bits.value
        return volts / 2.0 ** (feedback.bits.value - 1) / self["sampling_resistor"]

    @property
    def torque_per_ampere(self) -> float:
        """k_t = B L_coil L in N m/A, eqs. (11), (12)."""
        return self["magnet"] * self["coil_length"] * self["force_arm"]

    @property
    def counts_per_g(self) -> float:
        """Scale factor of the closed loop, counts for 1 g."""
        return self.pendulosity * STANDARD_GRAVITY / (self.torque_per_ampere * self.amperes_per_count)

    def steady_counts(self, specific_force_g: float, current_on: bool = False) -> float:
        """Mean N_out in closed loop, where the torques balance and the controller's integral holds the bridge at null.

        k0 a - k_t (k_VI k_DA N_out + I_ref) = D theta_null, theta_null from the mismatch of the reference capacitors.
        """
        null_rad = (2.0 * self.bridge_null - 1.0) * self.stop_rad
        torque = self.pendulosity * STANDARD_GRAVITY * specific_force_g - self["bending_stiffness"] * null_rad
        amperes = torque / self.torque_per_ampere - (self["reference_current"] if current_on else 0.0)
        return amperes / self.amperes_per_count


def load(preset_or_path: str | Path = DEFAULT) -> Loop:
    """A loop as its parameters say, with nothing drifted.

    Raises UsageError: no such file or preset, a key that is unknown or missing, a unit other than expected, a current
    test that DA2 cannot balance.
    """
    loop = Loop(read(preset_or_path))
    largest = max(abs(loop.steady_counts(1.0, on)) for on in (False, True))
    limit = 2.0 ** (loop.parameters.feedback.bits.value - 1)
    if largest >= limit:
        raise UsageError(
            f"{preset_or_path}: 1 g, or 1 g and the reference current, takes {largest:.0f} counts, above the "
            f"{limit:.0f} of DA2; take a stronger torquer, a smaller resistor or a smaller current"
        )
    return loop
