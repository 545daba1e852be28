"""Data sheets: what is printed of a device, and how far the temperature may take it in the worst case.

The simulation draws from populations (`accelerometer.Population`, `gyro.GyroPopulation`), which need more than a sheet
says; a sheet is held against them, not drawn from.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, NamedTuple

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


def load(name: str) -> AccelerometerSheet | InsSheet:
    """A shipped data sheet. Raises UsageError where there is none of that name."""
    path = FOLDER / f"{name}.toml"
    known = [sheet.stem for sheet in FOLDER.glob("*.toml")]
    if name not in known:
        raise UsageError(f"no data sheet '{name}'{did_you_mean(name, known)}")
    table = read_toml(path)
    return parse(InsSheet if table.get("kind") == "ins" else AccelerometerSheet, table, str(path))
