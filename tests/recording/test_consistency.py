"""The list of consistency checks: orders and odds against closed forms, each finding on a motion that is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from ins_eval.cli import main
from ins_eval.errors import DataRefused
from ins_eval.recording import Fixes, Imu, Recording, Start, consistency, form
from ins_eval.recording.belief import Belief, GpsBelief
from ins_eval.recording.consistency.alternatives import (
    BEYOND_DOUBT,
    MATRICES,
    NU,
    channel_scores,
    effective_share,
    equations,
    order_scores,
)
from ins_eval.recording.consistency.limits import LIMITS, check_limits, check_outliers, without_jumps
from ins_eval.recording.consistency.track import (
    HEIGHT_UNITS,
    STAMP_S,
    check_baro,
    check_height,
    check_stamps,
    check_track,
)
from ins_eval.recording.consistency.windows import HANDED, RELATIVE
from tests.recording import corpus

NOISY_M = 5.0
RADIUS_M, LATITUDE, LONGITUDE = 6.37e6, 0.7, 0.3
JUMPS, JITTER_S = 30, 3e-3
SIZE_TOLERANCE = 1e-9
AT_SPEED_MPS = 600.0  # of fixes five times a second


def test_the_48_orders_are_all_there_are():
    assert len({matrix.tobytes() for matrix in MATRICES}) == 48
    np.testing.assert_array_equal(MATRICES @ MATRICES.transpose(0, 2, 1), np.broadcast_to(np.eye(3), (48, 3, 3)))
    assert (np.linalg.det(MATRICES) > 0).sum() == 24
    np.testing.assert_array_equal(MATRICES[0], np.eye(3))
    assert equations(np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])) == "x=y,y=x,z=-z"


def test_turning_both_triads_alike_is_no_other_relative_order():
    proper = np.flatnonzero(np.linalg.det(MATRICES) > 0)
    assert {RELATIVE[k, k] for k in proper} == {0}
    assert set(HANDED[proper]) == {0}
    assert len({(HANDED[p], RELATIVE[p, g]) for p in range(48) for g in range(48)}) == 96


@pytest.mark.parametrize("order", [0, 5, 17, 31, 47])
@pytest.mark.parametrize("factor", [1.0, 0.1])
def test_the_order_and_unit_that_hold_are_the_likeliest(order, factor):
    rng = np.random.default_rng(order)
    read = rng.standard_normal((400, 3))
    expected = factor * read @ MATRICES[order].T + 0.05 * factor * rng.standard_normal((400, 3))
    factors = np.array([1.0, 0.1, 10.0])
    log = order_scores(channel_scores(expected[None], read[None], factors, np.full(3, 1e-6)))[0]
    assert np.unravel_index(np.argmax(log), log.shape) == (order, list(factors).index(factor))


def test_the_score_is_students_distribution():
    rng = np.random.default_rng(4)
    read = rng.standard_normal((500, 3))
    expected = read + 0.3 * rng.standard_normal((500, 3))
    floor = 0.5
    scores = channel_scores(expected[None], read[None], np.ones(1), np.full(3, floor))[0]
    size = np.sqrt(np.mean(np.minimum(expected[:, 1] ** 2, np.quantile(np.abs(expected[:, 1]), 0.98) ** 2)))
    right, wrong = (expected[:, 1] - read[:, 1]), (expected[:, 1] + read[:, 1])
    log = [stats.t.logpdf(residual / floor, NU).sum() for residual in (right, wrong)]
    share = effective_share(right / size)
    assert scores[1, 1, 0, 0] - scores[1, 1, 1, 0] == pytest.approx(share * (log[0] - log[1]), rel=SIZE_TOLERANCE)


def test_the_effective_share_is_that_of_an_autoregression():
    rng = np.random.default_rng(1)
    noise = np.zeros(200_000)
    for k, step in enumerate(rng.standard_normal(noise.size - 1)):
        noise[k + 1] = 0.8 * noise[k] + step
    assert effective_share(noise) == pytest.approx((1 - 0.8) / (1 + 0.8), rel=0.1)


def test_a_channel_that_should_show_nothing_decides_nothing():
    rng = np.random.default_rng(2)
    read = rng.standard_normal((300, 3))
    scores = channel_scores(0.01 * rng.standard_normal((1, 300, 3)), read[None], np.array([1.0, 1e-3]), np.zeros(3))
    assert not scores.any()


# ------------------------------------------------------------------------------------------------ fixes


def circle(seed: int = 0) -> Fixes:
    """A climbing circle of 200 m at 10 m/s on a sphere, five fixes a second."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 120.0, 0.2)
    course = t / 20.0
    velocity = np.column_stack([10.0 * np.cos(course), 10.0 * np.sin(course), -np.cos(t / 7.0)])
    north, east, up = 200.0 * np.sin(course), -200.0 * np.cos(course), 7.0 * np.sin(t / 7.0)
    return Fixes(
        t,
        LATITUDE + north / RADIUS_M,
        LONGITUDE + east / (RADIUS_M * np.cos(LATITUDE)),
        100.0 + up,
        velocity + 0.05 * rng.standard_normal(velocity.shape),
        np.ones(len(t), dtype=bool),
    )


