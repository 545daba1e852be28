"""Every threshold that decides a verdict, in one place.

Nats are natural logarithms of odds: 3 nats are odds of 20 to 1, 4.6 of 100 to 1. `chosen_on` says on what a threshold
was chosen; `benchmark.runners.policy` writes how verdicts move where it is halved or doubled.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields

REASONING = "reasoning, no data"
DEVELOPMENT = "simulated cases of the development sets"
PLANNED_NULLS = "simulated nulls, with receivers that have memory among them"
REAL = "real recordings without a known fault"


def _chosen(default: float, on: str, means: str) -> float:
    return field(default=default, metadata={"chosen_on": on, "means": means})


@dataclass(frozen=True)
class Policy:
    """Thresholds of a diagnosis, each with its meaning and what it was chosen on (`described`)."""

    # what a search may find
    odds: float = _chosen(0.5, REASONING, "prior odds of a further effect being there at all")
    most_effects: float = _chosen(24, REASONING, "effects in a set")
    beam: float = _chosen(12, DEVELOPMENT, "sets of each size that are carried on")
    worth_sets: float = _chosen(1.0, REASONING, "nats of the best single effect from which sets are looked at")
    share: float = _chosen(0.01, DEVELOPMENT, "share of the first effect's nats that another of its sensor must gain")
    share_chamber: float = _chosen(0.03, DEVELOPMENT, "the same where a recording is of a chamber")
    handicap: float = _chosen(3.0, REASONING, "nats that an effect composed of a recorded column pays")
    repeats: float = _chosen(1.5, REASONING, "nats that an effect pays where a simpler one would show alike")
    worth_refitting: float = _chosen(2.0, REASONING, "nats, at the noise of the null, from which a set is refitted")
    stay: float = _chosen(0.5, REASONING, "nats by which another set must lead that which was navigated with")
    sure: float = _chosen(
        3.0, REASONING, "nats beyond its cost that an effect beside others must gain: 1 in 20 by chance"
    )
    earth: float = _chosen(30.0, REASONING, "nats from which a term of the Earth is tried by navigating with it")
    most_of_set: float = _chosen(0.5, REASONING, "share of a set's nats from which an effect is tried alone, likewise")
    # what counts as a mismatch
    least_gain_chamber: float = _chosen(10.0, REAL, "nats below which nothing counts in a chamber")
    remarkable: float = _chosen(0.5, REASONING, "probability of an interval up to which it is refitted")
    suspects: float = _chosen(2, REASONING, "intervals of a recording that are refitted")
    hopeless: float = _chosen(1.0, REASONING, "nats below the null from which a fit of the noise is not tried")
    promising: float = _chosen(4.0, REASONING, "nats from which a dependence has its noise fitted")
    alone: float = _chosen(10.0, PLANNED_NULLS, "nats that one sensor must gain over all that wander alike")
    wander: float = _chosen(2.0, DEVELOPMENT, "prior sigmas beyond which a sensor's wander is no noise of its grade")
    stated: float = _chosen(2.0, REAL, "stated sigmas within which a receiver's slow position error is no mismatch")
    interval: float = _chosen(0.003, PLANNED_NULLS, "largest false alarm probability of an interval of a sensor")
    interval_position: float = _chosen(1e-6, PLANNED_NULLS, "the same of a position")
    interval_velocity: float = _chosen(1e-4, PLANNED_NULLS, "the same of a velocity")
    interval_navigation: float = _chosen(1e-5, PLANNED_NULLS, "the same of the navigation equations")
    interval_attitude: float = _chosen(1e-4, PLANNED_NULLS, "the same of a reference's attitude")
    # what counts as an explanation
    harm: float = _chosen(5.0, REAL, "nats that effects may lose on data that were not used")
    left_open: float = _chosen(1e-3, DEVELOPMENT, "share of what effects gain that linear sums leave open")
    open_margin: float = _chosen(6.0, DEVELOPMENT, "nats by which a form without a name must lead effects")
    most_of_one: float = _chosen(4, DEVELOPMENT, "effects of one sensor, constants aside, that explain something")
    unusual: float = _chosen(10.0, DEVELOPMENT, "usual sizes beyond which two effects of one sensor only describe it")
    returned: float = _chosen(3.0, REASONING, "sigmas within which two jumps cancel: one that returns")
    unmeasured: float = _chosen(
        0.05,
        REASONING,
        "share of a recording in which a sensor with an effect may hold one value or be at a limit",
    )
    probable: float = _chosen(0.5, REASONING, "probability that an effect must have to be named")
    plain: float = _chosen(5.0, REAL, "sigmas from which an effect is named whatever stays unexplained beside it")
    # what else is listed
    near: float = _chosen(3.0, REASONING, "nats below the answer within which another effect is a rival")
    twin: float = _chosen(9.0, REASONING, "more of chi-square, at any size, up to which another is listed: 3 sigma")
    listed: float = _chosen(4.6, REASONING, "nats within which others are listed where there is a rival")
    alike: float = _chosen(0.25, REASONING, "nats of likelihood below which only priors tell two apart")
    experiment_enough: float = _chosen(5.0, REASONING, "nats that an experiment must add to be recommended")
    experiment_worth: float = _chosen(3.0, REASONING, "nats to be named at all where none adds enough")

    def nats_left_open(self, gain: float) -> float:
        """What the linear sums of effects that gain so many nats leave open."""
        return self.left_open * max(gain, 0.0)

    def least_share(self, kinds: Iterable[str]) -> float:
        """The share of the first effect's nats that another of its sensor must gain, in recordings of these kinds."""
        return max((self.share_chamber if kind == "chamber" else self.share for kind in kinds), default=0.0)

    def largest_probability(self, channel: str) -> float:
        """The largest false alarm probability with which an interval of a channel of this name counts as a mismatch.

        What measures has slow errors and steps of its own.
        """
        of_channel = {
            "gps.position": self.interval_position,
            "gps.velocity": self.interval_velocity,
            "navigation": self.interval_navigation,
            "reference.attitude": self.interval_attitude,
        }
        return of_channel.get(channel, self.interval)

    @classmethod
    def described(cls) -> dict[str, tuple[float, str, str]]:
        """Of each threshold its value, what it means and what it was chosen on."""
        return {one.name: (one.default, one.metadata["means"], one.metadata["chosen_on"]) for one in fields(cls)}
