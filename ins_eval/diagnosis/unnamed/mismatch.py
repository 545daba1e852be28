"""A located mismatch, and a disturbance that has none of the names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ins_eval.diagnosis.unnamed.where import where

if TYPE_CHECKING:
    from ins_eval.diagnosis.unnamed.locate import Interval
    from ins_eval.estimation.case import Case


class Wander(NamedTuple):
    """How far a `sensor` wanders, one `sigma`, and the most that counts as noise of its grade: m/s^2 or rad/s."""

    sensor: str
    sigma: float
    bound: float


@dataclass(frozen=True)
class Mismatch:
    """One located mismatch in recording number `recording`."""

    recording: int
    channel: str
    axis: str
    begin_s: float
    end_s: float
    where: str
    significance_sigma: float
    follows: str = ""  # what it follows, where that is known and not time


@dataclass(frozen=True, eq=False)
class UnnamedDisturbance:
    """The channel that gains most from a disturbance without a name, beside an explanation or instead of it.

    `interval` is where it was found, where one was looked for, `wander` what the sensor does where it wanders beyond
    its grade.
    """

    mismatch: Mismatch | None
    gain: float
    significance_sigma: float
    interval: Interval | None = None
    wander: Wander | None = None


def deviate(nats: float) -> float:
    """Sigmas of nats that are gained beyond their cost."""
    return float(np.sqrt(2.0 * max(nats, 0.0)))


def located(case: Case, r: int, interval: Interval, sigma: float, follows: str = "") -> Mismatch:
    """An interval of recording `r` as a mismatch, which may follow a motion or the temperature."""
    place = where(case.model, case.temperature, interval.begin_s, interval.end_s)
    return Mismatch(
        recording=r,
        channel=interval.channel.name,
        axis=interval.channel.axis,
        begin_s=interval.begin_s,
        end_s=interval.end_s,
        where=", ".join(word for word in (place, follows and f"it follows {follows}") if word),
        significance_sigma=sigma,
        follows=follows,
    )
