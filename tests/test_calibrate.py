"""Chamber recordings and their calibration, from end to end."""

from __future__ import annotations

import json
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ins_eval.calibration.four_point import four_point
from ins_eval.commands import calibrate, evaluate, simulate
from ins_eval.compensation.file import read_model
from ins_eval.ensemble import Plan, World
from ins_eval.errors import DataRefused, InsEvalError, StorageError, UsageError
from ins_eval.navigation import samples
from ins_eval.recording import ChamberReadings, form

textbook_chamber = runpy.run_path(str(Path(__file__).with_name("calibration") / "conftest.py"))["textbook_chamber"]

GAMMA = {"JB-KT8 #1": 320320.0, "JB-KT8 #2": 308000.0, "JB-KT8 #3": 328000.0}  # Paper A, eqs (15)-(17), pulse/(g s)
MU = {"JB-KT8 #1": -32.76, "JB-KT8 #2": -49.81, "JB-KT8 #3": -41.14}  # likewise, pulse/(g s) per degC
GAMMA_TOLERANCE = 1e-3  # repeatability 30 ppm, the magnet's loop 200 ppm, half the loop of the rate
MU_TOLERANCE = 0.05  # the magnet's loop tilts the middle line, too
EQ_15 = {"alpha": 273.0, "beta": 0.1008, "eta": -0.02409, "epsilon": 88.14, "mu": -32.76, "gamma": 320320.0}
TRAVEL_C = 260  # 22 -> -60 -> 70 -> 22 degC
ROUND_OFF = 1e-6  # of a coefficient, fitted to readings without noise


def eq_15(temperature_c, rate_c_per_min):
    difference, rate, c = temperature_c - 22.0, rate_c_per_min, EQ_15
    of_rate = (c["alpha"] * rate + c["eta"] * difference + c["epsilon"]) * rate
    return of_rate + (c["beta"] * difference + c["mu"]) * difference + c["gamma"]


def bias_ug(temperature_c, rate_c_per_min):
    return 300.0 + 40.0 * (temperature_c - 22.0) + 0.0 * rate_c_per_min


def textbook(ramps=(0.3, 0.5, 0.9), **changed) -> ChamberReadings:
    return replace(textbook_chamber(eq_15, bias_ug, ramps), unit_id="textbook", **changed)


def only(readings: ChamberReadings, kept: np.ndarray) -> ChamberReadings:
    names = ("time_s", "run", "input_g", "rate_c_per_min", "temperature_c", "output")
    return replace(readings, **{name: getattr(readings, name)[kept] for name in names})


def while_falling(readings: ChamberReadings) -> ChamberReadings:
    """The first leg of every run, from 15 to -55 degC."""
    kept = (readings.temperature_c < 15.0) & (readings.temperature_c > -55.0)
    for run in np.unique(readings.run):
        rows = np.flatnonzero(readings.run == run)
        kept[rows[np.argmin(readings.temperature_c[rows]) :]] = False
    return only(readings, kept)


def calibrated(folder: Path, output: Path, **options) -> tuple[dict, str]:
    """Metrics and text of a calibration."""
    assert calibrate.run([folder], output=output, quiet=True, **options) == 0
    return json.loads((output / "metrics.json").read_text()), (output / "report.txt").read_text()


# ------------------------------------------------------------------------------------------------ the chamber


@pytest.fixture(scope="module")
def printed(tmp_path_factory) -> Path:
    """The three printed units in one table, without dwells."""
    folder = tmp_path_factory.mktemp("chamber") / "units"
    assert simulate.run("chamber", folder, unit="all", dwell_s=0.0, quiet=True) == 0
    return folder


@pytest.mark.parametrize("unit", GAMMA)
def test_simulated_units_have_the_printed_scale_factors(printed, unit):
    points = four_point(form.read_chamber(printed, unit))
    _, slope, level = np.polyfit(points.temperature_c - 22.0, points.scale, 2)
    assert level == pytest.approx(GAMMA[unit], rel=GAMMA_TOLERANCE)
    assert slope == pytest.approx(MU[unit], rel=MU_TOLERANCE)


