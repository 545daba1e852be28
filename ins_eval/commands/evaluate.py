"""``ins-eval evaluate``: how good an instrument is, from its own recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ins_eval.commands.flight_figures import path, temperature, traces
from ins_eval.compensation.file import SINGLE, believed_model, read_model
from ins_eval.effects import without_effects
from ins_eval.errors import DataRefused, UsageError, did_you_mean
from ins_eval.evaluate import (
    PARKED,
    Evaluation,
    Restarts,
    compensate,
    evaluate,
    height_aid,
    measures,
    restarts,
    samples,
    since_start,
    standstill_to_align_on,
)
from ins_eval.imu import Mission
from ins_eval.profile import Place, Profile, Thermal, load
from ins_eval.recording import Recording, form
from ins_eval.recording.belief import Belief
from ins_eval.recording.quiet import Stretch
from ins_eval.recording.readers import psins_text
from ins_eval.recording.validation import validate
from ins_eval.report import figures
from ins_eval.report.evaluation import evaluation_content
from ins_eval.report.results import write_results
from ins_eval.tables import parse, read_toml
from ins_eval.trajectory import MAX_RATE_HZ, MIN_RATE_HZ
from ins_eval.units import DEG

AS_RECORDED, BELIEVED = "none", "believed"
SHORTEST_NAVIGATION_S = 10.0
REFERENCE_WORDS = {"gps": "GPS", "ins": "the better INS", "standstill": "the standstill"}


def run(
    inputs: Sequence[Path],
    output: Path | None = None,
    compensation: Sequence[str] = (),
    belief: Path | None = None,
    restart_every_s: float | None = None,
    quiet: bool = False,
) -> int:
    """Evaluate each recording into ``output/NAME`` (by default ``reports/NAME``) and print its text."""
    for source in inputs:
        recording = _read(source)
        if belief is not None:
            recording = replace(recording, belief=parse(Belief, _tables(belief), str(belief)))
        folder = source if source.is_dir() else source.parent
        where = Path("reports") / source.stem if output is None else output
        _report(
            recording, folder, where if len(inputs) == 1 else where / source.stem, compensation, restart_every_s, quiet
        )
    return 0


def _read(source: Path) -> Recording:
    if source.is_dir():
        return form.read(source)
    if source.suffix == ".imu" or not source.exists():
        return validate(psins_text.read(source, {}))
    raise UsageError(
        f"{source}: evaluate takes a folder in the form ins-recording/1 (or a .imu file in PSINS text); bring this "
        "file into the form first: ins-eval import FORMAT FILE -o DIR"
    )


def _tables(belief: Path) -> dict[str, Any]:
    """The belief tables of a file; what says where the recording began stays the recording's own."""
    tables = read_toml(belief)
    return {key: table for key, table in tables.items() if key in Belief.model_fields}


@dataclass(frozen=True)
class _Arm:
    """One compensation of a recording: what is believed with it, and the velocity increments it makes."""

    recording: Recording
    velocity: np.ndarray


def _arms(recording: Recording, folder: Path, wanted: Sequence[str]) -> dict[str, _Arm]:
    found = (
        _of_pulses(recording, folder, wanted)
        if recording.imu.accelerometer_form == "pulse"
        else _of_increments(recording, folder)
    )
    unknown = [name for name in wanted if name not in found]
    if unknown:
        raise UsageError(f"{recording.name}: no compensation '{unknown[0]}' in it{did_you_mean(unknown[0], found)}")
    return {name: arm for name, arm in found.items() if not wanted or name in wanted}


def _of_pulses(recording: Recording, folder: Path, wanted: Sequence[str]) -> dict[str, _Arm]:
    seen, believed = samples(recording), recording.belief.accelerometer
    triads = {}
    if all(getattr(believed, axis) is not None for axis in "xyz"):
        triads[BELIEVED] = [believed_model(recording.belief, axis, folder) for axis in "xyz"]
    for name, file in _model_files(folder, wanted).items():
        triads[name] = [read_model(file, axis) for axis in "xyz"]
    if not triads:
        raise DataRefused(
            f"{recording.name}: the accelerometers deliver pulses, and nothing says what a pulse is worth; expected "
            "[accelerometer.x], .y and .z in recording.toml, or a model with --compensation FILE.toml"
        )
    other = replace(recording, belief=_of_other_accelerometers(recording.belief))
    velocity = {name: compensate(seen, triad, recording.interval_s) for name, triad in triads.items()}
    return {
        name: _Arm(*without_effects(recording if name == BELIEVED else other, of_arm, folder))
        for name, of_arm in velocity.items()
    }


