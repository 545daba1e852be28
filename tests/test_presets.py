"""Data sheets against the printed tables, and the verb that lists everything that ships with values of its own."""

from __future__ import annotations

from math import hypot
from pathlib import Path

import pytest

from ins_eval import datasheets
from ins_eval.accelerometer import Population
from ins_eval.commands import presets
from ins_eval.errors import UsageError
from ins_eval.gyro import GyroPopulation

# Paper A, Table 1
TABLE_1 = {
    "qa3000-030": {
        "input_range_g": 60.0,
        "bias_repeatability_ug": 40.0,
        "bias_temperature_ug_per_c": 15.0,
        "scale_repeatability_ppm": 80.0,
        "scale_temperature_ppm_per_c": 120.0,
        "operating_c": (-28.0, 78.0),
        "shock_g": 100.0,
        "resolution_ug": 1.0,
        "bandwidth_at_least_hz": 300.0,
        "bandwidth_at_most_hz": None,
    },
    "gjn096-d": {
        "input_range_g": 70.0,
        "bias_repeatability_ug": 60.0,
        "bias_temperature_ug_per_c": 50.0,
        "scale_repeatability_ppm": 80.0,
        "scale_temperature_ppm_per_c": 50.0,
        "operating_c": (-48.0, 80.0),
        "shock_g": 200.0,
        "resolution_ug": 5.0,
        "bandwidth_at_least_hz": None,
        "bandwidth_at_most_hz": 2000.0,
    },
}


@pytest.mark.parametrize("name", TABLE_1)
def test_every_row_of_table_1(name: str) -> None:
    sheet = datasheets.load(name).model_dump()
    assert {key: sheet[key] for key in sheet if key not in ("kind", "name")} == TABLE_1[name]


def test_worst_case_of_section_1() -> None:
    drift = datasheets.worst_case_drift(datasheets.load("qa3000-030"))
    assert drift.span_c == 90.0
    assert drift.bias_ug == pytest.approx(1350.0)  # "nearly 1.35 mg"
    assert drift.scale_ppm == pytest.approx(10_800.0)
    other = datasheets.worst_case_drift(datasheets.load("gjn096-d"), -48.0, 80.0)
    assert other == pytest.approx((128.0, 6400.0, 6400.0))
    with pytest.raises(UsageError, match=r"^worst case: [^\n]+colder end first$"):
        datasheets.worst_case_drift(datasheets.load("gjn096-d"), 80.0, -48.0)


def test_the_populations_take_up_table_5() -> None:
    ins = datasheets.load("tested-ins")
    ours, gyros = Population.load(), GyroPopulation()
    # Table 5: 50 ug, 50 ug, 30 ppm, 30 ppm; 0.01 deg/h, 0.01 deg/h (relabelled), 20 ppm, 20 ppm
    assert tuple(ins.accelerometer.model_dump().values()) == (50.0, 50.0, 30.0, 30.0)
    assert tuple(ins.gyro.model_dump().values()) == (0.01, 0.01, 20.0, 20.0)
    assert ours["turn_on"].sigma_ug == ins.accelerometer.bias_repeatability_ug
    assert ours["in_run"].sigma_ug <= ins.accelerometer.bias_stability_ug
    assert ours["nonlinearity"].k2_sigma_ug_per_g2 == ins.accelerometer.scale_linearity_ppm
    assert ours["scale_repeatability"].sigma_ppm == ins.accelerometer.scale_repeatability_ppm
    both = hypot(ins.gyro.bias_stability_deg_per_h, ins.gyro.bias_repeatability_deg_per_h)
    assert gyros.bias_deg_per_h == pytest.approx(both, rel=0.02)
    assert (gyros.scale_ppm, gyros.asymmetry_ppm) == (ins.gyro.scale_repeatability_ppm, ins.gyro.scale_linearity_ppm)


def test_at_least_twenty_units_of_every_grade_with_a_source() -> None:
    units = datasheets.units()
    assert len(units) >= 20
    assert {sheet.grade for sheet in units.values()} == set(datasheets.GRADES)
    assert all(len(sheet.source) > 10 and "not noted" not in sheet.source for sheet in units.values())


