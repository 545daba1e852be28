"""The loop as it is sampled and quantised: the working loop, and the scan with the plate on its stop.

Each period of the carrier the FPGA sends N_FPGA sin(2 pi k / n), k = 0 ... n - 1, rounded to the bits of DA1; the
bridge multiplies it by its ratio; the ADC rounds, with its noise, and clips; the FPGA multiplies by the sine and sums.
Then the controller acts and DA2 rounds and clips; the current flows one period later.
"""

from __future__ import annotations

import numpy as np

from ins_eval.digital_loop.kernel import closed_loop as _closed_loop
from ins_eval.digital_loop.kernel import demodulated
from ins_eval.digital_loop.model import Loop
from ins_eval.digital_loop.pendulum import discrete
from ins_eval.units import STANDARD_GRAVITY

ON_STOP = 1.0  # C1 / (C1 + C2) with the plate on its stop, eq. (16)


def closed_loop(
    loop: Loop, specific_force_g: np.ndarray, current_on: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """N_out (n,), one value a control period, from a plate that lies on its stop.

    `specific_force_g` (n,) in g and `current_on` (n,), the switch M1, hold for one period each.
    """
    parameters, period_s = loop.parameters, loop.period_s
    a, b = discrete(loop, period_s)
    reference = _reference(loop)
    controller = parameters.controller
    action = controller.proportional.value * np.array(
        [1.0, controller.integral.value * period_s, controller.derivative.value / period_s]
    )
    return _closed_loop(
        loop.pendulosity * STANDARD_GRAVITY * specific_force_g,
        loop.torque_per_ampere * loop["reference_current"] * current_on,
        a,
        b,
        loop.stop_rad,
        _carrier(loop, parameters.carrier.amplitude.value),
        reference,
        loop.bridge_null,
        parameters.adc.noise.value,
        2.0 ** (parameters.adc.bits.value - 1),
        _per_period(loop),
        action,
        loop.torque_per_ampere * loop.amperes_per_count,
        2.0 ** (parameters.feedback.bits.value - 1),
        rng,
    )


def scan(loop: Loop, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """The open-loop scan of eq. (17): N_FPGA (p,) and N_out (p,), the plate lying on its stop."""
    parameters = loop.parameters
    steps, periods = int(parameters.scan.steps.value), int(parameters.scan.periods.value)
    n_fpga = parameters.carrier.amplitude.value + parameters.scan.step.value * np.arange(steps + 1)
    return n_fpga, np.array([demodulate(loop, n, ON_STOP, periods, rng) for n in n_fpga])


def demodulate(loop: Loop, n_fpga: float, ratio: float, periods: int, rng: np.random.Generator) -> float:
    """Mean demodulated value over `periods` at the capacitance ratio C1 / (C1 + C2) = `ratio`, without feedback."""
    adc = loop.parameters.adc
    signal = _carrier(loop, n_fpga) * (ratio - loop.bridge_null)
    total = demodulated(signal, _reference(loop), adc.noise.value, 2.0 ** (adc.bits.value - 1), periods, rng)
    return _per_period(loop) * total / periods


def _reference(loop: Loop) -> np.ndarray:
    samples = int(loop.parameters.carrier.samples_per_period.value)
    return np.sin(2.0 * np.pi * np.arange(samples) / samples)


def _carrier(loop: Loop, n_fpga: float) -> np.ndarray:
    """One period of the carrier as the ADC would see it at a ratio of 1, in counts of the ADC."""
    words = np.round(n_fpga * _reference(loop))
    return words * loop.volts_per_count * loop["bridge_amplifier"] * loop.counts_per_volt


def _per_period(loop: Loop) -> float:
    """From the sum over one period to demodulated counts: the amplitude is 2 / n times the sum."""
    parameters = loop.parameters
    gain = parameters.demodulator.gain.value * parameters.controller.gain.value * loop.controller_gain
    return gain * 2.0 / parameters.carrier.samples_per_period.value
