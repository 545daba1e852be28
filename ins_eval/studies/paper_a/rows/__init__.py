"""Everything that Paper A contains, a row each: printed, computed again, ours, and a verdict."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ins_eval.published_flight import CHOSEN_WITH_TABLE_7
from ins_eval.studies.paper_a import ours as own
from ins_eval.studies.paper_a.printed import PRINTED
from ins_eval.studies.paper_a.rows import (
    claims_navigation,
    claims_sensors,
    inconsistencies_laboratory,
    inconsistencies_navigation,
)
from ins_eval.studies.paper_a.rows.equations import equation_rows
from ins_eval.studies.paper_a.rows.figures import figure_rows
from ins_eval.studies.paper_a.rows.procedures import procedure_rows
from ins_eval.studies.paper_a.rows.tables import table_rows
from ins_eval.studies.papers import VERDICT_RULE, VERDICTS, Groups, Row, assembled, read_stated

# Every id is a row itself or what stands before the first "/" of one.
REQUIRED = (
    *(f"A-T{k}" for k in range(1, 8)),
    "A-CEP",
    *(f"A-E{k}" for k in range(1, 18)),
    "A-S",
    "A-PW",
    *(f"A-P{k}" for k in range(1, 14)),
    *(f"A-F{k}" for k in range(1, 14)),
    *(f"A-C{k}" for k in range(1, 41)),
    *(f"A{k}" for k in range(1, 31)),
)

BESIDE = f"{CHOSEN_WITH_TABLE_7}; Table 6 and the CEP stood beside it"
# Numbers of the simulation that were chosen with the printed ones in view, by what stands before the first "/".
CHOSEN = {
    "A-T4": "the size of the magnet's loop, 200 ppm, was chosen after the residual of the proposed model in this table",
    "A-T6": BESIDE,
    "A-T7": CHOSEN_WITH_TABLE_7,
    "A-CEP": BESIDE,
    "A-P1": "the time constants of the creep were chosen after Fig. 3 and the 300 min of the text",
    "A-C36": BESIDE,
    "A24": BESIDE,
    "A26": BESIDE,
    "A30": BESIDE,
}

GROUPS: Groups = {
    "Tables": (table_rows,),
    "Equations": (equation_rows,),
    "Procedures": (procedure_rows,),
    "Figures": (figure_rows,),
    "Text claims": (claims_sensors.sensor_rows, claims_navigation.navigation_rows),
    "Inconsistencies": (inconsistencies_laboratory.laboratory_rows, inconsistencies_navigation.navigation_rows),
}

STATED = read_stated(Path(__file__).parents[1] / "stated.toml", PRINTED)


def rows(results: Mapping) -> list[Row]:
    """Every row, in the order of `REQUIRED`.

    `results` is a nested mapping with any of the keys seed, chamber, oven, flight and sensitivity; what is missing was
    not computed in this run, and its rows say so. With the seed the small computations of `ours` are done here.
    """
    ours = own.compute(results["seed"]) if "seed" in results else {}
    return assembled(GROUPS, REQUIRED, CHOSEN, results, ours, stated=STATED)


__all__ = ["CHOSEN", "GROUPS", "REQUIRED", "VERDICTS", "VERDICT_RULE", "Row", "rows"]
