"""The numbers that Paper A prints: nothing here is ours, and nothing is corrected.

``printed.toml`` holds what only this page needs. Tables 1 and 5 are data sheets, Tables 2 and 3 and the coefficients
of eqs (15)-(17) belong to the simulated accelerometers, Table 7 and the CEP to every report on a flight; they are read
from there.
"""

from __future__ import annotations

import functools
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from ins_eval import datasheets, published_flight
from ins_eval.accelerometer import Population
from ins_eval.scale_factor import TERMS

PRINTED: dict[str, Any] = {
    **tomllib.loads((Path(__file__).parent / "printed.toml").read_text(encoding="utf-8")),
    **published_flight.PRINTED,
}
UNITS = ("JB-KT8 #1", "JB-KT8 #2", "JB-KT8 #3")
QA3000, GJN096, INS = (datasheets.load(name) for name in ("qa3000-030", "gjn096-d", "tested-ins"))


@functools.cache
def _units() -> dict[str, np.ndarray]:
    units = Population.load()["scale_polynomial"].units
    return {unit.name: np.array([getattr(unit, term) for term in TERMS]) for unit in units}


def coefficients(unit: str) -> np.ndarray:
    """Eqs (15)-(17) as printed, (6,) in the order of `TERMS`, in pulse/g, degC and the unit of rate left open."""
    return _units()[unit].copy()


def span_c(unit: str) -> float:
    """Degrees between the ends of the range that the text gives for a unit."""
    low, high = PRINTED[unit]["range_c"]
    return high - low
