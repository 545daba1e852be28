"""The form on disk: nothing is lost on the way there and back, and its conventions hold."""

from __future__ import annotations

import dataclasses
import errno
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ins_eval.errors import StorageError, UsageError
from ins_eval.recording import ChamberReadings, Fixes, Imu, Recording, Start, form
from ins_eval.recording.belief import AxisBelief, Belief, BiasBelief, GpsBelief, ScaleBelief
from ins_eval.recording.form.toml import dumps
from ins_eval.units import through_degrees

PLACE_DEG = 1e-5  # by which fixes scatter, 1 m: by more, their start may seem to be elsewhere by chance
STEP_S = 0.01
SAMPLES = 300
DEG = np.pi / 180.0

# the worked example of the form, with three accelerometers
EXAMPLE = """
format = "ins-recording/1"
kind   = "flight"                  # flight | drive | oven | static | chamber
name   = "climb, cruise, landing"

[imu]
rate_hz       = 100.0
gyro          = "increment"
accelerometer = "pulse"
axes          = "FRD"

[start]
time_s = 0.0
latitude_deg = 34.65
longitude_deg = 108.9
height_m = 400.0
velocity_ned_mps = [0.0, 0.0, 0.0]
attitude_deg = [0.0, 0.0, 60.0]
attitude_sigma_deg = [0.003, 0.003, 0.06]
position_sigma_m = 0.0
velocity_sigma_mps = 0.0

[gps]
lever_arm_m = [0.0, 0.0, 0.0]
time_offset_s = 0.0
position_sigma_m = 2.5
velocity_sigma_mps = 0.05

[height]
source = "baro"
sigma_m = 2.0

[reference]
time_offset_s = 0.0

[earth]
rotation = true
coriolis = true
transport_rate = true
gravity_height = true
gravity_latitude = true

[gyro]
bias_radps = [0.0, 0.0, 0.0]
bias_sigma_deg_per_h = 0.014
angle_random_walk_deg_per_sqrt_h = 0.001

[accelerometer]
reference_temperature_c = 22.0
rate_filter_s = 180.0
bias_sigma_ug = 50.0
[accelerometer.x]
scale = { gamma = 320320.0, mu = -32.76, beta = 0.1008, epsilon = 88.14, eta = -0.02409, alpha = 273.0 }
bias  = { k0_ug = 300.0, omega_ug_per_c = 40.0 }
[accelerometer.y]
scale = { gamma = 320320.0 }
[accelerometer.z]
scale = { gamma = 320320.0 }
"""


