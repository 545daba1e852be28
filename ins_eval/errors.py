"""Every failure that a user can cause or meet, and the exit code of each kind.

    InsEvalError
    ├── GateNotMet      1   a promised improvement did not hold
    ├── UsageError      2   a profile, model, option or name that cannot be used
    ├── DataRefused     3   a recording that cannot be right
    └── StorageError    4   a folder that cannot be read or written, a full disk, too little memory

A message is one sentence: where, what was seen, what was expected, what to do.
Anything else that reaches the command line is our defect and exits with 5.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from ins_eval.printable import LONGEST_SENTENCE, LONGEST_VALUE, listed, printable, shortened

LINES = "\n\t"
LONGEST_COMPARED = 100  # characters of a name: comparing takes the square of the length


class InsEvalError(Exception):
    """Root of all failures that are reported in one sentence, without a traceback.

    Whatever stands in the sentence, it stays on one line and within `LONGEST_SENTENCE`. `below` it may stand more, such
    as a file to begin with.
    """

    exit_code = 5

    def __init__(self, sentence: object = "", below: str = ""):
        super().__init__(sentence, below)

    def __str__(self) -> str:
        sentence, below = self.args
        said = shortened(printable(str(sentence)), LONGEST_SENTENCE)
        return f"{said}\n\n{printable(below, keep=LINES)}" if below else said


class GateNotMet(InsEvalError):
    """A promised improvement did not hold."""

    exit_code = 1


class UsageError(InsEvalError):
    """A profile, model, option or name that cannot be used."""

    exit_code = 2


class DataRefused(InsEvalError):
    """A recording that cannot be right."""

    exit_code = 3


class StorageError(InsEvalError):
    """A folder that cannot be read or written, a full disk, too little memory."""

    exit_code = 4


def did_you_mean(name: str, choices: Iterable[str]) -> str:
    """Return ``; did you mean 'x'?`` for the nearest choice, or the list of all when nothing is near."""
    choices = sorted(choices)
    near = difflib.get_close_matches(name[:LONGEST_COMPARED], choices, n=1, cutoff=0.5)
    return f"; did you mean '{shortened(near[0], LONGEST_VALUE)}'?" if near else f"; known are {listed(choices)}"
