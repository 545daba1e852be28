"""What a calibration found, in numbers: each class is a table of ``metrics.json``, its fields the keys.

None: the readings do not tell. Specific force at a position of the chamber goes by "+1", "+0" and "-1" (g).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from ins_eval.calibration import Coefficient
from ins_eval.calibration.labelings import Printed


@dataclass(frozen=True)
class ScaleFit:
    """Terms of the scale factor, and what measured K1 over that of the model leaves."""

    terms: tuple[Coefficient, ...]
    residual_rms_ppm: float | None
    sensitivity_ppm_per_c: float | None


@dataclass(frozen=True)
class BiasFit:
    """Terms of the bias, and what measured less that of the model leaves."""

    terms: tuple[Coefficient, ...]
    residual_rms_ug: float | None


@dataclass(frozen=True)
class FittedModel:
    """A model with what 95 % of compensated readings of a new run stay within, by position."""

    scale: ScaleFit
    bias: BiasFit
    remarks: tuple[str, ...]
    new_run_ug: Mapping[str, float] | None


@dataclass(frozen=True)
class NotDetermined:
    """Why the readings leave a model open."""

    reason: str


@dataclass(frozen=True)
class NewReading:
    """95 % intervals in ug of a compensated reading in a run to come, by position."""

    temperature_c: float
    direction: Literal["falling", "rising"]
    rate_c_per_min: float
    within_ug: Mapping[str, tuple[float, float]]

    def as_tree(self) -> dict[str, Any]:
        """A row of ``new_run`` of ``metrics.json``."""
        at = {"temperature_c": self.temperature_c, "direction": self.direction, "rate_c_per_min": self.rate_c_per_min}
        return at | {position: list(ends) for position, ends in self.within_ug.items()}


@dataclass(frozen=True)
class ChamberFacts:
    """What was recorded in the chamber."""

    folder: str
    readings: int
    runs: int
    ramps_c_per_min: tuple[float, ...]
    temperature_c: tuple[float, float]
    further: tuple[str, ...]


@dataclass(frozen=True)
class Determined:
    """What the readings determine, see `calibration.identifiability`; `rate_seen_c_per_min` is the largest for long."""

    rank: int
    steady_rank: int
    terms: int
    condition: float | None
    words: str
    hysteresis: bool
    directions: tuple[Literal["falling", "rising"], ...]
    mean_rates_c_per_min: tuple[float, ...]
    rate_seen_c_per_min: float


@dataclass(frozen=True)
class AccelerometerNumbers:
    """One accelerometer; `printed` are the paper's equations by how the angles are labelled."""

    name: str
    axis: str
    recording: ChamberFacts
    determined: Determined
    sensitivity_ppm_per_c: float | None
    models: Mapping[str, FittedModel | NotDetermined]
    new_run: tuple[NewReading, ...]
    printed: Mapping[str, Printed]

    @property
    def fitted(self) -> dict[str, FittedModel]:
        """The models that the readings determine."""
        return {name: model for name, model in self.models.items() if isinstance(model, FittedModel)}


@dataclass(frozen=True)
class ChosenModel:
    """The model for the compensation file: what was asked for (None: the best), and the file that was written."""

    model: str
    asked: str | None
    file: str | None


@dataclass(frozen=True)
class CalibrationNumbers:
    """The tree ``ins-eval-calibration/1``."""

    compensation: ChosenModel
    accelerometers: tuple[AccelerometerNumbers, ...]
    format: str = "ins-eval-calibration/1"
