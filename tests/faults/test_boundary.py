"""What comes from outside: pipes, bombs, huge numbers, endless names, text that acts; a sentence for each."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from ins_eval import boundary
from ins_eval.cli import main
from ins_eval.errors import DataRefused, UsageError
from ins_eval.limits import BY_NAME, BY_UNIT, OTHER, limits_of
from ins_eval.printable import LONGEST_SENTENCE, printable, shortened
from ins_eval.recording import form
from ins_eval.recording.belief import Belief, EffectBelief
from ins_eval.recording.form.description import ImuTable, StartTable
from tests.faults.conftest import SHORT
from tests.faults.parked import gzip_bomb, matlab_bomb, parked, rewritten
from tests.recording.readers.conftest import CSV_MAPPING, csv_rows, drive

MIB = 1 << 20
BOMB_BYTES = 64 * MIB  # beyond the limit that these tests set, so that they need no gigabytes themselves
SOON_S = 5.0  # for a refusal; a hang would last for ever
TEX = r"a $\badcmd{ b$"
ACTING = "\x1b[31mred\x1b]0;title\x07\u202eback\nline"


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return parked(tmp_path_factory.mktemp("sound") / "unit")


@pytest.fixture
def unit(tmp_path: Path) -> Path:
    return parked(tmp_path / "unit")


@pytest.fixture
def small_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(boundary, "LARGEST_BYTES", 16 * MIB)


@pytest.fixture
def soon(refused: Callable[[list[str], int], str]) -> Callable[[list[str], int], str]:
    """Refused in one sentence, at once."""

    def run(arguments: list[str], code: int) -> str:
        began = time.monotonic()
        sentence = refused([str(one) for one in arguments], code)
        assert time.monotonic() - began < SOON_S
        return sentence

    return run


PLACES = {
    "import": lambda pipe, unit: ["import", "csv", pipe, "-o", unit.parent / "out"],
    "import of a bag": lambda pipe, unit: ["import", "rosbag", pipe, "-o", unit.parent / "out"],
    "belief of evaluate": lambda pipe, unit: ["evaluate", unit, "--belief", pipe, "--quiet"],
    "belief of diagnose": lambda pipe, unit: ["diagnose", unit, "--belief", pipe, "--quiet"],
    "population": lambda pipe, unit: [
        *("simulate", "flight", "--population", pipe.rename(pipe.with_suffix(".toml")), "-o", unit.parent / "out"),
    ],
    "committed": lambda pipe, unit: ["check-cep", "--committed", pipe, "--output", unit.parent / "out", "--quiet"],
    "loop": lambda pipe, unit: ["loop", "calibrate", pipe],
}


@pytest.mark.parametrize("place", PLACES)
def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path, unit: Path, soon, place: str) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert "is a pipe" in soon(PLACES[place](pipe, unit), 2)


@pytest.mark.parametrize("table", ["gps.parquet", "imu.parquet"])
@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_a_table_that_is_no_file(unit: Path, soon, table: str, kind: str) -> None:
    (unit / table).unlink()
    if kind == "pipe":
        os.mkfifo(unit / table)
    else:
        (unit / table).symlink_to("/dev/zero")
    assert f"is a {kind}" in soon(["evaluate", unit, "--quiet"], 2)


@pytest.mark.parametrize("name", ["cats", "csv", "psins-text", "kf-gins", "ulog", "mems-chamber"])
def test_gzip_that_unpacks_to_too_much(tmp_path: Path, soon, small_limit: None, name: str) -> None:
    file = tmp_path / "bomb.csv"
    file.write_bytes(gzip_bomb(BOMB_BYTES))
    (tmp_path / "bomb.toml").write_text('kind = "drive"\n')
    sentence = soon(["import", name, file, "-o", tmp_path / "out"], 2 if name == "csv" else 3)
    assert name == "csv" or "unpacks to more than 16 MiB" in sentence


@pytest.mark.parametrize("elements", [1, 6])
@pytest.mark.parametrize("name", ["psins-mat", "apm-mat"])
def test_matlab_that_unpacks_to_too_much(tmp_path: Path, soon, small_limit: None, name: str, elements: int) -> None:
    """One element beyond the limit, or several that are so together."""
    file = tmp_path / "bomb.mat"
    file.write_bytes(matlab_bomb(BOMB_BYTES // elements, elements))
    assert "unpacks to more than 16 MiB" in soon(["import", name, file, "-o", tmp_path / "out"], 3)


def test_parquet_that_unpacks_to_too_much(unit: Path, soon, small_limit: None) -> None:
    rows = BOMB_BYTES // 16
    table = pa.table({"time_s": pa.array(np.zeros(rows)), "height_m": pa.array(np.zeros(rows))})
    pa.parquet.write_table(table, unit / "gps.parquet", compression="zstd")
    assert (unit / "gps.parquet").stat().st_size < MIB
    assert "unpacks to more than 16 MiB" in soon(["evaluate", unit, "--quiet"], 3)


def test_a_file_that_grows_while_it_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its size was within the limit when it was looked at."""
    file = tmp_path / "log.csv"
    file.write_bytes(b"1,2\n" * 100)
    monkeypatch.setattr(boundary, "check_regular", lambda *_: 10)
    with pytest.raises(DataRefused, match="is larger than"):
        boundary.file_bytes(file, "a table", most=50)


