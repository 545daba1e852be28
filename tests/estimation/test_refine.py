"""Effects of unknown value and time, concealed in recordings by other code: the truth comes back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ins_eval.diagnosis.answer.judge import judge
from ins_eval.effects.accelerometer import CREEP_TIME
from ins_eval.effects.effect import Parameter
from ins_eval.error_model.columns import Column
from ins_eval.error_model.library import Candidate
from ins_eval.estimation.case import Case, prepare, with_effects
from ins_eval.estimation.placing import Q95, Point, Profile, of_tried
from ins_eval.estimation.refine import _same_white, refine
from ins_eval.estimation.study import Hypothesis, fit_noise, sums
from ins_eval.recording.belief import EffectBelief
from ins_eval.units import UG

SIGMAS = 4.0  # within which a value must come back
STEP_S, STEP_UG = 1500.0, 200.0
SMALL_UG, LEVEL_UG, BETWEEN_S, LATER_S, BESIDE_S = 15.0, 100.0, 1360.0, 2470.0, 15.0
NODES = 2.0  # s, two seconds of zero velocity: within which a step must come back
SECONDS_OF_WEEK = 300000.0
LARGE, OF_LARGE = 30.0, 0.01  # ug/degC, or ppm/degC
TAU_S, CREEP = 2000.0, 5.0  # s, ug/degC
OF_TAU = 0.06  # relative
OF_STEP = 0.1  # a density that is straight between values
OF_INTERVAL = 0.1  # sigmas, of straight lines between values a quarter of a sigma apart
AT_S, ROUNDING = 3000.0, 1e-6  # of sums from which what is uncertain anyway is taken
LEAST_BENT = 0.1  # of a relative change of the time constant, by which the value changes at least
STATED_UG = 100.0
FAN_UG, OF_FAN = 100.0, 0.05


def recorded(case: Case, name: str, **parameters) -> tuple[Case, Hypothesis]:
    member = case.member(name, "z", parameters)
    return case, Hypothesis(member, (member.column,))


def refined(case: Case, one: Hypothesis) -> Point:
    return refine([case], [one], fit_noise([case], [one.scaled(4.0)], [None]))


def estimate(found: Point) -> tuple[float, float]:
    """Value and sigma by least squares on the sums around the belief."""
    here = sums(found.cases, [one.noise_point for one in found.fitted], found.taken, found.point)
    nominal = found.taken[0].candidate.nominal
    return nominal * float(here.projection[0] / here.normal[0, 0]), nominal / float(np.sqrt(here.normal[0, 0]))


@pytest.mark.slow
def test_a_small_jump_at_rest_is_found_between_the_instants_that_are_tried(recording_at_rest) -> None:
    """A minute beside its instant it fits worse than nothing, so that no instant of the grid is promising."""
    recording = recording_at_rest(3600.0, 2, lambda t: SMALL_UG * (t > BETWEEN_S))
    (effect,) = judge([prepare(recording)]).effects
    candidate = effect.hypothesis.candidate
    assert (candidate.name, candidate.axis) == ("accelerometer.bias_step", "z")
    assert candidate.parameters["at_s"] == pytest.approx(BETWEEN_S, abs=BESIDE_S)
    assert effect.value == pytest.approx(SMALL_UG, abs=SIGMAS * effect.sigma)


def test_a_jump_of_a_level_accelerometer_is_no_turn_of_a_gyro_and_hides_no_smaller_one(recording_at_rest) -> None:
    """A gyro that is off for a moment tilts the solution, and the tilt is felt as the jump is."""
    recording = recording_at_rest(3600.0, 2, lambda t: SMALL_UG * (t > BETWEEN_S))
    imu = recording.imu
    rate_hz = 1.0 / float(np.median(np.diff(imu.time_s)))
    force = imu.accelerometer.copy()
    force[imu.time_s > LATER_S, 0] += LEVEL_UG * UG / rate_hz
    effects = judge([prepare(replace(recording, imu=replace(imu, accelerometer=force)))]).effects
    assert len(effects) == 2
    for effect, axis, at_s, size_ug in zip(effects, "xz", (LATER_S, BETWEEN_S), (LEVEL_UG, SMALL_UG), strict=True):
        candidate = effect.hypothesis.candidate
        assert (candidate.name, candidate.axis) == ("accelerometer.bias_step", axis)
        assert candidate.parameters["at_s"] == pytest.approx(at_s, abs=BESIDE_S)
        assert effect.value == pytest.approx(size_ug, abs=SIGMAS * effect.sigma)


@pytest.mark.parametrize("start_s", [0.0, SECONDS_OF_WEEK])
def test_a_step_at_an_unknown_time(recording_at_rest, start_s: float) -> None:
    recording = recording_at_rest(3600.0, 1, lambda t: STEP_UG * (t > STEP_S), start_s=start_s)
    case, one = recorded(prepare(recording), "accelerometer.bias_step", at_s=start_s + 1440.0)
    found = refined(case, one)
    assert found.taken[0].candidate.parameters["at_s"] - start_s == pytest.approx(STEP_S, abs=NODES)
    value, sigma = estimate(found)
    assert abs(value - STEP_UG) < SIGMAS * sigma
    assert sigma < 0.05 * STEP_UG
    first, last = found.intervals[0].spread["at_s"]
    assert start_s < first <= last < start_s + 3600.0
    assert last - first < 10.0 * NODES


def temperature(t):
    return 20.0 + 15.0 * (1.0 - np.cos(2.0 * np.pi * t / 5000.0))


def creep_ug(t: np.ndarray) -> np.ndarray:
    """value (y - y(0)) with tau y' = T - y, integrated as the differential equation that it is."""
    begin = float(temperature(0.0))
    made = solve_ivp(lambda s, y: (temperature(s) - y) / TAU_S, (0.0, t[-1]), [begin], t_eval=t, rtol=1e-8)
    return CREEP * (made.y[0] - begin)


