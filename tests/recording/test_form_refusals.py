"""Bad input in the form: one sentence each, with file, row and column, what was expected and what to do."""

from __future__ import annotations

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from ins_eval.errors import DataRefused, InsEvalError, UsageError
from ins_eval.recording import Imu, Recording, Start, form
from ins_eval.units import STANDARD_GRAVITY

_form = runpy.run_path(str(Path(__file__).with_name("test_form.py")))
DEG, SAMPLES = _form["DEG"], _form["SAMPLES"]
flight_of, parked, edited, as_csv, chamber = (
    _form[name] for name in ("flight_of", "parked", "edited", "as_csv", "chamber")
)


def refusal(folder: Path, kind: type[InsEvalError] = DataRefused, read=form.read) -> str:
    with pytest.raises(kind) as refused:
        read(folder)
    message = str(refused.value)
    assert type(refused.value) is kind
    assert str(folder) in message and message.isprintable() and ";" in message
    return message


@pytest.fixture
def flight() -> Recording:
    return flight_of(np.random.default_rng(5))


@pytest.fixture
def folder(tmp_path: Path, flight: Recording) -> Path:
    return form.write(flight, tmp_path / "flight")


def test_a_path_that_is_no_folder(tmp_path):
    assert "there is no such folder" in refusal(tmp_path / "nowhere", UsageError)
    path = tmp_path / "file"
    path.write_text("")
    assert "is a file" in refusal(path, UsageError)


def test_a_folder_without_description(tmp_path):
    assert "holds no recording.toml" in refusal(tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("format =", "format = =", "not valid TOML"),
        ("10.0", "1" * 5000, "not valid TOML"),
        ("format", "a = " + "[" * 5000 + "\nformat", "not valid TOML"),
        ("ins-recording/1", "ins-recording/2", "'ins-recording/2' is not known, expected ins-recording/1"),
        ('"static"', '"fligth"', "did you mean 'flight'?"),
        ("rate_hz = 10.0", "rate_hz = -10.0", "imu.rate_hz"),
        ("rate_hz = 10.0", "rate_hz = 100.0", "the samples of imu are 0.1 s apart"),
        ("rate_hz = 10.0", "rate_hz = 10000.0", "milliseconds given for seconds?"),
        ('gyro = "rate"', 'gyro = "degrees"', "imu.gyro"),
        ('gyro = "rate"\n', "", "'imu.gyro' is missing"),
        ("[imu]\n", '[imu]\naxes = "RFU"\n', "expected 'FRD'"),
        ("[imu]", "[uim]", "'[imu]' is missing"),
        ("latitude_deg = 0.0", "latitude_deg = 91.0", "start.latitude_deg"),
        ("latitude_deg = 0.0", "latitude_deg = nan", "start.latitude_deg"),
        ("height_m = 0.0", "height_m = 'high'", "start.height_m"),
        ("height_m = 0.0\n", "", "has latitude_deg and no height_m"),
        ("height_m = 0.0", "height_m = 0.0\nattitude_deg = [0.0, 1.0]", "start.attitude_deg"),
        ("time_s = 99.9", "time_s = 0.0", "set the start's time one step before the first sample"),
        ("[start]", "[earth]\nrotation = 'perhaps'\n[start]", "earth.rotation"),
        ("[start]", "[accelerometer.x]\nscale = {gamma = -1.0}\n[start]", "accelerometer.x.scale.gamma"),
        ('"static"', '"static"\naccelerometer = 5', "accelerometer"),
    ],
)
def test_a_fault_in_the_description(tmp_path, old, new, expected):
    assert expected in refusal(edited(parked(tmp_path / "r"), old, new))


def test_a_description_that_is_binary(tmp_path):
    folder = parked(tmp_path / "r")
    folder.joinpath("recording.toml").write_bytes(b"\xff\xfe\0")
    assert "not valid TOML" in refusal(folder)


