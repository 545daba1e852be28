"""Everything that Paper B contains, a row each: printed, computed again, ours, and a verdict."""

from __future__ import annotations

from collections.abc import Mapping

from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.studies.paper_b.rows import (
    claims,
    equations,
    figures,
    inconsistencies,
    modules,
    procedures,
    studies,
    tables,
)
from ins_eval.studies.paper_b.rows.audited import audited
from ins_eval.studies.papers import Row, assembled
from ins_eval.studies.row_tables import rows_of

# Every id is a row itself or what stands before the first "/" of one.
REQUIRED = (
    *(f"B-T{k}" for k in range(1, 5)),
    *(f"B-M{k}" for k in range(1, 16)),
    *(f"B-E{k}" for k in range(1, 32)),
    *(f"B-P{k}" for k in range(1, 6)),
    *(f"B-F{k}" for k in range(1, 14)),
    *(f"B-S{k}" for k in range(1, 4)),
    *(f"B-C{k}" for k in range(1, 25)),
    *(f"B{k}" for k in range(1, 23)),
)

WARM_UP = (
    "warm-up and temperature coefficients of our units were chosen in a search for what leaves residuals of about "
    "10 %, as in Tables 3 and 4"
)
# Numbers of the simulation that were chosen with the printed ones in view, by what stands before the first "/".
CHOSEN = dict.fromkeys(("B-T3", "B-T4", "B-P3", "B-P4", "B-P5", "B-C1", "B-C3", "B13", "B14"), WARM_UP)

GROUPS = {  # where the values of its rows are computed; the statements stand in a TOML file of the same name
    "Tables": tables,
    "Modules": modules,
    "Equations": equations,
    "Procedure": procedures,
    "Figures": figures,
    "Stability, long term, sources": studies,
    "Text claims": claims,
    "Inconsistencies": inconsistencies,
}
TREES = (  # of results
    *("loop", "exact", "quiet", "attraction", "temperature", "in_flight", "stability", "observability", "year"),
    *("population", "scaling", "unit"),
)


def rows(results: Mapping) -> list[Row]:
    """Every row, in the order of `REQUIRED`.

    `results` is a nested mapping with any of the keys `TREES`; what is missing was not computed in this run, and its
    rows say so.
    """
    computed = {**dict.fromkeys(TREES), **results, "paper": PRINTED, "audit": audited()}
    return assembled(rows_of(GROUPS, computed, results), REQUIRED, CHOSEN)


__all__ = ["CHOSEN", "GROUPS", "REQUIRED", "rows"]