def test_better_grades_have_quieter_gyros() -> None:
    """Medians of a decade of sheets fall from grade to grade: a figure in the wrong unit would stand out."""
    of = {grade: [] for grade in datasheets.GRADES}
    for sheet in datasheets.units().values():
        if sheet.gyro.angle_random_walk_deg_per_sqrt_h is not None:
            of[sheet.grade].append(sheet.gyro.angle_random_walk_deg_per_sqrt_h)
    medians = [sorted(values)[len(values) // 2] for values in of.values()]
    assert medians[1] > medians[2] > medians[3]
    assert all(0.0005 < value < 2.0 for values in of.values() for value in values)


# the figures that are printed in another unit than the sheet's: as printed, and the factor to ours
PRINTED_MPS_PER_SQRT_H = {
    "adis16448": 0.11,
    "adis16470": 0.037,
    "adis16495-1": 0.008,
    "hg1700": 0.065 * 0.3048,
    "imu-fsas": 0.03,
    "stim300": 0.06,
}
PRINTED_DEG_PER_S_PER_SQRT_HZ = {
    "adis16470": 0.34 / 60.0,
    "bmi270": 0.007,
    "icm-42688-p": 0.0028,
    "mpu-6050": 0.005,
    "mpu-9250": 0.01,
    "mti-1": 0.007,
    "mti-630": 0.007,
    "vn-100": 0.0035,
}


@pytest.mark.parametrize("name", PRINTED_MPS_PER_SQRT_H)
def test_velocity_random_walk_of_a_sheet_is_the_printed_one(name: str) -> None:
    ug = PRINTED_MPS_PER_SQRT_H[name] / 3600.0**0.5 / 9.80665e-6
    assert datasheets.unit(name).accelerometer.velocity_random_walk_ug_per_sqrt_hz == pytest.approx(ug, rel=1e-4)


@pytest.mark.parametrize("name", PRINTED_DEG_PER_S_PER_SQRT_HZ)
def test_angle_random_walk_of_a_sheet_is_the_printed_density(name: str) -> None:
    found = datasheets.unit(name).gyro.angle_random_walk_deg_per_sqrt_h
    assert found == pytest.approx(60.0 * PRINTED_DEG_PER_S_PER_SQRT_HZ[name], rel=1e-4)


def test_an_unknown_unit_is_refused() -> None:
    with pytest.raises(UsageError, match=r"^no inertial unit 'stim30'; did you mean 'stim300'\?; see"):
        datasheets.unit("stim30")
    with pytest.raises(UsageError, match="no inertial unit 'tested-ins'"):
        datasheets.unit("tested-ins")


def test_an_unknown_data_sheet_is_refused() -> None:
    with pytest.raises(UsageError, match=r"^no data sheet 'qa3000'; did you mean 'qa3000-030'\?$"):
        datasheets.load("qa3000")


# ---- ins-eval presets


def printed(capsys: pytest.CaptureFixture[str], name: str | None) -> str:
    assert presets.run(name) == 0
    return capsys.readouterr().out


def test_the_list_holds_every_file_and_every_programme(capsys, repository: Path) -> None:
    lines = printed(capsys, None).splitlines()
    listed: dict[str, set[str]] = {}
    kind = ""
    for line in lines:
        if line.endswith(":") and not line.startswith(" "):
            kind = line.removesuffix(":")
        elif line.startswith("  "):
            name, words = line.split(maxsplit=1)
            assert len(words) > 20 and words.endswith(".")
            listed.setdefault(kind, set()).add(name)

    def stems(folder: str) -> set[str]:
        return {path.stem for path in (repository / folder).glob("*.toml")}

    assert listed["accelerometer population"] == stems("ins_eval/accelerometer/presets")
    assert listed["data sheet"] | listed["INS"] | listed["inertial unit"] == stems("ins_eval/datasheets")
    assert listed["INS"] == {"tested-ins"}
    assert listed["profile of a flight or oven run"] == stems("trajectories")
    assert listed["gyro population"] == {"gyros"}
    assert listed["laboratory"] == {"four-point-chamber", "creep-rig"}
    for kind in ("accelerometer population", "data sheet", "INS", "laboratory"):
        assert all("Paper A" in line for line in lines if line.split() and line.split()[0] in listed[kind])


def test_a_data_sheet_comes_with_its_worst_case_and_the_population_of_that_name(capsys) -> None:
    text = printed(capsys, "qa3000-030")
    assert "15 ug/degC x 90 degC = 1350 ug = 1.35 mg" in text
    assert "120 ppm/degC x 90 degC = 10800 ppm" in text
    assert text.count("qa3000-030\n") == 2 and "accelerometer population: qa3000-030" in text
    assert 'extends = "jb-kt8"' in text and "JB-KT8 #3" in text  # and what it stands on


@pytest.mark.parametrize("name", ["jb-kt8", "table4-scaled", "climb-cruise-landing", "oven"])
def test_a_file_is_printed_whole(capsys, repository: Path, name: str) -> None:
    folder = "trajectories" if name in ("climb-cruise-landing", "oven") else "ins_eval/accelerometer/presets"
    assert (repository / folder / f"{name}.toml").read_text().rstrip() in printed(capsys, name)


def test_a_profile_is_printed_with_what_it_extends(capsys) -> None:
    text = printed(capsys, "straight")
    assert "turn = []" in text and "climb-cruise-landing, which it extends" in text and "to_m = 10000.0" in text


def test_the_programme_of_the_chamber_names_a_source_for_each_value(capsys) -> None:
    text = printed(capsys, "four-point-chamber")
    values = [line for line in text.splitlines() if " = " in line and not line.startswith(" ")]
    assert len(values) == 9
    assert all("# Paper A" in line or "# assumed" in line for line in values)
    assert "(0.3, 0.5, 0.7, 0.9)" in text and "step_c = 0.0625" in text


def test_the_tested_ins_relabels_a_row_and_shows_the_gyros(capsys) -> None:
    text = printed(capsys, "tested-ins")
    assert "bias_repeatability_deg_per_h = 0.01" in text and "relabelled" in text
    assert "bias_deg_per_h = 0.014" in text


@pytest.mark.parametrize("name", ["creep-rig", "gyros"])
def test_the_rest_is_printed(capsys, name: str) -> None:
    assert "assumed" in printed(capsys, name)


def test_every_number_of_a_population_has_a_source(repository: Path) -> None:
    for path in (repository / "ins_eval/accelerometer/presets").glob("*.toml"):
        covered = False
        for line in path.read_text().splitlines():
            if line.startswith("["):
                covered = "#" in line  # said of the whole table
            elif "=" in line and not line.startswith(("#", "name", "extends")):
                assert covered or "#" in line, f"{path.name}: {line}"
                covered = covered or "as what follows" in line


def test_an_unknown_name_is_refused_with_the_nearest() -> None:
    with pytest.raises(UsageError, match=r"^no preset 'jb-kt'; did you mean 'jb-kt8'\?$"):
        presets.run("jb-kt")


def test_a_profile_of_the_working_folder_is_listed_and_printed(capsys, tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "trajectories").mkdir()
    (tmp_path / "trajectories" / "mine.toml").write_text("# A hop of mine. Not for sale.\nextends = 'box'\n")
    monkeypatch.chdir(tmp_path)
    assert "mine                  A hop of mine.\n" in printed(capsys, None)
    text = printed(capsys, "mine")
    assert "box, which it extends" in text and "climb-cruise-landing, which it extends" in text


def test_a_base_that_is_missing_is_refused(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "trajectories").mkdir()
    (tmp_path / "trajectories" / "mine.toml").write_text("extends = 'bax'\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UsageError, match=r"^no profile 'bax'; did you mean 'box'\?$"):
        presets.run("mine")


def test_a_circle_of_profiles_is_refused(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "trajectories").mkdir()
    for name, base in (("one", "two"), ("two", "one")):
        (tmp_path / "trajectories" / f"{name}.toml").write_text(f"# Half a circle.\nextends = '{base}'\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UsageError, match="leads back to itself"):
        presets.run("one")
