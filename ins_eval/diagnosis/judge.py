"""From the sums to a verdict: is there a mismatch, what explains it, is that enough, and what else could it be?

    1  noise is fitted under the null, and every effect and every interval of every channel is looked at with it
    2  noise is fitted again under the best set of effects and under the best intervals, and the search repeated: what
       is wrong has inflated the noise of the null
    3  the finalists are compared with the noise integrated out of each
    4  the finalist is refitted through the full mechanization (`refine`)
    5  enough? what a slow disturbance of a channel, or any interval of it, still gains beside the effects
    6  what else: every family in the place of each effect

Sources: Kass and Raftery 1995; Willsky and Jones 1976.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import logsumexp
from threadpoolctl import threadpool_limits

from ins_eval.diagnosis import locate
from ins_eval.diagnosis.adequacy import left_unexplained
from ins_eval.diagnosis.case import Case
from ins_eval.diagnosis.disturbance import (
    ALONE,
    Suspect,
    intervals,
    one_sensor,
    with_quiet_sensors,
)
from ins_eval.diagnosis.experiments import Catalogue
from ins_eval.diagnosis.linearisation import CONSTANTS, Linearisation, linearise
from ins_eval.diagnosis.motion_dependence import motion_dependence
from ins_eval.diagnosis.noise import Fitted
from ins_eval.diagnosis.refine import again, believed_effect, refine
from ins_eval.diagnosis.rivals import WITHIN, rivals, with_experiments
from ins_eval.diagnosis.search import LEAST_SHARE, LEAST_SHARE_ELSEWHERE
from ins_eval.diagnosis.study import Hypothesis, fit_noise, marginal, wide
from ins_eval.diagnosis.verdict import (
    EXPLAINED,
    NO_MISMATCH,
    NOT_IDENTIFIABLE,
    PARTLY,
    UNEXPLAINED,
    Diagnosis,
    FoundEffect,
    Mismatch,
    Rival,
    UnnamedDisturbance,
    channel_of,
    located,
)
from ins_eval.diagnosis.where import where
from ins_eval.effects.composed import NAME as COMPOSED
from ins_eval.effects.parts import SENSORS
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.navigation import PARKED
from ins_eval.recording.belief import Belief
from ins_eval.streams import Streams

WORTH_REFITTING = 2.0  # log Bayes factor with the noise of the null
# nats below which nothing counts: readings of hours in one place share slow errors that no model of noise holds
LEAST_GAIN = {"chamber": 10.0}
ROUNDS = 3
STAY = 0.5  # nats by which another set must lead that with which the recordings were navigated
LARGE = 30.0  # log Bayes factor from which a term of the Earth is tried by navigating with it
ENERGY = (0.05, 0.95)  # of an effect's energy: the interval in which it shows
HARM = 5.0  # nats that effects may lose on data that were not used; noise alone costs about one each
FORM = 1e-3  # of what effects gain: what linear sums leave open of a large one
OPEN_MARGIN = 6.0  # nats by which a sure form without a name must lead, and what a further effect of a sensor is worth
MOST_OF_ONE = 4  # effects of one sensor, but for constants, that explain something


def judge(
    cases: Sequence[Case], progress: Callable[[str], None] = lambda _: None, belief: Belief | None = None
) -> Diagnosis:
    """Search recordings of one instrument together; `belief` plans experiments where all of them are chambers."""
    with threadpool_limits(1):  # small matrices: more threads in each product only wait for one another
        return _Judge(tuple(cases), progress, belief).judged()


class _Judge:
    """The steps of one diagnosis and what they share."""

    def __init__(self, cases: tuple[Case, ...], progress: Callable[[str], None], belief: Belief | None):
        self.cases, self.progress, self.belief = cases, progress, belief
        kinds = {case.kind for case in cases}
        self.share = max((LEAST_SHARE.get(kind, LEAST_SHARE_ELSEWHERE) for kind in kinds), default=0.0)
        self.rng = Streams(0).at("diagnosis", "significance").rng()

    def judged(self) -> Diagnosis:
        self.progress("noise")
        self.null = fit_noise(self.cases, [], [None] * len(self.cases))
        self.innovations = tuple(
            _innovations(case, one.noise_point) for case, one in zip(self.cases, self.null, strict=True)
        )
        self.progress("effects")
        begin = self._with_earth(linearise(self.cases, (), np.zeros(0), self.null, self.share))
        self.alone = self._alone() if begin.cases is self.cases else []
        linearisation = self._searched(begin)
        # what is wrong has made the sensors look noisy, a slow error of a bench stands in for an effect
        quiet = [
            replace(one, noise_point=with_quiet_sensors(case, one.noise_point))
            for case, one in zip(self.cases, linearisation.fitted, strict=True)
        ]
        for one in self.alone:
            quiet[one.recording] = one.fitted
        if any(
            (one.noise_point != found.noise_point).any() for one, found in zip(quiet, linearisation.fitted, strict=True)
        ):
            other = self._searched(self._at_noise(begin, quiet))
            linearisation = max(linearisation, other, key=lambda one: one.height)
        gain, heard = self._heard(linearisation)
        suspects = None
        if not heard:
            self.progress("intervals")
            suspects = self._suspects()
            surest = max((one for one in suspects if one.sure), key=lambda one: one.gain, default=None)
            if (
                surest is not None
                and (stepped := self._stepped(surest)) is not None
                and stepped.height > linearisation.height
            ):
                linearisation = stepped
                gain, heard = self._heard(linearisation)
        statistics: dict[str, float | str] = {
            "largest_log_bayes_factor": gain,
            "largest_effect": linearisation.name(),
            "cost_of_an_effect": linearisation.space.cost,
        }
        if heard:
            self.progress("what is left")
            explained = self._explained(linearisation, statistics)
            if explained is not None:
                return explained
        suspects = self._suspects() if suspects is None else suspects
        statistics["smallest_probability"] = min((one.probability for one in suspects), default=1.0)
        return self._located(linearisation if heard else None, suspects, gain, statistics)

    def _heard(self, linearisation: Linearisation) -> tuple[float, bool]:
        """Nats that the best set gains on the null, and whether they suffice to report a mismatch."""
        gain = self._gain(linearisation)
        least = max(LEAST_GAIN.get(case.kind, 0.0) for case in self.cases)
        return gain, gain > max(least, linearisation.space.cost * len(linearisation.best.members))

    def _suspects(self) -> list[Suspect]:
        """Disturbances without a name, at the noise of the null or their own."""
        found = list(self.alone)
        for r, case in enumerate(self.cases):
            found += intervals(case, r, self.null[r], self.rng)
        return found

    def _stepped(self, suspect: Suspect) -> Linearisation | None:
        """The linearisation at which a sensor has jumped that was off from an instant to the end; None if none has."""
        r = suspect.recording
        case = self.cases[r]
        exact = None if case.believed is None else _jump(case, suspect)
        if exact is None:
            return None
        sensor, _, axis = exact.channel.name.partition(".")
        step = case.member(f"{sensor}.bias_step", axis, {"at_s": exact.begin_s})
        columns = tuple(step.column if k == r else None for k in range(len(self.cases)))
        fitted = list(self.null)
        fitted[r] = suspect.fitted
        refined = refine(self.cases, [Hypothesis(step, columns)], fitted)
        linearisation = linearise(refined.cases, refined.model, refined.point, refined.fitted, self.share)
        return replace(linearisation, refined=refined).own_first(1)

    # 1 and 2

    def _alone(self) -> list[Suspect]:
        """Disturbances without a name that are sure, each at a noise of its own; the one that gains most is last."""
        found = [
            look(case, r, self.null[r]) for r, case in enumerate(self.cases) for look in (one_sensor, motion_dependence)
        ]
        return sorted((one for one in found if one is not None and one.sure), key=lambda one: one.gain)

    def _with_earth(self, linearisation: Linearisation) -> Linearisation:
        """Start from a term of the Earth that the belief leaves out where that alone mends the most.

        Such an error is so large that nothing linear around a solution without the term can be trusted.
        """
        if linearisation.best.log_bayes_factor < LARGE:
            return linearisation
        best, height = linearisation, linearisation.height
        for one in linearisation.hypotheses:
            if not one.candidate.name.startswith("earth."):
                continue
            effect = believed_effect(one, one.candidate.centre, self.cases)
            cases = [case.again([effect]) for case in self.cases]
            model = [again(one, cases)]
            fitted = fit_noise(cases, [], [None] * len(cases))
            tried = linearise(cases, model, np.array([one.candidate.centre]), fitted, self.share)
            if tried.height > height:
                best, height = tried, tried.height
        return best

    def _at_noise(self, linearisation: Linearisation, fitted: Sequence[Fitted]) -> Linearisation:
        """The linearisation around the same point, its sums and its search at another noise."""
        m = int(np.count_nonzero(linearisation.point))
        return linearise(linearisation.cases, linearisation.hypotheses[:m], linearisation.point[:m], fitted, self.share)

    def _searched(self, linearisation: Linearisation) -> Linearisation:
        """Search, fit the noise under the set found, navigate with that set, and search again until the set stays."""
        for turn in range(ROUNDS):
            best = linearisation.best
            if best.log_bayes_factor < WORTH_REFITTING:
                return linearisation
            if turn == 0:
                starts = [one.noise_point for one in linearisation.fitted]
                linearisation = self._at_noise(
                    linearisation, fit_noise(linearisation.cases, linearisation.chosen(), starts)
                )
                if linearisation.best.log_posterior < 0.0:
                    return linearisation
            keys = linearisation.keys
            refined = refine(self.cases, linearisation.chosen(scaled=False), linearisation.fitted)
            linearisation = linearise(refined.cases, refined.model, refined.point, refined.fitted, self.share)
            linearisation = replace(linearisation, refined=refined)
            own = linearisation.own_first(len(refined.model))
            placed = set(linearisation.best.members) == set(range(len(refined.model)))
            last = turn == ROUNDS - 1
            if linearisation.keys == keys and not placed and not last:
                continue  # at the noise of the answer another time, width or lag is better
            if last or linearisation.best.log_posterior <= own.best.log_posterior + STAY:
                linearisation = own
            if linearisation.keys == keys:
                break
        return linearisation

    # 3

    def _gain(self, linearisation: Linearisation) -> float:
        """log Bayes factor of the best set against the null, the noise integrated out of both."""
        best = linearisation.best
        if best.log_bayes_factor < WORTH_REFITTING:
            return best.log_bayes_factor
        m = list(best.members)
        centre = linearisation.space.centre[m]
        share = best.log_bayes_factor - linearisation.gain(m)
        models = [[], list(range(len(m)))]
        noise_points = [one.noise_point for one in linearisation.fitted]
        chosen, point, quiet = (
            linearisation.chosen(scaled=False),
            linearisation.point[m],
            [one.noise_point for one in self.null],
        )
        there = marginal(linearisation.cases, noise_points, chosen, models, centre, point)
        if all(
            a.model.nodes_s.size == b.model.nodes_s.size for a, b in zip(self.cases, linearisation.cases, strict=True)
        ):
            alone = marginal(self.cases, quiet, [], [[]], np.zeros(0))
        else:  # a clock that is set right moves measurements past one another, and other means are compared
            alone = marginal(linearisation.cases, quiet, chosen, [[]], centre, point)
        return float(there[1] - max(there[0], alone[0])) + share

    # 4, 5 and 6

    def _explained(self, linearisation: Linearisation, statistics: dict[str, float | str]) -> Diagnosis | None:
        """The answer where the effects found explain the mismatch, else None."""
        self.instead, self.beside = left_unexplained(linearisation, self.share, self.rng)
        posterior = linearisation.best.log_posterior
        statistics |= {"instead": self.instead.gain, "beside": self.beside.gain, "posterior": posterior}
        if self.beside.mismatch is not None or self.instead.gain > posterior + self._open_margin(linearisation):
            return None
        if self._outdone(linearisation, statistics["largest_log_bayes_factor"]):
            return None
        if not self._holds(linearisation):
            return None
        verdict = NOT_IDENTIFIABLE if any(one.below_best < WITHIN for one in rivals(linearisation)) else EXPLAINED
        shown = [self._shown(linearisation, k) for k in linearisation.best.members]
        return self._answer(verdict, self.beside, shown, linearisation, statistics=statistics)

    def _located(
        self,
        linearisation: Linearisation | None,
        suspects: list[Suspect],
        gain: float,
        statistics: dict[str, float | str],
    ) -> Diagnosis:
        """The answer where effects, if any, are not enough: sure ones beside something, or a place without a name."""
        found = [one for one in suspects if one.sure]
        surest = max(found, key=lambda one: one.gain, default=None)
        place = []
        if surest is not None:
            case = self.cases[surest.recording]
            exact = locate.refined(case, surest.interval, surest.fitted.noise_point)
            follows, instead = surest.follows, None if linearisation is None else self.instead.mismatch
            if instead and (instead.recording, instead.channel) == (surest.recording, exact.channel.name):
                follows = follows or instead.follows
            place = [located(case, surest.recording, exact, surest.sigma, follows)]
        if linearisation is None:
            if surest is None:
                sigma = max((one.sigma for one in suspects), default=0.0)
                return self._answer(NO_MISMATCH, UnnamedDisturbance(None, 0.0, sigma), statistics=statistics)
            unnamed = UnnamedDisturbance(place[0], surest.gain, surest.sigma)
            return self._answer(UNEXPLAINED, unnamed, place, statistics=statistics)
        shown = [self._shown(linearisation, k) for k in linearisation.best.members]
        beside, instead = self.beside, self.instead
        if surest is not None and surest.gain > gain:
            shown = place + shown
        lead = self._open_margin(linearisation)
        if beside.mismatch is not None:  # with it they do better; they must still be worth what they cost
            lead += max(beside.gain, 0.0) - linearisation.space.cost
        harms = linearisation.held_out["harm_nats"] > HARM
        if harms and surest is None and instead.gain < OPEN_MARGIN:
            return self._answer(
                NO_MISMATCH, UnnamedDisturbance(None, 0.0, beside.significance_sigma), statistics=statistics
            )
        described = self._outdone(linearisation, gain) or self._only_described(linearisation, gain, surest)
        outgained = instead.gain > linearisation.best.log_posterior + lead
        if harms or described or outgained:
            place = place or ([instead.mismatch] if outgained and instead.mismatch else shown)
            unnamed = replace(instead, mismatch=place[0])
            return self._answer(UNEXPLAINED, unnamed, place, linearisation, named=False, statistics=statistics)
        return self._answer(PARTLY, beside, shown, linearisation, statistics=statistics)

    def _outdone(self, linearisation: Linearisation, gain: float) -> bool:
        """Whether a sure disturbance without a name gains more than the effects.

        A form that follows the motion is held against them as another law would be: what keeps it from being heard
        where nothing is wrong no longer counts.
        """
        own = gain - linearisation.space.cost * len(linearisation.best.members)
        return any(
            one.gain > gain + OPEN_MARGIN or (one.follows and one.gain + ALONE > own + OPEN_MARGIN)
            for one in self.alone
        )

    def _open_margin(self, linearisation: Linearisation) -> float:
        """Nats by which a form without a name may at most lead the effects; below 0, by which it must stay behind them.

        0 for effects of different sensors, and `FORM` of what they gain. `OPEN_MARGIN` less for each that shares its
        sensor with another, since one sensor has one fault more often than two; more than `MOST_OF_ONE` describe it and
        explain nothing. Constants do not count: what has no name has them. `WITHIN` less where one is composed of a
        column, which is a description as well. In a chamber, where the laws of one sensor are sought, `OPEN_MARGIN`.
        """
        if any(case.believed is None for case in self.cases):
            return OPEN_MARGIN
        moved = [
            k
            for k in linearisation.best.members
            if linearisation.hypotheses[k].candidate.name not in (*CONSTANTS, "gyro.bias")
        ]
        sensors = Counter(one for one in _channels(linearisation, moved) if one.startswith(SENSORS))
        most = max(sensors.values(), default=1)
        if most > MOST_OF_ONE:
            return -np.inf
        left_open = FORM * max(linearisation.best.log_posterior, 0.0)
        composed = any(linearisation.hypotheses[k].candidate.name == COMPOSED for k in linearisation.best.members)
        return left_open - OPEN_MARGIN * (most - 1) - WITHIN * composed

    def _only_described(self, linearisation: Linearisation, gain: float, surest: Suspect | None) -> bool:
        """Whether the effects follow the shape of something else.

        A disturbance that gains more has suggested the effects of other sensors, one that gains far more those of its
        own. And what follows a law explains nothing where a mismatch is left in its very channel, unless effects of
        others explain most; but a bench always leaves one, and beside geometry, which is exact, the least error of a
        law is left.
        """
        members = linearisation.best.members
        channels = _channels(linearisation, members)
        if surest is not None:
            elsewhere = surest.interval.channel.name not in channels
            if surest.gain > gain + (0.0 if elsewhere else OPEN_MARGIN):
                return True
        left = self.beside.mismatch
        geometry = linearisation.space.exact[list(members)].any()
        if left is None or geometry or self.cases[left.recording].believed is None:
            return False
        if left.channel not in _channels(
            linearisation, [k for k in members if linearisation.hypotheses[k].candidate.lawful]
        ):
            return False
        others = [k for k, channel in zip(members, channels, strict=True) if channel != left.channel]
        return linearisation.gain(others) < 0.5 * linearisation.gain(members)

    @staticmethod
    def _holds(linearisation: Linearisation) -> bool:
        """Whether the effects do no harm on data that did not suggest them; what is composed of a column must help."""
        fit = linearisation.held_out
        if all(linearisation.hypotheses[k].candidate.name != COMPOSED for k in linearisation.best.members):
            return fit["harm_nats"] < HARM
        return fit["after"] < min(fit["before"], fit["placebo"])

    def _effects(self, linearisation: Linearisation) -> tuple[FoundEffect, ...]:
        m = linearisation.best.members
        whole = linearisation.gain(m)
        mean, covariance = linearisation.coefficients
        known = linearisation.refined
        bent = {} if known is None else {one.key: x for one, x in zip(known.model, known.bent, strict=True)}
        spread = {} if known is None else {one.key: x for one, x in zip(known.model, known.spread, strict=True)}
        out = []
        for i, k in enumerate(m):
            gain = whole - linearisation.gain([j for j in m if j != k])
            one = linearisation.hypotheses[k]
            form = VOCABULARY[one.candidate.name].form
            variance = covariance[i, i] + bent.get(one.key, 0.0) + (form * mean[i]) ** 2
            out.append(
                FoundEffect(
                    hypothesis=one,
                    value=float(mean[i] * one.candidate.nominal),
                    sigma=float(np.sqrt(variance) * one.candidate.nominal),
                    probability=self._probability(linearisation, k),
                    log_evidence_gain=float(gain),
                    false_alarm_probability=float(min(1.0, np.exp(min(0.0, linearisation.space.cost - gain)))),
                    spread=spread.get(one.key, {}),
                )
            )
        return tuple(sorted(out, key=lambda one: -one.log_evidence_gain))

    def _probability(self, linearisation: Linearisation, k: int) -> float:
        of_family, _, _ = linearisation.places(k)
        own = of_family[linearisation.space.families[k]]
        return float(np.exp(own - logsumexp(np.append(of_family, linearisation.space.cost))))

    def _with_experiments(self, linearisation: Linearisation) -> tuple[Rival, ...]:
        found = rivals(linearisation)
        if not found or (self.belief is None and all(case.believed is None for case in self.cases)):
            return found
        self.progress("experiments")
        return with_experiments(
            linearisation, found, Catalogue(self.cases, [one.noise_point for one in linearisation.fitted], self.belief)
        )

    def _shown(self, linearisation: Linearisation, k: int) -> Mismatch:
        """Where effect `k` shows: the recording and the interval that hold most of its energy."""
        of_family, _, _ = linearisation.places(k)
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
            channel=channel_of(one.candidate.name, one.candidate.axis, one.candidate.parameters),
            axis=one.candidate.axis or "",
            begin_s=begin_s,
            end_s=end_s,
            where=where(case.model, case.temperature, begin_s, end_s),
            significance_sigma=float(np.sqrt(2.0 * max(0.0, gain - linearisation.space.cost))),
        )

    def _answer(
        self,
        verdict: str,
        unnamed: UnnamedDisturbance,
        mismatches: Sequence[Mismatch] = (),
        linearisation: Linearisation | None = None,
        named: bool = True,
        statistics: dict[str, float | str] | None = None,
    ) -> Diagnosis:
        """The answer; with a `linearisation` whose effects are `named`, all that is said of them."""
        found = Diagnosis(
            cases=self.cases,
            verdict=verdict,
            effects=(),
            rivals=(),
            mismatches=tuple(mismatches),
            unnamed=unnamed,
            null=tuple(self.null),
            fitted=tuple(self.null if linearisation is None else linearisation.fitted),
            innovations=self.innovations,
            statistics=statistics or {},
            held_out={},
            after=(),
            linearisation=linearisation,
        )
        if linearisation is None or not named:
            return found
        found = replace(
            found,
            effects=self._effects(linearisation),
            rivals=self._with_experiments(linearisation),
            held_out=linearisation.held_out,
        )
        return replace(found, after=tuple(case.again(found.believed) for case in self.cases))


def _jump(case: Case, suspect: Suspect) -> locate.Interval | None:
    """Where a sensor is off to the end of a recording: at rest the instant from which it is so is known to seconds.

    There an accelerometer that jumps feels what it would if a gyro were off for a moment and tilted it, so every sensor
    is tried. None for what is off between two instants otherwise, or is no sensor.
    """
    interval, last_s = suspect.interval, float(case.model.nodes_s[-1])
    if not interval.channel.name.startswith(SENSORS):
        return None
    tried = [interval]
    if interval.end_s < last_s:
        sensors = [one for one in locate.channels(case.seen) if one.name.startswith(SENSORS)]
        tried = [replace(interval, channel=one, end_s=last_s) for one in sensors if case.kind in PARKED]
    found = [locate.refined(case, one, suspect.fitted.noise_point) for one in tried]
    window_s = np.diff(locate.edges(case.model))[0]
    return max((one for one in found if one.end_s > last_s - window_s), key=lambda one: one.t2, default=None)


def _channels(linearisation: Linearisation, members: Sequence[int]) -> list[str]:
    """The channel that each of these hypotheses disturbs."""
    ones = [linearisation.hypotheses[k].candidate for k in members]
    return [channel_of(one.name, one.axis, one.parameters) for one in ones]


def _innovations(case: Case, noise_point: np.ndarray) -> np.ndarray:
    """Whitened residual (nodes, 9) of the null, the nuisances at their posterior mean."""
    whitened = case.whitened([], noise_point, keep=len(case.nuisances) + 1)
    best = np.linalg.solve(np.eye(len(case.nuisances)) + whitened.normal, whitened.projection)
    return whitened.kept[..., 0] - whitened.kept[..., 1:] @ best
