"""``ins-eval loop`` from the outside: simulated tests, the gains they give, and what is refused."""

import json

import numpy as np
import pandas as pd
import pytest

from ins_eval.cli import main

WRITTEN = {"scan.csv", "current.csv", "static.csv", "manifest.json"}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("loop") / "paper"
    assert main(["loop", "simulate", "paper-unit", "-o", str(folder), "--quiet"]) == 0
    return folder


def calibrated(folder, tmp_path, *names, options=()):
    answer = tmp_path / "gains.json"
    files = [str(folder / name) for name in names]
    assert main(["loop", "calibrate", *files, "--json", str(answer), *options]) == 0
    return json.loads(answer.read_text())


def test_tests_of_a_loop_are_written_in_full(recorded):
    assert {path.name for path in recorded.iterdir()} == WRITTEN
    scan, static = pd.read_csv(recorded / "scan.csv"), pd.read_csv(recorded / "static.csv")
    assert scan.groupby(["state", "repetition"]).size().eq(21).all()
    assert set(static["state"]) == {"before", "after", "compensated"}
    manifest = json.loads((recorded / "manifest.json").read_text())
    assert manifest["injected"] == {"forward_ppm": -200.0, "feedback_ppm": 200.0, "through": "gain"}
    assert manifest["parameters"]["pendulum"]["mass"]["unit"] == "kg"


def test_same_seed_same_bytes(recorded, tmp_path):
    for seed, same in (("1", True), ("2", False)):
        main(["loop", "simulate", "paper-unit", "-o", str(tmp_path / seed), "--seed", seed, "--quiet"])
        for name in WRITTEN - {"manifest.json"}:
            assert ((tmp_path / seed / name).read_bytes() == (recorded / name).read_bytes()) is same


def test_gains_of_the_recorded_tests(recorded, tmp_path, capsys):
    found = calibrated(recorded, tmp_path, "scan.csv", "current.csv")
    scan = pd.read_csv(recorded / "scan.csv")
    slopes = {
        key: np.polyfit(rows["n_fpga"], rows["n_out"], 1)[0] for key, rows in scan.groupby(["state", "repetition"])
    }
    drifts = [1e6 * (slopes["test", k] / slopes["reference", k] - 1.0) for k in range(1, 7)]
    assert found["forward"]["drift_ppm"]["value"] == pytest.approx(np.mean(drifts), abs=1e-4)
    low, high = found["forward"]["drift_ppm"]["interval95"]
    assert low < -180.5 < high
    assert found["forward"]["reference"]["value"] == pytest.approx(478.974, abs=0.01)
    assert found["feedback"]["reference"]["value"] == pytest.approx(-71738.85, abs=1.0)
    assert found["feedback"]["drift_ppm"]["value"] == pytest.approx(218.0, abs=10.0)
    compensation = found["compensation"]
    assert compensation["controller_gain"] == pytest.approx(1.0 + 180.5e-6, abs=10e-6)
    assert compensation["new_n_vref"] == round(524288 / (1.0 + 1e-6 * found["feedback"]["drift_ppm"]["value"]))
    said = capsys.readouterr().out
    for words in ("multiply the gain of the controller by 1.0001", "set N_VREF from 524288 to 5241", "magnet"):
        assert words in said


def test_compensation_is_what_the_static_test_then_shows(recorded):
    """193 ug to about 24 ug."""
    counts = pd.read_csv(recorded / "static.csv").groupby("state")["n_out"].mean()
    change, remaining = (1e6 * (counts[state] / counts["before"] - 1.0) for state in ("after", "compensated"))
    assert change == pytest.approx(-193.0, abs=8.0)
    assert remaining == pytest.approx(24.0, abs=8.0)


def test_a_reference_alone_gives_gains_without_a_drift(recorded, tmp_path, capsys):
    scan = pd.read_csv(recorded / "scan.csv")
    scan[(scan["state"] == "reference") & (scan["repetition"] == 1)].to_csv(tmp_path / "one.csv", index=False)
    found = calibrated(tmp_path, tmp_path, "one.csv")
    assert set(found["forward"]) == {"reference", "repetitions"}
    assert "feedback" not in found
    assert not found["compensation"]
    assert "Reference gains only" in capsys.readouterr().out


def test_single_readings_have_no_interval(tmp_path, capsys):
    (tmp_path / "c.csv").write_text(
        "state,repetition,current,n_out\nreference,1,on,-46573.03\nreference,1,off,25165.82\n"
        "test,1,on,-46563.69\ntest,1,off,25160.79\n"
    )
    found = calibrated(tmp_path, tmp_path, "c.csv", options=("--n-vref", "30000"))
    assert found["feedback"]["drift_ppm"]["value"] == pytest.approx(1e6 * (71738.85 / 71724.48 - 1.0))
    assert found["feedback"]["drift_ppm"]["interval95"] == [None, None]
    assert found["compensation"]["new_n_vref"] == 29994
    assert "one reading: none" in capsys.readouterr().out


def test_through_a_resistor_the_forward_gain_changes_by_less(tmp_path):
    main(["loop", "simulate", "paper-unit", "-o", str(tmp_path), "--through", "resistor", "--quiet"])
    truth = json.loads((tmp_path / "manifest.json").read_text())["truth"]
    assert np.mean(truth["forward_ppm"]) == pytest.approx(-180.0 + 19.5, abs=6.0)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("simulate", "papr-unit"), "did you mean 'paper-unit'"),
        (("simulate", "missing.toml"), "no such file"),
        (("simulate", "paper-unit", "--forward-ppm", "1e6"), "expected -10000 to 10000 ppm"),
        (("simulate", "paper-unit", "--feedback-ppm", "nan"), "--feedback-ppm nan"),
        (("calibrate", "missing.csv"), "no such file"),
    ],
)
def test_what_cannot_be_used_is_one_sentence_and_exit_2(tmp_path, monkeypatch, capsys, arguments, said):
    monkeypatch.chdir(tmp_path)
    output = ("-o", "out") if arguments[0] == "simulate" else ()
    assert main(["loop", *arguments, *output]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.startswith("ins-eval: ")
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "state,repetition,n_fpga,n_out\nreference,1,1,5\nreference,1,2,5\nreference,1,3,5\n",
            "does not change with N_FPGA",
        ),
        ("state,repetition,current,n_out\nreference,1,on,5\nreference,1,off,5\n", "is the same with the current on"),
        (
            "state,repetition,current,n_out\nreference,1,on,5\nreference,1,off,9\ntest,1,on,5\ntest,1,off,7\n",
            "which is no drift",
        ),
    ],
)
def test_readings_that_are_no_test_are_refused(tmp_path, capsys, text, said):
    (tmp_path / "bad.csv").write_text(text)
    assert main(["loop", "calibrate", str(tmp_path / "bad.csv")]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_an_unstable_loop_is_refused(tmp_path, capsys):
    path = tmp_path / "wild.toml"
    path.write_text(
        'extends = "digital-qfa"\n[controller]\n'
        'proportional = { value = 30.0, unit = "count/count", source = "test" }\n'
    )
    assert main(["loop", "simulate", str(path), "-o", str(tmp_path / "out")]) == 2
    assert "unstable" in capsys.readouterr().err
