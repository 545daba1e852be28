"""What a parameter file must say, and the one sentence for each fault."""

import math

import pytest

from ins_eval.digital_loop import PARTS, load
from ins_eval.digital_loop.parameters import PRESETS
from ins_eval.errors import UsageError


def variant(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_text(f'extends = "digital-qfa"\n{text}\n')
    return path


@pytest.mark.parametrize("preset", sorted(path.stem for path in PRESETS.glob("*.toml")))
def test_presets_are_complete_and_every_value_has_a_source(preset):
    for _, table in load(preset).parameters:
        for _, quantity in table:
            assert quantity.source
            assert math.isfinite(quantity.value)


def test_a_file_states_what_differs(tmp_path):
    path = variant(tmp_path, '[pendulum]\nmass = { value = 1.4e-3, unit = "kg", source = "mine" }')
    assert load(path).pendulosity == pytest.approx(2.0 * load().pendulosity)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[pendulum]\nmass = { value = 0.7, unit = "g", source = "s" }', "the unit is 'g', expected 'kg'"),
        ('[pendulum]\nmass = { value = -1.0, unit = "kg", source = "s" }', "expected a value above 0"),
        ('[pendulum]\nmass = { value = 1.0, unit = "kg" }', "source' is missing"),
        ("[pendulum]\nmass = 0.7e-3", "pendulum.mass"),
        ('[pendulum]\nmas = { value = 1.0, unit = "kg", source = "s" }', "did you mean 'mass'"),
        ('[pendulum]\ndamping = { value = 1e-6, unit = "N m s/rad", source = "s" }', "two real poles"),
        ('[adc]\nbits = { value = 15.5, unit = "bit", source = "s" }', "whole number"),
        ('[scan]\nstep = { value = 500, unit = "count", source = "s" }', "DA1"),
        ('[scan]\nstep = { value = 130, unit = "count", source = "s" }', "of the ADC"),
        ('[feedback]\nreference_code = { value = 1048576, unit = "count", source = "s" }', "does not fit"),
        ('[bridge]\ncapacitor_1 = { value = 1e-9, unit = "F", source = "s" }', "the bridge cannot balance"),
        ('[current_source]\ncurrent = { value = 0.1, unit = "A", source = "s" }', "of DA2"),
        ('[ageing_sigma]\nmagnett = { value = 1, unit = "ppm/year", source = "s" }', "did you mean 'magnet'"),
        ("[magnets]\n", "unknown key 'magnets'"),
    ],
)
def test_a_fault_is_one_sentence(tmp_path, text, said):
    path = variant(tmp_path, text)
    with pytest.raises(UsageError, match=r"mine\.toml") as refused:
        load(path)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_an_unknown_preset_is_named_with_the_nearest():
    with pytest.raises(UsageError, match="did you mean 'paper-unit'"):
        load("paper-units")


def test_every_part_drifts_its_own_quantity():
    loop = load()
    for part in PARTS:
        drifted = loop.with_drift(part, 100.0).with_drift(part, 100.0)
        assert drifted[part] / loop[part] == pytest.approx(1.0001**2, rel=1e-12)
        assert all(drifted[other] == loop[other] for other in PARTS if other != part)


def test_an_unknown_part_is_named_with_the_nearest():
    with pytest.raises(UsageError, match="did you mean 'magnet'"):
        load().with_drift("magnets", 1.0)


def test_gains_of_the_chain_are_those_of_the_equations():
    """k1 = 2 C0 l / d; k_CV = V_IN k_amp / (4 C0) at null; together they are the gain per rad."""
    loop = load()
    assert loop.capacitance_gain == pytest.approx(2.4e-8, rel=1e-9)
    bridge = 800 / 8192 * 2.5 * 10.0 / (4.0 * 30e-12)
    assert loop.forward_gain_per_rad == pytest.approx(
        loop.capacitance_gain * bridge * 32768 / 5.0 * 47.897757, rel=1e-9
    )
    assert loop.forward_gain == pytest.approx(loop.forward_gain_per_rad / 1e-3)
    assert loop.torque_per_ampere == pytest.approx(0.7e-3 * 8e-3 * 9.80665 / 1.2e-3, rel=1e-7)  # 1 g takes 1.2 mA
