"""One mapping for tables, MATLAB and netCDF files: the same motion from every frame, unit, clock and file."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import scipy.io

from ins_eval.cli import main
from ins_eval.errors import DataRefused, UsageError
from ins_eval.readers import read
from ins_eval.recording import form
from ins_eval.recording.validation import validate
from tests.recording.readers import writers

ROUNDING = 1e-9  # of values that were written in full
MILLIMETRE_RAD = 1e-3 / 6.4e6
STAMP_S = 1e-6  # seconds since 1970 in 64 bits
RATE_HZ, LASTED_S = 20.0, 10.0
EPOCH = 1714558830  # 2024-05-01T10:20:30Z
GPS_LEAP_S = 18

IMU = """
kind = "drive"
axes = "FRD"
gyro = { columns = ["wx", "wy", "wz"], unit = "rad/s" }
accelerometer = { columns = ["ax", "ay", "az"], unit = "m/s^2" }
time = { column = "t", unit = "s" }
"""
START = "[start]\nlatitude_deg = 40.0\nlongitude_deg = 17.0\nheight_m = 100.0\n"


@pytest.fixture(scope="module")
def motion(weaving):
    return weaving(RATE_HZ, LASTED_S)


@pytest.fixture(scope="module")
def columns(motion):
    return writers.table(motion)


def imported(folder, content: bytes, told: str, form: str = "csv", **assumed: str):
    (folder / "log.file").write_bytes(content)
    (folder / "log.toml").write_text(told)
    return read(form, folder / "log.file", {key.replace("__", "."): value for key, value in assumed.items()})


def group(text: str, table: str = "gps") -> str:
    return f'{IMU}{START if "position" not in text else ""}[{table}]\ntime = {{ column = "t", unit = "s" }}\n{text}\n'


ORIGIN = "origin = { latitude_deg = LAT, longitude_deg = LON, height_m = H }"
POSITIONS = {
    "geodetic": 'position = { columns = ["lat", "lon", "h"], unit = "deg" }',
    "NED": f'position = {{ columns = ["n", "e", "d"], frame = "NED", {ORIGIN} }}',
    "ENU": f'position = {{ columns = ["e", "n", "u"], frame = "ENU", {ORIGIN} }}',
    "ECEF": 'position = { columns = ["x", "y", "z"], frame = "ECEF" }',
}


@pytest.mark.parametrize("frame", POSITIONS)
def test_position_only_in_every_frame(tmp_path, motion, columns, frame):
    place = {"LAT": columns["lat"][0], "LON": columns["lon"][0], "= H": motion.height[0]}
    text = POSITIONS[frame]
    for name, value in place.items():
        text = text.replace(name, f"{'= ' if '=' in name else ''}{float(value)!r}")
    recording = validate(imported(tmp_path, writers.csv(columns), group(text)))
    np.testing.assert_allclose(recording.gps.latitude_rad, motion.latitude, atol=MILLIMETRE_RAD)
    np.testing.assert_allclose(recording.gps.longitude_rad, motion.longitude, atol=MILLIMETRE_RAD)
    np.testing.assert_allclose(recording.gps.height_m, motion.height, atol=1e-3)
    assert np.isnan(recording.gps.velocity_n).all() and recording.gps.valid.all()
    np.testing.assert_allclose(recording.start.velocity_n, motion.velocity_n[0], atol=0.2)  # a difference over 50 ms
    assert "without velocity" in "\n".join(recording.notes)


def test_an_attitude_alone_is_a_reference_whatever_its_table_is_called(tmp_path, motion, columns):
    """A form whose gps has no position and no velocity could not be read again."""
    text = 'attitude = { columns = ["roll", "pitch", "heading"], unit = "deg" }'
    recording = validate(imported(tmp_path, writers.csv(columns), group(text)))
    assert recording.gps is None
    np.testing.assert_allclose(recording.reference.attitude_rad, motion.attitude, atol=ROUNDING)
    assert "it is the reference" in "\n".join(recording.notes)
    form.write(recording, tmp_path / "own")
    assert form.read(tmp_path / "own").reference is not None


VELOCITIES = {
    "NED": ('columns = ["vn", "ve", "vd"], axes = "NED"', 1.0),
    "NEU": ('columns = ["vn", "ve", "vu"], axes = "NEU"', 1.0),
    "NE": ('columns = ["vn", "ve"], axes = "NE"', 1.0),
    "EN": ('columns = ["ve", "vn"], axes = "EN"', 1.0),
    "km/h": ('columns = ["ve", "vn", "vu"], axes = "ENU", unit = "km/h"', 3.6),
    "knots": ('columns = ["ve", "vn", "vu"], axes = "ENU", unit = "knots"', 3600.0 / 1852.0),
    "course": ('columns = ["speed", "course"], axes = "speed course"', 1.0),
    "course up": ('columns = ["speed", "course", "vu"], axes = "speed course up"', 1.0),
}


@pytest.mark.parametrize("name", VELOCITIES)
def test_velocity_only_in_every_form(tmp_path, motion, columns, name):
    described, factor = VELOCITIES[name]
    scaled = columns | {key: factor * columns[key] for key in ("vn", "ve", "vd", "vu", "speed")}
    recording = imported(tmp_path, writers.csv(scaled), group(f"velocity = {{ {described} }}"))
    known = slice(0, 3 if described.count('", "') == 2 else 2)
    np.testing.assert_allclose(recording.gps.velocity_n[:, known], motion.velocity_n[:, known], atol=ROUNDING)
    assert np.isnan(recording.gps.velocity_n[:, known.stop :]).all()
    assert np.isnan(recording.gps.latitude_rad).all() and recording.gps.valid.all()


def test_what_the_user_assumes_stands_above_the_mapping(tmp_path, motion, columns):
    odd = columns | {
        "speed": 3.6 * columns["speed"],
        "vu": 3.6 * columns["vu"],
        "course": np.radians(columns["course"]),
    }
    text = 'position = { columns = ["lon", "lat", "h"], unit = "deg" }\n'
    text += 'velocity = { columns = ["speed", "course", "vu"], axes = "speed course down" }'
    recording = imported(
        tmp_path,
        writers.csv(odd),
        group(text),
        velocity__unit="km/h",
        course__unit="rad",
        velocity__axes="speed course up",
        position__order="longitude latitude",
    )
    np.testing.assert_allclose(recording.gps.velocity_n, motion.velocity_n, atol=ROUNDING)
    np.testing.assert_allclose(recording.gps.latitude_rad, motion.latitude, atol=ROUNDING)
    assert "The velocity unit is taken as km/h, because you assume so." in recording.notes


def test_velocity_of_the_earth_fixed_frame(tmp_path, motion, columns):
    text = POSITIONS["ECEF"] + '\nvelocity = { columns = ["vx", "vy", "vz"], axes = "ECEF" }'
    recording = imported(tmp_path, writers.csv(columns), group(text))
    np.testing.assert_allclose(recording.gps.velocity_n, motion.velocity_n, atol=1e-8)


@pytest.mark.parametrize("form", ["angles", "scalar first", "scalar last, ROS"])
def test_a_reference_of_attitude_only(tmp_path, motion, columns, form):
    to_enu = np.array([0.0, np.sqrt(0.5), np.sqrt(0.5), 0.0])  # NED to ENU, scalar first
    to_flu = np.array([0.0, 1.0, 0.0, 0.0])  # FLU to FRD
    ros = product(product(to_enu, writers.quaternions(motion)), to_flu)
    described = {
        "angles": 'columns = ["roll", "pitch", "heading"], unit = "deg"',
        "scalar first": 'columns = ["qw", "qx", "qy", "qz"], form = "w x y z"',
        "scalar last, ROS": 'columns = ["rx", "ry", "rz", "rw"], form = "x y z w", frame = "ENU", axes = "FLU"',
    }[form]
    held = columns | dict(zip(("rw", "rx", "ry", "rz"), ros.T, strict=True))
    recording = imported(tmp_path, writers.csv(held), group(f"attitude = {{ {described} }}", "reference"))
    np.testing.assert_allclose(recording.reference.attitude_rad, motion.attitude, atol=ROUNDING)
    assert recording.reference.valid.all() and np.isnan(recording.reference.height_m).all()


def product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Hamilton's product of quaternions, scalar first."""
    p, q = np.atleast_2d(p), np.atleast_2d(q)
    scalar = p[:, 0] * q[:, 0] - np.sum(p[:, 1:] * q[:, 1:], axis=1)
    return np.column_stack([scalar, p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])])


