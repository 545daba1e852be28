"""A start from what is there, in recordings of an independent world whose truth is known, and in real ones."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from scipy.spatial.transform import Rotation
from scipy.stats import beta, chi2

from benchmark.worlds.earth import from_euler, radii
from benchmark.worlds.grades import RANGES, a_recording
from benchmark.worlds.mems import a_journey
from benchmark.worlds.record import Made
from ins_eval.analysis.evaluate import evaluate_recording
from ins_eval.errors import DataRefused
from ins_eval.initialization import ATTITUDE, GYRO_BIAS, Initialization, find
from ins_eval.initialization import windows as of_windows
from ins_eval.initialization.rest import Felt, seconds_at_rest, velocity_sigma
from ins_eval.initialization.search import track
from ins_eval.initialization.smoother import filtered
from ins_eval.initialization.windows import first_window, standstills, window_of
from ins_eval.navigation import beginning, evaluate
from ins_eval.readers import apm_mat, apm_text
from ins_eval.recording import Fixes, Imu, Recording, Start, form
from ins_eval.recording.stillness import Stretch, still_stretches
from ins_eval.report.json_file import as_json
from ins_eval.restarts import restarts
from ins_eval.units import DEG, DEG_PER_H, UG

RATE_HZ = 20.0
PATHS = ("drive", "climb, cruise, landing", "drive", "box")
STATES = 9  # position, velocity, attitude
ONBOARD_RAD = 10.0 * DEG  # an autopilot's own attitude: heading by a magnetometer that is believed to 20 degrees
CONSUMER_HEADING_RAD = 3.0 * DEG  # found after a minute of motion
ENOUGH = 3.0  # sigmas
MOST_REFUSED = 6  # of 200, upper end of the 95 % interval at the 1 that was measured
BEFORE_TAKE_OFF_S = 190.0  # it taxies, and begins to take off within the last minute of them
TURNED_RAD = 20.0 * DEG
AFTER_S = 120.0
# what the window shows of the heading, and what turn-on biases make of it in minutes
CARRIED_RAD = {"tactical": 1.0 * DEG, "consumer": 5.0 * DEG}
ROUNDING_MPS = 1e-5
ROUNDING = 1e-9  # of numbers of order 1
JUMPS_AFTER_S = 10.0
KEPT_MPS = 0.3  # whatever the instant within a piece of half a minute at which it jumps
DRIVES_OFF_UNSEEN = (53, 12)  # seed and number of a journey of a consumer unit that begins as its car comes to rest
STANDS_S = (120.0, 180.0, 240.0)  # stands until the first of these, and between the others
CREEPS_S, OF_CREEPING_S = (100.0, 200.0), 10.0
OF_LONGER_SIGMAS = 0.2
GROWN_M = 5.0  # after ten seconds of an industrial unit, beside the noise of two fixes


def errors_of(seed: int, folder: Path, velocities: bool = True) -> tuple[np.ndarray, Initialization]:
    """True less found position (m), velocity (m/s) and attitude (rad) of one recording, and what was found.

    Without `velocities` the receiver gave positions alone.
    """
    grade, path = list(RANGES)[seed % 3], PATHS[seed % 4]
    made = a_recording(np.random.default_rng(seed), grade, path, RATE_HZ)
    made.save(folder)
    recording = form.read(folder)
    if not velocities:
        nothing = np.full_like(recording.gps.velocity_n, np.nan)
        recording = replace(recording, gps=replace(recording.gps, velocity_n=nothing, velocity_sigma_mps=None))
    found = find(recording, recording.imu.gyro, recording.imu.accelerometer)
    start = found.start
    lla, velocity, euler, _ = made.felt.truth.state([start.time_s])
    m, n = radii(lla[0, 0])
    metres = np.array([m + lla[0, 2], (n + lla[0, 2]) * np.cos(lla[0, 0]), -1.0])
    position = (lla[0] - [start.latitude_rad, start.longitude_rad, start.height_m]) * metres
    seen = Rotation.from_euler("ZYX", start.attitude_rad[::-1]).as_matrix()
    turned = Rotation.from_matrix(from_euler(*euler[0]) @ seen.T).as_rotvec()
    return np.concatenate([position, velocity[0] - start.velocity_n, turned]), found


def squared(errors: np.ndarray, found: Initialization, part: slice = slice(0, STATES)) -> float:
    """Normalised error squared."""
    return float(errors[part] @ np.linalg.solve(found.covariance[part, part], errors[part]))


def test_stated_sigmas_are_those_of_the_errors(tmp_path: Path) -> None:
    """A consumer unit and a tactical one that drive; 200 units of every grade that drive and fly are a slow test."""
    runs = [errors_of(seed, tmp_path / str(seed)) for seed in (0, 2)]
    total = sum(squared(*run) for run in runs)
    low, high = chi2.interval(0.998, STATES * len(runs))
    assert low < total < high
    assert all(not found.rival_headings_rad for _, found in runs)
    assert runs[0][1].heading_sigma_rad < CONSUMER_HEADING_RAD


def test_positions_alone_are_a_start_in_motion(tmp_path: Path) -> None:
    """A tactical unit that drives: its heading is found without a measured velocity, and the sigmas are true."""
    errors, found = errors_of(2, tmp_path / "r", velocities=False)
    low, high = chi2.interval(0.998, STATES)
    assert low < squared(errors, found) < high
    assert found.heading_sigma_rad < CONSUMER_HEADING_RAD and not found.rival_headings_rad


def stood(sway_mps: float, noise_mps: float, rolls_mps2: float = 0.0, seconds: int = 120) -> Felt:
    """A unit on a slope, whose velocity at the end of each second is drawn, and white noise; it rolls in the last 3."""
    rng, n = np.random.default_rng(11), round(RATE_HZ)
    velocity = np.vstack([np.zeros((1, 3)), sway_mps * rng.standard_normal((seconds, 3))])
    dv = np.repeat(np.diff(velocity, axis=0) / n, n, axis=0) + np.array([0.3, -0.2, -9.8]) / RATE_HZ
    dv += noise_mps / np.sqrt(RATE_HZ) * rng.standard_normal(dv.shape)
    dv[-3 * n :, 0] += rolls_mps2 / RATE_HZ
    time_s = np.arange(1, len(dv) + 1) / RATE_HZ
    return Felt(time_s, np.zeros_like(dv), dv, np.full(len(dv), 1.0 / RATE_HZ))


@pytest.mark.parametrize(("sway_mps", "noise_mps"), [(0.01, 1e-4), (0.002, 2e-3), (0.001, 2e-4)])
def test_sway_of_a_vehicle_that_stands_is_measured(sway_mps: float, noise_mps: float) -> None:
    """Within three sigmas of an estimate of s^2 from n = 360 values, sqrt(2 / n) c_0."""
    felt = stood(sway_mps, noise_mps)
    found = velocity_sigma(felt, seconds_at_rest(felt, Stretch(0.0, 120.0)))
    spread = np.sqrt(2.0 / 360.0) * (2.0 * sway_mps**2 + noise_mps**2)
    assert abs(found**2 - sway_mps**2) < ENOUGH * spread


def test_seconds_in_which_a_vehicle_begins_to_roll_are_not_rest() -> None:
    whole = Stretch(0.0, 120.0)
    assert seconds_at_rest(stood(1e-3, 1e-3), whole)[-1, 1] == 120.0
    assert seconds_at_rest(stood(1e-3, 1e-3, rolls_mps2=0.03), whole)[-1, 1] == 117.0


@pytest.mark.slow
def test_stated_sigmas_of_starts_by_positions_alone(tmp_path: Path) -> None:
    """The mean normalised error squared of 24 drives and flights lies in its 99.8 % band."""
    runs = [errors_of(seed, tmp_path / str(seed), velocities=False) for seed in range(3000, 3024)]
    total = sum(squared(*run) for run in runs)
    low, high = chi2.interval(0.998, STATES * len(runs))
    print(f"mean {total / len(runs):.2f} of {STATES} [{low / len(runs):.2f}, {high / len(runs):.2f}]")
    assert low < total < high


@pytest.mark.slow
def test_stated_sigmas_of_200_drives_and_flights(tmp_path: Path) -> None:
    """The mean normalised error squared lies in its 95 % band, and 95 % regions hold as often as they say.

    What is refused is counted: one flight of a consumer unit, for which no attitude was found.
    """
    runs = []
    for seed in range(7000, 7200):
        with contextlib.suppress(DataRefused):
            runs.append(errors_of(seed, tmp_path / str(seed)))
    assert len(runs) >= 200 - MOST_REFUSED
    of = {"all": slice(0, 9), "position": slice(0, 3), "velocity": slice(3, 6), "attitude": ATTITUDE}
    for name, part in of.items():
        values = np.array([squared(errors, found, part) for errors, found in runs])
        states = part.stop - part.start
        low, high = chi2.interval(0.95, states * len(values))
        inside = int((values < chi2.ppf(0.95, states)).sum())
        least = beta.ppf(0.025, inside, len(values) - inside + 1)
        most = beta.ppf(0.975, inside + 1, len(values) - inside)
        print(f"{name}: mean {values.mean():.2f} of {states} [{low / len(values):.2f}, {high / len(values):.2f}], "
              f"{inside} of {len(values)} inside 95 % [{least:.3f}, {most:.3f}]")  # fmt: skip
        assert low < values.sum() < high
        assert least < 0.95 < most


def smooth_road(kind: str, sigma_mps: float = 0.05) -> Recording:
    """A unit whose noise hides the road and half a m/s^2: stands, drives at 10 m/s, stands again and drives."""
    rng, rate_hz = np.random.default_rng(6), 50.0
    time_s = np.arange(1, round(300.0 * rate_hz) + 1) / rate_hz
    stops_s = np.array([STANDS_S[0], STANDS_S[0] + 20.0, STANDS_S[1] - 20.0, STANDS_S[1], STANDS_S[2], 260.0])

    def along(at_s: np.ndarray) -> np.ndarray:
        return np.interp(at_s, stops_s, [0.0, 10.0, 10.0, 0.0, 0.0, 10.0])

    force = np.column_stack([np.diff(along(time_s), prepend=0.0), 0.0 * time_s, np.full(time_s.size, -9.8 / rate_hz)])
    imu = Imu(
        time_s,
        2e-5 * rng.standard_normal((time_s.size, 3)),
        force + 0.02 * rng.standard_normal((time_s.size, 3)),
        "increment",
    )
    at_s = np.arange(1.0, 300.0)
    velocity_n = np.column_stack([along(at_s), 0.0 * at_s, 0.0 * at_s]) + 0.05 * rng.standard_normal((at_s.size, 3))
    latitude = 0.6 + np.cumsum(along(at_s)) / 6.37e6
    fixes = Fixes(at_s, latitude, np.full(at_s.size, 0.1), np.zeros(at_s.size), velocity_n, np.ones(at_s.size, bool),
                  velocity_sigma_mps=np.full(at_s.size, sigma_mps))  # fmt: skip
    return Recording("unit", kind, Start(0.0, 0.6, 0.1, 0.0), imu, gps=fixes)


def test_a_standstill_ends_where_fixes_move_though_the_imu_does_not_see_it() -> None:
    recording = smooth_road("drive")
    assert still_stretches(recording.imu)[0].end_s > STANDS_S[0] + 10.0
    first, second = standstills(recording)
    assert abs(first.start_s) < 1e-9 and STANDS_S[0] - 6.0 < first.end_s < STANDS_S[0]
    assert STANDS_S[1] < second.start_s < STANDS_S[1] + 6.0 and STANDS_S[2] - 6.0 < second.end_s < STANDS_S[2]
    # at walking pace coarse fixes stand as well, and what hovers is quiet and slow in the air
    assert standstills(smooth_road("drive", sigma_mps=0.3)) == standstills(smooth_road("flight")) == []


@pytest.mark.parametrize("turns", [0.0, 0.07])
def test_who_creeps_does_not_stand(turns: float) -> None:
    """0.3 m/s on a course that stays or turns, by fixes of 0.05 m/s of which none by itself says that it moves."""
    stands = smooth_road("drive")
    at_s = stands.gps.time_s
    moves = (at_s > CREEPS_S[0]) & (at_s <= CREEPS_S[1])
    course = turns * at_s
    way = 0.3 * np.where(moves, [np.cos(course), np.sin(course), 0.0 * course], 0.0).T
    noise = 0.05 * np.random.default_rng(3).standard_normal((at_s.size, 3))
    quiet = replace(stands.imu, accelerometer=stands.imu.accelerometer * [0.0, 0.0, 1.0])
    fixes = [replace(stands.gps, velocity_n=one + noise) for one in (way, 0.0 * way)]
    creeping, standing = (standstills(replace(stands, imu=quiet, gps=one)) for one in fixes)
    assert len(standing) == 1 and len(creeping) == 2
    assert abs(creeping[0].end_s - CREEPS_S[0]) < OF_CREEPING_S > abs(creeping[1].start_s - CREEPS_S[1])


@pytest.fixture(scope="module")
def unseen(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    folder = tmp_path_factory.mktemp("unseen") / "r"
    next(a_journey(*DRIVES_OFF_UNSEEN).cases).recorded.save(folder)
    return form.read(folder)


def test_a_noisy_unit_in_a_car_that_stood_begins(unseen: Recording) -> None:
    """Its gyros' offsets, of half a degree per second and more, turned a first guess by 60 degrees in the minute."""
    found = beginning(unseen, unseen.imu.accelerometer)
    seen = a_journey(*DRIVES_OFF_UNSEEN).seen.tables["reference"]
    k = int(np.argmin(np.abs(seen["time_s"] - found.start.time_s)))
    true = Rotation.from_euler("ZYX", [seen[name][k] for name in ("heading_deg", "pitch_deg", "roll_deg")], True)
    away = (true * Rotation.from_euler("ZYX", found.start.attitude_rad[::-1]).inv()).as_rotvec()
    assert (np.abs(away) < ENOUGH * found.sigmas[ATTITUDE]).all()


