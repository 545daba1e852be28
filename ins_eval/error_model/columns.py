"""A hypothesis as columns of the regression: what it drives, what it puts into the measurements, where it starts.

A column is the sum of terms. A drive term is weight x slow factor x integral over the epoch (`drives`), added to
velocity, phi or position; an observation term is weight x slow factor x response at a node (`observations`). Slow
factors are functions of time: 1, temperature, its rate, memory, a window.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ins_eval.error_model import drives
from ins_eval.error_model.geometry import POSITION
from ins_eval.error_model.observations import CHANNELS, SMOOTHINGS, Observations
from ins_eval.error_model.propagation import STATES, ErrorModel

EARTH_TERMS = ("rotation", "coriolis", "transport_rate", "gravity_height", "gravity_latitude")
TO_POSITION, TO_VELOCITY, TO_ATTITUDE = 0, 3, 6
_EARTH = drives.SOURCES
_KNOWN = _EARTH + 2 * len(EARTH_TERMS)
_ELAPSED = _KNOWN + 3
# what a node can show, before the nine channels themselves
_RESIDUAL, _DELAY, _LAG, _SMOOTHING = range(4)
_ARM = _SMOOTHING + 2 * SMOOTHINGS
_MOUNT, _CHANNEL = _ARM + 3, _ARM + 6


class Drive(NamedTuple):
    """weight x slow(t) x a sensor error of `axis` that follows `multiplier`; see `drives.source`."""

    sensor: str
    axis: int
    multiplier: str
    weight: float
    slow: str = "1"


class Missing(NamedTuple):
    """A term of the Earth that the navigation equations lack."""

    term: str
    weight: float = 1.0


class Measured(NamedTuple):
    """weight x slow(t) x what a measurement shows.

    Of "delay", "lag" (positions that are older than the velocities beside them, 1 s), "smoothing_0" to "smoothing_5"
    (`observations.smoothing`, of velocities, then of positions), "arm_x" (y, z), "mount_x" (y, z: reference not
    parallel, 1 rad), and "channel_0" to "channel_8".
    """

    response: str
    weight: float
    slow: str = "1"


class Elapsed(NamedTuple):
    """weight x what the equations add in time that did not pass: gravity, velocity, the turning of n."""

    weight: float


@dataclass(frozen=True)
class Column:
    """One column: `terms`, the state (9,) it begins with, and what it is called."""

    name: str
    terms: tuple[Drive | Missing | Measured | Elapsed, ...] = ()
    start: tuple[float, ...] = ()


@dataclass(eq=False)
class SlowFactor:
    """Slow factors by name, at the middle of the epochs and at the nodes."""

    epochs: dict[str, np.ndarray] = field(default_factory=dict)
    nodes: dict[str, np.ndarray] = field(default_factory=dict)

    def add(self, name: str, of_time, model: ErrorModel) -> str:
        """A function of time (s); returns its name."""
        if name not in self.epochs:
            self.epochs[name], self.nodes[name] = of_time(model.middle_s), of_time(model.nodes_s)
        return name

    def add_window(self, begin_s: float, end_s: float, model: ErrorModel) -> str:
        """1 between `begin_s` and `end_s`; an epoch across an edge counts by the part that is inside."""
        name = f"{begin_s:.3f}..{end_s:.3f}"
        if name not in self.epochs:
            low, high = model.nodes_s[:-1], model.nodes_s[1:]
            inside = np.minimum(high, end_s) - np.maximum(low, begin_s)
            self.epochs[name] = np.clip(inside / (high - low), 0.0, 1.0)
            self.nodes[name] = ((model.nodes_s >= begin_s) & (model.nodes_s < end_s)).astype(float)
        return name


@dataclass(frozen=True, eq=False)
class Assembled:
    """Columns as the filter takes them, the residual first; terms as rows of indices.

    `acting` (count, 2) are the first node and the one behind the last at which something acts on a column: it is 0
    before the first, and after the last nothing but the equations moves it. `walks` and `spread` are as in
    `ins_eval.error_model.propagation`. Where it is `still` there is no navigation error, and nothing drives one.
    """

    count: int
    still: bool
    acting: np.ndarray
    start: np.ndarray
    transition: np.ndarray
    half: np.ndarray
    walks: np.ndarray
    spread: np.ndarray
    coupling: np.ndarray
    interval_s: np.ndarray
    sources: np.ndarray
    slow_epochs: np.ndarray
    drive_terms: np.ndarray
    drive_weights: np.ndarray
    residual: np.ndarray
    design: np.ndarray
    observed: np.ndarray
    slow_nodes: np.ndarray
    observation_terms: np.ndarray
    observation_weights: np.ndarray

    @cached_property
    def channels(self) -> np.ndarray:
        """Those (n,) that measure anything."""
        return np.flatnonzero(np.isfinite(self.residual).any(axis=0))


def assemble(
    model: ErrorModel,
    seen: Observations,
    slow: SlowFactor,
    columns: Sequence[Column],
    taken: Sequence[tuple[Column, float]] = (),
    observed: np.ndarray | None = None,
) -> Assembled:
    """The residual and `columns` in the form that `whitening` takes.

    Columns that were `taken` off what was navigated, with their coefficients, are put back into the residual.
    `observed` is what `observed_of` makes of model and measurements, where that is known.
    """
    terms = (term for column in (*columns, *(one for one, _ in taken)) for term in column.terms)
    names = list(dict.fromkeys(["1", *(term.slow for term in terms if isinstance(term, Drive | Measured))]))
    place = {name: k for k, name in enumerate(names)}
    epochs, nodes = model.interval_s.size, model.nodes_s.size
    start = np.zeros((len(columns) + 1, STATES))
    # what was done to the solution is known, so it is taken off the residual
    driven = [(0, target, _KNOWN + k, 0) for k, target in enumerate((TO_POSITION, TO_VELOCITY, TO_ATTITUDE))]
    driven_weights = [-1.0, -1.0, -1.0]
    shown, shown_weights = [(0, _RESIDUAL, 0)], [1.0]
    for c, column, by in (*((0, *one) for one in taken), *((c, one, 1.0) for c, one in enumerate(columns, start=1))):
        if column.start:
            start[c] += by * np.asarray(column.start)
        for term in column.terms:
            if isinstance(term, Drive):
                sign, target = (1.0, TO_VELOCITY) if term.sensor == "accelerometer" else (-1.0, TO_ATTITUDE)
                driven.append((c, target, drives.source(term.sensor, term.axis, term.multiplier), place[term.slow]))
                driven_weights.append(by * sign * term.weight)
            elif isinstance(term, Missing):
                k = EARTH_TERMS.index(term.term)
                driven += [(c, TO_VELOCITY, _EARTH + 2 * k, 0), (c, TO_ATTITUDE, _EARTH + 2 * k + 1, 0)]
                driven_weights += [by * term.weight, by * term.weight]
            elif isinstance(term, Elapsed):
                driven += [(c, target, _ELAPSED + target // 3, 0) for target in (TO_POSITION, TO_VELOCITY, TO_ATTITUDE)]
                driven_weights += [by * term.weight] * 3
            else:
                shown.append((c, _response(term.response), place[term.slow]))
                shown_weights.append(by * term.weight)
    drive_terms = np.array(driven, dtype=np.int64).reshape(-1, 4)
    observation_terms = np.array(shown, dtype=np.int64).reshape(-1, 3)
    slow_epochs = np.array([np.ones(epochs), *(slow.epochs[name] for name in names[1:])])
    slow_nodes = np.array([np.ones(nodes), *(slow.nodes[name] for name in names[1:])])
    acting = np.column_stack([np.where(start.any(axis=1), 0, nodes), np.zeros(len(start), dtype=int)])
    drives_at, shows_at = 1 + _other_than_0(slow_epochs)[drive_terms[:, 3]], _other_than_0(slow_nodes)
    for column, at in ((drive_terms[:, 0], drives_at), (observation_terms[:, 0], shows_at[observation_terms[:, 2]])):
        np.minimum.at(acting[:, 0], column, at[:, 0])
        np.maximum.at(acting[:, 1], column, at[:, 1])
    return Assembled(
        count=len(columns) + 1,
        still=model.states is None,
        acting=acting,
        start=start,
        transition=model.transition,
        half=model.half,
        walks=model.walks,
        spread=model.spread,
        coupling=model.coupling,
        interval_s=model.interval_s,
        sources=model.sources,
        slow_epochs=slow_epochs,
        drive_terms=drive_terms,
        drive_weights=np.array(driven_weights, dtype=float),
        residual=seen.residual,
        design=seen.design,
        observed=observed_of(model, seen) if observed is None else observed,
        slow_nodes=slow_nodes,
        observation_terms=observation_terms,
        observation_weights=np.array(shown_weights, dtype=float),
    )


def observed_of(model: ErrorModel, seen: Observations) -> np.ndarray:
    """What each response shows in the nine channels of each node, (nodes, responses, 9); the residual is the first."""
    observed = np.zeros((model.nodes_s.size, _CHANNEL + CHANNELS, CHANNELS))
    observed[:, _RESIDUAL] = np.nan_to_num(seen.residual)
    observed[:, _DELAY] = seen.of_delay
    observed[:, _LAG, POSITION] = seen.of_delay[:, POSITION]
    observed[:, _SMOOTHING:_ARM] = seen.of_smoothing
    observed[:, _ARM : _ARM + 3] = seen.of_arm
    if model.states is not None:
        observed[:, _MOUNT:_CHANNEL, 6:] = np.swapaxes(model.states.mat_nb, 1, 2)  # boxes that are not parallel
    observed[:, _CHANNEL:] = np.eye(CHANNELS)
    return observed


def _other_than_0(values: np.ndarray) -> np.ndarray:
    """Where each row (n, k) is first other than 0 and behind where it is last, (n, 2); k and 0 where nowhere."""
    there, k = values != 0.0, values.shape[1]
    first, last = there.argmax(axis=1), k - there[:, ::-1].argmax(axis=1)
    return np.where(there.any(axis=1)[:, None], np.column_stack([first, last]), (k, 0))


def _response(name: str) -> int:
    if name == "delay":
        return _DELAY
    if name == "lag":
        return _LAG
    if name.startswith("smoothing_"):
        return _SMOOTHING + int(name[-1])
    if name.startswith("arm_"):
        return _ARM + "xyz".index(name[-1])
    if name.startswith("mount_"):
        return _MOUNT + "xyz".index(name[-1])
    return _CHANNEL + int(name.removeprefix("channel_"))
