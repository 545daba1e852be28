"""Reader of any MATLAB file, versions 4 to 7.3; a mapping file states what its variables are (`mapped`).

A field of a structure is named ``structure.field``, column k of a matrix ``name[k]``, counted from 1.
"""

from __future__ import annotations

import io
import struct
import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import scipy.io

from ins_eval.boundary import LARGEST_BYTES, content
from ins_eval.errors import DataRefused
from ins_eval.readers import hdf5, mapped
from ins_eval.readers.columns import NamedArrays, of_variables
from ins_eval.readers.matlab5 import HEADER_BYTES, all_variables
from ins_eval.recording import Recording

KEYS = mapped.KEYS
EXPECTED = "a MATLAB file with variables of numbers"
VERSION_7_3 = b"MATLAB 7.3"
HDF5_AT = 512  # bytes before the HDF5 part of a version 7.3 file


def read(path: Path, assumed: Mapping[str, str]) -> Recording:
    """A recording from FILE.mat and its mapping."""
    return mapped.read(path, assumed, opened)


def opened(path: Path, header: bool = True) -> NamedArrays:
    """The variables and fields of a file as columns."""
    raw = content(path, EXPECTED)
    if raw.startswith(VERSION_7_3) or raw.startswith(hdf5.MARK) or raw[HDF5_AT:].startswith(hdf5.MARK):
        version, found = "7.3", hdf5.variables(path, raw, transposed=True)
    elif raw[HEADER_BYTES - 2 : HEADER_BYTES] in (b"IM", b"MI"):
        version, found = "5", all_variables(path, EXPECTED)
    else:
        version, found = "4", _version_4(path, raw)
    columns = of_variables(found)
    if not columns:
        raise DataRefused(f"{path}: holds no variable of several numbers, expected {EXPECTED}; save it again")
    note = f"Found {len(columns)} columns in variables and fields of a MATLAB file of version {version}."
    return NamedArrays(path, columns, (note,))


def _version_4(path: Path, raw: bytes) -> dict[str, np.ndarray]:
    """Version 4 holds matrices only; the sizes are checked before they are believed.

    header of a matrix   type (1000: the other byte order), rows, columns, imaginary, length of the name; 4 bytes each
    """
    at, count = 0, 0
    try:
        order = "<" if 0 <= struct.unpack_from("<i", raw)[0] < 100 else ">"
        while at < len(raw):
            kind, rows, columns, imaginary, named = struct.unpack_from(f"{order}5i", raw, at)
            size = {0: 8, 1: 4, 2: 4, 3: 2, 4: 2, 5: 1}[kind // 10 % 10]
            if min(rows, columns, named) < 0 or named > 256 or kind // 1000 not in (0, 1) or imaginary not in (0, 1):
                raise ValueError("a header that no matrix has")
            at += 20 + named + rows * columns * size * (1 + imaginary)
            count += 1
        if at != len(raw) or at > LARGEST_BYTES or kind % 10 > 1:
            raise ValueError("data cut short")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = scipy.io.loadmat(io.BytesIO(raw))
    except Exception:  # a damaged file makes the library fail in many ways
        raise DataRefused(
            f"{path}: cannot be read as a MATLAB file, expected {EXPECTED}; copy the file again"
        ) from None
    return {name: value for name, value in found.items() if isinstance(value, np.ndarray)}
