"""How a small navigation error grows: the linear error model of the mechanization, one transition an epoch.

State x = [dp, dv, phi]: position error (m), velocity error (m/s), both INS minus truth in n, and phi (rad) of
C_ins = (I - phi x) C. The terms are those of `strapdown`, its Earth flags included:

    dp' = dv + ...,   dv' = f x phi + C df - (w_en + 2 w_ie) x dv - (dw_en + 2 dw_ie) x v + dg
    phi' = -w_in x phi + dw_in - C dw

Over an epoch the transition is I + F dt + F^2 dt^2 / 2 with the mean specific force, and a drive D enters as if all
of it came at mid-epoch. The vertical channel is open: what steadied the mechanization (height loop with an aid) is a
known input, so that it is subtracted instead of being modelled, and the aid's own errors do not matter. So is what a
new arc changes where it begins.

Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., sections 12.3 and 12.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.earth import EARTH_RATE, gravity, radii
from ins_eval.error_model import drives
from ins_eval.error_model.geometry import (
    ATTITUDE,
    CLOCK_S,
    POSITION,
    STATES,
    VELOCITY,
    States,
    along,
    apart,
    cross_matrices,
)
from ins_eval.strapdown import Solution, damping_gains

if TYPE_CHECKING:
    from ins_eval.error_model.null import Believed
    from ins_eval.recording.belief import EarthBelief


@dataclass(frozen=True, eq=False)
class ErrorModel:
    """The error model along one solution, epoch k from node k to node k + 1.

    `transition` and `half` (k, 9, 9) over an epoch and over its second half; `integrals` (k, sources, 3) as in
    `drives`; `missing` (k, 5, 6) what the equations lack where a term of the Earth is left out, to velocity and phi;
    `known` (k, 9) what was done to the solution and is no error: by the height loop, by arcs that begin afresh; `arc`
    (nodes,) the arc to whose end each node belongs; `elapsed` (k, 3, 3) what the equations alone
    add to position, velocity and phi; `loudness` (k, 3) by how much each gyro is noisier than most, None where
    they are alike.
    """

    nodes_s: np.ndarray
    states: States | None  # None in a chamber
    transition: np.ndarray
    half: np.ndarray
    integrals: np.ndarray
    missing: np.ndarray
    known: np.ndarray
    arc: np.ndarray
    elapsed: np.ndarray
    loudness: np.ndarray | None = None

    @property
    def middle_s(self) -> np.ndarray:
        return 0.5 * (self.nodes_s[1:] + self.nodes_s[:-1])

    @property
    def interval_s(self) -> np.ndarray:
        return np.diff(self.nodes_s)

    @cached_property
    def walks(self) -> np.ndarray:
        """As `walks` says of its epochs."""
        return walks(self.transition, self.half, self.spread)

    @cached_property
    def spread(self) -> np.ndarray:
        """Covariance (k, 2, 3, 3) in n of the random walks of velocity and phi, as a share of that of equal sensors."""
        out = np.tile(np.eye(3), (self.half.shape[0], 2, 1, 1))
        if self.loudness is not None:
            gyros = np.stack([self.integrals[:, drives.source("gyro", axis, "1")] for axis in range(3)], axis=2)
            louder = gyros / self.interval_s[:, None, None] * np.sqrt(self.loudness[:, None] ** 2 - 1.0)
            out[:, 1] += louder @ np.swapaxes(louder, 1, 2)
        return out

    @cached_property
    def driven(self) -> np.ndarray:
        """Squares of the integrals of each epoch, (k, sources)."""
        return np.square(self.integrals).sum(axis=2)

    @cached_property
    def coupling(self) -> np.ndarray:
        """What a constant error of each accelerometer and gyro adds to the state in each epoch, (k, 9, 6)."""
        out = np.empty((self.half.shape[0], STATES, 6))
        for axis in range(3):
            force, rate = (self.integrals[:, drives.source(sensor, axis, "1")] for sensor in ("accelerometer", "gyro"))
            out[:, :, axis] = np.einsum("kij,kj->ki", self.half[:, :, VELOCITY], force)
            out[:, :, 3 + axis] = -np.einsum("kij,kj->ki", self.half[:, :, ATTITUDE], rate)
        return out

    @cached_property
    def sources(self) -> np.ndarray:
        """All that can drive a column, (k, n, 3): `integrals`, `missing`, `known` and `elapsed`, one after another."""
        each = (self.integrals, self.missing, self.known, self.elapsed)
        return np.concatenate([of.reshape(self.half.shape[0], -1, 3) for of in each], axis=1)


def walks(transition: np.ndarray, half: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Covariance (k, 2, 9, 9) that random walks of velocity and of phi, of `spread` (k, 2, 3, 3) each, add in an epoch.

    The mean over the epoch of Phi Q Phi', from `transition` and `half` (k, 9, 9) over it and over its second half, by
    Simpson's rule: what begins at its start, its middle and its end. So a walk q of velocity moves a position by
    q^2 t^3 / 3.
    """
    out = np.empty((len(transition), 2, STATES, STATES))
    for n, part in enumerate((slice(3, 6), slice(6, 9))):
        whole, second, of = transition[:, :, part], half[:, :, part], spread[:, n]
        out[:, n] = (whole @ of @ np.swapaxes(whole, 1, 2) + 4.0 * second @ of @ np.swapaxes(second, 1, 2)) / 6.0
        out[:, n, part, part] += of / 6.0
    return out


