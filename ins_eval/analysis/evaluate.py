"""How good an instrument is, from its own recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import cache, cached_property
from math import ceil
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ins_eval.analysis.compensations import arms_of
from ins_eval.analysis.evaluation_numbers import (
    LOST_MPS,
    ComparedWith,
    EvaluationNumbers,
    FoundStart,
    NavigatedSpan,
    NumericFloor,
    RecordingFacts,
    StartAttitude,
)
from ins_eval.analysis.solution import SolutionEvaluation, evaluate_solution
from ins_eval.bandwidth import FastMotion, fast_motion
from ins_eval.believed import belief_rows, believed, recorded_velocity
from ins_eval.compensation import CompensationModel
from ins_eval.earth import EARTH_RATE, gravity
from ins_eval.errors import DataRefused, UsageError
from ins_eval.grade import Grade, measure_grade
from ins_eval.imu import Mission
from ins_eval.initialization import (
    ACCELEROMETER_BIAS,
    ACCELEROMETER_SCALE,
    ATTITUDE,
    GYRO_BIAS,
    GYRO_SCALE,
    POSITION,
    VELOCITY,
    Initialization,
)
from ins_eval.navigation import (
    Evaluation,
    Measures,
    beginning,
    evaluate,
    height_aid,
    measures,
    numeric_floor,
    polar_error_m,
    since_start,
)
from ins_eval.profile import load
from ins_eval.recording import PARKED, Imu, Recording, Start
from ins_eval.recording.stillness import Stretch
from ins_eval.reference import Errors
from ins_eval.restarts import Restarts, restarts
from ins_eval.strapdown import SAMPLES_PER_STEP, Solution
from ins_eval.trajectory import MAX_RATE_HZ, MIN_RATE_HZ
from ins_eval.tree import as_tree
from ins_eval.units import DEG, DEG_PER_H, UG

if TYPE_CHECKING:
    import pandas as pd

SHORTEST_NAVIGATION_S = 10.0
SHORTEST_PIECE_S = 1.0  # that is navigated from a fix of its own: one fix of most receivers; by reasoning
RESTART_EVERY_S = 30.0  # of what is lost by then
MOST_ROWS = 500_000  # of a solution that is kept beside its errors: 2.8 h at 200 Hz whole
POLAR_M = 0.01  # a hundred times what navigation leaves in the same time at 34 degrees and 10 Hz


@dataclass(frozen=True, eq=False)
class RecordingEvaluation:
    """A recording navigated once with each compensation.

    `standstill` is the stretch it was aligned on (None: the attitude of its start was taken or found), `navigated` and
    `restarts` are by compensation; `restarts` is empty where none were asked for.
    `fast_motion` is what motion too fast for the samples may have left in the first of them.
    `solution` is what the INS put out itself, where that was recorded, too.
    """

    recording: Recording
    standstill: Stretch | None
    navigated: Mapping[str, Evaluation]
    restarts: Mapping[str, Restarts]
    fast_motion: FastMotion
    solution: SolutionEvaluation | None = None

    @property
    def first(self) -> Evaluation:
        """The first of the compensations; alignment and reference are the same for all."""
        return next(iter(self.navigated.values()))

    @property
    def rate_hz(self) -> float:
        """Samples a second."""
        return round(1.0 / float(np.median(np.diff(self.recording.imu.time_s))), 6)

    @property
    def reference(self) -> Literal["ins", "gps", "standstill", "attitude"]:
        """What the solution is compared with."""
        reference = self.recording.reference
        if reference is not None and np.isfinite(reference.latitude_rad).any():
            return "ins"
        if self.recording.gps is not None:
            return "gps"
        return "standstill" if self.recording.kind in PARKED else "attitude"

    @cached_property
    def grade(self) -> Grade | None:
        """What its stretches at rest show, where something was believed from them or the unit is parked."""
        belief = self.recording.belief
        if self.recording.kind != "static" and belief.gyro.source is None and belief.accelerometer.source is None:
            return None
        return measure_grade(self.recording, recorded_velocity(self.recording))

    @cached_property
    def floor(self) -> NumericFloor:
        """The same navigation of an IMU without errors for as long: at the same place, or on the shipped flight."""
        time_s = self.first.solution.time_s
        return _floor(self.recording, float(time_s[-1] - time_s[0]), self.rate_hz)

    def to_frame(self) -> pd.DataFrame:
        """One row a compensation: velocity RMS in m/s, radial error rates in nmi/h, last radial error in m."""
        import pandas as pd

        rows = {
            name: {
                **{f"velocity_rms_{axis}_mps": value for axis, value in found.velocity_rms_mps.items()},
                **{f"{rate}_nmi_per_h": value for rate, value in found.radial_error_rate_nmi_per_h.items()},
                "final_radial_error_m": found.final_radial_error_m,
            }
            for name, found in self.measures.items()
        }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("compensation")

    def errors_to_frame(self) -> pd.DataFrame:
        """North, east and down errors of position in m and velocity in m/s at each epoch, by compensation."""
        import pandas as pd

        frames = {}
        for name, navigated in self.navigated.items():
            errors, time_s = since_start(navigated)
            columns = {f"{axis}_m": getattr(errors, f"{axis}_m") for axis in ("north", "east", "down")}
            columns |= {f"{axis}_mps": errors.velocity_n[:, k] for k, axis in enumerate(("north", "east", "down"))}
            frames[name] = pd.DataFrame({"time_s": time_s, **columns, "valid": errors.valid})
        return pd.concat(frames, names=["compensation", "epoch"])

    @cached_property
    def measures(self) -> dict[str, Measures]:
        """Errors of each compensation in numbers."""
        return {
            name: replace(measures(one), final_radial_error_m=_final_m(one.errors))
            for name, one in self.navigated.items()
        }

    @cached_property
    def tree(self) -> dict[str, Any]:
        """The tree ``ins-eval-evaluation/1`` of ``metrics.json``."""
        return as_tree(self.numbers)

    @cached_property
    def numbers(self) -> EvaluationNumbers:
        """What was found, in numbers."""
        recording, first = self.recording, self.first
        errors, time_s = since_start(first)
        return EvaluationNumbers(
            recording=RecordingFacts(
                recording.name,
                recording.kind,
                float(recording.imu.time_s[-1] - recording.start.time_s),
                recording.notes,
                self.rate_hz,
                0 if recording.imu.filled is None else int(recording.imu.filled.sum()),
            ),
            belief=tuple(belief_rows(recording)),
            grade=self.grade,
            alignment=_attitude(recording, self.standstill, first),
            navigation=NavigatedSpan(
                float(first.solution.time_s[0]), float(first.solution.time_s[-1]), _vertical(recording)
            ),
            compensations=self.measures,
            floor=self.floor,
            reference=ComparedWith(
                kind=self.reference,
                epochs=int(errors.valid.sum()),
                attitude_epochs=0 if first.attitude is None else first.attitude.time_s.size,
                outages=len(errors.gaps),
                outage_s=float(sum(gap.duration_s for gap in errors.gaps)),
                first_s=float(time_s[0]),
                last_s=float(time_s[-1]),
            ),
            solution=None if self.solution is None else self.solution.numbers,
            restarts=self.restarts,
        )


def evaluate_recording(
    recording: Recording,
    compensations: Sequence[str] = (),
    restart_every_s: float | None = None,
    models: Mapping[str, Sequence[CompensationModel]] | None = None,
) -> RecordingEvaluation:
    """Navigate a recording with each compensation and compare it with what is known.

    Parameters
    ----------
    compensations : those wanted, by name or file; none: all that the recording has
    restart_every_s : also in pieces of this length, see `restarts`; None: in pieces of `RESTART_EVERY_S` where the
        horizontal velocity RMS of every compensation is above `LOST_MPS`, and there are fixes to start from
    models : further compensations of pulses by name, a fitted model for each of x, y and z

    Raises: DataRefused, UsageError.
    """
    if restart_every_s is not None and not SHORTEST_PIECE_S <= restart_every_s < np.inf:
        raise UsageError(
            f"{recording.name}: pieces of {restart_every_s:g} s, expected at least {SHORTEST_PIECE_S:g}; give another "
            "--restart-every"
        )
    recording = believed(recording)
    arms = arms_of(recording, compensations, models or {})
    evaluations, pieces, notes, stand, fast = {}, {}, [], None, None
    for name, make in arms.items():
        arm = make()  # one at a time: the increments of a day at 200 Hz take 0.4 GB
        if arm.alike:
            notes.append(f"{name}: the one accelerometer of this file was taken for x, y and z.")
        begin = beginning(arm.recording, arm.velocity)
        stand = begin if stand is None and isinstance(begin, Stretch) else stand
        end_s = recording.start.time_s
        if begin is not None:
            end_s = begin.end_s if isinstance(begin, Stretch) else begin.start.time_s
        left_s = recording.imu.time_s[-1] - end_s
        if left_s < SHORTEST_NAVIGATION_S:
            raise DataRefused(
                f"{recording.name}: the stretch to align on ends {left_s:.0f} s before the recording; expected at "
                f"least {SHORTEST_NAVIGATION_S:.0f} s to navigate after it, record longer"
            )
        fast = fast or fast_motion(recording.imu.time_s, recording.imu.gyro, arm.velocity)
        one = evaluate(arm.recording, arm.velocity, begin)
        evaluations[name] = replace(one, solution=_thinned(one.solution))
        if restart_every_s is not None:
            pieces[name] = restarts(arm.recording, arm.velocity, restart_every_s, one.initialization)
        elif recording.gps is not None and measures(one).velocity_rms_mps.get("horizontal", 0.0) > LOST_MPS:
            with suppress(DataRefused):  # nothing to start from, or no piece between outages
                pieces[name] = restarts(arm.recording, arm.velocity, RESTART_EVERY_S, one.initialization)
    if restart_every_s is None and len(pieces) < len(arms):
        pieces = {}
    polar = _near_a_pole(next(iter(evaluations.values())).solution, recording)
    recording = replace(recording, notes=(*recording.notes, *notes, *polar, *([str(fast)] if fast.warned else [])))
    solution = None if recording.solution is None else evaluate_solution(recording)
    return RecordingEvaluation(recording, stand, evaluations, pieces, fast, solution)


def _thinned(solution: Solution) -> Solution:
    """The same in at most `MOST_ROWS` rows and the last."""
    rows = solution.time_s.size
    if rows <= MOST_ROWS:
        return solution
    kept = np.append(np.arange(0, rows - 1, -(-rows // MOST_ROWS)), rows - 1)
    return Solution(*(getattr(solution, field.name)[kept] for field in fields(solution)))


def _near_a_pole(solution: Solution, recording: Recording) -> list[str]:
    """What the navigation frame leaves there, where it is large enough to warn of."""
    polar_m = polar_error_m(solution, 1.0 / float(np.median(recording.interval_s)))
    if polar_m < POLAR_M:
        return []
    latitude_deg = float(np.degrees(np.abs(solution.latitude_rad).max()))
    return [
        f"At {latitude_deg:.2f} degrees of latitude north turns so fast that the navigation itself may be off by "
        f"{polar_m:.2g} m; a higher sample rate reduces this."
    ]


def _final_m(errors: Errors) -> float | None:
    """The radial error at the last epoch that has a position, where one has."""
    placed = np.flatnonzero(errors.valid & np.isfinite(errors.north_m + errors.east_m))
    return float(np.hypot(errors.north_m[placed[-1]], errors.east_m[placed[-1]])) if placed.size else None


def _attitude(recording: Recording, stand: Stretch | None, evaluation: Evaluation) -> StartAttitude:
    """With what attitude navigation began, and how it was found."""
    found, aligned = evaluation.initialization, evaluation.alignment
    begin = recording.start if found is None else found.start
    begin = begin if aligned is None else aligned.start
    roll_deg, pitch_deg, heading_deg = (float(a / DEG) for a in begin.attitude_rad)
    angles = {"roll_deg": roll_deg, "pitch_deg": pitch_deg, "heading_deg": heading_deg % 360.0}
    if found is not None:
        return _found_start(angles, found)
    if aligned is None:
        return StartAttitude(**angles)
    stated = recording.start.attitude_rad
    return StartAttitude(
        **angles,
        stretch_s=(stand.start_s, stand.end_s),
        heading_sigma_deg=aligned.heading_sigma_rad / DEG,
        documented_heading_deg=None if stated is None else float(stated[2] / DEG) % 360.0,
    )


def _found_start(angles: Mapping[str, float], found: Initialization) -> FoundStart:
    sigma = found.sigmas
    return FoundStart(
        **angles,
        window_s=(found.window.start_s, found.window.end_s),
        roll_pitch_sigma_deg=float(np.hypot(*sigma[ATTITUDE][:2]) / np.sqrt(2.0) / DEG),
        heading_sigma_deg=found.heading_sigma_rad / DEG,
        heading_known=found.heading_known,
        rival_headings_deg=tuple(one / DEG % 360.0 for one in found.rival_headings_rad),
        velocity_sigma_mps=tuple(sigma[VELOCITY].tolist()),
        position_sigma_m=tuple(sigma[POSITION].tolist()),
        gyro_bias_deg_per_h=tuple((found.gyro_bias_radps / DEG_PER_H).tolist()),
        gyro_bias_sigma_deg_per_h=tuple((sigma[GYRO_BIAS] / DEG_PER_H).tolist()),
        accelerometer_bias_ug=tuple((found.accelerometer_bias_mps2 / UG).tolist()),
        accelerometer_bias_sigma_ug=tuple((sigma[ACCELEROMETER_BIAS] / UG).tolist()),
        gyro_scale_ppm=tuple((1e6 * found.gyro_scale).tolist()),
        gyro_scale_sigma_ppm=tuple((1e6 * sigma[GYRO_SCALE]).tolist()),
        accelerometer_scale_ppm=tuple((1e6 * found.accelerometer_scale).tolist()),
        accelerometer_scale_sigma_ppm=tuple((1e6 * sigma[ACCELEROMETER_SCALE]).tolist()),
        fix_scale=tuple(found.fix_scale),
    )


def _vertical(recording: Recording) -> str:
    """What steadied the vertical channel, in words."""
    source = recording.belief.height.source
    if source == "baro" and recording.imu.height_baro_m is not None:
        return "damped by baro height"
    if height_aid(recording) is not None:
        return "damped by GPS height"
    return "damped by the known height" if recording.kind in PARKED else "free: no height was recorded to steady it"


def _floor(recording: Recording, duration_s: float, rate_hz: float) -> NumericFloor:
    """The same navigation of an IMU without errors for as long: at the same place, or on the shipped flight."""
    if recording.kind not in PARKED:
        return _floor_of_flight(float(np.clip(round(rate_hz), MIN_RATE_HZ, MAX_RATE_HZ)), ceil(duration_s))
    _, horizontal_m, velocity_mps = numeric_floor(_at_rest(recording, duration_s, rate_hz))
    return NumericFloor(rate_hz, "standstill", horizontal_m, velocity_mps)


@cache  # of several recordings the rates are few, and a flight of 8400 s takes as long as all else
def _floor_of_flight(rate_hz: float, duration_s: int) -> NumericFloor:
    profile = load("climb-cruise-landing")
    _, horizontal_m, velocity_mps = numeric_floor(Mission(profile, rate_hz).ideal(until_s=duration_s))
    return NumericFloor(rate_hz, profile.name, horizontal_m, velocity_mps)


def _at_rest(recording: Recording, duration_s: float, rate_hz: float) -> Recording:
    """What an IMU without any error feels level, heading north and at rest at the start: w_ie dt and -g dt."""
    place, steps = recording.start, max(SAMPLES_PER_STEP, round(duration_s * rate_hz))
    latitude = place.latitude_rad
    rate = EARTH_RATE * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    force = np.array([0.0, 0.0, -gravity(latitude, place.height_m)])
    start = Start(0.0, latitude, place.longitude_rad, place.height_m, attitude_rad=(0.0, 0.0, 0.0))
    gyro, accelerometer = (np.tile(mean / rate_hz, (steps, 1)) for mean in (rate, force))
    return Recording(
        "standstill", "static", start, Imu(np.arange(1, steps + 1) / rate_hz, gyro, accelerometer, "increment")
    )
