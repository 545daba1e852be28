"""The textbook chamber of the calibration tests serves here too."""

import runpy
from pathlib import Path

_calibration = runpy.run_path(str(Path(__file__).parents[1] / "calibration" / "conftest.py"))
chamber_of = _calibration["chamber_of"]
