"""What is navigated in arcs: real recordings of MEMS units that stand and fly, and what must not be named in them.

What is documented of each stands in `SOURCE.md` beside it. The laws of the parked unit are held against straight
lines through its means of 20 s, which need no navigation.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ins_eval.believed import believed
from ins_eval.diagnosis.answer.verdict import Diagnosis
from ins_eval.diagnosis.unnamed.disturbance import of_windows
from ins_eval.diagnosis.unnamed.open_form import open_forms
from ins_eval.earth import EARTH_RATE, gravity
from ins_eval.error_model import null
from ins_eval.errors import DataRefused
from ins_eval.estimation import arcs
from ins_eval.estimation import case as cases
from ins_eval.estimation.description import _beyond_sensors
from ins_eval.estimation.evidence import log_evidence, reduce, sensitivity
from ins_eval.estimation.noise import ALONE, ALONE_SPREAD
from ins_eval.estimation.study import fit_noise
from ins_eval.recording import Fixes, Imu, Recording, Start
from ins_eval.recording.belief import AccelerometerBelief, Belief, EarthBelief, EffectBelief, GpsBelief, GyroBelief
from ins_eval.recording.validation import validate
from ins_eval.strapdown import navigate
from ins_eval.units import ARCSEC, DEG, DEG_PER_H, DEG_PER_SQRT_H, UG
from tests.diagnosis.real_recordings import diagnosed, imported, values
from tests.ideal import RATE_HZ

DISTURBED_S, DISTURBED_DEG_PER_H, NORTH_DEG = 120.0, 1.0, 3.0  # of a recording of 15 min; what that leaves of north
FROM_S, TO_S = 400.0, 520.0  # of a climb
OFF_S, DISTURBED_COARSE_DEG_PER_H, SHRUNK = 460.0, 3000.0, 0.05  # of a gyro from then on; what a prior takes off
BIASED_DEG_PER_H, ENDS_MPS = 2000.0, 0.02
DRIFT_PPM = 0.05  # of a clock: 6 microseconds in all
TURNED_ARCSEC, ROUNDING_ARCSEC = 1000.0, 1e-3
OFF_M, NEAR, NO_PRIOR = 500.0, 0.2, 1.0  # of a guess, share of it that is left; sigmas of a prior, of 17 for a guess
STAMPS_S, FIX_M, FIX_MPS = 0.05, 0.5, 0.05  # one sigma of stamps and of fixes
LOUD, LOUDER = 4, 0.7  # gyro y, by so many prior sigmas more than the others
AGREES, SLOPE_STEP = 0.35, 1e-3  # at one speed stamps and white noise look alike, and a part is counted twice
DWELL_S, TURN_S, AS_IT_LIES_RAD = 200.0, 18.0, 0.01  # of a box on four sides; 3 mg in doubt are 3 mrad
STANDING_DEG_PER_H, SAME_HEADING_RAD = 20.0, 1.0 * DEG
AUTOPILOT_LATE_S = (0.21, 0.29)  # of positions, by the authors' filter; of velocities, by their increments


def climb(ideal_recording) -> Recording:
    """Two minutes of a flight with gyros that are believed to be bad enough for arcs of 18 s."""
    whole = ideal_recording("climb-cruise-landing")
    rows, fixes = (one.time_s > FROM_S for one in (whole.imu, whole.gps)), whole.gps
    imu_rows, fix_rows = rows
    imu_rows, fix_rows = imu_rows & (whole.imu.time_s <= TO_S), fix_rows & (fixes.time_s <= TO_S)
    imu = replace(
        whole.imu,
        time_s=whole.imu.time_s[imu_rows],
        gyro=whole.imu.gyro[imu_rows],
        accelerometer=whole.imu.accelerometer[imu_rows],
        further={},
    )
    first = int(np.searchsorted(fixes.time_s, FROM_S))
    before = slice(int(np.searchsorted(whole.imu.time_s, FROM_S + 1e-6)))
    flown = navigate(whole.imu.time_s[before], whole.imu.gyro[before], whole.imu.accelerometer[before], whole.start)
    start = replace(
        whole.start,
        time_s=FROM_S,
        latitude_rad=float(fixes.latitude_rad[first]),
        longitude_rad=float(fixes.longitude_rad[first]),
        height_m=float(fixes.height_m[first]),
        velocity_n=tuple(float(v) for v in fixes.velocity_n[first]),
        attitude_rad=tuple(float(angle) for angle in flown.attitude_rad[-1]),
    )
    gyro = whole.belief.gyro.model_copy(update={"bias_sigma_deg_per_h": 100.0})
    belief = whole.belief.model_copy(update={"gyro": gyro})
    return replace(whole, imu=imu, gps=fixes.rows(fix_rows), start=start, belief=belief)


def stands_in_a_drive(seed: int) -> Recording:
    """A unit of 20 deg/h that stands for five minutes in what is called a drive, and no start is stated."""
    rng, n, roll_pitch = np.random.default_rng(seed), 300 * 25, np.radians([0.6, -1.1])
    heading = rng.uniform(0.0, 2.0 * np.pi)
    to_body = Rotation.from_euler("ZYX", [heading, roll_pitch[1], roll_pitch[0]]).inv()
    latitude = 0.75
    rate = to_body.apply(EARTH_RATE * np.array([np.cos(latitude), 0.0, -np.sin(latitude)]))
    force = to_body.apply([0.0, 0.0, -float(gravity(latitude, 50.0))])
    rate = rate + STANDING_DEG_PER_H * DEG_PER_H * rng.standard_normal(3)
    force = force + 2000.0 * UG * rng.standard_normal(3)
    white = 0.3 * DEG_PER_SQRT_H / 5.0, 100.0 * UG / 5.0
    imu = Imu(
        time_s=np.arange(1, n + 1) / 25.0,
        gyro=rate / 25.0 + white[0] * rng.standard_normal((n, 3)),
        accelerometer=force / 25.0 + white[1] * rng.standard_normal((n, 3)),
        accelerometer_form="increment",
    )
    fixes = 300 * 5
    north_m, east_m, down_m = 0.9 * rng.standard_normal((3, fixes)) + np.cumsum(
        0.02 * rng.standard_normal((3, fixes)), axis=1
    )
    gps = Fixes(
        np.arange(fixes) / 5.0,
        latitude + north_m / 6.37e6,
        0.1 + east_m / 4.66e6,
        50.0 - down_m,
        0.05 * rng.standard_normal((fixes, 3)),
        np.ones(fixes, dtype=bool),
    )
    belief = Belief(
        gyro=GyroBelief(bias_sigma_deg_per_h=STANDING_DEG_PER_H, angle_random_walk_deg_per_sqrt_h=0.3),
        accelerometer=AccelerometerBelief(bias_sigma_ug=2000.0, velocity_random_walk_ug_per_sqrt_hz=100.0),
        gps=GpsBelief(position_sigma_m=1.8, velocity_sigma_mps=0.05),
    )
    start = Start(0.0, latitude, 0.1, 50.0, position_sigma_m=2.0, velocity_sigma_mps=0.1)
    return believed(Recording("stands", "drive", start, imu, gps=gps, belief=belief))


@pytest.mark.parametrize("seed", range(4))
def test_what_nothing_shows_stays_as_it_is_believed(seed: int) -> None:
    """Round by round a heading that nothing shows turned on, with a bias of 3000 deg/h, and a sign seemed wrong."""
    recording = stands_in_a_drive(seed)
    settled = arcs.settle(recording)
    found = settled.navigated
    headings = np.unwrap([one.attitude_rad[2] for one in (found.start, *found.arcs)])
    assert len(headings) > 2
    assert np.ptp(headings) < SAME_HEADING_RAD
    sigma = recording.belief.gyro.bias_sigma_deg_per_h * DEG_PER_H
    assert (np.abs(found.gyro_bias) < 3.0 * sigma).all()
    assert _beyond_sensors(cases.prepare(recording)) == []


def test_arcs_begin_where_samples_end_also_by_another_clock(ideal_recording) -> None:
    """A state that is a sample away from where its arc begins would be a jump of metres."""
    recording = climb(ideal_recording)
    drift = EffectBelief(name="recording.clock_drift", value=DRIFT_PPM)
    case = cases.prepare(recording)
    other = case.again([drift])
    assert len(other.believed.arcs) == len(case.believed.arcs) > 3
    for arc in other.believed.arcs:
        assert arc.time_s in other.believed.time_s


def test_arcs_begun_near_their_states_need_one_round_and_end_there(ideal_recording, monkeypatch) -> None:
    """Fixes and arcs are those of the recording: however they were begun, they end at the states that it tells."""
    case, rounds, errors = cases.prepare(climb(ideal_recording)), [], arcs._errors
    monkeypatch.setattr(arcs, "_errors", lambda here: rounds.append(0) or errors(here))
    bias = EffectBelief(name="gyro.bias", axis="x", value=BIASED_DEG_PER_H)
    once = case.again([bias])
    assert len(rounds) == arcs.ROUNDS_AGAIN
    twice = case.again([bias], once)
    assert len(rounds) == arcs.ROUNDS_AGAIN + 1
    velocities = [np.array([arc.velocity_n for arc in one.believed.arcs]) for one in (once, twice)]
    np.testing.assert_allclose(*velocities, atol=ENDS_MPS)


def test_stamps_that_jitter_and_motion_between_samples_are_noise_of_their_own(ideal_recording) -> None:
    """Fixes at stamps that are off by chance scatter with speed; slopes of the evidence are those of differences."""
    recording = climb(ideal_recording)
    rng = np.random.default_rng(4)
    fixes = recording.gps
    late_s = np.clip(STAMPS_S * rng.standard_normal(fixes.time_s.size), -3.0 * STAMPS_S, 3.0 * STAMPS_S)
    white = [FIX_MPS * rng.standard_normal(fixes.velocity_n.shape), *(FIX_M * rng.standard_normal((2, late_s.size)))]
    received = replace(
        fixes,
        time_s=fixes.time_s + late_s,
        velocity_n=fixes.velocity_n + white[0],
        latitude_rad=fixes.latitude_rad + white[1] / 6.37e6,
        longitude_rad=fixes.longitude_rad + white[2] / 6.37e6,
    )
    case = cases.prepare(replace(recording, gps=received))
    (fitted,) = fit_noise([case], [], [None])
    allowed = case.noise.levels(fitted.noise_point).white[np.isfinite(case.seen.residual[:, 0])]
    speed = np.median(np.abs(fixes.velocity_n[:, :2]), axis=0)
    np.testing.assert_allclose(np.median(allowed[:, :2], axis=0), np.hypot(FIX_M, STAMPS_S * speed), rtol=AGREES)
    alone = replace(case, noise=case.noise.with_one_alone(LOUD))
    for one, noise_point, names in (
        (case, fitted.noise_point, ("jitter", "accelerometer_sampling", "gyro_sampling")),
        (alone, np.append(fitted.noise_point, LOUDER), ("accelerometer_wander", "gyro_wander", ALONE)),
    ):
        ready, free = one.ready([]), one.noise.free
        _, slope_of = ready.slope(noise_point, sensitivity)
        for name in names:
            step = SLOPE_STEP * np.eye(slope_of.size)[free.index(name)]
            sides = [log_evidence(ready(noise_point + sign * step)) for sign in (1.0, -1.0)]
            difference = (sides[0] - sides[1]) / (2.0 * SLOPE_STEP)
            assert slope_of[free.index(name)] == pytest.approx(difference, rel=1e-3, abs=1e-3)
    ratio = alone.noise.levels(np.append(fitted.noise_point, LOUDER)).wander_sigma
    ratio = ratio / case.noise.levels(fitted.noise_point).wander_sigma
    np.testing.assert_allclose(ratio, np.where(np.arange(6) == LOUD, np.exp(ALONE_SPREAD * LOUDER), 1.0))


def test_a_disturbance_without_a_name_is_as_large_as_the_unit_is_coarse(ideal_recording) -> None:
    """At sizes of a navigation grade 3000 deg/h of gyro x were 220 mg of accelerometer y, which can be as large."""
    recording = climb(ideal_recording)
    rng = np.random.default_rng(4)
    imu, fixes = recording.imu, recording.gps
    gyro = imu.gyro + [DISTURBED_COARSE_DEG_PER_H * DEG_PER_H / RATE_HZ, 0.0, 0.0] * (imu.time_s > OFF_S)[:, None]
    latitude, longitude = rng.normal(0.0, FIX_M / 6.37e6, (2, fixes.time_s.size))
    received = replace(
        fixes,
        velocity_n=rng.normal(fixes.velocity_n, FIX_MPS),
        latitude_rad=fixes.latitude_rad + latitude,
        longitude_rad=fixes.longitude_rad + longitude,
    )
    case = cases.prepare(replace(recording, imu=replace(imu, gyro=gyro), gps=received))
    over, edges_s, whitened = of_windows(case, np.zeros(len(case.noise.free)))
    form = max(open_forms(reduce(whitened, len(case.nuisances)), len(over)), key=lambda one: one.log_bayes_factor)
    channel = over[form.channel]
    assert channel.name == "gyro.x"
    off = edges_s[:-1] > OFF_S
    found = channel.size / DEG_PER_H * (form.mean[off].mean() - form.mean[edges_s[1:] < OFF_S].mean())
    assert found == pytest.approx(DISTURBED_COARSE_DEG_PER_H, rel=SHRUNK)


def test_a_start_that_is_stated_is_held_against_what_is_found_also_where_arcs_are_needed(ideal_recording) -> None:
    """A heading stated to minutes of arc and 1.6 degrees off was taken for a first guess, and nothing was said."""
    recording = climb(ideal_recording)
    before = arcs.settle(recording)
    turned = cases.with_effects(recording.belief, [EffectBelief(name="alignment.heading", value=TURNED_ARCSEC)])
    after = arcs.settle(replace(recording, belief=turned), before=before)
    assert before.navigated.arcs and after.navigated.arcs
    headings = [one.stated.attitude_rad[2] / ARCSEC for one in (before, after)]
    stated = recording.start.attitude_rad[2] / ARCSEC
    assert headings == pytest.approx([stated, stated + TURNED_ARCSEC], abs=ROUNDING_ARCSEC)


def test_sigmas_of_an_attitude_that_is_not_stated_count_for_nothing(ideal_recording) -> None:
    start = climb(ideal_recording).start
    recording = replace(climb(ideal_recording), start=replace(start, attitude_rad=None))
    assert not null.begins_as_stated(recording, start)


def test_how_far_a_first_guess_was_off_is_held_against_no_start(ideal_recording, monkeypatch) -> None:
    """A guess that is half a kilometre off is corrected, and the start that it had is no prior of any effect."""
    stated = climb(ideal_recording)
    recording = replace(stated, start=replace(stated.start, attitude_sigma_rad=None))
    find = null.begin_afresh

    def guessed_far_off(*of: Any) -> tuple:
        believed, found, path = find(*of)
        path = replace(path, longitude_rad=path.longitude_rad + OFF_M / 6.37e6)
        start = null.start_at(path, believed.start.time_s)
        off = {"position_sigma_m": believed.start.position_sigma_m, "velocity_sigma_mps": 3.0}
        return replace(believed, start=replace(start, **off)), found, path

    monkeypatch.setattr(null, "begin_afresh", guessed_far_off)
    case = cases.prepare(recording)
    again = case.again([])
    assert np.nanmax(np.abs(case.seen.residual[:, :3])) < NEAR * OFF_M
    for one in (case, again):
        starts = [taken for column, taken in zip(one.nuisances, one.taken, strict=True) if column.start]
        assert len(starts) == 9
        np.testing.assert_allclose(starts, 0.0, atol=NO_PRIOR)


def test_what_a_start_was_found_to_be_is_not_sought_again(ideal_recording) -> None:
    """Where arcs begin in it too; without a reference that only knows attitudes it may be another."""
    recording = climb(ideal_recording)
    recording = replace(recording, start=replace(recording.start, attitude_rad=None, attitude_sigma_rad=None))
    _, shown, path = null.begin_afresh(recording)
    _, again, same = null.begin_afresh(recording, shown=shown)
    assert again is shown
    np.testing.assert_array_equal(same.quaternion_nb, path.quaternion_nb)


def test_what_an_alignment_uses_up_is_navigated_in_arcs(ideal_recording, monkeypatch) -> None:
    """Of a unit that stands for minutes and then taxis no heading is found before the end; arcs begin without one."""
    recording = climb(ideal_recording)
    expected = cases.prepare(recording)
    believe = null.believe

    def used_up(recording: Recording, folder: Path) -> null.Believed:
        believed = believe(recording, folder)
        return replace(believed, time_s=believed.time_s[:0])

    monkeypatch.setattr(null, "believe", used_up)
    found = cases.prepare(recording)
    assert len(found.believed.arcs) == len(expected.believed.arcs) > 3
    np.testing.assert_array_equal(found.seen.residual, expected.seen.residual)


def test_what_is_believed_without_an_earth_is_navigated_in_arcs(ideal_recording) -> None:
    """In one arc its solution is faster than anything after two hours."""
    flight = ideal_recording("climb-cruise-landing")
    flat = EarthBelief(rotation=False, coriolis=False, transport_rate=False)
    case = cases.prepare(replace(flight, belief=flight.belief.model_copy(update={"earth": flat})))
    assert case.settled is not None and not arcs.lost(case.seen)


def test_an_experiment_that_an_alignment_uses_up_is_refused(recording_at_rest) -> None:
    """As long as a short log whose temperatures it repeats, with a heading that nobody knows."""
    parked = recording_at_rest(95.0, 3, np.zeros_like)
    unknown = replace(parked.start, attitude_sigma_rad=(1e-3, 1e-3, np.pi), still_until_s=None)
    with pytest.raises(DataRefused, match="95 s are all needed to find its heading"):
        arcs.planned(replace(parked, start=unknown))


def test_arcs_that_begin_after_the_end_by_another_clock_are_gone(ideal_recording) -> None:
    recording = climb(ideal_recording)
    case = cases.prepare(recording)
    last = case.believed.arcs[-1]
    ends_s = case.believed.time_s
    ends_s = ends_s[ends_s < last.time_s - 1.0]
    kept = arcs._on_steps(case.believed.arcs, ends_s)
    assert 0 < len(kept) < len(case.believed.arcs)
    assert max(one.time_s for one in kept) < ends_s[-1]
    assert len({one.time_s for one in kept}) == len(kept)


def late_in_flight(found: Diagnosis) -> float:
    """How late the fixes are from the start of the motion on: an offset, and a step of the other clock before it."""
    of = values(found)
    return of.get(("gps.time_offset", None), 0.0) - of.get(("recording.clock_step", None), 0.0)


@pytest.mark.slow
def test_the_clock_of_an_autopilot_is_late_and_an_applied_delay_comes_on_top(tmp_path: Path) -> None:
    recording = imported("plane", tmp_path / "plane")
    applied = 0.15
    later = replace(recording, gps=replace(recording.gps, time_s=recording.gps.time_s + applied))
    own, both = (late_in_flight(diagnosed(one, tmp_path / "plane")) for one in (recording, later))
    assert AUTOPILOT_LATE_S[0] < own < AUTOPILOT_LATE_S[1]
    assert AUTOPILOT_LATE_S[0] < both - applied < AUTOPILOT_LATE_S[1]


def test_a_heading_that_began_wrong_is_not_left_to_the_biases_of_gyros(recording_at_rest) -> None:
    """Somebody moves a parked unit while it is aligned: what heading and gyros share is the heading's."""
    parked = recording_at_rest(900.0, 3, np.zeros_like)
    time_s = parked.imu.time_s
    extra = DISTURBED_DEG_PER_H * DEG_PER_H * (time_s < DISTURBED_S) * np.diff(time_s, prepend=0.0)
    gyro = parked.imu.gyro + np.outer(extra, [0.0, 1.0, 0.0])
    unaligned = replace(parked.start, attitude_rad=None, attitude_sigma_rad=None)
    navigated = arcs.settle(replace(parked, imu=replace(parked.imu, gyro=gyro), start=unaligned)).navigated
    assert abs(navigated.start.attitude_rad[2]) < NORTH_DEG * DEG
    assert (np.abs(navigated.gyro_bias) < 0.3 * DISTURBED_DEG_PER_H * DEG_PER_H).all()


