"""Many accelerometers through the procedure: what their estimates come to, and how large the shifts are.

A shift is the estimate less what was put in, in ppm; the paper's tables call |shift| / 200 ppm the residual. It comes
from nothing but the temperature coefficients of the parts and the warm-up, so it has either sign, and it is the same
whatever was put in.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ins_eval.digital_loop import bench
from ins_eval.digital_loop.injector import Injection
from ins_eval.digital_loop.model import Loop, load
from ins_eval.digital_loop.parameters import DEFAULT
from ins_eval.digital_loop.unit import Unit
from ins_eval.metrics import Estimate, central
from ins_eval.progress import progress
from ins_eval.streams import Streams

SIZE = 200
OTHER_REPETITIONS = 2  # of the injected sizes after the first
BOOTSTRAP = 2000
KEPT = (
    "temperature_c",
    "gain",
    "current_step",
    "forward_ppm",
    "feedback_ppm",
    "forward_true_ppm",
    "feedback_true_ppm",
    "forward_shift_ppm",
    "feedback_shift_ppm",
    "change_ug",
    "remaining_ug",
)
Member = dict[str, dict[str, np.ndarray]]


@dataclass(frozen=True)
class ProcedurePlan:
    """Everything that decides the numbers of a population, but for its size.

    `injected_ppm`: what is put in, -ppm in the forward and +ppm in the feedback gain; the paper's first.
    """

    preset: str = DEFAULT
    seed: int = 1
    injected_ppm: tuple[float, ...] = (200.0, 1000.0)


PLAN = ProcedurePlan()


def draw(streams: Streams, index: int, loop: Loop | None = None) -> Unit:
    """Accelerometer number `index` of the population that `loop` (by default the preset's) describes."""
    loop = loop or load()
    node, parameters = streams.at("unit", index), loop.parameters

    def drawn(quantity: str, part: str, mean: float, sigma: float) -> float:
        return mean + sigma * node.at(quantity, part).rng().standard_normal()

    means, sigmas = parameters.temperature_coefficient, parameters.temperature_coefficient_sigma
    return Unit(
        loop,
        {part: drawn("temperature", part, mean.value, getattr(sigmas, part).value) for part, mean in means},
        {part: drawn("ageing", part, 0.0, sigma.value) for part, sigma in parameters.ageing_sigma},
    )


def run(plan: ProcedurePlan = PLAN, size: int = SIZE, workers: int | None = None, quiet: bool = True) -> list[Member]:
    """All members in order of their numbers; the number of `workers` (threads, None: all cores) changes no digit."""
    return of_each(partial(member, plan), size, workers, quiet, "accelerometers")


def of_each(found: Callable[[int], Any], size: int, workers: int | None, quiet: bool, words: str) -> list:
    """What `found` gives for each number below `size`, in their order; `workers` (threads) change no digit."""
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        done = pool.map(found, range(size))
        try:
            kept = []
            with progress(size, words, quiet) as bar:
                for one in done:
                    kept.append(one)
                    bar.update()
            return kept
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def member(plan: ProcedurePlan, index: int) -> Member:
    """One accelerometer: ``[injected ppm][key]`` with the repetitions (r,) of `bench.Procedure`, keys as in `KEPT`.

    The sizes after the first are put into the first repetitions again, at the same temperatures and with the same
    noise, so that they can be compared pair by pair.
    """
    streams = Streams(plan.seed).at("digital loop")
    unit, node = draw(streams, index, load(plan.preset)), streams.at("unit", index, "bench")
    temperature_c = bench.temperatures(unit.loop, node)
    found = {}
    for number, size in enumerate(plan.injected_ppm):
        at_c = temperature_c[:, :OTHER_REPETITIONS] if number else temperature_c
        done = bench.procedure(unit, node, Injection(-size, size), at_c)
        found[f"{size:g}"] = {key: getattr(done, key) for key in KEPT}
    return found


def per_unit(members: Sequence[Member], injected_ppm: float) -> dict[str, np.ndarray]:
    """Means over the repetitions (units,) by key of `KEPT`, (units, 2) where it has reference and test."""
    return {key: np.stack([one[f"{injected_ppm:g}"][key].mean(axis=-1) for one in members]) for key in KEPT}


def summary(members: Sequence[Member], seed: int) -> dict[str, Any]:
    """What the members come to; an estimate is ``{"value", "interval95"}``.

    Of single units, median and central 95 %: ``forward_shift_ppm``, ``feedback_shift_ppm``, ``change_ug``,
    ``remaining_ug``, ``forward_error_ppm`` and ``feedback_error_ppm`` (estimate less what the gain did change),
    ``forward_residual_percent``, ``feedback_residual_percent``, ``removed_percent``,
    ``forward_scatter_ppm`` and ``feedback_scatter_ppm`` between repetitions, ``warm_up_c``,
    ``closure_ug``: what remains less (change + feedback estimate), the paper's 24 = -193 + 218.

    Means with bootstrap intervals over units: ``mean_forward_shift_ppm``, ``mean_feedback_shift_ppm``,
    ``forward_share_positive``, ``feedback_share_positive``, and ``shift_grows_ppm``: by how much the shift changes, in
    the same tests, when the other size is put in.
    """
    sizes = [float(size) for size in members[0]]
    found = per_unit(members, sizes[0])
    node = Streams(seed).at("digital loop", "bootstrap")
    share = {channel: np.abs(found[f"{channel}_shift_ppm"]) / sizes[0] for channel in ("forward", "feedback")}
    of_units = {
        **{key: found[key] for key in ("forward_shift_ppm", "feedback_shift_ppm", "change_ug", "remaining_ug")},
        **{f"{c}_error_ppm": found[f"{c}_ppm"] - found[f"{c}_true_ppm"] for c in share},
        **{f"{c}_residual_percent": 100.0 * values for c, values in share.items()},
        **{
            f"{c}_scatter_ppm": np.array([m[f"{sizes[0]:g}"][f"{c}_shift_ppm"].std(ddof=1) for m in members])
            for c in share
        },
        "removed_percent": 100.0 * (1.0 - np.abs(found["remaining_ug"] / found["change_ug"])),
        "closure_ug": found["remaining_ug"] - (found["change_ug"] + found["feedback_ppm"]),
        "warm_up_c": found["temperature_c"][:, 1] - found["temperature_c"][:, 0],
    }
    result: dict[str, Any] = {"units": len(members), "injected_ppm": sizes}
    result |= {key: central(values).as_tree() for key, values in of_units.items()}
    for channel in share:
        shift = found[f"{channel}_shift_ppm"]
        result[f"mean_{channel}_shift_ppm"] = _mean(shift, node.at(channel))
        result[f"{channel}_share_positive"] = _mean((shift > 0.0).astype(float), node.at(channel, "positive"))
    result["shift_grows_ppm"] = {
        f"{size:g}": {
            channel: _mean(_growth(members, channel, sizes[0], size), node.at(channel, f"{size:g}"))
            for channel in share
        }
        for size in sizes[1:]
    }
    return result


def _growth(members: Sequence[Member], channel: str, first: float, other: float) -> np.ndarray:
    """By how much the shift (units,) differs with the other size put in, over the same repetitions."""
    key = f"{channel}_shift_ppm"
    return np.array([(m[f"{other:g}"][key] - m[f"{first:g}"][key][:OTHER_REPETITIONS]).mean() for m in members])


def _mean(values: np.ndarray, streams: Streams) -> dict[str, Any]:
    chosen = streams.rng().integers(values.size, size=(BOOTSTRAP, values.size))
    low, high = np.quantile(values[chosen].mean(axis=1), (0.025, 0.975))
    return Estimate(float(values.mean()), float(low), float(high)).as_tree()
