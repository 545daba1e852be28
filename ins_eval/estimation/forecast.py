"""What recordings tell of every persistent error of the sensors at once: the posterior of an instrument's next flights.

All effects of accelerometers and gyros are free together, each with a normal prior of the size that this grade has, and
what belongs to a day (turn-on biases, start, the branch on which a magnet begins) is integrated out:

    p(c) = N(0, S),   E[c] = (A + S^-1)^-1 b,   Cov[c] = (A + S^-1)^-1

with A, b the reduced sums of all recordings. Of a law with a time or a width the values of the grid stand side by side,
each with its part of the variance of the prior: a mean over times and widths, and memory of several times at once. So
every effect takes its part of what was seen, small ones are shrunk and none is cut. Effects that were named have priors
wide enough for what they were found to be (`WITHIN_PRIOR` sigmas); those that are not of a sensor, or of one recording
only, are free beside the others.

The noise is that of the maximum of the evidence with all these effects free: the wander of a sensor is then only what
no effect accounts for. The prior of each effect is larger or smaller than usual by a factor at the maximum of the
evidence, the product of three that are log-normal: one of its kind, offsets of a sensor or errors that follow what it
feels, one of its name, and one of its name on its axis. For a sensor whose errors are small where they show is a finer
one, and small where they do not: a flight tells next to nothing of what gravity drives in a gyro, and under a prior
that is too wide it takes the offset that a switch-on drew over to the next. The third is of coarse units alone: three
equal sensors are mounted in others, while across a chip a micromechanical sensor is built otherwise than along it, and
may follow temperature ten times as much. A constant bias has no factor: a calibration leaves of it what a mean over
`CALIBRATED_RUNS` switch-ons leaves, and one or two recordings, each with a switch-on of its own, do not show it to be
more. One recording may differ from the next in each coefficient by `OF_DAY` of its prior; that part is integrated out
of each.

Sources: MacKay, Neural Computation 4 (1992) 415 (evidence of the sizes of priors); Bishop 2006, Pattern Recognition and
Machine Learning, 3.3 to 3.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.optimize import minimize

from ins_eval.effects.composed import NAME as COMPOSED
from ins_eval.effects.parts import SENSORS
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.error_model.columns import Measured
from ins_eval.error_model.library import PROPORTIONAL
from ins_eval.error_model.null import is_coarse
from ins_eval.estimation.study import Hypothesis, fit_noise, of_case, union, wide

if TYPE_CHECKING:
    from ins_eval.error_model.columns import Column
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.noise_fit import Fitted

BEGIN, BIAS = "branch_begin", "bias"
FACTOR_SPREAD = 1.0  # of the logarithm of the factor by which effects of a name are larger than usual
COMMON = 0.5  # of the variance of that logarithm, which all effects of a kind share; by reasoning
# Of the logarithm by which it differs from axis to axis of a coarse unit: by reasoning. The accelerometers of a parked
# MEMS unit follow temperature by 885, 174 and 2 ug/degC; the logarithms of the first two differ by 1.6, of two axes at
# one sigma by 1.4.
AXIS_SPREAD = 1.0
WITHIN_PRIOR = 3.0  # sigmas of its prior within which an effect that was named lies
WANDER = ("accelerometer_wander", "gyro_wander")
# Over which a calibrated constant is a mean: the two positions of Paper A that tell a bias, equation (14), at each of
# four rates of temperature, section 3.1, steps 5 and 6. Each is a run of its own.
CALIBRATED_RUNS = 8.0
LEAST = 1e-3  # nominal sizes of a bias that is said to be exact
FINEST = 0.1  # of usual sizes: what a bias that is said to be exact tells of other errors, by reasoning
OF_DAY = 0.1  # of a prior's sigma, by which a coefficient differs from one recording to the next; by reasoning


@dataclass(frozen=True, eq=False)
class Forecast:
    """Effects of the sensors with the posterior of their values.

    `effects` (k,) hypotheses, `mean` (k,) of their coefficients in nominal sizes and `root` (k, k) of its covariance.
    """

    effects: tuple[Hypothesis, ...]
    mean: np.ndarray
    root: np.ndarray


@dataclass(frozen=True, eq=False)
class Pool:
    """The persistent effects of the sensors and what is free beside them, each at one sigma of its prior.

    `persistent` (k,) hypotheses with `sigma` (k,) of their priors in nominal sizes and `taken` (k,), what of them was
    taken off before the recordings were navigated, in the same; `beside` what is of one recording or of no sensor.
    `axis_spread` is that of the logarithm by which sizes of one name differ from axis to axis.
    """

    persistent: tuple[Hypothesis, ...]
    sigma: np.ndarray
    taken: np.ndarray
    beside: tuple[Hypothesis, ...]
    axis_spread: float = 0.0

    @property
    def columns(self) -> list[Hypothesis]:
        own = [one.scaled(s) for one, s in zip(self.persistent, self.sigma, strict=True)]
        return [*own, *self.beside]


def forecast(
    cases: Sequence[Case], starts: Sequence[Fitted | None], named: Sequence[tuple[Hypothesis, float, float]] = ()
) -> Forecast:
    """The posterior of all persistent effects of the sensors from recordings of one instrument.

    `named` are effects that were found, each with its coefficient and what of it was taken off before `cases` were
    navigated; `starts` noise from which that of each recording is sought.
    """
    of = pool(cases, named)
    if not of.persistent:
        return Forecast((), np.zeros(0), np.zeros((0, 0)))
    fitted = fit_noise(cases, of.columns, starts)
    quiet = [_quiet(case, one) for case, one in zip(cases, fitted, strict=True)]
    factor = np.exp(factors(of, *_sums(cases, of, quiet, np.ones(of.sigma.size))))
    fitted = fit_noise(cases, replace(of, sigma=of.sigma * factor).columns, quiet)
    a, b = _sums(cases, of, fitted, factor)
    found = posterior_of(a, b, np.exp(factors(of, a, b)))
    return Forecast(of.persistent, of.sigma * found.mean, of.sigma[:, None] * found.root)


def pool(cases: Sequence[Case], named: Sequence[tuple[Hypothesis, float, float]] = ()) -> Pool:
    """Every persistent effect that one of the recordings could show, those `named` among them."""
    found = [one for one in union(cases) if persistent(one)]
    members: dict[tuple, list[Hypothesis]] = {}
    for one in found:
        members.setdefault((one.key, one.candidate.parameters.get(BEGIN)), []).append(one)
    own, sigma, beside = [], [], []
    for (_, begin), alike in members.items():
        if begin not in (None, 0.0):
            continue
        for one in alike:
            own.append(one)
            sigma.append(_prior_sigma(one, cases) / np.sqrt(len(alike)))
            if begin is not None:
                beside += _begins(one, found, sigma[-1], cases)
    taken, place = [0.0] * len(own), {one.identity: k for k, one in enumerate(own)}
    for one, coefficient, off in named:
        wide_enough = max(1.0, abs(coefficient) / WITHIN_PRIOR)
        if not persistent(one):
            beside.append(one.scaled(wide_enough))
        elif (k := place.get(one.identity)) is not None:
            sigma[k], taken[k] = max(sigma[k], wide_enough), off
        else:
            own.append(one)
            sigma.append(wide_enough)
            taken.append(off)
    coarse = any(is_coarse(case.believed.recording.belief) for case in cases if case.believed is not None)
    spread = AXIS_SPREAD if coarse else 0.0
    return Pool(tuple(own), np.array(sigma), np.array(taken), tuple(beside), spread)


def persistent(one: Hypothesis) -> bool:
    """Whether an effect is of a sensor and stays with it from one recording to the next."""
    effect = VOCABULARY[one.candidate.name]
    return effect.enters in SENSORS and not effect.local and effect.name != COMPOSED


def _prior_sigma(one: Hypothesis, cases: Sequence[Case]) -> float:
    """One sigma of the prior in nominal sizes; of a constant bias that of a mean over a few turn-ons.

    Of a unit whose stated bias is smaller than the usual one, all but scale factors and misalignments are as many times
    smaller, as those of a coarser unit are larger (`library.sized`). Usual sizes would take a part of the offset that
    a switch-on drew for one with temperature or with specific force, and carry it to the next.
    """
    sensor, _, what = one.candidate.name.partition(".")
    beliefs = [case.believed.recording.belief for case in cases if case.believed is not None]
    if not beliefs:
        return 1.0
    belief = getattr(beliefs[0], sensor)
    stated = float(belief.bias_sigma_ug if sensor == "accelerometer" else belief.bias_sigma_deg_per_h)
    if what == BIAS:
        return max(LEAST, stated / np.sqrt(CALIBRATED_RUNS) / one.candidate.nominal)
    if VOCABULARY[one.candidate.name].unit.startswith(PROPORTIONAL):
        return 1.0
    return float(np.clip(stated / VOCABULARY[f"{sensor}.{BIAS}"].nominal, FINEST, 1.0))


def _begins(one: Hypothesis, found: Sequence[Hypothesis], sigma: float, cases: Sequence[Case]) -> list[Hypothesis]:
    """What the branch on which a magnet begins adds in each flight and in each run of a chamber.

    Half of the difference of the two ends.
    """
    rest = {name: x for name, x in one.candidate.parameters.items() if name != BEGIN}
    ends = {
        float(other.candidate.parameters[BEGIN]): other
        for other in found
        if other.key == one.key and {n: x for n, x in other.candidate.parameters.items() if n != BEGIN} == rest
    }
    low, high = ends[min(ends)], ends[max(ends)]
    out = []
    for r, case in enumerate(cases):
        if high.columns[r] is None:
            continue
        up, down = wide(high.columns[r], 0.5 * sigma), wide(low.columns[r], -0.5 * sigma)
        whole = replace(up, terms=(*up.terms, *down.terms))
        for own in [whole] if case.believed is not None else _of_each_run(case, whole):
            columns: list[Column | None] = [None] * len(cases)
            columns[r] = own
            out.append(Hypothesis(one.candidate, tuple(columns)))
    return out


def _of_each_run(case: Case, column: Column) -> list[Column]:
    """What a `column` of a chamber recording is in each of its runs alone; each run has a constant of its own there."""
    slow, out = case.slow, []
    for constant in case.nuisances:
        (window,) = (term.slow for term in constant.terms if isinstance(term, Measured))
        terms = []
        for term in column.terms:
            if isinstance(term, Measured):
                name = f"{term.slow} in {window}"
                slow.nodes[name] = slow.nodes[window] * slow.nodes[term.slow]
                slow.epochs[name] = np.zeros(slow.nodes[name].size - 1)
                terms.append(term._replace(slow=name))
        out.append(replace(column, terms=tuple(terms)))
    return out


def shared(of: Pool) -> np.ndarray:
    """Logarithms of the factors of the priors (k,) by independent standard normal numbers (m,): a matrix (k, m).

    One number for each kind, one for each name with every axis and every time, and one for each name on each axis; none
    for a constant bias.
    """
    names = [one.candidate.name for one in of.persistent]
    kinds = [f"{name.partition('.')[0]} {VOCABULARY[name].multipliers == ('1',)}" for name in names]
    axes = [f"{one.candidate.name} {one.candidate.axis}" for one in of.persistent]

    def of_each(what: Sequence[str], spread: float) -> np.ndarray:
        return spread * np.equal.outer(np.array(what), np.array(sorted(set(what)))).astype(float)

    constant = np.array([name.partition(".")[2] == BIAS for name in names])
    by_number = np.hstack([
        of_each(kinds, FACTOR_SPREAD * np.sqrt(COMMON)),
        of_each(names, FACTOR_SPREAD * np.sqrt(1.0 - COMMON)),
        of_each(axes, of.axis_spread),
    ])  # fmt: skip
    return np.where(constant[:, None], 0.0, by_number)


def lessened(a: np.ndarray, b: np.ndarray, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A and b of one recording once a part of its own of each coefficient, of that `variance` (k,), is integrated out.

    A' = A (I + V A)^-1,   b' = (I + A V)^-1 b
    """
    inverse = np.linalg.inv(np.eye(b.size) + a * variance)
    out = inverse @ a
    return 0.5 * (out + out.T), inverse @ b


