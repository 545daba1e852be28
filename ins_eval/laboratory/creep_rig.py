"""The creep rig: three blocks of epoxy resin in three containers, a camera that sees how long they are.

Paper A, section 2.2, Fig. 2: at once a block takes the deformation of its change of temperature, then it creeps on in
the same direction for about 300 min. Tables 2 and 3 hold the sizes of both for ten repetitions, Fig. 3 the first.

immediate:  u = lambda (1 + b) (1 + n) (T - T_start)
slow:       v = lambda (1 + b) xi R(T_container) (T_container - T_start) m(t)

T(t) is the block's temperature, a first-order lag behind the container. m is the generalised Kelvin-Voigt body (Prony
series) of `accelerometer.creep`, as a share of what it has reached at the reading, since the tables hold readings:
the adhesive of the accelerometer and the block are one material. R is Table 2 over Table 3, as there.
lambda is the mean of the deformation per degree of the three containers. b is what sets the blocks apart (as much as
those three figures differ), n and xi what sets repetitions apart, as much as the tables scatter; xi is log-normal.

Assumed: the temperatures at which the blocks start. The paper gives none; one common room temperature would need
0.1, 0.9 and 0.2 um/degC, these starts need the same within 3 %. Assumed, too: the lag of the block.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ins_eval.accelerometer import Population
from ins_eval.accelerometer.creep import Creep, creep_ratio, epoxy, scattered
from ins_eval.errors import UsageError
from ins_eval.streams import Streams
from ins_eval.thermal import lagged
from ins_eval.units import MINUTE

STEP_S = 10.0  # between points of a relaxation
REACHED = 0.95  # a relaxation counts as stable when this share of its reading is reached


class Tables(NamedTuple):
    """Sizes in um, without sign, (..., containers, repetitions): Table 3 and Table 2."""

    thermal_um: np.ndarray
    creep_um: np.ndarray


class Statistics(NamedTuple):
    """Of the repetitions in each container, (..., containers)."""

    mean_um: np.ndarray
    cv_percent: np.ndarray
    variation_percent: np.ndarray  # (max - min) / first: below Tables 2 and 3


class Relaxation(NamedTuple):
    """One block from its start to the reading, (n,) each; a block that shrinks has negative deformations."""

    time_min: np.ndarray
    container_c: float
    temperature_c: np.ndarray  # of the block
    thermal_um: np.ndarray
    creep_um: np.ndarray

    @property
    def elongation_um(self) -> np.ndarray:
        """Both deformations together."""
        return self.thermal_um + self.creep_um

    @property
    def stable_after_min(self) -> float:
        """When the creep has reached `REACHED` of its reading."""
        return float(np.interp(REACHED, self.creep_um / self.creep_um[-1], self.time_min))


def printed_tables() -> Tables:
    """Tables 2 and 3 of Paper A, (3, 10) each."""
    data = epoxy()
    return Tables(data["thermal_um"], data["creep_um"])


def statistics(sizes_um: np.ndarray) -> Statistics:
    """Mean, coefficient of variation (n - 1 in it) and the tables' variation of sizes (..., n)."""
    mean = sizes_um.mean(axis=-1)
    cv = 100.0 * sizes_um.std(axis=-1, ddof=1) / mean
    return Statistics(mean, cv, 100.0 * np.ptp(sizes_um, axis=-1) / sizes_um[..., 0])


def standing(value: np.ndarray, drawn: np.ndarray) -> np.ndarray:
    """Share of the draws (k, ...) that lie below `value` (...)."""
    return np.mean(drawn < value, axis=0)


def _sourced(default: Any, source: str) -> Any:
    return field(default=default, metadata={"source": source})


