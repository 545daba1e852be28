"""What the evaluation of a recording found, in numbers: each class is a table of ``metrics.json``, its fields the keys.

What a recording does not have is left out of the file (see `tree.as_tree`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from ins_eval.analysis.schuler import SchulerFit
from ins_eval.believed import BeliefRow
from ins_eval.grade import Grade
from ins_eval.metrics import Estimate
from ins_eval.navigation import Measures
from ins_eval.restarts import Restarts

LOST_MPS = 100.0  # horizontal velocity RMS beyond which a pure-inertial solution means nothing


@dataclass(frozen=True)
class RecordingFacts:
    """What was recorded; `filled_samples` are increments that rest on samples on straight lines, where none were."""

    name: str
    kind: str
    duration_s: float
    notes: tuple[str, ...]
    rate_hz: float | None = None
    filled_samples: int | None = None


@dataclass(frozen=True)
class ClockOffset:
    """Offset of the clock of GPS or reference, and the velocity errors that remain with it; None: `reason` says why."""

    believed_s: float
    found_s: float | None
    reason: str | None = None
    interval95_s: tuple[float, float] | None = None
    velocity_constant_mps: Mapping[str, Estimate] = field(default_factory=dict)


@dataclass(frozen=True)
class Untold:
    """Why something was not found."""

    reason: str


@dataclass(frozen=True)
class SolutionNumbers:
    """Errors of a solution, with intervals that allow for their correlation in time; empty where it has none."""

    name: str | None
    reference: Literal["ins", "gps", "standstill"]
    epochs: int
    start_s: float
    end_s: float
    notes: tuple[str, ...]
    clock: ClockOffset
    schuler: SchulerFit | Untold
    velocity_rms_mps: Mapping[str, Estimate] = field(default_factory=dict)
    velocity_mean_mps: Mapping[str, Estimate] = field(default_factory=dict)
    final_radial_error_m: float | None = None
    radial_error_rate_nmi_per_h: Mapping[str, float] = field(default_factory=dict)

    @property
    def span_s(self) -> float:
        """From the start to the last epoch that was compared."""
        return self.end_s - self.start_s


@dataclass(frozen=True, kw_only=True)
class StartAttitude:
    """The attitude with which navigation began; `stretch_s` is the standstill it was aligned on, if it was."""

    roll_deg: float
    pitch_deg: float
    heading_deg: float
    heading_sigma_deg: float | None = None
    stretch_s: tuple[float, float] | None = None
    documented_heading_deg: float | None = None


@dataclass(frozen=True, kw_only=True)
class FoundStart(StartAttitude):
    """A start that nobody stated, found by least squares, with one sigma of everything."""

    window_s: tuple[float, float]
    roll_pitch_sigma_deg: float
    heading_known: bool
    rival_headings_deg: tuple[float, ...]
    velocity_sigma_mps: tuple[float, ...]
    position_sigma_m: tuple[float, ...]
    gyro_bias_deg_per_h: tuple[float, ...]
    gyro_bias_sigma_deg_per_h: tuple[float, ...]
    accelerometer_bias_ug: tuple[float, ...]
    accelerometer_bias_sigma_ug: tuple[float, ...]
    gyro_scale_ppm: tuple[float, ...]
    gyro_scale_sigma_ppm: tuple[float, ...]
    accelerometer_scale_ppm: tuple[float, ...]
    accelerometer_scale_sigma_ppm: tuple[float, ...]
    fix_scale: tuple[float, float]


@dataclass(frozen=True)
class NavigatedSpan:
    """When navigation began and ended, and what steadied the vertical channel."""

    start_s: float
    end_s: float
    vertical: str

    @property
    def duration_s(self) -> float:
        return self.end_s - self.start_s


@dataclass(frozen=True)
class NumericFloor:
    """What navigation alone makes of an IMU without errors."""

    rate_hz: float
    profile: str
    horizontal_m: float
    velocity_mps: float


@dataclass(frozen=True)
class ComparedWith:
    """What the solution was compared with; times count from the start of navigation."""

    kind: Literal["ins", "gps", "standstill", "attitude"]
    epochs: int
    attitude_epochs: int
    outages: int
    outage_s: float
    first_s: float
    last_s: float


@dataclass(frozen=True)
class EvaluationNumbers:
    """The tree ``ins-eval-evaluation/1``; `compensations` and `restarts` are by compensation."""

    recording: RecordingFacts
    belief: tuple[BeliefRow, ...]
    grade: Grade | None
    alignment: StartAttitude
    navigation: NavigatedSpan
    compensations: Mapping[str, Measures]
    floor: NumericFloor
    reference: ComparedWith
    solution: SolutionNumbers | None = None
    restarts: Mapping[str, Restarts] = field(default_factory=dict)
    format: str = "ins-eval-evaluation/1"
