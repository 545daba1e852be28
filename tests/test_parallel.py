"""Jobs give the same wherever they run, and what is lost is said in a sentence."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from ins_eval import ensemble, parallel
from ins_eval.ensemble import Plan
from ins_eval.errors import UsageError

distributed = pytest.importorskip("distributed")
JOBS = {f"job {n}": (n,) for n in range(12)}
INSTRUMENTS, RATE_HZ = 24, 2.0
LOST_AFTER = 4  # instruments, a worker is ended


def squared(number: int) -> tuple[int, int]:
    return number * number, os.getpid()


def refuses(number: int) -> int:
    raise UsageError(f"job {number}: refused")


@pytest.fixture(scope="module")
def cluster():
    with distributed.LocalCluster(n_workers=1, processes=False, dashboard_address=None) as made:
        yield made.scheduler_address


def test_jobs_of_a_cluster_and_of_processes_find_the_same(cluster: str) -> None:
    expected = {key: number * number for key, (number,) in JOBS.items()}
    for where in ({"workers": 1}, {"workers": 2}, {"scheduler": cluster}):
        found = dict(parallel.results(squared, JOBS, **where))
        assert {key: square for key, (square, _) in found.items()} == expected, where
    ordered = [square for square, _ in parallel.in_order(squared, JOBS.values(), scheduler=cluster)]
    assert ordered == list(expected.values())


@pytest.mark.parametrize("where", ["here", "cluster"])
def test_a_refusal_of_a_job_is_that_of_the_whole(cluster: str, where: str) -> None:
    chosen = {"here": {"workers": 1}, "cluster": {"scheduler": cluster}}[where]
    with pytest.raises(UsageError, match=r"job \d+: refused"):
        list(parallel.results(refuses, JOBS, **chosen))


def test_a_scheduler_that_is_not_there_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel, "REACHED_WITHIN_S", 0.2)
    for address in ("tcp://127.0.0.1:9", "nowhere at all"):
        with pytest.raises(UsageError, match="no Dask scheduler answers"):
            list(parallel.results(squared, JOBS, scheduler=address))


def test_a_worker_with_another_version_is_refused() -> None:
    with pytest.raises(UsageError, match="another version"):
        parallel._at_worker("of another package", squared, (2,))


def _bytes(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.glob("*/*.npz"))}


@pytest.mark.slow
def test_a_lost_worker_loses_nothing(tmp_path: Path) -> None:
    """Two workers, of which one is ended while it computes: the members are those of one process, byte for byte."""
    plan = Plan(rate_hz=RATE_HZ, arms=("simple", "hysteresis"))
    ensemble.run({"flight": (plan, INSTRUMENTS)}, tmp_path / "here", workers=1, quiet=True)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as made:
        pids = distributed.Client(made).run(os.getpid)
        store, ended = tmp_path / "there", False
        jobs = {index: (index, [plan]) for index in range(INSTRUMENTS)}
        kept = ensemble.Store(store / plan.key()).open()
        for count, (index, (member,)) in enumerate(
            parallel.results(ensemble.running._members, jobs, scheduler=made.scheduler_address)
        ):
            kept.write(index, member)
            if count == LOST_AFTER:
                os.kill(next(iter(pids.values())), signal.SIGKILL)
                ended = True
                time.sleep(0.5)
        assert ended
    assert _bytes(tmp_path / "there") == _bytes(tmp_path / "here")
    assert len(_bytes(tmp_path / "here")) == INSTRUMENTS
    values = ensemble.run({"flight": (plan, INSTRUMENTS)}, tmp_path / "there", workers=1, quiet=True)["flight"]
    assert all(np.isfinite(value).all() for member in values for arm in member.values() for value in arm.values())
