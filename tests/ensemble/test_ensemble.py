"""Members are paired: nothing that is added beside a draw, a compensation or an instrument moves another."""

from __future__ import annotations

import importlib
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

import ins_eval
from ins_eval import ensemble
from ins_eval.accelerometer import AccelerometerEffect, Contribution
from ins_eval.accelerometer import Population as Accelerometers
from ins_eval.ensemble import ARMS, SOURCES, Plan, World, fly
from ins_eval.errors import UsageError
from ins_eval.navigation import evaluate
from ins_eval.parallel import code_digest
from ins_eval.reference import bridge

MODEL = """\
class Plain:
    name = "plain"
    def fit(self, chamber):
        return self
    def specific_force(self, samples):
        return samples.output * (9.80665 / 320000.0)
"""
FEW = ("simple", "hysteresis_refined")


class Silent(AccelerometerEffect):
    """A source of errors that draws wherever it may and adds nothing."""

    name: ClassVar[str] = "silent"

    def for_axes(self, rng):
        rng.standard_normal(7)
        return self, self, self

    def draw(self, rng, drawn):
        return rng.standard_normal(3)

    def contribution(self, unit, run, streams):
        return Contribution(bias_ug=0.0 * streams.rng().standard_normal(run.time_s.size))

    def noise_ug(self, interval_s, rng):
        return 0.0 * rng.standard_normal(interval_s.size)


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "my.py"
    path.write_text(MODEL)
    return path


@pytest.fixture
def plan(profile: Path) -> Plan:
    return Plan(profile=str(profile), arms=FEW)


def in_bytes(member) -> dict[str, dict[str, bytes]]:
    """A member, to be compared bit by bit."""
    return {arm: {key: np.asarray(value).tobytes() for key, value in values.items()} for arm, values in member.items()}


def in_file(store: ensemble.Store, index: int) -> bytes:
    """A member as it lies on disk."""
    return store.path(index).read_bytes()


# ------------------------------------------------------------------------------------------------ pairing


def test_adding_compensations_changes_no_number_of_the_others(plan: Plan, model: Path) -> None:
    few = in_bytes(fly(World(plan), 1))
    more = in_bytes(fly(World(replace(plan, arms=(f"{model}:Plain", *reversed(ARMS), f"{model}:Plain_refined"))), 1))
    assert set(few) == set(FEW)
    assert len(more) == len(ARMS) + 2
    assert {arm: more[arm] for arm in FEW} == few


@pytest.mark.parametrize("place", [0, 5, 99])
def test_adding_a_source_of_errors_moves_no_other_draw(plan: Plan, place: int) -> None:
    world, with_source = World(plan), World(plan)
    effects = list(world.population.accelerometers.effects)
    effects.insert(place, Silent())
    more = Accelerometers("more", tuple(effects))
    with_source.population = replace(world.population, accelerometers=more)
    assert in_bytes(fly(with_source, 0)) == in_bytes(fly(world, 0))


@pytest.mark.parametrize("source", SOURCES)
def test_instrument_of_the_error_budget_is_the_same_with_all_else_switched_off(plan: Plan, source: str) -> None:
    full, alone = World(plan), World(replace(plan, source=source))
    on, gyros_err, changes = SOURCES[source]
    for whole, part in zip(full.instrument(3).accelerometers, alone.instrument(3).accelerometers, strict=True):
        for effect in set(on) - {key.partition(".")[0] for key, _ in changes}:
            np.testing.assert_equal(part.units[effect], whole.units[effect])
    recordings = [world.flight.record(world.instrument(3), world.streams(3).at("flight")) for world in (full, alone)]
    np.testing.assert_array_equal(recordings[0].gps.latitude_rad, recordings[1].gps.latitude_rad)
    np.testing.assert_array_equal(recordings[0].imu.height_baro_m, recordings[1].imu.height_baro_m)
    assert np.array_equal(recordings[0].imu.gyro, recordings[1].imu.gyro) == gyros_err
    assert not np.array_equal(recordings[0].imu.accelerometer, recordings[1].imu.accelerometer)


