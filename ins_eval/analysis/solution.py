"""How good an INS is, from the solution that it put out itself, beside GPS or a better navigator."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from ins_eval.analysis.correlated import Fit, Series, mean, regress, root_mean_square
from ins_eval.analysis.evaluation_numbers import ClockOffset, RecordingFacts, SolutionNumbers, Untold
from ins_eval.analysis.schuler import SCHULER_PERIOD_S, SchulerFit, fit_schuler
from ins_eval.error_model.geometry import States
from ins_eval.errors import DataRefused
from ins_eval.navigation import at_antenna, radial_error_rates
from ins_eval.recording import PARKED, Fixes, Recording
from ins_eval.reference import MISSING_ROW_FACTOR, Errors, compare, standstill
from ins_eval.strapdown import Solution
from ins_eval.tree import as_tree

if TYPE_CHECKING:
    import pandas as pd
    from scipy.interpolate import CubicSpline

SHORTEST_FOR_RATE_S = 0.5 * SCHULER_PERIOD_S  # below it a radial error over time is the start, not the instrument
CLOCK_LIMIT_S = 0.2  # half an interval, beyond which the motion does not determine the offset of the clocks
CLOCK_REPEATS = 4
NODES = 5.0  # s, of the error model
AXES = ("north", "east", "down")


@dataclass(frozen=True, eq=False)
class SolutionEvaluation:
    """The solution of an INS against what is known.

    `velocity` and `position` are its errors, None where either side has none; `clock` is the offset of the clock of
    GPS or reference that the velocities show (coefficient 0, s) with the constant velocity errors beside it
    (coefficients 1 and 2, m/s), None where the motion does not determine it, `clock_reason` says why; likewise
    `schuler` and its reason. Times count from `start_s`.
    """

    recording: Recording
    reference: Literal["ins", "gps", "standstill"]
    velocity: Errors | None
    position: Errors | None
    clock: Fit | None
    clock_reason: str
    schuler: SchulerFit | None
    schuler_reason: str
    notes: tuple[str, ...] = ()

    @property
    def start_s(self) -> float:
        """Start of navigation: the stated one, or the first row of the solution."""
        return self.recording.start.time_s

    @property
    def span_s(self) -> float:
        """From the start to the last epoch that was compared."""
        return max(float(one.time_s[one.valid][-1]) for one in (self.velocity, self.position) if one) - self.start_s

    @property
    def rates_follow(self) -> bool:
        """Whether a radial error rate, and of several flights a CEP, follows from so long a span."""
        return self.position is not None and self.span_s >= SHORTEST_FOR_RATE_S

    def to_frame(self) -> pd.DataFrame:
        """One row: velocity RMS and mean velocity errors in m/s, radial error rates in nmi/h, clock offset in s."""
        import pandas as pd

        of = self.numbers
        row: dict[str, Any] = {f"velocity_rms_{k}_mps": v.value for k, v in of.velocity_rms_mps.items()}
        row |= {f"velocity_mean_{k}_mps": v.value for k, v in of.velocity_mean_mps.items()}
        row |= {f"{k}_nmi_per_h": v for k, v in of.radial_error_rate_nmi_per_h.items()}
        return pd.DataFrame([{**row, "clock_offset_s": of.clock.found_s}], index=["solution"])

    @property
    def facts(self) -> RecordingFacts:
        """What was recorded."""
        time_s = self.recording.solution.time_s
        return RecordingFacts(
            self.recording.name, self.recording.kind, float(time_s[-1] - time_s[0]), self.recording.notes
        )

    @cached_property
    def tree(self) -> dict[str, Any]:
        """The tree ``ins-eval-evaluation/1`` of ``metrics.json``, of the solution alone."""
        return {
            "format": "ins-eval-evaluation/1",
            "recording": as_tree(self.facts),
            "solution": as_tree(self.numbers),
        }

    @cached_property
    def numbers(self) -> SolutionNumbers:
        """Its errors in numbers."""
        rms, means, final_m, rates = {}, {}, None, {}
        if self.velocity is not None:
            error = self.velocity.velocity_n[self.velocity.valid]
            there = [k for k in range(3) if np.isfinite(error[:, k]).all()]
            rms = {AXES[k]: root_mean_square(error[:, k] ** 2) for k in there}
            rms["horizontal"] = root_mean_square(error[:, 0] ** 2 + error[:, 1] ** 2)
            means = {AXES[k]: mean(error[:, k]) for k in there}
        if self.position is not None:
            last = np.flatnonzero(self.position.valid)[-1]
            final_m = float(np.hypot(self.position.north_m[last], self.position.east_m[last]))
        if self.rates_follow:
            time_s, position_m = self.track
            rates = radial_error_rates(position_m, time_s)
        return SolutionNumbers(
            name=self.recording.belief.solution.name,
            reference=self.reference,
            epochs=max(int(one.valid.sum()) for one in (self.velocity, self.position) if one is not None),
            start_s=float(self.start_s),
            end_s=float(self.start_s + self.span_s),
            notes=self.notes,
            clock=self._clock(),
            schuler=Untold(self.schuler_reason) if self.schuler is None else self.schuler,
            velocity_rms_mps=rms,
            velocity_mean_mps=means,
            final_radial_error_m=final_m,
            radial_error_rate_nmi_per_h=rates,
        )

    @property
    def track(self) -> tuple[np.ndarray, np.ndarray]:
        """Times since the start (m,) and position errors north and east (m, 2) in m of the valid epochs after it."""
        one = self.position
        later = one.valid & (one.time_s > self.start_s)
        return one.time_s[later] - self.start_s, np.column_stack([one.north_m, one.east_m])[later]

    def _clock(self) -> ClockOffset:
        believed_s = _believed_offset(self.recording, self.reference)
        if self.clock is None:
            return ClockOffset(believed_s, None, self.clock_reason)
        found = self.clock.estimate(0)
        constant = {AXES[k]: self.clock.estimate(1 + k) for k in range(2)}
        return ClockOffset(believed_s, found.value, None, (found.low, found.high), constant)


def evaluate_solution(recording: Recording) -> SolutionEvaluation:
    """Compare the solution that an INS put out with the reference, GPS or the standstill of a recording.

    Raises: DataRefused where there is nothing to compare with, or nothing in common.
    """
    rows = recording.solution
    fixes, kind, notes = _known(recording)
    section = recording.belief.gps if kind == "gps" else recording.belief.reference
    offset_s = _believed_offset(recording, kind)
    arm = section.lever_arm_m if kind != "standstill" else (0.0, 0.0, 0.0)
    if any(arm) and not _attitude_rows(rows).any():
        notes = (*notes, "The lever arm was not applied: the solution has no attitude.")
        arm = (0.0, 0.0, 0.0)
    stamp_s = rows.time_s - recording.belief.solution.time_offset_s
    errors = {}
    for group in ("velocity", "position"):
        seen, other = _has(rows, group), _has(fixes, group)
        if seen.sum() < 2 or other.sum() < 2:
            whose = "the solution" if seen.sum() < 2 else "what it is compared with"
            notes = (*notes, f"No {group}: {whose} has none.")
            continue
        solution = _solution(rows, stamp_s, seen, arm)
        errors[group] = _outside_gaps(compare(solution, _only(fixes, group), offset_s), solution.time_s)
    if not errors or not any(one.valid.sum() >= 2 for one in errors.values()):
        raise DataRefused(
            f"{recording.name}: solution and {'GPS' if kind == 'gps' else 'reference'} share neither velocities nor "
            "positions, expected one of them in both; add its columns to one of the tables"
        )
    clock, clock_reason = None, "it needs velocities, and there are none" if "velocity" not in errors else ""
    if kind == "standstill":
        clock_reason = "nothing moves at a standstill"
    elif "velocity" in errors:
        clock, clock_reason = _clock_offset(rows, stamp_s, arm, _only(fixes, "velocity"), offset_s)
    schuler, schuler_reason = _schuler(recording, fixes, stamp_s, errors.get("velocity"), clock, offset_s)
    return SolutionEvaluation(
        recording, kind, errors.get("velocity"), errors.get("position"), clock, clock_reason, schuler, schuler_reason,
        notes,
    )  # fmt: skip


def _known(recording: Recording) -> tuple[Fixes, Literal["ins", "gps", "standstill"], tuple[str, ...]]:
    """What the solution is compared with: the reference, else GPS, else a known standstill."""
    for fixes, kind in ((recording.reference, "ins"), (recording.gps, "gps")):
        if fixes is not None and (_has(fixes, "velocity").any() or _has(fixes, "position").any()):
            return fixes, kind, ()
    if recording.kind in PARKED and np.isfinite(recording.start.latitude_rad):
        rows = recording.solution
        every = _solution(rows, rows.time_s, np.ones(rows.time_s.size, dtype=bool), (0.0, 0.0, 0.0))
        return standstill(every, recording.start), "standstill", ()
    raise DataRefused(
        f"{recording.name}: an INS put out a solution, and there is nothing to compare it with; expected a table gps "
        "or reference with positions or velocities, or a recording at rest with [start]; add one"
    )


def _believed_offset(recording: Recording, kind: str) -> float:
    section = {"gps": recording.belief.gps, "ins": recording.belief.reference}.get(kind)
    return 0.0 if section is None else section.time_offset_s


def _has(fixes: Fixes, group: str) -> np.ndarray:
    """Rows (m,) that have north and east of a group; one that is marked as not valid, though it is whole, has not."""
    position = np.isfinite(fixes.latitude_rad) & np.isfinite(fixes.longitude_rad)
    velocity = np.isfinite(fixes.velocity_n[:, :2]).all(axis=1)
    there = position if group == "position" else velocity
    whole = (position | (not position.any())) & (velocity | (not velocity.any()))
    return there & (fixes.valid | ~whole)


def _only(fixes: Fixes, group: str) -> Fixes:
    """The rows of one group of columns, all else NaN."""
    rows = _has(fixes, group)
    nothing = np.full(int(rows.sum()), np.nan)
    position = group == "position"
    height = np.where(np.isfinite(fixes.height_m[rows]), fixes.height_m[rows], 0.0)
    velocity = fixes.velocity_n[rows].copy()
    if not np.isfinite(velocity[:, 2]).all():
        velocity[:, 2] = np.nan
    return Fixes(
        fixes.time_s[rows],
        fixes.latitude_rad[rows] if position else nothing,
        fixes.longitude_rad[rows] if position else nothing,
        height if position else nothing,
        np.full((nothing.size, 3), np.nan) if position else velocity,
        np.ones(nothing.size, dtype=bool),
    )


def _attitude_rows(rows: Fixes) -> np.ndarray:
    if rows.attitude_rad is None:
        return np.zeros(rows.time_s.size, dtype=bool)
    return np.isfinite(rows.attitude_rad).all(axis=1)


def _solution(rows: Fixes, stamp_s: np.ndarray, chosen: np.ndarray, lever_arm_m) -> Solution:
    """The `chosen` rows of a solution, at the antenna; a height that is missing is 0."""
    quaternion = np.tile([1.0, 0.0, 0.0, 0.0], (int(chosen.sum()), 1))
    if any(lever_arm_m):
        turning = _turning(rows, stamp_s)
        within = np.clip(stamp_s[chosen], turning.times[0], turning.times[-1])
        quaternion = turning(within).as_quat(scalar_first=True)
    solution = Solution(
        stamp_s[chosen],
        rows.latitude_rad[chosen],
        rows.longitude_rad[chosen],
        np.nan_to_num(rows.height_m[chosen]),
        rows.velocity_n[chosen],
        quaternion,
    )
    return at_antenna(solution, lever_arm_m)


def _turning(rows: Fixes, stamp_s: np.ndarray) -> Slerp:
    known = _attitude_rows(rows)
    return Slerp(stamp_s[known], Rotation.from_euler("ZYX", rows.attitude_rad[known][:, ::-1]))


def _outside_gaps(errors: Errors, samples_s: np.ndarray) -> Errors:
    """Errors without the epochs at which rows of the solution are missing."""
    return replace(errors, valid=errors.valid & ~_in_gap(errors.time_s, samples_s))


def _spline(time_s: np.ndarray, values: np.ndarray) -> CubicSpline:
    from scipy.interpolate import CubicSpline  # imported here, for it takes long and few need it

    return CubicSpline(time_s, values)


def _in_gap(time_s: np.ndarray, samples_s: np.ndarray) -> np.ndarray:
    spacing = np.diff(samples_s)
    right = np.clip(np.searchsorted(samples_s, time_s), 1, spacing.size)
    touched = np.minimum(np.abs(time_s - samples_s[right - 1]), np.abs(time_s - samples_s[right])) < 1e-6
    return (spacing[right - 1] > MISSING_ROW_FACTOR * np.median(spacing)) & ~touched


def _clock_offset(rows: Fixes, stamp_s, lever_arm_m, fixes: Fixes, believed_s: float) -> tuple[Fit | None, str]:
    """Stamp of the fixes minus that of the solution at the same instant, from their velocities.

    v_solution(t - s) - v_fix(t) = (offset - s) a + constant, with the acceleration a of the solution: repeated with s
    at the offset found. Velocities north and east have one offset and a constant each.
    """
    solution = _solution(rows, stamp_s, _has(rows, "velocity"), lever_arm_m)
    if solution.time_s.size < 4:
        return None, "the solution has too few rows"
    course = _spline(solution.time_s, solution.velocity_n[:, :2])
    offset_s = believed_s
    for _ in range(CLOCK_REPEATS):
        at_s = fixes.time_s - offset_s
        use = (at_s >= solution.time_s[0]) & (at_s <= solution.time_s[-1]) & ~_in_gap(at_s, solution.time_s)
        difference, acceleration = course(at_s[use]) - fixes.velocity_n[use, :2], course(at_s[use], 1)
        one = np.ones(int(use.sum()))
        found = regress([
            Series(at_s[use], np.column_stack([acceleration[:, k], one * (k == 0), one * (k == 1)]), difference[:, k])
            for k in range(2)
        ]) if use.sum() > 3 else None  # fmt: skip
        if found is None:
            return None, "too few epochs have both velocities, or nothing accelerates"
        if found.quantile * np.sqrt(found.covariance[0, 0]) > CLOCK_LIMIT_S:
            return None, f"the motion does not determine it to {CLOCK_LIMIT_S:g} s"
        offset_s += float(found.coefficients[0])
    return found._replace(coefficients=np.array([offset_s, *found.coefficients[1:]])), ""


def _schuler(
    recording: Recording,
    fixes: Fixes,
    stamp_s: np.ndarray,
    errors: Errors | None,
    clock: Fit | None,
    believed_s: float,
) -> tuple[SchulerFit | None, str]:
    rows, other_s = recording.solution, fixes.time_s
    if errors is None:
        return None, "it needs velocities of both"
    place = next(
        (
            (at_s[here], one.latitude_rad[here], one.height_m[here])
            for one, at_s in ((rows, stamp_s), (fixes, other_s))
            if (here := _has(one, "position")).sum() >= 2
        ),
        None,
    )
    start = recording.start
    if place is None and np.isfinite(start.latitude_rad):
        place = (np.array([start.time_s]), np.array([start.latitude_rad]), np.array([start.height_m]))
    if place is None:
        return None, "it needs the latitude: add positions, or [start]"
    valid = errors.valid
    time_s = errors.time_s[valid]
    if valid.sum() < 2:
        return None, "too few epochs"
    moving = _has(rows, "velocity")
    nodes_s = np.linspace(time_s[0], time_s[-1], max(2, int(np.ceil((time_s[-1] - time_s[0]) / NODES)) + 1))
    velocity = np.column_stack(
        [np.interp(nodes_s, stamp_s[moving], np.nan_to_num(v)) for v in rows.velocity_n[moving].T]
    )
    in_body = bool(_attitude_rows(rows).sum() >= 2)
    axes = np.broadcast_to(np.eye(3), (nodes_s.size, 3, 3))
    if in_body:
        turning = _turning(rows, stamp_s)
        axes = turning(np.clip(nodes_s, turning.times[0], turning.times[-1])).as_matrix()
    latitude, height = (np.interp(nodes_s, place[0], np.nan_to_num(x)) for x in place[1:])
    path = States(nodes_s, latitude, np.zeros_like(latitude), height, velocity, np.zeros_like(velocity), axes)
    error = errors.velocity_n[valid, :2]
    if clock is not None:  # what the offset of the clocks makes is neither the start's nor a sensor's
        course = _spline(stamp_s[moving], rows.velocity_n[moving, :2])
        acceleration = course(np.clip(time_s, stamp_s[moving][0], stamp_s[moving][-1]), 1)
        error = error - (clock.coefficients[0] - believed_s) * acceleration
    found = fit_schuler(time_s, error, path, in_body)
    return found, "" if found is not None else "the span is too short for so many unknowns"
