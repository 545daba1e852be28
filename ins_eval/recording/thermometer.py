"""Readings of a thermometer that are none: it is cut off for a while, or says what it says when it is switched on.

A housing of grams does not jump. A reading T that differs from the one before by more than `JUMPS` degC begins another
stretch, and the longest is right. On either side of it a stretch is right that begins within as much of where the last
right one ended; what lies between two right ones, or is short at an end, is no temperature, and a straight line stands
in for it. Where both ends are wrong it is not known which stretch is right, and all stay. One or two readings are left
to the check of outliers, which refuses them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ins_eval.recording import Imu
from ins_eval.recording.consistency import WARNING
from ins_eval.recording.consistency.limits import JUMPS

FEWEST = 3  # readings: one or two are refused as outliers, as `limits.check_outliers` was seen to do
SHORT = 0.1  # share of a recording up to which a stretch at an end, which never returns, is none; by reasoning


def without_faults(imu: Imu) -> tuple[Imu, list[str]]:
    """The samples with straight lines in place of readings that are no temperature, and a warning for each column."""
    if imu.temperature_c is None:
        return imu, []
    columns = imu.temperature_c.reshape(len(imu.time_s), -1).T.copy()
    names = ["temperature_c"] if len(columns) == 1 else [f"temperature_{axis}_c" for axis in "xyz"]
    said = []
    for name, values in zip(names, columns, strict=True):
        wrong = _wrong(values)
        if not wrong.any():
            continue
        rows = np.flatnonzero(wrong)
        said.append(
            f"{WARNING}{rows.size} readings of {name} jump away by more than {JUMPS['temperature']:g} degC from one "
            f"sample to the next, the first of {values[rows[0]]:.4g} degC at {imu.time_s[rows[0]]:.6g} s and the last "
            f"at {imu.time_s[rows[-1]]:.6g} s, as where a thermometer is cut off; they are left out, and a straight "
            "line stands in for them."
        )
        values[wrong] = np.interp(imu.time_s[wrong], imu.time_s[~wrong], values[~wrong])
    return (replace(imu, temperature_c=columns.T.reshape(imu.temperature_c.shape)), said) if said else (imu, [])


def _wrong(values: np.ndarray) -> np.ndarray:
    """Which readings (n,) are no temperature, (n,) bool."""
    jumps = np.abs(np.diff(values)) > JUMPS["temperature"]  # of NaN none
    out = np.zeros(values.size, dtype=bool)
    if not jumps.any():
        return out
    edges = np.concatenate([[0], np.flatnonzero(jumps) + 1, [values.size]])
    count = np.diff(edges)
    middle = int(np.argmax(count))
    right = {middle}
    for way in (1, -1):
        last = values[edges[middle + 1] - 1] if way > 0 else values[edges[middle]]
        for k in range(middle + way, count.size if way > 0 else -1, way):
            near, far = (edges[k], edges[k + 1] - 1)[::way]
            if abs(values[near] - last) <= JUMPS["temperature"]:
                right.add(k)
                last = values[far]
    low, high = min(right), max(right)
    if low > 0 and high < count.size - 1:
        return out
    for k in set(np.flatnonzero(count >= FEWEST).tolist()) - right:
        if low < k < high or count[k] <= SHORT * values.size:
            out[edges[k] : edges[k + 1]] = True
    return out
