"""What real recordings say of themselves without an error model: delays from a scan, laws of temperature from means."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmark.worlds.earth import gravity
from benchmark.worlds.into_data import DEG_PER_H, G0
from benchmark.worlds.recorded import ACCEL, ANGLES, DEG, GYRO, Recorded, attitudes

DELAYS_S = np.arange(-0.1, 0.6001, 0.01)
APART_S = 0.4  # of two fixes whose change of velocity is compared
BLOCKS = 10  # of a recording, each left out once
MEAN_S = 20.0  # of a parked unit


@dataclass(frozen=True)
class Scan:
    """RMS of what is left at each delay, (n,), and the delay at its least with a jackknife's sigma."""

    delay_s: np.ndarray
    rms: np.ndarray
    best_s: float
    sigma_s: float
    unit: str


@dataclass(frozen=True)
class Line:
    """Means of a channel over stretches against temperature, and the line through them with its slope's sigma."""

    name: str
    axis: str
    unit: str
    temperature_c: np.ndarray
    values: np.ndarray
    slope: float
    sigma: float


def velocity_scan(recorded: Recorded) -> Scan:
    """Changes of GPS velocity against specific force turned by the autopilot's attitude, both horizontal."""
    fixes, t, step_s = recorded.tables["gps"], recorded.time_s, recorded.step_s
    c = attitudes(recorded.tables["reference"], t - 0.5 * step_s)
    felt = np.einsum("nij,nj->ni", c, recorded.triad(ACCEL))
    start = recorded.head["start"]
    felt[:, 2] += gravity(start["latitude_deg"] * DEG, start["height_m"]) * step_s
    velocity = np.cumsum(felt, axis=0)[:, :2]
    at = fixes["time_s"]
    told = np.column_stack([fixes[f"velocity_{axis}_mps"] for axis in "ne"])
    later = np.searchsorted(at, at + APART_S - 1e-6)
    first = np.flatnonzero(later < at.size)
    later = later[first]
    near = np.abs(at[later] - at[first] - APART_S) < 0.5 * APART_S
    near &= (at[first] > t[0] + 1.0) & (at[later] < t[-1] - 1.0)
    first, later = first[near], later[near]
    left = []
    for delay in DELAYS_S:
        a, b = (np.column_stack([np.interp(at[k] - delay, t, one) for one in velocity.T]) for k in (first, later))
        left.append(np.sum((told[later] - told[first] - (b - a)) ** 2, axis=1))
    return _scan(np.array(left), "m/s")


def rate_scan(recorded: Recorded) -> Scan:
    """Turns of a better navigator against those of the gyros, less their mean difference; stamps late by a delay."""
    table, t = recorded.tables["reference"], recorded.time_s
    inside = (table["time_s"] > t[0] + 1.0) & (table["time_s"] < t[-1] - 1.0)
    at = table["time_s"][inside]
    c = attitudes({name: table[name] for name in ("time_s", *ANGLES)}, at)
    turned = np.einsum("nji,njk->nik", c[:-1], c[1:])
    told = np.column_stack([turned[:, 2, 1] - turned[:, 1, 2], turned[:, 0, 2] - turned[:, 2, 0],
                            turned[:, 1, 0] - turned[:, 0, 1]]) / 2.0  # fmt: skip
    angle = np.cumsum(recorded.triad(GYRO), axis=0)
    left = []
    for delay in DELAYS_S:
        felt = np.diff(np.column_stack([np.interp(at - delay, t, one) for one in angle.T]), axis=0)
        off = (told - felt) / np.diff(at)[:, None]
        left.append(np.sum((off - off.mean(axis=0)) ** 2, axis=1) / DEG**2)
    return _scan(np.array(left), "deg/s")


def _scan(square: np.ndarray, unit: str) -> Scan:
    """From squares of what is left (delays, pairs); the best delay by a parabola, its sigma by leaving blocks out."""
    total = square.mean(axis=1)
    blocks = np.array_split(np.arange(square.shape[1]), BLOCKS)
    best = [_lowest((total * square.shape[1] - square[:, rows].sum(axis=1)) / (square.shape[1] - rows.size))
            for rows in blocks]  # fmt: skip
    sigma = float(np.sqrt((BLOCKS - 1) / BLOCKS * np.sum((np.array(best) - np.mean(best)) ** 2)))
    return Scan(DELAYS_S, np.sqrt(total), _lowest(total), sigma, unit)


def _lowest(values: np.ndarray) -> float:
    """Delay of the least value, by the parabola through it and its neighbours."""
    k = int(np.clip(np.argmin(values), 1, values.size - 2))
    a, b, c = values[k - 1 : k + 2]
    curve = a - 2.0 * b + c
    shift = 0.5 * (a - c) / curve if curve > 0.0 else 0.0
    return float(DELAYS_S[k] + shift * (DELAYS_S[1] - DELAYS_S[0]))


def temperature_lines(recorded: Recorded, from_s: float) -> list[Line]:
    """Each channel of a parked unit against its thermometer, in means over `MEAN_S`; sigma from their scatter."""
    imu, t = recorded.tables["imu"], recorded.time_s
    use = t >= from_s
    block = ((t[use] - from_s) // MEAN_S).astype(int)
    count = np.bincount(block)
    mean = lambda x: np.bincount(block, x[use]) / count  # noqa: E731
    temperature, out = mean(imu["temperature_c"]), []
    whole = slice(0, -1)  # the last stretch is shorter
    for sensor, names, si, unit in (("accelerometer", ACCEL, 1e-6 * G0, "ug"), ("gyro", GYRO, DEG_PER_H, "deg/h")):
        for axis, name in zip("xyz", names, strict=True):
            values = mean(imu[name] / recorded.step_s / si)
            (slope, constant), covariance = np.polyfit(temperature[whole], values[whole], 1, cov=True)
            left = values[whole] - constant - slope * temperature[whole]
            slow = max(1.0, 1.0 + 2.0 * float(np.corrcoef(left[1:], left[:-1])[0, 1]))  # neighbours are alike
            out.append(Line(sensor, axis, unit, temperature[whole], values[whole], float(slope),
                            float(np.sqrt(covariance[0, 0] * slow))))  # fmt: skip
    return out


def earth_rate(recorded: Recorded, begin_s: float, end_s: float) -> float:
    """Magnitude of the mean rate of three gyros at rest, rad/s."""
    t = recorded.time_s
    rows = (t > begin_s) & (t <= end_s)
    return float(np.linalg.norm(recorded.triad(GYRO)[rows].sum(axis=0) / recorded.step_s[rows].sum()))


def longest_quiet(recorded: Recorded, seconds: float) -> tuple[float, float]:
    """Begin and end of the stretch of that length in which the gyros scatter least."""
    rows = round(seconds / float(np.median(recorded.step_s)))
    second = round(1.0 / float(np.median(recorded.step_s)))
    n = recorded.time_s.size // second * second
    scatter = recorded.triad(GYRO)[:n].reshape(-1, second, 3).std(axis=1).sum(axis=1)
    window = np.convolve(scatter, np.ones(rows // second), "valid")
    k = int(np.argmin(window)) * second
    return float(recorded.time_s[k]), float(recorded.time_s[min(k + rows, recorded.time_s.size - 1)])
