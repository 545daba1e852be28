"""Rows of Tables 1 to 4."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ins_eval.studies.paper_b.audit import estimation
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.studies.papers import CONTRADICTS, Row, decided, given, number, row, simulated
from ins_eval.tables import pick

CLASSES = {
    "electrostatic": "Electrostatic accelerometer",
    "floated": "Floated pendulous accelerometer",
    "qfa": "QFA",
    "mems": "MEMS",
}
STATIC = {
    "bias_stability_ug": ("bias stability", "µg"),
    "bias_repeatability_ug": ("bias repeatability over a month", "µg"),
    "scale_linearity_ppm": ("scale factor linearity", "ppm"),
    "scale_repeatability_ppm": ("scale factor repeatability over a month", "ppm"),
}
GAINS = {"table3": ("B-T3", "forward", "Forward gain"), "table4": ("B-T4", "feedback", "Feedback gain")}


def table_rows(results: Mapping) -> Iterator[Row]:
    """All of them."""
    yield from _classes()
    yield from _static(results)
    for table in GAINS:
        yield from _gain(table, results)
    yield row(
        "B-T4/sign",
        "Feedback gain: sign of what is tabled, the gain being raised by 200 ppm",
        CONTRADICTS,
        "By eq. (26) N_on − N_off is −I_ref/(k_VI k_DA) and has to shrink where the gain grows; the tabled numbers "
        "grow in size (B9).",
        printed=PRINTED["table4"]["mean"]["drift_ppm"],
        recomputed=estimation.expected_by_26_ppm(),
        ours=pick(results, "exact", "counts_feedback_ppm"),
        unit="ppm",
    )


def _classes() -> Iterator[Row]:
    of = PRINTED["classes"]
    for k, (key, name) in enumerate(CLASSES.items()):
        bias, scale = (_range(of[quantity][key]) for quantity in ("bias_stability_ug", "scale_stability_ppm"))
        yield given(
            f"B-T1/{key}",
            f"{name}: bias and scale factor stability, cost, time of manufacture",
            "a survey of classes, quoted from another paper.",
            printed=f"{bias} µg, {scale} ppm, {of['cost'][k]}, {of['manufacture'][k]}",
        )
    static = PRINTED["static"]
    bias, scale = of["bias_stability_ug"]["qfa"], of["scale_stability_ppm"]["qfa"]
    inside = bias[0] <= static["bias_stability_ug"] <= bias[1] and (
        scale[0] <= static["scale_repeatability_ppm"] <= scale[1]
    )
    yield decided(
        "B-T1/tested",
        "The tested accelerometer of Table 2 belongs to the class QFA",
        inside,
        f"{static['bias_stability_ug']:g} µg lie within {_range(bias)} µg, and "
        f"{static['scale_repeatability_ppm']:g} ppm within {_range(scale)} ppm.",
        CONTRADICTS,
        fails="one of the two left the range of its class",
    )


def _range(ends: list[float]) -> str:
    return f"{ends[0]:g} to {ends[1]:g}" if ends[0] < ends[1] else f"{ends[0]:g}"


def _static(results: Mapping) -> Iterator[Row]:
    noise = pick(results, "unit", "static_scatter_ug")
    for key, (words, unit) in STATIC.items():
        known = key == "bias_stability_ug" and noise
        yield given(
            f"B-T2/{key}",
            f"Tested accelerometer: {words}",
            "an index of the device, which nothing in the paper measures."
            + (
                f" The averaged static output of our identified unit repeats to {number(noise, 2)} µg." if known else ""
            ),
            printed=PRINTED["static"][key],
            ours=noise if known else None,
            unit=unit,
        )


def _gain(table: estimation.Table, results: Mapping) -> Iterator[Row]:
    """The six repetitions, their mean, the residuals, and the gain itself."""
    id, channel, name = GAINS[table]
    printed, found, shift = PRINTED[table], estimation.of(table), estimation.shift(table)
    sign = -1.0 if table == "table4" else 1.0  # the table counts N_on - N_off, the estimator its inverse
    population, unit = pick(results, "population"), pick(results, "unit", f"{channel}_ppm")
    slack = found.rounding_ppm
    for k, drift in enumerate(printed["drift_ppm"]):
        agrees = abs(drift - found.drift_ppm[k]) <= slack
        reason = (
            f"The gains of the row give {number(found.drift_ppm[k], 5)} ± {number(slack, 2)} ppm"
            f"{'' if agrees else ', which is not it'}, {number(found.residual_percent[k])} % from the injected "
            f"{found.injected_ppm:g} ppm."
        )
        if unit:
            reason += f" The identified unit, chosen after this table: {number(unit[k], 4)} ppm."
        yield simulated(
            f"{id}/{k + 1}",
            f"{name}, repetition {k + 1}: drift found",
            drift,
            pick(population, f"{channel}_repetition_ppm"),
            "the central 95 % of single repetitions of our units",
            reason,
            nothing=found.injected_ppm,
            recomputed=float(found.drift_ppm[k]),
            unit="ppm",
        )
    drift, residual = printed["mean"]["drift_ppm"], printed["mean"]["residual_percent"]
    enough = _warm_up_needed(population, channel, shift.mean_ppm)
    yield simulated(
        f"{id}/mean",
        f"{name}: mean drift of the six repetitions",
        drift,
        pick(population, f"{channel}_ppm"),
        "the central 95 % of our units, six repetitions each",
        f"The gains give {number(float(found.drift_ppm.mean()), 5)} ppm. It is {number(shift.mean_ppm)} ± "
        f"{number(shift.error_ppm, 2)} ppm from what was injected, {number(shift.sigmas)} standard errors (B10)."
        + (
            f" Our interval grows with the warm-up, {number(population['warm_up_c']['value'], 2)} °C and assumed; it "
            f"holds the printed value from {number(enough, 2)} °C on, and the paper allows 3."
            if population
            else ""
        ),
        nothing=found.injected_ppm,
        recomputed=float(found.drift_ppm.mean()),
        unit="ppm",
    )
    of_rows, _, of_gains = estimation.mean_residual_percent(table)
    yield simulated(
        f"{id}/residual",
        f"{name}: mean residual",
        residual,
        pick(population, f"{channel}_residual_percent"),
        "what 95 % of our units stay below",
        f"The gains give {number(of_gains, 4)} %, the mean of the six printed residuals is {number(of_rows, 4)} %.",
        recomputed=of_gains,
        unit="%",
    )
    yield given(
        f"{id}/scatter",
        f"{name}: scatter of the six repetitions",
        "it is not printed and follows from the rows; how much the warm-up differs from one repetition to the next was "
        "assumed with it in view.",
        recomputed=shift.scatter_ppm,
        ours=pick(population, f"{channel}_scatter_ppm"),
        unit="ppm",
    )
    mean = printed["mean"]["before"]
    yield given(
        f"{id}/gain",
        f"{name}: the gain itself, in the paper's counts",
        "the scale of our counts is chosen so."
        + (" The sign is that of the test current." if sign < 0 else " It stands for no physical unit."),
        printed=f"{mean:.2f}" if table == "table4" else f"{mean:.4f}",  # all its digits
        unit="count" if table == "table4" else "count per step",
    )


def _warm_up_needed(population: Mapping | None, channel: str, shift_ppm: float) -> float | None:
    """Warm-up in degC from which our central 95 % would hold a shift: its ends are in proportion to it."""
    if population is None:
        return None
    low, high = population[f"{channel}_shift_ppm"]["interval95"]
    return population["warm_up_c"]["value"] * shift_ppm / (high if shift_ppm > 0.0 else low)