def test_a_missing_table(tmp_path):
    folder = parked(tmp_path / "r")
    folder.joinpath("imu.csv").unlink()
    assert "holds neither imu.parquet nor imu.csv" in refusal(folder)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            "gyro_x",
            "gyrox",
            "the column 'gyro_x' is missing",
        ),
        ("gyro_x", "gyrox", "is it 'gyrox'?"),
        ("gyro_x,gyro_y", "a,b", "(and 1 more)"),
        ("gyro_x,gyro_y", "gyro_y,gyro_y", "'gyro_x' is missing"),
        ("time_s,gyro_x,gyro_y,gyro_z", "time_s,gyro_x,gyro_x,gyro_y,gyro_z", "row 2, column 0|Expected 8"),
        ("100.1,7.292115e-5", "100.1,nan", "row 3, column gyro_x: nan"),
        ("100.1,7.292115e-5", "100.1,", "row 3, column gyro_x: nan"),
        ("100.3,7.292115e-5", "100.3,inf", "row 5, column gyro_x: inf"),
        ("100.2,7.292115e-5", "100.2,7_000", "row 4, column gyro_x: '7_000', expected a number"),
        ("100.2,7.292115e-5", "100.2,fast\u00e9", "row 4, column gyro_x: 'fast"),
        ("100.2,", "100.1,", "row 4, column time_s: time repeats 100.1 s"),
        ("100.2,", "99.95,", "row 4, column time_s: time goes back from 100.1 to 99.95 s"),
        ("100.4,", "101.4,", "gap of 1.1 s"),
        ("100.2,", '"100.2,', "cannot be read"),
        ("-9.78\n100.3", "-9.78,1\n100.3", "row 4: Expected 7 columns, got 8"),
    ],
)
def test_a_fault_in_a_table(tmp_path, old, new, expected):
    message = refusal(edited(parked(tmp_path / "r"), old, new, "imu.csv"))
    assert any(part in message for part in expected.split("|")), message


def test_a_column_that_is_there_twice(tmp_path):
    folder = parked(tmp_path / "r")
    lines = folder.joinpath("imu.csv").read_text().splitlines()
    text = "\n".join([lines[0] + ",gyro_x", *(line + ",0" for line in lines[1:])]) + "\n"
    folder.joinpath("imu.csv").write_text(text)
    assert "the column 'gyro_x' stands there twice" in refusal(folder)


@pytest.mark.parametrize("mark", [";", "\t"])
def test_columns_that_commas_do_not_separate(tmp_path, mark):
    folder = parked(tmp_path / "r")
    path = folder / "imu.csv"
    path.write_text(path.read_text().replace(",", mark))
    assert "separate the columns by commas" in refusal(folder)


@pytest.mark.parametrize("content", [b"", b"PAR1", b"\x00\x01\x02rubbish" * 50])
@pytest.mark.parametrize("name", ["imu.csv", "imu.parquet"])
def test_a_table_that_is_none(tmp_path, content, name):
    folder = parked(tmp_path / "r")
    folder.joinpath("imu.csv").unlink()
    folder.joinpath(name).write_bytes(content)
    message = refusal(folder)
    assert "cannot be read" in message or "is missing" in message


def test_a_table_of_names_alone_and_one_of_a_single_row(tmp_path):
    folder = parked(tmp_path / "r")
    lines = folder.joinpath("imu.csv").read_text().splitlines(keepends=True)
    folder.joinpath("imu.csv").write_text(lines[0])
    assert "holds no rows" in refusal(folder)
    folder.joinpath("imu.csv").write_text("".join(lines[:2]))
    assert "holds 1 row, expected at least two" in refusal(folder)


def test_a_parquet_file_cut_short_or_with_one_bit_changed(folder):
    path = folder / "imu.parquet"
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    assert "cannot be read" in refusal(folder)
    path.write_bytes(whole[:500] + bytes([whole[500] ^ 4]) + whole[501:])
    assert "cannot be read" in refusal(folder)  # the pages carry checksums


def test_text_and_odd_types_in_a_parquet_column(folder):
    data = pa.parquet.read_table(folder / "imu.parquet")
    k = data.column_names.index("gyro_y")
    texts = pa.array(["0.0"] * 9 + ["x"] + ["0.0"] * (SAMPLES - 10))
    pa.parquet.write_table(data.set_column(k, "gyro_y", texts), folder / "imu.parquet")
    assert "row 10, column gyro_y: 'x', expected a number" in refusal(folder)
    lists = pa.array([[1.0]] * SAMPLES)
    pa.parquet.write_table(data.set_column(k, "gyro_y", lists), folder / "imu.parquet")
    assert "column gyro_y: holds values of type list" in refusal(folder)


def test_one_temperature_of_three(tmp_path):
    folder = parked(tmp_path / "r")
    lines = folder.joinpath("imu.csv").read_text().splitlines()
    text = "\n".join([lines[0] + ",temperature_x_c", *(line + ",20" for line in lines[1:])]) + "\n"
    folder.joinpath("imu.csv").write_text(text)
    assert "the column 'temperature_y_c' (and 1 more) is missing" in refusal(folder)


