"""A thermal chamber with an index head: one accelerometer, in four positions, at some ramps."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from benchmark.worlds import noise
from benchmark.worlds.earth import G0
from benchmark.worlds.heat import filtered_rate, lag, readings
from benchmark.worlds.instruments import Departures, Felt, element_temperature, scale_factor
from benchmark.worlds.noise import log_uniform
from benchmark.worlds.record import Made, Unit

POSITIONS = (1.0, 0.0, -1.0, 0.0)


def a_run(rng, time_s, ramp: float, low: float, high: float, up: bool, interval: float):
    """Commanded temperature and ramp of one stay: soak, ramp over, soak, ramp back."""
    first, second = (low, high) if up else (high, low)
    soak, ride = rng.uniform(600, 1500), abs(high - low) / ramp * 60.0
    knots = np.cumsum([0.0, soak, ride, soak, ride, 0.5 * soak])
    at = np.arange(0.0, knots[-1], interval)
    chamber = np.interp(at, knots, [first, first, second, second, first, first])
    rate = np.zeros(at.size)
    rate[(at > knots[1]) & (at <= knots[2])] = np.sign(second - first) * ramp
    rate[(at > knots[3]) & (at <= knots[4])] = np.sign(first - second) * ramp
    return at, chamber, rate


def a_chamber(
    rng, unit: Unit, axis: str, effects=(), ramps: tuple[float, ...] | None = None, positions=POSITIONS, name="chamber"
) -> Made:
    """A chamber recording of accelerometer `axis`, in which `effects` act; memory starts anew with each run."""
    i, sheet, true = "xyz".index(axis), unit.sheet, unit.noise
    quiet = true["accel_bias"] == 0.0
    ramps = ramps or tuple(sorted(rng.choice((0.2, 0.35, 0.5, 1.0), int(rng.integers(1, 4)), replace=False)))
    low, high = rng.uniform(-30.0, 5.0), rng.uniform(45.0, 65.0)
    interval = float(rng.choice((10.0, 20.0, 30.0)))
    tau_element = rng.uniform(100.0, 500.0)
    white_ug, shift_ug = (0.0, 0.0) if quiet else (log_uniform(rng, 2, 10) * true["vrw"] ** 0.3, log_uniform(rng, 2, 8))
    turn_on = sheet["accel_bias_ug"] * noise.turn_on(rng, true["accel_bias"])[0]
    one = unit.belief[axis]
    rows: dict[str, list] = {key: [] for key in ("time_s", "run", "input_g", "rate_c_per_min", "temperature_c",
                                                 "output", "chamber_c")}  # fmt: skip
    clock, run, felts, all_departures = interval, 0, [], []
    for ramp in ramps:
        for position, force in enumerate(positions):
            at, chamber, rate = a_run(rng, clock, ramp, low, high, True, interval)
            true_c = lag(gaussian_filter1d(chamber, max(60.0 / interval, 1.0), mode="nearest"), interval, tau_element)
            temperature = np.repeat(true_c[:, None], 3, axis=1)
            others = np.zeros((at.size, 3))
            others[:, i] = force
            others[:, (i + 2) % 3] = {1: 1.0, 3: -1.0}.get(position, 0.0)
            felt = Felt("chamber", None, at + interval, interval, np.zeros((at.size, 3)), others * G0 * interval,
                        temperature, filtered_rate(temperature, interval, 180.0), ())  # fmt: skip
            departures = Departures()
            for effect in effects:
                if "begin" in getattr(effect, "parameters", {}):
                    effect.parameters["begin"] = float(np.round(rng.uniform(-1, 1), 2))
                effect(felt, departures)
            ug = turn_on + shift_ug * rng.standard_normal() + white_ug * rng.standard_normal(at.size)
            ug = ug + (np.zeros((at.size, 3)) + departures.accel_ug)[:, i]
            ppm = (np.zeros((at.size, 3)) + departures.accel_ppm)[:, i]
            element, element_rate = element_temperature(felt, departures, 180.0)
            difference = element[:, i] - 22.0
            k1 = scale_factor(one["scale"], difference, element_rate[:, i]) + one["scale"]["gamma"] * 1e-6 * ppm
            k0 = one["bias"]["k0_ug"] + one["bias"]["omega_ug_per_c"] * difference + ug
            output = np.rint(k1 * (k0 * 1e-6 + force))  # counts of a gate of one second
            thermometer = true["thermometer"] and true["thermometer"] | {"lag_s": 0.0, "period_s": interval}
            reading = readings(rng, true_c[:, None], interval, thermometer)[:, 0]
            for key, values in zip(rows, (at + clock, np.full(at.size, run), np.full(at.size, force), rate, reading,
                                          output, chamber), strict=True):  # fmt: skip
                rows[key].append(values)
            felts.append(felt)
            all_departures.append(departures)
            clock, run = clock + at[-1] + rng.uniform(1800, 7200) // interval * interval, run + 1
    columns = {key: np.concatenate(values) for key, values in rows.items()}
    columns["run"] = columns["run"].astype(np.int64)
    if rng.random() < 0.4:
        del columns["chamber_c"]
    head = {
        "format": "ins-recording/1", "kind": "chamber", "name": name,
        "accelerometer": {"reference_temperature_c": 22.0, "rate_filter_s": 180.0,
                          "bias_sigma_ug": sheet["accel_bias_ug"], axis: one},
    }  # fmt: skip
    errors = {"felts": felts, "departures": all_departures, "axis": axis, "white_ug": white_ug, "shift_ug": shift_ug}
    drawn = {"accel_turn_on_ug": turn_on, "axis": axis, "ramps": list(ramps)}
    return Made(name, "chamber", "chamber", 1.0 / interval, head, {"chamber": columns}, None, Departures(), unit,
                errors, drawn)  # fmt: skip
