"""What may have been left out: one library of physical effects, for a diagnosis to find and for a belief to state.

    effect         what an effect is
    accelerometer, gyro, lag, receiver, start, earth, description, composed    the effects, one row each
    vocabulary     all of them by name, and what a belief may say of them
    slow           what the error of a sensor follows: temperature, its rate, memory, time
    temperature    the temperature that the elements had
    parts          an effect of the sensors as multiplier x slow factor
    apply          believed effects taken off a recording

A value is true minus believed, in what the sensor indicates. To add an effect: one row in the file of what it enters,
and, where its slow factor is new, one function in `slow`: CONTRIBUTING.md.

The names, units and parameters: docs/effects.md.
"""

from __future__ import annotations

from ins_eval.effects.apply import chamber_error, effects_left, turned_start, without_effects
from ins_eval.effects.effect import Effect, Parameter
from ins_eval.effects.vocabulary import VOCABULARY, checked

__all__ = [
    "VOCABULARY",
    "Effect",
    "Parameter",
    "chamber_error",
    "checked",
    "effects_left",
    "turned_start",
    "without_effects",
]
