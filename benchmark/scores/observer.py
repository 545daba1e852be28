"""A linear Gaussian observer of whole instruments: what could be known of the next flight by one who knows the noise.

All persistent errors of all sensors are free at once, normal with the sigmas from which they were drawn, and so are the
turn-on biases, the start and the branch on which each magnet begins. It knows every level of the noise, and linearises
about the truth. It does not know time constants and widths: values on a grid stand side by side, each with its part of
the variance. A magnet begins anew in each flight and in each run of a chamber.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmark.scores.oracle import reduced
from benchmark.scores.whitened import Moving, chamber_whitened
from benchmark.worlds.effects import AXES, Effect
from benchmark.worlds.record import Made
from benchmark.worlds.whole import POPULATIONS, Instrument, others

TIMES_S = tuple(np.geomspace(300.0, 15000.0, 6))
WIDTHS_C = tuple(np.geomspace(0.5, 9.0, 5))
DRAWS = 1000


def candidates(population: str) -> tuple[list[Effect], list[Effect]]:
    """Every persistent error at one sigma of its prior, and what the beginning of a magnet adds on a day."""
    found, of_day = [], []
    for name, sigma in POPULATIONS[population].items():
        for axis in AXES:
            if name.endswith("creep"):
                size = sigma / np.sqrt(len(TIMES_S))
                found += [Effect(name, axis, size, {"time_constant_s": float(t), "law": "one"}) for t in TIMES_S]
            elif name.endswith("hysteresis"):
                size = sigma / np.sqrt(len(WIDTHS_C))
                found += [Effect(name, axis, size, {"branch_width_c": float(w), "begin": 0.0}) for w in WIDTHS_C]
                of_day += [Effect(name, axis, size, {"branch_width_c": float(w), "begin": 1.0}) for w in WIDTHS_C]
            else:
                found += [Effect(name, axis, sigma, {} if o is None else {"other_axis": o}) for o in others(name, axis)]
    return found, of_day


Sums = tuple[np.ndarray, np.ndarray, float, int]


def observed(instrument: Instrument, parts: Sequence[Sums]) -> list[Effect]:
    """The errors that the observer believes after recordings with these `sums`: posterior means."""
    own, _ = candidates(instrument.population)
    a, b = sum(one[0] for one in parts), sum(one[1] for one in parts)
    mean = np.linalg.solve(a + np.eye(len(own)), b)
    return [Effect(e.name, e.axis, float(m * e.value), e.parameters) for e, m in zip(own, mean, strict=True)]


def reachable(instrument: Instrument, parts: Sequence[Sums], later: Made) -> np.ndarray:
    """Shares (n,) of the velocity RMS on a later flight that the observer leaves of instruments of its population.

    Each is another instrument on the same days: c ~ N(0, I), b ~ N(A c, A). So they say what the best that could be
    known gains, free of the luck of one instrument.
    """
    own, _ = candidates(instrument.population)
    v = Moving(later, instrument.unit.sheet, instrument.unit.noise).velocities(own)
    square = np.einsum("tci,tcj->ij", v, v)
    a = sum(one[0] for one in parts)
    rng = np.random.default_rng(0)
    c, white = rng.standard_normal((2, DRAWS, len(own)))
    values, vectors = np.linalg.eigh(a)
    b = c @ a + (white * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    left = c - np.linalg.solve(a + np.eye(len(own)), b.T).T
    return np.sqrt(np.einsum("ni,ni->n", left @ square, left) / np.einsum("ni,ni->n", c @ square, c))


def sums(instrument: Instrument, made: Made) -> Sums:
    """A (k, k) and b (k,) of the persistent errors in one recording, and the square of its n data; and n.

    What belongs to the recording is integrated out of all.
    """
    own, of_day = candidates(instrument.population)
    k = len(own)
    places = [next(i for i, one in enumerate(own) if _same(one, other)) for other in of_day]
    every = [*own, *of_day]
    sheet, true = instrument.unit.sheet, instrument.unit.noise
    if made.kind == "chamber":
        data, columns, nuisances = chamber_whitened(made, sheet, true, every)
    else:
        data, columns, nuisances = Moving(made, sheet, true).whitened(every)
    begins = columns[:, k:] - columns[:, places]  # a magnet that begins at one end, less one in the middle
    if made.kind == "chamber":
        run = made.tables["chamber"]["run"]
        begins = np.hstack([begins * (run == one)[:, None] for one in np.unique(run)])
    return *reduced(data, columns[:, :k], np.column_stack([nuisances, begins])), data.size


def _same(a: Effect, b: Effect) -> bool:
    """Whether two effects differ in where a magnet begins only."""
    one, other = ({k: x for k, x in effect.parameters.items() if k != "begin"} for effect in (a, b))
    return (a.name, a.axis, one) == (b.name, b.axis, other)
