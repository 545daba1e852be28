"""The models of an accelerometer, from its chamber readings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from ins_eval.analysis.calibrate import ChamberCalibration, calibrate_chambers
from ins_eval.compensation.file import write_model
from ins_eval.compensation.registry import FILE
from ins_eval.errors import UsageError
from ins_eval.figures.results.calibration import calibration_figures
from ins_eval.interface.result import PathLike, Result
from ins_eval.recording import ChamberReadings, form
from ins_eval.report.calibration import calibration_content


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
        raise UsageError(f"--write-model {file}: a compensation file ends in {FILE}; name it {file.with_suffix(FILE)}")
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
    return Result(title, found, found.tree, *calibration_content(found.numbers), partial(calibration_figures, found))
