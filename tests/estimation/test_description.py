"""Wrong descriptions written into files after the truth was made: named first, with axis, time and size; else none."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from benchmark.worlds.cases import a_recording as of_navigation_grade
from benchmark.worlds.cases import a_unit
from benchmark.worlds.description import misdescribe
from benchmark.worlds.grades import a_recording as of_grade
from benchmark.worlds.grades import cut
from benchmark.worlds.mems import a_journey
from benchmark.worlds.record import Made
from ins_eval.believed import believed
from ins_eval.cli import main
from ins_eval.diagnosis.answer.judge import judge
from ins_eval.diagnosis.answer.verdict import NO_MISMATCH
from ins_eval.earth import EARTH_RATE
from ins_eval.effects.parts import SENSORS, conditions
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.error_model.library import COARSEST_PPM, LARGEST_OF, sized
from ins_eval.errors import DataRefused
from ins_eval.estimation import description
from ins_eval.estimation.case import prepare, with_effects
from ins_eval.estimation.description import (
    REFUTED,
    _believing,
    _beyond_sensors,
    _height,
    _navigated,
    _of_matrix,
    wrong_columns,
    wrong_descriptions,
)
from ins_eval.interface.diagnose import diagnose
from ins_eval.readers import apm_mat
from ins_eval.recording import Imu, Recording, Start, consistency, form
from ins_eval.recording.belief import AccelerometerBelief, Belief, EffectBelief, GyroBelief
from ins_eval.recording.consistency.alternatives import BEYOND_DOUBT, MATRICES, Finding, mistakes
from ins_eval.recording.mending import mended

RATE_HZ = 20.0
SIGN, EXCHANGED, UNIT = "recording.axis_sign", "recording.axes_exchanged", "recording.unit"
STEP_S, DRIFT_PPM, SIGMAS = 0.15, 60.0, 4.0
AT_S = 1200.0
FINE_S = 0.05  # one sample
TURNS_LITTLE = (51, 68)  # seed and number of the journey, whose gyro z has the wrong sign
# of which nothing is wrong: accelerometers with biases along and across, gyros with one of 2 deg/s
BIASED_DRIVES = ((56, 66), (55, 88))
STANDS_AND_DRIFTS = (56, 7)  # its gyro z has a bias of 2.4 sigmas
TURNS_LITTLE_ON_WHEELS = (56, 97)  # whose gyro z has the wrong sign
TURNS_ALIKE = (55, 11)  # another, in which gyro y seems to have what gyro z has
TWIN_FLIGHT = (53, 72)  # of a flight whose gyros x and y stand for each other, and whose antenna is where the IMU is
LEFT_OUT = 2  # seed of a straight flight in which a reversed gyro z looks like the rotation of the Earth
ROUNDING = 1e-5  # of the evidence of a navigation, in nats


PLANE = Path(__file__).parents[3] / "shared" / "recordings" / "plane_flight_gps_latency" / "TestLog2.mat"
FAR_PPM = 3400.0
DEG = 57.29577951308232
WRONG = [
    (SIGN, "x", -1.0, {"sensor": "gyro"}),
    (SIGN, "z", -1.0, {"sensor": "gyro"}),
    (SIGN, "y", -1.0, {"sensor": "accelerometer"}),
    (EXCHANGED, "x", 1.0, {"sensor": "accelerometer", "other_axis": "y"}),
    (UNIT, None, DEG, {"sensor": "gyro", "unit_found": "deg"}),
    (UNIT, None, 1.0 / 9.80665, {"sensor": "accelerometer", "unit_found": "g"}),
    ("recording.gps_velocity", None, 3.6, {}),
    ("recording.reference_frame", None, 0.0, {"frame_found": "ENU"}),
]
GRADES = ("navigation", "industrial")
QUICK = {("navigation", UNIT, "gyro"), ("industrial", SIGN, "gyro"), ("industrial", EXCHANGED, "accelerometer")}
CASES = [
    pytest.param(grade, one, marks=() if (grade, one[0], one[3].get("sensor")) in QUICK else pytest.mark.slow)
    for grade in GRADES
    for one in WRONG
]


@cache
def made(grade: str, trajectory: str = "drive", seed: int = 5) -> Made:
    rng = np.random.default_rng(seed)
    if grade != "navigation":
        return of_grade(rng, grade, trajectory, RATE_HZ)
    return of_navigation_grade(rng, a_unit(rng, "plain", pulses=False), trajectory, RATE_HZ, (), False, ())


def spoilt(folder: Path, grade: str, *wrong: tuple, trajectory: str = "drive") -> Path:
    one = made(grade, trajectory)
    tables = {name: dict(columns) for name, columns in one.tables.items()}
    for name, axis, value, parameters in wrong:
        misdescribe(tables, name, axis, value, parameters)
    Made(**{**vars(one), "tables": tables}).save(folder)
    return folder


def said(folder: Path) -> list[tuple]:
    found, _ = wrong_descriptions(form.read(folder, doubted=True))
    return [(one.effect.name, one.effect.axis, one.effect.value, one.effect.sensor) for one in found]


@pytest.mark.parametrize(("grade", "wrong"), CASES)
def test_a_wrong_description_is_named_and_nothing_else(tmp_path, grade: str, wrong: tuple) -> None:
    name, axis, value, parameters = wrong
    ((found, of, factor, sensor),) = said(spoilt(tmp_path / "drive", grade, wrong))
    assert (found, of, sensor) == (name, axis, parameters.get("sensor"))
    assert factor == pytest.approx(value, rel=1e-5)


def test_what_no_standstill_shows_is_written(tmp_path) -> None:
    """A parked unit in g: there are no finite odds of that, and the answer is JSON all the same."""
    rng, n = np.random.default_rng(4), 20 * 120
    rate = EARTH_RATE * np.array([np.cos(0.6), 0.0, -np.sin(0.6)])
    imu = Imu(
        time_s=np.arange(1, n + 1) / RATE_HZ,
        gyro=rate / RATE_HZ + 1e-7 * rng.standard_normal((n, 3)),
        accelerometer=np.array([0.0, 0.0, -1.0]) / RATE_HZ + 1e-6 * rng.standard_normal((n, 3)),
        accelerometer_form="increment",
    )
    form.write(
        Recording("unit", "static", Start(0.0, 0.6, 0.1, 0.0, attitude_rad=(0.0, 0.0, 0.0)), imu), tmp_path / "unit"
    )
    answer = tmp_path / "answer.json"
    assert main(["diagnose", str(tmp_path / "unit"), "--json", str(answer), "--quiet"]) == 0
    first = json.loads(answer.read_text())["effects"][0]
    assert (first["name"], first["parameters"]["unit_found"]) == (UNIT, "g")


@pytest.mark.slow
@pytest.mark.parametrize("grade", GRADES)
def test_two_wrong_descriptions_are_both_named(tmp_path, grade: str) -> None:
    both = (WRONG[4], WRONG[6])
    assert {one[0] for one in said(spoilt(tmp_path / "drive", grade, *both))} == {UNIT, "recording.gps_velocity"}


@pytest.mark.parametrize("trajectory", ["drive", pytest.param("climb, cruise, landing", marks=pytest.mark.slow)])
@pytest.mark.parametrize("grade", [*GRADES, "consumer", "tactical"])
def test_a_sound_recording_has_none(tmp_path, grade: str, trajectory: str) -> None:
    assert said(spoilt(tmp_path / "sound", grade, trajectory=trajectory)) == []


@pytest.mark.parametrize(
    ("late_s", "velocities"), [(18.0, True), pytest.param(-37.0, True, marks=pytest.mark.slow), (90.0, False)]
)
def test_stamps_of_another_clock_are_late_and_nothing_else_is_wrong(tmp_path, late_s: float, velocities: bool) -> None:
    """UTC taken for GPS time, and the like: whole seconds beyond what a receiver is late by."""
    one = made("industrial", "drive")
    gps = dict(one.tables["gps"])
    gps["time_s"] = gps["time_s"] + late_s
    if not velocities:
        gps = {name: values for name, values in gps.items() if not name.startswith("velocity")}
    Made(**{**vars(one), "tables": {**one.tables, "gps": gps}}).save(tmp_path / "drive")
    found, _ = wrong_descriptions(form.read(tmp_path / "drive", doubted=True))
    (offset,) = found
    assert offset.effect.name == "gps.time_offset" and offset.log_odds > BEYOND_DOUBT
    assert offset.effect.value == pytest.approx(late_s, abs=SIGMAS * offset.sigma + FINE_S)
    with pytest.raises(DataRefused, match="expected one clock, odds .*; bring both to one clock, or state time_offset"):
        form.read(tmp_path / "drive")


@pytest.mark.parametrize("journey", BIASED_DRIVES)
def test_biases_are_no_other_order_of_columns(tmp_path, journey) -> None:
    """A unit on wheels seemed to be turned by a quarter, odds 1.9e10, and was refused; another to be doubtful."""
    case = next(one for one in a_journey(*journey).cases if one.effect is None)
    case.recorded.save(tmp_path / "drive")
    assert not [one for one in consistency.findings(form.read(tmp_path / "drive", doubted=True)) if one.decided]


def test_a_bias_of_a_unit_that_stands_is_no_other_unit(tmp_path) -> None:
    """Gyros that turn by 1.5 deg/s where nothing turns seemed to be given in deg/h; their noise tells."""
    for case in a_journey(*STANDS_AND_DRIFTS).cases:
        case.recorded.save(tmp_path / case.name)
        assert said(tmp_path / case.name) == []


def test_what_navigation_refutes_is_not_refused(tmp_path, monkeypatch) -> None:
    """The parts of a sound recording may look contradictory beyond doubt: navigating it shows otherwise."""
    folder = spoilt(tmp_path / "sound", "industrial")
    turned = ((np.diag([-1.0, -1.0, 1.0]), np.eye(3)), (np.eye(3), np.diag([1.0, -1.0, 1.0])))
    seeming = Finding("axes", "gyros and accelerometers contradict gps", "turn them", 2.0 * BEYOND_DOUBT, orders=turned)
    monkeypatch.setattr(consistency, "findings", lambda recording: [seeming])
    recording = form.read(folder, doubted=True)
    wrong, found = wrong_descriptions(recording)
    assert wrong == []
    (note,) = consistency.report(recording, found, "here")
    assert note.startswith("Undecided: ") and REFUTED in note


def test_one_turned_gyro_of_a_car_that_turns_little_is_found(tmp_path) -> None:
    """Biases of accelerometers were taken for other columns, beside which it was not tried: the log was refused."""
    for case in a_journey(*TURNS_LITTLE_ON_WHEELS).cases:
        case.recorded.save(tmp_path / case.name)
        wrong = [] if case.effect is None else [(SIGN, "z", -1.0, "gyro")]
        assert said(tmp_path / case.name) == wrong


@pytest.mark.parametrize("journey", [TURNS_LITTLE, pytest.param(TURNS_ALIKE, marks=pytest.mark.slow)])
def test_a_sign_that_only_navigation_tells(tmp_path, journey) -> None:
    """A few minutes out of a flight of a MEMS unit, in which it turns too little for its parts to tell."""
    for case in a_journey(*journey).cases:
        case.recorded.save(tmp_path / case.name)
        recording = replace(form.read(tmp_path / case.name), folder=tmp_path / case.name)
        assert wrong_descriptions(recording)[0] == []
        found = [one.effect for one in wrong_columns(recording, prepare(believed(recording), recording.folder))]
        wrong = [] if case.effect is None else [(case.effect.name, case.effect.axis, case.effect.parameters["sensor"])]
        assert [(one.name, one.axis, one.sensor) for one in found] == wrong


@pytest.mark.parametrize(
    ("wrong", "seen"),
    [
        (EffectBelief(name="accelerometer.scale", axis="x", value=2e5), False),
        (EffectBelief(name=SIGN, axis="x", value=-1.0, sensor="accelerometer"), True),
    ],
)
def test_an_accelerometer_that_is_off_by_a_fifth_is_no_other_column(tmp_path, wrong: EffectBelief, seen: bool) -> None:
    """One that was turned over is off by more than any sensor; that a sign of x is, the signs that are tried tell.

    So far from what is linear rounding decides whether x or y, which feels its turns, would take up more of it.
    """
    made("consumer", "climb, cruise, landing").save(tmp_path / "flight")
    read = form.read(tmp_path / "flight", doubted=True)
    case = prepare(believed(replace(read, belief=with_effects(read.belief, [wrong]))))
    assert any(sensor == "accelerometer" for sensor, _, _ in _beyond_sensors(case)) == seen


def of_the_world(folder, number: int, trajectory: str) -> Recording:
    """600 s of an industrial unit as the benchmark's world records it."""
    made = of_grade(np.random.default_rng([0, number]), "industrial", trajectory, 25.0)
    cut(made, 0.0, 600.0)
    made.save(folder / "recording")
    return replace(form.read(folder / "recording", doubted=True), folder=folder / "recording")


