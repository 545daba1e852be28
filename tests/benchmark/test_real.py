"""Effects written into recordings, what an oracle sees of them, and how answers to them are counted.

The recordings here are made by hand: a box at rest and one on a path whose forces are known in closed form.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from benchmark.runners import make_mems, make_real, report_real, run
from benchmark.scores import against
from benchmark.scores.detectable import Oracle
from benchmark.worlds import into_data, real
from benchmark.worlds.earth import W, gravity, radii
from benchmark.worlds.into_data import DEG, DEG_PER_H, UG, Applied, apply
from benchmark.worlds.recorded import ACCEL, GYRO, Recorded, merged, part, read

RATE_HZ, SECONDS = 10.0, 600.0
LATITUDE_DEG, HEIGHT_M = 45.0, 100.0
GYRO_NOISE, FORCE_NOISE = 1e-5, 1e-3  # rad/s and m/s^2 of a sample, white
DRIVEN_NOISE = (1e-4, 0.02)  # likewise, of a MEMS
SIGMA_AGREES = 0.6  # ten stretches less what was fitted: their sigma is known to a quarter
NAMES = {
    "gyro.bias_step": ("x", 10.0, "deg/h", {"at_s": 300.0}),
    "accelerometer.bias_step": ("z", 500.0, "ug", {"at_s": 300.0}),
    "accelerometer.bias_temperature": ("z", 300.0, "ug/degC", {}),
}


def parked(seed: int = 0) -> Recorded:
    """A level box at rest, heading north, warming up by 5 degrees; white noise on increments."""
    rng, n = np.random.default_rng(seed), round(SECONDS * RATE_HZ)
    dt = 1.0 / RATE_HZ
    t = dt * np.arange(1, n + 1)
    earth = W * np.array([np.cos(LATITUDE_DEG * DEG), 0.0, -np.sin(LATITUDE_DEG * DEG)])
    gyro = (earth + GYRO_NOISE * rng.standard_normal((n, 3))) * dt
    up = np.array([0.0, 0.0, -gravity(LATITUDE_DEG * DEG, HEIGHT_M)])
    force = (up + FORCE_NOISE * rng.standard_normal((n, 3))) * dt
    imu = {"time_s": t, "temperature_c": 20.0 + 5.0 * t / SECONDS}
    imu |= {name: gyro[:, i] for i, name in enumerate(GYRO)} | {name: force[:, i] for i, name in enumerate(ACCEL)}
    start = {"time_s": 0.0, "latitude_deg": LATITUDE_DEG, "longitude_deg": 10.0, "height_m": HEIGHT_M,
             "velocity_ned_mps": [0.0, 0.0, 0.0]}  # fmt: skip
    head = {
        "format": "ins-recording/1", "kind": "static", "name": "parked",
        "imu": {"rate_hz": RATE_HZ, "gyro": "increment", "accelerometer": "increment", "axes": "FRD"},
        "start": start, "height": {"source": "none", "sigma_m": 2.0},
        "gyro": {"bias_sigma_deg_per_h": 100.0, "bias_radps": [0.0, 0.0, 0.0]},
        "accelerometer": {"bias_sigma_ug": 1000.0, "bias_mps2": [0.0, 0.0, 0.0]},
    }  # fmt: skip
    return Recorded(head, {"imu": imu})


def heading(at: np.ndarray) -> np.ndarray:
    return 1.5 * np.sin(0.25 * at)


def speed(at: np.ndarray) -> np.ndarray:
    return 15.0 + 5.0 * np.sin(0.3 * at)


def driven(delay_s: float = 0.0, seed: int = 0) -> Recorded:
    """A level drive in bends with changing speed, nose ahead: forces in closed form; fixes late by `delay_s`."""
    rng, hz, seconds, latitude = np.random.default_rng(seed), 50.0, 120.0, LATITUDE_DEG * DEG
    t = np.arange(1, round(seconds * hz) + 1) / hz
    middle = t - 0.5 / hz
    psi, v = heading(middle), speed(middle)
    c = np.stack([np.stack([np.cos(psi), np.sin(psi), 0 * psi], -1), np.stack([-np.sin(psi), np.cos(psi), 0 * psi], -1),
                  np.tile([0.0, 0.0, 1.0], (t.size, 1))], axis=1)  # fmt: skip
    spin = W * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    turn = 1.5 * 0.25 * np.cos(0.25 * middle)
    own = np.column_stack([5.0 * 0.3 * np.cos(0.3 * middle), v * turn, np.zeros(t.size)])
    coriolis = 2.0 * np.cross(spin, np.column_stack([v * np.cos(psi), v * np.sin(psi), 0 * psi]))
    force = own + np.einsum("nij,nj->ni", c, coriolis - [0.0, 0.0, gravity(latitude, HEIGHT_M)])
    gyro = c @ spin + np.column_stack([0 * psi, 0 * psi, turn])
    gyro, force = (
        (x + size * rng.standard_normal(x.shape)) / hz
        for x, size in ((gyro, DRIVEN_NOISE[0]), (force, DRIVEN_NOISE[1]))
    )
    fine = np.linspace(0.0, seconds, round(seconds * 1000) + 1)
    way = [cumulative_trapezoid(speed(fine) * f(heading(fine)), fine, initial=0.0) for f in (np.cos, np.sin)]
    at = np.arange(0.2, seconds - 0.5, 0.2)
    noise = rng.standard_normal((at.size, 6)) * [0.5, 0.5, 0.5, 0.05, 0.05, 0.05]
    north, east = (np.interp(at, fine, one) + noise[:, k] for k, one in enumerate(way))
    m, n = radii(latitude)
    gps = {
        "time_s": at + delay_s, "latitude_deg": LATITUDE_DEG + north / (m + HEIGHT_M) / DEG,
        "longitude_deg": 10.0 + east / (n + HEIGHT_M) / np.cos(latitude) / DEG, "height_m": HEIGHT_M + noise[:, 2],
        "velocity_n_mps": speed(at) * np.cos(heading(at)) + noise[:, 3],
        "velocity_e_mps": speed(at) * np.sin(heading(at)) + noise[:, 4], "velocity_d_mps": noise[:, 5],
    }  # fmt: skip
    attitude = {"time_s": t, "roll_deg": np.zeros(t.size), "pitch_deg": np.zeros(t.size),
                "heading_deg": np.mod(heading(t) / DEG, 360.0)}  # fmt: skip
    imu = {"time_s": t} | {name: gyro[:, i] for i, name in enumerate(GYRO)}
    imu |= {name: force[:, i] for i, name in enumerate(ACCEL)}
    head = parked().head | {"kind": "drive", "gps": {"lever_arm_m": [0.0, 0.0, 0.0], "time_offset_s": 0.0}}
    return Recorded(head, {"imu": imu, "gps": gps, "reference": attitude})


@pytest.fixture(scope="module")
def still() -> Recorded:
    return parked()


@pytest.fixture(scope="module")
def drive() -> Recorded:
    return driven(delay_s=0.2)


def difference(before: Recorded, after: Recorded, column: str) -> np.ndarray:
    return (after.tables["imu"][column] - before.tables["imu"][column]) / before.step_s


def test_a_step_begins_at_its_time_and_stays(still) -> None:
    after = apply(still, Applied("gyro.bias_step", "y", 10.0, "deg/h", {"at_s": 300.0}))
    added = difference(still, after, "gyro_y")
    late = still.time_s >= 300.0
    np.testing.assert_allclose(added[late], 10.0 * DEG_PER_H, rtol=1e-9)
    np.testing.assert_array_equal(added[~late], 0.0)
    np.testing.assert_array_equal(after.tables["imu"]["gyro_x"], still.tables["imu"]["gyro_x"])


def test_a_law_of_temperature_counts_from_the_believed_reference(still) -> None:
    after = apply(still, Applied("accelerometer.bias_temperature", "z", 300.0, "ug/degC", {}))
    expected = 300.0 * UG * (still.tables["imu"]["temperature_c"] - 22.0)
    np.testing.assert_allclose(difference(still, after, "accel_z"), expected, atol=1e-12)


def test_a_scale_factor_is_of_what_is_indicated(still) -> None:
    after = apply(still, Applied("accelerometer.scale", "z", 1e4, "ppm", {}))
    np.testing.assert_allclose(after.tables["imu"]["accel_z"], 1.01 * still.tables["imu"]["accel_z"])


def test_an_axis_leans_towards_the_other(still) -> None:
    after = apply(still, Applied("accelerometer.misalignment", "x", 1000.0, "urad", {"other_axis": "z"}))
    assert np.mean(difference(still, after, "accel_x")) == pytest.approx(-1e-3 * gravity(45.0 * DEG, 100.0), rel=1e-3)


def test_files_that_are_described_wrongly(still) -> None:
    imu = still.tables["imu"]
    sign = apply(still, Applied("recording.axis_sign", "z", -1.0, "factor", {"sensor": "gyro"})).tables["imu"]
    np.testing.assert_array_equal(sign["gyro_z"], -imu["gyro_z"])
    two = {"sensor": "gyro", "other_axis": "y"}
    swapped = apply(still, Applied("recording.axes_exchanged", "x", 1.0, "factor", two)).tables["imu"]
    np.testing.assert_array_equal(swapped["gyro_x"], imu["gyro_y"])
    np.testing.assert_array_equal(swapped["gyro_y"], imu["gyro_x"])
    unit = apply(still, Applied("recording.unit", None, 57.3, "factor", {"sensor": "gyro"})).tables["imu"]
    np.testing.assert_allclose(unit["gyro_y"], 57.3 * imu["gyro_y"])


def test_clocks_and_fixes(drive) -> None:
    t = drive.time_s
    step = apply(drive, Applied("recording.clock_step", None, -0.15, "s", {"at_s": 60.0}))
    stamps = drive.tables["gps"]["time_s"]
    late = step.tables["gps"]["time_s"] - stamps  # the IMU early by 0.15 s, the fixes late by it
    np.testing.assert_allclose(late, np.where(stamps >= 60.0, 0.15, 0.0), atol=1e-12)
    np.testing.assert_array_equal(step.time_s, t)
    fast = apply(drive, Applied("recording.clock_drift", None, 1000.0, "ppm", {})).time_s
    assert fast[-1] - t[-1] == pytest.approx(1e-3 * t[-1], rel=1e-6)
    moved = apply(drive, Applied("gps.lever_arm", "x", 2.0, "m", {})).tables["gps"]
    fixes = drive.tables["gps"]
    at, arm = fixes["time_s"], 2.0
    turn = 1.5 * 0.25 * np.cos(0.25 * at)
    added = np.column_stack([moved[f"velocity_{axis}_mps"] - fixes[f"velocity_{axis}_mps"] for axis in "ne"])
    sideways = np.column_stack([-np.sin(heading(at)), np.cos(heading(at))])
    np.testing.assert_allclose(np.sum(added * sideways, axis=1), turn * arm, atol=0.02)  # turn rate times arm
    north = (moved["latitude_deg"] - fixes["latitude_deg"]) * DEG * 6.37e6
    np.testing.assert_allclose(north, arm * np.cos(heading(at)), atol=0.05)


def test_an_antenna_turns_with_the_body_when_a_late_fix_was_measured(drive) -> None:
    """Of fixes that are late as recorded: where the vehicle headed then, not when they are stamped."""
    late_s, arm, fixes = 0.5, 2.0, drive.tables["gps"]
    moved = apply(drive, Applied("gps.lever_arm", "x", arm, "m", {}), late_s).tables["gps"]
    north = (moved["latitude_deg"] - fixes["latitude_deg"]) * DEG * 6.37e6
    then, stamped = (arm * np.cos(heading(fixes["time_s"] - late)) for late in (late_s, 0.0))
    np.testing.assert_allclose(north, then, atol=0.05)
    assert np.abs(north - stamped).max() > 0.2


def test_every_effect_that_is_planned_can_be_put_in() -> None:
    for source in real.SOURCES:
        assert len(source.rows) >= 12, source.name
        assert {row.name for row in source.rows} <= set(into_data.OF_NAME), source.name


@pytest.mark.parametrize("name", NAMES)
def test_at_rest_the_oracle_finds_the_sigma_of_white_noise(still, name) -> None:
    axis, value, unit, further = NAMES[name]
    seen = Oracle(still, 10.0).seen(apply(still, Applied(name, axis, value, unit, further)))
    noise, si = (GYRO_NOISE, DEG_PER_H) if name.startswith("gyro") else (FORCE_NOISE, UG)
    law = into_data.signal(still, Applied(name, axis, value, unit, further))
    if name.endswith("temperature"):  # beside the constant that is believed to 1000 ug
        level = np.column_stack([law, np.ones(law.size)]) * UG
        information = level.T @ level / noise**2 + np.diag([0.0, 1.0 / (1000.0 * UG) ** 2]) * UG**2
        expected = np.sqrt(np.linalg.inv(information)[0, 0])
    else:
        expected = noise / si / np.sqrt(np.sum((law - law.mean()) ** 2))
    assert abs(value) * seen.sigma == pytest.approx(expected, rel=SIGMA_AGREES)
    assert abs(seen.own) < 4.0 * seen.sigma


def test_nobody_sees_a_law_of_temperature_beside_an_own_one_that_is_not_known(still) -> None:
    """What is added repeats the own law; a jump does not, and loses only what resembles one."""
    axis, value, unit, further = NAMES["accelerometer.bias_temperature"]
    law = Oracle(still, 10.0).seen(apply(still, Applied("accelerometer.bias_temperature", axis, value, unit, further)))
    assert law.d > 16.0
    assert law.open_d < 1e-3 * law.d
    axis, value, unit, further = NAMES["accelerometer.bias_step"]
    jump = Oracle(still, 10.0).seen(apply(still, Applied("accelerometer.bias_step", axis, value, unit, further)))
    assert 0.01 * jump.d < jump.open_d < jump.d


def test_in_arcs_the_oracle_finds_delay_and_what_was_put_in(drive) -> None:
    oracle = Oracle(drive, 10.0)
    assert oracle.delay_s == pytest.approx(0.2, abs=0.01)
    effect = Applied("gyro.bias_step", "x", 2000.0, "deg/h", {"at_s": 60.0})
    seen = oracle.seen(apply(drive, effect))
    assert abs(seen.own) < 4.0 * seen.sigma
    again = Oracle(apply(drive, effect), 10.0).seen(apply(apply(drive, effect), effect))
    assert again.own == pytest.approx(1.0, abs=0.1)  # the recording that holds it shows all of it
    assert oracle.seen(apply(drive, effect)).d > 16.0


def test_parts_and_merged_samples_are_the_same_motion(drive, tmp_path) -> None:
    second = part(drive, 0.5, 1.0)
    assert second.head["start"]["time_s"] == pytest.approx(60.0)
    assert second.time_s.size == drive.time_s.size // 2
    two = merged(drive, 2)
    np.testing.assert_allclose(two.tables["imu"]["accel_z"].sum(), drive.tables["imu"]["accel_z"].sum())
    assert two.head["imu"]["rate_hz"] == 5.0
    two.save(tmp_path / "two")
    np.testing.assert_array_equal(read(tmp_path / "two").tables["imu"]["gyro_x"], two.tables["imu"]["gyro_x"])


# ------------------------------------------------------------------------------------------------ counting


def entry(name: str, axis: str | None, low: float, high: float, **further) -> dict:
    return {
        "name": name,
        "axis": axis,
        "parameters": {"value": 0.5 * (low + high), "interval95": [low, high]} | further,
    }


OWN = {"verdict": "explained", "effects": [entry("gps.time_offset", None, 0.24, 0.26)], "indistinguishable": [],
       "mismatch": [{"channel": "gps.velocity", "interval_s": [0.0, 100.0]}]}  # fmt: skip
TRUTH = {
    "case": "case-plane-hidden-00", "kind": "single", "source": "plane", "what": "one effect",
    "recordings": [{"name": "aeroplane", "kind": "flight"}],
    "effects": [{"name": "gps.time_offset", "axis": None, "value": 0.15, "unit": "s"}], "channels": ["gps.velocity"],
    "oracle": {"log_bayes_factor": 100.0, "own": 0.25, "sigma": 0.005},
}  # fmt: skip


def counted(answer: dict | None, truth: dict = TRUTH, error: str = "") -> dict:
    return against.judged(truth, answer, OWN, {"seconds": 10.0, "processor_s": 9.0}, error)


def test_an_answer_that_says_what_it_said_before_detects_nothing() -> None:
    one = counted(OWN)
    assert not one["detected"]
    assert not one["found"]


def test_a_size_that_moved_by_what_was_put_in_is_found_and_held() -> None:
    one = counted(OWN | {"effects": [entry("gps.time_offset", None, 0.39, 0.41)]})
    assert one["first"]
    assert one["holds"]
    assert counted(OWN | {"effects": [entry("gps.time_offset", None, 0.45, 0.47)]})["holds"] is False


@pytest.mark.parametrize(("from_s", "to_s", "another"), [(235.0, 245.0, True), (20.0, 245.0, False)])
def test_a_jump_at_another_instant_is_another(from_s: float, to_s: float, another: bool) -> None:
    """As it is the recording named one that could as well have been before it moved."""
    before = OWN | {"effects": [entry("recording.clock_step", None, -0.26, -0.24, at_s_interval95=[26.0, 30.0])]}
    jump = entry("recording.clock_step", None, -0.27, -0.22, at_s=240.0, at_s_interval95=[from_s, to_s])
    new, _ = against.beyond(OWN | {"effects": [jump]}, before)
    assert new == (["recording.clock_step"] if another else [])


def test_what_any_entry_of_its_name_told_before_is_not_new() -> None:
    """Rivals stand behind effects and may have their names."""
    jump = entry("recording.clock_step", None, -0.27, -0.22, at_s_interval95=[235.0, 245.0])
    rival = entry("recording.clock_step", None, -0.9, -0.8, at_s=28.0)
    before = OWN | {"effects": [jump], "indistinguishable": [rival]}
    assert against.beyond(before, before)[0] == []


def test_axes_that_are_exchanged_have_no_order() -> None:
    names = [against.words({"name": "recording.axes_exchanged", "axis": one, "parameters": {"other_axis": other}})
             for one, other in ("xy", "yx", "xz")]  # fmt: skip
    assert names[0] == names[1] != names[2]


def test_another_name_is_detected_and_confidently_wrong() -> None:
    one = counted(OWN | {"effects": [entry("gyro.bias", "x", 1.0, 2.0)]})
    assert one["detected"]
    assert one["wrong"]
    assert not one["found"]


def test_a_refusal_is_no_detection_and_no_alarm() -> None:
    one = counted(None, error="exit code 3\nins-eval: refused")
    assert one["verdict"] == "refused"
    assert not one["detected"]
    null = counted(None, TRUTH | {"kind": "null", "effects": []}, "exit code 124\nended after 300 s")
    assert null["verdict"] == "took too long"
    assert not null["alarm"]


def test_without_an_answer_nothing_is_detected_and_nothing_is_wrong() -> None:
    null = TRUTH | {"kind": "null", "effects": []}
    records = [
        counted(OWN),
        counted(None, error="exit code 3\nrefused"),
        counted(OWN, null),
        counted(None, null, "exit code 5"),
    ]
    found = against.summary(records)
    assert found["all"]["detected, D >= 16"]["count"] == 2
    assert found["all"]["confidently wrong"]["count"] == 1
    assert found["nulls"]["all"]["count"] == 1
    assert found["all"]["ended with a fault"]["hits"] == 1
    said = {one["words"]: one["met"] for one in against.targets(found)}
    assert said["nulls that alarm"] is True
    assert said["detected, D of at least 16"] is False


def test_a_null_alarms_by_a_name_of_its_own() -> None:
    truth = TRUTH | {"kind": "null", "effects": []}
    assert not counted(OWN, truth)["alarm"]
    assert counted(OWN | {"effects": [entry("gyro.bias", "x", 1.0, 2.0)]}, truth)["alarm"]


# ------------------------------------------------------------------------------------------------ from end to end


def test_a_set_is_made_scored_and_reported_and_goes_on(tmp_path: Path, monkeypatch) -> None:
    """The chamber's rows as its authors have them: sensor, x, y, z [milli-g], temperature, a step of 3 milli-g."""
    rng, n = np.random.default_rng(1), 200 * real.ROWS_PER_S
    warm = np.linspace(-18.0, -14.0, n)
    rows = np.column_stack([np.full(n, 42652.0), *rng.standard_normal((3, n)) * 0.8, warm])
    rows[:, 3] += 1000.0
    file = tmp_path / "recordings" / "accel_thermal_chamber" / "Sample_data.csv.gz"
    file.parent.mkdir(parents=True)
    np.savetxt(file, rows[::100], delimiter=",", fmt="%.3f")
    monkeypatch.setattr(real, "ROWS_PER_S", real.ROWS_PER_S // 100)
    options = ["--recordings", str(file.parents[1]), "--only", "chamber,laser", "-o", str(tmp_path / "set")]
    assert make_real.main(options) == 0
    assert make_real.main(options) == 0  # what is there stays
    with pytest.raises(SystemExit):
        make_real.main([*options, "--seed", "2"])
    cases = {path.name: run.recordings(path) for path in (tmp_path / "set" / "recordings").iterdir()}
    assert len(cases) == 19  # the laser gyro is absent
    chosen = {name: one for name, one in cases.items() if name.endswith(("unmodified", "hidden-00", "null-0"))}
    assert run.run(chosen, tmp_path / "answers", limit_s=60.0) == []
    words = ["--output", str(tmp_path / "report"), "--quiet"]
    assert report_real.main([str(tmp_path / "set"), str(tmp_path / "answers"), *words]) == 0
    found = json.loads((tmp_path / "report" / "metrics.json").read_text())
    assert found["cases"] == 19
    one = next(one for one in found["records"] if one["case"] == "case-chamber-hidden-00")
    assert one["detected"]
    assert one["d"] > 16.0
    assert "no case" not in (tmp_path / "report" / "report.txt").read_text()
    assert "Effects concealed in real recordings" in (tmp_path / "report" / "index.html").read_text()


# the first signal may come within a callback, where it is lost; the next one ends the case
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_case_that_takes_too_long_is_ended(tmp_path: Path, still) -> None:
    still.save(tmp_path / "case")
    assert run.run({"case-1": [tmp_path / "case"]}, tmp_path / "answers", limit_s=0.05) == ["case-1"]
    assert (tmp_path / "answers" / "case-1.error").read_text().startswith(f"exit code {run.TIMEOUT}")


def test_a_journey_is_as_it_is_and_with_an_effect_that_the_oracle_sees(tmp_path: Path) -> None:
    """The same bytes whenever it is made; the effect is what the two recordings differ by, and no attitude is told."""
    for folder in (tmp_path / "first", tmp_path / "again"):
        assert make_mems.main(["--seed", "4", "--count", "1", "-o", str(folder)]) == 0
    truth = json.loads((tmp_path / "first/truth/case-mems-000-hidden-00.json").read_text())
    assert truth == json.loads((tmp_path / "again/truth/case-mems-000-hidden-00.json").read_text())
    plain, hidden = (read(tmp_path / f"first/recordings/case-mems-000-{name}") for name in ("unmodified", "hidden-00"))
    assert "attitude_deg" not in plain.head["start"] and "reference" not in plain.tables
    (effect,) = truth["effects"]
    parameters = {name: effect[name] for name in ("other_axis", "sensor", "at_s") if name in effect}
    wanted = apply(plain, Applied(effect["name"], effect["axis"], effect["value"], effect["unit"], parameters))
    changed = False
    for name, table in wanted.tables.items():
        for column, values in table.items():
            np.testing.assert_array_equal(hidden.tables[name][column], values)
            changed |= not np.array_equal(plain.tables[name][column], values)
    assert changed
    assert truth["oracle"]["log_bayes_factor"] > 0.0
