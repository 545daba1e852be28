"""Storage in the flight report: pairs, what they come to, and that nothing else of the report knows of it."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from ins_eval import ensemble
from ins_eval.analysis import ageing
from ins_eval.analysis.ageing import AGED, COMPENSATIONS, STATES
from ins_eval.analysis.fly import fly
from ins_eval.commands import flight_report
from ins_eval.ensemble import Plan, World
from ins_eval.ensemble.ageing import aged
from ins_eval.errors import UsageError
from ins_eval.interface.fly import of_flights
from ins_eval.report.json_file import as_json
from tests.ensemble.conftest import PROFILE

EXACT = 1e-12  # relative


@pytest.fixture(scope="module")
def storage(small_report: Path) -> dict:
    return json.loads((small_report / "metrics.json").read_text())["storage"]


@pytest.fixture(scope="module")
def members(small_report: Path) -> dict[str, list]:
    """By state, read where the report has left them."""
    plan = Plan()
    plans = {"all": (plan, 4), **ageing.plans(plan, 4, aged(1.0, 1))}
    found = ensemble.run(plans, small_report / "members", workers=1, quiet=True)
    return dict(zip(STATES, found.values(), strict=True))


def test_each_state_is_what_its_members_come_to(storage: dict, members: dict[str, list]) -> None:
    for name in COMPENSATIONS:
        for state in STATES:
            flown = ensemble.stacked([{name: m[name]} for m in members[state]])[name]
            seen = storage["compensations"][name][state]
            rms = np.sqrt(np.mean(flown["velocity_rms_horizontal"] ** 2))
            assert seen["velocity_rms_horizontal"]["value"] == pytest.approx(rms, rel=EXACT)
            assert seen["cep_rate_final"]["value"] == pytest.approx(np.median(flown["cep_rate_final"]), rel=EXACT)


def test_ratios_are_paired_and_intervals_hold_them(storage: dict) -> None:
    for name, steps in storage["change"].items():
        values = {s: storage["compensations"][name][s]["velocity_rms_horizontal"]["value"] for s in STATES}
        for step, ratios in steps.items():
            new, old = step.split("/")
            found = ratios["velocity_rms_horizontal"]
            assert found["ratio"] == pytest.approx(values[new] / values[old], rel=EXACT)
            low, high = found["interval95"]
            assert low <= found["ratio"] <= high
            assert high - low < 0.2  # unpaired, four instruments would leave more than a half


def test_self_calibration_brings_the_flight_back_to_fresh(storage: dict) -> None:
    assert storage["scale_ppm"]["self_calibrated"] < 0.5 * storage["scale_ppm"]["drifted"]
    for name in COMPENSATIONS:
        assert 0.0 < storage["final_m"][name]["self_calibrated"] < storage["final_m"][name]["drifted"]
    found = storage["alone"]["whole_mps"]["found"]
    assert 0.0 < found["self_calibrated"] < found["drifted"]


def test_drift_is_far_below_the_other_errors_and_shows_in_manoeuvres(storage: dict) -> None:
    drift = storage["alone"]["whole_mps"]["found"]["drifted"]
    for name in COMPENSATIONS:
        assert drift < 0.1 * storage["compensations"][name]["fresh"]["velocity_rms_horizontal"]["value"]
    manoeuvres = {m["name"]: m for m in storage["alone"]["manoeuvres"]}
    turn = manoeuvres["turn right by 90 degrees"]
    assert turn["axes_mps"][2] == pytest.approx(1e-4 * 210.0 * np.sqrt(2.0), rel=0.02)  # change of velocity
    assert manoeuvres["speeding up to 85 m/s"]["axes_mps"][0] == pytest.approx(1e-4 * 85.0, rel=0.01)
    assert [m["name"] for m in storage["alone"]["manoeuvres"][:2]] == ["descent to 400 m", "climb to 10000 m"]


def test_vertical_channel_feels_gravity_scaled(storage: dict) -> None:
    """h'' = a + 2 g h / R from rest: sixty steps a second for ten minutes, R of the mean sphere."""
    vertical = storage["alone"]["vertical"]["drifted"]
    a, h, v, step = vertical["felt_mps2"], 0.0, 0.0, 1.0 / 60.0
    for _ in range(36000):
        v += step * (a + 2.0 * 9.797 * h / 6.371e6)
        h += step * v
    assert vertical["free_height_m"] == pytest.approx(h, rel=0.005)
    assert 0.0 < vertical["height_m"] < 0.01 * vertical["free_height_m"]


def test_loops_of_the_three_states_are_the_same(members: dict[str, list]) -> None:
    """The scale factors of an instrument are those of its loops before and after their self-calibration."""
    units = aged(1.0, 1)
    of = {s: World(plan) for s, (plan, _) in zip(AGED, ageing.plans(Plan(), 4, units).values(), strict=True)}
    after = dict(zip(units.drifted_ppm, units.self_calibrated_ppm, strict=True))
    drawn = [[a.units["loop_gain"] for i in range(4) for a in of[s].instrument(i).accelerometers] for s in AGED]
    assert [after[ppm] for ppm in drawn[0]] == drawn[1]


def test_nothing_else_of_the_report_knows_of_storage(tmp_path: Path) -> None:
    """With and without the section, on a flight of five minutes: every other number and sentence the same."""
    profile = tmp_path / "hop.toml"
    profile.write_text(PROFILE)
    run = partial(ensemble.run, folder=tmp_path / "members", workers=1, quiet=True)
    plan = Plan(str(profile), seed=1)
    results = [of_flights(fly(plan, 2, run, ageing_years=years)) for years in (0.0, 2.0)]
    without, stored_too = (json.loads(as_json(result.metrics)) for result in results)
    assert stored_too.pop("storage")["years"] == 2.0
    assert without == stored_too
    texts = [str(result) for result in results]
    assert "After storage" not in texts[0] and "after 2 years between calibration" in " ".join(texts[1].split())


def test_section_is_in_the_standard_report(small_report: Path) -> None:
    text = " ".join((small_report / "report.txt").read_text().split())
    for words in ("After storage", "after 1 year between", "self-calibrated", "Alignment.", "on z"):
        assert words in text, words


def test_time_that_cannot_be_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    for years in (-1.0, 1000.0, float("nan")):
        with pytest.raises(UsageError, match="years, expected 0 to 100"):
            flight_report.run(tmp_path / "out", 1, True, profile="straight", size=2, seed=1, storage_years=years)
    assert not (tmp_path / "out").exists()
