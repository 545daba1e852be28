"""From recordings to findings: noise, the best set of effects, what is left beside it, what has no name.

    1  noise is fitted under the null, and every effect and every interval of every channel is looked at with it
    2  noise is fitted again under the best set of effects and under the best intervals, and the search repeated: what
       is wrong has inflated the noise of the null
    3  the finalists are compared with the noise integrated out of each
    4  the finalist is refitted through the full mechanization (`refine`)
    5  enough? what a slow disturbance of a channel, or any interval of it, still gains beside the effects

Sources: Kass and Raftery 1995; Willsky and Jones 1976.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.diagnosis.answer.decision import explains, is_heard
from ins_eval.diagnosis.answer.findings import Findings
from ins_eval.diagnosis.unnamed import locate
from ins_eval.diagnosis.unnamed.adequacy import left_unexplained
from ins_eval.diagnosis.unnamed.dependence import dependence
from ins_eval.diagnosis.unnamed.disturbance import (
    OF_SENSORS,
    intervals,
    is_sure,
    quieter,
    restless,
    surest_of,
    within_grade,
)
from ins_eval.diagnosis.unnamed.mismatch import Mismatch, deviate, located
from ins_eval.diagnosis.unnamed.one_sensor import one_sensor
from ins_eval.diagnosis.unnamed.where import where
from ins_eval.effects.parts import SENSORS
from ins_eval.estimation.best_set import (
    ROUNDS,
    alike,
    at_noise,
    at_own_noise,
    begun,
    joined,
    navigated_with,
    searched,
    with_further,
)
from ins_eval.estimation.instants import innovations
from ins_eval.estimation.linearisation import linearise, more_probable, on_common
from ins_eval.estimation.own_noise import with_own_noise
from ins_eval.estimation.placing import Point
from ins_eval.estimation.refine import Impossible
from ins_eval.estimation.study import Hypothesis, fit_noise, marginal, wide
from ins_eval.recording import PARKED
from ins_eval.streams import Streams

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from ins_eval.diagnosis.unnamed.disturbance import Suspect
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.linearisation import Linearisation
    from ins_eval.estimation.noise_fit import Fitted
    from ins_eval.policy import Policy

ENERGY = (0.05, 0.95)  # of an effect's energy: the interval in which it shows
NEAR = 6.0  # nats below the effects from which a form without a name is weighed at a noise of its own: by reasoning


def collect(cases: Sequence[Case], policy: Policy, progress: Callable[[str], None] = lambda _: None) -> Findings:
    """Search recordings of one instrument together."""
    cases = tuple(cases)
    rng = Streams(0).at("diagnosis", "significance").rng()
    progress("noise")
    null = tuple(fit_noise(cases, [], [None] * len(cases), hills=True))
    known = [
        replace(one, noise_point=within_grade(case, one.noise_point, policy))
        for case, one in zip(cases, null, strict=True)
    ]
    progress("effects")
    around_belief = linearise(Point(cases, (), np.zeros(0), tuple(known)), policy)
    begin = begun(around_belief, known, policy)
    alone = () if _of_earth(begin) else _alone(cases, null, policy)
    begins = [at_own_noise(begin, policy)]
    searches = [linearisation := searched(cases, begins[0], policy)]
    for noise in other_noise(cases, linearisation, alone):
        other_begin = at_own_noise(at_noise(begin, noise, policy), policy)
        if any(alike(other_begin, one) for one in begins):
            continue
        begins.append(other_begin)
        searches.append(other := searched(cases, other_begin, policy))
        better, worse = (other, linearisation) if more_probable(linearisation, other) > 0.0 else (linearisation, other)
        linearisation = joined(cases, better, worse, policy)
    linearisation = linearisation.sure(policy)
    if linearisation.best.log_posterior > 0.0:
        linearisation = with_further(cases, linearisation, quiet_but_one, policy)
    findings = Findings(
        cases=cases,
        null=null,
        innovations=tuple(innovations(case, one.noise_point) for case, one in zip(cases, null, strict=True)),
        alone=alone,
        linearisation=linearisation,
        gain=_gain(cases, known, linearisation, policy),
        around_belief=around_belief,
        others=tuple(_near(searches, linearisation, policy)),
    )
    suspects = None
    if not is_heard(findings, policy):
        progress("intervals")
        suspects = _suspects(findings, rng, policy)
        if surest := surest_of(suspects, policy):
            findings = _stepped(findings, surest.recording, surest.interval, surest.fitted, policy)
    if is_heard(findings, policy):
        progress("what is left")
        findings = _enough(_examined(findings, rng, policy), rng, policy)
        findings = replace(findings, linearisation=with_own_noise(findings.linearisation, policy))
        if explains(findings, policy) and not _unnamed_near(findings):
            return findings
    suspects = _suspects(findings, rng, policy) if suspects is None else suspects
    return replace(findings, suspects=suspects, places=tuple(_place(findings, one) for one in suspects))


def _unnamed_near(findings: Findings) -> bool:
    """Whether a form without a name, at the noise that was fitted beside the effects, comes so near to them.

    Then it is weighed at a noise of its own, as rivals are.
    """
    return findings.instead.gain > findings.linearisation.best.log_posterior - NEAR


def _near(searches: Sequence[Linearisation], best: Linearisation, policy: Policy) -> Iterator[Linearisation]:
    """The searches that found further effects, nearly as probable as the best set."""
    return (one for one in searches if one.keys - best.keys and more_probable(one, best) < policy.listed)


def other_noise(
    cases: Sequence[Case], linearisation: Linearisation, alone: Sequence[Suspect]
) -> Iterator[list[Fitted]]:
    """The noise of sensors that wander little, and that of sure disturbances without a name.

    What is wrong has made the sensors look noisy, and a slow error of a bench or a reference stands in for an effect.
    """
    quiet = _quiet(cases, linearisation.fitted)
    if quiet is not None:
        yield quiet
    if alone:
        found = list(quiet or linearisation.fitted)
        for one in alone:
            found[one.recording] = one.fitted
        yield found


def quiet_but_one(linearisation: Linearisation) -> list[list[Fitted]]:
    """The noise beside the best set as `quieter` has it, but for one kind of sensor, where that differs."""
    cases, fitted = linearisation.cases, linearisation.fitted
    kept = [kind for kind in OF_SENSORS if any(kind in case.noise.free for case in cases)]
    found = [quiet for kind in kept if (quiet := _quiet(cases, fitted, kind)) is not None]
    return list({tuple(tuple(one.noise_point) for one in quiet): quiet for quiet in found}.values())


def _quiet(cases: Sequence[Case], fitted: Sequence[Fitted], kept: str = "") -> list[Fitted] | None:
    """The noise as `quieter` has it, but for the level `kept`; None where it is so already."""
    points = [
        np.where(np.array(case.noise.free) == kept, one.noise_point, quieter(case, one.noise_point))
        for case, one in zip(cases, fitted, strict=True)
    ]
    if all((point == one.noise_point).all() for point, one in zip(points, fitted, strict=True)):
        return None
    return [replace(one, noise_point=point) for point, one in zip(points, fitted, strict=True)]


def _alone(cases: Sequence[Case], null: Sequence[Fitted], policy: Policy) -> tuple[Suspect, ...]:
    """Disturbances without a name that are sure, each at a noise of its own; the one that gains most is last."""
    found = [look(case, r, null[r], policy) for r, case in enumerate(cases) for look in (one_sensor, dependence)]
    sure = (one for one in found if one is not None and is_sure(one, policy))
    return tuple(sorted(sure, key=lambda one: one.gain))


def _suspects(findings: Findings, rng: np.random.Generator, policy: Policy) -> tuple[Suspect, ...]:
    """Disturbances without a name, at the noise of the null or their own."""
    found = list(findings.alone)
    for r, case in enumerate(findings.cases):
        found += intervals(case, r, findings.null[r], rng, policy)
    if surest_of(found, policy) is None:  # what is located as an interval explains more than that a sensor wanders
        for r, case in enumerate(findings.cases):
            found += [one for one in (restless(case, r, findings.null[r], policy),) if one is not None]
    return tuple(found)


def _enough(findings: Findings, rng: np.random.Generator, policy: Policy) -> Findings:
    """The findings with jumps of sensors beside the effects, where these leave nothing; else as they are."""
    tried = findings
    for _ in range(ROUNDS):
        left = tried.beside
        if explains(tried, policy) or left.mismatch is None or left.interval is None:
            break
        r = left.mismatch.recording
        stepped = _stepped(tried, r, left.interval, tried.linearisation.fitted[r], policy)
        if stepped is tried:
            break
        tried = _examined(stepped, rng, policy)
    return tried if explains(tried, policy) else findings


def _stepped(findings: Findings, r: int, off: locate.Interval, noise: Fitted, policy: Policy) -> Findings:
    """The findings where a sensor has jumped that is `off` from an instant to the end, if that is more probable.

    The jump stands beside the effects that are heard; `noise` is that of recording `r`.
    """
    cases, before = findings.cases, findings.linearisation
    heard = is_heard(findings, policy)
    case = before.cases[r] if heard else cases[r]
    exact = None if case.believed is None else _jump(case, off, noise.noise_point)
    if exact is None:
        return findings
    sensor, _, axis = exact.channel.name.partition(".")
    step = case.member(f"{sensor}.bias_step", axis, {"at_s": exact.begin_s})
    columns = tuple(step.column if k == r else None for k in range(len(cases)))
    model = [*(before.chosen(scaled=False) if heard else []), Hypothesis(step, columns)]
    point = np.append(before.point[list(before.best.members)] if heard else [], 0.0)
    fitted = list(before.fitted if heard else findings.null)
    fitted[r] = noise
    try:
        linearisation = navigated_with(cases, model, fitted, point, policy, before.cases)
    except Impossible:
        return findings
    if more_probable(before, linearisation) <= 0.0:
        return findings
    return replace(findings, linearisation=linearisation, gain=_gain(cases, findings.null, linearisation, policy))


def _examined(findings: Findings, rng: np.random.Generator, policy: Policy) -> Findings:
    """The findings with what the effects leave, and where each shows."""
    linearisation = findings.linearisation
    instead, beside = left_unexplained(linearisation, rng, policy)
    shown = tuple(_shown(linearisation, k) for k in linearisation.best.members)
    return replace(findings, instead=instead, beside=beside, shown=shown)


def _place(findings: Findings, suspect: Suspect) -> Mismatch:
    """Where a suspect is, to the second."""
    case = findings.cases[suspect.recording]
    exact = locate.refined(case, suspect.interval, suspect.fitted.noise_point)
    follows = suspect.follows
    instead = None if findings.instead is None else findings.instead.mismatch
    if instead and (instead.recording, instead.channel) == (suspect.recording, exact.channel.name):
        follows = follows or instead.follows
    return located(case, suspect.recording, exact, suspect.sigma, follows)


def _of_earth(begin: Linearisation) -> bool:
    return any(one.candidate.name.startswith("earth.") for one in begin.hypotheses[: np.count_nonzero(begin.point)])


def _gain(cases: Sequence[Case], null: Sequence[Fitted], linearisation: Linearisation, policy: Policy) -> float:
    """log Bayes factor of the best set against the null, the noise integrated out of both."""
    best = linearisation.best
    if best.log_bayes_factor < policy.worth_refitting:
        return best.log_bayes_factor
    m = list(best.members)
    centre = linearisation.space.centre[m]
    share = best.log_bayes_factor - linearisation.gain(m)
    models = [[], list(range(len(m)))]
    noise_points = [one.noise_point for one in linearisation.fitted]
    quiet = [one.noise_point for one in null]
    chosen, point = linearisation.chosen(scaled=False), linearisation.point[m]
    known, navigated = on_common(cases, linearisation.cases)
    there = marginal(navigated, noise_points, chosen, models, centre, point)
    if all(a.model.nodes_s.size == b.model.nodes_s.size for a, b in zip(known, navigated, strict=True)):
        alone = marginal(known, quiet, [], [[]], np.zeros(0))
    else:  # a clock that is set right moves measurements past one another, and other means are compared
        alone = marginal(navigated, quiet, chosen, [[]], centre, point)
    return float(there[1] - max(there[0], alone[0])) + share


def _shown(linearisation: Linearisation, k: int) -> Mismatch:
    """Where effect `k` shows: the recording and the interval that hold most of its energy."""
    of_family, _ = linearisation.places(k)
    gain = float(of_family[linearisation.space.families[k]])
    one, best, fitted = linearisation.hypotheses[k], linearisation.best, linearisation.fitted
    beside = [h for j, h in zip(best.members, linearisation.chosen(), strict=True) if j != k]
    energies = []
    for r, case in enumerate(linearisation.cases):
        if one.columns[r] is None:
            continue
        known = len(case.nuisances)
        columns = [wide(h.columns[r], 16.0) for h in beside if h.columns[r] is not None] + [one.columns[r]]
        last = known + len(columns)
        whitened = case.whitened(columns, fitted[r].noise_point, keep=last + 1)
        taken = np.linalg.solve(
            np.eye(last - 1) + whitened.normal[: last - 1, : last - 1], whitened.normal[: last - 1, last - 1]
        )
        energy = np.nansum((whitened.kept[..., last] - whitened.kept[..., 1:last] @ taken) ** 2, axis=1)
        energies.append((float(energy.sum()), r, energy))
    _, r, energy = max(energies, key=lambda entry: entry[0])
    case = linearisation.cases[r]
    part = np.cumsum(energy) / max(float(energy.sum()), 1e-300)
    begin, end = np.searchsorted(part, ENERGY)
    nodes_s = case.model.nodes_s
    begin_s, end_s = (float(nodes_s[max(begin - 1, 0)]), float(nodes_s[min(end, nodes_s.size - 1)]))
    if "at_s" in one.candidate.parameters:
        begin_s, end_s = float(one.candidate.parameters["at_s"]), float(nodes_s[-1])
    return Mismatch(
        recording=r,
        channel=one.candidate.channel,
        axis=one.candidate.axis or "",
        begin_s=begin_s,
        end_s=end_s,
        where=where(case.model, case.temperature, begin_s, end_s),
        significance_sigma=deviate(gain - linearisation.space.cost),
    )


def _jump(case: Case, interval: locate.Interval, noise_point: np.ndarray) -> locate.Interval | None:
    """Where a sensor is off to the end of a recording: at rest the instant from which it is so is known to seconds.

    There an accelerometer that jumps feels what it would if a gyro were off for a moment and tilted it, so every sensor
    is tried. None for what is off between two instants otherwise, or is no sensor.
    """
    last_s = float(case.model.nodes_s[-1])
    if not interval.channel.name.startswith(SENSORS):
        return None
    tried = [interval]
    if interval.end_s < last_s:
        sensors = [one for one in locate.channels(case) if one.name.startswith(SENSORS)]
        tried = [replace(interval, channel=one, end_s=last_s) for one in sensors if case.kind in PARKED]
    found = [locate.refined(case, one, noise_point) for one in tried]
    window_s = np.diff(locate.edges(case.model))[0]
    return max((one for one in found if one.end_s > last_s - window_s), key=lambda one: one.t2, default=None)
