"""From the tables of a log to a recording: samples, clocks, where it begins, and a note of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ins_eval.earth import radii
from ins_eval.errors import UsageError
from ins_eval.readers.layout import Layout, choose
from ins_eval.readers.mapping import GivenStart
from ins_eval.readers.options import NAMES, believed_time_offset, number
from ins_eval.readers.sampling import Readings, sampled
from ins_eval.recording import Fixes, Recording, Start
from ins_eval.recording.belief import POSITION_SIGMA_M, VELOCITY_SIGMA_MPS, Belief
from ins_eval.units import DEG

PLACE = ("latitude_deg", "longitude_deg", "height_m")
KEYS = ("kind", *Layout.KEYS, "gps.time_offset_s", "reference.time_offset_s", *PLACE)
KINDS = ("flight", "drive", "oven", "static")


@dataclass(frozen=True)
class Tables:
    """What a log holds, stamps on one clock; `start` is where it begins, if the log or a mapping says so."""

    name: str
    kind: str
    readings: Readings | None  # None: only what an INS put out itself
    layout: Layout | None
    gps: Fixes | None = None
    reference: Fixes | None = None
    solution: Fixes | None = None
    start: GivenStart | None = None
    belief: Belief = field(default_factory=Belief)
    attitude_sigma_rad: tuple[float, float, float] | None = None  # of the reference
    notes: tuple[str, ...] = ()


def recording(tables: Tables, where: str, assumed: Mapping[str, str], source: str) -> Recording:
    """The recording of a log; `source` says on whose word units and axes are what they are.

    Raises `UsageError` where nothing says where it begins, and what `sampled` raises.
    """
    choose("kind", tables.kind, KINDS)
    imu, start_s, notes = None, float(tables.solution.time_s[0]) if tables.readings is None else 0.0, ()
    if tables.readings is not None:
        layout = tables.layout.overridden(assumed)
        samples = sampled(tables.readings, layout, where)
        imu, start_s, notes = samples.imu, samples.start_s, (*layout.notes(assumed, source), *samples.notes)
    belief, offset_notes = _believed(tables, assumed, source)
    start, start_notes = _start(tables, belief, start_s, where, assumed)
    return Recording(
        name=tables.name,
        kind=tables.kind,
        start=start,
        imu=imu,
        gps=tables.gps,
        reference=tables.reference,
        belief=belief,
        notes=(
            *tables.notes,
            *notes,
            *offset_notes,
            *start_notes,
        ),
        solution=tables.solution,
    )


def _believed(tables: Tables, assumed: Mapping[str, str], source: str) -> tuple[Belief, list[str]]:
    """The belief with the clock offsets that are assumed, and a sentence for each."""
    belief, notes = tables.belief, []
    for name in ("gps", "reference"):
        described = getattr(belief, name)
        if getattr(tables, name) is None or (
            f"{name}.time_offset_s" not in assumed and "time_offset_s" in described.model_fields_set
        ):
            continue
        silent = "the mapping says nothing" if "mapping" in source else "the log does not document it"
        offset_s, note = believed_time_offset(name, assumed, silent)
        belief = belief.model_copy(update={name: described.model_copy(update={"time_offset_s": offset_s})})
        notes.append(note)
    return belief, notes


def _start(
    tables: Tables, belief: Belief, start_s: float, where: str, assumed: Mapping[str, str]
) -> tuple[Start, list[str]]:
    """The start that is given or assumed, or else the fix with a position nearest to the first sample."""
    place = tables.start
    if any(key in assumed for key in PLACE):
        missing = [key for key in PLACE[:2] if key not in assumed]
        if missing:
            raise UsageError(f"--assume {missing[0]}: is missing, expected both latitude_deg and longitude_deg; add it")
        place = GivenStart(**{key: number(assumed, key, 0.0) for key in PLACE})
    if place is not None:
        return _given(place, start_s), []
    candidates = [(name, getattr(tables, name)) for name in ("reference", "gps", "solution")]
    located = [
        (name, fixes, np.flatnonzero(np.isfinite(fixes.latitude_rad) & fixes.valid))
        for name, fixes in candidates
        if fixes is not None
    ]
    located = [found for found in located if found[2].size]
    if not located:
        raise UsageError(
            f"{where}: has neither [start] nor [gps] nor [reference] with a position, expected where the recording "
            "begins; add [start] with latitude_deg, longitude_deg and height_m to its mapping, or --assume "
            "latitude_deg=DEG --assume longitude_deg=DEG --assume height_m=M"
        )
    name, fixes, rows = located[0]
    return _from_fix(tables, name, fixes, rows, belief, start_s)


def _given(place: GivenStart, start_s: float) -> Start:
    return Start(
        time_s=start_s,
        latitude_rad=place.latitude_deg * DEG,
        longitude_rad=place.longitude_deg * DEG,
        height_m=place.height_m,
        velocity_n=place.velocity_ned_mps,
        attitude_rad=radians(place.attitude_deg),
        attitude_sigma_rad=radians(place.attitude_sigma_deg),
        position_sigma_m=place.position_sigma_m,
        velocity_sigma_mps=place.velocity_sigma_mps,
    )


def _from_fix(
    tables: Tables, name: str, fixes: Fixes, rows: np.ndarray, belief: Belief, start_s: float
) -> tuple[Start, list[str]]:
    described = getattr(belief, "gps" if name == "solution" else name)
    near_s = np.abs(fixes.time_s[rows] - described.time_offset_s - start_s)
    k = int(rows[np.argmin(near_s)])
    notes, height_m, velocity_n = [], float(fixes.height_m[k]), fixes.velocity_n[k]
    if not np.isfinite(height_m):
        height_m = 0.0
        notes.append(f"The height of the start is taken as 0 m, because {NAMES.get(name, name)} has none there.")
    if not np.isfinite(velocity_n).all():
        velocity_n = np.where(np.isfinite(velocity_n), velocity_n, _differenced(fixes, rows, k))
        notes.append(
            "The velocity of the start comes from differences of position, because "
            f"{NAMES.get(name, name)} has none there."
        )
    attitude = None
    for table in (tables.reference, tables.solution):
        if attitude is None and table is not None and table.attitude_rad is not None:
            known = np.flatnonzero(np.isfinite(table.attitude_rad).all(axis=1))
            if known.size:
                attitude = table.attitude_rad[known[np.argmin(np.abs(table.time_s[known] - start_s))]]
    sigmas = described.position_sigma_m, described.velocity_sigma_mps
    if None in sigmas:
        sigmas = POSITION_SIGMA_M, VELOCITY_SIGMA_MPS
        notes.append(f"The start is believed to {sigmas[0]:g} m and {sigmas[1]:g} m/s, since nobody stated its sigmas.")
    start = Start(
        time_s=start_s,
        **{**fixes.state(k), "height_m": height_m, "velocity_n": tuple(velocity_n.tolist())},
        attitude_rad=None if attitude is None else tuple(attitude.tolist()),
        attitude_sigma_rad=None if attitude is None else tables.attitude_sigma_rad,
        position_sigma_m=sigmas[0],
        velocity_sigma_mps=sigmas[1],
    )
    return start, notes


def _differenced(fixes: Fixes, rows: np.ndarray, k: int) -> np.ndarray:
    """North, east, down velocity (3,) from the position at row k to the next of `rows`, m/s; 0 where there is none."""
    later = rows[rows > k]
    earlier = rows[rows < k]
    if not later.size and not earlier.size:
        return np.zeros(3)
    a, b = (k, int(later[0])) if later.size else (int(earlier[-1]), k)
    meridian, transverse = radii(fixes.latitude_rad[k])
    north = (fixes.latitude_rad[b] - fixes.latitude_rad[a]) * meridian
    east = (fixes.longitude_rad[b] - fixes.longitude_rad[a]) * transverse * np.cos(fixes.latitude_rad[k])
    down = np.nan_to_num(fixes.height_m[a] - fixes.height_m[b])
    return np.array([north, east, down]) / (fixes.time_s[b] - fixes.time_s[a])


def radians(degrees):
    """A tuple of degrees in rad, or None."""
    return None if degrees is None else tuple(DEG * value for value in degrees)