def test_dates_and_weeks_of_gps_are_one_clock(tmp_path, motion, columns):
    dates = [str(np.datetime64(EPOCH, "s") + np.timedelta64(round(1000 * t), "ms")) + "Z" for t in motion.time_s]
    since_1980 = EPOCH - 315964800 + GPS_LEAP_S
    week, second = divmod(since_1980, 604800)
    held = columns | {"date": dates, "week": 0 * motion.time_s + week, "sow": second + motion.time_s}
    told = group(POSITIONS["geodetic"]).replace(
        '{ column = "t", unit = "s" }\n', '{ column = "date", unit = "date" }\n', 1
    )
    told = told.replace(
        '[gps]\ntime = { column = "t", unit = "s" }', '[gps]\ntime = { column = "sow", unit = "s", week = "week" }'
    )
    recording = imported(tmp_path, writers.csv(held), told)
    np.testing.assert_allclose(recording.gps.time_s[1:], recording.imu.time_s, atol=STAMP_S)
    np.testing.assert_allclose(recording.imu.time_s, motion.time_s[1:], atol=STAMP_S)
    said = "\n".join(recording.notes)
    assert f"counted from {EPOCH} s" in said and "with 18 leap seconds" in said


def test_a_speedometer_is_a_further_column(tmp_path, motion, columns):
    told = 'speed = { column = "speed", unit = "km/h" }\n' + IMU + START
    recording = imported(tmp_path, writers.csv(columns), told)
    np.testing.assert_allclose(recording.imu.further["speed_mps"], columns["speed"][1:] / 3.6, atol=ROUNDING)


