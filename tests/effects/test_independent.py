"""Effects of another maker, with signs, origins and physics of its own: believing in them takes them off."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmark.worlds.cases import a_unit
from benchmark.worlds.effects import VOCABULARY as OTHERS
from benchmark.worlds.effects import Effect
from benchmark.worlds.instruments import Departures
from benchmark.worlds.record import feel, measure
from ins_eval.effects import VOCABULARY
from ins_eval.error_model.null import believe
from ins_eval.estimation.arcs import observed
from ins_eval.recording import form
from ins_eval.recording.belief import EffectBelief

RATE_HZ = 10.0
SIZES = 20.0  # of the maker's nominal size, so that rounding to whole pulses does not matter
LEFT_OVER = 0.02  # of the residual
FLIGHT = "climb, cruise, landing"
CASES = [
    pytest.param("accelerometer.bias", "x", {}, marks=pytest.mark.slow),
    pytest.param("accelerometer.bias_temperature", "y", {}, marks=pytest.mark.slow),
    pytest.param("accelerometer.bias_temperature_rate", "x", {}, marks=pytest.mark.slow),
    ("accelerometer.bias_creep", "z", {"time_constant_s": 2400.0, "law": "one"}),
    ("accelerometer.bias_step", "y", {"at_s": 4000.0}),
    ("accelerometer.bias_drift", "x", {}),
    ("accelerometer.scale", "z", {}),
    pytest.param("accelerometer.scale_temperature_rate_quadratic", "z", {}, marks=pytest.mark.slow),
    ("accelerometer.scale_temperature_rate_coupling", "z", {}),
    ("accelerometer.scale_hysteresis", "z", {"branch_width_c": 2.0, "begin": -1.0}),
    pytest.param("accelerometer.quadratic", "z", {}, marks=pytest.mark.slow),
    pytest.param("accelerometer.cubic", "z", {}, marks=pytest.mark.slow),
    ("accelerometer.scale_step", "z", {"at_s": 4000.0}),
    pytest.param("accelerometer.asymmetry", "y", {}, marks=pytest.mark.slow),
    ("accelerometer.cross_pendulous", "y", {}),
    ("accelerometer.misalignment", "x", {"other_axis": "z"}),
    ("accelerometer.vibration_rectification", "z", {}),
    ("temperature.lag", None, {}),
    pytest.param("gyro.bias_temperature", "x", {}, marks=pytest.mark.slow),
    pytest.param("gyro.bias_drift", "z", {}, marks=pytest.mark.slow),
    ("gyro.scale", "z", {}),
    pytest.param("gyro.scale_step", "z", {"at_s": 4000.0}, marks=pytest.mark.slow),
    ("gyro.asymmetry", "z", {}),
    ("gyro.misalignment", "x", {"other_axis": "z"}),
    ("gyro.g_sensitivity", "x", {"other_axis": "z"}),
    ("gyro.g_sensitivity", "y", {"other_axis": "y"}),
    ("alignment.level", "north", {}),
    ("alignment.level", "east", {}),
    ("alignment.heading", None, {}),
    ("gps.lever_arm", "x", {}),
    ("gps.time_offset", None, {}),
    ("reference.time_offset", None, {}),
    ("reference.misalignment", "z", {}),
    ("earth.coriolis", None, {}),
    pytest.param("earth.gravity_height", None, {}, marks=pytest.mark.slow),
]


@cache
def felt():
    return feel(np.random.default_rng(5), FLIGHT, RATE_HZ, False)


@cache
def unit():
    return a_unit(np.random.default_rng(5), "zero", pulses=True)


def rms(recording) -> float:
    """Of the residual over all that was measured, in believed sigmas, of one solution from the start to the end."""
    _, seen = observed(believe(recording))
    return float(np.sqrt(np.nanmean((seen.residual / seen.sigma) ** 2)))


def test_the_names_and_units_are_those_of_the_other_maker() -> None:
    ours = {name: effect.unit for name, effect in VOCABULARY.items() if name != "composed"}
    assert ours == {name: row.unit for name, row in OTHERS.items()}
    assert {name: effect.axes for name, effect in VOCABULARY.items() if name in OTHERS} == {
        name: row.axes for name, row in OTHERS.items()
    }


@pytest.mark.parametrize(("name", "axis", "further"), CASES)
def test_believing_in_an_effect_takes_it_off(tmp_path, name: str, axis: str | None, further: dict) -> None:
    # larger errors of the start are found from fixes
    sizes = {"temperature.lag": 3.0, "alignment.heading": 1.0, "alignment.level": 2.0}.get(name, SIZES)
    value = 1.0 if name.startswith("earth.") else sizes * OTHERS[name].nominal
    departures = Departures()
    Effect(name, axis, value, dict(further))(felt(), departures)
    with_reference = name.startswith("reference.")
    rng = np.random.default_rng(6)
    made = measure(rng, felt(), unit(), departures, FLIGHT, "flight", with_reference, ("vibration_rms_g",))
    folder = tmp_path / "flight"
    made.save(folder)
    recording = form.read(folder, doubted=True)
    known = {key: value for key, value in further.items() if key not in ("law", "begin")}
    effect = EffectBelief(name=name, axis=axis, value=value, unit=OTHERS[name].unit, **known)
    believing = replace(recording, belief=recording.belief.model_copy(update={"effects": (effect,)}))
    before, after = rms(recording), rms(believing)
    assert after < LEFT_OVER * before
