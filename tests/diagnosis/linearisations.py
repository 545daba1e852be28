"""Stages of a search made by hand: sums whose columns are orthogonal but for two, to tell coefficients by hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ins_eval.error_model.columns import Column
from ins_eval.error_model.library import Candidate
from ins_eval.estimation.linearisation import Linearisation
from ins_eval.estimation.search import search
from ins_eval.estimation.study import Hypothesis, Sums, space
from ins_eval.policy import Policy

INFORMATION = 16.0  # each coefficient is known to a quarter of its nominal size
NOTHING = 0.05  # coefficient of what is not there: 0.2 sigma
ALIKE = 0.9  # correlation of two columns
CENTRE = {"temperature.lag": 1.0}  # what physics fixes a coefficient to
NAMES = (
    "accelerometer.bias_temperature", "accelerometer.scale_temperature", "accelerometer.quadratic", "gyro.bias",
    "gyro.scale", "alignment.heading", "accelerometer.bias_drift", "earth.coriolis",
)  # fmt: skip
Effect = tuple[str, str | None, dict[str, float | str]]  # name, axis, further parameters


def linearisation(
    effects: Sequence[Effect], seen: dict[int, float], alike: tuple[int, int] | None = None
) -> Linearisation:
    """Recordings that tell the coefficients `seen`, by the number of the effect, `NOTHING` of others.

    Of the two effects `alike` the columns have the correlation `ALIKE`.
    """
    hypotheses = tuple(
        Hypothesis(
            Candidate(name, axis, "ug", 1.0, Column("", ()), parameters, CENTRE.get(name, 0.0)), (Column("", ()),)
        )
        for name, axis, parameters in effects
    )
    normal = INFORMATION * np.eye(len(effects))
    if alike is not None:
        normal[alike], normal[alike[::-1]] = (ALIKE * INFORMATION,) * 2
    here = Sums(normal, normal @ [seen.get(k, NOTHING) for k in range(len(effects))], 0.0)
    families = space(hypotheses, Policy(handicap=0.0))
    ranked = tuple(search(here.normal, here.projection, families, Policy.share, Policy()))
    return Linearisation((), hypotheses, families, np.zeros(len(effects)), (), here, ranked)


def random_linearisation(rng: np.random.Generator, names: tuple[str, ...] = NAMES) -> Linearisation:
    """Columns that resemble each other more or less, effects or none, and a best set that may be a wrong one."""
    count = int(rng.integers(2, 10))
    drawn = [(str(rng.choice(names)), str(rng.choice(list("xyz")))) for _ in range(count)]
    hypotheses = tuple(
        Hypothesis(
            Candidate(name, axis, "ug", 1.0, Column("", ()), {}, 1.0 if name.startswith("earth.") else 0.0),
            (Column("", ()),),
        )
        for name, axis in dict.fromkeys(drawn)
    )
    m = len(hypotheses)
    x = rng.standard_normal((60, m)) + 10.0 ** rng.uniform(-1.0, 1.5) * rng.standard_normal((60, 1))
    x *= 10.0 ** rng.uniform(-1.0, 0.5, m)
    y = x @ (rng.standard_normal(m) * rng.integers(0, 2, m) * 10.0 ** rng.uniform(-1.0, 1.0)) + rng.standard_normal(60)
    here, families = Sums(x.T @ x, x.T @ y, 0.0), space(hypotheses, Policy())
    ranked = tuple(search(here.normal, here.projection, families, Policy.share, Policy()))
    found = Linearisation((), hypotheses, families, np.zeros(m), (), here, ranked)
    if rng.random() < 0.3:  # a set that was navigated with, and is not the best
        found = found.own_first(int(rng.integers(1, m + 1)))
    return found
