"""The process of a program made ready: streams that are open, no words but ours, a ceiling of memory."""

from __future__ import annotations

import gc
import logging
import os
import sys
import warnings
from contextlib import suppress
from pathlib import Path

COLLECTED_AFTER = (50_000, 20, 20)  # objects made, and rounds; Python has 700, 10, 10
CGROUP_LIMIT = Path("/sys/fs/cgroup/memory.max")  # of a container, cgroup v2


def open_streams() -> bool:
    """Let standard streams that are closed lead nowhere, so that no file takes their place; whether output was.

    A character that the terminal has not is printed as its escape.
    """
    closed = sys.stdout is None
    for name, number in (("stdin", 0), ("stdout", 1), ("stderr", 2)):
        if getattr(sys, name) is None:
            with suppress(OSError):
                while (opened := os.open(os.devnull, os.O_RDWR)) < number:
                    pass  # lower numbers are closed, too
                if opened > number:
                    os.dup2(opened, number)
            setattr(sys, name, open(os.devnull, "r" if number == 0 else "w", encoding="utf-8"))  # noqa: SIM115
        elif number:
            getattr(sys, name).reconfigure(errors="backslashreplace")
    return closed


def keep_quiet() -> None:
    """Say nothing but our own sentences: warnings of libraries are for those who ask for them with -W."""
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    logging.getLogger("matplotlib").setLevel(logging.ERROR)


def collect_seldom() -> None:
    """Look for circles of objects seldom: a verb makes few, and looking takes a tenth of a short one.

    Arrays in no circle are freed at once all the same.
    """
    gc.set_threshold(*COLLECTED_AFTER)


def collect_no_more() -> None:
    """Leave circles of objects to the system, which takes all at once when the process ends."""
    gc.freeze()


def memory_ceiling_bytes() -> int | None:
    """Half of the memory that is there, of the machine or of its container; None where it cannot be known."""
    sizes = []
    with suppress(AttributeError, OSError, ValueError):
        sizes.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    with suppress(OSError, ValueError):  # "max": no limit
        sizes.append(int(CGROUP_LIMIT.read_text()))
    return min(sizes) // 2 if sizes else None


def limit_memory(ceiling_bytes: int | None) -> None:
    """Let this process, and each that it starts, take no more than that; beyond it allocation raises MemoryError.

    Counted is what can be written (RLIMIT_DATA, Linux 4.7), not what is only reserved. Nothing is done where the
    system cannot, and a lower limit that is set already stays.
    """
    if ceiling_bytes is None:
        return
    with suppress(ImportError, OSError, ValueError):
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        allowed = ceiling_bytes if hard == resource.RLIM_INFINITY else min(ceiling_bytes, hard)
        resource.setrlimit(resource.RLIMIT_DATA, (allowed, hard))
