"""The contract check: good models pass, each deliberately bad one is refused with its own sentence."""

import copy
import itertools
from dataclasses import fields, replace

import numpy as np
import pytest

from ins_eval.compensation import check
from ins_eval.compensation.check import check_model, require_sound
from ins_eval.compensation.registry import load_model, model_names
from ins_eval.errors import UsageError
from ins_eval.units import STANDARD_GRAVITY

POINTS_OF_THE_CONTRACT = 10


class Mine:
    """What a researcher would write: ten lines, nothing inherited."""

    name = "mine"

    def fit(self, chamber):
        up, down, level = (chamber.output[chamber.input_g == g].mean() for g in (1.0, -1.0, 0.0))
        self.scale_ = (up - down) / 2.0
        self.bias_g_ = level / self.scale_
        return self

    def specific_force(self, samples):
        return 9.80665 * (samples.output / self.scale_ - self.bias_g_)


class InG(Mine):
    def specific_force(self, samples):
        return super().specific_force(samples) / 9.80665


class InMilliG(Mine):
    def specific_force(self, samples):
        return 1000.0 * super().specific_force(samples) / 9.80665


class InPulses(Mine):
    def specific_force(self, samples):
        return samples.output


class InIncrements(Mine):
    def specific_force(self, samples):
        return super().specific_force(samples) * np.diff(samples.time_s, prepend=0.0)


class UpsideDown(Mine):
    def specific_force(self, samples):
        return -super().specific_force(samples)


class NoUnitAtAll(Mine):
    def specific_force(self, samples):
        return 3.3 * super().specific_force(samples)


class BiasInUg(Mine):
    def specific_force(self, samples):
        return super().specific_force(samples) - 1e6 * self.bias_g_


class MeanOfTheFlight(Mine):
    def specific_force(self, samples):
        return super().specific_force(samples) - 1e-6 * samples.temperature_c.mean()


class CentralDifference(Mine):
    """Looks one sample ahead, no more."""

    def specific_force(self, samples):
        return super().specific_force(samples) + 1e-5 * np.gradient(samples.temperature_c)


class FromTheEnd(Mine):
    def specific_force(self, samples):
        return super().specific_force(samples) + 1e-6 * (samples.temperature_c - samples.temperature_c[-1])


class ChangesSamples(Mine):
    def specific_force(self, samples):
        samples.temperature_c[:] -= 22.0
        return super().specific_force(samples)


class ChangesChamber(Mine):
    def fit(self, chamber):
        chamber.output[:] /= 2.0
        super().fit(chamber)
        self.scale_ *= 2.0
        return self


class Column(Mine):
    def specific_force(self, samples):
        return super().specific_force(samples)[:, None]


class OneShort(Mine):
    def specific_force(self, samples):
        return super().specific_force(samples)[1:]


class AList(Mine):
    def specific_force(self, samples):
        return super().specific_force(samples).tolist()


class Whole(Mine):
    def specific_force(self, samples):
        return np.round(super().specific_force(samples)).astype(int)


class NotANumber(Mine):
    def specific_force(self, samples):
        force = super().specific_force(samples)
        force[:3] = np.nan
        return force


class Noisy(Mine):
    def specific_force(self, samples):
        return super().specific_force(samples) + 1e-4 * np.random.default_rng().normal(size=samples.time_s.size)


class Remembers(Mine):
    calls = 0

    def specific_force(self, samples):
        self.calls += 1
        return super().specific_force(samples) + 1e-6 * self.calls


class RandomFit(Mine):
    def fit(self, chamber):
        super().fit(chamber)
        self.bias_g_ += 1e-6 * np.random.default_rng().normal()
        return self


class SharedFit(Mine):
    count = itertools.count()

    def fit(self, chamber):
        super().fit(chamber)
        self.bias_g_ += 1e-6 * next(self.count)
        return self


class ForgetsSelf(Mine):
    def fit(self, chamber):
        super().fit(chamber)


class RaisesInFit(Mine):
    def fit(self, chamber):
        raise ValueError("singular matrix")


