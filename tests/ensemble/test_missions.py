"""Missions in the ensemble: the same instruments, calibration and oven; with every source off, the flight of all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ins_eval import gate
from ins_eval.ensemble import MISSION, Plan, World, fly
from ins_eval.ensemble.attribution import CORNERS, attribution
from ins_eval.ensemble.conditions import VELOCITY, by_condition, conditions
from ins_eval.metrics import median, root_mean_square
from ins_eval.missions import SOURCES
from ins_eval.streams import Streams

FEW = ("simple", "hysteresis_refined")


@pytest.fixture
def plan(profile: Path) -> Plan:
    return Plan(profile=str(profile), arms=FEW)


def same(one: dict, other: dict) -> bool:
    return all(np.array_equal(one[arm][key], other[arm][key]) for arm in FEW for key in one[arm])


def test_with_every_source_off_a_mission_is_the_flight_of_all(plan: Plan) -> None:
    off = fly(World(replace(plan, missions="worldwide", missions_off=SOURCES)), 1)
    assert same(fly(World(plan), 1), off)
    assert off[MISSION]["warmer_c"] == 0.0


def test_a_mission_changes_neither_calibration_nor_oven(plan: Plan) -> None:
    """Chamber readings and refinement are those of the flight of all; only what is flown differs."""
    off = ("gyro", "gradient")  # these are of the instrument and act in the oven, too
    common, own = World(plan), World(replace(plan, missions="worldwide", missions_off=off))
    for one, other in zip(common.triads(2)["simple"], own.triads(2)["simple"], strict=True):
        assert np.array_equal(one.scale_.values, other.scale_.values)
        assert np.array_equal(one.bias_ug_.values, other.bias_ug_.values)
    residuals = [world.triads(2)["hysteresis_refined"][0].residual_.values for world in (common, own)]
    assert np.array_equal(*residuals)
    assert not same(fly(common, 2), fly(own, 2))


def test_the_own_heat_is_that_of_the_flight(plan: Plan) -> None:
    world = World(replace(plan, profile="climb-cruise-landing", missions="worldwide"))
    heats = {world.mission(k).temperature.self_heating_c for k in range(3)}
    assert heats == {world.flight.temperature.self_heating_c}


def test_the_oven_may_keep_to_another_profile(plan: Plan) -> None:
    nominal = World(replace(plan, profile="climb-cruise-landing"))
    warmer = World(replace(plan, profile="warmer", oven="climb-cruise-landing"))
    assert np.array_equal(nominal.oven.temperature.temperature_c, warmer.oven.temperature.temperature_c)
    difference = warmer.flight.temperature.temperature_c - nominal.flight.temperature.temperature_c
    assert difference[0] == pytest.approx(6.0)
    at = int(np.searchsorted(warmer.flight.temperature.time_s, 7200.0))
    assert difference[at] == pytest.approx(5.0)


# ------------------------------------------------------------------------------------------------ attribution


def corners(model: float, refinement: float, both: float, size: int = 30) -> dict:
    """Errors of which each part alone leaves so much, and both together; the same for every instrument."""
    scale = np.random.default_rng(1).uniform(0.5, 2.0, size)
    factors = dict(zip(CORNERS, (1.0, model, refinement, both), strict=True))
    return {arm: {VELOCITY: factor * scale} for arm, factor in factors.items()}


def test_shapley_shares_are_the_mean_of_both_orders_and_multiply_to_the_whole() -> None:
    """Closed form: sqrt(m b / r) and sqrt(r b / m)."""
    m, r, b = 0.8, 0.7, 0.65
    found = attribution(corners(m, r, b), {VELOCITY: root_mean_square}, np.random.default_rng(2))[VELOCITY]
    assert found["model_first"]["model"]["ratio"] == pytest.approx(m)
    assert found["model_first"]["refinement"]["ratio"] == pytest.approx(b / m)
    assert found["refinement_first"]["refinement"]["ratio"] == pytest.approx(r)
    assert found["refinement_first"]["model"]["ratio"] == pytest.approx(b / r)
    assert found["shapley"]["model"]["ratio"] == pytest.approx(np.sqrt(m * b / r))
    assert found["shapley"]["refinement"]["ratio"] == pytest.approx(np.sqrt(r * b / m))
    product = found["shapley"]["model"]["ratio"] * found["shapley"]["refinement"]["ratio"]
    assert product == pytest.approx(found["together"]["ratio"]) == pytest.approx(b)


def test_a_part_that_does_nothing_has_a_share_of_exactly_one() -> None:
    found = attribution(corners(1.0, 0.7, 0.7), {VELOCITY: median}, np.random.default_rng(2))[VELOCITY]
    assert found["shapley"]["model"] == {"ratio": 1.0, "interval95": [1.0, 1.0]}


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    """Errors of pairs with a known ratio, over and over: 95 % of the intervals hold it."""
    rng, held, trials = np.random.default_rng(3), 0, 120
    for _ in range(trials):
        noise = np.exp(0.3 * rng.standard_normal((4, 60)))
        arms = {arm: {VELOCITY: f * n} for arm, f, n in zip(CORNERS, (1.0, 0.8, 0.9, 0.7), noise, strict=True)}
        low, high = attribution(arms, {VELOCITY: root_mean_square}, rng)[VELOCITY]["together"]["interval95"]
        held += low <= 0.7 <= high
    assert 0.87 < held / trials <= 1.0


# ------------------------------------------------------------------------------------------------ conditions


def test_conditions_of_a_mission(plan: Plan) -> None:
    """From the profile and from its temperatures, written out again."""
    world = World(replace(plan, missions="worldwide"))
    mission = world.mission(4)
    found, start = conditions(mission, world.oven), mission.profile.start
    later = mission.temperature.time_s >= 0.0
    temperature_c = mission.temperature.temperature_c[later]
    oven_c = world.oven.temperature.temperature_c[world.oven.temperature.time_s >= 0.0]
    assert found["warmer_c"] == pytest.approx(np.mean(temperature_c) - np.mean(oven_c))
    assert found["span_c"] == pytest.approx(temperature_c.max() - temperature_c.min())
    assert found["along_meridian"] == pytest.approx(0.5 + 0.5 * np.cos(2.0 * np.deg2rad(start.heading_deg)))
    assert found["since_on_h"] == mission.profile.thermal.before[-1].hours
    assert found["stand_min"] == start.stand_s / 60.0


def made_up(size: int) -> tuple[dict, dict]:
    """Missions on which a compensation halves the error, or doubles it where it is warmer than in the oven."""
    rng = np.random.default_rng(5)
    flown = {
        "warmer_c": rng.uniform(-30.0, 30.0, size),
        "span_c": rng.uniform(0.0, 40.0, size),
        "turns": rng.integers(2, 12, size).astype(float),
        "along_meridian": rng.uniform(0.0, 1.0, size),
        "since_on_h": rng.uniform(0.5, 24.0, size),
    }
    old = rng.uniform(1.0, 2.0, size)
    return flown, {"old": {VELOCITY: old}, "new": {VELOCITY: old * np.where(flown["warmer_c"] < 10.0, 0.5, 2.0)}}


def test_groups_tell_where_it_helps_and_where_it_hurts() -> None:
    flown, arms = made_up(200)
    groups = by_condition(arms, flown, ("new", "old"), Streams(1))["groups"]["warmer_c"]
    assert [g["ratio"] for g in groups] == pytest.approx([0.5, 0.5, 2.0])
    assert [g["improved"]["value"] for g in groups] == [1.0, 1.0, 0.0]
    assert sum(g["count"] for g in groups) == 200
    few = by_condition({a: {VELOCITY: v[VELOCITY][:6]} for a, v in arms.items()}, {k: v[:6] for k, v in flown.items()},
                       ("new", "old"), Streams(1))  # fmt: skip
    assert all("ratio" not in g for g in few["groups"]["warmer_c"] if g["count"] < 5)


def test_a_mission_that_was_never_on_before_has_a_group() -> None:
    flown, arms = made_up(20)
    flown["since_on_h"][:] = np.inf
    groups = by_condition(arms, flown, ("new", "old"), Streams(1))["groups"]["since_on_h"]
    assert [g["count"] for g in groups] == [0, 20]


def test_slopes_are_found_back() -> None:
    """ln ratio = 0.1 |warmer| / 10 - 0.05 span / 10 + 0.2 turns / 5, and noise."""
    flown, arms = made_up(400)
    rng = np.random.default_rng(6)
    log_ratio = 0.1 * np.abs(flown["warmer_c"]) / 10.0 - 0.05 * flown["span_c"] / 10.0 + 0.2 * flown["turns"] / 5.0
    arms["new"] = {VELOCITY: arms["old"][VELOCITY] * np.exp(log_ratio + 0.1 * rng.standard_normal(400))}
    slopes = by_condition(arms, flown, ("new", "old"), Streams(1))["slopes"]
    for name, expected in {"away_c": 0.1, "span_c": -0.05, "turns": 0.2, "along_meridian": 0.0}.items():
        low, high = slopes[name]["interval95"]
        assert slopes[name]["ratio"] == pytest.approx(np.exp(expected), abs=0.05)
        assert low < high < low + 0.2


def test_the_gate_compares_arms_and_not_what_missions_were_like(profile: Path, tmp_path: Path) -> None:
    """Real members, unlike those that the tests of the gate make up."""
    flown = gate.fly(tmp_path, str(profile), 1, gate.Sizes(paper=3, missions=3), workers=1, quiet=True)
    seen = gate.compare(flown, 1)
    assert set(seen["missions"]) == {*gate.ARMS, *gate.PAIRS["missions"]}
    assert set(seen["paper"]) == {*gate.ARMS, gate.MIRRORED, *gate.PAIRS["paper"]}
    assert seen["paper"][gate.ITSELF]["cep_rate_final"] == (1.0, 1.0, 1.0)
