"""The comparator: a navigation solution against GPS, against a better navigator, or against a known standstill.

The reference is never interpolated where it is silent. The INS, which is denser and smooth, is brought to the
epochs of the reference; over a gap it is the INS-minus-reference difference that is carried across (`bridge`),
and bridged epochs stay marked as not valid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numba
import numpy as np
from scipy.spatial.transform import Rotation

from ins_eval import earth
from ins_eval.errors import DataRefused
from ins_eval.recording import Fixes, Start, whole_rows
from ins_eval.strapdown import Solution

MISSING_ROW_FACTOR = 1.5  # a spacing above this many medians means that rows are missing
_CLOCK_ROUNDING_S = 1e-6  # a stamp this far outside the solution still belongs to it
_VELOCITY_NODES = 6  # samples of the INS through which its velocity is interpolated


class Gap(NamedTuple):
    """A silence of the reference, from its last valid epoch to the next one (or to the end of the record)."""

    start_s: float
    end_s: float

    @property
    def duration_s(self) -> float:
        return self.end_s - self.start_s


class GapSummary(NamedTuple):
    """How often and how long a reference was silent."""

    count: int
    total_s: float
    longest_s: float


@dataclass(frozen=True, eq=False)
class Errors:
    """INS minus reference at the epochs of the reference, in the local NED of the reference.

    `time_s` (m,) is on the clock of the IMU and includes the epochs of missing rows. `north_m`, `east_m`,
    `down_m` (m,) are in m, `velocity_n` (m, 3) in m/s; NaN where the reference is silent. `valid` (m,) is
    False there: only valid epochs enter a metric.
    """

    time_s: np.ndarray
    north_m: np.ndarray
    east_m: np.ndarray
    down_m: np.ndarray
    velocity_n: np.ndarray
    valid: np.ndarray
    gaps: tuple[Gap, ...]


@dataclass(frozen=True)
class AttitudeErrors:
    """Attitude of the INS against that of a reference, at the epochs (m,) at which it has one.

    C_INS = exp(phi x) C_reference: phi (m, 3) in rad about north, east and down; about down it is that of heading.
    `time_s` (m,) is on the clock of the IMU.
    """

    time_s: np.ndarray
    phi_n: np.ndarray


class _Rows(NamedTuple):
    """A reference in rows: `columns` (m, 6) are latitude, longitude, height and velocity."""

    time_s: np.ndarray
    columns: np.ndarray
    valid: np.ndarray


@dataclass(frozen=True, eq=False)
class _Epochs:
    """A reference beside a solution: its rows, metres for a radian north and east, gaps.

    The place of each row (m,) among the samples (n,) of the solution: the sample before it, its distance to the next,
    the fraction of it, and the nearest nodes (m, k) with their weights (m, k).
    """

    rows: _Rows
    north_m: np.ndarray
    east_m: np.ndarray
    gaps: tuple[Gap, ...]
    left: np.ndarray
    step: np.ndarray
    fraction: np.ndarray
    nodes: np.ndarray
    weights: np.ndarray


def compare(solution: Solution, fixes: Fixes, time_offset_s: float = 0.0) -> Errors:
    """Error of a solution at the epochs of a reference.

    north = (M + h) dL,   east = (N + h) cos(L) dl,   down = -dh,   d = INS - reference

    with radii, latitude L and height h of the reference and the longitude difference wrapped to +-pi. A stamp t
    of the reference means the instant t - `time_offset_s` on the clock of the IMU.

    Raises
    ------
    DataRefused
        The reference does not overlap the solution, or they share fewer than 2 valid epochs.
    """
    return _differences(solution, _epochs(fixes, time_offset_s, solution.time_s.tobytes()))


@lru_cache(maxsize=2)  # every compensation of a recording is compared at the same instants
def _epochs(fixes: Fixes, time_offset_s: float, sample_bytes: bytes) -> _Epochs:
    samples = np.frombuffer(sample_bytes)
    rows = _common(samples, fixes, time_offset_s)
    rows.columns[~rows.valid] = np.nan
    return _placed(samples, rows)


def compare_attitude(solution: Solution, fixes: Fixes, time_offset_s: float = 0.0) -> AttitudeErrors | None:
    """Attitude error of a solution where the reference has an attitude; None where it has fewer than 2 inside.

    Between its rows the solution turns at a constant rate.
    """
    if fixes.attitude_rad is None:
        return None
    samples, time_s = solution.time_s, fixes.time_s - time_offset_s
    known = np.isfinite(fixes.attitude_rad).all(axis=1) & (time_s >= samples[0]) & (time_s <= samples[-1])
    if samples.size < 2 or np.count_nonzero(known) < 2:
        return None
    time_s = time_s[known]
    left = np.clip(np.searchsorted(samples, time_s, side="right") - 1, 0, samples.size - 2)
    before, after = (Rotation.from_quat(solution.quaternion_nb[k], scalar_first=True) for k in (left, left + 1))
    fraction = (time_s - samples[left]) / (samples[left + 1] - samples[left])
    navigated = before * Rotation.from_rotvec(fraction[:, None] * (before.inv() * after).as_rotvec())
    seen = Rotation.from_euler("ZYX", fixes.attitude_rad[known][:, ::-1])
    return AttitudeErrors(time_s, (navigated * seen.inv()).as_rotvec())


def raw_vertices(solution: Solution, fixes: Fixes, time_offset_s: float = 0.0) -> Errors:
    """What `compare` would give if the reference *itself* were drawn straight across its gaps: for display only.

    Across a turn this makes the vertices of Paper A, Fig. 12. They are errors of the straight line, not of
    the INS; the epochs stay not valid. A gap at the start or the end stays empty.
    """
    rows = _drawn_straight(_common(solution.time_s, fixes, time_offset_s))
    return _differences(solution, _placed(solution.time_s, rows))


def outages(fixes: Fixes) -> tuple[Gap, ...]:
    """Stretches in which a reference is silent: marked not valid, not a number, or its rows are missing.

    Rows are missing where two stamps are more than 1.5 median spacings apart. A quantity that the
    reference never delivers (a navigator without velocity) is not an outage.
    """
    rows = _with_missing_rows(_rows(fixes))
    return _gaps(rows.time_s, rows.valid)


def summary(gaps: Sequence[Gap]) -> GapSummary:
    """Number, total and longest duration of `gaps`."""
    durations = [gap.duration_s for gap in gaps]
    return GapSummary(len(durations), float(sum(durations)), float(max(durations, default=0.0)))


def bridge(errors: Errors, window_s: float = 60.0) -> Errors:
    """Carry the INS-minus-reference difference across each gap, so that its curve can be drawn.

    Each component of the difference is regressed linearly on the valid epochs within `window_s` on either side
    of the gap. Bridged epochs stay not valid, so they enter no RMS. A gap at the start or the end is not
    extrapolated and stays NaN.
    """
    time_s, valid = errors.time_s, errors.valid
    values = np.column_stack([errors.north_m, errors.east_m, errors.down_m, errors.velocity_n])
    for start_s, end_s in errors.gaps:
        first, last = np.searchsorted(time_s, (start_s, end_s))
        inside = first + np.flatnonzero(~valid[first : last + 1])
        if inside[0] == 0 or inside[-1] == time_s.size - 1:
            continue
        first = np.searchsorted(time_s, start_s - window_s)
        last = np.searchsorted(time_s, end_s + window_s, side="right")
        around = first + np.flatnonzero(valid[first:last])
        centre_s = time_s[around].mean()
        t = time_s[around] - centre_s
        level = values[around].mean(axis=0)
        slope = t @ (values[around] - level) / (t @ t)
        values[inside] = level + (time_s[inside] - centre_s)[:, None] * slope
    north_m, east_m, down_m = values[:, :3].T
    return replace(errors, north_m=north_m, east_m=east_m, down_m=down_m, velocity_n=values[:, 3:])


def standstill(solution: Solution, start: Start, period_s: float = 1.0) -> Fixes:
    """The reference of a parked vehicle: the position of `start` and no velocity, every `period_s`."""
    first, last = solution.time_s[0], solution.time_s[-1]
    time_s = first + period_s * np.arange(np.floor((last - first + _CLOCK_ROUNDING_S) / period_s) + 1)
    return Fixes(
        time_s=time_s,
        latitude_rad=np.full(time_s.size, start.latitude_rad),
        longitude_rad=np.full(time_s.size, start.longitude_rad),
        height_m=np.full(time_s.size, start.height_m),
        velocity_n=np.zeros((time_s.size, 3)),
        valid=np.ones(time_s.size, dtype=bool),
    )


def _common(samples: np.ndarray, fixes: Fixes, time_offset_s: float) -> _Rows:
    """The part of the reference that lies inside the samples of a solution, on its clock, missing rows put in."""
    if fixes.time_s.size == 0:
        raise DataRefused("reference: it has no rows; expected at least 2 epochs inside the solution")
    instants = np.asarray(fixes.time_s, dtype=float) - time_offset_s
    first, last = float(samples[0]), float(samples[-1])
    inside = (instants >= first - _CLOCK_ROUNDING_S) & (instants <= last + _CLOCK_ROUNDING_S)
    spans = (
        f"it covers {instants[0]:.3f} to {instants[-1]:.3f} s on the clock of the IMU "
        f"and the solution {first:.3f} to {last:.3f} s"
    )
    if not inside.any():
        raise DataRefused(f"reference: {spans}, which do not overlap; check its clock and its time_offset_s")
    rows = _rows(fixes)
    common = _with_missing_rows(_Rows(instants[inside], rows.columns[inside], rows.valid[inside]))
    if np.count_nonzero(common.valid) < 2:
        raise DataRefused(
            f"reference: {spans}, with {np.count_nonzero(common.valid)} valid epoch(s) in common; expected at least 2"
        )
    return common


def _rows(fixes: Fixes) -> _Rows:
    columns = np.column_stack([fixes.latitude_rad, fixes.longitude_rad, fixes.height_m, fixes.velocity_n])
    return _Rows(np.asarray(fixes.time_s, dtype=float), columns, np.asarray(fixes.valid, dtype=bool))


def _with_missing_rows(rows: _Rows) -> _Rows:
    """The same reference on an unbroken series of epochs; `valid` tells which epochs it really delivers."""
    time_s, columns = rows.time_s, rows.columns
    valid = rows.valid & whole_rows(columns) & np.isfinite(columns).any(axis=1)
    spacing = np.diff(time_s)
    intervals = spacing / np.median(spacing) if spacing.size else spacing
    if not (intervals > MISSING_ROW_FACTOR).any():
        return _Rows(time_s, columns, valid)
    # number of rows that stand for each row: itself, and after it the missing ones
    copies = np.append(np.where(intervals > MISSING_ROW_FACTOR, np.rint(intervals), 1), 1).astype(int)
    row = np.repeat(np.arange(time_s.size), copies)
    place = np.arange(row.size) - np.searchsorted(row, row, side="left")
    missing = place > 0
    step = np.append(spacing, 0.0) / copies
    columns = columns[row]
    columns[missing] = np.nan
    return _Rows(time_s[row] + place * step[row], columns, valid[row] & ~missing)


def _gaps(time_s: np.ndarray, valid: np.ndarray) -> tuple[Gap, ...]:
    if time_s.size == 0:
        return ()
    edges = np.diff(np.concatenate([[0], ~valid, [0]]).astype(int))
    before = np.maximum(np.flatnonzero(edges == 1) - 1, 0)
    after = np.minimum(np.flatnonzero(edges == -1), time_s.size - 1)
    return tuple(Gap(float(time_s[i]), float(time_s[j])) for i, j in zip(before, after, strict=True))


def _drawn_straight(rows: _Rows) -> _Rows:
    time_s, columns, valid = rows
    known = columns[valid]
    known[:, 1] = np.unwrap(known[:, 1])
    for j in range(columns.shape[1]):
        columns[~valid, j] = np.interp(time_s[~valid], time_s[valid], known[:, j], left=np.nan, right=np.nan)
    return rows


def _differences(solution: Solution, epochs: _Epochs) -> Errors:
    time_s, columns, valid = epochs.rows
    latitude_rad, longitude_rad, height_m, velocity_n = _interpolated(solution, epochs)
    longitude_error = np.remainder(longitude_rad - columns[:, 1] + np.pi, 2.0 * np.pi) - np.pi
    return Errors(
        time_s=time_s,
        north_m=epochs.north_m * (latitude_rad - columns[:, 0]),
        east_m=epochs.east_m * longitude_error,
        down_m=columns[:, 2] - height_m,
        velocity_n=velocity_n - columns[:, 3:],
        valid=valid,
        gaps=epochs.gaps,
    )


def _interpolated(solution: Solution, epochs: _Epochs) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Latitude, longitude, height (m,) and velocity (m, 3) of the solution at epochs, from the samples around each.

    Position: cubic Hermite with the solution's own velocity, error h^4 x''''/384 for a sample spacing h.
    Velocity: the polynomial through the nearest 6 samples, error below h^6 v^(6)/200.
    """
    state = (solution.latitude_rad, solution.longitude_rad, solution.height_m, solution.velocity_n)
    places = (epochs.left, epochs.step, epochs.fraction, epochs.nodes, epochs.weights)
    position, velocity_n = _between(*places, *(np.ascontiguousarray(one) for one in state))
    return *position, velocity_n


