"""The flight of aged units: the same instruments on the same flights as fresh, with loop gains that have drifted.

The accelerometers are digital ones (Paper B), which can calibrate their feedback in place. Each instrument flies fresh,
drifted and self-calibrated; only the scale factors differ, so what ageing does follows from pairs. Where in the flight
a scale factor shows, `ensemble.response` says, without the errors of anything else.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import cosh, sqrt

import numpy as np

from ins_eval import ensemble, metrics
from ins_eval.earth import gravity, radii
from ins_eval.ensemble import Plan, World
from ins_eval.ensemble.ageing import Aged
from ins_eval.ensemble.response import Response, response
from ins_eval.imu import Mission
from ins_eval.metrics import Estimate, Ratio
from ins_eval.streams import Streams
from ins_eval.units import PPM

COMPENSATIONS = ("simple", "hysteresis_refined")
AGED = ("drifted", "self_calibrated")
STATES = ("fresh", *AGED)
SIZE = 40
MEASURES = ("velocity_rms_horizontal", "velocity_rms_down", "cep_rate_final")
STEPS = (("drifted", "fresh"), ("self_calibrated", "drifted"), ("self_calibrated", "fresh"))  # new against old
SHOWN_PPM = 100.0  # on one axis
FREE_S = 600.0  # after which a vertical channel without barometer is shown


@dataclass(frozen=True)
class Gains:
    """RMS over the units of drifts and of the error of the self-calibration."""

    feedback_ppm: float
    forward_ppm: float
    torquer_ppm: float
    current_ppm: float
    warmer_c: float
    estimate_error_ppm: float
    estimate_error_ppm_per_c: float


@dataclass(frozen=True)
class WholeFlight:
    """Horizontal velocity error by state, with the attitude found on the stand and given; their largest difference."""

    found: Mapping[str, float]
    given: Mapping[str, float]
    difference: Mapping[str, float]


@dataclass(frozen=True)
class Felt:
    """Horizontal velocity error of a phase, or what a manoeuvre feeds in, there also of `SHOWN_PPM` on each axis."""

    name: str
    from_s: float
    to_s: float
    drifted_mps: float
    self_calibrated_mps: float
    axes_mps: tuple[float, ...] = ()


@dataclass(frozen=True)
class VerticalChannel:
    """Errors of the damped channel; what the drift makes of gravity, how far a free one is off after `FREE_S`."""

    down_mps: float
    height_m: float
    felt_mps2: float
    free_height_m: float


@dataclass(frozen=True)
class Alone:
    """What scale-factor errors do alone, RMS over the instruments; manoeuvres have the largest first."""

    whole_mps: WholeFlight
    phases: tuple[Felt, ...]
    manoeuvres: tuple[Felt, ...]
    vertical: Mapping[str, VerticalChannel]


@dataclass(frozen=True)
class AgeingNumbers:
    """What ageing does, the branch ``storage`` of ``metrics.json``.

    scale_ppm       RMS of what ageing did to the scale factors of the instruments flown, by state
    compensations   estimates by compensation, state and measure
    change          ratios of one state to another ("new/old"), by compensation
    hysteresis      ratios of refined hysteresis to simple compensation, by state
    final_m         RMS distance of the last position from that of the same flight fresh, by compensation and state
    """

    years: float
    size: int
    gains: Gains
    scale_ppm: Mapping[str, float]
    compensations: Mapping[str, Mapping[str, Mapping[str, Estimate]]]
    change: Mapping[str, Mapping[str, Mapping[str, Ratio]]]
    hysteresis: Mapping[str, Mapping[str, Ratio]]
    final_m: Mapping[str, Mapping[str, float]]
    alone: Alone


def plans(fresh: Plan, size: int, units: Aged) -> dict[str, tuple[Plan, int]]:
    """The ensembles beside the `fresh` one, whose accelerometers have loops like those of `units`."""
    changed = {state: (("loop_gain.scale_ppm", tuple(getattr(units, f"{state}_ppm").tolist())),) for state in AGED}
    return {
        f"storage/{state}": (replace(fresh, arms=COMPENSATIONS, changes=fresh.changes + change), min(size, SIZE))
        for state, change in changed.items()
    }


def numbers(
    plans: Mapping[str, tuple[Plan, int]],
    members: Mapping[str, list[dict[str, dict[str, np.ndarray]]]],
    units: Aged,
) -> AgeingNumbers:
    """What ageing does, from the finished `members` of `plans`, the fresh ones under "all"."""
    size = plans["storage/drifted"][1]
    labels = {"fresh": "all", **{state: f"storage/{state}" for state in AGED}}
    flown = {state: ensemble.stacked(members[label][:size]) for state, label in labels.items()}
    arms = {f"{name}/{state}": flown[state][name] for name in COMPENSATIONS for state in STATES}
    simple, hysteresis = COMPENSATIONS
    pairs = [(f"{name}/{new}", f"{name}/{old}") for name in COMPENSATIONS for new, old in STEPS]
    pairs += [(f"{hysteresis}/{state}", f"{simple}/{state}") for state in STATES]
    compared = metrics.paired_bootstrap(
        arms,
        {measure: ensemble.STATISTICS[measure] for measure in MEASURES},
        pairs,
        Streams(plans["all"][0].seed).at("storage", "bootstrap").rng(),
    )

    def moved_m(name: str, state: str) -> float:
        track, fresh = (flown[s][name]["track_m"][:, -1] for s in (state, "fresh"))
        return _length_rms(track - fresh)

    worlds = {state: World(plans[labels[state]][0]) for state in AGED}
    scale_ppm = {state: _scale_ppm(world, size) for state, world in worlds.items()}
    arms, ratios = compared.arms, compared.ratios
    return AgeingNumbers(
        years=units.years,
        size=size,
        gains=_gains(units),
        scale_ppm={state: _rms(ppm) for state, ppm in scale_ppm.items()},
        compensations={n: {state: arms[f"{n}/{state}"] for state in STATES} for n in COMPENSATIONS},
        change={n: {f"{a}/{b}": ratios[f"{n}/{a}/{n}/{b}"] for a, b in STEPS} for n in COMPENSATIONS},
        hysteresis={state: ratios[f"{hysteresis}/{state}/{simple}/{state}"] for state in STATES},
        final_m={n: {state: moved_m(n, state) for state in AGED} for n in COMPENSATIONS},
        alone=alone(worlds["drifted"].flight, scale_ppm),
    )


def _gains(units: Aged) -> Gains:
    error_ppm = units.estimate_ppm - units.feedback_ppm
    of_temperature_ppm = error_ppm + units.current_ppm
    return Gains(
        _rms(units.feedback_ppm),
        _rms(units.forward_ppm),
        _rms(units.torquer_ppm),
        _rms(units.current_ppm),
        _rms(units.warmer_c),
        estimate_error_ppm=_rms(error_ppm),
        estimate_error_ppm_per_c=_rms(of_temperature_ppm) / _rms(units.warmer_c),
    )


def alone(mission: Mission, scale_ppm: Mapping[str, np.ndarray]) -> Alone:
    """What scale-factor errors (instruments, 3) in ppm, by state, do alone."""
    found, given = (response(mission, alignment) for alignment in ("found", "given"))
    difference = found.velocity - given.velocity
    return Alone(
        WholeFlight(
            {s: _length_rms(_horizontal(ppm, found.velocity)) for s, ppm in scale_ppm.items()},
            {s: _length_rms(_horizontal(ppm, given.velocity)) for s, ppm in scale_ppm.items()},
            {s: float(np.abs(_horizontal(ppm, difference)).max()) for s, ppm in scale_ppm.items()},
        ),
        _phases(mission, found, scale_ppm),
        _manoeuvres(mission, found, scale_ppm),
        {state: _vertical(mission, found, ppm) for state, ppm in scale_ppm.items()},
    )


def _phases(mission: Mission, found: Response, scale_ppm: Mapping[str, np.ndarray]) -> tuple[Felt, ...]:
    rows = []
    for phase in mission.profile.phase:
        inside = (found.time_s >= phase.from_s) & (found.time_s <= phase.to_s)
        felt = {f"{s}_mps": _length_rms(_horizontal(scale_ppm[s], found.velocity[:, inside])) for s in AGED}
        rows.append(Felt(phase.name, max(phase.from_s, 0.0), phase.to_s, **felt))
    return tuple(rows)


def _manoeuvres(mission: Mission, found: Response, scale_ppm: Mapping[str, np.ndarray]) -> tuple[Felt, ...]:
    rows = []
    for name, begin_s, end_s in _flown(mission):
        first, last = np.searchsorted(found.time_s, (begin_s, end_s))
        fed_in = found.fed_in[:, last] - found.fed_in[:, first]
        of_axes = SHOWN_PPM * np.hypot(fed_in[:, 0], fed_in[:, 1])
        felt = {f"{s}_mps": _length_rms(_horizontal(scale_ppm[s], fed_in)) for s in AGED}
        rows.append(Felt(name, begin_s, end_s, axes_mps=tuple(of_axes.tolist()), **felt))
    return tuple(sorted(rows, key=lambda row: -row.drifted_mps))


def _flown(mission: Mission) -> list[tuple[str, float, float]]:
    """Changes of speed and height, and turns: name, begin and end in s."""
    profile, rows = mission.profile, []
    for changes, key, before, unit, (up, down) in (
        (profile.speed, "to_mps", 0.0, "m/s", ("speeding up", "braking")),
        (profile.height, "to_m", profile.start.height_m, "m", ("climb", "descent")),
    ):
        for change in changes:
            value = getattr(change, key)
            rows.append((f"{up if value > before else down} to {value:g} {unit}", change.from_s, change.to_s))
            before = value
    for turn, (begin_s, end_s) in zip(profile.turn, mission.trajectory.turns_s.tolist(), strict=True):
        side = "right" if turn.by_deg > 0.0 else "left"
        rows.append((f"turn {side} by {abs(turn.by_deg):g} degrees", begin_s, end_s))
    return rows


def _vertical(mission: Mission, found: Response, scale_ppm: np.ndarray) -> VerticalChannel:
    """A free channel feels its own height error as k^2 h, k^2 = 2 g / R: h = a (cosh k t - 1) / k^2."""
    start = mission.start(0.0, aligned=False)
    g = gravity(start.latitude_rad, start.height_m)
    k = sqrt(2.0 * g / np.mean(radii(start.latitude_rad)))
    felt_mps2 = g * PPM * _rms(scale_ppm[:, 2])
    return VerticalChannel(
        _rms(np.tensordot(scale_ppm, found.velocity[..., 2], axes=1)),
        _rms(np.tensordot(scale_ppm, found.position[..., 2], axes=1)),
        felt_mps2,
        felt_mps2 * (cosh(k * FREE_S) - 1.0) / k**2,
    )


def _scale_ppm(world: World, size: int) -> np.ndarray:
    """What ageing did to the scale factors of the first `size` instruments, (size, 3) in ppm."""
    instruments = [world.instrument(index).accelerometers for index in range(size)]
    return np.array([[unit.units["loop_gain"] for unit in axes] for axes in instruments])


def _horizontal(scale_ppm: np.ndarray, per_ppm: np.ndarray) -> np.ndarray:
    """North and east (n, ..., 2) of scale-factor errors (n, 3), given what each ppm does (3, ..., 3)."""
    return np.tensordot(scale_ppm, per_ppm[..., :2], axes=1)


def _length_rms(vectors: np.ndarray) -> float:
    """RMS of the length of vectors (..., 2)."""
    return sqrt(2.0) * _rms(vectors)


def _rms(values: np.ndarray) -> float:
    return float(metrics.root_mean_square(np.ravel(values)))
