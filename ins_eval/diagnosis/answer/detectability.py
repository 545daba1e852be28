"""What recordings could show: the log Bayes factor that an effect of its usual size is expected to reach in them.

With a the reduced sum of a column that carries its nominal size, and an effect of v nominal sizes in the recording,
b ~ N(a v, a), so that with a prior of scale s

    E log B(s) = ((a v)^2 + a) / (a + s^-2) / 2 - log(1 + s^2 a) / 2

and B is the mean over the scales of the prior; a prior around a size c that physics fixes adds (c v - c^2 / 2) a and
leaves v - c to find. `evidence.expected_log_evidence` is the same for several columns. An effect of usual size that
stays near 0 is invisible: that none is found says nothing about it.

Source: Lindley, Ann. Math. Stat. 27 (1956) 986.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import brentq

from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.estimation.evidence import SCALES

if TYPE_CHECKING:
    from ins_eval.error_model.library import Candidate

SMALLEST, LARGEST = 1e-4, 1e8  # nominal sizes between which the size that shows is looked for


@dataclass(frozen=True)
class Detectability:
    """One family of effects: what its `usual` size, in `unit`, is expected to gain in nats.

    `shows_from` is the size from which on it is expected to gain enough; None where physics leaves no choice of size,
    or no size does.
    """

    name: str
    axis: str | None
    other_axis: str | None
    unit: str
    usual: float
    expected_log_bayes_factor: float
    shows_from: float | None


def expected(a: float, size: float, centre: float = 0.0) -> float:
    """Expected log Bayes factor (nats) of an effect of `size` nominal sizes whose column has the reduced sum `a`."""
    variance = np.square(SCALES if centre == 0.0 else (1.0,))
    square = (a * (size - centre)) ** 2 + a
    each = 0.5 * variance * square / (1.0 + variance * a) - 0.5 * np.log1p(variance * a)
    return float((centre * size - 0.5 * centre**2) * a + np.logaddexp.reduce(each) - np.log(each.size))


def shows_from(a: float, enough: float) -> float | None:
    """The size, in nominal sizes, that is expected to gain `enough` nats; None where there is none."""
    if not a > 0.0 or expected(a, LARGEST) < enough:
        return None
    if expected(a, SMALLEST) >= enough:
        return SMALLEST
    return float(np.exp(brentq(lambda x: expected(a, np.exp(x)) - enough, np.log(SMALLEST), np.log(LARGEST))))


def detectability(candidates: Sequence[Candidate], a: np.ndarray, enough: float) -> list[Detectability]:
    """Every family among `candidates`, least visible first; `a` (m,) is the diagonal of their reduced sums.

    Of a family whose members differ in a time, a width or a lag it is the member that shows best, or, where physics
    ties the size to it, the one of the size that is usual.
    """
    families: dict[tuple, list[int]] = {}
    for k, one in enumerate(candidates):
        families.setdefault(one.key, []).append(k)
    found = []
    for members in families.values():
        first = candidates[members[0]]
        if first.centre:
            usual = VOCABULARY[first.name].centre or VOCABULARY[first.name].nominal
            k = min(members, key=lambda j: abs(candidates[j].centre * candidates[j].nominal - usual))
        else:
            k = max(members, key=lambda j: a[j])
        one, own = candidates[k], max(float(a[k]), 0.0)
        size = one.centre or 1.0
        least = None if one.centre else shows_from(own, enough)
        found.append(
            Detectability(
                name=one.name,
                axis=one.axis,
                other_axis=one.parameters.get("other_axis"),
                unit=one.unit,
                usual=size * one.nominal,
                expected_log_bayes_factor=expected(own, size, one.centre),
                shows_from=None if least is None else least * one.nominal,
            )
        )
    return sorted(found, key=lambda one: one.expected_log_bayes_factor)
