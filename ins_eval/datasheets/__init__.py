"""Data sheets: what is printed of a device, and how far the temperature may take it in the worst case.

The simulation draws from populations (`accelerometer.Population`, `gyro.GyroPopulation`), which need more than a sheet
says; a sheet is held against them, not drawn from.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, model_validator

from ins_eval.errors import UsageError, did_you_mean
from ins_eval.tables import Strict, parse, read_toml

FOLDER = Path(__file__).parent
COLD_C, HOT_C = -20.0, 70.0  # Paper A, section 1: the range of its worst case

Positive = Annotated[float, Field(gt=0.0)]


class AccelerometerSheet(Strict):
    """A quartz flexible accelerometer, the rows of Paper A's Table 1."""

    kind: Literal["accelerometer"]
    name: str
    input_range_g: Positive
    bias_repeatability_ug: Positive
    bias_temperature_ug_per_c: Positive
    scale_repeatability_ppm: Positive
    scale_temperature_ppm_per_c: Positive
    operating_c: tuple[float, float]
    shock_g: Positive
    resolution_ug: Positive
    bandwidth_at_least_hz: Positive | None = None
    bandwidth_at_most_hz: Positive | None = None

    @model_validator(mode="after")
    def _ordered(self) -> AccelerometerSheet:
        if self.operating_c[0] >= self.operating_c[1]:
            raise ValueError(f"operating_c is {self.operating_c}; give the colder end first")
        return self


class AccelerometerRows(Strict):
    """The accelerometers of an INS, the rows of Paper A's Table 5."""

    bias_stability_ug: Positive
    bias_repeatability_ug: Positive
    scale_linearity_ppm: Positive
    scale_repeatability_ppm: Positive


class GyroRows(Strict):
    """The gyros of an INS, the rows of Paper A's Table 5."""

    bias_stability_deg_per_h: Positive
    bias_repeatability_deg_per_h: Positive
    scale_linearity_ppm: Positive
    scale_repeatability_ppm: Positive


class InsSheet(Strict):
    """An inertial navigation system."""

    kind: Literal["ins"]
    name: str
    accelerometer: AccelerometerRows
    gyro: GyroRows


class UnitGyroRows(Strict):
    """The gyros of an inertial unit; what its sheet does not say is None."""

    range_deg_per_s: Positive | None = None
    bias_repeatability_deg_per_h: Positive | None = None
    bias_instability_deg_per_h: Positive | None = None
    angle_random_walk_deg_per_sqrt_h: Positive | None = None
    scale_factor_ppm: Positive | None = None


class UnitAccelerometerRows(Strict):
    """The accelerometers of an inertial unit."""

    range_g: Positive | None = None
    bias_repeatability_ug: Positive | None = None
    bias_instability_ug: Positive | None = None
    velocity_random_walk_ug_per_sqrt_hz: Positive | None = None
    scale_factor_ppm: Positive | None = None


GRADES = ("consumer MEMS", "industrial MEMS", "tactical", "navigation")


class UnitSheet(Strict):
    """An inertial measurement unit in use, from the document `source`."""

    kind: Literal["imu"]
    name: str
    grade: Literal["consumer MEMS", "industrial MEMS", "tactical", "navigation"]
    source: str
    gyro: UnitGyroRows
    accelerometer: UnitAccelerometerRows


class Drift(NamedTuple):
    """How far a range of temperatures may take an accelerometer that nobody compensates."""

    span_c: float
    bias_ug: float
    scale_ppm: float


def worst_case_drift(sheet: AccelerometerSheet, cold_c: float = COLD_C, hot_c: float = HOT_C) -> Drift:
    """Temperature sensitivity times range, for bias and scale factor."""
    if not hot_c > cold_c:
        raise UsageError(f"worst case: from {cold_c:g} to {hot_c:g} degC; give the colder end first")
    span_c = hot_c - cold_c
    return Drift(span_c, sheet.bias_temperature_ug_per_c * span_c, sheet.scale_temperature_ppm_per_c * span_c)


def load(name: str) -> AccelerometerSheet | InsSheet | UnitSheet:
    """A shipped data sheet. Raises UsageError where there is none of that name."""
    path = FOLDER / f"{name}.toml"
    known = [sheet.stem for sheet in FOLDER.glob("*.toml")]
    if name not in known:
        raise UsageError(f"no data sheet '{name}'{did_you_mean(name, known)}")
    table = read_toml(path)
    kinds: dict[str, Any] = {"ins": InsSheet, "imu": UnitSheet}
    return parse(kinds.get(str(table.get("kind")), AccelerometerSheet), table, str(path))


@cache
def units() -> Mapping[str, UnitSheet]:
    """Every shipped sheet of an inertial unit by its name."""
    sheets = {path.stem: load(path.stem) for path in sorted(FOLDER.glob("*.toml"))}
    return {name: sheet for name, sheet in sheets.items() if isinstance(sheet, UnitSheet)}


def unit(name: str) -> UnitSheet:
    """The sheet of an inertial unit. Raises UsageError where there is none of that name."""
    found = units().get(name.lower())
    if found is None:
        raise UsageError(f"no inertial unit '{name}'{did_you_mean(name.lower(), units())}; see ins-eval presets")
    return found
