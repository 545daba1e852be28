"""The rule of the verdicts, from outside: what is reproduced could have failed, whatever the numbers."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.studies.papers import (
    COMPATIBLE,
    CONTRADICTS,
    NOT_COMPUTED,
    NOT_REPRODUCED,
    REPRODUCED,
    VERDICT_RULE,
    VERDICTS,
    Row,
    assembled,
    claimed,
    decided,
    judged,
    recalculated,
    row,
    simulated,
)

DRAWS = 5000


def estimate(low: float, high: float) -> dict:
    return {"value": 0.5 * (low + high), "interval95": [low, high]}


def held(printed: float, low: float, high: float, **also) -> Row:
    return simulated("x", "t", printed, estimate(low, high), "ours", **also)


def test_no_number_is_reproduced_that_zero_or_both_half_and_double_would_have_passed_for() -> None:
    rng = np.random.default_rng(4)
    seen = dict.fromkeys((REPRODUCED, COMPATIBLE, NOT_REPRODUCED), 0)
    for _ in range(DRAWS):
        middle, half, printed = rng.normal(0.0, 2.0), np.exp(rng.normal(0.0, 1.0)), rng.normal(0.0, 2.0)
        low, high = middle - half, middle + half
        found = held(printed, low, high)
        seen[found.verdict] += 1
        assert found.passes == (low, high)
        weak = low <= 0.0 <= high or (low <= printed / 2.0 <= high and low <= 2.0 * printed <= high)
        if not low <= printed <= high:
            assert found.verdict == NOT_REPRODUCED
        else:
            assert found.verdict == (COMPATIBLE if weak else REPRODUCED)
    assert min(seen.values()) > 100  # each outcome was met


@pytest.mark.parametrize("scale", [-3.0, 0.01, 1.0, 1e6])
def test_the_verdict_does_not_depend_on_unit_or_sign(scale: float) -> None:
    rng = np.random.default_rng(5)
    for _ in range(500):
        low, high = np.sort(rng.uniform(-1.0, 4.0, 2))
        printed = rng.uniform(-1.0, 4.0)
        ends = sorted((scale * low, scale * high))
        assert held(scale * printed, *ends).verdict == held(printed, low, high).verdict


def test_a_wider_range_never_turns_compatible_into_reproduced() -> None:
    rng = np.random.default_rng(6)
    for _ in range(500):
        low, high = np.sort(rng.uniform(0.1, 4.0, 2))
        printed = rng.uniform(low, high)
        if held(printed, low, high).verdict == COMPATIBLE:
            assert held(printed, low - 1.0, high + 1.0).verdict == COMPATIBLE


def test_where_something_was_put_in_the_distance_from_that_is_judged() -> None:
    assert held(-180.0, -190.0, -170.0, nothing=-200.0).verdict == REPRODUCED
    assert held(-180.0, -230.0, -170.0).verdict == REPRODUCED
    put_in = held(-180.0, -230.0, -170.0, nothing=-200.0)
    assert put_in.verdict == COMPATIBLE and "holds -200, where nothing is found" in put_in.reason
    wide = held(-180.0, -195.0, -150.0, nothing=-200.0)  # 20 from it, where 5 to 50 would have passed
    assert wide.verdict == COMPATIBLE and "half and double the distance from -200" in wide.reason


def test_a_claim_needs_the_whole_interval() -> None:
    for sign in (1.0, -1.0):
        side = "above" if sign > 0.0 else "below"

        def verdict(low: float, high: float, sign: float = sign, side: str = side) -> str:
            ends = sorted((sign * low, sign * high))
            return claimed("x", "t", estimate(*ends), "It is so.", **{side: sign * 2.0}).verdict

        assert verdict(2.5, 4.0) == REPRODUCED
        assert verdict(1.0, 4.0) == COMPATIBLE
        assert verdict(-1.0, 1.5) == NOT_REPRODUCED
    unknown = claimed("x", "t", None, None, above=0.0)
    assert unknown.verdict == NOT_REPRODUCED and unknown.reason == NOT_COMPUTED and unknown.ours is None


def test_arithmetic_passes_within_half_of_its_last_digit() -> None:
    good, bad = (recalculated("x", "t", printed, 16.234, 0.1, "So.") for printed in (16.2, 16.3))
    assert good.verdict == REPRODUCED and good.passes == pytest.approx((16.184, 16.284))
    assert bad.verdict == CONTRADICTS
    assert recalculated("x", "t", 0.0, 0.01, 0.1, "So.").verdict == COMPATIBLE  # zero tells nothing from nothing


def test_what_is_reproduced_has_to_say_how_it_could_have_failed() -> None:
    with pytest.raises(ValueError, match="could have failed"):
        row("x", "t", REPRODUCED, "Done.")
    done = row("x", "t", NOT_REPRODUCED, "Done.")
    with pytest.raises(ValueError, match="could have failed"):
        judged(done, REPRODUCED)
    assert judged(done, REPRODUCED, fails="it were not so").verdict == REPRODUCED
    assert decided("x", "t", None, None, fails="it were not so", ours=3.0).ours is None
    assert decided("x", "t", False, "No.", CONTRADICTS, fails="it were not so").verdict == CONTRADICTS


def test_what_was_chosen_in_view_is_at_most_compatible() -> None:
    of_paper = decided("y/1", "t", True, "So.", fails="it were not so")  # no number of ours
    plain = assembled([of_paper, held(1.0, 0.9, 1.1)], ("x", "y"), {})
    marked = assembled([of_paper, held(1.0, 0.9, 1.1)], ("x", "y"), {"x": "a size", "y": "another"})
    assert [one.id for one in plain] == ["x", "y/1"]
    assert [one.verdict for one in plain] == [REPRODUCED, REPRODUCED] and not plain[0].chosen
    assert [one.verdict for one in marked] == [COMPATIBLE, REPRODUCED]
    assert [one.chosen for one in marked] == ["a size", ""]


def test_the_rule_names_every_verdict() -> None:
    for verdict in VERDICTS:
        assert f'"{verdict[0].upper()}{verdict[1:]}"' in VERDICT_RULE
    assert "before the other three" in VERDICT_RULE
