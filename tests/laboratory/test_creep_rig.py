"""The creep rig: Fig. 3's statements, the Prony series against closed form and another integrator, Tables 2 and 3."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ins_eval.errors import UsageError
from ins_eval.laboratory.creep_rig import (
    CreepRig,
    Tables,
    printed_tables,
    standing,
    statistics,
)
from ins_eval.streams import Streams

CONTAINER_C = (-55.0, 30.0, 85.0)
# Paper A, below Fig. 3: at once, then slowly in 300 min; the block at -55 degC shrank
AT_ONCE_UM = (-7.696, 7.491, 12.51)
SLOWLY_UM = (-0.377, 0.761, 2.710)
# recomputed from Tables 2 and 3: (max - min) / #1; the paper prints 84.88, 42.44, 77.60 and 1.01, 1.32, 5.8
CREEP_VARIATION_PERCENT = (86.74, 53.48, 77.60)
THERMAL_VARIATION_PERCENT = (1.01, 1.36, 6.95)
CREEP_CV_PERCENT, THERMAL_CV_PERCENT = (29.5, 17.5, 24.1), (0.29, 0.38, 2.06)
CREEP_MEAN_UM, THERMAL_MEAN_UM = (0.415, 0.783, 3.077), (7.698, 7.486, 12.577)
# jb-kt8, [creep]
TAU_MIN, WEIGHTS, FASTER_PER_C = np.array((8.0, 40.0, 120.0)), np.array((0.3, 0.35, 0.35)), 60.0
EXPERIMENTS = 4000


@pytest.fixture(scope="module")
def rig() -> CreepRig:
    return CreepRig()


@pytest.fixture(scope="module")
def drawn(rig: CreepRig) -> Tables:
    return rig.repeated(Streams(7), EXPERIMENTS)


def test_statistics_of_tables_2_and_3() -> None:
    tables = printed_tables()
    creep, thermal = statistics(tables.creep_um), statistics(tables.thermal_um)
    assert creep.mean_um == pytest.approx(CREEP_MEAN_UM, abs=0.5e-3)
    assert thermal.mean_um == pytest.approx(THERMAL_MEAN_UM, abs=0.5e-3)
    assert creep.cv_percent == pytest.approx(CREEP_CV_PERCENT, abs=0.06)
    assert thermal.cv_percent == pytest.approx(THERMAL_CV_PERCENT, abs=0.006)
    assert creep.variation_percent == pytest.approx(CREEP_VARIATION_PERCENT, abs=0.005)
    assert thermal.variation_percent == pytest.approx(THERMAL_VARIATION_PERCENT, abs=0.006)


def test_statistics_of_numbers_that_can_be_done_by_hand() -> None:
    found = statistics(np.array([[2.0, 1.0, 3.0], [4.0, 4.0, 4.0]]))
    assert found.mean_um == pytest.approx([2.0, 4.0])
    assert found.cv_percent == pytest.approx([50.0, 0.0])
    assert found.variation_percent == pytest.approx([100.0, 0.0])


@pytest.mark.parametrize("k", range(3))
def test_figure_3(rig: CreepRig, k: int) -> None:
    block = rig.first()[k]
    assert block.container_c == CONTAINER_C[k]
    assert block.time_min[[0, -1]] == pytest.approx([0.0, 300.0])
    assert block.temperature_c[-1] == pytest.approx(CONTAINER_C[k], abs=1e-6)
    assert block.thermal_um[-1] == pytest.approx(AT_ONCE_UM[k], abs=1e-6)
    assert block.creep_um[-1] == pytest.approx(SLOWLY_UM[k], abs=1e-6)
    assert block.elongation_um[-1] == pytest.approx(AT_ONCE_UM[k] + SLOWLY_UM[k], abs=1e-6)
    assert block.elongation_um[0] == 0.0
    # at once: with the block's temperature, within minutes; slowly: all the way and never back
    assert np.interp(10.0, block.time_min, block.thermal_um) == pytest.approx(AT_ONCE_UM[k], rel=0.01)
    assert np.all(np.diff(block.creep_um) * np.sign(SLOWLY_UM[k]) > 0.0)


@pytest.mark.parametrize("k", range(3))
def test_creep_in_a_block_that_is_warm_at_once_is_a_prony_series(k: int) -> None:
    block = CreepRig(block_lag_s=0.01).relaxation(k, 1.0, 1.0)
    tau_min = TAU_MIN * np.exp(-(CONTAINER_C[k] - 22.0) / FASTER_PER_C)
    reached = 1.0 - np.exp(-np.outer(block.time_min, 1.0 / tau_min)) @ WEIGHTS
    one_point = 10.0 / 60.0 / tau_min[0]  # the step is spread over one point of the grid
    assert np.abs(block.creep_um) == pytest.approx(reached / reached[-1], abs=0.5 * WEIGHTS[0] * one_point + 0.01)


@pytest.mark.parametrize("k", range(3))
def test_creep_in_a_block_that_warms_agrees_with_another_integrator(rig: CreepRig, k: int) -> None:
    start_c, end_c = rig.start_c[k], CONTAINER_C[k]
    thermal, creep = statistics(printed_tables().thermal_um).mean_um, statistics(printed_tables().creep_um).mean_um

    def slope(minute: float, z: np.ndarray) -> np.ndarray:
        temperature_c = end_c + (start_c - end_c) * np.exp(-minute / 2.0)
        ratio = np.interp(temperature_c, CONTAINER_C, creep / thermal)
        tau_min = TAU_MIN * np.exp(-(temperature_c - 22.0) / FASTER_PER_C)
        return (ratio * (temperature_c - start_c) - z) / tau_min

    at_min = [5.0, 20.0, 60.0, 150.0, 300.0]
    z = WEIGHTS @ solve_ivp(slope, (0.0, 300.0), np.zeros(3), t_eval=at_min, rtol=1e-9, atol=1e-9, max_step=1.0).y
    block = rig.first()[k]
    assert np.interp(at_min, block.time_min, block.creep_um) / block.creep_um[-1] == pytest.approx(z / z[-1], rel=2e-3)


def test_hotter_is_faster(rig: CreepRig) -> None:
    after_min = [block.stable_after_min for block in rig.first()]
    assert after_min[0] > after_min[1] > after_min[2]
    assert after_min[0] < 300.0
    # after 300 min the cold block is not done: 1 - sum w exp(-300 / tau) of the Prony series by hand
    tau_min = np.outer(np.exp(-(np.array(CONTAINER_C) - 22.0) / FASTER_PER_C), TAU_MIN)
    assert rig.finished_share() == pytest.approx(1.0 - np.exp(-300.0 / tau_min) @ WEIGHTS, abs=1e-4)
    assert rig.finished_share()[0] == pytest.approx(0.78, abs=0.005)


def test_one_coefficient_for_three_blocks_only_with_the_assumed_starts(rig: CreepRig) -> None:
    assert rig.expansion_um_per_c == pytest.approx([0.0906, 0.0881, 0.0898], abs=0.5e-4)
    assert np.ptp(rig.expansion_um_per_c) / rig.expansion_um_per_c.mean() < 0.03
    room = CreepRig(start_c=(22.0, 22.0, 22.0)).expansion_um_per_c
    assert room == pytest.approx([0.100, 0.936, 0.200], abs=0.5e-3)


def test_virtual_repetitions_scatter_as_the_tables(drawn: Tables) -> None:
    assert drawn.creep_um.shape == drawn.thermal_um.shape == (EXPERIMENTS, 3, 10)
    assert drawn.creep_um.min() > 0.0 and drawn.thermal_um.min() > 0.0
    for sizes, cv, mean, block_cv in (
        (drawn.creep_um, CREEP_CV_PERCENT, CREEP_MEAN_UM, 0.0144),
        (drawn.thermal_um, THERMAL_CV_PERCENT, THERMAL_MEAN_UM, 0.0144),
    ):
        within = np.sqrt(np.mean(np.var(sizes, axis=2, ddof=1), axis=0)) / sizes.mean(axis=(0, 2))
        assert 100.0 * within == pytest.approx(cv, rel=0.03)
        of_blocks = sizes.mean(axis=2).std(axis=0, ddof=1) / sizes.mean(axis=(0, 2))
        expected = np.sqrt(block_cv**2 + (np.array(cv) / 100.0) ** 2 / 10.0)
        assert of_blocks == pytest.approx(expected, rel=0.05)
        # one coefficient of expansion for all blocks: the tables' own means lie within its 3 %
        assert sizes.mean(axis=(0, 2)) == pytest.approx(mean, rel=0.03)


def test_the_paper_is_one_ordinary_outcome(drawn: Tables) -> None:
    for printed, virtual in zip(printed_tables(), drawn, strict=True):
        of_paper, of_draws = statistics(printed), statistics(virtual)
        for value, values in zip(of_paper, of_draws, strict=True):
            share = standing(value, values)
            assert np.all((share > 0.025) & (share < 0.975))


def test_standing_is_the_share_below() -> None:
    assert standing(np.array([2.5, 0.0]), np.array([[1.0, 1.0], [2.0, 2.0], [3.0, 3.0], [4.0, 4.0]])) == pytest.approx(
        [0.5, 0.0]
    )


def test_the_same_seed_gives_the_same_experiments(rig: CreepRig, drawn: Tables) -> None:
    assert np.array_equal(rig.repeated(Streams(7), EXPERIMENTS).creep_um, drawn.creep_um)
    assert not np.array_equal(rig.repeated(Streams(8), EXPERIMENTS).creep_um, drawn.creep_um)


def test_every_value_of_the_rig_has_a_source() -> None:
    assert all(field.metadata["source"] for field in fields(CreepRig))


@pytest.mark.parametrize(
    "wrong", [{"start_c": (22.0, 22.0)}, {"start_c": (-55.0, 22.0, 22.0)}, {"reading_min": 0.0}, {"block_lag_s": -1.0}]
)
def test_an_impossible_rig_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(UsageError, match=r"^creep rig: [^\n]+$"):
        CreepRig(**wrong)
