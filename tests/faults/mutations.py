"""Files damaged at random: bytes, fields of a text, keys of a TOML file, columns of a parquet table, packed zeros.

`moved` damages nothing: the recording is at another place.
"""

from __future__ import annotations

import copy
import io
import tomllib
from functools import cache
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet

from ins_eval.recording.form.toml import dumps
from tests.faults.parked import gzip_bomb, matlab_bomb

AWKWARD = [
    *(b"nan", b"-inf", b"1e999", b"1e308", b"-1e200", b"1e-320", b"1_0", b"9" * 400, b"0x10", b"1,5", b"--", b""),
    *(b"%", b"#", b"\n", b"\r", b"\0", b"\xff\xfe", b"\t", b",", b";", b'"', b"'", b"\x1b[2J", "\u202e".encode()),
    *(b"a $\\badcmd{ b$", b"x" * 5000, b"[" * 2000, b"../../etc", b"true", b"1979-05-27"),
]
NUMBERS = [0.0, -0.0, -1.0, 1e-320, 1e-9, 1e9, 1e15, -1e15, 1e16, 1e154, 1e308, np.nan, np.inf, -np.inf, 360.0, 1e5]
VALUES: list[Any] = [
    *(0, -1, 5, 2**62, 1e308, -1e308, 1e15, 1e-320, 0.0, float("nan"), float("inf"), True, "", "x", "x" * 5000),
    *(
        "\x1b[31m",
        "\u202ea",
        "a\nb",
        "a $\\badcmd{ b$",
        "/dev/zero",
        "../..",
        "nan",
        [],
        [1],
        [1.0, 2.0, 3.0],
        [1e308] * 3,
    ),
    *(["a", 1], [[1]], {}, {"a": 1}, [{"name": "accelerometer.bias", "axis": "x", "value": 1e308}]),
]
FREE, NAMED = ["name", "notes", "unit_id"], 0.3  # keys that hold any text; share of the TOML files where one is awkward
BOMB_BYTES, BOMBS = 1 << 30, 0.05  # unpacked; share of the packed files that get one
FARTHEST = {"latitude_deg": 50.0, "longitude_deg": 250.0, "height_m": 2000.0}  # from where the recording was made


def mutated(name: str, content: bytes, rng: np.random.Generator) -> bytes:
    """`content` damaged, half of the time by what the file holds and else byte by byte; `name` says what it is."""
    packed = content.startswith((b"\x1f\x8b", b"MATLAB 5"))
    if packed and rng.random() < BOMBS:
        return content + _bomb(content[:1])
    if rng.random() < 0.5:
        try:
            if name.endswith(".toml"):
                return _toml(content, rng)
            if name.endswith(".parquet"):
                return _parquet(content, rng)
        except (ValueError, TypeError, KeyError, AttributeError, OverflowError, pa.ArrowException):
            return _bytes(content, rng)  # what cannot be written cannot be read
        if name.endswith((".csv", ".txt", ".asc", ".imu", ".json")) and b"\0" not in content[:1000]:
            return _fields(content, rng)
    return _bytes(content, rng)


def moved(files: dict[str, bytes], rng: np.random.Generator) -> dict[str, bytes]:
    """The files of a recording in the form, at another latitude, longitude or height from start to end."""
    key = _one(list(FARTHEST), rng)
    by = FARTHEST[key] * rng.uniform(-1.0, 1.0)
    out = dict(files)
    for name, content in files.items():
        if name.endswith("recording.toml"):
            tree = tomllib.loads(content.decode())
            tree["start"][key] += by
            out[name] = dumps(tree).encode()
        elif name.endswith(("gps.parquet", "reference.parquet")):
            table = pa.parquet.read_table(io.BytesIO(content))
            column = table.column_names.index(key)
            out[name] = _written(table.set_column(column, key, pa.array(table.column(key).to_numpy() + by)))
    return out


@cache
def _bomb(first: bytes) -> bytes:
    return gzip_bomb(BOMB_BYTES) if first == b"\x1f" else matlab_bomb(BOMB_BYTES, 1)[128:]


def _bytes(content: bytes, rng: np.random.Generator) -> bytes:
    """Bytes flipped, digits changed, parts cut out, doubled, replaced by awkward text, the end cut off."""
    changed = bytearray(content)
    for _ in range(rng.integers(1, 4)):
        a, b = np.sort(rng.integers(0, len(changed) + 1, 2))
        kind = rng.integers(6)
        if kind == 0:
            changed[a : a + 1] = bytes([rng.integers(256)])
        elif kind == 1:
            changed[a : a + 1] = b"%d" % rng.integers(10)
        elif kind == 2:
            del changed[a : min(b, a + 40)]
        elif kind == 3:
            changed[a:a] = changed[a : min(b, a + 200)]
        elif kind == 4:
            changed[a:a] = _one(AWKWARD, rng)
        elif rng.random() < 0.2:
            del changed[a:]
    return bytes(changed)