def test_an_arm_on_the_wrong_side_is_no_gyro_of_another_sign(tmp_path) -> None:
    """12 m of arm show a scale factor of a gyro that is off by more than any sensor's, where it turns."""
    read = of_the_world(tmp_path, 1, "box")
    arm_m = np.add(read.belief.gps.lever_arm_m, [12.0, 0.0, -4.0])
    gps = read.belief.gps.model_copy(update={"lever_arm_m": tuple(arm_m.tolist())})
    recording = believed(replace(read, belief=read.belief.model_copy(update={"gps": gps})))
    case = prepare(recording)
    assert wrong_columns(recording, case) == []
    (found, *_) = judge([case]).effects
    assert (found.hypothesis.candidate.name, found.hypothesis.candidate.axis) == ("gps.lever_arm", "x")
    assert found.value == pytest.approx(-12.0, abs=4.0 * found.sigma)


def test_what_no_single_column_explains_is_no_single_column(tmp_path) -> None:
    """x and y of both triads exchanged, and positions of metres without velocities: a sign fitted better, not well."""
    read = of_the_world(tmp_path, 4, "drive")
    imu = replace(read.imu, gyro=read.imu.gyro[:, [1, 0, 2]], accelerometer=read.imu.accelerometer[:, [1, 0, 2]])
    gps = replace(read.gps, velocity_n=np.full_like(read.gps.velocity_n, np.nan))
    recording = believed(replace(read, imu=imu, gps=gps))
    case = prepare(recording)
    assert _beyond_sensors(case) and wrong_columns(recording, case) == []


