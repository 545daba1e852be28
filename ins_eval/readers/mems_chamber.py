"""Samples of a MEMS triad in a thermal chamber, without times: read, looked at, and refused with the reason.

    sensor number, x, y, z [milli-g], temperature [degC]      no header, one row a sample

A chamber recording needs the specific force along the input axis in several positions, the commanded ramp and the time
of each reading; these rows have one position and no clock, so that neither scale nor bias nor rate can be told.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NoReturn

import numpy as np

from ins_eval.boundary import content
from ins_eval.errors import DataRefused
from ins_eval.readers.files import text_numbers

KEYS = ()
EXPECTED = "rows of sensor number, x, y, z [milli-g], temperature [degC]"
COLUMNS = 5


def read(path: Path, assumed: Mapping[str, str]) -> NoReturn:
    """Always raises `DataRefused`: for rows that cannot be right, or because they cannot be used."""
    raw = content(path, EXPECTED).replace(b",", b" ")
    table = text_numbers(str(path), raw, COLUMNS, EXPECTED)
    if not len(table) or not np.isfinite(table).all():
        raise DataRefused(f"{path}: holds values that are not finite, expected {EXPECTED}; remove or repair them")
    mean = np.rint((table[:, 1:4] / len(table)).sum(axis=0))  # a sum of values that were damaged may overflow
    force = ", ".join(f"{value:.6g}" for value in mean)
    low, high = table[:, 4].min(), table[:, 4].max()
    raise DataRefused(
        f"{path}: has {len(table)} rows at {low:.1f} to {high:.1f} degC in one position (mean {force} milli-g), "
        "without times and ramps, expected several positions with the time and the commanded ramp of each reading; "
        "scale, bias and their rate dependence cannot be separated from it, so record a four-point test in the form's "
        "table chamber"
    )