def _of_other_accelerometers(belief: Belief) -> Belief:
    """A belief without the effects that hold for its own compensation of the accelerometers only."""
    own = ("accelerometer.", "temperature.")
    kept = [
        one
        for one in belief.effects
        if not one.name.startswith(own) and not (one.form or "").startswith("accelerometer")
    ]
    return belief.model_copy(update={"effects": tuple(kept)})


def _model_files(folder: Path, wanted: Sequence[str]) -> dict[str, Path]:
    """Compensation files beside the recording, and those that were asked for."""
    files = {file.stem: file for file in sorted((folder / "compensation").glob("*.toml"))}
    return files | {name: Path(name) for name in wanted if name.endswith(".toml")}


def _of_increments(recording: Recording, folder: Path) -> dict[str, _Arm]:
    belief = recording.belief
    bare = belief.model_copy(
        update={"gyro": belief.gyro.model_copy(update={"bias_radps": (0.0, 0.0, 0.0)}), "effects": ()}
    )
    arms = {AS_RECORDED: _Arm(replace(recording, belief=bare), recording.imu.accelerometer)}
    bias = np.asarray(belief.accelerometer.bias_mps2)
    if bias.any() or any(belief.gyro.bias_radps) or belief.effects:
        velocity = recording.imu.accelerometer - bias * recording.interval_s[:, None]
        arms[BELIEVED] = _Arm(*without_effects(recording, velocity, folder))
    return arms


def _report(
    recording: Recording, folder: Path, output: Path, wanted: Sequence[str], restart_every_s: float | None, quiet: bool
) -> None:
    arms = _arms(recording, folder, wanted)
    alike = [name for name, file in _model_files(folder, arms).items() if name in arms and SINGLE in read_toml(file)]
    notes = [f"{name}: the one accelerometer of this file was taken for x, y and z alike." for name in alike]
    recording = replace(recording, notes=(*recording.notes, *notes))
    stand = standstill_to_align_on(recording)
    left_s = recording.imu.time_s[-1] - (recording.start.time_s if stand is None else stand.end_s)
    if left_s < SHORTEST_NAVIGATION_S:
        raise DataRefused(
            f"{recording.name}: the stretch to align on ends {left_s:.0f} s before the recording; expected at least "
            f"{SHORTEST_NAVIGATION_S:.0f} s to navigate after it, record longer"
        )
    evaluations = {name: evaluate(arm.recording, arm.velocity, stand) for name, arm in arms.items()}
    pieces = {}
    if restart_every_s is not None:
        pieces = {name: restarts(arm.recording, arm.velocity, restart_every_s) for name, arm in arms.items()}
    result = _metrics(recording, stand, evaluations, pieces)
    answer, sections = evaluation_content(result)
    drawn = _figures(recording, stand, evaluations, result)
    write_results(output, f"Evaluation: {recording.name}", answer, sections, result, drawn, quiet)


# ------------------------------------------------------------------------------------------------ metrics


def _metrics(
    recording: Recording,
    stand: Stretch | None,
    evaluations: Mapping[str, Evaluation],
    pieces: Mapping[str, Restarts],
) -> dict[str, Any]:
    first = next(iter(evaluations.values()))
    rate_hz = round(1.0 / float(np.median(np.diff(recording.imu.time_s))), 6)
    errors, time_s = since_start(first)
    result: dict[str, Any] = {
        "format": "ins-eval-evaluation/1",
        "recording": {
            "name": recording.name,
            "kind": recording.kind,
            "rate_hz": rate_hz,
            "duration_s": float(recording.imu.time_s[-1] - recording.start.time_s),
            "notes": list(recording.notes),
        },
        "alignment": _alignment(recording, stand, first),
        "navigation": {
            "start_s": float(first.solution.time_s[0]),
            "end_s": float(first.solution.time_s[-1]),
            "vertical": _vertical(recording),
        },
        "compensations": {
            name: {**measures(e), "final_radial_error_m": _final_m(e)} for name, e in evaluations.items()
        },
        "floor": _floor(recording, float(first.solution.time_s[-1] - first.solution.time_s[0]), rate_hz),
        "reference": {
            "kind": _reference_kind(recording),
            "epochs": int(errors.valid.sum()),
            "outages": len(errors.gaps),
            "outage_s": float(sum(gap.duration_s for gap in errors.gaps)),
            "first_s": float(time_s[0]),
            "last_s": float(time_s[-1]),
        },
    }
    if pieces:
        result["restarts"] = {
            name: {
                "count": piece.count,
                "after_s": [float(t) for t in piece.after_s],
                "position_rms_m": [float(p) for p in piece.position_rms_m],
                "velocity_rms_mps": [float(v) for v in piece.velocity_rms_mps],
            }
            for name, piece in pieces.items()
        }
    return result


