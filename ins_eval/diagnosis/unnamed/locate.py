"""Which channel, and when: a scan of every interval of every channel, and how sure, with all of them searched.

A disturbance that is constant over an interval of a channel is the sum of the columns of the windows in it, so all
intervals of all channels follow from one A and b: with sums a and b over the interval,

    t^2 = b^2 / a,   the generalised likelihood ratio for a disturbance of unknown size (twice its logarithm).

The largest of thousands of correlated t^2 is judged against the largest of draws b* ~ N(0, A), which is what the null
makes of the same columns; beyond the draws the tail is that of N independent chi^2 with one degree of freedom, N from
their 95 % quantile.

Sources: Willsky and Jones 1976 (the ratio for unknown time and size); Davies, Biometrika 74 (1987) 33 (a parameter
that exists under the alternative only, so that the largest ratio has no chi^2 law).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numba
import numpy as np
from scipy.special import chdtrc, ndtri

from ins_eval.effects.parts import SENSORS
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.error_model.columns import Column, Drive, Measured, SlowFactor
from ins_eval.estimation.evidence import Reduced, reduce
from ins_eval.units import ARCSEC, DEG_PER_H, UG

if TYPE_CHECKING:
    from ins_eval.effects.effect import Effect
    from ins_eval.error_model.propagation import ErrorModel
    from ins_eval.estimation.case import Case

WINDOWS = 64
SHORTEST_WINDOW_S = 5.0
DRAWS = 400
FINER = 16
QUANTILE = 0.95
SIZES = {  # that the column of a window carries, of sensors whose bias is as usual
    "accelerometer": 20.0 * UG,
    "gyro": 0.02 * DEG_PER_H,
    "position": 1.0,
    "velocity": 0.02,
    "attitude": 10.0 * ARCSEC,
}


@dataclass(frozen=True)
class Channel:
    """A channel in which something may be wrong: `name` as the answer calls it, `axis` of body or of n."""

    name: str
    axis: str
    size: float
    row: int = -1  # among the measured channels, where it is one

    def column(self, slow: str) -> Column:
        """A disturbance of this channel that follows a slow factor."""
        if self.row < 0:
            kind = self.name.partition(".")[0]
            return Column(self.name, (Drive(kind, "xyz".index(self.axis), "1", self.size, slow),))
        return Column(self.name, (Measured(f"channel_{self.row}", self.size, slow),))


@dataclass(frozen=True)
class Interval:
    """A located disturbance: `t2` its ratio, `size` in sizes of its channel with `sigma`."""

    channel: Channel
    begin_s: float
    end_s: float
    t2: float
    size: float
    sigma: float

    def column(self, slow: SlowFactor, model: ErrorModel) -> Column:
        """The same as a column."""
        return self.channel.column(slow.add_window(self.begin_s, self.end_s, model))


@dataclass(frozen=True)
class Significance:
    """Tail of the largest ratio of a scan: that of the largest of `trials` independent ratios."""

    trials: float

    @property
    def finer(self) -> Significance:
        """The same where both ends of every interval are looked for to a `FINER`th of a window: at most so many."""
        return Significance(self.trials * FINER**2)

    def probability(self, t2: float) -> float:
        """Probability that noise alone gives so large a ratio anywhere in the scan."""
        one = chdtrc(1, t2)
        return float(-np.expm1(self.trials * np.log1p(-min(one, 1.0 - 1e-16))))

    def sigma(self, t2: float) -> float:
        """That probability as the one-sided deviate of a normal distribution; 0 for one above a half."""
        p = self.probability(t2)
        if p > 1e-12:
            return max(0.0, -float(ndtri(p)))
        return float(np.sqrt(t2 - 2.0 * np.log(self.trials)))  # far in the tail of both


def channels(case: Case) -> list[Channel]:
    """All channels of this recording; a sensor is disturbed as many times more than usual as its bias may be larger."""
    seen = case.seen
    sizes = {sensor: SIZES[sensor] * _coarse(case, VOCABULARY[f"{sensor}.bias"]) for sensor in SENSORS}
    if seen.sources[0].name == "chamber":
        axis = case.candidates[0].axis
        return [Channel(f"accelerometer.{axis}", axis, sizes["accelerometer"], 0)]
    out = [Channel(f"{sensor}.{axis}", axis, sizes[sensor]) for sensor in SENSORS for axis in "xyz"]
    if seen.sources[0].name == "standstill":
        return out
    measured = np.isfinite(seen.residual).any(axis=0)
    names = {source.name for source in seen.sources}
    for k, kind in enumerate(("position", "velocity", "attitude")):
        name = "reference.attitude" if kind == "attitude" else f"gps.{kind}" if "gps" in names else "navigation"
        out += [Channel(name, "NED"[j], SIZES[kind], 3 * k + j) for j in range(3) if measured[3 * k + j]]
    return out


def _coarse(case: Case, bias: Effect) -> float:
    """How many times the usual a bias of this unit may be; 1 of a sensor that a chamber does not have."""
    return next((one.nominal for one in case.candidates if one.name == bias.name), bias.nominal) / bias.nominal


def edges(model: ErrorModel) -> np.ndarray:
    """Where windows begin and end."""
    start_s, end_s = float(model.nodes_s[0]), float(model.nodes_s[-1])
    count = int(np.clip((end_s - start_s) / SHORTEST_WINDOW_S, 2, WINDOWS))
    out = np.linspace(start_s, end_s, count + 1)
    out[-1] += 1e-3  # the last node is inside
    return out


def windows(channel: Channel, edges_s: np.ndarray, slow: SlowFactor, model: ErrorModel) -> Iterator[Column]:
    """One column a window of a channel."""
    for begin_s, end_s in zip(edges_s[:-1], edges_s[1:], strict=True):
        yield channel.column(slow.add_window(float(begin_s), float(end_s), model))


def scan(reduced: Reduced, over: list[Channel], edges_s: np.ndarray) -> list[Interval]:
    """The best interval of each channel, best first; the columns are the windows of each channel in turn."""
    count = edges_s.size - 1
    found = []
    for k, channel in enumerate(over):
        part = slice(k * count, (k + 1) * count)
        a, b = reduced.normal[part, part], reduced.projection[part]
        t2, i, j, sum_a, sum_b = _best(a, b)
        if i >= 0:
            size, sigma = sum_b / sum_a, 1.0 / np.sqrt(sum_a)
            found.append(Interval(channel, float(edges_s[i]), float(edges_s[j]), t2, size, sigma))
    return sorted(found, key=lambda one: -one.t2)


def significance(reduced: Reduced, count: int, rng: np.random.Generator) -> Significance:
    """Number of independent ratios whose largest has the tail of this scan's; `count` windows a channel."""
    values, vectors = np.linalg.eigh(reduced.normal)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    draws = rng.standard_normal((DRAWS, root.shape[1])) @ root.T
    largest = np.zeros(DRAWS)
    for part in range(0, reduced.normal.shape[0], count):
        a = np.ascontiguousarray(reduced.normal[part : part + count, part : part + count])
        largest = np.maximum(largest, _largest(a, np.ascontiguousarray(draws[:, part : part + count])))
    return Significance(float(np.log(QUANTILE) / np.log1p(-chdtrc(1, np.quantile(largest, QUANTILE)))))


