"""From where each believed value of a recording comes, where the user did not state it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from ins_eval.recording import Recording
from ins_eval.recording.belief import SHOWN_KEYS, UNSTATED, clauses


def attributed(recording: Recording, reader: str | None, assumed: Collection[str]) -> Recording:
    """The recording whose belief names the source of each value that the user did not state.

    `reader` is the format that took values for its own, None where a mapping or a form of the user states them;
    `assumed` are the keys of ``--assume``. A table that names its source as a whole stays as it is.
    """
    belief = recording.belief
    for table, keys in SHOWN_KEYS.items():
        of = getattr(belief, table)
        known = clauses(of.source)
        as_a_whole = of.source and not known.keys() & type(of).model_fields.keys()
        if as_a_whole or (table == "gps" and recording.gps is None):
            continue
        found = []
        for key in keys:
            if getattr(of, key) is None or key in known:
                continue
            if f"{table}.{key}" in assumed:
                found.append(f"{key}: --assume")
            elif key not in of.model_fields_set:
                found.append(f"{key}: {UNSTATED}")
            elif reader is not None:
                found.append(f"{key}: assumed by the reader of {reader}, see the notes")
        if found:
            source = "; ".join([*([of.source] if of.source else []), *found])
            belief = belief.model_copy(update={table: of.model_copy(update={"source": source})})
    return replace(recording, belief=belief)
