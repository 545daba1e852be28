"""A chamber recording as a case: silent where the belief is true, and at the rate term where that was left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.diagnosis.answer.experiments import information, planned_column
from ins_eval.diagnosis.answer.judge import judge
from ins_eval.diagnosis.answer.verdict import NO_MISMATCH
from ins_eval.diagnosis.unnamed.disturbance import is_sure, restless
from ins_eval.error_model.columns import assemble
from ins_eval.errors import DataRefused
from ins_eval.estimation.case import with_effects
from ins_eval.estimation.chamber import _read_off, prepare_chamber
from ins_eval.estimation.description import wrong_descriptions_of_chamber
from ins_eval.estimation.forecast import pool
from ins_eval.estimation.placing import again
from ins_eval.estimation.refine import refine
from ins_eval.estimation.study import Hypothesis, fit_noise
from ins_eval.policy import Policy
from ins_eval.random_processes import gauss_markov
from ins_eval.recording import ChamberReadings
from ins_eval.recording.belief import AccelerometerBelief, AxisBelief, Belief, BiasBelief, EffectBelief, ScaleBelief
from ins_eval.thermal import filtered_rate, lagged
from ins_eval.units import STANDARD_GRAVITY, UG
from tests.beliefs import navigation_grade

GAMMA, MU, EPSILON, K0_UG, OMEGA = 320000.0, -30.0, 60.0, 800.0, 50.0  # pulse/(g s), degC, degC/min, ug
NOISE = 1.0  # pulse/s
REFERENCE_C = 22.0
VALUE, ROUNDING_UG = 0.03, 1e-3  # relative, of what noise leaves of the rate term; and of arithmetic
ROUNDING = 1e-5  # of a factor as it is stated
SLOPE = 0.01  # of a compensation, taken from a difference
WANDER_UG, WANDER_S = 300.0, 1800.0
OF_READINGS = ("time_s", "run", "input_g", "rate_c_per_min", "temperature_c", "output")
JUMP_UG, JUMP_AT_S, JUMP_TOLERANCE_S = 60.0, 18000.0, 120.0  # in the second run, four readings
LAG_S, LAG, OWN_COLUMN = 130.0, 0.1, 0.01  # a lag, and relative, of what noise leaves of it and of its column


def measured(epsilon: float, lag_s: float = 0.0) -> ChamberReadings:
    """Four positions, each through 20 -> 60 -> 20 degC at 0.4 degC/min, by eqs (11) and (4) with tilts of its own.

    The elements follow the thermometer with a lag, and what is believed of them with it; other rate terms do not.
    """
    rng = np.random.default_rng(2)
    time_s = np.arange(0.0, 13200.0, 30.0)
    temperature = 20.0 + 0.4 / 60.0 * np.clip(np.minimum(time_s - 600.0, 12600.0 - time_s), 0.0, None)
    inside = lagged(time_s, temperature, lag_s) if lag_s else temperature
    scale = GAMMA + MU * (inside - REFERENCE_C) + EPSILON * filtered_rate(time_s, inside)
    scale += (epsilon - EPSILON) * filtered_rate(time_s, temperature)
    bias = 1e-6 * (K0_UG + OMEGA * (inside - REFERENCE_C))
    runs = []
    for force in (1.0, 0.0, -1.0, 0.0):
        tilt = 3e-4 * rng.standard_normal()
        runs.append(scale * (bias + force + tilt) + NOISE * rng.standard_normal(time_s.size))
    count = time_s.size
    return ChamberReadings(
        time_s=np.arange(4 * count) * 30.0 + 1000.0 * np.repeat(np.arange(4), count),
        run=np.repeat(np.arange(4), count),
        input_g=np.repeat([1.0, 0.0, -1.0, 0.0], count),
        rate_c_per_min=np.tile(np.sign(np.gradient(temperature)) * 0.4, 4),
        temperature_c=np.round(np.tile(temperature, 4), 2),
        output=np.concatenate(runs),
        axis="y",
    )


@pytest.fixture
def belief() -> Belief:
    scale, bias = ScaleBelief(gamma=GAMMA, mu=MU, epsilon=EPSILON), BiasBelief(k0_ug=K0_UG, omega_ug_per_c=OMEGA)
    return navigation_grade(accelerometer=AccelerometerBelief(y=AxisBelief(scale=scale, bias=bias)))


def test_one_reading_is_refused(belief) -> None:
    whole = measured(EPSILON)
    columns = ("time_s", "run", "input_g", "rate_c_per_min", "temperature_c", "output")
    one = replace(whole, **{name: getattr(whole, name)[:1] for name in columns})
    with pytest.raises(DataRefused, match="holds 1 reading, expected at least 2"):
        prepare_chamber(one, belief, "chamber")


def test_a_true_belief_is_left_alone(belief) -> None:
    diagnosis = judge([prepare_chamber(measured(EPSILON), belief, "chamber")])
    assert diagnosis.verdict == NO_MISMATCH
    assert diagnosis.mismatches == ()


@pytest.mark.parametrize(
    ("factor", "named"),
    [
        (1.0, []),
        (1.1, []),  # a scale factor, if a large one
        (-1.0, [("recording.axis_sign", "y", -1.0)]),
        (1e-3, [("recording.unit", None, 1e-3)]),
        (STANDARD_GRAVITY, [("recording.unit", None, STANDARD_GRAVITY)]),
    ],
)
def test_a_wrong_unit_or_sign_is_named_and_mended(belief, factor: float, named: list) -> None:
    right = measured(EPSILON)
    wrong = replace(right, output=factor * right.output)
    found = wrong_descriptions_of_chamber(wrong, belief, "chamber")
    assert [(one.effect.name, one.effect.axis, pytest.approx(one.effect.value, rel=1e-5)) for one in found] == named
    assert np.isfinite([one.log_odds for one in found]).all()  # they are written as JSON
    if found:
        mended = prepare_chamber(wrong, with_effects(belief, [one.effect for one in found]), "chamber")
        expected = prepare_chamber(right, belief, "chamber")
        scale = STANDARD_GRAVITY * ROUNDING
        np.testing.assert_allclose(mended.seen.residual[:, 0], expected.seen.residual[:, 0], atol=scale)


def test_a_slow_error_beyond_its_grade_is_no_noise(belief) -> None:
    """An accelerometer that wanders a hundred times as far as its readings scatter is located, not passed over."""
    readings = measured(EPSILON)
    rng = np.random.default_rng(8)
    wander = np.concatenate([gauss_markov(readings.time_s[readings.run == k], WANDER_UG * UG, WANDER_S, rng)
                             for k in range(4)])  # fmt: skip
    restive = replace(readings, output=readings.output + GAMMA * wander / STANDARD_GRAVITY)
    policy = Policy()
    for made, beyond in ((restive, True), (readings, False)):
        case = prepare_chamber(made, belief, "chamber")
        (fitted,) = fit_noise([case], [], [None])
        found = restless(case, 0, fitted, policy)
        assert (found is not None) == beyond
        if found is not None:
            assert found.interval.channel.name == "accelerometer.y"
            assert found.wander.sensor == "accelerometer"
            assert found.wander.bound < found.wander.sigma < WANDER_UG * UG * 2.0
            assert is_sure(found, policy)


def test_a_thermometer_that_stays_on_a_step_tells_as_much_as_one_reading(belief) -> None:
    """q / sqrt(12) times the slope of what is believed, of n readings that stay sqrt(n) times as much each."""
    step_c, stay, g0, temperature_c = 0.125, 21, 1.0, 20.0
    readings = measured(EPSILON)
    coarse = replace(readings, temperature_c=step_c * np.round(readings.temperature_c / step_c))
    assert np.all(coarse.temperature_c[:stay] == temperature_c) and coarse.temperature_c[stay] != temperature_c
    white = prepare_chamber(coarse, belief, "chamber").noise.white[:stay, 0]
    scale = GAMMA + MU * (temperature_c - REFERENCE_C)
    slope_ug = 1e6 * -MU / scale * (g0 + 1e-6 * (K0_UG + OMEGA * (temperature_c - REFERENCE_C))) - OMEGA
    expected = slope_ug * UG * step_c / np.sqrt(12.0) * np.sqrt(stay)
    np.testing.assert_allclose(white, expected, rtol=SLOPE)


def test_a_reading_that_moves_by_as_many_steps_each_time_is_off_by_the_same() -> None:
    """A ramp in time with the steps: rounding then shifts all of it by one amount, as if one reading had told it."""
    step_c, alone = 0.0625, 0.0625 / np.sqrt(12.0)
    moves = np.array([0] * 5 + [4] * 10 + [1] * 3 + [2, 3] * 3)
    readings = replace(
        measured(EPSILON), temperature_c=20.0 + step_c * np.cumsum(moves), run=np.zeros(moves.size, dtype=int)
    )
    found = _read_off(readings, np.ones(moves.size), [np.arange(moves.size)])
    np.testing.assert_allclose(found, alone * np.sqrt([5.0] * 5 + [10.0] * 10 + [1.0] * 9))


def test_a_rate_term_that_was_left_out_is_named(belief) -> None:
    diagnosis = judge([prepare_chamber(measured(2.0 * EPSILON), belief, "chamber")])
    found = diagnosis.effects[0].hypothesis.candidate
    assert (found.name, found.axis) == ("accelerometer.scale_temperature_rate", "y")
    assert diagnosis.effects[0].value == pytest.approx(EPSILON / GAMMA * 1e6, rel=VALUE)
    assert diagnosis.mismatches[0].channel == "accelerometer.y"


def test_a_lag_beside_a_rate_term_is_the_lag_for_which_its_column_is_made(belief) -> None:
    """The scale factor follows a lag as it does the rate, so that only the bias tells how late it is."""
    case = prepare_chamber(measured(2.0 * EPSILON, LAG_S), belief, "chamber")
    members = [
        case.member("temperature.lag", None, {"lag_s": 2.0 * LAG_S}),
        case.member("accelerometer.scale_temperature_rate", "y", {}),
    ]
    model = [Hypothesis(one, (one.column,)) for one in members]
    found = refine([case], model, fit_noise([case], [one.scaled(4.0) for one in model], [None]))
    lag, rate = (p * one.candidate.nominal for p, one in zip(found.point, found.taken, strict=True))
    assert lag == pytest.approx(found.taken[0].candidate.parameters["lag_s"], rel=OWN_COLUMN)
    assert lag == pytest.approx(LAG_S, rel=LAG)
    assert rate == pytest.approx(EPSILON / GAMMA * 1e6, rel=VALUE)
    low, high = found.intervals[0].spread["lag_s"]
    assert low < LAG_S < high
    assert high - low < LAG * LAG_S


def test_a_placed_lag_tells_as_much_in_a_planned_experiment(belief) -> None:
    """Its column counts in other sizes than that of one that is searched for."""
    case = prepare_chamber(measured(EPSILON), belief, "chamber")
    made = case.member("temperature.lag", None, {"lag_s": LAG_S})
    placed = again(Hypothesis(made, (made.column,)), [case])
    assert placed.candidate.nominal < made.nominal
    known = np.zeros(len(case.noise.free))
    own = information(case, [made.column], known) / made.nominal**2
    planned = information(case, [planned_column(case, placed.candidate)], known) / placed.candidate.nominal**2
    assert planned == pytest.approx(own)


def test_only_what_the_chamber_can_show_is_a_candidate(belief) -> None:
    candidates = prepare_chamber(measured(EPSILON), belief, "chamber").candidates
    assert {one.axis for one in candidates} == {"y", None}
    names = {one.name for one in candidates}
    assert {"temperature.lag", "accelerometer.bias_creep", "accelerometer.cubic", "accelerometer.bias_step"} <= names
    assert not {"accelerometer.bias", "accelerometer.cross_output", "gyro.bias"} & names


def test_in_one_position_an_offset_leads_what_follows_the_input(belief) -> None:
    readings = measured(EPSILON)
    upright = readings.run == 0
    one = replace(readings, **{name: getattr(readings, name)[upright] for name in OF_READINGS})
    for taken, alike in ((readings, set()), (one, {"scale", "asymmetry", "quadratic", "cubic"})):
        repeating = {c.name for c in prepare_chamber(taken, belief, "chamber").candidates if c.repeats}
        assert {name.removeprefix("accelerometer.").split("_")[0] for name in repeating} == alike


def test_a_jump_within_a_run_is_named_with_its_instant(belief) -> None:
    """In one of four positions the output jumps where the temperature rises; the others say that it is no law of it."""
    readings = measured(EPSILON)
    jumped = readings.output + GAMMA * 1e-6 * JUMP_UG * ((readings.run == 1) & (readings.time_s >= JUMP_AT_S))
    found = judge([prepare_chamber(replace(readings, output=jumped), belief, "chamber")])
    (effect,) = found.effects
    named = effect.hypothesis.candidate
    assert (named.name, named.axis) == ("accelerometer.bias_step", "y")
    assert named.parameters["at_s"] == pytest.approx(JUMP_AT_S, abs=JUMP_TOLERANCE_S)
    assert abs(effect.value - JUMP_UG) < 3.0 * effect.sigma


@pytest.mark.parametrize(
    ("name", "value", "further"),
    [
        ("accelerometer.bias_temperature", 3.0, {}),
        ("accelerometer.bias_creep", 5.0, {"time_constant_s": 1700.0}),
        ("accelerometer.scale_temperature_rate", 80.0, {}),
        ("accelerometer.scale_hysteresis", 40.0, {"branch_width_c": 3.0}),
        ("accelerometer.quadratic", 25.0, {}),
        ("temperature.lag", 40.0, {}),
    ],
)
def test_a_believed_effect_takes_its_column_off(belief, name: str, value: float, further: dict) -> None:
    case = prepare_chamber(measured(EPSILON), belief, "chamber")
    axis = None if name == "temperature.lag" else "y"
    candidate = case.member(name, axis, {"lag_s": value} if axis is None else further)
    after = case.again([EffectBelief(name=name, axis=axis, value=value, **further)])
    assembled = assemble(case.model, case.seen, case.slow, [candidate.column])
    column = np.zeros(case.seen.residual.shape[0])
    for (c, row, slow), weight in zip(assembled.observation_terms, assembled.observation_weights, strict=True):
        if c == 1:
            column += weight * assembled.observed[:, row, 0] * assembled.slow_nodes[slow]
    expected = value / candidate.nominal * column
    changed = case.seen.residual[:, 0] - after.seen.residual[:, 0]
    known = np.isfinite(changed)
    assert np.abs(expected).max() > 1.0 * UG
    np.testing.assert_allclose(changed[known], expected[known], atol=ROUNDING_UG * UG)


def test_a_lag_is_the_error_of_the_compensation_at_a_late_temperature(belief) -> None:
    """Eqs (11) and (4) at the smoothed temperature and at one that follows it late, without any candidate."""
    case = prepare_chamber(measured(EPSILON), belief, "chamber")
    lag_s = 60.0
    after = case.again([EffectBelief(name="temperature.lag", value=lag_s)])
    readings, seen = measured(EPSILON), case.temperature
    for rows in seen.runs:
        force = readings.input_g[rows]
        time_s, now = seen.time_s[rows], seen.smooth_c[rows, 0]
        late = lagged(time_s, now, lag_s)
        scale, late_scale = (GAMMA + MU * (t - REFERENCE_C) + EPSILON * filtered_rate(time_s, t) for t in (now, late))
        bias, late_bias = (1e-6 * (K0_UG + OMEGA * (t - REFERENCE_C)) for t in (now, late))
        expected = STANDARD_GRAVITY * (late_scale * (late_bias + force) / scale - bias - force)
        changed = (case.seen.residual - after.seen.residual)[rows, 0]
        known = np.isfinite(changed)
        np.testing.assert_allclose(changed[known], expected[known], atol=ROUNDING_UG * UG)


def test_a_magnet_begins_anew_in_each_run_of_a_chamber(belief) -> None:
    """What its begin adds is free in each run where the input is felt, and is nothing in the others."""
    readings = measured(EPSILON)
    case = prepare_chamber(readings, belief, "chamber")
    begins = [one for one in pool([case]).beside if one.candidate.name == "accelerometer.scale_hysteresis"]
    widths = {one.candidate.parameters["branch_width_c"] for one in begins}
    assert len(begins) == 4 * len(widths)
    for k, one in enumerate(begins[:4]):
        shown = np.sum([term.weight * case.slow.nodes[term.slow] for term in one.columns[0].terms], axis=0)
        felt = readings.input_g[readings.run == k]
        assert np.any(shown[readings.run == k]) == np.any(felt)
        assert not np.any(shown[readings.run != k])