def test_a_large_effect_is_no_curve_without_a_name(recording_at_rest) -> None:
    """Nothing of it is left over, so a curve over temperature, which holds it as well, only has more to pay."""
    recording = recording_at_rest(1800.0, 1, lambda t: LARGE * (temperature(t) - 22.0), temperature)
    (effect,) = judge([prepare(recording)]).effects
    candidate = effect.hypothesis.candidate
    assert (candidate.name.rpartition("_")[2], candidate.axis) == ("temperature", "z")  # at 1 g of bias and scale alike
    assert abs(effect.value) == pytest.approx(LARGE, rel=OF_LARGE)  # z feels -1 g


@pytest.fixture(scope="module")
def crept(recording_at_rest) -> tuple[Case, Point]:
    recording = recording_at_rest(7200.0, 1, creep_ug, temperature)
    case, one = recorded(prepare(recording), "accelerometer.bias_creep", time_constant_s=1200.0)
    return case, refined(case, one)


def test_a_creep_of_unknown_time_constant(crept) -> None:
    _, found = crept
    tau = found.taken[0].candidate.parameters["time_constant_s"]
    assert tau == pytest.approx(TAU_S, rel=OF_TAU)
    low, high = found.intervals[0].spread["time_constant_s"]
    assert low < TAU_S < high
    assert low < tau < high
    assert np.log(high / low) > 2.0 * Q95 * CREEP_TIME.form  # however well it is measured
    assert found.intervals[0].bent[0] > (LEAST_BENT * found.point[0] * CREEP_TIME.form) ** 2
    value, sigma = estimate(found)
    assert abs(value - CREEP) < SIGMAS * sigma
    assert sigma < 0.1 * CREEP


def test_what_is_asked_for_again_and_again_is_whitened_once_and_changes_nothing(crept) -> None:
    """Asked for in another order, with others, and one of them twice, sums are what one pass over all makes of them."""
    _, found = crept
    (creep,) = found.taken
    others = [recorded(found.cases[0], name, at_s=AT_S)[1] for name in ("accelerometer.bias_step", "gyro.bias_step")]
    for asked, once in (([creep], others), (others, [creep]), (others[:1], others[1:])):
        normal, projection = found.sums(asked, once)
        every = [*asked, *once, creep]
        point = np.append(np.zeros(len(every) - 1), found.point)
        plain = sums(found.cases, [one.noise_point for one in found.fitted], every, point)
        np.testing.assert_allclose(normal, plain.normal[:-1, :-1], rtol=ROUNDING, atol=ROUNDING * plain.normal.max())
        np.testing.assert_allclose(projection, plain.projection[:-1], rtol=ROUNDING)


