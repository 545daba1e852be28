"""Values of the rows of eqs (1) to (17), of the two definitions in the text, and of the piecewise bias."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ins_eval.calibration.labelings import FIGURE_4, TURNED
from ins_eval.studies.paper_a.audit import chamber
from ins_eval.studies.paper_a.audit import scale_factor as audit
from ins_eval.studies.paper_a.printed import PRINTED, UNITS, span_c
from ins_eval.studies.paper_a.rows.audited import audited
from ins_eval.tables import pick

EXACT = 1e-12  # relative, or in g: what counts as the same equation in double precision
K1, K0 = 1000.0, 0.01  # a scale factor and a bias in g that show what the printed positions give
BRACKETS = ((0.3, 1.1), (0.7, 1.3), (1.9, 1.7))  # any numbers: which terms there are does not depend on them
FOUR_POINT = {  # equation: what it is for, what it gives of it, and what else is to be said
    3: ("K1", "−K1/2", "With the other labeling only half of the difference that is needed is taken."),
    4: ("K0", "K0 − 1/2", "That is K0 − 1/2 either way."),
    13: ("K1", "0", "So it needs the other labeling."),
    14: (
        *("K0", "K0"),
        "Divided by the K1 of eq. (13) it would be infinite with the positions of Fig. 4, since that K1 is 0; and a "
        "quadratic coefficient K2 would be added to K0 in full.",
    ),
}


def values(results: Mapping, ours: Mapping) -> dict[str, dict[str, Any]]:
    """All of them."""
    model = pick(ours, "model")
    back = model and model["compensated"] < EXACT
    squared, plain = (audit.expanded(BRACKETS, squared=of) for of in (True, False))
    terms = {"square": "none" if (2, 0) not in plain else "one", "plain": str(len(plain)), "squared": str(len(squared))}
    return {
        "A-E1": {"holds": model and model["forward"] < EXACT and model["inverse"] < EXACT},
        **{id: {"holds": back} for id in ("A-E2", "A-E5", "A-E12")},
        **{f"A-E{k}": _four_point(k) for k in FOUR_POINT},
        "A-E6": {"left": [pick(results, "chamber", "table4", unit, "quadratic") for unit in UNITS]},
        **{f"A-E{k}": {"equation": str(k), "name": name, **terms} for k, name in ((8, "q"), (9, "w"), (10, "r"))},
        "A-E11": {"left": [pick(results, "chamber", "residual_rms_ppm", unit, "hysteresis") for unit in UNITS]},
        **{f"A-E{15 + k}": _coefficients(k) for k in range(len(UNITS))},
        **{f"A-S/{unit.removeprefix('JB-KT8 ')}": _definition(unit) for unit in UNITS},
    }


def _four_point(equation: int) -> dict[str, Any]:
    """A printed equation with both labelings, on a true K1 of 1000 and K0 of 0.01 g."""
    quantity, gives, also = FOUR_POINT[equation]
    truth, key = (K1, "scale") if quantity == "K1" else (K0, "bias")
    value, other = (getattr(chamber.labelled(f, K1, K0), f"eq{equation}_{key}") for f in (FIGURE_4, TURNED))
    return {
        **{"equation": str(equation), "quantity": quantity, "gives": gives, "also": also, "k1": K1, "k0": K0},
        **{"value": value, "other": other, "holds": abs(value - truth) < EXACT * K1},
    }


def _coefficients(k: int) -> dict[str, Any]:
    audit, unit = audited(), UNITS[k]
    return {
        **{"equation": str(15 + k), "name": unit, "printed": PRINTED[unit]["table4"]["none"]},
        **{"recomputed": audit["sensitivity"][k], "needed_c": audit["reference_needed_c"][k]},
    }


def _definition(unit: str) -> dict[str, Any]:
    """The paper's sensitivity on the change and range that its text quotes, the latter to a degree at either end."""
    of, quoted = PRINTED[unit], audit.quoted_sensitivity(unit)
    return {
        **{"name": unit, "printed": of["text_ppm_per_c"], "recomputed": quoted, "change_ppm": of["change_ppm"]},
        **{"span_c": span_c(unit), "table": of["table4"]["none"], "slack": quoted * 2.0 / span_c(unit)},
    }
