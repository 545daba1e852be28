"""A textbook chamber: steps 1-6 of Paper A without noise, for any scale factor and bias."""

import numpy as np
import pytest

from ins_eval.recording import ChamberReadings

TAU_S = 180.0


def closed_form_rate(time_s, corner_s, corner_c):
    """Filtered rate of a straight-sided programme: each side adds its slope times the step response of the filter."""
    rate = np.zeros_like(time_s)
    slopes = np.diff(corner_c) / np.diff(corner_s)
    for start, change in zip(corner_s[:-1], np.diff(slopes, prepend=0.0), strict=True):
        since = np.clip(time_s - start, 0.0, None)
        rate += 60.0 * change * (1.0 - np.exp(-since / TAU_S))
    return rate


def programme(ramp_c_per_min, soak_min=60.0):
    """Time, temperature and its filtered rate: 22 degC, down to -60, up to 70, back to 22; one reading a minute."""
    corner_s = 60.0 * np.cumsum([0.0, soak_min, 82.0 / ramp_c_per_min, 130.0 / ramp_c_per_min, 48.0 / ramp_c_per_min])
    corner_c = np.array([22.0, 22.0, -60.0, 70.0, 22.0])
    # readings between the corners make the reading straight only if the corners are read too
    time_s = np.union1d(np.arange(0.0, corner_s[-1], 60.0), corner_s)
    return time_s, np.interp(time_s, corner_s, corner_c), closed_form_rate(time_s, corner_s, corner_c)


def textbook_chamber(scale, bias_ug, ramps=(0.3, 0.9), positions=(1.0, 0.0, -1.0, 0.0), k2_per_g=0.0):
    """Readings by E = K1(T, r) (K0(T, r) + a + K2 a^2)."""
    columns, begin = [], 0.0
    for ramp in ramps:
        time_s, temperature, rate = programme(ramp)
        for force in positions:
            output = scale(temperature, rate) * (1e-6 * bias_ug(temperature, rate) + force + k2_per_g * force**2)
            run = np.full(time_s.size, len(columns))
            columns.append((begin + time_s, run, 0 * time_s + force, 0 * time_s + ramp, temperature, output))
            begin += time_s[-1] + 600.0
    return ChamberReadings(*(np.concatenate(column) for column in zip(*columns, strict=True)))


@pytest.fixture
def chamber_of():
    return textbook_chamber


@pytest.fixture
def programme_of():
    return programme
