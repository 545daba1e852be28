"""Columns of another navigator as `Fixes`: frames, units and stamps turned into ours; a missing group is NaN."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from pymap3d import ecef2geodetic, ned2geodetic
from scipy.spatial.transform import Rotation

from ins_eval.readers.columns import DATE, DAY_FIRST, MONTH_FIRST, Columns, same_length, vectors
from ins_eval.readers.epochs import checked
from ins_eval.readers.layout import choose, frd_from
from ins_eval.readers.mapping import Attitude, Epochs, Position, TimeColumn, Velocity
from ins_eval.recording import Fixes
from ins_eval.recording.consistency.track import HEIGHT_UNITS
from ins_eval.recording.outages import stated_valid
from ins_eval.units import DEG, SPEED_UNITS

KEYS = (
    "position.unit", "position.order", "height.unit", "velocity.unit", "velocity.axes", "course.unit", "attitude.unit",
)  # fmt: skip
DATES = (DATE, DAY_FIRST, MONTH_FIRST)
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
ANGLE_UNITS = {"deg": DEG, "rad": 1.0, "1e-7 deg": 1e-7 * DEG}
ORDERS = {"latitude longitude": [0, 1, 2], "longitude latitude": [1, 0, 2]}
ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])  # east-north-up to north-east-down
GPS_EPOCH_S = 315964800.0  # 1980-01-06 in seconds since 1970
WEEK_S = 604800.0


def stamps(source: Columns, described: TimeColumn, where: str, unit: str | None = None) -> np.ndarray:
    """The time of each row, s; counted from 1970 in UTC where the stamps are dates or have a GPS week."""
    unit = unit or described.unit
    choose("time.unit", unit, (*TIME_UNITS, *DATES))
    if unit in DATES:
        return source.dates_s(described.column, where, unit)
    time_s = TIME_UNITS[unit] * source.numbers(described.column, where)
    if described.week is None:
        return time_s
    week = source.numbers(described.week, where)
    same_length(source.path, where, {str(described.column): time_s, str(described.week): week})
    return GPS_EPOCH_S + WEEK_S * week + time_s - described.leap_s


def fixes(
    source: Columns, described: Epochs, where: str, origin_s: float, assumed: Mapping[str, str], keep_empty: bool
) -> tuple[Fixes, list[str]]:
    """The table of another navigator, and what was left out of it or is an outage.

    A row without any value is an outage, left out unless `keep_empty`; one without a time is left out.
    `origin_s` is subtracted from the stamps. Raises `DataRefused` for what no vehicle does, `UsageError` for columns
    that are not there.
    """
    time_s = stamps(source, described.time, where) - origin_s
    columns = {"time": time_s}
    if described.position is not None:
        columns["position"] = _position(source, described.position, where, assumed)
    if described.velocity is not None:
        columns["velocity"] = _velocity(source, described.velocity, where, assumed)
    if described.attitude is not None:
        columns["attitude"] = _attitude(source, described.attitude, where, assumed)
    if described.valid is not None:
        columns["valid"] = source.numbers(described.valid.column, where)
    same_length(source.path, where, columns)
    n = len(time_s)
    position, velocity = (columns.get(name, np.full((n, 3), np.nan)) for name in ("position", "velocity"))
    if described.velocity is not None and described.velocity.axes == "ECEF":
        velocity = _from_earth_fixed(velocity, position)
    attitude = columns.get("attitude")
    found = groups_found(position, velocity, attitude)
    name = where.rpartition(", ")[2]
    timed = np.isfinite(time_s)
    stated, notes = stated_valid(
        columns.get("valid", np.ones(n)), found & timed, name, lambda row: source.first_row + row
    )
    if (lost := found & ~timed).any():
        first = source.first_row + int(np.argmax(lost))
        notes.append(f"Rows of {name} without a time: {np.count_nonzero(lost)}, first row {first}; they were left out.")
    keep = timed & (keep_empty | found)
    attitude = None if attitude is None else attitude[keep]
    made = Fixes.of(time_s[keep], position[keep], velocity[keep], (found & stated)[keep], attitude)
    rows = np.flatnonzero(keep) + source.first_row
    return checked_groups(made, f"{source.path}, {name}", rows), notes


def groups_found(position: np.ndarray, velocity: np.ndarray, attitude: np.ndarray | None) -> np.ndarray:
    """Where a row has a horizontal position, a horizontal velocity or an attitude."""
    groups = [position[:, :2], velocity[:, :2], *([] if attitude is None else [attitude])]
    return np.any([np.isfinite(group).all(axis=1) for group in groups], axis=0)


def checked_groups(fixes: Fixes, where: str, rows: np.ndarray | None = None) -> Fixes:
    """The fixes as they are, once what they hold has passed `epochs.checked`; a missing value is not judged."""

    motion = ("latitude_rad", "longitude_rad", "height_m", "velocity_n")
    held = {name: np.where(np.isnan(values := getattr(fixes, name)), 0.0, values) for name in motion}
    checked(replace(fixes, **held), where, rows)
    return fixes


def _position(source: Columns, described: Position, where: str, assumed: Mapping[str, str]) -> np.ndarray:
    """Latitude, longitude in rad and height in m, (n, 3); a height that is not given is NaN."""
    values = vectors(source, described.columns, where)
    if described.frame == "geodetic":
        unit = assumed.get("position.unit", described.unit)
        order = assumed.get("position.order", "latitude longitude")
        choose(f"{where}, position.unit", unit, ANGLE_UNITS)
        choose(f"{where}, position.order", order, ORDERS)
        height_unit = assumed.get("height.unit", described.height_unit)
        choose(f"{where}, height.unit", height_unit, HEIGHT_UNITS)
        values[:, :2] *= ANGLE_UNITS[unit]
        values[:, 2:] *= HEIGHT_UNITS[height_unit]
        values = np.column_stack([values, np.full(len(values), np.nan)])[:, :3]
        return values[:, ORDERS[order]]
    with np.errstate(all="ignore"):  # what overflows is refused by its size
        if described.frame == "ECEF":
            return geodetic(values)
        flat = len(described.columns) == 2
        local = np.column_stack([values, np.zeros(len(values))])[:, :3]
        north, east, down = (local @ ENU.T if described.frame == "ENU" else local).T
        place = described.origin
        position = np.column_stack(
            ned2geodetic(north, east, down, place.latitude_deg, place.longitude_deg, place.height_m)
        )
    position[:, :2] *= DEG
    if flat:
        position[:, 2] = np.nan
    return position


def geodetic(xyz_m: np.ndarray) -> np.ndarray:
    """Latitude, longitude in rad and height in m of Earth-fixed positions (n, 3); NaN where one is not finite."""
    position = np.full((len(xyz_m), 3), np.nan)
    sound = np.isfinite(xyz_m).all(axis=1) & (np.linalg.norm(xyz_m, axis=1) > 0.0)
    if sound.any():
        position[sound] = np.column_stack(ecef2geodetic(*xyz_m[sound].T))
        position[sound, :2] *= DEG
    return position


def _from_earth_fixed(velocity_e: np.ndarray, position: np.ndarray) -> np.ndarray:
    """North, east, down of Earth-fixed velocities (n, 3), at the place of each row."""
    (sl, cl), (so, co) = ((np.sin(angle), np.cos(angle)) for angle in position[:, :2].T)
    x, y, z = velocity_e.T
    outwards = co * x + so * y
    return np.column_stack([cl * z - sl * outwards, co * y - so * x, -cl * outwards - sl * z])


def _velocity(source: Columns, described: Velocity, where: str, assumed: Mapping[str, str]) -> np.ndarray:
    """North, east, down in m/s, (n, 3), Earth-fixed where the columns are so; a down that is not given is NaN."""
    if "velocity.axes" in assumed:
        described = type(described).model_validate(described.model_dump() | {"axes": _axes(described, assumed)})
    unit = assumed.get("velocity.unit", described.unit)
    choose(f"{where}, velocity.unit", unit, SPEED_UNITS)
    values = vectors(source, described.columns, where)
    if described.axes.startswith("speed"):
        course_unit = assumed.get("course.unit", described.course_unit)
        choose(f"{where}, course.unit", course_unit, ANGLE_UNITS)
        course = ANGLE_UNITS[course_unit] * values[:, 1]
        speed = values[:, 0].copy()
        values[:, 0], values[:, 1] = speed * np.cos(course), speed * np.sin(course)
    elif described.axes.startswith("EN"):
        values[:, [0, 1]] = values[:, [1, 0]]
    values = SPEED_UNITS[unit] * np.column_stack([values, np.full(len(values), np.nan)])[:, :3]
    if described.axes.endswith(("U", "up")):
        values[:, 2] *= -1.0
    return values


def _axes(described: Velocity, assumed: Mapping[str, str]) -> str:
    choices = [
        axes
        for axes in ("NED", "NEU", "ENU", "ECEF", "NE", "EN", "speed course down", "speed course up", "speed course")
        if len(described.columns) == (2 if axes in ("NE", "EN", "speed course") else 3)
    ]
    choose("velocity.axes", assumed["velocity.axes"], tuple(choices))
    return assumed["velocity.axes"]


def _attitude(source: Columns, described: Attitude, where: str, assumed: Mapping[str, str]) -> np.ndarray:
    """Roll, pitch, heading in rad, (n, 3)."""
    values = vectors(source, described.columns, where)
    if described.form == "roll pitch heading":
        unit = assumed.get("attitude.unit", described.unit)
        choose(f"{where}, attitude.unit", unit, ANGLE_UNITS)
        return ANGLE_UNITS[unit] * values
    scalar_last = values if described.form == "x y z w" else values[:, [1, 2, 3, 0]]
    return attitude_of(scalar_last, described.frame, described.axes)


def attitude_of(quaternion: np.ndarray, frame: str = "NED", axes: str = "FRD") -> np.ndarray:
    """Roll, pitch, heading in rad, (n, 3), of quaternions (n, 4), scalar last, from body `axes` into `frame`.

    Rows that are no rotation, of length 0 or not finite, are NaN.
    """
    attitude = np.full((len(quaternion), 3), np.nan)
    with np.errstate(all="ignore"):
        length = np.linalg.norm(quaternion, axis=1)
    sound = np.isfinite(length) & (length > 0.0)
    if sound.any():
        turned = Rotation.from_quat(quaternion[sound] / length[sound, None]).as_matrix() @ frd_from(axes).T
        matrix = ENU @ turned if frame == "ENU" else turned
        pitch = -np.arcsin(np.clip(matrix[:, 2, 0], -1.0, 1.0))
        attitude[sound] = np.column_stack(
            [np.arctan2(matrix[:, 2, 1], matrix[:, 2, 2]), pitch, np.arctan2(matrix[:, 1, 0], matrix[:, 0, 0])]
        )
    return attitude
