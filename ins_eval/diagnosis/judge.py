"""Is there a mismatch, and where: the noise refitted under every suspect, under the same prior as under the null.

A suspect is an interval of a channel, or an effect of the library. Both are first ranked with the noise of the null,
which what is wrong has inflated; the best few are then compared with the null each at its own noise:

    gain of an effect    log Bayes factor, max over noise of log Z_1 less max over noise of log Z_0
    gain of an interval  twice the same with the size at its best, to be judged as the largest of many

Found suspects join what is uncertain anyway, and the search goes on until nothing is left.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import logsumexp
from threadpoolctl import threadpool_limits

from ins_eval.diagnosis import locate
from ins_eval.diagnosis.case import Case
from ins_eval.diagnosis.columns import Column
from ins_eval.diagnosis.evidence import log_bayes_factors, log_evidence_of, reduce
from ins_eval.diagnosis.library import Candidate
from ins_eval.diagnosis.locate import Interval, Significance
from ins_eval.diagnosis.noise import Fitted
from ins_eval.diagnosis.where import where
from ins_eval.diagnosis.whitening import Whitened
from ins_eval.streams import Streams

LEAST_LOG_BAYES_FACTOR = 5.0  # of an effect before it counts
# of an interval as remarkable as this, where nothing is wrong; a receiver that changes satellites steps by itself
LARGEST_PROBABILITY = {"gps.position": 1e-6, "gps.velocity": 1e-4}
OTHERWISE = 0.003
SUSPECTS = 2  # of each kind, refitted
WORTH_REFITTING = 1.0  # log Bayes factor with the noise of the null, or
REMARKABLE = 0.5  # probability of the ratio with that noise
MOST_MISMATCHES = 4
WIDEST_SIZES, WIDEST_FOUND = 10.0, 3.0  # prior sigma of a mismatch once it is taken for granted: sizes, or as found
ENERGY = (0.05, 0.95)  # of an effect's energy: the interval in which it shows


@dataclass(frozen=True)
class Mismatch:
    """One located mismatch; `log_bayes_factor` of the effect that showed it, None where a plain interval did."""

    channel: str
    axis: str
    begin_s: float
    end_s: float
    where: str
    significance_sigma: float
    log_bayes_factor: float | None
    column: Column = field(repr=False)
    size: float = 0.0  # found, in sizes of the column


@dataclass(frozen=True, eq=False)
class Judgement:
    """The null of one recording, and what was found against it.

    `statistics` are the largest log Bayes factor and the smallest probability of the first search; `innovations` of
    the null (nodes, 9), everything uncertain at its best.
    """

    case: Case
    null: Fitted
    mismatches: tuple[Mismatch, ...]
    statistics: dict[str, float | str]
    innovations: np.ndarray


def judge(case: Case, progress: Callable[[str], None] = lambda _: None) -> Judgement:
    """Search one recording for mismatches."""
    with threadpool_limits(1):  # small matrices: more threads in each product only wait for one another
        return _judged(case, progress)


def _judged(case: Case, progress: Callable[[str], None]) -> Judgement:
    progress("noise")
    null = case.fitted()
    innovations = _innovations(case, null.position)
    found: list[Mismatch] = []
    statistics: dict[str, float | str] = {}
    current, base = case, null
    while len(found) < MOST_MISMATCHES:
        progress(f"search {len(found) + 1}")
        mismatch, fitted, seen = _search(current, base)
        statistics = statistics or seen
        if mismatch is None:
            break
        found.append(mismatch)
        current = replace(current, nuisances=(*current.nuisances, _widened(mismatch)))
        base = current.fitted(start=fitted.position)
    return Judgement(case, null, tuple(found), statistics, innovations)


def _search(case: Case, base: Fitted) -> tuple[Mismatch | None, Fitted, dict[str, float | str]]:
    """The one mismatch that is most certain, or None, its noise, and what the search saw."""
    over, edges_s = locate.channels(case.seen, case.candidates[0].axis), locate.edges(case.model)
    windows = [column for channel in over for column in locate.windows(channel, edges_s, case.slow, case.model)]
    columns = [one.column for one in case.candidates] + windows
    known = len(case.nuisances)
    reduced = reduce(case.whitened(columns, base.position, case.block), known)
    effects = len(case.candidates)
    factors = _factors(case, reduced.normal.diagonal()[:effects], reduced.projection[:effects])
    inside = slice(effects, None)
    of_windows = replace(reduced, normal=reduced.normal[inside, inside], projection=reduced.projection[inside])
    intervals = locate.scan(of_windows, over, edges_s)
    trials = locate.significance(of_windows, edges_s.size - 1, Streams(0).at("diagnosis", "significance").rng())

    families = _families(case, factors)
    best = [
        _refit_effect(case, base, case.candidates[k], of_family - factors[k])
        for k, of_family in families[:SUSPECTS]
        if of_family > WORTH_REFITTING
    ]
    best += [
        _refit_interval(case, base, one, trials)
        for one in intervals[:SUSPECTS]
        if trials.probability(one.t2) < REMARKABLE
    ]
    seen: dict[str, float | str] = {
        "largest_log_bayes_factor": max((s.gain for s in best if s.effect), default=families[0][1]),
        "largest_effect": max(
            (s for s in best if s.effect), key=lambda s: s.gain, default=_Suspect(None, None, 0.0, 0.0, 0.0, base)
        ).name,
        "smallest_probability": min((s.probability for s in best if not s.effect), default=1.0),
        "trials": trials.trials,
        "significance_sigma": max((s.sigma for s in best if not s.effect), default=0.0),
    }
    sure = [s for s in best if s.sure]
    if not sure:
        return None, base, seen
    winner = max(sure, key=lambda s: s.gain)
    located = _of_effect(case, winner, trials) if winner.effect else _of_interval(case, winner)
    return located, winner.fitted, seen


@dataclass(frozen=True, eq=False)
class _Suspect:
    """A suspect after its refit; `gain` is a log Bayes factor, of an interval less the log of the trials."""

    effect: Candidate | None
    interval: Interval | None
    gain: float
    probability: float
    sigma: float
    fitted: Fitted

    @property
    def name(self) -> str:
        return "" if self.effect is None else f"{self.effect.name} {self.effect.axis or ''}".strip()

    @property
    def sure(self) -> bool:
        if self.effect is not None:
            return self.gain >= LEAST_LOG_BAYES_FACTOR
        return self.probability <= LARGEST_PROBABILITY.get(self.interval.channel.name, OTHERWISE)


def _factors(case: Case, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    centres = np.array([one.centre for one in case.candidates])
    out = log_bayes_factors(a, b)
    for k in np.flatnonzero(centres):
        out[k] = log_bayes_factors(a[k], b[k], centres[k])
    return out


def _families(case: Case, factors: np.ndarray) -> list[tuple[int, float]]:
    """Of each effect and axis the best member and its family's log Bayes factor, best first.

    A family is all that differ in a time, a width or a constant only; each value is as probable as another, so the
    factor of the family is the mean of those of its members.
    """
    members: dict[tuple[str, str | None, str], list[int]] = {}
    for k, one in enumerate(case.candidates):
        members.setdefault((one.name, one.axis, str(one.parameters.get("other_axis"))), []).append(k)
    out = []
    for of_family in members.values():
        best = max(of_family, key=lambda k: factors[k])
        out.append((best, float(logsumexp(factors[of_family]) - np.log(len(of_family)))))
    return sorted(out, key=lambda one: -one[1])


def _refit_effect(case: Case, base: Fitted, effect: Candidate, share: float) -> _Suspect:
    """`share` is the log Bayes factor of the family less that of this member."""
    known = slice(0, len(case.nuisances))

    def gain(whitened: Whitened) -> float:
        left = reduce(whitened, known.stop)
        factor = log_bayes_factors(left.normal[0, 0], left.projection[0], effect.centre)
        return log_evidence_of(whitened, known) + float(factor)

    fitted = case.fitted([effect.column], base.position, gain)
    return _Suspect(effect, None, _gained(fitted, base, known) + share, 0.0, 0.0, fitted)


def _refit_interval(case: Case, base: Fitted, interval: Interval, trials: Significance) -> _Suspect:
    known = slice(0, len(case.nuisances))

    def gain(whitened: Whitened) -> float:
        left = reduce(whitened, known.stop)
        return log_evidence_of(whitened, known) + 0.5 * float(left.projection[0] ** 2 / max(left.normal[0, 0], 1e-12))

    fitted = case.fitted([interval.column(case.slow, case.model)], base.position, gain)
    ratio = max(0.0, 2.0 * _gained(fitted, base, known))
    return _Suspect(
        None,
        interval,
        0.5 * ratio - np.log(trials.trials),
        trials.probability(ratio),
        trials.sigma(ratio),
        fitted,
    )


def _gained(fitted: Fitted, base: Fitted, known: slice) -> float:
    """What a suspect gains over the null, which is tried with the suspect's noise too: a better search is no gain."""
    there = log_evidence_of(fitted.whitened, known) - 0.5 * float(fitted.position @ fitted.position)
    return fitted.log_evidence - max(base.log_evidence, there)


