"""Mix-ups of units, axes and clocks that a recording betrays because its parts do not fit each other.

Each check refuses only where one named mix-up would explain what is seen, or where nothing could.
"""

from __future__ import annotations

import numpy as np
from pymap3d.haversine import anglesep_meeus

from ins_eval.earth import radii
from ins_eval.errors import DataRefused
from ins_eval.recording import Fixes, Recording, consistency
from ins_eval.units import DEG, STANDARD_GRAVITY

APART_M = 50e3  # the first fix from the start, beside what is travelled meanwhile: an airport, not a country
FASTEST_MPS = 1000.0
FORCE_TOLERANCE = 0.1  # of a mix-up's factor
ORDINARY_FORCE = (0.5, 2.0)  # of gravity, for the median over a recording
MOVING_MPS = 5.0  # above it a vehicle goes where it points
ALONG_RAD = 0.2
ASTRAY_RAD = 0.5
ENOUGH_FIXES = 10


def check_plausible(recording: Recording) -> None:
    """Refuse a recording whose parts contradict each other; raises DataRefused.

    The list of `consistency` belongs to `validate`; a reference without positions, which that does not see, is held
    against it here.
    """
    where = f"recording '{recording.name}'"
    for name, fixes, believed in (
        ("gps", recording.gps, recording.belief.gps),
        ("reference", recording.reference, recording.belief.reference),
        ("solution", recording.solution, recording.belief.solution),
    ):
        if fixes is not None:
            stamps_s = fixes.time_s - believed.time_offset_s
            if recording.imu is not None:
                _check_clock(recording, stamps_s, f"{where}, {name}", name)
            if np.isfinite(recording.start.latitude_rad):
                _check_place(recording, fixes, stamps_s, f"{where}, {name}")
            _check_heading(fixes, f"{where}, {name}")
    if recording.imu is None:
        return
    _check_force(recording, where)
    reference = recording.reference
    if reference is not None and not np.isfinite(reference.latitude_rad).any():
        consistency.report(recording, consistency.findings(recording), where)


def _check_clock(recording: Recording, stamps_s: np.ndarray, where: str, name: str) -> None:
    """Fixes and samples have some time in common."""
    first_s, last_s = recording.start.time_s, float(recording.imu.time_s[-1])
    if stamps_s[-1] < first_s or stamps_s[0] > last_s:
        raise DataRefused(
            f"{where}: covers {stamps_s[0]:.3f} to {stamps_s[-1]:.3f} s and the IMU {first_s:.3f} to {last_s:.3f} s, "
            f"expected an overlap; bring both to one clock, or state time_offset_s in [{name}]"
        )


def _check_place(recording: Recording, fixes: Fixes, stamps_s: np.ndarray, where: str) -> None:
    """The first fix is where the vehicle can be by then."""
    known = np.flatnonzero(fixes.valid & np.isfinite(fixes.latitude_rad) & np.isfinite(fixes.longitude_rad))
    if not known.size:
        return
    start = recording.start
    at = (start.latitude_rad, start.longitude_rad)
    latitude, longitude = float(fixes.latitude_rad[known[0]]), float(fixes.longitude_rad[known[0]])
    reach_m = APART_M + FASTEST_MPS * abs(float(stamps_s[known[0]]) - start.time_s)
    if _distance_m(at, (latitude, longitude)) <= reach_m:
        return
    mix_ups = {
        "radians given for degrees": (latitude / DEG, longitude / DEG),
        "the start given in radians": (latitude * DEG, longitude * DEG),
        "latitude and longitude exchanged": (longitude, latitude),
        "west given as east": (latitude, -longitude),
        "south given as north": (-latitude, longitude),
    }
    guess = next((f" ({mix_up}?)" for mix_up, place in mix_ups.items() if _distance_m(at, place) <= reach_m), "")
    raise DataRefused(
        f"{where}: the first fix is at latitude {latitude / DEG:.5f}, longitude {longitude / DEG:.5f} degrees, "
        f"{_distance_m(at, (latitude, longitude)) / 1e3:.0f} km from the start at {at[0] / DEG:.5f}, {at[1] / DEG:.5f}"
        f"{guess}, expected at most {reach_m / 1e3:.0f} km; correct the position that is wrong"
    )