@dataclass(frozen=True)
class CreepRig:
    """The experiment; the containers are those of `epoxy.toml`, in its order."""

    start_c: tuple[float, ...] = _sourced((30.0, -55.0, -55.0), "assumed: what makes Table 3 one coefficient")
    reading_min: float = _sourced(300.0, "Paper A, Fig. 3")
    block_lag_s: float = _sourced(120.0, "assumed")
    creep: Creep = field(
        default_factory=lambda: Population.load()["creep"], metadata={"source": "accelerometers jb-kt8, [creep]"}
    )

    def __post_init__(self) -> None:
        if len(self.start_c) != self.container_c.size or np.any(np.equal(self.start_c, self.container_c)):
            raise UsageError(
                f"creep rig: start_c is {self.start_c}; give one temperature for each container at "
                f"{', '.join(f'{c:g}' for c in self.container_c)} degC, different from it"
            )
        if self.reading_min <= 0.0 or self.block_lag_s <= 0.0:
            raise UsageError("creep rig: reading_min or block_lag_s is not above 0; give positive durations")

    @property
    def container_c(self) -> np.ndarray:
        """Temperatures of the containers, (3,)."""
        return epoxy()["temperature_c"]

    @property
    def step_c(self) -> np.ndarray:
        """Change of temperature of each block, (3,)."""
        return self.container_c - np.asarray(self.start_c)

    @cached_property
    def expansion_um_per_c(self) -> np.ndarray:
        """Immediate deformation per degree that each container of Table 3 shows, (3,)."""
        return printed_tables().thermal_um.mean(axis=1) / np.abs(self.step_c)

    def relaxation(self, container: int, thermal_um: float, creep_um: float) -> Relaxation:
        """The block of a container (0, 1, 2), given the sizes that are read at the end."""
        time_s = np.arange(0.0, self.reading_min * MINUTE + 0.5 * STEP_S, STEP_S)
        start_c, container_c = float(self.start_c[container]), float(self.container_c[container])
        temperature_c = lagged(time_s, np.full(time_s.size, container_c), self.block_lag_s, start=start_c)
        relaxed = self.creep.relaxed(time_s, temperature_c, stable_at_c=start_c)
        sign = np.sign(container_c - start_c)
        return Relaxation(
            time_s / MINUTE,
            container_c,
            temperature_c,
            sign * thermal_um * (temperature_c - start_c) / (container_c - start_c),
            sign * creep_um * relaxed / relaxed[-1],
        )

    def first(self) -> tuple[Relaxation, ...]:
        """Repetition #1 in each container: Fig. 3, with the end points of Tables 2 and 3."""
        tables = printed_tables()
        return tuple(
            self.relaxation(k, tables.thermal_um[k, 0], tables.creep_um[k, 0]) for k in range(self.container_c.size)
        )

    def finished_share(self) -> np.ndarray:
        """How much of the creep that the model would ever show is there at the reading, (3,)."""
        time_s = np.array([0.0, 1e-3, self.reading_min * MINUTE])
        share = []
        for start_c, container_c in zip(self.start_c, self.container_c, strict=True):
            relaxed = self.creep.relaxed(time_s, np.array([start_c, container_c, container_c]), start_c)
            share.append(relaxed[-1] / (creep_ratio(container_c) * (container_c - start_c)))
        return np.array(share)

    def repeated(self, streams: Streams, experiments: int = 1, repetitions: int = 10) -> Tables:
        """Virtual experiments, each with new blocks and so many repetitions: sizes (experiments, 3, repetitions)."""
        node = streams.at("creep_rig")
        shape = (experiments, self.container_c.size, repetitions)
        tables = printed_tables()
        thermal_cv, creep_cv = (statistics(sizes).cv_percent[:, None] / 100.0 for sizes in tables)
        per_c = self.expansion_um_per_c
        block = 1.0 + per_c.std(ddof=1) / per_c.mean() * node.at("block").rng().standard_normal((*shape[:2], 1))
        step_um = per_c.mean() * np.abs(self.step_c)[:, None] * block
        thermal = step_um * (1.0 + thermal_cv * node.at("thermal").rng().standard_normal(shape))
        xi = scattered(creep_cv, node.at("creep").rng().standard_normal(shape))
        return Tables(thermal, step_um * creep_ratio(self.container_c)[:, None] * xi)
