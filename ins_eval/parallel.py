"""Jobs that do not depend on one another, in parallel: by processes of this machine, or by a cluster of them.

Every parallel work of the package and of its benchmark goes through `results`. Without a scheduler the jobs run in
processes that are started for them and end with this one. With the address of a Dask scheduler they run on its workers,
which need this same version of the package: what a job needs goes with it, and what it finds comes back. Numbers do
not depend on where a job runs: a library takes one thread in it.

Source: Rocklin, Dask: Parallel Computation with Blocked Algorithms and Task Scheduling, SciPy 2015.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import signal
import threading
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import cache
from multiprocessing import connection, get_context, parent_process
from pathlib import Path
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits

from ins_eval.errors import InsEvalError, UsageError

Key = TypeVar("Key", bound=Hashable)
Found = TypeVar("Found")

# Else memory of large arrays goes back to the system at once and is cleared again for the next: four times slower.
KEEP_MEMORY = {"MALLOC_MMAP_THRESHOLD_": str(2**25), "MALLOC_TRIM_THRESHOLD_": str(2**28)}  # bytes
MALLOPT = {"MALLOC_MMAP_THRESHOLD_": -3, "MALLOC_TRIM_THRESHOLD_": -1}  # numbers of the same in `mallopt` of glibc
REACHED_WITHIN_S = 10.0  # a scheduler


def results(
    work: Callable[..., Found],
    jobs: Mapping[Key, tuple],
    workers: int | None = None,
    scheduler: str | None = None,
) -> Iterator[tuple[Key, Found]]:
    """What `work` finds of each job, with its key, in the order in which they end.

    Parameters
    ----------
    work : a function of a module, given the arguments of a job
    jobs : the arguments of each
    workers : processes of this machine (None: all cores); with one the jobs run here, in their order
    scheduler : address of a Dask scheduler, such as ``tcp://node:8786``, on whose workers they run instead

    Raises: what `work` raises; InsEvalError where a worker or the scheduler is lost for good, UsageError where none is
    reached or another version of this package answers.
    """
    if scheduler is not None:
        yield from _of_cluster(work, jobs, scheduler)
    elif (workers or os.cpu_count() or 1) == 1 or len(jobs) < 2:
        for key, arguments in jobs.items():
            yield key, _alone(work, arguments)
    else:
        yield from _of_processes(work, jobs, min(workers or os.cpu_count() or 1, len(jobs)))


def in_order(
    work: Callable[..., Found], jobs: Iterable[tuple], workers: int | None = None, scheduler: str | None = None
) -> Iterator[Found]:
    """What `work` finds of each of `jobs`, in their order, each as soon as all before it have ended; see `results`."""
    waiting: dict[int, Found] = {}
    first = 0
    for number, found in results(work, dict(enumerate(jobs)), workers, scheduler):
        waiting[number] = found
        while first in waiting:
            yield waiting.pop(first)
            first += 1


def _of_processes(work: Callable[..., Found], jobs: Mapping[Key, tuple], workers: int) -> Iterator[tuple[Key, Found]]:
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_attend_parent)
    try:
        # What is started here ignores interrupts for good: the parent alone answers.
        with _interrupts_ignored(), _environment(KEEP_MEMORY):
            futures = {pool.submit(_alone, work, arguments): key for key, arguments in jobs.items()}
        for future in as_completed(futures):
            yield futures[future], future.result()
    except BrokenProcessPool:
        raise InsEvalError(
            "a worker was ended from outside, perhaps for lack of memory; what was finished is kept, run again, "
            "with fewer --workers if it repeats"
        ) from None
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _alone(work: Callable[..., Found], arguments: tuple[Any, ...]) -> Found:
    with threadpool_limits(1):
        return work(*arguments)


def _of_cluster(work: Callable[..., Found], jobs: Mapping[Key, tuple], scheduler: str) -> Iterator[tuple[Key, Found]]:
    try:
        import distributed  # an extra, which takes a second to import
    except ImportError:
        raise UsageError(
            "--scheduler: the package distributed is missing here; install it: pip install 'ins_eval[cluster]'"
        ) from None
    try:
        client = distributed.Client(scheduler, timeout=REACHED_WITHIN_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise UsageError(
            f"--scheduler {scheduler}: no Dask scheduler answers ({type(error).__name__}), expected one such as "
            "tcp://node:8786; start it with 'dask scheduler'"
        ) from None
    with client:
        futures = {
            client.submit(_at_worker, code_digest(), work, arguments, pure=False): key
            for key, arguments in jobs.items()
        }
        try:
            for future in distributed.as_completed(list(futures), loop=client.loop):
                yield futures[future], future.result()
                future.release()
        except (distributed.KilledWorker, distributed.client.FutureCancelledError):
            raise InsEvalError(
                f"--scheduler {scheduler}: workers were lost again and again, or the scheduler was; what was finished "
                "is kept, run again when the cluster is whole"
            ) from None
        finally:
            client.cancel([future for future in futures if not future.done()])


def _at_worker(code: str, work: Callable[..., Found], arguments: tuple[Any, ...]) -> Found:
    if code != code_digest():
        raise UsageError(
            "--scheduler: a worker has another version of ins_eval than this machine, expected the same everywhere; "
            "install this one there and start its workers again"
        )
    _keep_memory()
    threadpool_limits(1)  # for good: jobs that share a process would switch it for one another
    return work(*arguments)


@cache
def _keep_memory() -> None:
    """What `KEEP_MEMORY` asks for, in a process that others have started; where its C library knows of it."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if os.name == "posix" else None
    for name, parameter in MALLOPT.items():
        if mallopt is not None:
            mallopt(parameter, int(KEEP_MEMORY[name]))


@cache  # of the code that this process has loaded, whatever lies there later
def code_digest() -> str:
    """SHA-256 of the modules and tables of this package: what decides numbers beside what is asked for."""
    package, digest = Path(__file__).parent, hashlib.sha256()
    for path in sorted(one for one in package.rglob("*") if one.suffix in (".py", ".toml")):
        digest.update(str(path.relative_to(package)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """No KeyboardInterrupt here, nor in the processes that are started meanwhile."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def _environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Have `variables` in the environment, for the processes that are started meanwhile."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _attend_parent() -> None:
    """Let a worker end with its parent, however that ends."""

    def wait() -> None:
        connection.wait([parent_process().sentinel])
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