def test_samples_that_are_longer_at_rest_show_the_same_start(unseen: Recording, monkeypatch) -> None:
    """Nothing is lost of what a window gains; what follows moves by far less than it is uncertain."""
    increments, (begin_s, _, end_s, _) = (unseen.imu.gyro, unseen.imu.accelerometer), first_window(unseen)
    windows, found = [], []
    for longer in (True, False):
        if not longer:
            monkeypatch.setattr(of_windows, "_longer_at_rest", lambda felt, _: (felt.time_s, felt.dtheta_b, felt.dv_b))
        windows.append(window_of(unseen, *increments, begin_s, end_s))
        found.append(beginning(unseen, unseen.imu.accelerometer))
    few, many = windows
    assert len(few.time_s) < 0.7 * len(many.time_s) and set(few.time_s) <= set(many.time_s)
    assert np.diff(few.time_s).max() < 0.3
    for one, all_of in ((few.dtheta_b, many.dtheta_b), (few.dv_b, many.dv_b)):
        rows = np.searchsorted(many.time_s, few.time_s)
        np.testing.assert_allclose(np.cumsum(one, axis=0), np.cumsum(all_of, axis=0)[rows], atol=1e-12)
    first, second = (Rotation.from_euler("ZYX", one.start.attitude_rad[::-1]) for one in found)
    assert (np.abs((first * second.inv()).as_rotvec()) < OF_LONGER_SIGMAS * found[1].sigmas[ATTITUDE]).all()
    np.testing.assert_allclose(found[0].sigmas, found[1].sigmas, rtol=OF_LONGER_SIGMAS)


