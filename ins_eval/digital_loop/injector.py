"""Drift put in on purpose: directly in the gain, or through a resistor as the paper did.

A resistor is not the gain. The instrumentation amplifier is non-inverting, G = 1 + R_f / R_g, so R_f changed by delta
changes the gain by delta (G - 1) / G: -200 ppm become -180 ppm at G = 10. The current is V / R, so R lowered by delta
raises the gain by delta / (1 - delta).

Source: Paper B, section IV-A step 3: "the loop-gain would be varied through changing the resistance value".
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ins_eval.digital_loop.model import Loop
from ins_eval.units import PPM


def non_inverting_ppm(resistor_ppm: float, gain: float) -> float:
    """Change in ppm of a gain G = 1 + R_f / R_g whose R_f has changed by `resistor_ppm`."""
    return resistor_ppm * (gain - 1.0) / gain


@dataclass(frozen=True)
class Injection:
    """What is put in: ppm of the forward and of the feedback gain, or of the resistors that should make these."""

    forward_ppm: float = -200.0
    feedback_ppm: float = 200.0
    through: Literal["gain", "resistor"] = "gain"

    def __call__(self, loop: Loop) -> Loop:
        """The loop with the drift put in, by the instrumentation amplifier and the sampling resistor."""
        forward_ppm, resistor = self.forward_ppm, 1.0 / (1.0 + PPM * self.feedback_ppm)
        if self.through == "resistor":
            forward_ppm = non_inverting_ppm(self.forward_ppm, loop["bridge_amplifier"])
            resistor = 1.0 - PPM * self.feedback_ppm
        return loop.with_drift("bridge_amplifier", forward_ppm).with_drift("sampling_resistor", (resistor - 1.0) / PPM)