def test_units_in_one_chamber_feel_the_same_air_and_err_each_by_itself(printed):
    one, two = (form.read_chamber(printed, unit) for unit in ("JB-KT8 #1", "JB-KT8 #2"))
    assert one.further["chamber_c"].min() == pytest.approx(-60.0, abs=1.0)
    assert one.further["chamber_c"].max() == pytest.approx(70.0, abs=1.0)
    assert one.temperature_c.tolist() == two.temperature_c.tolist()
    left = [r.output - r.output.mean() for r in (one, two)]
    assert (left[0] != left[1]).any()
    assert one.axis == ""


@pytest.mark.parametrize(("dwell_s", "minutes"), [(0.0, 0.0), (60.0, 1.0), (None, 3.0)])
def test_ramps_and_dwells_make_the_programme(tmp_path, dwell_s, minutes):
    """A run travels 260 degC at its ramp and waits at each of 260 whole degrees; one reading a minute."""
    simulate.run("chamber", tmp_path / "c", axis="y", ramps_c_per_min=[0.5, 2.0], dwell_s=dwell_s, quiet=True)
    readings = form.read_chamber(tmp_path / "c")
    assert np.unique(readings.rate_c_per_min).tolist() == [0.5, 2.0]
    assert (readings.axis, readings.unit_id) == ("y", "instrument 0 y")
    for run, ramp in ((0, 0.5), (4, 2.0)):
        assert np.count_nonzero(readings.run == run) == pytest.approx(TRAVEL_C / ramp + TRAVEL_C * minutes, abs=1.0)


