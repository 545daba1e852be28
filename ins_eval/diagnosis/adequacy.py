"""Is an explanation enough? What a disturbance without a name gains instead of the effects, and what beside them.

Instead, the whole error is left to one channel of one recording, which changes slowly with time or along a curve of its
temperature (`open_form`): where that gains more than laws do, they only describe something else. Beside, the effects
are taken off at their best, and any interval of any channel is looked at for what they leave.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ins_eval.diagnosis import locate
from ins_eval.diagnosis.columns import Column
from ins_eval.diagnosis.disturbance import largest_probability, of_windows, within_statement
from ins_eval.diagnosis.evidence import Reduced, reduce
from ins_eval.diagnosis.linearisation import Linearisation
from ins_eval.diagnosis.open_form import open_forms, over_temperature
from ins_eval.diagnosis.rivals import WITHIN
from ins_eval.diagnosis.verdict import UnnamedDisturbance, located
from ins_eval.diagnosis.whitening import Whitened

CURVE = "a curve of its temperature"


def left_unexplained(
    linearisation: Linearisation, share: float, rng: np.random.Generator
) -> tuple[UnnamedDisturbance, UnnamedDisturbance]:
    """Instead of the effects that are taken off, and beside them: what gains most in any recording.

    A mismatch beside effects whose form is a law must bring at least `share` of what they do.
    """
    instead, beside = [], []
    m = list(linearisation.best.members)
    chosen, mean = linearisation.chosen(), linearisation.coefficients[0]
    rough = not linearisation.space.exact[m].any()
    least = share * max(linearisation.best.log_bayes_factor, 0.0) if rough else 0.0
    for r, case in enumerate(linearisation.cases):
        own = [i for i, one in enumerate(chosen) if one.columns[r] is not None]
        scale = np.array([max(1.0, abs(float(mean[i]))) for i in own])
        point = linearisation.point[[m[i] for i in own]] / scale
        columns = [chosen[i].columns[r] for i in own]
        over, edges_s, whitened = of_windows(case, linearisation.fitted[r].noise_point, columns)
        nuisances = len(case.nuisances)
        put_back = _put_back(whitened, nuisances, point)
        in_time = _unnamed(r, linearisation, over, edges_s, put_back, None, rng)
        instead += [
            in_time,
            *_curved(r, linearisation, columns, point, locate.scan(put_back, over, edges_s), in_time.gain),
        ]
        left = reduce(whitened, nuisances + len(columns))
        beside.append(_unnamed(r, linearisation, over, edges_s, left, least, rng))
    return tuple(max(ones, key=lambda one: one.gain) for ones in (instead, beside))


def _put_back(whitened: Whitened, nuisances: int, point: np.ndarray) -> Reduced:
    """What is left of the columns behind those of the effects, with what these took off, at `point`, added again."""
    left, n = reduce(whitened, nuisances), point.size
    return Reduced(left.normal[n:, n:], left.projection[n:] + left.normal[n:, :n] @ point)


def _unnamed(
    r: int,
    linearisation: Linearisation,
    over: list[locate.Channel],
    edges_s: np.ndarray,
    reduced: Reduced,
    least: float | None,
    rng: np.random.Generator,
) -> UnnamedDisturbance:
    """What changes slowly with time; `least` nats that a mismatch must bring, None where one is shown anyway."""
    case = linearisation.cases[r]
    trials = locate.significance(reduced, edges_s.size - 1, rng)
    # a channel is one more family, and costs what an effect costs
    gain = max(one.log_bayes_factor for one in open_forms(reduced, len(over))) - linearisation.space.cost
    found = locate.scan(reduced, over, edges_s)
    interval = next((one for one in found if not within_statement(case, one)), None)
    if interval is None:
        return UnnamedDisturbance(None, gain, 0.0)
    sigma = trials.sigma(interval.t2)
    sure = trials.probability(interval.t2) <= largest_probability(interval)
    if least is None or (sure and 0.5 * interval.t2 > least) or gain > least:
        return UnnamedDisturbance(located(case, r, interval, sigma), gain, sigma)
    return UnnamedDisturbance(None, gain, sigma)


def _curved(
    r: int,
    linearisation: Linearisation,
    columns: Sequence[Column],
    point: np.ndarray,
    found: Sequence[locate.Interval],
    in_time: float,
) -> list[UnnamedDisturbance]:
    """The sensor whose error is best a curve of its temperature, where there is a temperature that moves.

    `columns` of the effects took off their part at `point`; `found` is the best interval of each channel. A
    temperature that only rises or falls is another clock, so it is said to follow it only where that gains `WITHIN`
    more than the form `in_time`.
    """
    case = linearisation.cases[r]
    curves = over_temperature(case)
    if not curves:
        return []
    knots = [column for one in curves.values() for column in one]
    whitened = case.whitened([*columns, *knots], linearisation.fitted[r].noise_point)  # as the effects, not on means
    forms = open_forms(_put_back(whitened, len(case.nuisances), point), len(curves))
    best = max(forms, key=lambda one: one.log_bayes_factor)
    gain = best.log_bayes_factor - linearisation.space.cost
    sigma = float(np.sqrt(2.0 * max(gain, 0.0)))
    channel = list(curves)[best.channel]
    follows = CURVE if gain > WITHIN + max(in_time, 0.0) else ""
    return [
        UnnamedDisturbance(located(case, r, one, sigma, follows), gain, sigma)
        for one in found
        if one.channel == channel
    ]
