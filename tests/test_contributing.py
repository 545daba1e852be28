"""The guides of CONTRIBUTING.md, followed to the letter in a copy of the checkout."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from textwrap import dedent, indent

import pytest

LONGEST = 55  # lines of a guide: one page
COPIED = (
    "ins_eval",
    "benchmark",
    "tests",
    "docs",
    "trajectories",
    "pyproject.toml",
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
)
BLOCK = re.compile(r"^( *)```(\w*)\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)
GUIDES = ("Add an effect", "Add a reader of a log format", "Add a compensation model")


def guide(repository: Path, title: str) -> str:
    text = (repository / "CONTRIBUTING.md").read_text()
    return re.search(rf"^## {title}\n.*?(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)[0]


def end_of(source: str, name: str) -> int:
    """Where the table or tuple `name` of a module ends, or that which a function of this name returns."""
    for node in ast.parse(source).body:
        targets = getattr(node, "targets", [getattr(node, "target", node)])
        if name in [getattr(one, "id", getattr(one, "name", None)) for one in targets]:
            returned = [inner for inner in ast.walk(node) if isinstance(inner, ast.Return)]
            value = returned[-1].value if returned else node.value
            lines = source.splitlines(keepends=True)
            bare = "".join(lines[: value.end_lineno - 1]) + lines[value.end_lineno - 1][: value.end_col_offset]
            return len(bare) - 1
    raise AssertionError(f"there is no '{name}'")


def insert(file: Path, name: str, block: str) -> None:
    """A row at the end of the table or tuple `name`."""
    source = file.read_text()
    end = end_of(source, name)
    before = source[:end].rstrip(" ")
    closing = " " * (end - len(before))
    assert before.endswith(",\n"), f"{file}: the last row of {name}"
    file.write_text(before + indent(block, closing + "    ") + closing + source[end:])


def append(file: Path, heading: str, row: str) -> None:
    """A row at the end of the table under a heading of a page."""
    before, found, after = file.read_text().partition(f"\n## {heading}\n")
    assert found
    table = re.search(r"(^\|.*\n)+", after, re.MULTILINE)
    file.write_text(before + found + after[: table.end()] + row + after[table.end() :])


def follow(copy: Path, words: str, block: str) -> None:
    """What the words before a block say about it."""
    words = " ".join(words.split())
    if new := re.search(r"[Aa] new file `([^`]+)`:$", words):
        (copy / new[1]).write_text(block)
    elif row := re.search(r"in the table `([^`]+)` of `([^`]+)`:$", words):
        append(copy / row[2], row[1], block)
    elif row := re.search(r"in `(\w+)` of `([^`]+)`(?:;.*|, with `(.*)` at the top)?:$", words):
        insert(copy / row[2], row[1], block)
        if row[3]:
            file = copy / row[2]
            future = "from __future__ import annotations\n"
            assert file.read_text().count(future) == 1
            file.write_text(file.read_text().replace(future, f"{future}\n{row[3]}\n"))
    else:
        raise AssertionError(f"the guide does not say where this belongs: {words[-120:]}")


@pytest.fixture
def run(tmp_path: Path) -> Callable[[str], str]:
    """Run a line of a guide in the copy, with the tools of this environment."""
    tools = {"python": "-m", "ins-eval": "-m ins_eval.cli", "ruff": "-m ruff", "lint-imports": ""}

    def line(command: str) -> str:
        tool = re.match(r"\.venv/bin/([\w-]+)", command)
        assert tool and tool[1] in tools, command
        python = {"python": sys.executable, "lint-imports": str(Path(sys.executable).parent / "lint-imports")}
        here = python.get(tool[1], f"{sys.executable} {tools[tool[1]]}")
        environment = {**os.environ, "PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
        environment.pop("PYTEST_ADDOPTS", None)
        words = here + command.removeprefix(tool[0])
        options = {"cwd": tmp_path, "env": environment, "capture_output": True, "text": True, "check": False}
        done = subprocess.run(words, shell=True, **options)
        assert done.returncode == 0, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
        return done.stdout

    return line


def followed(repository: Path, copy: Path, title: str, run: Callable[[str], str]) -> dict[str, str]:
    """Follow a guide; what each of its commands printed."""
    leave = shutil.ignore_patterns("*.part", ".hypothesis")
    for name in COPIED:
        source = repository / name
        shutil.copytree(source, copy / name, ignore=leave) if source.is_dir() else shutil.copy2(source, copy / name)
    text, last, printed = guide(repository, title), 0, {}
    for block in BLOCK.finditer(text):
        words, last = text[last : block.start()], block.end()
        if block[2] == "console":
            run(".venv/bin/ruff check --fix ins_eval tests")
            for command in re.findall(r"^\$ (.*)$", block[3], re.MULTILINE):
                printed[command] = run(command)
        else:
            follow(copy, words, dedent(block[3]))
    run(".venv/bin/ruff check ins_eval tests")
    run(".venv/bin/lint-imports --no-logo")
    return printed


def passed(printed: str) -> int:
    """How many tests a command ran, none of which failed."""
    counted = re.search(r"(\d+) passed", printed)
    return int(counted[1]) if counted else 0


def test_every_guide_is_one_page_and_is_followed_here(repository: Path) -> None:
    titles = re.findall(r"^## (.*)$", (repository / "CONTRIBUTING.md").read_text(), re.MULTILINE)
    assert tuple(titles) == GUIDES
    assert all(len(guide(repository, title).splitlines()) <= LONGEST for title in titles)


def test_an_effect_is_added(repository: Path, tmp_path: Path, run) -> None:
    printed = followed(repository, tmp_path, GUIDES[0], run)
    assert all(passed(text) >= 5 for text in printed.values()), printed
    vocabulary = "-c 'from ins_eval.effects import VOCABULARY; print(*VOCABULARY)'"
    assert "accelerometer.bias_temperature_cubic" in run(f".venv/bin/python {vocabulary}").split()


def test_a_reader_is_added(repository: Path, tmp_path: Path, run) -> None:
    tests, _, imported = followed(repository, tmp_path, GUIDES[1], run).values()
    assert passed(tests) >= 7
    assert "because the format has it so" in imported
    assert (tmp_path / "parked" / "imu.parquet").exists()
    start = tomllib.loads((tmp_path / "parked" / "recording.toml").read_text())["start"]
    assert start["latitude_deg"] == pytest.approx(30.0)


def test_a_compensation_model_is_added(repository: Path, tmp_path: Path, run) -> None:
    readme = (repository / "README.md").read_text()
    (tmp_path / "my.py").write_text(re.search(r"```python\n(# my\.py\n.*?)```", readme, re.DOTALL)[1])
    checked, tests = followed(repository, tmp_path, GUIDES[2], run).values()
    assert ": ok" in checked and "refused" not in checked
    assert passed(tests) >= 4
    assert "fit" in run(".venv/bin/ins-eval check-model simple_piecewise")


def test_a_guide_that_says_nowhere_is_not_followed(tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match="does not say where"):
        follow(tmp_path, "Somewhere:", "x = 1\n")
    (tmp_path / "a.py").write_text("ROWS = {\n    1: 2,\n}\n")
    follow(tmp_path, "1. The row, in `ROWS` of `a.py`:", "3: 4,\n")
    assert (tmp_path / "a.py").read_text() == "ROWS = {\n    1: 2,\n    3: 4,\n}\n"
    with pytest.raises(AssertionError, match="no 'OTHERS'"):
        follow(tmp_path, "1. The row, in `OTHERS` of `a.py`:", "3: 4,\n")
