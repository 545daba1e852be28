"""Models by name: the built-in ones, and a user's own from a file or an installed package."""

from __future__ import annotations

import functools
import importlib
import inspect
import re
import sys
import traceback
from collections.abc import Callable, Iterable
from pathlib import Path
from types import ModuleType

import numpy as np

from ins_eval import boundary
from ins_eval.compensation import CompensationModel, Samples
from ins_eval.compensation.ablations import (
    hysteresis_bias_only,
    hysteresis_blind,
    hysteresis_piecewise_scale,
    hysteresis_scale_only,
    hysteresis_without_rate,
)
from ins_eval.compensation.child import load_in_child, package_file
from ins_eval.compensation.file import AXES, SINGLE, ModelFile
from ins_eval.compensation.hysteresis import hysteresis
from ins_eval.compensation.mirrored import Mirrored
from ins_eval.compensation.none import none
from ins_eval.compensation.quadratic import quadratic
from ins_eval.compensation.refined import Refined
from ins_eval.compensation.simple import simple
from ins_eval.errors import UsageError, did_you_mean
from ins_eval.recording import ChamberReadings
from ins_eval.tables import parse, read_toml

BUILT_IN: dict[str, Callable[[], CompensationModel]] = {
    "none": none,
    "simple": simple,
    "simple_anchored": functools.partial(simple, anchored=True),
    "quadratic": quadratic,
    "hysteresis": hysteresis,
    "hysteresis_scale_only": hysteresis_scale_only,
    "hysteresis_bias_only": hysteresis_bias_only,
    "hysteresis_without_rate": hysteresis_without_rate,
    "hysteresis_blind": hysteresis_blind,
    "hysteresis_piecewise_scale": hysteresis_piecewise_scale,
}
REFINED = "_refined"  # after any name, a user's too: that model with the oven refinement
FILE = ".toml"
_MIRRORED = re.compile(r"2 (\S+) - (\S+)")
_METHODS = ("fit", "specific_force")
_NAME = re.compile(r"[\w.+-][\w.+ -]*")
RESERVED = ("size", "rate_hz", "improvement")  # stand beside the names of models in metrics.json


class FromFile:
    """A compensation file: fitted already, so that `fit` only turns to the accelerometer that the readings are of."""

    def __init__(self, path: str | Path):
        self.path = Path(path)
        file = parse(ModelFile, read_toml(self.path), str(path))
        held = {key: getattr(file, key) for key in (SINGLE, *AXES)}
        self.name = file.name
        self.models = {key: table.model(file.name) for key, table in held.items() if table is not None}
        self._model = next(iter(self.models.values()))

    def fit(self, chamber: ChamberReadings) -> FromFile:
        """Take the model of the axis of these readings as it stands in the file."""
        if chamber.axis not in self.models and SINGLE not in self.models:
            wanted = f"none for axis {chamber.axis}" if chamber.axis else "which axis is meant was not said"
            raise UsageError(
                f"{self.path}: holds models for {', '.join(self.models)}, but {wanted}; calibrate all three axes"
            )
        self._model = self.models.get(chamber.axis) or self.models[SINGLE]
        return self

    def specific_force(self, samples: Samples) -> np.ndarray:
        """Specific force along the input axis, (n,) m/s^2."""
        return self._model.specific_force(samples)


def model_names() -> list[str]:
    """Names of the built-in models, each without and with refinement."""
    return [name + suffix for name in BUILT_IN for suffix in ("", REFINED)]


def load_model(spec: str) -> CompensationModel:
    """A new, unfitted model; that of a compensation file is fitted already.

    `spec` is a built-in name, ``file.py:Class``, ``package.module:Class``, ``file.toml``, any of these followed by
    ``_refined``, or ``2 A - B`` of two of them (see `mirrored`). A user's class runs in a child (see `child`).

    Raises: UsageError where there is no such model or it cannot be made.
    """
    return load_in_child(spec, spec.removesuffix(REFINED)) if is_users(spec) else make_model(spec)


def is_users(spec: str) -> bool:
    """Whether a user's class is in `spec`."""
    return any(":" in part and not part.removesuffix(REFINED).endswith(FILE) for part in _parts(spec))


def make_model(spec: str) -> CompensationModel:
    """A new model in this process, as `load_model` says."""
    if len(parts := _parts(spec)) == 2:
        return Mirrored(*map(make_model, parts))
    if spec in BUILT_IN:
        return BUILT_IN[spec]()
    if spec.endswith(FILE):
        return _load_file(spec)
    if spec.endswith(FILE + REFINED):
        return Refined(_load_file(spec.removesuffix(REFINED)))
    if ":" in spec:
        return _load_users(spec)
    if spec.endswith(REFINED) and spec.removesuffix(REFINED) in BUILT_IN:
        return Refined(make_model(spec.removesuffix(REFINED)))
    if spec.endswith(".py"):
        raise UsageError(f"compensation model '{spec}' names a file but no class in it; write '{spec}:MyModel'")
    raise UsageError(f"no compensation model is called '{spec}'{did_you_mean(spec, model_names())}")


def _parts(spec: str) -> list[str]:
    """The two models of ``2 A - B``, else the one."""
    mirrored = _MIRRORED.fullmatch(spec)
    return [mirrored[1], mirrored[2]] if mirrored else [spec]


