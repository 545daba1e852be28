"""Effects in a belief: what is refused, what is written and read back, and who takes them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ins_eval.cli import main
from ins_eval.effects import checked, without_effects
from ins_eval.errors import DataRefused, UsageError
from ins_eval.navigation import compensate, evaluate, samples
from ins_eval.recording import Recording, form
from ins_eval.recording.belief import AccelerometerBelief, AxisBelief, Belief, EffectBelief
from ins_eval.tables import parse, read_toml
from ins_eval.units import ARCSEC, UG

CREEP = EffectBelief(name="accelerometer.bias_creep", axis="x", value=4.8, unit="ug/degC", time_constant_s=2400.0)
# ug; the same number written in two ways leaves rounding only
BIAS_UG, ROUNDING_M = 200.0, 1e-6


@pytest.mark.parametrize(
    ("effect", "said"),
    [
        ({"name": "accelerometer.bias_crep", "axis": "x"}, "did you mean 'accelerometer.bias_creep'?"),
        ({"name": "accelerometer.bias"}, "the axis is not given, expected x or y or z"),
        ({"name": "alignment.level", "axis": "x"}, "the axis is x, expected north or east"),
        ({"name": "alignment.heading", "axis": "z"}, "the axis is z, expected none"),
        ({"name": "gyro.bias", "axis": "z", "unit": "rad/s"}, "the unit is 'rad/s', expected 'deg/h'"),
        ({"name": "accelerometer.bias_creep", "axis": "x"}, "'time_constant_s' is missing"),
        ({"name": "accelerometer.misalignment", "axis": "x"}, "other_axis is not given, expected z or y"),
        ({"name": "gyro.misalignment", "axis": "x", "other_axis": "x"}, "other_axis is x, expected y or z"),
        ({"name": "earth.coriolis", "value": 0.1}, "the fraction is 0.1, expected near 1"),
        ({"name": "temperature.lag", "value": -3.0}, "the lag is -3 s"),
        ({"name": "composed", "axis": "x"}, "'driver' and 'form' are needed"),
        ({"name": "composed", "axis": "x", "driver": "u", "form": "bias * u"}, "is not understood, expected such as"),
        (
            {"name": "composed", "axis": "x", "driver": "u", "form": "gyro bias = value * lags(u, 3)"},
            "did you mean 'lag'?",
        ),
        (
            {"name": "composed", "axis": "x", "driver": "u", "form": "gyro bias = value * lag(u)"},
            "the argument of lag",
        ),
        (
            {"name": "composed", "axis": "x", "driver": "v", "form": "gyro bias = value * change(u)"},
            "the driver is 'v', but the form names 'u'",
        ),
    ],
)
def test_an_effect_that_means_nothing_is_refused_in_one_sentence(effect: dict, said: str) -> None:
    with pytest.raises(UsageError) as refusal:
        checked((CREEP, EffectBelief(**{"value": 1.0, **effect})))
    assert said in str(refusal.value)
    assert str(refusal.value).startswith("effects[1]")
    assert "\n" not in str(refusal.value)


def test_a_recording_without_the_driver_is_refused(flight: Recording) -> None:
    effect = EffectBelief(
        name="composed", axis="x", value=1.0, driver="fan_hz", form="accelerometer bias = value * change(fan_hz)"
    )
    with pytest.raises(DataRefused, match="no column 'fan_hz'"):
        without_effects(believing(flight, effect), increments(flight))


def test_what_is_written_is_what_is_read(tmp_path: Path) -> None:
    axis = AxisBelief(compensation="models/x.toml")
    belief = Belief(
        accelerometer=AccelerometerBelief(x=axis), effects=(CREEP, EffectBelief(name="earth.rotation", value=0.99))
    )
    path = form.write_belief(tmp_path / "elsewhere" / "belief.toml", belief, tmp_path)
    found = parse(Belief, read_toml(path), str(path))
    assert found.effects == belief.effects
    assert found.accelerometer.x.compensation == str(tmp_path.resolve() / "models" / "x.toml")
    assert found.gps == belief.gps


def test_a_recording_keeps_its_effects(tmp_path: Path, flight: Recording) -> None:
    short = slice(0, 400)
    imu = flight.imu
    cut = replace(
        imu,
        time_s=imu.time_s[short],
        gyro=imu.gyro[short],
        accelerometer=np.round(imu.accelerometer[short]),
        temperature_c=imu.temperature_c[short],
        height_baro_m=imu.height_baro_m[short],
        further={},
    )
    form.write(believing(replace(flight, imu=cut, gps=None), CREEP), tmp_path / "flight")
    assert form.read(tmp_path / "flight").belief.effects == (CREEP,)
    assert main(["evaluate", str(tmp_path / "flight"), "--quiet", "--output", str(tmp_path / "report")]) != 5


def test_an_effect_of_another_recording_is_left_alone(flight: Recording) -> None:
    velocity = increments(flight)
    of_another = CREEP.model_copy(update={"recording": "another flight"})
    seen, changed = without_effects(believing(flight, of_another), velocity)
    assert np.array_equal(changed, velocity)
    assert seen.belief.effects == ()
    _, changed = without_effects(believing(flight, CREEP.model_copy(update={"recording": flight.name})), velocity)
    assert not np.array_equal(changed, velocity)


def test_evaluate_takes_them(flight: Recording) -> None:
    """A bias and a turn of the start, believed as effects, against the same taken off by hand."""
    velocity = increments(flight)
    turn = 100.0 * ARCSEC
    effects = (
        EffectBelief(name="accelerometer.bias", axis="y", value=BIAS_UG),
        EffectBelief(name="alignment.heading", value=turn / ARCSEC),
    )
    roll, pitch, heading = flight.start.attitude_rad
    start = replace(flight.start, attitude_rad=(roll, pitch, heading + turn))
    interval_s = np.diff(flight.imu.time_s, prepend=flight.start.time_s)
    by_hand = velocity.copy()
    by_hand[:, 1] -= BIAS_UG * UG * interval_s
    expected = evaluate(replace(flight, start=start), by_hand).errors
    with pytest.raises(ValueError, match="take the believed accelerometer.bias off first"):
        evaluate(believing(flight, *effects), velocity)
    found = evaluate(*without_effects(believing(flight, *effects), velocity)).errors
    assert np.abs(expected.north_m).max() > 100.0
    np.testing.assert_allclose(found.north_m, expected.north_m, atol=ROUNDING_M)
    np.testing.assert_allclose(found.east_m, expected.east_m, atol=ROUNDING_M)


def believing(recording: Recording, *effects: EffectBelief) -> Recording:
    return replace(recording, belief=recording.belief.model_copy(update={"effects": effects}))


def increments(flight: Recording) -> np.ndarray:
    from ins_eval.compensation.file import believed_model

    triad = [believed_model(flight.belief, axis, ".") for axis in "xyz"]
    return compensate(samples(flight), triad, flight.interval_s)