def test_a_way_that_agrees_is_left_alone():
    assert not [found for found in check_track(circle(), "gps") if found.decided]
    assert check_stamps(circle(), "gps") is None


@pytest.mark.parametrize(
    ("change", "key", "said"),
    [
        (lambda f: replace(f, velocity_n=f.velocity_n * [1, 1, -1]), "velocity.axes", "north, east, -down"),
        (lambda f: replace(f, velocity_n=f.velocity_n[:, [1, 0, 2]]), "velocity.axes", "east, north, down"),
        (lambda f: replace(f, velocity_n=f.velocity_n * 3.6), "velocity.unit", "in km/h"),
        (lambda f: replace(f, velocity_n=f.velocity_n * 3600 / 1852), "velocity.unit", "in knots"),
        (lambda f: replace(f, velocity_n=f.velocity_n * 3600 / 1609.344), "velocity.unit", "in mph"),
        (lambda f: replace(f, velocity_n=f.velocity_n / 0.3048), "velocity.unit", "in ft/s"),
        (lambda f: replace(f, velocity_n=f.velocity_n * 100), "velocity.unit", "in cm/s"),
        (lambda f: replace(f, velocity_n=f.velocity_n / 3.6), "velocity.unit", "m/s read as km/h"),
        (
            lambda f: replace(f, latitude_rad=f.longitude_rad, longitude_rad=f.latitude_rad),
            "gps.position",
            "latitude and longitude are exchanged",
        ),
        (lambda f: replace(f, longitude_rad=-f.longitude_rad), "velocity.axes", "north, -east, down"),
    ],
)
def test_a_way_that_contradicts_is_named(change, key, said):
    (found,) = check_track(change(circle()), "gps")
    assert found.key == key and said in found.seen and found.log_odds > BEYOND_DOUBT


def test_velocities_along_body_axes_are_no_place_in_another_order():
    fixes = circle()
    ahead = np.hypot(*fixes.velocity_n[:, :2].T)
    along = np.column_stack([ahead, 0.02 * ahead, fixes.velocity_n[:, 2]])
    (found,) = check_track(replace(fixes, velocity_n=along), "gps")
    assert found.key == "velocity.axes" and "along body axes, forward and to the right" in found.seen


def test_a_place_that_does_not_move_tells_nothing_and_that_is_said():
    fixes = circle()
    still = replace(
        fixes,
        latitude_rad=np.full_like(fixes.latitude_rad, LATITUDE),
        longitude_rad=np.full_like(fixes.longitude_rad, LONGITUDE),
        height_m=np.full_like(fixes.height_m, 100.0),
        velocity_n=1e-3 * fixes.velocity_n,
    )
    (found,) = check_track(still, "gps")
    assert not found.decided and "does not determine the north velocity" in found.seen


@pytest.mark.parametrize(("at_s", "size_s"), [(30.0, 0.3), (80.0, 0.5)])
def test_a_jump_of_the_stamps_is_told_from_lost_fixes(at_s, size_s):
    fixes = circle()
    found = check_stamps(replace(fixes, time_s=fixes.time_s + size_s * (fixes.time_s > at_s)), "gps")
    assert f"jump by +{size_s:.3f} s after {at_s:g} s" in found.seen and found.log_odds > BEYOND_DOUBT
    lost = (fixes.time_s > at_s) & (fixes.time_s < at_s + 1.0)
    assert check_stamps(replace(fixes, valid=~lost), "gps") is None


def test_the_size_of_a_jump_is_as_sure_as_stamps_are_even():
    fixes, of_jump = circle(), []
    for seed in range(JUMPS):
        late_s = 0.3 * (fixes.time_s > 50.0) + JITTER_S * np.random.default_rng(seed).standard_normal(fixes.time_s.size)
        _, size_s, sigma_s = check_stamps(replace(fixes, time_s=fixes.time_s + late_s), "gps").jump
        of_jump.append((size_s - 0.3) / sigma_s)
    low, high = stats.chi2.ppf([0.001, 0.999], JUMPS)
    assert low < np.square(of_jump).sum() < high
    _, _, sigma_s = check_stamps(replace(fixes, time_s=fixes.time_s + 0.3 * (fixes.time_s > 50.0)), "gps").jump
    assert sigma_s == STAMP_S


