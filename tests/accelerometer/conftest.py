"""What the tests of the effects share."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from ins_eval.accelerometer import Population, ThermalRun


@pytest.fixture(scope="session")
def population() -> Population:
    """The default population."""
    return Population.load()


@pytest.fixture(scope="session")
def flight() -> ThermalRun:
    """A flight's temperatures, roughly: start-up warming, long fall, rise in the descent."""
    time_s = np.arange(0.0, 8401.0)
    return ThermalRun(time_s, np.interp(time_s, (0, 660, 7200, 8400), (11.0, 13.6, -11.2, -7.3)), "flight")


@pytest.fixture(scope="session")
def through() -> Callable[..., ThermalRun]:
    """A run that goes through temperatures at a constant rate, by default with a point every 60 s."""

    def build(temperatures_c: tuple[float, ...], rate_c_per_min: float, step_s: float = 60.0) -> ThermalRun:
        corners_s = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(temperatures_c))) / rate_c_per_min * 60.0))
        time_s = np.union1d(np.arange(0.0, corners_s[-1], step_s), corners_s)
        return ThermalRun(time_s, np.interp(time_s, corners_s, temperatures_c), "chamber")

    return build


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20210105)
