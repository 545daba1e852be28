"""Recorded tests of a digital loop: CSV files of scans, and of N_out with the reference current on and off.

    state,repetition,n_fpga,n_out        scan: one row a point
    state,repetition,current,n_out       current: "on" or "off", one row a reading or a mean of readings

`state` is "reference" (when the gains were known) or "test"; `repetition` is a whole number, the same in both states
for what was measured as a pair. Lines that begin with # are passed over.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from ins_eval.boundary import content
from ins_eval.errors import UsageError
from ins_eval.printable import listed, printable, shown

STATES = ("reference", "test")
SCAN = ("state", "repetition", "n_fpga", "n_out")
CURRENT = ("state", "repetition", "current", "n_out")
FEWEST_POINTS = 3  # a slope and what scatters around it


@dataclass(frozen=True, eq=False)
class LoopReadings:
    """What was recorded; r repetitions in order of their numbers, p points of the scan.

    n_fpga      (p,), empty where no scan was recorded
    scans       N_out (r, p) by state
    currents    by state, for each repetition N_out with the current on (b,) and off (c,)
    """

    n_fpga: np.ndarray
    scans: Mapping[str, np.ndarray]
    currents: Mapping[str, Sequence[tuple[np.ndarray, np.ndarray]]]


def read(paths: Sequence[Path]) -> LoopReadings:
    """The tests in these files, any number of each kind.

    Raises UsageError: a file that cannot be read, other columns, a value that is no number, a reference that is
    missing, repetitions or points that are not the same in both states.
    """
    tables: dict[tuple[str, ...], list[pd.DataFrame]] = {SCAN: [], CURRENT: []}
    for path in paths:
        columns, table = _table(path)
        tables[columns].append(table)
    scans, currents = (pd.concat(found) if found else None for found in tables.values())
    named = ", ".join(map(str, paths))
    n_fpga, by_state = _scans(scans, named) if scans is not None else (np.empty(0), {})
    return LoopReadings(n_fpga, by_state, _currents(currents, named) if currents is not None else {})


def _table(path: Path) -> tuple[tuple[str, ...], pd.DataFrame]:
    """The columns that say which kind of test a file holds, and its rows."""
    try:
        raw = io.BytesIO(content(path, "a table in CSV"))
        table = pd.read_csv(raw, comment="#", dtype=str, skipinitialspace=True, keep_default_na=False)
    except (ValueError, pd.errors.ParserError) as error:  # not UTF-8, nothing in it, rows of different length
        raise UsageError(f"{path}: not a CSV table ({printable(str(error).strip())}); correct it") from None
    columns = next((kind for kind in (SCAN, CURRENT) if set(kind) == set(table.columns)), None)
    if columns is None:
        raise UsageError(
            f"{path}: has the columns {listed(list(map(str, table.columns)))}; expected "
            f"{', '.join(SCAN)} (a scan) or {', '.join(CURRENT)} (the reference current on and off)"
        )
    if table.empty:
        raise UsageError(f"{path}: has no rows; record the test again")
    _check(table["state"], table["state"].isin(STATES), path, "'reference' or 'test'")
    if columns == CURRENT:
        _check(table["current"], table["current"].isin(("on", "off")), path, "'on' or 'off'")
    for column in set(columns) - {"state", "current"}:
        numbers = pd.to_numeric(table[column], errors="coerce")
        _check(table[column], np.isfinite(numbers), path, "a finite number")
        table[column] = numbers
    _check(table["repetition"], table["repetition"] % 1 == 0, path, "a whole number")
    return columns, table


def _check(column: pd.Series, good: pd.Series, path: Path, expected: str) -> None:
    if not good.all():
        row = int(np.argmin(good.to_numpy()))
        raise UsageError(f"{path}: row {row + 1}, {column.name} is {shown(column.iloc[row])}; expected {expected}")


def _scans(table: pd.DataFrame, named: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    _check_repetitions(table, named, "scan")
    if table.duplicated(["state", "repetition", "n_fpga"]).any():
        row = table[table.duplicated(["state", "repetition", "n_fpga"])].iloc[0]
        raise UsageError(
            f"{named}: the scan of {row.state}, repetition {row.repetition:g}, has N_FPGA = {row.n_fpga:g} twice; "
            "number repeated scans as repetitions"
        )
    wide = table.pivot(index=["state", "repetition"], columns="n_fpga", values="n_out")
    n_fpga = wide.columns.to_numpy(dtype=float)
    if n_fpga.size < FEWEST_POINTS:
        raise UsageError(f"{named}: a scan has {n_fpga.size} values of N_FPGA; expected {FEWEST_POINTS} or more")
    if wide.isna().to_numpy().any():
        state, repetition = wide.index[wide.isna().any(axis=1)][0]
        lacking = n_fpga[wide.loc[(state, repetition)].isna()][0]
        raise UsageError(
            f"{named}: the scan of {state}, repetition {repetition:g}, lacks N_FPGA = {lacking:g}, which another scan "
            "has; expected the same in all"
        )
    return n_fpga, {state: wide.loc[state].to_numpy() for state in STATES if state in wide.index}


def _currents(table: pd.DataFrame, named: str) -> dict[str, list[tuple[np.ndarray, np.ndarray]]]:
    _check_repetitions(table, named, "current test")
    found: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}
    for (state, repetition), rows in table.groupby(["state", "repetition"]):
        halves = [rows.loc[rows["current"] == setting, "n_out"].to_numpy() for setting in ("on", "off")]
        for half, setting in zip(halves, ("on", "off"), strict=True):
            if not half.size:
                raise UsageError(
                    f"{named}: the current test of {state}, repetition {repetition:g}, has no reading with the current "
                    f"{setting}; expected both"
                )
        found.setdefault(state, []).append((halves[0], halves[1]))
    return found


def _check_repetitions(table: pd.DataFrame, named: str, test: str) -> None:
    """There is a reference, and where there is a test it has the same repetitions."""
    numbers = {state: set(rows["repetition"]) for state, rows in table.groupby("state")}
    if "reference" not in numbers:
        raise UsageError(f"{named}: no {test} of state 'reference'; give the one that the test is compared with")
    alone = numbers["reference"] ^ numbers.get("test", numbers["reference"])
    if alone:
        raise UsageError(
            f"{named}: repetition {min(alone):g} of the {test} is there in one state only; expected the same "
            "repetitions in 'reference' and 'test'"
        )
