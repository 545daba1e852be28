"""MATLAB files against scipy, which writes them; damaged ones are refused."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.io

from ins_eval.errors import DataRefused, UsageError
from ins_eval.readers.matlab5 import variables

HEADER_BYTES = 128


def written(folder, compressed: bool = False, **values):
    path = folder / "file.mat"
    scipy.io.savemat(path, values, do_compression=compressed)
    return path


ARRAYS = {
    "doubles": np.arange(12.0).reshape(4, 3) / 7.0,
    "one": np.array([[3.5]]),
    "singles": np.arange(6, dtype=np.float32).reshape(2, 3) / 3,
    "small": np.array([[-1, 2, 3]], dtype=np.int8),
    "wide": np.array([[1], [-(2**31)]], dtype=np.int32),
    "unsigned": np.array([[65535, 1]], dtype=np.uint16),
    "long": np.array([[2**60, -1]], dtype=np.int64),
    "cube": np.arange(24.0).reshape(2, 3, 4),
    "empty": np.zeros((0, 7)),
    "not_finite": np.array([[np.nan, np.inf]]),
}


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("name", ARRAYS)
def test_numbers(tmp_path, name, compressed):
    path = written(tmp_path, compressed, **ARRAYS)
    found = variables(path, [name], "numbers")
    assert list(found) == [name]
    np.testing.assert_array_equal(found[name], scipy.io.loadmat(path)[name])
    assert found[name].shape == ARRAYS[name].shape


@pytest.mark.parametrize("compressed", [False, True])
def test_text_and_cells_of_text(tmp_path, compressed):
    labels = np.array([["LineNo"], ["GyrX"], ["Grad \u00b0"]], dtype=object)
    found = variables(written(tmp_path, compressed, labels=labels, word="drive"), ["labels", "word"], "text")
    np.testing.assert_array_equal(found["labels"], labels)
    assert found["word"].item() == "drive"


def test_what_is_neither_is_left_out(tmp_path):
    path = written(tmp_path, structure={"a": 1.0}, waves=np.array([[1.0 + 2.0j]]), sound=np.ones((1, 1)))
    assert set(variables(path, ["structure", "waves", "sound", "absent"], "numbers")) == {"sound"}


def test_the_other_byte_order(tmp_path):
    """Written by hand after the format's description: one double, 1.5, named x."""
    header = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x01\x00MI"
    parts = b"\0\0\0\x06\0\0\0\x08\0\0\0\x06\0\0\0\0" + b"\0\0\0\x05\0\0\0\x08\0\0\0\x01\0\0\0\x01"
    parts += b"\0\x01\0\x01x\0\0\0" + b"\0\0\0\x09\0\0\0\x08\x3f\xf8\0\0\0\0\0\0"
    path = tmp_path / "file.mat"
    path.write_bytes(header + b"\0\0\0\x0e" + len(parts).to_bytes(4, "big") + parts)
    assert variables(path, ["x"], "numbers")["x"].item() == 1.5
    assert scipy.io.loadmat(path)["x"].item() == 1.5


def test_a_size_beyond_the_file_is_not_believed(tmp_path):
    path = written(tmp_path, x=np.arange(100.0))
    content = bytearray(path.read_bytes())
    for at in range(HEADER_BYTES, len(content) - 4, 4):
        path.write_bytes(content[:at] + b"\xff\xff\xff\x7f" + content[at + 4 :])
        try:
            found = variables(path, ["x"], "numbers")
        except DataRefused as refused:
            assert "cannot be read as a MATLAB version 5 file, expected numbers; copy the file again" in str(refused)
        else:
            assert found.get("x", np.zeros(100)).size == 100


def test_other_files(tmp_path):
    path = tmp_path / "file.mat"
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(600))
    with pytest.raises(DataRefused, match=r"is a MATLAB 7\.3 file, expected version 5; save it in MATLAB"):
        variables(path, ["x"], "numbers")
    path.write_bytes(written(tmp_path, x=np.ones((50, 50))).read_bytes()[:-900])
    with pytest.raises(DataRefused, match="copy the file again"):
        variables(path, ["x"], "numbers")
    with pytest.raises(UsageError, match="there is no such file, expected numbers"):
        variables(tmp_path / "absent.mat", ["x"], "numbers")
