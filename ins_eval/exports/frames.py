"""The tables of a result: main figures, solutions, errors, residuals. Units are in the names of the columns.

`time_s` of every table is on the clock of the recording, so that tables can be laid beside the recording's own.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import singledispatch
from typing import Any

import numpy as np
import pandas as pd

from ins_eval.analysis.calibrate import ChamberCalibration
from ins_eval.analysis.compare import RecordingComparison
from ins_eval.analysis.diagnose import RecordingsDiagnosis
from ins_eval.analysis.evaluate import RecordingEvaluation
from ins_eval.analysis.fly import FlightStudy
from ins_eval.analysis.solution import SolutionEvaluation
from ins_eval.channels import CHANNELS
from ins_eval.estimation.case import Case
from ins_eval.recording import Fixes
from ins_eval.reference import AttitudeErrors, Errors
from ins_eval.restarts import Restarts
from ins_eval.strapdown import Solution
from ins_eval.units import DEG

FIGURES = "figures"  # the main figures, of every result
NED = ("north", "east", "down")
POINTS = ("elapsed_s", "temperature_c", "rate_c_per_min", "scale", "bias_ug")  # of a chamber
ANGLES = ("roll", "pitch", "heading")
Frames = dict[str, pd.DataFrame]


@singledispatch
def frames(found: Any) -> Frames:
    """Every table of what an analysis found, by its name."""
    return {FIGURES: plain(found.to_frame())}


@frames.register
def _(found: RecordingEvaluation) -> Frames:
    recording = found.recording
    made = {FIGURES: plain(found.to_frame())}
    for name, navigated in found.navigated.items():
        made[f"solution_{name}"] = _solution(navigated.solution)
        made[f"errors_{name}"] = _errors(navigated.errors)
        if navigated.attitude is not None:
            made[f"attitude_errors_{name}"] = _attitude_errors(navigated.attitude)
    for name, piece in found.restarts.items():
        made[f"restarts_{name}"] = _restarts(piece)
    made |= {"gps": _fixes(recording.gps, recording.belief.gps.time_offset_s)}
    made |= {"reference": _fixes(recording.reference, recording.belief.reference.time_offset_s)}
    if found.solution is not None:
        made |= {f"ins_{name}": table for name, table in frames(found.solution).items() if name not in made}
    return _filled(made)


@frames.register
def _(found: SolutionEvaluation) -> Frames:
    recording = found.recording
    return _filled(
        {
            FIGURES: plain(found.to_frame()),
            "solution": _fixes(recording.solution),
            "errors_position": _errors(found.position),
            "errors_velocity": _errors(found.velocity),
            "gps": _fixes(recording.gps, recording.belief.gps.time_offset_s),
            "reference": _fixes(recording.reference, recording.belief.reference.time_offset_s),
        }
    )


@frames.register
def _(found: RecordingComparison) -> Frames:
    windows, columns = found.windows, {}
    for k, (name, channel) in enumerate(zip(CHANNELS, found.fitted, strict=True)):
        unit = "radps" if name.startswith("gyro") else "mps2"
        columns[f"{name}_recorded_{unit}"] = windows.recorded[:, k]
        columns[f"{name}_implied_{unit}"] = windows.implied[:, k]
        columns[f"{name}_after_fit_{unit}"] = channel.remaining
    return {FIGURES: plain(found.to_frame()), "residuals": pd.DataFrame({"time_s": windows.time_s, **columns})}


@frames.register
def _(found: RecordingsDiagnosis) -> Frames:
    made, diagnosis = {FIGURES: plain(found.to_frame())}, found.diagnosis
    for case, innovations in zip(diagnosis.cases, diagnosis.innovations, strict=True):
        made[f"residuals_{case.name}"] = _whitened(case, innovations)
    return made


@frames.register
def _(found: ChamberCalibration) -> Frames:
    made = {FIGURES: plain(found.to_frame())}
    for one in found.accelerometers:
        points = one.calibration.points
        at = points.temperature_c, points.rate_c_per_min
        columns = {name: getattr(points, name) for name in POINTS}
        for name, model in one.calibration.models.items():
            if model.scale is not None and model.bias_ug is not None:
                columns[f"scale_residual_{name}_ppm"] = 1e6 * (points.scale / model.scale.evaluate(*at) - 1.0)
                columns[f"bias_residual_{name}_ug"] = points.bias_ug - model.bias_ug.evaluate(*at)
        made[f"residuals_{one.name}"] = pd.DataFrame(columns)
    return made


@frames.register
def _(found: FlightStudy) -> Frames:
    made = {FIGURES: plain(found.to_frame())}
    for name, navigated in found.shown.navigated.items():
        made[f"solution_{name}"] = _solution(navigated.solution)
        made[f"errors_{name}"] = _errors(navigated.errors)
    return made


def plain(frame: pd.DataFrame) -> pd.DataFrame:
    """A table of numbers, truths and text alone: the index and what is nested as columns, an interval as two."""
    if any(name is not None for name in frame.index.names):
        frame = frame.reset_index()
    rows = [_flat(row) for row in frame.to_dict("records")]
    return pd.DataFrame(rows, columns=None if rows else list(frame.columns))


def _flat(value: Any, name: str = "") -> dict[str, Any]:
    """The numbers and texts in a tree by the names that lead to them; a pair of numbers is an interval."""
    if isinstance(value, Mapping):
        return {key: one for k, v in value.items() for key, one in _flat(v, f"{name}_{k}" if name else str(k)).items()}
    if isinstance(value, (list, tuple)):
        pair = len(value) == 2 and all(isinstance(one, (int, float)) for one in value)
        return {f"{name}_{end}": one for end, one in zip(("low", "high"), value, strict=True)} if pair else {
            name: ", ".join(map(str, value))
        }  # fmt: skip
    return {name: value}


def _filled(made: Mapping[str, pd.DataFrame | None]) -> Frames:
    return {name: table for name, table in made.items() if table is not None}


def _solution(one: Solution) -> pd.DataFrame:
    quaternion = {f"quaternion_{part}": one.quaternion_nb[:, k] for k, part in enumerate("wxyz")}
    return pd.DataFrame(
        {"time_s": one.time_s, **_place(one), **_velocity(one.velocity_n), **_angles(one.attitude_rad), **quaternion}
    )


def _fixes(one: Fixes | None, offset_s: float = 0.0) -> pd.DataFrame | None:
    if one is None:
        return None
    angles = {} if one.attitude_rad is None else _angles(one.attitude_rad)
    known = {"time_s": one.time_s - offset_s, **_place(one), **_velocity(one.velocity_n), **angles}
    return pd.DataFrame({**known, "valid": one.valid})


def _errors(one: Errors | None) -> pd.DataFrame | None:
    if one is None:
        return None
    position = {f"{axis}_m": getattr(one, f"{axis}_m") for axis in NED}
    return pd.DataFrame({"time_s": one.time_s, **position, **_velocity(one.velocity_n), "valid": one.valid})


def _attitude_errors(one: AttitudeErrors) -> pd.DataFrame:
    return pd.DataFrame(
        {"time_s": one.time_s, **{f"phi_{axis}_deg": one.phi_n[:, k] / DEG for k, axis in enumerate(NED)}}
    )


def _restarts(one: Restarts) -> pd.DataFrame:
    columns = {"after_s": one.after_s, "position_rms_m": one.position_rms_m, "velocity_rms_mps": one.velocity_rms_mps}
    for quantity, (low, high) in (("position_m", one.position_interval_m), ("velocity_mps", one.velocity_interval_mps)):
        columns |= {f"{quantity}_low": low, f"{quantity}_high": high}
    return pd.DataFrame(columns)


def _whitened(case: Case, innovations: np.ndarray) -> pd.DataFrame:
    """Residuals of a diagnosis, each divided by what is believed of it; NaN where nothing was measured."""
    names = [f"{quantity}_{axis}" for quantity in ("position", "velocity", "attitude") for axis in NED]
    if case.believed is None:  # a chamber, where the one accelerometer is measured
        names = ["accelerometer"]
    columns = dict(zip(names, innovations.T, strict=False))
    return pd.DataFrame({"time_s": case.model.nodes_s, **columns})


def _place(one: Solution | Fixes) -> dict[str, np.ndarray]:
    return {"latitude_deg": one.latitude_rad / DEG, "longitude_deg": one.longitude_rad / DEG, "height_m": one.height_m}


def _velocity(velocity_n: np.ndarray) -> dict[str, np.ndarray]:
    return {f"velocity_{axis}_mps": velocity_n[:, k] for k, axis in enumerate(NED)}


def _angles(attitude_rad: np.ndarray) -> dict[str, np.ndarray]:
    return {f"{name}_deg": attitude_rad[:, k] / DEG for k, name in enumerate(ANGLES)}


def file_name(name: str) -> str:
    """A name without what file systems, MATLAB or netCDF do not take in it."""
    return re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_") or "table"
