"""``ins-eval calibrate``: from chamber readings to the models of an accelerometer, and how sure they are."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from ins_eval.commands.delivery import deliver
from ins_eval.interface.calibrate import calibrate


def run(
    chambers: Sequence[Path],
    model_file: Path | None = None,
    compensation: str | None = None,
    unit: str | None = None,
    output: Path | None = None,
    export: Sequence[str] = (),
    json: Path | None = None,
    quiet: bool = False,
) -> int:
    """Calibrate one accelerometer, or those of the three axes, report it and write its compensation file.

    The report goes into `output` (by default ``reports/NAME-calibration``); `model_file` gets the model
    `compensation`, by default hysteresis or the best that the readings determine.
    """
    result = calibrate(chambers, compensation, unit, model_file)
    names = [one.folder.resolve().name for one in result.found.accelerometers]
    if unit is not None:
        names.append(re.sub(r"\W+", "-", unit).strip("-"))
    deliver(result, output or Path("reports") / f"{'-'.join(names)}-calibration", quiet, json, export)
    if not quiet and model_file is not None:
        print(f"model: {model_file}")
    return 0