def _of_interval(case: Case, suspect: _Suspect) -> Mismatch:
    interval = locate.refined(case, suspect.interval, suspect.fitted.position)
    return Mismatch(
        channel=interval.channel.name,
        axis=interval.channel.axis,
        begin_s=interval.begin_s,
        end_s=interval.end_s,
        where=where(case.model, case.temperature, interval.begin_s, interval.end_s),
        significance_sigma=suspect.sigma,
        log_bayes_factor=None,
        column=interval.column(case.slow, case.model),
        size=interval.size,
    )


def _of_effect(case: Case, suspect: _Suspect, trials: Significance) -> Mismatch:
    effect = suspect.effect
    known = len(case.nuisances)
    whitened = case.whitened([effect.column], suspect.fitted.position, keep=known + 2)
    left = reduce(whitened, known)
    begin_s, end_s = _shown(case, whitened, known)
    if "at_s" in effect.parameters:
        begin_s, end_s = float(effect.parameters["at_s"]), float(case.model.nodes_s[-1])
    return Mismatch(
        channel=channel_of(effect.name, effect.axis),
        axis=effect.axis or "",
        begin_s=begin_s,
        end_s=end_s,
        where=where(case.model, case.temperature, begin_s, end_s),
        significance_sigma=trials.sigma(float(left.score[0] ** 2)),
        log_bayes_factor=suspect.gain,
        column=effect.column,
        size=float(left.projection[0] / max(left.normal[0, 0], 1e-12)),
    )