class Posterior(NamedTuple):
    """Of coefficients with normal priors: log B of all against none, their mean (k,) and a root of its covariance."""

    nats: float
    mean: np.ndarray
    root: np.ndarray


def posterior_of(a: np.ndarray, b: np.ndarray, sigma: np.ndarray) -> Posterior:
    """The posterior of coefficients with priors N(0, sigma^2), by the eigenvalues of S A S.

    Rounding makes some of them negative, and a wide prior enlarges these: what no column tells is 0.
    """
    values, vectors = np.linalg.eigh(sigma[:, None] * a * sigma)
    more = 1.0 + np.maximum(values, 0.0)
    right = vectors.T @ (sigma * b)
    nats = 0.5 * float((right**2 / more).sum() - np.log(more).sum())
    return Posterior(nats, sigma * (vectors @ (right / more)), sigma[:, None] * (vectors / np.sqrt(more)))


def lower(root: np.ndarray) -> np.ndarray:
    """The lower triangular root (k, k) of the covariance of which this is any `root`, with a diagonal >= 0."""
    _, upper = np.linalg.qr(root.T)
    return upper.T * np.where(np.diag(upper) < 0.0, -1.0, 1.0)


def _quiet(case: Case, fitted: Fitted) -> Fitted:
    """The noise with sensors that wander no more than is usual: what the size of effects is to explain first."""
    loud = np.isin(case.noise.free, WANDER)
    return replace(fitted, noise_point=np.where(loud, np.minimum(fitted.noise_point, 0.0), fitted.noise_point))


