"""What the doctor finds in a recording whose truth is known, and each thing it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.errors import DataRefused, UsageError
from ins_eval.readers import read
from ins_eval.readers.doctor import KEYS, examine
from ins_eval.readers.layout import Layout, frd_from
from ins_eval.recording import Fixes, Imu, Recording, Start, consistency
from ins_eval.recording.belief import AccelerometerBelief, AxisBelief, Belief, GpsBelief, ScaleBelief
from ins_eval.recording.consistency.alternatives import BEYOND_DOUBT

ALL_KEYS = (*KEYS, *Layout.KEYS, "gps.time_offset_s")
RATE_HZ, LASTED_S = 50.0, 60.0
LATENCY_S = 0.25


def late(motion) -> Recording:
    """A weaving vehicle whose fixes come late."""
    dt = 1.0 / RATE_HZ
    middle = slice(0, None, 10)
    imu = Imu(
        motion.time_s[1:],
        0.5 * dt * (motion.rate_b[1:] + motion.rate_b[:-1]),
        0.5 * dt * (motion.force_b[1:] + motion.force_b[:-1]),
        "increment",
    )
    gps = Fixes(
        motion.time_s[middle] + LATENCY_S,
        motion.latitude[middle],
        motion.longitude[middle],
        motion.height[middle],
        motion.velocity_n[middle],
        np.ones(len(motion.time_s[middle]), dtype=bool),
    )
    start = Start(0.0, float(motion.latitude[0]), float(motion.longitude[0]), 100.0)
    return Recording("weaving", "drive", start, imu, gps)


@pytest.fixture(scope="module")
def flight(weaving) -> Recording:
    return late(weaving(RATE_HZ, LASTED_S))


def notes(recording: Recording, **assumed: str) -> str:
    return "\n".join(examine(recording, {key.replace("__", "."): v for key, v in assumed.items()}, ALL_KEYS).notes)


def refusal(recording: Recording, keys=ALL_KEYS, **assumed: str) -> str:
    with pytest.raises(DataRefused) as refused:
        examine(recording, assumed, keys)
    message = str(refused.value)
    assert "\n" not in message and "recording 'weaving'" in message and "expected" in message
    return message


def with_imu(recording: Recording, **columns) -> Recording:
    return replace(recording, imu=replace(recording.imu, **columns))


def test_what_is_found(flight):
    found = notes(flight)
    assert "Found 3000 samples over 60 s, 50 Hz; the steps are even." in found
    assert "times gravity, along up" in found and "as it should be" in found
    assert "Found that GPS covers 0.25 to 60.25 s and the IMU 0 to 60 s; 2 of 301 epochs lie outside." in found
    assert "Found no temperature" in found
    assert found.count("\n") == 5


def test_a_late_receiver_is_warned_of_and_a_believed_one_agrees(flight):
    warning = next(note for note in notes(flight).split("\n") if note.startswith("Warning"))
    found_s = float(warning.split("same instant are ")[1].split(" ")[0])
    assert found_s == pytest.approx(LATENCY_S, abs=0.005)
    assert "believed is 0 s; the found one was not applied, --assume gps.time_offset_s=0.2" in warning
    believing = replace(flight, belief=Belief(gps=GpsBelief(time_offset_s=LATENCY_S)))
    assert "which agrees" in notes(believing)
    assert "Warning" not in notes(believing)


def test_stamps_that_spread(flight):
    rng = np.random.default_rng(2)
    found = notes(with_imu(flight, time_s=flight.imu.time_s + 2e-3 * rng.uniform(-1, 1, flight.imu.time_s.size)))
    assert "the steps spread by 1.6" in found  # sqrt(2) 2 ms / sqrt(3)


def test_temperatures_and_one_clock(flight):
    alone = with_imu(replace(flight, gps=None), temperature_c=np.linspace(20.0, 31.5, 3000))
    assert "Found temperatures of 20 to 31.5 degC." in notes(alone)
    assert "Found one clock" in notes(alone)


def test_pulses_are_turned_with_the_believed_scale(flight):
    axis = AxisBelief(scale=ScaleBelief(gamma=3e5))
    belief = Belief(accelerometer=AccelerometerBelief(x=axis, y=axis, z=axis))
    pulses = np.rint(flight.imu.accelerometer / 9.80665 * 3e5)
    counted = with_imu(flight, accelerometer=pulses, accelerometer_form="pulse")
    assert "same instant are +0.2" in notes(replace(counted, belief=belief))
    assert "the motion does not show" in notes(counted)


@pytest.mark.parametrize(
    ("factor", "guess"),
    [
        (1.0 / 9.80665, "g read as m/s^2"),
        (9.80665, "m/s^2 read as g"),
        (1000.0 / 9.80665, "milli-g read as m/s^2"),
        (1000.0, "milli-g read as g"),
        (50.0, "rates read as increments"),
        (0.02, "increments read as rates"),
        (3.0, "no unit that is known"),
        (0.0, "dead channel"),
    ],
)
def test_a_wrong_unit_of_the_accelerometer(flight, factor, guess):
    message = refusal(with_imu(flight, accelerometer=factor * flight.imu.accelerometer))
    assert guess in message and "--assume accelerometer.unit=UNIT takes it all the same" in message


def test_a_finding_is_overridden_by_stating_it(flight):
    in_g = with_imu(flight, accelerometer=flight.imu.accelerometer / 9.80665)
    assert "0.1" in notes(in_g, accelerometer__unit="m/s^2")
    upside_down = with_imu(flight, accelerometer=-flight.imu.accelerometer)
    assert "along down" in notes(upside_down, axes="FRD") and "you assume to be right" in notes(upside_down, axes="FRD")
    fast = with_imu(flight, gyro=180.0 / np.pi * flight.imu.gyro)
    assert "you assume to be right" in notes(fast, gyro__unit="rad/s")


def test_a_format_without_that_key_does_not_offer_it(flight):
    assert "--assume" not in refusal(with_imu(flight, accelerometer=0.1 * flight.imu.accelerometer), keys=())


@pytest.mark.parametrize("factor", [180.0 / np.pi, 648000.0 / np.pi, 50.0])
def test_a_wrong_unit_of_the_gyro(flight, factor):
    message = refusal(with_imu(flight, gyro=factor * flight.imu.gyro))
    assert "degrees read as radians or rates read as increments" in message and "--assume gyro.unit=UNIT" in message


@pytest.mark.parametrize(
    ("columns", "seen"),
    [([0, 1, 2], "that axis has the other sign"), ([2, 1, 0], "another order"), ([0, 2, 1], "another order")],
)
def test_wrong_axes(flight, columns, seen):
    message = refusal(with_imu(flight, accelerometer=-flight.imu.accelerometer[:, columns]))
    assert seen in message and "--assume axes=AXES" in message


@pytest.mark.parametrize(("taken", "mended"), [("FLU", "FRD"), ("FRD", "FLU"), ("RFU", "LFD")])
def test_a_unit_upside_down_is_told_axes_that_have_it_upright(flight, taken, mended):
    """And no unit of the gyros, which turns nothing round."""
    parked = replace(flight, kind="static", gps=None, notes=tuple(Layout("rad/s", "m/s^2", taken).notes({}, "so")))
    constant = np.ones_like(flight.imu.gyro)
    upside_down = with_imu(parked, gyro=1e-4 * constant, accelerometer=9.8 / RATE_HZ * constant * [0.0, 0.0, 1.0])
    message = refusal(upside_down)
    assert f"so correct the axes, such as by --assume axes={mended}, half a turn about forward; where" in message
    assert "gyro.unit" not in message and "consistency" not in message
    turn = frd_from(mended) @ frd_from(taken).T
    upright = with_imu(parked, gyro=1e-4 * constant, accelerometer=upside_down.imu.accelerometer @ turn.T)
    assert "as it should be" in notes(upright)


def test_a_start_on_its_tail_expects_gravity_there(flight):
    upright = replace(flight, gps=None, start=replace(flight.start, attitude_rad=(0.0, 0.5 * np.pi, 0.0)))
    force = flight.imu.accelerometer
    assert "as it should be" in notes(
        with_imu(upright, accelerometer=np.column_stack([-force[:, 2], force[:, 1], force[:, 0]]))
    )
    assert "expected forward (1.00 of it)" in refusal(upright)


@pytest.mark.parametrize(
    ("from_s", "to_s", "said"), [(40.0, np.inf, "overlap of 33 %"), (-np.inf, 15.1, "overlap of 25 %")]
)
def test_streams_that_hardly_overlap(flight, from_s, to_s, said):
    inside = (flight.gps.time_s >= from_s) & (flight.gps.time_s <= to_s)
    part = replace(flight, gps=flight.gps.rows(inside))
    message = refusal(part)
    assert said in message and "check the clocks" in message
    assert "GPS covers" in notes(part, overlap="short")
    with pytest.raises(UsageError, match="did you mean 'short'"):
        examine(part, {"overlap": "shorter"}, ALL_KEYS)


def test_streams_that_do_not_overlap(flight):
    moved = replace(flight, gps=replace(flight.gps, time_s=flight.gps.time_s + 1000.0))
    assert "an overlap of 0 %" in refusal(moved)


@pytest.mark.parametrize("late_s", [80.0, -90.0, 18.0])
def test_stamps_of_another_clock_come_with_what_mends_them(weaving, late_s):
    flight = late(weaving(RATE_HZ, 2.0 * LASTED_S))
    moved = replace(flight, gps=replace(flight.gps, time_s=flight.gps.time_s + late_s))
    message = refusal(moved)
    assert "expected one clock" in message and f"--assume gps.time_offset_s={late_s + LATENCY_S:.2f}" in message


def test_positions_in_another_unit_than_they_are_read_in(flight):
    away = flight.gps.latitude_rad[0] + 57.3 * (flight.gps.latitude_rad - flight.gps.latitude_rad[0])
    message = refusal(replace(flight, gps=replace(flight.gps, latitude_rad=away)))
    assert "degrees or radians" in message and "--assume position.unit=UNIT" in message
    assert "GPS covers" in notes(replace(flight, gps=replace(flight.gps, latitude_rad=away)), position__unit="rad")


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (np.pi / 180.0, "the gyros are in another unit, 57.2958 of the one read"),
        (2.0, "turns 0.5"),
        (-1.0, "the gyros are x=-x,y=-y,z=-z"),
    ],
)
def test_gyros_against_the_attitude_of_a_reference(flight, weaving, factor, said):
    attitude = weaving(RATE_HZ, LASTED_S).attitude[::10]
    known = replace(flight, gps=None, reference=replace(flight.gps, attitude_rad=attitude))
    assert "Found two clocks: the stamps of the reference" in notes(known).replace("Warning: found", "Found")
    message = refusal(with_imu(known, gyro=factor * flight.imu.gyro))
    assert said in message and "--assume" in message


def test_what_was_found_is_not_said_twice(flight):
    once = examine(flight, {}, ALL_KEYS)
    assert examine(once, {}, ALL_KEYS).notes == once.notes


REAL = {
    "apm-mat": "plane_flight_gps_latency/TestLog2.mat",
    "apm-text": "quad_flight_gps_latency/quad106.zip",
    "psins-mat": "fog_mems_vehicle/transfer_align_fog_mems.mat",
    "psins-text": "rlg_static_vehicle/lasergyro.imu",
}
TRUE = {"apm-mat": ["gps.settling"]}  # its receiver moves by metres a second for 8 s while the aeroplane stands


@pytest.mark.parametrize("name", REAL)
@pytest.mark.parametrize("attitude", [True, False])
def test_nothing_contradicts_itself_in_a_real_recording(real, name, attitude):
    recording = read(name, real(REAL[name]), {})
    if not attitude and recording.reference is not None:
        recording = replace(recording, reference=replace(recording.reference, attitude_rad=None))
    assert [found.key for found in consistency.findings(recording) if found.decided] == TRUE.get(name, [])


@pytest.mark.parametrize(
    ("name", "columns", "said"),
    [
        ("apm-mat", [1, 0, 2], "left-handed"),
        ("apm-text", [1, 0, 2], "left-handed"),
        ("psins-mat", [1, 0, 2], "left-handed"),
    ],
)
def test_two_exchanged_axes_of_a_real_recording_are_named(real, name, columns, said):
    recording = read(name, real(REAL[name]), {})
    imu = recording.imu
    spoilt = with_imu(recording, gyro=imu.gyro[:, columns], accelerometer=imu.accelerometer[:, columns])
    (found,) = [one for one in consistency.findings(spoilt) if one.decided and one.key not in TRUE.get(name, [])]
    assert "x=y,y=x,z=z" in found.seen and said in found.seen and found.log_odds > BEYOND_DOUBT
