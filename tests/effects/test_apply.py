"""A believed effect changes the residual of a recording by what its column of the library says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.effects import VOCABULARY, without_effects
from ins_eval.error_model import library
from ins_eval.estimation.case import Case, prepare
from ins_eval.recording import Recording
from ins_eval.recording.belief import EarthBelief, EffectBelief

LEFT_OVER = 0.01  # part of the change that the column leaves, in whitened units
SIZES = 0.3  # of the nominal size that are believed

FURTHER = {
    "accelerometer.bias_creep": {"time_constant_s": 2400.0},
    "accelerometer.bias_step": {"at_s": 4000.3},
    "gyro.bias_step": {"at_s": 4000.3},
    "accelerometer.scale_step": {"at_s": 4000.3},
    "gyro.scale_step": {"at_s": 4000.3},
    "recording.reference_frame": {"frame_found": "magnetic north"},
    "accelerometer.scale_hysteresis": {"branch_width_c": 2.0},
    "composed": {"driver": "supply_v", "form": "accelerometer bias = value * lag(supply_v, 600)"},
}
# alternatives have no size, and a clock that is set right moves the nodes: tests/error_model/test_propagation.py
ELSEWHERE = {name for name in VOCABULARY if name.startswith("recording.")} - {"recording.reference_frame"}
OTHER_AXES = {
    ("accelerometer.misalignment", "x"): "zy",
    ("gyro.misalignment", "y"): "zx",
    ("gyro.g_sensitivity", "z"): "zxy",
}


def cases() -> list[tuple[str, str | None, dict]]:
    out = []
    for effect in VOCABULARY.values():
        if effect.name in ELSEWHERE:
            continue
        for axis in effect.axes if effect.enters != "earth" else ():
            if len(effect.multipliers) > 1:
                out += [(effect.name, axis, {"other_axis": one}) for one in OTHER_AXES.get((effect.name, axis), ())]
            elif axis in (None, "north", "east", "z"):
                out.append((effect.name, axis, FURTHER.get(effect.name, {})))
    return out


@pytest.fixture(scope="module")
def prepared(flight, beside_a_reference) -> dict[bool, Case]:
    return {False: prepare(flight), True: prepare(beside_a_reference)}


def believing(recording: Recording, *effects: EffectBelief) -> Recording:
    return replace(recording, belief=recording.belief.model_copy(update={"effects": effects}))


def change(before: Case, after: Case, candidate: library.Candidate) -> tuple[np.ndarray, np.ndarray]:
    """Whitened change of the residual (k,) from `before` to `after`, and the whitened column (k,) of a candidate."""
    missing = np.isnan(before.seen.residual) | np.isnan(after.seen.residual)
    at, keep = np.zeros(len(before.noise.free)), len(before.nuisances) + 2
    kept = []
    for one in (before, after):
        seen = replace(one.seen, residual=np.where(missing, np.nan, one.seen.residual))
        alike = replace(one, seen=seen, noise=before.noise, slow=before.slow)
        kept.append(alike.whitened([candidate.column], at, keep=keep).kept[~missing])
    return kept[0][:, 0] - kept[1][:, 0], kept[0][:, keep - 1]


@pytest.mark.parametrize(("name", "axis", "further"), cases())
def test_what_is_taken_off_is_the_column_times_the_value(prepared, name: str, axis: str | None, further: dict) -> None:
    before = prepared[name.startswith(("reference.", "recording.reference"))]
    believed = before.believed
    value = SIZES * VOCABULARY[name].nominal
    parameters = {"lag_s": value} if name == "temperature.lag" else further
    candidate = library.member(believed, before.model, before.temperature, before.slow, name, axis, parameters)
    effect = EffectBelief(name=name, axis=axis, value=value, **further)
    changed, column = change(before, prepare(believing(believed.recording, effect)), candidate)
    expected = value / candidate.nominal * column
    left = float(np.linalg.norm(changed - expected) / np.linalg.norm(expected))
    assert left < LEFT_OVER


@pytest.mark.parametrize("term", EarthBelief.model_fields)
def test_an_effect_of_the_earth_puts_back_what_the_belief_leaves_out(flight, term: str) -> None:
    lacking = flight.belief.model_copy(update={"earth": EarthBelief(**{term: False})})
    effect = EffectBelief(name=f"earth.{term}", value=0.97)
    seen, _ = without_effects(replace(flight, belief=lacking.model_copy(update={"effects": (effect,)})), np.zeros(0))
    assert seen.belief == flight.belief
