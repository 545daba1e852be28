"""A channel whose error follows the motion, without a name.

A receiver's height is wrong in proportion to height (troposphere, datum) and its velocity while it turns (its tracking
loops lag); a sensor that feels the Earth's magnetic field errs with the sine of heading, or of twice the heading where
iron around it is soft; an accelerometer that sticks errs with the side of its own input. The vocabulary has no such
effects, so they are no explanation: what is found says where an explanation has to be sought, and keeps named effects
from taking its place.

With the drives u as they change from the start, of unit root mean square each, the error of a channel of size s is
s (c u + ...): of a heading psi, sin(k psi) and cos(k psi); of a force f along the input axis, f / (|f| + `STICK`).
Its evidence is that of `search`, at a noise of its own.

Sources: Kaplan and Hegarty, Understanding GPS/GNSS (tracking loops, troposphere); IEEE Std 952 (magnetic sensitivity
of a gyro); IEEE Std 528 (dead band).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.diagnosis.unnamed import locate
from ins_eval.diagnosis.unnamed.disturbance import Suspect, with_quiet_sensors
from ins_eval.error_model.drives import source, strength
from ins_eval.estimation.evidence import SCALES, Gained, log_evidence_of, mixture, reduce
from ins_eval.recording import PARKED
from ins_eval.units import STANDARD_GRAVITY

if TYPE_CHECKING:
    from ins_eval.diagnosis.unnamed.locate import Channel
    from ins_eval.error_model.columns import Column
    from ins_eval.error_model.propagation import ErrorModel
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.noise_fit import Fitted
    from ins_eval.policy import Policy

SIDE = "the side of its own input"
MOTIONS = {
    "gps": ("height", "turning"),
    "accelerometer": ("heading", "twice the heading", SIDE),
    "gyro": ("heading", "twice the heading"),
}
STICK = 0.02 * STANDARD_GRAVITY  # specific force within which what sticks turns from one side to the other


@dataclass(frozen=True)
class Dependence:
    """An error of `channel` that follows a `motion`."""

    channel: Channel
    motion: str
    columns: tuple[Column, ...]


def motion_dependence(case: Case, r: int, base: Fitted, policy: Policy) -> Suspect | None:
    """The most probable channel of recording `r` that follows its motion; None where nothing moves."""
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
    return Suspect(r, found[0], gained, 0.0 if gained > 0.0 else 1.0, sigma, fitted, best.motion)


def _gain(a: np.ndarray, b: np.ndarray) -> Gained:
    """log B, every coefficient with the scales of `search`."""
    return mixture(a, b, [np.diag(scales) for scales in product(SCALES, repeat=b.size)])


def _forms(case: Case) -> list[Dependence]:
    """Every channel with every motion that it may follow."""
    found = []
    for channel in locate.channels(case):
        for motion in MOTIONS.get(channel.name.partition(".")[0], ()):
            names = _slow(case, channel, motion)
            found.append(Dependence(channel, motion, tuple(channel.column(name) for name in names)))
    return found


def _slow(case: Case, channel: Channel, motion: str) -> list[str]:
    """The names of the slow factors of a motion."""
    names = []
    for k, (time_s, values) in enumerate(_drives(case.model, channel, motion)):
        changed = values - values[0]
        scaled = changed / max(float(np.sqrt(np.mean(changed**2))), 1e-12)
        key = f"{motion} {k}" + (f" {channel.axis}" if motion == SIDE else "")
        names.append(case.slow.add(key, partial(np.interp, xp=time_s, fp=scaled), case.model))
    return names


def _drives(model: ErrorModel, channel: Channel, motion: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """What an error follows: instants and values."""
    if motion == SIDE:
        axis = "xyz".index(channel.axis)
        constant, driven = (model.integrals[:, source("accelerometer", axis, what)] for what in ("1", "f"))
        force = strength(driven, constant)
        return [(model.middle_s, force / (np.abs(force) + STICK))]
    states = model.states
    heading = np.unwrap(np.arctan2(states.mat_nb[:, 1, 0], states.mat_nb[:, 0, 0]))
    if motion == "height":
        return [(model.nodes_s, states.height_m)]
    if motion == "turning":
        return [(model.nodes_s, np.gradient(heading, model.nodes_s))]
    times = 2.0 if motion == "twice the heading" else 1.0
    return [(model.nodes_s, of(times * heading)) for of in (np.sin, np.cos)]
