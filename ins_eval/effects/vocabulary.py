"""All effects by name, and what a belief may say of them."""

from __future__ import annotations

from collections.abc import Sequence

from ins_eval.effects import accelerometer, composed, description, earth, gyro, lag, receiver, start
from ins_eval.effects.effect import Effect
from ins_eval.errors import UsageError, did_you_mean
from ins_eval.recording import mending
from ins_eval.recording.belief import EffectBelief

VOCABULARY: dict[str, Effect] = {
    effect.name: effect
    for module in (accelerometer, lag, gyro, start, receiver, earth, description, composed)
    for effect in module.EFFECTS
}
ONE_OF_EARTH = (0.5, 1.5)  # a fraction that stands for the whole term


def checked(effects: Sequence[EffectBelief]) -> None:
    """Refuse, in one sentence, a believed effect that means nothing.

    Raises: UsageError for a name, axis, unit, other axis or further parameter that the vocabulary does not have.
    """
    for k, believed in enumerate(effects):
        _check(believed, f"effects[{k}]")


def _check(believed: EffectBelief, where: str) -> None:
    if believed.name not in VOCABULARY:
        raise UsageError(f"{where}: no effect is called '{believed.name}'{did_you_mean(believed.name, VOCABULARY)}")
    effect = VOCABULARY[believed.name]
    where = f"{where} ({effect.name})"
    if believed.axis not in effect.axes:
        expected = " or ".join(axis or "none" for axis in effect.axes)
        raise UsageError(f"{where}: the axis is {believed.axis or 'not given'}, expected {expected}; correct it")
    if effect.name != composed.NAME and believed.unit not in (None, effect.unit):
        raise UsageError(
            f"{where}: the unit is '{believed.unit}', expected '{effect.unit}'; bring the value into that unit"
        )
    others = effect.others(believed.axis)
    if (believed.other_axis or believed.axis) not in others and others != (None,):
        raise UsageError(
            f"{where}: other_axis is {believed.other_axis or 'not given'}, expected {' or '.join(others)}; correct it"
        )
    for parameter in effect.parameters:
        if parameter.assumed or parameter.even:
            continue
        if parameter.name in EffectBelief.model_fields and getattr(believed, parameter.name) is None:
            raise UsageError(f"{where}: '{parameter.name}' is missing; add it")
    if effect.enters == description.FAMILY:
        mending.check(believed, where)
    if effect.enters == "earth" and not ONE_OF_EARTH[0] < believed.value < ONE_OF_EARTH[1]:
        raise UsageError(f"{where}: the fraction is {believed.value:g}, expected near 1; physics allows no other")
    if effect.enters == "temperature" and believed.value < 0.0:
        raise UsageError(f"{where}: the lag is {believed.value:g} s, expected one of 0 or more; elements are not early")
    if effect.name == composed.NAME:
        if believed.driver is None or believed.form is None:
            raise UsageError(f"{where}: 'driver' and 'form' are needed; add them")
        named = composed.parse_form(believed.form, where).driver
        if named != believed.driver:
            raise UsageError(f"{where}: the driver is '{believed.driver}', but the form names '{named}'; name one")
