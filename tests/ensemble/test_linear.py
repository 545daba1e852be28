"""Thousands of instruments at once: each is the one that is flown in full, and its errors are those of first order."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ins_eval import ensemble, gps
from ins_eval.accelerometer import Population, ThermalRun, draw
from ins_eval.analysis import ageing, both_ways
from ins_eval.analysis import flight as analysis
from ins_eval.analysis import fly as study
from ins_eval.ensemble import MISSION, Plan, World, fly
from ins_eval.ensemble.linear import agreement, fly_linearly, joined, member, unfit
from ins_eval.ensemble.linear.course import Course, epochs_of
from ins_eval.ensemble.linear.instruments import Instruments
from ins_eval.gyro import GyroPopulation
from ins_eval.imu import Mission
from ins_eval.interface.fly import fly as fly_instruments
from ins_eval.laboratory import Chamber
from ins_eval.many_streams import ManyStreams
from ins_eval.profile import load
from ins_eval.reference import Errors, bridge, outages
from ins_eval.streams import Streams

NODES = [Streams(4).at("instrument", index) for index in range(3)]
MANY = ManyStreams.of(NODES)
ARMS = ("simple", "hysteresis", "simple_refined", "hysteresis_refined")
EACH, RATIO = 0.01, 0.002  # largest difference of an instrument, and of a ratio of two compensations
SAME = 1e-9


@pytest.fixture
def aligned(profile: Path) -> Path:
    """The flight of five minutes after ten on the stand; after two the heading is off by a degree, no small error."""
    profile.write_text(profile.read_text().replace("stand_s = 120.0", "stand_s = 600.0"))
    return profile


@pytest.fixture(scope="module")
def population() -> Population:
    """Every effect in it, the terms that the paper neglects too, but for whole pulses."""
    known = Population.load()
    terms = {"k3_sigma_ug_per_g3": 5.0, "kip_sigma_ug_per_g2": 20.0, "delta_p_sigma_urad": 40.0}
    gains = known["loop_gain"].model_copy(update={"scale_ppm": (5.0, -70.0, 30.0)})
    crossed = known["nonlinearity"].model_copy(update=terms)
    return known.replacing(gains, crossed).without("quantisation")


def test_many_accelerometers_are_those_drawn_one_by_one(population: Population) -> None:
    time_s = np.arange(0.0, 600.0)
    before = ThermalRun(np.array([-900.0, -60.0]), np.array([30.0, 12.0]), "flight")
    run = ThermalRun(time_s, 20.0 - 0.03 * time_s + 2.0 * np.sin(time_s / 50.0), "flight", before=before)
    force_g = np.column_stack([np.sin(time_s / 9.0), 0.2 * np.cos(time_s), -1.0 + 0.1 * np.sin(time_s)])
    interval_s = np.ones(time_s.size)
    for axis, many in enumerate(draw(population, MANY.at("accelerometers"))):
        found = many.slow(run, MANY.at("flight"))
        counts = many.counts(interval_s, force_g, found, MANY.at("flight"))
        for k, node in enumerate(NODES):
            one = population.draw(node.at("accelerometers"))[axis]
            slow = one.slow(run, node.at("flight"))
            assert found.scale[:, k] == pytest.approx(slow.scale, rel=SAME)
            assert found.bias_ug[:, k] == pytest.approx(slow.bias_ug, rel=SAME, abs=SAME)
            assert counts[:, k] == pytest.approx(one.counts(interval_s, force_g, slow, node.at("flight")), rel=SAME)


@pytest.mark.parametrize("draws", [1, 10])
def test_noise_of_a_step_is_as_large_however_it_is_drawn(draws: int) -> None:
    """The mean over a second of noise of the density N has the standard deviation N."""
    known = Population.load()
    many = draw(known.only("noise"), MANY.at("accelerometers"))[0]
    still = ThermalRun(np.arange(4e4), np.full(40_000, 22.0), "flight")
    slow = many.slow(still, MANY.at("flight"))
    counts = many.counts(np.ones(40_000), np.zeros(3), slow, MANY.at("flight"), draws)
    assert 1e6 * (counts / many.gamma).std() == pytest.approx(known["noise"].density_ug_per_sqrt_hz, rel=0.01)
    triads = GyroPopulation().perfect()
    walk = replace(triads, angle_random_walk_deg_per_sqrt_h=0.06)  # 0.06 deg/sqrt(h): 1e-3 deg/s over a second
    found = walk.rate_errors(1.0, draws, np.zeros((40_000, 3)), np.zeros((40_000, 3)), MANY, np.full(40_000, 22.0))
    assert np.rad2deg(found.std()) == pytest.approx(1e-3, rel=0.01)


def test_later_blocks_draw_their_noise_once_a_step(profile: Path) -> None:
    world = World(Plan(str(profile), arms=("simple",), experiment="linear"))
    course = Course(world.flight)
    assert Instruments(world, range(80)).draws(course) == 10
    assert Instruments(world, range(240, 320)).draws(course) == 1


def test_an_effect_that_is_not_known_is_refused(population: Population) -> None:
    class Other(type(population["noise"]).__base__):  # an effect like any other
        name = "other"

    with pytest.raises(ValueError, match="'other' is made for one accelerometer"):
        draw(replace(population, effects=(*population.effects, Other())), MANY)


def test_many_triads_of_gyros_are_those_drawn_one_by_one() -> None:
    gyros = GyroPopulation(thermal_deg_per_h_per_c=0.01)
    rng = np.random.default_rng(2)
    rate_b, temperature_c = 1e-3 * rng.normal(size=(400, 3)), 20.0 + rng.normal(size=400)
    found = gyros.rate_errors(1.0, 1, rate_b, np.abs(rate_b), MANY, temperature_c)
    time_s = np.arange(1.0, 401.0)
    for k, node in enumerate(NODES):
        error = gyros.increments(time_s, 0.0, rate_b, node, temperature_c) - rate_b
        assert pytest.approx(error, rel=1e-6, abs=1e-15) == found[:, :, k].T  # a small part of what was subtracted


def test_many_receivers_are_those_drawn_one_by_one(profile: Path) -> None:
    flown = load(profile)
    receiver = flown.gps.model_copy(update={"position_memory_m": 2.0, "velocity_memory_mps": 0.01})
    mission = Mission(flown.model_copy(update={"gps": receiver}), 10.0)
    fixes = gps.receive(mission.trajectory, NODES[1])
    truth = mission.trajectory.truth(fixes.time_s)
    position, velocity = gps.errors_of(receiver, fixes.time_s, MANY)
    seen = fixes.valid
    assert (fixes.velocity_n - truth.velocity_n)[seen] == pytest.approx(velocity[seen, :, 1], abs=1e-12)
    assert (truth.height_m - fixes.height_m)[seen] == pytest.approx(position[seen, 2, 1], abs=1e-9)


@pytest.mark.parametrize("name", ["none", "simple", "simple_anchored", "quadratic", "hysteresis", "hysteresis_blind"])
def test_many_units_are_calibrated_as_one_by_one(name: str, population: Population) -> None:
    from ins_eval.compensation import Samples
    from ins_eval.compensation.refined import Refined
    from ins_eval.compensation.registry import load_model

    chamber = Chamber(rates_c_per_min=(0.5, 0.9), soak_s=0.0, dwell_s=0.0)
    rng = np.random.default_rng(3)
    temperature_c, rate = np.linspace(-20.0, 40.0, 900), np.linspace(-0.5, 0.5, 900)
    output = 3.2e5 * (1.0 + 1e-5 * rng.normal(size=(900, 3)))
    many = draw(population, MANY.at("accelerometers"))[0]
    seen = Samples(np.arange(900.0), output, temperature_c, rate)
    model = Refined(load_model(name).fit(chamber.measure(many, MANY))).refine([(seen, 9.8)])
    found = model.specific_force(seen)
    for k, node in enumerate(NODES):
        alone = population.draw(node.at("accelerometers"))[0]
        own = replace(seen, output=output[:, k])
        one = Refined(load_model(name).fit(chamber.measure(alone, node))).refine([(own, 9.8)])
        assert found[:, k] == pytest.approx(one.specific_force(own), rel=SAME)


def test_a_flight_is_that_in_full(aligned: Path) -> None:
    world = World(Plan(str(aligned), arms=ARMS))
    linear = fly_linearly(world, range(3))
    full = ensemble.stacked([fly(world, index) for index in range(3)])
    for arm in ARMS:
        assert set(linear[arm]) == set(full[arm])
        assert linear[arm]["track_s"] == pytest.approx(full[arm]["track_s"])
        for key in set(full[arm]) - {"track_s", "track_m"}:
            near = EACH * np.abs(full[arm][key]).max()
            assert linear[arm][key] == pytest.approx(full[arm][key], rel=EACH, abs=near), (arm, key)
    assert agreement(linear, full).worst < EACH


def test_missions_of_their_own_are_those_in_full() -> None:
    plan = Plan(arms=ARMS, missions="worldwide")
    linear, full = (World(replace(plan, experiment=way)) for way in ("linear", "flight"))
    found = joined([member(linear, index) for index in range(2)])
    expected = ensemble.stacked([fly(full, index) for index in range(2)])
    assert {key: list(value) for key, value in found.pop(MISSION).items()} == {
        key: list(value) for key, value in expected.pop(MISSION).items()
    }
    assert found["simple"]["track_s"] == pytest.approx(expected["simple"]["track_s"])
    assert agreement(found, expected).worst < EACH


def test_with_the_attitude_given(profile: Path) -> None:
    world = World(Plan(str(profile), arms=("simple",), changes=(("alignment", "given"),)))
    linear, full = fly_linearly(world, [5])["simple"], fly(world, 5)["simple"]
    assert linear["radial_rms_m"][0] == pytest.approx(float(full["radial_rms_m"]), rel=EACH)


def test_tracks_are_bridged_over_outages(profile: Path) -> None:
    """The weights of an epoch without a fix are those of `reference.bridge`."""
    flown = load(profile)
    turn = flown.turn[0].model_copy(update={"at_s": 172.0})
    mission = Mission(flown.model_copy(update={"turn": (turn,)}), 10.0)
    epochs = epochs_of(mission, 300.0)
    assert not epochs.valid[180]
    rng = np.random.default_rng(4)
    errors = rng.normal(size=epochs.time_s.size)
    fixes = gps.receive(mission.trajectory, Streams(1))
    silent = np.where(epochs.valid, errors, np.nan)
    bridged = bridge(
        Errors(
            epochs.time_s, silent, silent, silent, np.column_stack([silent] * 3), epochs.valid, tuple(outages(fixes))
        )
    )
    found = np.zeros(epochs.track_s.size)
    for e in range(epochs.time_s.size):
        for entry in range(epochs.begin[e], epochs.begin[e + 1]):
            found[epochs.track[entry]] += epochs.weight[entry] * errors[e]
    assert found == pytest.approx(bridged.north_m[np.searchsorted(epochs.time_s, epochs.track_s)])


def test_a_block_is_the_same_whatever_was_flown_before(profile: Path) -> None:
    plan = Plan(str(profile), arms=("simple",), experiment="linear")
    first = fly_linearly(World(plan), range(4, 8))["simple"]
    world = World(plan)
    fly_linearly(world, range(4))
    again = fly_linearly(world, range(4, 8))["simple"]
    assert all(np.array_equal(first[key], again[key]) for key in first)


def test_blocks_are_joined_in_order() -> None:
    blocks = [{"a": {"x": np.arange(3.0)}}, {"a": {"x": np.arange(3.0, 6.0)}}]
    assert joined(blocks, 5)["a"]["x"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_what_cannot_be_flown_linearly_is_said(profile: Path, tmp_path: Path) -> None:
    assert unfit(Plan(str(profile))) is None
    assert unfit(Plan(str(profile), arms=("simple", "my.py:MyModel"), missions="worldwide")) is None
    assert "not built in" in str(unfit(Plan(str(profile), arms=("simple", "my.py:MyModel"))))
    assert "temperatures of their own" in str(unfit(Plan(str(profile), changes=(("gradient", 0.02),))))
    odd = tmp_path / "odd.toml"
    odd.write_text(profile.read_text().replace("stand_s = 120.0", "stand_s = 120.5"))
    assert "120.5 is not in whole seconds" in str(unfit(Plan(str(odd))))


@pytest.mark.parametrize(("apart", "taken"), [(0.009, True), (0.011, False)])
def test_all_are_flown_in_full_where_one_differs(apart: float, taken: bool, profile: Path) -> None:
    asked: list[dict[str, int]] = []

    def run(plans):
        asked.append({label: size for label, (_, size) in plans.items()})
        errors = np.full(300, 2.0)
        full = {"velocity_rms_horizontal": errors, "radial_rms_m": errors}
        linear = {**full, "radial_rms_m": errors * np.where(np.arange(300) == 7, 1.0 + apart, 1.0)}
        one_by_one = [{"simple": {key: values[k] for key, values in full.items()}} for k in range(40)]
        return {"all": one_by_one, "all/linear": [{"simple": linear}]}

    found = study.fly(Plan(str(profile)), 300, run, ageing_years=0.0, missions_flown=0)
    assert found.agreed["all"].worst == pytest.approx(apart)
    assert asked[0]["all"] == 40 and asked[0]["all/linear"] == 300
    assert ("all/linear" in found.plans) == taken and len(asked) == (1 if taken else 2)
    assert found.plans["all"][1] == asked[-1]["all"] == (40 if taken else 300)
    assert found.size == 300


@pytest.mark.slow
def test_a_large_ensemble_is_flown_linearly_and_in_full_where_that_differs(
    aligned: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    few = both_ways.Linearly(in_full=2, checked=2)
    monkeypatch.setattr(both_ways, "LINEARLY", {"all": few, "missions": few})
    monkeypatch.setattr(analysis, "BUDGET_SIZE", 2)
    monkeypatch.setattr(analysis, "BESIDE_SIZE", 2)
    monkeypatch.setattr(ageing, "SIZE", 2)

    def flown() -> study.FlightStudy:
        return fly_instruments(str(aligned), 4, missions=4, members=tmp_path, workers=1, quiet=True).found

    found = flown()
    ensembles = [found.tree["ensemble"], found.tree["missions"]["ensemble"]]
    for of in ensembles:
        assert of["linear"]["taken"] and of["linear"]["size"] == 2 and 0.0 < of["linear"]["worst"] < EACH
        assert of["size"] == 4 and "none" not in of
    assert found.size == 4 and "none" not in found.arms
    monkeypatch.setattr(both_ways, "AGREED", 0.5 * min(of["linear"]["worst"] for of in ensembles))
    instead = flown()
    for of in (instead.tree["ensemble"], instead.tree["missions"]["ensemble"]):
        assert not of["linear"]["taken"] and "none" in of
    assert len(instead.arms["none"]["radial_rms_m"]) == 4


@pytest.mark.slow
def test_two_hundred_instruments_on_the_flight_of_the_paper(tmp_path: Path) -> None:
    plan, size = Plan(arms=ARMS), 200
    plans = {"full": (plan, size), "linear": (replace(plan, experiment="linear"), size)}
    members = ensemble.run(plans, tmp_path, quiet=True)
    found = agreement(joined(members["linear"], size), ensemble.stacked(members["full"]))
    assert found.worst < EACH
    assert found.of_ratio < RATIO
