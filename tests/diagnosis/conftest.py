"""Flights without any noise, made by the simulator, as what a perfect instrument and receiver would record."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

from ins_eval.imu import Mission
from ins_eval.profile import load
from ins_eval.recording import Recording
from ins_eval.units import DEG

RATE_HZ = 20.0


@cache
def mission(name: str) -> Mission:
    return Mission(load(name), RATE_HZ)


@cache
def ideal(name: str) -> Recording:
    """A recording whose increments and fixes are exact, with an attitude that is believed to a few arc seconds."""
    made = mission(name).ideal()
    parked = mission(name).profile.kind == "static"
    start = replace(made.start, attitude_sigma_rad=(0.003 * DEG, 0.003 * DEG, 0.06 * DEG))
    fixes = None if parked else replace(made.reference, attitude_rad=None)
    return replace(made, kind="static" if parked else "flight", start=start, reference=None, gps=fixes)


@pytest.fixture(scope="session")
def flight() -> Recording:
    return ideal("climb-cruise-landing")


@pytest.fixture(scope="session")
def ideal_recording():
    return ideal