def flight_of(
    rng: np.random.Generator, triad_temperatures: bool = False, attitude: bool = True, samples: int = SAMPLES
):
    """A level flight due east-north-east in pulses, with every optional thing there is."""
    time_s = STEP_S * np.arange(1, samples + 1)
    fix_s = np.arange(0.0, time_s[-1], 0.2)
    m = fix_s.size
    valid = rng.random(m) > 0.2
    valid[0] = True
    lost = np.where(valid, 1.0, np.nan)

    def place(centre_deg: float) -> np.ndarray:
        return through_degrees((centre_deg + PLACE_DEG * rng.standard_normal(m)) * DEG)

    reference = Fixes(
        time_s=fix_s + 0.05,
        latitude_rad=place(34.65),
        longitude_rad=place(108.9),
        height_m=400.0 + rng.standard_normal(m),
        velocity_n=np.full((m, 3), np.nan),
        valid=np.ones(m, dtype=bool),
        attitude_rad=through_degrees(rng.uniform(-1.0, 1.0, (m, 3))) if attitude else None,
    )
    return Recording(
        name='a "flight"\twith\n\x7f odd \\ letters, \u00e9\U0001f6eb',
        kind="flight",
        start=Start(
            time_s=0.0,
            latitude_rad=34.65 * DEG,
            longitude_rad=108.9 * DEG,
            height_m=400.1,
            velocity_n=(0.1, 0.2, -0.3),
            attitude_rad=(0.1 * DEG, -0.7 * DEG, 60.3 * DEG) if attitude else None,
            attitude_sigma_rad=(0.003 * DEG, 0.003 * DEG, 0.06 * DEG) if attitude else None,
            position_sigma_m=0.3,
            velocity_sigma_mps=0.01,
            still_until_s=None if attitude else 1.5,
        ),
        imu=Imu(
            time_s=time_s,
            gyro=1e-6 * rng.standard_normal((samples, 3)),
            accelerometer=np.rint(rng.normal((0.0, 0.0, -3203.2), 3.0, (samples, 3))),
            accelerometer_form="pulse",
            temperature_c=rng.normal(20.0, 1.0, (samples, 3) if triad_temperatures else samples),
            height_baro_m=400.0 + rng.standard_normal(samples),
            further={"supply_v": 28.0 + rng.standard_normal(samples), "state": np.arange(samples, dtype=np.int32)},
            filled=np.arange(samples) == 7,
        ),
        gps=Fixes(
            time_s=fix_s,
            latitude_rad=lost * place(34.65),
            longitude_rad=lost * place(108.9),
            height_m=lost * 400.0,
            velocity_n=lost[:, None] * rng.standard_normal((m, 3)),
            valid=valid,
            position_sigma_m=rng.random(m),
            velocity_sigma_mps=rng.random(m),
        ),
        reference=reference,
        belief=Belief.model_validate(
            {
                "gps": GpsBelief(lever_arm_m=(1.0, 0.1, -0.2), time_offset_s=1.0 / 30.0),
                "accelerometer": {
                    "velocity_random_walk_ug_per_sqrt_hz": 2.0,
                    "x": AxisBelief(
                        scale=ScaleBelief(gamma=1e6 / 3.0, mu=-32.76), bias=BiasBelief(k0_ug=0.1, omega_ug_per_c=1 / 7)
                    ),
                    "y": AxisBelief(compensation="compensation/y.toml"),
                    "colour": "red",
                },
                "imu": {"maker": "somebody", "serial": 17},
                "weather": {"wind": {"speed_mps": 3.0, "from_deg": 270}, "days": ["a", "b"]},
                "experiment": 12,
            }
        ),
        notes=("From a test.", "It has two notes."),
    )


def assert_same(one: object, other: object, where: str = "") -> None:
    """Equal to the last bit of every array and number."""
    if dataclasses.is_dataclass(one):
        assert type(one) is type(other), where
        for field in (field for field in dataclasses.fields(one) if field.compare):
            assert_same(getattr(one, field.name), getattr(other, field.name), f"{where}.{field.name}")
    elif isinstance(one, dict):
        assert list(one) == list(other), where
        for key in one:
            assert_same(one[key], other[key], f"{where}[{key}]")
    elif isinstance(one, np.ndarray):
        assert one.dtype == other.dtype and one.shape == other.shape, where
        assert np.array_equal(one, other, equal_nan=one.dtype.kind == "f"), where
    else:
        assert one == other, where


def parked(folder: Path, description: str = "", csv: str | None = None) -> Path:
    """A folder written by hand: parked at the equator, heading north; gravity by WGS-84 is 9.7803253359 m/s^2."""
    folder.mkdir(exist_ok=True)
    folder.joinpath("recording.toml").write_text(
        description
        or 'format = "ins-recording/1"\nkind = "static"\n'
        '[imu]\nrate_hz = 10.0\ngyro = "rate"\naccelerometer = "rate"\n'
        "[start]\ntime_s = 99.9\nlatitude_deg = 0.0\nlongitude_deg = 0.0\nheight_m = 0.0\n"
    )
    rows = [f"{100 + 0.1 * k:.1f},7.292115e-5,0,0,0.0,0.0,-9.78" for k in range(5)]
    folder.joinpath("imu.csv").write_text(
        csv or "time_s,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n" + "\n".join(rows) + "\n"
    )
    return folder


def edited(folder: Path, old: str, new: str, file: str = "recording.toml") -> Path:
    path = folder / file
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    return folder


@pytest.fixture
def flight() -> Recording:
    return flight_of(np.random.default_rng(5))


@pytest.fixture
def folder(tmp_path: Path, flight: Recording) -> Path:
    return form.write(flight, tmp_path / "flight")


def as_csv(folder: Path, name: str) -> Path:
    """Turn one parquet table of a folder into CSV, every digit kept."""
    data = pa.parquet.read_table(folder / f"{name}.parquet").to_pydict()
    lines = [",".join(data)] + [",".join(map(repr, row)) for row in zip(*data.values(), strict=True)]
    folder.joinpath(f"{name}.csv").write_text("\n".join(lines) + "\n")
    folder.joinpath(f"{name}.parquet").unlink()
    return folder / f"{name}.csv"


