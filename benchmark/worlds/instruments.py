"""The unit itself: accelerometers in pulses, gyros in increments, both with all that nature adds."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numba
import numpy as np

from benchmark.worlds import noise
from benchmark.worlds.earth import G0
from benchmark.worlds.heat import filtered_rate, lag
from benchmark.worlds.world import Path

UG = 1e-6 * G0
DEG_PER_H = math.pi / 180.0 / 3600.0
TERMS = ("gamma", "mu", "beta", "epsilon", "eta", "alpha")


@dataclass
class Felt:
    """What acts on the instrument, one row a sample; `temperature` and `rate` are the true ones of each element."""

    kind: str
    truth: Path
    time_s: np.ndarray
    dt: float
    angle: np.ndarray
    velocity: np.ndarray
    temperature: np.ndarray
    rate: np.ndarray
    phases: tuple
    extra: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def force_g(self) -> np.ndarray:
        return self.velocity / (self.dt * G0)

    @property
    def turn(self) -> np.ndarray:
        """rad/s, (n, 3)."""
        return self.angle / self.dt


@dataclass
class Departures:
    """True minus believed: what effects add. Arrays are per sample and axis; the rest holds for the recording."""

    accel_ug: np.ndarray | float = 0.0
    accel_ppm: np.ndarray | float = 0.0
    gyro_deg_per_h: np.ndarray | float = 0.0
    element_lag_s: np.ndarray = field(default_factory=lambda: np.zeros(3))
    attitude_rad: np.ndarray = field(default_factory=lambda: np.zeros(3))  # rotation about north, east, down
    lever_m: np.ndarray = field(default_factory=lambda: np.zeros(3))
    gps_offset_s: float = 0.0
    reference_offset_s: float = 0.0
    reference_rad: np.ndarray = field(default_factory=lambda: np.zeros(3))
    gps_velocity: object = None  # function of (felt, time_s) -> (n, 3) m/s north, east, down
    gps_position: object = None
    earth: tuple[str, ...] = ()  # flags that the belief sets false
    extra_columns: dict[str, np.ndarray] = field(default_factory=dict)


def believe(rng: np.random.Generator, sheet: dict, plain_model: bool = False) -> dict:
    """A believed instrument: eq. (11) and (4) for each axis."""
    out = {}
    for axis in "xyz":
        gamma = round(sheet["gamma"] * (1.0 + 0.004 * rng.standard_normal()), 1)
        ppm = gamma * 1e-6
        scale = {"gamma": gamma, "mu": ppm * rng.normal(-90.0, 30.0)}
        if not plain_model:
            scale |= {
                "beta": ppm * rng.normal(0.3, 0.15), "epsilon": ppm * rng.normal(100.0, 80.0),
                "eta": ppm * rng.normal(0.0, 1.0), "alpha": ppm * rng.normal(0.0, 80.0),
            }  # fmt: skip
        scale = {key: float(f"{value:.6g}") if key != "gamma" else value for key, value in scale.items()}
        bias = {"k0_ug": round(rng.normal(0.0, 1500.0), 2), "omega_ug_per_c": round(rng.normal(0.0, 12.0), 3)}
        out[axis] = {"scale": scale, "bias": bias}
    return out


def scale_factor(coefficients: dict, difference, rate):
    """K1 of eq. (11), pulse/(g s)."""
    c = {term: coefficients.get(term, 0.0) for term in TERMS}
    return (
        c["gamma"] + c["mu"] * difference + c["beta"] * difference**2 + c["epsilon"] * rate
        + c["eta"] * difference * rate + c["alpha"] * rate**2
    )  # fmt: skip


@numba.njit(cache=True)
def _count(output):
    """Whole counts of (n, 3); what is left over goes into the next sample."""
    out = np.empty(output.shape)
    for i in range(output.shape[1]):
        rest = 0.0
        for k in range(output.shape[0]):
            total = output[k, i] + rest
            out[k, i] = np.rint(total)
            rest = total - out[k, i]
    return out


def element_temperature(felt: Felt, departures: Departures, tau: float) -> tuple[np.ndarray, np.ndarray]:
    """Temperature and its rate at each element; late where the belief is that they are not."""
    if not departures.element_lag_s.any():
        return felt.temperature, felt.rate
    temperature, rate = felt.temperature.copy(), felt.rate.copy()
    for i, late in enumerate(departures.element_lag_s):
        if late > 0.0:
            temperature[:, i] = lag(felt.temperature[:, i], felt.dt, late)
        elif late < 0.0:  # the thermometer is the late one: the elements run ahead of it
            smooth = np.gradient(felt.temperature[:, i], felt.dt)
            temperature[:, i] += -late * smooth
        rate[:, i] = filtered_rate(temperature[:, i], felt.dt, tau)
    return temperature, rate


def slow(felt: Felt, rng, sigma, tau, flick, walk):
    """Slow random forms made each second and straight between, (n, 3); they begin at zero, for the turn-on value."""
    n = int(felt.time_s[-1]) + 3
    total = np.zeros((n, 3))
    if sigma > 0:
        total += noise.markov(rng, n, 1.0, sigma, tau)
    if flick > 0:
        total += noise.flicker(rng, n, 1.0, flick)
    if walk > 0:
        total += noise.walk(rng, n, 1.0, walk)
    if not (sigma or flick or walk):
        return 0.0
    at = np.arange(n, dtype=float)
    return np.column_stack([np.interp(felt.time_s, at, total[:, i]) for i in range(3)])


def gyro_increments(felt: Felt, departures: Departures, sheet: dict, true: dict, rng) -> tuple[np.ndarray, dict]:
    """Indicated angle over each sample, (n, 3) rad, and what was drawn."""
    n, dt = felt.angle.shape[0], felt.dt
    turn_on = sheet["gyro_bias_deg_per_h"] * noise.turn_on(rng, true["gyro_bias"])
    wander = slow(felt, rng, true["gyro_wander_deg_per_h"], true["gyro_wander_tau_s"],
                  true["gyro_flicker_deg_per_h"], true["gyro_walk_deg_per_h"])  # fmt: skip
    error = (turn_on + wander + departures.gyro_deg_per_h) * DEG_PER_H * dt
    arw = true["arw"] * sheet["arw_deg_per_sqrt_h"] * math.pi / 180.0 / 60.0
    out = felt.angle + error
    if arw > 0:
        out = out + arw * math.sqrt(dt) * noise.white(rng, n)
    if true["gyro_quantum_rad"] > 0:
        out = _count(out / true["gyro_quantum_rad"]) * true["gyro_quantum_rad"]
    return out, {"gyro_turn_on_deg_per_h": turn_on.tolist()}


def accelerometer_output(felt, departures, belief, sheet, true, rng, pulses=True, t0=22.0, tau=180.0):
    """Counts (n, 3) over each sample, or m/s where `pulses` is false; and what was drawn."""
    n, dt = felt.velocity.shape[0], felt.dt
    turn_on = sheet["accel_bias_ug"] * noise.turn_on(rng, true["accel_bias"])
    wander = slow(felt, rng, true["accel_wander_ug"], true["accel_wander_tau_s"],
                  true["accel_flicker_ug"], true["accel_walk_ug"])  # fmt: skip
    ug = turn_on + wander + departures.accel_ug
    vrw = true["vrw"] * sheet["vrw_ug_per_sqrt_hz"]
    if vrw > 0:
        ug = ug + vrw / math.sqrt(dt) * noise.white(rng, n)
    ppm = np.broadcast_to(departures.accel_ppm, (n, 3))
    ug = np.broadcast_to(ug, (n, 3))
    drawn = {"accel_turn_on_ug": turn_on.tolist()}
    temperature, rate = element_temperature(felt, departures, tau)
    if not pulses:
        return (1.0 + 1e-6 * ppm) * (felt.velocity + ug * UG * dt), drawn
    out = np.empty((n, 3))
    for i, axis in enumerate("xyz"):
        one, difference = belief[axis], temperature[:, i] - t0
        k1 = scale_factor(one["scale"], difference, rate[:, i]) + one["scale"]["gamma"] * 1e-6 * ppm[:, i]
        k0 = one["bias"]["k0_ug"] + one["bias"]["omega_ug_per_c"] * difference + ug[:, i]
        out[:, i] = k1 * (k0 * 1e-6 * dt + felt.velocity[:, i] / G0)
    return _count(out), drawn


def compensated(counts, belief, reading, dt, t0=22.0, tau=180.0):
    """Specific velocity (n, 3) m/s as the belief reads the counts, for the oracle and the tests."""
    out = np.empty(counts.shape)
    for i, axis in enumerate("xyz"):
        one, difference = belief[axis], reading[:, i] - t0
        k1 = scale_factor(one["scale"], difference, filtered_rate(reading[:, i], dt, tau))
        k0 = one["bias"]["k0_ug"] + one["bias"]["omega_ug_per_c"] * difference
        out[:, i] = (counts[:, i] / k1 - k0 * 1e-6 * dt) * G0
    return out
