"""Tables as CSV, Parquet and LaTeX."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from ins_eval.exports.frames import FIGURES, file_name
from ins_eval.files import write_whole


def write_csv(frames: Mapping[str, pd.DataFrame], folder: Path) -> list[Path]:
    """One file a table; numbers with every digit."""
    return [
        write_whole(folder / f"{file_name(name)}.csv", frame.to_csv(index=False, lineterminator="\n").encode())
        for name, frame in frames.items()
    ]


def write_parquet(frames: Mapping[str, pd.DataFrame], folder: Path) -> list[Path]:
    """One file a table."""
    return [
        write_whole(folder / f"{file_name(name)}.parquet", frame.to_parquet(index=False))
        for name, frame in frames.items()
    ]


def write_latex(frames: Mapping[str, pd.DataFrame], folder: Path) -> list[Path]:
    """The main figures as a table of the package booktabs."""
    table = frames[FIGURES].style.hide(axis="index").format(precision=4, escape="latex")
    table = table.format_index(escape="latex", axis="columns")
    return [write_whole(folder / f"{FIGURES}.tex", table.to_latex(hrules=True).encode())]