class TestThereAndBack:
    @settings(max_examples=25, deadline=None)
    @given(seed=st.integers(0, 2**32 - 1), triad_temperatures=st.booleans(), attitude=st.booleans())
    def test_every_bit_returns(self, tmp_path_factory, seed, triad_temperatures, attitude):
        recording = flight_of(np.random.default_rng(seed), triad_temperatures, attitude, samples=50)
        again = form.read(form.write(recording, tmp_path_factory.mktemp("form") / "r"))
        assert_same(again, recording)

    def test_every_bit_returns_through_csv_too(self, folder, flight):
        for name in ("imu", "gps", "reference"):
            as_csv(folder, name)
        again = form.read(folder)
        assert again.imu.further.keys() == flight.imu.further.keys()
        assert_same(replace(again, imu=replace(again.imu, further=flight.imu.further)), flight)

    def test_what_is_not_there_stays_absent(self, tmp_path, flight):
        bare = replace(
            flight,
            gps=None,
            reference=None,
            imu=replace(flight.imu, temperature_c=None, height_baro_m=None, further={}),
            start=Start(0.0, 34.65 * DEG, 108.9 * DEG, 400.0),
            belief=Belief(),
            notes=(),
        )
        assert_same(form.read(form.write(bare, tmp_path / "bare")), bare)
        assert sorted(p.name for p in (tmp_path / "bare").iterdir()) == ["imu.parquet", "recording.toml"]

    def test_the_same_recording_gives_the_same_bytes(self, tmp_path, folder, flight):
        again = form.write(flight, tmp_path / "again")
        for path in folder.iterdir():
            assert path.read_bytes() == (again / path.name).read_bytes()

    def test_a_simulated_flight_comes_back_whole(self, tmp_path):
        from ins_eval.ensemble import Plan, World
        from ins_eval.imu import Mission
        from ins_eval.profile import load

        world = World(Plan(profile="climb-cruise-landing", population="jb-kt8", seed=1))
        recording = Mission(load("climb-cruise-landing"), 2.0).record(
            world.instrument(0), world.streams(0).at("flight")
        )
        gps, start = recording.gps, recording.start
        recording = replace(
            recording,
            start=replace(
                start,
                latitude_rad=float(through_degrees(start.latitude_rad)),
                longitude_rad=float(through_degrees(start.longitude_rad)),
            ),
            gps=replace(
                gps,
                latitude_rad=through_degrees(gps.latitude_rad),
                longitude_rad=through_degrees(gps.longitude_rad),
            ),
        )
        again = form.read(form.write(recording, tmp_path / "simulated"))
        assert_same(replace(again, notes=recording.notes), recording)

    def test_an_earlier_recording_is_replaced_whole(self, folder, flight):
        form.write(replace(flight, gps=None), folder, truth=flight.reference)
        assert form.read(folder).gps is None
        assert (folder / "truth.parquet").exists()
        form.write(flight, folder)
        assert not (folder / "truth.parquet").exists()

    @pytest.mark.parametrize("name", ["gps.csv", "imu.csv", "reference.parquet"])
    def test_tables_of_another_origin_are_left_alone(self, tmp_path, flight, name):
        theirs = tmp_path / name
        theirs.write_text("theirs")
        with pytest.raises(UsageError, match=f"holds {name}, which is not ours"):
            form.write(replace(flight, reference=None), tmp_path)
        assert theirs.read_text() == "theirs"

    def test_a_write_that_fails_leaves_the_earlier_recording(self, folder, flight, monkeypatch):
        before = {path.name: path.read_bytes() for path in folder.iterdir()}

        def full_disk(file):
            raise OSError(errno.ENOSPC, "No space left on device")

        monkeypatch.setattr("ins_eval.files.os.fsync", full_disk)
        with pytest.raises(StorageError):
            form.write(replace(flight, gps=None), folder)
        assert {path.name: path.read_bytes() for path in folder.iterdir()} == before

    def test_a_path_below_a_file_is_a_storage_error(self, folder, flight):
        with pytest.raises(StorageError, match="cannot be written"):
            form.write(flight, folder / "imu.parquet")

    def test_the_truth_is_never_opened(self, folder):
        (folder / "truth.parquet").mkdir()  # opening it would fail
        (folder / "truth.csv").write_bytes(b"\0rubbish")
        form.read(folder)

    def test_chamber_readings_come_back(self, tmp_path):
        readings = replace(chamber(), axis="y", further={"chamber_c": 12 + np.arange(40.0) / 7, "remark": ["a"] * 40})
        belief = Belief(
            accelerometer={"x": AxisBelief(scale=ScaleBelief(gamma=3e5)), "y": AxisBelief(scale=ScaleBelief(gamma=2e5))}
        )
        folder = form.write_chamber(readings, tmp_path / "y", belief=belief)
        again = form.read_chamber(folder)
        assert_same(replace(again, further={}), replace(readings, further={}))
        assert again.further["chamber_c"].tolist() == readings.further["chamber_c"].tolist()
        assert again.further["remark"].tolist() == ["a"] * 40
        assert set(again.further) == {"chamber_c", "remark"}
        assert form.read_belief(folder).accelerometer == belief.accelerometer.model_copy(update={"x": None})

    def test_nothing_need_be_believed_of_what_is_to_be_calibrated(self, tmp_path):
        folder = form.write_chamber(replace(chamber(unit_id=""), axis="z"), tmp_path / "z")
        assert form.read_belief(folder) == Belief()
        assert form.read_chamber(folder).unit_id == ""
        assert form.read_chamber(folder).axis == "z"

    def test_the_axis_of_a_chamber_need_not_be_said(self, tmp_path):
        folder = form.write_chamber(chamber(), tmp_path / "c")
        assert "accelerometer.x" not in (folder / "recording.toml").read_text()
        assert form.read_chamber(folder).axis == ""

    def test_several_accelerometers_of_one_table_come_back_one_by_one(self, tmp_path):
        """Written one after another: the times of the second follow those of the first, by the step of the readings."""
        first, second = (replace(chamber(f"#{k}"), further={"supply_v": np.full(40, 5.0 + k)}) for k in (1, 2))
        folder = form.write_chamber([first, second], tmp_path / "both")
        assert_same(replace(form.read_chamber(folder, "#1"), further={}), replace(first, further={}))
        again = form.read_chamber(folder, "#2")
        assert again.time_s.tolist() == (second.time_s + 40.0).tolist()
        assert again.run.tolist() == (second.run + 4).tolist()
        assert again.output.tolist() == second.output.tolist()
        assert again.further["supply_v"].tolist() == [7.0] * 40

    def test_accelerometers_measured_side_by_side_may_share_their_times(self, tmp_path):
        """Rows of both units at every instant: each is in order by itself."""
        folder = form.write_chamber(chamber("7"), tmp_path / "c")
        path = as_csv(folder, "chamber")
        head, *rows = path.read_text().replace("'7'", "7").splitlines()
        both = [one for row in rows for one in (row, row.removesuffix("7") + "8")]
        path.write_text("\n".join([head, *both]) + "\n")
        for unit in ("7", "8"):
            assert_same(form.read_chamber(folder, unit), chamber(unit))