def test_instruments_and_seeds_differ(plan: Plan) -> None:
    worlds = World(plan), World(replace(plan, seed=2))
    numbers = {fly(world, i)["simple"]["velocity_rms_north"].item() for world in worlds for i in (0, 1)}
    assert len(numbers) == 4


def test_contributions_are_those_of_the_errors(plan: Plan) -> None:
    """Velocity RMS, final radial error rate and track, written out again from the errors of a flight."""
    recording = World(plan).flight.ideal()
    errors = evaluate(recording, recording.imu.accelerometer + 1e-5).errors  # 1e-4 m/s^2 at 10 Hz
    seen = ensemble.contributions(errors)
    north = errors.velocity_n[errors.valid, 0]
    assert seen["velocity_rms_north"] == pytest.approx(np.sqrt(np.mean(north**2)), rel=1e-12)
    last = np.flatnonzero(errors.valid)[-1]
    radius_nmi = np.hypot(errors.north_m[last], errors.east_m[last]) / 1852.0
    assert seen["cep_rate_final"] == pytest.approx(radius_nmi / (errors.time_s[last] / 3600.0), rel=1e-12)
    bridged = bridge(errors)
    np.testing.assert_allclose(seen["track_s"], np.arange(0.0, 301.0, 60.0), atol=0.5)
    np.testing.assert_allclose(seen["track_m"][:, 0], np.interp(seen["track_s"], bridged.time_s, bridged.north_m))


# ------------------------------------------------------------------------------------------------ the run


def test_members_depend_on_neither_workers_nor_size_nor_company(plan: Plan, tmp_path: Path) -> None:
    other = replace(plan, seed=9)
    alone = ensemble.run({"a": (plan, 3)}, tmp_path / "one", workers=1, quiet=True)
    both = ensemble.run({"b": (other, 1), "a": (plan, 2)}, tmp_path / "two", workers=2, quiet=True)
    assert [in_bytes(m) for m in alone["a"][:2]] == [in_bytes(m) for m in both["a"]]
    stores = [ensemble.Store(tmp_path / folder / plan.key()) for folder in ("one", "two")]
    assert [in_file(stores[0], i) for i in (0, 1)] == [in_file(stores[1], i) for i in (0, 1)]


def test_members_come_in_order_of_their_numbers(plan: Plan, tmp_path: Path) -> None:
    ensemble.run({"a": (plan, 3)}, tmp_path, workers=1, quiet=True)
    store = ensemble.Store(tmp_path / plan.key())
    store.path(0).unlink()  # so that the first is finished last
    again = ensemble.run({"a": (plan, 3)}, tmp_path, workers=1, quiet=True)["a"]
    assert [in_bytes(m) for m in again] == [in_bytes(fly(World(plan), i)) for i in range(3)]
    stacked = ensemble.stacked(again)
    assert list(stacked["simple"]["cep_rate_final"]) == [m["simple"]["cep_rate_final"] for m in again]


def test_finished_members_are_not_computed_again(plan: Plan, tmp_path: Path, monkeypatch) -> None:
    first = ensemble.run({"a": (plan, 2)}, tmp_path, workers=1, quiet=True)
    monkeypatch.setattr(ensemble.flight, "member", None)
    again = ensemble.run({"a": (plan, 2)}, tmp_path, workers=1, quiet=True)
    assert [in_bytes(m) for m in again["a"]] == [in_bytes(m) for m in first["a"]]


def test_progress_shows_the_time_to_go(plan: Plan, tmp_path: Path, capsys, monkeypatch) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    ensemble.run({"a": (plan, 2)}, tmp_path / "shown", workers=1, quiet=False)
    shown = capsys.readouterr().err
    assert "instruments" in shown and "2/2" in shown
    assert "<00:00" in shown  # elapsed<to go
    ensemble.run({"a": (plan, 2)}, tmp_path / "quiet", workers=1, quiet=True)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("field", [{"experiment": "fligt"}, {"source": "gyros"}])
