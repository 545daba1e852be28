"""An ensemble of instruments in flight, with each compensation."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from ins_eval import ensemble
from ins_eval.analysis.fly import FlightStudy
from ins_eval.analysis.fly import fly as fly_instruments
from ins_eval.figures.results.flight import study_figures
from ins_eval.interface.result import PathLike, Result
from ins_eval.report.flight import flight_content


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
    return Result(title, found, found.tree, *flight_content(found.tree, found.ageing), partial(study_figures, found))
