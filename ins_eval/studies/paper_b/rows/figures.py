"""Values of the rows of the figures: no curve can be read off the paper, so captions and text are judged."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ins_eval.studies.paper_b.audit import loop
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.studies.paper_b.rows.audited import audited
from ins_eval.studies.papers import same
from ins_eval.tables import pick

LEVELS_APART = 3.0  # scatters of a level at least


def values(results: Mapping) -> dict[str, dict[str, Any]]:
    """All of them."""
    exact, across = pick(results, "exact"), abs(loop.seen_ppm(k_pre=-200.0).on_less_off)
    injected = PRINTED["table3"]["injected_ppm"]
    return {
        "B-F5": {"holds": exact and abs(exact["forward_ppm"] - injected) < 1.0},
        "B-F7": {
            "holds": exact and same(exact["counts_on_less_off"] / exact["counts_on_less_off_expected"], 1.0, 1e-5)
        },
        "B-F8": {"across_ppm": across, "holds": across < 0.1},
        "B-F11": _traces("table3", "forward", results),
        "B-F12": _traces("table4", "feedback", results),
    }


def _traces(table: str, channel: str, results: Mapping) -> dict[str, Any]:
    drift, scatter = (
        pick(results, "population", f"{channel}_{what}_ppm") for what in ("repetition", "baseline_scatter")
    )
    printed, holds = PRINTED[table]["mean"]["drift_ppm"], None
    apart = abs(printed) / audited()["shift"][table].before_scatter_ppm
    if drift and scatter:
        holds = min(apart, min(map(abs, drift["interval95"])) / scatter["interval95"][1]) > LEVELS_APART
    return {
        **{"channel": channel, "printed": printed, "apart": apart, "ours": drift, "scatter": scatter},
        **{"least": LEVELS_APART, "holds": holds},
    }
