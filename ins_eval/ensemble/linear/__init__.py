"""Experiment "linear": the flight of a block of instruments by first-order error dynamics along the true flight.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ins_eval.ensemble.linear.course import Course
from ins_eval.ensemble.linear.flight import fly
from ins_eval.ensemble.linear.instruments import Instruments
from ins_eval.ensemble.world import World
from ins_eval.imu import Mission

BLOCK = 40  # instruments that are worked out together


@lru_cache(maxsize=8)
def course_of(mission: Mission) -> Course:
    """The course of a mission that many instruments share."""
    return Course(mission)


def member(world: World, index: int) -> dict[str, dict[str, np.ndarray]]:
    """One block of instruments."""
    return fly_linearly(world, range(BLOCK * index, BLOCK * (index + 1)))


def fly_linearly(world: World, indexes) -> dict[str, dict[str, np.ndarray]]:
    instruments = Instruments(world, indexes)
    triads = instruments.triads(course_of(world.oven))
    return fly(instruments, course_of(world.flight), triads)
