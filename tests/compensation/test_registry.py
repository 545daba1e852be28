"""Models by name: what is found, and one sentence for each way of not being found."""

import pytest

from ins_eval.compensation.refined import Refined
from ins_eval.compensation.registry import load_model, model_names
from ins_eval.errors import UsageError

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
    assert load_model(f"{folder}/my_model.py:MyModel").gain == 1.0
    refined = load_model("my_model.py:MyModel_refined")
    assert isinstance(refined, Refined)
    assert refined.name == "mine_refined"
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
        ("zzz", "known are .*simple"),
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
