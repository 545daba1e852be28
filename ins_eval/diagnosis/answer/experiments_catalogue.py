"""The catalogue of experiments: what can be done with the instrument whose recordings are at hand, cheapest first.

A box that is parked can be left standing, turned and tumbled; one with a thermometer can be put into an oven; one that
was recorded on the move can move again; and one accelerometer can be taken out and put into a chamber.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ins_eval.diagnosis.answer import experiments_plans as plans
from ins_eval.units import HOUR

if TYPE_CHECKING:
    from ins_eval.estimation.case import Case
    from ins_eval.recording import ChamberReadings, Recording

MOVING = ("flight", "drive")
SPAN_C = 30.0  # of an oven, around the middle of what was recorded
OVEN_LEGS_C_PER_MIN = (0.2, 0.5, 1.0, 1.0)  # down and up in turn
CHAMBER_C = (-10.0, 50.0)
RAMPS_C_PER_MIN = (0.2, 0.5, 1.0)  # down and up each
POSITIONS_G = (1.0, 0.0, -1.0, 0.0)
LONGEST_H = 3


@dataclass(frozen=True, eq=False)
class Experiment:
    """One row; `plan` makes the recording as believed, None: the recordings at hand once more.

    `anew` are the effects, by the beginning of their names, that are not the same in it, besides those that are local.
    """

    name: str
    cost: int  # rank
    plan: Callable[[], Recording | ChamberReadings] | None
    anew: tuple[str, ...] = ()


def experiments(cases: Sequence[Case], like: Case | None, axes: Sequence[str]) -> list[Experiment]:
    """What the recordings at hand permit, cheapest first.

    `like` is the case whose belief is followed, None where all are chambers; `axes` the accelerometers to take out.
    """
    kinds = {case.kind for case in cases}
    thermal = [case for case in ([like] if like else []) + list(cases) if case.temperature is not None]
    once_more = "the same again" if len(cases) == 1 else "all of it again"
    cost = 20 if "flight" in kinds else 11 if kinds & {"chamber", "oven"} else 9 if "drive" in kinds else 1
    found = [Experiment(once_more, cost, None)]
    if like is not None:
        found += _parked(like)
        if thermal:
            found += _ovens(like, thermal[0])
        if like.kind in MOVING:
            found += _moving(like)
            receiver = f"{once_more}, with another receiver and its antenna surveyed"
            found.append(Experiment(receiver, cost + 1, None, ("gps.",)))
    if thermal:
        found += [one for axis in axes for one in _chambers(axis)]
    return sorted(found, key=lambda one: one.cost)


def _parked(like: Case) -> list[Experiment]:
    lasted_s = float(like.model.nodes_s[-1] - like.model.nodes_s[0])
    hours = int(np.clip(np.ceil(3.0 * lasted_s / HOUR), 1, LONGEST_H))
    return [
        _still(like, 2, f"a parked recording of {hours} h", (plans.LEVEL,), hours * HOUR),
        _still(like, 3, "turning the box through four headings while parked", plans.HEADINGS, 900.0),
        _still(like, 4, "a tumble: parked on six faces in turn", plans.FACES, 600.0),
    ]


def _ovens(like: Case, thermal: Case) -> list[Experiment]:
    seen = thermal.temperature
    middle = 0.5 * float(seen.smooth_c.min() + seen.smooth_c.max())
    low, high = middle - 0.5 * SPAN_C, middle + 0.5 * SPAN_C
    since_s = seen.time_s - seen.time_s[0]
    again = f"an oven run with {'the flight' if like.kind == 'flight' else 'the recording'}'s temperatures"
    legs_s, legs_c = plans.ramps(OVEN_LEGS_C_PER_MIN, low, high)
    cycle_s, cycle_c = plans.ramps(OVEN_LEGS_C_PER_MIN[-2:], low, high)

    def recorded(time_s: np.ndarray) -> np.ndarray:
        return np.column_stack([np.interp(time_s, since_s, of_axis) for of_axis in seen.smooth_c.T])

    def ramped(time_s: np.ndarray) -> np.ndarray:
        return np.interp(time_s, legs_s, legs_c)

    def cycled(time_s: np.ndarray) -> np.ndarray:
        return np.interp(np.remainder(time_s, cycle_s[-1]), cycle_s, cycle_c)

    faces = "an oven run on six faces in turn, cooled and warmed"
    return [
        _still(like, 5, again, (plans.LEVEL,), since_s[-1], recorded),
        _still(like, 6, f"{again}, the box upside down", (plans.UPSIDE_DOWN,), since_s[-1], recorded),
        _still(like, 7, "an oven run at three ramp rates", (plans.LEVEL,), legs_s[-1], ramped),
        _still(like, 8, faces, plans.FACES, cycle_s[1], cycled),
    ]


def _moving(like: Case) -> list[Experiment]:
    if like.kind == "drive":
        return [
            _moved(like, 10, "a second drive with S-turns", *_CAR_TURNS),
            _moved(like, 11, "a second drive with accelerations and stops", *_CAR_DASHES),
        ]
    found = [
        _moved(like, 21, "a second flight with S-turns and banked turns", *_FLIGHT_TURNS),
        _moved(like, 22, "a second flight with accelerations and dashes", *_FLIGHT_DASHES),
    ]
    if like.temperature is not None:
        warm = "a second flight with another temperature profile"
        found.append(_moved(like, 23, warm, *_FLIGHT_TWICE, ground_c=35.0))
    return found


def _still(like: Case, cost: int, name: str, faces, dwell_s: float, celsius=None) -> Experiment:
    """Parked on `faces`; `celsius` gives the temperature at instants from the start on.

    None: a room at the reference temperature, in which thermal effects do not show.
    """

    def plan() -> Recording:
        motion = plans.parked(like.believed.start, faces, float(dwell_s))
        time_s = motion.time_s[1:]
        room_c = like.believed.recording.belief.accelerometer.reference_temperature_c
        given = np.full(time_s.size, room_c) if celsius is None else celsius(time_s)
        return plans.recording(name, "static" if celsius is None else "oven", motion, given, like.believed)

    return Experiment(name, cost, plan)


def _moved(like: Case, cost: int, name: str, *what, **further) -> Experiment:
    def plan() -> Recording:
        planned = plans.profile(like.believed.start, *what, **further)
        motion, given = plans.moving(planned, banked=like.kind != "drive")
        return plans.recording(name, like.kind, motion, given, like.believed)

    return Experiment(name, cost, plan)


def _chambers(axis: str) -> list[Experiment]:
    def chamber(knots: tuple[np.ndarray, np.ndarray]) -> Callable[[], ChamberReadings]:
        return lambda: plans.chamber(axis, [(g, *knots) for g in POSITIONS_G])

    rates = plans.ramps([rate for rate in RAMPS_C_PER_MIN for _ in ("down", "up")], *CHAMBER_C)
    soaks = plans.ramps([RAMPS_C_PER_MIN[-1]] * 4, *CHAMBER_C, soak_s=2.0 * HOUR)
    where = f"accelerometer {axis} in a chamber, four positions"
    return [
        Experiment(f"{where}, +-0.2, 0.5 and 1 degC/min", 12, chamber(rates)),
        Experiment(f"{where}, soaks of 2 h", 13, chamber(soaks)),
    ]


def _s_turns(first_s: float, every_s: float, count: int, bank_deg: float) -> list[tuple[float, float, float]]:
    """Turns of 60 degrees to either side in turn."""
    return [(first_s + k * every_s, 60.0 if k % 4 in (0, 3) else -60.0, bank_deg) for k in range(count)]


# duration; speed (from, to, m/s); height (from, to, m above the start); turns (at, by, bank)
_FLIGHT_TURNS = (
    3600.0,
    [(10.0, 70.0, 90.0), (3520.0, 3590.0, 0.0)],
    [(70.0, 670.0, 2000.0), (2900.0, 3500.0, 0.0)],
    _s_turns(700.0, 60.0, 12, 25.0) + [(1500.0 + 150.0 * k, 360.0, 45.0 if k % 2 else 60.0) for k in range(8)],
)
_DASHES = [(700.0 + 200.0 * k, 760.0 + 200.0 * k, 200.0 if k % 2 == 0 else 90.0) for k in range(10)]
_FLIGHT_DASHES = (
    3600.0,
    [(10.0, 70.0, 90.0), *_DASHES, (3520.0, 3590.0, 0.0)],
    [(70.0, 670.0, 2000.0), (2900.0, 3500.0, 0.0)],
    [(900.0, 180.0, 25.0), (1700.0, 180.0, 25.0), (2500.0, 180.0, 25.0)],
)
_FLIGHT_TWICE = (
    7200.0,
    [(10.0, 70.0, 90.0), (7120.0, 7190.0, 0.0)],
    [(70.0, 1270.0, 7000.0), (2400.0, 3300.0, 500.0), (4000.0, 5000.0, 7000.0), (6000.0, 7000.0, 0.0)],
    [(1800.0 + 1500.0 * k, 180.0, 25.0) for k in range(4)],
)
_CAR_TURNS: tuple[Any, ...] = (
    2400.0,
    [(300.0, 320.0, 15.0), (2070.0, 2090.0, 0.0)],
    [],
    _s_turns(350.0, 40.0, 20, 10.0) + [(1300.0 + 80.0 * k, 360.0, 15.0) for k in range(8)],
)
_CAR_DASHES: tuple[Any, ...] = (
    2400.0,
    [(300.0 + 50.0 * k, 312.0 + 50.0 * k, 25.0 if k % 2 == 0 else 0.0) for k in range(36)],
    [],
    [(320.0 + 400.0 * k, 90.0, 10.0) for k in range(4)],
)
