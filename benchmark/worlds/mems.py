"""Drives and flights of MEMS units made here, and what is concealed in each.

A journey is a stretch of minutes: from the stand on, or out of the middle with a start that states no attitude. Sizes
are those that are concealed in real recordings of the same grade (`real`), noise of every other journey is other than
its sheet says.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmark.worlds import grades
from benchmark.worlds.into_data import Applied, apply
from benchmark.worlds.real import FLYING, INDUSTRIAL, Case, Row, Source
from benchmark.worlds.recorded import ANGLES, Recorded

RATE_HZ = 50.0
LENGTHS_S = (300.0, 600.0)
STANDS_FIRST = 0.6  # of the journeys
PATHS = {"drive": 0.5, "box": 0.2, "wing rock": 0.15, "climb, cruise, landing": 0.15}
ATTITUDE_STEP_S = 0.1
ROWS: dict[str, tuple[Row, ...]] = {
    "consumer": tuple(row for row in FLYING if row.name != "gps.lever_arm"),  # no attitude is recorded to turn it by
    "industrial": INDUSTRIAL,
}
WORD = 23  # of the seeds of these journeys


@dataclass(frozen=True)
class Journey:
    """A recording as it is, the same with true attitudes for the oracle, and what is concealed in it."""

    source: Source
    recorded: Recorded
    seen: Recorded
    effect: Applied

    @property
    def cases(self) -> Iterator[Case]:
        """The recording as it is, and with the effect."""
        name = f"case-{self.source.name}"
        yield Case(f"{name}-unmodified", "unmodified", self.source, "as it is", self.recorded)
        hidden = apply(self.recorded, self.effect)
        yield Case(f"{name}-hidden-00", "single", self.source, "one effect", hidden, self.effect)


def a_journey(seed: int, index: int) -> Journey:
    """Journey number `index`; the same arguments give the same one."""
    rng = np.random.default_rng(np.random.SeedSequence([WORD, seed, index]))
    grade, path = str(rng.choice(list(ROWS))), str(rng.choice(list(PATHS), p=list(PATHS.values())))
    made = grades.a_recording(rng, grade, path, RATE_HZ, ("plain", "adversarial")[index % 2])
    length_s, last_s = float(rng.uniform(*LENGTHS_S)), float(made.felt.time_s[-1])
    begin_s = 0.0 if rng.random() < STANDS_FIRST else round(float(rng.uniform(0.0, last_s - length_s)))
    grades.cut(made, begin_s, length_s)
    recorded = Recorded(made.head, {name: dict(columns) for name, columns in made.tables.items()})
    at_s = np.arange(begin_s, begin_s + length_s, ATTITUDE_STEP_S)
    angles = np.rad2deg(made.felt.truth.state(at_s)[2])
    seen = recorded.copy()
    seen.tables["reference"] = {"time_s": at_s} | dict(zip(ANGLES, angles.T, strict=True))
    source = Source(f"mems-{index:03d}", f"{grade} unit, {path}", "", "", ROWS[grade])
    row = source.rows[int(rng.integers(len(source.rows)))]
    return Journey(source, recorded, seen, row.drawn(rng, recorded))
