"""A channel whose error follows the motion, or how its temperature changes, without a name.

A receiver's height is wrong in proportion to height (troposphere, datum) and its velocity while it turns (its tracking
loops lag); a sensor that feels the Earth's magnetic field errs with the sine of heading, or of twice the heading where
iron around it is soft; an accelerometer that sticks errs with the side of its own input, one that is not tight with the
pressure of the air, and one that is unevenly warm with what its rate of temperature does not tell: how that changes.
The vocabulary has no such effects, so they are no explanation: what is found says where an explanation has to be
sought, and keeps named effects from taking its place.

With drives u of unit root mean square, the error of a channel of size s is s (c u + ...): of a heading psi, sin(k psi)
and cos(k psi); of a force f along the input axis, f / (|f| + `STICK`); of a height h, h - h(0) or p(h) - p(0) of the
standard atmosphere; of a temperature T, its second derivative, smoothed over `SMOOTH_S`. Its evidence is that of
`search`, at a noise of its own.

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
from ins_eval.error_model.drives import source, strength
from ins_eval.estimation.evidence import SCALES, Gained, log_evidence_of, mixture, reduce
from ins_eval.recording import PARKED
from ins_eval.units import STANDARD_GRAVITY

if TYPE_CHECKING:
    from ins_eval.diagnosis.unnamed.locate import Channel
    from ins_eval.error_model.columns import Column
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.noise_fit import Fitted
    from ins_eval.policy import Policy

SIDE = "the side of its own input"
PRESSURE = "the pressure of the air at its height"
WARMING = "how the rate of its temperature changes"
FOLLOWED = {
    "gps": ("height", "turning"),
    "accelerometer": ("heading", "twice the heading", SIDE, PRESSURE, WARMING),
    "gyro": ("heading", "twice the heading", WARMING),
}
OF_AXIS = (SIDE, WARMING)  # what each axis has of its own
FROM_START = ("height", "turning", PRESSURE)  # a first fix, or a calibration on the ground, holds what was there before
STICK = 0.02 * STANDARD_GRAVITY  # specific force within which what sticks turns from one side to the other
SMOOTH_S = 30.0  # of a second derivative: below the minutes in which a housing warms, above a thermometer's readings
# ICAO Doc 7488, up to the tropopause and above it
LAPSE_HEIGHT_M, EXPONENT, TROPOPAUSE_M, SCALE_HEIGHT_M = 44331.0, 5.25588, 11000.0, 6341.6


@dataclass(frozen=True)
class Dependence:
    """An error of `channel` that follows `what`."""

    channel: Channel
    what: str
    columns: tuple[Column, ...]


def dependence(case: Case, r: int, base: Fitted, policy: Policy) -> Suspect | None:
    """The most probable channel of recording `r` that follows one of `FOLLOWED`; None where nothing moves."""
    if case.believed is None or case.kind in PARKED:
        return None
    tried = _forms(case)
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
    sigma = float(np.sqrt(2.0 * max(gained, 0.0)))
    return Suspect(r, found[0], gained, 0.0 if gained > 0.0 else 1.0, sigma, fitted, best.what)


def _gain(a: np.ndarray, b: np.ndarray) -> Gained:
    """log B, every coefficient with the scales of `search`."""
    return mixture(a, b, [np.diag(scales) for scales in product(SCALES, repeat=b.size)])


def _forms(case: Case) -> list[Dependence]:
    """Every channel with all that it may follow."""
    found = []
    for channel in locate.channels(case):
        for what in FOLLOWED.get(channel.name.partition(".")[0], ()):
            if what == WARMING and case.temperature is None:
                continue
            names = _slow(case, channel, what)
            found.append(Dependence(channel, what, tuple(channel.column(name) for name in names)))
    return found


def _slow(case: Case, channel: Channel, what: str) -> list[str]:
    """The names of the slow factors of what is followed."""
    names = []
    for k, (time_s, values) in enumerate(_drives(case, channel.axis, what)):
        felt = values - values[0] if what in FROM_START else values
        scaled = felt / max(float(np.sqrt(np.mean(felt**2))), 1e-12)
        key = f"{what} {k}" + (f" {channel.axis}" if what in OF_AXIS else "")
        names.append(case.slow.add(key, partial(np.interp, xp=time_s, fp=scaled), case.model))
    return names


def _drives(case: Case, axis: str, what: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """What an error follows: instants and values."""
    model, states = case.model, case.model.states
    if what == SIDE:
        constant, driven = (model.integrals[:, source("accelerometer", "xyz".index(axis), of)] for of in ("1", "f"))
        force = strength(driven, constant)
        return [(model.middle_s, force / (np.abs(force) + STICK))]
    if what == WARMING:
        seen = case.temperature
        steps = SMOOTH_S / float(np.median(np.diff(seen.time_s)))
        return [(seen.time_s, gaussian_filter1d(seen.smooth_c[:, "xyz".index(axis)], steps, order=2, mode="nearest"))]
    heading = np.unwrap(np.arctan2(states.mat_nb[:, 1, 0], states.mat_nb[:, 0, 0]))
    if what == "height":
        return [(model.nodes_s, states.height_m)]
    if what == PRESSURE:
        return [(model.nodes_s, standard_pressure(states.height_m))]
    if what == "turning":
        return [(model.nodes_s, np.gradient(heading, model.nodes_s))]
    times = 2.0 if what == "twice the heading" else 1.0
    return [(model.nodes_s, of(times * heading)) for of in (np.sin, np.cos)]


def standard_pressure(height_m: np.ndarray) -> np.ndarray:
    """Pressure of the standard atmosphere at `height_m` (n,), as a share of that at sea level, (n,).

    (1 - h / 44331 m)^5.25588 up to 11 km, from there on isothermal.
    """
    below = (1.0 - np.minimum(height_m, TROPOPAUSE_M) / LAPSE_HEIGHT_M) ** EXPONENT
    return below * np.exp(-np.maximum(height_m - TROPOPAUSE_M, 0.0) / SCALE_HEIGHT_M)
