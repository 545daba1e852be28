"""What an analysis found, as text, page, table, figures and files."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from ins_eval.errors import UsageError, did_you_mean
from ins_eval.report import text
from ins_eval.report.content import Section

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

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

    `found` is what was found, in the type of the analysis: `Result[RecordingComparison]`; `metrics` is the same as the
    tree that ``metrics.json`` holds.
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
        from ins_eval.report.results import write_results  # here, as below: to draw takes long to import

        write_results(Path(folder), self.title, self.answer, self.sections, self.metrics, self.figures, quiet)

    @property
    def frames(self) -> Mapping[str, pd.DataFrame]:
        """Every table by its name, of the main figures, solutions, errors and residuals; see `exports.frames`."""
        from ins_eval import exports  # here, as below: it imports every analysis

        return exports.frames(self.found)

    def export(self, folder: PathLike, *formats: str) -> list[Path]:
        """Write the tables into a folder, each of `formats` a key of `exports.FORMATS`, and return the files."""
        from ins_eval import exports

        return exports.export(self.found, Path(folder), formats)

    def __str__(self) -> str:
        return text.render(self.title, self.answer, self.sections)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        from ins_eval.report import page

        return page.embedded(
            title=self.title, answer=self.answer, sections=self.sections, figures=self.figures, metrics=self.metrics
        )
