"""Rows of the procedure, steps 1 to 5."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ins_eval.studies.paper_b.audit import output
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.studies.papers import CONTRADICTS, Row, between, decided, given, number, simulated
from ins_eval.tables import pick

SINGLE = "the central 95 % of single repetitions of our units"
BELOW = "what 95 % of single repetitions of our units stay below"


def procedure_rows(results: Mapping) -> Iterator[Row]:
    """All of them."""
    population, exact = pick(results, "population"), pick(results, "exact")
    yield given(
        "B-P1",
        "Step 1: references of the forward gain and of k_VI k_DA",
        "a step, carried out as printed."
        + (
            " From one reference to the next they scatter by "
            f"{between(population['forward_baseline_scatter_ppm'])} and "
            f"{between(population['feedback_baseline_scatter_ppm'])} ppm."
            if population
            else ""
        ),
    )
    static = pick(results, "unit", "static_scatter_ug")
    yield given(
        "B-P2",
        "Step 2: static output N_out(0)",
        "a step, carried out as printed."
        + (f" The average of our identified unit repeats to {number(static, 2)} µg, as assumed." if static else ""),
        ours=static,
        unit="µg",
    )
    printed = PRINTED["output"]
    yield simulated(
        "B-P3",
        "Step 3: change of the output with −200 ppm forward and +200 ppm feedback, uncompensated",
        printed["uncompensated_ug"],
        pick(population, "uncompensated_ug"),
        SINGLE,
        (f"Without disturbances it is {number(abs(exact['output_feedback_ug']), 5)} µg, all of it from the feedback "
         f"gain; the forward gain gives {number(abs(exact['output_forward_ug']), 1)}. " if exact else "")
        + f"The printed value lacks {number(abs(output.missing_ppm()))} ppm of it (B14).",
        recomputed=output.expected_change_ug(),
        unit="µg",
    )  # fmt: skip
    yield simulated(
        "B-P4",
        "Step 4: change of the output after compensation",
        printed["compensated_ug"],
        pick(population, "compensated_ug"),
        BELOW,
        f"The other printed numbers imply {number(output.closure_ug()[0])} µg (B21).",
        recomputed=output.closure_ug()[0],
        unit="µg",
    )
    as_printed, inverse = output.residual_percent()
    yield decided(
        "B-P5/formula",
        "Step 5: residual by eq. (31)",
        abs(as_printed - printed["residual_percent"]) < 0.5,
        f"The formula gives {number(as_printed)} %, its inverse {number(inverse, 4)} % (B12).",
        CONTRADICTS,
        fails="the two differed by more than 0.5 %",
        printed=printed["residual_percent"],
        recomputed=as_printed,
        unit="%",
    )
    yield simulated(
        "B-P5/value",
        "Step 5: residual of the output, compensated over uncompensated",
        printed["residual_percent"],
        pick(population, "output_residual_percent"),
        BELOW,
        recomputed=inverse,
        unit="%",
    )