def build(believed: Believed, arcs: Sequence[Solution], nodes_s: np.ndarray) -> ErrorModel:
    """The error model on the nodes `nodes_s`, the first of which is the start; each arc begins at a node."""
    states = along(arcs, believed.gyro, believed.gyro_bias, nodes_s)
    integrals = drives.integrate(believed, arcs, nodes_s)
    dt = np.diff(nodes_s)[:, None]
    force_n = sum(integrals[:, drives.source("accelerometer", axis, "f")] for axis in range(3)) / dt
    about = states
    if believed.stands:
        about, force_n = _standing(states)
    matrices, missing = dynamics(believed.recording.belief.earth, about, force_n)
    full, eye = matrices * dt[:, None], np.eye(STATES)
    square = full @ full
    transition = eye + full + square / 2.0 + square @ full / 6.0  # by the third a heading moves a position
    half = eye + full / 2.0 + square / 8.0
    known = np.zeros((dt.size, STATES))
    if len(arcs) == 1:
        known[:, 5], known[:, 2] = _feedback(believed, arcs[0], nodes_s).T
    begins = np.searchsorted(nodes_s, [one.time_s - CLOCK_S for one in believed.arcs])
    inside = begins < dt.size
    k, afresh = begins[inside], [one for one, here in zip(believed.arcs, inside, strict=True) if here]
    pushed = (transition[k] @ apart(afresh, states, k)[..., None]) if afresh else np.zeros((0, STATES, 1))
    known[k] = np.linalg.solve(half[k], pushed)[..., 0]  # what enters at mid-epoch is as much as it is at its node
    return ErrorModel(
        nodes_s=nodes_s,
        states=states,
        transition=transition,
        half=half,
        integrals=integrals,
        missing=missing * dt[:, None],
        known=known,
        arc=np.searchsorted(begins, np.arange(nodes_s.size), side="left"),
        elapsed=_elapsed(believed.recording.belief.earth, about) * dt[:, None],
    )


def _standing(states: States) -> tuple[States, np.ndarray]:
    """The same at rest, and the specific force (k, 3) in n that holds it up, between k + 1 nodes.

    The velocity that a solution has where a unit stands, and what it feels across, are its own errors: an error model
    along them would show a heading that no standstill shows. Between two stands a unit is moved, but what it then feels
    across sums to nothing: it stands again.
    """
    force_n = np.zeros((states.time_s.size - 1, 3))
    force_n[:, 2] = -gravity(states.latitude_rad, states.height_m)[1:]
    return replace(states, velocity_n=np.zeros_like(states.velocity_n)), force_n


