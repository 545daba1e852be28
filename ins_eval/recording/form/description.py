"""The file ``recording.toml``: what the recording is, from where it starts, and what is believed."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, Field, ValidationInfo, field_validator, model_validator

from ins_eval.errors import DataRefused, UsageError, did_you_mean
from ins_eval.printable import shown
from ins_eval.recording import KINDS, Start
from ins_eval.recording.belief import ZERO, Belief, FormTable, NotNegative, Vector
from ins_eval.recording.form.names import POSITION
from ins_eval.tables import parse, read_toml
from ins_eval.units import DEG

FILE = "recording.toml"
FORMAT = "ins-recording/1"
CHAMBER = "chamber"
AXES = "FRD"
_NEAR = 0.8  # similarity from which an unknown key is taken for a slip of the pen

T = TypeVar("T", bound=BaseModel)


class ImuTable(FormTable):
    """What the columns of the table ``imu`` mean."""

    rate_hz: Annotated[float, Field(gt=0.0)] | None = None
    gyro: Literal["increment", "rate"]
    accelerometer: Literal["pulse", "increment", "rate"]
    axes: str = AXES
    unit: str | None = None  # the name of a data sheet, see ins-eval presets

    @field_validator("axes")
    @classmethod
    def _forward_right_down(cls, axes: str) -> str:
        if axes != AXES:
            raise ValueError(
                f"the body axes are {axes!r}, expected '{AXES}' (forward, right, down); turn the columns of gyro and "
                "accelerometer to them"
            )
        return axes


class StartTable(FormTable):
    """The believed state at `time_s`, in degrees."""

    time_s: float | None = None  # None: one step before the first sample
    latitude_deg: Annotated[float, Field(ge=-90.0, le=90.0)] | None = None  # none of the three: those of a fix
    longitude_deg: Annotated[float, Field(ge=-360.0, le=360.0)] | None = None
    height_m: float | None = None
    velocity_ned_mps: Vector = ZERO
    attitude_deg: Vector | None = None
    attitude_sigma_deg: tuple[NotNegative, NotNegative, NotNegative] | None = None
    position_sigma_m: NotNegative = 0.0
    velocity_sigma_mps: NotNegative = 0.0
    still_until_s: float | None = None

    @model_validator(mode="after")
    def _whole_place(self) -> StartTable:
        known = [key for key in POSITION if getattr(self, key) is not None]
        if known and len(known) < len(POSITION):
            missing = next(key for key in POSITION if key not in known)
            raise ValueError(
                f"has {known[0]} and no {missing}, expected all of {', '.join(POSITION)} or none; add {missing}"
            )
        return self

    def state(self, one_step_before_s: float, at_a_fix: Start | None = None) -> Start:
        """The same in radians; where it has no place, what it does not say is `at_a_fix`."""
        place = {} if self.latitude_deg is None else {
            "latitude_rad": self.latitude_deg * DEG,
            "longitude_rad": self.longitude_deg * DEG,
            "height_m": self.height_m,
        }  # fmt: skip
        state = {
            "velocity_n": ("velocity_ned_mps", self.velocity_ned_mps),
            "attitude_rad": ("attitude_deg", _radians(self.attitude_deg)),
            "attitude_sigma_rad": ("attitude_sigma_deg", _radians(self.attitude_sigma_deg)),
            "position_sigma_m": ("position_sigma_m", self.position_sigma_m),
            "velocity_sigma_mps": ("velocity_sigma_mps", self.velocity_sigma_mps),
            "still_until_s": ("still_until_s", self.still_until_s),
        }
        known = {} if at_a_fix is None else vars(at_a_fix)
        said = {name: value for name, (key, value) in state.items() if not known or key in self.model_fields_set}
        return Start(**known | place | said | {"time_s": one_step_before_s if self.time_s is None else self.time_s})


class Description(FormTable):
    """The keys of ``recording.toml`` that are not belief."""

    format: str
    kind: str
    name: str | None = None
    notes: tuple[str, ...] = ()
    imu: ImuTable | None = None
    start: StartTable | None = None

    @field_validator("format", "kind")
    @classmethod
    def _known(cls, value: str, info: ValidationInfo) -> str:
        known = (FORMAT,) if info.field_name == "format" else (*KINDS, CHAMBER)
        if value not in known:
            raise ValueError(f"{shown(value)} is not known, expected {' or '.join(known)}{did_you_mean(value, known)}")
        return value


@dataclass(frozen=True)
class Opened:
    """A description as read, with the folder and the belief beside it."""

    folder: Path
    description: Description
    belief: Belief
    axes: tuple[str, ...]  # accelerometers that have a table
    notes: tuple[str, ...]

    @property
    def file(self) -> Path:
        return self.folder / FILE

    @property
    def name(self) -> str:
        return self.description.name or self.folder.resolve().name


def open_folder(folder: str | Path) -> Opened:
    """Read ``recording.toml``.

    Keys that are not known are kept in the belief, those of ``[imu]`` and ``[start]`` in tables of these names there.
    Raises UsageError for a folder that does not exist and DataRefused for one that holds no sound description.
    """
    folder = Path(folder)
    if not folder.is_dir():
        seen = "this is a file" if folder.exists() else "there is no such folder"
        raise UsageError(
            f"{folder}: {seen}, expected a recording in the form {FORMAT}; check the name, or make it: "
            "ins-eval import FORMAT FILE -o DIR"
        )
    path = folder / FILE
    if not path.is_file():
        raise DataRefused(
            f"{folder}: holds no {FILE}, expected one beside the tables; write it, or import the recording from the "
            "format that it is in"
        )
    try:
        table = read_toml(path)
    except UsageError as fault:
        raise DataRefused(str(fault)) from None
    except (ValueError, RecursionError) as fault:  # a number of thousands of digits, brackets a thousand deep
        raise DataRefused(f"{path}: not valid TOML ({type(fault).__name__}); correct the file") from None
    description = _parse(Description, table, path)
    believed = {key: value for key, value in table.items() if key not in Description.model_fields}
    for key in ("imu", "start"):
        if extra := getattr(description, key) and getattr(description, key).model_extra:
            believed[key] = extra
    axes = tuple(axis for axis in "xyz" if axis in _table(believed, "accelerometer"))
    if description.kind == CHAMBER:  # nothing need be believed of what is to be calibrated: its table may be empty
        accelerometer = _table(believed, "accelerometer")
        empty = [axis for axis in axes if not {"scale", "compensation"} & set(_table(accelerometer, axis))]
        believed |= {"accelerometer": {key: value for key, value in accelerometer.items() if key not in empty}}
    belief = _parse(Belief, believed, path)
    slips = _slips(belief, (), ("imu", "start"))
    for key in ("imu", "start"):
        slips += _slips(getattr(description, key), (key,))
    notes = dict.fromkeys((*description.notes, *slips))
    return Opened(folder, description, belief, axes, tuple(notes))


def table_of(description: Description, belief: Belief, unused: tuple[str, ...]) -> dict[str, Any]:
    """The tables of ``recording.toml``.

    The belief is written out in full, defaults included, but for tables that are `unused` and nothing but default.
    """
    table = description.model_dump(exclude_none=True)
    for key, value in belief.model_dump(exclude_none=True).items():
        if key not in unused or getattr(belief, key) != getattr(Belief(), key):
            table[key] = {**table[key], **value} if isinstance(table.get(key), dict) else value
    return {key: value for key, value in table.items() if value != ()}


def _table(table: dict[str, Any], key: str) -> dict[str, Any]:
    """The table below a key, empty where there is none."""
    below = table.get(key)
    return below if isinstance(below, dict) else {}


def _parse(model: type[T], table: dict[str, Any], path: Path) -> T:
    try:
        return parse(model, table, str(path))
    except UsageError as fault:
        raise DataRefused(str(fault)) from None


def _slips(table: FormTable | None, place: tuple[str, ...], known: tuple[str, ...] = ()) -> list[str]:
    """A sentence for each key that is not known but nearly is one that is; other extra keys are nobody's business."""
    if table is None:
        return []
    fields = (*type(table).model_fields, *known)
    notes = []
    for key in table.model_extra or {}:
        near = [] if key in known else difflib.get_close_matches(key, fields, n=1, cutoff=_NEAR)
        if near:
            where = f" of [{'.'.join(place)}]" if place else ""
            notes.append(f"The key {shown(key)}{where} in {FILE} is not known and was not used; is it {near[0]}?")
    for key in type(table).model_fields:
        below = getattr(table, key)
        notes += _slips(below, (*place, key)) if isinstance(below, FormTable) else []
    return notes


def _radians(degrees: Vector | None) -> Vector | None:
    return None if degrees is None else tuple(value * DEG for value in degrees)
