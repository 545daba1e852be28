"""Positions and heights of another navigator against its velocities, the barometer against its heights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pymap3d import geodetic2ned

from ins_eval.recording import Fixes, Imu
from ins_eval.recording.consistency.alternatives import (
    FEWEST,
    LIKELY,
    MATRICES,
    NU,
    UNIT_PRIOR,
    Finding,
    channel_scores,
    order_scores,
    prior,
    undecided,
    undecided_axes,
)
from ins_eval.units import DEG, SPEED_UNITS

INTERVAL_S = 2.0  # over which positions are differenced and velocities integrated
MOST_ROWS = 2000
POSITION_FLOOR_M = 0.3
SPEEDS = SPEED_UNITS | {f"m/s read as {name}": 1.0 / size for name, size in SPEED_UNITS.items() if name != "m/s"}
WAY = 0.05  # of the way, that scale errors and filters of a receiver may take from the agreement
HEIGHT_UNITS = {"m": 1.0, "feet": 0.3048, "cm": 1e-2, "mm": 1e-3}
HEIGHT_FLOOR_M = 2.0
# over which heights are differenced as well: a height is noisier than a place, a climb slow; by reasoning
CLIMB_INTERVAL_S = 30.0
JUDGED_MPS = 2.0  # slower, the way does not tell the time
SMALLEST_JUMP_S, LONGEST_JUMP_S = 0.05, 60.0
STAMP_S = 1e-6  # to which stamps are read
JUMP_SPREADS = 5.0
MOST_JUMPS = 5
BODY = 0.2  # of the way, by which a velocity along body axes may differ: a crab angle of 11 degrees; by reasoning
STEADY = 0.5  # of the mean velocity of two fixes: what changes by more in between tells no time; by reasoning
EVEN, UNEVEN = 0.02, 0.2  # of a step: stamps that are even, a step that is not
UNEVEN_ODDS = float(np.log(1e3))
LIKELIER_THAN_T = 2.0  # the stamps must step by as much, besides: an odd stamp and an odd way at once
LARGEST_BARO_OFFSET_M = 1500.0  # weather, geoid and a setting on the ground; the form asks for agreement at the start
VELOCITY = ("north", "east", "down")
LARGEST_NARROW_RAD = 2.0 * np.pi * DEG * 1.01  # 360 degrees in radians, read as degrees


def places(fixes: Fixes) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Latitude and longitude in rad under every alternative that is possible on the Earth."""
    latitude, longitude = fixes.latitude_rad, fixes.longitude_rad
    ways = {
        "as read": (latitude, longitude),
        "latitude and longitude exchanged": (longitude, latitude),
        "radians read as degrees": (latitude / DEG, longitude / DEG),
        "degrees read as radians": (latitude * DEG, longitude * DEG),
    }
    possible = {"as read": ways["as read"]}
    for words, (lat, lon) in ways.items():
        at, far = np.nanmax(np.abs(lat)), np.nanmax(np.abs(lon))
        if at <= np.pi / 2 and far <= 2.0 * np.pi:
            possible[words] = (lat, lon)
    return possible


def without_missing_down(fixes: Fixes) -> tuple[Fixes, bool]:
    """The fixes with a vertical velocity of zero where none was ever measured, and whether that is so."""
    level = not np.isfinite(fixes.velocity_n[:, 2]).any()
    if not level:
        return fixes, False
    velocity_n = fixes.velocity_n.copy()
    velocity_n[:, 2] = 0.0
    return replace(fixes, velocity_n=velocity_n), True


