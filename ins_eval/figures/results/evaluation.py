"""Figures of a recording that was evaluated."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from ins_eval import figures
from ins_eval.analysis.evaluate import RecordingEvaluation
from ins_eval.figures.results.grade import grade_figures
from ins_eval.figures.results.recording import path, temperature, traces
from ins_eval.figures.results.solution import solution_figures
from ins_eval.recording import Recording
from ins_eval.recording.stillness import Stretch
from ins_eval.restarts import Restarts
from ins_eval.units import DEG, STANDARD_GRAVITY

REFERENCE_WORDS = {"gps": "GPS", "ins": "the better INS", "standstill": "the standstill", "attitude": "its attitude"}


def evaluation_figures(evaluation: RecordingEvaluation) -> dict[str, Figure]:
    """Every figure by its name."""
    recording, first, stand = evaluation.recording, evaluation.first, evaluation.standstill
    solution = first.solution
    start_s = float(solution.time_s[0])
    drawn = traces(
        recording,
        evaluation.navigated,
        reference=REFERENCE_WORDS[evaluation.reference],
        floor_m=evaluation.floor.horizontal_m,
        rms_mps={name: one.velocity_rms_mps for name, one in evaluation.measures.items()},
    )
    fixes = recording.reference if evaluation.reference == "ins" else recording.gps
    if fixes is not None and (fixes.valid & np.isfinite(fixes.latitude_rad)).any():
        gaps = [(gap.start_s - start_s, gap.end_s - start_s) for gap in first.errors.gaps]
        drawn |= path(fixes, start_s, gaps)
    drawn |= temperature(recording)
    attitude = solution.attitude_rad / DEG
    drawn["attitude"] = figures.attitude(
        time_s=solution.time_s - start_s,
        roll_deg=attitude[:, 0],
        pitch_deg=attitude[:, 1],
        heading_deg=np.unwrap(attitude[:, 2] % 360.0, period=360.0),
    )
    if first.attitude is not None:
        drawn["attitude_error"] = figures.attitude_error(
            time_s=first.attitude.time_s - start_s,
            errors_deg={name: one.attitude.phi_n / DEG for name, one in evaluation.navigated.items()},
        )
    if evaluation.restarts:
        drawn["error_growth"] = error_growth(evaluation.restarts)
    if evaluation.grade is not None:
        drawn |= grade_figures(evaluation.grade)
    if stand is not None:
        drawn["activity"] = _activity(recording, stand, (start_s, float(solution.time_s[-1])))
    if evaluation.solution is not None:
        drawn |= solution_figures(evaluation.solution)
    return drawn


def error_growth(restarts: Mapping[str, Restarts]) -> Figure:
    """How far each compensation is off after a start afresh from a fix."""
    first = next(iter(restarts.values()))
    return figures.error_growth(
        after_s=first.after_s,
        position_m={name: one.position_rms_m for name, one in restarts.items()},
        band_m={name: one.position_interval_m for name, one in restarts.items()},
        count=first.count,
    )


def _activity(recording: Recording, stand: Stretch, navigated_s: tuple[float, float]) -> Figure:
    """Deviation of specific force and rate in windows of a second; pulses are shown as they are, scaled by one g."""
    imu = recording.imu
    step_s = float(np.median(np.diff(imu.time_s)))
    window = max(10, round(1.0 / step_s))
    whole = imu.time_s.size // window * window
    scale = 1.0
    if imu.accelerometer_form == "pulse":
        rows = imu.time_s <= stand.end_s
        scale = STANDARD_GRAVITY * step_s / np.linalg.norm(imu.accelerometer[rows].mean(axis=0))
    agitation = {
        name: np.sqrt(increments[:whole].reshape(-1, window, 3).var(axis=1).sum(axis=1)) / step_s
        for name, increments in (("force", scale * imu.accelerometer), ("rate", imu.gyro))
    }
    return figures.activity(
        time_s=imu.time_s[window - 1 : whole : window],
        force_mps2=agitation["force"],
        rate_deg_per_s=agitation["rate"] / DEG,
        stretch_s=(stand.start_s, stand.end_s),
        navigation_s=navigated_s,
    )