def _sums(
    cases: Sequence[Case], of: Pool, fitted: Sequence[Fitted], factor: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A (k, k) and b (k,) of the persistent effects at one sigma each, what is new in each recording integrated out.

    What is new is `OF_DAY` of the priors as they are once each is larger by its `factor` (k,).
    """
    columns, k = of.columns, len(of.persistent)
    a, b = np.zeros((k, k)), np.zeros(k)
    for r, (case, one) in enumerate(zip(cases, fitted, strict=True)):
        here = of_case(case, r, one.noise_point, columns, False)
        normal, projection = _without(here.normal, here.projection, k)
        projection = projection + normal @ (of.taken / of.sigma)
        normal, projection = lessened(normal, projection, (OF_DAY * factor) ** 2)
        a, b = a + normal, b + projection
    return a, b


def factors(of: Pool, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Logarithm (k,) of the factor of each prior at the maximum of the evidence, see `shared`.

    With s the sigma of a prior,  d log B / d log s = E[c^2] / s^2 - 1.
    """
    by_number = shared(of)
    usual = posterior_of(a, b, np.ones(b.size)).nats  # against which the search sees when it no longer gains

    def down(numbers: np.ndarray) -> tuple[float, np.ndarray]:
        sigma = np.exp(by_number @ numbers)
        nats, mean, root = posterior_of(a, b, sigma)
        slope = ((mean**2 + (root**2).sum(axis=1)) / sigma**2 - 1.0) @ by_number
        return 0.5 * float(numbers @ numbers) - (nats - usual), numbers - slope

    return by_number @ minimize(down, np.zeros(by_number.shape[1]), jac=True, method="L-BFGS-B").x


def _without(a: np.ndarray, b: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray]:
    """A and b of the first `k` columns once the others, each with a standard normal prior, are integrated out."""
    if b.size == k:
        return a, b
    across = np.linalg.solve(np.eye(b.size - k) + a[k:, k:], a[k:, :k])
    return a[:k, :k] - a[:k, k:] @ across, b[:k] - across.T @ b[k:]