@pytest.mark.parametrize("first_mps", [5.0, 12.0])
def test_a_car_that_drives_off_while_nothing_is_received_has_one_clock(first_mps):
    """It stands when the fixes stop and is under way when they come back; the way was made in the last seconds."""
    fixes = circle()
    speed = np.clip(20.0 - 2.0 * (fixes.time_s - 20.0), 0.0, 20.0) + np.clip(2.0 * (fixes.time_s - 80.0), 0.0, 20.0)
    step_s = np.diff(fixes.time_s, prepend=fixes.time_s[0])
    north_m = np.cumsum(step_s * speed)
    lost = (fixes.time_s > 40.0) & (fixes.time_s < 80.0 + first_mps / 2.0)
    driven = replace(
        fixes,
        latitude_rad=LATITUDE + north_m / RADIUS_M,
        longitude_rad=np.full_like(north_m, LONGITUDE),
        velocity_n=np.outer(speed, [1.0, 0.0, 0.0]),
        valid=~lost,
    )
    assert check_stamps(driven, "gps") is None


def climbing_out(rng: np.random.Generator, lost: float) -> Fixes:
    """Fixes of an aeroplane that rolls at 8 m/s and then flies at 200, as noisy in either; a share is `lost`."""
    t = np.arange(0.0, 1200.0, 1.0)
    speed = 8.0 + 192.0 * np.clip((t - 300.0) / 60.0, 0.0, 1.0)
    north_m = np.cumsum(np.diff(t, prepend=0.0) * speed) + NOISY_M * rng.standard_normal(t.size)
    return Fixes(
        t,
        LATITUDE + north_m / RADIUS_M,
        np.full_like(t, 0.2),
        np.full_like(t, 100.0),
        np.outer(speed, [1.0, 0.0, 0.0]),
        rng.random(t.size) > lost,
    )


def test_noisy_positions_tell_no_time_in_slow_motion() -> None:
    """5 m are 0.6 s at 8 m/s and 0.03 s in flight: a single lost fix was a jump of the stamps."""
    rng = np.random.default_rng(4)
    for _ in range(20):
        assert check_stamps(climbing_out(rng, lost=0.05), "gps") is None
    fixes = climbing_out(rng, lost=0.0)
    found = check_stamps(replace(fixes, time_s=fixes.time_s + (fixes.time_s > 800.0)), "gps")
    assert "jump by +1.000 s after 800 s" in found.seen and found.log_odds > BEYOND_DOUBT


def test_a_barometer_in_feet_and_one_far_away():
    fixes = circle()
    up = replace(fixes, height_m=100.0 + 3.0 * fixes.time_s)
    n = len(up.time_s)
    imu = Imu(up.time_s, np.zeros((n, 3)), np.zeros((n, 3)), "increment", height_baro_m=up.height_m + 5.0)
    assert check_baro(imu, up, 100.0, "gps") is None
    assert "it is in feet" in check_baro(replace(imu, height_baro_m=up.height_m / 0.3048), up, 100.0, "gps").seen
    assert "above the heights" in check_baro(replace(imu, height_baro_m=up.height_m + 1e9), up, 100.0, "gps").seen


@pytest.mark.parametrize("unit", HEIGHT_UNITS)
@pytest.mark.parametrize("noise_m", [0.0, 0.3])
def test_a_height_in_another_unit_is_told_by_the_velocity_down(unit, noise_m):
    """h = 100 + 7 sin(t / 7) and its derivative cos(t / 7), of the circle, in each unit."""
    fixes = circle()
    noise = noise_m * np.random.default_rng(3).standard_normal(fixes.time_s.size)
    found = check_height(replace(fixes, height_m=(fixes.height_m + noise) / HEIGHT_UNITS[unit]), "gps")
    if unit == "m":
        assert found is None
    else:
        assert found.key == "height.unit" and found.value == unit and found.log_odds > BEYOND_DOUBT
        assert f"the height is in {unit} and was read as m" in found.seen


