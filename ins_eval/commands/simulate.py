"""``ins-eval simulate``: a flight, an oven run or a chamber test, written as a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ins_eval.analysis.simulate import chamber_of, simulate, simulate_chamber
from ins_eval.errors import UsageError
from ins_eval.recording import form
from ins_eval.report.json_file import write_json


@dataclass(frozen=True)
class Options:
    """What is recorded, as ``ins-eval simulate --help`` says it.

    A chamber with `ramps_c_per_min` and `dwell_s` holds the accelerometer `axis` (by default x) of the instrument, or
    the printed `unit` of that name, or "all" of these in one table.
    """

    profile: str = "climb-cruise-landing"
    population: str = "jb-kt8"
    seed: int = 1
    instrument: int = 0
    rate_hz: float | None = None
    axis: str | None = None
    unit: str | None = None
    ramps_c_per_min: Sequence[float] | None = None
    dwell_s: float | None = None


def run(
    kind: Literal["flight", "oven", "chamber"],
    output: Path,
    json: Path | None = None,
    quiet: bool = False,
    **options: Any,
) -> int:
    """Write one recording of one instrument into `output`; the same seed gives the same bytes.

    `options` are the fields of `Options`.
    """
    of = Options(**options)
    if kind == "chamber":
        chamber = chamber_of(of.ramps_c_per_min, of.dwell_s)
        made = simulate_chamber(chamber, of.population, of.seed, of.instrument, of.axis, of.unit)
        form.write_chamber(made, output)
    else:
        of_chamber = {"--axis": of.axis, "--unit": of.unit, "--ramps": of.ramps_c_per_min, "--dwell": of.dwell_s}
        if wrong := [option for option, value in of_chamber.items() if value is not None]:
            raise UsageError(f"simulate {kind}: {wrong[0]} is of a chamber; leave it out or simulate a chamber")
        simulate(of.profile, kind, of.population, of.seed, of.instrument, of.rate_hz).write(output)
    write_json(json, {"format": "ins-eval-simulated/1", "kind": kind, "seed": of.seed, "recording": str(output)})
    if not quiet:
        print(f"recording: {output}")
    return 0