def test_an_imu_that_disagrees_with_its_fixes_finds_no_attitude(unseen: Recording) -> None:
    wrong = replace(unseen, imu=replace(unseen.imu, gyro=unseen.imu.gyro / DEG_PER_H))
    with pytest.raises(DataRefused, match="no attitude makes IMU and fixes agree"):
        beginning(wrong, wrong.imu.accelerometer)


@pytest.fixture(scope="module")
def driven() -> Made:
    """An industrial unit in a car that states no attitude."""
    return a_recording(np.random.default_rng(7), "industrial", "drive", RATE_HZ)


@pytest.fixture(scope="module")
def drive(driven: Made, tmp_path_factory: pytest.TempPathFactory) -> Recording:
    folder = tmp_path_factory.mktemp("drive") / "r"
    driven.save(folder)
    return form.read(folder)


@pytest.fixture(scope="module")
def begin(drive: Recording) -> Initialization:
    found = beginning(drive, drive.imu.accelerometer)
    assert isinstance(found, Initialization)
    return found


def test_a_mems_drive_is_navigated_and_restarted_without_a_reference(drive: Recording, begin: Initialization) -> None:
    found = evaluate(drive, drive.imu.accelerometer, begin, until_s=begin.start.time_s + 60.0)
    assert found.initialization is begin
    pieces = restarts(drive, drive.imu.accelerometer, 10.0, begin)
    assert pieces.count > 100
    assert (pieces.position_interval_m[0] < pieces.position_rms_m).all()
    assert (pieces.position_rms_m < pieces.position_interval_m[1]).all()
    assert pieces.position_rms_m[-1] < GROWN_M
    few = restarts(drive, drive.imu.accelerometer, 1000.0, begin)
    assert np.isnan(few.position_interval_m).all()


