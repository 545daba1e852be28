"""Reader of netCDF, classic and netCDF-4; a mapping file states what its variables are (`mapped`).

Classic files are read by `scipy.io.netcdf_file`, netCDF-4 ones, which are HDF5, by h5py.
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import scipy.io

from ins_eval.boundary import content
from ins_eval.errors import DataRefused
from ins_eval.readers import hdf5, mapped
from ins_eval.readers.columns import NamedArrays, of_variables
from ins_eval.recording import Recording

KEYS = mapped.KEYS
EXPECTED = "a netCDF file with variables along time"
CLASSIC = b"CDF"


def read(path: Path, assumed: Mapping[str, str]) -> Recording:
    """A recording from FILE.nc and its mapping."""
    return mapped.read(path, assumed, opened)


def opened(path: Path, header: bool = True) -> NamedArrays:
    """The variables of a file as columns."""
    raw = content(path, EXPECTED)
    if raw.startswith(hdf5.MARK):
        form, found = "netCDF-4", hdf5.variables(path, raw, transposed=False)
    elif raw.startswith(CLASSIC):
        form, found = "classic netCDF", _classic(path, raw)
    else:
        raise DataRefused(f"{path}: is no netCDF file, expected {EXPECTED}; check that this is the format named")
    columns = of_variables(found)
    if not columns:
        raise DataRefused(f"{path}: holds no variable of several numbers, expected {EXPECTED}; copy the file again")
    return NamedArrays(path, columns, (f"Found {len(columns)} columns in variables of a {form} file.",))


def _classic(path: Path, raw: bytes) -> dict[str, np.ndarray]:
    found = {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with scipy.io.netcdf_file(io.BytesIO(raw), "r", mmap=False) as file:
                for name, variable in file.variables.items():
                    values = np.array(variable.data)
                    if values.dtype.kind not in "iuf" or values.ndim not in (1, 2):
                        continue
                    values = values.astype(values.dtype.newbyteorder("="))
                    attributes = {key: getattr(variable, key) for key in hdf5.SCALING if hasattr(variable, key)}
                    found[str(name)] = hdf5.scaled(values, attributes)
    except Exception:  # a damaged file makes the library fail in many ways
        raise DataRefused(f"{path}: cannot be read as netCDF, expected {EXPECTED}; copy the file again") from None
    return found
