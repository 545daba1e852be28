"""Messages between two processes: JSON through a socket, arrays through memory that both have."""

from __future__ import annotations

import json
import math
import mmap
import os
import socket
import tempfile
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

LENGTH_BYTES = 3  # of a message without its arrays: 16 MB
PLAIN = "biufcUSmM"  # kinds of arrays that are nothing but their bytes
ALIGNED_BYTES = 64  # where an array may begin


class Connection:
    """One end. Whatever the other end sends is no more than JSON and the bytes of arrays."""

    def __init__(self, messages: socket.socket, memory: int):
        """`memory` is the handle of the shared memory, which grows with what is sent."""
        self.messages, self.memory = messages, memory
        self._mapped = np.empty(0, np.uint8)

    @classmethod
    def pair(cls) -> tuple[Connection, Connection]:
        """Both ends, the second for a process that inherits its `handles`."""
        memory = _unnamed_memory()
        here, there = socket.socketpair()
        return cls(here, memory), cls(there, os.dup(memory))

    @classmethod
    def inherited(cls, handles: Sequence[int]) -> Connection:
        """The end with these `handles`; what this process starts in turn does not get them."""
        for handle in handles:
            os.set_inheritable(handle, False)
        return cls(socket.socket(fileno=handles[0]), handles[1])

    @property
    def handles(self) -> tuple[int, int]:
        """Numbers of the files behind this end."""
        return self.messages.fileno(), self.memory

    def close(self) -> None:
        """Close this end; to do so twice does no harm."""
        if self.messages.fileno() >= 0:
            self.messages.close()
            os.close(self.memory)

    def send(self, message: dict[str, Any], arrays: Sequence[np.ndarray] = ()) -> None:
        """Send a message and arrays of `PLAIN` kinds; those of the message before are gone then."""
        arrays = [np.asarray(array) for array in arrays]
        *begins, end = _begins(array.nbytes for array in arrays)
        if end > os.fstat(self.memory).st_size:
            os.ftruncate(self.memory, end)
        mapped = self._map(end)
        for begin, array in zip(begins, arrays, strict=True):
            mapped[begin : begin + array.nbytes].view(array.dtype).reshape(array.shape)[...] = array
        text = json.dumps({**message, "arrays": [(array.dtype.str, array.shape) for array in arrays]}).encode()
        self.messages.sendall(len(text).to_bytes(LENGTH_BYTES, "big") + text)

    def receive(self) -> tuple[dict[str, Any], list[np.ndarray]]:
        """A message and its arrays, each in memory of its own. Raises EOFError or OSError where the other end is gone.

        Raises ValueError, TypeError, KeyError or AttributeError for what `send` does not send.
        """
        length = int.from_bytes(self._read(LENGTH_BYTES), "big")
        message = json.loads(self._read(length))
        kinds = [(np.dtype(kind), tuple(shape)) for kind, shape in message.pop("arrays")]
        sizes = [kind.itemsize * math.prod(shape) for kind, shape in kinds]
        if any(kind.kind not in PLAIN for kind, _ in kinds) or any(size < 0 for size in sizes):
            raise ValueError(f"arrays {kinds}")
        *begins, end = _begins(sizes)
        mapped = self._map(end)
        return message, [
            mapped[begin : begin + size].view(kind).reshape(shape).copy()
            for begin, size, (kind, shape) in zip(begins, sizes, kinds, strict=True)
        ]

    def _map(self, size: int) -> np.ndarray:
        """The shared memory, at least `size` bytes of it."""
        if size > self._mapped.size:
            self._mapped = np.frombuffer(mmap.mmap(self.memory, size), np.uint8)
        return self._mapped

    def _read(self, count: int) -> bytearray:
        into = bytearray(count)
        rest = memoryview(into)
        while rest:
            received = self.messages.recv_into(rest)
            if not received:
                raise EOFError
            rest = rest[received:]
        return into


def _begins(sizes: Iterator[int] | Sequence[int]) -> list[int]:
    """Where arrays of these sizes in bytes begin, one behind the other, and where the last one ends."""
    begins = [0]
    for size in sizes:
        begins.append(begins[-1] + -(-size // ALIGNED_BYTES) * ALIGNED_BYTES)
    return begins


def _unnamed_memory() -> int:
    """Handle of memory, or of a file where the system has no memory without a name."""
    if hasattr(os, "memfd_create"):
        return os.memfd_create("ins_eval")
    with tempfile.TemporaryFile() as file:
        return os.dup(file.fileno())
