"""Random streams by name: one for each error source, so that adding a source moves no other draw."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Streams:
    """A node in a tree of named random streams.

    ``Streams(seed).at("instrument", 7).at("accelerometer.x", "creep", "flight").rng()`` is the same generator
    in whatever order, process or worker it is asked for.
    """

    entropy: int
    path: tuple[int, ...] = ()

    def at(self, *names: str | int) -> Streams:
        """The node below this one that `names` lead to."""
        keys = tuple(n if isinstance(n, int) else zlib.crc32(n.encode()) for n in names)
        return Streams(self.entropy, self.path + keys)

    def rng(self) -> np.random.Generator:
        """A fresh generator at the start of this node's stream."""
        return np.random.Generator(np.random.PCG64(np.random.SeedSequence(self.entropy, spawn_key=self.path)))
