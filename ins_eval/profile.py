"""Flight profiles: what a file in ``trajectories/`` may say, and reading it.

A profile is TOML. A key carries its unit; an unknown key, a wrong type or a value out of its range is refused
with one sentence. ``extends = "other"`` starts from another profile, tables are merged and lists replaced.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from ins_eval.errors import UsageError, did_you_mean
from ins_eval.tables import Strict, parse, read_extending

Latitude = Annotated[float, Field(ge=-85.0, le=85.0)]
Longitude = Annotated[float, Field(ge=-180.0, le=180.0)]
Height = Annotated[float, Field(ge=-500.0, le=25000.0)]
Seconds = Annotated[float, Field(ge=-86400.0, le=86400.0)]
Duration = Annotated[float, Field(gt=0.0, le=86400.0)]
Celsius = Annotated[float, Field(ge=-90.0, le=150.0)]


class Place(Strict):
    """Where the vehicle stands before time 0."""

    latitude_deg: Latitude
    longitude_deg: Longitude
    height_m: Height
    heading_deg: Annotated[float, Field(ge=-360.0, le=360.0)]
    stand_s: Annotated[float, Field(ge=0.0, le=7200.0)]  # standing, switched on, before time 0


class SpeedChange(Strict):
    """Ground speed goes to `to_mps` between two instants; the acceleration fades in and out over `edge_s`."""

    from_s: Seconds
    to_s: Seconds
    to_mps: Annotated[float, Field(ge=0.0, le=400.0)]
    edge_s: Duration = 5.0


class HeightChange(Strict):
    """Height goes to `to_m` between two instants; the vertical speed fades in and out over `edge_s`."""

    from_s: Seconds
    to_s: Seconds
    to_m: Height
    edge_s: Duration = 30.0


class Turn(Strict):
    """A coordinated turn, positive to the right: the roll goes to `bank_deg` and back over `edge_s` each."""

    at_s: Seconds
    by_deg: Annotated[float, Field(ge=-720.0, le=720.0)]
    bank_deg: Annotated[float, Field(gt=0.0, le=70.0)]
    edge_s: Duration = 10.0


class WingRock(Strict):
    """A sinusoidal roll on top of the flight, faded in and out over ten periods."""

    amplitude_deg: Annotated[float, Field(ge=0.0, le=20.0)]
    frequency_hz: Annotated[float, Field(gt=0.0, le=5.0)]
    from_s: Seconds
    to_s: Seconds


class Anchor(Strict):
    """A temperature that is known at one instant; the self-heating is solved so that it is met."""

    time_s: Seconds
    temperature_c: Celsius


class Before(Strict):
    """A stretch of time before the IMU was switched on for the flight: in still air of `air_c`, switched on or off."""

    hours: Annotated[float, Field(gt=0.0, le=240.0)]
    air_c: Celsius
    on: bool = False


class Thermal(Strict):
    """Lumped heat balance of the IMU; see `thermal.imu_temperature`."""

    ground_c: Celsius = 20.0
    lapse_c_per_km: Annotated[float, Field(ge=-10.0, le=15.0)] | None = None  # up to 11 km; None: standard atmosphere
    before: tuple[Before, ...] = ()  # in the order of time, the last ends where the profile starts
    time_constant_s: Annotated[float, Field(gt=0.0, le=86400.0)] = 4500.0
    recovery_factor: Annotated[float, Field(ge=0.0, le=1.0)] = 0.85
    self_heating_c: Annotated[float, Field(ge=0.0, le=80.0)] | None = None
    anchor: Anchor | None = None
    same_as: str | None = None  # the oven repeats the temperatures of this profile

    @model_validator(mode="after")
    def _one_source(self) -> Thermal:
        if sum(v is not None for v in (self.self_heating_c, self.anchor, self.same_as)) != 1:
            raise ValueError("give exactly one of self_heating_c, anchor and same_as")
        return self


class Gps(Strict):
    """The reference receiver."""

    period_s: Annotated[float, Field(gt=0.0, le=60.0)] = 1.0
    position_sigma_m: Annotated[float, Field(ge=0.0, le=1000.0)] = 2.5
    velocity_sigma_mps: Annotated[float, Field(ge=0.0, le=10.0)] = 0.05
    position_memory_m: Annotated[float, Field(ge=0.0, le=1000.0)] = 0.0  # one sigma, beside the white error
    velocity_memory_mps: Annotated[float, Field(ge=0.0, le=10.0)] = 0.0
    memory_s: Duration = 300.0  # correlation time of both
    lost_beyond_roll_deg: Annotated[float, Field(gt=0.0, le=180.0)] = 30.0


class Baro(Strict):
    """Baro height: first-order Gauss-Markov error that starts at zero."""

    sigma_m: Annotated[float, Field(ge=0.0, le=500.0)] = 2.0
    correlation_s: Duration = 1800.0


class Phase(Strict):
    """A named part of the flight, for figures."""

    name: str
    from_s: Seconds
    to_s: Seconds


class Profile(Strict):
    """Everything that a trajectory file says."""

    name: str
    kind: Literal["flight", "static"] = "flight"
    duration_s: Duration
    start: Place
    speed: tuple[SpeedChange, ...] = ()
    height: tuple[HeightChange, ...] = ()
    turn: tuple[Turn, ...] = ()
    wing_rock: WingRock | None = None
    thermal: Thermal
    gps: Gps = Gps()
    baro: Baro = Baro()
    phase: tuple[Phase, ...] = ()

    @model_validator(mode="after")
    def _in_order(self) -> Profile:
        ordered: dict[str, Sequence[SpeedChange | HeightChange]] = {"speed": self.speed, "height": self.height}
        for label, changes in ordered.items():
            end = 0.0
            for i, c in enumerate(changes):
                if not end <= c.from_s < c.to_s <= self.duration_s:
                    raise ValueError(
                        f"{label}[{i}] runs from {c.from_s:g} s to {c.to_s:g} s; expected an interval that starts at "
                        f"or after {end:g} s, ends later than it starts and no later than duration_s = "
                        f"{self.duration_s:g} s"
                    )
                if 2 * c.edge_s > c.to_s - c.from_s:
                    raise ValueError(
                        f"{label}[{i}] lasts {c.to_s - c.from_s:g} s, too short for two edges of {c.edge_s:g} s"
                    )
                end = c.to_s
        for i, t in enumerate(self.turn):
            if not 0.0 <= t.at_s < self.duration_s:
                raise ValueError(f"turn[{i}] is at {t.at_s:g} s, outside 0 to duration_s = {self.duration_s:g} s")
        if self.kind == "static" and (self.speed or self.height or self.turn or self.wing_rock):
            raise ValueError(
                "a static profile does not move: leave out speed, height, turn and wing_rock, or set kind = 'flight'"
            )
        return self


def folders() -> list[Path]:
    """Where profiles are looked for by name: the working folder's ``trajectories``, then the shipped ones."""
    package = Path(__file__).parent
    return [Path("trajectories"), package / "trajectories", package.parent / "trajectories"]


def find(name: str | Path) -> Path:
    """The file of a profile given by path or by name; refuses with the names that exist."""
    path = Path(name)
    if path.suffix == ".toml":
        if path.is_file():
            return path
        raise UsageError(f"{path}: no such profile; give an existing .toml file or one of the shipped names")
    for folder in folders():
        if (folder / f"{name}.toml").is_file():
            return folder / f"{name}.toml"
    known = {p.stem for folder in folders() for p in folder.glob("*.toml")}
    raise UsageError(f"no profile '{name}'{did_you_mean(str(name), known)}")


def load(name: str | Path) -> Profile:
    """Read a profile by name or path. Raises UsageError with one sentence for whatever is wrong with it."""
    path = find(name)
    return parse(Profile, read_extending(path, find), str(path))
