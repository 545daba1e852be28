"""All tables in one MAT or netCDF file."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import scipy.io

from ins_eval.exports.frames import file_name
from ins_eval.files import write_whole

NAME = "result"
LARGEST_INT32 = 2**31 - 1


def write_mat(frames: Mapping[str, pd.DataFrame], folder: Path) -> list[Path]:
    """``result.mat``: a struct a table, a column vector a column, text as cells."""
    structs = {
        file_name(name): {file_name(column): _column(frame[column])[:, None] for column in frame}
        for name, frame in frames.items()
    }
    buffer = io.BytesIO()
    scipy.io.savemat(buffer, structs, do_compression=True, long_field_names=True)
    return [write_whole(folder / f"{NAME}.mat", buffer.getvalue())]


def write_netcdf(frames: Mapping[str, pd.DataFrame], folder: Path) -> list[Path]:
    """``result.nc``, classic netCDF: a dimension a table, a variable ``TABLE_COLUMN`` a column, text as characters."""
    buffer = io.BytesIO()
    file = scipy.io.netcdf_file(buffer, "w", version=2)
    for name, frame in frames.items():
        rows = file_name(name)
        file.createDimension(rows, len(frame))
        for column in frame:
            values, of = _classic(_column(frame[column])), f"{rows}_{file_name(column)}"
            dimensions = [rows]
            if values.ndim == 2:
                dimensions.append(f"{of}_length")
                file.createDimension(dimensions[1], values.shape[1])
            variable = file.createVariable(of, values.dtype.newbyteorder(">"), tuple(dimensions))
            variable[:] = values
    file.flush()
    content = buffer.getvalue()
    file.close()
    return [write_whole(folder / f"{NAME}.nc", content)]


def _classic(values: np.ndarray) -> np.ndarray:
    """Values in a type that classic netCDF has: text (n,) becomes characters (n, longest)."""
    if values.dtype == object:
        encoded = np.array([value.encode() for value in values] or [b""], dtype=np.bytes_)
        return encoded.view("S1").reshape(encoded.size, -1)[: values.size]
    if values.dtype.kind in "iub":
        return values.astype(np.int32 if np.abs(values.astype(float)).max(initial=0.0) <= LARGEST_INT32 else float)
    return values


def _column(values: pd.Series) -> np.ndarray:
    """A column as numbers or truths, or else as text."""
    if pd.api.types.is_numeric_dtype(values) or pd.api.types.is_bool_dtype(values):
        return values.to_numpy()
    return values.astype(object).where(values.notna(), "").map(str).to_numpy(dtype=object)
