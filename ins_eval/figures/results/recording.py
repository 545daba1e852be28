"""Figures of one recording that was navigated, with each compensation: shared by flight report and evaluation."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure
from pymap3d.vincenty import vdist

from ins_eval import figures
from ins_eval.earth import radii
from ins_eval.navigation import Evaluation, samples
from ins_eval.recording import Fixes, Recording
from ins_eval.reference import Errors, bridge, raw_vertices
from ins_eval.strapdown import Solution
from ins_eval.thermal import Temperature
from ins_eval.units import DEG

POINT_S = 1.0  # between the points of a temperature curve


def traces(
    recording: Recording,
    evaluations: Mapping[str, Evaluation],
    reference: str = "GPS",
    floor_m: float | None = None,
    rms_mps: Mapping[str, Mapping[str, float]] | None = None,
    raw: Sequence[str] = (),
) -> dict[str, Figure]:
    """Velocity, latitude, longitude and position errors; `raw` names those whose raw vertices are shown, too."""
    errors = _together({name: bridge(e.errors) for name, e in evaluations.items()})
    first, one = next(iter(evaluations.values())), next(iter(errors.values()))
    start_s = first.solution.time_s[0]
    time_s = one.time_s - start_s
    latitude = np.interp(one.time_s, first.solution.time_s, first.solution.latitude_rad)
    height = np.interp(one.time_s, first.solution.time_s, first.solution.height_m)
    metres = metres_per_arcmin(latitude, height)
    common = {
        "time_s": time_s,
        "bridged": ~one.valid,
        "outages": tuple((gap.start_s - start_s, gap.end_s - start_s) for gap in one.gaps),
        "reference": reference,
    }
    horizontal = {name: np.hypot(e.north_m, e.east_m) for name, e in errors.items()}
    drawn: dict[str, Figure] = {}
    placed, moving = (bool(np.isfinite(x).any()) for x in (one.north_m, one.velocity_n[:, :2]))  # of the comparison
    if placed:
        drawn["position_error"] = figures.position_error(**common, errors_m=horizontal, floor_m=floor_m)
        drawn["ground_track"] = figures.ground_track(
            time_s=time_s,
            reference_m=_from_start_m(first.solution, one),
            errors_m={name: np.column_stack([e.north_m, e.east_m]) for name, e in errors.items()},
            reference=reference,
        )
    vertices = {name: raw_vertices(evaluations[name].solution, recording.gps) for name in raw}
    for axis, component in enumerate(("north", "east") if moving else ()):
        drawn[f"{component}_velocity_error"] = figures.velocity_error(
            **common,
            component=component,
            errors_mps={name: e.velocity_n[:, axis] for name, e in errors.items()},
            raw_mps={name: v.velocity_n[:, axis] for name, v in vertices.items()} or None,
            rms_mps={name: rms[component] for name, rms in (rms_mps or {}).items() if component in rms} or None,
        )
    for component, of_arcmin in metres.items() if placed else ():
        values = {n: (e.north_m if component == "latitude" else e.east_m) / of_arcmin for n, e in errors.items()}
        drawn[f"{component}_error"] = figures.angle_error(
            **common, component=component, errors_arcmin=values, metres_per_arcmin=float(of_arcmin.mean())
        )
    return drawn


def _together(errors: Mapping[str, Errors]) -> dict[str, Errors]:
    """The errors at the epochs that all of them have: one that ends far off may have lost some."""
    shared = functools.reduce(np.intersect1d, (one.time_s for one in errors.values()))
    columns = ("time_s", "north_m", "east_m", "down_m", "velocity_n", "valid")

    def cut(one: Errors) -> Errors:
        rows = np.isin(one.time_s, shared)
        return one if rows.all() else replace(one, **{name: getattr(one, name)[rows] for name in columns})

    return {name: cut(one) for name, one in errors.items()}


def _from_start_m(solution: Solution, errors: Errors) -> np.ndarray:
    """Where the reference was, (n, 2) m north and east of where it began: the solution less its error.

    An azimuthal equidistant map: distance and direction along the ellipsoid from the start, by Vincenty's formula. NaN
    where an error is so large that its metres lead beyond a pole.
    """
    angles = [solution.latitude_rad, np.unwrap(solution.longitude_rad), solution.height_m]
    latitude, longitude, height = (np.interp(errors.time_s, solution.time_s, angle) for angle in angles)
    meridian, transverse = radii(latitude)
    latitude = (latitude - errors.north_m / (meridian + height)) / DEG
    longitude = (longitude - errors.east_m / (transverse + height) / np.cos(latitude * DEG)) / DEG
    known = np.isfinite(latitude + longitude) & (np.abs(latitude) <= 90.0)
    out = np.full((latitude.size, 2), np.nan)
    if known.any():
        first = int(np.argmax(known))
        distance_m, azimuth_deg = vdist(latitude[first], longitude[first], latitude[known], longitude[known])
        out[known] = np.column_stack([distance_m * np.cos(azimuth_deg * DEG), distance_m * np.sin(azimuth_deg * DEG)])
    return out


def metres_per_arcmin(latitude_rad: np.ndarray, height_m: np.ndarray) -> dict[str, np.ndarray]:
    """Metres on the ground in an arc-minute of "latitude" and of "longitude", (n,) each."""
    meridian, transverse = radii(latitude_rad)
    return {
        "latitude": (meridian + height_m) * DEG / 60.0,
        "longitude": (transverse + height_m) * np.cos(latitude_rad) * DEG / 60.0,
    }


def path(fixes: Fixes, start_s: float, outages: Sequence[tuple[float, float]]) -> dict[str, Figure]:
    """Flight path over the ground and height, from the fixes of GPS or reference."""
    known = fixes.valid & np.isfinite(fixes.latitude_rad)
    return {
        "flight_path": figures.flight_path(
            time_s=fixes.time_s[known] - start_s,
            latitude_deg=fixes.latitude_rad[known] / DEG,
            longitude_deg=fixes.longitude_rad[known] / DEG,
            height_m=fixes.height_m[known],
            outages=outages,
        )
    }


def temperature(
    recording: Recording, phases: Sequence[tuple[str, float, float]] = (), true: Temperature | None = None
) -> dict[str, Figure]:
    """Temperature and its rate, or nothing where no temperature was recorded."""
    if recording.imu.temperature_c is None:
        return {}
    seen = next(samples(recording))
    time_s = np.arange(seen.time_s[0], seen.time_s[-1], POINT_S)
    latest = np.searchsorted(seen.time_s, time_s)
    return {
        "temperature_and_rate": figures.temperature_and_rate(
            time_s=time_s,
            temperature_c=None if true is None else np.interp(time_s, true.time_s, true.temperature_c),
            reading_c=seen.temperature_c[latest],
            rate_c_per_min=seen.rate_c_per_min[latest],
            phases=phases,
        )
    }
