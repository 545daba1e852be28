"""What a simpler error would show alike pays for it: jumps before anything moves, magnitudes of what keeps its sign.

The flight stands, takes off, turns both ways and lands; its fixes tell when it moves.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.effects import composed
from ins_eval.effects.parts import conditions, parts
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.error_model.library import HARDLY, Candidate, sized
from ins_eval.estimation.case import prepare
from ins_eval.recording import Imu, Recording, Start
from ins_eval.recording.belief import AccelerometerBelief, Belief, GyroBelief

NEAR = 0.65  # of a usual size: those of a column are 0.4 to 1 of a constant's

MOVES_MPS = 1.0
LATER_S = 600.0  # by then as much of the flight is behind that a jump is another thing


@pytest.fixture(scope="module")
def candidates(flight) -> tuple[Candidate, ...]:
    return prepare(flight).candidates


def of(candidates, name: str, axis: str | None = None) -> list[Candidate]:
    return [one for one in candidates if one.name == name and one.axis == axis]


def test_a_clock_that_jumps_before_anything_moves_is_late_from_the_start_on(flight, candidates) -> None:
    speed = np.linalg.norm(flight.gps.velocity_n, axis=1)
    off_s = flight.gps.time_s[np.argmax(speed > MOVES_MPS)]
    jumps = {one.parameters["at_s"]: one.repeats for one in of(candidates, "recording.clock_step")}
    assert all(repeats for at_s, repeats in jumps.items() if at_s <= off_s)
    assert not any(repeats for at_s, repeats in jumps.items() if at_s > off_s + LATER_S)
    squares = np.cumsum(speed**2) / np.sum(speed**2)
    share = {at_s: squares[flight.gps.time_s <= at_s][-1] for at_s in jumps}
    assert {repeats for at_s, repeats in jumps.items() if share[at_s] < 0.5 * HARDLY} == {True}
    assert {repeats for at_s, repeats in jumps.items() if share[at_s] > 2.0 * HARDLY} == {False}


def test_the_magnitude_of_what_keeps_its_sign_is_a_scale_factor(candidates) -> None:
    """Gravity is never reversed along z; turns to the left and to the right are."""
    (upright,), (turning,) = of(candidates, "accelerometer.asymmetry", "z"), of(candidates, "gyro.asymmetry", "z")
    assert upright.repeats
    assert not turning.repeats


def test_what_changes_in_flight_repeats_nothing(candidates) -> None:
    for name in ("accelerometer.scale", "accelerometer.bias", "gyro.scale", "gyro.bias_drift"):
        assert not any(one.repeats for one in of(candidates, name, "z"))
    assert not any(one.repeats for one in of(candidates, "accelerometer.bias_step", "z"))


def test_of_the_temperature_a_scale_factor_of_a_gyro_alone_is_composed(flight) -> None:
    warming = replace(flight.imu, temperature_c=np.linspace(15.0, 55.0, flight.imu.time_s.size))
    found = [one for one in prepare(replace(flight, imu=warming)).candidates if one.name == composed.NAME]
    assert [one.axis for one in found] == ["x", "y", "z"]
    for one in found:
        assert one.parameters == {"driver": "temperature_c", "form": "gyro scale = value * change(temperature_c)"}


@pytest.mark.parametrize("target", ["gyro bias", "gyro scale", "accelerometer bias", "accelerometer scale"])
def test_what_follows_a_column_has_the_usual_size_of_its_grade(target: str) -> None:
    """Over the spread of the column about as large as a constant error of its target."""
    belief = Belief(gyro=GyroBelief(bias_sigma_deg_per_h=100.0), accelerometer=AccelerometerBelief(bias_sigma_ug=3e3))
    time_s, supply_v = np.arange(1.0, 8.0), np.linspace(4.9, 5.2, 7)
    imu = Imu(time_s, np.zeros((7, 3)), np.zeros((7, 3)), "increment", further={"supply_v": supply_v})
    given = conditions(Recording("r", "drive", Start(0.0, 0.6, 0.1, 0.0), imu, belief=belief))
    which = {"driver": "supply_v", "form": composed.form(target, "change", "supply_v")}
    of_parts = parts(VOCABULARY[composed.NAME], "z", which, given)
    _, nominal, _ = sized(VOCABULARY[composed.NAME], which, of_parts, time_s, given)
    _, alone, _ = sized(VOCABULARY[target.replace(" ", ".")], {}, [], time_s, given)
    assert nominal * np.std(supply_v) == pytest.approx(alone, rel=NEAR)