def chamber(unit_id: str = "JB-KT8 #1") -> ChamberReadings:
    time_s = np.arange(40.0)
    run = np.repeat(np.arange(4), 10)
    force = np.repeat([1.0, 0.0, -1.0, 0.0], 10)
    return ChamberReadings(time_s, run, force, 0 * force + 0.3, 20 + time_s / 7, 320320.0 * force, unit_id)


class TestToml:
    keys = st.text(min_size=1, max_size=5)
    leaves = (
        st.booleans()
        | st.integers(-(2**63), 2**63 - 1)
        | st.floats(allow_nan=False)
        | st.text(max_size=8)
        | st.dates()
        | st.times()
        | st.datetimes()
    )
    values = st.recursive(
        leaves, lambda below: st.lists(below, max_size=4) | st.dictionaries(st.text(), below, max_size=4)
    )

    @settings(max_examples=200, deadline=None)
    @given(st.dictionaries(keys, values, max_size=5))
    def test_a_table_comes_back(self, table):
        assert tomllib.loads(dumps(table, "head\nof two lines")) == table

    def test_floats_keep_their_last_bit_and_none_is_left_out(self):
        table = {"a": np.float64(0.1) + 0.2, "b": None, "c": {"d": {"e": (5e-324, 1e300, np.int64(3))}}}
        assert tomllib.loads(dumps(table)) == {"a": 0.1 + 0.2, "c": {"d": {"e": [5e-324, 1e300, 3]}}}


