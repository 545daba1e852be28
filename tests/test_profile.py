"""Profiles: what is refused, in which words, and what ``extends`` does."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from ins_eval.errors import UsageError
from ins_eval.profile import find, load
from ins_eval.thermal import imu_temperature
from ins_eval.trajectory import Trajectory

FLIGHT = """
name = "short flight"
duration_s = 600.0

[start]
latitude_deg = 45.0
longitude_deg = 10.0
height_m = 200.0
heading_deg = 30.0
stand_s = 60.0

[[speed]]
from_s = 0.0
to_s = 60.0
to_mps = 80.0

[[turn]]
at_s = 100.0
by_deg = 90.0
bank_deg = 30.0

[thermal]
self_heating_c = 5.0
"""


def write(folder: Path, text: str, name: str = "mine") -> Path:
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return path


def refusal(action) -> str:
    """The message of the UsageError that `action` raises, which must be one sentence."""
    with pytest.raises(UsageError) as caught:
        action()
    message = str(caught.value)
    assert "\n" not in message
    assert ". " not in message.replace(".toml", "")
    assert caught.value.exit_code == 2
    return message


def test_the_base_of_these_tests_is_accepted(tmp_path: Path) -> None:
    profile = load(write(tmp_path, FLIGHT))
    assert profile.start.latitude_deg == 45.0
    assert profile.gps.lost_beyond_roll_deg == 30.0
    Trajectory(profile)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        # unknown keys, at the top, in a table, in a list of tables
        ("duration_s = 600.0", "duration_s = 600.0\nrates = 1", ("unknown key 'rates'",)),
        ("stand_s", "stands_s", ("unknown key 'start.stands_s'", "did you mean 'stand_s'?")),
        ("bank_deg", "banks_deg", ("unknown key 'turn[0].banks_deg'", "did you mean 'bank_deg'?")),
        ("self_heating_c", "self_heatng_c", ("unknown key 'thermal.self_heatng_c'", "did you mean 'self_heating_c'?")),
        # keys with another unit
        ("height_m", "height_ft", ("unknown key 'start.height_ft'", "did you mean 'height_m'?")),
        ("heading_deg", "heading_rad", ("unknown key 'start.heading_rad'", "did you mean 'heading_deg'?")),
        ("to_mps", "to_kmh", ("unknown key 'speed[0].to_kmh'", "did you mean 'to_mps'?")),
        # values
        ("latitude_deg = 45.0", "latitude_deg = 89.0", ("start.latitude_deg", "89.0", "85")),
        ("latitude_deg = 45.0", "latitude_deg = nan", ("start.latitude_deg", "nan", "finite")),
        ("duration_s = 600.0", "duration_s = 'ten minutes'", ("duration_s", "'ten minutes'", "number", "unit")),
        ("bank_deg = 30.0", "bank_deg = 80.0", ("turn[0].bank_deg", "80.0", "70")),
        ("stand_s = 60.0", "stand_s = -60.0", ("start.stand_s", "-60.0")),
        ("name = \"short flight\"", "kind = \"hover\"\nname = \"a\"", ("kind", "'hover'", "'flight'", "'static'")),
        ("height_m = 200.0\n", "", ("'start.height_m' is missing",)),
        # times that contradict each other
        ("at_s = 100.0", "at_s = 700.0", ("turn[0]", "700 s", "600 s")),
        ("to_s = 60.0", "to_s = 610.0", ("speed[0]", "610 s", "600 s")),
        ("to_s = 60.0", "to_s = 8.0", ("speed[0]", "8 s", "two edges of 5 s")),
        ("name = \"short flight\"", "kind = \"static\"\nname = \"a\"", ("static", "speed, height, turn")),
        ("self_heating_c = 5.0", "ground_c = 10.0", ("thermal", "exactly one", "self_heating_c, anchor and same_as")),
        ("self_heating_c = 5.0", "self_heating_c = 5.0\nsame_as = 'box'", ("thermal", "exactly one")),
    ],
)  # fmt: skip
def test_a_fault_is_refused_in_one_sentence_with_file_and_key(
    tmp_path: Path, old: str, new: str, said: tuple[str, ...]
) -> None:
    assert old in FLIGHT
    path = write(tmp_path, FLIGHT.replace(old, new))
    message = refusal(lambda: load(path))
    for part in (str(path), *said):
        assert part in message


def test_overlapping_changes_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path, FLIGHT + "[[speed]]\nfrom_s = 50.0\nto_s = 90.0\nto_mps = 100.0\n")
    message = refusal(lambda: load(path))
    for part in (str(path), "speed[1]", "50 s to 90 s", "at or after 60 s"):
        assert part in message


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("at_s = 100.0", "at_s = 0.0", ("turn[0]", "0 m/s", "needs speed")),
        ("at_s = 100.0", "at_s = 595.0", ("turn[0]", "595 s", "after duration_s = 600 s")),
    ],
)
def test_a_turn_that_cannot_be_flown_is_refused(tmp_path: Path, old: str, new: str, said: tuple[str, ...]) -> None:
    """Standing still, and one that lasts beyond the flight."""
    profile = load(write(tmp_path, FLIGHT.replace(old, new)))
    message = refusal(lambda: Trajectory(profile))
    for part in ("short flight", *said):
        assert part in message


def test_an_oven_of_another_length_than_the_flight_it_repeats_is_refused(tmp_path: Path) -> None:
    text = FLIGHT.split("[[speed]]")[0] + "[thermal]\nsame_as = 'climb-cruise-landing'\n"
    profile = load(write(tmp_path, text))
    message = refusal(lambda: imu_temperature(Trajectory(profile)))
    for part in ("short flight", "-60 s to 600 s", "climb-cruise-landing", "-900 s to 8400 s", "stand_s"):
        assert part in message


def test_an_anchor_outside_the_flight_is_refused(tmp_path: Path) -> None:
    text = FLIGHT.replace("self_heating_c = 5.0", "anchor = { time_s = 900.0, temperature_c = 1.0 }")
    profile = load(write(tmp_path, text))
    assert "thermal.anchor.time_s = 900" in refusal(lambda: imu_temperature(Trajectory(profile)))


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "none.toml"
    assert str(path) in refusal(lambda: load(path))


def test_a_name_that_is_not_known_is_refused_with_the_nearest() -> None:
    assert "no profile 'bax'; did you mean 'box'?" in refusal(lambda: load("bax"))


def test_a_file_that_is_not_toml_is_refused_with_the_line(tmp_path: Path) -> None:
    path = write(tmp_path, "name = 'a'\nthis is no TOML\n")
    message = refusal(lambda: load(path))
    assert str(path) in message
    assert "line 2" in message
    path.write_bytes(b"\xff\xfe\x00binary")
    assert str(path) in refusal(lambda: load(path))


def test_circular_extends_is_refused(tmp_path: Path) -> None:
    write(tmp_path, "extends = 'second'\n", "first")
    write(tmp_path, "extends = 'first'\n", "second")
    message = refusal(lambda: load(tmp_path / "first.toml"))
    assert "'extends' leads back to itself" in message
    assert str(tmp_path) in message


def test_extends_an_unknown_profile_is_refused_with_the_nearest(tmp_path: Path) -> None:
    path = write(tmp_path, "extends = 'stright'\n")
    assert "did you mean 'straight'?" in refusal(lambda: load(path))


def test_extends_merges_tables_and_replaces_lists(tmp_path: Path) -> None:
    write(tmp_path, FLIGHT, "base")
    text = 'extends = "base"\nname = "other"\nturn = []\n[start]\nheading_deg = 70.0\n[gps]\nperiod_s = 2.0\n'
    base, other = load(tmp_path / "base.toml"), load(write(tmp_path, text))
    assert (other.name, other.turn, other.speed) == ("other", (), base.speed)
    assert other.start == base.start.model_copy(update={"heading_deg": 70.0})
    assert (other.gps.period_s, base.gps.period_s) == (2.0, 1.0)
    assert other.thermal == base.thermal


def test_a_fault_in_the_base_is_refused_too(tmp_path: Path) -> None:
    write(tmp_path, FLIGHT.replace("height_m", "height_ft"), "base")
    path = write(tmp_path, "extends = 'base'\n")
    assert "start.height_ft" in refusal(lambda: load(path))


def test_a_name_is_looked_up_in_the_working_folder_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "trajectories").mkdir()
    write(tmp_path / "trajectories", FLIGHT, "box")
    assert load("box").name != "short flight"
    monkeypatch.chdir(tmp_path)
    assert load("box").name == "short flight"
    assert load("straight").turn == ()


def test_every_shipped_profile_loads_by_name_and_by_path(repository: Path) -> None:
    paths = sorted((repository / "trajectories").glob("*.toml"))
    assert {p.stem for p in paths} >= {"box", "climb-cruise-landing", "oven", "straight", "wing-rock"}
    for path in paths:
        assert load(path.stem) == load(path)
        assert load(path).name == tomllib.loads(path.read_text(encoding="utf-8"))["name"]
        assert find(path.stem).is_file()
