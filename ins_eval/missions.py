"""A population of missions: the flight plan, the day and the history of an instrument, drawn for each anew.

A source of difference is a table of a file in ``trajectories/missions``. It draws from a stream of its own name and
changes the profile that all missions begin with, so adding or leaving out a source moves no other draw.

    place, heading     where it starts, and the way out
    cruise             height and speed
    course             turns of the cruise, which take the longer the faster it is: out and back, box, survey
    day                temperature of the ground and of the tropopause, from which the lapse follows
    stand              how long it stands, switched on
    history            the flight before: elements, magnet and epoxy are not in equilibrium when it is switched on
    receiver           errors of the reference receiver that last for minutes
    gyro, gradient     what instruments have in addition: thermal drift of the gyros, accelerometers unequally warm
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import tan
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field

from ins_eval.errors import UsageError, did_you_mean
from ins_eval.profile import Profile, Turn, folders
from ins_eval.streams import Streams
from ins_eval.tables import Strict, parse, read_extending
from ins_eval.thermal import TROPOPAUSE_M
from ins_eval.units import DEG, MINUTE, STANDARD_GRAVITY

FOLDER = "missions"
HANGAR_H = 24.0  # before the flight before: longer than any time constant of the epoxy
BOX_TURNS, BOX_DEG = 5, 90.0
EDGE_S = 10.0  # of a turn, as `profile.Turn`

CourseKind = Literal["out and back", "box", "survey"]
NotNegative = Annotated[float, Field(ge=0.0)]


def _ascending(ends: tuple[float, float]) -> tuple[float, float]:
    if ends[0] > ends[1]:
        raise ValueError(f"{list(ends)} runs backwards; give the smaller end first")
    return ends


Range = Annotated[tuple[float, float], AfterValidator(_ascending)]


class MissionSource(Strict):
    """One difference between missions; as it stands here it makes none."""

    def on(self, profile: Profile, rng: np.random.Generator) -> Profile:
        """The profile with what was drawn."""
        return profile


class StartPlace(MissionSource):
    """Latitude and longitude of the start."""

    latitude_deg: Range
    longitude_deg: Range

    def on(self, profile: Profile, rng: np.random.Generator) -> Profile:
        latitude, longitude = rng.uniform(*self.latitude_deg), rng.uniform(*self.longitude_deg)
        return _with(profile, "start", latitude_deg=latitude, longitude_deg=longitude)


class Heading(MissionSource):
    """Heading on the stand."""

    heading_deg: Range

    def on(self, profile: Profile, rng: np.random.Generator) -> Profile:
        return _with(profile, "start", heading_deg=rng.uniform(*self.heading_deg))


class Course(MissionSource):
    """The turns of the cruise, instead of those of the profile."""

    kinds: Annotated[tuple[CourseKind, ...], Field(min_length=1)]
    bank_deg: Range
    box_leg_s: Range
    survey_leg_s: Range

    def on(self, profile: Profile, rng: np.random.Generator) -> Profile:
        kind = self.kinds[rng.integers(len(self.kinds))]
        side, bank_deg = rng.choice((-1.0, 1.0)), rng.uniform(*self.bank_deg)
        legs_s = {"box": rng.uniform(*self.box_leg_s), "survey": rng.uniform(*self.survey_leg_s)}
        begin_s, end_s = cruise(profile)
        speed = max((change.to_mps for change in profile.speed), default=0.0)
        angles = _angles(kind, side)
        at_s = 0.5 * (begin_s + end_s) if kind == "out and back" else begin_s + legs_s[kind]
        turns = [turn for turn in profile.turn if not begin_s <= turn.at_s < end_s]
        for by_deg in angles:
            lasts_s = _lasts_s(by_deg, bank_deg, speed)
            if at_s + lasts_s > end_s:
                break
            turns.append(Turn(at_s=at_s, by_deg=by_deg, bank_deg=bank_deg, edge_s=EDGE_S))
            at_s += lasts_s + legs_s.get(kind, 0.0)
        turns.sort(key=lambda turn: turn.at_s)
        return parse(Profile, {**dict(profile), "name": f"{profile.name}, {kind}", "turn": turns}, profile.name)


class Cruise(MissionSource):
    """Height and speed of the cruise, instead of the largest of the profile."""

    height_m: Range
    speed_mps: Range

    def on(self, profile: Profile, rng: np.random.Generator) -> Profile:
        top = {"height": ("to_m", rng.uniform(*self.height_m)), "speed": ("to_mps", rng.uniform(*self.speed_mps))}
        changed = {}
        for table, (key, value) in top.items():
            rows = [dict(row) for row in getattr(profile, table)]
            highest = max((row[key] for row in rows), default=None)
            changed[table] = [{**row, key: value if row[key] == highest else row[key]} for row in rows]
        return parse(Profile, {**dict(profile), **changed}, profile.name)


class Day(MissionSource):
    """The air: its temperature at the ground, and how it falls to that of the tropopause."""

    ground_c: Range
    tropopause_c: float
    tropopause_sigma_c: NotNegative

    def on(self, profile: Profile, rng: np.random.Generator) -> Profile:
        ground_c = rng.uniform(*self.ground_c)
        top_c = self.tropopause_c + self.tropopause_sigma_c * rng.standard_normal()
        lapse = 1e3 * (ground_c - top_c) / (TROPOPAUSE_M - profile.start.height_m)
        return _with(profile, "thermal", ground_c=ground_c, lapse_c_per_km=lapse)


class Stand(MissionSource):
    """How long it stands, switched on: whole minutes."""

    minutes: Range

    def on(self, profile: Profile, rng: np.random.Generator) -> Profile:
        return _with(profile, "start", stand_s=MINUTE * round(rng.uniform(*self.minutes)))


class History(MissionSource):
    """A day in a hangar, a flight's time switched on, and the time since then on the ground's air."""

    on_h: Range
    since_h: Range
    hangar_warmer_c: Range

    def on(self, profile: Profile, rng: np.random.Generator) -> Profile:
        ground_c = profile.thermal.ground_c
        on_h, since_h = rng.uniform(*self.on_h), np.exp(rng.uniform(*np.log(self.since_h)))
        hangar_c = ground_c + rng.uniform(*self.hangar_warmer_c)
        before = (
            {"hours": HANGAR_H, "air_c": hangar_c},
            {"hours": on_h, "air_c": ground_c, "on": True},
            {"hours": since_h, "air_c": ground_c},
        )
        return _with(profile, "thermal", before=before)


class Receiver(MissionSource):
    """Errors of the receiver with a memory."""

    position_memory_m: Range
    velocity_memory_mps: Range
    memory_s: Range

    def on(self, profile: Profile, rng: np.random.Generator) -> Profile:
        return _with(profile, "gps", **{key: rng.uniform(*ends) for key, ends in self})


class Gyro(MissionSource):
    """Drift of the gyros with temperature; each instrument has its own."""

    thermal_deg_per_h_per_c: NotNegative


class Gradient(MissionSource):
    """Spread of the temperatures in the IMU; each instrument has its own (`imu.Instrument.gradient`)."""

    sigma: NotNegative


class _Tables(Strict):
    place: StartPlace | None = None
    heading: Heading | None = None
    cruise: Cruise | None = None
    course: Course | None = None
    day: Day | None = None
    stand: Stand | None = None
    history: History | None = None
    receiver: Receiver | None = None
    gyro: Gyro | None = None
    gradient: Gradient | None = None


SOURCES = tuple(_Tables.model_fields)


@dataclass(frozen=True)
class Missions:
    """The sources of difference that are on, by name, in the order of `SOURCES`."""

    name: str
    sources: Mapping[str, MissionSource]

    @classmethod
    def load(cls, name_or_path: str | Path) -> Missions:
        """A shipped population by name, or one from a TOML file; it may begin with ``extends = "NAME"``.

        Raises UsageError: no such file, not TOML, an unknown or missing key, a value out of its range.
        """
        path = find(name_or_path)
        tables = parse(_Tables, read_extending(path, find), str(path))
        return cls(path.stem, {name: source for name, source in tables if source is not None})

    def without(self, *names: str) -> Missions:
        """The same with these sources switched off; no other draw moves."""
        for name in names:
            if name not in SOURCES:
                raise UsageError(f"missions: no source '{name}'{did_you_mean(name, SOURCES)}")
        return Missions(self.name, {name: source for name, source in self.sources.items() if name not in names})

    def draw(self, profile: Profile, streams: Streams) -> Profile:
        """The profile of one mission, whose node in the random streams is `streams`."""
        for name, source in self.sources.items():
            profile = source.on(profile, streams.at(name).rng())
        return profile


def find(name_or_path: str | Path) -> Path:
    """The file of a population of missions given by path or by name; refuses with the names that exist."""
    path = Path(name_or_path)
    if path.suffix == ".toml":
        return path
    within = [folder / FOLDER for folder in folders()]
    for folder in within:
        if (folder / f"{name_or_path}.toml").is_file():
            return folder / f"{name_or_path}.toml"
    known = {file.stem for folder in within for file in folder.glob("*.toml")}
    raise UsageError(f"no population of missions '{name_or_path}'{did_you_mean(str(name_or_path), known)}")


def cruise(profile: Profile) -> tuple[float, float]:
    """Begin and end of the cruise in s: from reaching the largest height and speed to leaving either."""
    begin_s, end_s = 0.0, profile.duration_s
    for changes, key in ((profile.speed, "to_mps"), (profile.height, "to_m")):
        if changes:
            top = max(range(len(changes)), key=lambda k: getattr(changes[k], key))
            begin_s = max(begin_s, changes[top].to_s)
            if top + 1 < len(changes):
                end_s = min(end_s, changes[top + 1].from_s)
    return begin_s, end_s


def _angles(kind: str, side: float) -> list[float]:
    """Turns of a course in degrees, one after the other; they end with the cruise."""
    if kind == "out and back":  # a reversal: out to one side, back round the other way onto the same line
        return [90.0 * side, -270.0 * side]
    if kind == "box":
        return [BOX_DEG * side] * BOX_TURNS
    return [180.0 * side, -180.0 * side] * 20


def _lasts_s(by_deg: float, bank_deg: float, speed_mps: float) -> float:
    """Duration of a coordinated turn, psi' = g tan(bank) / V, with its two edges."""
    rate = STANDARD_GRAVITY * tan(bank_deg * DEG) / max(speed_mps, 1.0)
    return max(abs(by_deg) * DEG / rate, EDGE_S) + EDGE_S


def _with(profile: Profile, table: str, **fields: Any) -> Profile:
    """The profile with other values in one of its tables, checked as if they stood in its file."""
    return parse(Profile, {**dict(profile), table: {**dict(getattr(profile, table)), **fields}}, profile.name)
