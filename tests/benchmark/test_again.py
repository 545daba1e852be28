"""Cases drawn once more: the same but for the effect, and on the paths of recommended experiments."""

from __future__ import annotations

import numpy as np
import pytest

from benchmark.runners import again, experiments
from benchmark.worlds import cases
from benchmark.worlds.trajectories import TRAJECTORIES
from benchmark.worlds.write import toml

MANIFEST = {"made": [{"set": "development", "seed": 3, "rate_hz": 20.0}]}
G = 9.80665


@pytest.fixture(scope="module")
def case() -> cases.Case:
    """A parked unit with a bias in z of which one recording cannot say whether it is one."""
    return cases.draw("development", 3, "unidentifiable", 0, 20.0)


def test_a_case_is_drawn_again_from_its_truth(case):
    (made,) = again.drawn(case.truth, MANIFEST).made
    for name, column in case.made[0].tables["imu"].items():
        np.testing.assert_array_equal(made.tables["imu"][name], column)


def test_another_manifest_is_refused(case):
    with pytest.raises(ValueError, match="no seed of the manifest"):
        again.drawn(case.truth, {"made": [{"set": "development", "seed": 4, "rate_hz": 20.0}]})


def test_with_nothing_hidden_only_the_effect_is_gone(case):
    """A bias of v ug over T seconds is v 1e-6 K1 T pulses; K1 is gamma to within 1 % at any temperature."""
    (made,) = again.without_effect(case.truth, MANIFEST).made
    hidden, bare = case.made[0].tables["imu"], made.tables["imu"]
    for name in set(hidden) - {"accel_z"}:
        np.testing.assert_array_equal(bare[name], hidden[name])
    assert toml(made.head) == toml(case.made[0].head)
    (effect,) = case.truth["effects"]
    gamma = made.head["accelerometer"]["z"]["scale"]["gamma"]
    pulses = effect["value"] * 1e-6 * gamma * hidden["time_s"][-1]
    assert np.sum(hidden["accel_z"] - bare["accel_z"]) == pytest.approx(pulses, rel=0.01)


def test_a_tumble_stands_on_six_faces(case):
    made = again.experiment(case.truth, MANIFEST, "a tumble: parked on six faces in turn")
    force, each = made.felt.velocity / made.felt.dt / G, round(again.DWELL_S / made.felt.dt)
    middle = force[each // 2 :: each][: len(again.FACES)]
    assert {tuple(np.rint(one).astype(int)) for one in middle} == {
        tuple(sign * axis) for axis in np.eye(3, dtype=int) for sign in (-1, 1)
    }
    assert np.abs(np.linalg.norm(middle, axis=1) - 1.0).max() < 0.005  # gravity differs from 9.80665 by so much
    assert made.kind == "static" and made.unit.sheet == case.unit.sheet


def test_headings_turn_the_box_on_the_spot(case):
    made = again.experiment(case.truth, MANIFEST, "turning the box through four headings while parked")
    second = 900.0 * (np.arange(4) + 0.5)
    heading = np.degrees(made.felt.truth.state(second)[2][:, 2])
    np.testing.assert_allclose(np.diff(heading), 90.0, atol=1e-6)
    assert np.abs(made.felt.truth.state(second)[1]).max() < 1e-9


def test_a_chamber_holds_the_axis_that_was_asked_for(case):
    made = again.experiment(case.truth, MANIFEST, "accelerometer z in a chamber, four positions, soaks of 2 h")
    assert made.kind == "chamber" and made.errors["axis"] == "z"
    ramps = {round(abs(float(one)), 3) for one in made.tables["chamber"]["rate_c_per_min"]}
    assert ramps == {0.0, *again.CHAMBER_RAMPS}


def test_an_experiment_that_the_maker_does_not_have_is_not_made(case):
    assert again.experiment(case.truth, MANIFEST, "the same again, with another receiver and its antenna") is None
    assert again.experiment(case.truth, MANIFEST, "ask an expert") is None


def test_every_path_of_an_experiment_exists():
    assert {path for _, path in again.EXPERIMENTS} <= {*TRAJECTORIES, *again.PATHS}


def named(name, **more) -> dict:
    return {"name": f"accelerometer.{name}", "axis": "z", **more}


@pytest.mark.parametrize(
    ("joint", "separated"),
    [
        ({"effects": [named("bias")], "indistinguishable": []}, True),
        ({"effects": [named("bias")], "indistinguishable": [named("cubic")]}, True),
        ({"effects": [named("bias")], "indistinguishable": [named("scale")]}, False),
        ({"effects": [named("scale")], "indistinguishable": []}, False),
        (None, False),
    ],
)
def test_an_experiment_separates_where_the_truth_leads_and_its_rivals_are_gone(joint, separated):
    truth = {"a": {"kind": "unidentifiable", "effects": [named("bias", value=300.0)]}}
    before = {"a": {"verdict": "not identifiable", "effects": [named("bias")],
                    "indistinguishable": [named("scale", experiment="a tumble")]}}  # fmt: skip
    (one,) = experiments.outcomes(truth, before, {} if joint is None else {"a": joint})
    assert (one["experiment"], one["made"], one["separated"]) == ("a tumble", joint is not None, separated)