class RaisesInForce(Mine):
    def specific_force(self, samples):
        return samples.truth


class ReadsOtherColumns(Mine):
    """Takes the array that a column is a part of, where there is one."""

    def specific_force(self, samples):
        table = samples.output.base
        return super().specific_force(samples) if table is None else table[:, 0] / self.scale_


class ReadsBeyondTheEnd(Mine):
    """Reads the memory after an array, in the same block."""

    def specific_force(self, samples):
        table = samples.temperature_c.base
        beyond = 0 if table is None else np.lib.stride_tricks.as_strided(samples.temperature_c, (12000,))[-4000:].sum()
        return super().specific_force(samples) + 1e-6 * beyond


class ReadsAnAttribute(Mine):
    def specific_force(self, samples):
        return getattr(samples, "specific_force_mps2", super().specific_force(samples))


class ReadsWhatever(Mine):
    """Takes the last array of the right size that it can find in its argument."""

    def specific_force(self, samples):
        *_, last = (thing for thing in vars(samples).values() if thing.shape == samples.output.shape)
        return super().specific_force(samples) - 1e-3 * (last - samples.rate_c_per_min)


class FitsOtherColumns(Mine):
    def fit(self, chamber):
        super().fit(chamber)
        if chamber.output.base is not None:
            self.bias_g_ = 1e-9 * chamber.output.base[:, 2].mean()
        return self


class FitsAnAttribute(Mine):
    def fit(self, chamber):
        super().fit(chamber)
        self.bias_g_ += 1e-3 * np.mean(getattr(chamber, "_true_bias", 0.0))
        return self


class Nameless(Mine):
    name = ""


class TakesABuiltInsName(Mine):
    name = "hysteresis"


class WithoutFit:
    name = "without"

    def specific_force(self, samples):
        return samples.output


class NeedsArguments(Mine):
    def __init__(self, gain):
        self.gain = gain


BAD = {
    InG: ("unit m/s^2", "looks like g: 1 m/s.2 of a textbook accelerometer gave 0.102; .*multiply by 9.80665"),
    InMilliG: ("unit m/s^2", "looks like milli-g"),
    InPulses: ("unit m/s^2", "looks like pulse/s"),
    InIncrements: ("unit m/s^2", "looks like m/s over the sample"),
    UpsideDown: ("unit m/s^2", "looks like the negative of it"),
    NoUnitAtAll: ("unit m/s^2", "does not follow the specific force: .* gave 3.3"),
    BiasInUg: ("unit m/s^2", "m/s.2 RMS off on a textbook accelerometer.*units of the bias"),
    MeanOfTheFlight: ("causal", "looks ahead: without the samples after 4000 .* from sample 0 on"),
    CentralDifference: ("causal", "looks ahead: .* from sample 3999 on"),
    FromTheEnd: ("causal", "looks ahead"),
    ChangesSamples: ("samples left alone", "specific_force changed its input 'temperature_c'"),
    ChangesChamber: ("chamber readings left alone", "fit changed its input 'output'"),
    Column: ("specific_force", r"returned shape \(8000, 1\) for 8000 samples; expected \(8000,\)"),
    OneShort: ("specific_force", r"returned shape \(7999,\)"),
    AList: ("specific_force", "returned list; expected a numpy array of floats"),
    Whole: ("specific_force", "returned an array of int64; expected a numpy array of floats"),
    NotANumber: ("finite", r"is not finite in 3 of 8000 samples, first 0 \(nan\)"),
    Noisy: ("repeatable", "another answer to the same samples"),
    Remembers: ("repeatable", "another answer to the same samples"),
    RandomFit: ("repeatable", "another model from the same chamber"),
    SharedFit: ("repeatable", "another model from the same chamber"),
    ForgetsSelf: ("fit", "fit returned NoneType; expected the model itself"),
    RaisesInFit: ("fit", "fit raised ValueError: singular matrix, line"),
    RaisesInForce: ("specific_force", "specific_force raised AttributeError: .*truth"),
    ReadsOtherColumns: ("values alone", "reads more than the values of the samples: .* leave the .base of"),
    ReadsBeyondTheEnd: ("values alone", "specific_force reads more"),
    ReadsAnAttribute: ("values alone", "specific_force reads more"),
    ReadsWhatever: ("values alone", "specific_force reads more"),
    FitsOtherColumns: ("values alone", "fit reads more than the values of the chamber readings"),
    FitsAnAttribute: ("values alone", "fit reads more"),
    Nameless: ("name and methods", "its name is ''"),
    TakesABuiltInsName: ("name and methods", "'hysteresis' is that of a built-in model"),
    WithoutFit: ("name and methods", "it has no method fit"),
    NeedsArguments: ("name and methods", r"\(\) raised TypeError"),
}


