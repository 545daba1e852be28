"""Small computations that only the page of Paper A needs: seconds, from the laboratory and the default flight.

Whatever is random is drawn from the seed of the run. Values of single units are given as their median and the
central 95 % of them.
"""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Any

import numpy as np

from ins_eval.accelerometer import Accelerometer, Population, ThermalRun
from ins_eval.accelerometer.creep import epoxy
from ins_eval.calibration.branches import branches
from ins_eval.calibration.fits import LINE, REFERENCE_C, polynomial
from ins_eval.calibration.four_point import four_point
from ins_eval.ensemble import World, oven
from ins_eval.imu import Mission
from ins_eval.laboratory import Chamber, draw_printed_units, magnet
from ins_eval.laboratory.creep_rig import CreepRig, statistics
from ins_eval.metrics import root_mean_square, velocity_rms
from ins_eval.output_equation import SENSOR_AXES, specific_force_g
from ins_eval.profile import load
from ins_eval.streams import Streams
from ins_eval.studies.paper_a.printed import PRINTED
from ins_eval.studies.paper_a.single import FIRST, SECOND, central
from ins_eval.thermal import filtered_rate, imu_temperature
from ins_eval.trajectory import Trajectory

PROFILE = "climb-cruise-landing"
DRAWS = 10  # of everything that is left to chance, for each of the three printed units
POSITION_INSTRUMENTS = 20  # whose oven runs are navigated again for their positions
POSITION_AXES = ("east", "north", "horizontal")
EXPERIMENTS = 500  # of the creep rig
BRANCH_C = 40.0  # where both branches of the chamber's cycle are fully developed
FLIGHT_STEP = 10  # seconds between points of the flight
HIGH_ORDER = ((2, 1), (2, 2), (1, 2))  # powers of r and of dT of the terms that eq. (11) leaves out


@functools.cache
def compute(seed: int) -> dict[str, Any]:
    """All of them, by subject."""
    streams = Streams(seed).at("paper_a")
    units = [unit for draw in range(DRAWS) for unit in draw_printed_units(streams.at("unit", draw)).values()]
    flight = Mission(load(PROFILE), 1.0)
    return {
        "thermal": thermal(flight),
        "scale": scale(units),
        "bias": bias(units, streams.at("bias")),
        "high_order": high_order(units, flight.run, streams.at("flight")),
        "creep": creep(streams),
        "model": full_model(streams.at("model").rng()),
        "oven_position": oven_position(seed),
    }


def thermal(flight: Mission) -> dict[str, float]:
    """Temperatures of the IMU over the flight, in degC, s and degC/min."""
    time_s, temperature_c = flight.temperature.time_s, flight.temperature.temperature_c
    rate = 60.0 * np.gradient(temperature_c, time_s)
    of = PRINTED["flight"]
    climb_s, landing_s = 60.0 * of["climb_min"], 60.0 * of["climb_min"] + 3600.0 * of["cruise_h"]
    flying, cruise = time_s >= 0.0, (time_s >= climb_s) & (time_s < landing_s)
    early, late = flying & (time_s < of["early_late_s"]), time_s >= of["early_late_s"]
    peak = temperature_c.argmax()
    cold = flight.profile.thermal.model_copy(update={"anchor": None, "self_heating_c": 0.0})
    unheated = imu_temperature(Trajectory(flight.profile.model_copy(update={"thermal": cold}))).temperature_c
    return {
        "start_c": temperature_c[0],
        "peak_c": temperature_c[peak],
        "peak_s": time_s[peak],
        "cruise_start_c": np.interp(climb_s, time_s, temperature_c),
        "cruise_end_c": np.interp(landing_s, time_s, temperature_c),
        "end_c": temperature_c[-1],
        "rise_c": temperature_c[peak] - temperature_c[0],
        "rise_without_own_heat_c": unheated.max() - unheated[0],
        "landing_rise_c": temperature_c[-1] - temperature_c[time_s >= landing_s].min(),
        "falling_share_of_cruise": np.mean(rate[cruise] < 0.0),
        "mean_rate": np.abs(rate[flying]).mean(),
        "mean_rate_cruise": np.abs(rate[cruise]).mean(),
        "max_rate": np.abs(rate[flying]).max(),
        "early_rate": np.abs(rate[early]).mean(),
        "late_rate": np.abs(rate[late]).mean(),
        "early_range_c": np.ptp(temperature_c[early]),
        "late_range_c": np.ptp(temperature_c[late]),
        "farthest_from_reference_c": np.abs(temperature_c[flying] - REFERENCE_C).max(),
    }


