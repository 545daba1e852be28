"""How far the linear ensemble is from the flight in full, of instruments that were flown both ways."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Arms = Mapping[str, Mapping[str, np.ndarray]]
AGREED = 0.01  # relative difference of any instrument from which on the flights in full are taken
COMPARED = ("velocity_rms_horizontal", "radial_rms_m")


@dataclass(frozen=True)
class Agreement:
    """Of `size` instruments flown both ways.

    largest      ``[compensation][measure]``: the largest relative difference of any instrument
    of_ratio     the largest difference of a ratio to the first compensation, of the measures' RMS over the instruments
    """

    size: int
    largest: Mapping[str, Mapping[str, float]]
    of_ratio: float

    @property
    def worst(self) -> float:
        """The largest difference of all."""
        return max(max(of_arm.values()) for of_arm in self.largest.values())

    def as_tree(self) -> dict[str, Any]:
        """As it stands in ``metrics.json``."""
        largest = {arm: dict(of_arm) for arm, of_arm in self.largest.items()}
        return {"size": self.size, "worst": self.worst, "of_ratio": self.of_ratio, "largest": largest}


def agreement(linear: Arms, full: Arms) -> Agreement:
    """The instruments of `full`, which are the first of `linear`, compared in every compensation of `linear`."""
    first, *others = linear
    size = len(full[first][COMPARED[0]])
    largest: dict[str, dict[str, float]] = {arm: {} for arm in linear}
    of_ratio = 0.0
    for measure in COMPARED:
        pairs = {arm: (linear[arm][measure][:size], full[arm][measure]) for arm in linear}
        rms = {arm: [float(np.sqrt(np.mean(values**2))) for values in pair] for arm, pair in pairs.items()}
        for arm, (ours, theirs) in pairs.items():
            largest[arm][measure] = float(np.max(np.abs(ours / theirs - 1.0)))
        for arm in others:
            ours, theirs = (rms[arm][way] / rms[first][way] for way in range(2))
            of_ratio = max(of_ratio, abs(ours - theirs))
    return Agreement(size, largest, of_ratio)


def joined(members: Sequence[Arms], size: int | None = None) -> dict[str, dict[str, np.ndarray]]:
    """``[arm][key]`` of the first `size` instruments, from the blocks that hold them, one after the other."""
    return {
        arm: {key: np.concatenate([block[arm][key] for block in members])[:size] for key in of_arm}
        for arm, of_arm in members[0].items()
    }
