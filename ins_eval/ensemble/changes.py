"""One-factor changes of a plan: a dotted key, and the value that stands there instead.

    creep.scatter            a parameter of an effect of the accelerometers (accelerometer/presets)
    gyro.bias_deg_per_h      a parameter of the gyros
    thermal.ground_c         a table of the profile; of its lists (turn, speed, height) every element
    alignment                "found" on the stand, or "given": the true attitude at time 0
    gradient                 spread of the temperatures in the IMU, see `imu.Instrument.gradient`

The tables have different names, so a key says which one it means. Every value is checked as if it stood in the file.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from functools import reduce
from typing import Literal

from ins_eval import accelerometer
from ins_eval.errors import UsageError, did_you_mean
from ins_eval.gyro import GyroPopulation
from ins_eval.profile import Profile
from ins_eval.tables import parse

Change = tuple[str, float | str | tuple[float, ...]]
Attitude = Literal["found", "given"]
ATTITUDES: tuple[Attitude, ...] = ("found", "given")


@dataclass(frozen=True)
class Setting:
    """What an ensemble assumes: sensors, profile, and how the attitude at time 0 is known."""

    accelerometers: accelerometer.Population
    gyros: GyroPopulation
    profile: Profile
    alignment: Attitude = "found"
    gradient: float = 0.0

    def changed(self, changes: Iterable[Change]) -> Setting:
        """The setting with each change made. Raises UsageError for a key that is unknown or a value out of range."""
        return reduce(_changed, changes, self)


def _changed(setting: Setting, change: Change) -> Setting:
    key, value = change
    where = f"change '{key}'"
    if key == "alignment":
        if value not in ATTITUDES:
            raise UsageError(f"{where}: the value is {value!r}; expected {' or '.join(map(repr, ATTITUDES))}")
        return replace(setting, alignment=value)
    if key == "gradient":
        return replace(setting, gradient=_not_negative(value, where))
    table, _, field = key.partition(".")
    effects = [effect.name for effect in setting.accelerometers.effects]
    tables = [name for name, content in setting.profile if not isinstance(content, (str, float))]
    if table in effects:
        effect = setting.accelerometers[table]
        new = parse(type(effect), {**dict(effect), field: value}, where)
        return replace(setting, accelerometers=setting.accelerometers.replacing(new))
    if table == "gyro":
        return replace(setting, gyros=_gyros(setting.gyros, field, value, where))
    if table in tables and field:
        return replace(setting, profile=_profile(setting.profile, table, field, value, where))
    near = did_you_mean(table, ["alignment", "gradient", "gyro", *effects, *tables])
    raise UsageError(f"{where}: expected <table>.<parameter>, and there is no table '{table}'{near}")


def _gyros(gyros: GyroPopulation, field: str, value, where: str) -> GyroPopulation:
    known = [f.name for f in fields(gyros)]
    if field not in known:
        raise UsageError(f"{where}: unknown key '{field}'{did_you_mean(field, known)}")
    return replace(gyros, **{field: _not_negative(value, where)})


def _not_negative(value, where: str) -> float:
    if isinstance(value, (str, tuple)) or not value >= 0.0:
        raise UsageError(f"{where}: the value is {value!r}; expected a number, 0 or more")
    return float(value)


def _profile(profile: Profile, table: str, field: str, value, where: str) -> Profile:
    content = getattr(profile, table)
    if not content:
        raise UsageError(f"{where}: profile '{profile.name}' has no {table}; name another profile or leave it out")
    if isinstance(content, tuple):
        new = tuple({**dict(element), field: value} for element in content)
    else:
        new = {**dict(content), field: value}
    return parse(Profile, {**dict(profile), table: new}, where)
