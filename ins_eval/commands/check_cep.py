"""``ins-eval check-cep``: the gate that the improvement of the CEP still holds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import log
from pathlib import Path
from typing import Annotated

from pydantic import Field

from ins_eval import ensemble, metrics
from ins_eval.ensemble import Plan
from ins_eval.errors import GateNotMet
from ins_eval.metrics import Ratio
from ins_eval.storage import write_whole
from ins_eval.streams import Streams
from ins_eval.tables import Strict, parse, read_toml

SIMPLE, HYSTERESIS = "simple", "hysteresis_refined"  # as Paper A compares them: the refinement is hysteresis's alone
MIRRORED = f"2 {SIMPLE} - {HYSTERESIS}"
MEASURES = {
    "cep_rate_final": "CEP rate (final, median over instruments)",
    "velocity_rms_horizontal": "horizontal velocity RMS (RMS over instruments of the RMS of a flight)",
}
HELD_SHARE = 0.5  # of the committed gain
POWER = 0.995  # of all conditions together
COMMIT_SIZE = 3000


class Gain(Strict):
    """A ratio hysteresis to simple, and the standard deviation of its logarithm over ensembles of the stated size."""

    ratio: Annotated[float, Field(gt=0.0, lt=1.0)]
    log_sd: Annotated[float, Field(gt=0.0)]


class Committed(Strict):
    """The gains that the gate holds, found with so many instruments."""

    size: Annotated[int, Field(ge=2)]
    seed: int
    cep_rate_final: Gain
    velocity_rms_horizontal: Gain

    def gain(self, measure: str) -> Gain:
        """The committed gain in one of `MEASURES`."""
        return getattr(self, measure)


def run(
    output: Path,
    committed_file: Path,
    profile: str,
    seed: int,
    workers: int | None,
    quiet: bool,
    size: int | None = None,
    commit: bool = False,
) -> int:
    """Run the ensemble, print each bound and each control, raise GateNotMet where one does not hold.

    With `commit` the gains found are written to `committed_file` instead of being held against it.
    """
    if commit:
        size = size or COMMIT_SIZE
        return _commit(committed_file, _ratios(output, profile, seed, workers, quiet, size), size, seed)
    committed = parse(Committed, read_toml(committed_file), str(committed_file))
    needed = max(_size(committed.gain(measure), committed.size) for measure in MEASURES)
    size = size or needed
    ratios = _ratios(output, profile, seed, workers, quiet, size)
    gate = ratios[f"{HYSTERESIS}/{SIMPLE}"]

    say = (lambda text: None) if quiet else print
    say(f"gate: {HYSTERESIS} (chamber calibration, one oven refinement) against {SIMPLE} (chamber calibration),")
    say(f"      as Paper A compares them; {size} paired instruments, seed {seed};")
    say(f"      {needed} give all conditions together a power of {100 * POWER:g} % at the committed gains")
    for measure, words in MEASURES.items():
        least = 100.0 * HELD_SHARE * (1.0 - committed.gain(measure).ratio)
        say(f"  {words}:")
        say(f"    {_in_words(gate[measure])}; gain {100 * (1 - gate[measure].ratio):.1f} %, {least:.1f} % needed")
    failures = _shortfalls(gate, committed) + _controls(ratios, committed, say)
    if failures:
        raise GateNotMet(f"check-cep: {'; '.join(failures)}; look at what changed flight, models or calibration")
    say("gate: met")
    return 0


def _shortfalls(ratios: Mapping[str, Ratio], committed: Committed) -> list[str]:
    """The gate itself: both upper bounds below 1, and no gain below half of the committed one."""
    failures = []
    for measure, words in MEASURES.items():
        r, least = ratios[measure], HELD_SHARE * (1.0 - committed.gain(measure).ratio)
        if r.high >= 1.0:
            failures.append(f"the upper bound of the {words} is {r.high:.3f}, expected below 1")
        if 1.0 - r.ratio < least:
            failures.append(
                f"the gain in {words} is {100 * (1 - r.ratio):.1f} %, expected at least half of the committed "
                f"{100 * least / HELD_SHARE:.1f} %"
            )
    return failures


def _controls(
    ratios: Mapping[str, Mapping[str, Ratio]], committed: Committed, say: Callable[[str], object]
) -> list[str]:
    """The gate must fail a model as much worse as hysteresis is better, and see nothing where nothing differs."""
    failures = []
    mirrored, same = ratios[f"{MIRRORED}/{SIMPLE}"], ratios[f"{SIMPLE}/{SIMPLE}"]
    say(f"  control '{MIRRORED}', which must fail:")
    for measure, r in mirrored.items():
        say(f"    {measure}: {_in_words(r)}")
    if not _shortfalls(mirrored, committed):
        failures.append(f"the control '{MIRRORED}' passed, so the gate proves nothing")
    say(f"  control '{SIMPLE}' against itself, which must be exactly 1:")
    for measure, r in same.items():
        say(f"    {measure}: {r.ratio!r}, interval {r.low!r} to {r.high!r}")
    if any((r.ratio, r.low, r.high) != (1.0, 1.0, 1.0) for r in same.values()):
        failures.append(f"'{SIMPLE}' against itself is not exactly 1, so the pairs are not paired")
    return failures


def _in_words(r: Ratio) -> str:
    return f"ratio {r.ratio:.3f}, 95 % interval {r.low:.3f} to {r.high:.3f}"


def _size(gain: Gain, n: int) -> int:
    """Instruments with which the conditions on a measure hold with the power asked for, at the committed gain."""
    each = 1.0 - (1.0 - POWER) / (2 * len(MEASURES))
    log_ratio = log(gain.ratio)
    room = log(1.0 - HELD_SHARE * (1.0 - gain.ratio)) - log_ratio  # between the gain and half of it
    return max(
        metrics.power_size(log_ratio, gain.log_sd, n, power=each),
        metrics.power_size(-room, gain.log_sd, n, confidence=0.0, power=each),
    )


def _ratios(
    output: Path, profile: str, seed: int, workers: int | None, quiet: bool, size: int
) -> dict[str, dict[str, Ratio]]:
    plan = Plan(profile=profile, arms=(SIMPLE, HYSTERESIS, MIRRORED), seed=seed)
    arms = ensemble.stacked(ensemble.run({"gate": (plan, size)}, output / "members", workers, quiet)["gate"])
    statistics = {measure: ensemble.STATISTICS[measure] for measure in MEASURES}
    pairs = [(HYSTERESIS, SIMPLE), (MIRRORED, SIMPLE), (SIMPLE, SIMPLE)]
    return metrics.paired_bootstrap(arms, statistics, pairs, Streams(seed).at("gate").rng()).ratios


def _commit(path: Path, ratios: Mapping[str, Mapping[str, Ratio]], size: int, seed: int) -> int:
    lines = [
        f"# Gains of {HYSTERESIS} over {SIMPLE} that `ins-eval check-cep` holds, written by its option --commit.",
        "# log_sd is the standard deviation of the logarithm of the ratio over ensembles of this size.",
        f"size = {size}",
        f"seed = {seed}",
    ]
    for measure in MEASURES:
        r = ratios[f"{HYSTERESIS}/{SIMPLE}"][measure]
        lines += ["", f"[{measure}]", f"ratio = {r.ratio:.4f}", f"log_sd = {r.log_sd:.4f}"]
    write_whole(path, "\n".join([*lines, ""]).encode())
    print(f"committed: {path}")
    return 0