def test_the_same_seed_writes_the_same_chamber(tmp_path):
    for folder in "ab":
        simulate.run("chamber", tmp_path / folder, unit="JB-KT8 #3", axis="z", dwell_s=0.0, seed=4, quiet=True)
    for name in ("chamber.parquet", "recording.toml"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    assert form.read_chamber(tmp_path / "a").axis == "z"


@pytest.mark.parametrize(
    ("kind", "options", "said"),
    [
        ("chamber", {"unit": "JB-KT8 #4"}, "did you mean 'JB-KT8 #"),
        ("chamber", {"ramps_c_per_min": [0.3, 0.0]}, "--ramps 0: expected 0.01 to 10 degC/min"),
        ("chamber", {"ramps_c_per_min": [float("nan")]}, "--ramps nan: expected"),
        ("chamber", {"dwell_s": -1.0}, "--dwell -1: expected 0 to 3600 s"),
        ("oven", {"unit": "all"}, "--unit is of a chamber"),
        ("flight", {"dwell_s": 0.0}, "--dwell is of a chamber"),
    ],
)
def test_chambers_that_cannot_be(tmp_path, kind, options, said):
    with pytest.raises(UsageError, match=said):
        simulate.run(kind, tmp_path / "never", quiet=True, **options)
    assert not (tmp_path / "never").exists()


# ------------------------------------------------------------------------------------------------ its calibration


def test_textbook_coefficients_come_back(tmp_path):
    """Without noise the six terms of eq. (15) and the line of the bias are found, at ramps of three rates."""
    folder = form.write_chamber(textbook(), tmp_path / "c")
    metrics, text = calibrated(folder, tmp_path / "report", model_file=tmp_path / "it.toml")
    (unit,) = metrics["accelerometers"]
    found = {term["name"]: term for term in unit["models"]["hysteresis"]["scale"]["terms"]}
    for name, value in EQ_15.items():
        assert found[name]["value"] == pytest.approx(value, rel=ROUND_OFF), name
    bias = {term["name"]: term["value"] for term in unit["models"]["simple"]["bias"]["terms"]}
    assert bias == pytest.approx({"mu": 40.0, "gamma": 300.0}, rel=ROUND_OFF)
    assert unit["determined"] | {"rank": 6, "steady_rank": 6, "hysteresis": True} == unit["determined"]
    assert metrics["compensation"]["model"] == "hysteresis"
    # 1 g at 60 degC, rising by 0.5 degC/min
    model, at = read_model(tmp_path / "it.toml"), (np.array([60.0]), np.array([0.5]))
    force = model.specific_force(
        type("Samples", (), {"output": eq_15(*at), "temperature_c": at[0], "rate_c_per_min": at[1]})()
    )
    assert force[0] == pytest.approx(9.80665 * (1.0 - 1e-6 * bias_ug(*at)[0]), rel=1e-6)
    assert "320320" in text and "Rank 6 of 6" in text


def test_every_printed_unit_is_calibrated_by_its_name(printed, tmp_path, monkeypatch, capsys):
    """Hysteresis leaves less than quadratic, quadratic less than simple, as in Table 4; the report says where it is."""
    monkeypatch.chdir(tmp_path)
    assert calibrate.run([printed], unit="JB-KT8 #2", model_file=Path("hysteresis.toml")) == 0
    out = capsys.readouterr().out
    folder = tmp_path / "reports" / "units-JB-KT8-2-calibration"
    assert "page: reports/units-JB-KT8-2-calibration/index.html" in out
    assert "model: hysteresis.toml" in out
    assert out.startswith("JB-KT8 #2: the scale factor moves by")
    (unit,) = json.loads((folder / "metrics.json").read_text())["accelerometers"]
    left = [unit["models"][name]["scale"]["sensitivity_ppm_per_c"] for name in ("simple", "quadratic", "hysteresis")]
    assert unit["sensitivity_ppm_per_c"] > left[0] > left[1] > left[2] > 0.0
    page = (folder / "index.html").read_text()
    assert page.count('role="img"') == 5
    assert read_model("hysteresis.toml").name == "hysteresis from file"  # not taken for the built-in one


def test_one_rate_leaves_hysteresis_open(tmp_path):
    folder = form.write_chamber(textbook(ramps=(0.5,)), tmp_path / "c")
    metrics, text = calibrated(folder, tmp_path / "report", model_file=tmp_path / "it.toml")
    assert metrics["compensation"] | {"model": "quadratic", "asked": None} == metrics["compensation"]
    text = " ".join(text.split())
    assert "One rate (0.5 °C/min) cannot separate alpha from gamma" in text
    assert "0.25 or 1 °C/min" in text
    assert "do not determine the hysteresis compensation; the best that they determine is quadratic" in text


def test_one_direction_leaves_hysteresis_open_but_gives_it_where_it_is_asked_for(tmp_path):
    folder = form.write_chamber(while_falling(textbook()), tmp_path / "c")
    metrics, text = calibrated(folder, tmp_path / "report", compensation="hysteresis")
    determined = metrics["accelerometers"][0]["determined"]
    assert determined | {"directions": ["falling"], "hysteresis": False} == determined
    assert metrics["compensation"]["model"] == "hysteresis"
    assert "Record the way back" in " ".join(text.split())


@pytest.fixture(scope="module")
def instrument(tmp_path_factory) -> Path:
    """Chambers of the three axes of an instrument, its flight, and the file of three axes made of the chambers."""
    folder = tmp_path_factory.mktemp("instrument")
    for axis in "xyz":
        simulate.run("chamber", folder / axis, axis=axis, quiet=True)
    simulate.run("flight", folder / "flight", rate_hz=10.0, quiet=True)
    chambers = [folder / axis for axis in "zxy"]
    assert calibrate.run(chambers, model_file=folder / "mine.toml", output=folder / "report", quiet=True) == 0
    return folder


def test_calibrated_file_evaluates_a_flight_to_the_last_digit(instrument, tmp_path):
    """The file made from the chamber recordings is the model that was calibrated beside the simulated flight."""
    mine = str(instrument / "mine.toml")
    evaluate.run([instrument / "flight"], tmp_path, compensation=["hysteresis", mine], quiet=True)
    found = json.loads((tmp_path / "metrics.json").read_text())["compensations"]
    assert found[mine] == found["hysteresis"]


def test_report_of_three_axes_tells_them_apart(instrument):
    text = (instrument / "report" / "report.txt").read_text()
    for axis in "xyz":
        assert f"Scale factor of {axis}" in text
        assert (instrument / "report" / "figures" / f"{axis}_scale_against_temperature.svg").exists()


def test_calibrated_file_is_flown_as_it_is(instrument):
    """In the ensemble its own instrument gets what fitting the model there gives; another one gets the same curves."""
    mine = str(instrument / "mine.toml")
    world = World(Plan(arms=("hysteresis", mine, f"{mine}_refined", "hysteresis_refined")))
    triads = [world.triads(index) for index in (0, 1)]
    recording = world.flight.record(world.instrument(0), world.streams(0).at("flight"))
    for axis, seen in enumerate(samples(recording)):
        force = {arm: triad[axis].specific_force(seen) for arm, triad in triads[0].items()}
        assert (force[mine] == force["hysteresis"]).all()
        assert (force[f"{mine}_refined"] == force["hysteresis_refined"]).all()
        assert (triads[1][mine][axis].specific_force(seen) == force[mine]).all()


# ------------------------------------------------------------------------------------------------ bad input


def without_minus_one_g() -> ChamberReadings:
    readings = textbook((0.5,))
    return only(readings, readings.input_g > -0.5)


BAD = {
    "a position is missing": (without_minus_one_g, DataRefused, "0 of the 1 run.s. at -1 g found"),
    "one temperature": (
        lambda: only(textbook((0.5,)), textbook((0.5,)).temperature_c == 22.0),
        DataRefused,
        "stays between 22.00 and 22.00 degC",
    ),
    "times go back": (
        lambda: replace(textbook((0.5,)), time_s=textbook((0.5,)).time_s[::-1]),
        DataRefused,
        "row 2, column time_s: time goes back",
    ),
    "upside down": (
        lambda: replace(textbook((0.5,)), output=-textbook((0.5,)).output),
        DataRefused,
        "at \\+1 g is not above that at -1 g",
    ),
}


def refused(kind: type[InsEvalError], said: str, chambers: list[Path], **options) -> None:
    with pytest.raises(kind, match=said) as found:
        calibrate.run(chambers, quiet=True, **options)
    assert type(found.value) is kind
    assert "\n" not in str(found.value)


@pytest.mark.parametrize("fault", BAD)
def test_readings_that_are_no_calibration(tmp_path, fault):
    make, kind, said = BAD[fault]
    folder = form.write_chamber(make(), tmp_path / "c")
    refused(kind, f"{folder}.*{said}", [folder], output=tmp_path / "out", model_file=tmp_path / "m.toml")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"unit": "JB-KT8 #9"}, "holds no unit 'JB-KT8 #9'"),
        ({}, "names 3 units .*choose it with --unit"),
        ({"unit": "JB-KT8 #1", "compensation": "hysterisis"}, "did you mean 'hysteresis'"),
        ({"unit": "JB-KT8 #1", "model_file": Path("model.json")}, "a compensation file ends in .toml"),
    ],
)
def test_options_that_do_not_fit(printed, tmp_path, options, said):
    refused(UsageError, said, [printed], output=tmp_path / "out", **options)
    assert not (tmp_path / "out").exists()


