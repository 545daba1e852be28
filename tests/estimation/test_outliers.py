"""Which fixes are left out, and which are not: white fixes of a car with a burst, a late clock, a jump that stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.error_model.observations import CHANNELS, SMOOTHINGS, Observations
from ins_eval.error_model.propagation import STATES
from ins_eval.estimation.noise import LONGEST_BURST, without_outliers

ROWS, AT = 600, 300
POSITION_M, VELOCITY_MPS = 2.0, 0.1
FAR_M = 40.0
LATE_S, BRAKING_MPS2 = 0.3, 6.0
MOST_BY_CHANCE = 3  # of 3600 white components beyond 4.5 sigmas of a scatter that is measured


@pytest.fixture
def seen() -> Observations:
    """Fixes once a second, white."""
    rng = np.random.default_rng(3)
    sigma = np.repeat([POSITION_M, VELOCITY_MPS, np.nan], 3) * np.ones((ROWS, 1))
    return Observations(
        (),
        residual=sigma * rng.standard_normal((ROWS, CHANNELS)),
        sigma=sigma,
        design=np.zeros((ROWS, CHANNELS, STATES)),
        of_arm=np.zeros((ROWS, 3, CHANNELS)),
        of_delay=np.zeros((ROWS, CHANNELS)),
        of_smoothing=np.zeros((ROWS, 2 * SMOOTHINGS, CHANNELS)),
        arc=np.zeros(ROWS, dtype=int),
        measured_by=("gps",) * 6 + ("",) * 3,
    )


def moved(seen: Observations, added: np.ndarray, channel: int) -> Observations:
    residual = seen.residual.copy()
    residual[:, channel] += added
    return replace(seen, residual=residual)


def left_out(seen: Observations) -> np.ndarray:
    after, count = without_outliers(seen)
    gone = np.isnan(after.residual) & np.isfinite(seen.residual)
    assert gone.sum() == count
    return gone


def during(rows: int) -> np.ndarray:
    return (np.arange(ROWS) >= AT) & (np.arange(ROWS) < AT + rows)


def test_white_fixes_stay(seen) -> None:
    assert left_out(seen).sum() <= MOST_BY_CHANCE


@pytest.mark.parametrize("rows", range(1, LONGEST_BURST + 1))
@pytest.mark.parametrize("at", ["between", "first", "last"])
def test_a_burst_is_left_out_with_all_components_of_its_fixes(seen, rows, at: str) -> None:
    here = np.roll(during(rows), {"between": 0, "first": -AT, "last": AT - rows}[at])
    gone = left_out(moved(seen, FAR_M * here, 1))
    assert gone[here, :3].all()
    assert not gone[:, 3:].any()
    assert gone[~here].sum() <= MOST_BY_CHANCE


def test_what_lasts_longer_or_does_not_come_back_is_no_burst(seen) -> None:
    assert left_out(moved(seen, FAR_M * during(3 * LONGEST_BURST), 1)).sum() <= MOST_BY_CHANCE
    assert left_out(moved(seen, FAR_M * during(ROWS), 1)).sum() <= MOST_BY_CHANCE


@pytest.mark.parametrize("sigmas", [1.0, 4.0])
def test_what_drifts_has_no_burst_at_its_ends(seen, sigmas: float) -> None:
    """A solution that drifts by several sigmas from fix to fix: the last is far from the four before, on their line."""
    assert left_out(moved(seen, sigmas * POSITION_M * np.arange(ROWS), 1)).sum() <= MOST_BY_CHANCE


def test_a_late_receiver_is_heard_where_the_car_brakes(seen) -> None:
    """Three seconds at 6 m/s^2 and 0.3 s: 18 sigmas of velocity, boxed like a burst."""
    braking = BRAKING_MPS2 * during(3)
    late = moved(seen, LATE_S * braking, 3)
    of_delay = seen.of_delay.copy()
    of_delay[:, 3] = braking
    assert left_out(late)[during(3), 3].all()  # where nothing is known of the motion
    assert left_out(replace(late, of_delay=of_delay)).sum() <= MOST_BY_CHANCE


def test_readings_of_a_bench_are_left_out_alone_only(seen) -> None:
    """Several in a row that stand apart are a run at another position."""
    apart = moved(seen, FAR_M * during(3), 0)
    after, count = without_outliers(apart, longest=1)
    assert count <= MOST_BY_CHANCE
    assert np.isfinite(after.residual[during(3), :3]).all()
