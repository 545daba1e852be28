"""Changes and ratios of the same instruments: the quantity that a claim states, with an interval that pairs them."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.streams import Streams
from ins_eval.studies.paper_a import paired

TIME_S = np.arange(0.0, 8401.0, 600.0)
SIZE = 60


def arms(simple: np.ndarray, refined: np.ndarray) -> dict:
    """Radial errors (n, m) in m, all of them to the east."""

    def of(radius: np.ndarray) -> dict:
        return {"track_m": np.stack([np.zeros_like(radius), radius], axis=2), "track_s": np.tile(TIME_S, (SIZE, 1))}

    return {"simple": of(simple), "hysteresis_refined": of(refined)}


def grown(by: float) -> dict:
    """A difference that is large and scatters much between instruments, and grows by so many m after 6000 s."""
    level = np.random.default_rng(1).normal(1000.0, 800.0, (SIZE, 1))
    refined = np.full((SIZE, TIME_S.size), 5000.0)
    return arms(refined + level + by * (TIME_S > 6000.0), refined)


def test_growth_is_that_of_the_same_instruments() -> None:
    for by in (50.0, -50.0):
        found = paired.differences(grown(by), Streams(1))
        assert found["late_growth_m"]["value"] == pytest.approx(by)
        assert found["late_growth_m"]["interval95"] == pytest.approx([by, by])  # however far the instruments are apart
        before, after = (found["difference_m"][t]["interval95"] for t in ("6000", "8400"))
        assert before[0] < after[1] and after[0] < before[1]  # overlap, so that they alone would not tell
    assert set(found["difference_m"]) == {"1800", "3600", "6000", "8400"}


def test_early_excess_is_what_exceeds_half_of_the_end() -> None:
    zero = np.zeros((SIZE, TIME_S.size))
    found = paired.differences(arms(zero + TIME_S / 8400.0, zero), Streams(1))
    assert found["early_excess_m"]["value"] == pytest.approx(3600.0 / 8400.0 - 0.5)


def test_latitude_longitude_and_position_are_told_apart() -> None:
    rng = np.random.default_rng(2)
    simple = rng.normal(size=(SIZE, TIME_S.size, 2))
    refined = simple * [1.3, 0.5]  # north grows, east shrinks
    track_s = np.tile(TIME_S, (SIZE, 1))
    found = paired.positions(
        {
            "simple": {"track_m": simple, "track_s": track_s},
            "hysteresis_refined": {"track_m": refined, "track_s": track_s},
        },
        Streams(1),
    )
    ratio = {what: e["value"] for what, e in found["position_ratio"].items()}
    assert ratio["latitude"] == pytest.approx(1.3) and ratio["longitude"] == pytest.approx(0.5)
    assert 0.5 < ratio["position"] < 1.3
    assert found["position_improved"]["latitude"] == 0.0 and found["position_improved"]["longitude"] == 1.0


def test_what_the_choice_of_the_best_run_adds() -> None:
    runs = np.linspace(0.5, 1.4, 10)  # of each instrument: gains of 50 % to -40 %, median 5 %

    def member(level: float) -> dict:
        return {
            "simple/given": {"velocity_rms_horizontal": np.full(10, level)},
            "hysteresis_refined/given": {"velocity_rms_horizontal": level * runs},
        }

    found = paired.choice_percent([member(level) for level in (0.5, 1.0, 3.0)], Streams(1))
    assert found["value"] == pytest.approx(45.0) and found["interval95"] == pytest.approx([45.0, 45.0])
    none = paired.choice_percent(
        [{name: {"velocity_rms_horizontal": np.ones(10)} for name in ("simple/given", "hysteresis_refined/given")}] * 3,
        Streams(1),
    )
    assert none["value"] == 0.0
