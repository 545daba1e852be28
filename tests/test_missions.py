"""Missions: each source changes what it names, within what its file states, and moves no other draw."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ins_eval.errors import UsageError
from ins_eval.missions import SOURCES, Missions, cruise
from ins_eval.profile import Profile, load
from ins_eval.streams import Streams
from ins_eval.thermal import imu_temperature
from ins_eval.trajectory import Trajectory

MANY = 60
TOUCHES = {  # the tables of a profile that a source may change
    "place": {"start"},
    "heading": {"start"},
    "cruise": {"speed", "height"},
    "course": {"name", "turn"},
    "day": {"thermal"},
    "stand": {"start"},
    "history": {"thermal"},
    "receiver": {"gps"},
    "gyro": set(),
    "gradient": set(),
}


@pytest.fixture(scope="module")
def base() -> Profile:
    """The flight of the paper, its own heat given."""
    profile = load("climb-cruise-landing")
    thermal = profile.thermal.model_copy(update={"anchor": None, "self_heating_c": 15.8})
    return profile.model_copy(update={"thermal": thermal})


@pytest.fixture(scope="module")
def worldwide() -> Missions:
    return Missions.load("worldwide")


@pytest.fixture(scope="module")
def drawn(base: Profile, worldwide: Missions) -> list[Profile]:
    return [worldwide.draw(base, Streams(k)) for k in range(MANY)]


def changed(before: Profile, after: Profile) -> set[str]:
    return {key for key, value in before if getattr(after, key) != value}


def test_the_shipped_population_has_every_source(worldwide: Missions) -> None:
    assert tuple(worldwide.sources) == SOURCES


@pytest.mark.parametrize("source", SOURCES)
def test_a_source_changes_what_it_names_and_nothing_else(base: Profile, worldwide: Missions, source: str) -> None:
    alone = worldwide.without(*(name for name in SOURCES if name != source))
    assert changed(base, alone.draw(base, Streams(1))) == TOUCHES[source]


@pytest.mark.parametrize("source", ["place", "course", "cruise", "stand", "receiver"])
def test_switching_a_source_off_moves_no_other_draw(base: Profile, worldwide: Missions, source: str) -> None:
    for seed in range(5):
        whole, without = worldwide.draw(base, Streams(seed)), worldwide.without(source).draw(base, Streams(seed))
        for table in {"speed", "height", "gps"} - TOUCHES[source]:
            assert getattr(whole, table) == getattr(without, table)
        for key, value in without.start:
            if value != getattr(base.start, key):  # drawn by a source that is on
                assert getattr(whole.start, key) == value
        # the temperature of the ground; the lapse follows from it and from the place
        assert whole.thermal.ground_c == without.thermal.ground_c


def test_with_every_source_off_the_profile_stays(base: Profile, worldwide: Missions) -> None:
    assert worldwide.without(*SOURCES).draw(base, Streams(1)) == base


def test_what_is_drawn_lies_in_its_ranges_and_fills_them(drawn: list[Profile]) -> None:
    ranges = {
        "latitude": (-60.0, 70.0, [p.start.latitude_deg for p in drawn]),
        "ground": (-20.0, 35.0, [p.thermal.ground_c for p in drawn]),
        "stand": (300.0, 1800.0, [p.start.stand_s for p in drawn]),
        "height": (3000.0, 12000.0, [max(c.to_m for c in p.height) for p in drawn]),
        "speed": (130.0, 250.0, [max(c.to_mps for c in p.speed) for p in drawn]),
    }
    for low, high, values in ranges.values():
        assert low <= min(values) < low + 0.15 * (high - low)
        assert high - 0.15 * (high - low) < max(values) <= high


def test_courses_differ_and_end_with_the_cruise(drawn: list[Profile]) -> None:
    counts = set()
    for profile in drawn:
        begin_s, end_s = cruise(profile)
        assert (begin_s, end_s) == (1800.0, 7200.0)
        trajectory = Trajectory(profile)
        turns_s = [span for span in trajectory.turns_s if begin_s <= span[0] < end_s]
        counts.add(len(turns_s))
        assert all(end <= end_s + 1e-6 for _, end in turns_s)
        assert all(a[1] <= b[0] + 1e-6 for a, b in zip(turns_s, turns_s[1:], strict=False))
        turned = sum(t.by_deg for t in profile.turn if begin_s <= t.at_s < end_s)
        assert abs(turned) in (0.0, 180.0, *(90.0 * k for k in range(1, 6)))
    assert 2 in counts
    assert counts & {4, 5}
    assert max(counts) > 6


def test_an_out_and_back_returns_towards_its_start(base: Profile, worldwide: Missions) -> None:
    only = worldwide.without(*(name for name in SOURCES if name != "course"))
    flown = [only.draw(base, Streams(k)) for k in range(20)]
    back = next(p for p in flown if p.name.endswith("out and back"))
    truth = Trajectory(back).truth(np.array([0.0, 4500.0, 7190.0]))
    away = np.hypot(
        truth.latitude_rad - truth.latitude_rad[0],
        np.cos(truth.latitude_rad[0]) * (truth.longitude_rad - truth.longitude_rad[0]),
    )
    assert away[2] < 0.5 * away[1]


def test_every_mission_can_be_flown(drawn: list[Profile]) -> None:
    for profile in drawn[:12]:
        trajectory = Trajectory(profile)
        temperature_c = imu_temperature(trajectory).temperature_c
        assert np.all(np.isfinite(temperature_c))
        assert temperature_c.min() > -75.0
        assert temperature_c.max() < 80.0
        assert np.abs(np.rad2deg(trajectory.truth(np.array([8400.0])).latitude_rad)) < 85.0


def test_the_lapse_leads_to_the_tropopause(drawn: list[Profile]) -> None:
    """ICAO: -56.5 degC at 11 km, here with a sigma of 5."""
    top_c = [p.thermal.ground_c - 1e-3 * p.thermal.lapse_c_per_km * (11000.0 - p.start.height_m) for p in drawn]
    assert np.mean(top_c) == pytest.approx(-56.5, abs=4.0 * 5.0 / np.sqrt(MANY))
    assert 3.0 < np.std(top_c) < 7.0


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[plase]\nlatitude_deg = [0.0, 1.0]", "unknown key 'plase'.*did you mean 'place'"),
        ('extends = "worldwide"\n[place]\nlatitude_deg = [10.0, 1.0]', "runs backwards"),
        ('extends = "worldwide"\n[course]\nkinds = ["circle"]', "course"),
    ],
)
def test_refuses_what_it_does_not_know(tmp_path: Path, text: str, sentence: str) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(UsageError, match=sentence):
        Missions.load(path)


def test_refuses_a_name_that_is_not_there(worldwide: Missions) -> None:
    with pytest.raises(UsageError, match="did you mean 'worldwide'"):
        Missions.load("worldwid")
    with pytest.raises(UsageError, match="did you mean 'stand'"):
        worldwide.without("stnd")


def test_a_file_may_leave_sources_out(tmp_path: Path) -> None:
    path = tmp_path / "cold.toml"
    path.write_text("[day]\nground_c = [-20.0, -10.0]\ntropopause_c = -60.0\ntropopause_sigma_c = 0.0\n")
    assert tuple(Missions.load(path).sources) == ("day",)
