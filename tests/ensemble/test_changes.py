"""A change reaches the one thing that its key names, and is refused where there is no such thing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ins_eval.accelerometer import Population
from ins_eval.ensemble import Plan, World
from ins_eval.ensemble.changes import Setting
from ins_eval.errors import UsageError
from ins_eval.gyro import GyroPopulation
from ins_eval.profile import load


@pytest.fixture
def setting() -> Setting:
    return Setting(Population.load(), GyroPopulation(), load("box"))


def test_a_parameter_of_an_effect_changes_alone(setting: Setting) -> None:
    changed = setting.changed([("creep.scatter", 0.5), ("creep.weights", (0.0, 0.0, 0.0))])
    assert changed.accelerometers["creep"].scatter == 0.5
    assert changed.accelerometers["creep"].weights == (0.0, 0.0, 0.0)
    assert changed.accelerometers.without("creep") == setting.accelerometers.without("creep").replacing(
        changed.accelerometers.without("creep")["creep"]
    )
    assert replace(changed, accelerometers=setting.accelerometers) == setting


def test_a_parameter_of_the_gyros_changes_alone(setting: Setting) -> None:
    changed = setting.changed([("gyro.bias_deg_per_h", 0.5)])
    assert changed == replace(setting, gyros=GyroPopulation(bias_deg_per_h=0.5))


def test_a_table_of_the_profile_and_every_element_of_its_lists_change(setting: Setting) -> None:
    changed = setting.changed([("thermal.ground_c", 25.0), ("turn.bank_deg", 25.0)]).profile
    assert changed.thermal == setting.profile.thermal.model_copy(update={"ground_c": 25.0})
    assert [t.bank_deg for t in changed.turn] == [25.0] * 5
    assert [t.at_s for t in changed.turn] == [t.at_s for t in setting.profile.turn]
    assert changed.model_copy(update={"thermal": setting.profile.thermal, "turn": setting.profile.turn}) == (
        setting.profile
    )


def test_no_name_means_two_tables(setting: Setting) -> None:
    effects = [effect.name for effect in setting.accelerometers.effects]
    names = ["gyro", "alignment", *effects, *type(setting.profile).model_fields]
    assert len(names) == len(set(names))


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("crep.scatter", 0.5, r"change 'crep.scatter': .* no table 'crep'; did you mean 'creep'\?"),
        ("creep.scater", 0.5, r"change 'creep.scater': unknown key 'scater'; did you mean 'scatter'\?"),
        ("creep", 0.5, "change 'creep': unknown key ''"),
        ("creep.scatter", -0.5, "change 'creep.scatter': 'scatter' is -0.5"),
        ("creep.scatter", "much", "change 'creep.scatter': 'scatter' is 'much'"),
        ("scale_polynomial.rate_sign", "up", "change 'scale_polynomial.rate_sign': 'rate_sign' is 'up'"),
        ("gyro.bias_deg_h", 0.5, "change 'gyro.bias_deg_h': unknown key .* did you mean 'bias_deg_per_h'"),
        ("gyro.bias_deg_per_h", -1.0, "change 'gyro.bias_deg_per_h': the value is -1.0; expected a number, 0 or more"),
        ("gyro.bias_deg_per_h", float("nan"), "change 'gyro.bias_deg_per_h': the value is nan"),
        ("gyro.bias_deg_per_h", "small", "change 'gyro.bias_deg_per_h': the value is 'small'"),
        ("thermal.ground", 25.0, "change 'thermal.ground': unknown key 'thermal.ground'; did you mean 'ground_c'"),
        ("thermal.ground_c", 500.0, "change 'thermal.ground_c': 'thermal.ground_c' is 500.0"),
        ("turn.bank_deg", 80.0, "change 'turn.bank_deg': 'turn.*bank_deg' is 80.0"),
        ("wing_rock.amplitude_deg", 1.0, "change 'wing_rock.amplitude_deg': profile .* has no wing_rock"),
        ("duration_s", 60.0, "change 'duration_s': .* no table 'duration_s'"),
        ("alignment", "guessed", "change 'alignment': the value is 'guessed'; expected 'found' or 'given'"),
    ],
)
def test_what_cannot_be_changed_is_refused_in_one_sentence(setting: Setting, key: str, value, sentence: str) -> None:
    with pytest.raises(UsageError, match=sentence) as refusal:
        setting.changed([(key, value)])
    assert "\n" not in str(refusal.value)


def test_a_changed_size_scales_the_same_draw(profile: Path) -> None:
    base = World(Plan(profile=str(profile)))
    tenth = World(Plan(profile=str(profile), changes=(("bias_temperature.omega1_ug_per_c", 5.0),)))
    for one, other in zip(base.instrument(4).accelerometers, tenth.instrument(4).accelerometers, strict=True):
        np.testing.assert_allclose(other.units["bias_temperature"][0], 0.1 * one.units["bias_temperature"][0])
        np.testing.assert_array_equal(other.units["scale_polynomial"], one.units["scale_polynomial"])


def test_a_change_of_the_gyros_leaves_the_accelerometers_alone(profile: Path) -> None:
    worlds = [World(Plan(profile=str(profile), changes=c)) for c in ((), (("gyro.bias_deg_per_h", 0.0),))]
    one, other = (w.flight.record(w.instrument(2), w.streams(2).at("flight")).imu for w in worlds)
    np.testing.assert_array_equal(one.accelerometer, other.accelerometer)
    assert not np.array_equal(one.gyro, other.gyro)
