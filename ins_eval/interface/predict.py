"""What a model is expected to gain on a flight."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from ins_eval.analysis.diagnose import belief_of
from ins_eval.analysis.predict import Prediction, planned, predict_flight
from ins_eval.figures.results.summary import prediction_figures
from ins_eval.interface.result import PathLike, Result
from ins_eval.recording import form
from ins_eval.report.prediction import prediction_content


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
    words = prediction_content(found.tree, str(model))
    return Result(f"Prediction: {found.flight}", found, found.tree, *words, partial(prediction_figures, found))