@pytest.mark.parametrize("unit", HEIGHT_UNITS)
def test_a_noisy_height_in_another_unit_is_told_by_a_slow_climb(unit):
    """h = 1000 + 200 sin(2 pi t / 1000), of 1.3 m/s at most, with 2.5 m of noise in each fix."""
    rng, turn = np.random.default_rng(4), 2.0 * np.pi / 1000.0
    time_s = np.arange(1500.0)
    down = -200.0 * turn * np.cos(turn * time_s)
    velocity = np.column_stack([np.full((1500, 2), 20.0), down]) + 0.05 * rng.standard_normal((1500, 3))
    height_m = 1000.0 + 200.0 * np.sin(turn * time_s) + 2.5 * rng.standard_normal(1500)
    place = np.zeros(1500)
    fixes = Fixes(time_s, place, place, height_m / HEIGHT_UNITS[unit], velocity, np.ones(1500, dtype=bool))
    found = check_height(fixes, "gps")
    assert found is None if unit == "m" else found.value == unit and found.log_odds > BEYOND_DOUBT


@pytest.mark.parametrize("seed", range(20))
def test_heights_of_a_level_way_tell_no_unit(seed):
    """Noise and a slow wander of metres over velocities of centimetres: no factor is that of a unit."""
    rng = np.random.default_rng(seed)
    fixes = circle()
    wander = 0.3 * np.cumsum(rng.standard_normal(fixes.time_s.size))
    noise = rng.standard_normal((2, fixes.time_s.size))
    velocity = np.column_stack([fixes.velocity_n[:, :2], 0.05 * noise[0]])
    assert check_height(replace(fixes, height_m=100.0 + wander + noise[1], velocity_n=velocity), "gps") is None


def test_a_height_of_fixes_in_mm_is_not_a_barometer_in_another_unit():
    fixes = circle()
    up = replace(fixes, height_m=100.0 + 3.0 * fixes.time_s, velocity_n=np.full_like(fixes.velocity_n, np.nan))
    n = len(up.time_s)
    imu = Imu(up.time_s, np.zeros((n, 3)), np.zeros((n, 3)), "increment", height_baro_m=up.height_m)
    found = check_baro(imu, replace(up, height_m=1e3 * up.height_m), 100.0, "gps")
    assert (found.key, found.value) == ("height.unit", "mm") and found.log_odds > BEYOND_DOUBT


# ------------------------------------------------------------------------------------------------ limits


def recording(**columns) -> Recording:
    fixes = circle()
    n = 6000
    time_s = 0.02 * np.arange(1, n + 1)
    imu = Imu(time_s, np.zeros((n, 3)), np.tile([0.0, 0.0, -0.196], (n, 1)), "increment", 20.0 + 0.01 * time_s)
    start = Start(0.0, LATITUDE, LONGITUDE, 100.0)
    return Recording("circle", "drive", start, replace(imu, **columns), fixes)


def spoilt(values: np.ndarray, at, value: float) -> np.ndarray:
    changed = values.copy()
    changed[at] = value
    return changed


def test_nothing_is_found_in_smooth_columns():
    assert not [*check_limits(recording()), *check_outliers(recording())]


@pytest.mark.parametrize("k", [0, 1, 300, 598, 599])
@pytest.mark.parametrize(
    ("column", "axis", "value", "said"),
    [
        ("velocity_n", 0, 3000.0, "column velocity_n_mps: 3000 m/s"),
        ("latitude_rad", None, 0.0, "column latitude_deg: 0 deg"),
        ("longitude_rad", None, 0.0, "column longitude_deg: 0 deg"),
        ("height_m", None, 9e4, "column height_m: 90000 m"),
    ],
)
def test_a_single_outlier_is_named_with_row_and_value(k, column, axis, value, said):
    flown = recording()
    values = spoilt(getattr(flown.gps, column), k if axis is None else (k, axis), value)
    wild = replace(flown, gps=replace(flown.gps, **{column: values}))
    (found,) = check_outliers(wild)
    assert f"gps, fix {k + 1} at" in found.seen and said in found.seen and found.log_odds == np.inf
    left, (clause,) = without_jumps(wild)
    assert clause == f"{found.seen}, and is left out" and np.flatnonzero(~left.gps.valid).tolist() == [k]
    assert not [*check_outliers(left)]


@pytest.mark.parametrize("rows", [slice(100, None), slice(None, 100)])
def test_a_path_that_begins_or_ends_at_speed_has_no_outlier_there(rows):
    """All neighbours of an end lie on one side; it is where the next two lead."""
    flown = recording()
    gps = flown.gps
    stands = np.zeros(len(gps.time_s), dtype=bool)
    stands[rows] = True
    way = np.cumsum(np.where(stands, 0.0, AT_SPEED_MPS * np.gradient(gps.time_s)))
    moved = replace(gps, latitude_rad=gps.latitude_rad[0] + way / RADIUS_M, velocity_n=0.0 * gps.velocity_n)
    assert not [*check_outliers(replace(flown, gps=moved))]


