"""The maker of cases: the same seed gives the same bytes, and a recording tells nothing."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pyarrow.parquet
import pytest

from benchmark.runners import make
from benchmark.worlds.cases import KINDS, SETS, draw, title
from benchmark.worlds.effects import VOCABULARY
from benchmark.worlds.outside import FORMS
from benchmark.worlds.write import FILES

COLUMNS = {
    "imu": {"time_s", "gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z", "temperature_c", "temperature_x_c",
            "temperature_y_c", "temperature_z_c", "height_baro_m", "vibration_rms_g", "supply_v",
            "static_pressure_hpa", "fan_speed_hz"},
    "gps": {"time_s", "latitude_deg", "longitude_deg", "height_m", "velocity_n_mps", "velocity_e_mps",
            "velocity_d_mps", "valid"},
    "reference": {"time_s", "latitude_deg", "longitude_deg", "height_m", "velocity_n_mps", "velocity_e_mps",
                  "velocity_d_mps", "roll_deg", "pitch_deg", "heading_deg"},
    "chamber": {"time_s", "run", "input_g", "rate_c_per_min", "temperature_c", "output", "chamber_c"},
}  # fmt: skip


def made(folder: Path, kinds: str, count: int, *more: str) -> Path:
    arguments = ["--kind", kinds, "--count", str(count), "--rate", "20", "-o", str(folder), *more]
    assert make.main(arguments) == 0
    return folder


def digests(folder: Path) -> dict[str, str]:
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A few cases of several kinds, a chamber and two recordings of one unit among them."""
    folder = tmp_path_factory.mktemp("cases")
    made(folder, "single", 1, "--first", "1", "--no-oracle")
    made(folder, "outside", 1, "--first", "2", "--no-oracle")
    made(folder, "multi", 1, "--no-oracle")
    return made(folder, "unidentifiable", 1, "--first", "12", "--no-oracle")


def test_the_same_seed_gives_the_same_bytes(folder, tmp_path):
    again = made(tmp_path / "again", "outside", 1, "--first", "2", "--no-oracle")
    old, new = digests(folder), digests(again)
    new.pop("truth/manifest.json")
    assert new.items() <= old.items()


def test_another_seed_or_set_gives_another_case():
    titles = {title(which, seed, kind, 0) for which in SETS for seed in (1, 2) for kind in KINDS}
    assert len(titles) == 2 * len(SETS) * len(KINDS)
    drawn = [draw(which, 1, "unidentifiable", 12, 20.0).truth["effects"] for which in SETS]
    assert all(one not in drawn[:k] for k, one in enumerate(drawn))


def test_half_of_what_hides_something_has_adversarial_noise_where_that_is_asked():
    """Which half is drawn by itself: the other half is the very case that is made without."""
    forms = {}
    for index in range(6):
        plain, mixed = (draw("development", 3, "unidentifiable", index, 20.0, asked) for asked in (False, True))
        forms[index] = mixed.truth["noise_form"]
        assert plain.truth["noise_form"] == "plain"
        assert (mixed.truth["noise"] == plain.truth["noise"]) == (forms[index] == "plain")
        assert [one["name"] for one in mixed.truth["effects"]] == [one["name"] for one in plain.truth["effects"]]
    assert set(forms.values()) == {"plain", "adversarial"}


def test_a_recording_holds_only_what_the_form_has(folder):
    for path in (folder / "recordings").rglob("*"):
        if not path.is_file():
            continue
        assert path.name in FILES
        if path.suffix == ".parquet":
            schema = pyarrow.parquet.read_schema(path)
            assert set(schema.names) <= COLUMNS[path.stem]
            assert not schema.metadata


def test_a_recording_does_not_tell_what_it_hides(folder):
    """No name of an effect, kind, seed or set in any text or folder name."""
    names = [name.split(".")[1] for name in VOCABULARY if not name.startswith("earth.")]
    words = {*names, *KINDS, *SETS, *FORMS, "seed", "truth", "effect", "outside"} - {"bias", "scale", "time_offset",
             "lever_arm", "quadratic", "heading"}  # fmt: skip
    for path in (folder / "recordings").rglob("*"):
        told = path.read_text() if path.suffix == ".toml" else ""
        for word in words:
            assert word not in f"{path.relative_to(folder / 'recordings')}\n{told}", (path, word)


def test_names_of_cases_do_not_follow_their_kinds(folder):
    names = {path.name for path in (folder / "recordings").iterdir()}
    assert names == {path.stem for path in (folder / "truth").glob("case-*.json")}
    assert all(len(name) == len("case-") + 8 for name in names)


def test_the_truth_lies_apart_and_says_what_was_hidden(folder):
    for path in (folder / "truth").glob("case-*.json"):
        truth = json.loads(path.read_text())
        assert truth["effects"] and truth["kind"] in KINDS
        for one in truth["recordings"]:
            assert (folder / "recordings" / one["path"] / "recording.toml").exists()


def test_the_manifest_names_the_generator_by_its_hash(folder):
    entries = json.loads((folder / "truth" / "manifest.json").read_text())["made"]
    assert {one["generator_sha256"] for one in entries} == {make.code_hash()}


def test_an_unknown_kind_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit):
        make.main(["--kind", "nothing", "-o", str(tmp_path)])
    assert "unknown kind nothing" in capsys.readouterr().err
