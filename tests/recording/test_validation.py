"""Validation before navigation: each refusal has its sentence, and sound recordings pass untouched."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.errors import DataRefused
from ins_eval.readers.psins_text import read_imu_text
from ins_eval.recording import Fixes, Imu, Recording, Start
from ins_eval.recording.belief import Belief, GyroBelief
from ins_eval.recording.stuck import spikes, unmeasured
from ins_eval.recording.validation import validate
from tests.ideal import ideal

LATITUDE_RAD = np.radians(45.0)
GRAVITY_45 = 9.806199203  # m/s^2, normal gravity at 45 degrees and height 0, WGS-84
EARTH_RATE = 7.292115e-5  # rad/s
STEP_S = 0.01
SAMPLES = 2000


def parked(kind="static", seed=1, **start) -> Recording:
    """Level, heading north, at 45 degrees: Earth rate along forward and up, gravity down, a little noise."""
    rng = np.random.default_rng(seed)
    rate = np.array([np.cos(LATITUDE_RAD), 0.0, -np.sin(LATITUDE_RAD)]) * EARTH_RATE
    return Recording(
        name="parked",
        kind=kind,
        start=replace(Start(0.0, LATITUDE_RAD, 0.0, 0.0, attitude_rad=(0.0, 0.0, 0.0)), **start),
        imu=Imu(
            time_s=STEP_S * np.arange(1, SAMPLES + 1),
            gyro=rate * STEP_S + 1e-9 * rng.standard_normal((SAMPLES, 3)),
            accelerometer=np.array([0.0, 0.0, -GRAVITY_45]) * STEP_S + 1e-5 * rng.standard_normal((SAMPLES, 3)),
            accelerometer_form="increment",
        ),
        notes=("from a test",),
    )


def with_imu(recording: Recording, **columns) -> Recording:
    return replace(recording, imu=replace(recording.imu, **columns))


def refusal(recording: Recording) -> str:
    with pytest.raises(DataRefused) as refused:
        validate(recording)
    message = str(refused.value)
    assert message.startswith("recording 'parked'") and "\n" not in message
    return message


def test_a_sound_recording_passes_without_a_word():
    assert validate(parked()).notes == ("from a test",)


def test_a_recording_in_motion_is_not_measured_against_rest():
    imu = parked().imu
    moving = with_imu(parked(kind="flight"), gyro=imu.gyro + 0.01, accelerometer=1.3 * imu.accelerometer)
    assert validate(moving).notes == ("from a test",)


def test_what_is_said_to_rest_and_drives_is_refused():
    """A noise of 0.5 m/s is no motion."""
    m = 100
    noise = 0.5 * np.random.default_rng(7).standard_normal((m, 3))
    still = Fixes(
        np.linspace(1.0, 20.0, m), *(np.full(m, one) for one in (LATITUDE_RAD, 0.0, 0.0)), noise, np.ones(m, bool)
    )
    validate(replace(parked(), gps=still))
    drives = replace(still, velocity_n=noise + np.where(np.arange(m) > 70, 12.0, 0.0)[:, None] * [1.0, 0.0, 0.0])
    assert "expected rest, as of kind 'static'" in refusal(replace(parked(), gps=drives))


def test_a_gap_is_refused_with_place_and_length():
    time_s = parked().imu.time_s.copy()
    time_s[1200:] += 0.05
    message = refusal(with_imu(parked(), time_s=time_s))
    assert "gap of 0.06 s after 12 s (IMU sample 1200)" in message and "ins-eval import ins-recording" in message
    time_s[1500:] += 0.05
    assert "(IMU sample 1200) and 1 more" in refusal(with_imu(parked(), time_s=time_s))


def test_a_step_just_below_the_limit_is_no_gap():
    time_s = parked().imu.time_s.copy()
    time_s[1200:] += 0.49 * STEP_S
    validate(with_imu(parked(), time_s=time_s))


def test_a_sample_that_is_stamped_late_is_no_gap_and_is_said():
    time_s = parked().imu.time_s.copy()
    time_s[1200] += 0.8 * STEP_S
    notes = validate(with_imu(parked(), time_s=time_s)).notes
    assert any("1 samples are stamped late" in note and "first after 12 s" in note for note in notes)


@pytest.mark.parametrize("shift_s", [-0.01, -0.5])
def test_time_that_stands_still_or_goes_back_is_refused(shift_s):
    time_s = parked().imu.time_s.copy()
    time_s[700:] += shift_s
    message = refusal(with_imu(parked(), time_s=time_s))
    assert "at IMU sample 701" in message and "strictly increasing" in message


@pytest.mark.parametrize("time_s", [0.01, 5.0, -3.0])
def test_the_start_is_one_step_before_the_first_sample(time_s):
    assert "set the start's time one step before" in refusal(parked(time_s=time_s))


@pytest.mark.parametrize("column", ["gyro", "accelerometer", "temperature_c", "height_baro_m", "time_s"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_value_that_is_not_finite_is_refused_with_its_sample(column, bad):
    recording = with_imu(parked(), temperature_c=np.full(SAMPLES, 20.0), height_baro_m=np.zeros(SAMPLES))
    values = np.array(getattr(recording.imu, column))
    values[41] = bad
    message = refusal(with_imu(recording, **{column: values}))
    assert f"{column} is not finite" in message and "sample 42 of 2000" in message


@pytest.mark.parametrize(
    ("column", "shape"),
    [("gyro", (SAMPLES, 2)), ("accelerometer", (SAMPLES - 1, 3)), ("temperature_c", (SAMPLES, 2)), ("gyro", (9,))],
)
def test_a_wrong_shape_is_refused(column, shape):
    assert f"{column} has shape" in refusal(with_imu(parked(), **{column: np.zeros(shape)}))


def test_a_single_sample_is_refused():
    imu = parked().imu
    one = with_imu(parked(), time_s=imu.time_s[:1], gyro=imu.gyro[:1], accelerometer=imu.accelerometer[:1])
    assert "1 IMU samples, expected at least two" in refusal(one)


@pytest.mark.parametrize(
    ("factor", "shown", "guess"),
    [
        (1.0 / 9.80665, "0.102 times gravity", "g given for m/s^2"),
        (9.80665, "9.81 times gravity", "multiplied by g twice"),
        (100.0, "100 times gravity", "rates given for increments"),
        (1.05, "1.05 times gravity", "expected 9.8062;"),
        (0.0, "0 times gravity", "expected 9.8062;"),
    ],
)
def test_a_mix_up_of_accelerometer_units_is_refused_with_its_factor(factor, shown, guess):
    message = refusal(with_imu(parked(), accelerometer=factor * parked().imu.accelerometer))
    assert shown in message and guess in message and "convert the accelerometer" in message


@pytest.mark.parametrize(
    ("factor", "guess"),
    [
        (180.0 / np.pi, "degrees given for radians"),
        (np.pi / 180.0, "radians converted from degrees twice"),
        (100.0, "rates given for increments"),
        (648000.0 / np.pi, "arc seconds given for radians"),
        (0.0, "expected about 15.04;"),
    ],
)
def test_a_mix_up_of_gyro_units_is_refused(factor, guess):
    message = refusal(with_imu(parked(), gyro=factor * parked().imu.gyro))
    assert "times Earth rate" in message and guess in message and "convert the gyro" in message


@pytest.mark.parametrize("bias_deg_per_h", [-100.0, -5.0, 5.0, 100.0])
def test_a_poor_gyro_is_not_mistaken_for_a_mix_up(bias_deg_per_h):
    bias = np.radians(bias_deg_per_h / 3600.0) * STEP_S
    validate(with_imu(parked(), gyro=parked().imu.gyro + bias))


def test_where_the_belief_is_judged_biases_may_be_as_large_as_those_of_any_sensor():
    """Offsets of 500 deg/h beside a bias known to 10 deg/h, and of 80 mg, are findings; another unit is refused."""
    imu, bias = parked().imu, np.radians(500.0 / 3600.0) * STEP_S
    known = Belief(gyro=GyroBelief(bias_radps=(0.0, 0.0, 0.0), bias_sigma_deg_per_h=10.0))
    for other in (with_imu(parked(), gyro=imu.gyro + bias), with_imu(parked(), accelerometer=1.08 * imu.accelerometer)):
        other = replace(other, belief=known)
        refusal(other)
        assert validate(other, judged=True).notes == ("from a test",)
    with pytest.raises(DataRefused, match="times gravity"):
        validate(with_imu(parked(), accelerometer=imu.accelerometer / GRAVITY_45), judged=True)


def test_accelerometer_axes():
    accelerometer = parked().imu.accelerometer
    assert "does z point up?" in refusal(with_imu(parked(), accelerometer=-accelerometer))
    assert "another order?" in refusal(with_imu(parked(), accelerometer=accelerometer[:, [2, 0, 1]]))
    in_pulses = with_imu(parked(), accelerometer=-3e5 * accelerometer, accelerometer_form="pulse")
    assert "does z point up?" in refusal(in_pulses)
    validate(with_imu(in_pulses, accelerometer=-in_pulses.imu.accelerometer))


def test_gravity_is_expected_where_the_attitude_of_the_start_puts_it():
    """Nose straight up, the specific force points along the forward axis."""
    upwards = -parked().imu.accelerometer[:, [2, 1, 0]]
    turned = with_imu(parked(attitude_rad=(0.0, np.pi / 2, 0.0)), accelerometer=upwards)
    validate(turned)
    assert "another order?" in refusal(replace(turned, start=replace(turned.start, attitude_rad=None)))


@pytest.mark.parametrize("column", ["gyro", "accelerometer"])
def test_what_no_instrument_measures_is_refused(column):
    values = getattr(parked().imu, column).copy()
    values[9, 1] = 1e300
    assert "in sample 10 at 0.1 s" in refusal(with_imu(parked(kind="flight"), **{column: values}))


@pytest.mark.parametrize(
    ("start", "said"), [({"latitude_rad": 2.0}, "latitude is 114.592"), ({"height_m": np.nan}, "is not finite")]
)
def test_an_impossible_start_is_refused(start, said):
    assert said in refusal(parked(**start))


def fixes(**columns) -> Fixes:
    m = 5
    sound = Fixes(1.0 + np.arange(m), np.zeros(m), np.zeros(m), np.zeros(m), np.zeros((m, 3)), np.ones(m, bool))
    return replace(sound, **columns)


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"velocity_n": np.zeros((5, 2))}, "velocity_n has shape (5, 2)"),
        ({"time_s": np.array([1.0, 2.0, 2.0, 3.0, 4.0])}, "strictly increasing"),
        ({"height_m": np.array([0.0, np.nan, 0.0, 0.0, 0.0])}, "mark it valid = 0"),
        ({"latitude_rad": np.full(5, 34.0)}, "check the unit"),
    ],
)
def test_bad_fixes_are_refused(columns, said):
    message = refusal(replace(parked(), gps=fixes(**columns)))
    assert "'parked', gps:" in message and said in message


def test_an_outage_is_allowed():
    outage = fixes(latitude_rad=np.array([0.0, np.nan, 0.0, 0.0, 0.0]), valid=np.array([1, 0, 1, 1, 1], bool))
    validate(replace(parked(), reference=outage))


def test_stuck_dead_and_saturated_channels_are_noted_not_refused():
    gyro, accelerometer = parked().imu.gyro.copy(), parked().imu.accelerometer.copy()
    gyro[500:800, 0] = gyro[500, 0]
    accelerometer[:, 1] = 0.0
    accelerometer[:, 0] = np.clip(accelerometer[:, 0], -2e-5, 1e-5)
    low, high = (accelerometer[:, 0] == -2e-5).sum(), (accelerometer[:, 0] == 1e-5).sum()
    recording = validate(with_imu(parked(), gyro=gyro, accelerometer=accelerometer))
    assert recording.notes[1:] == (
        "Warning: the gyro x channel holds one value for 3 s up to 8 s: stuck?",
        f"Warning: the accelerometer x channel is at its smallest value in {low} samples: saturated?",
        f"Warning: the accelerometer x channel is at its largest value in {high} samples: saturated?",
        "The accelerometer y channel holds one value throughout: dead, or an ideal simulation.",
    )
    assert validate(recording).notes == recording.notes


def test_a_sample_that_stands_alone_is_noted_and_a_shock_is_not():
    """A shock rings for some samples; counts that are mostly 0, and a tail of Student's, hold single ones as well."""
    rng = np.random.default_rng(5)
    gyro, accelerometer = parked().imu.gyro.copy(), parked().imu.accelerometer.copy()
    gyro[[700, 1200], 2] += [1e-3, -2e-3]
    accelerometer[900:906, 0] += 0.1 * np.sin(np.arange(6.0))
    recording = validate(with_imu(parked(), gyro=gyro, accelerometer=accelerometer))
    (note,) = recording.notes[1:]
    assert note.startswith("Warning: 2 samples of the gyro z channel stand far from both neighbours, which agree, ")
    assert "first at 7.01 s: faults, or shocks?" in note
    for quiet in (1.0 * (rng.random(SAMPLES) < 5e-4), rng.standard_t(5.0, SAMPLES), np.zeros(SAMPLES), np.zeros(1)):
        assert not spikes(quiet).size


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9, 1.0])
def test_a_sensor_is_stuck_that_measures_in_the_rest(share):
    """A channel that never changes may be an ideal simulation."""
    gyro = parked().imu.gyro.copy()
    gyro[: round(share * SAMPLES), 0] = gyro[0, 0]
    expected = {} if share == 1.0 else {"gyro.x": pytest.approx(share, abs=2.0 / SAMPLES)}
    assert unmeasured(with_imu(parked(), gyro=gyro)) == expected


