"""What is believed of an instrument and of the simulation: the tables of ``recording.toml`` that are not data.

A key that is absent has the default stated here; None is unknown and is found from the recording and from data sheets
(`ins_eval.believed`). Keys that are not known are kept. Units are in the names.
The form `ins-recording/1`: docs/recording.md.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator, model_validator

from ins_eval.limits import SMALLEST_DIVISOR, allowed
from ins_eval.scale_factor import TERMS
from ins_eval.units import STANDARD_GRAVITY

Vector = tuple[float, float, float]
NotNegative = Annotated[float, Field(ge=0.0)]
ZERO: Vector = (0.0, 0.0, 0.0)
POSITION_SIGMA_M, VELOCITY_SIGMA_MPS = 2.5, 0.05  # of a single-frequency receiver: its slow error shows in no spread
SHOWN_KEYS = {  # of the tables whose values have sources
    "gyro": ("bias_radps", "bias_sigma_deg_per_h", "angle_random_walk_deg_per_sqrt_h"),
    "accelerometer": ("bias_mps2", "bias_sigma_ug", "velocity_random_walk_ug_per_sqrt_hz"),
    "gps": ("lever_arm_m", "time_offset_s", "position_sigma_m", "velocity_sigma_mps"),
}
UNSTATED = "not stated, taken as 0"
UNSTATED_DENSITY_UG = 5.0  # per root Hz: velocity random walk where none is stated; by reasoning


def clauses(source: str | None) -> dict[str, str]:
    """The sources of single keys that a ``source`` names: ``KEY: SOURCE; KEY: SOURCE``."""
    return dict(clause.split(": ", 1) for clause in (source or "").split("; ") if ": " in clause)


class FormTable(BaseModel):
    """A table of the form: extra keys are allowed and kept, numbers lie within `limits`, texts are not endless."""

    model_config = ConfigDict(extra="allow", frozen=True, allow_inf_nan=False, defer_build=True)

    @field_validator("*")
    @classmethod
    def _within_limits(cls, value: object, info: ValidationInfo) -> object:
        allowed(str(info.field_name), value)
        return value


class GpsBelief(FormTable):
    """The receiver: where its antenna is, what its stamps mean, how well it measures."""

    lever_arm_m: Vector = ZERO  # IMU to antenna, body axes
    time_offset_s: float = 0.0  # stamp minus IMU stamp of the same instant
    position_sigma_m: NotNegative | None = None
    velocity_sigma_mps: NotNegative | None = None
    source: str | None = None  # where these values come from


class ReferenceBelief(GpsBelief):
    """A better navigator, seen as a receiver whose antenna is the navigator itself."""

    position_sigma_m: NotNegative = 0.0
    velocity_sigma_mps: NotNegative = 0.0


class SolutionBelief(FormTable):
    """What an INS put out itself."""

    time_offset_s: float = 0.0  # stamp minus the IMU's (without IMU: GPS and reference's) time of the same instant
    name: str | None = None  # of the INS


class HeightBelief(FormTable):
    """What steadies the vertical channel; `sigma_m` is its slow error."""

    source: Literal["baro", "gps", "none"] = "baro"
    sigma_m: NotNegative = 2.0


class EarthBelief(FormTable):
    """What the navigation equations contain."""

    rotation: bool = True
    coriolis: bool = True
    transport_rate: bool = True
    gravity_height: bool = True
    gravity_latitude: bool = True


class GyroBelief(FormTable):
    """The gyros."""

    bias_radps: Vector | None = None
    bias_sigma_deg_per_h: NotNegative | None = None
    angle_random_walk_deg_per_sqrt_h: NotNegative | None = None
    source: str | None = None


class ScaleBelief(FormTable):
    """Eq. (11) of Paper A: pulse/(g s), degC, degC/min."""

    alpha: float = 0.0
    beta: float = 0.0
    eta: float = 0.0
    epsilon: float = 0.0
    mu: float = 0.0
    gamma: Annotated[float, Field(ge=SMALLEST_DIVISOR)]

    @property
    def coefficients(self) -> np.ndarray:
        """In the order of `scale_factor.TERMS`, (6,)."""
        return np.array([getattr(self, term) for term in TERMS])


class BiasBelief(FormTable):
    """Eq. (4) of Paper A: K0 = k0 + omega (T - T0)."""

    k0_ug: float = 0.0
    omega_ug_per_c: float = 0.0


class AxisBelief(FormTable):
    """One accelerometer whose output is in pulses: scale and bias, or the file of a compensation model."""

    scale: ScaleBelief | None = None
    bias: BiasBelief = BiasBelief()
    compensation: str | None = None  # path, relative to the folder of the recording

    @model_validator(mode="after")
    def _one_of_both(self) -> AxisBelief:
        if (self.scale is None) == (self.compensation is None):
            raise ValueError("give either scale (and bias) or compensation")
        return self


class AccelerometerBelief(FormTable):
    """The accelerometers."""

    reference_temperature_c: float = 22.0
    rate_filter_s: Annotated[float, Field(gt=0.0)] = 180.0
    bias_sigma_ug: NotNegative | None = None
    bias_mps2: Vector | None = None  # of columns in increments or rates
    velocity_random_walk_ug_per_sqrt_hz: NotNegative | None = None
    source: str | None = None
    x: AxisBelief | None = None
    y: AxisBelief | None = None
    z: AxisBelief | None = None

    @property
    def mps_per_pulse(self) -> np.ndarray | None:
        """What a pulse of x, y and z is at the believed scales, (3,) in m/s; None where one has no scale."""
        scales = [axis.scale.gamma if axis and axis.scale else None for axis in (self.x, self.y, self.z)]
        return None if None in scales else STANDARD_GRAVITY / np.array(scales)


class EffectBelief(FormTable):
    """An effect that the instrument is believed to have, by its name in docs/effects.md.

    `value` is true minus believed in what is indicated, in `unit`. It belongs to all recordings of the instrument, or
    to the one whose name is `recording`. What the names mean is in `ins_eval.effects`.
    """

    name: str
    axis: Literal["x", "y", "z", "north", "east", "down"] | None = None
    value: float
    unit: str | None = None  # None: that of the vocabulary
    root: tuple[float, ...] | None = None  # row of a root L of the covariance L L' of all values; None: exact
    recording: str | None = None
    other_axis: Literal["x", "y", "z"] | None = None
    time_constant_s: Annotated[float, Field(gt=0.0)] | None = None
    branch_width_c: Annotated[float, Field(gt=0.0)] | None = None
    branch_begin: Annotated[float, Field(ge=-1.0, le=1.0)] | None = None  # None: the branch that it follows first
    rate_filter_s: Annotated[float, Field(gt=0.0)] | None = None  # None: that of the accelerometers
    at_s: float | None = None
    driver: str | None = None
    form: str | None = None
    sensor: Literal["gyro", "accelerometer"] | None = None
    unit_found: str | None = None
    frame_found: str | None = None


class Belief(FormTable):
    """All that a recording believes."""

    gps: GpsBelief = GpsBelief()
    reference: ReferenceBelief = ReferenceBelief()
    solution: SolutionBelief = SolutionBelief()
    height: HeightBelief = HeightBelief()
    earth: EarthBelief = EarthBelief()
    gyro: GyroBelief = GyroBelief()
    accelerometer: AccelerometerBelief = AccelerometerBelief()
    effects: tuple[EffectBelief, ...] = ()


NAVIGATION_GRADE = Belief(
    gps=GpsBelief(position_sigma_m=2.5, velocity_sigma_mps=0.05),
    gyro=GyroBelief(bias_radps=ZERO, bias_sigma_deg_per_h=0.014, angle_random_walk_deg_per_sqrt_h=0.001),
    accelerometer=AccelerometerBelief(bias_sigma_ug=50.0, bias_mps2=ZERO),
)  # what the simulator states of its own instruments: Paper A, Table 5, and a single-frequency receiver
