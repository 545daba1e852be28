"""A user's model in a process of its own, where the truth is not.

A model that walks the memory of its process could read the trajectory, the simulated errors or the GPS there. So a
user's model is loaded and called in a child, a fresh interpreter that is sent chamber readings and samples and sends
back specific force (`serve` runs there). `ChildModel` stands in its place here; the models themselves stay in the
child, each under a number. Nothing that a child sends is ever run: an answer is JSON and the bytes of arrays.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import weakref
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from ins_eval import errors
from ins_eval.compensation import Samples
from ins_eval.compensation.connection import Connection
from ins_eval.parallel import KEEP_MEMORY
from ins_eval.recording import ChamberReadings

ANSWER_WITHIN_S = 300.0  # a loop in Python over the samples of two hours at 100 Hz takes a few seconds
END_WITHIN_S = 5.0
SAMPLES = tuple(field.name for field in fields(Samples))
READINGS = ("time_s", "run", "input_g", "rate_c_per_min", "temperature_c", "output")
# The number of threads decides the last bits of a result: one, as in `parallel`.
_ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OPENBLAS", "OMP", "MKL", "BLIS")}
_START = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[2]); "
    "from ins_eval.compensation.serve import serve; serve(json.loads(sys.argv[1]))"
)


class ModelFailed(Exception):
    """What a user's model did in its child; `described` is how `registry.describe_error` says it."""

    def __init__(self, described: str):
        super().__init__(described)
        self.described = described


class Child:
    """A process that holds models; it ends with this one, however this one ends."""

    def __init__(self) -> None:
        self._connection, theirs = Connection.pair()
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _START, json.dumps(theirs.handles), json.dumps(sys.path)],
            stdin=subprocess.DEVNULL,
            stdout=2,  # what a model prints is not our text
            pass_fds=theirs.handles,
            env=os.environ | _ONE_THREAD | KEEP_MEMORY,
            start_new_session=True,  # an interrupt from the terminal is for the parent to answer
        )
        theirs.close()
        self._owner, self._lock = os.getpid(), threading.Lock()
        self.left: list[int] = []  # numbers of models that nobody holds any more
        self._end = weakref.finalize(self, _end, self._connection, self._process)

    @property
    def alive(self) -> bool:
        """Whether this process may ask it."""
        return self._owner == os.getpid() and self._end.alive and self._process.poll() is None

    def ask(self, do: str, arrays: Sequence[np.ndarray] = (), **request: Any) -> tuple[dict[str, Any], list]:
        """The answer and its arrays. Raises ModelFailed, or the InsEvalError that the model raised."""
        if self._owner != os.getpid():  # two processes would take each other's answers
            raise errors.UsageError("a user's compensation model was loaded before a fork; load it in each process")
        with self._lock:
            left = [self.left.pop() for _ in range(len(self.left))]
            try:
                self._connection.messages.settimeout(ANSWER_WITHIN_S)
                self._connection.send({"do": do, "left": left, **request}, arrays)
                answer, results = self._connection.receive()
                error = _error(answer)
            except BaseException as failed:  # whatever it may still answer must not be taken for the next answer
                self._end()
                if isinstance(failed, TimeoutError):
                    raise ModelFailed(f"gave no answer within {ANSWER_WITHIN_S:g} s") from None
                if isinstance(failed, (EOFError, OSError)):
                    raise ModelFailed(f"ended its process ({_ending(self._process.returncode)})") from None
                if isinstance(failed, (ValueError, TypeError, KeyError, AttributeError)):
                    raise ModelFailed("disturbed the connection to its process") from None
                raise
        if error is not None:
            raise error
        return answer, results


class ChildModel:
    """Stands for a model in a child and has its `name`, `fit`, `refine` and `specific_force`."""

    def __init__(self, child: Child, number: int, name: str):
        self.name = name
        self._child, self._number = child, number
        weakref.finalize(self, child.left.append, number).atexit = False

    def fit(self, chamber: ChamberReadings) -> ChildModel:
        """Fit the model; returns this one where the model returned itself."""
        arrays = [*(getattr(chamber, name) for name in READINGS), *chamber.further.values()]
        said = {"unit_id": chamber.unit_id, "axis": chamber.axis, "further": list(chamber.further)}
        returned = self._ask("fit", arrays, **said)[0]["returned"]
        return self if returned is None else _of_type(returned)

    def refine(self, runs: Sequence[tuple[Samples, float | np.ndarray]]) -> ChildModel:
        """Refine the model, where it takes a refinement."""
        self._ask("refine", [array for samples, known in runs for array in (*_columns(samples), known)])
        return self

    def specific_force(self, samples: Samples) -> np.ndarray:
        """What the model gives; of anything but an array of numbers only its type."""
        answer, force = self._ask("specific_force", _columns(samples))
        return force[0] if force else _of_type(answer["returned"])

    def findings(self) -> list[tuple[str, str]]:
        """Check and refusal of each finding of `check.check_model`, which is run in the child."""
        return self._ask("check")[0]["findings"]

    def __deepcopy__(self, memo: dict) -> ChildModel:
        return ChildModel(self._child, self._ask("copy")[0]["number"], self.name)

    def _ask(self, do: str, arrays: Sequence[np.ndarray] = (), **request: Any) -> tuple[dict[str, Any], list]:
        return self._child.ask(do, arrays, number=self._number, **request)


_children: dict[str, Child] = {}


def child_of(key: str) -> Child:
    """The child that this process has for `key`, started where there is none."""
    if key not in _children or not _children[key].alive:
        _children[key] = Child()
    return _children[key]


def package_file(name: str, key: str) -> str | None:
    """The file of a package's module; to find it runs the packages above it, so the child for `key` does."""
    return child_of(key).ask("package_file", name=name, path=sys.path)[0]["file"]


def load_in_child(spec: str, key: str) -> ChildModel:
    """A new, unfitted model of `spec` in the child for `key`.

    Raises: UsageError where there is no such model or it cannot be made.
    """
    child = child_of(key)
    try:
        answer, _ = child.ask("load", spec=spec, folder=os.getcwd(), path=sys.path)
    except ModelFailed as failed:
        raise errors.UsageError(
            f"compensation model '{spec}': it {failed.described} while it was loaded; expected a module that imports "
            "cleanly and a class that can be made without arguments"
        ) from None
    return ChildModel(child, answer["number"], answer["name"])


def _columns(samples: Samples) -> list[np.ndarray]:
    return [getattr(samples, name) for name in SAMPLES]


def _of_type(name: str) -> Any:
    """Something of which only the name of its type is known."""
    return type(name, (), {})()


def _error(answer: dict[str, Any]) -> Exception | None:
    """What the model raised: an error of this package as it is, any other as a ModelFailed."""
    if "described" not in answer:
        return None
    if answer["kind"] is None:
        return ModelFailed(answer["described"])
    error = getattr(errors, answer["kind"])(answer["text"])
    error.described = answer["described"]
    return error


def _ending(code: int) -> str:
    if code == -signal.SIGKILL:
        return "SIGKILL, perhaps for lack of memory"
    return signal.Signals(-code).name if code < 0 else f"exit code {code}"


def _end(connection: Connection, process: subprocess.Popen) -> None:
    """Close the connection, upon which a child ends by itself."""
    connection.close()
    try:
        process.wait(END_WITHIN_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
