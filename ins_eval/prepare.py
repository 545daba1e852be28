"""``python -m ins_eval.prepare``: machine code made once, after an install, so that no first run waits for it.

Numba keeps it beside the sources, or in the user's cache folder where that cannot be written. A short flight is
simulated, flown, evaluated and diagnosed, and instruments are flown linearly, which calls whatever is compiled.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from ins_eval.analysis.missions import POPULATION
from ins_eval.cli import main as run
from ins_eval.ensemble import Plan, World, linear

PROFILE = """\
name = "short flight"
duration_s = 180.0
start = {latitude_deg = 45.0, longitude_deg = 10.0, height_m = 500.0, heading_deg = 30.0, stand_s = 120.0}
speed = [{from_s = 10.0, to_s = 60.0, to_mps = 80.0}]
turn = [{at_s = 80.0, by_deg = 45.0, bank_deg = 20.0}]
thermal = {self_heating_c = 1.0}
"""


def commands(folder: Path) -> list[list[str]]:
    """One of each, on the profile ``short.toml`` of a folder."""
    recording = str(folder / "short")
    return [
        ["simulate", "flight", "--profile", str(folder / "short.toml"), "--rate", "20", "-o", recording, "--quiet"],
        ["evaluate", recording, "-o", str(folder / "page"), "--quiet"],
        ["diagnose", recording, "-o", str(folder / "diagnosis"), "--quiet"],
        ["flight-report", "--ensemble", "2", "--workers", "1", "-o", str(folder / "flight"), "--quiet"],
    ]


def main() -> int:
    """Run them; returns the exit code of the first that fails."""
    print("make env: compiling what runs in machine code, about a minute", flush=True)
    with TemporaryDirectory() as where:
        (Path(where) / "short.toml").write_text(PROFILE)
        for words in commands(Path(where)):
            print(f"make env: {words[0]}", flush=True)
            if code := run(words):
                return code
    print("make env: linear ensembles", flush=True)
    for missions in (None, POPULATION):
        linear.member(World(Plan(experiment="linear", missions=missions)), 0)
    return 0


if __name__ == "__main__":
    sys.exit(main())