@pytest.mark.parametrize("model", BAD, ids=lambda model: model.__name__)
def test_bad_model_is_refused_by_its_own_check_alone(model):
    point, sentence = BAD[model]
    with pytest.raises(UsageError, match=sentence) as refused:
        require_sound(model)
    assert model.__name__ in str(refused.value)
    assert "\n" not in str(refused.value)
    assert [finding.check for finding in check_model(model) if finding.refusal] == [point]


def test_good_model_passes_as_class_as_object_and_as_factory():
    for given in (Mine, Mine(), lambda: Mine()):
        findings = check_model(given)
        assert [str(finding) for finding in findings if finding.refusal] == []
        assert len(findings) == POINTS_OF_THE_CONTRACT
        require_sound(given)
    assert str(findings[-1]) == "values alone: ok"


@pytest.mark.parametrize("name", [*model_names(), "2 simple - hysteresis_refined"])
def test_every_built_in_passes(name):
    findings = check_model(load_model(name))
    assert [str(finding) for finding in findings if finding.refusal] == []
    assert len(findings) == POINTS_OF_THE_CONTRACT


def test_a_causal_model_with_a_memory_passes():
    class Lagging(Mine):
        name = "lagging"

        def specific_force(self, samples):
            past_mean = np.cumsum(samples.temperature_c) / np.arange(1, samples.time_s.size + 1)
            return super().specific_force(samples) + 1e-5 * past_mean

    require_sound(Lagging)


def test_a_model_that_takes_columns_apart_and_looks_for_more_passes():
    """Negative control: copies, tables, checks of contiguity and questions for what is not there are no fault."""

    class Careful(Mine):
        name = "careful"

        def fit(self, chamber):
            assert chamber.output.flags.c_contiguous
            return super().fit(replace(chamber, output=chamber.output.copy()))

        def specific_force(self, samples):
            assert samples.output.flags.c_contiguous
            table = np.column_stack([getattr(samples, field.name) for field in fields(samples)])
            hasattr(samples, "humidity")
            return super().specific_force(replace(copy.copy(samples), output=table[:, 1]))

    require_sound(Careful)


def test_the_check_leaves_the_given_object_unfitted():
    model = Mine()
    check_model(model)
    assert not hasattr(model, "scale_")


def test_two_faults_are_reported_together():
    class Both(InG):
        def specific_force(self, samples):
            force = super().specific_force(samples)
            return force - force.mean()

    refused = [finding.check for finding in check_model(Both) if finding.refusal]
    assert refused == ["unit m/s^2", "causal"]


def test_textbook_unit_is_the_one_of_equation_15():
    """Output at rest at T0: K1 = gamma = 320 320 pulse/(g s), K0 = 300 ug; at 32 degC and 0.5 degC/min by hand."""
    output = check._output(np.array([22.0, 32.0]), np.array([0.0, 0.5]), 1.0)
    k1 = 273 * 0.25 + 0.1008 * 100 - 0.02409 * 5 - 32.76 * 10 + 88.14 * 0.5 + 320320
    assert output == pytest.approx([320320 * 1.0003, k1 * 1.0007], rel=1e-12)
    samples, force = check._samples()
    assert np.abs(force).max() < STANDARD_GRAVITY
    assert samples.time_s.size == 8000