def test_a_gyro_that_feels_an_earth_that_is_left_out_is_not_turned_over(tmp_path) -> None:
    """Straight on, the rotation along z is a rate of one sign there: with that turned over much of it is right."""
    made("navigation", "straight", LEFT_OUT).save(tmp_path / "straight")
    read = form.read(tmp_path / "straight")
    earth = read.belief.earth.model_copy(update={"rotation": False})
    recording = believed(replace(read, belief=read.belief.model_copy(update={"earth": earth})))
    turned = EffectBelief(name=SIGN, axis="z", value=-1.0, sensor="gyro")
    right, over = (_height(_navigated(one)) for one in (recording, _believing(recording, [turned])))
    assert over > right + BEYOND_DOUBT
    assert wrong_columns(recording, prepare(recording)) == []


@pytest.mark.parametrize("turn", [m for m in MATRICES if np.linalg.det(m) > 0.0])
@pytest.mark.parametrize("mistake", [m for m in MATRICES if mistakes(m) == 1])
def test_of_twins_that_navigate_alike_the_one_mistake_is_named(monkeypatch, mistake, turn) -> None:
    """A mistake of the gyros in a box turned by Q: gyros Q M and accelerometers Q, alike but for rounding.

    What a turned box leaves of the one mistake is never one again: a turn takes two, and those are of the other triad.
    """
    same = np.eye(3)
    twins = [(same, mistake), *([(turn, turn @ mistake)] if mistakes(turn) else [])]
    found = Finding("axes", "", "", 10.0, orders=tuple(twins))
    read = description._Changes(same, same)
    rounded = iter([ROUNDING * k for k in range(len(twins))] + [-100.0])
    monkeypatch.setattr(description, "_navigated", lambda recording: None)
    monkeypatch.setattr(description, "_height", lambda case: next(rounded))
    monkeypatch.setattr(description, "log_prior_of_start", lambda recording, case: 0.0)
    recording = Recording("r", "flight", Start(0.0, 0.6, 0.1, 0.0), None)
    best = description._best(recording, read, found, list(description._options(found, read)))
    np.testing.assert_array_equal(best.gyro, mistake)
    np.testing.assert_array_equal(best.accelerometer, same)


