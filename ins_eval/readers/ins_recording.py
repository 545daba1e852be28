"""Our own form, ``ins-recording/1``: read, lost samples filled or the recording cut there, to be written again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ins_eval.readers.layout import Layout
from ins_eval.readers.options import number
from ins_eval.readers.sampling import filled
from ins_eval.recording import Recording, form
from ins_eval.recording.belief import AccelerometerBelief

KEYS = ("gps.time_offset_s", "reference.time_offset_s", "gaps", "fill_s")
MODELS = "compensation"  # of a recording that was simulated, further models to compare


def read(path: Path, assumed: Mapping[str, str]) -> Recording:
    """The recording in a folder, its short gaps filled, with the clock offsets that are assumed."""
    recording = form.read(path, lost_samples=True)
    if recording.imu is not None:
        layout = Layout("rad", "m/s").overridden(assumed)
        imu, notes = filled(recording.imu, form.given_as_rates(path), layout, str(path))
        recording = replace(recording, imu=imu, notes=(*recording.notes, *notes))
    if (path / MODELS).is_dir():
        note = f"The folder {MODELS} was not copied; copy it into the new recording to evaluate with its models."
        recording = replace(recording, notes=(*recording.notes, note))
    belief = recording.belief.model_copy(
        update={"accelerometer": _from_anywhere(recording.belief.accelerometer, path.resolve())}
    )
    for table in ("gps", "reference"):
        key = f"{table}.time_offset_s"
        if key in assumed:
            stated = getattr(belief, table)
            offset_s = number(assumed, key, stated.time_offset_s)
            belief = belief.model_copy(update={table: stated.model_copy(update={"time_offset_s": offset_s})})
    return replace(recording, belief=belief)


def _from_anywhere(believed: AccelerometerBelief, folder: Path) -> AccelerometerBelief:
    """Files of compensation models by their full path: the copy will lie in another folder."""
    axes = {axis: getattr(believed, axis) for axis in "xyz"}
    found = {
        axis: stated.model_copy(update={"compensation": str(folder / stated.compensation)})
        for axis, stated in axes.items()
        if stated is not None and stated.compensation is not None
    }
    return believed.model_copy(update=found)