def test_samples_that_carry_the_ins_away_are_refused(drive: Recording, begin: Initialization) -> None:
    """The state no longer advances there: pieces of it would be taken without end."""
    imu, force = drive.imu, drive.imu.accelerometer.copy()
    force[imu.time_s > begin.start.time_s + 100.0] *= 1e7
    with pytest.raises(DataRefused, match="carry the INS away"):
        restarts(replace(drive, imu=replace(imu, accelerometer=force)), force, 10.0, begin)


@pytest.mark.slow
def test_positions_alone_are_evaluated_and_restarted(drive: Recording, begin: Initialization) -> None:
    """The numbers leave velocities out; positions grow as those of an industrial unit, more than with velocities."""
    nothing = np.full_like(drive.gps.velocity_n, np.nan)
    placed = replace(drive, gps=replace(drive.gps, velocity_n=nothing, velocity_sigma_mps=None))
    found = evaluate_recording(placed, restart_every_s=10.0)
    pieces = found.tree["restarts"]["none"]
    assert "velocity_rms_mps" not in pieces and "velocity_interval95_mps" not in pieces
    assert pieces["count"] > 100 and pieces["position_rms_m"][-1] < GROWN_M
    both = restarts(drive, drive.imu.accelerometer, 10.0, begin)
    assert both.position_rms_m[-1] < pieces["position_interval95_m"][-1][1]
    assert as_json(found.tree)


