"""What no vehicle and no instrument shows: values beyond limits, and single values far from their neighbours."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ins_eval.earth import radii
from ins_eval.limits import LONGEST_LEVER_ARM_M, limits_of
from ins_eval.recording import Fixes, Recording
from ins_eval.recording.consistency.alternatives import Finding
from ins_eval.units import DEG

# quantity: lowest, highest, unit
LIMITS = {
    "temperature": (*limits_of("temperature_c"), "degC"),
    "baro height": (*limits_of("height_baro_m"), "m"),
    "height": (*limits_of("height_m"), "m"),
    "speed": (0.0, limits_of("speed_mps")[1], "m/s"),
}
# quantity: the smallest distance from the neighbours that nothing but a fault makes in one sample and takes back
JUMPS = {"temperature": 20.0, "baro height": 300.0, "height": 500.0, "velocity": 60.0, "position": 1000.0}
ROUND_OFF = 1e-11  # of the largest value: what the conversion of a held rate to increments leaves
SPREADS = 30.0  # of the column itself, that a fault exceeds besides
DOUBTFUL = 0.1  # of a jump: enough for a warning
MOST_FAULTS = 0.01  # of the rows; more are not single ones
# of the farthest beyond a jump to the farthest within it: the tail of receivers with outliers of their own, Student's t
# of two degrees of freedom, gives more in one of TAIL^2
TAIL = 20.0
WARNED = float(np.log(1e3))  # log odds of a doubtful jump
COLDEST_C, HOTTEST_C = -90.0, 200.0  # in which instruments work: polar air, and tools for oil wells
HIGHEST_M = 1e5  # of fixes: above it rockets alone go, where space begins by convention (FAI)


def changes(increments: np.ndarray, interval_s: np.ndarray) -> np.ndarray:
    """Rows after which a channel (n,) takes another value, as increment and as rate: either may be what was logged."""
    moved = [
        np.abs(np.diff(values)) > ROUND_OFF * np.abs(values).max() for values in (increments, increments / interval_s)
    ]
    return np.flatnonzero(moved[0] & moved[1])


def check_limits(recording: Recording) -> Iterator[Finding]:
    """A finding for each quantity beyond its limits."""
    imu = recording.imu
    if imu.temperature_c is not None:
        warmest = imu.temperature_c.reshape(len(imu.time_s), -1)
        impossible = list(_beyond("temperature", warmest, imu.time_s, "imu", "temperature_c"))
        yield from impossible or _hot(warmest)
    if imu.height_baro_m is not None:
        yield from _beyond("baro height", imu.height_baro_m[:, None], imu.time_s, "imu", "height_baro_m")
    for table in ("gps", "reference"):
        fixes = getattr(recording, table)
        if fixes is None:
            continue
        valid = fixes.valid.astype(bool)
        yield from _beyond("height", fixes.height_m[:, None], fixes.time_s, table, "height_m", valid)
        yield from _high(fixes.height_m[valid], table)
        speed = np.linalg.norm(np.nan_to_num(fixes.velocity_n), axis=1)[:, None]
        yield from _beyond("speed", speed, fixes.time_s, table, "velocity", valid)
        lever_m = float(np.linalg.norm(getattr(recording.belief, table).lever_arm_m))
        if lever_m > LONGEST_LEVER_ARM_M:
            seen = f"[{table}] lever_arm_m is {lever_m:.4g} m long, expected at most {LONGEST_LEVER_ARM_M:g} m"
            yield Finding(f"{table}.lever_arm_m", seen, "give it in metres, in body axes")


def _high(height_m: np.ndarray, table: str) -> Iterator[Finding]:
    """Heights that only a rocket has are doubted, with what they were in a smaller unit."""
    height_m = height_m[np.isfinite(height_m)]
    usual_m = float(np.median(height_m)) if height_m.size else 0.0
    if abs(usual_m) > HIGHEST_M:
        seen = (
            f"{table}, column height_m: half of the heights lie beyond {usual_m:.4g} m, expected below {HIGHEST_M:g} m "
            f"of all but rockets; in mm they were {1e-3 * usual_m:.4g} m, in cm {1e-2 * usual_m:.4g} m"
        )
        yield Finding("height.unit", seen, "give the heights in m, or state their unit", WARNED)


def _hot(temperature_c: np.ndarray) -> Iterator[Finding]:
    """Temperatures in which no instrument works are doubted, with what they were in another unit."""
    known = temperature_c[np.isfinite(temperature_c)]
    usual_c = float(np.median(known)) if known.size else 0.0
    if not COLDEST_C <= usual_c <= HOTTEST_C:
        seen = (
            f"imu, temperature: half of the values lie beyond {usual_c:.4g} degC, expected {COLDEST_C:g} to "
            f"{HOTTEST_C:g} of instruments that work; in kelvin they were {usual_c - 273.15:.4g} degC, in degrees "
            f"Fahrenheit {(usual_c - 32.0) / 1.8:.4g} degC"
        )
        yield Finding("temperature.unit", seen, "give the temperatures in degC", WARNED)


def _beyond(quantity, values, time_s, table: str, column: str, use=None) -> Iterator[Finding]:
    low, high, unit = LIMITS[quantity]
    outside = ((values < low) | (values > high)).any(axis=1)  # NaN compares false
    outside &= True if use is None else use
    if outside.any():
        k = int(np.argmax(outside))
        value = values[k][(values[k] < low) | (values[k] > high)][0]
        more = f" and {outside.sum() - 1} more" if outside.sum() > 1 else ""
        seen = (
            f"{table}, {_place(table, k)} at {time_s[k]:.6g} s, column {column}: {value:.6g} {unit}{more}, expected "
            f"{low:g} to {high:g}"
        )
        yield Finding(f"{table}.outlier", seen, _mend(table))


def _place(table: str, k: int) -> str:
    """Which sample of the IMU or which fix; rows are lines of a file, which a recording has left behind."""
    return f"{'sample' if table == 'imu' else 'fix'} {k + 1}"


def _mend(table: str) -> str:
    return "correct that value, or leave the column out" if table == "imu" else "remove that row, or mark it valid = 0"


def check_outliers(recording: Recording) -> Iterator[Finding]:
    """A finding for each column with single values that its neighbours contradict."""
    imu = recording.imu
    if imu.temperature_c is not None:
        several = imu.temperature_c.reshape(len(imu.time_s), -1)
        names = ["temperature_c"] if several.shape[1] == 1 else [f"temperature_{axis}_c" for axis in "xyz"]
        for name, values in zip(names, several.T, strict=True):
            yield from _single("temperature", values, imu.time_s, ("imu", name, 1.0, "degC"))
    if imu.height_baro_m is not None:
        yield from _single("baro height", imu.height_baro_m, imu.time_s, ("imu", "height_baro_m", 1.0, "m"))
    for table in ("gps", "reference"):
        if (fixes := getattr(recording, table)) is not None:
            yield from _of_fixes(fixes, table)


def without_jumps(recording: Recording) -> tuple[Recording, list[str]]:
    """The recording without single fixes that only a fault makes, and a clause on those of each column."""
    clauses = []
    for table in ("gps", "reference"):
        if (fixes := getattr(recording, table)) is None:
            continue
        found = [one for one in _of_fixes(fixes, table) if one.log_odds > WARNED]
        if found:
            valid = fixes.valid.copy()
            valid[[row for one in found for row in one.rows]] = False
            recording = replace(recording, **{table: replace(fixes, valid=valid)})
            clauses += [f"{one.seen}, and is left out" for one in found]
    return recording, clauses


def _of_fixes(fixes: Fixes, table: str) -> Iterator[Finding]:
    rows = np.flatnonzero(fixes.valid)
    if len(fixes.time_s) < 2:
        return
    known = fixes.latitude_rad[rows]
    middle = float(np.nanmedian(known)) if np.isfinite(known).any() else 0.0
    along = [float(one) for one in radii(middle)]
    columns = [
        ("position", fixes.latitude_rad, "latitude_deg", along[0], 1.0 / DEG, "deg"),
        ("position", fixes.longitude_rad, "longitude_deg", along[1] * max(np.cos(middle), 0.01), 1.0 / DEG, "deg"),
        ("height", fixes.height_m, "height_m", 1.0, 1.0, "m"),
    ]
    columns += [
        ("velocity", v, f"velocity_{axis}_mps", 1.0, 1.0, "m/s")
        for v, axis in zip(fixes.velocity_n.T, "ned", strict=True)
    ]
    speed = np.linalg.norm(np.nan_to_num(fixes.velocity_n[rows]), axis=1)
    usual_mps = float(np.quantile(speed, 0.9)) if len(rows) else 0.0
    for quantity, values, name, metres, shown, unit in columns:
        chosen = rows[np.isfinite(values[rows])]
        if quantity == "position" and name.startswith("longitude"):
            values = np.unwrap(np.where(np.isfinite(values), values, 0.0))
        extra = 5.0 * usual_mps * float(np.median(np.diff(fixes.time_s))) if quantity == "position" else 0.0
        yield from _single(
            quantity, metres * values[chosen], fixes.time_s[chosen], (table, name, shown / metres, unit), extra, chosen
        )


def _single(quantity, values, time_s, named, extra: float = 0.0, rows=None) -> Iterator[Finding]:
    """Values far from the two before and from the two after them; `named`: table, column, scale and unit."""
    n = len(values)
    jump = JUMPS[quantity] + extra
    if n < 6 or 2.0 * np.abs(np.diff(values)).max() < DOUBTFUL * jump:  # no value is that far from its neighbours
        return
    around = np.clip(np.arange(n)[:, None], 2, n - 3) + np.array([-2, -1, 0, 1, 2])
    own = around == np.arange(n)[:, None]
    others = around[~own].reshape(n, 4)
    expected = np.median(values[others], axis=1)
    sides = values[others].reshape(n, 2, 2).mean(axis=2)
    # a ramp is near the median of both sides, or at its ends on the line of the next two; a step near one of the sides
    one, other = np.r_[1, : n - 2, n - 2], np.r_[2, 2:n, n - 3]
    slope = (values[other] - values[one]) / (time_s[other] - time_s[one])
    on_line = np.abs(values - values[one] - slope * (time_s - time_s[one]))
    away = np.min([np.abs(values - expected), np.abs(values[:, None] - sides).min(axis=1), on_line], axis=0)
    whole = time_s[around[:, -1]] - time_s[around[:, 0]] <= 6.0 * float(np.median(np.diff(time_s)))
    spread = 1.4826 * float(np.median(away))
    for share, log_odds in ((1.0, np.inf), (DOUBTFUL, WARNED)):
        found = np.flatnonzero(whole & (away > max(share * jump, SPREADS * spread)))
        if not found.size or found.size > max(3, MOST_FAULTS * n):
            continue
        table, column, scale, unit = named
        k = int(found[np.argmax(away[found])])
        if away[k] < TAIL * np.delete(away, found).max():
            log_odds = WARNED  # what wanders off so often wanders that far, too
        more = f" (and {found.size - 1} more such values)" if found.size > 1 else ""
        at = _place(table, k if rows is None else int(rows[k]))
        seen = (
            f"{table}, {at} at {time_s[k]:.6g} s, column {column}: {values[k] * scale:.6g} {unit}{more}, expected "
            f"about {expected[k] * scale:.6g} {unit} as its neighbours; it looks like a single outlier"
        )
        chosen = found if rows is None else rows[found]
        yield Finding(f"{table}.outlier", seen, _mend(table), log_odds, rows=tuple(chosen.tolist()))
        return
