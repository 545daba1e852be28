"""What an effect is: its name, its physics, where it enters, in which unit, and how large it usually is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ins_eval.output_equation import SENSOR_AXES

AXES = ("x", "y", "z")
ACCELEROMETER, GYRO = "accelerometer", "gyro"
# multipliers of a gyro follow its own axis and the two others in turn
_TURN = {"w": 0, "w_next": 1, "w_last": 2, "f": 0, "f_next": 1, "f_last": 2}


class Parameter(NamedTuple):
    """A further parameter and its prior: log-uniform from `low` to `high`, or uniform over the recording (None).

    `count` is how many values are tried before the best is refined. One that is `assumed` has a value in the belief,
    and others are tried only where the recording is too short for that. The prior of one that is `even` is uniform, and
    a belief may leave it open. `form` is one sigma of its logarithm that the law leaves open, however well it is
    measured: another law of the same physics, fitted with this one, has its value elsewhere.
    """

    name: str
    unit: str
    low: float | None
    high: float | None
    count: int
    assumed: bool = False
    even: bool = False
    form: float = 0.0

    @property
    def words(self) -> str:
        """The name in words, without the unit in which it ends."""
        return (self.name.rpartition("_")[0] if self.unit else self.name).replace("_", " ")

    @property
    def log_uniform(self) -> bool:
        return self.low is not None and not self.even

    def grid(self, start_s: float, end_s: float) -> np.ndarray:
        """The values (count,) that are tried in a recording from `start_s` to `end_s`."""
        if self.low is None:
            return np.linspace(start_s, end_s, self.count + 2)[1:-1]
        if self.even:
            return np.linspace(self.low, self.high, self.count)
        return np.geomspace(self.low, self.high, self.count)


@dataclass(frozen=True)
class Effect:
    """One name of the vocabulary.

    name : as in docs/effects.md
    physics : what it is, in words
    enters : "accelerometer", "gyro", "gps", "reference", "start", "earth", "temperature", "recording" or "any"
    unit, si : of a value, and the SI value of one unit
    nominal : one sigma of the middle scale of the prior on the value, in `unit`
    excited_by : what a recording must contain for it to show
    reference : where its physics is written down
    axes : those that it can have; None where it has none
    multipliers : of a sensor's error; several where another axis has to be named
    slow : the slow factor by which the multiplier is multiplied, see `slow`
    parameters : what it has besides a value
    words : keys of what else it has, which is no number
    centre : what physics fixes the value to, in `unit`; 0 where it does not, then `nominal` is around 0
    local : it belongs to one recording only
    form : one sigma of the value that its law and the sampling leave open however long it is measured, as a part of it
    """

    name: str
    physics: str
    enters: str
    unit: str
    si: float
    nominal: float
    excited_by: str
    reference: str
    axes: tuple[str | None, ...] = AXES
    multipliers: tuple[str, ...] = ("1",)
    slow: str = "1"
    parameters: tuple[Parameter, ...] = ()
    centre: float = 0.0
    local: bool = False
    form: float = 1e-3
    words: tuple[str, ...] = ()

    def others(self, axis: str | None) -> tuple[str | None, ...]:
        """The other axes between which has to be chosen for `axis`; (None,) where there is nothing to choose."""
        if len(self.multipliers) == 1:
            return (None,)
        return tuple(taken_axis(self.enters, one, axis) for one in self.multipliers)

    def multiplier(self, axis: str | None, other_axis: str | None) -> str:
        """The multiplier for an axis and, where it has several, the other axis; its own where none is named."""
        if len(self.multipliers) == 1:
            return self.multipliers[0]
        return self.multipliers[self.others(axis).index(other_axis or axis)]


def taken_axis(sensor: str, multiplier: str, axis: str) -> str:
    """The body axis along which a `multiplier` of a sensor of `axis` is taken."""
    own, pendulous, output = SENSOR_AXES[axis]
    if sensor == ACCELEROMETER:
        return AXES[{"f_pendulous": pendulous, "f_output": output}.get(multiplier, own)]
    return AXES[(own + _TURN.get(multiplier, 0)) % 3]


def multiplied(sensor: str, multiplier: str, axis: str, force: np.ndarray, rate: np.ndarray) -> np.ndarray | float:
    """A multiplier at every sample: of specific force (n, 3) in m/s^2 and body rate (n, 3) in rad/s."""
    own = AXES.index(axis)
    if multiplier == "1":
        return 1.0
    if multiplier.startswith("|"):
        return np.abs((rate if sensor == GYRO else force)[:, own])
    if sensor == GYRO:
        taken = AXES.index(taken_axis(GYRO, multiplier, axis))
        return (rate if multiplier.startswith("w") else force)[:, taken]
    f = force[:, own]
    if multiplier in ("f^2", "f^3"):
        return f ** int(multiplier[-1])
    other = multiplier.removeprefix("f ")
    along = f if other == "f" else force[:, AXES.index(taken_axis(ACCELEROMETER, other, axis))]
    return f * along if " " in multiplier else along
