"""Recordings from end to end, through the command line: simulated ones, and real ones where they are at hand."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from benchmark.runners.real_studies import RAF
from benchmark.worlds.real import WARM_UP
from ins_eval.cli import main
from ins_eval.commands.evaluate import Options
from ins_eval.recording import form
from ins_eval.report.json_file import as_json
from tests.test_docs import missing_figures

DOCUMENTED_HEADING_DEG = 90.6  # of the parked laser-gyro unit, by its authors
HEADING_TOLERANCE_DEG = 0.5
BELIEF_GAIN = 10.0  # horizontal velocity RMS of the FOG/MEMS drive, without and with the authors' constant biases
TRUSTED_S, TRUSTED_M = 10.0, 60.0  # how far a MEMS autopilot is off by itself after so long, at the most

# straight lines by ordinary least squares of its own rows, deg/h/degC and ug/degC
GROWN_10_S_M = 20.0  # of an industrial unit with GPS alone to start from
WARM_UP_LINES = {"gyro z": -42.7, "accelerometer z": -876.0}
LINE_TOLERANCE = 0.05  # of it: the page takes the stretches at rest, these lines all rows
WARM_UP_OFFSETS_DEG_PER_S = (0.20, -0.03, 0.38)  # of the parked MEMS unit's gyros, measured independently
OFFSET_TOLERANCE_DEG_PER_S = 0.005  # half of their last digit


@pytest.fixture
def real():
    """Path of a file in ../shared/recordings; skips where it is absent."""

    def path(*parts: str) -> Path:
        file = Path(__file__).resolve().parents[2].joinpath("shared", "recordings", *parts)
        if not file.exists():
            pytest.skip(f"the real recording ../shared/recordings/{'/'.join(parts)} is absent here")
        return file

    return path


def evaluated(folder: Path, output: Path, *options: str) -> dict:
    """Metrics of a recording, evaluated without words."""
    assert main(["evaluate", str(folder), "--output", str(output), "--quiet", *options]) == 0
    return json.loads((output / "metrics.json").read_text())


def measured(source: Path, **options) -> dict:
    """The same metrics without the page on which they stand."""
    return json.loads(as_json(Options(**options).evaluated(source).metrics))


def imported(format_name: str, file: Path, folder: Path, *assumptions: str) -> Path:
    """A real file brought into the form."""
    assumed = [word for a in assumptions for word in ("--assume", a)]
    assert main(["import", format_name, str(file), "-o", str(folder), *assumed]) == 0
    return folder


def test_simulated_flight_evaluates_to_the_flight_report_to_the_last_digit(small_report: Path, tmp_path: Path) -> None:
    assert main(["simulate", "flight", "-o", str(tmp_path / "flight"), "--quiet"]) == 0
    shown = json.loads((small_report / "metrics.json").read_text())["flight"]
    found = measured(tmp_path / "flight")["compensations"]
    assert set(shown) <= set(found)
    for name, groups in shown.items():
        for group, values in groups.items():
            assert {key: found[name][group][key] for key in values} == values, name
    believed, simple = (found[name]["velocity_rms_mps"] for name in ("believed", "simple"))
    assert believed == pytest.approx(simple, rel=1e-9)  # a simulated recording believes simple


def test_the_same_seed_writes_the_same_recording(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        assert main(["simulate", "oven", "-o", str(tmp_path / folder), "--quiet"]) == 0
    files = sorted(p.relative_to(tmp_path / "one") for p in (tmp_path / "one").rglob("*") if p.is_file())
    assert {"recording.toml", "imu.parquet", "compensation/simple.toml"} <= {str(f) for f in files}
    for file in files:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes(), file


def test_oven_recording_is_navigated_against_its_standstill(tmp_path: Path) -> None:
    assert main(["simulate", "oven", "-o", str(tmp_path / "oven"), "--quiet"]) == 0
    metrics = evaluated(tmp_path / "oven", tmp_path / "report", "--compensation", "none", "simple_refined")
    assert metrics["reference"]["kind"] == "standstill"
    rms = {name: arm["velocity_rms_mps"]["horizontal"] for name, arm in metrics["compensations"].items()}
    assert set(rms) == {"none", "simple_refined"}
    assert rms["simple_refined"] < rms["none"]


def test_wrong_belief_makes_the_evaluation_worse(tmp_path: Path) -> None:
    """A belief file replaces the recording's own; one without Coriolis must cost kilometres."""
    assert main(["simulate", "flight", "-o", str(tmp_path / "flight"), "--rate", "10", "--quiet"]) == 0
    own = (tmp_path / "flight" / "recording.toml").read_text()
    (tmp_path / "wrong.toml").write_text(own.replace("coriolis = true", "coriolis = false"))
    right = measured(tmp_path / "flight", compensation=["believed"])
    wrong = measured(tmp_path / "flight", compensation=["believed"], belief=tmp_path / "wrong.toml")
    final = [m["compensations"]["believed"]["final_radial_error_m"] for m in (right, wrong)]
    assert final[1] > final[0] + 5000.0


def test_name_of_no_compensation_is_refused(tmp_path: Path, capsys) -> None:
    assert main(["simulate", "oven", "-o", str(tmp_path / "oven"), "--quiet"]) == 0
    assert main(["evaluate", str(tmp_path / "oven"), "--compensation", "simpel", "--quiet"]) == 2
    assert "did you mean 'simple'" in capsys.readouterr().err


def test_laser_gyro_through_the_form_is_the_same_as_read_directly(real, tmp_path: Path) -> None:
    file = real("rlg_static_vehicle", "lasergyro.imu")
    direct = evaluated(file, tmp_path / "direct")
    through = measured(imported("psins-text", file, tmp_path / "folder"))
    for metrics in (direct, through):
        assert abs(metrics["alignment"]["heading_deg"] - DOCUMENTED_HEADING_DEG) < HEADING_TOLERANCE_DEG
        del metrics["recording"]["notes"]
    assert direct == through


