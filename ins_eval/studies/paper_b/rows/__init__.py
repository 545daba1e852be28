"""Everything that Paper B contains, a row each: printed, computed again, ours, and a verdict."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.studies.paper_b.rows.claims import claim_rows
from ins_eval.studies.paper_b.rows.equations import equation_rows
from ins_eval.studies.paper_b.rows.figures import figure_rows
from ins_eval.studies.paper_b.rows.inconsistencies import inconsistency_rows
from ins_eval.studies.paper_b.rows.modules import module_rows, study_rows
from ins_eval.studies.paper_b.rows.procedures import procedure_rows
from ins_eval.studies.paper_b.rows.tables import table_rows
from ins_eval.studies.papers import Groups, Row, assembled, read_stated

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

GROUPS: Groups = {
    "Tables": (table_rows,),
    "Modules": (module_rows,),
    "Equations": (equation_rows,),
    "Procedure": (procedure_rows,),
    "Figures": (figure_rows,),
    "Stability, long term, sources": (study_rows,),
    "Text claims": (claim_rows,),
    "Inconsistencies": (inconsistency_rows,),
}

STATED = read_stated(Path(__file__).parents[1] / "stated.toml", PRINTED)


def rows(results: Mapping) -> list[Row]:
    """Every row, in the order of `REQUIRED`.

    `results` is a nested mapping with any of the keys loop, exact, quiet, stability, observability, year, population,
    scaling and unit; what is missing was not computed in this run, and its rows say so.
    """
    return assembled(GROUPS, REQUIRED, CHOSEN, results, stated=STATED)


__all__ = ["CHOSEN", "GROUPS", "REQUIRED", "rows"]
