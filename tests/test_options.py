"""One set of options over all verbs: names, meanings, replaced names, version, completion, progress."""

from __future__ import annotations

import argparse
import io
import json
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from ins_eval import prepare
from ins_eval.cli import SHELLS, leaves, main, make_parser
from ins_eval.progress import progress

SHARED = ("-o", "--output", "--json", "--quiet", "--seed", "--workers", "--memory", "--ensemble", "--belief")
EVERYWHERE = ("--json", "--quiet", "--memory")
REPLACED = (
    (["diagnose", "one", "--report", "page"], "--report is called -o, --output now"),
    (["calibrate", "chamber", "-o", "model.toml"], "--write-model FILE"),
    (["loop-report", "--population", "40"], "--population is called --ensemble now"),
    (["loop", "simulate", "paper-unit", "-o", "tests", "--unit", "3"], "--unit is called --instrument now"),
)


def verbs() -> dict[str, argparse.ArgumentParser]:
    (below,) = (a for a in make_parser()._actions if isinstance(a, argparse._SubParsersAction))
    return {parser.prog.removeprefix("ins-eval "): parser for parser in leaves(below)}


def option(parser: argparse.ArgumentParser, name: str) -> argparse.Action | None:
    return parser._option_string_actions.get(name)


@pytest.mark.parametrize("name", verbs())
def test_every_verb_takes_the_options_of_all(name: str) -> None:
    parser = verbs()[name]
    assert all(option(parser, one) for one in EVERYWHERE)
    assert option(parser, "-o") is option(parser, "--output")
    assert {one for one in parser._option_string_actions if len(one) == 2} <= {"-h", "-o"}


@pytest.mark.parametrize("name", SHARED)
def test_an_option_means_the_same_in_every_verb(name: str) -> None:
    found = [action for parser in verbs().values() if (action := option(parser, name))]
    assert len(found) > 1
    assert (
        len({(action.dest, action.metavar, type(action), getattr(action.type, "__qualname__", "")) for action in found})
        == 1
    )
    if name not in ("-o", "--output", "--ensemble"):  # which say what folder it is, and of how many
        assert len({action.help for action in found}) == 1


@pytest.mark.parametrize(("arguments", "said"), REPLACED, ids=lambda value: value if isinstance(value, str) else "")
def test_a_replaced_name_is_refused_with_the_new_one(arguments: list[str], said: str, capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert said in capsys.readouterr().err.splitlines()[-1]


def test_numbers_go_to_a_file_or_in_place_of_the_text(tmp_path: Path, capsys) -> None:
    assert main(["check-model", "simple", "--json", "-"]) == 0
    printed = capsys.readouterr().out
    assert json.loads(printed)["refusals"] and not any(json.loads(printed)["refusals"].values())
    assert main(["check-model", "simple", "--quiet", "--json", str(tmp_path / "found.json")]) == 0
    assert capsys.readouterr().out == ""
    assert (tmp_path / "found.json").read_text() == printed


def test_version_is_that_of_the_package(capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    assert capsys.readouterr().out == f"ins-eval {version('ins-eval')}\n"


@pytest.mark.parametrize("shell", SHELLS)
def test_completion_is_read_by_its_shell(shell: str, tmp_path: Path, capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--completion", shell])
    assert ended.value.code == 0
    script = tmp_path / "completion"
    script.write_text(capsys.readouterr().out)
    assert all(name.split()[0] in script.read_text() for name in verbs())
    if shell == "bash":
        asked = f"source {script}; COMP_WORDS=(ins-eval eval); COMP_CWORD=1; _shtab_ins_eval; echo ${{COMPREPLY[@]}}"
        found = subprocess.run(["bash", "-c", asked], capture_output=True, text=True, check=True)
        assert found.stdout.split() == ["evaluate"]
    elif shutil.which(shell):
        subprocess.run([shell, "--no-execute", str(script)], check=True)


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("stream", "line_s"), [(Terminal(), 60.0), (io.StringIO(), 0.0), (io.StringIO(), 60.0)])
def test_progress_is_a_bar_on_a_terminal_and_lines_elsewhere(
    stream: io.StringIO, line_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stderr", stream)
    with progress(3, "instruments", quiet=False, line_s=line_s) as bar:
        for _ in range(3):
            bar.update()
    text = stream.getvalue()
    if stream.isatty():
        assert "\r" in text and "instruments: 100%" in text
    elif line_s:
        assert text == ""  # over before the first minute
    else:
        lines = text.splitlines()
        assert len(lines) >= 3 and "\r" not in text
        assert all(line.startswith(f"instruments: {min(k, 3)} of 3 after 00:00") for k, line in enumerate(lines[:4]))


def test_what_an_install_compiles_is_asked_for_as_verbs_are(tmp_path) -> None:
    for words in prepare.commands(tmp_path):
        make_parser().parse_args(words)
