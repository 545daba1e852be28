"""Errors put into an IMU are found again, as surely as their intervals say; what was not excited is not given."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ins_eval.channels import BLOCKS, LIMIT, find_clock, fit_channels, in_windows
from ins_eval.errors import DataRefused
from ins_eval.implied import implied_increments
from ins_eval.recording import Fixes
from ins_eval.trajectory import Increments
from ins_eval.units import DEG

STEP_S = 0.02
DURATION_S = 160.0
BIAS = {"gyro": np.array([2e-3, -1e-3, 4e-4]), "velocity": np.array([0.05, -0.03, 0.02])}
GAIN = {  # scale factor errors on the diagonal, misalignments beside it
    "gyro": np.array([[4e-3, 1e-3, -2e-3], [-3e-3, -2e-3, 1e-3], [2e-3, 3e-3, 1e-3]]),
    "velocity": np.array([[-1e-3, 2e-3, 1e-3], [1e-3, 2e-3, -3e-3], [-2e-3, 1e-3, 3e-3]]),
}
GYRO_NOISE, VELOCITY_NOISE = 2e-5, 3e-3  # rad/sqrt(s), m/s/sqrt(s)
ATTITUDE_NOISE_RAD, SPEED_NOISE_MPS = 2e-5, 2e-3  # of the reference, at each epoch
DRAWS = 50
FEWEST_COVERED, MOST_COVERED = 0.92, 0.985  # of intervals that hold 95 %; 1200 of them, not all independent
DRIVE = Path("shared", "recordings", "fog_mems_vehicle", "transfer_align_fog_mems.mat")


def motion(rng: np.random.Generator | None = None, offset_s: float = 0.0) -> Fixes:
    """A lively, made-up ride, with the noise of a reference where `rng` is given."""
    time_s = np.arange(0.0, DURATION_S + 0.05, 0.1)
    t = time_s
    attitude = np.column_stack(
        [
            0.4 * np.sin(0.9 * t) + 0.1 * np.sin(2.3 * t),
            0.25 * np.sin(0.7 * t + 1.0) + 0.1 * np.sin(1.9 * t),
            0.6 * np.sin(0.4 * t) + 0.2 * np.sin(1.3 * t + 2.0),
        ]
    )
    velocity = np.column_stack([20.0 + 3.0 * np.sin(0.8 * t), 4.0 * np.sin(0.5 * t), 1.5 * np.sin(1.1 * t)])
    if rng is not None:
        attitude = attitude + ATTITUDE_NOISE_RAD * rng.standard_normal(attitude.shape)
        velocity = velocity + SPEED_NOISE_MPS * rng.standard_normal(velocity.shape)
    n = t.size
    return Fixes(
        time_s + offset_s,
        np.full(n, 34.4 * DEG),
        np.full(n, 1.9),
        np.full(n, 400.0),
        velocity,
        np.ones(n, dtype=bool),
        attitude,
    )


SAMPLES_S = np.arange(1, round(DURATION_S / STEP_S) + 1) * STEP_S


@pytest.fixture(scope="module")
def true() -> Increments:
    return implied_increments(motion(), SAMPLES_S, 0.0)


def recorded(true: Increments, rng: np.random.Generator) -> Increments:
    """A sensor triad with every error of the model and white noise."""
    return Increments(
        true.time_s,
        true.dtheta_b @ (np.eye(3) + GAIN["gyro"]).T
        + STEP_S * BIAS["gyro"]
        + GYRO_NOISE * np.sqrt(STEP_S) * rng.standard_normal(true.dtheta_b.shape),
        true.dv_b @ (np.eye(3) + GAIN["velocity"]).T
        + STEP_S * BIAS["velocity"]
        + VELOCITY_NOISE * np.sqrt(STEP_S) * rng.standard_normal(true.dv_b.shape),
    )


def truths() -> list[np.ndarray]:
    """Bias and three terms of each channel."""
    return [np.array([BIAS[sensor][axis], *GAIN[sensor][axis]]) for sensor in ("gyro", "velocity") for axis in range(3)]


def test_injected_errors_are_found_within_intervals_that_cover_them_as_they_say(true):
    inside = []
    for seed in range(DRAWS):
        rng = np.random.default_rng(seed)
        implied = implied_increments(motion(rng), SAMPLES_S, 0.0)
        channels = fit_channels(in_windows(recorded(true, rng), implied, 0.0, 1.0, 0.0))
        for channel, truth in zip(channels, truths(), strict=True):
            for estimate, value in zip((channel.bias, *channel.terms), truth, strict=True):
                inside.append(estimate.low <= value <= estimate.high)
    assert len(inside) == DRAWS * 24
    assert FEWEST_COVERED < np.mean(inside) < MOST_COVERED


def test_errors_are_found_to_a_small_part_of_themselves(true):
    """So that the intervals above are not merely wide."""
    channels = fit_channels(in_windows(recorded(true, np.random.default_rng(1)), true, 0.0, 1.0, 0.0))
    for channel, (bias, *terms) in zip(channels, truths(), strict=True):
        assert channel.bias.value == pytest.approx(bias, abs=0.3 * abs(bias) if "gyro" in channel.name else 0.03)
        assert [term.value for term in channel.terms] == pytest.approx(terms, abs=1.5e-3)
        assert channel.rms_after < channel.rms_without_mean < channel.rms_before


def test_density_of_what_remains_is_that_of_the_noise_put_in(true):
    channels = fit_channels(in_windows(recorded(true, np.random.default_rng(2)), true, 0.0, 1.0, 0.0))
    densities = [channel.density for channel in channels]
    assert densities[:3] == pytest.approx([GYRO_NOISE] * 3, rel=0.2)  # 160 windows: 6 %, one sigma
    assert densities[3:] == pytest.approx([VELOCITY_NOISE] * 3, rel=0.2)
    assert max(abs(channel.neighbour_correlation) for channel in channels) < 0.25


def test_noise_of_the_reference_alternates(true):
    implied = implied_increments(motion(np.random.default_rng(3)), SAMPLES_S, 0.0)
    channels = fit_channels(in_windows(true, implied, 0.0, 1.0, 0.0))
    assert max(channel.neighbour_correlation for channel in channels[:3]) < -0.3


@pytest.mark.parametrize("offset_s", [-0.015, 0.0, 0.43])
def test_clock_offset_is_found(true, offset_s):
    rng = np.random.default_rng(4)
    fixes = motion(rng, offset_s)
    clock = find_clock(
        recorded(true, rng),
        lambda offset: implied_increments(fixes, SAMPLES_S, 0.0, offset),
        0.0,
        1.0,
        fixes.time_s[0],
        0.0,
    )
    assert clock.low <= offset_s <= clock.high
    assert clock.standard_error < 1e-3


def test_interval_of_the_clock_offset_covers_it(true):
    inside = []
    for seed in range(DRAWS):
        rng = np.random.default_rng(100 + seed)
        fixes = motion(rng, 0.003)
        clock = find_clock(
            recorded(true, rng),
            lambda offset, f=fixes: implied_increments(f, SAMPLES_S, 0.0, offset),
            0.0,
            1.0,
            fixes.time_s[0],
            0.0,
        )
        inside.append(clock.low <= 0.003 <= clock.high)
    assert np.mean(inside) > 0.85  # of 50 draws; below that with a probability of 0.4 % where 95 % hold


def test_a_standstill_gives_a_mean_difference_and_nothing_else():
    fixes = motion()
    still = replace(
        fixes,
        velocity_n=np.zeros_like(fixes.velocity_n),
        attitude_rad=np.tile([0.02, 0.01, 1.0], (fixes.time_s.size, 1)),
    )

    def implied_at(offset_s):
        return implied_increments(still, SAMPLES_S, 0.0, offset_s)

    recording = recorded(implied_at(0.0), np.random.default_rng(5))
    channels = fit_channels(in_windows(recording, implied_at(0.0), 0.0, 1.0, 0.0))
    assert all(channel.bias is None and channel.terms == (None, None, None) for channel in channels)
    assert [c.mean_difference.value for c in channels[:3]] == pytest.approx(BIAS["gyro"], rel=0.02)
    # the accelerometers' scale factors and misalignments stand within: gravity on them
    gravity_on_z = BIAS["velocity"] - 9.8 * GAIN["velocity"][:, 2]
    assert [c.mean_difference.value for c in channels[3:]] == pytest.approx(gravity_on_z, abs=2e-3)
    assert find_clock(recording, implied_at, 0.0, 1.0, 0.0, 0.0) is None


def test_one_lively_axis_gives_its_own_terms_only(true):
    fixes = motion()
    attitude = np.column_stack([fixes.attitude_rad[:, 0], *np.zeros((2, fixes.time_s.size))])
    rolling = replace(fixes, attitude_rad=attitude, velocity_n=np.zeros_like(fixes.velocity_n))
    implied = implied_increments(rolling, SAMPLES_S, 0.0)
    noisy = recorded(implied, np.random.default_rng(6))
    for channel in fit_channels(in_windows(noisy, implied, 0.0, 1.0, 0.0))[:3]:
        about_roll, *others = channel.terms
        assert about_roll.value == pytest.approx(GAIN["gyro"][channel.axis, 0], abs=3e-4)
        assert others == [None, None]


def test_a_fit_that_is_less_sure_than_the_limit_is_not_given(true):
    rng = np.random.default_rng(7)
    loud = replace(
        recorded(true, rng), dtheta_b=true.dtheta_b + 0.02 * np.sqrt(STEP_S) * rng.standard_normal(true.dtheta_b.shape)
    )
    for channel in fit_channels(in_windows(loud, true, 0.0, 1.0, 0.0)):
        for term in channel.terms:
            assert term is None or term.standard_error <= LIMIT
    assert all(c.terms == (None, None, None) for c in fit_channels(in_windows(loud, true, 0.0, 1.0, 0.0))[:3])


def test_windows_leave_gaps_out_of_either_series(true):
    holes = Increments(true.time_s, true.dtheta_b.copy(), true.dv_b.copy())
    holes.dtheta_b[1000:1010] = np.nan  # the reference is silent in the window that ends at 21 s
    holes.dv_b[1000:1010] = np.nan
    windows = in_windows(true, holes, 0.0, 1.0, 0.0)
    assert windows.time_s.size == DURATION_S - 1 and 21.0 not in np.round(windows.time_s, 6)
    late = true.time_s.copy()
    late[2500:] += 3.0  # samples are missing before 50 s
    shifted = Increments(late, true.dtheta_b, true.dv_b)
    assert in_windows(shifted, shifted, 0.0, 1.0, 0.0).time_s.size == DURATION_S - 1


def test_windows_begin_and_end_on_epochs_wherever_the_samples_lie():
    """Between epochs the reference is a curve: of motion above its bandwidth only means from epoch to epoch hold."""
    time_s = np.arange(0.0, DURATION_S + 0.05, 0.1)

    def heading(t):
        return 0.3 * np.sin(0.9 * t) + 2e-3 * np.sin(2.0 * np.pi * 5.7 * t)

    n = time_s.size
    fixes = replace(
        motion(), velocity_n=np.zeros((n, 3)), attitude_rad=np.column_stack([*np.zeros((2, n)), heading(time_s)])
    )
    samples_s = np.arange(0.013, DURATION_S, STEP_S)  # an epoch is never the edge of a sample
    edges_s = np.concatenate([[0.0], samples_s])
    implied = implied_increments(fixes, samples_s, 0.0)
    still = implied_increments(replace(fixes, attitude_rad=np.zeros((n, 3))), samples_s, 0.0)  # the Earth alone
    gyro = still.dtheta_b + np.column_stack([*np.zeros((2, samples_s.size)), np.diff(heading(edges_s))])
    recording = Increments(samples_s, gyro, implied.dv_b)
    on, off = (in_windows(recording, implied, 0.0, 1.0, epoch_s).difference[:, 2].std() for epoch_s in (0.0, 0.05))
    assert on < 3e-4 < 1e-3 < off  # 1e-4: the edge divides a sample of 20 ms in proportion


def test_too_little_in_common_is_refused(true):
    short = Increments(true.time_s[:1500], true.dtheta_b[:1500], true.dv_b[:1500])
    with pytest.raises(DataRefused, match=f"covers 30 windows of 1 s .* expected at least {2 * BLOCKS}"):
        in_windows(short, short, 0.0, 1.0, 0.0)


def test_real_drive(repository):
    """A MEMS unit beside a fibre-optic navigator; the numbers to meet are in SOURCE.md beside the file."""
    path = repository.parent / DRIVE
    if not path.exists():
        pytest.skip(f"the real recording ../{DRIVE} is absent here")
    tables = pytest.importorskip("scipy.io").loadmat(path)
    turn = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])  # to forward-right-down, north-east-down
    imu, navigator = tables["mimu"], tables["fogavp"]
    fixes = Fixes(
        navigator[:, 9],
        navigator[:, 6],
        navigator[:, 7],
        navigator[:, 8],
        navigator[:, 3:6] @ turn.T,
        np.ones(len(navigator), dtype=bool),
        np.column_stack([navigator[:, 1], navigator[:, 0], -navigator[:, 2]]),
    )
    recording = Increments(imu[:, 6], imu[:, :3] @ turn.T, imu[:, 3:6] @ turn.T)
    start_s = imu[0, 6] - 0.01

    def implied_at(offset_s):
        return implied_increments(fixes, recording.time_s, start_s, offset_s)

    clock = find_clock(recording, implied_at, start_s, 1.0, fixes.time_s[0], 0.0)
    # documented: the IMU's clock -15 ms from the reference's, so the reference's stamp is 15 ms more
    assert clock.value == pytest.approx(0.015, abs=0.002)
    assert clock.standard_error < 5e-4
    channels = fit_channels(in_windows(recording, implied_at(clock.value), start_s, 1.0, fixes.time_s[0] - clock.value))
    assert [c.bias.value for c in channels[:3]] == pytest.approx([0.000774, -0.001041, -0.000366], abs=1e-5)
    assert [c.mean_difference.value for c in channels[3:5]] == pytest.approx([-0.057, 0.019], abs=0.001)
    assert channels[5].bias.value == pytest.approx(0.032, abs=0.005)  # shares its value with the scale factor
    # documented scale errors -0.06, -0.47 and -0.48 %, without uncertainty
    x, y, z = (channel.terms[channel.axis] for channel in channels[:3])
    assert x.low <= -0.0006 <= x.high and x.high < 0.0
    assert y.standard_error < 2e-3 and z.standard_error < 1.5e-3 and z.high < 0.0
    assert max(c.rms_after for c in channels[:3]) < 0.006 * DEG
