"""Which start errors and constant sensor errors would make the error curve of an INS.

Every error of the start (velocity, tilt, heading) and every constant error of a sensor makes one curve of velocity:
the linear error equations of `error_model.propagation` along the flight, the vertical channel held. For a vehicle
at rest, Earth rate aside, those curves are Schuler's, w_s^2 = g / R:

    start velocity v0: v0 cos(w_s t)      tilt a: R w_s a sin(w_s t)
    accelerometer bias b: b / w_s sin(w_s t)      gyro bias d: R d (1 - cos(w_s t))

Their sum is fitted to what was seen by least squares (`correlated.regress`). Curves that are the same in shape are
fitted as one. Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., section 12.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ins_eval.analysis.correlated import Fit, Series, regress
from ins_eval.earth import EARTH_RATE, gravity, radii
from ins_eval.error_model.geometry import States
from ins_eval.error_model.propagation import dynamics
from ins_eval.metrics import Estimate
from ins_eval.recording.belief import EarthBelief
from ins_eval.units import ARCSEC, DEG_PER_H, UG

SCHULER_PERIOD_S = 84.4 * 60.0
BLOCK_S, FEWEST_BLOCKS = 30.0, 20  # errors are averaged over blocks; of a short span over so many
SAME_SHAPE = 0.998  # cosine between two curves, from which they are one
MAIN_SHARE = 0.2  # of the largest part of a curve that others make, from which a part is named
INSEPARABLE = 0.95  # correlation of two estimates, from which only their combination is known
HELD = np.array([0, 1, 3, 4, 6, 7, 8])  # of the error model: without height and vertical velocity
START = ("velocity_north", "velocity_east", "tilt_north", "tilt_east", "heading")
UNITS = {"velocity": ("m/s", 1.0), "tilt": ("arcsec", ARCSEC), "heading": ("arcsec", ARCSEC),
         "accelerometer": ("ug", UG), "gyro": ("deg/h", DEG_PER_H)}  # fmt: skip


@dataclass(frozen=True, eq=False)
class SchulerFit:
    """The fit of start and sensor errors to an error of velocity.

    `estimates` by name, each in the unit of `unit_of`; `alike` groups of names that make one curve: each of a group
    has the whole of it as its estimate. `inseparable` are groups whose curves differ but of which this span tells only
    combinations; one of such a group may have no estimate. `curve` (k, 2) is the fitted velocity error north and east
    at `time_s` (k,).
    """

    estimates: dict[str, Estimate]
    alike: tuple[tuple[str, ...], ...]
    inseparable: tuple[tuple[str, ...], ...]
    span_s: float
    time_s: np.ndarray
    curve: np.ndarray
    seen: np.ndarray  # (k, 2), averaged over the same blocks
    explained: float  # share of the mean square of what was seen

    def as_tree(self) -> dict[str, Any]:
        """The branch ``schuler`` of ``metrics.json``."""
        return {
            "span_s": self.span_s,
            "explained": self.explained,
            "estimates": {name: {**one.as_tree(), "unit": unit_of(name)} for name, one in self.estimates.items()},
            "alike": [list(group) for group in self.alike],
            "inseparable": [list(group) for group in self.inseparable],
        }


def unit_of(name: str) -> str:
    """Unit of an estimate."""
    return UNITS[name.split("_")[0]][0]


def responses(path: States, in_body: bool) -> dict[str, np.ndarray]:
    """Velocity error north and east (k, 2) at the nodes of `path` that one unit (SI) of each error makes.

    With `in_body` the sensors' errors are constant along the body axes (`path.mat_nb`), else along north and east.
    """
    step_s = np.diff(path.time_s)[:, None, None]
    matrices, _ = dynamics(EarthBelief(), path, _specific_force(path))
    f = matrices[:, HELD[:, None], HELD]
    axes = 0.5 * (path.mat_nb[1:] + path.mat_nb[:-1]) if in_body else np.broadcast_to(np.eye(3), (len(f), 3, 3))
    drive = np.zeros((len(f), 7, 6))
    drive[:, 2:4, :3], drive[:, 4:, 3:] = axes[:, :2], -axes
    half = 0.5 * step_s * f
    transition = np.eye(7) + step_s * f + 2.0 * half @ half
    forced = step_s * (drive + half @ drive)
    state = np.zeros((len(f) + 1, 7, 11))
    state[0, 2:, :5] = np.eye(5)
    for k in range(len(f)):
        state[k + 1] = transition[k] @ state[k]
        state[k + 1, :, 5:] += forced[k]
    letters = ("x", "y", "z") if in_body else ("north", "east", "down")
    names = (*START, *(f"accelerometer_{one}" for one in letters), *(f"gyro_{one}" for one in letters))
    curves = dict(zip(names, np.moveaxis(state[:, 2:4], 2, 0), strict=True))
    return {name: curve for name, curve in curves.items() if name != "accelerometer_down"}  # it moves the height only


def fit_schuler(time_s: np.ndarray, velocity_error: np.ndarray, path: States, in_body: bool) -> SchulerFit | None:
    """Fit start and sensor errors to a velocity error.

    Parameters
    ----------
    time_s, velocity_error : (m,) and (m, 2), north and east in m/s; within the nodes of `path`
    in_body : see `responses`

    None where the span is too short or too sparse to fit.
    """
    curves = responses(path, in_body)
    at = {name: _interpolated(time_s, path.time_s, curve) for name, curve in curves.items()}
    spread = {name: float(np.linalg.norm(curve)) for name, curve in at.items()}
    largest = {kind: max((s for n, s in spread.items() if n.startswith(kind)), default=0.0) for kind in UNITS}
    felt = [name for name in at if spread[name] > 0.01 * largest[name.split("_")[0]]]
    groups = _alike({name: at[name] / spread[name] for name in felt})
    first, made_of = _independent({group[0]: at[group[0]].ravel() / spread[group[0]] for group in groups})
    groups = [group for group in groups if group[0] in first]
    blocks = _blocks(time_s)
    block_s = _averaged(time_s, blocks)
    seen = _averaged(velocity_error, blocks)
    design = np.stack([_averaged(at[name], blocks) for name in first], axis=2)
    found = regress([Series(block_s, design[:, axis], seen[:, axis]) for axis in range(2)])
    if found is None:
        return None
    curve = design @ found.coefficients
    left = seen - curve
    return SchulerFit(
        estimates=_estimates(found, groups, at),
        alike=tuple(group for group in groups if len(group) > 1),
        inseparable=(*made_of, *_inseparable(found.covariance, first)),
        span_s=float(time_s[-1] - time_s[0]),
        time_s=block_s,
        curve=curve,
        seen=seen,
        explained=float(1.0 - np.sum(left**2) / total) if (total := np.sum(seen**2)) else 1.0,
    )


def _specific_force(path: States) -> np.ndarray:
    """Mean specific force between nodes (k, 3): acceleration + (w_en + 2 w_ie) x v - g."""
    dt = np.diff(path.time_s)[:, None]
    v = 0.5 * (path.velocity_n[1:] + path.velocity_n[:-1])
    latitude, height = (0.5 * (x[1:] + x[:-1]) for x in (path.latitude_rad, path.height_m))
    meridian, transverse = (radius + height for radius in radii(latitude))
    north, east, _ = v.T
    turning = np.column_stack([
        east / transverse + 2.0 * EARTH_RATE * np.cos(latitude),
        -north / meridian,
        -east * np.tan(latitude) / transverse - 2.0 * EARTH_RATE * np.sin(latitude),
    ])  # fmt: skip
    force = np.diff(path.velocity_n, axis=0) / dt + np.cross(turning, v)
    force[:, 2] -= gravity(latitude, height)
    return force


def _interpolated(time_s: np.ndarray, nodes_s: np.ndarray, curve: np.ndarray) -> np.ndarray:
    return np.column_stack([np.interp(time_s, nodes_s, component) for component in curve.T])


def _alike(unit_curves: dict[str, np.ndarray]) -> list[tuple[str, ...]]:
    """Names in groups whose curves have one shape."""
    groups: list[tuple[str, ...]] = []
    for name, curve in unit_curves.items():
        for k, group in enumerate(groups):
            if abs(float(np.sum(curve * unit_curves[group[0]]))) > SAME_SHAPE:
                groups[k] = (*group, name)
                break
        else:
            groups.append((name,))
    return groups


def _independent(unit_curves: dict[str, np.ndarray]) -> tuple[list[str], list[tuple[str, ...]]]:
    """Names whose curves no others make, and each other name with those that make its curve together."""
    kept: list[str] = []
    made_of = []
    for name, curve in unit_curves.items():
        others = np.array([unit_curves[one] for one in kept]).T.reshape(curve.size, len(kept))
        parts = np.linalg.lstsq(others, curve, rcond=None)[0]
        if np.linalg.norm(curve - others @ parts) ** 2 > 1.0 - SAME_SHAPE**2:
            kept.append(name)
        else:
            shares = np.abs(parts) * np.linalg.norm(others, axis=0)
            makers = [one for one, share in zip(kept, shares, strict=True) if share > MAIN_SHARE * shares.max()]
            made_of.append((name, *makers))
    return kept, made_of


def _estimates(found: Fit, groups: list[tuple[str, ...]], at: dict[str, np.ndarray]) -> dict[str, Estimate]:
    """Every name with its estimate: of a group that makes one curve, each as if it made all of it."""
    estimates = {}
    for k, group in enumerate(groups):
        for name in group:
            unit = UNITS[name.split("_")[0]][1]
            factor = np.sum(at[name] * at[group[0]]) / np.sum(at[name] ** 2)
            value, low, high = (float(x) for x in found.estimate(k, unit / factor))
            estimates[name] = Estimate(value, min(low, high), max(low, high))
    return estimates


def _inseparable(covariance: np.ndarray, names: list[str]) -> tuple[tuple[str, ...], ...]:
    """Groups of names that are linked by strong correlations of their estimates."""
    sigma = np.sqrt(np.diag(covariance))
    linked = np.abs(covariance) > INSEPARABLE * np.outer(sigma, sigma)
    reach = np.linalg.matrix_power(linked.astype(float), len(names)) > 0.0
    groups = {tuple(np.flatnonzero(row)) for row in reach}
    return tuple(tuple(names[i] for i in group) for group in sorted(groups) if len(group) > 1)


def _blocks(time_s: np.ndarray) -> np.ndarray:
    """Number (m,) of the block of each epoch."""
    span_s = time_s[-1] - time_s[0]
    block_s = min(BLOCK_S, span_s / FEWEST_BLOCKS)
    return np.minimum((time_s - time_s[0]) / block_s, np.ceil(span_s / block_s) - 1.0).astype(int)


def _averaged(values: np.ndarray, blocks: np.ndarray) -> np.ndarray:
    """Mean of values (m, ...) over each block that has any."""
    _, inverse, counts = np.unique(blocks, return_inverse=True, return_counts=True)
    total = np.zeros((counts.size, *values.shape[1:]))
    np.add.at(total, inverse, values)
    return total / counts.reshape(-1, *[1] * (values.ndim - 1))
