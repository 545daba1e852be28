"""Rows of the figures: no curve can be read off the paper, so what captions and text say of them is judged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ins_eval.paper_b.audit import bridge, estimation, loop
from ins_eval.paper_b.printed import PRINTED
from ins_eval.papers import CONTRADICTS, REPRODUCED, Row, between, decided, find, given, number, row

OURS = "Redrawn as our loop has it."


def figure_rows(results: Mapping) -> Iterator[Row]:
    """All of them."""
    exact, unit, population = (find(results, key) for key in ("exact", "unit", "population"))
    yield given("B-F1", "Pendulum", "a drawing without a number; it stands in our loop as the first block of Fig. 2.")
    yield row("B-F2", "Loop of the digital accelerometer", REPRODUCED, f"{OURS} It closes and settles at k0 a/k_fb.")
    yield row("B-F3", "Bridge and chain that measure ΔC", REPRODUCED, f"{OURS} Its gain is that of B3.")
    yield row(
        "B-F4",
        "Forward channel in open loop, for a moment M_in",
        CONTRADICTS,
        f"With the plate on its stop the counts do not depend on the moment: {', '.join(bridge.not_in_the_scan())} are "
        "no part of the chain (B5).",
    )
    yield decided(
        "B-F5",
        "Scan of N_FPGA and least squares",
        exact and True,
        exact and f"{OURS} It finds {number(exact['forward_ppm'], 5)} ppm of −200 without disturbances.",
        printed=PRINTED["table3"]["injected_ppm"],
        ours=exact["forward_ppm"] if exact else None,
        unit="ppm",
    )
    yield given(
        "B-F6", "Open loop excited through the torquer", "the rejected method, see B-E23; drawn for comparison."
    )
    yield decided(
        "B-F7",
        "Closed loop with the constant current: the same acceleration, another current",
        exact and True,
        exact
        and f"{OURS} Switched on, the counts move by {number(exact['counts_on_less_off'], 7)} and the loop settles "
        "again; the scale of our counts is chosen after the paper's.",
    )
    yield row(
        "B-F8",
        "Structure with both corrections",
        REPRODUCED,
        "Forward and feedback gain are corrected apart: a drift of the forward gain changes N_on − N_off by "
        f"{number(abs(loop.seen_ppm(k_pre=-200.0).on_less_off), 1)} ppm at a loop gain of 1e6.",
    )
    yield row("B-F9", "Sequence of the procedure", REPRODUCED, "Steps 1 to 5 run in this order here.")
    yield given("B-F10", "Photograph of the hardware", "it cannot be redrawn.")
    yield _traces("B-F11", "table3", "forward", population)
    yield _traces("B-F12", "table4", "feedback", population)
    left, outputs = find(population, "output_residual_percent"), find(unit, "outputs_ug")
    yield decided(
        "B-F13",
        "Output before the drift, with it, and compensated: the third nearer to the first than the second",
        left and left["interval95"][1] < 100.0,
        left
        and f"In single repetitions of our units {between(left)} % of the change are left."
        + (
            f" The identified unit, drawn here, has {number(outputs['uncompensated'])} µg uncompensated and "
            f"{number(outputs['compensated'])} compensated, of the other sign; the paper prints sizes, 193 and 24."
            if outputs
            else ""
        ),
        printed=PRINTED["output"]["residual_percent"],
        ours=left,
        unit="%",
    )


def _traces(id: str, table: estimation.Table, channel: str, population: Mapping | None) -> Row:
    shift = estimation.shift(table)
    drift = find(population, f"{channel}_ppm")
    apart = abs(PRINTED[table]["mean"]["drift_ppm"]) / shift.before_scatter_ppm
    return decided(
        id,
        f"Estimation of the {channel} gain before and after the drift: two levels apart",
        drift and apart > 3.0,
        drift
        and f"The printed levels are {number(apart)} times the scatter of one apart. Those of our units are apart by "
        f"{between(drift)} ppm, median and central 95 %; one repetition of the identified unit is drawn.",
        printed=PRINTED[table]["mean"]["drift_ppm"],
        ours=drift,
        unit="ppm",
    )
