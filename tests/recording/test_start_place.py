"""A start that lies elsewhere than the first fixes; the ellipsoid is pymap3d's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pymap3d import ned2geodetic

from ins_eval.recording import Fixes, Imu, Recording, Start
from ins_eval.recording.belief import Belief, GpsBelief
from ins_eval.recording.consistency import findings
from ins_eval.units import DEG

LATITUDE_DEG, LONGITUDE_DEG, HEIGHT_M = 48.0, 179.9999, 300.0  # across the line of the date
GEOID_M, FAR_M, NEAR_M = 47.0, 300.0, 4.0
LATE_S = 0.7
TOLERANCE_M = 1.0  # fixes err, and the Earth is curved


def recording(
    velocity_n: tuple[float, float, float], begins_m=(0.0, 0.0, 0.0), late_s: float = 0.0, **start
) -> Recording:
    """Steady motion from where fixes begin; the start lies `begins_m` north, east and down of it."""
    rng = np.random.default_rng(1)
    time_s, imu_s = np.arange(1.0, 31.0), np.arange(1, 3001) / 100.0
    way_m = np.outer(time_s - late_s, velocity_n) + rng.standard_normal((time_s.size, 3))
    latitude, longitude, height = ned2geodetic(*way_m.T, LATITUDE_DEG, LONGITUDE_DEG, HEIGHT_M)
    begin = [float(one) for one in ned2geodetic(*begins_m, LATITUDE_DEG, LONGITUDE_DEG, HEIGHT_M)]
    force = np.tile([0.0, 0.0, -9.80665], (imu_s.size, 1)) + 1e-3 * rng.standard_normal((imu_s.size, 3))
    gps = Fixes(time_s, latitude * DEG, longitude * DEG, height, np.tile(velocity_n, (time_s.size, 1)),
                np.ones(time_s.size, dtype=bool))  # fmt: skip
    gps.latitude_rad[1] += 0.1 * DEG  # one fix that is wrong decides nothing
    at = Start(0.0, begin[0] * DEG, begin[1] * DEG, begin[2], velocity_n, **start)
    imu = Imu(imu_s, 1e-5 * rng.standard_normal((imu_s.size, 3)), force / 100.0, "increment")
    belief = Belief(gps=GpsBelief(position_sigma_m=1.0))
    return Recording("log", "drive", at, imu, gps=gps, belief=belief)


def of_start(one: Recording) -> dict[str, str]:
    return {found.key: found.seen for found in findings(one) if found.key.startswith("start.")}


@pytest.mark.parametrize("velocity_n", [(0.0, 0.0, 0.0), (40.0, -60.0, 5.0)])
def test_a_start_where_the_fixes_begin_is_not_warned_of(velocity_n) -> None:
    """Nor one that errs as receivers do, late fixes, or a place that is said to be uncertain."""
    assert not of_start(recording(velocity_n))
    assert not of_start(recording(velocity_n, (NEAR_M, -NEAR_M, NEAR_M)))
    assert not of_start(recording(velocity_n, late_s=LATE_S))
    assert not of_start(recording(velocity_n, (FAR_M, 0.0, GEOID_M), position_sigma_m=FAR_M))


@pytest.mark.parametrize("velocity_n", [(0.0, 0.0, 0.0), (40.0, -60.0, 5.0)])
@pytest.mark.parametrize(("down_m", "side"), [(-GEOID_M, "above"), (GEOID_M, "below")])
def test_a_height_above_the_sea_beside_one_above_the_ellipsoid_is(velocity_n, down_m: float, side: str) -> None:
    found = of_start(recording(velocity_n, (0.0, 0.0, down_m)))
    assert list(found) == ["start.height"]
    stated = found["start.height"].split(f" m {side} that of gps")[0].rsplit(" ", 1)[-1]
    assert float(stated) == pytest.approx(GEOID_M, abs=TOLERANCE_M)


def test_a_start_long_before_the_fixes_is_held_against_them_where_it_stood_until_then() -> None:
    begun = recording((0.0, 0.0, 0.0), (0.0, 0.0, -GEOID_M))
    earlier = replace(begun.start, time_s=-120.0)
    assert not of_start(replace(begun, start=earlier))  # it may have come from elsewhere
    assert list(of_start(replace(begun, start=replace(earlier, still_until_s=0.0)))) == ["start.height"]


def test_another_place_is() -> None:
    found = of_start(recording((3.0, 0.0, 0.0), (0.0, FAR_M, 0.0)))
    assert list(found) == ["start.place"]
    stated = found["start.place"].split(" m from that of gps")[0].rsplit(" ", 1)[-1]
    assert float(stated) == pytest.approx(FAR_M, abs=TOLERANCE_M)
