"""Values of the rows of the modules of the loop and of the bench."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ins_eval.studies.paper_b.audit import electronics, loop
from ins_eval.tables import pick

AMPLIFIERS = (2.0, 10.0, 50.0)


def values(results: Mapping) -> dict[str, dict[str, Any]]:
    """All of them."""
    left, opened = loop.seen_ppm(k_0=200.0, k_t=200.0).off, pick(results, "exact", "switch_open_ug")
    return {
        "B-M1": {"recomputed": left, "holds": abs(left) < 0.1},
        "B-M11": {"holds": None if opened is None else opened == 0.0},
        "B-M13": {"mapped_ppm": [electronics.amplifier_ppm(gain, -200.0) for gain in AMPLIFIERS]},
    }
