"""`python -m benchmark.runners.run RECORDINGS ANSWERS [--workers 2] [--only PATTERN] [--limit S]`: diagnose as a user.

RECORDINGS holds a folder for each case: a recording, or several of one instrument, which go on one command line. Each
case is given to the command line of the installed package, ``diagnose CASE --json ANSWERS/CASE.json --quiet``. An
answer that this package has already written is kept, so a run that was interrupted goes on. Where the command fails,
its exit code and sentence stand in ``ANSWERS/CASE.error``, 124 where it took longer than ``--limit``, and it is tried
again. ``ANSWERS/runs.json`` keeps for each case the seconds that it took, by the clock and of the processor, and the
package. Answers do not depend on the number of workers.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import importlib.util
import io
import json
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from fnmatch import fnmatch
from pathlib import Path

from tqdm import tqdm

from ins_eval.errors import InsEvalError
from ins_eval.parallel import results

RUNS = "runs.json"
TIMEOUT = 124  # exit code of a case that was ended
AGAIN_S = 1.0  # of the processor, after which a limit is told again: what is raised in a callback is lost
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1"}  # the number of threads decides the last bits of a result


def package_hash(package: Path | None = None) -> str:
    """SHA-256 of the modules and tables of a package, by default of the installed one."""
    here = package or Path(importlib.util.find_spec("ins_eval").origin).parent
    digest = hashlib.sha256()
    for path in sorted(one for end in ("py", "toml") for one in here.rglob(f"*.{end}")):
        digest.update(str(path.relative_to(here)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def recordings(case: Path) -> list[Path]:
    """The recordings of a case: its folder itself or the folders in it."""
    return (
        [case] if (case / "recording.toml").exists() else sorted(path.parent for path in case.glob("*/recording.toml"))
    )


class TooLong(BaseException):
    """The limit is over; no `Exception`, so that the command line does not take it for a fault of its own."""


def _over(number, frame):
    raise TooLong


def diagnose(folders: list[str], answer: str, limit_s: float = 0.0, *options: str) -> tuple[int, str, float, float]:
    """Give recordings to the verb: exit code, words on standard error, seconds by the clock and of the processor."""
    from ins_eval.cli import main

    said, begin, used = io.StringIO(), time.perf_counter(), time.process_time()
    here = threading.current_thread() is threading.main_thread()  # else, on a cluster, nothing can end a case
    if here:
        before = signal.signal(signal.SIGPROF, _over)
        signal.setitimer(signal.ITIMER_PROF, limit_s, AGAIN_S)
    with contextlib.redirect_stderr(said):
        try:
            code = main(["diagnose", *folders, "--json", answer, "--quiet", *options])
        except SystemExit as end:  # an option that the command line refuses
            code = end.code
        except TooLong:
            code = TIMEOUT
            print(f"ended after {limit_s:g} s of the processor", file=sys.stderr)
        finally:
            if here:
                signal.setitimer(signal.ITIMER_PROF, 0.0)
                signal.signal(signal.SIGPROF, before)
    return int(code or 0), said.getvalue().strip(), time.perf_counter() - begin, time.process_time() - used


def read_runs(answers: Path) -> dict[str, dict]:
    """Of each answered case, its seconds and the package that answered."""
    path = answers / RUNS
    return json.loads(path.read_text()) if path.exists() else {}


def run(
    cases: dict[str, list[Path]],
    answers: Path,
    workers: int = 1,
    limit_s: float = 0.0,
    scheduler: str | None = None,
    work: Callable[..., tuple[int, str, float, float]] = diagnose,
) -> list[str]:
    """Diagnose `cases`, name -> recordings, into `answers` by `work`; returns the names of those that failed.

    A case that takes longer than `limit_s` of the processor, which no other load lengthens, is ended; 0: none is, nor
    on the workers of a Dask `scheduler`.
    """
    answers.mkdir(parents=True, exist_ok=True)
    package, runs, failed = package_hash(), read_runs(answers), []
    to_do = [name for name in sorted(cases) if not whole(answers, name, runs, package)]
    os.environ.update(ONE_THREAD)
    jobs = {
        name: ([str(one.resolve()) for one in cases[name]], str((answers / f"{name}.json").resolve()), limit_s)
        for name in to_do
    }
    found = results(work, jobs, workers, scheduler)
    for name, (code, said, seconds, used) in tqdm(
        found, "cases", len(cases), initial=len(cases) - len(to_do), file=sys.stderr
    ):
        error = answers / f"{name}.error"
        runs[name] = {"seconds": round(seconds, 2), "processor_s": round(used, 2), "package": package}
        write(answers / RUNS, json.dumps(runs, indent=1, sort_keys=True) + "\n")
        if code:
            failed.append(name)
            (answers / f"{name}.json").unlink(missing_ok=True)
            error.write_text(f"exit code {code}\n{said}\n")
            continue
        error.unlink(missing_ok=True)
    return sorted(failed)


def whole(answers: Path, name: str, runs: dict, package: str) -> bool:
    """Whether a case has an answer that can be read and is of this package."""
    try:
        form = json.loads((answers / f"{name}.json").read_text())["format"]
    except (OSError, ValueError, KeyError):
        return False
    return form.startswith("ins-diagnosis/") and runs.get(name, {}).get("package") == package


def write(path: Path, words: str) -> None:
    part = path.with_suffix(".part")
    part.write_text(words)
    part.replace(path)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmark.runners.run", description=__doc__.splitlines()[0])
    parser.add_argument("recordings", type=Path, help="folder of the cases")
    parser.add_argument("answers", type=Path, help="where the answers go")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of Dask, whose workers see the same folders")
    parser.add_argument(
        "--limit", type=float, default=0.0, metavar="S", help="seconds of the processor after which a case is ended"
    )
    parser.add_argument("--only", default="*", metavar="PATTERN", help="cases whose name matches, such as case-0*")
    chosen = parser.parse_args(arguments)
    found = sorted(path for path in chosen.recordings.glob("*") if path.is_dir() and fnmatch(path.name, chosen.only))
    if not found:
        parser.error(f"{chosen.recordings}: no case that matches {chosen.only}; expected folders of recordings")
    try:
        cases = {path.name: recordings(path) for path in found}
        failed = run(cases, chosen.answers, chosen.workers, chosen.limit, chosen.scheduler)
    except InsEvalError as error:  # a worker that was lost
        print(error, file=sys.stderr)
        return 1
    for name in failed:
        print(f"{name}: {(chosen.answers / f'{name}.error').read_text().splitlines()[-1]}", file=sys.stderr)
    print(f"{len(found)} cases, {len(failed)} failed")
    return 0  # all were tried; what failed is counted by the report


if __name__ == "__main__":
    sys.exit(main())
