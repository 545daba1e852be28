"""What is asked for in a notebook or on the command line: each function gives a `Result`.

import ins_eval as ie
recording = ie.read("my_recording")
result = ie.evaluate(recording)
result.to_frame()
result.plot("position_error")
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Generic, Literal, Protocol, TypeVar

import pandas as pd
from matplotlib.figure import Figure

from ins_eval import ensemble
from ins_eval.analysis.calibrate import ChamberCalibration, calibrate_chambers
from ins_eval.analysis.compare import RecordingComparison, compare_recording
from ins_eval.analysis.diagnose import RecordingsDiagnosis, belief_of, diagnose_folders
from ins_eval.analysis.evaluate import RecordingEvaluation, evaluate_recording
from ins_eval.analysis.fly import FlightStudy
from ins_eval.analysis.fly import fly as fly_instruments
from ins_eval.analysis.predict import Prediction, planned, predict_flight
from ins_eval.analysis.results import RunComparison, compare_results
from ins_eval.analysis.several import SeveralEvaluations, Summary
from ins_eval.analysis.simulate import Simulated, simulate_recording
from ins_eval.analysis.solution import SolutionEvaluation, evaluate_solution
from ins_eval.compensation import CompensationModel
from ins_eval.compensation.file import write_model
from ins_eval.compensation.registry import FILE
from ins_eval.diagnosis.estimate.case import with_effects, without_roots
from ins_eval.errors import DataRefused, UsageError, did_you_mean
from ins_eval.initialization.magnetic import with_magnetic_heading
from ins_eval.readers import psins_text
from ins_eval.recording import ChamberReadings, Recording, form
from ins_eval.recording.belief import Belief
from ins_eval.recording.form.description import CHAMBER, open_folder
from ins_eval.recording.validation import validate
from ins_eval.report import page, text
from ins_eval.report.calibration import calibration_content
from ins_eval.report.calibration_figures import calibration_figures
from ins_eval.report.comparison import comparison_content
from ins_eval.report.comparison_figures import comparison_figures
from ins_eval.report.content import Section
from ins_eval.report.diagnosis import TITLE, diagnosis_content
from ins_eval.report.diagnosis_page import page as page_of_diagnosis
from ins_eval.report.evaluation import evaluation_content
from ins_eval.report.evaluation_figures import evaluation_figures
from ins_eval.report.flight import flight_content
from ins_eval.report.flight_figures import study_figures
from ins_eval.report.prediction import prediction_content
from ins_eval.report.results import write_results
from ins_eval.report.runs import runs_content
from ins_eval.report.several import several_content
from ins_eval.report.solution_figures import solution_figures
from ins_eval.tables import parse, read_toml
from ins_eval.units import DEG

PathLike = str | os.PathLike[str]


class Findings(Protocol):
    """What an analysis found, frozen: see the module of `ins_eval.analysis` that made it."""

    def to_frame(self) -> pd.DataFrame:
        """The main figures."""
        ...


Found = TypeVar("Found", bound=Findings)


@dataclass(frozen=True, eq=False, repr=False)
class Result(Generic[Found]):
    """What an analysis found. It prints as text and shows as a page in a notebook.

    found      what was found, in the type of the analysis: `Result[RecordingComparison]`
    metrics    the same as the tree that ``metrics.json`` holds
    """

    title: str
    found: Found
    metrics: Mapping[str, Any]
    answer: str
    sections: Sequence[Section] = field(repr=False)
    draw: Callable[[], Mapping[str, Figure]]

    def to_frame(self) -> pd.DataFrame:
        """The main figures as a table; its rows and units are those of `found`."""
        return self.found.to_frame()

    @property
    def figures(self) -> Mapping[str, Figure]:
        """Every figure by its name, drawn at the first time."""
        if "_figures" not in self.__dict__:
            object.__setattr__(self, "_figures", dict(self.draw()))
        return self.__dict__["_figures"]

    def plot(self, name: str) -> Figure:
        """One of the `figures`. Raises: UsageError where there is none of that name."""
        if name not in self.figures:
            raise UsageError(f"{self.title}: no figure '{name}'{did_you_mean(name, self.figures)}")
        return self.figures[name]

    def write(self, folder: PathLike, quiet: bool = True) -> None:
        """Write ``metrics.json``, the page with its figures and the text into a folder."""
        write_results(Path(folder), self.title, self.answer, self.sections, self.metrics, self.figures, quiet)

    def __str__(self) -> str:
        return text.render(self.title, self.answer, self.sections)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return page.embedded(
            title=self.title, answer=self.answer, sections=self.sections, figures=self.figures, metrics=self.metrics
        )


def read(
    source: PathLike,
    belief: PathLike | None = None,
    unit: str | None = None,
    magnetometer: Sequence[str] = (),
    declination_deg: float = 0.0,
) -> Recording:
    """Read a recording.

    Parameters
    ----------
    source : folder in the form ins-recording/1, or a ``.imu`` file in PSINS text
    belief : file with the belief tables to take in place of those of the recording
    unit : the inertial unit by the name of its data sheet, which fills what nobody stated
    magnetometer : three columns of `imu`, body axes, from which the heading of a start that states none is taken
    declination_deg : of the magnetic field, east positive

    Raises: UsageError, DataRefused.
    """
    source = Path(source)
    stated = None
    if belief is not None:
        tables = {key: table for key, table in read_toml(Path(belief)).items() if key in Belief.model_fields}
        stated = parse(Belief, tables, str(belief))
    if source.is_dir():
        if open_folder(source).description.kind == CHAMBER:
            raise UsageError(f"{source}: it is a chamber recording; calibrate or diagnose it")
        recording = form.read(source, solution_alone=True, belief=stated)
    elif source.suffix == ".imu" or not source.exists():
        recording = replace(validate(psins_text.read(source, {})), folder=source.parent)
    else:
        raise UsageError(
            f"{source}: evaluate takes a folder in the form ins-recording/1 (or a .imu file in PSINS text); bring this "
            "file into the form first: ins-eval import FORMAT FILE -o DIR"
        )
    if unit is not None:
        recording = replace(recording, unit=unit)
    if magnetometer:
        recording = with_magnetic_heading(recording, magnetometer, declination_deg * DEG)
    return recording if stated is None else replace(recording, belief=stated)


def simulate(
    profile: str = "climb-cruise-landing",
    kind: Literal["flight", "oven"] = "flight",
    population: str = "jb-kt8",
    seed: int = 1,
    instrument: int = 0,
    rate_hz: float | None = None,
) -> Simulated:
    """Simulate one recording of one instrument: see `analysis.simulate.simulate_recording`."""
    return simulate_recording(profile, kind, population, seed, instrument, rate_hz)


def evaluate(
    recording: Recording,
    compensations: Sequence[str] = (),
    restart_every_s: float | None = None,
    models: Mapping[str, Sequence[CompensationModel]] | None = None,
) -> Result[RecordingEvaluation | SolutionEvaluation]:
    """How good an instrument is, from its own recording: see `analysis.evaluate.evaluate_recording`.

    Where only the solution of an INS was recorded: see `analysis.solution.evaluate_solution`.
    """
    title = f"Evaluation: {recording.name}"
    if recording.imu is None:
        if compensations or restart_every_s is not None or models:
            raise UsageError(
                f"{recording.name}: holds no imu, only the solution that an INS put out, so there is nothing to "
                "compensate or to start afresh; leave --compensation and --restart-every out"
            )
        own = evaluate_solution(recording)
        return Result(title, own, own.tree, *evaluation_content(own.tree), partial(solution_figures, own))
    found = evaluate_recording(recording, compensations, restart_every_s, models)
    words = evaluation_content(found.tree)
    return Result(title, found, found.tree, *words, partial(evaluation_figures, found))


def evaluate_several(recordings: Sequence[Summary]) -> Result[SeveralEvaluations]:
    """Recordings that were evaluated, or refused, on one page with their CEP: see `analysis.several`.

    Each is a `summary`, named as the folder below this page in which its own is written.
    """
    found = SeveralEvaluations(recordings)
    return Result(f"Evaluation of {len(recordings)} recordings", found, found.tree, *several_content(found.tree), dict)


def results(folders: Sequence[PathLike]) -> Result[RunComparison]:
    """Results of runs side by side, each held against the first: see `analysis.results.compare_results`."""
    if len(folders) < 2:
        raise UsageError("results: one folder, expected two or more to hold against each other; name another")
    found = compare_results([Path(folder) for folder in folders])
    return Result(
        f"Results: {' beside '.join(run.name for run in found.runs)}",
        found,
        found.tree,
        *runs_content(found.tree),
        dict,
    )


def compare(recording: Recording, use_found_offset: bool = False) -> Result[RecordingComparison]:
    """The recorded IMU against what its reference implies: see `analysis.compare.compare_recording`."""
    if recording.imu is None:
        raise DataRefused(f"{recording.name}: holds no imu, only the solution that an INS put out; evaluate it")
    found = compare_recording(recording, use_found_offset)
    draw = partial(comparison_figures, found)
    return Result(f"Comparison: {recording.name}", found, found.tree, *comparison_content(found), draw)


def calibrate(
    chambers: Sequence[PathLike | ChamberReadings],
    compensation: str | None = None,
    unit: str | None = None,
    model_file: PathLike | None = None,
) -> Result[ChamberCalibration]:
    """Calibrate one accelerometer, or those of x, y and z: see `analysis.calibrate.calibrate_chambers`.

    Parameters
    ----------
    chambers : folders of kind "chamber", or readings
    compensation : model for the file; None: hysteresis or the best that the readings determine
    unit : which accelerometer of a folder with several
    model_file : gets the model of each accelerometer, for `load_model` and ``[accelerometer] compensation``
    """
    file = None if model_file is None else Path(model_file)
    if file is not None and file.suffix != FILE:
        raise UsageError(f"-o {file}: a compensation file ends in {FILE}; name it {file.with_suffix(FILE)}")
    readings = [
        (Path(one.unit_id), one)
        if isinstance(one, ChamberReadings)
        else (Path(one), form.read_chamber(Path(one), unit))
        for one in chambers
    ]
    found = calibrate_chambers(readings, compensation)
    if file is not None:
        write_model(file, found.models(file.stem))
        found = replace(found, file=file)
    title = f"Calibration: {', '.join(one.name for one in found.accelerometers)}"
    return Result(title, found, found.tree, *calibration_content(found.tree), partial(calibration_figures, found))


def diagnose(
    recordings: Sequence[PathLike],
    belief: PathLike | None = None,
    model_file: PathLike | None = None,
    step: Callable[[str], None] = lambda words: None,
    unit: str | None = None,
) -> Result[RecordingsDiagnosis]:
    """Where recordings of one instrument leave what is believed of them: see `analysis.diagnose.diagnose_folders`.

    `belief` replaces that of all recordings; `model_file` gets a belief with the posterior of all effects; `unit` names
    the data sheet that fills what nobody stated.
    ``result.found.answer`` is the answer in the form ins-eval-diagnosis.
    """
    folders, belief_file = [Path(folder) for folder in recordings], None if belief is None else Path(belief)
    found = diagnose_folders(folders, belief_file, step, unit)
    if model_file is not None:
        found = replace(found, written=found.diagnosis.forecast)
        _, where = belief_of(folders[0], belief_file)
        form.write_belief(Path(model_file), with_effects(without_roots(found.belief), found.written), where)
    tree, draw = page_of_diagnosis(found.diagnosis, found.answer, found.written)
    tree["belief"] = found.stated
    return Result(TITLE, found, tree, *diagnosis_content(tree), draw)


def predict(model: PathLike, flight: PathLike) -> Result[Prediction]:
    """What a model expects to gain on a flight: see `analysis.predict.predict_flight`.

    Parameters
    ----------
    model : a belief that `diagnose` wrote
    flight : a profile, shipped or a TOML file, or the folder of a recording with the course and temperatures
    """
    stated, where = belief_of(Path(), Path(model))
    folder = Path(flight)
    if folder.is_dir():
        found = predict_flight(stated, form.read(folder), where)
    else:
        found = predict_flight(stated, planned(str(flight), stated), where)
    return Result(f"Prediction: {found.flight}", found, found.tree, *prediction_content(found.tree), dict)


def fly(
    profile: str = "climb-cruise-landing",
    size: int = 200,
    model: str | None = None,
    missions: int | None = None,
    seed: int = 0,
    members: PathLike | None = None,
    workers: int | None = None,
    quiet: bool = False,
) -> Result[FlightStudy]:
    """Fly an ensemble of instruments with each compensation, fresh and aged by a year: see `analysis.fly.fly`.

    Parameters
    ----------
    profile : shipped, or a TOML file
    size : instruments; more than 200 are flown linearly, some of them in full as well
    model : a further compensation, ``file.py:Class``
    missions : how many instruments fly a mission of their own; None: the usual number, or `size` where that is less
    members : folder where finished instruments are kept and found; None: nowhere
    workers, quiet : see `ensemble.run`
    """
    with TemporaryDirectory() as nowhere:
        run = partial(ensemble.run, folder=Path(members or nowhere), workers=workers, quiet=quiet)
        return of_flights(fly_instruments(ensemble.Plan(profile, seed=seed), size, run, model, missions_flown=missions))


def of_flights(found: FlightStudy) -> Result[FlightStudy]:
    """The result of instruments that were flown."""
    title = f"Flight report: {found.tree['profile']}"
    return Result(title, found, found.tree, *flight_content(found.tree), partial(study_figures, found))