@pytest.mark.parametrize("bias_ug", [0.0, 3000.0])
def test_a_box_that_is_turned_between_stands_begins_each_arc_as_it_lies(recording_at_rest, bias_ug: float) -> None:
    """On four sides in turn, with a bias of fifty times its sigma: the path follows the turns, far beyond small angles.

    Truth are the turns that the increments are made of.
    """
    parked = recording_at_rest(5.0 * DWELL_S, 3, np.zeros_like)  # on the last side it lies longest
    imu = parked.imu
    middle_s = imu.time_s - 0.5 * np.diff(imu.time_s, prepend=0.0)

    def rolled(time_s: np.ndarray) -> np.ndarray:
        return 0.5 * np.pi * np.clip((time_s - DWELL_S * np.arange(1, 4)[:, None]) / TURN_S, 0.0, 1.0).sum(axis=0)

    box = Rotation.from_rotvec(np.outer(rolled(middle_s), [1.0, 0.0, 0.0]))
    turning = np.diff(rolled(imu.time_s), prepend=0.0)
    gyro = box.apply(imu.gyro, inverse=True) + np.outer(turning, [1.0, 0.0, 0.0])
    force = box.apply(imu.accelerometer, inverse=True)
    force[:, 2] += bias_ug * UG * np.diff(imu.time_s, prepend=0.0)
    turned = replace(parked, imu=replace(imu, gyro=gyro, accelerometer=force))
    validate(turned, judged=True)
    navigated = arcs.settle(turned).navigated
    for arc in navigated.arcs:
        if any(one.start_s < arc.time_s < one.end_s for one in navigated.stands):
            away = Rotation.from_euler("ZYX", arc.attitude_rad[::-1]).inv() * box[int(arc.time_s * RATE_HZ) - 1]
            assert away.magnitude() < AS_IT_LIES_RAD
    assert len(navigated.stands) == 4