def test_a_toml_of_megabytes(unit: Path, soon) -> None:
    with open(unit / "recording.toml", "a") as file:
        file.write("# comment\n" * (boundary.LARGEST_TEXT_BYTES // 10))
    assert "is larger than 2 MiB" in soon(["evaluate", unit, "--quiet"], 3)


@pytest.mark.parametrize("value", ["5", "[1]", "true", "1.5", "{ a = 1 }", '"' + "x" * 400 + '"', "1979-05-27"])
@pytest.mark.parametrize("option", ["--profile", "--population"])
def test_extends_that_is_no_name(tmp_path: Path, soon, option: str, value: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(f"extends = {value}\n")
    assert "'extends' is" in soon(["simulate", "flight", option, file, "-o", tmp_path / "out"], 2)


HUGE = {
    "start.height_m": ("height_m = 400.0", "height_m = 1e308"),
    "gyro.bias_radps": ("[gyro]", "[gyro]\nbias_radps = [1e3, 0.0, 0.0]"),
    "gyro.bias_radps, finite": ("[gyro]", "[gyro]\nbias_radps = [0.0, 1e308, 0.0]"),
    "accelerometer.bias_mps2": ("[accelerometer]", "[accelerometer]\nbias_mps2 = [0.0, 0.0, -1e308]"),
    "start.velocity_ned_mps": ("velocity_ned_mps = [0.0", "velocity_ned_mps = [1e300"),
    "accelerometer.x.scale.gamma": ("[accelerometer]", "[accelerometer]\nx = { scale = { gamma = 1e-320 } }"),
    "height.sigma_m": ("sigma_m = 2.0", "sigma_m = 1e200"),
    "start.time_s": ("time_s = 0.0", "time_s = 1e300"),
}


@pytest.mark.parametrize("key", HUGE)
def test_a_huge_number_of_the_form(unit: Path, soon, key: str) -> None:
    sentence = soon(["evaluate", rewritten(unit, *HUGE[key]), "--quiet"], 3)
    assert key.partition(",")[0].rpartition(".")[2] in sentence
    assert "expected" in sentence or "should be" in sentence


@pytest.mark.parametrize("column", ["velocity_n_mps", "height_m"])
def test_a_huge_number_of_a_table(unit: Path, soon, column: str) -> None:
    table = pa.parquet.read_table(unit / "gps.parquet")
    values = table.column(column).to_numpy().copy()
    values[7] = 1e308
    place = table.column_names.index(column)
    pa.parquet.write_table(table.set_column(place, column, pa.array(values)), unit / "gps.parquet")
    assert "row 8" in soon(["evaluate", unit, "--quiet"], 3)


@pytest.mark.parametrize("column", ["longitude_deg", "velocity_n_mps"])
def test_a_half_without_any_value(unit: Path, soon, column: str) -> None:
    table = pa.parquet.read_table(unit / "gps.parquet")
    empty = pa.array(np.full(table.num_rows, np.nan))
    place = table.column_names.index(column)
    pa.parquet.write_table(table.set_column(place, column, empty), unit / "gps.parquet")
    assert f"column {column}: no row has a value" in soon(["evaluate", unit, "--quiet"], 3)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("creep.time_constants_min", [1e-320, 40.0, 120.0]),
        ("creep.faster_per_c", 1e-320),
        ("creep.reference_temperature_c", 1e308),
        ("bias_temperature.omega1_sigma", 1e15),
        ("in_run.correlation_s", 1e-320),
    ],
)
def test_a_population_that_no_number_can_hold(tmp_path: Path, soon, key: str, value: float | list[float]) -> None:
    table, _, name = key.partition(".")
    file = tmp_path / "mine.toml"
    file.write_text(f'extends = "jb-kt8"\n[{table}]\n{name} = {value}\n')
    assert name in soon(["simulate", "flight", "--population", file, "-o", tmp_path / "out"], 2)


def test_a_population_whose_calibration_no_belief_can_hold(short_profile: Path, tmp_path: Path, soon) -> None:
    """Each number may be, but what a chamber makes of them is no scale factor of any accelerometer."""
    file = tmp_path / "mine.toml"
    units = "".join(
        f'[[scale_polynomial.units]]\nname = "{name}"\ngamma = 3.2e5\nmu = 0.0\nbeta = 1e15\nalpha = 0.0\neta = 0.0\n'
        "epsilon = 0.0\n"
        for name in "ab"
    )
    file.write_text(f'extends = "jb-kt8"\n[scale_polynomial]\nspread = 0.2\n{units}')
    short = ["--profile", short_profile, "--rate", "5"]
    said = soon(["simulate", "flight", *short, "--population", file, "-o", tmp_path / "out"], 2)
    assert f"{file}, accelerometer" in said and "cannot be" in said


@pytest.mark.parametrize("column", ["output", "temperature_c", "rate_c_per_min", "input_g"])
def test_a_huge_number_of_a_chamber(tmp_path: Path, soon, column: str) -> None:
    folder = tmp_path / "chamber"
    assert main(["simulate", "chamber", "--ramps", "4", "--no-dwell", "-o", str(folder), "--quiet"]) == 0
    table = pa.parquet.read_table(folder / "chamber.parquet")
    values = table.column(column).to_numpy().copy()
    values[11] = 1e308
    place = table.column_names.index(column)
    pa.parquet.write_table(table.set_column(place, column, pa.array(values)), folder / "chamber.parquet")
    assert f"row 12, column {column}: 1e+308" in soon(["calibrate", folder, "--quiet"], 3)


def test_the_air_of_a_chamber_is_no_list(tmp_path: Path, soon) -> None:
    folder = tmp_path / "chamber"
    assert main(["simulate", "chamber", "--ramps", "4", "--no-dwell", "-o", str(folder), "--quiet"]) == 0
    table = pa.parquet.read_table(folder / "chamber.parquet")
    place = table.column_names.index("chamber_c")
    lists = pa.array([[one] for one in table.column("chamber_c").to_pylist()])
    pa.parquet.write_table(table.set_column(place, "chamber_c", lists), folder / "chamber.parquet")
    assert "chamber_c" in soon(["diagnose", folder, "--quiet"], 3)


def test_every_number_of_the_form_has_limits() -> None:
    """Of its unit, where its name has one; those of no unit are counts, ratios and coefficients."""
    without = []
    for model in (ImuTable, StartTable, EffectBelief, *_tables(Belief)):
        for name, field in model.model_fields.items():
            if "float" in str(field.annotation) and limits_of(name) == OTHER:
                without.append(name)
    counts = {"alpha", "beta", "eta", "epsilon", "mu", "gamma", "value", "root", "branch_begin"}
    assert set(without) <= counts
    for low, high in (*BY_UNIT.values(), *BY_NAME.values(), OTHER):
        assert low < high and np.isfinite(high * high)


def _tables(model) -> list:
    below = [field.annotation for field in model.model_fields.values() if hasattr(field.annotation, "model_fields")]
    return [model, *(inner for one in below for inner in _tables(one))]


def test_nothing_that_acts_reaches_the_terminal(unit: Path, soon, capsys: pytest.CaptureFixture[str]) -> None:
    written = "".join(f"\\u{ord(c):04x}" if not c.isprintable() else c for c in ACTING)
    rewritten(unit, 'name = "unit"', f'name = "{written}"\nnotes = ["{written}"]')
    rewritten(unit, "[gyro]", f'[gyro]\nsource = "{written}"\n"bias_radp{written}" = 1')
    assert main(["evaluate", str(unit), "--output", str(unit.parent / "out")]) == 0
    said = capsys.readouterr()
    written_files = [(unit.parent / "out" / name).read_text() for name in ("report.txt", "index.html")]
    for text in (said.out, said.err, *written_files):
        assert printable(text, keep="\n\t") == text
    assert "red" in said.out
    rewritten(unit, 'kind = "static"', f'kind = "{written}"')
    assert "expected flight" in soon(["evaluate", unit, "--quiet"], 3)


def test_a_key_with_a_line_break_splits_no_sentence(unit: Path, soon) -> None:
    rewritten(unit, "[gyro]", '[gyro]\nbias_radps = "x\\n\\u202ey"\n')
    assert "bias_radps" in soon(["evaluate", unit, "--quiet"], 3)


def test_a_name_with_tex_is_drawn_as_it_stands(unit: Path, tmp_path: Path) -> None:
    rewritten(unit, 'name = "unit"', f"name = '{TEX}'")
    folder = unit.rename(tmp_path / TEX.replace("\\", ""))
    assert main(["evaluate", str(folder), "--output", str(tmp_path / "out"), "--quiet"]) == 0
    for figure in (tmp_path / "out" / "figures").glob("*.svg"):
        ET.parse(figure)  # raises where a control character stands in it


def test_figures_draw_no_formula(tmp_path: Path) -> None:
    from ins_eval.figures import style

    @style.styled
    def draw():
        figure, ax = style.sheet(2.0, TEX, TEX)
        ax.plot([1.0, 10.0], [1.0, 100.0], label=TEX)
        ax.set(yscale="log", xlabel=TEX)
        ax.set_xticks([1.0, 2.0], labels=[TEX, style.label("\x1b[1m")])
        style.legend_below(figure, ax)
        return figure

    drawing = style.svg(draw())
    words = "".join(ET.fromstring(drawing).itertext())
    assert words.count(r"$\badcmd{") == 5 and "\x1b" not in drawing
    assert "mathdefault" not in words  # the powers of ten of an axis are still set as such


@pytest.mark.parametrize("length", [1000, 100_000])
def test_a_long_value_is_shortened(unit: Path, soon, length: int) -> None:
    rewritten(unit, 'source = "baro"', f'source = "{"x" * length}"')
    assert "height.source" in soon(["evaluate", unit, "--quiet"], 3)


def test_a_long_name_is_refused_before_anything_is_made(tmp_path: Path, soon) -> None:
    """In a profile and in a mapping, whose name the recording would have had."""
    (tmp_path / "log.csv").write_bytes(csv_rows(drive(10.0, 60.0)))
    (tmp_path / "log.toml").write_text(f'name = "{"x" * 5000}"\n{CSV_MAPPING}')
    (tmp_path / "short.toml").write_text(re.sub("^name = .*$", f'name = "{"x" * 5000}"', SHORT, flags=re.MULTILINE))
    flight = ["simulate", "flight", "--profile", tmp_path / "short.toml", "--rate", "5"]
    for words in (["import", "csv", tmp_path / "log.csv"], flight):
        said = soon([*words, "-o", tmp_path / "out"], 2)
        assert "name: 5000 characters, expected at most 2000" in said
        assert not (tmp_path / "out").exists()


def test_a_long_list_is_shortened(tmp_path: Path, soon) -> None:
    file = tmp_path / "scan.csv"
    file.write_text(",".join(f"column_{k}" for k in range(500)) + "\n" + ",".join(["1"] * 500) + "\n")
    assert "and 488 more" in soon(["loop", "calibrate", file], 2)


def test_whatever_stands_in_a_sentence_it_ends() -> None:
    said = str(DataRefused(f"file: {'x' * 100_000}\n\x1b[31m, expected less; cut it"))
    assert len(said) <= LONGEST_SENTENCE and "\n" not in said
    assert said.startswith("file: xxx") and said.endswith("\\x1b[31m, expected less; cut it")
    assert shortened("as it is", 8) == "as it is"


def test_a_long_name_is_compared_soon() -> None:
    from ins_eval.errors import did_you_mean

    began = time.monotonic()
    did_you_mean("x" * 100_000, [f"name_{k}" * 5 for k in range(500)])
    assert time.monotonic() - began < 1.0


def program(*arguments: object, shell: str = "", **environment: str) -> subprocess.CompletedProcess[str]:
    """`ins-eval` as a process, with what a shell would add behind it."""
    command = " ".join(f"'{one}'" for one in (sys.executable, "-m", "ins_eval.cli", *arguments)) + f" {shell}"
    return subprocess.run(
        command, shell=True, capture_output=True, text=True, env=os.environ | environment, timeout=300, check=False
    )


def test_closed_output_is_a_sentence_before_anything_is_computed(tmp_path: Path, sound: Path, assert_sentence) -> None:
    result = program("evaluate", sound, "--output", tmp_path / "out", shell=">&-")
    assert result.returncode == 4
    assert "standard output is closed" in assert_sentence(result.stderr)
    assert not (tmp_path / "out").exists()


def test_all_streams_may_be_closed_where_nothing_is_to_be_said(tmp_path: Path, sound: Path) -> None:
    result = program("evaluate", sound, "--output", tmp_path / "out", "--quiet", shell="<&- >&- 2>&-")
    assert result.returncode == 0
    assert (tmp_path / "out" / "metrics.json").read_bytes().startswith(b"{")


def test_a_terminal_of_ascii(tmp_path: Path, sound: Path) -> None:
    """And no word of a library beside ours: matplotlib complains where its folder cannot be made."""
    (tmp_path / "file").write_text("")
    environment = {"PYTHONIOENCODING": "ascii", "MPLCONFIGDIR": str(tmp_path / "file" / "x")}
    result = program("evaluate", sound, "--output", tmp_path / "out", **environment)
    assert result.returncode == 0 and result.stderr == "", result.stderr
    assert result.stdout.isascii() and "page: " in result.stdout


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the ceiling is of Linux")
def test_more_memory_than_the_ceiling_is_a_sentence(tmp_path: Path, assert_sentence) -> None:
    """A text of 60 MB of numbers, as a list of fields, takes more than half a GiB."""
    file = tmp_path / "log.txt"
    file.write_bytes(b"0.1 0 0 0 0 0 9.8\n" * 3_500_000)
    result = program(
        *("import", "kf-gins", file, "-o", tmp_path / "out", "--memory", 0.5),
        *("--assume", "latitude_deg=30", "--assume", "longitude_deg=30"),
    )
    assert result.returncode == 4, result.stderr
    assert "more memory than its ceiling of 0.5 GiB" in assert_sentence(result.stderr)


def test_a_ceiling_that_no_run_can_keep_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    for value in ("0", "-1", "nan", "inf", "1e400", "much"):
        with pytest.raises(SystemExit) as ended:
            main(["presets", "--memory", value])
        assert ended.value.code == 2
    assert "--memory" in capsys.readouterr().err


def test_a_chamber_is_for_calibrate(tmp_path: Path, soon) -> None:
    folder = tmp_path / "chamber"
    assert main(["simulate", "chamber", "--ramps", "4", "--no-dwell", "-o", str(folder), "--quiet"]) == 0
    file = folder / "recording.toml"
    file.write_text("\n".join(line for line in file.read_text().splitlines() if not line.startswith("[accelerometer")))
    assert "calibrate" in soon(["diagnose", folder, "--quiet"], 2)


def test_a_model_is_refused_once(tmp_path: Path, soon) -> None:
    file = tmp_path / "model.toml"
    file.write_text("kind = 5\n")
    sentence = soon(["check-model", file], 2)
    assert sentence.count("kind") == 1 and sentence.count("ins-eval:") == 1


def test_the_page_names_no_file_that_is_not_there(tmp_path: Path, sound: Path) -> None:
    assert main(["evaluate", str(sound), "--output", str(tmp_path), "--quiet"]) == 0
    assert not (tmp_path / "manifest.json").exists() and "manifest.json" not in (tmp_path / "index.html").read_text()


def test_reading_a_folder_says_so(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="is a folder"):
        boundary.content(tmp_path, "a file")
    with pytest.raises(UsageError, match="there is no such folder"):
        form.read(tmp_path / "none")