@pytest.mark.slow
def test_gyros_exchanged_are_not_a_box_on_its_side(tmp_path) -> None:
    for case in a_journey(*TWIN_FLIGHT).cases:
        case.recorded.save(tmp_path / case.name)
        recording = replace(form.read(tmp_path / case.name, doubted=True), folder=tmp_path / case.name)
        said_of_it = [(one.effect.name, one.effect.axis, one.effect.sensor) for one in wrong_descriptions(recording)[0]]
        assert said_of_it == ([] if case.effect is None else [(EXCHANGED, "x", "gyro")])


@pytest.mark.slow
def test_at_a_wrong_instant_no_column_is_called_wrong() -> None:
    """A real flight whose clock drifts by two seconds fits better with an accelerometer turned over."""
    if not PLANE.exists():
        pytest.skip(f"{PLANE} is not here")
    read = apm_mat.read(PLANE, {})
    start_s = read.start.time_s
    imu = replace(read.imu, time_s=start_s + (read.imu.time_s - start_s) * (1.0 + 1e-6 * FAR_PPM))
    recording = believed(replace(read, imu=imu))
    case = prepare(recording)
    sign = replace(
        recording,
        belief=with_effects(recording.belief, [EffectBelief(name=SIGN, axis="y", value=-1.0, sensor="accelerometer")]),
    )
    assert _height(_navigated(sign)) > _height(_navigated(recording))
    assert wrong_columns(recording, case) == []


