"""A delimited text file as columns of numbers, with the row of whatever is no number."""

from __future__ import annotations

import io
import re
import warnings
from pathlib import Path

import numpy as np
import pandas as pd

from ins_eval.boundary import content
from ins_eval.errors import DataRefused, UsageError, did_you_mean
from ins_eval.readers.columns import DATE, DAY_FIRST, MONTH_FIRST, Column, is_number
from ins_eval.readers.files import shown
from ins_eval.units import DAY, HOUR, MINUTE

EXPECTED = "a table in CSV with one line of names and one row a sample"
SEPARATORS = (b",", b";", b"\t")
LONGEST_PREAMBLE = 1000  # lines before the table, that are looked through: by reasoning
COMMENTS = (b"#", b"%", b"//")
STAMP = re.compile(rb"\d{1,4}[:/.-]\d{1,2}[:/.-]\d")  # the beginning of a date or a time of day
MISSING = {b"", b"-", b"na", b"n/a", b"nan", b"null", b"none"}
# units as loggers write them, and as a mapping does
SPELLINGS = dict.fromkeys(("dps", "°/s", "degrees/s", "deg/sec"), "deg/s") | dict.fromkeys(
    ("°/h", "dph", "deg/hr"), "deg/h"
)
SPELLINGS |= dict.fromkeys(("m/s2", "m/s²", "m/s/s"), "m/s^2") | {"mg": "milli-g", "radps": "rad/s", "rad/sec": "rad/s"}
UTF_16 = (b"\xff\xfe", b"\xfe\xff")
IN_BRACKETS = re.compile(r"[\[(]\s*([^\[\]()]+?)\s*[\])]\s*$")  # the unit at the end of a name
TIME_OF_DAY = r"^\s*([01]?\d|2[0-3]):([0-5]\d):([0-5]\d|60)([.,]\d+)?\s*$"
DAY_AND_MONTH = r"^\s*(\d{1,2})([./-])(\d{1,2})[./-]\d{2,4}(?!\d)"  # or month and day: the year comes last
MONTHS = 12
CUT_NOTE = "{} does not end with a line break, so its last row may be cut and was left out."


