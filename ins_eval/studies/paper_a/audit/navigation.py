"""Oven and flight: rates of temperature, percentages, durations and CEP, computed again."""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot

from ins_eval.metrics import CONFIDENCE
from ins_eval.scale_factor import TERMS
from ins_eval.studies.paper_a.printed import INS, PRINTED, UNITS, coefficients
from ins_eval.units import HOUR, NMI

AXES = ("east", "north")


def cruise_start_c() -> float:
    """Temperature at which the cruise must begin to end at the coldest printed one at the usual rate of flight."""
    flight = PRINTED["flight"]
    return flight["coldest_c"] + PRINTED["chamber"]["usual_flight_rate_c_per_min"] * 60.0 * flight["cruise_h"]


def cruise_rate_c_per_min(start_c: float) -> float:
    """Mean rate of cooling over the cruise from `start_c` to the coldest printed temperature."""
    flight = PRINTED["flight"]
    return (start_c - flight["coldest_c"]) / (60.0 * flight["cruise_h"])


def places() -> int:
    """Different places where the INS is said to be."""
    return len(set(PRINTED["flight"]["ins_installed"]))


def duration_h() -> float:
    """Sum of the three phases."""
    flight = PRINTED["flight"]
    return (flight["climb_min"] + flight["landing_min"]) / 60.0 + flight["cruise_h"]


def landing_at_s() -> float:
    """End of the cruise, from the start of the climb."""
    flight = PRINTED["flight"]
    return 60.0 * flight["climb_min"] + HOUR * flight["cruise_h"]


def reduction_percent(of: Mapping, axis: str | None = None) -> float:
    """What the compensation takes off, in % of the simple one: a velocity of Table 6 or 7, or the CEP.

    The axis is east, north or horizontal, or None for the CEP.
    """
    if axis == "horizontal":
        before, after = (hypot(*of[arm].values()) for arm in ("simple", "hysteresis"))
    else:
        before, after = (of[arm] if axis is None else of[arm][axis] for arm in ("simple", "hysteresis"))
    return 100.0 * (before - after) / before


def flights_for_an_interval() -> int:
    """Fewest flights whose smallest and largest radius enclose the median with 95 % confidence, whatever its law.

    All n lie on one side with probability 2 / 2^n.
    """
    n = 1
    while 2.0 * 0.5**n > 1.0 - CONFIDENCE:
        n += 1
    return n


def cep_to_velocity(arm: str) -> float:
    """Printed CEP rate over printed horizontal velocity RMS of the flight, both in m/s."""
    velocity = PRINTED["table7"][arm]
    return PRINTED["cep"][arm] * NMI / HOUR / hypot(velocity["east"], velocity["north"])


def flight_to_oven(arm: str, axis: str) -> float:
    """Velocity RMS of Table 7 over that of Table 6."""
    return PRINTED["table7"][arm][axis] / PRINTED["table6"][arm][axis]


def rate_terms_ppm(rate_c_per_min: float) -> list[float]:
    """epsilon r + alpha r^2 of each unit in ppm of gamma: the rate terms near T0.

    On a horizontal accelerometer in steady flight they act on a specific force of nearly zero.
    """
    found = []
    for unit in UNITS:
        c = dict(zip(TERMS, coefficients(unit), strict=True))
        found.append(1e6 * (c["epsilon"] * rate_c_per_min + c["alpha"] * rate_c_per_min**2) / c["gamma"])
    return found


def force_for_turn_on_g(rate_c_per_min: float) -> float:
    """Horizontal specific force in g at which the largest rate terms equal the printed bias repeatability."""
    return INS.accelerometer.bias_repeatability_ug / max(rate_terms_ppm(rate_c_per_min))