def rows_apart(time_s: np.ndarray, interval_s: float, overlap: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Rows (first, last) about `interval_s` apart without a gap between; a pair begins `overlap` times in that time."""
    step_s = float(np.median(np.diff(time_s)))
    ahead = max(1, round(interval_s / step_s))
    first = np.arange(0, len(time_s) - ahead, max(1, ahead // overlap))
    last = first + ahead
    whole = time_s[last] - time_s[first] < 1.5 * ahead * step_s
    return first[whole], last[whole]


def check_track(fixes: Fixes, table: str) -> list[Finding]:
    """The alternative of position, order, sign and unit of velocity, or course, that the way itself prefers."""
    fixes, level = without_missing_down(fixes)
    use = fixes.valid & np.isfinite(fixes.velocity_n).all(axis=1)
    use &= np.isfinite(fixes.latitude_rad) & np.isfinite(fixes.longitude_rad)
    if use.sum() < FEWEST + 1:
        return []
    time_s = fixes.time_s[use]
    pairs = pairs_of(time_s)
    if pairs is None:
        return []
    velocities = _velocities(fixes.velocity_n[use])
    named, went, flown = [], [], []
    for place, (latitude, longitude) in places(fixes).items():
        for turned, velocity_n in velocities.items():
            named.append((place, turned))
            went.append(moved(latitude[use], longitude[use], fixes.height_m[use], pairs))
            flown.append(travelled(time_s, velocity_n, pairs))
    went, flown = np.array(went), np.array(flown)
    if level:
        went[:, :, 2] = np.nan
    way_m = WAY * min(float(np.median(np.hypot(*one[0, :, :2].T))) for one in (went, flown))
    factors = np.array(list(SPEEDS.values()))
    log = order_scores(channel_scores(went, flown, factors, np.hypot(POSITION_FLOOR_M, [way_m, way_m, 0.0])))
    log += prior(factors)
    log += UNIT_PRIOR * np.array([sum(one != "as read" for one in pair) for pair in named])[:, None, None]
    best = np.unravel_index(np.argmax(log), log.shape)
    log_odds = float(log[best] - log[0, 0, 0])
    if named[best[0]][1] == "as read" and _along_body_axes(went[0], flown[0]):
        seen = (
            f"{table}: velocity north is the speed and velocity east next to nothing while the way turns, expected "
            "both to turn with it; it looks as if the velocity is along body axes, forward and to the right"
        )
        mend = "turn it to north, east, down by the attitude, or leave its columns out"
        return [Finding("velocity.axes", seen, mend)]
    if log_odds < LIKELY:
        near = log > log[0, 0, 0] - LIKELY
        parts = [f"the {VELOCITY[i]} velocity" for i in undecided_axes(np.flatnonzero(near[0].any(axis=1)))]
        parts += ["the unit of the velocity"] if near[0, 0, 1:].any() else []
        parts += ["the unit and order of the position"] if near[1:, 0, 0].any() else []
        return undecided(f"{table}: the way", parts)
    way = [np.sqrt(np.mean(one[0, :, : 2 if level else 3] ** 2, axis=0)).tolist() for one in (went, flown)]
    return [_finding(named[best[0]], MATRICES[best[1]], list(SPEEDS)[best[2]], log_odds, table, way)]


def _along_body_axes(went: np.ndarray, flown: np.ndarray) -> bool:
    """Whether the first column is as far as each way (n, 3) north, east, down goes, also where that leads elsewhere."""
    way = np.hypot(went[:, 0], went[:, 1])
    moves = way > max(JUDGED_MPS * INTERVAL_S, 0.5 * float(np.median(way)))
    elsewhere = moves & (went[:, 0] < 0.5 * way)
    if elsewhere.sum() < FEWEST:
        return False
    far, ahead = (np.array([np.median(one[rows]) for rows in (moves, elsewhere)]) for one in (way, flown[:, 0]))
    aside = float(np.median(np.abs(flown[elsewhere, 1])))
    return bool((np.abs(ahead - far) < BODY * far).all() and aside < BODY * far[1])


def _velocities(velocity_n: np.ndarray) -> dict[str, np.ndarray]:
    """As read, and with the course in radians that was read as degrees, where all courses are that near to north."""
    found = {"as read": velocity_n}
    course = np.arctan2(velocity_n[:, 1], velocity_n[:, 0])
    if 0.0 < np.abs(course).max() < LARGEST_NARROW_RAD:
        speed = np.hypot(velocity_n[:, 0], velocity_n[:, 1])
        turned = np.column_stack([speed * np.cos(course / DEG), speed * np.sin(course / DEG), velocity_n[:, 2]])
        found["course"] = turned
    return found


def _finding(pair, matrix, unit: str, log_odds: float, table: str, way: list[list[float]]) -> Finding:
    """The first thing to correct of the alternative that holds; what is left shows when it is read again."""
    place, turned = pair
    directions = ", ".join(VELOCITY[: len(way[0])])
    seen = (
        f"{table}: positions contradict velocities: {directions} move by {_three(way[0])} m in {INTERVAL_S:g} s "
        f"and the velocities make {_three(way[1])} m, root mean square, expected the same"
    )
    if place != "as read":
        return another_place(seen, place, table, log_odds)
    seen += "; it looks as if "
    if turned == "course":
        return Finding("course.unit", f"{seen}the course is in radians and was read as degrees",
                       "convert the course to degrees, or state its unit", log_odds, value="rad")  # fmt: skip
    if unit != "m/s":
        words = f"the velocity is {unit}" if "read" in unit else f"the velocity is in {unit} and was read as m/s"
        factor = SPEEDS[unit]
        mend = f"multiply the velocities by {factor:.5g}, or state their unit"
        return Finding("velocity.unit", seen + words, mend, log_odds, unit if "read" not in unit else "m/s", factor)
    words = f"velocity north, east, down is {_signed(matrix)} of those read"
    mend = "correct order and signs of the velocity columns"
    mend += "" if np.trace(matrix[:2, :2]) == 2.0 else ", or of latitude and longitude"
    return Finding("velocity.axes", f"{seen}{words}", mend, log_odds, matrix=matrix)


def another_place(seen: str, place: str, table: str, log_odds: float) -> Finding:
    """Latitude and longitude exchanged or in another unit, as `places` names it."""
    seen = f"{seen}; it looks as if latitude and longitude are"
    if place == "latitude and longitude exchanged":
        return Finding(f"{table}.position", f"{seen} exchanged", "exchange these two columns", log_odds)
    mend = "give them in degrees, or state their unit"
    return Finding("position.unit", f"{seen} {place}", mend, log_odds, value=place.split()[0][:3])


def _three(values: list[float]) -> str:
    return ", ".join(f"{value:.4g}" for value in values)


def _signed(matrix: np.ndarray) -> str:
    """An order and signs of velocities: ``north, east, -down``."""
    found = [(int(np.argmax(np.abs(row))), row.sum()) for row in matrix]
    return ", ".join(f"{'-' if sign < 0 else ''}{VELOCITY[k]}" for k, sign in found)


def check_height(fixes: Fixes, table: str) -> Finding | None:
    """The unit of the heights that the velocities down, integrated, prefer; their sign is judged with the way."""
    use = fixes.valid & np.isfinite(fixes.height_m) & np.isfinite(fixes.velocity_n[:, 2])
    time_s, height_m, velocity_n = fixes.time_s[use], fixes.height_m[use], fixes.velocity_n[use]
    found = []
    for interval_s in (INTERVAL_S, CLIMB_INTERVAL_S):
        pairs = pairs_of(time_s, interval_s) if use.sum() > FEWEST else None
        if pairs is None:
            continue
        risen = height_m[pairs[1]] - height_m[pairs[0]]
        climbed = -travelled(time_s, velocity_n, pairs)[:, 2]
        log = _height_scores(risen, climbed, 1.0 / np.array(list(HEIGHT_UNITS.values())), POSITION_FLOOR_M)
        best = np.unravel_index(np.argmax(log), log.shape)
        found.append((float(log[best] - log[0, 0]), int(best[1]), interval_s, _size(risen), _size(climbed)))
    log_odds, unit, interval_s, risen_m, climbed_m = max(found, default=(0.0, 0, 0.0, 0.0, 0.0))
    if log_odds < LIKELY or unit == 0:
        return None
    seen = (
        f"{table}: heights contradict velocities: they change by {risen_m:.4g} m in {interval_s:g} s and the "
        f"velocities down make {climbed_m:.4g} m, root mean square, expected the same"
    )
    return another_height(seen, list(HEIGHT_UNITS)[unit], log_odds)


def _size(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def another_height(seen: str, unit: str, log_odds: float) -> Finding:
    """The heights of fixes in a unit other than m."""
    factor = HEIGHT_UNITS[unit]
    seen = f"{seen}; it looks as if the height is in {unit} and was read as m"
    mend = f"multiply the heights by {factor:.5g}, or state their unit"
    return Finding("height.unit", seen, mend, log_odds, unit, factor)


def _height_scores(wanted: np.ndarray, shown: np.ndarray, factors: np.ndarray, floor_m: float) -> np.ndarray:
    """log of the odds (2, s) that heights `wanted` (n,) are those `shown`, with either sign and each of s factors."""
    empty = np.full((1, len(wanted), 1), np.nan)
    log = channel_scores(
        np.concatenate([wanted[None, :, None], empty, empty], axis=2),
        np.repeat(shown[None, :, None], 3, axis=2),
        factors,
        np.full(3, floor_m),
    )[0, 0, 0]
    return log + UNIT_PRIOR * ((factors != 1.0)[None, :] + np.array([[0.0], [1.0]]))


def check_baro(imu: Imu, fixes: Fixes, start_height_m: float, table: str) -> Finding | None:
    """The unit and sign of the barometric height that the heights of the fixes, or the start, prefer."""
    if imu.height_baro_m is None:
        return None
    use = np.flatnonzero(fixes.valid & np.isfinite(fixes.height_m))
    use = use[(fixes.time_s[use] >= imu.time_s[0]) & (fixes.time_s[use] <= imu.time_s[-1])] if use.size else use
    if use.size < FEWEST:
        return None
    use = use[np.unique(np.linspace(0, len(use) - 1, min(len(use), MOST_ROWS)).astype(int))]
    baro_m = np.interp(fixes.time_s[use], imu.time_s, imu.height_baro_m)
    height_m = fixes.height_m[use]
    offset_m = float(np.median(baro_m - height_m))
    wanted, shown = height_m - np.median(height_m), baro_m - np.median(baro_m)
    of_baro, of_fixes = list(HEIGHT_UNITS), list(HEIGHT_UNITS)[1:]
    factors = np.array([HEIGHT_UNITS[one] for one in of_baro] + [1.0 / HEIGHT_UNITS[one] for one in of_fixes])
    log = _height_scores(wanted, shown, factors, HEIGHT_FLOOR_M)
    best = np.unravel_index(np.argmax(log), log.shape)
    log_odds = float(log[best] - log[0, 0])
    if log_odds > LIKELY:
        seen = (
            f"height_baro_m changes by {np.ptp(baro_m):.4g} m where the heights of {table} change by "
            f"{np.ptp(height_m):.4g} m, expected about the same"
        )
        if best[1] >= len(of_baro):
            return another_height(seen, of_fixes[best[1] - len(of_baro)], log_odds)
        sign = ", with the other sign" if best[0] else ""
        seen = f"{seen}; it looks as if it is in {of_baro[best[1]]}{sign}"
        return Finding("height_baro", seen, "convert it to metres, upwards positive", log_odds)
    of_start_m = float(np.median(baro_m)) - start_height_m
    if min(abs(offset_m), abs(of_start_m)) > LARGEST_BARO_OFFSET_M:
        seen = (
            f"height_baro_m is {offset_m:.4g} m above the heights of {table}, expected within "
            f"{LARGEST_BARO_OFFSET_M:g} m"
        )
        return Finding("height_baro", seen, "refer it to the height of the start")
    return None


def check_stamps(fixes: Fixes, table: str) -> Finding | None:
    """A jump of the stamps: the time that the way from one fix to the next takes at its velocity is another.

    tau = v . dp / v . v;  a fix that is missing, or a step of the position aside, stamps differ by tau. How well it
    tells them is how they scatter, and how ways do in the time that they take: positions are as noisy in slow motion.
    """
    use = fixes.valid & np.isfinite(fixes.velocity_n[:, :2]).all(axis=1)
    use &= np.isfinite(fixes.latitude_rad) & np.isfinite(fixes.longitude_rad)
    time_s, velocity_n = fixes.time_s[use], fixes.velocity_n[use, :2]
    if use.sum() < FEWEST + 1:
        return None
    rows = np.arange(len(time_s))
    dp = moved(fixes.latitude_rad[use], fixes.longitude_rad[use], fixes.height_m[use], (rows[:-1], rows[1:]))[:, :2]
    mean = 0.5 * (velocity_n[1:] + velocity_n[:-1])
    speed2 = (mean**2).sum(axis=1)
    dt = np.diff(time_s)
    usual_s = float(np.median(dt))
    steady = (np.diff(velocity_n, axis=0) ** 2).sum(axis=1) < STEADY**2 * speed2  # who drives off after a gap has stood
    fast = steady & (speed2 > JUDGED_MPS**2) & (dt < LONGEST_JUMP_S + 2.0 * usual_s)
    if fast.sum() < FEWEST:
        return _uneven(time_s, ~fast, table)
    rows = np.flatnonzero(fast)
    excess_s = dt[fast] - (mean[fast] * dp[fast]).sum(axis=1) / speed2[fast]
    away_m = np.abs(dp[fast] - mean[fast] * (dt[fast] - excess_s)[:, None]).max(axis=1)  # across the way
    speed = np.sqrt(speed2[fast])
    spread_s = np.maximum(_scatter(excess_s), _scatter(excess_s * speed) / speed).clip(min=1e-3)
    odd = np.abs(dt[fast] - usual_s - excess_s) < 0.3 * np.abs(excess_s)  # the stamps themselves step by as much
    odd &= (np.abs(excess_s) > SMALLEST_JUMP_S) & (away_m < JUDGED_MPS * np.abs(excess_s))
    found = rows[odd & (np.abs(excess_s) > JUMP_SPREADS * spread_s)]
    if not found.size or found.size > MOST_JUMPS:
        longer_s = np.abs(dt - usual_s)
        told = np.zeros(len(dt), dtype=bool)
        told[rows] = (np.abs(excess_s) < 0.5 * longer_s[fast]) & (longer_s[fast] > JUMP_SPREADS * spread_s)
        return _uneven(time_s, ~told, table)
    k = int(found[0])
    size_s = float(dt[k] - usual_s)
    z = size_s / spread_s[np.searchsorted(rows, k)]
    log_odds = 0.5 * (NU + 1.0) * float(np.log1p(z * z / NU)) * LIKELIER_THAN_T - float(np.log(len(rows)))
    more = f" (and {found.size - 1} more)" if found.size > 1 else ""
    seen = (
        f"{table}: the stamps jump by {size_s:+.3f} s after {time_s[k]:.6g} s (fix {int(np.flatnonzero(use)[k]) + 1})"
        f"{more}, which the way between these fixes at their velocity contradicts, expected stamps of one clock"
    )
    mend = f"take {size_s:.3f} s off every stamp after {time_s[k]:.6g} s, or cut the recording there"
    apart_s = dt - usual_s
    sigma_s = float(np.sqrt(np.mean(apart_s[np.abs(apart_s) < SMALLEST_JUMP_S] ** 2)))  # of the step that was due
    jump = (float(time_s[k] + 0.5 * usual_s), size_s, max(sigma_s, STAMP_S))
    return Finding(f"{table}.clock", seen, mend, log_odds, jump=jump)


def _scatter(values: np.ndarray) -> float:
    """One sigma of values by their median absolute deviation."""
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))


def _uneven(time_s: np.ndarray, untold: np.ndarray, table: str) -> Finding | None:
    """A step of even stamps that no whole number of lost fixes makes, where no motion tells."""
    dt = np.diff(time_s)
    usual_s = float(np.median(dt))
    even = np.median(np.abs(dt - usual_s)) < EVEN * usual_s
    odd = untold & (np.abs(dt / usual_s - np.rint(dt / usual_s)) > UNEVEN) & (np.abs(dt - usual_s) > SMALLEST_JUMP_S)
    found = np.flatnonzero(odd)
    if not even or not found.size or found.size > MOST_JUMPS:
        return None
    k = int(found[0])
    seen = (
        f"{table}: the stamps jump by {dt[k] - usual_s:+.3f} s after {time_s[k]:.6g} s, no whole number of steps of "
        f"{usual_s:.4g} s, expected stamps of one clock; the vehicle is too slow there for its way to show it"
    )
    return Finding(f"{table}.clock", seen, "see whether later stamps are as much too late", UNEVEN_ODDS)


def pairs_of(time_s: np.ndarray, interval_s: float = INTERVAL_S):
    """Rows (first, last) about `interval_s` apart without a gap between, thinned to `MOST_ROWS`."""
    first, last = rows_apart(time_s, interval_s, overlap=4)
    if len(first) < FEWEST:
        return None
    keep = np.unique(np.linspace(0, len(first) - 1, min(len(first), MOST_ROWS)).astype(int))
    return first[keep], last[keep]


def moved(latitude, longitude, height_m, pairs) -> np.ndarray:
    """Differences of position north, east, down in m, (n, 3)."""
    first, last = pairs
    height_m = np.nan_to_num(height_m)
    a = (latitude[first], longitude[first], height_m[first])
    north, east, _ = geodetic2ned(latitude[last], longitude[last], height_m[first], *a, deg=False)
    return np.column_stack([north, east, height_m[first] - height_m[last]])


def travelled(time_s, velocity_n, pairs) -> np.ndarray:
    """Velocities integrated by the trapezoid, (n, 3)."""
    steps = 0.5 * (velocity_n[1:] + velocity_n[:-1]) * np.diff(time_s)[:, None]
    way = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    return way[pairs[1]] - way[pairs[0]]
