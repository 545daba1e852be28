"""``ins-eval evaluate``: how good a real, parked instrument is, from its own recording."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ins_eval import metrics
from ins_eval.commands.flight_report import write_results
from ins_eval.errors import DataRefused
from ins_eval.evaluate import Evaluation, evaluate
from ins_eval.imu import Mission
from ins_eval.profile import Place, Profile, Thermal
from ins_eval.recording import Recording
from ins_eval.recording.psins import read_imu_text
from ins_eval.recording.quiet import Stretch, choose_alignment, quiet_stretches
from ins_eval.recording.validation import validate
from ins_eval.report import figures
from ins_eval.report.evaluation import evaluation_content
from ins_eval.units import DEG

AS_RECORDED = "none"  # the only compensation for a recording in increments: what was recorded, as it was recorded
SHORTEST_NAVIGATION_S = 60.0


def run(recording_file: Path, output: Path, quiet: bool) -> int:
    """Read, align on a quiet stretch, navigate what follows, write the report into `output`, print its text."""
    recording = validate(read_imu_text(recording_file))
    stretch = choose_alignment(quiet_stretches(recording.imu))
    left_s = recording.imu.time_s[-1] - stretch.end_s
    if left_s < SHORTEST_NAVIGATION_S:
        raise DataRefused(
            f"{recording_file}: the quiet stretch found for the alignment ends {left_s:.0f} s before the recording; "
            f"expected at least {SHORTEST_NAVIGATION_S:.0f} s to navigate after it, record longer"
        )
    evaluation = evaluate(recording, recording.imu.accelerometer, align_between_s=(stretch.start_s, stretch.end_s))
    result = _metrics(recording, stretch, evaluation)
    answer, sections = evaluation_content(result)
    write_results(
        output,
        f"Evaluation: {recording.name}",
        answer,
        sections,
        result,
        _figures(recording, stretch, evaluation),
        quiet,
    )
    return 0


def _metrics(recording: Recording, stretch: Stretch, evaluation: Evaluation) -> dict[str, Any]:
    alignment, errors, solution = evaluation.alignment, evaluation.errors, evaluation.solution
    since_s = errors.time_s - solution.time_s[0]
    keep = errors.valid & (since_s > 0.0)
    position = np.column_stack([errors.north_m, errors.east_m])[keep]
    rates = metrics.radial_error_rates(position, since_s[keep])
    roll, pitch, heading = (float(a / DEG) for a in alignment.start.attitude_rad)
    step_s = float(np.median(np.diff(recording.imu.time_s)))
    result = {
        "format": "ins-eval-evaluation/1",
        "recording": {
            "name": recording.name,
            "kind": recording.kind,
            "rate_hz": round(1.0 / step_s, 6),
            "duration_s": float(recording.imu.time_s[-1] - recording.start.time_s),
            "notes": list(recording.notes),
        },
        "alignment": {
            "stretch_s": [stretch.start_s, stretch.end_s],
            "roll_deg": roll,
            "pitch_deg": pitch,
            "heading_deg": heading % 360.0,
            "heading_sigma_deg": alignment.heading_sigma_rad / DEG,
        },
        "navigation": {"start_s": float(solution.time_s[0]), "end_s": float(solution.time_s[-1])},
        "compensations": {
            AS_RECORDED: {
                "velocity_rms_mps": {
                    k: float(v) for k, v in metrics.velocity_rms(errors.velocity_n, errors.valid)._asdict().items()
                },
                "radial_error_rate_nmi_per_h": {
                    "final": float(rates.final),
                    "least_squares": float(rates.least_squares),
                    "radial_error_rate_rms": float(rates.rms),
                },
                "final_radial_error_m": float(np.hypot(*position[-1])),
            }
        },
        "floor": _floor(recording, solution.time_s[-1] - solution.time_s[0], 1.0 / step_s),
        "reference": {"kind": "standstill", "epochs": int(errors.valid.sum()), "outages": len(errors.gaps)},
    }
    if recording.start.attitude_rad is not None:
        result["alignment"]["documented_heading_deg"] = float(recording.start.attitude_rad[2] / DEG) % 360.0
    return result


def _floor(recording: Recording, duration_s: float, rate_hz: float) -> dict[str, float]:
    """The same navigation of an IMU without errors that stands at the same place for as long."""
    start = recording.start
    place = Place(
        latitude_deg=start.latitude_rad / DEG,
        longitude_deg=start.longitude_rad / DEG,
        height_m=start.height_m,
        heading_deg=0.0,
        stand_s=0.0,
    )
    still = Profile(
        name="standstill", kind="static", duration_s=duration_s, start=place, thermal=Thermal(self_heating_c=0.0)
    )
    ideal = Mission(still, rate_hz).ideal()
    errors = evaluate(ideal, ideal.imu.accelerometer).errors
    return {
        "rate_hz": rate_hz,
        "horizontal_m": float(np.hypot(errors.north_m, errors.east_m).max()),
        "velocity_mps": float(np.abs(errors.velocity_n[:, :2]).max()),
    }


def _figures(recording: Recording, stretch: Stretch, evaluation: Evaluation) -> dict[str, Any]:
    errors, solution, imu = evaluation.errors, evaluation.solution, recording.imu
    since_s = errors.time_s - solution.time_s[0]
    step_s = float(np.median(np.diff(imu.time_s)))
    window = max(10, round(1.0 / step_s))
    whole = imu.time_s.size // window * window
    restless = {
        name: np.sqrt(increments[:whole].reshape(-1, window, 3).var(axis=1).sum(axis=1)) / step_s
        for name, increments in (("force", imu.accelerometer), ("rate", imu.gyro))
    }
    attitude = solution.attitude_rad / DEG
    drawn = {
        "activity": figures.activity(
            time_s=imu.time_s[window - 1 : whole : window],
            force_mps2=restless["force"],
            rate_deg_per_s=restless["rate"] / DEG,
            stretch_s=(stretch.start_s, stretch.end_s),
            navigation_s=(float(solution.time_s[0]), float(solution.time_s[-1])),
        ),
        "attitude": figures.attitude(
            time_s=solution.time_s - solution.time_s[0],
            roll_deg=attitude[:, 0],
            pitch_deg=attitude[:, 1],
            heading_deg=attitude[:, 2] % 360.0,
        ),
        "position_error": figures.position_error(
            time_s=since_s, errors_m={AS_RECORDED: np.hypot(errors.north_m, errors.east_m)}, reference="the standstill"
        ),
    }
    for axis, component in enumerate(("north", "east")):
        drawn[f"{component}_velocity_error"] = figures.velocity_error(
            time_s=since_s,
            errors_mps={AS_RECORDED: errors.velocity_n[:, axis]},
            component=component,
            reference="the standstill",
        )
    return drawn