def scale(units: list[Accelerometer]) -> dict[str, Any]:
    """True scale factor in the chamber at the slowest ramp: change over the cycle, loop, and what opens it."""
    chamber = Chamber(rates_c_per_min=(min(PRINTED["chamber"]["rates_c_per_min"]),))
    run = chamber.thermal_run(chamber.rates_c_per_min[0])
    change, total, by_magnet, by_rate, by_reading = [], [], [], [], []
    for unit in units:
        opening = magnet.opening(unit, chamber, at_c=BRANCH_C)
        total.append(opening.total_ppm[0])
        by_magnet.append(opening.magnet_ppm[0])
        by_rate.append(opening.rate_ppm[0])
        by_reading.append(opening.reading_ppm[0])
        curve = unit.slow(run, Streams(0)).scale
        change.append(1e6 * (curve[run.temperature_c.argmin()] - curve[run.temperature_c.argmax()]) / curve.mean())
    total = np.array(total)
    return {
        "cold_minus_hot_ppm": central(change),
        "falls_share": float(np.mean(np.array(change) > 0.0)),
        "falling_minus_rising_ppm": central(total),
        "falling_upper_share": float(np.mean(total > 0.0)),
        "magnet_share": central(by_magnet / total),
        "rate_share": central(by_rate / total),
        "reading_share": central(by_reading / total),
    }


def bias(units: list[Accelerometer], streams: Streams) -> dict[str, Any]:
    """How much of the variance of K0 in the chamber curves leave open (%), and what opens its loop."""
    chamber = Chamber()
    open_percent: dict[str, list[float]] = {"line": [], "curve": [], "branches": []}
    creep_share, slope = [], []
    for k, unit in enumerate(units):
        p = four_point(chamber.measure(unit, streams.at("unit", k)))
        still = np.zeros(p.temperature_c.size)
        fits = {
            "line": polynomial(p.temperature_c, p.rate_c_per_min, p.bias_ug, LINE).evaluate(p.temperature_c, still),
            "curve": branches(p.temperature_c, still, p.bias_ug).evaluate(p.temperature_c, still),
            "branches": branches(p.temperature_c, p.rate_c_per_min, p.bias_ug).evaluate(
                p.temperature_c, p.rate_c_per_min
            ),
        }
        for name, fitted in fits.items():
            open_percent[name].append(100.0 * np.var(p.bias_ug - fitted) / np.var(p.bias_ug))
        slope.append(abs(unit.units["bias_temperature"][0]))
        creep_share.append(_creep_share(unit, chamber, streams.at("unit", k)))
    return {
        **{f"open_by_{name}_percent": central(values) for name, values in open_percent.items()},
        "creep_share": central(creep_share),
        "slope_ug_per_c": central(slope),
    }


def _creep_share(unit: Accelerometer, chamber: Chamber, streams: Streams) -> float:
    """Part of the opening of the bias loop at `BRANCH_C` that is creep; the rest is the lag of the elements."""
    run = chamber.thermal_run(min(PRINTED["chamber"]["rates_c_per_min"]))
    for effect in unit.effects:
        run = effect.inside(run)
    node = streams.at("creep_share")
    gaps = {
        effect.name: _gap(run, effect.contribution(unit.units[effect.name], run, node.at(effect.name)).bias_ug)
        for effect in unit.effects
        if effect.name in ("bias_temperature", "creep")
    }
    return gaps["creep"] / sum(gaps.values())


def _gap(run: ThermalRun, values: np.ndarray) -> float:
    """Falling minus rising branch at `BRANCH_C`."""
    surface_c, values = run.temperature_c, np.broadcast_to(values, run.time_s.shape)  # an effect that is off is 0
    coldest, hottest = surface_c.argmin(), surface_c.argmax()
    rising = np.interp(BRANCH_C, surface_c[coldest:hottest], values[coldest:hottest])
    return float(np.interp(BRANCH_C, surface_c[:hottest:-1], values[:hottest:-1]) - rising)


def high_order(units: list[Accelerometer], run: ThermalRun, streams: Streams) -> dict[str, Any]:
    """Least squares of all nine terms of the squared eq. (7) on the true scale factor over the flight.

    Coefficients of the terms that the paper omits, as sizes, in pulse/(g s), degC and degC/min, and in parts of
    gamma; and the most that the three together do in the flight, ppm.
    """
    time_s, temperature_c = run.time_s[::FLIGHT_STEP], run.temperature_c[::FLIGHT_STEP]
    rate, difference = filtered_rate(time_s, temperature_c), temperature_c - REFERENCE_C
    powers = [(i, j) for j in (2, 1, 0) for i in (2, 1, 0)]
    design = np.column_stack([rate**i * difference**j for i, j in powers])
    omitted = [powers.index(power) for power in HIGH_ORDER]
    length = np.linalg.norm(design, axis=0)
    sizes, relative, most = [], [], []
    for k, unit in enumerate(units):
        curve = unit.slow(run, streams.at("unit", k)).scale[::FLIGHT_STEP]
        found = np.linalg.lstsq(design / length, curve, rcond=None)[0] / length
        sizes.append(np.abs(found[omitted]))
        relative.append(np.abs(found[omitted]) / unit.gamma)
        most.append(1e6 * np.abs(design[:, omitted] @ found[omitted]).max() / unit.gamma)
    names = ("rate2_difference", "rate2_difference2", "rate_difference2")
    return {
        **{f"{name}": central(values) for name, values in zip(names, np.transpose(sizes), strict=True)},
        **{f"{name}_of_gamma": central(values) for name, values in zip(names, np.transpose(relative), strict=True)},
        "most_ppm": central(most),
        "condition": float(np.linalg.cond(design / length)),
    }


