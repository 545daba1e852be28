"""Tables on disk, parquet or CSV, as columns of numbers; what is no number is refused with its row."""

from __future__ import annotations

import difflib
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from ins_eval.boundary import check_unpacked, file_bytes
from ins_eval.errors import DataRefused
from ins_eval.limits import OTHER
from ins_eval.printable import printable, shown

PARQUET, CSV = ".parquet", ".csv"
_NEAR = 0.85  # similarity from which an unknown column is taken for a slip of the pen
BYTES_A_VALUE = 8  # of a float
_METADATA_LIMIT = 10_000_000  # bytes, and entries: a damaged length must not ask for all memory
_UNREADABLE = (pa.ArrowException, OSError, ValueError, MemoryError)


@dataclass(frozen=True)
class Columns:
    """One table of a recording. Rows of a CSV count as its lines do, so that the line of names is row 1."""

    path: Path
    data: pa.Table
    notes: tuple[str, ...] = ()
    row_numbers: np.ndarray | None = None  # from 0, where these are some of the rows of the file

    @property
    def rows(self) -> int:
        return self.data.num_rows

    def row(self, index: int) -> int:
        """The number in the file of the row with this index, for a sentence."""
        numbered = index if self.row_numbers is None else self.row_numbers[index]
        return int(numbered) + (2 if self.path.suffix == CSV else 1)

    def only(self, chosen: np.ndarray) -> Columns:
        """The rows where `chosen` (n,) is True; they keep their numbers."""
        return Columns(self.path, self.data.filter(pa.array(chosen)), self.notes, np.flatnonzero(chosen))

    @property
    def names(self) -> list[str]:
        return self.data.column_names

    def require(self, names: Sequence[str]) -> None:
        """Refuse a table that lacks one of `names`."""
        missing = [name for name in names if name not in self.names]
        if not missing:
            return
        more = f" (and {len(missing) - 1} more)" if len(missing) > 1 else ""
        near = difflib.get_close_matches(missing[0], [name for name in self.names if name not in names], n=1)
        if near:
            hint = f"is it {shown(near[0])}? then rename that one"
        elif len(self.names) == 1 and any(mark in self.names[0] for mark in ";\t "):
            hint = "separate the columns by commas"
        else:
            listed = ", ".join(shown(name) for name in self.names[:12])
            hint = f"it has {listed}{', ...' if len(self.names) > 12 else ''}, so add or rename one"
        raise DataRefused(
            f"{self.path}: the column '{missing[0]}'{more} is missing, expected {', '.join(names)}; {hint}"
        )

    def numbers(self, name: str, low: float = OTHER[0], high: float = OTHER[1], gaps: bool = False) -> np.ndarray:
        """A column as floats (n,) within `low` and `high`; where it may have `gaps`, NaN stands for no value.

        Raises DataRefused with the row of the first value that is no number, not finite, or outside.
        """
        if self.names.count(name) > 1:
            raise DataRefused(f"{self.path}: the column '{name}' stands there twice, expected once; rename one of them")
        values = self._floats(name)
        bad = ~((values >= low) & (values <= high))
        bad = (bad | np.isinf(values)) & ~np.isnan(values) if gaps else bad | ~np.isfinite(values)
        if bad.any():
            row = int(np.argmax(bad))
            expected = f"a finite number, {low:g} to {high:g}" if (low, high) == OTHER else f"{low:g} to {high:g}"
            more = f", and {np.count_nonzero(bad) - 1} more" if np.count_nonzero(bad) > 1 else ""
            raise DataRefused(
                f"{self.path}, row {self.row(row)}, column {name}: {values[row]:g}{more}, expected {expected}; correct "
                "or remove what is wrong there, and mind the unit in the column's name"
            )
        return values

    def increasing_time(self) -> np.ndarray:
        """The column ``time_s``, refused where it stands still or goes back."""
        time_s = self.numbers("time_s")
        back = np.flatnonzero(np.diff(time_s) <= 0.0)
        if back.size:
            k = int(back[0])
            before, after = time_s[k : k + 2].tolist()
            goes = f"repeats {after!r} s" if after == before else f"goes back from {before!r} to {after!r} s"
            more = f", and {back.size - 1} times more" if back.size > 1 else ""
            raise DataRefused(
                f"{self.path}, row {self.row(k + 1)}, column time_s: time {goes}{more}, expected strictly increasing "
                "times; sort the rows and drop repeated ones"
            )
        return time_s

    def others(self, known: Sequence[str]) -> dict[str, np.ndarray]:
        """The columns that are not `known`, as they are."""
        return {
            name: _as_it_is(self.data.column(k))
            for k, name in enumerate(self.names)
            if name not in known and self.names.index(name) == k
        }

    def slips(self, known: Sequence[str]) -> list[str]:
        """A sentence for each column that is not known but nearly is one that is missing."""
        notes = []
        for name in self.names:
            free = [one for one in known if one not in self.names]
            near = [] if name in known else difflib.get_close_matches(name, free, n=1, cutoff=_NEAR)
            if near:
                notes.append(f"The column {shown(name)} of {self.path.name} was not used; is it {near[0]}?")
        return notes

    def _floats(self, name: str) -> np.ndarray:
        column = self.data.column(name)
        kind = column.type
        if pa.types.is_dictionary(kind):
            column = column.cast(kind.value_type)
            kind = column.type
        if pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind):
            return np.array(_plain(column), dtype=float)
        if pa.types.is_null(kind):
            return np.full(self.rows, np.nan)
        if not (pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_binary(kind)):
            raise DataRefused(
                f"{self.path}, column {name}: holds values of type {kind}, expected numbers; write it as floats"
            )
        texts = column.to_pylist()
        values = [np.nan if text is None else _number(text) for text in texts]
        for row, value in enumerate(values):
            if value is None:
                raise DataRefused(
                    f"{self.path}, row {self.row(row)}, column {name}: {shown(texts[row])}, expected a number; correct "
                    "that row, with a point as decimal sign"
                )
        return np.array(values, dtype=float)