@pytest.mark.parametrize("sensor", SENSORS)
def test_every_order_and_sign_comes_back_from_what_is_said_of_it(sensor: str) -> None:
    rng = np.random.default_rng(3)
    read = {one: rng.standard_normal((7, 3)) for one in SENSORS}
    imu = Imu(np.arange(1.0, 8.0), read["gyro"], read["accelerometer"], "increment")
    for matrix in MATRICES:
        assert len(_of_matrix(sensor, matrix)) == mistakes(matrix)  # in no more words than it takes
        belief = Belief(effects=tuple(_of_matrix(sensor, 0.5 * matrix)))
        right = mended(Recording("r", "drive", Start(0.0, 0.6, 0.1, 0.0), imu, belief=belief))
        np.testing.assert_allclose(getattr(right.imu, sensor), 0.5 * read[sensor] @ matrix.T, rtol=1e-5)


@pytest.mark.parametrize(
    ("gyro_deg_per_h", "accelerometer_ug"), [(0.01, 50.0), (5.0, 800.0), (300.0, 4e3), (3000.0, 4e4)]
)
def test_usual_sizes_of_a_grade_are_below_what_no_sensor_does(gyro_deg_per_h: float, accelerometer_ug: float) -> None:
    """Scale factors and misalignments of a few per cent at most, whatever the offsets; navigation grade as it is."""
    belief = Belief(
        gyro=GyroBelief(bias_sigma_deg_per_h=gyro_deg_per_h),
        accelerometer=AccelerometerBelief(bias_sigma_ug=accelerometer_ug),
    )
    imu = Imu(np.arange(1.0, 8.0), np.zeros((7, 3)), np.zeros((7, 3)), "increment")
    given = conditions(Recording("r", "drive", Start(0.0, 0.6, 0.1, 0.0), imu, belief=belief))
    for name in ("accelerometer.scale", "gyro.scale", "gyro.misalignment", "accelerometer.misalignment"):
        effect = VOCABULARY[name]
        _, nominal, _ = sized(effect, {}, [], imu.time_s, given)
        assert effect.nominal <= nominal <= COARSEST_PPM < LARGEST_OF["ppm"]
        if gyro_deg_per_h < 0.05:
            assert nominal == effect.nominal


@pytest.mark.slow
@pytest.mark.parametrize(
    "wrong",
    [
        WRONG[0],
        WRONG[3],
        WRONG[4],
        WRONG[6],
        ("recording.clock_step", None, STEP_S, {"at_s": AT_S}),
        ("recording.clock_drift", None, DRIFT_PPM, {}),
    ],
    ids=lambda one: one[0],
)
def test_the_answer_names_it_first(tmp_path, wrong: tuple) -> None:
    name, axis, value, parameters = wrong
    answer = diagnose([spoilt(tmp_path / "drive", "navigation", wrong)]).found.answer
    first = answer["effects"][0]
    assert (first["name"], first["axis"]) == (name, axis)
    low, high = first["parameters"]["interval95"]
    middle, half = 0.5 * (low + high), max(SIGMAS / 1.96 * 0.5 * (high - low), 1e-5 * abs(value))
    assert middle == pytest.approx(value, abs=half)
    assert answer["mismatch"][0]["channel"] == ("clock" if "clock" in name else "recording")
    assert answer["verdict"] != "unexplained"
    for key, expected in parameters.items():
        found = first["parameters"][key]
        assert found == (pytest.approx(expected, abs=5.0) if key == "at_s" else expected)


@pytest.mark.slow
def test_what_is_written_mends_the_next_diagnosis(tmp_path) -> None:
    folder, model = spoilt(tmp_path / "drive", "navigation", WRONG[0]), tmp_path / "belief.toml"
    result = diagnose([folder], model_file=model)
    assert result.found.answer["effects"][0]["name"] == SIGN and str(result)
    again = diagnose([folder], belief=model).found.answer
    assert (again["verdict"], again["effects"]) == (NO_MISMATCH, [])


@pytest.mark.slow
@pytest.mark.parametrize("trajectory", ["drive", "climb, cruise, landing"])
def test_a_sound_recording_is_given_none(tmp_path, trajectory: str) -> None:
    answer = diagnose([spoilt(tmp_path / "sound", "navigation", trajectory=trajectory)]).found.answer
    assert not [one for one in answer["effects"] if one["name"].startswith("recording.")]