@pytest.mark.parametrize(
    ("column", "scale", "expected"),
    [
        ("latitude_deg", 3.0, "row 1, column latitude_deg: 103"),
        ("position_sigma_m", -1.0, "column position_sigma_m"),
        ("latitude_deg longitude_deg", DEG, "(radians given for degrees?)"),
        ("longitude_deg", -1.0, "(west given as east?)"),
        ("latitude_deg", -1.0, "(south given as north?)"),
        ("latitude_deg", 0.5, "km from the start"),
    ],
)
def test_fixes_that_cannot_be_where_they_are(folder, column, scale, expected):
    data = pa.parquet.read_table(folder / "gps.parquet").to_pydict()
    for name in column.split():
        data[name] = [scale * value for value in data[name]]
    pa.parquet.write_table(pa.table(data), folder / "gps.parquet")
    assert expected in refusal(folder)


def test_a_fix_is_named_by_its_line_in_a_csv_and_by_its_row_in_parquet(folder):
    data = pa.parquet.read_table(folder / "gps.parquet").to_pandas()
    data.loc[4, "time_s"] = data.time_s[3]
    data.to_parquet(folder / "gps.parquet", index=False)
    assert "gps.parquet, row 5, column time_s: time repeats" in refusal(folder)
    (folder / "gps.parquet").unlink()
    data.to_csv(folder / "gps.csv", index=False)
    assert "gps.csv, row 6, column time_s: time repeats" in refusal(folder)


def test_fixes_on_another_clock(folder, flight):
    late = replace(flight.gps, time_s=flight.gps.time_s + 1000.0)
    form.write(replace(flight, gps=late), folder)
    message = refusal(folder)
    assert "expected an overlap" in message and "time_offset_s in [gps]" in message


def test_a_heading_in_radians(folder, flight):
    course = np.linspace(1.0, 6.0, flight.reference.time_s.size)
    velocity = 80.0 * np.column_stack([np.cos(course), np.sin(course), 0.0 * course])
    attitude = np.column_stack([0.0 * course, 0.0 * course, course + 0.05])
    sound = replace(flight.reference, velocity_n=velocity, attitude_rad=attitude)
    form.read(form.write(replace(flight, reference=sound), folder))
    mixed = replace(sound, attitude_rad=attitude * DEG)
    form.write(replace(flight, reference=mixed), folder)
    assert "fits it as radians" in refusal(folder)


@pytest.mark.parametrize(
    ("form_of", "factor", "expected"),
    [
        ("rate", 1.0 / 9.80665, "g given for m/s^2"),
        ("increment", 1.0, "rates given for increments"),
    ],
)
@pytest.mark.parametrize("kind", ["static", "drive"])
def test_an_accelerometer_in_another_unit(tmp_path, form_of, factor, expected, kind):
    folder = edited(parked(tmp_path / "r"), 'accelerometer = "rate"', f'accelerometer = "{form_of}"')
    edited(folder, '"static"', f'"{kind}"')
    path = folder / "imu.csv"
    path.write_text(path.read_text().replace("-9.78\n", f"{-9.78 * factor}\n"))
    assert expected in refusal(folder)


@pytest.mark.parametrize(("felt_g", "said"), [(0.0, True), (1.0, False)])
def test_gravity_that_was_taken_off(tmp_path, felt_g, said):
    """Ten minutes of 0.2 m/s^2 about what is felt: whatever it did, on average it felt 0.83 g."""
    rng, time_s = np.random.default_rng(4), np.arange(0.1, 600.0, 0.1)
    force = 0.2 * rng.standard_normal((time_s.size, 3)) - [0.0, 0.0, felt_g * STANDARD_GRAVITY]
    imu = Imu(time_s, 1e-3 * rng.standard_normal((time_s.size, 3)), 0.1 * force, "increment")
    folder = form.write(Recording("phone", "drive", Start(0.0, 45.0 * DEG, 10.0 * DEG, 100.0), imu), tmp_path / "phone")
    if not said:
        form.read(folder)
        return
    assert "expected at least 0.83 g" in (message := refusal(folder)) and "gravity was taken off" in message


def test_a_chamber_where_a_recording_is_expected_and_the_reverse(tmp_path, folder):
    cold = form.write_chamber(chamber(), tmp_path / "chamber")
    assert "is of kind 'chamber'" in refusal(cold, UsageError)
    assert "is of kind 'flight'" in refusal(folder, UsageError, form.read_chamber)