class DelimitedTable:
    """The rows of a CSV file, of which columns are asked for by name."""

    def __init__(self, path: Path, header: bool = True):
        self.path = path
        raw = content(path, EXPECTED).removeprefix(b"\xef\xbb\xbf")
        if raw.startswith(UTF_16):
            raise DataRefused(f"{path}: is text in UTF-16, expected UTF-8; save it in that encoding")
        self.cut = not raw.endswith((b"\n", b"\r"))
        self.notes = (CUT_NOTE.format(path.name),) if self.cut else ()
        before, raw = _without_comments(raw, header)
        preamble, raw = _without_preamble(raw) if header else ([], raw)
        units, raw = _without_units(raw) if header else ([], raw)
        for left_out, what in (
            ([line for line in before if line.strip()], "of comment before the table"),
            ([line for line in preamble if line.strip()], "before the names of the columns"),
            (units, "of units below the names of the columns"),
        ):
            if left_out:
                lines = "was 1 line" if len(left_out) == 1 else f"were {len(left_out)} lines"
                self.notes += (f"Left out {lines} {what} of {path.name}, {shown(left_out[0].strip())}.",)
        self.first_row = len(before) + len(preamble) + len(units) + (2 if header else 1)
        raw = raw.lstrip(b"#%/ ") if header else raw
        separator = _separator(raw.split(b"\n", 1)[0])
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")  # rows longer than the line of names would lose what is beyond
                self.data = pd.read_csv(
                    io.BytesIO(raw),
                    sep=r"\s+" if separator is None else separator.decode(),
                    header=0 if header else None,
                    index_col=False,
                    skipinitialspace=True,
                    encoding="utf-8",
                    encoding_errors="replace",
                    low_memory=False,
                )
        except Exception as fault:  # damaged text makes the parser fail in many ways
            reason = " ".join(str(fault).split())[:120].encode("ascii", "backslashreplace").decode()
            raise DataRefused(f"{path}: cannot be read as a table ({reason}), expected {EXPECTED}") from None
        self.data.columns = [
            str(name).strip().lstrip("#% ") if header else str(k) for k, name in enumerate(self.data.columns, start=1)
        ]
        named = {name: said[1] for name in self.names() if (said := IN_BRACKETS.search(name))}
        texts = [
            field.decode("utf-8", "replace").strip("()[] ") for line in units for field in _fields(line, separator)
        ]
        named |= dict(zip(self.names(), texts, strict=False))
        self.units = {name: SPELLINGS.get(text.lower(), text) for name, text in named.items()}
        if self.cut:
            self.data = self.data.iloc[:-1]
        if self.data.empty:
            raise DataRefused(f"{path}: holds no rows, expected at least three; copy the file again")

    def names(self) -> list[str]:
        return list(self.data.columns)

    def numbers(self, column: Column, where: str) -> np.ndarray:
        """One column as floats; an empty field is NaN."""
        name = str(column)
        if name not in self.names():
            raise UsageError(
                f"{where}: there is no column '{name}' in {self.path.name}{did_you_mean(name, self.names())}"
            )
        if self.names().count(name) > 1:
            raise DataRefused(f"{self.path}: the column '{name}' is there twice, expected once; rename one of them")
        values = self.data[name]
        if values.dtype.kind in "iuf":
            return values.to_numpy(dtype=float)
        # as texts: a whole number of hundreds of digits is a text here, not a number that fits no float
        as_numbers = pd.to_numeric(values.astype(str).where(values.notna()), errors="coerce")
        bad = (as_numbers.isna() & values.notna()).to_numpy()
        if not bad.any() and values.dtype.kind != "b":
            return as_numbers.to_numpy(dtype=float)
        row = int(np.argmax(bad)) if bad.any() else 0
        hint = "with a point as decimal sign" if "," in str(values.iloc[row]) else "or delete that row"
        raise DataRefused(f"{self._place(row, name)}, expected a number; correct it, {hint}")

    def dates_s(self, column: Column, where: str, unit: str = DATE) -> np.ndarray:
        """Dates in text as seconds since 1970, UTC unless they say otherwise; an empty field is NaN.

        Times of day without a date are seconds since the midnight before the first of them. `unit` may state whether
        1/2/2024 is the day or the month first; otherwise the dates themselves say it.
        """
        name = str(column)
        if self.names().count(name) != 1:
            return self.numbers(column, where)  # refuses it with the reason
        values = self.data[name]
        texts = values.astype(str).where(values.notna())
        of_day = texts.str.fullmatch(TIME_OF_DAY, na=False).to_numpy(dtype=bool)
        if of_day.any() and (of_day | texts.isna()).all():
            return self._of_day_s(texts, name)
        day_first = self._day_first(texts, name, where, unit)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a format that is guessed row by row
            try:
                dates = pd.to_datetime(texts, utc=True, errors="coerce", format="mixed", dayfirst=day_first)
            except Exception:  # dates beyond all calendars fail in many ways
                dates = pd.Series(pd.NaT, index=values.index, dtype="datetime64[ns, UTC]")
        bad = (dates.isna() & values.notna()).to_numpy() | of_day  # a time without a date would be of today
        if bad.any() or values.dtype.kind in "iuf":
            raise DataRefused(
                f"{self._place(int(np.argmax(bad)), name)}, expected a date such as 2024-05-01T10:20:30.5; correct it, "
                "or name the unit of the numbers"
            )
        since = (dates - pd.Timestamp(0, tz="UTC")).to_numpy()
        return np.where(dates.isna(), np.nan, since / np.timedelta64(1, "s"))

    def _of_day_s(self, texts: pd.Series, name: str) -> np.ndarray:
        """Times of day, s; after midnight, where they fall by more than half a day, they go on."""
        parts = texts.str.extract(TIME_OF_DAY)
        hours, minutes, seconds = (pd.to_numeric(parts[k]).to_numpy(dtype=float) for k in range(3))
        fraction = pd.to_numeric("0" + parts[3].fillna(".0").str.replace(",", ".")).to_numpy(dtype=float)
        time_s = HOUR * hours + MINUTE * minutes + seconds + fraction
        known = np.isfinite(time_s)
        time_s[known] += DAY * np.cumsum(np.diff(time_s[known], prepend=time_s[known][0]) < -DAY / 2.0)
        note = f"The column '{name}' of {self.path.name} has times of day and no date: seconds since midnight."
        self.notes = tuple(dict.fromkeys((*self.notes, note)))
        return time_s

    def _day_first(self, texts: pd.Series, name: str, where: str, unit: str) -> bool:
        """Whether dates whose year comes last have the day first: as stated, as one beyond 12 shows, or by the dots.

        False for dates that begin with the year. Dates of one day that leave it open are read month first, and the
        notes say so.
        """
        parts = texts.str.extract(DAY_AND_MONTH)
        first, second = (pd.to_numeric(parts[k]).to_numpy(dtype=float) for k in (0, 2))
        written = np.isfinite(first)
        if not written.any():
            return False
        days = parts[written].drop_duplicates()
        if unit != DATE:
            day_first, why = unit == DAY_FIRST, "the unit says so"
        elif (shows := (first > MONTHS) | (second > MONTHS)).any():
            row = int(np.argmax(shows))
            day_first, why = bool(first[row] > MONTHS), f"{shown(texts.iloc[row])} shows it"
        elif (parts[1][written] == ".").all():
            day_first, why = True, "dates with points are"
        elif len(days) == 1:
            day_first, why = False, "nothing shows the order and all are of one day"
        else:
            raise UsageError(
                f"{where}: the dates in column '{name}' of {self.path.name}, first {shown(texts[written].iloc[0])}, "
                f'may have the day or the month first, expected one order; state it with unit = "{DAY_FIRST}" or '
                f'"{MONTH_FIRST}"'
            )
        wrong = (second if day_first else first) > MONTHS
        order = "day first" if day_first else "month first"
        if wrong.any():
            raise DataRefused(
                f"{self._place(int(np.argmax(wrong)), name)}, expected the {order}, because {why}; write all dates in "
                "one order, such as 2024-05-01"
            )
        if not written[texts.notna()].all():
            row = int(np.argmax(texts.notna() & ~written))
            raise DataRefused(
                f"{self._place(row, name)}, expected a date with the {order} as the others; write all in one order, "
                "such as 2024-05-01"
            )
        note = f"The dates of the column '{name}' of {self.path.name} are read {order}, because {why}."
        self.notes = tuple(dict.fromkeys((*self.notes, note)))
        return day_first

    def _place(self, row: int, name: str) -> str:
        """File, row, column and what stands there, for a sentence."""
        return f"{self.path}, row {row + self.first_row}, column {name}: {shown(str(self.data[name].iloc[row]))}"


