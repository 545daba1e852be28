"""Temperature of the instrument: an ODE of two nodes, the filter that defines dT/dt, and the thermometer."""

from __future__ import annotations

import numba
import numpy as np
from scipy.interpolate import CubicSpline

from benchmark.worlds.world import Path


@numba.njit(cache=True)
def _two_nodes(around, start, tau_shell, tau_core, warm_shell, warm_core, step):
    """Shell and core between which heat flows; Runge-Kutta of fourth order, surroundings straight between steps."""
    n = around.size
    out = np.empty((n, 2))
    s, c = start[0], start[1]
    for k in range(n):
        out[k, 0], out[k, 1] = s, c
        if k + 1 == n:
            break
        a, b = around[k], around[k + 1]
        ks, kc = np.zeros(4), np.zeros(4)
        for j in range(4):
            u = 0.0 if j == 0 else (1.0 if j == 3 else 0.5)
            x = s + (0.0 if j == 0 else u * step * ks[j - 1])
            y = c + (0.0 if j == 0 else u * step * kc[j - 1])
            ks[j] = (a + u * (b - a) - x) / tau_shell + 0.5 * (y - x) / tau_core + warm_shell
            kc[j] = (x - y) / tau_core + warm_core
        s += step / 6.0 * (ks[0] + 2 * ks[1] + 2 * ks[2] + ks[3])
        c += step / 6.0 * (kc[0] + 2 * kc[1] + 2 * kc[2] + kc[3])
    return out


@numba.njit(cache=True)
def _lag(signal, dt, tau, start):
    """tau y' = x - y, exact for x straight between samples dt apart."""
    y = np.empty(signal.size)
    y[0] = start
    decay = np.exp(-dt / tau)
    for k in range(1, signal.size):
        slope = (signal[k] - signal[k - 1]) / dt
        y[k] = signal[k] - slope * tau + (y[k - 1] - signal[k - 1] + slope * tau) * decay
    return y


def lag(signal: np.ndarray, dt: float, tau: float, start: float | None = None) -> np.ndarray:
    """First-order lag of (n,) or of each column of (n, m)."""
    if signal.ndim == 2:
        return np.column_stack([lag(column, dt, tau, start) for column in signal.T])
    signal = np.ascontiguousarray(signal)
    return _lag(signal, dt, tau, signal[0] if start is None else start)


def filtered_rate(temperature: np.ndarray, dt: float, tau: float) -> np.ndarray:
    """The rate of docs/recording.md, degC/min, of readings dt apart."""
    return 60.0 * (temperature - lag(temperature, dt, tau)) / tau


def surroundings(rng: np.random.Generator, kind: str, truth: Path) -> np.ndarray:
    """Temperature around the instrument each second, degC."""
    time_s = np.arange(0.0, truth.duration_s + 1.5)
    if kind in ("flight", "drive"):
        ground, lapse = rng.uniform(2.0, 33.0), rng.uniform(5.0, 7.2) * 1e-3
        lla, velocity, _, _ = truth.state(np.minimum(time_s, truth.duration_s))
        heating = 0.85 * np.sum(velocity**2, axis=1) / 2009.4
        return ground - lapse * (lla[:, 2] - lla[0, 2]) + heating
    if kind == "static":
        base, slow = rng.uniform(15.0, 30.0), rng.uniform(0.2, 2.0)
        return base + slow * np.sin(2 * np.pi * (time_s / rng.uniform(2000.0, 9000.0) + rng.random()))
    # oven: ramps and stays
    level = rng.uniform(15.0, 30.0)
    knots, levels = [0.0, rng.uniform(200, 600)], [level, level]
    while knots[-1] < time_s[-1]:
        target = rng.uniform(-25.0, 65.0)
        knots.append(knots[-1] + abs(target - levels[-1]) / (rng.choice((0.2, 0.35, 0.5, 0.8, 1.0)) / 60.0))
        levels.append(target)
        if rng.random() < 0.6:
            knots.append(knots[-1] + rng.uniform(300, 1200))
            levels.append(target)
    return np.interp(time_s, knots, levels)


def temperatures(rng: np.random.Generator, kind: str, truth: Path, time_s: np.ndarray, apart: bool) -> np.ndarray:
    """True temperature of the three accelerometers at `time_s`, (n, 3) degC; the same in all unless `apart`."""
    around = surroundings(rng, kind, truth)
    quick = 0.5 if kind == "oven" else 1.0
    shell, core = quick * rng.uniform(500, 1500), quick * rng.uniform(900, 3000)
    warm = rng.uniform(0.0, 8.0)
    begin = around[0] + rng.uniform(0.0, 0.7) * warm
    nodes = _two_nodes(around, np.array((begin, begin)), shell, core, warm / shell, 0.3 * warm / core, 1.0)
    share = np.array((0.5, 0.5, 0.5)) + (rng.uniform(-0.35, 0.35, 3) if apart else 0.0)
    spline = CubicSpline(np.arange(len(around), dtype=float), nodes)(time_s)
    return spline[:, :1] * (1.0 - share) + spline[:, 1:] * share


def readings(rng: np.random.Generator, true: np.ndarray, dt: float, spec: dict | None) -> np.ndarray:
    """What the thermometers say of `true` (n, m): lagged, noisy, in steps, held; exact where `spec` is None."""
    if spec is None:
        return true.copy()
    felt = lag(true, dt, spec["lag_s"]) if spec["lag_s"] > 0 else true
    every = max(round(spec["period_s"] / dt), 1)
    held = felt[::every] + spec["noise_c"] * rng.standard_normal(felt[::every].shape)
    held = np.round(held / spec["step_c"]) * spec["step_c"] if spec["step_c"] > 0 else held
    return np.repeat(held, every, axis=0)[: len(true)]