def _fields(content: bytes, rng: np.random.Generator) -> bytes:
    """One field, column or line of a text table changed."""
    lines = content.split(b"\n")
    mark = next((one for one in (b",", b";", b"\t", b" ") if one in lines[len(lines) // 2]), b" ")
    row = int(rng.integers(len(lines)))
    fields = lines[row].split(mark)
    column = int(rng.integers(len(fields)))
    kind = rng.integers(6)
    if kind <= 1:
        fields[column] = _one(AWKWARD, rng)
        lines[row] = mark.join(fields)
    elif kind == 2:  # a column of one value
        value = _one(AWKWARD, rng) if rng.random() < 0.5 else repr(float(_one(NUMBERS, rng))).encode()
        for k, line in enumerate(lines[1:], start=1):
            parts = line.split(mark)
            if column < len(parts):
                lines[k] = mark.join([*parts[:column], value, *parts[column + 1 :]])
    elif kind == 3:
        lines = [mark.join([*parts[:column], *parts[column + 1 :]]) for parts in (line.split(mark) for line in lines)]
    elif kind == 4:
        a, b = np.sort(rng.integers(0, len(lines) + 1, 2))
        lines[a:b] = lines[a:b][::-1] if rng.random() < 0.5 else []
    else:
        lines[row:row] = lines[row : row + int(rng.integers(1, 50))]
    return b"\n".join(lines)


def _toml(content: bytes, rng: np.random.Generator) -> bytes:
    """A key of any table with another value, another name, away, or a new one beside it."""
    tree = tomllib.loads(content.decode())
    if rng.random() < NAMED:
        table = tree.get("recording", tree)
        table[_one(FREE, rng)] = "".join(rng.choice([one for one in VALUES if isinstance(one, str)], 3))
        return dumps(tree).encode()
    for _ in range(rng.integers(1, 3)):
        table = _one(_tables(tree), rng)
        keys = list(table)
        key = _one(keys, rng) if keys else "x"
        kind = rng.integers(5)
        if kind <= 1:
            table[key] = copy.deepcopy(_one(VALUES, rng))
        elif kind == 2:
            table[key] = _like(table.get(key), rng)
        elif kind == 3:
            table.pop(key, None)
        else:
            new = _one([f"{key}x", "extends", "compensation", "effects", "a b", "", "\x1b"], rng)
            (tree if new == "extends" else table)[new] = copy.deepcopy(_one(VALUES, rng))
    return dumps(tree).encode()


def _like(value: Any, rng: np.random.Generator) -> Any:
    """An awkward value of the same kind: a number, a list of as many, or a text."""
    if isinstance(value, list):
        return [_like(part, rng) for part in value]
    if isinstance(value, str):
        return _one([one for one in VALUES if isinstance(one, str)], rng)
    return float(_one(NUMBERS, rng))


def _tables(tree: dict[str, Any]) -> list[dict[str, Any]]:
    below = [one for value in tree.values() for one in (value if isinstance(value, list) else [value])]
    return [tree, *(table for one in below if isinstance(one, dict) for table in _tables(one))]


def _parquet(content: bytes, rng: np.random.Generator) -> bytes:
    """A value, a column or rows of the table changed."""
    table = pa.parquet.read_table(io.BytesIO(content))
    column = int(rng.integers(table.num_columns))
    name, values = table.column_names[column], np.array(table.column(column).to_numpy(), dtype=object)
    kind = rng.integers(8)
    if kind <= 2:
        a = int(rng.integers(len(values)))
        values[a : a + int(_one([1, 1, 3, len(values)], rng))] = float(_one(NUMBERS, rng))
        table = table.set_column(column, name, pa.array(values.tolist(), pa.float64()))
    elif kind == 3:
        other = _one([pa.array([str(v) for v in values]), pa.nulls(len(values)), pa.array([[1.0]] * len(values))], rng)
        table = table.set_column(column, name, other)
    elif kind == 4:
        table = table.remove_column(column)
    elif kind == 5:
        table = table.rename_columns([str(_one([n, n, n, "", "time_s", "\x1b"], rng)) for n in table.column_names])
    elif kind == 6:
        table = table.slice(int(rng.integers(table.num_rows)), int(_one([0, 1, 2, 5, 10**6], rng)))
    else:
        table = table.take(rng.integers(0, table.num_rows, table.num_rows))
    return _written(table)


def _written(table: pa.Table) -> bytes:
    sink = io.BytesIO()
    pa.parquet.write_table(table, sink)
    return sink.getvalue()


def _one(choices: list, rng: np.random.Generator) -> Any:
    return choices[int(rng.integers(len(choices)))]
