"""Standard normal numbers of many random streams at once: the numbers that `Streams.rng` of each would give.

A `Generator` costs 10 us to make, and an instrument has hundreds of streams; here a stream is four integers in a row
of a table. The algorithms are those of NumPy, whose numbers are met bit by bit: the entropy of `SeedSequence`, the
generator PCG64 (XSL RR 128/64) and the ziggurat of `Generator.standard_normal`.

Sources: M. E. O'Neill, PCG, Harvey Mudd College HMC-CS-2014-0905; G. Marsaglia and W. W. Tsang, The ziggurat method
for generating random variables, J. Stat. Software 5 (2000) 8.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numba
import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic
from numba.np.random._constants import fi_double, ki_double, wi_double, ziggurat_nor_inv_r, ziggurat_nor_r

from ins_eval.streams import Streams

POOL = 4  # words of a SeedSequence
_U32, _U64 = np.uint32, np.uint64
_MULTIPLIER_HIGH, _MULTIPLIER_LOW = _U64(0x2360ED051FC65DA4), _U64(0x4385DF649FCCF645)  # of PCG64
_KI, _WI, _FI = ki_double, wi_double, fi_double


@dataclass(frozen=True, eq=False)
class ManyStreams:
    """Nodes of one tree of streams, (n,): what `Streams` is for one. `words` (n, w) are their paths."""

    entropy: int
    words: np.ndarray

    @classmethod
    def of(cls, nodes: Sequence[Streams]) -> ManyStreams:
        """Together, nodes of one tree whose paths have one length."""
        return cls(nodes[0].entropy, np.array([node.path for node in nodes], dtype=_U32).reshape(len(nodes), -1))

    def at(self, *names: str | int) -> ManyStreams:
        """The nodes below these that `names` lead to, of each the same."""
        below = Streams(0).at(*names).path
        words = np.empty((len(self.words), self.words.shape[1] + len(below)), _U32)
        words[:, : self.words.shape[1]], words[:, self.words.shape[1] :] = self.words, below
        return ManyStreams(self.entropy, words)

    def begin(self) -> np.ndarray:
        """Each at the start of its stream: (n, 4) of uint64, for `normals`."""
        seed = [self.entropy >> 32 * k & 0xFFFFFFFF for k in range(max(POOL, -(-self.entropy.bit_length() // 32)))]
        return _seeded(np.array(seed, dtype=_U32), self.words)

    def generators(self) -> Iterator[np.random.Generator]:
        """What `Streams.rng` of each would give: one generator that is set to the start of each stream in turn."""
        of_numpy = np.random.PCG64(0)
        generator = np.random.Generator(of_numpy)
        for s1, s0, i1, i0 in self.begin().tolist():
            of_numpy.state = {
                "bit_generator": "PCG64",
                "state": {"state": s1 << 64 | s0, "inc": i1 << 64 | i0},
                "has_uint32": 0,
                "uinteger": 0,
            }
            yield generator


@intrinsic
def _high_product(typingctx, a, b):
    """The upper 64 bits of the product of two integers of 64 bits."""

    def generate(context, builder, signature, arguments):
        wide = ir.IntType(128)
        product = builder.mul(*(builder.zext(argument, wide) for argument in arguments))
        return builder.trunc(builder.lshr(product, ir.Constant(wide, 64)), ir.IntType(64))

    return types.uint64(types.uint64, types.uint64), generate


@numba.njit(cache=True)
def _hashed(value, constant, multiplier):
    value = _U32(value ^ constant)
    constant = _U32(constant * multiplier)
    value = _U32(value * constant)
    return _U32(value ^ (value >> _U32(16))), constant


@numba.njit(cache=True)
def _mixed(x, y):
    value = _U32(_U32(_U32(0xCA01F9DD) * x) - _U32(_U32(0x4973F715) * y))
    return _U32(value ^ (value >> _U32(16)))


@numba.njit(cache=True)
def _seeded(seed, words):
    """States and increments of PCG64 from entropy `seed` (s >= 4,) and spawn keys `words` (n, w)."""
    out = np.empty((words.shape[0], 4), _U64)
    pool = np.empty(POOL, _U32)
    drawn = np.empty(2 * POOL, _U32)
    for row in range(words.shape[0]):
        constant = _U32(0x43B0D7E5)
        for k in range(POOL):
            pool[k], constant = _hashed(seed[k], constant, _U32(0x931E8875))
        for source in range(POOL):
            for k in range(POOL):
                if k != source:
                    value, constant = _hashed(pool[source], constant, _U32(0x931E8875))
                    pool[k] = _mixed(pool[k], value)
        for source in range(seed.size - POOL + words.shape[1]):
            more = seed.size - POOL
            word = seed[POOL + source] if source < more else words[row, source - more]
            for k in range(POOL):
                value, constant = _hashed(word, constant, _U32(0x931E8875))
                pool[k] = _mixed(pool[k], value)
        constant = _U32(0x8B51F9DD)
        for k in range(2 * POOL):
            drawn[k], constant = _hashed(pool[k % POOL], constant, _U32(0x58F38DED))
        s1, s0, i1, i0 = [_U64(drawn[2 * k]) | (_U64(drawn[2 * k + 1]) << _U64(32)) for k in range(4)]
        i1 = (i1 << _U64(1)) | (i0 >> _U64(63))
        i0 = (i0 << _U64(1)) | _U64(1)
        low = i0 + s0  # one step from a state of 0 leaves the increment
        high = i1 + s1 + _U64(low < s0)
        out[row, 0], out[row, 1] = _stepped(high, low, i1, i0)
        out[row, 2], out[row, 3] = i1, i0
    return out


@numba.njit(cache=True, inline="always")
def _stepped(high, low, i1, i0):
    """The next state of PCG64: state * multiplier + increment, modulo 2^128."""
    new_high = _high_product(low, _MULTIPLIER_LOW) + high * _MULTIPLIER_LOW + low * _MULTIPLIER_HIGH
    new_low = low * _MULTIPLIER_LOW
    low = new_low + i0
    return new_high + i1 + _U64(low < new_low), low


@numba.njit(cache=True, inline="always")
def _output(high, low):
    x, turn = high ^ low, high >> _U64(58)
    return (x >> turn) | (x << ((_U64(64) - turn) & _U64(63)))


@numba.njit(cache=True)
def _uniform(high, low):
    return np.float64(_output(high, low) >> _U64(11)) / 9007199254740992.0


@numba.njit(cache=True)
def _outside(raw, high, low, i1, i0):
    """The number that begins with `raw`, which lies outside the core of its layer, and the state after it."""
    while True:
        layer = raw & _U64(0xFF)
        magnitude = (raw >> _U64(9)) & _U64(0x000FFFFFFFFFFFFF)
        x = np.float64(np.int64(magnitude)) * _WI[layer]
        if raw & _U64(0x100):
            x = -x
        if magnitude < _KI[layer]:
            return x, high, low
        high, low = _stepped(high, low, i1, i0)
        while layer == 0:  # the tail
            beyond = -ziggurat_nor_inv_r * np.log1p(-_uniform(high, low))
            high, low = _stepped(high, low, i1, i0)
            y = -np.log1p(-_uniform(high, low))
            if y + y > beyond * beyond:
                x = ziggurat_nor_r + beyond
                return (-x if (magnitude >> _U64(8)) & _U64(1) else x), high, low
            high, low = _stepped(high, low, i1, i0)
        below = _FI[layer - _U64(1)]
        if (below - _FI[layer]) * _uniform(high, low) + _FI[layer] < np.exp(-0.5 * x * x):
            return x, high, low
        high, low = _stepped(high, low, i1, i0)
        raw = _output(high, low)


@numba.njit(cache=True, nogil=True)
def normal_sums(streams, count, every, width):
    """Sums over `every` rows of standard normal numbers, `width` in a row, of each of n streams: (count, width, n).

    What ``rng.standard_normal((count * every, width))`` of each stream gives, summed over `every` rows at a time. The
    `streams` (n, 4) go on: the next call takes the next numbers.
    """
    n = streams.shape[0]
    out = np.empty((count, width, n))
    high, low = streams[:, 0].copy(), streams[:, 1].copy()
    i1, i0 = streams[:, 2].copy(), streams[:, 3].copy()
    drawn = np.empty(n, np.uint64)
    for k in range(count):
        for row in range(every):
            for j in range(width):
                for s in range(n):  # innermost, so that the processor works on several streams at once
                    high[s], low[s] = _stepped(high[s], low[s], i1[s], i0[s])
                    drawn[s] = _output(high[s], low[s])
                for s in range(n):
                    raw = drawn[s]
                    layer = raw & _U64(0xFF)
                    magnitude = (raw >> _U64(9)) & _U64(0x000FFFFFFFFFFFFF)
                    x = np.float64(np.int64(magnitude)) * _WI[layer]
                    x = -x if raw & _U64(0x100) else x
                    if magnitude >= _KI[layer]:
                        x, high[s], low[s] = _outside(raw, high[s], low[s], i1[s], i0[s])
                    out[k, j, s] = x + (out[k, j, s] if row else 0.0)
    streams[:, 0], streams[:, 1] = high, low
    return out


def normals(streams: np.ndarray, count: int) -> np.ndarray:
    """The next `count` standard normal numbers of each of n `streams`, which go on: (count, n)."""
    return normal_sums(streams, count, 1, 1)[:, 0]