def test_the_recordings_are_navigated_with_what_was_found(crept) -> None:
    """What the creep did to the velocity at rest is gone, and the coefficient is what was taken off."""
    case, found = crept
    before, after = (np.nanstd(one.seen.residual[:, 5]) for one in (case, found.cases[0]))
    assert after < 0.25 * before
    value, sigma = estimate(found)
    assert abs(found.point[0] * found.taken[0].candidate.nominal - value) < sigma


def test_what_is_stated_stays_believed_beside_what_is_found(flight) -> None:
    stated = EffectBelief(name="accelerometer.bias", axis="x", value=STATED_UG)
    case = prepare(replace(flight, belief=with_effects(flight.belief, [stated])))
    np.testing.assert_array_equal(case.again([]).seen.residual, case.seen.residual)
    assert np.nanmax(np.abs(case.seen.residual - prepare(flight).seen.residual)) > 1.0  # m: the stated one acts


def test_sums_around_what_was_found_are_those_around_the_belief(crept) -> None:
    """The same effect with the same noise, from the recording as it is and from the one navigated with the effect."""
    case, found = crept
    tau = found.taken[0].candidate.parameters["time_constant_s"]
    _, one = recorded(case, "accelerometer.bias_creep", time_constant_s=tau)
    positions = [one.noise_point for one in found.fitted]
    there, here = sums([case], positions, [one]), sums(found.cases, positions, found.taken, found.point)
    assert here.normal[0, 0] == pytest.approx(there.normal[0, 0], rel=1e-3)
    assert here.projection[0] == pytest.approx(there.projection[0], rel=1e-3)


@pytest.mark.parametrize(
    ("candidate", "coefficient", "value", "recording"),
    [
        (Candidate("accelerometer.bias_creep", "x", "ug/degC", 2.0, Column(""), {"time_constant_s": 900.0}), 1.5, 3.0,
         None),
        (Candidate("gyro.bias_step", "x", "deg/h", 0.02, Column(""), {"at_s": 900.0}), -5.0, -0.1, "second"),
        (Candidate("earth.coriolis", None, "", 0.1, Column(""), centre=10.0), 9.3, 1.0, None),
        (Candidate("temperature.lag", "x", "s", 20.0, Column(""), {"lag_s": 60.0}), -0.5, 0.0, None),
    ],
)  # fmt: skip
def test_what_a_belief_says_of_an_effect(candidate, coefficient: float, value: float, recording) -> None:
    """A step belongs to its recording; a term of the Earth is there or not; no element is early."""
    one = Hypothesis(candidate, (None, candidate.column))
    found = one.believed(coefficient, [SimpleNamespace(name="first"), SimpleNamespace(name="second")])
    assert (found.name, found.axis, found.recording) == (candidate.name, candidate.axis, recording)
    assert found.value == pytest.approx(value)
    for name in ("time_constant_s", "at_s"):
        assert getattr(found, name) == candidate.parameters.get(name)


@dataclass(frozen=True)
class Levels:
    white: np.ndarray
    priors: str
    down: str


