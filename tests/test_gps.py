"""The receiver: noise of the stated size, silent beyond 30 degrees of roll and nowhere else."""

from __future__ import annotations

import numpy as np
import pymap3d
import pytest
from scipy.stats import chi2

from ins_eval.gps import receive
from ins_eval.profile import Gps, load
from ins_eval.streams import Streams
from ins_eval.trajectory import Trajectory

CHANCE = 1e-3  # of a chi-square bound, each side; seeds are fixed
EXACT_M = 1e-3  # ENU of pymap3d is a plane, the errors are arcs


@pytest.fixture(scope="module")
def trajectory() -> Trajectory:
    return Trajectory(load("climb-cruise-landing"))


def errors(trajectory: Trajectory, streams: Streams) -> tuple[np.ndarray, np.ndarray]:
    """Position (m, 3) in m and velocity (m, 3) in m/s of the valid fixes less the truth, NED, by pymap3d."""
    fixes = receive(trajectory, streams)
    truth = trajectory.truth(fixes.time_s)
    east, north, up = pymap3d.geodetic2enu(
        fixes.latitude_rad, fixes.longitude_rad, fixes.height_m,
        truth.latitude_rad, truth.longitude_rad, truth.height_m, deg=False,
    )  # fmt: skip
    return np.stack([north, east, -up], axis=1)[fixes.valid], (fixes.velocity_n - truth.velocity_n)[fixes.valid]


def test_noise_is_white_and_has_the_stated_sigma(trajectory: Trajectory) -> None:
    """2.5 m and 0.05 m/s on each of north, east, down, each within a chi-square bound; no memory."""
    for found, sigma in zip(errors(trajectory, Streams(1)), (2.5, 0.05), strict=True):
        low, high = chi2.ppf([CHANCE, 1.0 - CHANCE], len(found))
        squares = np.sum((found / sigma) ** 2, axis=0)
        assert np.all((squares > low) & (squares < high))
        memory = np.mean(found[1:] * found[:-1], axis=0) / sigma**2
        assert np.abs(memory).max() < 4.0 / np.sqrt(len(found))
        between = np.corrcoef(found, rowvar=False)[np.triu_indices(3, 1)]
        assert np.abs(between).max() < 4.0 / np.sqrt(len(found))


def test_one_fix_a_second_from_time_zero(trajectory: Trajectory) -> None:
    assert np.array_equal(receive(trajectory, Streams(1)).time_s, np.arange(0.0, 8401.0))


def test_lost_beyond_30_degrees_of_roll_and_nowhere_else(trajectory: Trajectory) -> None:
    """Paper A: the antenna in the cabin loses the satellites; a lost fix holds nothing."""
    fixes = receive(trajectory, Streams(1))
    roll_deg = np.rad2deg(np.abs(trajectory.truth(fixes.time_s).attitude_rad[:, 0]))
    assert np.array_equal(fixes.valid, roll_deg <= 30.0)
    assert 30 < np.count_nonzero(~fixes.valid) < 1000
    for column in (fixes.latitude_rad, fixes.longitude_rad, fixes.height_m, fixes.velocity_n[:, 0]):
        assert np.array_equal(np.isfinite(column), fixes.valid)


def test_a_receiver_that_is_never_lost_and_has_no_noise_gives_the_truth(trajectory: Trajectory) -> None:
    gps = Gps(period_s=5.0, position_sigma_m=0.0, velocity_sigma_mps=0.0, lost_beyond_roll_deg=180.0)
    perfect = Trajectory(trajectory.profile.model_copy(update={"gps": gps}))
    fixes = receive(perfect, Streams(1))
    position, velocity = errors(perfect, Streams(1))
    assert fixes.valid.all()
    assert np.diff(fixes.time_s) == pytest.approx(5.0)
    assert np.abs(position).max() < EXACT_M
    assert not np.any(velocity)


def test_position_noise_moves_no_velocity_noise(trajectory: Trajectory) -> None:
    quiet = trajectory.profile.gps.model_copy(update={"position_sigma_m": 0.0})
    other = Trajectory(trajectory.profile.model_copy(update={"gps": quiet}))
    ours, theirs = receive(trajectory, Streams(1)), receive(other, Streams(1))
    assert np.array_equal(ours.velocity_n, theirs.velocity_n, equal_nan=True)
    assert not np.array_equal(ours.height_m, theirs.height_m, equal_nan=True)


def test_the_same_streams_give_the_same_bytes(trajectory: Trajectory) -> None:
    runs = [receive(trajectory, Streams(seed)).latitude_rad.tobytes() for seed in (1, 1, 2)]
    assert runs[0] == runs[1] != runs[2]


def test_errors_with_memory_stand_beside_the_white_ones(trajectory: Trajectory) -> None:
    """Variance s^2 and correlation exp(-dt / tau) of a Gauss-Markov process; the white errors stay as they were."""
    gps = trajectory.profile.gps.model_copy(
        update={"position_memory_m": 4.0, "velocity_memory_mps": 0.1, "memory_s": 60.0}
    )
    slow = Trajectory(trajectory.profile.model_copy(update={"gps": gps}))
    runs = [
        [after - before for before, after in zip(errors(trajectory, node), errors(slow, node), strict=True)]
        for node in (Streams(k) for k in range(8))
    ]
    for kind, sigma in enumerate((4.0, 0.1)):
        added = np.array([run[kind] for run in runs])  # (runs, epochs, axes)
        independent = added.size / (2.0 * 60.0)  # a sample counts once in two correlation times
        spread = 4.0 / np.sqrt(2.0 * independent)
        assert np.mean(added**2) / sigma**2 == pytest.approx(1.0, abs=2.0 * spread)
        half = np.mean(added[:, 60:1500] * added[:, :1440]) / np.mean(added[:, :1500] ** 2)
        assert half == pytest.approx(np.exp(-1.0), abs=4.0 * spread)