def dynamics(earth: EarthBelief, states: States, force_n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """F (k, 9, 9), and the rates (k, 5, 6) by which each term of `EarthBelief` would be missing.

    Parameters: `states` at k + 1 nodes, and the mean specific force `force_n` (k, 3) in m/s^2 between them.
    """
    rotation, coriolis, transport = float(earth.rotation), float(earth.coriolis), float(earth.transport_rate)

    def middle(values: np.ndarray) -> np.ndarray:
        return 0.5 * (values[1:] + values[:-1])

    latitude, height, v = middle(states.latitude_rad), middle(states.height_m), middle(states.velocity_n)
    north, east, down = v.T
    s, c, t = np.sin(latitude), np.cos(latitude), np.tan(latitude)
    meridian, transverse = (radius + height for radius in radii(latitude))
    zero, one = np.zeros_like(s), np.ones_like(s)
    ie = EARTH_RATE * np.column_stack([c, zero, -s])
    en = np.column_stack([east / transverse, -north / meridian, -east * t / transverse])
    # derivatives by dp = (north, east, down) and by dv
    ie_p = np.zeros((s.size, 3, 3))
    ie_p[:, 0, 0], ie_p[:, 2, 0] = -EARTH_RATE * s / meridian, -EARTH_RATE * c / meridian
    en_p, en_v = np.zeros_like(ie_p), np.zeros_like(ie_p)
    en_v[:, 0, 1], en_v[:, 1, 0], en_v[:, 2, 1] = one / transverse, -one / meridian, -t / transverse
    en_p[:, 0, 2], en_p[:, 1, 2] = east / transverse**2, -north / meridian**2
    en_p[:, 2, 2] = -east * t / transverse**2
    en_p[:, 2, 0] = -east / (transverse * c**2 * meridian)

    f = np.zeros((s.size, STATES, STATES))
    f[:, 0, 0], f[:, 0, 2] = -down / meridian, north / meridian
    f[:, 1, 0], f[:, 1, 1] = east * t / meridian, -(north * t / meridian + down / transverse)
    f[:, 1, 2] = east / transverse
    f[:, POSITION, VELOCITY] = np.eye(3)
    flag_ie, flag_cc = rotation * ie, rotation * coriolis * ie
    turning = transport * en + 2.0 * flag_cc
    across = cross_matrices(v)
    f[:, VELOCITY, POSITION] = across @ (transport * en_p + 2.0 * rotation * coriolis * ie_p)
    f[:, VELOCITY, VELOCITY] = across @ (transport * en_v) - cross_matrices(turning)
    f[:, VELOCITY, ATTITUDE] = cross_matrices(force_n)
    f[:, ATTITUDE, POSITION] = transport * en_p + rotation * ie_p
    f[:, ATTITUDE, VELOCITY] = transport * en_v
    f[:, ATTITUDE, ATTITUDE] = -cross_matrices(transport * en + flag_ie)
    level, formula = _gravity_arguments(earth, latitude, height)
    f[:, 5, 2] += -earth.gravity_height * (gravity(level, formula + 50.0) - gravity(level, formula - 50.0)) / 100.0
    f[:, 5, 0] += (
        earth.gravity_latitude * (gravity(level + 1e-4, formula) - gravity(level - 1e-4, formula)) / (2e-4 * meridian)
    )

    missing = np.zeros((s.size, 5, 6))
    missing[:, 0, :3], missing[:, 0, 3:] = float(earth.coriolis) * 2.0 * np.cross(ie, v), -ie
    missing[:, 1, :3] = rotation * 2.0 * np.cross(ie, v)
    missing[:, 2, :3], missing[:, 2, 3:] = np.cross(en, v), -en
    missing[:, 3, 2] = gravity(level, 0.0 * height) - gravity(level, height)
    missing[:, 4, 2] = gravity(0.0 * latitude + 0.25 * np.pi, formula) - gravity(latitude, formula)
    return f, missing


def _elapsed(earth: EarthBelief, states: States) -> np.ndarray:
    """Velocity, gravity less Coriolis, and w_in (k, 3, 3): what changes where nothing is felt, between k + 1 nodes."""

    def middle(values: np.ndarray) -> np.ndarray:
        return 0.5 * (values[1:] + values[:-1])

    latitude, height, v = middle(states.latitude_rad), middle(states.height_m), middle(states.velocity_n)
    meridian, transverse = (radius + height for radius in radii(latitude))
    zero = np.zeros_like(latitude)
    ie = earth.rotation * EARTH_RATE * np.column_stack([np.cos(latitude), zero, -np.sin(latitude)])
    en = earth.transport_rate * np.column_stack(
        [v[:, 1] / transverse, -v[:, 0] / meridian, -v[:, 1] * np.tan(latitude) / transverse]
    )
    down = np.column_stack([zero, zero, gravity(*_gravity_arguments(earth, latitude, height))])
    return np.stack([v, down - np.cross(en + 2.0 * earth.coriolis * ie, v), ie + en], axis=1)


def _gravity_arguments(earth, latitude: np.ndarray, height: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Latitude and height for which the believed equations take gravity."""
    return (
        latitude if earth.gravity_latitude else np.full_like(latitude, 0.25 * np.pi),
        height if earth.gravity_height else np.zeros_like(height),
    )


def _feedback(believed: Believed, solution: Solution, nodes_s: np.ndarray) -> np.ndarray:
    """What the height loop added to velocity down (m/s) and position down (m) in each epoch, (k, 2).

    The loop of `strapdown.navigate`: v_D += (k2 e + k3 integral(e)) dt, h -= k1 e dt, e = h - aid at the step's start.
    """
    k1, k2, k3 = damping_gains(believed.start.latitude_rad, believed.start.height_m)
    dt = np.diff(solution.time_s)
    offset = np.zeros(dt.size)
    offset[1:] = solution.height_m[1:-1] - believed.aid_m[3::4][: dt.size - 1]
    integral = np.cumsum(offset * dt)
    total = np.zeros((dt.size + 1, 2))
    total[1:, 0] = np.cumsum((k2 * offset + k3 * integral) * dt)
    total[1:, 1] = np.cumsum(k1 * offset * dt)
    return np.column_stack([np.diff(np.interp(nodes_s, solution.time_s, total[:, j])) for j in range(2)])
