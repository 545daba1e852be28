"""Wrong descriptions are taken off: files that another maker spoilt come back as they were."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from benchmark.worlds.description import misdescribe
from ins_eval.errors import UsageError
from ins_eval.recording import Fixes, Imu, Recording, Start
from ins_eval.recording.belief import Belief, EffectBelief
from ins_eval.recording.mending import mended
from ins_eval.units import DEG

ROUNDING = 1e-12
SPOILT = [
    ("recording.axis_sign", "y", -1.0, {"sensor": "gyro"}),
    ("recording.axis_sign", "z", -1.0, {"sensor": "accelerometer"}),
    ("recording.axes_exchanged", "x", 1.0, {"sensor": "accelerometer", "other_axis": "z"}),
    ("recording.axes_exchanged", "x", -1.0, {"sensor": "gyro", "other_axis": "y"}),
    ("recording.unit", None, 57.29577951308232, {"sensor": "gyro", "unit_found": "deg"}),
    ("recording.gps_velocity", None, 3.6, {}),
    ("recording.gps_velocity", "down", -1.0, {}),
    ("recording.clock_step", None, 0.15, {"at_s": 30.0}),
    ("recording.clock_step", None, -0.15, {"at_s": 30.0}),
    ("recording.clock_drift", None, 80.0, {}),
]


def sound() -> Recording:
    rng = np.random.default_rng(1)
    imu = Imu(0.1 + 0.1 * np.arange(600), rng.standard_normal((600, 3)), rng.standard_normal((600, 3)), "increment")
    return Recording("drive", "drive", Start(0.0, 0.6, 0.1, 200.0), imu, gps=fixes(rng))


def fixes(rng, attitude: bool = False) -> Fixes:
    time_s = 1.0 + 0.5 * np.arange(110)
    at = 1e-4 * rng.standard_normal((2, time_s.size))
    return Fixes(
        time_s, 0.6 + at[0], 0.1 + at[1], 200.0 + 0.0 * time_s, rng.standard_normal((time_s.size, 3)),
        np.ones(time_s.size, dtype=bool), rng.uniform(0.0, 3.0, (time_s.size, 3)) if attitude else None,
    )  # fmt: skip


def tables(recording: Recording) -> dict:
    imu = {"time_s": recording.imu.time_s}
    imu |= {f"gyro_{axis}": recording.imu.gyro[:, k] for k, axis in enumerate("xyz")}
    imu |= {f"accel_{axis}": recording.imu.accelerometer[:, k] for k, axis in enumerate("xyz")}
    out = {"imu": imu}
    for name in ("gps", "reference"):
        one = getattr(recording, name)
        if one is not None:
            velocity = zip(("velocity_n_mps", "velocity_e_mps", "velocity_d_mps"), one.velocity_n.T, strict=True)
            out[name] = {"time_s": one.time_s, **dict(velocity)}
            out[name] |= {} if one.attitude_rad is None else {"heading_deg": one.attitude_rad[:, 2] / DEG}
    return out


def spoilt(recording: Recording, name: str, axis: str | None, value: float, parameters: dict) -> Recording:
    """The same recording as a wrong description makes it, and which believes in it."""
    made = tables(recording)
    misdescribe(made, name, axis, value, parameters)
    imu = made["imu"]
    wrong = replace(
        recording.imu,
        time_s=imu["time_s"],
        gyro=np.column_stack([imu[f"gyro_{one}"] for one in "xyz"]),
        accelerometer=np.column_stack([imu[f"accel_{one}"] for one in "xyz"]),
    )
    changed = {}
    for table in ("gps", "reference"):
        one = getattr(recording, table)
        if one is None:
            continue
        columns = made[table]
        velocity = np.column_stack([columns[f"velocity_{d}_mps"] for d in "ned"])
        one = replace(one, time_s=columns["time_s"], velocity_n=velocity)
        if one.attitude_rad is not None:
            one = replace(one, attitude_rad=np.column_stack([one.attitude_rad[:, :2], DEG * columns["heading_deg"]]))
        changed[table] = one
    belief = Belief(effects=(EffectBelief(name=name, axis=axis, value=value, **parameters),))
    return replace(recording, imu=wrong, belief=belief, **changed)


def alike(found: Recording, expected: Recording) -> None:
    for part in ("imu", "gps", "reference"):
        one, other = getattr(found, part), getattr(expected, part)
        for field in fields(one) if one is not None else ():
            a, b = getattr(one, field.name), getattr(other, field.name)
            if isinstance(a, np.ndarray):
                np.testing.assert_allclose(a, b, rtol=ROUNDING, atol=ROUNDING)


@pytest.mark.parametrize(("name", "axis", "value", "parameters"), SPOILT)
def test_what_was_spoilt_is_mended(name: str, axis: str | None, value: float, parameters: dict) -> None:
    recording = sound()
    wrong = spoilt(recording, name, axis, value, parameters)
    with pytest.raises(AssertionError):
        alike(wrong, recording)
    found = mended(wrong)
    alike(found, recording)
    assert found.belief.effects == ()


@pytest.mark.parametrize("parameters", [{"frame_found": "ENU"}, {"frame_found": "magnetic north"}])
def test_a_reference_in_another_frame_is_turned_back(parameters: dict) -> None:
    recording = replace(sound(), gps=None, reference=fixes(np.random.default_rng(2), attitude=True))
    value = 0.0 if parameters["frame_found"] == "ENU" else 7.0
    alike(mended(spoilt(recording, "recording.reference_frame", None, value, parameters)), recording)


def test_exchanged_columns_come_first_and_what_belongs_to_another_recording_stays_out() -> None:
    recording = sound()
    turn = EffectBelief(name="recording.axis_sign", axis="x", value=-1.0, sensor="gyro")
    exchange = EffectBelief(name="recording.axes_exchanged", axis="x", other_axis="y", value=1.0, sensor="gyro")
    expected = recording.imu.gyro[:, [1, 0, 2]] * [-1.0, 1.0, 1.0]
    for effects in ((turn, exchange), (exchange, turn)):
        found = mended(replace(recording, belief=Belief(effects=effects)))
        np.testing.assert_array_equal(found.imu.gyro, expected)
    other = turn.model_copy(update={"recording": "another"})
    left = mended(replace(recording, belief=Belief(effects=(other,))))
    np.testing.assert_array_equal(left.imu.gyro, recording.imu.gyro)


@pytest.mark.parametrize(
    ("effect", "said"),
    [
        ({"name": "recording.axis_sign", "axis": "x", "value": -1.0}, "sensor is not given, expected gyro or"),
        ({"name": "recording.axis_sign", "axis": "x", "value": 2.0, "sensor": "gyro"}, "the value is 2, expected -1"),
        ({"name": "recording.axes_exchanged", "axis": "x", "value": 1.0, "sensor": "gyro"}, "other_axis is not given"),
        ({"name": "recording.unit", "value": -3.0, "sensor": "gyro"}, "the factor is -3, expected one above 0"),
        ({"name": "recording.gps_velocity", "axis": "down", "value": 2.0}, "the value is 2, expected -1"),
        ({"name": "recording.clock_step", "value": 0.1}, "'at_s' is missing"),
        ({"name": "recording.clock_drift", "value": -2e6}, "time does not run back"),
        ({"name": "recording.reference_frame", "value": 3.0}, "frame_found is not given, expected 'ENU' or"),
    ],
)
def test_a_wrong_description_that_means_nothing_is_refused(effect: dict, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        mended(replace(sound(), belief=Belief(effects=(EffectBelief(**effect),))))
