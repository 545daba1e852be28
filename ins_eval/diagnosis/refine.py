"""The finalist once more: its times, widths and lags where the data put them, and the recordings navigated with it.

First-order responses hold while an effect is small. So what was found is taken off in the full mechanization, the
residual and all columns are made anew around it, and what was taken off is added back to the sums linearly, so that
every prior stays around the belief. Done until the coefficients stay; then they and their intervals are those of the
nonlinear problem (Gauss-Newton).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ins_eval.diagnosis.case import Case
from ins_eval.diagnosis.library import Candidate
from ins_eval.diagnosis.noise import Fitted, NoiseModel
from ins_eval.diagnosis.search import log_bayes_factor, posterior
from ins_eval.diagnosis.study import Hypothesis, fit_noise, sums
from ins_eval.effects.effect import Parameter
from ins_eval.effects.lag import NAME as LAG
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.recording.belief import EffectBelief

TURNS = 3  # times that the recordings are navigated at most
SAME, SAME_S, SAME_SHARE = 0.02, 2.0, 0.05
STEADY = 0.3  # sigmas that a coefficient may still move
ZOOMS = (1.0, 0.3, 0.1)  # half width of the values tried, in steps of the first grid
VALUES = 9  # tried in each
FAR = 4.5  # nats below the best at which the interval of a time or width is looked for no further
WIDER = 1.6
FURTHER, STEEP = 4, 1.0  # more zooms where the best stands more than so many nats above its neighbours
Q95 = 1.96
PLACED = 0.03  # of the prior with which a lag is searched for: a placed one has the size for which its column is made


@dataclass(frozen=True, eq=False)
class RefinedFit:
    """Recordings navigated with the finalist, and where.

    `model` its effects with columns around that point, `point` (k,) their coefficients there, `spread` the 95 %
    interval of each time, width and lag of each effect, `bent` (k,) the variance that all of these add to each
    coefficient.
    """

    cases: tuple[Case, ...]
    model: tuple[Hypothesis, ...]
    point: np.ndarray
    fitted: tuple[Fitted, ...]
    spread: tuple[dict[str, tuple[float, float]], ...]
    bent: np.ndarray


def refine(cases: Sequence[Case], model: Sequence[Hypothesis], fitted: Sequence[Fitted]) -> RefinedFit:
    """Gauss-Newton on the effects of `model`, from what was found without it."""
    original = tuple(cases)
    model = tuple(again(one, original) for one in model)  # they may come from other navigated recordings
    point, fitted = np.zeros(len(model)), tuple(fitted)
    cases, fixed = original, np.array([one.candidate.name.startswith("earth.") for one in model])
    noise = [case.noise for case in original]  # what is white is read off once: else no two fits could be compared
    if fixed.any():  # there is nothing between a term that is there and one that is not
        point = np.where(fixed, [one.candidate.centre for one in model], 0.0)
        cases, model = _navigated(original, model, point)
        noise = [case.noise for case in cases]
        fitted = tuple(fit_noise(cases, model, [one.noise_point for one in fitted]))
    for _ in range(TURNS):
        moved = list(model)
        for k in range(len(model)):
            moved[k], _, _ = _placed(cases, moved, k, fitted, model, point)
        mean, sigma = _estimate(cases, moved, fitted, model, point)
        same = all(_alike(a, b) for a, b in zip(model, moved, strict=True))
        steady = same and bool((np.abs(mean - point) < STEADY * sigma)[~fixed].all())
        if steady:
            break
        model = tuple(moved)
        point = np.where(fixed, point, mean)
        cases, model = _navigated(original, model, point, noise)
    scaled = [one.scaled(max(1.0, abs(float(p)))) for one, p in zip(model, point, strict=True)]
    fitted = tuple(fit_noise(cases, scaled, [one.noise_point for one in fitted]))
    placed = [_placed(cases, model, k, fitted, model, point) for k in range(len(model))]  # at the noise of the answer
    bent = sum((one[2] for one in placed), np.zeros(len(model)))
    return RefinedFit(cases, model, point, fitted, tuple(one[1] for one in placed), bent)


def _navigated(
    original: Sequence[Case],
    model: Sequence[Hypothesis],
    point: np.ndarray,
    noise: Sequence[NoiseModel] | None = None,
) -> tuple[tuple[Case, ...], tuple[Hypothesis, ...]]:
    """The recordings with the effects of `model` taken off, with this `noise` or their own, and the effects around."""
    effects = [believed_effect(one, float(p), original) for one, p in zip(model, point, strict=True) if p != 0.0]
    cases = tuple(case.again(effects) for case in original)
    if noise is not None:
        cases = tuple(
            replace(case, noise=_same_white(case, before, one))
            for case, before, one in zip(cases, original, noise, strict=True)
        )
    return cases, tuple(again(one, cases) for one in model)


def _same_white(case: Case, before: Case, noise: NoiseModel) -> NoiseModel:
    """The `noise` of `before` for the nodes of `case`: a clock that is set right moves measurements along."""
    if case.noise.white.shape == noise.white.shape:
        return noise
    typical = []
    for one, white in ((before, noise.white), (case, case.noise.white)):
        known = np.where(np.isfinite(one.seen.residual), white, np.nan)
        typical.append([np.nanmedian(column) if np.isfinite(column).any() else 1.0 for column in known.T])
    level = np.divide(*typical)
    return replace(case.noise, priors=noise.priors, down=noise.down, white=case.noise.white * level)


def again(one: Hypothesis, cases: Sequence[Case], parameters: dict | None = None) -> Hypothesis:
    """The same effect, perhaps with other `parameters`, around the point at which `cases` were navigated.

    A lag has the sharp prior of one that is placed.
    """
    old = one.candidate
    chosen = old.parameters if parameters is None else parameters
    made: list[Candidate | None] = [
        None if had is None else case.member(old.name, old.axis, chosen)
        for had, case in zip(one.columns, cases, strict=True)
    ]
    found = Hypothesis(next(c for c in made if c is not None), tuple(None if c is None else c.column for c in made))
    if old.name != LAG:
        return found
    candidate = found.candidate
    placed = replace(candidate, nominal=PLACED * candidate.nominal, centre=candidate.centre / PLACED)
    return replace(found.scaled(PLACED), candidate=placed)


def believed_effect(one: Hypothesis, coefficient: float, cases: Sequence[Case]) -> EffectBelief:
    """An effect as a belief states it, of a hypothesis with its coefficient."""
    candidate = one.candidate
    value = coefficient * candidate.nominal
    known = {name: p for name, p in candidate.parameters.items() if name in EffectBelief.model_fields}
    local = None
    if candidate.local:
        local = next(case.name for case, column in zip(cases, one.columns, strict=True) if column is not None)
    if candidate.name.startswith("earth."):
        value = 1.0
    if candidate.name == LAG:
        value = max(value, 0.0)
    return EffectBelief(name=candidate.name, axis=candidate.axis, value=value, recording=local, **known)


def _sums(
    cases: Sequence[Case],
    asked: Sequence[Hypothesis],
    fitted: Sequence[Fitted],
    navigated: Sequence[Hypothesis],
    point: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """A (n, n) and b (n,) of the hypotheses `asked`, what was taken off added back with what it was taken off with."""
    n = len(asked)
    taken = np.append(np.zeros(n), point)
    here = sums(cases, [one.noise_point for one in fitted], [*asked, *navigated], taken)
    return here.normal[:n, :n], here.projection[:n]


def _estimate(
    cases: Sequence[Case],
    model: Sequence[Hypothesis],
    fitted: Sequence[Fitted],
    navigated: Sequence[Hypothesis],
    point: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    a, b = _sums(cases, model, fitted, navigated, point)
    centre = np.array([one.candidate.centre for one in model])
    _, scales = log_bayes_factor(a, b, centre)
    mean, covariance = posterior(a, b, centre, scales)
    return mean, np.sqrt(np.diag(covariance))


def _alike(a: Hypothesis, b: Hypothesis) -> bool:
    """Whether times, widths and lags have stayed: an instant to `SAME_S`, a share to `SAME_SHARE`, others to `SAME`."""
    least = {"at_s": SAME_S, "branch_begin": SAME_SHARE}
    for name, x in a.candidate.parameters.items():
        if isinstance(x, float | int):
            y = float(b.candidate.parameters[name])
            if abs(x - y) > least.get(name, SAME * abs(x)):
                return False
    return True


def _placed(
    cases: Sequence[Case],
    model: Sequence[Hypothesis],
    k: int,
    fitted: Sequence[Fitted],
    navigated: Sequence[Hypothesis],
    point: np.ndarray,
) -> tuple[Hypothesis, dict[str, tuple[float, float]], np.ndarray]:
    """Effect `k` with the values of its further parameters that the sums like best, and their 95 % intervals.

    And the variance (k,) that not knowing them adds to the coefficient of each effect.
    """
    one = model[k]
    parameters = [p for p in VOCABULARY[one.candidate.name].parameters if p.name in one.candidate.parameters]
    spread: dict[str, tuple[float, float]] = {}
    bent = np.zeros(len(model))
    for parameter in parameters:
        others = [*model[:k], one, *model[k + 1 :]]
        one, spread[parameter.name], added = _along(cases, others, k, parameter, fitted, navigated, point)
        bent += added
    return one, spread, bent


def _along(
    cases, model, k, parameter: Parameter, fitted, navigated, point
) -> tuple[Hypothesis, tuple[float, float], np.ndarray]:
    one = model[k]
    r = next(i for i, column in enumerate(one.columns) if column is not None)
    start_s, end_s = (float(cases[r].model.nodes_s[i]) for i in (0, -1))
    grid = parameter.grid(start_s, end_s)
    logs = parameter.low is not None and not parameter.even
    to, back = (np.log, np.exp) if logs else (np.asarray, np.asarray)
    step = float(np.diff(to(grid))[0])
    bounds = (start_s + 1.0, end_s - 1.0) if parameter.low is None else (parameter.low, parameter.high)
    low, high = (float(to(x)) for x in bounds)
    tried: dict[float, float] = {}
    means: dict[float, np.ndarray] = {}
    made: dict[float, Hypothesis] = {}
    centre = float(to(one.candidate.parameters[parameter.name]))
    half = step
    for zoom in ZOOMS:
        half = step * zoom
        values = np.unique(np.clip(centre + half * np.linspace(-1.0, 1.0, VALUES), low, high))
        _try(cases, model, k, parameter.name, values, back, fitted, navigated, point, tried, means, made)
        centre = max(tried, key=tried.__getitem__)
    for _ in range(FURTHER):
        if not _steep(tried, centre):
            break
        half *= ZOOMS[1]
        values = np.unique(np.clip(centre + half * np.linspace(-1.0, 1.0, VALUES), low, high))
        _try(cases, model, k, parameter.name, values, back, fitted, navigated, point, tried, means, made)
        centre = max(tried, key=tried.__getitem__)
    half = step * ZOOMS[-1]
    while half < 30.0 * step and _open(tried, low, high):
        half *= WIDER
        values = np.unique(np.clip(centre + half * np.array([-1.0, 1.0]), low, high))
        _try(cases, model, k, parameter.name, values, back, fitted, navigated, point, tried, means, made)
        centre = max(tried, key=tried.__getitem__)
    places = np.array(sorted(tried))
    heights = np.array([tried[x] for x in places])
    fine = np.linspace(places[0], places[-1], 2001)
    density = np.exp(np.interp(fine, places, heights) - heights.max())
    part = np.cumsum(density) / density.sum()
    ends = fine[np.searchsorted(part, [0.025, 0.975])]
    reach = np.hypot(np.maximum((ends - centre) * [-1.0, 1.0], 0.0), Q95 * parameter.form)
    ends = np.clip(centre + reach * [-1.0, 1.0], low, high)
    bent = np.empty(len(model))
    for j, coefficients in enumerate(np.transpose([means[x] for x in places])):
        mean = np.interp(fine, places, coefficients)
        below, at, above = np.interp(centre + parameter.form * np.array([-1.0, 0.0, 1.0]), places, coefficients)
        bent[j] = np.average((mean - np.average(mean, weights=density)) ** 2, weights=density)
        bent[j] += max(abs(above - at), abs(at - below)) ** 2
    return made[centre], tuple(float(x) for x in back(ends)), bent


def _steep(tried: dict[float, float], centre: float) -> bool:
    """Whether both values beside the best one are so much worse that its 95 % interval lies between them."""
    places = sorted(tried)
    i = places.index(centre)
    return all(tried[x] < tried[centre] - STEEP for x in places[max(i - 1, 0) : i + 2] if x != centre)


def _open(tried: dict[float, float], low: float, high: float) -> bool:
    """Whether an end of the tried range is still probable without being an end of the possible range."""
    best, first, last = max(tried.values()), min(tried), max(tried)
    return (tried[first] > best - FAR and first > low) or (tried[last] > best - FAR and last < high)


def _try(cases, model, k, name, values, back, fitted, navigated, point, tried, means, made) -> None:
    """Evidence of the model with each value in the place of that of effect `k`, and its coefficients."""
    fresh = [float(x) for x in values if float(x) not in tried]
    if not fresh:
        return
    old = model[k].candidate.parameters
    variants = [again(model[k], cases, {**old, name: float(back(x))}) for x in fresh]
    asked = [*(one for j, one in enumerate(model) if j != k), *variants]
    own = len(asked) - len(fresh)
    normal, projection = _sums(cases, asked, fitted, navigated, point)
    centre = np.array([one.candidate.centre for one in asked])
    for j, x in enumerate(fresh):
        m = [*range(own), own + j]
        a, b = normal[np.ix_(m, m)], projection[m]
        tried[x], scales = log_bayes_factor(a, b, centre[m])
        mean, _ = posterior(a, b, centre[m], scales)
        means[x] = np.insert(mean[:-1], k, mean[-1] * variants[j].candidate.nominal / model[k].candidate.nominal)
        made[x] = variants[j]
