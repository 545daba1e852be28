"""Rows of the figures: no curve can be read off the paper, so what captions and text say of them is judged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ins_eval.studies.paper_b.audit import bridge, estimation, loop
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.studies.papers import CONTRADICTS, Row, between, claimed, decided, number, row, same
from ins_eval.tables import pick

OURS = "Redrawn as our loop has it."
LEVELS_APART = 3.0  # scatters of a level at least


def figure_rows(results: Mapping) -> Iterator[Row]:
    """All of them."""
    exact, unit, population = (pick(results, key) for key in ("exact", "unit", "population"))
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
        exact and abs(exact["forward_ppm"] - PRINTED["table3"]["injected_ppm"]) < 1.0,
        exact and f"{OURS} It finds {number(exact['forward_ppm'], 5)} ppm of −200 without disturbances.",
        fails="without disturbances it missed the injected drift by more than 1 ppm",
        printed=PRINTED["table3"]["injected_ppm"],
        ours=exact["forward_ppm"] if exact else None,
        unit="ppm",
    )
    yield decided(
        "B-F7",
        "Closed loop with the constant current: the same acceleration, another current",
        exact and same(exact["counts_on_less_off"] / exact["counts_on_less_off_expected"], 1.0, 1e-5),
        exact
        and f"{OURS} Switched on, the counts move by {number(exact['counts_on_less_off'], 7)}, where "
        f"−I_ref/(k_VI k_DA) is {number(exact['counts_on_less_off_expected'], 7)}, and the loop settles again; the "
        "scale of our counts is chosen after the paper's.",
        fails="the two differed by more than 5 ppm",
    )
    across = abs(loop.seen_ppm(k_pre=-200.0).on_less_off)
    yield decided(
        "B-F8",
        "Structure with both corrections",
        across < 0.1,
        "Forward and feedback gain are corrected apart: a drift of the forward gain changes N_on − N_off by "
        f"{number(across, 1)} ppm at a loop gain of 1e6.",
        fails="200 ppm of the forward gain changed N_on − N_off by more than 0.1 ppm",
    )
    yield _traces("B-F11", "table3", "forward", population)
    yield _traces("B-F12", "table4", "feedback", population)
    left, outputs = pick(population, "output_residual_percent"), pick(unit, "outputs_ug")
    yield claimed(
        "B-F13",
        "Output before the drift, with it, and compensated: the third nearer to the first than the second",
        left,
        left
        and f"In single repetitions of our units {between(left)} % of the change are left."
        + (
            f" The identified unit, drawn here, has {number(outputs['uncompensated'])} µg uncompensated and "
            f"{number(outputs['compensated'])} compensated, of the other sign; the paper prints sizes, 193 and 24."
            if outputs
            else ""
        ),
        below=100.0,
        what="what is left",
        printed=PRINTED["output"]["residual_percent"],
        unit="%",
    )


def _traces(id: str, table: estimation.Table, channel: str, population: Mapping | None) -> Row:
    shift = estimation.shift(table)
    drift, scatter = (pick(population, f"{channel}_{what}_ppm") for what in ("repetition", "baseline_scatter"))
    apart = abs(PRINTED[table]["mean"]["drift_ppm"]) / shift.before_scatter_ppm
    known = drift and scatter
    return decided(
        id,
        f"Estimation of the {channel} gain before and after the drift: two levels apart",
        known and min(apart, min(map(abs, drift["interval95"])) / scatter["interval95"][1]) > LEVELS_APART,
        known
        and f"The printed levels are {number(apart)} times the scatter of one apart. Those of our units are apart by "
        f"{between(drift)} ppm in single repetitions, median and central 95 %, and one of them scatters by "
        f"{between(scatter)}; one repetition of the identified unit is drawn.",
        fails=f"the levels, printed or ours, were apart by less than {LEVELS_APART:g} times the scatter of one",
        printed=PRINTED[table]["mean"]["drift_ppm"],
        ours=drift,
        unit="ppm",
    )
