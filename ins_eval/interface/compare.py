"""The recorded IMU against what its reference implies."""

from __future__ import annotations

from functools import partial

from ins_eval.analysis.compare import RecordingComparison, compare_recording
from ins_eval.errors import DataRefused
from ins_eval.figures.results.comparison import comparison_figures
from ins_eval.interface.result import Result
from ins_eval.recording import Recording
from ins_eval.report.comparison import comparison_content


def compare(recording: Recording, use_found_offset: bool = False) -> Result[RecordingComparison]:
    """The recorded IMU against what its reference implies: see `analysis.compare.compare_recording`."""
    if recording.imu is None:
        raise DataRefused(f"{recording.name}: holds no imu, only the solution that an INS put out; evaluate it")
    found = compare_recording(recording, use_found_offset)
    draw = partial(comparison_figures, found)
    return Result(f"Comparison: {recording.name}", found, found.tree, *comparison_content(found), draw)
