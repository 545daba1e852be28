"""The numbers that Paper A prints: nothing here is ours, and nothing is corrected.

``printed.toml`` holds what only this page needs. Tables 1 and 5 are data sheets, Tables 2 and 3 and the coefficients
of eqs (15)-(17) belong to the simulated accelerometers; they are read from there.
"""

from __future__ import annotations

import functools
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from ins_eval import datasheets
from ins_eval.accelerometer import Population
from ins_eval.scale_factor import TERMS

PRINTED: dict[str, Any] = tomllib.loads((Path(__file__).parent / "printed.toml").read_text(encoding="utf-8"))
UNITS = ("JB-KT8 #1", "JB-KT8 #2", "JB-KT8 #3")
QA3000, GJN096, INS = (datasheets.load(name) for name in ("qa3000-030", "gjn096-d", "tested-ins"))


@functools.cache
def _units() -> dict[str, np.ndarray]:
    units = Population.load()["scale_polynomial"].units
    return {unit.name: np.array([getattr(unit, term) for term in TERMS]) for unit in units}


def coefficients(unit: str) -> np.ndarray:
    """Eqs (15)-(17) as printed, (6,) in the order of `TERMS`, in pulse/g, degC and the unit of rate left open."""
    return _units()[unit].copy()


CHOSEN_WITH_TABLE_7 = (  # said wherever our flights stand beside this table
    "the slope of the bias, the gyros, the path and the alignment of the simulation were chosen among 28 combinations, "
    "besides 30 runs with one factor changed, with Table 7 in view"
)

# Table 7 and the CEP of section 3.2, as the metrics of a flight hold them
FLIGHT = {
    "table7": {arm: PRINTED["table7"][arm] for arm in ("simple", "hysteresis")},
    "cep": {arm: PRINTED["cep"][arm] for arm in ("simple", "hysteresis")},
}


def span_c(unit: str) -> float:
    """Degrees between the ends of the range that the text gives for a unit."""
    low, high = PRINTED[unit]["range_c"]
    return high - low
