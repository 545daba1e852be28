"""A user's model in an ensemble, which looks for the truth by every route that Python has, finds none."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ins_eval.compensation import guard
from ins_eval.compensation.registry import make_model
from ins_eval.ensemble import Plan, World, flight

SPY = """
import gc, json, sys
from pathlib import Path
import numpy as np

NAMES = {"Recording", "Trajectory", "Truth", "Mission", "Instrument", "World", "Fixes", "Start"}

def reachable():
    # arrays of numbers are not tracked themselves, but what holds them is
    tracked = gc.get_objects()
    return tracked + [thing for one in tracked for thing in gc.get_referents(one)]

def frames():
    frame = sys._getframe(1)
    while frame is not None:
        yield frame.f_code.co_name
        yield from (type(thing).__name__ for thing in frame.f_locals.values())
        frame = frame.f_back

OWN = []  # what it was given and what it gave

class Spy:
    name = "spy"
    def fit(self, chamber):
        self.scale_ = chamber.output[chamber.input_g == 1.0].mean()
        return self
    def specific_force(self, samples):
        OWN.extend(vars(samples).values())
        given, count = {id(one) for one in OWN}, samples.output.size
        found = [f"{name}.base" for name, column in vars(samples).items() if column.base is not None]
        found += [name for name in vars(samples) if name not in {"time_s", "output", "temperature_c", "rate_c_per_min"}]
        for thing in reachable():
            if type(thing).__name__ in NAMES and type(thing).__module__.startswith("ins_eval"):
                found.append(type(thing).__name__)
            if isinstance(thing, np.ndarray) and thing.shape[:1] == (count,) and id(thing) not in given:
                found.append(f"array {thing.shape}")
        found += [f"sys.modules: {name}" for name in ("ins_eval.imu", "ins_eval.ensemble.world") if name in sys.modules]
        found += [f"frame: {name}" for name in frames() if name in NAMES | {"fly", "compensate", "triads"}]
        with Path("found.jsonl").open("a") as file:
            file.write(json.dumps(sorted(set(found))) + "\\n")
        OWN.append(9.80665 * samples.output / self.scale_)
        return OWN[-1]
"""


@pytest.fixture
def found(profile: Path, tmp_path: Path, monkeypatch):
    """What the spy finds in each of its calls while one instrument is calibrated, refined and flown."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spy.py").write_text(SPY)

    def fly(*spies: str) -> list[list[str]]:
        plan = Plan(profile=str(profile), arms=("simple", *spies))
        assert "spy.py:Spy" in flight.member(World(plan), 0)
        return [json.loads(line) for line in (tmp_path / "found.jsonl").read_text().splitlines()]

    return fly


def test_a_model_that_looks_for_the_truth_finds_none(found) -> None:
    calls = found("spy.py:Spy", "spy.py:Spy_refined")
    assert len(calls) == 9  # three axes in flight and, refined, in the oven and in flight
    assert calls == [[]] * 9


def test_in_one_process_with_the_truth_it_finds_it_by_each_route(found, monkeypatch) -> None:
    """The spy is able: the test above can fail."""
    monkeypatch.setattr(guard, "load_model", make_model)
    everything = {thing for call in found("spy.py:Spy") for thing in call}
    assert {"Trajectory", "Recording", "frame: fly", "sys.modules: ins_eval.imu"} <= everything
    assert any(thing.startswith("array") for thing in everything)
