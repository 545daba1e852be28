"""Motion too fast for the samples: what the mechanization leaves of it, and that it is said."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ins_eval.analysis.evaluate import evaluate_recording
from ins_eval.bandwidth import LEAST_ACCELERATION, fast_motion
from ins_eval.profile import Profile
from ins_eval.recording import Fixes, Imu, Recording, Start
from ins_eval.recording.belief import EarthBelief
from ins_eval.strapdown import navigate
from ins_eval.trajectory import Trajectory
from ins_eval.units import DEG

RATE_HZ, SUM = 100.0, 4  # samples; increments are sums of so many that are four times as fast
G = 9.8
BETTER = 3.0  # than the two-sample algorithm, at least
FACTOR = 3.0  # within which the size of the acceleration error is said


def rocking(frequency_hz: float) -> Trajectory:
    """Ten minutes straight on at 100 m/s with a roll of 2 degrees at `frequency_hz`."""
    profile = Profile(
        name="rocking",
        duration_s=600.0,
        start={"latitude_deg": 45.0, "longitude_deg": 10.0, "height_m": 500.0, "heading_deg": 30.0, "stand_s": 0.0},
        speed=({"from_s": 10.0, "to_s": 60.0, "to_mps": 100.0, "edge_s": 20.0},),
        wing_rock={"amplitude_deg": 2.0, "frequency_hz": 1.0, "from_s": 70.0, "to_s": 590.0},
        thermal={"self_heating_c": 1.0},
    )
    rock = profile.wing_rock.model_copy(update={"frequency_hz": frequency_hz})  # beyond what a file may say
    return Trajectory(profile.model_copy(update={"wing_rock": rock}))


def felt(trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    fine = trajectory.increments(SUM * RATE_HZ)
    angle, velocity = (each.reshape(-1, SUM, 3).sum(axis=1) for each in (fine.dtheta_b, fine.dv_b))
    return fine.time_s[SUM - 1 :: SUM], angle, velocity


def start_of(trajectory: Trajectory) -> Start:
    truth = trajectory.truth(np.zeros(1))
    place = (float(each[0]) for each in (truth.latitude_rad, truth.longitude_rad, truth.height_m))
    return Start(0.0, *place, tuple(truth.velocity_n[0]), tuple(truth.attitude_rad[0]), attitude_sigma_rad=(1e-6,) * 3)


def with_two_samples(angle: np.ndarray, velocity: np.ndarray, attitude: Rotation) -> np.ndarray:
    """Velocity (3,) gained in inertial axes by the classical two-sample algorithm, Savage, J. Guid. 21 (1998) 19, 208.

    dv = v1 + v2 + (t1 + t2) x (v1 + v2) / 2 + 2/3 (t1 x v2 + v1 x t2),   phi = t1 + t2 + 2/3 t1 x t2
    """
    t1, t2, v1, v2 = angle[::2], angle[1::2], velocity[::2], velocity[1::2]
    gained = v1 + v2 + 0.5 * np.cross(t1 + t2, v1 + v2) + 2.0 / 3.0 * (np.cross(t1, v2) + np.cross(v1, t2))
    sum_n = np.zeros(3)
    for turn, step in zip(Rotation.from_rotvec(t1 + t2 + 2.0 / 3.0 * np.cross(t1, t2)), gained, strict=True):
        sum_n += attitude.apply(step)
        attitude = attitude * turn
    return sum_n


@pytest.mark.parametrize("frequency_hz", [5.0, 20.0])
def test_motion_beyond_an_eighth_of_the_rate_is_said_with_its_size(frequency_hz: float) -> None:
    trajectory = rocking(frequency_hz)
    time_s, angle, velocity = felt(trajectory)
    truth = trajectory.truth(time_s)
    start = start_of(trajectory)
    solution = navigate(time_s, angle, velocity, start, vertical="free")
    true = trajectory.truth(solution.time_s)
    off = solution.velocity_n - true.velocity_n
    left = np.linalg.norm(off[-1]) / 600.0
    fixes = Fixes(
        time_s[99::100], truth.latitude_rad[99::100], truth.longitude_rad[99::100], truth.height_m[99::100],
        truth.velocity_n[99::100], np.ones(time_s.size // 100, dtype=bool),
    )  # fmt: skip
    recording = Recording("rocking", "flight", start, Imu(time_s, angle, velocity, "increment"), gps=fixes)
    found = evaluate_recording(recording)
    said = [note for note in found.tree["recording"]["notes"] if "too fast for the sample rate" in note]
    assert found.fast_motion.warned == bool(said) == (frequency_hz > RATE_HZ / 8.0)
    if said:
        assert left / FACTOR < np.linalg.norm(found.fast_motion.acceleration_b) < left * FACTOR
    else:
        assert left < LEAST_ACCELERATION


def test_it_is_followed_better_than_by_two_samples() -> None:
    """20 Hz at 100 Hz on an Earth that does not turn, 20 s of roll about a level axis under gravity.

    The velocity across, gained where roll and specific force beat, has no mean in truth: specific force is constant in
    axes that do not turn.
    """
    w, n = 2.0 * np.pi * 20.0, 2000
    edges = np.arange(n + 1) / RATE_HZ
    roll = 2.0 * DEG * np.sin(w * edges)
    nodes, weights = np.polynomial.legendre.leggauss(12)
    at = edges[:-1, None] + (nodes + 1.0) / (2.0 * RATE_HZ)
    force = [np.zeros_like(at), -np.sin(2.0 * DEG * np.sin(w * at)), -np.cos(2.0 * DEG * np.sin(w * at))]
    velocity = np.stack([each @ weights for each in force], axis=1) * G / (2.0 * RATE_HZ)
    angle = np.stack([np.diff(roll), np.zeros(n), np.zeros(n)], axis=1)
    truth = np.array([0.0, 0.0, -G * n / RATE_HZ])
    start = Start(0.0, 0.5, 0.0, 0.0, attitude_rad=(0.0, 0.0, 0.0))
    flat = EarthBelief(rotation=False, coriolis=False, transport_rate=False)
    ours = navigate(edges[1:], angle, velocity, start, vertical="free", earth=flat).velocity_n[-1]
    left = np.linalg.norm(ours[:2])
    theirs = np.linalg.norm((with_two_samples(angle, velocity, Rotation.identity()) - truth)[:2])
    assert theirs > BETTER * left


def test_noise_is_no_motion() -> None:
    rng = np.random.default_rng(3)
    time_s = np.arange(1, 60_001) / RATE_HZ
    noise = rng.normal(size=(2, time_s.size, 3))
    found = fast_motion(time_s, 1e-4 * noise[0], 1e-2 * noise[1] - [0.0, 0.0, 0.0981])
    assert not found.warned
