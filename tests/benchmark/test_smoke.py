"""A few concealed cases through the whole way: made, diagnosed by the command line, scored.

Drawn from the development set by a rule, not by how they come out: nulls of four kinds, and of each kind of sensor the
first case of seed 7 with a short path whose oracle has D of at least 100 and a margin of at least 20 nats, so that
what is asserted has room.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import pytest

from benchmark.runners import make, run
from benchmark.scores.score import beats_placebo, read, score

SEED, RATE_HZ = 7, 20
ANSWER = Callable[[str, int], dict]
CHAMBER = ("single", 45)
FAST_NULLS = (("adversarial", 4),)  # box
FAST_HIDDEN = (("single", 80), CHAMBER)  # earth.gravity_height, accelerometer.bias_creep y
NULLS = (*FAST_NULLS, ("null", 3), ("null", 9))  # wing rock, static: tests/diagnosis/test_null.py is fast
# gps.time_offset, gyro.bias_temperature_rate y, accelerometer.bias_step y
HIDDEN = (*FAST_HIDDEN, ("single", 33), ("single", 24), ("single", 5))
OUTSIDE = (("outside", 0),)  # a bias that follows the static pressure, which is recorded


def of_cases(cases: tuple[tuple[str, int], ...], fast: tuple[tuple[str, int], ...]):
    """The test for each of the cases, slow for those that are not among the fast ones."""
    marked = [pytest.param(one, marks=() if one in fast else pytest.mark.slow) for one in cases]
    return pytest.mark.parametrize("case", marked)


@pytest.fixture(scope="module")
def answer(tmp_path_factory) -> ANSWER:
    """Of a kind and an index: what was right and wrong of the answer."""

    @cache
    def answered(kind: str, index: int) -> dict:
        folder = tmp_path_factory.mktemp(f"{kind}-{index}")
        options = ["--kind", kind, "--first", str(index), "--seed", str(SEED), "--rate", str(RATE_HZ), "--no-oracle"]
        assert make.main([*options, "-o", str(folder)]) == 0
        cases = {path.name: run.recordings(path) for path in (folder / "recordings").iterdir()}
        assert run.run(cases, folder / "answers") == []
        (one,) = score(list(read(folder / "truth").values()), read(folder / "answers"))["records"]
        return one

    return answered


@of_cases(NULLS, FAST_NULLS)
def test_where_nothing_is_concealed_the_answer_is_no_mismatch(answer, case):
    assert answer(*case)["verdict"] == "no mismatch", answer(*case)["named"]


@of_cases(HIDDEN, FAST_HIDDEN)
def test_a_clear_effect_is_named_or_listed(answer, case):
    one = answer(*case)
    assert one["found"], (one["truth"], one["verdict"], one["listed"])
    assert not one["wrong"]


@pytest.mark.parametrize("cases", [FAST_HIDDEN, pytest.param(HIDDEN, marks=pytest.mark.slow)])
def test_most_clear_effects_are_named_first(answer, cases):
    """One may stand second: the margin is that of an oracle that knows the noise."""
    assert sum(answer(*case)["first"] for case in cases) >= len(cases) - 1


@of_cases(tuple(case for case in HIDDEN if case != CHAMBER), FAST_HIDDEN)  # that one is no flight
def test_what_is_named_fits_unused_data_better_than_the_placebo(answer, case):
    assert beats_placebo(answer(*case)), answer(*case)["fit"]


@pytest.mark.slow
@pytest.mark.parametrize("case", OUTSIDE)
def test_an_effect_that_has_no_name_is_found_and_given_no_wrong_one(answer, case):
    one = answer(*case)
    assert one["heard"]
    assert not one["wrong"], one["named"]
