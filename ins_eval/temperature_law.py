"""Means of every channel at rest against temperature, with their straight line y = a + b (T - T0).

The slope is least squares over means of ten seconds. Its 95 % interval is the quantile of a moving block bootstrap:
runs of neighbouring residuals are drawn together, since what a channel does beside its law goes on for minutes. Such a
line says how a channel moved with temperature in this recording and not why: time passed as well. `diagnose` separates
the two.

Source: Kuensch, The jackknife and the bootstrap for general stationary observations, Annals of Statistics 17 (1989).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

BLOCK_S = 10.0  # of a mean: white noise of a MEMS gyro is some deg/h then
FEWEST = 12  # means that a line and its interval are made of
LEAST_RANGE_C = 1.0  # of temperature: less is the noise of a thermometer
SAMPLES = 1000  # of the bootstrap


@dataclass(frozen=True, eq=False)
class TemperatureLaw:
    """A channel against temperature: means (m,) at temperatures (m,), and the line about their mean temperature.

    Units are those of the channel, rad/s or m/s^2; `interval95` belongs to `slope`.
    """

    name: str
    temperature_c: np.ndarray
    mean: np.ndarray
    reference_c: float
    offset: float
    slope: float
    interval95: tuple[float, float]


def temperature_laws(
    names: Sequence[str], columns: np.ndarray, temperature_c: np.ndarray, rows: Sequence[slice], step_s: float
) -> tuple[TemperatureLaw, ...]:
    """The law of each channel over stretches at rest; nothing where the temperature hardly changes.

    Parameters
    ----------
    columns : (channels, n) rates and specific forces
    temperature_c : (n,) or (n, 3), of gyros and accelerometers x, y, z
    rows : the stretches at rest
    """
    size = max(1, round(BLOCK_S / step_s))
    temperature_c = np.asarray(temperature_c, dtype=float).reshape(columns.shape[1], -1)
    blocks = [slice(a, a + size) for r in rows for a in range(r.start, r.stop - size + 1, size)]
    if len(blocks) < FEWEST:
        return ()
    warmth = np.array([temperature_c[b].mean(axis=0) for b in blocks])
    means = np.array([columns[:, b].mean(axis=1) for b in blocks])
    if np.ptp(warmth, axis=0).min() < LEAST_RANGE_C or not np.isfinite(means).all():
        return ()
    return tuple(
        _law(name, warmth[:, k % 3 if warmth.shape[1] == 3 else 0], means[:, k])
        for k, name in enumerate(names[: len(columns)])
    )


def _law(name: str, temperature_c: np.ndarray, mean: np.ndarray) -> TemperatureLaw:
    middle = float(temperature_c.mean())
    x = temperature_c - middle
    power = float(x @ x)
    slope = float(x @ mean) / power
    rest = mean - mean.mean() - slope * x
    count = len(x)
    run = _memory(rest)
    rng = np.random.default_rng(0)
    begins = rng.integers(0, count, (SAMPLES, -(-count // run)))
    drawn = rest[((begins[:, :, None] + np.arange(run)) % count).reshape(SAMPLES, -1)[:, :count]]
    low, high = np.quantile((drawn - drawn.mean(axis=1, keepdims=True)) @ x / power, [0.025, 0.975])
    return TemperatureLaw(
        name, temperature_c, mean, middle, float(mean.mean()), slope, (slope - float(high), slope - float(low))
    )


def _memory(rest: np.ndarray) -> int:
    """Length of the runs: twice the sum of correlations up to the first that is not positive, at most a quarter."""
    power = float(rest @ rest)
    total = 1.0
    for lag in range(1, len(rest) // 4):
        rho = float(rest[lag:] @ rest[:-lag]) / power if power > 0.0 else 0.0
        if rho <= 0.0:
            break
        total += 2.0 * rho
    return int(np.clip(round(2.0 * total), 1, max(1, len(rest) // 4)))
