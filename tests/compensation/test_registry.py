"""Models by name: what is found, and one sentence for each way of not being found."""

import numpy as np
import pytest

from ins_eval.compensation import Samples
from ins_eval.compensation.check import check_model, require_sound
from ins_eval.compensation.refined import Refined
from ins_eval.compensation.registry import load_model, model_files, model_names
from ins_eval.errors import UsageError
from ins_eval.recording import ChamberReadings

GOOD = """
from dataclasses import dataclass

import numpy as np


@dataclass
class MyModel:
    gain: float = 1.0
    name: str = "mine"

    def fit(self, chamber):
        return self

    def specific_force(self, samples):
        return self.gain * samples.output


class Needy:
    def __init__(self, gain):
        self.gain = gain


class Nameless:
    def fit(self, chamber):
        return self


class Lame:
    name = "lame"


class Impostor(MyModel):
    def __init__(self):
        self.name = "simple"


VALUE = 3
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "my_model.py").write_text(GOOD)
    (tmp_path / "broken.py").write_text("import numpy\n\nraise RuntimeError('no licence found')\n")
    (tmp_path / "typo.py").write_text("class A:\n    def fit(self\n")
    (tmp_path / "quits.py").write_text("import sys\nsys.exit(4)\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", model_names())
def test_every_listed_name_loads(name):
    assert load_model(name).name == name


def test_each_call_makes_a_new_model():
    assert load_model("simple") is not load_model("simple")


def test_model_of_a_file_loads_and_takes_the_refinement(folder):
    assert load_model("my_model.py:MyModel").name == "mine"
    assert load_model(f"{folder}/my_model.py:MyModel").specific_force(one_g(5.0)) == pytest.approx([5.0] * 3)
    refined = load_model("my_model.py:MyModel_refined")
    assert refined.name == "mine_refined"
    assert refined.fit(readings()).specific_force(one_g(5.0)) == pytest.approx([5.0] * 3)
    assert refined.refine([(one_g(5.0), 4.0)]).specific_force(one_g(5.0)) == pytest.approx([4.0] * 3)
    assert not (folder / "__pycache__").exists()


def test_changed_file_is_read_again(folder):
    load_model("my_model.py:MyModel")
    (folder / "my_model.py").write_text(GOOD.replace('"mine"', '"yours"'))
    import os

    os.utime(folder / "my_model.py", (2e9, 2e9))
    assert load_model("my_model.py:MyModel").name == "yours"


def test_model_of_a_package_loads(folder, monkeypatch):
    package = folder / "lab_models_for_test"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "hot.py").write_text(GOOD)
    monkeypatch.syspath_prepend(folder)
    assert load_model("lab_models_for_test.hot:MyModel").name == "mine"
    assert load_model("lab_models_for_test.hot:MyModel_refined").name == "mine_refined"


def test_factory_function_of_this_package_loads():
    assert load_model("ins_eval.compensation.hysteresis:hysteresis").name == "hysteresis"


@pytest.mark.parametrize(
    ("spec", "sentence"),
    [
        ("hysterisis", "did you mean 'hysteresis'"),
        ("zzz", "known are hysteresis, .* and [0-9]+ more"),
        ("simple_refind", "did you mean 'simple_refined'"),
        ("2 simple - hysterese", "'hysterese'; did you mean 'hysteresis'"),
        ("my_model.py", "names a file but no class in it; write 'my_model.py:MyModel'"),
        ("my_modl.py:MyModel", "there is no file my_modl.py; did you mean 'my_model.py'"),
        ("no/such/folder.py:MyModel", "there is no file no/such/folder.py"),
        ("my_model.py:MyModle", "has no class 'MyModle'; did you mean 'MyModel'"),
        ("my_model.py:VALUE", "has no class 'VALUE'"),
        ("broken.py:A", "raised RuntimeError: no licence found, line 3 of broken.py"),
        ("broken.py:A_refined", "raised RuntimeError"),
        ("typo.py:A", r"raised SyntaxError: .*line 2"),
        ("quits.py:A", "raised SystemExit: 4"),
        ("my_model.py:Needy", r"Needy\(\) raised TypeError: .*; expected a class that can be made without arguments"),
        ("my_model.py:Nameless", "its name is None; expected a non-empty text"),
        ("my_model.py:Lame", "it has no method fit and no method specific_force"),
        ("my_model.py:Impostor", "'simple' is that of a built-in model"),
        (
            "my_model:MyModel",
            "there is no module 'my_model'; a file my_model.py is here, so write 'my_model.py:MyModel'",
        ),
        ("nowhere_at_all.sub:A", "there is no module 'nowhere_at_all'; install the package"),
    ],
)
def test_refused_in_one_sentence(folder, spec, sentence):
    with pytest.raises(UsageError, match=sentence) as refused:
        load_model(spec)
    assert str(refused.value).startswith(("compensation model", "no compensation model"))
    assert "\n" not in str(refused.value)


SINGLE = """
format = "ins-compensation/1"
name = "lab-3"
[accelerometer.scale_pulse_per_g_s]
gamma = 328000.0
mu = -41.14
[accelerometer.bias_ug]
gamma = 250.0
mu = 40.0
"""
GAMMA = {"x": 320320.0, "y": 308000.0, "z": 5000.0}  # pulse/(g s); z counts far more slowly than a textbook one


def of_three_axes(name="lab") -> str:
    tables = [
        f"[{axis}.scale_pulse_per_g_s]\ngamma = {gamma}\n[{axis}.bias_ug]\ngamma = 0.0" for axis, gamma in GAMMA.items()
    ]
    return "\n".join(['format = "ins-compensation/1"', f'name = "{name}"', *tables])


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "lab.toml"
    path.write_text(of_three_axes())
    return path


def readings(axis="") -> ChamberReadings:
    """Readings that would make another model of any class that is fitted."""
    rng = np.random.default_rng(2)
    columns = [np.arange(9.0), np.zeros(9, int), np.ones(9), np.full(9, 0.3), rng.normal(size=9), rng.normal(size=9)]
    return ChamberReadings(*columns, axis=axis)


def one_g(gamma: float) -> Samples:
    """Output of a perfect accelerometer of that scale factor at 1 g."""
    return Samples(np.arange(1.0, 4.0), np.full(3, gamma), np.full(3, 22.0), np.zeros(3))


@pytest.mark.parametrize("axis", "xyz")
def test_compensation_file_is_flown_as_it_is_on_each_axis(file, axis):
    """1 g is 9.80665 m/s^2 for the scale factor that the file gives that axis, whatever the chamber reads."""
    model = load_model(str(file))
    assert model.name == "lab"
    assert model.fit(readings(axis)) is model
    np.testing.assert_allclose(model.specific_force(one_g(GAMMA[axis])), 9.80665, rtol=1e-15)


def test_file_of_a_single_accelerometer_serves_any_axis(tmp_path):
    path = tmp_path / "one.toml"
    path.write_text(SINGLE)
    for axis in ("x", "y", "z", ""):
        force = load_model(str(path)).fit(readings(axis)).specific_force(one_g(328000.0))
        np.testing.assert_allclose(force, 9.80665 * (1.0 - 250e-6), rtol=1e-15)


def test_refined_variant_of_a_file_takes_what_the_oven_left(file):
    """In an oven at 1 g the file of x is off by the 1e-4 that its scale factor is; refined it is right there."""
    model = load_model(f"{file}_refined").fit(readings("x"))
    assert (type(model), model.name) == (Refined, "lab_refined")
    seen = one_g(GAMMA["x"] * (1.0 + 1e-4))
    np.testing.assert_allclose(model.specific_force(seen), 9.80665 * (1.0 + 1e-4), rtol=1e-12)
    model.refine([(seen, 9.80665)])
    np.testing.assert_allclose(model.specific_force(seen), 9.80665, rtol=1e-12)


def test_compensation_file_counts_among_the_files_of_a_plan(file):
    assert model_files(["simple", str(file), f"{file}_refined"]) == [file]


def test_file_keeps_the_contract_on_every_axis(file):
    require_sound(load_model(str(file)))
    assert not [finding for finding in check_model(load_model(str(file))) if finding.refusal]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("gamma = 5000.0", "mu = 1.0", "lab, z: at .* degC .* more output is not more specific force; .* above 0"),
        ("gamma = 308000.0", "gamma = -308000.0", "lab, y: .* above 0"),
    ],
)
def test_file_whose_scale_factor_makes_no_sense_on_one_axis(file, old, new, said):
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))
    with pytest.raises(UsageError, match=said):
        require_sound(load_model(str(file)))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "no such file"),
        ("a = ", "not valid TOML"),
        ('format = "ins-recording/1"', "format"),
        (of_three_axes("hysteresis"), "its name 'hysteresis' is that of a built-in model"),
        (of_three_axes("JB-KT8 #1"), "cannot stand in a table of results"),
    ],
)
@pytest.mark.parametrize("suffix", ["", "_refined"])
def test_unusable_compensation_file_is_refused(tmp_path, content, said, suffix):
    path = tmp_path / "it.toml"
    if content is not None:
        path.write_text(content)
    with pytest.raises(UsageError, match=said) as refused:
        load_model(f"{path}{suffix}")
    assert str(path) in str(refused.value)
    assert "\n" not in str(refused.value)


def test_readings_whose_axis_the_file_does_not_hold(tmp_path, file):
    file.write_text(of_three_axes().partition("[z.")[0])
    for axis, said in (("z", "holds models for x, y, but none for axis z"), ("", "which axis is meant was not said")):
        with pytest.raises(UsageError, match=said):
            load_model(str(file)).fit(readings(axis))
