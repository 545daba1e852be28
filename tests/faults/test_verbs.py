"""Damaged inputs of every verb that reads: accepted or refused in one sentence, soon, never a defect of ours."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.faults.verbs import Verb, damaged, verbs

MANY, FEWER = 1000, 150  # of each verb; `diagnose` takes seconds where it accepts
VERBS = (
    *("evaluate", "evaluate, belief", "evaluate, pulses", "compare", "diagnose", "diagnose, chamber", "calibrate"),
    *("loop calibrate", "loop simulate", "results", "simulate", "check-model"),
)
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Verb]:
    return verbs(tmp_path_factory.mktemp("verbs") / "sound")


@pytest.mark.filterwarnings("ignore")  # of libraries, which the command line does not print either
@pytest.mark.parametrize("name", VERBS)
def test_damaged_inputs(made: dict[str, Verb], tmp_path: Path, record_property, name: str) -> None:
    refused, many = 0, FEWER if name.startswith("diagnose") else MANY
    for seed in range(many):
        rng = np.random.default_rng([sum(name.encode()), seed])
        found = damaged(made[name], tmp_path / "damaged", rng)
        assert found.kind in ("accepted", "refused"), f"seed {seed}: {found}"
        refused += found.kind == "refused"
    record_property("outcomes", f"{many - refused} accepted, {refused} refused")
    assert 0 < refused < many  # the damage reaches the reader, and not all of it


def test_the_fuzzer_sees_a_defect(made: dict[str, Verb], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where what checks the belief is out, some damaged belief is a defect, and the fuzzer says so."""
    from ins_eval import interface

    def unchecked(*_: object) -> None:
        raise ValueError("a number that nobody checked")

    monkeypatch.setattr(interface, "parse", unchecked)
    found = damaged(made["evaluate, belief"], tmp_path / "damaged", np.random.default_rng(4))
    assert found.kind == "defect" and "nobody checked" in found.said