@pytest.mark.parametrize(
    ("column", "row", "value", "expected"),
    [
        ("input_g", 4, 9.80665, "row 5, column input_g: 9.80665, expected +1, 0 or -1"),
        ("input_g", 4, 0.0, "row 5, column input_g: 0 in run 0 that began at +1 g"),
        ("run", 4, 0.5, "row 5, column run: 0.5, expected a whole number"),
        ("run", 25, 0, "row 26, column run: run 0 goes on after another"),
        ("output", 7, np.nan, "row 8, column output: nan"),
        ("temperature_c", 7, np.inf, "row 8, column temperature_c: inf"),
        ("time_s", 7, 6.0, "row 8, column time_s: time repeats 6.0 s"),
    ],
)
def test_a_fault_in_a_chamber(tmp_path, column, row, value, expected):
    readings = chamber()
    values = getattr(readings, column).astype(float)
    values[row] = value
    folder = form.write_chamber(replace(readings, **{column: values}), tmp_path / "c")
    assert expected in refusal(folder, read=form.read_chamber)


def test_a_chamber_with_tables_of_two_axes(tmp_path):
    folder = form.write_chamber(replace(chamber(), axis="x"), tmp_path / "c")
    edited(folder, "[accelerometer.x]", "[accelerometer.y]\n\n[accelerometer.x]")
    assert "tables of the accelerometers x and y" in refusal(folder, read=form.read_chamber)


@pytest.fixture
def two_units(tmp_path) -> Path:
    return form.write_chamber([chamber("#1"), chamber("#2")], tmp_path / "c")


@pytest.mark.parametrize(
    ("unit", "said"),
    [
        (None, "names 2 units ('#1', '#2'), expected one; choose it with --unit"),
        ("#11", "holds no unit '#11'; did you mean '#1'?"),
        ("other", "holds no unit 'other'; known are #1, #2"),
    ],
)
def test_a_chamber_of_two_units(two_units, unit, said):
    assert said in refusal(two_units, UsageError, lambda folder: form.read_chamber(folder, unit))


def test_a_unit_of_a_chamber_that_names_none(tmp_path):
    folder = form.write_chamber(chamber(unit_id=""), tmp_path / "c")
    said = refusal(folder, UsageError, lambda folder: form.read_chamber(folder, "#1"))
    assert "unit_id: is not there, so '#1' cannot be found; leave --unit away" in said


@pytest.mark.parametrize(
    ("column", "value", "expected"),
    [
        ("output", np.nan, "row 48, column output: nan"),
        ("time_s", 46.0, "row 48, column time_s: time repeats 46.0 s"),
        ("input_g", 0.0, "row 48, column input_g: 0 in run 4 that began at +1 g"),
    ],
)
def test_a_fault_in_the_rows_of_the_second_unit_is_told_by_the_row_of_the_file(two_units, column, value, expected):
    path = two_units / "chamber.parquet"
    data = pa.parquet.read_table(path)
    k = data.column_names.index(column)
    values = data.column(k).to_numpy().copy()
    values[47] = value
    pa.parquet.write_table(data.set_column(k, column, pa.array(values)), path)
    form.read_chamber(two_units, "#1")  # nothing is wrong with the first
    assert expected in refusal(two_units, read=lambda folder: form.read_chamber(folder, "#2"))


def test_accelerometers_that_cannot_share_a_table(tmp_path):
    for several in (
        [chamber("#1"), chamber("#1")],
        [chamber("#1"), replace(chamber("#2"), further={"a": np.ones(40)})],
    ):
        with pytest.raises(UsageError, match="a unit_id each and the same further columns"):
            form.write_chamber(several, tmp_path / "c")
    assert not (tmp_path / "c").exists()


@pytest.mark.parametrize("field", ["gyro", "temperature_c", "height_baro_m", "filled"])
def test_a_column_with_other_rows_than_the_times_is_not_written(tmp_path, flight, field: str) -> None:
    """Nor is the earlier recording lost."""
    kept = form.write(flight, tmp_path / "flight")
    columns = np.ones((3, 3)) if field == "gyro" else np.ones(3)
    spoiled = replace(flight, imu=replace(flight.imu, **{field: columns}))
    assert f"has 3 rows, expected {SAMPLES}" in refusal(kept, UsageError, lambda folder: form.write(spoiled, folder))
    np.testing.assert_array_equal(form.read(kept).imu.gyro, flight.imu.gyro)
