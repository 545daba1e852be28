"""Named random streams: reproducible, independent of order and process, apart from each other."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from ins_eval.streams import Streams

BOUND = 4.5 / np.sqrt(20000)  # of a correlation of 20 000 draws


def draws(streams: Streams, count: int = 20000) -> np.ndarray:
    return streams.rng().standard_normal(count)


def test_a_stream_is_the_same_whatever_was_asked_before() -> None:
    root = Streams(5)
    first = draws(root.at("instrument", 7, "creep"))
    draws(root.at("gps"))
    draws(root.at("instrument", 7))
    assert np.array_equal(first, draws(Streams(5).at("instrument").at(7).at("creep")))
    assert np.array_equal(first, draws(root.at("instrument", 7, "creep")))


def test_a_stream_is_the_same_in_another_process() -> None:
    """Names are hashed by a fixed rule, not by Python's own, which differs from process to process."""
    code = "from ins_eval.streams import Streams; print(Streams(5).at('a', 3, 'noise').rng().bytes(32).hex())"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == Streams(5).at("a", 3, "noise").rng().bytes(32).hex()


def test_the_rule_stays_as_it_is() -> None:
    """PCG64 of SeedSequence(entropy, spawn_key = CRC-32 of the names): a stored result can be made again."""
    from zlib import crc32

    expected = np.random.Generator(np.random.PCG64(np.random.SeedSequence(5, spawn_key=(crc32(b"gps"), 4))))
    assert np.array_equal(draws(Streams(5).at("gps", 4)), expected.standard_normal(20000))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (Streams(5).at("a"), Streams(5).at("b")),
        (Streams(5).at("a"), Streams(6).at("a")),
        (Streams(5).at("a", 0), Streams(5).at("a", 1)),
        (Streams(5).at("a", "b"), Streams(5).at("b", "a")),
        (Streams(5).at("a"), Streams(5).at("a", 0)),
        (Streams(5), Streams(5).at("a")),
    ],
)
def test_streams_are_independent(one: Streams, other: Streams) -> None:
    assert abs(np.corrcoef(draws(one), draws(other))[0, 1]) < BOUND


def test_the_names_of_this_program_do_not_collide() -> None:
    """Effects, axes and runs, by the way they are named."""
    names = [f"accelerometer.{axis}" for axis in "xyz"] + ["gyros", "gps", "baro", "accelerometers", "chamber", "oven"]
    names += ["bias", "scale", "asymmetry", "instability", "angle_random_walk", "gps.position", "gps.velocity"]
    names += ["creep", "magnet_hysteresis", "turn_on", "in_run", "noise", "samples", "unit", "instrument", "flight"]
    assert len({Streams(1).at(name).path for name in names}) == len(names)
