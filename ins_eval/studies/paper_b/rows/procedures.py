"""Values of the rows of the procedure, steps 1 to 5."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.studies.paper_b.rows.audited import audited
from ins_eval.tables import pick


def values(results: Mapping) -> dict[str, dict[str, Any]]:
    """All of them."""
    exact = pick(results, "exact")
    off = audited()["output"]["residual_percent"] - PRINTED["output"]["residual_percent"]
    return {
        "B-P3": {
            "feedback_ug": exact and abs(exact["output_feedback_ug"]),
            "forward_ug": exact and abs(exact["output_forward_ug"]),
        },
        "B-P5/formula": {"holds": abs(off) < 0.5},
    }
