"""What is believed where nobody stated it: from sheets, rest, grade and fixes; never in silence."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ins_eval import datasheets
from ins_eval.believed import belief_rows, believed, believed_of_chamber
from ins_eval.cli import main
from ins_eval.errors import DataRefused, UsageError
from ins_eval.grade import measure_grade, nearest_unit
from ins_eval.interface.compare import compare
from ins_eval.interface.evaluate import evaluate
from ins_eval.readers.attribution import attributed
from ins_eval.recording import Fixes, Imu, Recording, Start, form
from ins_eval.recording.belief import AccelerometerBelief, Belief, GpsBelief, GyroBelief
from ins_eval.recording.validation import validate
from tests.beliefs import navigation_grade

DEG, DEG_PER_H, UG = np.pi / 180.0, np.pi / 180.0 / 3600.0, 9.80665e-6
EARTH_RATE = 7.292115e-5  # rad/s
LATITUDE_RAD = 45.0 * DEG
GRAVITY_45 = 9.806199203  # m/s^2, normal gravity at 45 degrees and height 0, WGS-84
STEP_S = 0.02
MEMS_OFFSET_RADPS = np.array([0.20, -0.03, 0.38]) * DEG
ARW_DEG, VRW_UG = 0.2, 120.0  # deg/sqrt(h), ug/sqrt(Hz)
SIGMAS = 4.0  # of a tolerance that follows from a stated sigma
SHOWN_DIGITS = 5e-3  # relative, of three digits
WHITE = 0.1  # relative, of white noise in minutes at rest


AIMED = Start(
    0.0,
    LATITUDE_RAD,
    0.0,
    0.0,
    attitude_rad=(0.0, 0.0, 30.0 * DEG),
    attitude_sigma_rad=(1e-4, 1e-4, 1e-2),
)


def parked(
    duration_s: float = 300.0,
    offset_radps: np.ndarray = MEMS_OFFSET_RADPS,
    arw: float = ARW_DEG,
    vrw: float = VRW_UG,
    force_ug: float = 0.0,
    **fields,
) -> Recording:
    """Level at 45 degrees, heading 30 degrees, with these constants and white noises."""
    rng = np.random.default_rng(5)
    count = round(duration_s / STEP_S)
    heading = 30.0 * DEG
    north = np.array([np.cos(heading), -np.sin(heading), 0.0])
    rate = EARTH_RATE * (np.cos(LATITUDE_RAD) * north + np.array([0.0, 0.0, -np.sin(LATITUDE_RAD)])) + offset_radps
    gyro = rate * STEP_S + arw / 60.0 * DEG * np.sqrt(STEP_S) * rng.standard_normal((count, 3))
    force = np.array([0.0, 0.0, -GRAVITY_45 - force_ug * UG])
    velocity = force * STEP_S + vrw * UG * np.sqrt(STEP_S) * rng.standard_normal((count, 3))
    imu = Imu(STEP_S * np.arange(1, count + 1), gyro, velocity, "increment")
    fields = {"start": Start(0.0, LATITUDE_RAD, 0.0, 0.0), "kind": "static"} | fields
    return Recording(name="parked", imu=imu, **fields)


def driven(with_gps: Fixes | None = None) -> Recording:
    """Vibration and turns throughout, so that nothing is at rest."""
    still = parked(120.0)
    rng = np.random.default_rng(8)
    shaken = still.imu.gyro + 0.02 * STEP_S * rng.standard_normal(still.imu.gyro.shape)
    time_s = np.arange(0.0, 120.0)
    moving = Fixes(
        time_s,
        LATITUDE_RAD + 10.0 * time_s / 6.37e6,
        np.zeros(120),
        np.zeros(120),
        np.tile([10.0, 0.0, 0.0], (120, 1)),
        np.ones(120, dtype=bool),
    )
    return replace(still, kind="drive", imu=replace(still.imu, gyro=shaken), gps=with_gps or moving)


# ------------------------------------------------------------------------------------------------------------ at rest


def test_offsets_and_noise_at_rest_are_those_put_in() -> None:
    recording = parked(force_ug=3000.0)
    grade = measure_grade(recording, recording.imu.accelerometer)
    assert (np.abs(grade.gyro_offset - MEMS_OFFSET_RADPS) < SIGMAS * grade.gyro_offset_sigma).all()
    assert grade.gyro_offset_sigma.max() < 2.0 * EARTH_RATE
    assert abs(grade.force_offset / UG - 3000.0) < SIGMAS * grade.force_offset_sigma / UG
    assert grade.white["angle_random_walk_deg_per_sqrt_h"] == pytest.approx(ARW_DEG, rel=WHITE)
    assert grade.white["velocity_random_walk_ug_per_sqrt_hz"] == pytest.approx(VRW_UG, rel=WHITE)
    assert "MEMS" in grade.grade


def test_a_vehicle_that_stands_but_is_shaken_is_not_said_to_move() -> None:
    """Its fixes stand from 30 s on; the gyros are shaken throughout."""
    moving = driven()
    velocity = moving.gps.velocity_n.copy()
    velocity[30:] = 0.0
    stands = measure_grade(driven(replace(moving.gps, velocity_n=velocity)), moving.imu.accelerometer)
    assert stands.words.startswith("It stands still from 30 to 119 s by the fixes, but is disturbed there")
    assert measure_grade(moving, moving.imu.accelerometer).words.startswith(
        "No stretch of 10 s is at rest. White noise"
    )


def test_the_vertical_part_of_earth_rate_is_no_offset() -> None:
    recording = parked(offset_radps=np.zeros(3), arw=0.002, vrw=10.0)
    grade = measure_grade(recording, recording.imu.accelerometer)
    assert abs(grade.gyro_offset[2]) < 0.1 * EARTH_RATE  # level: down holds all of the vertical part
    horizontal = EARTH_RATE * np.cos(LATITUDE_RAD)
    assert np.hypot(*grade.gyro_offset[:2]) == pytest.approx(horizontal, rel=0.01)
    assert (np.abs(grade.gyro_offset[:2]) < 3.0 * grade.gyro_offset_sigma[:2]).all()


def test_every_rest_counts_and_its_length_is_said() -> None:
    recording = parked(300.0)
    rng = np.random.default_rng(3)
    gyro = recording.imu.gyro.copy()
    for begin_s, end_s in ((100.0, 120.0), (200.0, 220.0)):
        rows = slice(round(begin_s / STEP_S), round(end_s / STEP_S))
        gyro[rows] += 0.05 * STEP_S * rng.standard_normal(gyro[rows].shape)
    grade = measure_grade(replace(recording, imu=replace(recording.imu, gyro=gyro)), recording.imu.accelerometer)
    assert len(grade.rests) == 3
    assert grade.rest_s == pytest.approx(260.0, abs=6.0)
    assert "in 100 s, 80 s, 80 s at rest" in grade.words


@pytest.mark.parametrize(
    ("arw", "vrw", "offset_deg_per_h", "force_ug", "grade"),
    [
        (0.002, 8.0, 0.003, 25.0, "navigation"),
        (0.07, 60.0, 1.0, 1000.0, "tactical"),
        (0.5, 300.0, 10000.0, 40000.0, "consumer MEMS"),
    ],
)
def test_the_grade_is_that_of_instruments_so_good(arw, vrw, offset_deg_per_h, force_ug, grade) -> None:
    offset = offset_deg_per_h * DEG_PER_H * np.array([1.0, -1.0, 1.0])
    recording = parked(120.0, offset_radps=offset, arw=arw, vrw=vrw, force_ug=force_ug)
    assert measure_grade(recording, recording.imu.accelerometer).grade == grade


def test_an_offset_rules_out_units_that_have_none() -> None:
    white = {"angle_random_walk_deg_per_sqrt_h": 0.15, "velocity_random_walk_ug_per_sqrt_hz": 102.0}
    assert nearest_unit(white, {}) == "stim300"
    assert datasheets.unit(nearest_unit(white, {"gyro": (1400.0, 20.0)})).grade in ("consumer MEMS", "industrial MEMS")


def test_noise_of_the_place_makes_no_consumer_unit_of_one_without_offsets() -> None:
    """As of laser gyros in a vehicle: wind and engine are seen, and offsets below the unknown part of Earth rate."""
    white = {"angle_random_walk_deg_per_sqrt_h": 0.06, "velocity_random_walk_ug_per_sqrt_hz": 360.0}
    offsets = {"gyro": (10.0, 12.0), "accelerometer": (100.0, 300.0)}
    assert datasheets.unit(nearest_unit(white, offsets)).grade in ("tactical", "navigation")


def test_a_recording_that_never_rests_bounds_the_noise_only() -> None:
    grade = measure_grade(driven(), driven().imu.accelerometer)
    assert grade.gyro_offset is None and not grade.channels
    assert grade.bounds["angle_random_walk_deg_per_sqrt_h"] > ARW_DEG
    assert "at most" in grade.words and "or better" in grade.words


# ----------------------------------------------------------------------------------------------------------- believed


def test_everything_unknown_is_filled_with_its_source_and_said_first() -> None:
    filled = believed(parked(notes=("from a test",)))
    gyro, accelerometer = filled.belief.gyro, filled.belief.accelerometer
    values = [gyro.bias_radps, gyro.bias_sigma_deg_per_h, gyro.angle_random_walk_deg_per_sqrt_h]
    values += [accelerometer.bias_mps2, accelerometer.bias_sigma_ug, accelerometer.velocity_random_walk_ug_per_sqrt_hz]
    assert None not in values
    np.testing.assert_allclose(gyro.bias_radps, MEMS_OFFSET_RADPS, atol=1.5 * EARTH_RATE)
    assert "at rest" in gyro.source and "data sheets of grade" in accelerometer.source
    assert filled.notes[0].startswith("Grade: ") and filled.notes[-1] == "from a test"
    assert sum(note.startswith("Believed, not stated: ") for note in filled.notes) == len(values)
    assert believed(filled) is filled


def test_what_is_stated_stays_and_a_full_belief_comes_back_as_it_is() -> None:
    recording = parked(belief=navigation_grade())
    assert believed(recording) is recording
    some = believed(parked(belief=Belief(gyro=GyroBelief(angle_random_walk_deg_per_sqrt_h=0.7))))
    assert some.belief.gyro.angle_random_walk_deg_per_sqrt_h == 0.7
    row = next(row for row in belief_rows(some) if row.key == "[gyro] angle_random_walk_deg_per_sqrt_h")
    assert row.value == "0.7" and row.source == "stated"


def test_a_named_unit_fills_before_measurement() -> None:
    filled = believed(parked(offset_radps=np.zeros(3), unit="ADIS16448"))
    sheet = datasheets.unit("adis16448")
    assert filled.belief.gyro.angle_random_walk_deg_per_sqrt_h == sheet.gyro.angle_random_walk_deg_per_sqrt_h
    assert filled.belief.gyro.bias_sigma_deg_per_h == sheet.gyro.bias_repeatability_deg_per_h
    assert filled.belief.accelerometer.bias_sigma_ug == sheet.accelerometer.bias_repeatability_ug
    assert sheet.source in filled.belief.gyro.source
    with pytest.raises(UsageError, match="no inertial unit 'adis1644'"):
        believed(parked(unit="adis1644"))


def test_a_stated_sigma_gives_way_to_an_offset_that_was_measured() -> None:
    """An honest 1000 deg/h about 0 becomes the offset at rest and what is left of it."""
    filled = believed(parked(belief=Belief(gyro=GyroBelief(bias_sigma_deg_per_h=1000.0))))
    assert filled.belief.gyro.bias_sigma_deg_per_h < 50.0
    assert "in place of 1000 about 0 as stated" in filled.belief.gyro.source
    quiet = believed(parked(offset_radps=np.zeros(3), belief=Belief(gyro=GyroBelief(bias_sigma_deg_per_h=1000.0))))
    assert quiet.belief.gyro.bias_sigma_deg_per_h < 50.0 and not any(quiet.belief.gyro.bias_radps)
    fine = believed(parked(offset_radps=np.zeros(3), belief=Belief(gyro=GyroBelief(bias_sigma_deg_per_h=0.01))))
    assert fine.belief.gyro.bias_sigma_deg_per_h == 0.01  # the unknown part of Earth rate says nothing about it


def test_gps_sigmas_come_from_the_fixes() -> None:
    recording = driven()
    plain = believed(recording).belief.gps
    assert (plain.position_sigma_m, plain.velocity_sigma_mps) == (2.5, 0.05)
    assert "hides slow errors" in plain.source
    own = replace(recording.gps, position_sigma_m=np.full(120, 4.0), velocity_sigma_mps=np.full(120, 0.3))
    stating = believed(replace(recording, gps=own)).belief.gps
    assert (stating.position_sigma_m, stating.velocity_sigma_mps) == (4.0, 0.3)
    rng = np.random.default_rng(2)
    noisy = replace(recording.gps, height_m=20.0 * rng.standard_normal(120), velocity_n=rng.standard_normal((120, 3)))
    spread = believed(replace(recording, gps=noisy)).belief.gps
    assert spread.position_sigma_m == pytest.approx(20.0, rel=0.3)
    assert spread.velocity_sigma_mps == pytest.approx(1.0, rel=0.3)


def test_nothing_below_is_unknown_for_a_moving_recording_and_a_chamber() -> None:
    belief = believed(driven()).belief
    assert "mean of the data sheets" in belief.gyro.source
    assert None not in (belief.gyro.bias_radps, belief.gyro.bias_sigma_deg_per_h, belief.accelerometer.bias_sigma_ug)
    assert believed_of_chamber(Belief()).accelerometer.bias_sigma_ug == 50.0


@pytest.mark.parametrize("kind", ["flight", "static"])
def test_where_no_noise_is_seen_the_coarsest_grade_is_believed(kind: str) -> None:
    """6 s in motion are too short to bound the noise; 60 s of constants at rest show none."""
    recording = parked(6.0 if kind == "flight" else 60.0, np.zeros(3), 0.0, 0.0, kind=kind)
    assert measure_grade(recording, recording.imu.accelerometer).grade is None
    filled = believed(recording)
    sheets = [one for one in datasheets.units().values() if one.grade == "consumer MEMS"]
    stated = [value for one in sheets if (value := one.gyro.angle_random_walk_deg_per_sqrt_h)]
    mean = np.exp(np.mean(np.log(stated)))
    assert filled.belief.gyro.angle_random_walk_deg_per_sqrt_h == pytest.approx(mean, rel=SHOWN_DIGITS)
    for table in (filled.belief.gyro, filled.belief.accelerometer):
        assert "grade consumer MEMS, the coarsest, since no noise is seen" in table.source
    why = "no stretch of 10 s is at rest." if kind == "flight" else "60 s at rest show none."
    assert filled.notes[0] == f"The grade is unknown, since no noise is seen: {why}"


# ---------------------------------------------------------------------------------------------------- pages and files


def test_pages_say_first_what_is_believed(tmp_path) -> None:
    recording = parked(120.0, offset_radps=np.zeros(3), arw=0.002, vrw=10.0, start=AIMED)
    for result in (evaluate(recording), compare(recording)):
        assert [one.heading for one in result.sections[:2]] == ["At a glance", "What is believed"]
        rows = {row["key"]: row for row in result.metrics["belief"]}
        assert "data sheets of grade navigation" in rows["[gyro] bias_sigma_deg_per_h"]["source"]
        shown = [cells[-1] for cells in result.sections[1].blocks[0].rows]
        assert rows["[gyro] bias_sigma_deg_per_h"]["source"] in shown
    assert "What grade it is" in str(evaluate(recording))
    assert "allan_deviation" in evaluate(recording).figures


def test_what_was_filled_in_is_written_with_its_source_and_read_again(tmp_path) -> None:
    filled = believed(parked(60.0, unit="mti-1"))
    form.write(filled, tmp_path / "one")
    table = tomllib.loads((tmp_path / "one" / "recording.toml").read_text())
    assert "Xsens" in table["gyro"]["source"] and table["imu"]["unit"] == "mti-1"
    again = form.read(tmp_path / "one")
    assert again.belief.gyro == filled.belief.gyro and again.unit == "mti-1"
    assert believed(again) is again
    rows = {row.key: row.source for row in belief_rows(again)}
    assert "data sheet of MTi-1" in rows["[gyro] angle_random_walk_deg_per_sqrt_h"]


def test_the_unit_of_the_command_line_is_used(tmp_path, capsys) -> None:
    form.write(parked(150.0, offset_radps=np.zeros(3), arw=0.002, vrw=10.0, start=AIMED), tmp_path / "one")
    arguments = ["compare", str(tmp_path / "one"), "--output", str(tmp_path / "page"), "--unit", "hg9900"]
    assert main(arguments) == 0
    assert "HG9900 (Honeywell)" in capsys.readouterr().out
    assert main([*arguments[:-1], "hg990"]) != 0
    assert "no inertial unit 'hg990'; did you mean 'hg9900'?" in capsys.readouterr().err


# ----------------------------------------------------------------------------------------------------------- honoured


@pytest.mark.parametrize("size_deg_per_h", [1000.0, 1500.0, 20000.0])
def test_a_stated_bias_of_any_size_is_honoured_at_rest(size_deg_per_h: float) -> None:
    bias = np.array([0.6, 0.0, 0.8]) * size_deg_per_h * DEG_PER_H
    stated = Belief(gyro=GyroBelief(bias_radps=tuple(bias), bias_sigma_deg_per_h=10.0))
    recording = parked(60.0, offset_radps=bias, belief=stated)
    assert validate(recording)
    wrong = Belief(gyro=GyroBelief(bias_radps=tuple(-bias), bias_sigma_deg_per_h=10.0))
    with pytest.raises(DataRefused, match="beside the believed bias"):
        validate(replace(recording, belief=wrong))


def test_a_large_offset_that_nobody_ruled_out_is_accepted_and_a_mix_up_of_units_is_not() -> None:
    assert validate(parked(60.0))
    recording = parked(60.0, offset_radps=np.zeros(3), arw=0.002)
    mixed = replace(recording, imu=replace(recording.imu, gyro=recording.imu.gyro / DEG))
    with pytest.raises(DataRefused, match="degrees given for radians"):
        validate(mixed)


# ---------------------------------------------------------------------------------------------------------- attributed


def test_what_a_reader_assumed_is_not_called_stated(tmp_path: Path) -> None:
    """Through the form and back: every value of the belief names who took it, the user's own excepted."""
    belief = Belief(
        gyro=GyroBelief(bias_sigma_deg_per_h=600.0, source="bias_sigma_deg_per_h: the sheet"),
        accelerometer=AccelerometerBelief(bias_sigma_ug=2e4),
        gps=GpsBelief(time_offset_s=0.2, position_sigma_m=2.5),
    )
    fixes = driven().gps
    stands = replace(fixes, latitude_rad=np.full(120, LATITUDE_RAD), velocity_n=np.zeros((120, 3)))
    recording = replace(parked(120.0), gps=stands, belief=belief)

    def sources(reader: str | None) -> dict[str, str]:
        read = attributed(recording, reader, ("gps.time_offset_s",))
        form.write(read, tmp_path / str(reader))
        return {row.key: row.source for row in belief_rows(form.read(tmp_path / str(reader)))}

    of_reader, of_user = sources("apm-mat"), sources(None)
    for key, words in {
        "[gyro] bias_sigma_deg_per_h": "the sheet",
        "[gps] lever_arm_m": "not stated, taken as 0",
        "[gps] time_offset_s": "--assume",
    }.items():
        assert of_reader[key] == of_user[key] == words
    for key in ("[accelerometer] bias_sigma_ug", "[gps] position_sigma_m"):
        assert of_reader[key] == "assumed by the reader of apm-mat, see the notes"
        assert of_user[key] == "stated"