@pytest.mark.parametrize("nodes", [9, 10, 11])
@pytest.mark.parametrize(("level", "expected"), [(4.0, 3.0), (15.0, 15.0)])
def test_noise_stays_at_its_level_where_a_clock_that_is_set_right_leaves_other_nodes(
    nodes: int, level: float, expected: float
) -> None:
    """Of `before` 10 nodes, one of them not measured; motion makes the last twice as noisy in each.

    A level that was misread, as where an attitude that is late looks like a walk, is read again.
    """

    def case(count: int, level: float, priors: str) -> SimpleNamespace:
        white = np.full((count, 3), level)
        white[-1] *= 2.0
        residual = np.zeros((count, 3))
        residual[0] = np.nan
        model = SimpleNamespace(nodes_s=np.arange(count) + 0.1 * (count != 10))
        noise, seen = Levels(white, priors, "down"), SimpleNamespace(residual=residual)
        return SimpleNamespace(model=model, noise=noise, seen=seen)

    before = case(10, 3.0, "of before")
    found = _same_white(case(nodes, level, "its own"), before)
    assert found.priors == "of before"
    np.testing.assert_allclose(found.white, case(nodes, expected, "").noise.white)


@pytest.mark.parametrize("sigma", [1e-9, 1e-3, 0.3])
def test_a_time_has_an_interval_however_sure_it_is(sigma: float) -> None:
    """Heights of a normal density over values that are far apart, as the best one may be, and close to it."""
    profile = object.__new__(Profile)
    profile.parameter = SimpleNamespace(form=0.0)
    profile.model, profile.back, profile.low, profile.high = (None,), np.asarray, -1e3, 1e3
    profile.centre = 7.3
    places = profile.centre + np.concatenate([np.linspace(-500.0, 500.0, 9), sigma * np.linspace(-5.0, 5.0, 41)])
    profile.heights = {float(x): -0.5 * ((float(x) - profile.centre) / sigma) ** 2 for x in places}
    profile.means = {x: np.array([2.0]) for x in profile.heights}
    (low, high), bent = profile._spread()
    ends = profile.centre + sigma * Q95 * np.array([-1.0, 1.0])
    assert [low, high] == pytest.approx(ends, abs=OF_INTERVAL * sigma)
    assert bent == pytest.approx([0.0])
    profile.heights = {x: profile.heights[x] for x in (*map(float, places[:9]), profile.centre)}
    (low, high), _ = profile._spread()  # nothing near was tried
    assert low <= profile.centre <= high


@pytest.mark.parametrize("step", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("parameter", [
    Parameter("at_s", "s", None, None, 0), Parameter("time_constant_s", "s", 1e-9, 1e9, 0),
    Parameter("time_constant_s", "s", 1e-9, 1e9, 0, form=0.5),
])  # fmt: skip
def test_of_values_that_were_tried_the_interval_is_that_of_the_density_or_a_step(step: float, parameter) -> None:
    """A normal density of sigma 1 about 0.03 of a step from the value that is best, of a time or of its logarithm."""
    to, back = (np.log, np.exp) if parameter.low else (np.asarray, np.asarray)
    heights = {float(back(x)): -0.5 * (x - 0.03 * step) ** 2 for x in step * np.arange(-50.0, 51.0)}
    ends = 0.03 * step + Q95 * np.array([-1.0, 1.0])
    reach = np.maximum(np.abs(ends), 0.5 * step)
    expected = np.array([-1.0, 1.0]) * np.hypot(reach, Q95 * parameter.form)
    assert to(of_tried(heights, parameter)) == pytest.approx(expected, abs=OF_STEP * step)


def test_what_a_column_drives_is_taken_off_where_that_column_was_recorded(recording_at_rest) -> None:
    """A fan that only one of two recordings tells of: the other is navigated without it and not refused."""
    plain = recording_at_rest(3600.0, 2, lambda t: 0.0 * t)
    fan_hz = np.sin(plain.imu.time_s / 300.0)
    told = recording_at_rest(3600.0, 2, lambda t: FAN_UG * np.sin(t / 300.0))
    told = replace(told, name="told", imu=replace(told.imu, further={**told.imu.further, "fan_hz": fan_hz}))
    cases = [prepare(told), prepare(plain)]
    form = "accelerometer bias = value * change(fan_hz)"
    member = next(one for one in cases[0].candidates if one.axis == "z" and one.parameters.get("form") == form)
    one = Hypothesis(member, (member.column, None))
    found = refine(cases, [one], fit_noise(cases, [one.scaled(4.0)], [None, None]))
    assert found.point[0] * member.nominal == pytest.approx(FAN_UG, rel=OF_FAN)
