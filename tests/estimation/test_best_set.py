"""Two searches put together: what only one of them found is taken where the data have it, else not. And a search that
was led astray comes back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.estimation import best_set
from ins_eval.estimation.best_set import (
    SAME_NOISE,
    alike,
    at_noise,
    at_own_noise,
    joined,
    navigated_with,
    searched,
    with_further,
)
from ins_eval.estimation.case import Case, prepare
from ins_eval.estimation.linearisation import Linearisation, linearise
from ins_eval.estimation.noise_fit import Fitted
from ins_eval.estimation.placing import Point
from ins_eval.estimation.refine import _navigated, refine
from ins_eval.estimation.search import explanation, one_more
from ins_eval.estimation.study import Hypothesis, fit_noise
from ins_eval.policy import Policy
from ins_eval.units import UG

LARGE_UG, SMALL_UG, AT_S = 200.0, 60.0, {"x": 1440.0, "y": 2160.0, "z": 960.0}
SIGMAS = 4.0
LOUD, QUIET = 3.0, -2.0  # prior sigmas of the wander
SHORT = 0.3  # of the way to where a fit should end


@pytest.fixture(scope="module")
def stepped(recording_at_rest) -> Case:
    """At rest for an hour; the accelerometer on z has a large step, that on x a small one."""
    recording = recording_at_rest(3600.0, 2, lambda t: LARGE_UG * (t > AT_S["z"]))
    imu = recording.imu
    force = imu.accelerometer.copy()
    force[imu.time_s > AT_S["x"], 0] += SMALL_UG * UG * float(np.median(np.diff(imu.time_s)))
    return prepare(replace(recording, imu=replace(imu, accelerometer=force)))


def step(case: Case, axis: str) -> Hypothesis:
    member = case.member("accelerometer.bias_step", axis, {"at_s": AT_S[axis]})
    return Hypothesis(member, (member.column,))


def with_steps(case: Case, axes: str) -> Linearisation:
    model = [step(case, axis) for axis in axes]
    noise = fit_noise([case], [one.scaled(4.0) for one in model], [None])
    return navigated_with((case,), model, noise, np.zeros(len(model)), Policy())


def axes_of(found: Linearisation) -> list[str]:
    return [one.candidate.axis for one in found.chosen()]


def test_what_only_the_other_search_found_is_taken_with_its_size(stepped) -> None:
    both = joined((stepped,), with_steps(stepped, "z"), with_steps(stepped, "x"), Policy())
    assert axes_of(both) == ["z", "x"]
    mean, covariance = both.coefficients
    for k, size_ug in enumerate((LARGE_UG, SMALL_UG)):
        nominal = both.chosen()[k].candidate.nominal
        assert abs(mean[k] * nominal - size_ug) < SIGMAS * nominal * np.sqrt(covariance[k, k])


def test_what_the_data_do_not_have_is_not_taken_from_the_other_search(stepped) -> None:
    better = with_steps(stepped, "zx")
    assert joined((stepped,), better, with_steps(stepped, "y"), Policy()) is better


def at_wander(found: Linearisation, level: float) -> list[Fitted]:
    """The noise beside a set where accelerometers wander so much, in prior sigmas."""
    return [
        replace(one, noise_point=np.where(np.array(case.noise.free) == "accelerometer_wander", level, one.noise_point))
        for case, one in zip(found.cases, found.fitted, strict=True)
    ]


def test_what_the_wander_beside_a_set_takes_up_is_found_where_sensors_are_quiet(stepped) -> None:
    """A step on x, of which nothing is left beside accelerometers that wander so much as to hold it."""
    loud = at_noise(with_steps(stepped, "z"), at_wander(with_steps(stepped, "z"), LOUD), Policy()).own_first(1)
    gains, _ = one_more(loud.here.normal, loud.here.projection, loud.best.members, loud.space)
    assert gains.max() < loud.space.cost + Policy().sure
    both = with_further((stepped,), loud, lambda one: [at_wander(one, QUIET)], Policy())
    assert axes_of(both) == ["z", "x"]
    mean, covariance = both.coefficients
    nominal = both.chosen()[1].candidate.nominal
    assert abs(mean[1] * nominal - SMALL_UG) < SIGMAS * nominal * np.sqrt(covariance[1, 1])
    assert with_further((stepped,), both, lambda one: [at_wander(one, QUIET)], Policy()) is both


def test_a_search_that_was_led_to_a_less_probable_set_comes_back(stepped, monkeypatch) -> None:
    """Sums around a set say what is linear about the others, which may be much less than what navigating shows."""
    visited = []

    def astray(at: Point, policy: Policy) -> Linearisation:
        found = linearise(at, policy)
        if not at.taken:
            return found
        visited.append([one.candidate.axis for one in at.taken])
        wrong = next(k for k, one in enumerate(found.hypotheses) if one.key == step(stepped, "y").key)
        best = explanation((wrong,), found.best.log_bayes_factor + 10.0 * Policy().stay, found.space.cost)
        return replace(found, ranked=(best, *found.ranked))

    null = tuple(fit_noise([stepped], [], [None]))
    begin = at_own_noise(linearise(Point((stepped,), (), np.zeros(0), null), Policy()), Policy())
    monkeypatch.setattr(best_set, "linearise", astray)
    found = searched((stepped,), begin, Policy())
    assert visited[0][:1] == ["z"]
    assert ["y"] in visited
    assert axes_of(found) == visited[0]


def test_sums_around_quite_other_sizes_are_no_answer(stepped, monkeypatch) -> None:
    """A fit that ends far from the sizes that are best beside its noise: what is linear there is not trusted."""
    right, short = with_steps(stepped, "z"), []
    assert right.settled

    def stopped(cases, model, fitted, point=None, near=None) -> Point:
        at = refine(cases, model, fitted, point, near)
        if short:
            return at
        short.append(at.point)
        back = SHORT * at.point
        return Point(*_navigated(cases, at.taken, back), back, at.fitted)

    null = tuple(fit_noise([stepped], [], [None]))
    begin = at_own_noise(linearise(Point((stepped,), (), np.zeros(0), null), Policy()), Policy())
    monkeypatch.setattr(best_set, "refine", stopped)
    monkeypatch.setattr(best_set, "more_probable", lambda a, b: -1.0)  # the sums around the first point promise more
    found = searched((stepped,), begin, Policy())
    assert short
    assert found.settled
    k = axes_of(found).index("z")
    mean, covariance = found.coefficients
    nominal = found.chosen(scaled=False)[k].candidate.nominal
    assert abs(mean[k] * nominal - LARGE_UG) < SIGMAS * nominal * np.sqrt(covariance[k, k])


def test_a_search_goes_on_alike_from_one_set_at_noises_that_are_as_probable(stepped) -> None:
    null = tuple(fit_noise([stepped], [], [None]))
    begin = at_own_noise(linearise(Point((stepped,), (), np.zeros(0), null), Policy()), Policy())
    fitted = begin.fitted[0]

    def moved(nats: float) -> Linearisation:
        """The same set at a noise that is so many nats less probable."""
        step = np.sqrt(2.0 * nats) * fitted.spread[:, -1]
        return replace(begin, fitted=(replace(fitted, noise_point=fitted.noise_point + step),))

    near, far = moved(0.5 * SAME_NOISE), moved(2.0 * SAME_NOISE)
    assert fitted.nats_to(far.fitted[0]) == pytest.approx(2.0 * SAME_NOISE)
    assert alike(near, begin)
    assert not alike(far, begin)
    assert not alike(replace(near, ranked=begin.ranked[1:]), begin)
