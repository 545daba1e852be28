"""The verb and what it shows: text, JSON and page, the disturbance of a channel and the gain of an effect."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import ins_eval as ie
from ins_eval.commands import diagnose
from ins_eval.diagnosis.answer import nonparametric
from ins_eval.diagnosis.answer.answer import answer
from ins_eval.diagnosis.answer.nonparametric import disturbances, located
from ins_eval.diagnosis.answer.summary import basis, before_after, evidence, limits
from ins_eval.diagnosis.answer.verdict import (
    EXPLAINED,
    NO_MISMATCH,
    NOT_IDENTIFIABLE,
    PARTLY,
    UNEXPLAINED,
    Diagnosis,
    FoundEffect,
    Rival,
    Withdrawn,
)
from ins_eval.diagnosis.unnamed.locate import Channel
from ins_eval.diagnosis.unnamed.mismatch import Mismatch, UnnamedDisturbance, Wander
from ins_eval.earth import EARTH_RATE
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.error_model.columns import Column
from ins_eval.error_model.library import Candidate, channel_of
from ins_eval.errors import UsageError
from ins_eval.estimation.case import prepare
from ins_eval.estimation.study import Hypothesis
from ins_eval.policy import Policy
from ins_eval.recording import form
from ins_eval.units import ARCSEC, DEG_PER_H, HOUR, NMI, PPM, STANDARD_GRAVITY, UG
from tests.ideal import RATE_HZ

# of docs/answer.md
KEYS = {"format", "verdict", "mismatch", "effects", "indistinguishable", "unexplained", "withdrawn", "fit"}
OF_MISMATCH = {"recording", "channel", "interval_s", "where", "significance_sigma"}
OF_EFFECT = {"name", "axis", "parameters", "probability", "log_evidence_gain", "false_alarm_probability"}
OF_RIVAL = {"from", "name", "axis", "probability", "log_evidence_below_best", "told_apart_by_prior_only", "experiment",
            "expected_log_bayes_factor"}  # fmt: skip
OF_UNEXPLAINED = {"significance_sigma", "channel", "interval_s", "wander"}
OF_FIT = {"held_out", "velocity_rms_mps", "radial_error_rate_nmi_per_h"}
VERDICTS = {"no mismatch", "explained", "not identifiable", "partly explained", "unexplained"}
CHANNELS = {f"{sensor}.{axis}" for sensor in ("accelerometer", "gyro") for axis in "xyz"} | {
    "temperature", "gps.position", "gps.velocity", "reference.attitude", "navigation", "clock", "recording"
}  # fmt: skip
BURST_DEG_PER_H, BURST_S, LASTS_S = 0.3, (600.0, 1200.0), 1800.0
DRIFT_DEG_PER_H2 = 0.5
SHARE = 0.15  # by which what data find by themselves may differ from what was put in
EPOCH_SHARE = 1e-3  # what turning within an epoch takes from a drive
WORSE = 1.1  # held-out ratio of an effect that does harm


@pytest.fixture(scope="module")
def parked(ideal_recording, tmp_path_factory):
    """Folders of half an hour at rest: sound, with a gyro x that is off for a while, and with one that drifts."""
    whole = ideal_recording("oven")
    rows = whole.imu.time_s <= LASTS_S
    imu = replace(
        whole.imu,
        time_s=whole.imu.time_s[rows],
        gyro=whole.imu.gyro[rows],
        accelerometer=whole.imu.accelerometer[rows],
        height_baro_m=None,
    )
    time_s = imu.time_s
    errors = {
        "sound": np.zeros(time_s.size),
        "broken": BURST_DEG_PER_H * ((time_s > BURST_S[0]) & (time_s <= BURST_S[1])),
        "drifting": DRIFT_DEG_PER_H2 * (time_s - whole.start.time_s) / HOUR,
    }
    folder = tmp_path_factory.mktemp("parked")

    def written(name: str):
        gyro = imu.gyro.copy()
        gyro[:, 0] += errors[name] * DEG_PER_H / RATE_HZ
        return form.write(replace(whole, name=name, imu=replace(imu, gyro=gyro)), folder / name)

    return {name: written(name) for name in errors}


def test_a_sound_recording_has_no_mismatch(parked, tmp_path, capsys) -> None:
    assert diagnose.run([parked["sound"]], json=tmp_path / "answer.json", quiet=False) == 0
    answer = json.loads((tmp_path / "answer.json").read_text())
    assert set(answer) == KEYS
    assert (answer["format"], answer["verdict"], answer["mismatch"]) == ("ins-diagnosis/1", "no mismatch", [])
    assert "no mismatch" in capsys.readouterr().out


@pytest.fixture(scope="module")
def sound(parked):
    return ie.diagnose([parked["sound"]]).found.diagnosis


@pytest.fixture(scope="module")
def both(parked):
    """The diagnosis of a sound and a broken gyro together."""
    return ie.diagnose([parked["sound"], parked["broken"]])


@pytest.fixture(scope="module")
def drifting(parked):
    return ie.diagnose([parked["drifting"]]).found.diagnosis


@pytest.fixture(scope="module")
def broken(both, tmp_path_factory):
    """The answer for both folders, and where its page is."""
    folder = tmp_path_factory.mktemp("answer")
    both.write(folder / "report", quiet=True)
    return both.found.answer, folder / "report"


def test_a_broken_gyro_is_located_beside_a_sound_recording(broken) -> None:
    """No effect with a name comes and goes, so the gyro must stay what is not explained, in its interval."""
    found, _ = broken
    assert found["verdict"] in (PARTLY, UNEXPLAINED)
    first = found["mismatch"][0]
    assert (first["recording"], first["channel"]) == ("broken", "gyro.x")
    assert first["interval_s"] == pytest.approx(list(BURST_S), abs=60.0)
    assert found["unexplained"]["channel"] == "gyro.x"
    assert found["unexplained"]["interval_s"] == pytest.approx(list(BURST_S), abs=60.0)
    assert found["unexplained"]["significance_sigma"] > 5.0


def test_no_other_sensor_is_blamed_for_a_broken_gyro(broken) -> None:
    """Accelerometers, and the gyros y and z, are perfect: nothing of theirs may be called sure."""
    found, _ = broken
    assert {(one["name"].partition(".")[0], one["axis"]) for one in found["effects"]} <= {("gyro", "x")}
    held_out = found["fit"].get("held_out")
    assert held_out is None or held_out["after"] < WORSE * held_out["before"]


def test_the_page_of_a_broken_gyro(broken) -> None:
    words = (broken[1] / "report.txt").read_text()
    assert "Gyro x of broken" in words
    assert (broken[1] / "figures" / "whitened_residuals_2.svg").is_file()


def test_a_sound_recording_has_evidence_and_limits_but_nothing_located(sound) -> None:
    found = sound
    assert found.verdict == NO_MISMATCH
    of = basis(found)
    places = evidence(of, None)
    assert places[0].log_bayes_factor < of.space.cost
    assert not any(one.named for one in places)
    assert located(found) is None
    assert before_after(found, 0) is None
    assert len(limits(of)) == len(places)


def test_what_nothing_explains_is_found_in_size_and_time(both) -> None:
    found = both.found.diagnosis
    found = replace(found, effects=(), linearisation=None, unnamed=replace(found.unnamed, mismatch=found.mismatches[0]))
    one = located(found)
    assert (one.channel, one.unit) == ("gyro.x", "deg/h")
    assert not np.isfinite(one.effect).any()
    inside = (one.time_s > BURST_S[0] + 120.0) & (one.time_s < BURST_S[1] - 120.0)
    outside = (one.time_s < BURST_S[0] - 120.0) | (one.time_s > BURST_S[1] + 120.0)
    height = one.mean[inside].mean() - one.mean[outside].mean()
    assert height == pytest.approx(BURST_DEG_PER_H, rel=SHARE)


def test_an_effect_lies_along_what_data_find(drifting) -> None:
    found = drifting
    assert found.verdict == EXPLAINED
    effect = found.effects[0]
    assert (effect.hypothesis.candidate.name, effect.hypothesis.candidate.axis) == ("gyro.bias_drift", "x")
    places = evidence(basis(found), effect)
    assert [one.named for one in places[:2]] == [True, False]
    one = located(found, effect)
    assert (one.channel, one.unit, one.drive_unit) == ("gyro.x", "deg/h", "h")
    truth = DRIFT_DEG_PER_H2 * one.time_s / HOUR
    np.testing.assert_allclose(one.drive, one.time_s / HOUR, atol=0.01)
    np.testing.assert_allclose(one.effect, truth, atol=SHARE * truth.max())
    np.testing.assert_allclose(one.mean, truth, atol=SHARE * truth.max())


def test_the_residual_falls_with_the_effect_and_one_noise(drifting) -> None:
    _, before, after = before_after(drifting, 0)
    squares = [float(np.nansum(e**2)) for e in (before, after)]
    assert squares[1] < 0.5 * squares[0]


def test_a_column_is_the_error_of_its_own_sensor(flight) -> None:
    case = prepare(flight)
    one = case.member("accelerometer.bias", "z", {})
    driven, measured = disturbances(case, one.column)
    np.testing.assert_allclose(driven[:, 2], one.nominal * UG, rtol=EPOCH_SHARE)
    assert np.abs(driven[:, [0, 1]]).max() < 0.1 * one.nominal * UG  # nothing but turning within an epoch
    assert not measured.any()


def test_the_missing_rotation_of_the_earth_is_what_three_gyros_feel(flight) -> None:
    case = prepare(flight)
    one = case.member("earth.rotation", None, {})
    driven, _ = disturbances(case, one.column)
    felt = np.linalg.norm(driven[:, 3:], axis=1) / one.nominal
    np.testing.assert_allclose(felt, EARTH_RATE, rtol=0.02)


def test_a_fast_clock_is_a_gyro_that_misses_the_turn_of_the_earth_and_no_more(flight) -> None:
    """At rest in n a fast clock adds gravity and the turning of n; that it moves a position is the error of no gyro."""
    case = prepare(flight)
    one = case.member("recording.clock_drift", None, {})
    driven, _ = disturbances(case, one.column)
    rate, force = (np.linalg.norm(part, axis=1) / (PPM * one.nominal) for part in (driven[:, 3:], driven[:, :3]))
    transport = np.linalg.norm(case.model.states.velocity_n, axis=1).max() / 6.37e6
    np.testing.assert_allclose(rate, EARTH_RATE, atol=1.5 * transport)  # and tan(latitude) of it about down
    np.testing.assert_allclose(force, STANDARD_GRAVITY, rtol=0.02)


def test_a_file_is_sent_to_import(tmp_path) -> None:
    with pytest.raises(UsageError, match="ins-eval import"):
        diagnose.run([tmp_path / "nothing.csv"])


def case(name: str, north_m: np.ndarray, east_m: np.ndarray, velocity: tuple[float, float]) -> SimpleNamespace:
    """A recording of which only the errors of navigation are known, a node every ten minutes."""
    residual = np.full((north_m.size, 9), np.nan)
    residual[:, :6] = 0.0
    residual[:, 0], residual[:, 1] = north_m, east_m
    residual[1:, 3:5] = velocity
    model = SimpleNamespace(nodes_s=5000.0 + 600.0 * np.arange(north_m.size))
    return SimpleNamespace(name=name, kind="flight", believed=object(), model=model, inertial=lambda: residual)


def hypothesis(name: str, axis: str | None, unit: str, **parameters) -> Hypothesis:
    column = Column("")
    return Hypothesis(Candidate(name, axis, unit, 1.0, column, parameters), (column, None))


CREEP = hypothesis("accelerometer.bias_creep", "x", "ug/degC", time_constant_s=2400.0)
TURN = hypothesis("gyro.misalignment", "y", "urad", other_axis="x")
DRIFT = hypothesis("accelerometer.bias_drift", "x", "ug/h")
STEP = hypothesis("accelerometer.bias_step", "x", "ug", at_s=600.0)
SHAPE = hypothesis("composed", "z", "ug per unit of fan_hz", driver="fan_hz",
                   form="accelerometer bias = value * lag(fan_hz, 600)")  # fmt: skip
LAG = hypothesis("temperature.lag", None, "s", lag_s=60.0)
LEFT = Mismatch(0, "gyro.x", "x", 5600.0, 6800.0, "climb", 5.123456)
RESTLESS = Wander("gyro", 4e-8, 2e-8)


def diagnosis(verdict: str, effects=(), rivals=(), mismatches=(), unnamed=None) -> Diagnosis:
    nodes = np.arange(7)
    before = (
        case("first", 300.0 * nodes, 400.0 * nodes, (0.3, -0.4)),
        case("second", 0.0 * nodes, 0.0 * nodes, (0, 0)),
    )
    after = (case("first", 30.0 * nodes, 40.0 * nodes, (0.03, -0.04)), before[1]) if effects else ()
    return Diagnosis(
        cases=before,
        verdict=verdict,
        effects=tuple(FoundEffect(one, 4.8, 0.15, 0.97, 41.2, 4e-4, spread) for one, spread in effects),
        rivals=tuple(rivals),
        mismatches=tuple(mismatches),
        unnamed=unnamed or UnnamedDisturbance(None, 0.0, 1.1),
        null=(),
        fitted=(),
        innovations=(),
        statistics={},
        held_out={"before": 14.2, "after": 1.03, "placebo": 13.8, "measure": "as said"} if effects else {},
        after=after,
        linearisation=None,
        policy=Policy(),
    )


NAMED = [(CREEP, {"time_constant_s": (1900.0, 3000.0)}), (TURN, {}), (SHAPE, {}), (LAG, {"lag_s": (40.0, 80.0)})]
RIVALS = [
    Rival(CREEP, DRIFT, 0.02, 2.9, False, "an oven run with the flight's temperatures", 21.0, value=30.0, sigma=5.0),
    Rival(CREEP, STEP, 0.01, 3.4, True, value=-20.0, sigma=5.0, spread={"at_s": (580.0, 615.0)}),
    Rival(CREEP, SHAPE, 0.01, 3.4, True),
    Rival(CREEP, TURN, 0.01, 3.5, True, beside=(DRIFT,), value=12.0),
]
OF_VERDICT = {
    NO_MISMATCH: diagnosis(NO_MISMATCH),
    EXPLAINED: diagnosis(EXPLAINED, NAMED, (), [LEFT]),
    NOT_IDENTIFIABLE: diagnosis(NOT_IDENTIFIABLE, NAMED, RIVALS, [LEFT]),
    PARTLY: replace(
        diagnosis(PARTLY, NAMED, RIVALS, [LEFT, LEFT], UnnamedDisturbance(LEFT, 9.0, 5.123456)),
        withdrawn=(Withdrawn(FoundEffect(DRIFT, 1.0, 2.0, 0.2, 1.0, 0.5), "its probability is below a half"),),
    ),
    UNEXPLAINED: diagnosis(UNEXPLAINED, (), (), [LEFT], UnnamedDisturbance(LEFT, 9.0, 5.123456, wander=RESTLESS)),
}


def test_the_verdicts_are_those_of_the_contract() -> None:
    assert set(OF_VERDICT) == VERDICTS


@pytest.mark.parametrize("verdict", sorted(VERDICTS))
def test_every_answer_has_its_keys(verdict: str) -> None:
    found = answer(OF_VERDICT[verdict])
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert set(found) == KEYS
    assert (found["format"], found["verdict"]) == ("ins-diagnosis/1", verdict)
    assert all(set(one) == OF_MISMATCH for one in found["mismatch"])
    assert all(set(one) >= OF_EFFECT for one in found["effects"])
    assert all(set(one) >= OF_RIVAL for one in found["indistinguishable"])
    assert set(found["unexplained"]) == OF_UNEXPLAINED
    assert set(found["fit"]) == (OF_FIT if found["effects"] else OF_FIT - {"held_out"})
    for one in found["effects"]:
        for name in [key for key in one["parameters"] if key.endswith("interval95")]:
            low, high = one["parameters"][name]
            assert low < one["parameters"]["value" if name == "interval95" else name.removesuffix("_interval95")] < high


def test_what_an_answer_says_of_its_effects() -> None:
    creep, turn, shape, lag = answer(OF_VERDICT[PARTLY])["effects"]
    assert creep["parameters"] == {
        "value": 4.8,
        "interval95": pytest.approx([4.8 - 1.96 * 0.15, 4.8 + 1.96 * 0.15]),
        "unit": "ug/degC",
        "time_constant_s": 2400.0,
        "time_constant_s_interval95": [1900.0, 3000.0],
    }
    assert turn["parameters"]["other_axis"] == "x"
    assert (shape["driver"], shape["form"]) == ("fan_hz", "accelerometer bias = value * lag(fan_hz, 600)")
    assert set(lag["parameters"]) == {"value", "interval95", "unit"}  # its lag is the value
    assert (creep["probability"], creep["log_evidence_gain"], creep["false_alarm_probability"]) == (0.97, 41.2, 4e-4)


def test_what_an_answer_says_of_rivals_and_of_what_is_left() -> None:
    found = answer(OF_VERDICT[PARTLY])
    drift, step, shape, _ = found["indistinguishable"]
    assert drift["parameters"] == {"value": 30.0, "interval95": [30.0 - 1.96 * 5.0, 30.0 + 1.96 * 5.0], "unit": "ug/h"}
    assert step["parameters"]["at_s"] == 600.0 and "parameters" not in shape
    assert step["parameters"]["at_s_interval95"] == [580.0, 615.0]
    assert (drift["from"], drift["name"], drift["axis"]) == (
        "accelerometer.bias_creep",
        "accelerometer.bias_drift",
        "x",
    )
    assert (drift["experiment"], drift["expected_log_bayes_factor"]) == (RIVALS[0].experiment, 21.0)
    assert (drift["log_evidence_below_best"], drift["told_apart_by_prior_only"]) == (2.9, False)
    assert (shape["driver"], shape["told_apart_by_prior_only"], shape["experiment"]) == ("fan_hz", True, None)
    left = {"significance_sigma": 5.12, "channel": "gyro.x", "interval_s": [5600.0, 6800.0], "wander": None}
    assert found["unexplained"] == left
    assert found["mismatch"][0]["recording"] == "first"


def test_the_errors_of_navigation() -> None:
    """One recording leaves at 500 m in ten minutes, the other not at all: means over both."""
    fit = answer(OF_VERDICT[EXPLAINED])["fit"]
    rms = fit["velocity_rms_mps"]
    assert rms["before"] == pytest.approx({"north": 0.3 / np.sqrt(2.0), "east": 0.4 / np.sqrt(2.0)})
    assert rms["after"] == pytest.approx({"north": 0.03 / np.sqrt(2.0), "east": 0.04 / np.sqrt(2.0)})
    rate = fit["radial_error_rate_nmi_per_h"]
    assert rate["before"] == pytest.approx(3000.0 / NMI / np.sqrt(2.0))
    assert rate["after"] == pytest.approx(300.0 / NMI / np.sqrt(2.0))


def test_every_effect_lives_in_a_channel_of_the_contract() -> None:
    for name, effect in VOCABULARY.items():
        for axis in effect.axes:
            assert channel_of(name, axis, {"form": "gyro bias = value * change(u)"}) in CHANNELS


@pytest.mark.parametrize(
    ("unit", "channel", "disturbed", "drive", "of"),
    [
        ("urad", Channel("reference.attitude", "D", 10.0 * ARCSEC, 8), 1e-6 / ARCSEC, 1.0, ""),  # an angle by an angle
        ("urad", Channel("gyro.x", "x", DEG_PER_H), 1e-6 * 90.0 * HOUR, 90.0, "deg/s"),
        ("ppm", Channel("accelerometer.z", "z", UG), 1.0, 1.0, "g"),  # 1 ppm of 1 g is 1 ug
        ("ppm", Channel("gps.velocity", "N", 0.02, 3), 1e-6 * 70.0, 70.0, "m/s"),
    ],
)
def test_what_a_value_multiplies_has_the_unit_of_its_channel(unit, channel, disturbed, drive, of) -> None:
    """`disturbed` is what a value of 1 does to the channel, in the unit of the channel."""
    factor, found = nonparametric._drive_unit(SimpleNamespace(unit=unit), channel)
    assert (factor * disturbed, found) == (pytest.approx(drive), of)
