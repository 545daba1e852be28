"""What was recorded: the one type that simulated and real data share.

After a `Recording` is made nothing can tell whether it was simulated. All quantities are SI with angles in
rad, body axes are forward-right-down and the navigation frame is north-east-down, whatever the file held.
Row k of `Imu` covers the time from row k-1 (the first: from ``start.time_s``) to its own ``time_s``.
On disk it has the form of docs/recording.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from ins_eval.recording.belief import Belief

Kind = Literal["flight", "drive", "oven", "static"]
KINDS: tuple[Kind, ...] = get_args(Kind)
PARKED: tuple[Kind, ...] = ("oven", "static")  # what is not meant to move


@dataclass(frozen=True)
class Start:
    """The believed state at `time_s`; `attitude_rad` is roll, pitch, heading, or None when it must be aligned.

    `still_until_s` is known where somebody wrote down until when the vehicle stood still from `time_s` on.
    """

    time_s: float
    latitude_rad: float
    longitude_rad: float
    height_m: float
    velocity_n: tuple[float, float, float] = (0.0, 0.0, 0.0)  # m/s
    attitude_rad: tuple[float, float, float] | None = None
    attitude_sigma_rad: tuple[float, float, float] | None = None
    position_sigma_m: float = 0.0
    velocity_sigma_mps: float = 0.0
    still_until_s: float | None = None


@dataclass(frozen=True)
class Imu:
    """Increments of a strapdown triad.

    `gyro` (n, 3) is rad over the sample. `accelerometer` (n, 3) is counts over the sample where
    `accelerometer_form` is ``"pulse"`` and m/s over the sample where it is ``"increment"``.
    `temperature_c` is the thermometer's reading, (n,) for the whole unit or (n, 3) for each accelerometer.
    """

    time_s: np.ndarray
    gyro: np.ndarray
    accelerometer: np.ndarray
    accelerometer_form: Literal["pulse", "increment"]
    temperature_c: np.ndarray | None = None
    height_baro_m: np.ndarray | None = None
    further: Mapping[str, np.ndarray] = field(default_factory=dict)  # columns of any other sensor, by name
    filled: np.ndarray | None = None  # (n,) bool: the sample was not recorded, a straight line stands in for it

    def rows(self, chosen: slice) -> Imu:
        """Some of the samples."""
        columns = {
            name: values[chosen] if isinstance(values, np.ndarray) else values for name, values in vars(self).items()
        }
        return Imu(**columns | {"further": {name: values[chosen] for name, values in self.further.items()}})


@dataclass(frozen=True, eq=False)
class Fixes:
    """Positions and velocities of a navigator: GPS, a better INS (then with attitude), or the INS itself.

    A group that is missing (position, velocity, attitude) is NaN; groups may have rows of their own.
    """

    time_s: np.ndarray  # (m,)
    latitude_rad: np.ndarray
    longitude_rad: np.ndarray
    height_m: np.ndarray
    velocity_n: np.ndarray  # (m, 3) m/s
    valid: np.ndarray  # (m,) bool, False in an outage
    attitude_rad: np.ndarray | None = None  # (m, 3) roll, pitch, heading
    position_sigma_m: np.ndarray | None = None  # (m,) where each fix states its own
    velocity_sigma_mps: np.ndarray | None = None

    @classmethod
    def of(cls, time_s: np.ndarray, position: np.ndarray, *others: np.ndarray | None) -> Fixes:
        """From latitude, longitude in rad and height in m (m, 3); `others` in the order of the fields."""
        return cls(time_s, *position.T, *others)

    @classmethod
    def of_attitude(cls, time_s: np.ndarray, attitude_rad: np.ndarray, valid: bool) -> Fixes:
        """An attitude (m, 3) without position and velocity, every row of it `valid` or not."""
        unknown = np.full((time_s.size, 3), np.nan)
        return cls.of(time_s, unknown, unknown.copy(), np.full(time_s.size, valid), attitude_rad)

    def state(self, row: int) -> dict[str, Any]:
        """Position and velocity of one row, as `Start` takes them."""
        place = {name: float(getattr(self, name)[row]) for name in ("latitude_rad", "longitude_rad", "height_m")}
        return {**place, "velocity_n": tuple(self.velocity_n[row].tolist())}

    def rows(self, chosen: np.ndarray) -> Fixes:
        """Some of the fixes."""
        return Fixes(**{name: None if values is None else values[chosen] for name, values in vars(self).items()})


def whole_rows(motion: np.ndarray) -> np.ndarray:
    """Which rows of latitude, longitude, height and velocity (m, 6) hold what the table delivers, (m,) bool.

    A column that is never there is not asked for, of attitude alone nothing. Where no row has position and velocity
    both, since each has rows of its own, a row that has one of them is whole.
    """
    there = np.isfinite(motion)
    delivered = there.any(axis=0)
    groups = [there[:, columns][:, delivered[columns]] for columns in (slice(0, 3), slice(3, 6))]
    whole = [group.all(axis=1) for group in groups if group.size]
    if not whole:
        return np.ones(len(motion), dtype=bool)
    both = np.logical_and.reduce(whole)
    return both if both.any() else np.logical_or.reduce(whole)


@dataclass(frozen=True)
class Recording:
    """One uninterrupted recording of one instrument: its `imu`, its own `solution`, or both."""

    name: str
    kind: Kind
    start: Start
    imu: Imu | None  # None: only what the INS put out itself was recorded
    gps: Fixes | None = None
    reference: Fixes | None = None
    belief: Belief = field(default_factory=Belief)
    notes: tuple[str, ...] = field(default=())  # what a reader found and what it assumed, one sentence each
    unit: str | None = None  # an inertial unit by the name of its data sheet
    folder: Path = field(default=Path("."), compare=False)  # to which files that the belief names are relative
    solution: Fixes | None = None  # what the INS put out itself

    @property
    def interval_s(self) -> np.ndarray:
        """Length of each sample of the IMU, (n,) s; the first begins at the start."""
        return np.diff(self.imu.time_s, prepend=self.start.time_s)

    def between(self, begin_s: float, end_s: float) -> tuple[Recording, slice]:
        """The same with the samples between two instants only, and their rows; the rest of the start stays."""
        time_s = self.imu.time_s
        rows = slice(*np.searchsorted(time_s, [begin_s + 1e-6, end_s + 1e-6]))
        before_s = float(time_s[rows.start - 1]) if rows.start else self.start.time_s
        return replace(self, start=replace(self.start, time_s=before_s), imu=self.imu.rows(rows)), rows


@dataclass(frozen=True, eq=False)
class ChamberReadings:
    """One accelerometer in a thermal chamber: one row a reading, as in the table ``chamber`` on disk.

    `run` numbers each uninterrupted stay in one position, `input_g` is the specific force along the input axis
    in units of standard gravity, `rate_c_per_min` the commanded ramp, `temperature_c` the thermometer's
    reading at the accelerometer's surface, `output` the mean output over the reading in pulse/s. `axis` is the body
    axis of its input in the IMU that it belongs to, empty where that is not said.
    """

    time_s: np.ndarray
    run: np.ndarray
    input_g: np.ndarray
    rate_c_per_min: np.ndarray
    temperature_c: np.ndarray
    output: np.ndarray
    unit_id: str = ""
    axis: Literal["x", "y", "z", ""] = ""
    further: Mapping[str, np.ndarray] = field(default_factory=dict)  # the chamber's own temperature, any other sensor
