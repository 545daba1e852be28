"""What was measured, against the solution: nine channels at the nodes of the error model.

Channels: position and velocity error north, east, down (m, m/s), attitude error phi about north, east, down (rad);
each INS minus measured, NaN where nothing was measured. A parked recording without a receiver is measured against its
standstill, which holds to a centimetre and a few millimetres a second: a vehicle settles on its wheels and sways. Its
attitude, whatever it is, is held as well; that tells something of gyros that drift faster than it tilts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from ins_eval.earth import EARTH_RATE, radii
from ins_eval.error_model.geometry import ATTITUDE, CLOCK_S, POSITION, STATES, VELOCITY, States, cross_matrices
from ins_eval.errors import DataRefused
from ins_eval.recording import PARKED, Fixes
from ins_eval.recording.belief import GpsBelief
from ins_eval.recording.stillness import MOVED_FACTOR, Stretch, still_stretches
from ins_eval.units import DEG

if TYPE_CHECKING:
    from ins_eval.error_model.null import Believed

CHANNELS = 9
STANDSTILL_POSITION_M, STANDSTILL_VELOCITY_MPS = 0.01, 0.002
REFERENCE_POSITION_M, REFERENCE_VELOCITY_MPS, REFERENCE_ATTITUDE_RAD = 1.0, 0.01, 0.01 * DEG  # where not stated
STAND_S, STAND_EDGE_S = 10.0, 2.0  # shortest stand between two moves; what is left out at its ends
EPOCH_S = 1.0
SMOOTHED_S = (1.0, 3.0)  # of a curve that a receiver smooths, to either side: by reasoning
SMOOTHINGS = 3  # of a curve each: over the two, and to one side
LONGEST_EPOCH_S = 4.0  # of a day: columns of a flight with turns keep their errors of 3e-3 (test_error_model)
# within which only random walks and jolts change anything, and as many as tell the noise: by reasoning
STANDING_EPOCH_S, FEWEST_STANDING = 5.0, 300
MOST_EPOCHS = 12_000  # by reasoning: as many as memory and time allow; errors of hours need no more


@dataclass(frozen=True, eq=False)
class MeasurementSource:
    """One origin of measurements: a receiver, a better navigator, or the knowledge that nothing moves."""

    name: str  # gps, reference, standstill
    fixes: Fixes
    belief: GpsBelief
    instants_s: np.ndarray  # on the clock of the IMU


@dataclass(frozen=True, eq=False)
class Observations:
    """What is measured at each node: all (nodes, ...).

    `residual` (nodes, 9); `sigma` (nodes, 9) as believed; `design` (nodes, 9, 9) what a channel sees of the state;
    `of_arm` (nodes, 3, 9) response to an antenna that is 1 m farther along a body axis than believed; `of_delay`
    (nodes, 9) response to a stamp that is 1 s later than believed; `of_smoothing` (nodes, 6, 9) response to a
    receiver that smooths its velocities, then its positions, see `smoothing`; `arc` (nodes,) the arc of the solution;
    `measured_by` (9,) the source of each channel.
    """

    sources: tuple[MeasurementSource, ...]
    residual: np.ndarray
    sigma: np.ndarray
    design: np.ndarray
    of_arm: np.ndarray
    of_delay: np.ndarray
    of_smoothing: np.ndarray
    arc: np.ndarray
    measured_by: tuple[str, ...] = ("",) * CHANNELS


def sources(believed: Believed, end_s: float) -> tuple[MeasurementSource, ...]:
    """Everything that measures: a reference where it knows a channel, GPS for what it does not.

    Raises DataRefused where nothing does.
    """
    recording = believed.recording
    found = []
    for name, fixes, belief in (
        ("reference", recording.reference, recording.belief.reference),
        ("gps", recording.gps, recording.belief.gps),
    ):
        if fixes is None or stands_in_arcs(believed):
            continue
        instants = fixes.time_s - belief.time_offset_s
        inside = (instants >= believed.start.time_s - CLOCK_S) & (instants <= end_s + CLOCK_S)
        inside &= _not_too_many(inside)
        if (inside & _tells(fixes)).sum() >= 2:
            found.append(MeasurementSource(name, fixes.rows(inside), belief, np.clip(instants[inside], None, end_s)))
    if not found and recording.kind in PARKED:
        found.append(_standstill(believed, end_s))
    if not found:
        raise DataRefused(
            f"{recording.name}: it moves, and neither GPS nor a reference shares two epochs with it; there is nothing "
            "to diagnose it against"
        )
    return tuple(found)


def _tells(fixes: Fixes) -> np.ndarray:
    """(m,) rows that are valid and hold any number."""
    columns = [fixes.latitude_rad, fixes.height_m, *fixes.velocity_n.T]
    if fixes.attitude_rad is not None:
        columns.append(fixes.attitude_rad.sum(axis=1))
    return fixes.valid & np.isfinite(columns).any(axis=0)


def _not_too_many(inside: np.ndarray) -> np.ndarray:
    """Every row, or every so many of them where a fast navigator would give more than `MOST_EPOCHS`."""
    every = -(-int(inside.sum()) // MOST_EPOCHS)
    return np.arange(inside.size) % max(1, every) == 0


def nodes(believed: Believed, measured: tuple[MeasurementSource, ...], end_s: float) -> np.ndarray:
    """The start, every instant of a measurement, every begin of an arc, and no epoch longer than `longest_epoch_s`."""
    begins = [one.time_s for one in believed.arcs]
    instants = np.unique(np.round(np.concatenate([begins, *(source.instants_s for source in measured)]), 6))
    instants = instants[instants > believed.start.time_s + CLOCK_S]
    edges = np.concatenate([[believed.start.time_s], instants[instants <= end_s]])
    pieces = np.maximum(1, np.ceil(np.diff(edges) / longest_epoch_s(believed, end_s) - 1e-3)).astype(int)
    first = np.repeat(edges[:-1], pieces)
    step = np.repeat(np.diff(edges) / pieces, pieces)
    place = np.arange(first.size) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    return np.append(first + place * step, edges[-1])


def longest_epoch_s(believed: Believed, end_s: float) -> float:
    """Whole seconds: one; of many hours as many as `MOST_EPOCHS` make of them, and not more than `LONGEST_EPOCH_S`.

    Of a parked unit `STANDING_EPOCH_S`, fewer where that left less than `FEWEST_STANDING` of them: what is believed of
    a standstill at the least is no white noise, and every second of it would be counted for itself.
    """
    length_s = end_s - believed.start.time_s
    longest_s, often_s = LONGEST_EPOCH_S, EPOCH_S
    if believed.recording.kind in PARKED:
        longest_s = STANDING_EPOCH_S
        often_s = float(np.clip(np.floor(length_s / FEWEST_STANDING), EPOCH_S, longest_s))
    return min(longest_s, max(often_s, np.ceil(length_s / MOST_EPOCHS)))


def observe(
    believed: Believed, states: States, arc: np.ndarray, measured: tuple[MeasurementSource, ...]
) -> Observations:
    """The solution at the nodes, whose `states` it passes in the arcs `arc` (nodes,), against all that was measured."""
    count = states.time_s.size
    out = Observations(
        measured,
        residual=np.full((count, CHANNELS), np.nan),
        sigma=np.ones((count, CHANNELS)),
        design=np.zeros((count, CHANNELS, STATES)),
        of_arm=np.zeros((count, 3, CHANNELS)),
        of_delay=np.zeros((count, CHANNELS)),
        of_smoothing=np.zeros((count, 2 * SMOOTHINGS, CHANNELS)),
        arc=arc,
    )
    out.design[:] = np.eye(CHANNELS, STATES)
    rate_b = _rate(believed, states)
    by = [""] * CHANNELS
    for source in reversed(measured):  # the first has the last word
        row = np.searchsorted(states.time_s, source.instants_s - 2.0 * CLOCK_S)
        row = np.minimum(row, count - 1)
        for channel in _one_source(source, row, out, states, rate_b):
            by[channel] = source.name
    return replace(out, measured_by=tuple(by))


def _one_source(source: MeasurementSource, row: np.ndarray, out: Observations, states, rate_b: np.ndarray) -> list[int]:
    """Write what one source measured into `out`; the channels in which it measured anything."""
    fixes, belief = source.fixes, source.belief
    mat = states.mat_nb[row]
    spin_b = rate_b[row]
    arm_n = mat @ np.asarray(belief.lever_arm_m)
    swing_n = np.einsum("kij,kj->ki", mat, np.cross(spin_b, np.asarray(belief.lever_arm_m)))
    latitude, height = states.latitude_rad[row], states.height_m[row]
    meridian, transverse = radii(latitude)
    around = np.remainder(states.longitude_rad[row] - fixes.longitude_rad + np.pi, 2.0 * np.pi) - np.pi
    y = np.full((row.size, CHANNELS), np.nan)
    y[:, 0] = (meridian + height) * (latitude - fixes.latitude_rad)
    y[:, 1] = (transverse + height) * np.cos(latitude) * around
    y[:, 2] = fixes.height_m - height
    y[:, POSITION] += arm_n
    y[:, VELOCITY] = states.velocity_n[row] + swing_n - fixes.velocity_n
    if fixes.attitude_rad is not None:
        known = np.isfinite(fixes.attitude_rad).all(axis=1)
        given = Rotation.from_euler("ZYX", fixes.attitude_rad[known][:, ::-1])
        y[known, ATTITUDE] = -(Rotation.from_matrix(mat[known]) * given.inv()).as_rotvec()
    y[~fixes.valid] = np.nan
    sigma = _sigma(source)
    stamped = source.name != "standstill"  # which holds at any instant
    of_delay = stamped * _delay(states, row, spin_b, mat, fixes.velocity_n)
    smoothed = smoothing(states)[row] if source.name == "gps" else np.zeros((row.size, SMOOTHINGS, 6))
    design = np.broadcast_to(np.eye(CHANNELS, STATES), (row.size, CHANNELS, STATES)).copy()
    design[:, POSITION, ATTITUDE], design[:, VELOCITY, ATTITUDE] = cross_matrices(arm_n), cross_matrices(swing_n)
    for channel in range(CHANNELS):
        here = np.isfinite(y[:, channel])
        at = row[here]
        out.residual[at, channel] = y[here, channel]
        out.sigma[at, channel] = sigma[here, channel]
        out.design[at, channel] = design[here, channel]
        out.of_delay[at, channel] = of_delay[here, channel]
        if channel < 6:
            own = slice(SMOOTHINGS) if channel >= 3 else slice(SMOOTHINGS, 2 * SMOOTHINGS)
            out.of_smoothing[at, own, channel] = smoothed[here, :, channel]
        for axis in range(3):
            # an antenna farther out than believed: the measurement is ahead of the solution
            if channel < 3:
                out.of_arm[at, axis, channel] = -mat[here, channel, axis]
            elif channel < 6:
                swing = np.einsum("kij,kj->ki", mat, np.cross(spin_b, np.eye(3)[axis]))
                out.of_arm[at, axis, channel] = -swing[here, channel - 3]
    return [channel for channel in range(CHANNELS) if np.isfinite(y[:, channel]).any()]


def _delay(states, row: np.ndarray, spin_b: np.ndarray, mat: np.ndarray, measured_n: np.ndarray) -> np.ndarray:
    """The stamp is later than believed, so the measurement is older: y = x(t) - x(t - delay).

    Positions move with the velocity that was `measured_n` (m, 3), where it was: a solution that drifts while it stands
    would let a clock move what does not move.
    """
    turning_n = -np.einsum("kij,kj->ki", mat, spin_b)  # phi of C(t) against C(t - delay)
    velocity_n = np.where(np.isfinite(measured_n), measured_n, states.velocity_n[row])
    return np.column_stack([velocity_n, states.acceleration_n[row], turning_n])


def smoothing(states: States) -> np.ndarray:
    """What a receiver that smooths leaves out of positions and velocities beside what is late, (n, 3, 6) in m and m/s.

        x(t) - (x(t - h) + x(t + h)) / 2   for h = 1 s and 3 s, of means to both sides alike,
        (x(t + 3 s) - x(t - 3 s)) / 2 - 3 (x(t + 1 s) - x(t - 1 s)) / 2   of one that is not,

    all 0 where the rate of a position or velocity x is steady: by how much a mean is late is a delay. A filter with
    weights w is a sum of the three, up to what differs within a second. Beyond its ends the solution goes on as it is
    accelerated there.
    """
    from scipy.interpolate import CubicHermiteSpline  # imported here, for it takes long and not every verb needs it

    near_s, far_s = SMOOTHED_S
    time_s, velocity, acceleration = states.time_s, states.velocity_n, states.acceleration_n
    step_s = np.diff(time_s)[:, None]
    steps = 0.5 * step_s * (velocity[1:] + velocity[:-1]) - step_s**2 / 12.0 * np.diff(acceleration, axis=0)
    path = CubicHermiteSpline(time_s, np.vstack([np.zeros(3), np.cumsum(steps, axis=0)]), velocity)

    def at(apart_s: float) -> np.ndarray:
        inside = np.clip(time_s + apart_s, time_s[0], time_s[-1])
        beyond = (time_s + apart_s - inside)[:, None]
        there = np.column_stack([np.interp(inside, time_s, one) for one in velocity.T])
        steady = np.where(beyond < 0.0, acceleration[0], acceleration[-1])
        return np.hstack([path(inside) + beyond * there + 0.5 * beyond**2 * steady, there + beyond * steady])

    here, before, after, far_before, far_after = (at(apart_s) for apart_s in (0.0, -near_s, near_s, -far_s, far_s))
    return np.stack(
        [
            here - 0.5 * (before + after),
            here - 0.5 * (far_before + far_after),
            0.5 * (far_after - far_before) - 0.5 * far_s / near_s * (after - before),
        ],
        axis=1,
    )


def _rate(believed: Believed, states: States) -> np.ndarray:
    """Body rate against the Earth (nodes, 3) in rad/s: mean over the samples around a node less bias and Earth."""
    edges = np.concatenate([[believed.start.time_s], believed.time_s])
    half = float(np.median(np.diff(edges)))
    low, high = (np.clip(states.time_s + sign * half, edges[0], edges[-1]) for sign in (-1.0, 1.0))
    turned, angle = np.empty((states.time_s.size, 3)), np.zeros(edges.size)
    for axis, column in enumerate(believed.gyro.T):
        np.cumsum(column, out=angle[1:])
        turned[:, axis] = np.interp(high, edges, angle) - np.interp(low, edges, angle)
    latitude = states.latitude_rad
    earth_n = EARTH_RATE * np.column_stack([np.cos(latitude), np.zeros_like(latitude), -np.sin(latitude)])
    return turned / (high - low)[:, None] - believed.gyro_bias - np.einsum("kji,kj->ki", states.mat_nb, earth_n)


def _sigma(source: MeasurementSource) -> np.ndarray:
    """One sigma of each channel (m, 9): each fix's own where it states it, else as believed, else a small one."""
    fixes, belief = source.fixes, source.belief
    stated = source.name == "gps"
    noise_point = belief.position_sigma_m or (2.5 if stated else REFERENCE_POSITION_M)
    velocity = belief.velocity_sigma_mps or (0.05 if stated else REFERENCE_VELOCITY_MPS)
    if source.name == "standstill":
        noise_point, velocity = STANDSTILL_POSITION_M, STANDSTILL_VELOCITY_MPS
    attitude = REFERENCE_ATTITUDE_RAD
    out = np.empty((fixes.time_s.size, CHANNELS))
    out[:, POSITION], out[:, VELOCITY], out[:, ATTITUDE] = noise_point, velocity, attitude
    for channels, own in ((POSITION, fixes.position_sigma_m), (VELOCITY, fixes.velocity_sigma_mps)):
        if own is not None:
            known = np.isfinite(own) & (own > 0.0)
            out[known, channels] = own[known, None]
    return out