def test_what_an_ins_put_out(tmp_path, motion, columns):
    text = POSITIONS["geodetic"] + '\nvelocity = { columns = ["vn", "ve"], axes = "NE" }'
    recording = imported(tmp_path, writers.csv(columns), group(text, "solution"))
    np.testing.assert_allclose(recording.solution.velocity_n[:, :2], motion.velocity_n[:, :2], atol=ROUNDING)
    assert recording.gps is None
    only = '[solution]\ntime = { column = "t", unit = "s" }\n' + POSITIONS["geodetic"]
    alone = imported(tmp_path, writers.csv(columns), 'kind = "drive"\naxes = "FRD"\n' + only)
    assert alone.imu is None
    np.testing.assert_allclose(alone.solution.latitude_rad, recording.solution.latitude_rad)
    with pytest.raises(UsageError, match="'time' is missing, expected the columns of the imu"):
        imported(tmp_path, writers.csv(columns), 'kind = "drive"\naxes = "FRD"\n' + START)


def test_stamps_in_a_file_of_their_own(tmp_path, motion, columns):
    (tmp_path / "stamps.txt").write_text("\n".join(f"{1e3 * t:.6f}" for t in columns["t"]) + "\n")
    told = (IMU + START).replace('column = "t", unit = "s"', 'file = "stamps.txt", column = 1, unit = "ms"')
    recording = imported(tmp_path, writers.csv(columns), told)
    np.testing.assert_allclose(recording.imu.time_s, imported(tmp_path, writers.csv(columns), IMU + START).imu.time_s)
    (tmp_path / "stamps.txt").write_text("1.0\n2.0\n3.0\n")
    with pytest.raises(DataRefused, match="rows"):
        imported(tmp_path, writers.csv(columns), told)


def test_rows_without_a_value_are_outages(tmp_path, motion, columns):
    lost = np.arange(len(motion.time_s)) % 4 == 1
    holes = columns | {key: np.where(lost, np.nan, columns[key]) for key in ("lat", "vn")}
    text = POSITIONS["geodetic"] + '\nvelocity = { columns = ["vn", "ve", "vd"], axes = "NED" }'
    recording = imported(tmp_path, writers.csv(holes), group(text))
    assert len(recording.gps.time_s) == (~lost).sum()
    assert recording.gps.valid.all()


def test_rows_of_fixes_that_are_not_used_are_counted_with_the_first(tmp_path, motion, columns):
    """Rows count from 1 and the names are the first."""
    n = len(motion.time_s)
    rows = np.arange(n)
    holes = {key: columns[key] for key in ("lat", "lon", "h")} | {
        "t": np.where((rows >= 20) & (rows < 23), np.nan, columns["t"]),
        "fix": np.where(rows == 40, np.nan, 1.0 * (rows != 50)),
    }
    holes["lat"], holes["lon"] = (np.where(rows < 4, 0.0, columns[key]) for key in ("lat", "lon"))
    (tmp_path / "fixes.csv").write_bytes(writers.csv(holes))
    text = POSITIONS["geodetic"] + '\nfile = "fixes.csv"\nvalid = { column = "fix" }'
    recording = imported(tmp_path, writers.csv(columns), group(text))
    said = "\n".join(recording.notes)
    assert "Rows of gps without a time: 3, first row 22; they were left out." in said
    assert "Rows of gps that state nothing in the column of validity: 1, first row 42; they count as an outage" in said
    assert "Rows of gps at exactly 0° N 0° E: 4, first at 0 s; they count as an outage" in said
    assert len(recording.gps.time_s) == n - 3
    assert recording.gps.valid.sum() == n - 3 - 4 - 2
    assert recording.start.latitude_rad == pytest.approx(motion.latitude[4], abs=ROUNDING)


