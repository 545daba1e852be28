"""Which terms of eq. (11) a chamber programme can separate.

At a steady ramp the rate is one number, +r or -r. One direction determines three of the six terms, both directions at
one rate five (alpha r^2 is a constant there, like gamma), two or more rates all six. The filtered rate of a real
programme also passes through all values in between for some minutes after each turn and wavers at each dwell: by the
numbers alone one ramp then has rank six as well, and not even a bad condition. But that separation hangs on a few
readings, taken while inner parts lag most behind the thermometer, and on eq. (11) being true of them; so the rank
of the steady legs stands beside it and decides the verdict.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ins_eval.calibration.fits import RANK_TOLERANCE, REFERENCE_C, mixed_up
from ins_eval.calibration.four_point import FourPoint
from ins_eval.calibration.uncertainty import legs
from ins_eval.scale_factor import TERMS, scale_factor_terms

STEADY_TOLERANCE = 1e-9  # of the largest singular value: here the rates are exact
OFF = 0.2


@dataclass(frozen=True, eq=False)
class Identifiability:
    """`rank` of the readings as they are and `steady_rank` of the legs at their mean rates, of so many `terms`.

    `condition` and `steady_condition` are the ratios of the extreme singular values, columns scaled to unit length: by
    so much an error may grow; infinite where the rank falls short. `rates_c_per_min` are the mean rates of the legs and
    `turning_share` the share of readings whose rate is off that of their leg by more than a fifth. `words` say what
    cannot be separated and what hangs on turns alone; empty where all is well.
    """

    terms: tuple[str, ...]
    rank: int
    steady_rank: int
    condition: float
    steady_condition: float
    rates_c_per_min: tuple[float, ...]
    turning_share: float
    words: str

    @property
    def sound(self) -> bool:
        """Whether the steady legs determine every term."""
        return self.steady_rank == len(self.terms)


def identifiability(
    points: FourPoint, terms: tuple[str, ...] = TERMS, reference_c: float = REFERENCE_C
) -> Identifiability:
    """What these points determine of the chosen terms of eq. (11), whatever the values are."""
    chosen = [TERMS.index(term) for term in terms]
    difference = points.temperature_c - reference_c
    rank, condition, open_rows = _rank(scale_factor_terms(difference, points.rate_c_per_min)[:, chosen], RANK_TOLERANCE)
    steady, rates = _steady_rates(points)
    turning = float(np.mean(np.abs(points.rate_c_per_min - steady) > OFF * np.abs(steady)))
    steady_rank, steady_condition, steady_open = _rank(
        scale_factor_terms(difference, steady)[:, chosen], STEADY_TOLERANCE
    )
    words = ""
    if rank < len(terms):
        words = mixed_up(terms, open_rows)
    elif steady_rank < len(terms):
        words = (
            f"{_cause(rates)}: {mixed_up(terms, steady_open)} by steady legs; what separates them are readings taken "
            f"near turns ({_percent(turning)} of all), so calibrate at two or more rates, falling and rising"
        )
    return Identifiability(terms, rank, steady_rank, condition, steady_condition, rates, turning, words)


def _steady_rates(points: FourPoint) -> tuple[np.ndarray, tuple[float, ...]]:
    """The rate of each reading if every ramp moved at one speed both ways: (n,) in degC/min; and those rates."""
    ramp, leg = legs(points)
    steady = np.zeros(ramp.size)
    for number in range(ramp.max() + 1):
        of_ramp = ramp == number
        speed = np.median(np.abs(points.rate_c_per_min[of_ramp]))
        for k in np.unique(leg[of_ramp]):
            steady[leg == k] = speed * np.sign(np.median(points.rate_c_per_min[leg == k]))
    return steady, tuple(np.unique(steady).tolist())


def _rank(design: np.ndarray, tolerance: float) -> tuple[int, float, np.ndarray]:
    """Rank, ratio of the extreme singular values, and the directions (k, p) that are left open."""
    length = np.linalg.norm(design, axis=0)
    length[length == 0.0] = 1.0
    _, singular, right = np.linalg.svd(np.linalg.qr(design / length, mode="r"))
    rank = int(np.count_nonzero(singular > tolerance * singular[0]))
    condition = float(singular[0] / singular[-1]) if rank == singular.size else float("inf")
    return rank, condition, right[rank:]


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if share >= 0.01 else "less than 1 %"


def _cause(rates: tuple[float, ...]) -> str:
    if len({abs(rate) for rate in rates}) > 1:
        return "these rates and directions"
    return "one rate" if len(rates) > 1 else "one direction"
