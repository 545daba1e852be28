"""An effect that has no name: an error of a sensor that follows a recorded column, in one of a few forms.

    TARGET = value * SHAPE(DRIVER)        TARGET  accelerometer bias, accelerometer scale, gyro bias, gyro scale
                                          SHAPE   one of `SHAPES`; with an argument: SHAPE(DRIVER, ARGUMENT)

such as ``accelerometer bias = value * lag(supply_v, 600)``. With u the driver and u(0) its first value:

    change    u - u(0)
    square    (u - u(0))^2
    rate      60 (u - y) / tau with tau y' = u - y, y(0) = u(0), per minute; argument tau in s
    lag       y - y(0) of the same filter; argument tau in s
    branch    +1 where u falls, -1 where it rises; argument: the change over which 63 % of the other branch is reached
"""

from __future__ import annotations

import re
from typing import NamedTuple

from ins_eval.effects.effect import ACCELEROMETER, GYRO, Effect
from ins_eval.errors import UsageError, did_you_mean
from ins_eval.units import DEG_PER_H, PPM, UG

NAME = "composed"
# whether it has an argument
SHAPES = {"change": False, "square": False, "rate": True, "lag": True, "branch": True}


class Target(NamedTuple):
    """What a composed effect changes: `size` in `unit` is usual."""

    sensor: str
    multiplier: str
    unit: str
    si: float
    size: float


TARGETS = {
    "accelerometer bias": Target(ACCELEROMETER, "1", "ug", UG, 50.0),
    "accelerometer scale": Target(ACCELEROMETER, "f", "ppm", PPM, 100.0),
    "gyro bias": Target(GYRO, "1", "deg/h", DEG_PER_H, 0.02),
    "gyro scale": Target(GYRO, "w", "ppm", PPM, 50.0),
}
_FORM = re.compile(r"(?P<target>[a-z ]+?) = value \* (?P<shape>\w+)\((?P<driver>[^,()]+)(?:, (?P<argument>[^,()]+))?\)")

EFFECTS = (
    Effect(
        name=NAME,
        physics="a sensor's error follows a column that was recorded beside it",
        enters="any", unit="as stated", si=1.0, nominal=1.0, words=("driver", "form"),
        excited_by="a driver that changes", reference="none: the recording itself suggests it",
    ),
)  # fmt: skip


class Form(NamedTuple):
    """A form taken apart; `argument` is NaN where the shape has none."""

    target: Target
    shape: str
    driver: str
    argument: float


def form(target: str, shape: str, driver: str, argument: float | None = None) -> str:
    """The words of a form, as an answer and a belief state them."""
    return f"{target} = value * {shape}({driver}{'' if argument is None else f', {argument:.6g}'})"


def parse_form(text: str, where: str = NAME) -> Form:
    """A form taken apart. Raises UsageError, which begins with `where`, for one that is none of those above."""
    match = _FORM.fullmatch(text)
    if match is None:
        raise UsageError(
            f"{where}: the form '{text}' is not understood, expected such as "
            f"'{form('accelerometer bias', 'lag', 'supply_v', 600.0)}'; write it so"
        )
    target, shape, argument = match["target"], match["shape"], match["argument"]
    for word, choices in ((target, TARGETS), (shape, SHAPES)):
        if word not in choices:
            raise UsageError(f"{where}: '{word}' in the form '{text}' is not known{did_you_mean(word, choices)}")
    try:
        number = float(argument) if SHAPES[shape] else float("nan")
    except (TypeError, ValueError):
        number = 0.0
    if number <= 0.0 or (argument is None) == SHAPES[shape]:
        wanted = "one number above 0" if SHAPES[shape] else "none"
        raise UsageError(f"{where}: the argument of {shape} in the form '{text}' should be {wanted}; correct it")
    return Form(TARGETS[target], shape, match["driver"], number)
