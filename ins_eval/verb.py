"""A verb is run, and a failure of it becomes one sentence and an exit code."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
import tempfile
import traceback
from importlib import import_module
from typing import Any

from ins_eval import process
from ins_eval.boundary import GIB
from ins_eval.errors import InsEvalError, StorageError
from ins_eval.printable import LONGEST_SENTENCE, printable, shortened

INTERRUPTED, DEFECT = 130, 5
# where a verb is that does not stand in `commands` under its own name
MODULES = {
    "import": "commands.import_recording",
    "paper-report": "studies.paper_report",
    "loop-report": "studies.loop_report",
}


def run(verb: str, options: dict[str, Any], memory: int | None, own_process: bool, closed: bool = False) -> int:
    """Run a verb with its options and return its exit code.

    In a process of its own it prints no warnings of libraries and takes no more than `memory` bytes. `closed` tells
    that standard output is.
    """
    try:
        if closed and not options.get("quiet"):
            raise StorageError("standard output is closed, expected a place for the text; give one, or add --quiet")
        if own_process:
            process.keep_quiet()
            process.collect_seldom()
            process.limit_memory(memory)
        # imported here: a verb should not wait for what only another one needs
        command = import_module(f"ins_eval.{MODULES.get(verb) or 'commands.' + verb.replace('-', '_')}")
        code = getattr(command, options.pop("action", "run"))(**options)
        sys.stdout.flush()
        return code
    except InsEvalError as error:
        print(f"ins-eval: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("ins-eval: interrupted; what was finished is kept, run the same command again to go on", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # whoever read our text has left; nothing is wrong
        _stop_writing()
        return 0
    except MemoryError:
        size = f"{memory / GIB:.3g} GiB" if memory else "what is there"
        print(
            f"ins-eval: {verb} needs more memory than its ceiling of {size}; raise --memory or cut the recording",
            file=sys.stderr,
        )
        return StorageError.exit_code
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EFBIG):
            return _defect(error)
        _stop_writing()
        print(f"ins-eval: the text cannot be written ({error.strerror}); free some space", file=sys.stderr)
        return StorageError.exit_code
    except Exception as error:  # our defect: keep the details, spare the reader
        return _defect(error)


def _stop_writing() -> None:
    """Let nothing more go to a standard output that takes no more, not even at the end of the program."""
    with contextlib.suppress(OSError, ValueError):  # a standard output that is no file
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _defect(error: Exception) -> int:
    kept, said = "and its details cannot be kept", shortened(printable(str(error)), LONGEST_SENTENCE)
    with (
        contextlib.suppress(OSError),
        tempfile.NamedTemporaryFile("w", prefix="ins-eval-", suffix=".txt", delete=False, encoding="utf-8") as file,
    ):
        traceback.print_exception(error, file=file)
        kept = f"the details are in {file.name}"
    print(f"ins-eval: a defect of ours, {type(error).__name__}: {said}; {kept}, please report it", file=sys.stderr)
    return DEFECT
