"""The four positions and the programme of the chamber, computed again."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from ins_eval.calibration.labelings import Printed, printed_equations
from ins_eval.laboratory import Chamber
from ins_eval.studies.paper_a.printed import PRINTED, UNITS
from ins_eval.units import MINUTE


def programme() -> Chamber:
    """Steps 1 to 6 as printed."""
    of = PRINTED["chamber"]
    coldest, hottest = of["from_to_c"]
    return Chamber(
        rates_c_per_min=tuple(of["rates_c_per_min"]),
        soak_c=of["soak_c"],
        soak_s=of["soak_min"] * MINUTE,
        coldest_c=coldest,
        hottest_c=hottest,
        dwell_s=of["dwell_min"] * MINUTE,
    )


class Ramps(NamedTuple):
    """Of each commanded rate, all tuples of the same length."""

    commanded_c_per_min: tuple[float, ...]
    mean_c_per_min: tuple[float, ...]  # dwells included
    moving_share: tuple[float, ...]  # of the time between the soaks
    position_h: tuple[float, ...]


def ramps() -> Ramps:
    """What a dwell at each whole degree makes of a "constant" rate."""
    chamber = programme()
    rates = chamber.rates_c_per_min
    mean = tuple(chamber.mean_rate_c_per_min(rate) for rate in rates)
    return Ramps(rates, mean, tuple(m / r for m, r in zip(mean, rates, strict=True)), tuple(map(chamber.run_h, rates)))


def effort_h(dwell: bool = True) -> float:
    """Hours of all positions at all rates."""
    chamber = programme() if dwell else replace(programme(), dwell_s=0.0)
    return PRINTED["chamber"]["positions"] * sum(map(chamber.run_h, chamber.rates_c_per_min))


class Slew(NamedTuple):
    """Rates in degC/min."""

    oven_slowest: float
    fastest_step: float
    justified: float
    justified_is_a_step: bool


def slew() -> Slew:
    """Rates that the chamber is said to have, that the text justifies, and that the steps use."""
    of = PRINTED["chamber"]
    rates, justified = of["rates_c_per_min"], of["justified_rate_c_per_min"]
    return Slew(of["slew_c_per_min"][0], max(rates), justified, justified in rates)


def surface_offsets_c() -> list[tuple[float, float]]:
    """Of each unit: quoted surface minus set temperature at the cold and at the hot end."""
    cold, hot = PRINTED["chamber"]["from_to_c"]
    return [(PRINTED[u]["range_c"][0] - cold, PRINTED[u]["range_c"][1] - hot) for u in UNITS]


def labelled(force_g: tuple[float, ...], k1: float, k0: float, k2: float = 0.0) -> Printed:
    """Eqs (3), (4), (13), (14) on outputs K1 (K0 + a + K2 a^2), with the forces (4,) at 0, 90, 180, 270 degrees."""
    return printed_equations([k1 * (k0 + a + k2 * a**2) for a in force_g], k1)


def days(hours: float) -> float:
    return hours / 24.0
