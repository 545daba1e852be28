"""The public interface: what a notebook gets is what the command line writes."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import ins_eval as ie
from ins_eval.cli import main
from ins_eval.errors import UsageError
from tests.recording.readers.conftest import CSV_MAPPING, csv_rows, drive

EARTH_RADIUS_M = 6.371e6
GROUND = 0.02  # relative: the Earth is no sphere, and the curves of a map are thinned


@pytest.fixture(scope="module")
def flight():
    return ie.simulate("straight", rate_hz=10.0)


@pytest.fixture(scope="module")
def folder(flight, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("interface") / "flight"
    flight.write(folder)
    return folder


@pytest.fixture(scope="module")
def result(folder):
    return ie.evaluate(ie.read(folder))


def test_a_folder_that_is_not_there_is_said_to_be_missing(tmp_path):
    for ask in (ie.read, lambda folder: ie.diagnose([folder])):
        with pytest.raises(UsageError, match=r"my-fligth: there is no such folder, .* ins-eval import"):
            ask(tmp_path / "my-fligth")


def test_evaluation_is_that_of_the_command_line(folder, result, tmp_path, capsys):
    assert main(["evaluate", str(folder), "--output", str(tmp_path)]) == 0
    assert str(result).splitlines()[:3] == capsys.readouterr().out.splitlines()[:3]
    assert json.loads((tmp_path / "metrics.json").read_bytes()) == result.metrics
    frame = result.to_frame()
    for name, found in result.metrics["compensations"].items():
        assert frame.loc[name, "velocity_rms_horizontal_mps"] == found["velocity_rms_mps"]["horizontal"]


def test_frame_of_errors_holds_what_the_figures_are_made_of(result):
    """The RMS that is reported is that of the valid rows."""
    errors = result.found.errors_to_frame().loc["believed"]
    rms = np.sqrt(np.mean(errors.north_mps[errors.valid] ** 2))
    assert rms == pytest.approx(result.to_frame().loc["believed", "velocity_rms_north_mps"], rel=1e-12)


def test_result_shows_as_a_page_of_its_own(result):
    html = result._repr_html_()
    assert html.startswith("<iframe srcdoc=") and html.count("<iframe") == 1
    assert "&lt;svg" in html and "<svg" not in html


def test_figure_that_there_is_not_is_refused_with_those_meant(result):
    assert result.plot("position_error") is result.figures["position_error"]
    with pytest.raises(UsageError, match="did you mean 'position_error'"):
        result.plot("positon_error")


def test_the_ground_track_is_that_of_the_fixes_and_of_the_errors(result):
    ground, error = result.plot("ground_track").axes
    curves = {ax: {line.get_label(): line.get_xydata() for line in ax.lines} for ax in (ground, error)}
    east_km, north_km = np.ptp(curves[ground]["GPS"], axis=0)
    fixes = result.found.recording.gps
    half_angle_sines = [  # the haversine of the flight, on a sphere
        np.sin(np.ptp(fixes.latitude_rad) / 2.0) ** 2,
        np.cos(fixes.latitude_rad[[0, -1]]).prod() * np.sin(np.ptp(fixes.longitude_rad) / 2.0) ** 2,
    ]
    went_m = 2.0 * EARTH_RADIUS_M * np.arcsin(np.sqrt(sum(half_angle_sines)))
    assert 1e3 * np.hypot(east_km, north_km) == pytest.approx(went_m, rel=GROUND)
    believed = result.found.errors_to_frame().loc["believed"]
    far_m = 1e3 if error.get_xlabel() == "east [km]" else 1.0
    drawn = next(xy for name, xy in curves[error].items() if name.partition(" (same as")[0] == "believed")
    drawn_m = far_m * np.abs(drawn).max(axis=0)
    assert drawn_m == pytest.approx([believed.east_m.abs().max(), believed.north_m.abs().max()], rel=GROUND)
    assert ground.get_aspect() == error.get_aspect() == 1.0


def test_models_from_memory_are_those_of_the_files(flight, result):
    """A researcher's own triad needs no file."""
    own = ie.evaluate(flight.recording, models={"mine": flight.models["hysteresis"]}, compensations=["mine"])
    assert own.to_frame().loc["mine"].to_numpy() == pytest.approx(result.to_frame().loc["hysteresis"].to_numpy())


def test_what_is_no_recording_and_pieces_that_are_none_are_refused(flight):
    with pytest.raises(UsageError, match="evaluate takes a recording, not 'flight'; give it"):
        ie.evaluate("flight")
    for every_s in (-3.0, 0.0, np.nan):
        with pytest.raises(UsageError, match="expected at least 1; give another --restart-every"):
            ie.evaluate(flight.recording, restart_every_s=every_s)


@pytest.mark.parametrize("given", ["believed", np.zeros((4, 3))], ids=["text", "increments"])
def test_compensations_that_are_no_names_are_refused(flight, given):
    with pytest.raises(UsageError, match="compensations are a list of names"):
        ie.evaluate(flight.recording, given)


def test_a_file_is_imported_as_the_command_line_does(tmp_path):
    log = tmp_path / "log.csv"
    log.write_bytes(csv_rows(drive(10.0, 60.0)))
    log.with_suffix(".toml").write_text(CSV_MAPPING)
    (recording,) = ie.import_file("csv", log)
    assert main(["import", "csv", str(log), "-o", str(tmp_path / "out"), "--quiet"]) == 0
    again = ie.read(tmp_path / "out")
    assert recording.notes == again.notes
    np.testing.assert_array_equal(recording.imu.gyro, again.imu.gyro)


def test_instruments_that_fly_are_those_of_the_report(tmp_path):
    flown = ie.fly("straight", size=2, missions=0, seed=3, members=tmp_path / "members", workers=1, quiet=True)
    frame = flown.to_frame()
    assert frame.loc["simple"].shape[0] == 2
    rms = np.sqrt(np.mean(frame.loc["simple", "velocity_rms_horizontal"] ** 2))
    reported = flown.metrics["ensemble"]["simple"]["velocity_rms_mps"]["horizontal"]["value"]
    assert rms == pytest.approx(reported, rel=1e-12)


def test_a_chamber_is_no_recording_to_evaluate(tmp_path):
    assert main(["simulate", "chamber", "-o", str(tmp_path / "chamber"), "--quiet"]) == 0
    with pytest.raises(UsageError, match="calibrate or diagnose it"):
        ie.read(tmp_path / "chamber")
    frame = ie.calibrate([tmp_path / "chamber"]).to_frame()
    assert {"none", "simple", "quadratic", "hysteresis"} <= set(frame.index.get_level_values("model"))


def test_every_public_name_is_there():
    for name in ie.__all__:
        assert getattr(ie, name) is not None
    assert set(dir(ie)) == set(ie.__all__)
    with pytest.raises(AttributeError, match="no attribute 'evaluat'"):
        _ = ie.evaluat


def test_import_alone_loads_nothing():
    """Not even numpy: the command line and a notebook start at once."""
    script = "import sys, ins_eval; print({'numpy', 'numba', 'pandas', 'pydantic'} & set(sys.modules))"
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert result.stdout == "set()\n"
