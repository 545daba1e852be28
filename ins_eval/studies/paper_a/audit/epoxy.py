"""Tables 2 and 3, and the experiment behind them, computed again from their own numbers."""

from __future__ import annotations

import numpy as np

from ins_eval.accelerometer.creep import epoxy
from ins_eval.laboratory.creep_rig import Statistics, statistics
from ins_eval.studies.paper_a.printed import PRINTED

SOAK_C = 22.0  # the one start temperature that the rest of the paper would suggest
# start temperatures with which one coefficient of expansion serves all three blocks; assumed, the paper has none
STEPS_FROM_C = (30.0, -55.0, -55.0)


def of_table(table: str) -> Statistics:
    """Statistics of ``"creep_um"`` (Table 2) or ``"thermal_um"`` (Table 3) in the three containers."""
    return statistics(epoxy()[table])


def of_first(table: str) -> list[float]:
    """Sizes of repetition #1 in the three containers."""
    return epoxy()[table][:, 0].tolist()


def missed_extremes(table: str) -> list[tuple[float, float] | None]:
    """For each column, two entries (high, low) that would give the printed variation, or None where none would.

    Where they are not the true extremes, an extreme was overlooked.
    """
    printed = PRINTED["creep"]["table2_variation_percent" if table == "creep_um" else "table3_variation_percent"]
    found: list[tuple[float, float] | None] = []
    for sizes, percent in zip(epoxy()[table], printed, strict=True):
        pairs = {(float(h), float(low)) for h in sizes for low in sizes if h > low}
        miss = {pair: abs(100.0 * (pair[0] - pair[1]) / sizes[0] - percent) for pair in pairs}
        # of pairs that fit alike, the one that holds a true extreme
        best = min(miss, key=lambda p: (miss[p] > 0.05, p[0] != sizes.max() and p[1] != sizes.min(), miss[p]))
        found.append(best if miss[best] <= 0.05 else None)
    return found


def overlooked(table: str) -> list[tuple[float, float]]:
    """The pairs of `missed_extremes` that are not the true extremes of their columns."""
    pairs = zip(missed_extremes(table), epoxy()[table], strict=True)
    return [pair for pair, sizes in pairs if pair and pair != (sizes.max(), sizes.min())]


def caption_differences() -> int:
    """How many of the three temperatures of Fig. 3's caption are not those of text and tables."""
    of = PRINTED["creep"]
    return sum(a != b for a, b in zip(of["figure3_caption_c"], of["temperature_c"], strict=True))


def sign_differences() -> int:
    """How many of the three columns have a sign that the text contradicts."""
    of = PRINTED["creep"]
    return sum(a != b for a, b in zip(of["table_signs"], of["text_signs"], strict=True))


def expansion_um_per_c(from_c: tuple[float, ...] = (SOAK_C,) * 3) -> np.ndarray:
    """Mean thermal deformation (3,) per degree travelled, where the blocks start at `from_c`."""
    data = epoxy()
    return data["thermal_um"].mean(axis=1) / np.abs(data["temperature_c"] - np.array(from_c))


def best_common_start() -> tuple[float, np.ndarray]:
    """The one start temperature that comes nearest to a constant expansion, and what it leaves, (3,) in um/degC.

    The block at -55 degC shrank and that at 30 degC expanded, so it lies between; there the two agree.
    """
    cold, warm, _ = epoxy()["thermal_um"].mean(axis=1)
    low, high, _ = epoxy()["temperature_c"]
    start = (warm * low + cold * high) / (cold + warm)
    return float(start), expansion_um_per_c((float(start),) * 3)


def spread(values: np.ndarray) -> float:
    """Largest over smallest."""
    return float(values.max() / values.min())
