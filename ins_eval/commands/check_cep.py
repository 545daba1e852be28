"""``ins-eval check-cep``: the gate that hysteresis compensation still improves navigation, see `ins_eval.gate`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ins_eval import gate
from ins_eval.errors import GateNotMet
from ins_eval.files import write_whole
from ins_eval.gate import MEASURES, Committed, Condition, Quantities, Sizes
from ins_eval.report.json_file import write_json
from ins_eval.tables import parse, read_toml

COMMIT_SIZES = Sizes(paper=2400, missions=1000)
HEADINGS = {
    1: "the gain of the paper's comparison: hysteresis with the oven refinement, simple without",
    2: "the gain without refinement, over missions",
    3: "both refined alike: not worse than committed",
    4: "errors of each compensation: as committed",
}


@dataclass(frozen=True)
class Options:
    """What is flown and held against what, as ``ins-eval check-cep --help`` says it.

    With `commit` what is found is written to `committed_file`, None: that of the package, instead of being held
    against it.
    """

    profile: str
    seed: int
    size: int | None = None
    commit: bool = False
    committed_file: Path | None = None


def run(
    output: Path,
    workers: int | None,
    quiet: bool,
    json: Path | None = None,
    scheduler: str | None = None,
    **options: Any,
) -> int:
    """Run the ensembles, print each condition and each control, raise GateNotMet where one does not hold.

    `options` are the fields of `Options`.
    """
    of = Options(**options)
    committed_file = of.committed_file or gate.COMMITTED_FILE
    if of.commit:
        sizes = Sizes(paper=of.size, missions=of.size) if of.size else COMMIT_SIZES
        flown = gate.fly(output, of.profile, of.seed, sizes, workers, quiet, scheduler)
        write_whole(committed_file, gate.commit(flown, sizes, of.seed).encode())
        write_json(json, {"format": "ins-eval-gate/1", "committed": str(committed_file)})
        if not quiet:
            print(f"committed: {committed_file}")
        return 0
    committed = parse(Committed, read_toml(committed_file), str(committed_file))
    size = of.size or committed.power_size
    sizes = Sizes(paper=size, missions=size)
    seen = gate.compare(gate.fly(output, of.profile, of.seed, sizes, workers, quiet, scheduler), of.seed)
    conditions = gate.conditions(seen, committed, size)
    if not quiet:
        _print(conditions, seen["paper"], committed, size, of.seed)
    held = [one._asdict() | {"met": one.met} for one in conditions]
    write_json(json, {"format": "ins-eval-gate/1", "size": size, "seed": of.seed, "conditions": held})
    failures = [f"condition {c.subject}: {c.seen:.3f}, expected {c.limits}" for c in conditions if not c.met]
    failures += gate.control_faults(seen["paper"], committed)
    if failures:
        raise GateNotMet(f"check-cep: {'; '.join(failures)}; look at what changed flight, models or calibration")
    if not quiet:
        print("gate: met")
    return 0


def _print(conditions: list[Condition], paper: Quantities, committed: Committed, size: int, seed: int) -> None:
    print(f"gate: {size} paired instruments, seed {seed}, each on the paper's flight and on a mission of its own;")
    print(
        f"      with {committed.power_size} all conditions together have a power of {100 * gate.POWER:g} % at what was"
    )
    print(f"      committed of {committed.size.paper} on the paper's flight and {committed.size.missions} on missions;")
    print("      CEP rate (final) in nmi/h, horizontal velocity RMS in m/s")
    for number, heading in HEADINGS.items():
        print(f"{number}  {heading}")
        for condition in (c for c in conditions if c.number == number):
            print(f"   {_line(condition)}")
        for gain in (g for g in committed.gains(held=False) if g[0] == number):
            _, flight, quantity, measure = gain
            print(
                f"   {flight}, {quantity}, {MEASURES[measure]}: not held, it would need "
                f"{committed.needed(*gain[1:])} instruments, more than the {gate.LARGEST} of five minutes"
            )
    print(f"controls on the paper's flight: '{gate.MIRRORED}' must fail, 'simple' against itself must be exactly 1")
    for control in gate.CONTROLS:
        for measure, (ratio, low, high) in paper[control].items():
            print(f"   {control:37s}{MEASURES[measure]:13s}ratio {ratio:.3f}, 95 % interval {low:.3f} to {high:.3f}")


def _line(c: Condition) -> str:
    met = f"margin {100.0 * c.margin:5.1f} %" if c.met else "NOT MET"
    return f"{c.flight:9s}{c.quantity:35s}{MEASURES[c.measure]:13s}{c.seen:6.3f}  {c.limits:15s}  {met:15s} {c.words}"
