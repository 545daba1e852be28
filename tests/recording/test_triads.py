"""Order, signs and units of both triads without an attitude, on independent worlds of every grade."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import beta

from benchmark.worlds.grades import RANGES, a_recording
from ins_eval.readers import read
from ins_eval.recording import Recording, consistency, form
from ins_eval.recording.consistency import triads
from ins_eval.recording.consistency.alternatives import BEYOND_DOUBT, MATRICES, equations, mistakes
from ins_eval.units import DEG, STANDARD_GRAVITY

PATHS = ("climb, cruise, landing", "box", "straight", "wing rock", "drive")
RATE_HZ = 25.0
DRIVE = ("shared", "recordings", "fog_mems_vehicle", "transfer_align_fog_mems.mat")
SEEDS = 7  # of each grade on each path: 105 recordings
MOST_REFUSED = 0.035  # of sound ones, upper end of the 95 % interval at none of 105
JUMP_S = 0.28  # of a clock
LEAST_NAMED = 0.95  # of what a motion on wheels, or the unit, must tell


def turned(recording: Recording, gyro: np.ndarray, accelerometer: np.ndarray) -> Recording:
    """Both triads as a file has them whose axes are `matrix` @ ours."""
    imu = recording.imu
    changed = replace(imu, gyro=imu.gyro @ gyro.T, accelerometer=imu.accelerometer @ accelerometer.T)
    return replace(recording, imu=changed)


SAME = np.eye(3)
X_SIGN, Y_SIGN, Z_SIGN = (np.diag(signs) for signs in ([-1.0, 1, 1], [1.0, -1, 1], [1.0, 1, -1]))
X_WITH_Y = np.eye(3)[[1, 0, 2]]
MOUNTED = [np.diag([1.0, -1, -1]), np.diag([1.0, 1, -1]) @ np.eye(3)[[0, 2, 1]], np.diag([-1.0, 1, 1]) @ X_WITH_Y]
# what is spoilt, and the key of the remedy
SPOILT = {
    "gyro x sign": (X_SIGN, SAME, "axes"),
    "gyro z sign": (Z_SIGN, SAME, "axes"),
    "accelerometer y sign": (SAME, Y_SIGN, "axes"),
    "gyro x with y": (X_WITH_Y, SAME, "axes"),
    "both x with y": (X_WITH_Y, X_WITH_Y, "axes"),
    "gyro deg/s": (SAME / DEG, SAME, "gyro.unit"),
    "accelerometer g": (SAME, SAME / STANDARD_GRAVITY, "accelerometer.unit"),
}


@pytest.fixture(scope="module")
def world(tmp_path_factory) -> dict[tuple[str, str, int], Recording]:
    """Recordings by grade, path and seed, each made when it is first asked for; what they contradict is not judged."""

    class Worlds(dict):
        def __missing__(self, key: tuple[str, str, int]) -> Recording:
            grade, path, seed = key
            folder = Path(tmp_path_factory.mktemp("world")) / "recording"
            a_recording(np.random.default_rng([seed, PATHS.index(path)]), grade, path, RATE_HZ).save(folder)
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(consistency, "BEYOND_DOUBT", np.inf)
                self[key] = form.read(folder)
            return self[key]

    return Worlds()


def refused(recording: Recording) -> list[triads.Finding]:
    return [found for found in triads.check_triads(recording) if found.log_odds > BEYOND_DOUBT]


def test_stamps_that_jump_lengthen_a_window_and_are_no_other_axes(world):
    """Of fixes a second apart every other window holds a jump, and ends beyond the times at which motion is summed."""
    recording = world["consumer", "wing rock", 0]
    fixes = recording.gps
    assert np.median(np.diff(fixes.time_s)) == pytest.approx(1.0, abs=0.01)
    jumped = fixes.time_s + JUMP_S * np.floor(np.arange(fixes.time_s.size) / 16.0 + 0.25)
    assert refused(replace(recording, gps=replace(fixes, time_s=jumped))) == []


@pytest.mark.parametrize(("grade", "path"), [("consumer", "wing rock"), ("consumer", "drive")])
def test_a_sound_recording_with_an_arm_and_offsets_is_not_refused(world, grade, path):
    assert not refused(world[grade, path, 0])


@pytest.mark.parametrize("name", ["gyro z sign", "both x with y", "gyro deg/s"])
def test_what_is_beyond_doubt_is_refused_again(world, name):
    gyro, accelerometer, key = SPOILT[name]
    (found,) = refused(turned(world["consumer", "drive", 0], gyro, accelerometer))
    assert found.key == key
    if key == "axes":
        np.testing.assert_array_equal(found.matrix if name.startswith("both") else Z_SIGN, gyro)
    else:
        assert found.factor == pytest.approx(DEG)


@pytest.mark.parametrize(
    "mounted",
    [pytest.param(one, id=equations(one), marks=() if k == 1 else pytest.mark.slow) for k, one in enumerate(MOUNTED)],
)
def test_a_box_that_is_mounted_as_its_start_states_is_as_it_should_be(world, mounted):
    """On its side, upside down or to the left of a car; without the attitude the same axes are refused."""
    recording = world["consumer", "drive", 0]
    fixes = recording.gps
    first = np.flatnonzero(np.hypot(*fixes.velocity_n[:, :2].T) > triads.MOVING_MPS)[0]
    course = float(np.arctan2(fixes.velocity_n[first, 1], fixes.velocity_n[first, 0]))
    attitude = (Rotation.from_euler("z", course) * Rotation.from_matrix(mounted).inv()).as_euler("ZYX")[::-1]
    box = turned(recording, mounted, mounted)
    assert triads.check_triads(box)[0].decided
    stated = replace(box, start=replace(box.start, attitude_rad=tuple(attitude), attitude_sigma_rad=(0.1, 0.1, 0.3)))
    assert not [found for found in triads.check_triads(stated) if found.decided]
    down = np.diag(1.0 - 2.0 * np.abs(mounted[:, 2]))
    (found,) = refused(turned(stated, down, SAME))  # a wrong sign shows all the same
    assert found.key == "axes"


def test_one_mistake_stands_before_the_same_motion_in_a_turned_box(world):
    """Gyros x and y exchanged are as far from the data as three mistakes in a box on its side, and likelier."""
    (found,) = triads.check_triads(turned(world["industrial", "climb, cruise, landing", 0], X_WITH_Y, SAME))
    counted = [int(mistakes(force) + mistakes(rate)) for force, rate in found.orders[: triads.MOST_NAMED]]
    np.testing.assert_array_equal(found.orders[0], (SAME, X_WITH_Y))
    assert counted[0] == 1 and counted == sorted(counted)


def test_mistakes_are_counted_as_they_are_made():
    """Breadth first over signs and exchanges: the fewest that lead to each order and sign."""
    made = [one for one in MATRICES if mistakes(one) == 1]
    assert len(made) == 3 + 3 * 2  # signs, and exchanges with either sign
    near, reached = [SAME], {tuple(SAME.ravel()): 0}
    while near:
        ways = [(one @ step, reached[tuple(one.ravel())] + 1) for one in near for step in made]
        near = []
        for matrix, count in ways:
            if tuple(matrix.ravel() + 0.0) not in reached:
                reached[tuple(matrix.ravel() + 0.0)] = count
                near.append(matrix + 0.0)
    assert {key: int(mistakes(np.reshape(key, (3, 3)))) for key in reached} == reached
    assert len(reached) == len(MATRICES)


def test_the_real_drive_without_its_attitude():
    """A unit on wheels whose vibration is as large as its motion: no unit may win by making the noise small."""
    file = Path(__file__).resolve().parents[3].joinpath(*DRIVE)
    if not file.exists():
        pytest.skip(f"the real recording ../{'/'.join(DRIVE)} is absent here")
    recording = read("psins-mat", file, {})
    recording = replace(recording, reference=replace(recording.reference, attitude_rad=None))
    assert not [found for found in triads.check_triads(recording) if found.decided]
    assert refused(turned(recording, Z_SIGN, SAME))


@pytest.mark.slow
def test_no_sound_recording_of_105_is_refused(world):
    keys = [(grade, path, seed) for seed in range(SEEDS) for path in PATHS for grade in RANGES]
    wrong = [(key, found) for key in keys for found in refused(world[key])]
    high = float(beta.ppf(0.975, len(wrong) + 1, len(keys) - len(wrong)))
    print(f"refused {len(wrong)} of {len(keys)}, at most {100 * high:.1f} %")
    assert high < MOST_REFUSED, wrong


@pytest.mark.slow
def test_what_the_motion_can_tell_is_named_with_its_key(world):
    """Each mistake on each grade and path; a sign of the gyro about down needs a heading that changes."""
    named = {}
    for grade in RANGES:
        for path in PATHS:
            for name, (gyro, accelerometer, key) in SPOILT.items():
                if name == "gyro z sign" and path in ("straight", "wing rock"):
                    continue
                found = triads.check_triads(turned(world[grade, path, 0], gyro, accelerometer))
                named[grade, path, name] = any(one.decided and one.key == key for one in found)
    share = np.mean(list(named.values()))
    print(f"named {sum(named.values())} of {len(named)}")
    assert share >= LEAST_NAMED, [key for key, well in named.items() if not well]
