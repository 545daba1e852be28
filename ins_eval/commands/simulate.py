"""``ins-eval simulate``: a flight, an oven run or a chamber test, written as a recording."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from ins_eval.analysis.simulate import chamber_of, simulate_chamber, simulate_recording
from ins_eval.errors import UsageError
from ins_eval.recording import form


def run(
    kind: Literal["flight", "oven", "chamber"],
    output: Path,
    profile: str = "climb-cruise-landing",
    population: str = "jb-kt8",
    seed: int = 1,
    instrument: int = 0,
    rate_hz: float | None = None,
    axis: str | None = None,
    unit: str | None = None,
    ramps_c_per_min: Sequence[float] | None = None,
    dwell_s: float | None = None,
    quiet: bool = False,
) -> int:
    """Write one recording of one instrument into `output`; the same seed gives the same bytes.

    A chamber holds the accelerometer `axis` (by default x) of the instrument, or the printed `unit` of that name, or
    "all" of these in one table.
    """
    if kind == "chamber":
        chamber = chamber_of(ramps_c_per_min, dwell_s)
        form.write_chamber(simulate_chamber(chamber, population, seed, instrument, axis, unit), output)
    else:
        of_chamber = {"--axis": axis, "--unit": unit, "--ramps": ramps_c_per_min, "--dwell": dwell_s}
        if wrong := [option for option, value in of_chamber.items() if value is not None]:
            raise UsageError(f"simulate {kind}: {wrong[0]} is of a chamber; leave it away or simulate a chamber")
        simulate_recording(profile, kind, population, seed, instrument, rate_hz).write(output)
    if not quiet:
        print(f"recording: {output}")
    return 0