@numba.njit(cache=True)
def _best(a, b):
    """Largest ratio over all intervals [i, j), and the sums there; an interval that the data do not see is skipped."""
    n = b.size
    total = np.trace(a)
    best, at_i, at_j, best_a, best_b = 0.0, -1, -1, 0.0, 0.0
    for i in range(n):
        sum_a, sum_b = 0.0, 0.0
        for j in range(i, n):
            sum_b += b[j]
            sum_a += a[j, j]
            for k in range(i, j):
                sum_a += 2.0 * a[k, j]
            if sum_a > 1e-6 * total and sum_b * sum_b > best * sum_a:
                best, at_i, at_j, best_a, best_b = sum_b * sum_b / sum_a, i, j + 1, sum_a, sum_b
    return best, at_i, at_j, best_a, best_b


@numba.njit(cache=True)
def _largest(a, draws):
    n = a.shape[0]
    total = np.trace(a)
    out = np.zeros(draws.shape[0])
    sum_b = np.empty(draws.shape[0])
    for i in range(n):
        sum_a = 0.0
        sum_b[:] = 0.0
        for j in range(i, n):
            sum_a += a[j, j]
            for k in range(i, j):
                sum_a += 2.0 * a[k, j]
            for d in range(draws.shape[0]):
                sum_b[d] += draws[d, j]
            if sum_a > 1e-6 * total:
                for d in range(draws.shape[0]):
                    t2 = sum_b[d] * sum_b[d] / sum_a
                    if t2 > out[d]:
                        out[d] = t2
    return out


def refined(case, interval: Interval, noise_point: np.ndarray) -> Interval:
    """The same with ends to a sixteenth of a window: all ends near those found, with noise at `noise_point`."""
    step_s = np.diff(edges(case.model))[0]
    low, high = float(case.model.nodes_s[0]), float(case.model.nodes_s[-1]) + 1e-3
    around = np.linspace(-1.0, 1.0, 2 * FINER + 1) * step_s
    begins = np.clip(interval.begin_s + around, low, high)
    ends = np.clip(interval.end_s + around, low, high)
    fine = np.unique(np.round(np.concatenate([begins, ends]), 3))
    fine = fine[np.append(True, np.diff(fine) > 0.5)]
    columns = list(windows(interval.channel, fine, case.slow, case.model))
    reduced = reduce(case.whitened(columns, noise_point, case.blocks), len(case.nuisances))
    best = scan(reduced, [interval.channel], fine)
    return best[0] if best else interval
