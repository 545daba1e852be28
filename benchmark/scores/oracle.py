"""How well a case could be solved by one who knows its noise: log Bayes factors of the truth and of its rivals.

The realised errors of the recording and every candidate are inputs of the same linear error dynamics, whitened with
the true noise; start attitude and turn-on biases are marginalised with their true spread, the size of an effect with
a mixture of Gaussians about the nominal size of its name, cut at zero where nature has one sign only. What is hidden
has the column that it makes at its own size, rivals that at the nominal one.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import log_ndtr, logsumexp

from benchmark.scores.whitened import Moving, chamber_whitened
from benchmark.worlds.effects import AXES, DESCRIPTION, OF_ONE_SIGN, VOCABULARY, Effect
from benchmark.worlds.outside import FORMS, Outside, Window

SCALES = (0.1, 0.3, 1.0, 3.0, 10.0)  # of the nominal size
STEP_EVERY_S = 600.0
NEAR = 5.0  # nats by which a rival may be worse that is listed
OF_VIBRATION = "accelerometer.vibration_rectification"
TWIN = 9.0  # of chi-square that a twin at its best size may leave more than the truth: 3 sigma


def library(seconds: float, with_steps: bool = True) -> list[Effect]:
    """Every name on every axis at its nominal size, hyper-parameters on a grid."""
    out = []
    for name, row in VOCABULARY.items():
        if row.target == DESCRIPTION:
            continue
        grid: list[dict] = [{}]
        if name.endswith("creep"):
            grid = [{"time_constant_s": float(t), "law": "one"} for t in np.geomspace(300, 10000, 6)]
        elif name.endswith("hysteresis"):
            grid = [{"branch_width_c": float(w), "begin": 0.0} for w in np.geomspace(0.5, 9.0, 6)]
        elif name.endswith("step"):
            grid = [{"at_s": float(t)} for t in np.arange(300.0, seconds - 200.0, STEP_EVERY_S)] if with_steps else []
        for axis in row.axes:
            if "misalignment" in name and not name.startswith("reference"):
                grid = [{"other_axis": other} for other in AXES if other != axis]
            elif "g_sensitivity" in name:
                grid = [{"other_axis": other} for other in AXES]
            out += [Effect(name, axis, row.nominal, dict(one)) for one in grid]
    return out


def jumps_at(instants_s: list[float]) -> list[Effect]:
    """Every name that jumps, on every axis at its nominal size, at these instants that the grid of `library` misses."""
    rows = [row for row in VOCABULARY.items() if row[0].endswith("step") and row[1].target != DESCRIPTION]
    return [Effect(name, axis, row.nominal, {"at_s": t}) for name, row in rows for axis in row.axes for t in instants_s]


def can_be_stated(effect: Effect, case) -> bool:
    """What is defined by a recorded column is no explanation where no recording has it."""
    return effect.name != OF_VIBRATION or any("vibration_rms_g" in made.tables.get("imu", ()) for made in case.made)


def family(effect) -> tuple:
    """What counts as one explanation: name, axis and other axis, whatever the hyper-parameters."""
    return effect.name, effect.axis, effect.parameters.get("other_axis")


def nominal(effect):
    """The same effect at the size on which its prior rests."""
    if isinstance(effect, Effect):
        return Effect(effect.name, effect.axis, VOCABULARY[effect.name].nominal, effect.parameters)
    if isinstance(effect, Outside):
        return Outside(effect.name, effect.axis, FORMS[effect.name][2], effect.parameters, effect.shown)
    size = {"a": 60.0, "g": 0.06}[effect.channel[0]]
    return Window(effect.channel, effect.axis, size, effect.from_share, effect.length_s)


def of_one_sign(effects) -> np.ndarray:
    """Whether the size of each effect (m,) cannot be negative."""
    return np.array([isinstance(one, Effect) and one.name in OF_ONE_SIGN for one in effects])


def summed(case, effects) -> tuple[np.ndarray, np.ndarray]:
    """A (m, m) and b (m,) of the columns of effects at the sizes that they have, over the recordings of a case."""
    a = b = 0.0
    for made in case.made:
        sheet, true = case.unit.sheet, case.unit.noise
        if made.kind == "chamber":
            whitened = chamber_whitened(made, sheet, true, effects)
        else:
            whitened = Moving(made, sheet, true).whitened(effects)
        one = reduced(*whitened)
        a, b = a + one[0], b + one[1]
    return a, b


def reduced(data, candidates, nuisances):
    """A (m, m) and b (m,) of the candidates, nuisances of unit spread marginalised; and what is left of the data."""
    a, c = candidates.T @ candidates, candidates.T @ nuisances
    inner = np.linalg.inv(nuisances.T @ nuisances + np.eye(nuisances.shape[1]))
    d = nuisances.T @ data
    return a - c @ inner @ c.T, candidates.T @ data - c @ inner @ d, float(data @ data - d @ inner @ d)


def evidence(a, b, sharp, positive):
    """Log Bayes factor of each single column, (m,); sharp ones have the coefficient 1, positive ones none below 0."""
    free = evidence_sets(a, b, np.arange(len(b))[:, None], positive)
    return np.where(sharp, b - 0.5 * np.diag(a), free)


def evidence_sets(a, b, sets, positive):
    """Log Bayes factor (n,) of each set of columns, the rows of `sets` (n, k); one scale for all of a set.

    Of two positive ones in a set each is cut by itself.
    """
    inner, fit, cut = a[sets[:, :, None], sets[:, None, :]], b[sets], positive[sets]
    out = []
    for s in SCALES:
        covariance = np.linalg.inv(inner + s**-2.0 * np.eye(sets.shape[1]))
        mean = np.einsum("nij,nj->ni", covariance, fit)
        sigmas = mean / np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        gain = 0.5 * np.einsum("nk,nk->n", fit, mean) + 0.5 * np.linalg.slogdet(covariance / s**2)[1]
        out.append(gain + np.where(cut, _above_zero(sigmas), 0.0).sum(axis=1))
    return logsumexp(out, axis=0) - math.log(len(SCALES))


def _above_zero(sigmas):
    """What a prior gains that has the half above zero only, of posteriors so many sigmas above it."""
    return math.log(2.0) + log_ndtr(sigmas)


def beside(a, b, hidden, keys, positive) -> list[dict]:
    """Of each of several hidden effects, the first columns: how clear it is where the others may have any size.

    `sigma` is its size over what is left uncertain of it, `rivals` what may stand in its place, the others kept, with
    the nats by which that is worse. `keys` are the families of the other columns, `positive` whether the size of a
    column cannot be negative.
    """
    m, gain = len(hidden), float(evidence_sets(a, b, np.arange(len(hidden))[None], positive)[0])
    free = np.sqrt(np.diag(np.linalg.inv(a[:m, :m] + 1e-9 * np.eye(m))))
    taken = {family(one) for one in hidden}
    found = []
    for k, one in enumerate(hidden):
        sets = np.array([[j if i == k else i for i in range(m)] for j in range(m, len(b))])
        margins: dict[tuple, float] = {}
        for key, height in zip(keys, evidence_sets(a, b, sets, positive), strict=True):
            margins[key] = min(margins.get(key, np.inf), gain - float(height))
        near = sorted((margin, key) for key, margin in margins.items() if margin < NEAR and key not in taken)
        found.append({
            "effect": _words(family(one)), "sigma": abs(one.value / VOCABULARY[one.name].nominal) / free[k],
            "rivals": [{"rival": _words(key), "margin": margin} for margin, key in near],
        })  # fmt: skip
    return found


def twins(a, b, families: list[tuple], sharp, positive) -> set[tuple]:
    """Families of the columns (m,) that at any size that they can have fit as well as column 0, which is the truth.

    A column of size x leaves y'y - 2 b x + a x^2 of chi-square; a twin at most `TWIN` more than the truth at its best.
    """
    free = np.where(positive, np.maximum(b, 0.0), b) / np.maximum(np.diag(a), 1e-300)
    size = np.where(sharp, 1.0, free)
    gains = 2.0 * b * size - np.diag(a) * size**2
    return {family for family, gain in zip(families, gains, strict=True) if gain >= gains[0] - TWIN} - {families[0]}


def judge(case) -> dict:
    """The oracle's numbers of a case, for its truth file."""
    hidden = case.hidden
    seconds = max((made.felt.time_s[-1] for made in case.made if made.felt is not None), default=7200.0)
    with_steps = len(case.made) == 1 and case.made[0].felt is not None
    candidates = [one for one in library(seconds, with_steps) if can_be_stated(one, case)]
    grid = len(candidates)
    instants_s = [one.parameters["at_s"] for one in hidden if isinstance(one, Effect) and "at_s" in one.parameters]
    candidates += jumps_at(instants_s) if with_steps else []
    m = len(hidden)
    every, keys = [*hidden, *candidates], [family(one) for one in candidates]
    share = np.array([one.value / nominal(one).value for one in hidden])
    per_nominal = np.append(1.0 / share, np.ones(len(candidates)))  # columns of what is hidden count in nominal sizes
    a, b = summed(case, every)
    a, b = a * np.outer(per_nominal, per_nominal), b * per_nominal
    sharp = np.array([hasattr(one, "name") and one.name.startswith("earth.") for one in every])
    positive = of_one_sign(every)
    single = evidence(a, b, sharp, positive)
    groups: dict[tuple, list[int]] = {}
    for k, one in enumerate(candidates[:grid]):
        groups.setdefault(family(one), []).append(m + k)
    by_family = {key: float(logsumexp(single[rows]) - math.log(len(rows))) for key, rows in groups.items()}
    for k, one in enumerate(candidates[grid:], start=m + grid):  # at the instant of the truth, as the truth itself is
        by_family[family(one)] = max(by_family[family(one)], float(single[k]))
    truth = {family(one) for one in hidden if isinstance(one, Effect)}
    if not hidden:
        best = max(by_family, key=by_family.get)
        return {"log_bayes_factor": 0.0, "rival": _words(best), "margin": -by_family[best]}
    ratio = float(b[:m] @ share - 0.5 * share @ a[:m, :m] @ share)
    if m == 1:
        gain = float(single[0])
        rivals = {key: value for key, value in by_family.items() if key not in truth}
        alike = twins(a, b, [*truth, *keys], sharp, positive) if truth else ()
        further = {"twins": sorted(_words(one) for one in alike)}
    else:
        gain = float(evidence_sets(a, b, np.arange(m)[None], positive)[0])
        further = {"beside": beside(a, b, hidden, keys, positive)}
        rivals = dict(by_family)
        pairs = np.column_stack(np.triu_indices(len(candidates), 1))
        heights = evidence_sets(a, b, m + pairs, positive)
        for k in np.argsort(heights)[::-1][:2000]:
            two = {keys[i] for i in pairs[k]}
            if two != truth:
                rivals.setdefault(tuple(sorted(two, key=str)), float(heights[k]))
    ranked = sorted(rivals, key=rivals.get, reverse=True)
    best = ranked[0]
    return further | {
        "log_bayes_factor": gain, "log_likelihood_ratio": ratio, "rival": _words(best), "margin": gain - rivals[best],
        "rivals": [{"rival": _words(one), "margin": gain - rivals[one]} for one in ranked[:8]
                   if gain - rivals[one] < NEAR],
    }  # fmt: skip


def _words(key) -> str:
    if isinstance(key[0], tuple):
        return " + ".join(_words(one) for one in key)
    return " ".join(str(one) for one in key if one)
