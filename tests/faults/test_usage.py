"""What a user may get wrong: one sentence, the exit code of its kind, and nothing written."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

RUBBISH = random.Random(1).randbytes(3000)


@pytest.fixture
def output(tmp_path: Path) -> Path:
    """Where a refused command must write nothing."""
    return tmp_path / "never"


PROFILES = {
    "unknown key": ("to_mps = 100.0", "to_mps = 100.0\nto_kn = 200.0", "unknown key 'speed[0].to_kn'; did you mean"),
    "unknown table": ("[thermal]", "[termal]\n[thermal]", "unknown key 'termal'; did you mean 'thermal'"),
    "wrong unit": ("latitude_deg = 34.65", "latitude_deg = 3465.0", "mind the unit in the key's name"),
    "key in another unit": ("latitude_deg = 34.65", "latitude_rad = 0.6", "did you mean 'latitude_deg'"),
    "wrong type": ("to_mps = 100.0", 'to_mps = "fast"', "'speed[0].to_mps' is 'fast'"),
    "not finite": ("height_m = 400.0", "height_m = nan", "start.height_m"),
    "missing key": ("heading_deg = 60.0\n", "", "'start.heading_deg' is missing"),
    "out of order": ("to_s = 60.0", "to_s = -60.0", "speed[0] runs from 0 s to -60 s"),
    "not TOML": ("[start]", "[start", "not valid TOML"),
    "extends nothing": ('name = "short"', 'name = "short"\nextends = "bax"', "did you mean 'box'"),
    "does not move": ('name = "short"', 'name = "short"\nkind = "static"', "a static profile does not move"),
}


@pytest.mark.parametrize("fault", PROFILES)
def test_bad_profile(short_profile: Path, tmp_path: Path, output: Path, refused, fault: str) -> None:
    old, new, said = PROFILES[fault]
    text = short_profile.read_text()
    assert old in text
    bad = tmp_path / "bad.toml"
    bad.write_text(text.replace(old, new, 1))
    sentence = refused(["flight-report", "--profile", str(bad), "--output", str(output), "--quiet"], 2)
    assert said in sentence
    assert str(bad) in sentence or "extends" in fault
    assert not output.exists()


def test_profiles_that_extend_each_other(tmp_path: Path, output: Path, refused) -> None:
    for name, base in (("a", "b"), ("b", "a")):
        (tmp_path / f"{name}.toml").write_text(f'extends = "{base}"\n')
    command = ["flight-report", "--profile", str(tmp_path / "a.toml"), "--output", str(output), "--quiet"]
    assert "break the circle" in refused(command, 2)
    assert not output.exists()


@pytest.mark.parametrize(
    ("kind", "said"),
    [("missing", "no such profile"), ("folder", "no such profile"), ("rubbish", "not valid TOML")],
)
def test_file_that_is_no_profile(tmp_path: Path, output: Path, refused, kind: str, said: str) -> None:
    path = tmp_path / "it.toml"
    if kind == "folder":
        path.mkdir()
    elif kind == "rubbish":
        path.write_bytes(RUBBISH)
    assert said in refused(["flight-report", "--profile", str(path), "--output", str(output), "--quiet"], 2)
    assert not output.exists()


@pytest.mark.parametrize("verb", ["flight-report", "check-cep"])
def test_unknown_profile_name(output: Path, refused, verb: str) -> None:
    command = [verb, "--profile", "climb-cruise-landin", "--output", str(output), "--quiet"]
    assert "did you mean 'climb-cruise-landing'" in refused(command, 2)
    assert not output.exists()


def test_profile_that_stands_still_is_no_flight(output: Path, refused) -> None:
    sentence = refused(["flight-report", "--profile", "oven", "--output", str(output), "--quiet"], 2)
    assert "oven" in sentence
    assert not output.exists()


@pytest.mark.parametrize("rate", ["-3", "0", "1e9", "nan"])
def test_a_rate_that_no_trajectory_is_sampled_at(output: Path, refused, rate: str) -> None:
    sentence = refused(["simulate", "flight", "--rate", rate, "--output", str(output), "--quiet"], 2)
    assert "expected 1 to 400" in sentence
    assert not output.exists()


@pytest.mark.parametrize("stand_s", [0.0, 3.0])
def test_flight_without_time_to_align(short_profile: Path, tmp_path: Path, refused, stand_s: float) -> None:
    hasty = tmp_path / "hasty.toml"
    hasty.write_text(short_profile.read_text().replace("stand_s = 300.0", f"stand_s = {stand_s}"))
    command = ["flight-report", "--profile", str(hasty), "--ensemble", "2", "--workers", "1", "--quiet"]
    sentence = refused([*command, "--output", str(tmp_path / "out")], 3)
    assert "rest" in sentence or "stand" in sentence


@pytest.mark.parametrize(
    ("population", "said"),
    [("jb-kt", "did you mean 'jb-kt8'"), ("nowhere.toml", "nowhere.toml: there is no such")],
)
def test_unknown_population(output: Path, refused, population: str, said: str) -> None:
    assert said in refused(["flight-report", "--population", population, "--output", str(output), "--quiet"], 2)
    assert not output.exists()


def test_population_with_an_unknown_key(tmp_path: Path, output: Path, refused) -> None:
    mine = tmp_path / "mine.toml"
    mine.write_text('extends = "jb-kt8"\n[creep]\nscater = 0.2\n')
    sentence = refused(["flight-report", "--population", str(mine), "--output", str(output), "--quiet"], 2)
    assert "unknown key 'creep.scater'; did you mean 'scatter'" in sentence
    assert not output.exists()


COMMITTED = {
    "rubbish": (lambda good: RUBBISH, "not valid TOML"),
    "empty": (lambda good: b"", "'seed' is missing"),
    "no gain": (lambda good: good.replace(b"value = 0.99", b"value = 1.2"), "1.2 is no gain; expected below 1"),
    "one measure only": (lambda good: good.replace(b"cep_rate_final", b"# "), ".cep_rate_final' is missing"),
    "one compensation less": (
        lambda good: good.replace(b'missions."simple"', b'missions."other"'),
        "'missions.\"simple\"' is missing",
    ),
    "another file": (lambda good: b'name = "box"\n', "unknown key 'name'"),
}


def test_committed_file_that_is_missing(tmp_path: Path, output: Path, refused) -> None:
    path = tmp_path / "gate.toml"
    sentence = refused(["check-cep", "--committed", str(path), "--output", str(output), "--quiet"], 2)
    assert f"{path}: there is no such file" in sentence
    assert not output.exists()


@pytest.mark.parametrize("fault", COMMITTED)
def test_committed_file_that_cannot_be_used(commands, tmp_path: Path, output: Path, refused, fault: str) -> None:
    spoil, said = COMMITTED[fault]
    path = tmp_path / "gate.toml"
    path.write_bytes(spoil(commands.committed.read_bytes()))
    sentence = refused(["check-cep", "--committed", str(path), "--output", str(output), "--quiet"], 2)
    assert said in sentence
    assert str(path) in sentence
    assert not output.exists()


@pytest.mark.parametrize("kind", ["missing", "empty folder", "rubbish", "empty", "text of another kind"])
def test_recording_that_is_none(tmp_path: Path, output: Path, refused, kind: str) -> None:
    path = tmp_path / "it.imu"
    if kind == "empty folder":
        path.mkdir()
    elif kind != "missing":
        path.write_bytes({"rubbish": RUBBISH, "empty": b"", "text of another kind": b"to be or not to be\n"}[kind])
    sentence = refused(["evaluate", str(path), "--output", str(output), "--quiet"], 2 if kind == "missing" else 3)
    assert str(path) in sentence
    assert not output.exists()


def test_quiet_gate_says_nothing(commands, tmp_path: Path, capsys) -> None:
    from ins_eval.cli import main

    assert main(commands.check_cep(tmp_path / "gate")) == 0
    assert capsys.readouterr() == ("", "")
