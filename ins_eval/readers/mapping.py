"""What a mapping file may say: which columns of a table are which quantity, in which unit and frame.

One mapping serves every source of named columns: a CSV table, a MATLAB or netCDF file (`columns.Columns`).
"""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from ins_eval.readers.columns import Column
from ins_eval.recording import Kind
from ins_eval.recording.belief import Belief, Vector
from ins_eval.tables import Strict


class TimeColumn(Strict):
    """Stamps; with `week` the column counts from the beginning of that GPS week, and `leap_s` takes it to UTC.

    Unit ``date`` is text such as 2024-05-01T10:20:30.5, in UTC unless it says otherwise; ``date day first`` and ``date
    month first`` are such as 1/5/2024. Where a logger keeps its
    stamps apart, `file` beside the mapping holds one in each row; a column of a number means that it has no names.
    """

    file: str | None = None
    column: Column
    unit: Literal["s", "ms", "us", "ns", "date", "date day first", "date month first"]
    week: Column | None = None
    leap_s: float = 18.0  # GPS minus UTC, since 2017


class Triad(Strict):
    columns: tuple[Column, Column, Column]
    unit: str


class One(Strict):
    column: Column


class Speed(Strict):
    """A speedometer."""

    column: Column
    unit: str = "m/s"


class Origin(Strict):
    latitude_deg: float
    longitude_deg: float
    height_m: float = 0.0


class Position(Strict):
    """Latitude, longitude in `unit` and height in its own; or m north-east-down, east-north-up, or Earth-fixed.

    Without the third column the height is not known.
    """

    columns: tuple[Column, Column, Column] | tuple[Column, Column]
    unit: str | None = None
    height_unit: str = "m"
    frame: Literal["geodetic", "NED", "ENU", "ECEF"] = "geodetic"
    origin: Origin | None = None

    @model_validator(mode="after")
    def _complete(self) -> Position:
        if self.frame == "geodetic" and self.unit is None:
            raise ValueError('has no unit, expected that of latitude and longitude; add unit = "deg"')
        if self.frame != "geodetic" and self.unit not in (None, "m"):
            raise ValueError(f"frame {self.frame} is in m, not in {self.unit}; leave the unit out")
        if self.frame != "geodetic" and self.height_unit != "m":
            raise ValueError(f"frame {self.frame} is in m, its height not in {self.height_unit}; leave that unit out")
        if (self.frame in ("NED", "ENU")) != (self.origin is not None):
            raise ValueError("origin = { latitude_deg, longitude_deg, height_m } belongs to frame NED or ENU; mend it")
        if self.frame == "ECEF" and len(self.columns) != 3:
            raise ValueError("frame ECEF has three columns; give x, y, z")
        return self


class Velocity(Strict):
    """Two or three columns; speed and course are over ground, course from north, clockwise."""

    columns: tuple[Column, Column, Column] | tuple[Column, Column]
    axes: Literal["NED", "NEU", "ENU", "ECEF", "NE", "EN", "speed course down", "speed course up", "speed course"]
    unit: str = "m/s"
    course_unit: str = "deg"

    @model_validator(mode="after")
    def _counted(self) -> Velocity:
        count = len(self.axes.split()) if " " in self.axes else 3 if self.axes == "ECEF" else len(self.axes)
        if len(self.columns) != count:
            raise ValueError(f"axes '{self.axes}' are {count} columns, not {len(self.columns)}; name that many")
        return self


class Attitude(Strict):
    """Roll, pitch, heading in `unit`, or a quaternion that turns body vectors into the frame.

    The body axes of a quaternion are `axes`.
    """

    columns: tuple[Column, Column, Column] | tuple[Column, Column, Column, Column]
    unit: str | None = None
    form: Literal["roll pitch heading", "w x y z", "x y z w"] = "roll pitch heading"
    frame: Literal["NED", "ENU"] = "NED"
    axes: str = "FRD"

    @model_validator(mode="after")
    def _complete(self) -> Attitude:
        angles = self.form == "roll pitch heading"
        if len(self.columns) != (3 if angles else 4):
            raise ValueError(f"form '{self.form}' is {3 if angles else 4} columns, not {len(self.columns)}; mend one")
        if angles and self.unit is None:
            raise ValueError('has no unit, expected that of the angles; add unit = "deg"')
        if angles and (self.frame, self.axes) != ("NED", "FRD"):
            raise ValueError("frame and axes belong to a quaternion; roll, pitch, heading are of FRD against NED")
        return self


class Epochs(Strict):
    """Another navigator: GPS, a better one (reference), or what an INS put out (solution); any group may be missing."""

    file: str | None = None  # beside the mapping; absent: the source itself
    time: TimeColumn
    position: Position | None = None
    velocity: Velocity | None = None
    attitude: Attitude | None = None
    valid: One | None = None

    @model_validator(mode="after")
    def _something(self) -> Epochs:
        if self.position is None and self.velocity is None and self.attitude is None:
            raise ValueError("has neither position nor velocity nor attitude; add what it holds")
        return self


class GivenStart(Strict):
    latitude_deg: float
    longitude_deg: float
    height_m: float
    velocity_ned_mps: Vector = (0.0, 0.0, 0.0)
    attitude_deg: Vector | None = None
    attitude_sigma_deg: Vector | None = None
    position_sigma_m: float = 0.0
    velocity_sigma_mps: float = 0.0


class MappingFile(Strict):
    """What the columns are."""

    kind: Kind
    axes: str
    name: str | None = None
    header: bool = True  # false: columns are numbered from 1
    time: TimeColumn | None = None  # of the samples
    gyro: Triad | None = None
    accelerometer: Triad | None = None
    temperature: One | None = None  # degC
    height_baro: One | None = None  # m
    speed: Speed | None = None  # kept as the further column speed_mps
    further: tuple[Column, ...] = ()
    start: GivenStart | None = None
    gps: Epochs | None = None
    reference: Epochs | None = None
    solution: Epochs | None = None
    belief: Belief = Belief()

    @model_validator(mode="after")
    def _samples_or_solution(self) -> MappingFile:
        missing = [name for name in ("time", "gyro", "accelerometer") if getattr(self, name) is None]
        if missing and (len(missing) < 3 or self.solution is None):
            raise ValueError(f"'{missing[0]}' is missing, expected the columns of the imu, or a [solution] alone")
        named = [column for triad in (self.gyro, self.accelerometer) if triad is not None for column in triad.columns]
        twice = [column for k, column in enumerate(named) if column in named[:k]]
        if twice:
            raise ValueError(
                f"column '{twice[0]}' stands for two axes of gyro and accelerometer, expected six; name each once"
            )
        return self