@numba.njit(cache=True)
def _between(left, step, u, nodes, weights, latitude, longitude, height, velocity_n):
    """Latitude, longitude and height (3, m) and velocity (m, 3) at instants between samples."""
    position = np.empty((3, left.size))
    velocity = np.zeros((left.size, 3))
    values, rates = np.empty((3, 2)), np.empty((3, 2))
    for k in range(left.size):
        for end in range(2):
            i = left[k] + end
            meridian_m, transverse_m = earth.radii(latitude[i])
            values[0, end], values[1, end], values[2, end] = latitude[i], longitude[i], height[i]
            rates[0, end] = velocity_n[i, 0] / (meridian_m + height[i])
            rates[1, end] = velocity_n[i, 1] / ((transverse_m + height[i]) * np.cos(latitude[i]))
            rates[2, end] = -velocity_n[i, 2]
        turn = 2.0 * np.pi * np.round((values[1, 1] - values[1, 0]) / (2.0 * np.pi))  # across 180 degrees
        values[1, 1] -= turn
        for quantity in range(3):
            change = values[quantity, 1] - values[quantity, 0]
            excess_0, excess_1 = rates[quantity, 0] * step[k] - change, rates[quantity, 1] * step[k] - change
            bend = u[k] * (1.0 - u[k]) * ((1.0 - u[k]) * excess_0 - u[k] * excess_1)
            position[quantity, k] = values[quantity, 0] + u[k] * change + bend
        for j in range(nodes.shape[1]):
            for axis in range(3):
                velocity[k, axis] += weights[k, j] * velocity_n[nodes[k, j], axis]
    return position, velocity


