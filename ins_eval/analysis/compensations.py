"""The compensations that a recording has: what is believed with each, and the velocity increments it makes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from ins_eval.compensation import CompensationModel
from ins_eval.compensation.file import believed_model, read_triad
from ins_eval.effects import without_effects
from ins_eval.errors import DataRefused, UsageError, did_you_mean
from ins_eval.navigation import compensate, samples
from ins_eval.recording import Recording
from ins_eval.recording.belief import ZERO, Belief

AS_RECORDED, BELIEVED = "none", "believed"


@dataclass(frozen=True)
class Arm:
    """One compensation of a recording: what is believed with it, and the velocity increments it makes.

    `alike`: one model of a file does for the three axes.
    """

    recording: Recording
    velocity: np.ndarray
    alike: bool = False


def arms_of(
    recording: Recording, wanted: Sequence[str], models: Mapping[str, Sequence[CompensationModel]]
) -> dict[str, Callable[[], Arm]]:
    """What makes each compensation that is wanted, by name (none wanted: all that the recording has).

    `models` are further ones of pulses. Raises: DataRefused, UsageError.
    """
    found = (
        _of_pulses(recording, wanted, models)
        if recording.imu.accelerometer_form == "pulse"
        else _of_increments(recording)
    )
    unknown = [name for name in wanted if name not in found]
    if unknown:
        raise UsageError(f"{recording.name}: no compensation '{unknown[0]}' in it{did_you_mean(unknown[0], found)}")
    return {name: arm for name, arm in found.items() if not wanted or name in wanted}


def _of_pulses(
    recording: Recording, wanted: Sequence[str], models: Mapping[str, Sequence[CompensationModel]]
) -> dict[str, Callable[[], Arm]]:
    folder = recording.folder
    believed = recording.belief.accelerometer
    triads: dict[str, Sequence[CompensationModel]] = {}
    if all(getattr(believed, axis) is not None for axis in "xyz"):
        triads[BELIEVED] = [believed_model(recording.belief, axis, folder) for axis in "xyz"]
    files = {name: read_triad(file) for name, file in _model_files(folder, wanted).items()}
    triads |= files | dict(models)
    if not triads:
        raise DataRefused(
            f"{recording.name}: the accelerometers deliver pulses, and nothing says what a pulse is worth; expected "
            "[accelerometer.x], .y and .z in recording.toml, or a model with --compensation FILE.toml"
        )
    other = replace(recording, belief=_of_other_accelerometers(recording.belief))

    def made(name: str) -> Arm:
        velocity = compensate(samples(recording), triads[name], recording.interval_s)
        alike = name in files and triads[name] is files[name] and files[name][0] is files[name][1]
        return Arm(*without_effects(recording if name == BELIEVED else other, velocity, folder), alike)

    return {name: partial(made, name) for name in triads}


def _of_other_accelerometers(belief: Belief) -> Belief:
    """A belief without the effects that hold for its own compensation of the accelerometers only."""
    own = ("accelerometer.", "temperature.")
    kept = [
        one
        for one in belief.effects
        if not one.name.startswith(own) and not (one.form or "").startswith("accelerometer")
    ]
    return belief.model_copy(update={"effects": tuple(kept)})


def _model_files(folder: Path, wanted: Sequence[str]) -> dict[str, Path]:
    """Compensation files beside the recording, and those that were asked for."""
    files = {file.stem: file for file in sorted((folder / "compensation").glob("*.toml"))}
    return files | {name: Path(name) for name in wanted if name.endswith(".toml")}


def _of_increments(recording: Recording) -> dict[str, Callable[[], Arm]]:
    belief = recording.belief
    bare = belief.model_copy(
        update={
            "gyro": belief.gyro.model_copy(update={"bias_radps": ZERO}),
            "accelerometer": belief.accelerometer.model_copy(update={"bias_mps2": ZERO}),
            "effects": (),
        }
    )

    def as_recorded() -> Arm:
        return Arm(replace(recording, belief=bare), recording.imu.accelerometer)

    def as_believed() -> Arm:
        return Arm(*without_effects(recording, recording.imu.accelerometer, recording.folder))

    believes = any(belief.accelerometer.bias_mps2) or any(belief.gyro.bias_radps) or bool(belief.effects)
    return {AS_RECORDED: as_recorded} | ({BELIEVED: as_believed} if believes else {})
