"""``ins-eval import``: read, examine, validate, write in the form, say what was found; exit codes."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from ins_eval.cli import main
from ins_eval.commands.import_recording import run
from ins_eval.errors import DataRefused, UsageError
from ins_eval.readers import FORMATS, find
from ins_eval.recording import form
from ins_eval.wording import in_symbols

GOOD, USAGE, REFUSED = 0, 2, 3
DEGREES_ROUNDING = 1e-15
LOST, LONG = (1000, 1200, 1500), range(2000, 2400)  # rows of 50 Hz


@pytest.fixture
def log(tmp_path, made):
    path = tmp_path / "log.mat"
    path.write_bytes(made.apm_mat(lasted_s=70.0))
    return path


def test_what_was_read_lies_in_the_form_with_its_notes(tmp_path, log, capsys):
    assert run("apm-mat", log, tmp_path / "out", ["gps.time_offset_s=0.25"]) == GOOD
    printed = capsys.readouterr().out.splitlines()
    assert printed[-1] == f"recording: {tmp_path / 'out'}"
    written = form.read(tmp_path / "out")
    assert set(printed[:-1]) <= {in_symbols(note) for note in written.notes}
    assert written.belief.gps.time_offset_s == 0.25
    read = FORMATS["apm-mat"].read(log, {})
    np.testing.assert_array_equal(written.imu.gyro, read.imu.gyro)
    np.testing.assert_array_equal(written.gps.velocity_n, read.gps.velocity_n)
    np.testing.assert_allclose(written.reference.attitude_rad, read.reference.attitude_rad, atol=DEGREES_ROUNDING)


def test_our_own_form_is_copied(tmp_path, log):
    run("apm-mat", log, tmp_path / "one")
    assert run("ins-recording", tmp_path / "one", tmp_path / "two") == GOOD
    one, two = form.read(tmp_path / "one"), form.read(tmp_path / "two")
    np.testing.assert_array_equal(one.imu.accelerometer, two.imu.accelerometer)
    assert (one.start, one.belief, one.notes) == (two.start, two.belief, two.notes)
    run("ins-recording", tmp_path / "one", tmp_path / "two", ["gps.time_offset_s=0.1"])
    assert form.read(tmp_path / "two").belief.gps.time_offset_s == 0.1


@pytest.mark.parametrize("form_of_imu", ["increment", "rate"])
def test_lost_samples_of_our_own_form_are_filled_and_marked(tmp_path, log, form_of_imu):
    """Rows that are gone, a row without numbers, and a gap of seconds, at which the recording is cut."""
    run("apm-mat", log, tmp_path / "one")
    whole = form.read(tmp_path / "one")
    table = pd.read_parquet(tmp_path / "one" / "imu.parquet")
    if form_of_imu == "rate":
        sensors = [name for name in table if name.startswith(("gyro_", "accel_"))]
        table[sensors] = table[sensors].div(np.diff(table["time_s"], prepend=whole.start.time_s), axis=0)
        head = tmp_path / "one" / "recording.toml"
        head.write_text(head.read_text().replace('"increment"', '"rate"'))
    table.loc[LOST[0], "gyro_x"] = np.nan
    table.drop(index=[*LOST[1:], *LONG]).to_parquet(tmp_path / "one" / "imu.parquet")
    with pytest.raises(DataRefused, match=f"row {LOST[0] + 1}, column gyro_x"):
        form.read(tmp_path / "one")
    assert run("ins-recording", tmp_path / "one", tmp_path / "two") == GOOD
    parts = [form.read(tmp_path / f"two-{k}") for k in (1, 2)]
    filled = parts[0].imu.filled
    np.testing.assert_array_equal(np.flatnonzero(filled), np.array(LOST))
    assert parts[1].imu.filled is None
    step_s = np.diff(whole.imu.time_s).mean()
    np.testing.assert_allclose(parts[0].imu.time_s, whole.imu.time_s[: LONG[0]], atol=0.1 * step_s)
    turned, true = parts[0].imu.gyro.sum(axis=0), whole.imu.gyro[: LONG[0]].sum(axis=0)
    assert np.abs(turned - true).max() < len(LOST) * np.abs(whole.imu.gyro[: LONG[0]]).max()
    run("ins-recording", tmp_path / "one", tmp_path / "three", ["gaps=bridge"])
    assert form.read(tmp_path / "three").imu.filled.sum() == len(LOST) + len(LONG)


@pytest.mark.parametrize(
    ("assume", "said"),
    [
        (["axes"], "expected KEY=VALUE"),
        (["=FRD"], "expected KEY=VALUE"),
        (["axes=FRD", "axes=FLU"], "is given twice"),
        (["axis=FRD"], "apm-mat does not know it; did you mean 'axes'"),
        (["mapping=x"], "apm-mat does not know it"),
    ],
)
def test_assumptions_that_are_none(tmp_path, log, assume, said):
    with pytest.raises(UsageError, match=said):
        run("apm-mat", log, tmp_path / "out", assume)
    assert not (tmp_path / "out").exists()


def test_a_format_that_is_not_known():
    with pytest.raises(UsageError, match="did you mean 'apm-mat'"):
        find("apm-matt")
    assert all(known.description and "\n" not in known.description for known in FORMATS.values())


def test_exit_codes_and_one_sentence(tmp_path, log, capsys):
    out = ["-o", str(tmp_path / "out")]
    assert main(["import", "apm-mat", str(log), *out]) == GOOD
    assert main(["import", "apm-mat", str(tmp_path / "absent.mat"), *out]) == USAGE
    assert main(["import", "apm-mat", str(tmp_path), *out]) == USAGE
    assert main(["import", "psins-mat", str(log), *out]) == REFUSED
    failures = capsys.readouterr().err.splitlines()
    assert len(failures) == 3 and all(line.startswith("ins-eval: ") for line in failures)


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_every_format_refuses_a_path_that_names_no_file(tmp_path, name):
    with pytest.raises(UsageError):
        run(name, tmp_path / "absent", tmp_path / "out")