def _final_m(evaluation: Evaluation) -> float:
    errors = evaluation.errors
    last = np.flatnonzero(errors.valid)[-1]
    return float(np.hypot(errors.north_m[last], errors.east_m[last]))


def _alignment(recording: Recording, stand: Stretch | None, evaluation: Evaluation) -> dict[str, Any]:
    begin = recording.start if evaluation.alignment is None else evaluation.alignment.start
    roll, pitch, heading = (float(a / DEG) for a in begin.attitude_rad)
    found = {"roll_deg": roll, "pitch_deg": pitch, "heading_deg": heading % 360.0}
    if evaluation.alignment is not None:
        found["stretch_s"] = [stand.start_s, stand.end_s]
        found["heading_sigma_deg"] = evaluation.alignment.heading_sigma_rad / DEG
        if recording.start.attitude_rad is not None:
            found["documented_heading_deg"] = float(recording.start.attitude_rad[2] / DEG) % 360.0
    return found


def _vertical(recording: Recording) -> str:
    """What steadied the vertical channel, in words."""
    source = recording.belief.height.source
    if source == "baro" and recording.imu.height_baro_m is not None:
        return "damped by baro height"
    if height_aid(recording) is not None:
        return "damped by GPS height"
    return "damped by the known height" if recording.kind in PARKED else "free: no height was recorded to steady it"


def _reference_kind(recording: Recording) -> str:
    if recording.reference is not None and np.isfinite(recording.reference.latitude_rad).any():
        return "ins"
    return "gps" if recording.gps is not None else "standstill"


def _floor(recording: Recording, duration_s: float, rate_hz: float) -> dict[str, float]:
    """The same navigation of an IMU without errors: at the same place for as long, or on the shipped flight."""
    if recording.kind in PARKED:
        start = recording.start
        place = Place(
            latitude_deg=start.latitude_rad / DEG,
            longitude_deg=start.longitude_rad / DEG,
            height_m=start.height_m,
            heading_deg=0.0,
            stand_s=0.0,
        )
        still = Thermal(self_heating_c=0.0)
        profile = Profile(name="standstill", kind="static", duration_s=duration_s, start=place, thermal=still)
    else:
        profile = load("climb-cruise-landing")
    rate_hz = float(np.clip(round(rate_hz), MIN_RATE_HZ, MAX_RATE_HZ))
    ideal = Mission(profile, rate_hz).ideal()
    errors = evaluate(ideal, ideal.imu.accelerometer).errors
    return {
        "rate_hz": rate_hz,
        "profile": profile.name,
        "horizontal_m": float(np.hypot(errors.north_m, errors.east_m).max()),
        "velocity_mps": float(np.abs(errors.velocity_n[:, :2]).max()),
    }


# ------------------------------------------------------------------------------------------------ figures


def _figures(
    recording: Recording, stand: Stretch | None, evaluations: Mapping[str, Evaluation], result: Mapping[str, Any]
) -> dict[str, Figure]:
    first = next(iter(evaluations.values()))
    solution = first.solution
    start_s = float(solution.time_s[0])
    kind = result["reference"]["kind"]
    drawn = traces(
        recording,
        evaluations,
        reference=REFERENCE_WORDS[kind],
        floor_m=result["floor"]["horizontal_m"],
        rms_mps={name: arm["velocity_rms_mps"] for name, arm in result["compensations"].items()},
    )
    fixes = recording.reference if kind == "ins" else recording.gps
    if fixes is not None:
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
    if stand is not None:
        drawn["activity"] = _activity(recording, stand, (start_s, float(solution.time_s[-1])))
    return drawn


def _activity(recording: Recording, stand: Stretch, navigated_s: tuple[float, float]) -> Figure:
    """Deviation of specific force and rate in windows of a second; pulses are shown as they are, scaled by one g."""
    imu = recording.imu
    step_s = float(np.median(np.diff(imu.time_s)))
    window = max(10, round(1.0 / step_s))
    whole = imu.time_s.size // window * window
    scale = 1.0
    if imu.accelerometer_form == "pulse":
        rows = imu.time_s <= stand.end_s
        scale = 9.80665 * step_s / np.linalg.norm(imu.accelerometer[rows].mean(axis=0))
    restless = {
        name: np.sqrt(increments[:whole].reshape(-1, window, 3).var(axis=1).sum(axis=1)) / step_s
        for name, increments in (("force", scale * imu.accelerometer), ("rate", imu.gyro))
    }
    return figures.activity(
        time_s=imu.time_s[window - 1 : whole : window],
        force_mps2=restless["force"],
        rate_deg_per_s=restless["rate"] / DEG,
        stretch_s=(stand.start_s, stand.end_s),
        navigation_s=navigated_s,
    )
