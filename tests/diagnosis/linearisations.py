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
