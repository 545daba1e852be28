"""Figures of the grade of an instrument: its Allan deviation and its laws of temperature."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ins_eval import figures
from ins_eval.allan import TERMS
from ins_eval.grade import Grade, units_of
from ins_eval.temperature_law import TemperatureLaw
from ins_eval.units import DEG_PER_H, UG
from ins_eval.wording import significant

FIGURE, LAWS = "allan_deviation", "temperature_laws"
LETTERS = {"quantisation": "Q", "white": "N", "flicker": "B", "random_walk": "K"}


def grade_figures(grade: Grade) -> dict[str, Figure]:
    """The Allan deviation of every channel, and its law of temperature; nothing where no rest is long enough."""
    channels = [_channel(one) for one in grade.channels if one.allan.tau_s.size]
    if not channels:
        return {}
    drawn = {FIGURE: figures.allan_deviation(channels=channels, rest_s=grade.rest_s)}
    if grade.laws:
        drawn[LAWS] = figures.temperature_laws(channels=[_law(one) for one in grade.laws])
    return drawn


def _law(one: TemperatureLaw) -> dict[str, Any]:
    unit, si = ("°/h", DEG_PER_H) if one.name.startswith("gyro") else ("µg", UG)
    ends_c = np.array([one.temperature_c.min(), one.temperature_c.max()])
    low, high = (bound / si for bound in one.interval95)
    return {
        "name": one.name,
        "unit": unit,
        "temperature_c": one.temperature_c,
        "change": (one.mean - one.offset) / si,
        "line_c": ends_c,
        "line": one.slope * (ends_c - one.reference_c) / si,
        "words": f"{significant(one.slope / si, 4)} [{significant(low, 4)}, {significant(high, 4)}] {unit}/°C",
    }


def _channel(one) -> dict[str, Any]:
    of = units_of(one.name)
    unit, si = ("°/h", of["flicker"][1]) if one.name.startswith("gyro") else ("µg", of["flicker"][1])
    tau_s, words, terms = one.allan.tau_s, [], {}
    for term in TERMS if one.fit else ():
        found, (name, size) = getattr(one.fit, term), of[term]
        if found.visible and term != "quantisation":
            value, low, high = (significant(x / size) for x in (found.value, found.low, found.high))
            words.append(f"{LETTERS[term]} = {value} [{low}, {high}] {name}")
        if found.visible:
            terms[term] = one.fit.deviation(tau_s, term) / si
    return {
        "name": one.name,
        "unit": unit,
        "tau_s": tau_s,
        "deviation": np.asarray(one.allan.deviation) / si,
        "fit": None if one.fit is None else one.fit.deviation(tau_s) / si,
        "terms": terms,
        "words": "\n".join(words),
    }
