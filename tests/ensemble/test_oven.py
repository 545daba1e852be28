"""The oven: what a still IMU makes of known errors, in closed form, and what the ten runs come to."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from ins_eval import ensemble, metrics
from ins_eval.accelerometer import AccelerometerEffect, Contribution
from ins_eval.earth import gravity, radii
from ins_eval.ensemble import Plan, World, oven
from ins_eval.gyro import GyroPopulation
from ins_eval.units import DEG_PER_H, UG

ARMS = ("simple", "hysteresis_refined")
HEADING, LATITUDE = np.radians([60.0, 34.65])
HEIGHT_M = 400.0
DURATION_S = 8400.0


class InTheOven(AccelerometerEffect):
    """A level bias that the chamber does not show, as a turn-on bias does not, but known.

    It points to the azimuth `towards_deg`; to `bias_ug` comes a drift from the start of the stand until `until_s`,
    which passes through 0 at time 0.
    """

    name: ClassVar[str] = "in_the_oven"
    towards_deg: float = 0.0
    bias_ug: float = 0.0
    drift_ug_per_min: float = 0.0
    until_s: float = DURATION_S
    share: float = 0.0  # of an axis

    def for_axes(self, rng):
        angle = np.radians(self.towards_deg) - HEADING
        return tuple(self.model_copy(update={"share": share}) for share in (np.cos(angle), np.sin(angle), 0.0))

    def contribution(self, unit, run, streams):
        if run.kind == "chamber":
            return Contribution()
        drift = self.drift_ug_per_min * np.minimum(run.time_s, self.until_s) / 60.0
        return Contribution(bias_ug=self.share * (self.bias_ug + drift))


@dataclass(frozen=True)
class Drifting(GyroPopulation):
    """Gyros whose only error is a constant rate towards north or east of an IMU at the flight's heading."""

    north: float = 0.0
    east: float = 0.0

    def increments(self, time_s, start_s, true_increments, streams, temperature_c=22.0):
        c, s = np.cos(HEADING), np.sin(HEADING)
        bias = np.array([self.north * c + self.east * s, self.east * c - self.north * s, 0.0])
        return true_increments + bias * np.diff(time_s, prepend=start_s)[:, None]


@pytest.fixture(scope="module", autouse=True)
def _two_runs():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(oven, "RUNS", 2)
        yield


def rms(
    accelerometer: AccelerometerEffect | None = None, gyros: GyroPopulation | None = None
) -> dict[str, dict[str, float]]:
    """Velocity RMS by group and axis of an instrument that errs in nothing else; the two runs are alike."""
    world = World(Plan(experiment="oven", arms=ARMS))
    clean = world.population.accelerometers.only()
    effects = (*clean.effects, accelerometer) if accelerometer else clean.effects
    world.population = replace(
        world.population, accelerometers=replace(clean, effects=effects), gyros=gyros or GyroPopulation().perfect()
    )
    return {group: {k[13:]: float(v[0]) for k, v in values.items()} for group, values in oven.member(world, 0).items()}


def schuler() -> tuple[np.ndarray, float]:
    """Phase of the Schuler oscillation over the flight, and its angular rate."""
    rate = np.sqrt(gravity(LATITUDE, HEIGHT_M) / (np.mean(radii(LATITUDE)) + HEIGHT_M))
    return rate * np.arange(0.0, DURATION_S + 1.0, oven.EPOCH_S), float(rate)


# ------------------------------------------------------------------------------------------------ closed forms


def test_without_sensor_errors_nothing_moves() -> None:
    """What is left is the baro's: v_down = 0.01 m/s drives east by 2 W cos L v_down / w = 1e-3 m/s at most."""
    for group, values in rms().items():
        assert values["horizontal"] < 1e-3, group


def test_level_accelerometer_bias_swings_where_the_attitude_is_given_and_vanishes_where_it_is_found() -> None:
    """dv = (b / w) sin(w t); 50 ug give 0.27 m/s. An alignment tilts the platform by b / g, which cancels it."""
    phase, rate = schuler()
    expected = 50.0 * UG / rate * metrics.root_mean_square(np.sin(phase))
    assert expected == pytest.approx(0.27, abs=0.005)
    found = rms(InTheOven(bias_ug=50.0, towards_deg=60.0))
    assert found["simple/given"]["horizontal"] == pytest.approx(expected, rel=0.02)
    assert found["simple/aligned"]["horizontal"] < 0.05 * expected
    # the refinement learns it where it keeps its constant, and only there
    assert found["hysteresis_refined/given"]["horizontal"] < 0.01 * expected
    assert found["free_1/given"]["horizontal"] == pytest.approx(expected, rel=0.02)


