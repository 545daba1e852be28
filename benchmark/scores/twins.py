"""Twins of a concealed effect: names that, with a free size, fit the realised errors as well as the truth does.

    chi-square left by a column at its best size = y'y - b^2 / a,   twin: at most `MORE` more than the truth leaves

in the sums of `oracle`, from the true columns, whitened with the true noise; start and turn-on are integrated out.
"""

from __future__ import annotations

import numpy as np

from benchmark.scores import oracle, whitened

MORE = 9.0  # of chi-square: 3 sigma


def twins(a: np.ndarray, b: np.ndarray, families: list[tuple]) -> set[tuple]:
    """Families of the columns (m,) that are twins of column 0, which is the truth."""
    gains = b**2 / np.maximum(np.diag(a), 1e-300)
    return {family for family, gain in zip(families, gains, strict=True) if gain >= gains[0] - MORE} - {families[0]}


def of_case(case) -> set[tuple]:
    """The twins of the one effect that a case conceals, (name, axis, other axis) each."""
    (hidden,) = case.hidden
    seconds = max((made.felt.time_s[-1] for made in case.made if made.felt is not None), default=7200.0)
    every = [oracle.nominal(hidden), *oracle.library(seconds, with_steps=len(case.made) == 1)]
    a = b = 0.0
    for made in case.made:
        sheet, true = case.unit.sheet, case.unit.noise
        if made.kind == "chamber":
            columns = whitened.chamber_whitened(made, sheet, true, every)
        else:
            columns = whitened.Moving(made, sheet, true).whitened(every)
        one = oracle.reduced(*columns)
        a, b = a + one[0], b + one[1]
    return twins(a, b, [oracle.family(one) for one in every])
