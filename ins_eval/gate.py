"""What the gate holds: that hysteresis compensation is better in flight, and that nothing else was made worse for it.

Each instrument flies the paper's flight and a mission of its own, once with each compensation. Held are

1. on the paper's flight, the gain of `hysteresis_refined` over `simple`, as Paper A compares them;
2. over missions, the gain of `hysteresis` over `simple`, where refinement plays no part;
3. on both, that `hysteresis_refined` is not worse against `simple_refined`, which is refined alike, than committed;
4. on both, the errors of each compensation: neither larger nor smaller than committed.

A gain holds if the upper 95 % bound of the paired ratio R lies below 1 and the gain is at least half of the committed
one, R <= 1 - (1 - R_n)/2. In 3 and 4 a quantity Q of N instruments is compared with Q_n, committed from n others:

    |log(Q / Q_n)| <= z sd_n sqrt(n/N + 1)        in 3 from above only

What is committed stands in ``gate.toml`` beside this module (`COMMITTED_FILE`).
sd_n is the standard deviation of log Q over ensembles of n. z leaves an unchanged run the probability (1 - P)/k to fail
in one of the k conditions, so that all of them together hold with the probability P or more, however they depend.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import exp, inf, log, sqrt
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field, model_validator
from scipy import stats

from ins_eval import ensemble, metrics
from ins_eval.ensemble import Plan
from ins_eval.ensemble.inference import power_size
from ins_eval.metrics import Estimate
from ins_eval.streams import Streams
from ins_eval.tables import Strict

COMMITTED_FILE = Path(__file__).with_name("gate.toml")

ARMS = ("simple", "hysteresis", "simple_refined", "hysteresis_refined")
MEASURES = {"cep_rate_final": "CEP rate", "velocity_rms_horizontal": "velocity RMS"}
FLIGHTS = ("paper", "missions")
MISSIONS = "worldwide"
MIRRORED = "2 simple - hysteresis_refined"  # as much worse than simple as hysteresis_refined is better

AS_PAPER_A = "hysteresis_refined/simple"  # the refinement is hysteresis's alone
UNREFINED = "hysteresis/simple"
REFINED_ALIKE = "hysteresis_refined/simple_refined"
GAINS = ((1, "paper", AS_PAPER_A), (2, "missions", UNREFINED))
NOT_WORSE = tuple((3, flight, REFINED_ALIKE) for flight in FLIGHTS)
ERRORS = tuple((4, flight, arm) for flight in FLIGHTS for arm in ARMS)
MIRROR, ITSELF = CONTROLS = f"{MIRRORED}/simple", "simple/simple"  # on the paper's flight
PAIRS = {"paper": (AS_PAPER_A, REFINED_ALIKE, *CONTROLS), "missions": (UNREFINED, REFINED_ALIKE)}

HELD_SHARE = 0.5  # of a committed gain
POWER = 0.995  # of all conditions together
COUNT = len(MEASURES) * (2 * len(GAINS) + len(NOT_WORSE) + len(ERRORS))
EACH = (1.0 - POWER) / COUNT  # probability of one condition to fail although nothing changed
RESAMPLES = 2000
# log_sd is found from resampled ensembles a tenth as large, times sqrt(1/10): the bootstrap of a median of n errs by
# n^(-1/4) (Hall and Martin 1988), 18 % for 1000, since only few values lie next to it.
PARTS = 10
LARGEST = 1300  # instruments in five minutes on two quiet cores, at 0.45 s each

STATISTICS = {measure: ensemble.STATISTICS[measure] for measure in MEASURES}

Arms = Mapping[str, Mapping[str, np.ndarray]]  # [arm][measure], with the instruments along the first axis
Quantities = Mapping[str, Mapping[str, Estimate]]  # [arm or "arm/other"][measure]


class Found(Strict):
    """A quantity, and the standard deviation of its logarithm over ensembles of the stated size."""

    value: Annotated[float, Field(gt=0.0)]
    log_sd: Annotated[float, Field(ge=0.0, le=1.0)]


class CommittedMeasures(Strict):
    """A compensation, or one against another, in each of `MEASURES`."""

    cep_rate_final: Found
    velocity_rms_horizontal: Found


class Sizes(Strict):
    """How many instruments flew."""

    paper: Annotated[int, Field(ge=2)]
    missions: Annotated[int, Field(ge=2)]

    def of(self, flight: str) -> int:
        """Of one of `FLIGHTS`."""
        return getattr(self, flight)


class Committed(Strict):
    """What was found with so many instruments: ``paper`` and ``missions`` by arm or "arm/other"."""

    seed: int
    size: Sizes
    paper: dict[str, CommittedMeasures]
    missions: dict[str, CommittedMeasures]

    @model_validator(mode="after")
    def _complete(self) -> Committed:
        for _, flight, quantity in (*GAINS, *NOT_WORSE, *ERRORS):
            if quantity not in getattr(self, flight):
                raise ValueError(f"'{flight}.\"{quantity}\"' is missing; write the file with --commit")
        for _, flight, quantity in GAINS:
            for measure in MEASURES:
                if (ratio := self.found(flight, quantity, measure).value) >= 1.0:
                    raise ValueError(f'{flight}."{quantity}".{measure}: {ratio:g} is no gain; expected below 1')
        return self

    def found(self, flight: str, quantity: str, measure: str) -> Found:
        """One quantity of one of `FLIGHTS` in one of `MEASURES`."""
        return getattr(getattr(self, flight)[quantity], measure)

    def needed(self, flight: str, quantity: str, measure: str) -> int:
        """Instruments with which both conditions on a gain hold with the power asked for, at the committed gain."""
        gain = self.found(flight, quantity, measure)
        room = log(_half(gain.value)) - log(gain.value)  # between the gain and half of it
        return max(
            power_size(log(gain.value), gain.log_sd, self.size.of(flight), power=1.0 - EACH),
            power_size(-room, gain.log_sd, self.size.of(flight), confidence=0.0, power=1.0 - EACH),
        )

    def gains(self, held: bool = True) -> list[tuple[int, str, str, str]]:
        """Number, flight, quantity and measure of the gains that `LARGEST` instruments can hold, or of the others."""
        every = [(*gain, measure) for gain in GAINS for measure in MEASURES]
        return [gain for gain in every if (self.needed(*gain[1:]) <= LARGEST) == held]

    @property
    def power_size(self) -> int:
        """Instruments that every gain held needs."""
        return max((self.needed(*gain[1:]) for gain in self.gains()), default=2)


class Condition(NamedTuple):
    """One number that the gate holds between two limits; `words` say which number and why the limits."""

    number: int
    flight: str
    quantity: str
    measure: str
    words: str
    seen: float
    low: float
    high: float

    @property
    def met(self) -> bool:
        return self.low <= self.seen <= self.high

    @property
    def margin(self) -> float:
        """By what share the number may still move towards the nearer limit; below 0 where it is not met."""
        return min(self.seen / self.low - 1.0 if self.low else inf, 1.0 - self.seen / self.high)

    @property
    def limits(self) -> str:
        return f"{self.low:.3f} to {self.high:.3f}" if self.low else f"at most {self.high:.3f}"

    @property
    def subject(self) -> str:
        return f"{self.number}, {self.flight}, {self.quantity}, {MEASURES[self.measure]}"


def conditions(seen: Mapping[str, Quantities], committed: Committed, size: int) -> list[Condition]:
    """Every condition with what `size` instruments have shown, by flight."""
    found = []
    for number, flight, quantity, measure in committed.gains():
        gain = committed.found(flight, quantity, measure)
        found += gain_conditions((number, flight, quantity, measure), seen[flight][quantity][measure], gain)
    for (number, flight, quantity), sides in [(q, 1) for q in NOT_WORSE] + [(q, 2) for q in ERRORS]:
        for measure in MEASURES:
            value, before = seen[flight][quantity][measure].value, committed.found(flight, quantity, measure)
            width = band(before, committed.size.of(flight), size, sides)
            low = before.value * exp(-width) if sides == 2 else 0.0
            words = f"committed {before.value:.3f} {'+-' if sides == 2 else '+'}{100.0 * (exp(width) - 1.0):.1f} %"
            high = before.value * exp(width)
            found.append(Condition(number, flight, quantity, measure, words, value, low, high))
    return found


def gain_conditions(subject: tuple[int, str, str, str], ratio: Estimate, gain: Found) -> list[Condition]:
    """The two conditions on a gain: it is sure, and at least half of the committed one."""
    half = _half(gain.value)
    return [
        Condition(*subject, "upper bound, no gain at 1", ratio.high, 0.0, float(np.nextafter(1.0, 0.0))),
        Condition(*subject, f"half of the committed gain, ratio {gain.value:.3f}", ratio.value, 0.0, half),
    ]


def band(committed: Found, n: int, size: int, sides: int) -> float:
    """Width of a band on the logarithm: what `size` instruments may differ by from n others, on one side or two."""
    return float(stats.norm.isf(EACH / sides)) * committed.log_sd * sqrt(n / size + 1.0)


def control_faults(paper: Quantities, committed: Committed) -> list[str]:
    """The gate must fail a model as much worse as hysteresis is better, and see nothing where nothing differs."""
    faults = []
    number, flight, quantity = GAINS[0]
    for measure in MEASURES:
        gain = committed.found(flight, quantity, measure)
        mirrored = gain_conditions((number, flight, MIRRORED, measure), paper[MIRROR][measure], gain)
        if all(condition.met for condition in mirrored):
            faults.append(f"the control '{MIRRORED}' passed in {MEASURES[measure]}, so the gate proves nothing")
    if any(tuple(ratio) != (1.0, 1.0, 1.0) for ratio in paper[ITSELF].values()):
        faults.append("'simple' against itself is not exactly 1, so the pairs are not paired")
    return faults


def fly(
    output: Path,
    profile: str,
    seed: int,
    sizes: Sizes,
    workers: int | None,
    quiet: bool,
    scheduler: str | None = None,
) -> dict[str, Arms]:
    """Fly so many instruments: what each contributes to every measure, by flight."""
    plans = {
        "paper": (Plan(profile=profile, arms=(*ARMS, MIRRORED), seed=seed), sizes.paper),
        "missions": (Plan(profile=profile, arms=ARMS, seed=seed, missions=MISSIONS), sizes.missions),
    }
    members = ensemble.run(plans, output / "members", workers, quiet, scheduler)
    groups = {flight: ensemble.stacked(of_flight) for flight, of_flight in members.items()}
    return {flight: {arm: groups[flight][arm] for arm in plan.arms} for flight, (plan, _) in plans.items()}


def compare(flown: Mapping[str, Arms], seed: int) -> dict[str, Quantities]:
    """Every quantity with its paired bootstrap interval, by flight."""
    seen = {}
    for flight, pairs in PAIRS.items():
        split = [tuple(pair.split("/")) for pair in pairs]
        rng = Streams(seed).at("gate", flight).rng()
        compared = metrics.paired_bootstrap(flown[flight], STATISTICS, split, rng)
        ratios = {
            pair: {measure: Estimate(*ratio[:3]) for measure, ratio in of_measure.items()}
            for pair, of_measure in compared.ratios.items()
        }
        seen[flight] = compared.arms | ratios
    return seen


def commit(flown: Mapping[str, Arms], sizes: Sizes, seed: int) -> str:
    """The text of a file that `Committed` reads."""
    lines = [
        "# What `ins-eval check-cep` holds, written by its option --commit: errors of each compensation (CEP rate in",
        "# nmi/h, velocity RMS in m/s), and those of one over those of another. log_sd is the standard deviation of",
        "# the logarithm over ensembles of this size.",
        f"seed = {seed}",
        "",
        "[size]",
        *(f"{flight} = {sizes.of(flight)}" for flight in FLIGHTS),
    ]
    for flight, arms in flown.items():
        size = sizes.of(flight)
        part = max(2, size // PARTS)
        drawn = Streams(seed).at("gate", "scatter", flight).rng().integers(0, size, (RESAMPLES, part))
        for _, _, quantity in (held for held in (*GAINS, *NOT_WORSE, *ERRORS) if held[1] == flight):
            lines += ["", f'[{flight}."{quantity}"]']
            for measure in MEASURES:
                value = exp(_log(arms, quantity, measure, np.arange(size)))
                log_sd = np.std(_log(arms, quantity, measure, drawn), ddof=1) * sqrt(part / size)
                lines.append(f"{measure} = {{ value = {value:.5f}, log_sd = {log_sd:.5f} }}")
    return "\n".join([*lines, ""])


def _log(arms: Arms, quantity: str, measure: str, chosen: np.ndarray) -> np.ndarray:
    """Logarithm of an arm, or of "arm/other", of the instruments `chosen` (..., n): (...)."""
    first, *other = (np.log(STATISTICS[measure](arms[arm][measure][chosen])) for arm in quantity.split("/"))
    return first - other[0] if other else first


def _half(ratio: float) -> float:
    """The ratio with the held share of the gain."""
    return 1.0 - HELD_SHARE * (1.0 - ratio)