# ---------------------------------------------------------------------------------------- MATLAB and netCDF


def nested(columns) -> dict:
    imu = {name: columns[name] for name in ("t", "wx", "wy", "wz", "ax", "ay", "az")}
    return {"imu": imu, "fix": np.column_stack([columns[name][::5] for name in ("t", "lat", "lon", "h")])}


FILES = {
    "mat-4": ("mat", lambda columns: writers.matlab_4(columns)),
    "mat-5": ("mat", None),
    "mat-7.3": ("mat", lambda columns: writers.matlab_7_3(columns)),
    "netcdf": ("netcdf", lambda columns: writers.netcdf_classic(columns)),
    "netcdf-4": ("netcdf", lambda columns: writers.netcdf_4(columns)),
}


@pytest.mark.parametrize("name", FILES)
def test_variables_by_name(tmp_path, made, motion, columns, name):
    form, write = FILES[name]
    raw = made.matlab(**columns) if write is None else write(columns)
    recording = imported(tmp_path, raw, group(POSITIONS["geodetic"]), form)
    assert_is(recording, motion)
    np.testing.assert_allclose(recording.gps.latitude_rad, motion.latitude, atol=ROUNDING)


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_fields_of_structures_and_columns_of_matrices(tmp_path, made, motion, columns, version):
    held = nested(columns)
    raw = made.matlab(**held) if version == "5" else writers.matlab_7_3(held)
    told = IMU
    for field in held["imu"]:
        told = told.replace(f'"{field}"', f'"imu.{field}"')
    told += '[gps]\ntime = { column = "fix[1]", unit = "s" }\n'
    told += 'position = { columns = ["fix[2]", "fix[3]", "fix[4]"], unit = "deg" }\n'
    recording = imported(tmp_path, raw, told, "mat")
    assert_is(recording, motion)
    np.testing.assert_allclose(recording.gps.latitude_rad, motion.latitude[::5], atol=ROUNDING)
    with pytest.raises(UsageError) as refused:
        (tmp_path / "log.toml").unlink()
        read("mat", tmp_path / "log.file", {})
    listed = str(refused.value).partition("\n\n")[2]
    assert "imu.wx" in listed and "fix[1] to fix[4]" in listed


def assert_is(recording, motion):
    middle = 0.5 / RATE_HZ * (motion.rate_b[1:] + motion.rate_b[:-1])
    np.testing.assert_allclose(recording.imu.gyro, middle, atol=ROUNDING)
    felt = 0.5 / RATE_HZ * (motion.force_b[1:] + motion.force_b[:-1])
    np.testing.assert_allclose(recording.imu.accelerometer, felt, atol=ROUNDING)
    np.testing.assert_allclose(recording.imu.time_s, motion.time_s[1:], atol=ROUNDING)


def test_columns_of_different_length_are_refused(tmp_path, made, columns):
    held = columns | {"wy": columns["wy"][:-5]}
    with pytest.raises(DataRefused, match="wy has 196 rows and wx 201, expected as many"):
        imported(tmp_path, made.matlab(**held), IMU + START, "mat")


def test_packed_netcdf_and_missing_values(tmp_path, columns):
    import io

    file = io.BytesIO()
    handle = scipy.io.netcdf_file(file, "w")
    handle.createDimension("Time", len(columns["t"]))
    for name in ("t", "wx", "wy", "wz", "ax", "ay", "az"):
        handle.createVariable(name, "f8", ("Time",))[:] = columns[name]
    packed = handle.createVariable("temp", "i2", ("Time",))
    packed[:] = np.arange(len(columns["t"])) % 100
    packed.scale_factor, packed.add_offset = 0.1, 20.0
    handle.flush()
    recording = imported(tmp_path, file.getvalue(), 'temperature = { column = "temp" }\n' + IMU + START, "netcdf")
    np.testing.assert_allclose(recording.imu.temperature_c[:3], [20.1, 20.2, 20.3], atol=ROUNDING)