def test_an_unknown_heading_is_stated_as_unknown(drive: Recording) -> None:
    """Without fixes the standstill levels the unit and gives its gyro offsets, and says nothing of the heading."""
    parked = replace(drive, gps=None, kind="static")
    begin = beginning(parked, parked.imu.accelerometer)
    assert isinstance(begin, Initialization)
    assert not begin.heading_known
    assert begin.sigmas[GYRO_BIAS].max() < 30.0 * DEG_PER_H  # the Earth turns, and nobody knows along which axis


def test_a_stated_heading_is_kept_at_rest(drive: Recording) -> None:
    start = replace(drive.start, attitude_rad=(0.0, 0.0, 1.0), attitude_sigma_rad=(np.pi, np.pi, 0.02))
    parked = replace(drive, gps=None, kind="static", start=start)
    begin = find(parked, parked.imu.gyro, parked.imu.accelerometer)
    assert abs(begin.start.attitude_rad[2] - 1.0) < ENOUGH * 0.02
    assert begin.heading_sigma_rad < 0.03


def test_a_stated_attitude_is_carried_to_a_window_that_begins_later(tmp_path: Path) -> None:
    """A tactical unit that is told its attitude while the aircraft taxies, and turns before it takes off."""
    made = a_recording(np.random.default_rng(5), "tactical", "climb, cruise, landing", RATE_HZ)
    made.save(tmp_path / "r")
    whole = form.read(tmp_path / "r")
    taxi_s = first_window(whole)[1] - BEFORE_TAKE_OFF_S
    recording, rows = whole.between(taxi_s, whole.imu.time_s[-1])
    euler = made.felt.truth.state([recording.start.time_s])[2][0]
    stated = replace(recording.start, attitude_rad=tuple(euler.tolist()), attitude_sigma_rad=(0.1 * DEG,) * 3)
    found = find(replace(recording, start=stated), whole.imu.gyro[rows], whole.imu.accelerometer[rows])
    end = made.felt.truth.state([found.start.time_s])[2][0]
    assert abs(np.sin(made.felt.truth.state([found.window.start_s])[2][0, 2] - euler[2])) > TURNED_RAD
    assert abs(np.sin(found.start.attitude_rad[2] - end[2])) < ENOUGH * found.sigmas[ATTITUDE][2]


