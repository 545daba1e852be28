"""The comparator against closed-form motion, the geometry of a turn, and pymap3d."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pymap3d
import pytest

from ins_eval import earth, reference
from ins_eval.errors import DataRefused
from ins_eval.recording import Fixes, Start
from ins_eval.strapdown import Solution

POSITION_TOLERANCE_M = 1e-4
VELOCITY_TOLERANCE_MPS = 1e-5
ROUNDING_M = 1e-7
NED_TOLERANCE_M = 0.02  # errors of 500 m: second-order terms of the local tangent plane, e^2 / R
LATITUDE, LONGITUDE, HEIGHT_M = np.radians(34.65), np.radians(108.9), 400.0


def weaving(time_s):
    """Closed-form flight: latitude, longitude, height and their exact velocity, jerk 0.5 m/s^3 on each axis."""
    w = 0.4  # rad/s
    amplitude_m = 0.5 / w**3
    angle = amplitude_m / 6.37e6
    latitude = LATITUDE + 3e-5 * time_s + angle * np.sin(w * time_s)
    longitude = LONGITUDE - 2e-5 * time_s + angle * np.cos(w * time_s)
    height = HEIGHT_M + 5.0 * time_s + amplitude_m * np.sin(w * time_s + 1.0)
    meridian, transverse = earth.radii(latitude)
    north = (meridian + height) * (3e-5 + angle * w * np.cos(w * time_s))
    east = (transverse + height) * np.cos(latitude) * (-2e-5 - angle * w * np.sin(w * time_s))
    down = -5.0 - amplitude_m * w * np.cos(w * time_s + 1.0)
    return latitude, longitude, height, np.column_stack([north, east, down])


def as_solution(time_s, latitude, longitude, height, velocity):
    return Solution(time_s, latitude, longitude, height, velocity, np.zeros((time_s.size, 3)))


def as_fixes(time_s, latitude, longitude, height, velocity):
    return Fixes(time_s, latitude, longitude, height, velocity, np.ones(time_s.size, dtype=bool))


def parked(time_s, longitude=LONGITUDE):
    m = time_s.size
    return np.full(m, LATITUDE), np.full(m, longitude), np.full(m, HEIGHT_M), np.zeros((m, 3))


@pytest.fixture
def seconds():
    """A parked reference, 200 s at 1 Hz."""
    time_s = np.arange(200.0)
    return as_fixes(time_s, *parked(time_s))


@pytest.fixture
def still():
    """A parked solution over the same 200 s at 10 Hz."""
    time_s = np.arange(1991) / 10.0
    return as_solution(time_s, *parked(time_s))


# ---------------------------------------------------------------------------------------- interpolation


def test_ins_is_interpolated_to_the_epochs_of_the_reference():
    samples = 0.4 * np.arange(1000)
    epochs = 0.17 + np.arange(399.0)
    errors = reference.compare(as_solution(samples, *weaving(samples)), as_fixes(epochs, *weaving(epochs)))
    assert errors.valid.all() and errors.gaps == ()
    worst_m = np.abs([errors.north_m, errors.east_m, errors.down_m]).max()
    assert worst_m < POSITION_TOLERANCE_M
    assert np.abs(errors.velocity_n).max() < VELOCITY_TOLERANCE_MPS


def test_uneven_samples_are_interpolated_as_well():
    rng = np.random.default_rng(1)
    samples = 0.2 * np.arange(2000) + rng.uniform(-0.05, 0.05, 2000)
    epochs = 1.0 + np.arange(398.0)
    errors = reference.compare(as_solution(samples, *weaving(samples)), as_fixes(epochs, *weaving(epochs)))
    assert np.abs([errors.north_m, errors.east_m, errors.down_m]).max() < POSITION_TOLERANCE_M
    assert np.abs(errors.velocity_n).max() < VELOCITY_TOLERANCE_MPS


@pytest.mark.parametrize("samples", [2, 3, 5])
def test_a_handful_of_samples_is_enough_for_a_straight_line(samples):
    time_s = np.linspace(0.0, 2.0, samples)
    epochs = np.array([0.0, 0.7, 2.0])
    climb = [np.column_stack([np.zeros_like(t), np.zeros_like(t), -3.0 - t]) for t in (time_s, epochs)]
    errors = reference.compare(
        as_solution(time_s, *parked(time_s)[:2], 3.0 * time_s + time_s**2 / 2.0, climb[0]),
        as_fixes(epochs, *parked(epochs)[:2], 3.0 * epochs + epochs**2 / 2.0, climb[1]),
    )
    assert np.abs(errors.down_m).max() < ROUNDING_M
    assert np.abs(errors.velocity_n).max() < ROUNDING_M


def test_one_sample_cannot_be_compared(seconds):
    time_s = np.zeros(1)
    two = replace(seconds, time_s=seconds.time_s * 1e-9)
    with pytest.raises(DataRefused, match="1 sample"):
        reference.compare(as_solution(time_s, *parked(time_s)), two)


def test_a_stamp_means_the_instant_less_the_offset():
    samples, epochs = 0.1 * np.arange(4000), np.arange(10.0, 390.0)
    solution = as_solution(samples, *weaving(samples))
    stamped_late = replace(as_fixes(epochs, *weaving(epochs)), time_s=epochs + 0.25)
    right = reference.compare(solution, stamped_late, time_offset_s=0.25)
    assert np.abs(right.north_m).max() < POSITION_TOLERANCE_M
    assert right.time_s == pytest.approx(epochs, abs=1e-9)
    # left alone, the solution at the later instant is ahead by v dt towards north
    ahead = reference.compare(solution, stamped_late)
    middle = weaving(epochs + 0.125)[3][:, 0] * 0.25
    assert ahead.north_m == pytest.approx(middle, abs=0.01)


# ------------------------------------------------------------------------------------------- differences


@pytest.mark.parametrize(("north", "east", "down"), [(500.0, 0.0, 0.0), (0.0, -500.0, 0.0), (-300.0, 400.0, 50.0)])
def test_differences_are_those_of_pymap3d(still, seconds, north, east, down):
    latitude, longitude, height = pymap3d.ned2geodetic(north, east, down, LATITUDE, LONGITUDE, HEIGHT_M, deg=False)
    shifted = replace(
        still,
        latitude_rad=np.full(still.time_s.size, latitude),
        longitude_rad=np.full(still.time_s.size, longitude),
        height_m=np.full(still.time_s.size, height),
    )
    errors = reference.compare(shifted, seconds)
    found = np.column_stack([errors.north_m, errors.east_m, errors.down_m])
    assert found == pytest.approx(np.tile([north, east, down], (200, 1)), abs=NED_TOLERANCE_M)


def test_velocity_error_is_ins_minus_reference(still, seconds):
    moving_reference = replace(seconds, velocity_n=np.tile([0.3, -0.2, 0.1], (200, 1)))
    errors = reference.compare(still, moving_reference)
    assert errors.velocity_n == pytest.approx(np.tile([-0.3, 0.2, -0.1], (200, 1)))


@pytest.mark.parametrize("west_of_line", ["solution", "reference"])
def test_longitude_wraps_at_the_date_line(still, seconds, west_of_line):
    angle = 100.0 / ((earth.radii(LATITUDE)[1] + HEIGHT_M) * np.cos(LATITUDE))  # 100 m on either side
    sign = 1.0 if west_of_line == "solution" else -1.0
    solution = replace(still, longitude_rad=np.full(still.time_s.size, sign * (np.pi - angle)))
    fixes = replace(seconds, longitude_rad=np.full(200, -sign * (np.pi - angle)))
    assert reference.compare(solution, fixes).east_m == pytest.approx(np.full(200, -sign * 200.0), abs=1e-4)


def test_a_solution_that_crosses_the_date_line_is_smooth():
    samples, epochs = 0.5 * np.arange(200), 0.25 + np.arange(99.0)
    speed = 200.0
    rate = speed / ((earth.radii(LATITUDE)[1] + HEIGHT_M) * np.cos(LATITUDE))

    def eastward(time_s):
        longitude = np.remainder(np.pi + rate * (time_s - 50.0) + np.pi, 2.0 * np.pi) - np.pi
        velocity = np.tile([0.0, speed, 0.0], (time_s.size, 1))
        return np.full(time_s.size, LATITUDE), longitude, np.full(time_s.size, HEIGHT_M), velocity

    fixes = as_fixes(epochs, *eastward(epochs))
    fixes.valid[40:60] = False  # the crossing itself falls into a gap
    errors = reference.compare(as_solution(samples, *eastward(samples)), fixes)
    assert np.abs(errors.east_m[errors.valid]).max() < POSITION_TOLERANCE_M
    drawn = reference.raw_vertices(as_solution(samples, *eastward(samples)), fixes)
    assert np.abs(drawn.east_m).max() < POSITION_TOLERANCE_M  # a straight line drawn straight is right


# --------------------------------------------------------------------------------------------------- gaps


def lose_by_flag(fixes, lost):
    return replace(fixes, valid=fixes.valid & ~lost)


def lose_by_nan(fixes, lost):
    velocity = fixes.velocity_n.copy()
    velocity[lost, 1] = np.nan
    return replace(fixes, velocity_n=velocity)


def lose_by_missing_rows(fixes, lost):
    return Fixes(*(getattr(fixes, name)[~lost] for name in list(Fixes.__dataclass_fields__)[:6]))


@pytest.mark.parametrize("lose", [lose_by_flag, lose_by_nan, lose_by_missing_rows])
def test_outages_are_found_however_they_are_marked(still, seconds, lose):
    lost = np.zeros(200, dtype=bool)
    lost[50:60] = lost[120] = True
    fixes = lose(seconds, lost)
    expected = ((49.0, 60.0), (119.0, 121.0))
    assert reference.outages(fixes) == expected
    assert reference.summary(reference.outages(fixes)) == (2, 13.0, 11.0)
    errors = reference.compare(still, fixes)
    assert errors.gaps == expected
    assert np.array_equal(errors.time_s, seconds.time_s)
    assert np.array_equal(errors.valid, ~lost)
    assert np.isnan(errors.north_m[lost]).all() and np.isnan(errors.velocity_n[lost]).all()
    assert np.isfinite(errors.north_m[~lost]).all() and np.isfinite(errors.velocity_n[~lost]).all()


def test_outages_at_both_ends_are_found(seconds):
    lost = (seconds.time_s < 10.0) | (seconds.time_s > 190.0)
    assert reference.outages(lose_by_flag(seconds, lost)) == ((0.0, 10.0), (190.0, 199.0))


def test_an_unbroken_reference_has_no_outage(seconds):
    jittered = replace(seconds, time_s=seconds.time_s + 0.2 * np.sin(np.arange(200.0)))
    assert reference.outages(jittered) == ()
    assert reference.summary(()) == (0, 0.0, 0.0)


def test_a_quantity_that_is_never_delivered_is_no_outage(still, seconds):
    """A navigator may give position alone: any column of a reference may be missing."""
    errors = reference.compare(still, replace(seconds, velocity_n=np.full((200, 3), np.nan)))
    assert errors.valid.all()
    assert np.abs(errors.north_m).max() < ROUNDING_M
    assert np.isnan(errors.velocity_n).all()


# ---------------------------------------------------------------------------------------------- a lost turn

SPEED_MPS, BANK_RAD = 210.0, np.radians(35.0)
TURN_RATE = 9.80665 * np.tan(BANK_RAD) / SPEED_MPS
HALF_TURN_RAD = np.radians(34.0)  # the middle 68 degrees of a 90 degree turn: 36 s, as in a box flight
TURN_AT_S = 150.0


def turning(time_s):
    """Level coordinated turn through north at 150 s, in metres north and east of a point, and its velocity."""
    psi = TURN_RATE * (time_s - TURN_AT_S)
    radius = SPEED_MPS / TURN_RATE
    velocity = SPEED_MPS * np.column_stack([np.cos(psi), np.sin(psi), np.zeros_like(psi)])
    return radius * np.sin(psi), radius * (1.0 - np.cos(psi)), velocity


def placed(time_s, north_m, east_m, velocity):
    """Metres to radians with the radii of the origin: exact enough for the size of a turn."""
    meridian, transverse = earth.radii(LATITUDE)
    latitude = LATITUDE + north_m / (meridian + HEIGHT_M)
    longitude = LONGITUDE + east_m / ((transverse + HEIGHT_M) * np.cos(LATITUDE))
    return latitude, longitude, np.full(time_s.size, HEIGHT_M), velocity


@pytest.fixture
def lost_turn():
    """Solution equal to the flight, and GPS that is lost symmetrically about the middle of the turn."""
    time_s = np.arange(301.0)
    flight = placed(time_s, *turning(time_s))
    fixes = as_fixes(time_s, *flight)
    half_s = HALF_TURN_RAD / TURN_RATE
    fixes.valid[np.abs(time_s - TURN_AT_S) < half_s] = False
    return as_solution(time_s, *flight), fixes


def test_gps_drawn_straight_across_a_turn_has_the_vertices_of_its_geometry(lost_turn):
    solution, fixes = lost_turn
    drawn = reference.raw_vertices(solution, fixes)
    gap = drawn.gaps[0]
    half = TURN_RATE * gap.duration_s / 2.0  # the heading actually lost, on whole seconds
    # v (1 - cos) of velocity and the sagitta R (1 - cos) of position, halfway
    middle = np.argmin(np.abs(drawn.time_s - TURN_AT_S))
    assert drawn.velocity_n[middle, 0] == pytest.approx(SPEED_MPS * (1.0 - np.cos(half)), rel=1e-3)
    assert -drawn.east_m[middle] == pytest.approx(SPEED_MPS / TURN_RATE * (1.0 - np.cos(half)), rel=0.01)
    assert np.abs(drawn.velocity_n[:, 0]).max() > 30.0
    assert not drawn.valid[middle]
    assert np.abs(drawn.velocity_n[drawn.valid]).max() < VELOCITY_TOLERANCE_MPS


def test_bridging_the_difference_has_no_vertex(lost_turn):
    """The same turn, the same gap: the INS is right, so its error must be drawn as zero."""
    bridged = reference.bridge(reference.compare(*lost_turn))
    assert np.abs([bridged.north_m, bridged.east_m]).max() < POSITION_TOLERANCE_M
    assert np.abs(bridged.velocity_n).max() < VELOCITY_TOLERANCE_MPS


def linear_errors(lost):
    time_s = np.arange(300.0)
    n, e, d = 3.0 + 0.5 * time_s, -2.0 * time_s, np.full(300, 7.0)
    v = np.outer(time_s, [0.01, -0.02, 0.0]) + 0.3
    gaps = reference.outages(replace(as_fixes(time_s, *parked(time_s)), valid=~lost))
    hidden = [np.where(lost, np.nan, x) for x in (n, e, d)]
    return (n, e, d, v), reference.Errors(time_s, *hidden, np.where(lost[:, None], np.nan, v), ~lost, gaps)


def test_a_linear_difference_is_bridged_exactly_and_stays_invalid():
    lost = np.zeros(300, dtype=bool)
    lost[100:136] = lost[150:160] = True  # the second gap lies within the window of the first
    (n, e, d, v), errors = linear_errors(lost)
    bridged = reference.bridge(errors)
    found = np.column_stack([bridged.north_m, bridged.east_m, bridged.down_m, bridged.velocity_n])
    assert found == pytest.approx(np.column_stack([n, e, d, v]), abs=1e-9)
    assert np.array_equal(bridged.valid, ~lost)
    assert np.isnan(errors.north_m[lost]).all()  # the input is untouched


def test_the_bridge_is_the_regression_over_a_minute_on_either_side():
    rng = np.random.default_rng(2)
    lost = np.zeros(300, dtype=bool)
    lost[140:160] = True
    _, errors = linear_errors(lost)
    noisy = replace(errors, north_m=errors.north_m + rng.normal(size=300))
    around = np.r_[79:140, 160:221]  # within 60 s of the last and next valid epochs, 139 s and 160 s
    line = np.polynomial.Polynomial.fit(noisy.time_s[around], noisy.north_m[around], 1)
    assert reference.bridge(noisy).north_m[lost] == pytest.approx(line(noisy.time_s[lost]), abs=1e-9)


def test_a_gap_at_an_end_is_not_extrapolated():
    lost = np.zeros(300, dtype=bool)
    lost[:20] = lost[280:] = True
    _, errors = linear_errors(lost)
    bridged = reference.bridge(errors)
    assert np.isnan(bridged.north_m[lost]).all()
    assert np.isfinite(bridged.north_m[~lost]).all()


def test_gps_is_not_drawn_beyond_its_ends(lost_turn):
    solution, fixes = lost_turn
    fixes.valid[:5] = False
    drawn = reference.raw_vertices(solution, fixes)
    assert np.isnan(drawn.north_m[:5]).all() and np.isfinite(drawn.north_m[5:]).all()


# ---------------------------------------------------------------------------------- standstill and refusals


def test_standstill_is_the_start_at_one_hertz(still):
    fixes = reference.standstill(still, Start(0.0, LATITUDE, LONGITUDE, HEIGHT_M))
    assert np.array_equal(fixes.time_s, np.arange(200.0))
    errors = reference.compare(replace(still, height_m=still.height_m - 2.0), fixes)
    assert errors.down_m == pytest.approx(np.full(200, 2.0))  # two metres too low is two metres down
    assert np.abs(errors.velocity_n).max() == 0.0


def test_a_reference_elsewhere_in_time_is_refused_with_both_spans(still, seconds):
    later = replace(seconds, time_s=seconds.time_s + 1000.0)
    with pytest.raises(DataRefused, match=r"1000\.000 to 1199\.000 s .* 0\.000 to 199\.000 s, which do not overlap"):
        reference.compare(still, later)
    assert reference.compare(still, later, time_offset_s=1000.0).valid.all()


def test_fewer_than_two_common_valid_epochs_are_refused(still, seconds):
    only_one = replace(seconds, valid=seconds.time_s == 7.0)
    with pytest.raises(DataRefused, match=r"with 1 valid epoch\(s\) in common; expected at least 2"):
        reference.compare(still, only_one)
    touching = replace(seconds, time_s=seconds.time_s + 199.0)
    with pytest.raises(DataRefused, match=r"0\.000 to 199\.000 s, with 1 valid"):
        reference.compare(still, touching)


def test_an_empty_reference_is_refused(still):
    empty = np.empty(0)
    with pytest.raises(DataRefused, match="no rows"):
        reference.compare(still, Fixes(empty, empty, empty, empty, np.empty((0, 3)), empty.astype(bool)))
    assert reference.outages(Fixes(empty, empty, empty, empty, np.empty((0, 3)), empty.astype(bool))) == ()