def test_a_sensor_does_not_measure_at_its_limits():
    accelerometer = parked().imu.accelerometer.copy()
    low, high = np.quantile(accelerometer[:, 0], [0.1, 0.8])
    accelerometer[:, 0] = np.clip(accelerometer[:, 0], low, high)
    found = unmeasured(with_imu(parked(), accelerometer=accelerometer))
    assert found == {"accelerometer.x": pytest.approx(0.3, abs=2.0 / SAMPLES)}


def test_a_motion_without_noise_is_neither_stuck_nor_at_a_limit():
    recording = ideal("climb-cruise-landing")
    assert unmeasured(recording) == {}
    gyro = recording.imu.gyro.copy()
    gyro[:, 2] = np.clip(gyro[:, 2], *(0.5 * np.array([gyro[:, 2].min(), gyro[:, 2].max()])))
    assert unmeasured(with_imu(recording, gyro=gyro)) == {}


def test_coarse_counts_are_neither_stuck_nor_saturated():
    """A channel of a few distinct counts repeats values by chance for a second and longer."""
    rng = np.random.default_rng(3)
    gyro = parked().imu.gyro.copy()
    gyro[:, 1] = 1e-7 * (rng.random(SAMPLES) < 0.02)
    quantum = 2e-6
    accelerometer = quantum * np.round(parked().imu.accelerometer / quantum)
    assert validate(with_imu(parked(), gyro=gyro, accelerometer=accelerometer)).notes == ("from a test",)


def test_the_real_laser_gyro_recording_passes(laser_gyro):
    recording = read_imu_text(laser_gyro)
    assert validate(recording).notes == recording.notes