def _placed(samples: np.ndarray, rows: _Rows) -> _Epochs:
    """The rows of a reference among the samples (n,) of a solution, in s."""
    if samples.size < 2:
        raise DataRefused(f"solution: {samples.size} sample(s), expected at least 2 to compare with a reference")
    time_s, (latitude, _, height) = rows.time_s, rows.columns[:, :3].T
    meridian_m, transverse_m = earth.radii(latitude)
    left = np.clip(np.searchsorted(samples, time_s, side="right") - 1, 0, samples.size - 2)
    step = samples[left + 1] - samples[left]
    count = min(_VELOCITY_NODES, samples.size)
    first = np.clip(left - count // 2 + 1, 0, samples.size - count)
    nodes = first[:, None] + np.arange(count)
    return _Epochs(
        rows,
        meridian_m + height,
        (transverse_m + height) * np.cos(latitude),
        _gaps(time_s, rows.valid),
        left,
        step,
        (time_s - samples[left]) / step,
        nodes,
        _lagrange_weights(samples[nodes] - time_s[:, None]),
    )


def _lagrange_weights(offset_s: np.ndarray) -> np.ndarray:
    """Weights (m, k) of the samples at `offset_s` (m, k) in the polynomial through them, at offset zero."""
    count = offset_s.shape[1]
    weights = np.ones_like(offset_s)
    for j in range(count):
        others = [i for i in range(count) if i != j]
        weights[:, j] = np.prod(offset_s[:, others] / (offset_s[:, others] - offset_s[:, [j]]), axis=1)
    return weights
