"""Everything that Paper A contains, a row each: printed, computed again, ours, and a verdict."""

from __future__ import annotations

from collections.abc import Mapping

from ins_eval.published_flight import CHOSEN_WITH_TABLE_7
from ins_eval.studies.paper_a import ours as own
from ins_eval.studies.paper_a.printed import PRINTED
from ins_eval.studies.paper_a.rows import claims, equations, figures, inconsistencies, procedures, tables
from ins_eval.studies.paper_a.rows.audited import audited
from ins_eval.studies.papers import VERDICT_RULE, VERDICTS, Row, assembled
from ins_eval.studies.row_tables import rows_of

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

BESIDE = f"{CHOSEN_WITH_TABLE_7}; Table 6 and the CEP were known as well"
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

GROUPS = {  # where the values of its rows are computed; the statements stand in a TOML file of the same name
    "Tables": tables,
    "Equations": equations,
    "Procedures": procedures,
    "Figures": figures,
    "Text claims": claims,
    "Inconsistencies": inconsistencies,
}
TREES = (  # of results, and of `ours`
    *("chamber", "oven", "flight", "sensitivity"),
    *("thermal", "scale", "bias", "high_order", "creep", "model", "oven_position"),
)


def rows(results: Mapping) -> list[Row]:
    """Every row, in the order of `REQUIRED`.

    `results` is a nested mapping with any of the keys seed, chamber, oven, flight and sensitivity; what is missing was
    not computed in this run, and its rows say so. With the seed the small computations of `ours` are done here.
    """
    ours = own.compute(results["seed"]) if "seed" in results else {}
    computed = {**dict.fromkeys(TREES), **results, **ours, "paper": PRINTED, "audit": audited()}
    return assembled(rows_of(GROUPS, computed, results, ours), REQUIRED, CHOSEN)


__all__ = ["CHOSEN", "GROUPS", "REQUIRED", "VERDICTS", "VERDICT_RULE", "Row", "rows"]
