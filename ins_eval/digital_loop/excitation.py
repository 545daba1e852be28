"""The method that the paper rejects, eq. (23): excite the feedback channel in open loop and read the deflection.

A current holds 1 g in balance, steps of N_DA2 around it deflect the pendulum, and the slope of N_out against N_DA2 is
the whole gain k_pre k_fb, pendulum and torquer included. But the gap takes only D d / l of torque, 0.05 g with the
default parameters, so the bias that wanders from reading to reading is large against the excitation, while the
constant current excites with nearly 3 g. The paper names electrostatic attraction besides; a plate that is loaded is
drawn by the carrier (`attraction`), which makes it softer, by the same in every excitation.
"""

from __future__ import annotations

import numpy as np

from ins_eval.digital_loop import attraction, sampled
from ins_eval.digital_loop.model import Loop
from ins_eval.errors import UsageError
from ins_eval.streams import Streams
from ins_eval.units import PPM, STANDARD_GRAVITY

SHARE_OF_GAP = 0.6  # the largest deflection of the excitation
BALANCED_G = 1.0


def excite(loop: Loop, streams: Streams, loading: float = attraction.FREE) -> tuple[np.ndarray, np.ndarray]:
    """Words of DA2 (p,) and demodulated N_out (p,), the pendulum at rest at each of them.

    `loading` is C_s / C0 of the plate, which lets the carrier draw it; without, it does not. What it does to the
    reading of the bridge is left out. `calibration.loop_gains.scan_gain` gives the slope, - k_pre k_fb in counts for
    one count. Raises UsageError where the plate would touch a stop or is pulled onto it.
    """
    words, u = deflections(loop, streams)
    if np.any(np.abs(u) >= 1.0):
        raise UsageError("the plate touches a stop in the open-loop excitation; give the bench a smaller bias_sigma")
    u = attraction.attracted(loop, u, loading)
    parameters = loop.parameters
    rng, periods = streams.at("adc").rng(), int(parameters.scan.periods.value)
    amplitude = parameters.carrier.amplitude.value
    return words, np.array([sampled.demodulate(loop, amplitude, 0.5 * (1.0 + one), periods, rng) for one in u])


def deflections(loop: Loop, streams: Streams) -> tuple[np.ndarray, np.ndarray]:
    """Words of DA2 (p,) and the u (p,) at which the pendulum is then at rest, without attraction and stops."""
    steps = np.linspace(-1.0, 1.0, int(loop.parameters.scan.steps.value) + 1)
    counts_per_stop = loop["bending_stiffness"] * loop.stop_rad / (loop.torque_per_ampere * loop.amperes_per_count)
    words = np.round(loop.steady_counts(BALANCED_G) + SHARE_OF_GAP * counts_per_stop * steps)
    bias_g = PPM * loop.parameters.bench.bias_sigma.value * streams.at("bias").rng().standard_normal(words.size)
    torque = loop.pendulosity * STANDARD_GRAVITY * (BALANCED_G + bias_g)
    torque -= loop.torque_per_ampere * loop.amperes_per_count * words
    return words, torque / loop["bending_stiffness"] / loop.stop_rad
