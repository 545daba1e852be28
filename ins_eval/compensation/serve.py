"""What runs in the child of a user's model (see `child`): it loads models and calls them when asked."""

from __future__ import annotations

import copy
import importlib.util
import itertools
import os
import select
import signal
import socket
import sys
import threading
from typing import Any

import numpy as np

from ins_eval import errors
from ins_eval.compensation import CompensationModel, Samples
from ins_eval.compensation.check import check_model, kind
from ins_eval.compensation.child import READINGS, SAMPLES
from ins_eval.compensation.connection import PLAIN, Connection
from ins_eval.compensation.registry import describe_error, make_model
from ins_eval.recording import ChamberReadings

Answer = tuple[dict[str, Any], list[np.ndarray]]


def serve(handles: tuple[int, int]) -> None:
    """Answer what the parent asks on the connection with these `handles`, until the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    connection = Connection.inherited(handles)
    threading.Thread(target=_end_with_parent, args=(connection.messages,), daemon=True).start()
    models = Models()
    while True:
        try:
            request, arrays = connection.receive()
        except (EOFError, OSError):
            os._exit(0)
        answer, results = models.answer(arrays, **request)
        del arrays
        connection.send(answer, results)
        del answer, results


class Models:
    """Models by number."""

    def __init__(self) -> None:
        self._models: dict[int, CompensationModel] = {}
        self._numbers = itertools.count()

    def answer(self, arrays: list[np.ndarray], do: str, left: list[int], **request: Any) -> Answer:
        """Do what is asked; what a model raises is part of the answer."""
        for number in left:
            self._models.pop(number, None)
        try:
            return getattr(self, do)(arrays, **request)
        except BaseException as error:  # SystemExit, too, is the model's own
            names = [base.__name__ for base in type(error).__mro__ if base.__module__ == errors.__name__]
            return {
                "kind": names[0] if names else None,
                "text": str(error),
                "described": describe_error(error),
            }, []

    def load(self, _: list, spec: str, folder: str, path: list[str]) -> Answer:
        """Make a new model, as it would be made in the folder and with the path of the parent."""
        os.chdir(folder)
        sys.path[:] = path
        model = make_model(spec)
        return {"number": self._keep(model), "name": model.name}, []

    def package_file(self, _: list, name: str, path: list[str]) -> Answer:
        """Find the file of a package's module."""
        sys.path[:] = path
        found = importlib.util.find_spec(name)
        return {"file": found and found.origin}, []

    def copy(self, _: list, number: int) -> Answer:
        """Copy a model."""
        return {"number": self._keep(copy.deepcopy(self._models[number]))}, []

    def check(self, _: list, number: int) -> Answer:
        """Check the contract of a model."""
        findings = check_model(self._models[number])
        return {"findings": [(finding.check, finding.refusal) for finding in findings]}, []

    def fit(self, arrays: list, number: int, unit_id: str, axis: str, further: list[str]) -> Answer:
        """Fit a model."""
        count = len(READINGS)
        beside = dict(zip(further, arrays[count:], strict=True))
        readings = dict(zip(READINGS, arrays[:count], strict=True))
        chamber = ChamberReadings(**readings, unit_id=unit_id, axis=axis, further=beside)
        returned = self._models[number].fit(chamber)
        return {"returned": None if returned is self._models[number] else kind(returned)}, []

    def refine(self, arrays: list, number: int) -> Answer:
        """Refine a model that takes a refinement."""
        width = len(SAMPLES) + 1
        runs = [arrays[first : first + width] for first in range(0, len(arrays), width)]
        if (refine := getattr(self._models[number], "refine", None)) is not None:
            refine([(Samples(*columns), known if known.ndim else float(known)) for *columns, known in runs])
        return {}, []

    def specific_force(self, arrays: list, number: int) -> Answer:
        """Ask a model for specific force."""
        force = self._models[number].specific_force(Samples(*arrays))
        if isinstance(force, np.ndarray) and force.dtype.kind in PLAIN:
            return {}, [force]
        return {"returned": kind(force)}, []

    def _keep(self, model: CompensationModel) -> int:
        number = next(self._numbers)
        self._models[number] = model
        return number


def _end_with_parent(messages: socket.socket) -> None:
    """End this process when the other end of the connection is closed, also while a model is at work."""
    waiting = select.poll()
    waiting.register(messages, 0)  # POLLHUP comes unasked
    waiting.poll()
    os._exit(0)
