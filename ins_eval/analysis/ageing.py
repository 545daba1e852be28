"""The flight of aged units: the same instruments on the same flights as fresh, with loop gains that have drifted.

The accelerometers are digital ones (Paper B), which can calibrate their feedback in place. Each instrument flies fresh,
drifted and self-calibrated; only the scale factors differ, so what ageing does follows from pairs. Where in the flight
a scale factor shows, `ensemble.response` says, without the errors of anything else.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import cosh, sqrt
from typing import Any

import numpy as np

from ins_eval import ensemble, metrics
from ins_eval.earth import gravity, radii
from ins_eval.ensemble import Plan, World
from ins_eval.ensemble.ageing import Aged
from ins_eval.ensemble.changes import ATTITUDES
from ins_eval.ensemble.response import Response, response
from ins_eval.imu import Mission
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
) -> dict[str, Any]:
    """What ageing does, from the finished `members` of `plans`, the fresh ones under "all".

    An estimate is ``{"value", "interval95"}``, a ratio ``{"ratio", "interval95"}``.

    gains           RMS over `units` of drifts and of the error of the self-calibration, in ppm
    scale_ppm       RMS of what ageing did to the scale factors of the instruments flown
    compensations   estimates by compensation, state and measure
    change          ratios of one state to another, by compensation
    hysteresis      ratios of refined hysteresis to simple compensation, by state
    final_m         RMS distance of the last position from that of the same flight fresh, by compensation
    alone           see `alone`
    """
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

    def estimates(arm: str) -> dict[str, Any]:
        return {measure: estimate.as_tree() for measure, estimate in compared.arms[arm].items()}

    def ratios(new: str, old: str) -> dict[str, Any]:
        found = compared.ratios[f"{new}/{old}"]
        return {measure: {"ratio": r.ratio, "interval95": [r.low, r.high]} for measure, r in found.items()}

    def moved_m(name: str, state: str) -> float:
        track, fresh = (flown[s][name]["track_m"][:, -1] for s in (state, "fresh"))
        return _length_rms(track - fresh)

    worlds = {state: World(plans[labels[state]][0]) for state in AGED}
    scale_ppm = {state: _scale_ppm(world, size) for state, world in worlds.items()}
    return {
        "years": units.years,
        "size": size,
        "gains": _gains(units),
        "scale_ppm": {state: _rms(ppm) for state, ppm in scale_ppm.items()},
        "compensations": {n: {state: estimates(f"{n}/{state}") for state in STATES} for n in COMPENSATIONS},
        "change": {n: {f"{a}/{b}": ratios(f"{n}/{a}", f"{n}/{b}") for a, b in STEPS} for n in COMPENSATIONS},
        "hysteresis": {state: ratios(f"{hysteresis}/{state}", f"{simple}/{state}") for state in STATES},
        "final_m": {n: {state: moved_m(n, state) for state in AGED} for n in COMPENSATIONS},
        "alone": alone(worlds["drifted"].flight, scale_ppm),
    }


def _gains(units: Aged) -> dict[str, float]:
    error_ppm = units.estimate_ppm - units.feedback_ppm
    of_temperature_ppm = error_ppm + units.current_ppm
    kept = ("feedback_ppm", "forward_ppm", "torquer_ppm", "current_ppm", "warmer_c")
    return {
        **{key: _rms(getattr(units, key)) for key in kept},
        "estimate_error_ppm": _rms(error_ppm),
        "estimate_error_ppm_per_c": _rms(of_temperature_ppm) / _rms(units.warmer_c),
    }


def alone(mission: Mission, scale_ppm: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """What scale-factor errors (instruments, 3) in ppm do by themselves, by name; RMS over the instruments.

    whole_mps    horizontal velocity error over the flight, with the attitude found on the stand and given, and the
                 largest difference between the two
    phases       horizontal velocity error over each phase of the profile
    manoeuvres   what the accelerometers feed into the horizontal velocity from begin to end of each, the largest
                 first, and what `SHOWN_PPM` on one axis feed in
    vertical     velocity and height error of the damped channel; what the error makes of gravity, and how far a free
                 channel is off after `FREE_S`
    """
    of = {alignment: response(mission, alignment) for alignment in ATTITUDES}
    found, given = (of[alignment] for alignment in ATTITUDES)
    return {
        "whole_mps": {
            **{
                a: {s: _length_rms(_horizontal(ppm, r.velocity)) for s, ppm in scale_ppm.items()} for a, r in of.items()
            },
            "difference": {
                s: float(np.abs(_horizontal(ppm, found.velocity - given.velocity)).max())
                for s, ppm in scale_ppm.items()
            },
        },
        "phases": _phases(mission, found, scale_ppm),
        "manoeuvres": _manoeuvres(mission, found, scale_ppm),
        "vertical": {state: _vertical(mission, found, ppm) for state, ppm in scale_ppm.items()},
    }


def _phases(mission: Mission, found: Response, scale_ppm: Mapping[str, np.ndarray]) -> list[dict[str, Any]]:
    rows = []
    for phase in mission.profile.phase:
        inside = (found.time_s >= phase.from_s) & (found.time_s <= phase.to_s)
        felt = {f"{s}_mps": _length_rms(_horizontal(ppm, found.velocity[:, inside])) for s, ppm in scale_ppm.items()}
        rows.append({"name": phase.name, "from_s": max(phase.from_s, 0.0), "to_s": phase.to_s, **felt})
    return rows


def _manoeuvres(mission: Mission, found: Response, scale_ppm: Mapping[str, np.ndarray]) -> list[dict[str, Any]]:
    rows = []
    for name, begin_s, end_s in _flown(mission):
        first, last = np.searchsorted(found.time_s, (begin_s, end_s))
        fed_in = found.fed_in[:, last] - found.fed_in[:, first]
        of_axes = SHOWN_PPM * np.hypot(fed_in[:, 0], fed_in[:, 1])
        felt = {f"{s}_mps": _length_rms(_horizontal(ppm, fed_in)) for s, ppm in scale_ppm.items()}
        rows.append({"name": name, "from_s": begin_s, "to_s": end_s, **felt, "axes_mps": of_axes.tolist()})
    return sorted(rows, key=lambda row: -row["drifted_mps"])


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


def _vertical(mission: Mission, found: Response, scale_ppm: np.ndarray) -> dict[str, float]:
    """A free channel feels its own height error as k^2 h, k^2 = 2 g / R: h = a (cosh k t - 1) / k^2."""
    start = mission.start(0.0, aligned=False)
    g = gravity(start.latitude_rad, start.height_m)
    k = sqrt(2.0 * g / np.mean(radii(start.latitude_rad)))
    felt_mps2 = g * PPM * _rms(scale_ppm[:, 2])
    return {
        "down_mps": _rms(np.tensordot(scale_ppm, found.velocity[..., 2], axes=1)),
        "height_m": _rms(np.tensordot(scale_ppm, found.position[..., 2], axes=1)),
        "felt_mps2": felt_mps2,
        "free_height_m": felt_mps2 * (cosh(k * FREE_S) - 1.0) / k**2,
    }


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