def test_plan_refuses_what_it_does_not_know(field: dict) -> None:
    with pytest.raises(UsageError, match="did you mean '(flight|gyro)'"):
        Plan(**field)


# ------------------------------------------------------------------------------------------------ the key


@pytest.mark.parametrize(
    "change",
    [
        {"seed": 2},
        {"arms": ("simple",)},
        {"rate_hz": 20.0},
        {"oven_runs": 2},
        {"source": "gyro"},
        {"profile": "box"},
        {"experiment": "oven"},
        {"changes": (("creep.scatter", 0.5),)},
        {"oven": "climb-cruise-landing"},
        {"missions": "worldwide"},
        {"missions_off": ("place",)},
    ],
    ids=lambda change: next(iter(change)),
)
def test_key_changes_with_the_plan(plan: Plan, change: dict) -> None:
    assert replace(plan, **change).key() != plan.key()


def test_key_is_the_same_in_another_process(plan: Plan) -> None:
    code = f"from ins_eval.ensemble import Plan; print(Plan(profile={plan.profile!r}, arms={plan.arms!r}).key())"
    environment = {**os.environ, "PYTHONHASHSEED": "7"}
    command = [sys.executable, "-c", code]
    other = subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.strip()
    assert other == plan.key()


def test_key_changes_with_what_the_profile_says_and_not_with_how(plan: Plan, profile: Path) -> None:
    before = plan.key()
    profile.write_text("# a comment\n" + profile.read_text())
    assert plan.key() == before
    profile.write_text(profile.read_text().replace("to_mps = 100.0", "to_mps = 100.5"))
    assert plan.key() != before


def test_key_changes_with_a_profile_that_the_profile_refers_to(profile: Path, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "trajectories").mkdir()
    referred = tmp_path / "trajectories" / "warm.toml"
    referred.write_text(profile.read_text())
    profile.write_text(profile.read_text().partition("[thermal]")[0] + '[thermal]\nsame_as = "warm"\n')
    plan = Plan(profile=str(profile))
    before = plan.key()
    referred.write_text(referred.read_text().replace("self_heating_c = 20.0", "self_heating_c = 21.0"))
    assert plan.key() != before


def test_key_changes_with_the_population(profile: Path, tmp_path: Path) -> None:
    population = tmp_path / "mine.toml"
    population.write_text('extends = "jb-kt8"\n')
    plan = Plan(profile=str(profile), population=str(population))
    before = plan.key()
    population.write_text('extends = "jb-kt8"\n[creep]\nscatter = 0.123\n')
    assert plan.key() != before


def test_key_changes_with_the_file_of_a_users_model(plan: Plan, model: Path) -> None:
    plan = replace(plan, arms=(f"{model}:Plain", f"{model}:Plain_refined"))
    before = plan.key()
    model.write_text(MODEL.replace("320000.0", "320001.0"))
    assert plan.key() != before


def test_key_changes_with_the_module_of_a_users_model(plan: Plan, tmp_path: Path, monkeypatch) -> None:
    module = tmp_path / "lab_model_of_the_key_test.py"
    module.write_text(MODEL)
    monkeypatch.syspath_prepend(tmp_path)
    plan = replace(plan, arms=(f"{module.stem}:Plain_refined",))
    before = plan.key()
    module.write_text(MODEL.replace("320000.0", "320001.0"))
    importlib.invalidate_caches()
    assert plan.key() != before


@pytest.mark.parametrize("file", ["gps.py", "ensemble/oven.py", "accelerometer/creep.py", "accelerometer/epoxy.toml"])
def test_key_changes_with_the_code_and_its_data(plan: Plan, tmp_path: Path, monkeypatch, file: str) -> None:
    copy = tmp_path / "ins_eval"
    shutil.copytree(Path(ins_eval.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr("ins_eval.parallel.__file__", str(copy / "parallel.py"))
    monkeypatch.setattr("ins_eval.ensemble.plan.code_digest", code_digest.__wrapped__)  # of a new process
    before = plan.key()
    with (copy / file).open("a") as text:
        text.write("# changed\n")
    assert plan.key() != before
