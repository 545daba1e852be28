"""The flight of a member: navigated once with each compensation, with the same errors in all of them."""

from __future__ import annotations

import numpy as np

from ins_eval import metrics
from ins_eval.compensation import SharedSamples
from ins_eval.ensemble.conditions import conditions
from ins_eval.ensemble.world import World, beginning
from ins_eval.navigation import compensate, evaluate, samples
from ins_eval.reference import bridge

TRACK_PERIOD_S = 60.0
MISSION = "mission"  # stands beside the arms of a member

# What the contributions of all members come to, by measure.
STATISTICS = {
    **{f"velocity_rms_{axis}": metrics.root_mean_square for axis in metrics.VelocityRms._fields},
    **{f"cep_rate_{key}": definition.statistic for key, definition in metrics.DEFINITIONS.items()},
}


def fly(world: World, index: int) -> dict[str, dict[str, np.ndarray]]:
    """One member: for each arm, what its flight contributes to every measure, and its track of position errors.

    Where each instrument flies a mission of its own, `MISSION` holds what that was like.
    """
    mission = world.mission(index)
    recording = mission.record(world.instrument(index), world.streams(index).at("flight"))
    seen, begin = tuple(samples(recording, SharedSamples)), beginning(mission, recording, world.alignment)
    interval_s, result = recording.interval_s, {}
    for arm, triad in world.triads(index).items():
        velocity = compensate(seen, triad, interval_s)
        flown = evaluate(recording, velocity, **begin)
        result[arm] = contributions(flown.errors)
    if world.missions is not None:
        result[MISSION] = conditions(mission, world.oven)
    return result


member = fly  # as `running` calls it in every experiment


def contributions(errors) -> dict[str, np.ndarray]:
    """What one flight contributes to the measures of an ensemble."""
    moving = errors.valid & (errors.time_s > 0.0)
    position_m, time_s = np.column_stack([errors.north_m, errors.east_m])[moving], errors.time_s[moving]
    rms = metrics.velocity_rms(errors.velocity_n, errors.valid)
    bridged = bridge(errors)
    radius_m = np.hypot(position_m[:, 0], position_m[:, 1])
    reductions = dict.fromkeys(d.per_flight for d in metrics.DEFINITIONS.values())  # several definitions share one
    reduced = {reduce: np.asarray(reduce(position_m, time_s)) for reduce in reductions}
    grid = np.searchsorted(bridged.time_s, np.arange(0.0, bridged.time_s[-1] + 0.5, TRACK_PERIOD_S) - 1e-6)
    return {
        **{f"velocity_rms_{axis}": np.asarray(value) for axis, value in rms._asdict().items()},
        **{f"cep_rate_{key}": reduced[d.per_flight] for key, d in metrics.DEFINITIONS.items()},
        "radial_rms_m": np.asarray(metrics.root_mean_square(radius_m)),
        "track_s": bridged.time_s[grid],
        "track_m": np.column_stack([bridged.north_m[grid], bridged.east_m[grid]]),
    }
