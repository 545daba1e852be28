"""Rows of eqs (1) to (17), of the two definitions in the text, and of the piecewise bias."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ins_eval.calibration.labelings import FIGURE_4, TURNED
from ins_eval.studies.paper_a.audit import chamber
from ins_eval.studies.paper_a.audit import scale_factor as audit
from ins_eval.studies.paper_a.printed import PRINTED, UNITS
from ins_eval.studies.papers import (
    CONTRADICTS,
    Row,
    as_printed,
    between,
    decided,
    given,
    listed,
    number,
    recalculated,
    row,
)
from ins_eval.tables import pick

EXACT = 1e-12  # relative, or in g: what counts as the same equation in double precision
K1, K0 = 1000.0, 0.01  # a scale factor and a bias in g that show what the printed positions give


def equation_rows(results: Mapping, ours: Mapping) -> Iterator[Row]:
    """All of them."""
    yield from _output(ours)
    yield from _four_point()
    yield from _bracket_squares(results)
    yield from _six_terms(results)
    yield from _definitions()
    bias = pick(ours, "bias")
    yield given(
        "A-PW",
        "Piecewise function of the bias",
        "the paper does not publish it. Ours has up to nine knots on a falling and a rising branch"
        + (f" and leaves {between(bias['open_by_branches_percent'])} % of the variance of K0 open." if bias else "."),
        ours=bias["open_by_branches_percent"] if bias else None,
        unit="%",
    )


def _output(ours: Mapping) -> Iterator[Row]:
    model = pick(ours, "model")
    forward, neglected, back = (pick(model, key) for key in ("forward", "neglected_ug", "compensated"))
    inverse = pick(model, "inverse")
    yield decided(
        "A-E1",
        "Eq. (1): output with every coefficient, and its inverse",
        model and forward < EXACT and inverse < EXACT,
        f"The simulated accelerometers agree with the printed equation to {number(forward or 0.0)} of the output; "
        f"the force is found again to {number(inverse or 0.0)} g. With all coefficients of the order of Table 5 "
        f"(30 µg, 30 µrad) eq. (2) would be wrong by up to {number(neglected or 0.0)} µg at forces of up to 2 g on "
        "each axis.",
        fails="our output differed from the printed equation, or the force that is found again, by more than 1e-12",
        ours=forward,
    )
    yield decided(
        "A-E2",
        "Eq. (2): output from K1, K0 and the specific force",
        model and back < EXACT,
        "It is eq. (1) with all other coefficients zero, and eq. (5) takes it back.",
        fails="eq. (5) gave the force with an error above 1e-12 g",
        ours=back,
        unit="g",
    )
    yield decided(
        "A-E5",
        "Eq. (5): compensated output",
        model and back < EXACT,
        f"Applied to eq. (2) it gives the specific force to {number(back or 0.0)} g.",
        fails="the force came back with an error above 1e-12 g",
        ours=back,
        unit="g",
    )
    yield decided(
        "A-E12",
        "Eq. (12): output with the six-term scale factor",
        model and back < EXACT,
        "It is eq. (2) with eq. (11) for K1; the compensation divides by the same K1, so it is exact where K1 and "
        "K0 are.",
        fails="the force came back with an error above 1e-12 g",
        ours=back,
        unit="g",
    )


def _four_point() -> Iterator[Row]:
    """The printed equations with both labelings, on a true K1 of 1000 and K0 of 0.01 g."""
    figure, turned = (chamber.labelled(forces, K1, K0) for forces in (FIGURE_4, TURNED))
    for k, quantity, truth, gives, also in (
        (3, "K1", K1, "-K1/2", "With the other labeling only half of the difference that is needed is taken."),
        (4, "K0", K0, "K0 - 1/2", "That is K0 - 1/2 either way."),
        (13, "K1", K1, "0", "So it needs the other labeling."),
        (
            14,
            "K0",
            K0,
            "K0",
            "Divided by the K1 of eq. (13) it would be infinite with the positions of Fig. 4, since that K1 is 0; "
            "and a quadratic coefficient K2 would be added to K0 in full.",
        ),
    ):
        key = f"eq{k}_{'scale' if quantity == 'K1' else 'bias'}"
        value, other = getattr(figure, key), getattr(turned, key)
        yield decided(
            f"A-E{k}",
            f"Eq. ({k}): {quantity} from four positions",
            abs(value - truth) < EXACT * K1,
            f"On K1 = {K1:g} pulse/s/g and K0 = {K0:g} g the positions of Fig. 4 (0°: +1 g, 90°: 0, 180°: -1 g, "
            f"270°: 0) give {number(value)} and the head a quarter turn further (90°: +1 g, 270°: -1 g) "
            f"{number(other)}. {also}",
            CONTRADICTS,
            fails=f"the printed positions gave another {quantity} than the true one, as they do in other equations",
            printed=quantity,
            recomputed=gives,
        )


def _bracket_squares(results: Mapping) -> Iterator[Row]:
    brackets = ((0.3, 1.1), (0.7, 1.3), (1.9, 1.7))  # any numbers: which terms there are does not depend on them
    squared, plain = audit.expanded(brackets, squared=True), audit.expanded(brackets, squared=False)
    left = [pick(results, "chamber", "table4", unit, "quadratic") for unit in UNITS]
    yield given(
        "A-E6",
        "Eq. (6): scale factor as a parabola in temperature",
        "a definition, which is eq. (11) at a rate of zero; the calibration has it as its quadratic arm."
        + (f" That leaves {' / '.join(between(e) for e in left)} ppm/°C of the three units." if all(left) else ""),
    )
    demanded = [audit.constraint(unit) for unit in UNITS]
    reason = (
        "Squared, the brackets demand ε² = 4 α γ and μ ≥ 0: ε = "
        f"{listed([c.epsilon_demanded for c in demanded], 6)} where "
        f"{as_printed([c.epsilon_printed for c in demanded])} is printed, and μ is printed as "
        f"{as_printed([c.mu_printed for c in demanded])}."
    )
    yield row("A-E7", "Eq. (7): squares of brackets linear in the rate", CONTRADICTS, reason)
    for k, name in ((8, "q"), (9, "w"), (10, "r")):
        yield row(
            f"A-E{k}",
            f"Eq. ({k}): {name} as a bracket",
            CONTRADICTS,
            f"It equates {name} to the bracket itself, while eq. (7) puts its square in the place of {name}. "
            f"Without the square there is no term in r² ({'none' if (2, 0) not in plain else 'one'} of "
            f"{len(plain)}), which eq. (11) has; with it there are {len(squared)} terms.",
        )


def _six_terms(results: Mapping) -> Iterator[Row]:
    residual = [pick(results, "chamber", "residual_rms_ppm", unit, "hysteresis") for unit in UNITS]
    rates = PRINTED["chamber"]["rates_c_per_min"]
    ours = f" Ours leaves {' / '.join(between(r) for r in residual)} ppm RMS." if all(residual) else ""
    yield row(
        "A-E11",
        "Eq. (11): six-term scale factor",
        CONTRADICTS,
        "It does not follow from eq. (7), whose constraints the printed coefficients break (A6). As a free "
        "polynomial it is determined by the four rates in both directions (rank "
        f"{audit.rank([s * r for r in rates for s in (-1, 1)])} of 6), and so it is used here.{ours}",
    )
    for k, unit in zip((15, 16, 17), UNITS, strict=True):
        value, table = audit.printed_sensitivity(unit), PRINTED[unit]["table4"]["none"]
        yield row(
            f"A-E{k}",
            f"Eq. ({k}): coefficients of {unit}",
            CONTRADICTS,
            f"With T0 = 22 °C they give {number(value)} ppm/°C over the quoted range where Table 4 has {table:g}; "
            f"T0 would have to be {number(audit.reference_needed_c(unit))} °C. T0, the unit of the rate and the "
            "time base of a pulse are not printed.",
            printed=table,
            recomputed=value,
            unit="ppm/°C",
        )


def _definitions() -> Iterator[Row]:
    """The paper's change in ppm and sensitivity, on the changes and ranges that its text quotes."""
    for unit in UNITS:
        of = PRINTED[unit]
        quoted = audit.quoted_sensitivity(unit)
        # the range is given "about", to a degree at either end: the quotient is then good to
        slack = quoted * 2.0 / (of["range_c"][1] - of["range_c"][0])
        yield recalculated(
            f"A-S/{unit.removeprefix('JB-KT8 ')}",
            f"{unit}: change over the range, divided by the range",
            of["text_ppm_per_c"],
            quoted,
            1.0,
            f"{of['change_ppm']:.0f} ppm over {of['range_c'][1] - of['range_c'][0]:g} °C is {number(quoted, 4)} "
            f"ppm/°C; the text says {of['text_ppm_per_c']:g}, Table 4 {of['table4']['none']:g}. A degree more or "
            f"less at each end would change it by {number(slack, 2)}.",
            unit="ppm/°C",
        )
