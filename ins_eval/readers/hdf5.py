"""Numeric variables of an HDF5 file, which MATLAB 7.3 and netCDF-4 files are, by their paths."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ins_eval.boundary import LARGEST_BYTES
from ins_eval.errors import DataRefused
from ins_eval.readers.optional import library

MARK = b"\x89HDF\r\n\x1a\n"
MOST_VARIABLES = 10_000
DEEPEST = 8  # groups within groups


def variables(path: Path, raw: bytes, transposed: bool) -> dict[str, np.ndarray]:
    """Arrays of numbers by name, members of groups as ``group.member``; MATLAB's are `transposed`.

    Raises `DataRefused` for a file that is damaged or unpacks to more than `LARGEST_BYTES`.
    """
    h5py = library("h5py", f"{path}")
    found: dict[str, np.ndarray] = {}
    held = 0
    try:
        with h5py.File(io.BytesIO(raw), "r") as file:
            for name, item in _datasets(h5py, file, 0):
                if item.dtype.kind not in "iufb" or item.ndim > 2 or item.shape is None:
                    continue
                held += math.prod(item.shape) * max(item.dtype.itemsize, 8)
                if held > LARGEST_BYTES or len(found) >= MOST_VARIABLES:
                    raise DataRefused(
                        f"{path}: unpacks to more than {LARGEST_BYTES >> 30} GiB or {MOST_VARIABLES} variables; give "
                        "a smaller part"
                    )
                value = _scaled(item)
                found[name] = value.T if transposed else value
    except DataRefused:
        raise
    except Exception:  # a damaged file makes the library fail in many ways
        raise DataRefused(
            f"{path}: cannot be read as HDF5, the form of MATLAB 7.3 and netCDF-4; copy the file again"
        ) from None
    return found


def _datasets(h5py, group, depth: int) -> Iterator[tuple[str, Any]]:
    """Name and data set of each below a group; links are not followed out of the file, nor groups in a circle."""
    if depth == DEEPEST:
        return
    for name in group:
        if name.startswith("#") or not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        item = group[name]
        if isinstance(item, h5py.Dataset):
            yield name, item
        elif isinstance(item, h5py.Group):
            for inner, found in _datasets(h5py, item, depth + 1):
                yield f"{name}.{inner}", found


def _scaled(item) -> np.ndarray:
    """Values with what netCDF says of them: missing ones are NaN, packed ones unpacked."""
    attributes = {key: item.attrs[key] for key in SCALING if key in item.attrs}
    return scaled(item[()], attributes)


SCALING = ("_FillValue", "missing_value", "scale_factor", "add_offset")


def scaled(values: np.ndarray, attributes: dict) -> np.ndarray:
    """``scale_factor value + add_offset``, NaN where a value is `_FillValue` or `missing_value` (CF conventions)."""
    if not attributes or values.dtype.kind not in "iufb":
        return values
    missing = np.zeros(values.shape, dtype=bool)
    for key in SCALING[:2]:
        if key in attributes:
            missing |= np.isin(values, np.ravel(attributes[key]))
    scale = float(np.ravel(attributes.get("scale_factor", 1.0))[0])
    offset = float(np.ravel(attributes.get("add_offset", 0.0))[0])
    return np.where(missing, np.nan, scale * values.astype(float) + offset)