@pytest.mark.parametrize("grade", ["tactical", pytest.param("consumer", marks=pytest.mark.slow)])
def test_a_path_is_carried_back_to_the_start_of_who_turns_before_it_moves_fast(tmp_path: Path, grade: str) -> None:
    """Nothing is stated; the window that shows the start begins minutes after the aircraft began to taxi."""
    made = a_recording(np.random.default_rng(5), grade, "climb, cruise, landing", RATE_HZ)
    made.save(tmp_path / "r")
    whole = form.read(tmp_path / "r")
    taxi_s = first_window(whole)[1] - BEFORE_TAKE_OFF_S
    recording, rows = whole.between(taxi_s, taxi_s + BEFORE_TAKE_OFF_S + AFTER_S)
    increments = whole.imu.gyro[rows], whole.imu.accelerometer[rows]
    found = find(recording, *increments)
    path = track(recording, found, *increments)
    assert path.time_s[0] == recording.start.time_s < found.window.start_s - 60.0
    _, velocity, euler, _ = made.felt.truth.state(path.time_s)
    before = path.time_s < found.window.start_s
    assert np.abs(np.sin(euler[before, 2] - euler[before, 2][-1])).max() > TURNED_RAD
    seen = Rotation.from_quat(path.quaternion_nb[before], scalar_first=True)
    true = Rotation.from_euler("ZYX", euler[before][:, ::-1])
    assert np.linalg.norm((true * seen.inv()).as_rotvec(), axis=1).max() < CARRIED_RAD[grade]
    assert np.sqrt(((path.velocity_n - velocity)[before] ** 2).mean(axis=0)).max() < KEPT_MPS


@pytest.mark.parametrize(("accelerometer_ug", "gyro_deg_per_h"), [(15000.0, 0.0), (0.0, 3000.0)])
def test_a_path_is_kept_where_a_bias_jumps(
    driven: Made, drive: Recording, begin: Initialization, accelerometer_ug: float, gyro_deg_per_h: float
) -> None:
    """Bias z of an industrial unit jumps by three and five turn-on sigmas after the window that showed the start."""
    dtheta_b, dv_b = drive.imu.gyro.copy(), drive.imu.accelerometer.copy()
    after = drive.imu.time_s > begin.window.end_s + JUMPS_AFTER_S
    dtheta_b[after, 2] += gyro_deg_per_h * DEG_PER_H / RATE_HZ
    dv_b[after, 2] += accelerometer_ug * UG / RATE_HZ
    path = track(drive, begin, dtheta_b, dv_b)
    true_n = driven.felt.truth.state(path.time_s)[1]
    assert np.sqrt(((path.velocity_n - true_n) ** 2).mean(axis=0)).max() < KEPT_MPS


@pytest.mark.parametrize("velocities", [True, False])
def test_the_date_line_changes_nothing(drive: Recording, velocities: bool) -> None:
    """The Earth is the same all around: a drive across 180 degrees is the one that it is elsewhere."""
    gps = drive.gps if velocities else replace(drive.gps, velocity_n=np.full_like(drive.gps.velocity_n, np.nan))
    east = np.pi - float(np.nanmedian(gps.longitude_rad))
    around = np.remainder(gps.longitude_rad + east + np.pi, 2.0 * np.pi) - np.pi
    assert np.abs(np.diff(around)).max() > np.pi
    increments = drive.imu.gyro, drive.imu.accelerometer
    paths = []
    for fixes in (gps, replace(gps, longitude_rad=around)):
        recording = replace(drive, gps=fixes)
        paths.append(track(recording, find(recording, *increments), *increments))
    np.testing.assert_allclose(paths[1].velocity_n, paths[0].velocity_n, atol=ROUNDING_MPS)


def test_an_attitude_sigma_of_any_size_is_a_start(drive: Recording, begin: Initialization) -> None:
    """A sigma of 180 degrees states that the attitude is unknown."""
    start = replace(drive.start, attitude_rad=(0.0, 0.0, 0.0), attitude_sigma_rad=(np.pi,) * 3)
    said = beginning(replace(drive, start=start), drive.imu.accelerometer)
    assert said.start == begin.start


