"""Cases go through the command line, answers are kept, failures are said."""

from __future__ import annotations

import json
import shutil

import pytest

from benchmark.runners import run

ANSWER = json.dumps({"format": "ins-diagnosis/1", "verdict": "no mismatch"})
DESCRIPTION = 'format = "ins-recording/1"\nkind = "flight"\nname = "empty"\n'


def answered(folder, name, package) -> None:
    (folder / f"{name}.json").write_text(ANSWER)
    (folder / run.RUNS).write_text(json.dumps({name: {"seconds": 1.0, "package": package}}))


def test_the_recordings_of_a_case_are_its_folder_or_those_in_it(tmp_path):
    for name in ("one", "two/second", "two/first"):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "recording.toml").write_text(DESCRIPTION)
    assert run.recordings(tmp_path / "one") == [tmp_path / "one"]
    assert run.recordings(tmp_path / "two") == [tmp_path / "two" / "first", tmp_path / "two" / "second"]


def test_a_refused_recording_leaves_its_sentence_and_is_tried_again(tmp_path, capsys):
    case = tmp_path / "recordings" / "case-1"
    case.mkdir(parents=True)
    (case / "recording.toml").write_text(DESCRIPTION)
    answers = tmp_path / "answers"
    assert run.main([str(case.parent), str(answers), "--workers", "1"]) == 0
    code, sentence = (answers / "case-1.error").read_text().splitlines()
    assert code == "exit code 3"
    assert "case-1" in sentence
    assert "1 cases, 1 failed" in capsys.readouterr().out
    assert not (answers / "case-1.json").exists()


def test_an_answer_of_this_package_is_kept(tmp_path):
    answered(tmp_path, "case-1", run.package_hash())
    assert run.whole(tmp_path, "case-1", run.read_runs(tmp_path), run.package_hash())
    assert run.run({"case-1": [tmp_path / "nowhere"]}, tmp_path) == []
    assert (tmp_path / "case-1.json").read_text() == ANSWER


@pytest.mark.parametrize("spoil", ["other package", "half", "gone"])
def test_an_answer_that_is_old_or_broken_is_made_anew(tmp_path, spoil):
    answered(tmp_path, "case-1", "0" * 64 if spoil == "other package" else run.package_hash())
    if spoil == "half":
        (tmp_path / "case-1.json").write_text(ANSWER[:20])
    elif spoil == "gone":
        (tmp_path / "case-1.json").unlink()
    assert not run.whole(tmp_path, "case-1", run.read_runs(tmp_path), run.package_hash())


def test_a_folder_without_cases_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit):
        run.main([str(tmp_path), str(tmp_path / "answers")])
    assert "no case that matches" in capsys.readouterr().err


def test_the_package_is_known_by_its_bytes(tmp_path, repository):
    copy = tmp_path / "ins_eval"
    shutil.copytree(repository / "ins_eval", copy, ignore=shutil.ignore_patterns("__pycache__"))
    before = run.package_hash(copy)
    (copy / "units.py").write_text((copy / "units.py").read_text() + "\n")
    assert run.package_hash(copy) != before
