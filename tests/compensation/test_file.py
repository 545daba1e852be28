"""Compensation models on disk: the same specific force to the last bit, and one sentence for a bad file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ins_eval.calibration.branches import BranchCurve
from ins_eval.calibration.fits import Polynomial
from ins_eval.compensation import Samples
from ins_eval.compensation.file import believed_model, read_model, write_model
from ins_eval.compensation.mirrored import Mirrored
from ins_eval.compensation.refined import Refined
from ins_eval.compensation.registry import BUILT_IN, load_model
from ins_eval.compensation.scale_and_bias import ScaleAndBias
from ins_eval.errors import InsEvalError, UsageError
from ins_eval.limits import BY_UNIT, OTHER
from ins_eval.recording.belief import Belief
from ins_eval.scale_factor import TERMS, scale_factor
from ins_eval.units import STANDARD_GRAVITY

ROUND_OFF_MPS2 = 1e-12
EQ_15 = (273.0, 0.1008, -0.02409, 88.14, -32.76, 320320.0)  # Paper A, eq. (15), JB-KT8 #1

WHOLE = """
format = "ins-compensation/1"
name = "simple"
[accelerometer.scale_pulse_per_g_s]
mu = -32.76
gamma = 320320.0
[accelerometer.bias_ug]
knots_c = [-60.0, 22.0, 70.0]
falling = [1.0, 2.0, 3.0]
rising = [1.0, 1.5, 3.0]
"""


def samples(seed=0, count=500) -> Samples:
    rng = np.random.default_rng(seed)
    return Samples(
        np.arange(1.0, count + 1),
        3e5 * rng.standard_normal(count),
        rng.uniform(-70.0, 80.0, count),
        rng.uniform(-1.0, 1.0, count),
    )


def fitted(name, chamber_of):
    def bias_ug(temperature, rate):
        return 300.0 + 50.0 * (temperature - 22.0) + 30.0 * np.sign(rate) * np.cos(temperature / 50.0)

    chamber = chamber_of(lambda temperature, rate: scale_factor(EQ_15, temperature - 22.0, rate), bias_ug)
    return load_model(name).fit(chamber)


def refined(name, chamber_of):
    model = Refined(fitted(name, chamber_of))
    run = samples(3, 3000)
    temperature = 20.0 + 30.0 * np.sin(run.time_s / 300.0)
    run = replace(run, output=320320.0 + 40.0 * temperature, temperature_c=temperature)
    return model.refine([(run, STANDARD_GRAVITY)])


def assert_same_curve(one, other):
    if isinstance(one, BranchCurve):
        np.testing.assert_array_equal(one.knots_c, other.knots_c)
    else:
        assert (one.terms, one.reference_c, one.residual_rms) == (other.terms, other.reference_c, other.residual_rms)
    np.testing.assert_array_equal(one.values, other.values)
    assert (one.covariance is None) == (other.covariance is None)
    if one.covariance is not None:
        np.testing.assert_array_equal(one.covariance, other.covariance)


@pytest.mark.parametrize("name", [*BUILT_IN, "simple_refined", "hysteresis_refined"])
def test_every_built_in_model_comes_back(name, chamber_of, tmp_path):
    base = name.removesuffix("_refined")
    model = refined(base, chamber_of) if base != name else fitted(name, chamber_of)
    again = read_model(write_model(tmp_path / "model.toml", model))
    assert again.name == name
    np.testing.assert_array_equal(again.specific_force(samples()), model.specific_force(samples()))
    inner, inner_again = getattr(model, "model", model), getattr(again, "model", again)
    assert inner_again.name == base
    for written, read in zip(inner.curves_with_covariance(), (inner_again.scale_, inner_again.bias_ug_), strict=True):
        assert written.covariance.shape == 2 * (written.values.size,)
        assert_same_curve(written, read)
    if base != name:
        assert_same_curve(model.residual_, again.residual_)


def test_a_triad_holds_one_model_for_each_axis(chamber_of, tmp_path):
    triad = [fitted("simple", chamber_of) for _ in "xyz"]
    for k, model in enumerate(triad):
        model.bias_ug_ = Polynomial(("gamma",), np.array([100.0 * k]), np.zeros((1, 1)), 0.0)
    path = write_model(tmp_path / "triad.toml", triad)
    for axis, model in zip("xyz", triad, strict=True):
        np.testing.assert_array_equal(read_model(path, axis).specific_force(samples()), model.specific_force(samples()))
    with pytest.raises(UsageError, match="holds models for x, y, z, but which axis is meant was not said"):
        read_model(path)
    text = path.read_text()
    path.write_text(text[: text.index("[z.")])
    with pytest.raises(UsageError, match="holds models for x, y, but there is none for axis z"):
        read_model(path, "z")


def test_a_single_model_serves_any_axis(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text(WHOLE)
    for axis in (None, "x", "z"):
        assert read_model(path, axis).name == "simple"


def test_a_file_written_by_hand_by_the_equations(tmp_path):
    """K1 = 320320 - 32.76 (32 - 22) = 319992.4 pulse/(g s); K0 falling 2 + 10/48, rising 1.5 + 1.5 10/48 ug at 32 degC.

    With 319992.4 pulse/s the specific force is 1 g less K0.
    """
    path = tmp_path / "m.toml"
    path.write_text(WHOLE)
    at = Samples(np.arange(2.0), np.full(2, 319992.4), np.full(2, 32.0), np.array([-1.0, 1.0]))
    bias_ug = np.array([2.0 + 10.0 / 48.0, 1.5 + 15.0 / 48.0])
    force = read_model(path).specific_force(at)
    np.testing.assert_allclose(force, 9.80665 * (1.0 - 1e-6 * bias_ug), rtol=0.0, atol=ROUND_OFF_MPS2)


numbers = st.floats(*OTHER)
degrees_c = st.floats(*BY_UNIT["c"])


@settings(max_examples=40, deadline=None)
@given(
    terms=st.permutations(TERMS).flatmap(lambda order: st.integers(1, 6).map(lambda n: tuple(order[:n]))),
    values=st.lists(numbers, min_size=6, max_size=6),
    reference_c=degrees_c,
    knots=st.lists(degrees_c, min_size=1, max_size=6, unique=True),
    seed=st.integers(0, 1000),
)
def test_any_numbers_come_back_to_the_last_bit(tmp_path_factory, terms, values, reference_c, knots, seed):
    rng = np.random.default_rng(seed)
    covariance = rng.standard_normal((len(terms), len(terms)))
    model = ScaleAndBias("any", None, None)
    model.scale_ = Polynomial(terms, np.array(values[: len(terms)]), covariance, 0.1, reference_c)
    of_knots = rng.standard_normal((2 * len(knots), 2 * len(knots))) if seed % 2 else None
    model.bias_ug_ = BranchCurve(np.sort(knots), *rng.standard_normal((2, len(knots))), of_knots)
    again = read_model(write_model(tmp_path_factory.getbasetemp() / "any.toml", model))
    assert_same_curve(again.bias_ug_, model.bias_ug_)
    assert again.scale_.coefficients == model.scale_.coefficients
    assert again.scale_.reference_c == reference_c
    order = [terms.index(term) for term in again.scale_.terms]
    np.testing.assert_array_equal(again.scale_.covariance, covariance[np.ix_(order, order)])


def test_what_is_not_known_of_a_fit_is_not_written(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text(WHOLE)
    scale = read_model(path).scale_
    assert scale.covariance is None and np.isnan(scale.residual_rms)
    written = write_model(path, read_model(path)).read_text()
    assert "nan" not in written and "covariance" not in written.partition("[")[2]


def test_a_model_from_a_file_is_not_fitted_anew(tmp_path, chamber_of):
    path = tmp_path / "m.toml"
    path.write_text(WHOLE)
    with pytest.raises(UsageError, match="cannot be fitted anew"):
        fitted_again = read_model(path)
        fitted_again.fit(chamber_of(lambda t, r: 3e5 + 0.0 * t, lambda t, r: 0.0 * t))


class Own:
    name = "own"

    def fit(self, chamber):
        return self

    def specific_force(self, samples):
        return samples.output


@pytest.mark.parametrize(
    ("model", "expected"),
    [
        (Own(), "the model own is a Own, expected a scale factor and a bias"),
        (Mirrored(Own(), Own()), "is a Mirrored"),
        (Refined(load_model("simple")), "has not been refined"),
        (load_model("simple"), "is not fitted"),
        ([Own(), Own()], "2 models given, expected one, or three"),
        ([Own(), Own(), load_model("simple")], "called own and simple, expected one name"),
    ],
)
def test_what_has_no_place_in_a_file_is_said(tmp_path, model, expected):
    with pytest.raises(UsageError, match=expected):
        write_model(tmp_path / "m.toml", model)
    assert not (tmp_path / "m.toml").exists()


def test_a_curve_of_ones_own_has_no_place_either(tmp_path, chamber_of):
    model = fitted("simple", chamber_of)
    model.bias_ug_ = Own()
    with pytest.raises(UsageError, match="a curve of type Own, expected a polynomial or one with branches"):
        write_model(tmp_path / "m.toml", model)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("ins-compensation/1", "ins-compensation/9", "'format' is 'ins-compensation/9'"),
        ('name = "simple"\n', "", "'name' is missing"),
        ("gamma", "gama", "unknown key 'accelerometer.scale_pulse_per_g_s.gama'; did you mean 'gamma'?"),
        ("bias_ug", "bias_mg", "unknown key 'accelerometer.bias_mg'; did you mean 'bias_ug'?"),
        ("[accelerometer.bias_ug]", "[x.bias_ug]", "is missing"),
        ("mu = -32.76", "mu = 'steep'", "accelerometer.scale_pulse_per_g_s.mu"),
        ("mu = -32.76", "mu = inf", "accelerometer.scale_pulse_per_g_s.mu"),
        ("mu = -32.76\ngamma = 320320.0\n", "", "the curve has no term"),
        ("mu = -32.76", "knots_c = [1.0]", "stand in one curve; keep terms or branches"),
        ("mu = -32.76", "mu = 1.0\ncovariance = [[1.0, 2.0], [3.0]]", "not square over the terms mu, gamma"),
        ("knots_c", "covariance = [[1.0]]\nknots_c", "not square over the values of falling and rising"),
        ("falling = [1.0, 2.0, 3.0]\n", "", "needs knots_c, falling and rising of one length"),
        ("falling = [1.0, 2.0, 3.0]", "falling = [1.0, 2.0]", "of one length"),
        ("-60.0, 22.0", "22.0, -60.0", "do not increase; sort the knots"),
        ("rising = [1.0, 1.5, 3.0]", "rising = []", "rising"),
        (
            "[accelerometer.bias_ug]",
            "[accelerometer.residual_mps2]\nmu = 1.0\n[accelerometer.bias_ug]",
            "residual_mps2 has",
        ),
        ("name", "name = = 3", "not valid TOML"),
        ("32.76", "1" * 5000, "not valid TOML"),
        ("name", "a = " + "[" * 5000 + "\nname", "not valid TOML"),
    ],
)
def test_a_fault_in_a_file_gets_one_sentence(tmp_path, old, new, expected):
    path = tmp_path / "m.toml"
    assert old in WHOLE
    path.write_text(WHOLE.replace(old, new, 1))
    with pytest.raises(UsageError) as refused:
        read_model(path)
    assert expected in str(refused.value)
    assert str(path) in str(refused.value) and str(refused.value).isprintable()


def test_both_a_single_accelerometer_and_axes_are_refused(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text(WHOLE + WHOLE[WHOLE.index("[acc") :].replace("accelerometer", "x"))
    with pytest.raises(UsageError, match=r"either one table \[accelerometer\] or tables"):
        read_model(path)
    with pytest.raises(UsageError, match="no such file"):
        read_model(tmp_path / "other.toml")


def test_whatever_the_bytes_a_model_or_one_sentence(tmp_path, chamber_of):
    path = write_model(tmp_path / "m.toml", refined("hysteresis", chamber_of))
    whole = path.read_bytes()
    refusals = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        content = bytearray(whole)
        for place in rng.integers(0, len(content), rng.integers(1, 4)):
            content[place : place + rng.integers(0, 9)] = rng.bytes(3) if seed % 2 else b'0-.e["]='[seed % 8 :]
        path.write_bytes(bytes(content))
        try:
            read_model(path)
        except InsEvalError as refused:
            refusals += 1
            assert str(refused).isprintable(), seed
    assert 20 < refusals < 200


def believing(**axis) -> Belief:
    return Belief.model_validate({"accelerometer": {"reference_temperature_c": 25.0, "x": axis}})


def test_the_believed_model_is_equations_4_and_11(tmp_path):
    """At 35 degC and 0.5 degC/min, T0 = 25: K1 = 68.25 + 10.08 - 0.12045 + 44.07 - 327.6 + 320320 = 320114.67955.

    K0 = 300 + 10 * 40 = 700 ug.
    """
    scale = dict(zip(TERMS, EQ_15, strict=True))
    model = believed_model(believing(scale=scale, bias={"k0_ug": 300.0, "omega_ug_per_c": 40.0}), "x", tmp_path)
    at = Samples(np.zeros(1), np.array([320114.67955]), np.array([35.0]), np.array([0.5]))
    np.testing.assert_allclose(model.specific_force(at), 9.80665 * (1.0 - 700e-6), rtol=0.0, atol=ROUND_OFF_MPS2)
    assert read_model(write_model(tmp_path / "b.toml", model)).specific_force(at) == model.specific_force(at)


def test_the_believed_model_may_lie_in_a_file_beside_the_recording(tmp_path):
    (tmp_path / "below").mkdir()
    (tmp_path / "below" / "m.toml").write_text(WHOLE)
    assert believed_model(believing(compensation="below/m.toml"), "x", tmp_path).name == "simple"
    with pytest.raises(UsageError, match="no such file"):
        believed_model(believing(compensation="m.toml"), "x", tmp_path)


def test_no_belief_is_said(tmp_path):
    with pytest.raises(UsageError, match=r"no table \[accelerometer.y\]"):
        believed_model(believing(scale={"gamma": 3e5}), "y", tmp_path)
