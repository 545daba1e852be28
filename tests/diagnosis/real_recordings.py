"""The real recordings as a user has them: loaded, cut in halves, shuffled, and what a diagnosis of them says in words.

What is documented of each stands in `SOURCE.md` beside it.
"""

from __future__ import annotations

import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmark.runners.imported import recorded
from benchmark.worlds.real import SOURCES
from ins_eval.analysis.diagnose import diagnose_folders
from ins_eval.diagnosis.answer.answer import answer
from ins_eval.diagnosis.answer.verdict import Diagnosis
from ins_eval.readers import psins_mat, psins_text
from ins_eval.recording import ChamberReadings, Recording, form
from ins_eval.recording.belief import AccelerometerBelief, AxisBelief, Belief, BiasBelief, EarthBelief, ScaleBelief
from ins_eval.report.diagnosis import diagnosis_content
from ins_eval.report.diagnosis_page import page
from tests.beliefs import navigation_grade

RECORDINGS = Path(__file__).parents[3] / "shared" / "recordings"
LASER = RECORDINGS / "rlg_static_vehicle" / "lasergyro.imu"
RAMP = RECORDINGS / "accel_thermal_chamber" / "Sample_data.csv.gz"
FOG_MEMS = RECORDINGS / "fog_mems_vehicle" / "transfer_align_fog_mems.mat"
ROWS_PER_S = 500  # of the ramp, as the authors assume
GAMMA = 1000.0  # pulse/(g s): a milli-g is a pulse


def real(path: Path) -> Path:
    if not path.is_file():
        pytest.skip(f"{path} is not here")
    return path


def laser(rotation: bool) -> Recording:
    """Parked laser gyros with an Earth that is believed to turn or not."""
    whole = psins_text.read(real(LASER), {})
    return replace(whole, belief=navigation_grade(earth=EarthBelief(rotation=rotation)))


def shuffled_axes(recording: Recording, stretch_s: float, seed: int) -> Recording:
    """In every stretch the gyros trade places and signs: no direction in space stays."""
    rng = np.random.default_rng(seed)
    gyro = recording.imu.gyro.copy()
    rows = round(stretch_s / float(np.median(np.diff(recording.imu.time_s))))
    for begin in range(0, len(gyro), rows):
        part = slice(begin, begin + rows)
        gyro[part] = gyro[part][:, rng.permutation(3)] * rng.choice([-1.0, 1.0], 3)
    return replace(recording, imu=replace(recording.imu, gyro=gyro))


def fog_mems(late_s: float = 0.0, biases: bool = True) -> Recording:
    """MEMS beside a better navigator whose stamps are believed to be late; the authors' gyro biases believed or not."""
    recording = psins_mat.read(real(FOG_MEMS), {})
    gyro = recording.belief.gyro if biases else recording.belief.gyro.model_copy(update={"bias_radps": (0.0,) * 3})
    reference = recording.belief.reference.model_copy(update={"time_offset_s": late_s})
    return replace(recording, belief=recording.belief.model_copy(update={"reference": reference, "gyro": gyro}))


def half(recording: Recording, second: bool) -> Recording:
    """Half of a recording; the second begins with the state of the reference."""
    imu, fixes = recording.imu, recording.reference
    middle = imu.time_s.size // 2
    rows = slice(middle, None) if second else slice(0, middle)
    part = replace(imu, time_s=imu.time_s[rows], gyro=imu.gyro[rows], accelerometer=imu.accelerometer[rows])
    if not second:
        return replace(recording, imu=part)
    k = int(np.argmin(np.abs(fixes.time_s - imu.time_s[middle - 1])))
    start = replace(
        recording.start,
        time_s=float(imu.time_s[middle - 1]),
        latitude_rad=float(fixes.latitude_rad[k]),
        longitude_rad=float(fixes.longitude_rad[k]),
        height_m=float(fixes.height_m[k]),
        velocity_n=tuple(fixes.velocity_n[k]),
        attitude_rad=tuple(fixes.attitude_rad[k]),
    )
    return replace(recording, imu=part, start=start)


def shuffled_reference(recording: Recording, stretch_s: float, seed: int) -> Recording:
    """Stretches of the attitude of the reference in another order; the stamps stay."""
    rng = np.random.default_rng(seed)
    fixes = recording.reference
    rows = round(stretch_s / float(np.median(np.diff(fixes.time_s))))
    stretches = np.array_split(np.arange(fixes.time_s.size), range(rows, fixes.time_s.size, rows))
    order = np.concatenate([stretches[k] for k in rng.permutation(len(stretches))])
    return replace(recording, reference=replace(fixes, attitude_rad=fixes.attitude_rad[order]))


def ramp() -> ChamberReadings:
    """Means over a second of the vertical axis at rest."""
    with gzip.open(real(RAMP)) as file:
        rows = np.loadtxt(file, delimiter=",").reshape(-1, ROWS_PER_S, 5).mean(axis=1)
    count = len(rows)
    return ChamberReadings(
        time_s=np.arange(float(count)),
        run=np.zeros(count, dtype=int),
        input_g=np.ones(count),
        rate_c_per_min=np.zeros(count),
        temperature_c=rows[:, 4],
        output=rows[:, 3],
        axis="z",
    )


def chamber_belief(readings: ChamberReadings, line: bool = False, **further: float) -> Belief:
    """Milli-g a pulse; a `line` in temperature as least squares have it, or nothing. The rest is as by default."""
    reference_c = float(readings.temperature_c[0])
    slope, constant = np.polyfit(readings.temperature_c - reference_c, readings.output - GAMMA, 1) * line
    bias = BiasBelief(k0_ug=1e3 * float(constant), omega_ug_per_c=1e3 * float(slope))
    axis = AxisBelief(scale=ScaleBelief(gamma=GAMMA), bias=bias)
    return navigation_grade(accelerometer=AccelerometerBelief(reference_temperature_c=reference_c, z=axis, **further))


def shuffled_temperature(readings: ChamberReadings, stretches: int, seed: int) -> ChamberReadings:
    order = np.random.default_rng(seed).permutation(stretches)
    parts = np.array_split(readings.temperature_c, stretches)
    return replace(readings, temperature_c=np.concatenate([parts[k] for k in order]))


def words(found: Diagnosis) -> str:
    """The first lines of the text that a user reads, on one line."""
    told = answer(found)
    tree, _ = page(found, told)
    return " ".join(diagnosis_content(tree)[0].split())


def imported(name: str, folder: Path) -> Recording:
    source = next(one for one in SOURCES if one.name == name)
    if recorded(source, RECORDINGS, folder) is None:
        pytest.skip(f"{RECORDINGS / source.file} is not here")
    return form.read(folder)


def diagnosed(recording: Recording, folder: Path) -> Diagnosis:
    """As a user has it, from a folder: what is described wrongly is mended, and a receiver settles first."""
    return diagnose_folders([form.write(recording, folder)]).diagnosis


def values(found: Diagnosis) -> dict[tuple[str, str | None], float]:
    return {(one.hypothesis.candidate.name, one.hypothesis.candidate.axis): one.value for one in found.effects}