def test_chambers_that_do_not_make_an_instrument(tmp_path):
    of = {axis: form.write_chamber(textbook((0.5,), axis=axis), tmp_path / (axis or "none")) for axis in ("x", "y", "")}
    twin = form.write_chamber(textbook((0.5,), axis="x"), tmp_path / "twin")
    output = tmp_path / "out"
    refused(UsageError, "2 chamber recordings given", [of["x"], of["y"]], output=output)
    refused(UsageError, "both of axis x", [of["x"], of["y"], twin], output=output)
    refused(UsageError, "does not say which axis", [of["x"], of["y"], of[""]], output=output)
    assert not output.exists()


def test_what_is_no_chamber(instrument, tmp_path):
    refused(UsageError, 'expected kind = "chamber"', [instrument / "flight"], output=tmp_path / "out")
    refused(UsageError, "there is no such folder", [tmp_path / "nowhere"], output=tmp_path / "out")
    refused(DataRefused, "holds no recording.toml", [tmp_path], output=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_folders_that_cannot_be_written(tmp_path):
    folder = form.write_chamber(textbook((0.5,)), tmp_path / "c")
    (tmp_path / "file").write_text("")
    refused(StorageError, "cannot be written", [folder], output=tmp_path / "file" / "out")
    model = tmp_path / "file" / "m.toml"
    refused(StorageError, "cannot be written", [folder], output=tmp_path / "out", model_file=model)