def model_files(specs: Iterable[str]) -> list[Path]:
    """The files of the users' own models among `specs`, each once."""
    files = []
    for one in (part for spec in specs for part in _parts(spec)):
        where = one.rpartition(":")[0]
        if (file := one.removesuffix(REFINED)).endswith(FILE):
            files.append(Path(file))
        elif where.endswith(".py"):
            files.append(Path(where))
        elif where and (found := package_file(where, file)):
            files.append(Path(found))
    return sorted(set(files))


def missing_parts(model: object) -> str | None:
    """What an object lacks to be a compensation model, or None."""
    name = getattr(model, "name", None)
    if not isinstance(name, str) or not name:
        return f'its name is {name!r}; expected a non-empty text, so give the class a line like name = "mine"'
    if not _NAME.fullmatch(name) or name in RESERVED:
        return (
            f"its name '{name}' cannot stand in a table of results; expected letters, digits, '_', '.', '+' or '-', "
            f"and none of {', '.join(RESERVED)}, so rename it"
        )
    lacking = [method for method in _METHODS if not callable(getattr(model, method, None))]
    if lacking:
        return f"it has no method {' and no method '.join(lacking)}; expected fit(chamber) and specific_force(samples)"
    of_ours = type(model).__module__.startswith("ins_eval.") and not isinstance(model, FromFile)
    if name in model_names() and not of_ours:
        return f"its name '{name}' is that of a built-in model; its results would be taken for that one's, so rename it"
    return None


def _load_file(spec: str) -> FromFile:
    model = FromFile(spec)
    if lack := missing_parts(model):
        raise UsageError(f"compensation model '{spec}': {lack}")
    return model


def _load_users(spec: str) -> CompensationModel:
    where, _, attribute = spec.rpartition(":")
    module = _from_file(spec, Path(where)) if where.endswith(".py") else _from_package(spec, where)
    factory = getattr(module, attribute, None)
    if factory is None and attribute.endswith(REFINED):
        return Refined(make_model(spec.removesuffix(REFINED)))
    if not callable(factory):
        classes = [name for name, thing in vars(module).items() if inspect.isclass(thing)]
        known = did_you_mean(attribute, classes) if classes else "; it has no class at all"
        raise UsageError(f"compensation model '{spec}': {where} has no class '{attribute}'{known}")
    try:
        model = factory()
    except Exception as error:
        raise UsageError(
            f"compensation model '{spec}': {attribute}() {describe_error(error)}; "
            f"expected a class that can be made without arguments, so give each a default"
        ) from error
    if lack := missing_parts(model):
        raise UsageError(f"compensation model '{spec}': {lack}")
    return model


def _from_file(spec: str, path: Path) -> ModuleType:
    if not path.is_file():
        near = did_you_mean(path.name, [p.name for p in path.parent.glob("*.py")]) if path.parent.is_dir() else ""
        raise UsageError(f"compensation model '{spec}': there is no file {path}{near if 'mean' in near else ''}")
    return _import_file(spec, path.resolve(), path.stat().st_mtime_ns)


@functools.lru_cache(maxsize=32)  # an ensemble makes a model for every accelerometer of every instrument
def _import_file(spec: str, path: Path, _modified_ns: int) -> ModuleType:
    name = f"ins_eval_model_{path.stem}_{abs(hash(path)):x}"
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module  # dataclasses look their module up
    try:
        # compiled here rather than by an importer, which would leave a __pycache__ beside the user's file
        exec(compile(boundary.file_bytes(path, "Python", boundary.LARGEST_TEXT_BYTES), path, "exec"), module.__dict__)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise _import_failed(spec, str(path), error) from error
    return module


def _from_package(spec: str, name: str) -> ModuleType:
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name and (name == error.name or name.startswith(error.name + ".")):
            file = Path(*name.split(".")).with_suffix(".py")
            remedy = (
                f"a file {file} is here, so write"
                if file.is_file()
                else "install the package that has it, or name a file:"
            )
            attribute = spec.rpartition(":")[2]
            raise UsageError(
                f"compensation model '{spec}': there is no module '{error.name}'; {remedy} '{file}:{attribute}'"
            ) from error
        raise _import_failed(spec, name, error) from error
    except (Exception, SystemExit) as error:
        raise _import_failed(spec, name, error) from error


def _import_failed(spec: str, where: str, error: BaseException) -> UsageError:
    return UsageError(
        f"compensation model '{spec}': importing {where} {describe_error(error)}; "
        f"expected a module that imports cleanly"
    )


def describe_error(error: BaseException) -> str:
    """What a stranger's model did, for one sentence: the kind, first line and place of its exception."""
    if hasattr(error, "described"):  # in its child
        return error.described
    text = str(error).strip().split("\n")[0]
    if isinstance(error, SyntaxError) and error.lineno:
        return f"raised SyntaxError: {error.msg}, line {error.lineno}"
    frames = traceback.extract_tb(error.__traceback__)
    line = f", line {frames[-1].lineno} of {Path(frames[-1].filename).name}" if frames else ""
    return f"raised {type(error).__name__}{': ' + text if text else ''}{line}"