def _shown(case: Case, whitened: Whitened, known: int) -> tuple[float, float]:
    """The interval that holds most of the energy of the last column, less what the nuisances take of it."""
    a = whitened.normal
    taken = np.linalg.solve(np.eye(known) + a[:known, :known], a[:known, known])
    energy = np.nansum((whitened.kept[..., known + 1] - whitened.kept[..., 1 : known + 1] @ taken) ** 2, axis=1)
    share = np.cumsum(energy) / max(float(energy.sum()), 1e-300)
    begin, end = np.searchsorted(share, ENERGY)
    nodes_s = case.model.nodes_s
    return float(nodes_s[max(begin - 1, 0)]), float(nodes_s[min(end, nodes_s.size - 1)])


def _innovations(case: Case, position: np.ndarray) -> np.ndarray:
    """Whitened residual (nodes, 9) with nuisances at their best."""
    whitened = case.whitened([], position, keep=len(case.nuisances) + 1)
    best = np.linalg.solve(np.eye(len(case.nuisances)) + whitened.normal, whitened.projection)
    return whitened.kept[..., 0] - whitened.kept[..., 1:] @ best


def _widened(found: Mismatch) -> Column:
    """The column of a mismatch with a prior that leaves it free."""
    wide = max(WIDEST_SIZES, WIDEST_FOUND * abs(found.size))
    return replace(
        found.column,
        terms=tuple(term._replace(weight=wide * term.weight) for term in found.column.terms),
        start=tuple(wide * x for x in found.column.start),
    )


def channel_of(name: str, axis: str | None) -> str:
    """The channel in which an effect of this name lives."""
    sensor = name.partition(".")[0]
    if sensor in ("accelerometer", "gyro"):
        return f"{sensor}.{axis}"
    if sensor in ("alignment", "earth"):
        return "navigation"
    if sensor == "reference":
        return "reference.attitude"
    return {"gps.lever_arm": "gps.position", "temperature.lag": "temperature"}.get(name, "gps.velocity")
