"""The page on the last whole sealed set says what the committed log holds, with exact intervals."""

from __future__ import annotations

import json
from pathlib import Path

from benchmark.runners import quick
from benchmark.runners.targets import TARGETS, spoken
from benchmark.scores.score import rate

HEADER = "| line | what | found | 95 % interval | target | |"


def rows_of(entry: dict) -> list[str]:
    """The lines of the table, from an entry of the log: proportions with their intervals, other numbers without."""
    rows = []
    for one in sorted(TARGETS, key=lambda one: (one.line, one.words)):
        kept = entry["found"].get(f"{one.line} {one.words}")
        if kept is None:  # a target that came after this set
            continue
        count, interval = f"{kept['found']:.3g}" if isinstance(kept["found"], float) else "", ""
        if not count:
            count, _, interval = spoken(rate(*kept["found"]))
        rows.append(f"| {one.line} | {one.words} | {count} | {interval} | {one.goal} | {kept['verdict']} |")
    return rows


def test_the_table_is_that_of_the_log(repository: Path) -> None:
    entry = quick.whole_set(json.loads((repository / quick.LOG).read_text()))
    page = (repository / "docs" / "validation.md").read_text()
    table = page[page.index(HEADER) :].split("\n\n")[0].splitlines()[2:]
    assert table == rows_of(entry), "write these lines:\n" + "\n".join(rows_of(entry))
    seeds, cases = ", ".join(map(str, entry["seeds"])), sum(entry["cases"].values())
    assert f"seed {seeds} (version {entry['package'].split()[1]}, {cases} recordings" in page
    assert all(f"{count} {kind}" in page for kind, count in entry["cases"].items())
