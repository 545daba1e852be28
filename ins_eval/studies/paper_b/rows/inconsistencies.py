"""Values of the rows of what does not fit together in Paper B, each from a computation in ``audit``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ins_eval.studies.paper_b.audit import bridge, electronics, estimation, output, pendulum, wording
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.studies.paper_b.rows.audited import DRIFT_PPM, audited
from ins_eval.tables import pick

UNDERDAMPED = (2.0, 2.0, 1.0)
DA0_BITS = (16, 18, 20)
AMPLIFIERS = (2.0, 5.0, 10.0, 50.0)
TEN_FOLD_PPM = 1000.0


def values(results: Mapping) -> dict[str, dict[str, Any]]:
    """All of them."""
    return {**_equations(), **_wording(), **_tables(results), **_output(results), **_electronics(results)}


def _equations() -> dict[str, dict[str, Any]]:
    return {
        "B2": {"underdamped": UNDERDAMPED, "recomputed": pendulum.divisor(*UNDERDAMPED)},
        "B4": {"of_the_other_ppm": bridge.open_loop_gain_ppm(0.0, DRIFT_PPM)},
    }


def _wording() -> dict[str, dict[str, Any]]:
    """Symbols, references and shares."""
    steps, counts = np.arange(21.0), 479.1 * (800.0 + np.arange(21.0))
    slopes = [wording.slope(steps, counts, first) for first in (counts[0], 0.9 * counts[0])]
    wrong, shares = wording.wrong_references(), wording.shares()
    return {
        "B6": {
            "slope_ppm": abs(slopes[1] / slopes[0] - 1.0) / 1e-6,
            "names": "; ".join(" and ".join(names) for names in wording.symbols().values()),
        },
        "B7": {"printed": ", ".join(wrong), "recomputed": ", ".join(wrong.values())},
        "B18": {
            "here": list(PRINTED["static"].values()),
            "there": list(dict(wording.INS.accelerometer).values()),
            "holds": wording.same_as_paper_a(),
        },
        "B19": {"shares": [round(share, 2) for share in shares.values()], "feedback": shares["feedback"]},
    }


def _tables(results: Mapping) -> dict[str, dict[str, Any]]:
    """Tables 3 and 4, the room, and what ten times the drift would read as."""
    found = {table: estimation.of(table) for table in ("table3", "table4")}
    apart = [float(np.abs(np.array(PRINTED[t]["drift_ppm"]) - of.drift_ppm).max()) for t, of in found.items()]
    rounding, scaling = [of.rounding_ppm for of in found.values()], pick(results, "scaling")
    rows_mean, _, gains_mean = estimation.mean_residual_percent("table4")
    read = [estimation.would_read_percent(table, TEN_FOLD_PPM) for table in ("table3", "table4")]
    _, high = audited()["room_ppm"]
    largest = max(audited()["shifts_ppm"], key=abs)
    return {
        "B8": {
            **{"apart_ppm": apart, "rounding_ppm": rounding, "of_rows": rows_mean, "recomputed": gains_mean},
            "holds": all(a <= r for a, r in zip(apart, rounding, strict=True)),
        },
        "B9": {"falls_ppm": abs(estimation.expected_by_26_ppm()), "rises_ppm": estimation.tabled_change_ppm()},
        "B10": {
            **{"would_read_forward": read[0], "would_read_feedback": read[1], "ten_fold_ppm": TEN_FOLD_PPM},
            "recomputed": 100.0 - read[0],
            "ours": scaling and 100.0 * scaling["forward_rms_ppm"] / TEN_FOLD_PPM,
        },
        "B20": {"printed": largest, "passes": (-high, high), "holds": abs(largest) <= high},
    }


def _output(results: Mapping) -> dict[str, dict[str, Any]]:
    exact, of_unit = pick(results, "exact"), pick(results, "unit", "closure_ug")
    left, open_ug = output.closure_ug()
    error = audited()["shift"]["table4"].error_ppm
    return {
        "B13": {"recomputed": output.feedback_residual_ug()},
        "B16": {"left_ug": exact and abs(exact["output_forward_ug"])},
        "B21": {
            **{"open_ug": abs(open_ug), "of_unit_ug": None if of_unit is None else abs(of_unit)},
            **{"passes": (left - error, left + error), "holds": abs(open_ug) <= error},
        },
    }


def _electronics(results: Mapping) -> dict[str, dict[str, Any]]:
    steps, bits = [electronics.step_ppm(bits) for bits in DA0_BITS], pick(results, "exact", "reference_bits")
    return {
        "B17": {"steps_ppm": steps, "recomputed": steps[0], "ours": bits and electronics.step_ppm(int(bits))},
        "B22": {
            "found_ppm": [electronics.amplifier_ppm(gain, -DRIFT_PPM) for gain in AMPLIFIERS],
            "amplifiers": AMPLIFIERS,
            "explains": electronics.gain_that_explains(PRINTED["table3"]["mean"]["drift_ppm"], -DRIFT_PPM),
        },
    }