def test_a_library_that_is_missing_is_named(tmp_path, columns, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(UsageError, match=r"needs the library h5py.*pip install 'ins-eval\[formats\]'"):
        imported(tmp_path, b"\x89HDF\r\n\x1a\n" + bytes(600), IMU, "netcdf")


def test_the_aircraft_file_gives_its_solution(real, tmp_path):
    told = 'kind = "flight"\naxes = "FRD"\n' + START + '[solution]\ntime = { column = "Time", unit = "s" }\n'
    told += 'velocity = { columns = ["VEW", "VNS"], axes = "EN" }\n'
    told += '[gps]\ntime = { column = "Time", unit = "s" }\nvelocity = { columns = ["GGVEW", "GGVNS"], axes = "EN" }\n'
    path = real("irs_solution_flight") / "RAFdata.nc"
    (tmp_path / "raf.toml").write_text(told)
    recording = read("netcdf", path, {"mapping": str(tmp_path / "raf.toml")})
    difference = recording.solution.velocity_n - recording.gps.velocity_n
    # measured when the file came to us: inertial minus GPS, mean of five minutes
    np.testing.assert_allclose(np.nanmean(difference[:, [1, 0]], axis=0), [-0.052, -0.059], atol=5e-4)


BAD = {
    "origin = { latitude_deg": 'position = { columns = ["n", "e", "d"], frame = "NED" }',
    "has no unit, expected that of latitude": 'position = { columns = ["lat", "lon", "h"] }',
    "axes 'NE' are 2 columns, not 3": 'velocity = { columns = ["vn", "ve", "vd"], axes = "NE" }',
    "has neither position nor velocity nor attitude": "",
    "form 'w x y z' is 4 columns, not 3": 'attitude = { columns = ["qw", "qx", "qy"], form = "w x y z" }',
    "'mach' is not known": 'velocity = { columns = ["vn", "ve"], axes = "NE", unit = "mach" }',
    "there is no column 'latt' in log.file; did": 'position = { columns = ["latt", "lon"], unit = "deg" }',
}


@pytest.mark.parametrize("said", BAD)
def test_bad_groups_are_refused(tmp_path, columns, said):
    with pytest.raises(UsageError) as refused:
        imported(tmp_path, writers.csv(columns), group(BAD[said]))
    assert said in str(refused.value) and "\n" not in str(refused.value)


def test_a_mapping_that_was_written_stands_for_what_was_assumed(columns, tmp_path, capsys) -> None:
    """Assumed and then read with the written mapping alone, from another folder: the same recording."""
    (tmp_path / "log.csv").write_bytes(writers.csv(columns))
    (tmp_path / "gps.csv").write_bytes(writers.csv(columns))
    told = group(POSITIONS["geodetic"]).replace("[gps]", '[gps]\nfile = "gps.csv"').replace('"rad/s"', '"deg/s"')
    (tmp_path / "log.toml").write_text(told)
    assumed = {
        "gyro.unit": "rad/s", "axes": "FRD", "kind": "flight", "gps.time_offset_s": "0.1", "gaps": "bridge",
        "position.unit": "deg", "time.unit": "s",
    }  # fmt: skip
    options = [word for key, value in assumed.items() for word in ("--assume", f"{key}={value}")]
    mapping = tmp_path / "elsewhere" / "own.toml"
    first = ["import", "csv", str(tmp_path / "log.csv"), "-o", str(tmp_path / "one"), *options]
    assert main([*first, "--write-mapping", str(mapping)]) == 0
    assert f"mapping: {mapping}; still to be assumed: gaps" in capsys.readouterr().out
    again = ["import", "csv", str(tmp_path / "log.csv"), "-o", str(tmp_path / "two"), "--assume", f"mapping={mapping}"]
    assert main([*again, "--assume", "gaps=bridge", "--quiet"]) == 0
    one, two = (form.read(tmp_path / name) for name in ("one", "two"))
    np.testing.assert_array_equal(one.imu.gyro, two.imu.gyro)
    np.testing.assert_array_equal(one.gps.latitude_rad, two.gps.latitude_rad)
    assert (one.kind, one.start, one.belief.gps.time_offset_s) == (two.kind, two.start, two.belief.gps.time_offset_s)
    assert one.kind == "flight" and two.belief.gps.time_offset_s == 0.1


def test_a_format_without_a_mapping_writes_none(tmp_path, capsys) -> None:
    assert main(["import", "euroc", str(tmp_path), "-o", "out", "--write-mapping", str(tmp_path / "m.toml")]) == 2
    assert "euroc has no mapping" in capsys.readouterr().err