class TestConventions:
    def test_the_worked_example(self, tmp_path, folder):
        folder.joinpath("recording.toml").write_text(EXAMPLE)
        recording = form.read(folder)
        assert (recording.name, recording.kind) == ("climb, cruise, landing", "flight")
        start = recording.start
        assert (start.latitude_rad, start.longitude_rad) == (34.65 * DEG, 108.9 * DEG)
        assert start.attitude_rad == (0.0, 0.0, 60.0 * DEG)
        assert start.attitude_sigma_rad == (0.003 * DEG, 0.003 * DEG, 0.06 * DEG)
        x = recording.belief.accelerometer.x
        assert x.scale.coefficients.tolist() == [273.0, 0.1008, -0.02409, 88.14, -32.76, 320320.0]
        assert (x.bias.k0_ug, x.bias.omega_ug_per_c) == (300.0, 40.0)
        assert recording.notes == ()
        assert recording.belief.accelerometer.velocity_random_walk_ug_per_sqrt_hz is None

    def test_pulses_are_counts_over_the_sample(self, folder):
        """Level and at rest z counts -(1 g) 320320 pulse/(g s) 0.01 s = -3203.2; a row holds the counts themselves."""
        path = as_csv(folder, "imu")
        header, *rows = path.read_text().splitlines()
        fields = dict(zip(header.split(","), rows[6].split(","), strict=True))
        fields |= {"accel_x": "12", "accel_y": "-1", "accel_z": "-3203"}
        rows[6] = ",".join(fields.values())
        path.write_text("\n".join([header, *rows]) + "\n")
        imu = form.read(folder).imu
        assert imu.accelerometer_form == "pulse"
        assert imu.accelerometer[6].tolist() == [12.0, -1.0, -3203.0]

    def test_rates_become_increments_by_the_trapezoid(self, tmp_path):
        """Gyro x 1, 3, 5, 5 mrad/s at 100.0, 100.1, 100.2, 100.3 s: 0.1, then 0.2, 0.4 and 0.5 mrad."""
        text = "time_s,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n"
        for k, (rate, force) in enumerate(zip((1, 3, 5, 5), (-9.7, -9.8, -9.9, -9.7), strict=True)):
            text += f"{100 + k / 10},{rate}e-3,0,0,0,0,{force}\n"
        folder = edited(parked(tmp_path / "r", csv=text), '"static"', '"drive"')
        recording = form.read(folder)
        np.testing.assert_allclose(recording.imu.gyro[:, 0], [0.1e-3, 0.2e-3, 0.4e-3, 0.5e-3], rtol=1e-11)
        np.testing.assert_allclose(recording.imu.accelerometer[:, 2], [-0.97, -0.975, -0.985, -0.98], rtol=1e-11)
        assert recording.imu.accelerometer_form == "increment"
        assert sum("became increments by the trapezoid" in note for note in recording.notes) == 2
        # written again it is in increments, and stays
        again = form.read(form.write(recording, tmp_path / "again"))
        assert_same(again, recording)

    def test_increments_are_taken_as_they_are(self, tmp_path):
        folder = edited(parked(tmp_path / "r"), 'gyro = "rate"', 'gyro = "increment"')
        folder = edited(folder, '"static"', '"drive"')
        assert form.read(folder).imu.gyro[:, 0].tolist() == [7.292115e-5] * 5

    def test_an_outage_is_a_row_not_valid_or_without_a_number(self, folder):
        folder.joinpath("gps.parquet").unlink()
        folder.joinpath("gps.csv").write_text(
            "time_s,latitude_deg,longitude_deg,height_m,velocity_n_mps,velocity_e_mps,velocity_d_mps,valid,satellites\n"
            "0.0,34.65,108.9,400,0,0,0,1,7\n"
            "0.5,,108.9,400,0,0,0,1,7\n"
            "1.0,34.65,108.9,400,0,0,0,0,7\n"
            "1.5,34.65,108.9,400,0,nan,0,1,7\n"
            "2.0,34.65,108.9,400,0,0,0,,7\n"
            "2.5,34.65,-108.9,400,0,0,0,1,7\n"
        )
        gps = form.read(folder).gps
        assert gps.valid.tolist() == [True, False, False, False, False, True]
        assert gps.longitude_rad[5] == -108.9 * DEG
        assert np.isnan(gps.latitude_rad[1]) and np.isnan(gps.velocity_n[3, 1])

    def test_time_offsets_move_no_stamp(self, folder, flight):
        edited(folder, "[gps]\n", "[gps]\nstamped_by = 'receiver'\n")
        recording = form.read(folder)
        assert recording.belief.gps.time_offset_s == 1.0 / 30.0
        assert np.array_equal(recording.gps.time_s, flight.gps.time_s)

    def test_any_column_of_a_reference_may_be_missing(self, folder):
        folder.joinpath("reference.parquet").unlink()
        folder.joinpath("reference.csv").write_text("time_s,roll_deg,heading_deg\n0.5,1,\n1.0,2,90\n")
        reference = form.read(folder).reference
        assert np.isnan(reference.latitude_rad).all() and np.isnan(reference.velocity_n).all()
        np.testing.assert_array_equal(reference.attitude_rad, [[1 * DEG, np.nan, np.nan], [2 * DEG, np.nan, 90 * DEG]])
        folder.joinpath("reference.csv").write_text("time_s,velocity_n_mps\n0.5,1\n1.0,\n")
        reference = form.read(folder).reference
        assert reference.attitude_rad is None
        assert reference.valid.tolist() == [True, False]
        folder.joinpath("reference.csv").write_text("time_s,latitude_deg,height_m\n0.5,40,1\n1.0,40,2\n")
        recording = form.read(folder)
        assert np.isnan(recording.reference.latitude_rad).all() and np.isfinite(recording.reference.height_m).all()
        assert any("latitude without longitude" in note for note in recording.notes)

    def test_the_defaults_of_a_short_description(self, tmp_path):
        recording = form.read(parked(tmp_path / "my recording"))
        assert recording.name == "my recording"
        assert recording.belief == Belief()
        assert recording.start.attitude_rad is None

    def test_extra_keys_and_columns_never_fail(self, tmp_path):
        folder = parked(tmp_path / "r")
        edited(folder, "[imu]", "[height]\nsigma = 3\n[own]\na = 1979-05-27\n[imu]\nremark = 'x'")
        lines = folder.joinpath("imu.csv").read_text().splitlines()
        extra = ["remark,temperatur_c", *(["warm,20"] * 5)]
        folder.joinpath("imu.csv").write_text("\n".join(f"{a},{b}" for a, b in zip(lines, extra, strict=True)) + "\n")
        recording = form.read(folder)
        assert recording.imu.further["remark"].tolist() == ["warm"] * 5
        assert recording.belief.model_extra["imu"] == {"remark": "x"}
        assert any("sigma_m?" in note for note in recording.notes)
        assert any("is it temperature_c?" in note for note in recording.notes)
        again = form.read(form.write(recording, tmp_path / "again"))
        assert again.belief == recording.belief
        assert again.imu.further["remark"].tolist() == ["warm"] * 5

    def test_where_a_table_is_there_twice_the_parquet_file_counts(self, folder):
        folder.joinpath("gps.csv").write_text("rubbish")
        assert "Both gps.parquet and gps.csv are there; gps.csv was not read." in form.read(folder).notes

    def test_a_last_line_without_its_break_is_pointed_out(self, tmp_path):
        folder = parked(tmp_path / "r")
        path = folder / "imu.csv"
        path.write_text(path.read_text().rstrip("\n"))
        assert any("may be cut" in note for note in form.read(folder).notes)


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="threads are counted in /proc")
def test_reading_a_table_leaves_no_thread(tmp_path):
    """One that still ends when a refusal ends the process aborted it, once in six times."""
    folder = form.write(flight_of(np.random.default_rng(5)), tmp_path / "flight")
    counts = (
        "import os, sys; from pathlib import Path; import ins_eval.recording.form.columns as columns; "
        "before = os.listdir('/proc/self/task'); columns._parquet(Path(sys.argv[1])); "
        "print(len(before), len(os.listdir('/proc/self/task')))"
    )
    command = [sys.executable, "-c", counts, str(folder / "imu.parquet")]
    before, after = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    assert before == after
