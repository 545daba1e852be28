"""Values of the rows of equations (1) to (31)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ins_eval.studies.paper_b.audit import bridge, electronics, loop
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.studies.paper_b.rows.audited import ANY_PENDULUM, DRIFT_PPM, audited
from ins_eval.studies.papers import same
from ins_eval.tables import pick
from ins_eval.units import PPM

COUNTS = 1e-4  # last digit, as a share, to which counts of the loop are compared
FACTORS = {  # equation: the part, its words, the test that 200 ppm of it have to change, by how much, and its unit
    9: ("dac_reference", "gain of DA2 and its reference", "current_test_ppm", DRIFT_PPM, "ppm"),
    11: ("coil_length", "length of the coil times arm", "output_ug", -DRIFT_PPM, "µg"),
    12: ("magnet", "magnetic induction", "output_ug", -DRIFT_PPM, "µg"),
}
TESTS = {"current_test_ppm": "test with the constant current", "output_ug": "output at 1 g"}


def values(results: Mapping) -> dict[str, dict[str, Any]]:
    """All of them."""
    seen = {part["part"]: part for part in pick(results, "observability") or ()}
    return {
        **_forward(seen),
        **{f"B-E{k}": _part(k, seen) for k in FACTORS},
        **_counts(pick(results, "exact"), pick(results, "quiet")),
    }


def _forward(seen: Mapping) -> dict[str, dict[str, Any]]:
    """Pendulum and bridge."""
    of = audited()["pendulum"]
    limit = same(of["right"], 1.0 / ANY_PENDULUM[2], 1e-9) and not same(of["printed"], of["right"], 1e-3)
    null = audited()["bridge"]["null_shift_ppm"] * PPM
    shifted = bridge.voltage(null, 1.0, bridge.reference_ratio(DRIFT_PPM))
    error, product = audited()["inverse_error_ppm"], electronics.product_error_ppm([100.0] * 4)
    small = {"size_ppm": abs(error), "holds": abs(error) < 1.0}
    return {
        "B-E3": {"holds": limit},
        "B-E5": {"holds": abs(shifted) < 1e-12 and abs(audited()["bridge"]["closed_loop_ppm"]) < 1e-6},
        "B-E7": {**small, "scan_ppm": pick(seen, "adc_reference", "forward_scan_ppm")},
        "B-E8": {"recomputed": product, "holds": abs(product) < 1.0},
        "B-E22": small,
    }


def _part(equation: int, seen: Mapping) -> dict[str, Any]:
    """A factor of a gain: 200 ppm of it have to change a test by as much."""
    part, words, test, expected, unit = FACTORS[equation]
    found = pick(seen, part, test)
    return {
        **{"equation": f"{equation}", "factor": words, "test": TESTS[test], "expected": expected, "unit": unit},
        **{"ours": found, "holds": None if found is None else abs(found - expected) < 0.1},
    }


def _counts(exact: Mapping | None, quiet: Mapping | None) -> dict[str, dict[str, Any]]:
    """Scan, loop at rest, feedback gain."""
    high, low = (loop.seen_ppm(gain, k_vi_da=DRIFT_PPM).on_less_off for gain in (1e6, 1e2))
    exactly = (1.0 / (1.0 + DRIFT_PPM * PPM) - 1.0) / PPM
    found = {"B-E26": {"recomputed": high, "at_100": low, "holds": abs(high - exactly) < 0.1}}
    if exact is None:
        return found | {f"B-E{k}": {"holds": None} for k in (19, 23, 24, 25, 28, 30)}
    off, rejected = exact["counts_per_g"], exact["rejected_scatter_ppm"]
    on = off + exact["counts_on_less_off_expected"]
    limit, injected = PRINTED["text"]["estimation_error_ppm"], {k: PRINTED[f"table{k}"]["injected_ppm"] for k in (3, 4)}
    return found | {
        "B-E19": {"holds": abs(exact["forward_ppm"] - injected[3]) < 1.0},
        "B-E23": {"holds": quiet and rejected > limit},
        "B-E24": {"expected": on, "holds": same(exact["counts_on"] / on, 1.0, COUNTS)},
        "B-E25": {"expected": off, "holds": same(exact["counts_off"] / off, 1.0, COUNTS)},
        "B-E28": {"holds": abs(exact["feedback_ppm"] - injected[4]) < 0.1},
        "B-E30": {
            **{"left_ug": abs(exact["compensated_ug"]), "of_ug": abs(exact["output_feedback_ug"])},
            "holds": abs(exact["compensated_ug"]) < 1.0,
        },
    }
