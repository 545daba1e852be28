"""How far a long run is: a bar on a terminal, a line a minute in a log."""

from __future__ import annotations

import sys
from typing import TextIO

from tqdm import tqdm

LINE_S = 60.0  # between lines where standard error is no terminal
_LINE = "{desc}: {n_fmt} of {total_fmt} after {elapsed}, {remaining} to go{postfix}"


def progress(total: int, words: str, quiet: bool, line_s: float = LINE_S) -> tqdm:
    """Show how many of `total` steps are done, and the time to go; `update` counts.

    Where standard error is no terminal nothing is written before `line_s`, and then a line every `line_s`.
    """
    if sys.stderr.isatty():
        return tqdm(total=total, desc=words, unit="", disable=quiet, mininterval=0.5, file=sys.stderr)
    return tqdm(
        total=total,
        desc=words,
        disable=quiet,
        file=_Lines(sys.stderr),
        delay=line_s,
        mininterval=line_s,
        miniters=1,
        bar_format=_LINE,
    )


class _Lines:
    """A stream on which a bar does not overwrite itself."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream

    def write(self, text: str) -> None:
        if line := text.replace("\r", "").strip(" \n,"):
            self.stream.write(f"{line}\n")

    def flush(self) -> None:
        self.stream.flush()
