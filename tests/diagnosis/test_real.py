"""What the null says of real recordings: beside it stand numbers that need no error model. Skipped where they are not.

Sources of the recordings and what is documented of them: `SOURCE.md` beside each.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ins_eval.diagnosis.answer.judge import Diagnosis, judge
from ins_eval.diagnosis.answer.summary import turned_on
from ins_eval.earth import EARTH_RATE
from ins_eval.error_model.columns import Column, Drive, Measured
from ins_eval.estimation import case as cases
from ins_eval.estimation.case import Case
from ins_eval.estimation.chamber import prepare_chamber
from ins_eval.estimation.noise_fit import Fitted
from ins_eval.recording import ChamberReadings, Recording
from ins_eval.recording.belief import EarthBelief
from ins_eval.recording.stillness import still_stretches
from ins_eval.units import DEG, DEG_PER_H, STANDARD_GRAVITY
from tests.diagnosis.real_recordings import (
    chamber_belief,
    fog_mems,
    half,
    laser,
    ramp,
    shuffled_axes,
    shuffled_reference,
    shuffled_temperature,
    words,
)

pytestmark = pytest.mark.slow

# by cross-correlation of the two boxes' turn rates, without any navigation; half of the recording apart 0.3 ms
STAMPS_LATE_S, STAMPS_AGREE_S = 0.0155, 0.0005
AUTHORS_BIAS_FRD = np.array([0.00077050, -0.00103577, -0.00040954])  # rad/s
BIAS_AGREES = 1e-4
HEADING_DEG, HEADING_AGREES_DEG = 90.6, 0.6
FRACTION_AGREES = 0.015
LATITUDE_AGREES_DEG = 0.6
RATE_HZ = 100.0
BEFORE_DEG_PER_H, AFTER_DEG_PER_H = 8.6, 0.23  # of three gyros, the Earth's rate not taken off and taken off
BEFORE_DEG_PER_S, AFTER_DEG_PER_S = 0.10, 0.03
MOUNTING_URAD = {"y": 1540.0, "z": -5110.0}  # the authors' angles, in our axes and sense
MOUNTING_AGREES_URAD = 500.0
CONSTANT_MG, LINE_MG, LEFT_MG = 1.737, 0.953, 0.84  # of a constant, a line in temperature, that and a rate; noise 0.82
AS_SHOWN_MG, NEAR_MG = 0.002, 0.05
SHORT_FILTER_S = 30.0  # the rate settles within the first part of a ramp of 56 s
SHEET_UG = 5000.0  # a MEMS unit that states its bias to 5 mg
STRETCH_S = 10.0  # of what is shuffled
RATES = {"accelerometer.bias_temperature_rate", "accelerometer.scale_temperature_rate"}
STEPS = {"accelerometer.bias_step", "accelerometer.scale_step"}
PROBABLE = 0.01  # a twin that nothing but its size speaks against is listed however improbable it is
MEMORIES = {"accelerometer.bias_creep", "temperature.lag"}
RAMP_BEGINS_S, RAMP_AGREES_S = 144.0, 10.0
WHITE_RMS = (0.6, 1.4)
LEVEL_SIGMA_DEG, HEADING_SIGMA_DEG = 0.02, 2.0
RIVAL_BIAS_SIGMA = 10.0 * DEG_PER_H  # of three constant gyro biases instead of the Earth


def solved(case: Case, centre: np.ndarray | None = None) -> tuple[Fitted, np.ndarray]:
    """Noise and nuisances at their best; the prior of the last nuisances is around `centre` instead of 0."""
    count = len(case.nuisances)
    mean = np.zeros(count)
    if centre is not None:
        mean[count - centre.size :] = centre
    fitted = replace(case, taken=case.taken - mean).fitted()
    sums = fitted.whitened
    return fitted, mean + np.linalg.solve(np.eye(count) + sums.normal, sums.projection)


def with_columns(case: Case, *columns: Column) -> Case:
    taken = np.append(case.taken, np.zeros(len(columns)))
    return replace(case, nuisances=(*case.nuisances, *columns), taken=taken)


def place(case: Case, name: str) -> int:
    return [column.name for column in case.nuisances].index(name)


# ---------------------------------------------------------------- MEMS beside a fibre-optic navigator


@pytest.fixture(scope="module")
def vehicle() -> Recording:
    return fog_mems()


BOXES = tuple(Column(f"box {axis}", (Measured(f"mount_{axis}", 0.01),)) for axis in "xyz")
LATE = Column("late", (Measured("delay", 0.02),))


def test_the_clocks_of_two_boxes() -> None:
    late_s = 0.0
    for _ in range(2):  # the column is linear in a delay through which the box turns
        case = with_columns(cases.prepare(fog_mems(late_s)), *BOXES, LATE)
        _, found = solved(case)
        late_s += 0.02 * found[-1]
    assert late_s == pytest.approx(STAMPS_LATE_S, abs=STAMPS_AGREE_S)


def test_biases_and_a_white_remainder_once_clocks_and_boxes_agree(vehicle) -> None:
    case = with_columns(cases.prepare(fog_mems(STAMPS_LATE_S)), *BOXES)
    fitted, found = solved(case)
    sigma = vehicle.belief.gyro.bias_sigma_deg_per_h * DEG_PER_H
    own = np.array([found[place(case, f"turn-on bias of gyro {axis}")] for axis in "xyz"]) * sigma
    bias = np.asarray(vehicle.belief.gyro.bias_radps) + own
    np.testing.assert_allclose(bias, AUTHORS_BIAS_FRD, atol=BIAS_AGREES)
    whitened = case.whitened([], fitted.noise_point, keep=found.size + 1)
    innovations = whitened.kept[..., 0] - whitened.kept[..., 1:] @ found
    rms = np.sqrt(np.nanmean(innovations[:, 3:] ** 2, axis=0))
    assert np.all((rms > WHITE_RMS[0]) & (rms < WHITE_RMS[1])), rms


def rate_residual(recording: Recording, late_s: float, bias: np.ndarray) -> float:
    """RMS in deg/s of the gyros less `bias`, each tenth of a second, against the turn of the other box."""
    imu, fixes = recording.imu, recording.reference
    edges = np.append(recording.start.time_s, imu.time_s)
    angle = np.concatenate([np.zeros((1, 3)), np.cumsum(imu.gyro, axis=0)])
    at = fixes.time_s - late_s
    inside = (at >= edges[0]) & (at <= edges[-1])
    told = Rotation.from_euler("ZYX", fixes.attitude_rad[inside][:, ::-1])
    turned = (told[:-1].inv() * told[1:]).as_rotvec()
    felt = np.diff(np.column_stack([np.interp(at[inside], edges, a) for a in angle.T]), axis=0)
    step_s = np.diff(at[inside])[:, None]
    return float(np.sqrt(np.mean(((felt - turned) / step_s - bias) ** 2))) / DEG


@pytest.mark.parametrize("part", ["first half", "second half", "whole"])
def test_clocks_are_named_before_all_else_and_what_is_left_is_small(vehicle, part) -> None:
    some = vehicle if part == "whole" else half(vehicle, part == "second half")
    found = judge([cases.prepare(some)])
    assert found.effects[0].hypothesis.key[0] == "reference.time_offset"
    assert found.effects[0].value == pytest.approx(STAMPS_LATE_S, abs=STAMPS_AGREE_S)
    assert not any(one.hypothesis.key[0].startswith("accelerometer.") for one in found.effects)  # the road is no law
    case = with_columns(found.after[0], *BOXES)
    _, best = solved(case)
    sigma = some.belief.gyro.bias_sigma_deg_per_h * DEG_PER_H
    own = np.array([best[place(case, f"turn-on bias of gyro {axis}")] for axis in "xyz"]) * sigma
    bias = np.asarray(some.belief.gyro.bias_radps) + own
    np.testing.assert_allclose(bias, AUTHORS_BIAS_FRD, atol=BIAS_AGREES)
    assert rate_residual(some, 0.0, bias) > BEFORE_DEG_PER_S
    assert rate_residual(some, found.effects[0].value, bias) < AFTER_DEG_PER_S


@pytest.fixture(scope="module")
def unbiased() -> Diagnosis:
    """Neither the clock nor the biases of the authors believed."""
    return judge([cases.prepare(fog_mems(biases=False))])


def test_the_clock_comes_first_and_then_the_gyro_biases_of_the_authors(unbiased) -> None:
    assert unbiased.effects[0].hypothesis.key[0] == "reference.time_offset"
    assert unbiased.effects[0].value == pytest.approx(STAMPS_LATE_S, abs=STAMPS_AGREE_S)  # later: a positive offset
    assert "the stamps of the better navigator are later than believed" in words(unbiased)
    effects = {(one.hypothesis.key[0], one.hypothesis.key[1]): one.value for one in unbiased.effects}
    bias = {one.name: one.found for one in turned_on(unbiased, 0)}
    found = np.array([effects.get(("gyro.bias", axis), 0.0) + bias[f"turn-on bias of gyro {axis}"] for axis in "xyz"])
    np.testing.assert_allclose(found * DEG_PER_H, AUTHORS_BIAS_FRD, atol=BIAS_AGREES)


def test_the_mounting_of_the_two_boxes_is_that_of_the_authors(unbiased) -> None:
    effects = {(one.hypothesis.key[0], one.hypothesis.key[1]): one.value for one in unbiased.effects}
    for axis, urad in MOUNTING_URAD.items():
        assert effects["reference.misalignment", axis] == pytest.approx(urad, abs=MOUNTING_AGREES_URAD)


def test_a_reference_in_another_order_has_no_clock(vehicle) -> None:
    found = judge([cases.prepare(shuffled_reference(vehicle, STRETCH_S, seed=1))])
    assert "reference.time_offset" not in {one.hypothesis.key[0] for one in found.effects}


def test_no_alarm_about_clocks_that_agree() -> None:
    found = judge([cases.prepare(fog_mems(STAMPS_LATE_S))])
    for one in found.effects:
        assert one.hypothesis.key[0] != "reference.time_offset" or abs(one.value) < STAMPS_AGREE_S


# ---------------------------------------------------------------- parked laser gyros, the Earth not believed to turn


@pytest.fixture(scope="module")
def quiet() -> Recording:
    """The longest quiet stretch, level by its accelerometers, heading as documented."""
    whole = laser(rotation=True)
    stretch = max(still_stretches(whole.imu), key=lambda s: s.duration_s)
    imu = whole.imu
    rows = (imu.time_s > stretch.start_s) & (imu.time_s <= stretch.end_s)
    x, y, z = -imu.accelerometer[rows].mean(axis=0)
    start = replace(
        whole.start,
        time_s=stretch.start_s,
        attitude_rad=(float(np.arctan2(y, z)), float(np.arctan2(-x, np.hypot(y, z))), HEADING_DEG * DEG),
        attitude_sigma_rad=(LEVEL_SIGMA_DEG * DEG, LEVEL_SIGMA_DEG * DEG, HEADING_SIGMA_DEG * DEG),
    )
    some = replace(imu, time_s=imu.time_s[rows], gyro=imu.gyro[rows], accelerometer=imu.accelerometer[rows])
    return replace(whole, imu=some, start=start)


@pytest.fixture(scope="module")
def unturned() -> Recording:
    """The whole recording with an Earth that is not believed to turn."""
    return laser(rotation=False)


@pytest.fixture(scope="module")
def turning(unturned) -> Diagnosis:
    return judge([cases.prepare(unturned)])


def test_the_rotation_that_was_left_out_is_named_with_rate_and_heading(turning, unturned) -> None:
    assert [one.hypothesis.key[0] for one in turning.effects] == ["earth.rotation"]
    fraction = turning.effects[0]
    assert turning.verdict in ("explained", "partly explained")  # a jolt of an accelerometer stands beside it
    assert fraction.value == pytest.approx(1.0, abs=FRACTION_AGREES)
    heading_deg = next(one.found for one in turned_on(turning, 0) if one.name == "heading")
    assert heading_deg == pytest.approx(HEADING_DEG, abs=HEADING_AGREES_DEG)
    # gyros of a standstill against the rate and the heading that were found
    start = turning.after[0].believed.start
    stretch = next(s for s in still_stretches(unturned.imu) if s.end_s > start.time_s)
    rows = (unturned.imu.time_s > stretch.start_s) & (unturned.imu.time_s <= stretch.end_s)
    rate = unturned.imu.gyro[rows].mean(axis=0) * RATE_HZ
    to_body = Rotation.from_euler("ZYX", [heading_deg * DEG, *start.attitude_rad[1::-1]]).inv()
    north, down = np.cos(start.latitude_rad), -np.sin(start.latitude_rad)
    left = rate - to_body.apply(fraction.value * EARTH_RATE * np.array([north, 0.0, down]))
    before, after = (float(np.sqrt(np.mean(np.square(x)))) / DEG_PER_H for x in (rate, left))
    assert before == pytest.approx(BEFORE_DEG_PER_H, abs=0.2)
    assert after < AFTER_DEG_PER_H
    # what the gyros feel about down is not in the fit; with the rate found it is the sine of the latitude
    latitude_deg = np.arcsin(to_body.inv().apply(rate)[2] / (-fraction.value * EARTH_RATE)) / DEG
    assert latitude_deg == pytest.approx(start.latitude_rad / DEG, abs=LATITUDE_AGREES_DEG)


def test_three_constant_biases_are_the_rival_and_turning_the_box_settles_it(turning) -> None:
    together = [one for one in turning.rivals if one.of.key[0] == "earth.rotation"]
    assert {one.hypothesis.key[:2] for one in together} == {("gyro.bias", axis) for axis in "xyz"}
    rate_deg_per_h = np.sqrt(sum(one.value**2 for one in together))  # three numbers that make one known rate
    assert rate_deg_per_h * DEG_PER_H == pytest.approx(EARTH_RATE, rel=FRACTION_AGREES)
    assert all(one.by_prior_only and len(one.beside) == 2 for one in together)
    assert {one.experiment for one in together} == {"turning the box through four headings while parked"}
    said = words(turning)
    assert "together would fit as well" in said
    assert "The earth rotation is preferred because it is known to be there" in said
    assert "Turning the box through four headings while parked would separate them" in said


def test_gyros_that_trade_places_are_not_the_earth(unturned) -> None:
    found = judge([cases.prepare(shuffled_axes(unturned, STRETCH_S, seed=0))])
    assert "earth.rotation" not in {one.hypothesis.key[0] for one in found.effects}


def test_no_alarm_about_a_rotation_that_is_believed(unturned) -> None:
    believed = replace(unturned, belief=unturned.belief.model_copy(update={"earth": EarthBelief()}))
    found = judge([cases.prepare(believed)])
    assert not {one.hypothesis.key[0] for one in found.effects} & {"earth.rotation", "gyro.bias", "alignment.heading"}
    assert all(one.channel.startswith("accelerometer") for one in found.mismatches)


def test_gyros_that_turn_the_wrong_way_are_not_the_earth(unturned) -> None:
    backwards = replace(unturned, imu=replace(unturned.imu, gyro=-unturned.imu.gyro))
    found = judge([cases.prepare(backwards)])
    assert "earth.rotation" not in {one.hypothesis.key[0] for one in found.effects}


def test_a_parked_unit_is_judged_without_a_heading_too(unturned) -> None:
    """It is found with everything else; its sigma is that of any heading."""
    case = cases.prepare(replace(unturned, start=replace(unturned.start, attitude_rad=None)))
    assert np.isfinite(case.seen.residual[:, :6]).any()
    assert case.believed.attitude_sigma_n[2] > 90.0 * DEG


def test_a_wrong_heading_is_turned_back(quiet) -> None:
    off_deg = 3.0
    roll, pitch, heading = quiet.start.attitude_rad
    start = replace(quiet.start, attitude_rad=(roll, pitch, heading + off_deg * DEG))
    case = cases.prepare(replace(quiet, start=start))
    _, found = solved(case)
    phi_deg = HEADING_SIGMA_DEG * found[place(case, "start attitude D")]
    assert phi_deg == pytest.approx(-off_deg, abs=HEADING_AGREES_DEG)


def test_one_rotation_is_more_probable_than_three_biases_that_fit_as_well(quiet) -> None:
    """Each by its own mechanization, on one white noise: a column of the whole Earth rate is no longer small."""
    earth = cases.prepare(quiet)
    rate = quiet.imu.gyro.mean(axis=0) * 100.0
    belief = quiet.belief.model_copy(
        update={
            "earth": EarthBelief(rotation=False),
            "gyro": quiet.belief.gyro.model_copy(update={"bias_radps": tuple(float(w) for w in rate)}),
        }
    )
    still = cases.prepare(replace(quiet, belief=belief))
    still = replace(still, noise=replace(still.noise, white=earth.noise.white))
    columns = [Column(f"bias {axis}", (Drive("gyro", axis, "1", RIVAL_BIAS_SIGMA),)) for axis in range(3)]
    with_earth, _ = solved(earth)
    with_biases, _ = solved(with_columns(still, *columns), -rate / RIVAL_BIAS_SIGMA)
    assert 5.0 < with_earth.log_evidence - with_biases.log_evidence < 20.0


# ---------------------------------------------------------------- MEMS accelerometer, one rising ramp


@pytest.fixture(scope="module")
def readings() -> ChamberReadings:
    return ramp()


def diagnosed(readings: ChamberReadings, **belief: float) -> Diagnosis:
    believed = chamber_belief(readings, **belief)
    return judge([prepare_chamber(readings, believed, "ramp")], belief=believed)


def left_mg(case: Case) -> float:
    return float(np.nanstd(case.seen.residual[:, 0])) / STANDARD_GRAVITY * 1e3


def names(found: Diagnosis, probability: float = 0.0) -> set[str]:
    """Effects and rivals at least as probable."""
    return {one.hypothesis.key[0] for one in (*found.effects, *found.rivals) if one.probability >= probability}


@pytest.mark.parametrize("further", [{}, {"bias_sigma_ug": SHEET_UG}], ids=["by default", "by its sheet"])
def test_a_rate_is_named_with_a_filter_of_its_own(readings, further) -> None:
    """180 s, the filter of the convention, is longer than the ramp: in such a recording the filter is found as well."""
    found = diagnosed(readings, **further)
    assert found.verdict == "not identifiable"  # one position cannot tell bias from scale
    assert len(found.effects) == 1
    assert names(found, PROBABLE) == RATES
    assert found.effects[0].hypothesis.candidate.parameters["rate_filter_s"] < SHORT_FILTER_S
    assert left_mg(found.cases[0]) == pytest.approx(CONSTANT_MG, abs=AS_SHOWN_MG)
    assert left_mg(found.after[0]) == pytest.approx(LEFT_MG, abs=NEAR_MG)


def test_temperature_alone_is_not_enough_and_what_one_ramp_cannot_tell_is_said(readings) -> None:
    found = diagnosed(readings, line=True, bias_sigma_ug=SHEET_UG)
    assert left_mg(found.cases[0]) == pytest.approx(LINE_MG, abs=AS_SHOWN_MG)
    assert found.effects[0].hypothesis.key[0] in RATES
    assert left_mg(found.after[0]) == pytest.approx(LEFT_MG, abs=NEAR_MG)
    assert found.verdict == "not identifiable"
    assert names(found) >= RATES | MEMORIES
    jump = {one for one in found.rivals if one.hypothesis.key[0].endswith("_step")}  # where the ramp begins
    assert all("in a chamber, four positions" in one.experiment for one in set(found.rivals) - jump)
    assert {one.experiment for one in jump} <= {"the same again"}
    assert "something else fits as well" in words(found)


@pytest.mark.parametrize("late_s", [60, 100, 160])
def test_a_temperature_of_another_time_explains_nothing(readings, late_s) -> None:
    """What the rate does is left as a change in time, where the ramp was: no law of temperature is named or listed."""
    found = diagnosed(replace(readings, temperature_c=np.roll(readings.temperature_c, late_s)))
    assert names(found) <= STEPS
    assert found.verdict in ("unexplained", "not identifiable")
    assert found.mismatches[0].begin_s == pytest.approx(RAMP_BEGINS_S, abs=RAMP_AGREES_S)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_shuffled_temperature_explains_nothing(readings, seed) -> None:
    found = diagnosed(shuffled_temperature(readings, 10, seed), bias_sigma_ug=SHEET_UG)
    assert names(found) <= STEPS


def test_no_alarm_about_a_rate_that_is_believed(readings) -> None:
    first = diagnosed(readings, line=True, bias_sigma_ug=SHEET_UG)
    again = judge(first.after)
    assert again.verdict == "no mismatch"
