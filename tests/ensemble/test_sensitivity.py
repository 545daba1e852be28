"""One assumption at a time: each case differs from the base, and only where it says so."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ins_eval.ensemble import Plan, World, fly, sensitivity
from ins_eval.ensemble.sensitivity import ARMS, BASE, CASES


def test_base_is_the_flight_of_the_flight_report(profile: Path) -> None:
    """The member of the base, bit by bit that of a flight plan with all compensations."""
    base = replace(sensitivity.plans(seed=3)[BASE][0], profile=str(profile))
    whole = fly(World(Plan(profile=str(profile), seed=3)), 1)
    for arm, values in fly(World(base), 1).items():
        for key, value in values.items() if arm in whole else ():
            assert value.tobytes() == whole[arm][key].tobytes()
    assert set(whole) & set(base.arms) == set(ARMS)


def test_plans_differ_from_the_base_in_one_field() -> None:
    plans = sensitivity.plans(seed=3, size=7)
    base, _ = plans[BASE]
    assert base == Plan(arms=ARMS, seed=3)
    for name, (plan, size) in plans.items():
        differing = [field for field, value in vars(plan).items() if value != getattr(base, field)]
        assert (len(differing), size) == (int(name != BASE), 7), name


def test_every_case_is_accepted_and_changes_the_world() -> None:
    def seen(plan: Plan) -> tuple:
        world = World(plan)
        return world.flight.profile, world.population, world.alignment, plan.oven_runs

    worlds = {name: seen(plan) for name, (plan, _) in sensitivity.plans().items()}
    for name, world in worlds.items():
        assert [other for other, same in worlds.items() if same == world] == [name]


def test_words_name_no_case_twice() -> None:
    assert len({case.words for case in CASES.values()}) == len(CASES)


@pytest.mark.parametrize("case", ["alignment/given", "path/bank", "oven runs/3", "gyro/0"])
def test_flight_of_a_case_has_the_same_accelerometer_draws(case: str, profile: Path) -> None:
    """What a case does not touch is drawn as in the base."""
    plans = sensitivity.plans()
    base, changed = (World(replace(plans[name][0], profile=str(profile))) for name in (BASE, case))
    for one, other in zip(base.instrument(2).accelerometers, changed.instrument(2).accelerometers, strict=True):
        np.testing.assert_equal(other.units, one.units)
    north = [fly(world, 2)["hysteresis_refined"]["velocity_rms_north"] for world in (base, changed)]
    assert north[0] != north[1]


def test_summary_of_known_members() -> None:
    """A case whose errors are all twice those of the base: exactly 2 in every resample, as they are paired."""
    rng = np.random.default_rng(5)

    def member(scale: float, worse: float) -> dict[str, dict[str, np.ndarray]]:
        keys = [f"velocity_rms_{axis}" for axis in sensitivity.AXES]
        return {arm: {k: np.asarray(scale * (worse if arm == "simple" else 1.0)) for k in keys} for arm in ARMS}

    sizes = rng.uniform(0.5, 2.0, 12)
    members = {BASE: [member(s, 1.5) for s in sizes], "path/box": [member(2.0 * s, 1.5) for s in sizes]}
    result = sensitivity.summary(members, seed=1)
    assert list(result) == [BASE, "path/box"]
    assert result["path/box"]["words"] == CASES["path/box"].words
    for arm in ARMS:
        against = result["path/box"]["against_base"][arm]
        assert [against["value"], *against["interval95"]] == pytest.approx([2.0, 2.0, 2.0], rel=1e-12)
        assert result[BASE]["against_base"][arm] == {"value": 1.0, "interval95": [1.0, 1.0]}
    assert result["path/box"]["ratio"]["value"] == pytest.approx(1.0 / 1.5)
    assert result[BASE]["simple"]["east"]["value"] == pytest.approx(1.5 * np.sqrt(np.mean(sizes**2)))
