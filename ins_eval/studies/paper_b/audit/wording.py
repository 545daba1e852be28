"""Symbols, references and shares in the text of Paper B."""

from __future__ import annotations

import numpy as np

from ins_eval.studies.paper_b.printed import INS, PRINTED


def symbols() -> dict[str, list[str]]:
    """Quantities that stand under more than one symbol, with these."""
    found = {name: sorted(set(PRINTED["symbols"][name].values())) for name in ("equivalent_gain", "pendulosity")}
    return {name: names for name, names in found.items() if len(names) > 1}


def slope(steps: np.ndarray, counts: np.ndarray, subtracted: float) -> float:
    """Eq. (19): centred least squares of counts less a constant on the steps of N_FPGA."""
    y = counts - subtracted
    n = steps.size
    return float((steps @ y - n * y.mean() * steps.mean()) / (steps @ steps - n * steps.mean() ** 2))


def wrong_references() -> dict[str, str]:
    """Table that the text names: where the numbers stand."""
    return {
        PRINTED[f"table{k}"]["cited_as"]: f"TABLE {k}"
        for k in (3, 4)
        if PRINTED[f"table{k}"]["cited_as"] != f"TABLE {k}"
    }


def same_as_paper_a() -> bool:
    """Whether Table 2 is the accelerometer part of Paper A's Table 5."""
    return dict(INS.accelerometer) == PRINTED["static"]


def shares() -> dict[str, float]:
    """Estimated shares in % by channel, from Tables 3 and 4."""
    return {
        "forward": 100.0 - PRINTED["table3"]["mean"]["residual_percent"],
        "feedback": 100.0 - PRINTED["table4"]["mean"]["residual_percent"],
    }
