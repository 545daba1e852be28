"""Values of the rows of what the text names besides: stability, the long term, the sources of the residual."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ins_eval.studies.paper_b.audit import loop
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.tables import pick


def values(results: Mapping) -> dict[str, dict[str, Any]]:
    """All of them."""
    margins = pick(results, "stability")
    change = margins and margins["drifted"]["phase_margin_deg"] - margins["nominal"]["phase_margin_deg"]
    return {
        "B-S1": {"ours": change, "holds": margins and change < -1.0},
        "B-S3": {
            "printed": len(PRINTED["factors"]["neglected"]) + 1,
            "unseen_ppm": abs(loop.seen_ppm(k_t=200.0).on_less_off),
        },
    }
