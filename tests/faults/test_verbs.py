"""Damaged inputs of every verb that reads: accepted or refused in one sentence, soon, never a defect of ours."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ins_eval import boundary, limits, profile, tables
from ins_eval.accelerometer import model
from ins_eval.analysis import evaluate
from ins_eval.figures import style
from ins_eval.imu import Mission
from ins_eval.profile import Place, Profile, Thermal
from ins_eval.recording import Recording, validation
from ins_eval.recording.consistency import limits as consistency_limits
from ins_eval.recording.form import reading
from tests.faults.verbs import Verb, damaged, normal_s, verbs

MANY, FEWER = 1000, 150  # of each verb; `diagnose` takes seconds where it accepts
VERBS = (
    *("import", "import, mat"),
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


def _floor_of_a_profile(recording: Recording, duration_s: float, rate_hz: float) -> Recording:
    """The standstill as the simulator makes it, which flies where the flights of the paper do."""
    at = recording.start
    place = Place(
        latitude_deg=np.degrees(at.latitude_rad),
        longitude_deg=np.degrees(at.longitude_rad),
        height_m=at.height_m,
        heading_deg=0.0,
        stand_s=0.0,
    )
    thermal = Thermal(self_heating_c=0.0)
    standstill = Profile(name="standstill", kind="static", duration_s=duration_s, start=place, thermal=thermal)
    return Mission(standstill, rate_hz).ideal()


def _any_base(path: Path, find: Callable[[str], Path]) -> dict[str, Any]:
    """A file laid over what it extends, whatever stands there."""
    table = tables.read_toml(path)
    base_name = table.pop("extends", None)
    if base_name is None:
        return table
    sibling = path.parent / (base_name + ".toml")
    return {**_any_base(sibling if sibling.is_file() else find(base_name), find), **table}


def _no_limits(patch: pytest.MonkeyPatch) -> None:
    for module in (limits, reading):
        patch.setattr(module, "limits_of", lambda _: (-np.inf, np.inf))
    patch.setattr(validation, "within", np.isfinite)
    endless = {quantity: (-np.inf, np.inf, unit) for quantity, (*_, unit) in consistency_limits.LIMITS.items()}
    patch.setattr(consistency_limits, "LIMITS", endless)


def _any_extends(patch: pytest.MonkeyPatch) -> None:
    for module in (profile, model):
        patch.setattr(module, "read_extending", _any_base)


def _no_sizes(patch: pytest.MonkeyPatch) -> None:
    for name in ("UNSUSPECTED_BYTES", "LARGEST_BYTES"):
        patch.setattr(boundary, name, 1 << 62)


def _any_formula(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(style, "as_written", lambda figure: figure)


def _any_place(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(evaluate, "_at_rest", _floor_of_a_profile)


# what is taken out: how, the verb, and the file that is damaged
FIXES: dict[str, tuple[Callable[[pytest.MonkeyPatch], None], str, str]] = {
    "the floor of any place": (_any_place, "evaluate", "unit/recording.toml"),
    "unpacked size of gzip": (_no_sizes, "import", "log.csv"),
    "unpacked size of MATLAB": (_no_sizes, "import, mat", "log.mat"),
    "texts drawn as they stand": (_any_formula, "diagnose", "unit/recording.toml"),
    "what extends may be": (_any_extends, "simulate", "short.toml"),
    "limits of numbers": (_no_limits, "evaluate, belief", "belief.toml"),
}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("fix", FIXES)
def test_the_fuzzer_finds_what_a_fix_mends(
    made: dict[str, Verb], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, record_property, fix: str
) -> None:
    """Where the fix is out, one of the inputs ends as no input may."""
    take_out, name, file = FIXES[fix]
    take_out(monkeypatch)
    normal_s(made[name], tmp_path / "sound")
    for seed in range(MANY):
        rng = np.random.default_rng([sum(name.encode()), seed])
        found = damaged(made[name], tmp_path / "damaged", rng, only=file)
        if found.kind not in ("accepted", "refused"):
            record_property("found", f"{found.kind} after {seed + 1} inputs")
            return
    pytest.fail(f"none of {MANY} inputs shows that the fix is out")
