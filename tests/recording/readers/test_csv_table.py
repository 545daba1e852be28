"""Any table with a mapping: the same motion from every unit, separator and layout; the template; each refusal."""

from __future__ import annotations

import tomllib
from types import SimpleNamespace

import numpy as np
import pytest

from ins_eval.errors import DataRefused, UsageError
from ins_eval.readers import read
from ins_eval.readers.delimited import DelimitedTable
from ins_eval.recording.validation import validate
from ins_eval.units import DEG

ROUNDING = 1e-9
STAMP_S = 1e-6  # seconds since 1970 in 64 bits
LASTED_S, RATE_HZ = 12.0, 50.0
AS_IT_IS = np.eye(3)

START = "[start]\nlatitude_deg = 40.0\nlongitude_deg = 17.0\nheight_m = 100.0\n"


@pytest.fixture(scope="module")
def motion(weaving):
    return weaving(RATE_HZ, LASTED_S)


def mapping(
    gyro: str = "rad/s", accelerometer: str = "m/s^2", axes: str = "FRD", time: str = "s", more: str = START
) -> str:
    return (
        f'kind = "drive"\naxes = "{axes}"\ntime = {{ column = "t", unit = "{time}" }}\n'
        f'gyro = {{ columns = ["wx", "wy", "wz"], unit = "{gyro}" }}\n'
        f'accelerometer = {{ columns = ["ax", "ay", "az"], unit = "{accelerometer}" }}\n{more}'
    )


def table(
    motion, time=1.0, gyro=1.0, accelerometer=1.0, separator=",", turn=AS_IT_IS, names="t wx wy wz ax ay az"
) -> str:
    columns = [time * motion.time_s, gyro * motion.rate_b @ turn, accelerometer * motion.force_b @ turn]
    rows = [separator.join(f"{value:.17g}" for value in row) for row in np.column_stack(columns)]
    return separator.join(names.split()) + "\n" + "\n".join(rows) + "\n"


def read_back(folder, rows: str, told: str, **assumed: str):
    (folder / "my.csv").write_text(rows)
    (folder / "my.toml").write_text(told)
    return read("csv", folder / "my.csv", {key.replace("__", "."): value for key, value in assumed.items()})


def assert_is(recording, motion):
    middle = 0.5 / RATE_HZ * (motion.rate_b[1:] + motion.rate_b[:-1])
    np.testing.assert_allclose(recording.imu.gyro, middle, atol=ROUNDING)
    felt = 0.5 / RATE_HZ * (motion.force_b[1:] + motion.force_b[:-1])
    np.testing.assert_allclose(recording.imu.accelerometer, felt, atol=ROUNDING)
    np.testing.assert_allclose(recording.imu.time_s, motion.time_s[1:], atol=ROUNDING)
    validate(recording)


@pytest.mark.parametrize("separator", [",", ";", "\t", "  "])
def test_separators(tmp_path, motion, separator):
    assert_is(read_back(tmp_path, table(motion, separator=separator), mapping()), motion)