def _distance_m(one: tuple[float, float], other: tuple[float, float]) -> float:
    """Great-circle distance on the sphere of the transverse radius of the first place; any angles, also absurd ones."""
    return float(radii(one[0])[1] * anglesep_meeus(one[1], one[0], other[1], other[0], deg=False))


def _check_heading(fixes: Fixes, where: str) -> None:
    """A moving vehicle points about where it goes; refused where it does so only if the heading is in radians."""
    if fixes.attitude_rad is None:
        return
    north, east = fixes.velocity_n[:, 0], fixes.velocity_n[:, 1]
    heading = fixes.attitude_rad[:, 2]
    moving = fixes.valid & (np.hypot(north, east) > MOVING_MPS) & np.isfinite(heading)
    if np.count_nonzero(moving) < ENOUGH_FIXES:
        return
    course = np.arctan2(east[moving], north[moving])

    def off_course(angle: np.ndarray) -> float:
        return float(np.median(np.abs(np.remainder(angle - course + np.pi, 2.0 * np.pi) - np.pi)))

    as_given, as_radians = off_course(heading[moving]), off_course(heading[moving] / DEG)
    if as_given > ASTRAY_RAD and as_radians < ALONG_RAD:
        raise DataRefused(
            f"{where}: heading_deg is {as_given / DEG:.0f} degrees off the course of the velocity and fits it as "
            "radians, expected degrees; convert roll, pitch and heading to degrees"
        )


def _check_force(recording: Recording, where: str) -> None:
    """The median specific force is not that of gravity in another unit, and its mean no less than gravity makes it.

    Over T seconds |mean f| = |g - change of velocity / T|, whatever it did, and the mean of |f| is no less.
    """
    imu = recording.imu
    per_unit = recording.belief.accelerometer.mps_per_pulse if imu.accelerometer_form == "pulse" else np.ones(3)
    if per_unit is None:
        return
    step_s = float(np.median(recording.interval_s))
    force = np.linalg.norm(imu.accelerometer * per_unit, axis=1) / recording.interval_s
    force_g = float(np.median(force)) / STANDARD_GRAVITY
    if ORDINARY_FORCE[0] <= force_g <= ORDINARY_FORCE[1]:
        return
    mix_ups = {1.0 / step_s: "rates given for increments", step_s: "increments given for rates"}
    if imu.accelerometer_form == "increment":
        mix_ups |= {
            1.0 / STANDARD_GRAVITY: "g given for m/s^2",
            STANDARD_GRAVITY: "multiplied by g twice",
            1.0 / step_s / STANDARD_GRAVITY: "rates in g given for increments in m/s",
        }
    guesses = [mix_up for factor, mix_up in mix_ups.items() if abs(force_g / factor - 1.0) < FORCE_TOLERANCE]
    if guesses:
        raise DataRefused(
            f"{where}: the median specific force is {force_g:.4g} g ({', or '.join(guesses)}?), expected about 1 g; "
            "state the form of the columns in [imu], or convert them"
        )
    lasted_s = float(imu.time_s[-1]) - recording.start.time_s
    least_g = 1.0 - FASTEST_MPS / (STANDARD_GRAVITY * lasted_s)
    mean_g = float(force.mean()) / STANDARD_GRAVITY
    if mean_g < ORDINARY_FORCE[0] * least_g:
        raise DataRefused(
            f"{where}: the specific force is {mean_g:.3g} g on average over {lasted_s:.4g} s, expected at least "
            f"{least_g:.2g} g, since gravity is part of it however it moves; it looks as if gravity was taken off (a "
            "linear acceleration); give what the accelerometers measured"
        )