def test_the_farthest_of_many_outliers_is_the_receivers_own():
    """Student's t of two degrees of freedom: 825 m is rare beside 150 m, 90 000 m is not its tail."""
    flown = recording()
    height = flown.gps.height_m.copy()
    height[[40, 190, 333]] += [-150.0, 60.0, 90.0]
    for off_m, log_odds in ((825.0, np.log(1e3)), (9e4, np.inf)):
        wild = spoilt(height, 471, height[471] + off_m)
        (found,) = check_outliers(replace(flown, gps=replace(flown.gps, height_m=wild)))
        assert "gps, fix 472 at" in found.seen and found.log_odds == pytest.approx(log_odds)


def test_a_temperature_is_refused_or_doubted_by_its_size():
    flown = recording()
    sizes = {1e5: np.inf, 60.0: np.inf, 24.0: np.log(1e3)}
    for value, log_odds in sizes.items():
        hot = recording(temperature_c=spoilt(flown.imu.temperature_c, 1234, value))
        (found,) = check_outliers(hot)
        assert "imu, sample 1235 at" in found.seen and found.log_odds == pytest.approx(log_odds)


def test_a_height_of_rockets_is_doubted():
    """400 m in mm; a single one is an outlier."""
    flown = recording()
    (found,) = check_limits(replace(flown, gps=replace(flown.gps, height_m=flown.gps.height_m + 4e5)))
    assert found.key == "height.unit" and "in mm they were 400.1 m" in found.seen
    assert found.decided and found.log_odds < BEYOND_DOUBT


def test_a_step_that_stays_is_no_outlier():
    flown = recording()
    risen = flown.imu.temperature_c + 40.0 * (flown.imu.time_s > 60.0)
    assert not [*check_outliers(recording(temperature_c=risen))]
    off = flown.gps.velocity_n + [100.0, 0.0, 0.0] * (flown.gps.time_s > 50.0)[:, None]
    assert not [*check_outliers(replace(flown, gps=replace(flown.gps, velocity_n=off)))]


def test_a_lever_arm_and_a_temperature_beyond_the_limits():
    far = replace(recording(), belief=Belief(gps=GpsBelief(lever_arm_m=(1e6, 0.0, 0.0))))
    (found,) = check_limits(far)
    assert "lever_arm_m is 1e+06 m long" in found.seen
    (found,) = check_limits(recording(temperature_c=np.full(6000, 2.0 * LIMITS["temperature"][1])))
    assert "and 5999 more, expected -150 to 500" in found.seen


def test_a_thermometer_in_kelvin_is_doubted_and_not_refused():
    (found,) = check_limits(recording(temperature_c=np.full(6000, 295.0)))
    assert "in kelvin they were 21.85 degC" in found.seen and found.decided and found.log_odds < BEYOND_DOUBT
    assert list(check_limits(recording(temperature_c=np.full(6000, 85.0)))) == []


# ------------------------------------------------------------------------------------------------ to insist


def test_a_refusal_offers_the_way_to_insist_and_the_form_keeps_it(tmp_path, capsys):
    quirk = next(quirk for quirk in corpus.QUIRKS if quirk.name == "km/h")
    path = corpus.write_csv(quirk.spoil(corpus.motion("car")), tmp_path, attitude=True)
    assert main(["import", "csv", str(path), "-o", str(tmp_path / "out")]) == DataRefused.exit_code
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "in km/h" in said and "--assume consistency=warn takes it all the same" in said
    insisted = ["--assume", "consistency=warn"]
    assert main(["import", "csv", str(path), "-o", str(tmp_path / "out"), *insisted]) == 0
    assert consistency.ACCEPTED.format(consistency.KEY) in form.read(tmp_path / "out").notes


@pytest.mark.parametrize(("name", "remedy"), [("gyro deg/s", "gyro.unit=deg/s"), ("both FLU", "axes=x=x,y=-y,z=-z")])
def test_the_remedy_that_is_named_mends_the_file(tmp_path, capsys, name, remedy):
    quirk = next(quirk for quirk in corpus.QUIRKS if quirk.name == name)
    path = corpus.write_csv(quirk.spoil(corpus.motion("car")), tmp_path, attitude=True)
    out = ["-o", str(tmp_path / "out")]
    assert main(["import", "csv", str(path), *out]) == DataRefused.exit_code
    assert f"--assume {remedy} mends it" in capsys.readouterr().err
    assert main(["import", "csv", str(path), *out, "--assume", remedy]) == 0
    assert "contradict" not in capsys.readouterr().out
