"""``ins-eval simulate``: a flight, an oven run or a chamber test, written as a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from ins_eval.analysis.simulate import chamber_of, simulate, simulate_chamber
from ins_eval.errors import UsageError
from ins_eval.recording import form
from ins_eval.report.json_file import write_json


def run(
    kind: Literal["flight", "oven", "chamber"],
    output: Path,
    profile: str = "climb-cruise-landing",
    population: str = "jb-kt8",
    seed: int = 1,
    instrument: int = 0,
    rate_hz: float | None = None,
    json: Path | None = None,
    quiet: bool = False,
    **of_chamber: Any,
) -> int:
    """Write one recording of one instrument into `output`; the same seed gives the same bytes.

    `of_chamber`: a chamber with `ramps_c_per_min` and `dwell_s` holds the accelerometer `axis` (by default x) of the
    instrument, or the printed `unit` of that name, or "all" of these in one table.
    """
    if kind == "chamber":
        chamber = chamber_of(of_chamber.get("ramps_c_per_min"), of_chamber.get("dwell_s"))
        chosen = of_chamber.get("axis"), of_chamber.get("unit")
        form.write_chamber(simulate_chamber(chamber, population, seed, instrument, *chosen), output)
    else:
        options = {"--axis": "axis", "--unit": "unit", "--ramps": "ramps_c_per_min", "--dwell": "dwell_s"}
        if wrong := [option for option, name in options.items() if of_chamber.get(name) is not None]:
            raise UsageError(f"simulate {kind}: {wrong[0]} is of a chamber; leave it out or simulate a chamber")
        simulate(profile, kind, population, seed, instrument, rate_hz).write(output)
    write_json(json, {"format": "ins-eval-simulated/1", "kind": kind, "seed": seed, "recording": str(output)})
    if not quiet:
        print(f"recording: {output}")
    return 0