def _without_comments(raw: bytes, header: bool) -> tuple[list[bytes], bytes]:
    """The lines before the table, which are empty or comments, and the rest; the last comment may be the names."""
    lines = raw.split(b"\n", LONGEST_PREAMBLE)
    count = next((k for k, line in enumerate(lines) if line.strip() and not _comment(line)), 0)
    if header and count and not _names(lines[count]):
        count = max((k for k in range(count) if _comment(lines[k])), default=count)
    return (lines[:count], b"\n".join(lines[count:])) if count else ([], raw)


def _without_preamble(raw: bytes) -> tuple[list[bytes], bytes]:
    """The lines before the names of the columns, and the rest; none where the first has as many fields as most.

    The names are the first line with as many fields as most, if none of them is a number.
    """
    lines = [line.rstrip(b"\r") for line in raw.split(b"\n", LONGEST_PREAMBLE)[:LONGEST_PREAMBLE]]
    for separator in (_separator(lines[0]), *SEPARATORS, None):
        counts = [len(_fields(line, separator)) for line in lines]
        usual = max(counts, key=counts.count)
        first = counts.index(usual)
        if usual > 1 and (first == 0 or _names(lines[first])):
            return lines[:first], raw.split(b"\n", first)[first]
    return [], raw


def _without_units(raw: bytes) -> tuple[list[bytes], bytes]:
    """The line of units below the names of the columns, if there is one before the numbers, and the rest."""
    names, units, rest = (*raw.split(b"\n", 2), b"", b"")[:3]
    separator = _separator(names)
    fields = _fields(units.lower(), separator)
    said = [field for field in fields if field not in MISSING]
    texts = said and _names(units) and not any(STAMP.match(field) for field in said)
    if texts and len(fields) == len(_fields(names, separator)) and not _names(rest.split(b"\n", 1)[0]):
        return [units], names + b"\n" + rest
    return [], raw


def _separator(line: bytes) -> bytes | None:
    """What separates the fields of a line; None is white space."""
    found = max(SEPARATORS, key=line.count)
    return found if found in line else None


def _fields(line: bytes, separator: bytes | None) -> list[bytes]:
    return [field.strip().strip(b'"') for field in line.split(separator)]


def _comment(line: bytes) -> bool:
    return line.lstrip().startswith(COMMENTS)


def _names(line: bytes) -> bool:
    """Whether no field of a line is a number."""
    return not any(is_number(field.strip(b'"')) for field in re.split(rb"[,;\s]+", line))
