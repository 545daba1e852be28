"""A recording navigated in pieces, each started afresh at a fix: how far an instrument can be trusted between fixes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from ins_eval import metrics
from ins_eval.errors import DataRefused
from ins_eval.initialization import Initialization, find, follow, standstills
from ins_eval.navigation import evaluate, without_bias
from ins_eval.recording import Fixes, Recording, Start
from ins_eval.reference import Errors

FEWEST_PIECES = 5  # that an interval takes


@dataclass(frozen=True)
class Restarts:
    """How errors grow with the time since navigation was started afresh, (m,) each: RMS over `count` pieces.

    The intervals (2, m) hold the RMS with 95 %, by a bootstrap over pieces; NaN where there are fewer than five.
    """

    after_s: np.ndarray
    position_rms_m: np.ndarray
    velocity_rms_mps: np.ndarray
    position_interval_m: np.ndarray
    velocity_interval_mps: np.ndarray
    count: int

    @property
    def has_velocity(self) -> bool:
        """Whether the fixes have velocities."""
        return bool(np.isfinite(self.velocity_rms_mps).all())

    def as_tree(self) -> dict[str, Any]:
        """A branch of ``restarts`` of ``metrics.json``; without what the fixes have no velocities for."""
        found = {
            "count": self.count,
            "after_s": self.after_s.tolist(),
            "position_rms_m": self.position_rms_m.tolist(),
            "position_interval95_m": _listed(self.position_interval_m),
        }
        if self.has_velocity:
            found["velocity_rms_mps"] = self.velocity_rms_mps.tolist()
            found["velocity_interval95_mps"] = _listed(self.velocity_interval_mps)
        return found


def _listed(interval: np.ndarray) -> list[list[float]] | None:
    """Pairs of low and high; None where there are too few pieces for an interval."""
    return interval.T.tolist() if np.isfinite(interval).all() else None


def restarts(recording: Recording, dv_b: np.ndarray, every_s: float, begin: Initialization | None = None) -> Restarts:
    """Navigate in pieces of `every_s`, each started afresh at a fix.

    For instruments that cannot find north and drift away within minutes. A piece starts with the attitude that the
    reference has then; where no reference has one, with the state that `initialization.follow` makes of all fixes
    before it, from `begin` on. The errors of a piece are taken relative to those at its start, so that the noise of
    the fix it started from is in them twice.
    Raises: DataRefused where there is nothing to start from or no piece lies between valid fixes.
    """
    reference = recording.reference
    if reference is not None and reference.attitude_rad is not None:
        pieces = _from_reference(recording, dv_b, every_s)
    else:
        pieces = _from_fixes(recording, dv_b, every_s, begin)
    after_s = np.arange(1.0, every_s + 0.5)
    position, speed = [], []
    for at_s, errors in pieces:
        valid = np.flatnonzero(errors.valid)
        rows = valid[np.round(np.interp(at_s + after_s, errors.time_s[valid], np.arange(valid.size))).astype(int)]
        first = valid[0]
        position.append(
            np.hypot(errors.north_m[rows] - errors.north_m[first], errors.east_m[rows] - errors.east_m[first])
        )
        speed.append(np.hypot(*(errors.velocity_n[rows, :2] - errors.velocity_n[first, :2]).T))
    if not position:
        raise DataRefused(
            f"{recording.name}: no stretch of {every_s:g} s lies between valid fixes and attitudes; "
            "give a shorter --restart-every"
        )
    return Restarts(
        after_s,
        metrics.root_mean_square(np.array(position).T),
        metrics.root_mean_square(np.array(speed).T),
        _over_pieces(np.array(position)),
        _over_pieces(np.array(speed)),
        len(position),
    )


def _over_pieces(values: np.ndarray) -> np.ndarray:
    """95 % interval (2, m) of the RMS over pieces (count, m), by 2000 bootstrap samples of them."""
    if len(values) < FEWEST_PIECES:
        return np.full((2, values.shape[1]), np.nan)
    chosen = np.random.default_rng(0).multinomial(len(values), np.full(len(values), 1.0 / len(values)), 2000)
    return np.quantile(np.sqrt(chosen @ values**2 / len(values)), [0.025, 0.975], axis=0)


def _from_reference(recording: Recording, dv_b: np.ndarray, every_s: float) -> Iterator[tuple[float, Errors]]:
    """Begin and errors of each piece, started with the attitude of the reference."""
    reference, fixes = recording.reference, recording.gps or recording.reference
    section = recording.belief.gps if recording.gps is not None else recording.belief.reference
    known = np.isfinite(reference.attitude_rad).all(axis=1)
    turning = Slerp(reference.time_s[known], Rotation.from_euler("ZYX", reference.attitude_rad[known][:, ::-1]))
    instants = fixes.time_s - section.time_offset_s
    span = (
        max(reference.time_s[known][0], recording.imu.time_s[0]),
        min(reference.time_s[known][-1], recording.imu.time_s[-1]),
    )
    next_s = -np.inf
    for k in np.flatnonzero(fixes.valid):
        if instants[k] < max(next_s, span[0]) or instants[k] + every_s > span[1]:
            continue
        next_s = instants[k] + every_s
        errors = _piece(recording, dv_b, fixes, k, float(instants[k]), turning, every_s)
        if errors is not None:
            yield float(instants[k]), errors


def _from_fixes(
    recording: Recording, dv_b: np.ndarray, every_s: float, begin: Initialization | None
) -> Iterator[tuple[float, Errors]]:
    """Begin and errors of each piece, started with the state that the fixes before it give."""
    dtheta_unbiased, dv_unbiased = without_bias(recording, dv_b)
    state = begin or find(recording, dtheta_unbiased, dv_unbiased)
    still, last_s = standstills(recording), float(recording.imu.time_s[-1])
    while state.start.time_s + every_s <= last_s:
        at_s = state.start.time_s
        part, rows = recording.between(at_s, at_s + every_s)
        with suppress(DataRefused):  # an outage: nothing to compare with
            yield at_s, evaluate(part, dv_b[rows], state, until_s=at_s + every_s).errors
        state = follow(part, state, dtheta_unbiased[rows], dv_unbiased[rows], at_s + every_s, still)


def _piece(recording, dv_b, fixes: Fixes, k: int, at_s: float, turning: Slerp, every_s: float) -> Errors | None:
    """Errors over `every_s` from fix `k` on, or None where fewer than two fixes are valid in it."""
    first = int(np.searchsorted(recording.imu.time_s, at_s + 1e-6))
    begin_s = float(recording.imu.time_s[first - 1]) if first else recording.start.time_s
    roll_pitch_heading = turning(np.clip(begin_s, turning.times[0], turning.times[-1])).as_euler(
        "ZYX", suppress_warnings=True
    )[::-1]
    start = Start(begin_s, **fixes.state(k), attitude_rad=tuple(float(a) for a in roll_pitch_heading))
    try:
        return evaluate(recording, dv_b, until_s=at_s + every_s, start=start).errors
    except DataRefused:
        return None
