"""The compiled loop, sample by sample. Quantities as in `model`; what they are is said in `sampled`."""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True, nogil=True)
def demodulated(signal, reference, noise, limit, periods, rng):
    """Sum over `periods` of the ADC's words times the reference; `signal` (n,) is one period in counts of the ADC."""
    total = 0.0
    for _ in range(periods):
        for k in range(signal.size):
            word = np.floor(signal[k] + noise * rng.standard_normal() + 0.5)
            total += min(max(word, -limit), limit - 1.0) * reference[k]
    return total


@numba.njit(cache=True, nogil=True)
def closed_loop(
    torque, switch_torque, a, b, stop, carrier, reference, null, noise, adc_limit, gain, action, per_count, limit, rng
):
    """Words (n,) of DA2 while the loop works, from the plate on its stop; see `sampled.closed_loop`."""
    words = np.empty(torque.size)
    signal = np.empty(carrier.size)
    theta, omega = stop, 0.0
    word, integral, before = 0.0, 0.0, 0.0
    for i in range(torque.size):
        ratio = 0.5 * (1.0 + theta / stop) - null
        for k in range(carrier.size):
            signal[k] = carrier[k] * ratio
        error = gain * demodulated(signal, reference, noise, adc_limit, 1, rng)
        moment = torque[i] - switch_torque[i] - per_count * word  # what was decided one period ago acts now
        theta, omega = (
            a[0, 0] * theta + a[0, 1] * omega + b[0] * moment,
            a[1, 0] * theta + a[1, 1] * omega + b[1] * moment,
        )
        if abs(theta) > stop:
            theta, omega = np.sign(theta) * stop, 0.0
        integral = min(max(integral + action[1] * error, -limit), limit - 1.0)
        wanted = np.floor(action[0] * error + integral + action[2] * (error - before) + 0.5)
        word = min(max(wanted, -limit), limit - 1.0)
        before = error
        words[i] = word
    return words
