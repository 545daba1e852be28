"""A channel whose error follows the motion, or how its temperature changes, without a name.

A receiver's height is wrong in proportion to height (troposphere, datum) and its velocity while it turns (its tracking
loops lag); a sensor that feels the Earth's magnetic field errs with the sine of heading, or of twice the heading where
iron around it is soft; an accelerometer that sticks errs with the sign of the force along it, one that is not tight
with the pressure of the air, and one that is unevenly warm with how its rate of temperature changes.
The vocabulary has no such effects, so they are no explanation: what is found says where an explanation has to be
sought, and keeps named effects from taking its place.

With drives u the error of a channel of size s is s (c u + ...): of a heading psi, sin(k psi) and cos(k psi); of a force
f along the input axis, f / (|f| + `STICK`); of a height h, h - h(0) or p(h) - p(0) of the standard atmosphere, since a
first fix, or a calibration on the ground, holds what was there before; of a temperature T, its second derivative,
smoothed over `SMOOTH_S`; the last three, and the turning, of unit root mean square. What hardly changes is a constant,
and constants have names. Its evidence is that of `search`, at a noise of its own.

Sources: Kaplan and Hegarty, Understanding GPS/GNSS (tracking loops, troposphere); IEEE Std 952 (magnetic sensitivity
of a gyro); IEEE Std 528 (dead band); IEEE Std 1293 (pressure sensitivity of an accelerometer); ICAO Doc 7488 (standard
atmosphere).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ins_eval.diagnosis.unnamed import locate
from ins_eval.diagnosis.unnamed.disturbance import Suspect, with_quiet_sensors
from ins_eval.diagnosis.unnamed.mismatch import deviate
from ins_eval.error_model.drives import source, strength
from ins_eval.estimation.evidence import SCALES, Gained, log_evidence_of, mixture, reduce
from ins_eval.recording import PARKED
from ins_eval.thermal import standard_pressure
from ins_eval.units import STANDARD_GRAVITY

if TYPE_CHECKING:
    from ins_eval.diagnosis.unnamed.locate import Channel
    from ins_eval.error_model.columns import Column
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.noise_fit import Fitted
    from ins_eval.policy import Policy

SIGN = "the sign of the specific force along it"
PRESSURE = "the pressure of the air at its height"
WARMING = "how the rate of its temperature changes"
ANGLES = {"heading": 1.0, "twice the heading": 2.0}
DRIVERS = {
    "gps": ("height", "turning"),
    "accelerometer": (*ANGLES, SIGN, PRESSURE, WARMING),
    "gyro": (*ANGLES, WARMING),
}
OF_AXIS = (SIGN, WARMING)  # what each axis has of its own
STICK = (
    0.02 * STANDARD_GRAVITY
)  # specific force within which what sticks turns from one side to the other; by reasoning
SMOOTH_S = 30.0  # of a second derivative: below the minutes in which a housing warms, above its readings; by reasoning
LEAST_CHANGE = 0.1  # of a drive, whose size is about 1: its standard deviation; by reasoning


@dataclass(frozen=True)
class Dependence:
    """An error of `channel` that follows a `driver`."""

    channel: Channel
    driver: str
    columns: tuple[Column, ...]


def dependence(case: Case, r: int, base: Fitted, policy: Policy) -> Suspect | None:
    """The most probable channel of recording `r` that follows one of its `DRIVERS`; None where nothing moves."""
    if case.believed is None or case.kind in PARKED:
        return None
    tried = _forms(case)
    if not tried:
        return None
    known = slice(0, len(case.nuisances))
    cost = float(np.log(len(tried) / policy.odds)) + policy.alone
    columns = [column for one in tried for column in one.columns]
    starts = []
    for noise_point in (base.noise_point, with_quiet_sensors(case, base.noise_point)):
        whitened = case.whitened(columns, noise_point, case.blocks)
        left = reduce(whitened, known.stop)
        here = log_evidence_of(whitened, known) - 0.5 * float(noise_point @ noise_point)
        first = 0
        for one in tried:
            own = slice(first, first + len(one.columns))
            starts.append((here + _gain(left.normal[own, own], left.projection[own]).nats, noise_point, one))
            first = own.stop
    height, noise_point, best = max(starts, key=lambda start: start[0])
    if height - base.log_evidence < policy.promising:
        return None
    fitted = case.fitted(best.columns, replace(base, noise_point=noise_point), _gain)
    gained = fitted.log_evidence - base.log_evidence - cost
    edges_s = locate.edges(case.model)
    windows = list(locate.windows(best.channel, edges_s, case.slow, case.model))
    left = reduce(case.whitened(windows, fitted.noise_point, case.blocks), known.stop)
    found = locate.scan(left, [best.channel], edges_s)
    if not found:
        return None
    return Suspect(r, found[0], gained, 0.0 if gained > 0.0 else 1.0, deviate(gained), fitted, best.driver)


def _gain(a: np.ndarray, b: np.ndarray) -> Gained:
    """log B, every coefficient with the scales of `search`."""
    return mixture(a, b, [np.diag(scales) for scales in product(SCALES, repeat=b.size)])


def _forms(case: Case) -> list[Dependence]:
    """Every channel with every driver that it may follow and that changes."""
    found = []
    for channel in locate.channels(case):
        for driver in DRIVERS.get(channel.name.partition(".")[0], ()):
            drives = _drives(case, channel.axis, driver)
            if any(np.std(values) > LEAST_CHANGE for _, values in drives):
                names = _slow(case, drives, f"{driver} {channel.axis}" if driver in OF_AXIS else driver)
                found.append(Dependence(channel, driver, tuple(channel.column(name) for name in names)))
    return found


def _slow(case: Case, drives: list[tuple[np.ndarray, np.ndarray]], key: str) -> list[str]:
    """The names of the slow factors of the drives of one driver."""
    each = [partial(np.interp, xp=time_s, fp=values) for time_s, values in drives]
    return [case.slow.add(f"{key} {k}", of_time, case.model) for k, of_time in enumerate(each)]


def _drives(case: Case, axis: str, driver: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """What an error follows: instants and values; none of a temperature that was not recorded."""
    model, states = case.model, case.model.states
    if driver == SIGN:
        constant, driven = (model.integrals[:, source("accelerometer", "xyz".index(axis), of)] for of in ("1", "f"))
        force = strength(driven, constant)
        return [(model.middle_s, force / (np.abs(force) + STICK))]
    if driver == WARMING:
        seen = case.temperature
        if seen is None or seen.time_s.size < 3:
            return []
        return [(seen.time_s, _unit(second_derivative(seen.time_s, seen.smooth_c[:, "xyz".index(axis)])))]
    heading = np.unwrap(np.arctan2(states.mat_nb[:, 1, 0], states.mat_nb[:, 0, 0]))
    if driver in ANGLES:
        return [(model.nodes_s, of(ANGLES[driver] * heading)) for of in (np.sin, np.cos)]
    values = {
        "height": states.height_m,
        PRESSURE: standard_pressure(states.height_m),
        "turning": np.gradient(heading, model.nodes_s),
    }[driver]
    return [(model.nodes_s, _unit(values - values[0]))]


def _unit(values: np.ndarray) -> np.ndarray:
    """Values of unit root mean square."""
    return values / max(float(np.sqrt(np.mean(values**2))), 1e-12)


def second_derivative(time_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Of values (n,) on an even grid, smoothed over `SMOOTH_S`; 0 of a constant and of a straight line."""
    rough = np.gradient(np.gradient(values, time_s), time_s)
    return gaussian_filter1d(rough, SMOOTH_S / (time_s[1] - time_s[0]), mode="nearest")