def test_drift_on_the_stand_is_taken_for_a_heading() -> None:
    """A bias to the north that grows by b' feels like a turn by b'/g about east, which is how a heading error feels.

    The heading found is wrong by b' / (g W cos L). While the drift goes on it cancels that, as it did on the stand,
    but for the 35 degrees by which the Earth turns meanwhile; once it ends the heading error alone is left:
    dv = b' (1 - cos w t) / w^2, as much as the drift itself would make where the attitude is given.
    """
    phase, rate = schuler()
    drift = 2.0  # ug/min
    expected = drift * UG / 60.0 / rate**2 * metrics.root_mean_square(1.0 - np.cos(phase))
    lasting = rms(InTheOven(drift_ug_per_min=drift))
    assert lasting["simple/given"]["horizontal"] == pytest.approx(expected, rel=0.05)
    assert lasting["simple/aligned"]["horizontal"] < 0.2 * expected
    ending = rms(InTheOven(drift_ug_per_min=drift, until_s=0.0))
    assert ending["simple/given"]["horizontal"] < 0.01 * expected
    assert ending["simple/aligned"]["horizontal"] == pytest.approx(expected, rel=0.1)


def test_north_gyro_counts_in_both_cases_and_east_gyro_hides_behind_the_heading() -> None:
    """dv = e R (1 - cos w t); 0.01 deg/h give 0.40 m/s. An alignment takes an east gyro for a heading."""
    phase, _ = schuler()
    drift = 0.01 * DEG_PER_H
    expected = drift * (np.mean(radii(LATITUDE)) + HEIGHT_M) * metrics.root_mean_square(1.0 - np.cos(phase))
    assert expected == pytest.approx(0.40, abs=0.005)
    north = rms(gyros=Drifting(north=drift))
    assert north["simple/given"]["horizontal"] == pytest.approx(expected, rel=0.05)
    assert north["simple/given"]["east"] == pytest.approx(0.39, abs=0.005)  # the rest swings round with the Earth
    assert north["simple/aligned"]["horizontal"] == pytest.approx(expected, rel=0.05)
    east = rms(gyros=Drifting(east=drift))
    assert east["simple/given"]["horizontal"] == pytest.approx(expected, rel=0.05)
    assert east["simple/aligned"]["horizontal"] < 0.01 * expected


# ------------------------------------------------------------------------------------------------ members


@pytest.fixture
def plan(profile: Path) -> Plan:
    return Plan(profile=str(profile), experiment="oven", arms=(*ARMS, "hysteresis"))


def test_member_has_every_arm_in_both_cases_and_each_run(plan: Plan) -> None:
    member = oven.member(World(plan), 0)
    refined = [f"refined_{n}" for n in range(1, 6)]
    both = {f"{arm}/{case}" for arm in [*plan.arms, *refined] for case in ("aligned", "given")}
    assert set(member) == both | {f"free_{n}/given" for n in range(1, 6)}
    for values in member.values():
        assert {k: v.shape for k, v in values.items()} == {f"velocity_rms_{a}": (2,) for a in oven.AXES}
        np.testing.assert_allclose(
            values["velocity_rms_horizontal"], np.hypot(values["velocity_rms_north"], values["velocity_rms_east"])
        )
        assert values["velocity_rms_east"][0] != values["velocity_rms_east"][1]


def test_refinement_with_the_runs_of_the_plan_is_the_arm_of_the_plan(plan: Plan) -> None:
    member = oven.member(World(replace(plan, oven_runs=3)), 1)
    for case in ("aligned", "given"):
        for key, value in member[f"hysteresis_refined/{case}"].items():
            np.testing.assert_array_equal(member[f"refined_3/{case}"][key], value)
            assert not np.array_equal(member[f"refined_2/{case}"][key], value)


def test_runs_of_the_test_are_none_of_those_of_the_refinement(plan: Plan) -> None:
    world = World(plan)
    tested = [oven._recorded(world, 0, run)[1][0].output for run in range(5)]
    refined = [samples.output for samples, _ in world.oven_runs(0, 5)[0]]
    assert len({output.tobytes() for output in [*tested, *refined]}) == 10


def test_errors_over_time_are_those_of_the_member(plan: Plan) -> None:
    world = World(plan)
    member = oven.member(world, 1)
    for case in ("aligned", "given"):
        errors = oven.errors_of_run(world, 1, 1, case)
        assert set(errors) == set(plan.arms)
        for arm, found in errors.items():
            east = metrics.root_mean_square(found.velocity_n[:, 1])
            assert east == pytest.approx(member[f"{arm}/{case}"]["velocity_rms_east"][1], rel=1e-12)
            np.testing.assert_allclose(found.time_s, np.arange(0.0, 301.0, oven.EPOCH_S))