def test_believed_biases_improve_the_real_drive(real, tmp_path: Path) -> None:
    folder = imported("psins-mat", real("fog_mems_vehicle", "transfer_align_fog_mems.mat"), tmp_path / "drive")
    arms = measured(folder)["compensations"]
    none, believed = (arms[name]["velocity_rms_mps"]["horizontal"] for name in ("none", "believed"))
    assert believed * BELIEF_GAIN < none


@pytest.mark.parametrize(
    ("format_name", "parts"),
    [
        ("apm-mat", ("plane_flight_gps_latency", "TestLog2.mat")),
        pytest.param("apm-text", ("quad_flight_gps_latency", "quad106.zip"), marks=pytest.mark.slow),
    ],
)
def test_real_mems_flights_are_evaluated_between_fixes(real, tmp_path: Path, format_name: str, parts) -> None:
    folder = imported(format_name, real(*parts), tmp_path / "flight")
    found = evaluated(folder, tmp_path / "report", "--restart-every", "30")
    assert missing_figures("evaluate", found) == []
    pieces = found["restarts"]["none"]
    assert pieces["count"] >= 15
    growth = dict(zip(pieces["after_s"], pieces["position_rms_m"], strict=True))
    assert growth[TRUSTED_S] < TRUSTED_M < growth[30.0]
    assert ": started afresh from a fix" in (tmp_path / "report" / "report.txt").read_text()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("format_name", "parts", "offset_s"),
    [
        ("apm-mat", ("plane_flight_gps_latency", "TestLog2.mat"), "0.2694"),
        ("apm-text", ("quad_flight_gps_latency", "quad106.zip"), "0.1919"),
    ],
)
def test_real_mems_flights_are_restarted_with_gps_only(real, tmp_path: Path, format_name, parts, offset_s) -> None:
    """Attitude and reference of the autopilot are taken away; the offset of the clocks is the one the import names."""
    known = form.read(imported(format_name, real(*parts), tmp_path / "flight", f"gps.time_offset_s={offset_s}"))
    blind = replace(known, reference=None, start=replace(known.start, attitude_rad=None, attitude_sigma_rad=None))
    folder = form.write(blind, tmp_path / "blind")
    for every_s in (10, 30):
        pieces = evaluated(folder, tmp_path / f"{every_s}", "--restart-every", str(every_s))["restarts"]["none"]
        low, high = pieces["position_interval95_m"][9]
        assert pieces["count"] >= 10 and low < pieces["position_rms_m"][9] < high
        assert pieces["position_rms_m"][9] < GROWN_10_S_M


def test_a_parked_mems_unit_comes_from_its_raw_text_to_a_page(real, tmp_path: Path) -> None:
    """Stamps stand in a file of their own, no attitude and no belief is stated, single samples are missing."""
    for name in ("F00379_B.gz", "F00379_Bt.gz"):
        shutil.copy(real("mems_static_warmup", name), tmp_path / name)
    (tmp_path / "F00379_B.toml").write_text(WARM_UP)
    found = evaluated(imported("csv", tmp_path / "F00379_B.gz", tmp_path / "vn"), tmp_path / "page")
    assert found["recording"]["filled_samples"] > 30
    assert found["alignment"]["heading_known"] is False
    offsets = [found["grade"]["gyro_offset_deg_per_h"][axis]["value"] / 3600.0 for axis in "xyz"]
    assert offsets == pytest.approx(WARM_UP_OFFSETS_DEG_PER_S, abs=OFFSET_TOLERANCE_DEG_PER_S)
    assert found["grade"]["grade"] == "industrial MEMS"
    assert (tmp_path / "page" / "figures" / "allan_deviation.svg").exists()
    laws = found["grade"]["temperature_laws"]
    for channel, line in WARM_UP_LINES.items():
        assert laws[channel]["slope"] == pytest.approx(line, rel=LINE_TOLERANCE)
    assert (tmp_path / "page" / "figures" / "temperature_laws.svg").exists()


def test_what_a_real_ins_put_out_comes_from_its_netcdf_to_a_page(real, tmp_path: Path) -> None:
    """There is no IMU; documented are means of -0.052 east and -0.059 m/s north, and that 5 minutes carry no CEP."""
    shutil.copy(real("irs_solution_flight", "RAFdata.nc"), tmp_path / "raf.nc")
    (tmp_path / "raf.toml").write_text(RAF)
    found = evaluated(imported("netcdf", tmp_path / "raf.nc", tmp_path / "raf"), tmp_path / "page")["solution"]
    mean = found["velocity_mean_mps"]
    assert mean["east"]["value"] == pytest.approx(-0.052, abs=5e-4)
    assert mean["north"]["value"] == pytest.approx(-0.059, abs=5e-4)
    assert "no radial error rate and no CEP" in " ".join((tmp_path / "page" / "report.txt").read_text().split())


@pytest.mark.parametrize(
    ("format_name", "parts", "said"),
    [
        ("cats", ("rocket_flight_temperature", "imu.csv.gz"), "before lift-off"),
        ("mems-chamber", ("accel_thermal_chamber", "Sample_data.csv.gz"), "one position"),
    ],
)
def test_what_cannot_be_evaluated_is_refused_with_the_reason(
    real, tmp_path: Path, capsys, format_name: str, parts, said: str
) -> None:
    assert main(["import", format_name, str(real(*parts)), "-o", str(tmp_path / "never")]) == 3
    assert said in capsys.readouterr().err
    assert not (tmp_path / "never").exists()