def stands(believed: Believed) -> tuple[Stretch, ...]:
    """The stretches of a recording in which nobody moves a parked unit; none of one that is not parked."""
    if believed.recording.kind not in PARKED:
        return ()
    return tuple(
        Stretch(one.start_s + STAND_EDGE_S, one.end_s - STAND_EDGE_S)
        for one in still_stretches(believed.recording.imu, STAND_S + 2.0 * STAND_EDGE_S, MOVED_FACTOR)
    )


def stands_in_arcs(believed: Believed) -> bool:
    """Whether a recording is measured against its standstill alone, whatever else measured it."""
    return bool(believed.arcs) and believed.recording.kind in PARKED


def _standstill(believed: Believed, end_s: float) -> MeasurementSource:
    """Place and rest each epoch; in arcs, attitude as well, both of the arc with which a stand begins."""
    start, every_s = believed.start, longest_epoch_s(believed, end_s)
    time_s = np.arange(start.time_s + every_s, end_s + CLOCK_S, every_s)
    states, state = [start], np.zeros(time_s.size, dtype=int)
    known = np.full(time_s.size, not believed.arcs)
    for stand in believed.stands if believed.arcs else ():
        inside = (time_s >= stand.start_s) & (time_s <= stand.end_s)
        known |= inside
        state[inside] = len(states)
        states.append(next((one for one in believed.arcs if one.time_s >= stand.start_s), believed.arcs[-1]))
    time_s, state = time_s[known], state[known]
    fixes = Fixes(
        time_s=time_s,
        latitude_rad=np.array([one.latitude_rad for one in states])[state],
        longitude_rad=np.array([one.longitude_rad for one in states])[state],
        height_m=np.array([one.height_m for one in states])[state],
        velocity_n=np.zeros((time_s.size, 3)),
        valid=np.ones(time_s.size, dtype=bool),
        attitude_rad=np.array([one.attitude_rad for one in states])[state] if believed.arcs else None,
    )
    return MeasurementSource("standstill", fixes, GpsBelief(), time_s)
