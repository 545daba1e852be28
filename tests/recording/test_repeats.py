"""Rows that repeat a fix until the next comes: how many fixes there were is known, since each was made once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.readers import read
from ins_eval.recording import Fixes, form
from ins_eval.recording.repeats import without_repeats
from tests.recording.test_form import flight_of

RADIUS_M, LATITUDE, LONGITUDE = 6.37e6, 0.7, 0.3
PARKED_S, SPEED_MPS, RATE_HZ = 40.0, 10.0, 5.0
FIXES = 600
COUNTED = 0.02  # of the fixes at rest, by which stamps that are not whole multiples shift their count


def fixes_of(parked_s: float) -> Fixes:
    """A vehicle that stands, its position and velocity exactly the same, and then drives north."""
    t = np.arange(FIXES) / RATE_HZ
    speed = SPEED_MPS * (t > parked_s)
    north_m = SPEED_MPS * np.clip(t - parked_s, 0.0, None)
    velocity = np.column_stack([speed, 0.0 * t, 0.0 * t])
    return Fixes(t, LATITUDE + north_m / RADIUS_M, 0.0 * t + LONGITUDE, 0.0 * t + 100.0, velocity, t >= 0.0)


def held(fixes: Fixes, rate_hz: float) -> Fixes:
    """What a logger at that rate writes of fixes: the last one, until another comes."""
    time_s = np.arange(0.0, fixes.time_s[-1], 1.0 / rate_hz)
    rows = np.searchsorted(fixes.time_s, time_s + 1e-9, side="right") - 1
    return replace(fixes.rows(rows), time_s=time_s)


def only(fixes: Fixes, columns: str) -> Fixes:
    """Without position, or without velocity."""
    empty = np.full(len(fixes.time_s), np.nan)
    if columns == "position":
        return replace(fixes, velocity_n=np.full((len(empty), 3), np.nan))
    return replace(fixes, latitude_rad=empty, longitude_rad=empty, height_m=empty)


@pytest.mark.parametrize("columns", ["both", "position", "velocity"])
@pytest.mark.parametrize("rate_hz", [7.5, 50.0, 500.0])
def test_a_fix_counts_once_however_often_it_is_written(rate_hz, columns):
    """The velocity turns, so that no two fixes have the same."""
    fixes = fixes_of(parked_s=-1.0)
    turning = np.column_stack([SPEED_MPS * np.cos(fixes.time_s), SPEED_MPS * np.sin(fixes.time_s), 0.0 * fixes.time_s])
    fixes = replace(fixes, velocity_n=turning)
    fixes = fixes if columns == "both" else only(fixes, columns)
    written = held(fixes, rate_hz)
    left, said = without_repeats(written, "gps")
    assert len(left.time_s) == FIXES - 1  # the last one ends the log
    late_s = left.time_s - fixes.time_s[:-1]
    assert late_s.min() > -1e-9 and late_s.max() < 1.0 / rate_hz
    assert f"{len(written.time_s) - FIXES + 1} of {len(written.time_s)} rows of gps repeat the row before" in said[0]
    assert f"{FIXES - 1} fixes are used" in said[0]


@pytest.mark.parametrize("columns", ["both", "position"])
@pytest.mark.parametrize("parked_s", [PARKED_S, 1000.0])
def test_a_receiver_that_stands_still_has_its_fixes(parked_s, columns):
    fixes = fixes_of(parked_s)
    fixes = fixes if columns == "both" else only(fixes, columns)
    assert without_repeats(fixes, "gps") == (fixes, [])


def test_at_rest_as_many_are_left_as_the_receiver_makes_in_motion():
    left, _ = without_repeats(held(fixes_of(PARKED_S), 50.0), "gps")
    at_rest = np.count_nonzero(left.time_s < PARKED_S)
    assert at_rest == pytest.approx(PARKED_S * RATE_HZ, rel=COUNTED)
    assert len(left.time_s) == pytest.approx(FIXES, rel=COUNTED)


def test_an_outage_is_no_repeat():
    fixes = fixes_of(PARKED_S)
    lost = (fixes.time_s > 60.0) & (fixes.time_s < 70.0)
    zeros = replace(fixes, latitude_rad=np.where(lost, 0.0, fixes.latitude_rad), valid=~lost)
    assert without_repeats(zeros, "gps") == (zeros, [])


def test_the_form_and_importers_say_so(tmp_path):
    flight = flight_of(np.random.default_rng(5))
    rows = np.repeat(np.arange(len(flight.gps.time_s)), 10)
    step_s = np.diff(flight.gps.time_s).min()
    written = flight.gps.rows(rows)
    written = replace(written, time_s=written.time_s + np.tile(np.arange(10), len(rows) // 10) * step_s / 10.0)
    folder = form.write(replace(flight, gps=written), tmp_path / "flight")
    for recording in (form.read(folder), read("ins-recording", folder, {})):
        found = recording.gps
        np.testing.assert_array_equal(found.time_s[found.valid], flight.gps.time_s[flight.gps.valid])
        assert any("rows of gps repeat the row before" in note for note in recording.notes)
