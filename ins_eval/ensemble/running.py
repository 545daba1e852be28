"""Members computed in parallel: what is missing is computed, the rest is read."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import lru_cache
from importlib import import_module
from multiprocessing import connection, get_context, parent_process
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from ins_eval.compensation.child import KEEP_MEMORY
from ins_eval.ensemble.plan import Plan
from ins_eval.ensemble.store import Store
from ins_eval.ensemble.world import World
from ins_eval.errors import InsEvalError, StorageError
from ins_eval.progress import progress


@lru_cache(maxsize=64)
def _world(plan: Plan) -> World:
    return World(plan)


def _work(index: int, ensembles: Sequence[tuple[Plan, Store]]) -> int:
    """Compute and keep the members of one number, which share an instrument; runs in a worker. Returns how many."""
    with threadpool_limits(1):
        for plan, store in ensembles:
            experiment = import_module(f"ins_eval.ensemble.{plan.experiment}")
            store.write(index, experiment.member(_world(plan), index))
    return len(ensembles)


def run(
    plans: Mapping[str, tuple[Plan, int]], folder: Path, workers: int | None = None, quiet: bool = False
) -> dict[str, list[dict[str, dict[str, np.ndarray]]]]:
    """Compute what is missing of several ensembles and return all their members, in order of their numbers.

    Parameters: ``plans[label]`` is a plan and its size in instruments, `Plan.together` of them a member; `folder`
    keeps the members; `workers` processes (None: all cores); a bar with the time to go is shown unless `quiet`.
    Raises: StorageError for a full disk or a folder that cannot be written.
    """
    stores = {label: Store(folder / plan.key()).open() for label, (plan, _) in plans.items()}
    counts = {label: -(-size // plan.together) for label, (plan, size) in plans.items()}
    missing: dict[int, list[tuple[Plan, Store]]] = {}
    for index in range(max(counts.values(), default=0)):
        for label, (plan, _) in plans.items():
            if index < counts[label] and stores[label].read(index) is None:
                missing.setdefault(index, []).append((plan, stores[label]))
    count = sum(map(len, missing.values()))
    with progress(count, "instruments", quiet or not missing) as bar:
        for done in _computed(missing, workers or os.cpu_count() or 1):
            bar.update(done)
    return {label: [_present(stores[label], index) for index in range(count)] for label, count in counts.items()}


def _computed(missing: Mapping[int, Sequence[tuple[Plan, Store]]], workers: int) -> Iterator[int]:
    if workers == 1 or len(missing) < 2:
        for index, ensembles in missing.items():
            yield _work(index, ensembles)
        return
    pool = ProcessPoolExecutor(min(workers, len(missing)), mp_context=get_context("spawn"), initializer=_attend_parent)
    try:
        # What is started here ignores interrupts for good: the parent alone answers.
        with _interrupts_ignored(), _environment(KEEP_MEMORY):
            futures = [pool.submit(_work, index, ensembles) for index, ensembles in missing.items()]
        for future in as_completed(futures):
            yield future.result()
    except BrokenProcessPool:
        raise InsEvalError(
            "a worker was ended from outside, perhaps for want of memory; finished instruments are kept, run again, "
            "with fewer --workers if it repeats"
        ) from None
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


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


def _present(store: Store, index: int) -> dict[str, dict[str, np.ndarray]]:
    result = store.read(index)
    if result is None:
        raise StorageError(f"{store.path(index)}: was written and cannot be read back; check the disk and run again")
    return result


def stacked(members: list[dict[str, dict[str, np.ndarray]]]) -> dict[str, dict[str, np.ndarray]]:
    """``[arm][key]`` with the members along the first axis."""
    return {arm: {key: np.stack([m[arm][key] for m in members]) for key in members[0][arm]} for arm in members[0]}
