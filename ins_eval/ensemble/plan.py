"""What decides the numbers of an ensemble."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np

from ins_eval import accelerometer
from ins_eval.compensation.registry import model_files
from ins_eval.ensemble.changes import Change
from ins_eval.errors import UsageError, did_you_mean
from ins_eval.missions import Missions
from ins_eval.parallel import code_digest
from ins_eval.profile import load

ARMS = (
    "none",
    "simple",
    "simple_anchored",
    "quadratic",
    "hysteresis",
    "simple_refined",
    "hysteresis_refined",
    "hysteresis_scale_only",
    "hysteresis_bias_only",
    "hysteresis_without_rate",
    "hysteresis_blind",
    "hysteresis_piecewise_scale",
)
RATE_HZ = 10.0
OVEN_RATE_HZ = 1.0

Experiment = Literal["flight", "oven", "chamber", "linear"]
EXPERIMENTS: tuple[Experiment, ...] = get_args(Experiment)
BLOCK = 80  # instruments of one member of a linear ensemble on the flight of all


class ErrorSource(NamedTuple):
    """A source of the error budget: the effects of the accelerometers that stay on, whether the gyros err, changes."""

    effects: tuple[str, ...]
    gyros: bool = False
    changes: tuple[Change, ...] = ()


_THERMAL = ("thermal_lag", "bias_temperature", "creep")
SOURCES: dict[str, ErrorSource] = {
    "accelerometer_bias_thermal": ErrorSource(_THERMAL),
    # the IMU of Paper A has one temperature; with the spread of the missions it has not
    "accelerometer_bias_thermal_with_gradient": ErrorSource(_THERMAL, changes=(("gradient", 0.02),)),
    "accelerometer_bias_of_the_run": ErrorSource(("turn_on", "in_run", "noise")),
    "accelerometer_scale_factor": ErrorSource(
        ("scale_polynomial", "magnet_hysteresis", "scale_repeatability", "nonlinearity", "loop_gain")
    ),
    # what Paper A neglects in eq. (1); assumed: K3 10 ug/g^3, Kip and Kio as large as K2, 10 seconds of arc
    "accelerometer_cross_terms": ErrorSource(
        ("nonlinearity",),
        changes=(
            ("nonlinearity.k2_sigma_ug_per_g2", 0.0),
            ("nonlinearity.k3_sigma_ug_per_g3", 10.0),
            ("nonlinearity.kip_sigma_ug_per_g2", 30.0),
            ("nonlinearity.kio_sigma_ug_per_g2", 30.0),
            ("nonlinearity.delta_o_sigma_urad", 50.0),
            ("nonlinearity.delta_p_sigma_urad", 50.0),
        ),
    ),
    "gyro": ErrorSource((), gyros=True),
}


@dataclass(frozen=True)
class Plan:
    """Everything that decides the numbers of an ensemble, but for its size."""

    profile: str = "climb-cruise-landing"
    population: str = "jb-kt8"
    arms: tuple[str, ...] = ARMS
    seed: int = 1
    rate_hz: float = RATE_HZ
    oven_runs: int = 1
    source: str | None = None  # one of SOURCES: all others are switched off
    experiment: Experiment = "flight"
    changes: tuple[Change, ...] = ()  # one-factor changes, see `changes`
    oven: str | None = None  # the profile whose temperatures the oven repeats; None: that of the flight
    missions: str | None = None  # each instrument flies a mission of its own; the oven keeps to the profile
    missions_off: tuple[str, ...] = ()  # sources of difference between missions that are switched off

    def __post_init__(self) -> None:
        for name, value, known in (("experiment", self.experiment, EXPERIMENTS), ("source", self.source, SOURCES)):
            if value is not None and value not in known:
                raise UsageError(f"plan: no {name} '{value}'{did_you_mean(value, known)}")

    @property
    def together(self) -> int:
        """How many instruments one member holds."""
        return BLOCK if self.experiment == "linear" and self.missions is None else 1

    def key(self) -> str:
        """Name of the results of this plan: changes with the plan, the profile, the models and the code."""
        digest = hashlib.sha256(json.dumps(asdict(self), sort_keys=True).encode())
        for name in (self.profile, self.oven):
            if name is not None:
                profile = load(name)
                for said in (profile, *([load(profile.thermal.same_as)] if profile.thermal.same_as else [])):
                    digest.update(said.model_dump_json().encode())
        if self.missions is not None:
            digest.update(repr(Missions.load(self.missions)).encode())
        digest.update(repr(accelerometer.Population.load(self.population)).encode())
        digest.update(np.__version__.encode())
        digest.update(code_digest().encode())
        for path in model_files(self.arms):
            digest.update(path.read_bytes())
        return digest.hexdigest()[:16]
