"""A recording as it is asked for: from its folder, or from a file of PSINS."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ins_eval.errors import UsageError
from ins_eval.initialization.magnetic import with_magnetic_heading
from ins_eval.interface.result import PathLike
from ins_eval.recording import Recording, form
from ins_eval.recording.form.description import CHAMBER, open_folder
from ins_eval.recording.validation import validate
from ins_eval.units import DEG


def read(
    source: PathLike,
    belief: PathLike | None = None,
    unit: str | None = None,
    magnetometer: Sequence[str] = (),
    declination_deg: float = 0.0,
) -> Recording:
    """Read a recording.

    Parameters
    ----------
    source : folder in the form ins-recording/1, or a ``.imu`` file in PSINS text
    belief : file with the belief tables to take in place of those of the recording
    unit : the inertial unit by the name of its data sheet, which fills what nobody stated
    magnetometer : three columns of `imu`, body axes, from which the heading of a start that states none is taken
    declination_deg : of the magnetic field, east positive

    Raises: UsageError, DataRefused.
    """
    source = Path(source)
    stated = None if belief is None else form.belief_of_file(Path(belief))
    if source.is_dir() or not source.exists():
        if open_folder(source).description.kind == CHAMBER:
            raise UsageError(f"{source}: it is a chamber recording; calibrate or diagnose it")
        recording = form.read(source, solution_alone=True, belief=stated)
    elif source.suffix == ".imu":
        from ins_eval.readers import psins_text  # imported here: the libraries of all formats come with it

        recording = replace(validate(psins_text.read(source, {})), folder=source.parent)
    else:
        raise UsageError(
            f"{source}: evaluate takes a folder in the form ins-recording/1 (or a .imu file in PSINS text); bring this "
            "file into the form first: ins-eval import FORMAT FILE -o DIR"
        )
    if unit is not None:
        recording = replace(recording, unit=unit)
    if magnetometer:
        recording = with_magnetic_heading(recording, magnetometer, declination_deg * DEG)
    return recording if stated is None else replace(recording, belief=stated)
