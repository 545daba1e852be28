"""A receiver that was just switched on leaps while its box feels nothing: these fixes are left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.random_processes import gauss_markov
from ins_eval.recording import Fixes, Imu, Recording, Start
from ins_eval.recording.consistency.settling import check_settling, settled, settled_from
from ins_eval.units import STANDARD_GRAVITY

SECONDS, RATE_HZ, FIX_HZ, STANDS_S = 120.0, 50.0, 5.0, 60.0
SETTLES_S, LEAPS_MPS, SPREAD_S = 9.0, 2.0, 1.5
NOISE_MPS, MANOEUVRE_MPS2, LATE_S = 0.05, 2.0, 0.24
OFFSET_RADPS = np.array([0.02, -0.03, 0.12])  # of gyros that nobody zeroed, seven degrees a second
WITHIN_S = 3.0  # after the last leap; what is judged together spans four seconds


def driven(rng: np.random.Generator, moves_from_s: float = STANDS_S, noise_mps: float = NOISE_MPS) -> Recording:
    """A car that stands and then speeds up and brakes along north; its fixes are late, as receivers are."""
    time_s = np.arange(1, int(SECONDS * RATE_HZ) + 1) / RATE_HZ
    forward = np.where(time_s > moves_from_s, MANOEUVRE_MPS2 * np.sin(time_s - moves_from_s), 0.0)
    velocity = np.cumsum(forward) / RATE_HZ
    force = np.column_stack([forward, np.zeros_like(forward), np.full_like(forward, -STANDARD_GRAVITY)])
    fixes_s = np.arange(1.0, SECONDS * FIX_HZ) / FIX_HZ
    velocity_n = np.zeros((fixes_s.size, 3))
    velocity_n[:, 0] = np.interp(fixes_s - LATE_S, time_s, velocity)
    none = np.zeros(fixes_s.size)
    return Recording(
        "car",
        "drive",
        Start(0.0, 0.6, 0.1, 0.0),
        Imu(time_s, np.zeros_like(force), (force + 0.02 * rng.standard_normal(force.shape)) / RATE_HZ, "increment"),
        gps=Fixes(fixes_s, none, none, none, velocity_n + noise_mps * rng.standard_normal(velocity_n.shape),
                  np.ones(fixes_s.size, dtype=bool)),
    )  # fmt: skip


def switched_on(recording: Recording, rng: np.random.Generator, from_s: float = 0.0) -> Recording:
    """The same whose receiver wanders by metres a second for a while."""
    fixes = recording.gps
    off = np.column_stack([gauss_markov(fixes.time_s, LEAPS_MPS, SPREAD_S, rng) for _ in range(3)])
    off[(fixes.time_s < from_s) | (fixes.time_s > from_s + SETTLES_S)] = 0.0
    return replace(recording, gps=replace(fixes, velocity_n=fixes.velocity_n + off))


@pytest.mark.parametrize("offset", [0.0, 1.0])
@pytest.mark.parametrize("seed", range(5))
def test_fixes_of_a_receiver_that_settles_are_left_out(seed: int, offset: float) -> None:
    """Whatever offset the gyros have: it turns nothing."""
    rng = np.random.default_rng(seed)
    recording = switched_on(driven(rng), rng)
    imu = recording.imu
    recording = replace(recording, imu=replace(imu, gyro=imu.gyro + offset * OFFSET_RADPS / RATE_HZ))
    settled_s = settled_from(recording)
    assert SETTLES_S - WITHIN_S < settled_s < SETTLES_S + WITHIN_S
    left = settled(recording)
    assert left.gps.time_s[0] >= settled_s
    (found,) = check_settling(recording)
    assert found.decided
    assert f"{recording.gps.time_s.size - left.gps.time_s.size} fixes" in found.seen


@pytest.mark.parametrize("seed", range(5))
def test_nothing_else_is(seed: int) -> None:
    """Noise; motion from the first fix on, though fixes are late; one leap; leaps later, as if a sensor stuck."""
    rng = np.random.default_rng(seed)
    calm = driven(rng)
    once = calm.gps.velocity_n.copy()
    once[20] += LEAPS_MPS
    for other in (
        calm,
        driven(rng, noise_mps=0.0),
        driven(rng, moves_from_s=0.0),
        replace(calm, gps=replace(calm.gps, velocity_n=once)),
        switched_on(calm, rng, from_s=30.0),
        replace(calm, gps=None),
    ):
        assert settled_from(other) is None
        assert settled(other) is other
