"""From the tables of a log to a recording: samples, clocks, where it begins, and a note of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from ins_eval.errors import UsageError
from ins_eval.readers.layout import Layout, choose
from ins_eval.readers.mapping import GivenStart
from ins_eval.readers.options import believed_time_offset, number
from ins_eval.readers.sampling import Readings, sampled
from ins_eval.recording import KINDS, Fixes, Recording, Start
from ins_eval.recording.begin import begin_at_a_fix
from ins_eval.recording.belief import Belief
from ins_eval.recording.outages import measured
from ins_eval.units import DEG

PLACE = ("latitude_deg", "longitude_deg", "height_m")
KEYS = ("kind", *Layout.KEYS, "gps.time_offset_s", "reference.time_offset_s", *PLACE)
NAVIGATORS = ("gps", "reference", "solution")


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
    found = {name: measured(one, name) for name in NAVIGATORS if (one := getattr(tables, name)) is not None}
    tables = replace(tables, **{name: fixes for name, (fixes, _) in found.items()})
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
            *(note for _, of_table in found.values() for note in of_table),
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
    tables_of = {name: getattr(tables, name) for name in ("reference", "gps", "solution")}
    found = begin_at_a_fix(tables_of, belief, start_s, tables.attitude_sigma_rad)
    if found is None:
        raise UsageError(
            f"{where}: has neither [start] nor [gps] nor [reference] with a position, expected where the recording "
            "begins; add [start] with latitude_deg, longitude_deg and height_m to its mapping, or --assume "
            "latitude_deg=DEG --assume longitude_deg=DEG --assume height_m=M"
        )
    return found


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


def radians(degrees):
    """A tuple of degrees in rad, or None."""
    return None if degrees is None else tuple(DEG * value for value in degrees)
