"""Files of the form with bytes changed at random: a recording or one sentence, and soon, whatever the bytes."""

from __future__ import annotations

import runpy
import time
from pathlib import Path

import numpy as np
import pytest

from ins_eval.errors import DataRefused, UsageError
from ins_eval.recording import form
from tests.faults.mutations import mutated

HANGS_S = 30.0

_form = runpy.run_path(str(Path(__file__).with_name("test_form.py")))
flight_of, as_csv = _form["flight_of"], _form["as_csv"]

FILES = ("recording.toml", "imu.csv", "imu.parquet", "gps.csv", "gps.parquet", "reference.csv")


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> dict[str, bytes]:
    root = tmp_path_factory.mktemp("sound")
    recording = flight_of(np.random.default_rng(9), samples=60)
    parquet = form.write(recording, root / "parquet")
    csv = form.write(recording, root / "csv")
    for name in ("imu", "gps", "reference"):
        as_csv(csv, name)
    return {name: ((csv if name.endswith("csv") else parquet) / name).read_bytes() for name in FILES}


def try_many(sound: dict[str, bytes], folder: Path, seeds: range) -> None:
    folder.mkdir()
    outcomes = {"read": 0, "refused": 0}
    for seed in seeds:
        rng = np.random.default_rng(seed)
        chosen = FILES[seed % len(FILES)]
        for name in FILES:
            folder.joinpath(name).unlink(missing_ok=True)
        form_of = chosen.rpartition(".")[2] if chosen != "recording.toml" else "csv"
        tables = [f"imu.{form_of}", f"gps.{form_of}", "reference.csv", "recording.toml"]
        for name in tables:
            folder.joinpath(name).write_bytes(sound[name])
        folder.joinpath(chosen).write_bytes(mutated(chosen, sound[chosen], rng))
        began = time.perf_counter()
        try:
            form.read(folder)
            outcomes["read"] += 1
        except (DataRefused, UsageError) as refused:
            outcomes["refused"] += 1
            assert str(refused).isprintable(), seed
        assert time.perf_counter() - began < HANGS_S, seed
    assert min(outcomes.values()) > len(seeds) // 50, outcomes  # both do happen


def test_some(sound, tmp_path):
    try_many(sound, tmp_path / "m", range(300))


@pytest.mark.slow
def test_many(sound, tmp_path):
    try_many(sound, tmp_path / "m", range(1000, 6000))
