"""What is believed of the instrument, and where each value comes from: the first section of every page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ins_eval.believed import BeliefRow
from ins_eval.report.content import Block, Section, table

HEADING = "What is believed"
NOTE = (
    "What was not stated comes from the source beside it; to change it, state it in recording.toml or name the unit "
    "with --unit."
)


def belief_section(rows: Sequence[BeliefRow] | Mapping[str, Sequence[BeliefRow]]) -> Section:
    """The rows of one recording, or those of several by their names."""
    named = rows if isinstance(rows, Mapping) else {"": rows}
    blocks: list[Block] = []
    for name, of in named.items():
        title = f"Believed of {name}" if name and len(named) > 1 else "Belief"
        cells = [(row.key, row.value, row.source) for row in of]
        blocks += table(title, ("key", "value", "from"), cells, NOTE, "lll")
    return Section(HEADING, blocks)
