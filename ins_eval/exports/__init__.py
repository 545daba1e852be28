"""Results as files that other software reads: tables, arrays and tracks.

`frames` gives the tables of a result by name, `export` writes them: one file a table as CSV or Parquet, all of them in
one MAT or netCDF file, positions as KML or GPX, the main figures as LaTeX.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ins_eval.errors import UsageError, did_you_mean
from ins_eval.exports.arrays import write_mat, write_netcdf
from ins_eval.exports.frames import frames
from ins_eval.exports.tables import write_csv, write_latex, write_parquet
from ins_eval.exports.tracks import write_gpx, write_kml

FORMATS = {
    "csv": write_csv,
    "parquet": write_parquet,
    "mat": write_mat,
    "nc": write_netcdf,
    "kml": write_kml,
    "gpx": write_gpx,
    "tex": write_latex,
}

__all__ = ["FORMATS", "export", "frames"]


def export(found: Any, folder: Path, formats: Sequence[str]) -> list[Path]:
    """Write the tables of what an analysis found into a folder and return the files.

    Raises: UsageError for a format that there is not, or a track of what has no positions; StorageError.
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown:
        raise UsageError(f"export: no format '{unknown[0]}'{did_you_mean(unknown[0], FORMATS)}")
    tables = frames(found)
    return [path for name in formats for path in FORMATS[name](tables, folder)]
