"""What a number can be, by the unit in its name: one table for every TOML file, the form, importers and `evaluate`.

Beyond them no vehicle goes and no instrument measures; a number without unit must leave room to be squared.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

# unit at the end of a name: lowest, highest
BY_UNIT: dict[str, tuple[float, float]] = {
    "deg": (-720.0, 720.0),  # two turns
    "m": (-2e4, 1e6),  # from the deepest ocean with room to spare to low orbit
    "mps": (-2e4, 2e4),  # re-entry from the Moon: 11 km/s
    "mps2": (-1e4, 1e4),  # a shell in its barrel: 1e5, which no navigation instrument measures
    "radps": (-100.0, 100.0),  # 5700 deg/s; the widest gyros have 4000
    "c": (-150.0, 500.0),
    "c_per_min": (-1e3, 1e3),
    "s": (-1e10, 1e10),  # 300 years: stamps since 1970 or 1980
    "hz": (0.0, 1e6),
    "g": (-1e3, 1e3),
    "ug": (-1e9, 1e9),  # 1000 g
    "ug_per_c": (-1e9, 1e9),
    "ug_per_sqrt_hz": (-1e9, 1e9),
    "deg_per_h": (-2.1e7, 2.1e7),  # 100 rad/s
    "deg_per_sqrt_h": (-3.5e5, 3.5e5),  # 100 rad/s over an hour
}
BY_NAME: dict[str, tuple[float, float]] = {
    "latitude_deg": (-90.0, 90.0),
    "longitude_deg": (-360.0, 360.0),
    "roll_deg": (-360.0, 360.0),
    "pitch_deg": (-90.0, 90.0),
    "heading_deg": (-360.0, 720.0),
    "height_baro_m": (-5e3, 1e6),
    "position_sigma_m": (0.0, 1e6),
    "velocity_sigma_mps": (0.0, 2e4),
}
OTHER = (-1e15, 1e15)  # a chamber of pulses counted over a day shows below 1e12
LONGEST_LEVER_ARM_M = 200.0  # the largest ships have 400 m from end to end
SMALLEST_DIVISOR = 1e-9  # of what divides: a quotient leaves room to be squared; a pulse in 30 years at 1 g
LONGEST_TEXT = 2000  # characters of a name or note


@lru_cache(maxsize=1000)  # of a list of numbers each is held to them
def limits_of(name: str) -> tuple[float, float]:
    """Lowest and highest value of the key or column of that name, in its own unit."""
    if name in BY_NAME:
        return BY_NAME[name]
    units = [unit for unit in BY_UNIT if name.endswith(f"_{unit}")]
    return BY_UNIT[max(units, key=len)] if units else OTHER


def allowed(name: str, value: object) -> None:
    """Raises ValueError where a number of the value of that key lies beyond its limits, or a text of it is endless."""
    if isinstance(value, (tuple, list)):
        for part in value:
            allowed(name, part)
    elif isinstance(value, str):
        if len(value) > LONGEST_TEXT:
            raise ValueError(f"{len(value)} characters, expected at most {LONGEST_TEXT}; write less")
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        low, high = limits_of(name)
        if not low <= value <= high:
            raise ValueError(f"{value:g} cannot be, expected {low:g} to {high:g}; mind the unit in the key's name")


def within(values: np.ndarray) -> np.ndarray:
    """Where values (n, ...) are finite and leave room to be squared."""
    return (values >= OTHER[0]) & (values <= OTHER[1])