@pytest.mark.parametrize(("unit", "factor"), [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_units_of_time(tmp_path, motion, unit, factor):
    assert_is(read_back(tmp_path, table(motion, time=factor), mapping(time=unit)), motion)


def test_units_of_the_sensors_from_the_mapping_and_from_the_user(tmp_path, motion):
    rows = table(motion, gyro=180.0 / np.pi, accelerometer=1000.0 / 9.80665)
    assert_is(read_back(tmp_path, rows, mapping("deg/s", "milli-g")), motion)
    assumed = {"gyro__unit": "deg/s", "accelerometer__unit": "milli-g"}
    recording = read_back(tmp_path, rows, mapping(), **assumed)
    assert_is(recording, motion)
    assert "rates in milli-g, because you assume so" in "\n".join(recording.notes)


@pytest.mark.parametrize("axes", ["RFU", "x=y,y=x,z=-z"])
def test_axes(tmp_path, motion, axes):
    """Forward-right-down (f, r, d) is written as right-forward-up (r, f, -d)."""
    turn = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    assert_is(read_back(tmp_path, table(motion, turn=turn), mapping(axes=axes)), motion)


def test_increments(tmp_path, motion):
    recording = read_back(tmp_path, table(motion, gyro=0.02, accelerometer=0.02), mapping("rad", "m/s"))
    np.testing.assert_allclose(recording.imu.gyro, 0.02 * motion.rate_b, atol=ROUNDING)
    assert recording.start.time_s == pytest.approx(-0.02, abs=ROUNDING)


def test_seconds_since_1970_lose_no_digits(tmp_path, motion):
    text = table(motion).split("\n")
    shifted = [
        text[0],
        *(f"17{k // 50:08d}.{2 * (k % 50):02d}," + row.split(",", 1)[1] for k, row in enumerate(text[1:-1])),
    ]
    recording = read_back(tmp_path, "\n".join(shifted) + "\n", mapping())
    np.testing.assert_allclose(recording.imu.time_s, motion.time_s[1:], atol=1e-6)
    assert "All times are counted from 1700000000 s" in "\n".join(recording.notes)


def test_a_table_without_names(tmp_path, motion):
    told = (
        mapping()
        .replace('"t"', "1")
        .replace('["wx", "wy", "wz"]', "[2, 3, 4]")
        .replace('["ax", "ay", "az"]', "[5, 6, 7]")
    )
    assert_is(read_back(tmp_path, table(motion).split("\n", 1)[1], "header = false\n" + told), motion)


def test_further_columns_and_beliefs(tmp_path, motion):
    rows = table(motion).split("\n")
    rows = [rows[0] + ",temp,baro,volt", *(f"{row},{20 + 0.01 * k},{100 + k},12.5" for k, row in enumerate(rows[1:-1]))]
    told = mapping(
        more='temperature = { column = "temp" }\nheight_baro = { column = "baro" }\nfurther = ["volt"]\n'
        + START
        + "attitude_deg = [0.0, 0.0, 90.0]\n[belief.gyro]\nbias_radps = [1e-3, 0.0, 0.0]\n"
    )
    recording = read_back(tmp_path, "\n".join(rows) + "\n", told)
    assert recording.imu.temperature_c[-1] == pytest.approx(26.0)
    assert recording.imu.height_baro_m[-1] == 700.0
    assert set(recording.imu.further) == {"volt"}
    assert recording.belief.gyro.bias_radps == (1e-3, 0.0, 0.0)
    assert recording.start.attitude_rad[2] == pytest.approx(0.5 * np.pi)


GPS = """
[gps]
file = "fixes.csv"
time = { column = "time", unit = "ms" }
position = { columns = ["lat", "lon", "h"], unit = "UNIT" }
velocity = { columns = ["a", "b", "c"], axes = "AXES" }
"""


@pytest.mark.parametrize(("unit", "factor"), [("deg", 180.0 / np.pi), ("rad", 1.0), ("1e-7 deg", 1.8e9 / np.pi)])
@pytest.mark.parametrize("axes", ["NED", "ENU", "speed course down"])
def test_fixes_of_another_file(tmp_path, motion, unit, factor, axes):
    north, east, down = motion.velocity_n[::10].T
    velocity = {
        "NED": [north, east, down],
        "ENU": [east, north, -down],
        "speed course down": [np.hypot(north, east), np.degrees(np.arctan2(east, north)), down],
    }[axes]
    columns = [1e3 * motion.time_s, factor * motion.latitude, factor * motion.longitude, motion.height]
    rows = np.column_stack([*(column[::10] for column in columns), *velocity])
    text = "\n".join(",".join(f"{value:.17g}" for value in row) for row in rows)
    (tmp_path / "fixes.csv").write_text(f"time,lat,lon,h,a,b,c\n{text}\n")
    recording = read_back(tmp_path, table(motion), mapping(more=GPS.replace("UNIT", unit).replace("AXES", axes)))
    np.testing.assert_allclose(recording.gps.latitude_rad, motion.latitude[::10], atol=ROUNDING)
    np.testing.assert_allclose(recording.gps.velocity_n, motion.velocity_n[::10], atol=ROUNDING)
    np.testing.assert_allclose(recording.gps.time_s, motion.time_s[::10], atol=ROUNDING)
    assert recording.start.latitude_rad == pytest.approx(motion.latitude[0], abs=ROUNDING)


def test_fixes_and_attitude_in_the_same_table(tmp_path, motion):
    rows = table(motion).split("\n")
    told = mapping(
        more='[reference]\ntime = { column = "t", unit = "s" }\n'
        'position = { columns = ["lat", "lon", "h"], unit = "rad" }\n'
        'velocity = { columns = ["vn", "ve", "vd"], axes = "NED" }\n'
        'attitude = { columns = ["roll", "pitch", "heading"], unit = "rad" }\n'
    )
    wide = [rows[0] + ",lat,lon,h,vn,ve,vd,roll,pitch,heading"]
    for k, row in enumerate(rows[1:-1]):
        fix = [motion.latitude[k], motion.longitude[k], motion.height[k], *motion.velocity_n[k], *motion.attitude[k]]
        wide.append(row + "," + ",".join(f"{v:.17g}" for v in fix) if k % 5 == 0 else row + 9 * ",")
    recording = read_back(tmp_path, "\n".join(wide) + "\n", told)
    np.testing.assert_allclose(recording.reference.attitude_rad, motion.attitude[::5], atol=ROUNDING)
    np.testing.assert_allclose(recording.start.attitude_rad, motion.attitude[0], atol=ROUNDING)


def test_a_last_row_without_line_break_is_left_out_and_said(tmp_path, motion):
    recording = read_back(tmp_path, table(motion)[:-3], mapping())
    assert len(recording.imu.time_s) == len(motion.time_s) - 2
    assert "may be cut" in "\n".join(recording.notes)


@pytest.mark.parametrize(
    ("form", "first", "unit", "said"),
    [
        ("{d}/{m}/{y}", (2024, 1, 31), "date", "are read day first, because '31/01/2024"),
        ("{m}/{d}/{y}", (2024, 1, 31), "date", "are read month first, because '01/31/2024"),
        ("{d}/{m}/{y}", (2024, 5, 12), "date", "are read day first, because '13/05/2024"),
        ("{d}.{m}.{y}", (2024, 5, 11), "date", "are read day first, because dates with points are."),
        ("{d}-{m}-{y}", (2024, 5, 11), "date day first", "are read day first, because the unit says so."),
        ("{m}/{d}/{y}", (2024, 5, 11), "date month first", "are read month first, because the unit says so."),
        ("{y}-{m}-{d}", (2024, 5, 11), "date", None),
    ],
)
def test_a_date_beyond_twelve_or_the_unit_says_whether_the_day_is_first(tmp_path, motion, form, first, unit, said):
    """6 s before midnight to 6 s after it, whatever the order."""
    midnight = np.datetime64("-".join(f"{part:02d}" for part in first)) + np.timedelta64(1, "D")
    recording = read_back(tmp_path, dated(motion, form, midnight), mapping(time=unit))
    np.testing.assert_allclose(recording.imu.time_s, motion.time_s[1:], atol=STAMP_S)
    since_1970_s = int((midnight - np.datetime64("1970-01-01")) / np.timedelta64(1, "s")) - 6
    notes = "\n".join(recording.notes)
    assert f"counted from {since_1970_s} s" in notes
    assert said in notes if said else "are read" not in notes


def dated(motion, form: str, midnight: np.datetime64) -> str:
    lines = table(motion).split("\n")
    for k, second in enumerate(motion.time_s, start=1):
        at = str(midnight + np.timedelta64(round(1e6 * (second - 6.0)), "us"))
        y, m, d = at[:10].split("-")
        lines[k] = f"{form.format(y=y, m=m, d=d)} {at[11:]},{lines[k].split(',', 1)[1]}"
    return "\n".join(lines)


def test_dates_that_leave_their_order_open_are_refused_where_it_matters(tmp_path, motion):
    rows = dated(motion, "{d}/{m}/{y}", np.datetime64("2024-05-12"))
    with pytest.raises(UsageError, match='state it with unit = "date day first" or "date month first"'):
        read_back(tmp_path, rows, mapping(time="date"))
    assert read_back(tmp_path, rows, mapping(time="date"), time__unit="date day first").imu.time_s[-1] == LASTED_S
    shown_by_one = dated(motion, "{d}/{m}/{y}", np.datetime64("2024-05-13"))
    with pytest.raises(DataRefused, match="row 302, column t: '13/05/2024 .* expected the month first"):
        read_back(tmp_path, shown_by_one, mapping(time="date month first"))
    one_day = "\n".join(rows.split("\n")[:300]) + "\n"
    said = "\n".join(read_back(tmp_path, one_day, mapping(time="date")).notes)
    assert "read month first, because nothing shows the order and all are of one day." in said


@pytest.mark.parametrize("separator", [",", "  "])
@pytest.mark.parametrize("mark", ["#", "%", "//"])
def test_comments_before_the_table_are_left_out_and_said(tmp_path, motion, mark, separator):
    rows = table(motion, separator=separator)
    before = f"{mark} logger 1, 2024\n\n{mark} rates in rad/s, forces in m/s^2\n"
    for named in (rows, f"{mark} {rows}"):  # the names may be the last comment
        recording = read_back(tmp_path, before + named, mapping())
        assert_is(recording, motion)
        said = "\n".join(recording.notes)
        assert f"Left out were 2 lines of comment before the table of my.csv, '{mark} logger 1, 2024'." in said
    with pytest.raises(DataRefused, match="row 8, column wx: 'x', expected a number"):
        read_back(tmp_path, before + line(rows, 5, "0.06,x,0,0,0,0,-9.8".replace(",", separator)), mapping())
    assert "comment" not in "\n".join(read_back(tmp_path, f"{mark}{rows}", mapping()).notes)


UNITS = "s,rad/s,rad/s,rad/s,m/s^2,m/s^2,m/s^2\n"


@pytest.mark.parametrize("separator", [",", ";", "\t", "  "])
@pytest.mark.parametrize("before", ["", "Logger: A 3\nRate,100 Hz\n\n", "logger\nserial;number;7\n"])
@pytest.mark.parametrize("units", ["", UNITS])
def test_lines_before_the_names_and_units_below_them_are_left_out_and_said(tmp_path, motion, before, units, separator):
    units = units.replace(",", separator)
    rows = before + table(motion, separator=separator).replace("\n", f"\n{units}", 1)
    recording = read_back(tmp_path, rows, mapping())
    assert_is(recording, motion)
    said = "\n".join(recording.notes)
    assert ("lines before the names of the columns" in said) == bool(before)
    assert ("Left out was 1 line of units below the names of the columns" in said) == bool(units)
    number = rows.count("\n", 0, rows.index("wx")) + 4 + bool(units)
    with pytest.raises(DataRefused, match=f"row {number}, column wx: 'x', expected a number"):
        read_back(tmp_path, line(rows, number, "0.06,x,0,0,0,0,-9.8".replace(",", separator)), mapping())


@pytest.mark.parametrize("row", ["2024-05-01 10:20:30,null,null", "null,null,null", "10:20:30,-,-"])
def test_a_first_row_without_numbers_is_a_row_and_no_line_of_units(tmp_path, row):
    (tmp_path / "fixes.csv").write_text(f"t,lat,lon\n{row}\n10:20:31,1,2\n10:20:32,1,2\n")
    assert len(DelimitedTable(tmp_path / "fixes.csv").data) == 3


def test_a_unit_that_the_table_states_otherwise_is_refused(tmp_path, motion):
    rows = table(motion, gyro=1.0 / DEG).replace("\n", f"\n{UNITS.replace('rad/s', 'deg/s')}", 1)
    with pytest.raises(UsageError, match="gyro.unit is rad/s, but my.csv states deg/s with the name of column 'wx'"):
        read_back(tmp_path, rows, mapping())
    in_name = table(motion).replace("ax", '"ax (g)"', 1)
    with pytest.raises(UsageError, match="states g with the name of column"):
        read_back(tmp_path, in_name, mapping().replace('"ax"', '"ax (g)"'))
    assert_is(read_back(tmp_path, rows, mapping("deg/s")), motion)
    insisted = read_back(tmp_path, rows, mapping("deg/s", "g"), accelerometer__unit="m/s^2")
    assert_is(insisted, motion)
    (tmp_path / "my.toml").unlink()
    assert tomllib.loads(template_of(tmp_path, rows))["gyro"]["unit"] == "deg/s"


@pytest.mark.parametrize("spelled", ["(deg/s)", "[deg/s]", "dps", "°/s", "deg/sec"])
def test_a_unit_is_held_against_the_mapping_however_a_logger_spells_it(tmp_path, motion, spelled):
    rows = table(motion, gyro=1.0 / DEG).replace("\n", f"\n{UNITS.replace('rad/s', spelled)}", 1)
    with pytest.raises(UsageError, match="gyro.unit is rad/s, but my.csv states deg/s with the name of column 'wx'"):
        read_back(tmp_path, rows, mapping())
    assert_is(read_back(tmp_path, rows, mapping("deg/s")), motion)


def test_text_in_utf_16_is_said_to_be_that(tmp_path, motion):
    (tmp_path / "my.csv").write_bytes(table(motion).encode("utf-16"))
    with pytest.raises(DataRefused, match="is text in UTF-16, expected UTF-8"):
        DelimitedTable(tmp_path / "my.csv")


def test_rows_without_a_time_count_as_missing(tmp_path, motion):
    since_1970 = SimpleNamespace(**{**vars(motion), "time_s": motion.time_s + 1.7e9})
    lines = table(since_1970).split("\n")
    for k in (1, 100):
        lines[k] = f",{lines[k].split(',', 1)[1]}"
    recording = read_back(tmp_path, "\n".join(lines), mapping())
    assert "2 rows hold no number for time, first row 2: they count as missing." in recording.notes
    assert recording.imu.filled.sum() == 2 and recording.imu.time_s.size == motion.time_s.size - 2
    np.testing.assert_allclose(recording.imu.time_s, motion.time_s[2:], atol=STAMP_S)  # no digit is lost


@pytest.mark.parametrize("fraction", [".", ","])
def test_times_of_day_go_on_after_midnight(tmp_path, motion, fraction):
    lines = table(motion, separator=";").split("\n")
    for k, second in enumerate(motion.time_s, start=1):
        at = str(np.datetime64("2024-05-12") + np.timedelta64(round(1e6 * (second - 6.0)), "us"))[11:]
        lines[k] = f"{at.replace('.', fraction)};{lines[k].split(';', 1)[1]}"
    rows = "\n".join(lines)
    recording = read_back(tmp_path, rows, mapping(time="date"))
    np.testing.assert_allclose(recording.imu.time_s - recording.start.time_s, motion.time_s[1:], atol=STAMP_S)
    assert "The column 't' of my.csv has times of day and no date: seconds since midnight." in recording.notes
    (tmp_path / "my.toml").unlink()
    assert tomllib.loads(template_of(tmp_path, rows))["time"]["unit"] == "date"
    one_has_a_date = line(rows, 5, "2024-05-11T23:59:54.06;0;0;0;0;0;-9.8")
    with pytest.raises(DataRefused, match="row 2, column t: '23:59:54.* expected a date such as"):
        read_back(tmp_path, one_has_a_date, mapping(time="date"))


def template_of(folder, rows: str) -> str:
    (folder / "my.csv").write_text(rows)
    with pytest.raises(UsageError) as refused:
        read("csv", folder / "my.csv", {})
    sentence, _, template = str(refused.value).partition("\n\n")
    assert "my.toml: there is no such mapping file" in sentence and "\n" not in sentence
    return template


@pytest.mark.parametrize(
    "names",
    [
        "t wx wy wz ax ay az",
        "time gyro_x gyro_y gyro_z accel_x accel_y accel_z",
        "TimeMS GyrX GyrY GyrZ AccX AccY AccZ",
        "timestamp angular_velocity.x angular_velocity.y angular_velocity.z linear_acceleration.x "
        "linear_acceleration.y linear_acceleration.z",
        "ts Gx Gy Gz Ax Ay Az",
    ],
)
def test_the_template_finds_the_columns_and_imports_as_it_is(tmp_path, motion, names):
    template = template_of(tmp_path, table(motion, names=names))
    told = tomllib.loads(template)
    assert [told["time"]["column"], *told["gyro"]["columns"], *told["accelerometer"]["columns"]] == names.split()
    assert "here z points down" in template and "looks like m/s^2" in template
    drive = template.replace('kind = "static"', 'kind = "drive"').replace("latitude_deg = 0.0", "latitude_deg = 40.0")
    assert_is(read_back(tmp_path, table(motion, names=names), drive), motion)


def test_the_template_guesses_units(tmp_path, motion):
    names = "t GyroX[deg/s] GyroY[deg/s] GyroZ[deg/s] ax ay az"
    rows = table(motion, time=1e6, accelerometer=1000.0 / 9.80665, names=names)
    told = tomllib.loads(template_of(tmp_path, rows))
    assert (told["time"]["unit"], told["gyro"]["unit"], told["accelerometer"]["unit"]) == ("us", "deg/s", "milli-g")


def test_the_template_leaves_open_what_it_cannot_know(tmp_path, motion):
    told = tomllib.loads(template_of(tmp_path, table(motion, names='zeit "a\\b" p2 p3 p4 p5 p6')))
    assert told["gyro"]["columns"] == ["?", "?", "?"]
    with_numbers = template_of(tmp_path, table(motion).split("\n", 1)[1])
    assert tomllib.loads(with_numbers)["header"] is False


def test_the_mapping_may_lie_elsewhere(tmp_path, motion):
    (tmp_path / "elsewhere.toml").write_text(mapping())
    (tmp_path / "my.csv").write_text(table(motion))
    assert_is(read("csv", tmp_path / "my.csv", {"mapping": str(tmp_path / "elsewhere.toml")}), motion)


def line(rows: str, number: int, text: str) -> str:
    lines = rows.split("\n")
    lines[number - 1] = text
    return "\n".join(lines)


def test_bad_tables_are_refused(tmp_path, motion):
    sound = table(motion)
    row = "0.06,0,0,0,0,0,-9.8"
    bad = {
        "row 5, column ax: 'high', expected a number": line(sound, 5, row.replace("0,0,-9.8", "high,0,-9.8")),
        "row 5, column az: '-9,8', expected a number; correct it, with a point": line(
            sound, 5, '0.06,0,0,0,0,0,"-9,8"'
        ),
        "row 2, column t: 's', expected a number": sound.replace("\n", "\ns,0.1,rad/s,rad/s,m/s2,m/s2,m/s2\n", 1),
        "accelerometer is no finite sensor value in 1 rows, first in row 5": line(sound, 5, "0.06,0,0,0,0,0,-inf"),
        "gyro is no finite sensor value in 1 rows, first in row 5": line(sound, 5, "0.06,inf,0,0,0,0,-9.8"),
        "row 5: time repeats from 0.04 to 0.04 s": line(sound, 5, "0.04,0,0,0,0,0,-9.8"),
        "cannot be read as a table": line(sound, 5, row + ",1,2"),
        "is empty": "",
        "holds no rows": "t,wx,wy,wz,ax,ay,az\n",
        "time is no finite number of seconds in 1 rows, first in row 5; remove them": line(
            sound, 5, "inf,0,0,0,0,0,-9.8"
        ),
        "0 rows hold numbers": "\n".join(("t,wx,wy,wz,ax,ay,az", *[",0,0,0,0,0,-9.8"] * 5)) + "\n",
    }
    for said, rows in bad.items():
        with pytest.raises(DataRefused) as refused:
            read_back(tmp_path, rows, mapping())
        assert said in str(refused.value) and "\n" not in str(refused.value)


def test_a_fix_is_named_by_its_line_in_the_file(tmp_path, motion):
    """Line 1 holds the names; the row without a time is passed over and counts."""
    lines = ["time,lat,lon,h,a,b,c", *(f"{1000 * k},40,17,0,0,0,0" for k in range(8))]
    told = mapping(more=GPS.replace("UNIT", "deg").replace("AXES", "NED"))
    for number, fault, said in (
        (6, "3000,40,17,0,0,0,0", "gps, row 6: time goes from 3 to 3 s"),
        (5, "3000,x,17,0,0,0,0", "row 5, column lat: 'x'"),
    ):
        spoilt = line(line("\n".join(lines), 3, ",40,17,0,0,0,0"), number, fault) + "\n"
        (tmp_path / "fixes.csv").write_text(spoilt)
        with pytest.raises(DataRefused) as refused:
            read_back(tmp_path, table(motion), told)
        assert said in str(refused.value)


def test_bad_mappings_are_refused(tmp_path, motion):
    bad = {
        "there is no column 'gx' in my.csv": mapping().replace('"wx"', '"gx"'),
        "column 'wx' stands for two axes": mapping().replace('"wy"', '"wx"'),
        "did you mean 'wx'": mapping().replace('"wx"', '"wxx"'),
        "'deg/sec' is not known; did you mean 'deg/s'": mapping(gyro="deg/sec"),
        "left-handed": mapping(axes="FRU"),
        "'kind' is missing": mapping().replace('kind = "drive"', ""),
        "unknown key 'gyros'; did you mean 'gyro'": mapping().replace("gyro =", "gyros ="),
        "has neither [start] nor [gps] nor [reference]": mapping(more=""),
        "'time.unit' is 'h'": mapping(time="h"),
        "not valid TOML": mapping() + "[",
        "fixes.csv: there is no such file": mapping(more=GPS.replace("UNIT", "deg").replace("AXES", "NED")),
    }
    for said, told in bad.items():
        with pytest.raises(UsageError) as refused:
            read_back(tmp_path, table(motion), told)
        assert said in str(refused.value) and "\n" not in str(refused.value)


def test_a_height_in_mm_is_refused_until_it_is_stated(tmp_path, motion):
    every = slice(0, None, 10)
    rows = [motion.time_s[every] * 1e3, np.degrees(motion.latitude[every]), np.degrees(motion.longitude[every])]
    rows += [1e3 * motion.height[every], *motion.velocity_n[every].T]
    text = "\n".join(["time,lat,lon,h,a,b,c", *(",".join(f"{v:.12g}" for v in row) for row in zip(*rows, strict=True))])
    (tmp_path / "fixes.csv").write_text(text + "\n")
    told = mapping(more=GPS.replace("UNIT", "deg").replace("AXES", "NED"))
    read_wrong = read_back(tmp_path, table(motion), told)
    with pytest.raises(DataRefused, match="the height is in mm and was read as m"):
        validate(read_wrong)
    in_mm = told.replace('unit = "deg"', 'unit = "deg", height_unit = "mm"')
    for right in (
        read_back(tmp_path, table(motion), told, height__unit="mm"),
        read_back(tmp_path, table(motion), in_mm),
    ):
        np.testing.assert_allclose(right.gps.height_m, motion.height[every], rtol=ROUNDING)
        assert any("in mm" in note or "as mm" in note for note in right.notes)
    local = told.replace('unit = "deg"', 'frame = "ECEF", height_unit = "mm"')
    with pytest.raises(UsageError, match="frame ECEF is in m, its height not in mm"):
        read_back(tmp_path, table(motion), local)


def test_a_latitude_in_another_unit_is_refused(tmp_path, motion):
    (tmp_path / "fixes.csv").write_text("time,lat,lon,h,a,b,c\n0,40,17,0,0,0,0\n100,40,17,0,0,0,0\n")
    told = mapping(more=GPS.replace("UNIT", "rad").replace("AXES", "NED"))
    with pytest.raises(DataRefused, match="gps: a latitude of 2291.83 .* it looks like degrees read as radians"):
        read_back(tmp_path, table(motion), told)
    assert read_back(tmp_path, table(motion), told, position__unit="deg").gps.latitude_rad[0] == pytest.approx(
        np.radians(40)
    )