def open_table(folder: Path, name: str) -> Columns | None:
    """The table `name` of a recording, or None; where it is there twice, the parquet file counts."""
    parquet, csv = folder / f"{name}{PARQUET}", folder / f"{name}{CSV}"
    if parquet.exists():
        both = (f"Both {parquet.name} and {csv.name} are there; {csv.name} was not read.",) if csv.exists() else ()
        return _opened(parquet, _parquet(parquet), both)
    if not csv.exists():
        return None
    content = file_bytes(csv, "a table in CSV")
    whole = content.endswith((b"\n", b"\r"))
    cut = () if whole else (f"{csv.name} does not end with a line break, so its last row may be cut.",)
    return _opened(csv, _csv(csv, content), cut)


def parquet_bytes(columns: Mapping[str, np.ndarray]) -> bytes:
    """Columns as the bytes of a parquet file, the same for the same columns; its pages carry checksums."""
    arrays = {name: pa.array(values, from_pandas=False) for name, values in columns.items()}
    table = pa.table(arrays)
    split = [field.name for field in table.schema if pa.types.is_floating(field.type)]
    sink = io.BytesIO()
    pa.parquet.write_table(
        table,
        sink,
        compression="zstd",
        use_dictionary=False,
        use_byte_stream_split=split,
        write_page_checksum=True,
    )
    return sink.getvalue()


def _opened(path: Path, data: pa.Table, notes: tuple[str, ...]) -> Columns:
    try:
        data = data.rename_columns([name.strip() for name in data.column_names])
    except _UNREADABLE as fault:
        raise _unreadable(path, fault) from None
    if not data.num_rows:
        raise DataRefused(f"{path}: holds no rows, expected at least one; remove the file or copy it again")
    return Columns(path, data, notes)


def _parquet(path: Path) -> pa.Table:
    content = file_bytes(path, "a parquet table")
    try:
        file = pa.parquet.ParquetFile(
            pa.BufferReader(content),
            page_checksum_verification=True,
            thrift_string_size_limit=_METADATA_LIMIT,
            thrift_container_size_limit=_METADATA_LIMIT,
        )
        # a column of one value takes no room, so that the rows are counted, too
        groups = [file.metadata.row_group(k).total_byte_size for k in range(file.metadata.num_row_groups)]
        check_unpacked(path, max(sum(groups), BYTES_A_VALUE * file.metadata.num_rows * file.metadata.num_columns))
        data = file.read(use_threads=False)  # threads that still end when a refusal ends the process abort it
        data.validate(full=True)
    except _UNREADABLE as fault:
        raise _unreadable(path, fault) from None
    return data


def _csv(path: Path, content: bytes) -> pa.Table:
    try:
        # in one thread, so that a fault comes with its row
        return pa.csv.read_csv(io.BytesIO(content), read_options=pa.csv.ReadOptions(use_threads=False))
    except _UNREADABLE as fault:
        raise _unreadable(path, fault) from None


def _unreadable(path: Path, fault: BaseException) -> DataRefused:
    """The reason as the library gives it, on one line; its rows count from 1 with the line of names, as ours do."""
    reason = " ".join(str(fault).split()) or type(fault).__name__
    reason = re.sub(r"CSV parse error: Row #(\d+)", lambda found: f"row {found[1]}", printable(reason))
    reason = reason if len(reason) <= 120 else f"{reason[:117]}..."
    form = "a parquet table" if path.suffix == PARQUET else "a table in CSV, one line of names and then numbers"
    return DataRefused(f"{path}: cannot be read ({reason}), expected {form}; export or copy it again")


def _number(text: str | bytes) -> float | None:
    """The number that a text stands for, or None."""
    try:
        return None if "_" in str(text) else float(text)
    except ValueError:
        return None


def _plain(column: pa.ChunkedArray) -> np.ndarray:
    """The values of a column; without gaps they are taken as they lie, for `to_numpy` imports pandas."""
    if column.null_count or not column.num_chunks:
        return column.to_numpy()
    whole = pa.concat_arrays(column.chunks)
    if pa.types.is_boolean(whole.type):
        bits = np.frombuffer(whole.buffers()[1], dtype=np.uint8)
        return np.unpackbits(bits, bitorder="little")[whole.offset : whole.offset + len(whole)].astype(bool)
    of_numbers = pa.types.is_floating(whole.type) or pa.types.is_integer(whole.type)
    return np.from_dlpack(whole) if of_numbers else column.to_numpy()


def _as_it_is(column: pa.ChunkedArray) -> np.ndarray:
    try:
        return np.array(_plain(column))
    except _UNREADABLE:
        return np.array([str(value) for value in column], dtype=object)
