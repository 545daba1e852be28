"""Improvement on data that were not used, against explicit least squares."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from ins_eval.error_model.columns import Column
from ins_eval.error_model.library import Candidate
from ins_eval.estimation.held_out import held_out
from ins_eval.estimation.study import Hypothesis
from ins_eval.estimation.whitening import Whitened

NODES, STEP_S = 1200, 10.0
FLAT = 1e-6  # prior of an effect is so wide that it does not matter
ROUNDING = 1e-9
NOISE = 0.15  # of a mean of squares of 1 over thousands of rows, several times its sigma


@dataclass(eq=False)
class Whitened9:
    """A recording whose whitened rows are given: residual (nodes, 9), NaN where nothing was measured."""

    residual: np.ndarray
    anyway: np.ndarray
    start_s: float = 3600.0

    @property
    def nuisances(self) -> tuple[Column, ...]:
        return tuple(Column("") for _ in range(self.anyway.shape[2]))

    @property
    def model(self) -> SimpleNamespace:
        return SimpleNamespace(nodes_s=self.start_s + STEP_S * np.arange(self.residual.shape[0]))

    def whitened(self, columns, position, keep) -> Whitened:
        shape = self.residual.shape
        effects = [np.where(np.isfinite(self.residual), np.reshape(one.start, shape), np.nan) for one in columns]
        kept = np.stack([self.residual, *np.moveaxis(self.anyway, 2, 0), *effects], axis=2)
        assert keep == kept.shape[2]
        return Whitened(np.empty(0), np.empty(0), 0.0, 0.0, 0, kept)


def hypothesis(*responses: np.ndarray | None) -> Hypothesis:
    made = tuple(None if one is None else Column("", start=tuple(one.ravel())) for one in responses)
    return Hypothesis(Candidate("accelerometer.bias_drift", "x", "ug/h", 1.0, next(filter(None, made))), made)


def recording(seed: int, nodes: int = NODES) -> tuple[Whitened9, np.ndarray]:
    """Fixes of position and velocity, white noise of 1, a slow response of an effect, and one nuisance."""
    rng = np.random.default_rng(seed)
    shape = (nodes, 9)
    t = np.linspace(0.0, 1.0, nodes)
    response = np.zeros(shape)
    response[:, :6] = (t**2 * np.sin(9.0 * t))[:, None] * rng.standard_normal(6)
    anyway = np.ones((*shape, 1)) * rng.standard_normal(9)[:, None]
    residual = rng.standard_normal(shape) + 0.5 * anyway[..., 0]
    residual[:, 6:] = np.nan
    residual[rng.random(shape) < 0.1] = np.nan
    return Whitened9(residual, anyway), response


def with_effect(case: Whitened9, response: np.ndarray, size: float) -> Whitened9:
    return Whitened9(case.residual + size * response, case.anyway)


def expected(residual, anyway, further, block_s: float) -> tuple[float, float]:
    """Mean square of each half as the other predicts it, with the covariance of the prediction, and the log density.

    The prior is 1 on what is uncertain anyway.
    """
    nodes = residual.shape[0]
    half = np.floor(STEP_S * np.arange(nodes) / block_s) % 2
    columns = np.concatenate([anyway, further], axis=2)
    total, density, count = 0.0, 0.0, 0
    for judged in (0.0, 1.0):
        used = np.isfinite(residual) & (half != judged)[:, None]
        left = np.isfinite(residual) & (half == judged)[:, None]
        prior = np.eye(anyway.shape[2], columns.shape[2])
        design = np.concatenate([columns[used], prior])
        p = np.linalg.lstsq(design, np.append(residual[used], np.zeros(len(prior))))[0]
        root = np.linalg.inv(np.linalg.qr(design, mode="r"))
        spread = np.eye(left.sum()) + (columns[left] @ root) @ (columns[left] @ root).T
        e = residual[left] - columns[left] @ p
        square = e @ np.linalg.solve(spread, e)
        total, density = total + square, density - 0.5 * (square + np.linalg.slogdet(spread)[1])
        count += left.sum()
    return total / count, density


@pytest.mark.parametrize(("nodes", "block_s"), [(1200, 600.0), (240, 2390.0 / 8.0)])
def test_the_numbers_are_those_of_least_squares(nodes: int, block_s: float) -> None:
    case, response = recording(1, nodes)
    case = with_effect(case, response, 3.0)
    found = held_out([case], [hypothesis(response)], np.zeros(1), [np.zeros(0)])
    late = np.concatenate([response[-(nodes // 2) :], response[: -(nodes // 2)]])
    late[np.roll(np.isnan(case.residual), nodes // 2, axis=0)] = 0.0
    none = np.zeros((*response.shape, 0))
    before, unaided = expected(case.residual, case.anyway, none, block_s)
    after, aided = expected(case.residual, case.anyway, response[..., None], block_s)
    placebo, _ = expected(case.residual, case.anyway, late[..., None], block_s)
    assert found["before"] == pytest.approx(before, rel=ROUNDING)
    assert found["after"] == pytest.approx(after, rel=FLAT)
    assert found["placebo"] == pytest.approx(placebo, rel=FLAT)
    assert found["harm_nats"] == pytest.approx(unaided - aided, rel=FLAT)


def test_a_block_that_the_others_say_nothing_of_is_no_harm() -> None:
    """A nuisance that shows in the first block only is judged with its prior, large as what it leaves there may be."""
    case, response = recording(7)
    first = np.zeros_like(case.residual)
    first[: int(600.0 / STEP_S)] = 30.0
    anyway = np.concatenate([case.anyway, first[..., None]], axis=2)
    found = held_out(
        [Whitened9(case.residual + 1.5 * first, anyway)], [hypothesis(response)], np.zeros(1), [np.zeros(0)]
    )
    assert found["before"] == pytest.approx(1.0, abs=NOISE)
    assert abs(found["harm_nats"]) < 5.0


def test_an_effect_that_is_there_lowers_and_a_placebo_does_not() -> None:
    case, response = recording(2)
    found = held_out([with_effect(case, response, 5.0)], [hypothesis(response)], np.zeros(1), [np.zeros(0)])
    assert found["after"] == pytest.approx(1.0, abs=NOISE)
    assert found["before"] > 1.5
    assert found["placebo"] > 1.5


def test_an_effect_that_is_not_there_does_not_lower() -> None:
    """Each coefficient costs about one in as many rows as there are."""
    case, response = recording(3)
    found = held_out([case], [hypothesis(response)], np.zeros(1), [np.zeros(0)])
    rows = np.isfinite(case.residual).sum()
    assert found["before"] - 10.0 / rows < found["after"] < found["before"] + 20.0 / rows


def test_what_was_taken_off_counts_as_before() -> None:
    """A recording navigated with its effect has the same numbers as one that was not."""
    case, response = recording(4)
    around = held_out([with_effect(case, response, 5.0)], [hypothesis(response)], np.zeros(1), [np.zeros(0)])
    navigated = held_out([case], [hypothesis(response)], np.array([5.0]), [np.zeros(0)])
    for key in ("before", "after", "placebo"):
        assert navigated[key] == pytest.approx(around[key], rel=FLAT)
    assert navigated["before"] > 1.5


def test_recordings_count_by_their_rows() -> None:
    """An effect of one recording only is no coefficient of the other."""
    (a, of_a), (b, _) = recording(5), recording(6, 600)
    a = with_effect(a, of_a, 5.0)
    together = held_out([a, b], [hypothesis(of_a, None)], np.zeros(1), [np.zeros(0)] * 2)
    alone = held_out([a], [hypothesis(of_a)], np.zeros(1), [np.zeros(0)])
    beside, _ = expected(b.residual, b.anyway, np.zeros((*b.residual.shape, 0)), 600.0)
    rows = [np.isfinite(one.residual).sum() for one in (a, b)]
    for key in ("before", "after", "placebo"):
        mean = (rows[0] * alone[key] + rows[1] * beside) / sum(rows)
        assert together[key] == pytest.approx(mean, rel=FLAT)
    assert "one noise model for all three" in together["measure"]
