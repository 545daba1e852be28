"""Beliefs that tests state in full: what nobody states is unknown, and only the analyses fill it in."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import BaseModel

from ins_eval.recording.belief import NAVIGATION_GRADE, Belief


def navigation_grade(**tables) -> Belief:
    """The belief of a simulated instrument, with these tables or keys of tables in place of its own."""
    whole = NAVIGATION_GRADE.model_dump()
    for name, table in tables.items():
        given = table.model_dump(exclude_unset=True) if isinstance(table, BaseModel) else table
        whole[name] = {**whole[name], **given} if isinstance(given, Mapping) else given
    return Belief.model_validate(whole)