def creep(streams: Streams) -> dict[str, Any]:
    """The virtual creep rig: relaxations of the first repetition, and the scatter of repeated experiments."""
    rig = CreepRig()
    first = rig.first()
    virtual = rig.repeated(streams, EXPERIMENTS)
    variation = {name: statistics(getattr(virtual, name)).variation_percent for name in ("creep_um", "thermal_um")}
    temperature_c = epoxy()["temperature_c"]
    return {
        "elongation_um": [float(r.elongation_um[-1]) for r in first],
        "stable_after_min": [r.stable_after_min for r in first],
        "finished_share": rig.finished_share().tolist(),
        **{f"{name}_variation_percent": [central(column) for column in values.T] for name, values in variation.items()},
        "container_c": temperature_c.tolist(),
    }


def full_model(rng: np.random.Generator) -> dict[str, float]:
    """Eq. (1) with every coefficient of the order of Table 5, 30 ug/g^n and 30 urad, at forces of up to 2 g.

    `forward` is the largest relative difference of the simulated accelerometers from the equation as printed,
    `inverse` the largest error in g of getting the force back, `neglected_ug` what eq. (5) leaves that neglects all
    but K0 and K1, `compensated` what eq. (5) leaves of eq. (2), in g.
    """
    population = Population.load()
    sizes = dict.fromkeys(type(population["nonlinearity"]).model_fields, 30.0)
    triad = population.replacing(population["nonlinearity"].model_copy(update=sizes)).draw(Streams(0).at("eq1"))
    coefficients = [unit.units["nonlinearity"] for unit in triad]
    force, k0_ug = rng.uniform(-2.0, 2.0, (200, 3)), 150.0
    k1 = np.array([unit.gamma for unit in triad])
    output = np.column_stack([unit.output(force, unit.gamma, k0_ug) for unit in triad])
    printed = np.empty_like(output)
    for axis, (c, unit) in enumerate(zip(coefficients, triad, strict=True)):
        ai, ap, ao = force[:, SENSOR_AXES[unit.axis]].T
        k2, k3, kip, kio, delta_o, delta_p = 1e-6 * np.array(c)
        e = 1e-6 * k0_ug + ai + k2 * ai**2 + k3 * ai**3 + kip * ai * ap + kio * ai * ao + delta_o * ap + -delta_p * ao
        printed[:, axis] = k1[axis] * e
    simple = k1 * (1e-6 * k0_ug + force)
    return {
        "forward": float(np.abs(output / printed - 1.0).max()),
        "inverse": float(np.abs(specific_force_g(coefficients, output, k1, k0_ug) - force).max()),
        "neglected_ug": float(1e6 * np.abs(output / k1 - 1e-6 * k0_ug - force).max()),
        "compensated": float(np.abs(simple / k1 - 1e-6 * k0_ug - force).max()),
    }


def oven_position(seed: int) -> dict[str, Any]:
    """Ten oven runs of some instruments, attitude given: what refined hysteresis takes off the RMS of position, %.

    For east, north and horizontal: `best_*` in the run whose horizontal velocity RMS shrinks most and `median_*` in
    the median run, medians and central 95 % of the instruments; `improved_*`: share of all runs in which it shrinks.
    """
    world = World(replace(oven.PLAN, arms=(FIRST, SECOND), seed=seed))
    velocity = np.empty((POSITION_INSTRUMENTS, oven.RUNS, 2))
    position = np.empty((POSITION_INSTRUMENTS, oven.RUNS, 2, len(POSITION_AXES)))
    for index, run in np.ndindex(velocity.shape[:2]):
        errors = oven.errors_of_run(world, index, run)
        for k, of_arm in enumerate(errors[arm] for arm in (FIRST, SECOND)):
            velocity[index, run, k] = velocity_rms(of_arm.velocity_n, of_arm.valid).horizontal
            horizontal = np.hypot(of_arm.east_m, of_arm.north_m)
            position[index, run, k] = root_mean_square(np.array([of_arm.east_m, of_arm.north_m, horizontal]))
    gain = 100.0 * (1.0 - position[:, :, 1] / position[:, :, 0])
    best = (velocity[..., 1] / velocity[..., 0]).argmin(axis=1)
    of_best = gain[np.arange(len(best)), best]
    found: dict[str, Any] = {"size": POSITION_INSTRUMENTS}
    for k, axis in enumerate(POSITION_AXES):
        found |= {
            f"best_{axis}": central(of_best[:, k]),
            f"median_{axis}": central(np.median(gain[..., k], axis=1)),
            f"improved_{axis}": float(np.mean(gain[..., k] > 0.0)),
        }
    return found