def test_without_rest_and_fixes_there_is_no_start(drive: Recording) -> None:
    rows = slice(0, round(3.0 * RATE_HZ))
    columns = {name: getattr(drive.imu, name)[rows] for name in ("time_s", "gyro", "accelerometer")}
    short = replace(drive, gps=None, imu=Imu(**columns, accelerometer_form="increment"))
    with pytest.raises(DataRefused, match=r"give attitude_deg in \[start\]"):
        beginning(short, short.imu.accelerometer)


@pytest.mark.parametrize(
    ("reader", "parts"),
    [
        (apm_mat, ("plane_flight_gps_latency", "TestLog2.mat")),
        (apm_text, ("quad_flight_gps_latency", "quad106.zip")),
    ],
)
def test_real_mems_flights_begin_where_their_autopilot_was(reader, parts: tuple[str, str]) -> None:
    """Within a few degrees of the autopilot's own attitude, which the search does not see."""
    file = Path(__file__).resolve().parents[2].joinpath("shared", "recordings", *parts)
    if not file.exists():
        pytest.skip(f"the real recording ../shared/recordings/{'/'.join(parts)} is absent here")
    whole = reader.read(file, {"gps.time_offset_s": "0.2"})
    blind = replace(whole, reference=None, start=replace(whole.start, attitude_rad=None, attitude_sigma_rad=None))
    begin = beginning(blind, blind.imu.accelerometer)
    assert isinstance(begin, Initialization) and not isinstance(begin, Stretch)
    reference = whole.reference
    at = int(np.argmin(np.abs(reference.time_s - begin.start.time_s)))
    theirs = Rotation.from_euler("ZYX", reference.attitude_rad[at][::-1])
    off = Rotation.from_euler("ZYX", begin.start.attitude_rad[::-1]) * theirs.inv()
    assert off.magnitude() < ONBOARD_RAD


def test_the_filter_and_its_smoother_are_those_of_another_library() -> None:
    """filterpy's, where some rows measure nothing, some channels are not measured, and two states stay as they are."""
    rng = np.random.default_rng(5)
    n, rows = 6, 14
    transition = np.tile(np.eye(n), (rows - 1, 1, 1))
    transition[:, :4] += 0.3 * rng.normal(size=(rows - 1, 4, n)) * (rng.random((rows - 1, 4, n)) < 0.6)
    noise = rng.uniform(0.1, 1.0, (rows - 1, n)) * [1.0, 1.0, 1.0, 1.0, 0.0, 0.1]
    row = np.array([0, 2, 2, 5, 6, 9, 13])
    z, h = rng.normal(size=(row.size, 3)), rng.normal(size=(row.size, 3, n))
    variance = rng.uniform(0.5, 2.0, (row.size, 3))
    variance[1, 2] = variance[4, 0] = 0.0
    mean, root = rng.normal(size=n), rng.normal(size=(n, n))
    other, log_likelihood = KalmanFilter(n, 1), 0.0
    other.x, other.P = mean.copy(), root @ root.T
    states, covariances = [], []
    for k in range(rows):
        if k:
            other.predict(F=transition[k - 1], Q=np.diag(noise[k - 1]))
        for m in np.flatnonzero(row == k):
            for channel in np.flatnonzero(variance[m] > 0.0):
                other.update(z[m, channel], R=variance[m, channel], H=h[m, channel : channel + 1])
                log_likelihood += other.log_likelihood + 0.5 * np.log(2.0 * np.pi)
        states.append(other.x.copy())
        covariances.append(other.P.copy())
    smoothed, *_ = other.rts_smoother(
        np.array(states), np.array(covariances), [np.eye(n), *transition], [np.eye(n), *map(np.diag, noise)]
    )
    found, last, covariance, height, _ = filtered(transition, noise, row, z, h, variance, mean, root @ root.T, np.inf)
    assert found == pytest.approx(smoothed, abs=ROUNDING)
    assert last == pytest.approx(states[-1], abs=ROUNDING)
    assert covariance == pytest.approx(covariances[-1], abs=ROUNDING)
    assert height == pytest.approx(log_likelihood, abs=ROUNDING)
