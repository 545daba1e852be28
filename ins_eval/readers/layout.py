"""Units and body axes of a file's gyro and accelerometer columns, and turning them into ours.

A unit says what a column is: ``deg/s`` is a rate, ``deg`` is the increment over a sample.
Axes are three letters, the directions in which x, y and z of the file point (``RFU``: right, forward, up), or the
three equations of our body axes (``x=y,y=x,z=-z``). Ours are forward-right-down.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ins_eval.errors import UsageError, did_you_mean
from ins_eval.readers.options import number
from ins_eval.units import ARCSEC, DEG, DEG_PER_H, STANDARD_GRAVITY

# name: (rate or increment, what one of it is in SI)
GYRO_UNITS = {
    "rad/s": ("rate", 1.0),
    "deg/s": ("rate", DEG),
    "deg/h": ("rate", DEG_PER_H),
    "rad": ("increment", 1.0),
    "deg": ("increment", DEG),
    "arcsec": ("increment", ARCSEC),
}
ACCELEROMETER_UNITS = {
    "m/s^2": ("rate", 1.0),
    "g": ("rate", STANDARD_GRAVITY),
    "milli-g": ("rate", 1e-3 * STANDARD_GRAVITY),
    "m/s": ("increment", 1.0),
    "g s": ("increment", STANDARD_GRAVITY),
}
DIRECTIONS = {
    "F": (1.0, 0.0, 0.0),
    "B": (-1.0, 0.0, 0.0),
    "R": (0.0, 1.0, 0.0),
    "L": (0.0, -1.0, 0.0),
    "D": (0.0, 0.0, 1.0),
    "U": (0.0, 0.0, -1.0),
}
GAPS = ("cut", "longest", "bridge", "refuse")
STAMPS = ("refuse", "drop")
EQUATION = re.compile(r"\s*([xyz])\s*=\s*([+-]?)\s*([xyz])\s*")


@dataclass(frozen=True)
class Layout:
    """How a file holds its samples; `gaps` and `stamps` say what to do with lost rows and with time going back.

    A gap of one row, or of up to `fill_s` seconds, is filled with samples on a straight line. Longer ones cut the
    recording into stretches, unless `gaps` says otherwise.
    """

    gyro_unit: str
    accelerometer_unit: str
    axes: str = "FRD"
    gaps: str = "cut"
    stamps: str = "refuse"
    fill_s: float = 0.5

    KEYS = ("gyro.unit", "accelerometer.unit", "axes", "gaps", "stamps", "fill_s")

    def __post_init__(self) -> None:
        choose("gyro.unit", self.gyro_unit, GYRO_UNITS)
        choose("accelerometer.unit", self.accelerometer_unit, ACCELEROMETER_UNITS)
        choose("gaps", self.gaps, GAPS)
        choose("stamps", self.stamps, STAMPS)
        if not 0.0 <= self.fill_s < np.inf:
            raise UsageError(f"fill_s: {self.fill_s:g}, expected seconds, 0 or more")
        frd_from(self.axes)

    def overridden(self, assumed: Mapping[str, str]) -> Layout:
        """This layout with what the user assumes instead."""
        words = {key.replace(".", "_"): assumed[key] for key in self.KEYS if key in assumed}
        return replace(self, **words | ({"fill_s": number(assumed, "fill_s", 0.0)} if "fill_s" in words else {}))

    def notes(self, assumed: Mapping[str, str], source: str) -> list[str]:
        """What the values are taken for, and on whose word."""

        def word(key: str) -> str:
            return "you assume so" if key in assumed else source

        gyro, accelerometer = GYRO_UNITS[self.gyro_unit][0], ACCELEROMETER_UNITS[self.accelerometer_unit][0]
        turned = "" if self.axes == "FRD" else " and were turned to forward-right-down"
        return [
            f"The gyro values are taken as {gyro}s in {self.gyro_unit}, because {word('gyro.unit')}.",
            f"The accelerometer values are taken as {accelerometer}s in {self.accelerometer_unit}, because "
            f"{word('accelerometer.unit')}.",
            f"The axes x, y, z are taken as {self.axes}{turned}, because {word('axes')}.",
        ]


def choose(key: str, value: str, choices: Mapping[str, object] | tuple[str, ...]) -> None:
    """Raise `UsageError` unless `value` is one of `choices`."""
    if value not in choices:
        raise UsageError(f"{key}: '{value}' is not known{did_you_mean(value, choices)}")


def frd_from(axes: str) -> np.ndarray:
    """The matrix (3, 3) that turns a vector in the axes of a file to forward-right-down.

    Raises `UsageError` for axes that are not three different directions or not right-handed.
    """
    matrix = _of_equations(axes) if "=" in axes else _of_letters(axes)
    if abs(np.linalg.det(matrix)) < 0.5:
        raise UsageError(
            f"axes: '{axes}' names one direction twice, expected three different ones such as FRD or RFU; correct it"
        )
    if np.linalg.det(matrix) < 0.0:
        raise UsageError(
            f"axes: '{axes}' is left-handed, expected a right-handed set such as FRD, FLU or RFU; "
            "check the sign of one axis"
        )
    return matrix


def letters(matrix: np.ndarray) -> str:
    """The three letters of the axes (3, 3) that `frd_from` turns so: the directions of the file's x, y and z."""
    return "".join(next(one for one, of in DIRECTIONS.items() if np.allclose(column, of)) for column in matrix.T)


def _of_letters(axes: str) -> np.ndarray:
    letters = axes.upper()
    if len(letters) != 3 or any(letter not in DIRECTIONS for letter in letters):
        raise UsageError(
            f"axes: '{axes}', expected three letters out of F, B, R, L, D, U for where x, y, z point, such as RFU, "
            "or equations such as x=y,y=x,z=-z"
        )
    return np.array([DIRECTIONS[letter] for letter in letters]).T


def _of_equations(axes: str) -> np.ndarray:
    found = [EQUATION.fullmatch(part) for part in axes.split(",")]
    if len(found) != 3 or not all(found) or {match[1] for match in found} != set("xyz"):
        raise UsageError(
            f"axes: '{axes}', expected one equation for each of our axes x forward, y right, z down, "
            "such as x=y,y=x,z=-z"
        )
    matrix = np.zeros((3, 3))
    for match in found:
        matrix["xyz".index(match[1]), "xyz".index(match[3])] = -1.0 if match[2] == "-" else 1.0
    return matrix