def test_members_depend_on_neither_workers_nor_order(plan: Plan, tmp_path: Path) -> None:
    alone = ensemble.run({"oven": (plan, 2)}, tmp_path / "one", workers=1, quiet=True)["oven"]
    # a spawned worker has all ten runs, so only the two of this process are compared
    with_flight = {"flight": (replace(plan, experiment="flight"), 1), "oven": (plan, 2)}
    both = ensemble.run(with_flight, tmp_path / "two", workers=2, quiet=True)["oven"]
    for one, other in zip(alone, both, strict=True):
        assert set(one) == set(other)
        for group, values in one.items():
            for key, value in values.items():
                assert value.tobytes() == other[group][key][:2].tobytes()


# ------------------------------------------------------------------------------------------------ summary


@pytest.fixture
def made_up() -> list[dict[str, dict[str, np.ndarray]]]:
    """Four instruments of two runs: hysteresis_refined has 0.9 and (0.6, 0.7, 0.8, 0.5) of simple's errors."""

    def group(scale) -> dict[str, np.ndarray]:
        east, north = 3.0 * np.multiply(scale, 1.0), 4.0 * np.multiply(scale, 1.0)
        columns = (east, north, np.hypot(east, north))
        return {f"velocity_rms_{a}": v for a, v in zip(oven.AXES, columns, strict=True)}

    members = []
    for best in (0.6, 0.7, 0.8, 0.5):
        refined = {f"{name}_{n}/{case}": group((1.0, 1.0 / n)) for name, case in
                   (("refined", "given"), ("refined", "aligned"), ("free", "given")) for n in range(1, 6)}  # fmt: skip
        arms = {f"simple/{c}": group((1.0, 1.0)) for c in oven.CASES}
        arms |= {f"hysteresis_refined/{c}": group((0.9, best)) for c in oven.CASES}
        members.append({**arms, **refined})
    return members


def test_summary_of_known_members(made_up) -> None:
    result = oven.summary(made_up, seed=1)
    assert (result["size"], result["runs"]) == (4, 2)
    assert result["given"]["simple"]["east"] == {"value": 3.0, "interval95": [3.0, 3.0]}
    expected = np.sqrt(np.mean([0.9**2 * 4, 0.6**2 + 0.7**2 + 0.8**2 + 0.5**2]) / 4)
    assert result["gain"]["given"]["north"]["value"] == pytest.approx(expected, rel=1e-12)
    low, high = result["gain"]["given"]["north"]["interval95"]
    assert low < expected < high
    assert result["best_of_ten"]["aligned"]["horizontal"]["value"] == pytest.approx(35.0)  # of 40, 30, 20, 50
    assert result["median_of_ten"]["aligned"]["horizontal"]["value"] == pytest.approx(22.5)  # of 25, 20, 15, 30
    assert result["runs_improved"] == {"aligned": 1.0, "given": 1.0}
    assert result["shown"]["best"] == 1
    assert [run["hysteresis_refined"]["east"] for run in result["shown"]["runs"]] == pytest.approx([2.7, 1.8])
    assert [run["simple"]["horizontal"] for run in result["shown"]["runs"]] == [5.0, 5.0]
    assert list(result["refinement"]) == ["1", "2", "3", "4", "5"]
    assert result["refinement"]["2"]["value"] == pytest.approx(5.0 * np.sqrt((1 + 0.25) / 2))
    assert set(result["refinement_cases"]["aligned"]) == {"refined"}


def test_best_run_is_the_one_with_the_largest_gain_level_whatever_its_axes(made_up) -> None:
    for member in made_up:  # the first run loses to the east and gains more to the north
        member["hysteresis_refined/given"] = {
            "velocity_rms_east": np.array([3.3, 1.5]),
            "velocity_rms_north": np.array([0.4, 3.6]),
            "velocity_rms_horizontal": np.hypot([3.3, 1.5], [0.4, 3.6]),
        }
    best = oven.summary(made_up, seed=1)["best_of_ten"]["given"]
    assert best["east"]["value"] == pytest.approx(-10.0)
    assert best["north"]["value"] == pytest.approx(90.0)
    assert best["horizontal"]["value"] == pytest.approx(100.0 * (1.0 - np.hypot(3.3, 0.4) / 5.0))
