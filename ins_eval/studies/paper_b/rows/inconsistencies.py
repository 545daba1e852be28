"""What does not fit together in Paper B: B1 to B22, each from a computation in ``audit``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ins_eval.studies.paper_b.audit import bridge, electronics, estimation, loop, output, pendulum, wording
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.studies.papers import (
    CONTRADICTS,
    GIVEN,
    NOT_REPRODUCED,
    Row,
    as_printed,
    between,
    decided,
    listed,
    number,
    row,
    simulated,
)
from ins_eval.tables import pick

ANY_PENDULUM = (2.0, 5.0, 1.0)  # J, C, D: overdamped
UNDERDAMPED = (2.0, 2.0, 1.0)
DRIFT_PPM = 200.0
DA0_BITS = (16, 18, 20)
AMPLIFIERS = (2.0, 5.0, 10.0, 50.0)
TEN_FOLD_PPM = 1000.0
SINGLE = "the central 95 % of single repetitions of our units, as sizes"


def inconsistency_rows(results: Mapping) -> Iterator[Row]:
    """All of them."""
    yield from _equations(results)
    yield from _wording()
    yield from _tables(results)
    yield from _output(results)
    yield from _sight(results)
    yield from _electronics(results)


def _equations(results: Mapping) -> Iterator[Row]:
    exact = pick(results, "exact")
    printed, right = (pendulum.steady_state(*ANY_PENDULUM, printed=p) for p in (True, False))
    j = ANY_PENDULUM[0]
    yield row(
        "B1",
        "Limit of eq. (2) against eq. (3)",
        CONTRADICTS,
        f"The partial fractions lack 1/J: eq. (2) tends to M J/D, eq. (3) is M/D. With J = {j:g} the one is "
        f"{number(printed / right)} times the other, whatever C and D."
        + (f" With J = {exact['inertia']:.1e} kg m² of ours it would be next to nothing." if exact else ""),
        printed="M/D",
        recomputed="M J/D",
    )
    poles = pick(exact, "poles_rad_s")
    yield row(
        "B2",
        "Overdamped pendulum, C² > 4 D J, not stated",
        NOT_REPRODUCED,
        f"{GIVEN}eqs (1), (2) need two real poles; for J, C, D = {as_printed(UNDERDAMPED)} they divide by "
        f"|s2| − |s1| = {number(pendulum.divisor(*UNDERDAMPED))}."
        + (f" Ours has its poles at {listed(poles, 4)} rad/s." if poles else ""),
        recomputed=pendulum.divisor(*UNDERDAMPED),
        unit="rad/s",
    )
    yield row(
        "B3",
        "Eq. (4): unit, and gain at null",
        CONTRADICTS,
        "V_IN times ΔC is V F and no voltage; and k_CV, the bracket, is zero at C1 = C2 where the loop works. With "
        f"C1,2 = C0 ± ΔC/2 the slope of the bracket is {number(bridge.gain(1.0))}/C0.",
        printed=bridge.printed_gain_at_null(),
        recomputed=bridge.gain(1.0),
        unit="V_IN k_amp/C0",
    )
    closed, opened = bridge.closed_loop_gain_ppm(DRIFT_PPM), bridge.open_loop_gain_ppm(DRIFT_PPM)
    yield row(
        "B4",
        "References of the bridge: effect in open loop against that at null",
        CONTRADICTS,
        f"200 ppm of Cref1 change the gain of the open loop by {number(opened)} ppm (Cref2 by "
        f"{number(bridge.open_loop_gain_ppm(0.0, DRIFT_PPM))}) and that at null by {number(closed)}; there they shift "
        "the null. The scan takes such a drift for one of the forward gain, and the correction puts it in.",
        printed="identical",
        recomputed=opened,
        ours=pick(exact, "reference_open_ppm"),
        unit="ppm",
    )
    missing = bridge.not_in_the_scan()
    yield row(
        "B5",
        "Eq. (17): moment, stiffness and k1 in the scan",
        CONTRADICTS,
        f"With the plate on its stop {', '.join(missing)} are not in the counts: the scan cannot see their drift, and "
        "the correction leaves it."
        + (
            f" Ours: 200 ppm of the stiffness give {number(exact['stiffness_scan_ppm'], 1)} ppm, of the gap "
            f"{number(exact['spacing_scan_ppm'], 1)}."
            if exact
            else ""
        ),
        printed=len(PRINTED["factors"]["eq17"]),
        recomputed=len(PRINTED["factors"]["open_loop"]),
        unit="factors",
    )


def _wording() -> Iterator[Row]:
    """Symbols and references."""
    steps, counts = np.arange(21.0), 479.1 * (800.0 + np.arange(21.0))
    slopes = [wording.slope(steps, counts, first) for first in (counts[0], 0.9 * counts[0])]
    two = "; ".join(" and ".join(names) for names in wording.symbols().values())
    yield row(
        "B6",
        "Symbols: N(0) for N'(0), and two names for one quantity",
        CONTRADICTS,
        "Eq. (21) subtracts the first count of the other state. The least squares are centred, so their slope stays "
        f"the same to {number(abs(slopes[1] / slopes[0] - 1.0) / 1e-6, 1)} ppm. Two names for one: {two}.",
        printed=PRINTED["symbols"]["subtracted_in_21"],
        recomputed=PRINTED["symbols"]["same_status_in_21"],
    )
    wrong = wording.wrong_references()
    yield row(
        "B7",
        "References to tables in section IV-B",
        CONTRADICTS,
        "The residuals stand one table further on than the text says.",
        printed=", ".join(wrong),
        recomputed=", ".join(wrong.values()),
    )


def _tables(results: Mapping) -> Iterator[Row]:
    three, four = (estimation.of(table) for table in ("table3", "table4"))
    apart = [
        float(np.abs(np.array(PRINTED[t]["drift_ppm"]) - r.drift_ppm).max())
        for t, r in (("table3", three), ("table4", four))
    ]
    rows_mean, _, gains_mean = estimation.mean_residual_percent("table4")
    yield decided(
        "B8",
        "Rows of Tables 3 and 4 from their gains",
        apart[0] <= three.rounding_ppm and apart[1] <= four.rounding_ppm,
        f"All drifts follow to {listed(apart, 1)} ppm, less than the rounding of the gains "
        f"({listed([three.rounding_ppm, four.rounding_ppm], 2)} ppm). The mean residual of Table 4 is "
        f"{rows_mean:.2f} % as the mean of the six printed ones and {gains_mean:.2f} % from the gains, as printed.",
        CONTRADICTS,
        fails="one of the twelve drifts differed by more than the rounding of its gains",
        printed=PRINTED["table4"]["mean"]["residual_percent"],
        recomputed=gains_mean,
        unit="%",
    )
    yield row(
        "B9",
        "Sign of Table 4",
        CONTRADICTS,
        "Listed is N_on − N_off or its like, in counts, and no gain; by eq. (26) its size falls by "
        f"{number(abs(estimation.expected_by_26_ppm()), 5)} ppm where k_VI k_DA grows by 200, and it rises by "
        f"{number(estimation.tabled_change_ppm(), 5)}. Here the estimator is ΔN0/ΔN1 − 1 and Table 4 is read as if its "
        "sign were turned.",
        printed=PRINTED["table4"]["mean"]["drift_ppm"],
        recomputed=estimation.expected_by_26_ppm(),
        ours=pick(results, "exact", "counts_feedback_ppm"),
        unit="ppm",
    )
    forward, feedback = estimation.shift("table3"), estimation.shift("table4")
    population, scaling = pick(results, "population"), pick(results, "scaling")
    ours = ""
    if population:
        ours += (
            " Ours: forward "
            f"{between(population['forward_shift_ppm'])}, feedback {between(population['feedback_shift_ppm'])} ppm, "
            "median and central 95 % of the units, of either sign."
        )
    if scaling:
        ours += (
            f" With {TEN_FOLD_PPM:g} ppm injected the same tests shift by {number(scaling['forward_ratio'], 4)} and "
            f"{number(scaling['feedback_ratio'], 4)} times as much."
        )
    yield row(
        "B10",
        "Residuals of 9.74 and 9.08 % taken for a share that is not estimated",
        CONTRADICTS,
        f"They are a shift of {number(forward.mean_ppm)} ± {number(forward.error_ppm, 2)} ppm "
        f"({number(forward.sigmas)} standard errors) and of {number(feedback.mean_ppm)} ± "
        f"{number(feedback.error_ppm, 2)} ppm "
        f"({number(feedback.sigmas, 2)}), of one sign in all twelve repetitions: of the feedback gain "
        f"{number(estimation.found_share_percent('table4'), 4)} % were found. A shift that comes with the state and "
        f"not with the injected size would read as {number(estimation.would_read_percent('table3', TEN_FOLD_PPM))} and "
        f"{number(estimation.would_read_percent('table4', TEN_FOLD_PPM))} % estimated at {TEN_FOLD_PPM:g} ppm. The "
        f"gains of one repetition move together (correlation {number(forward.correlation, 2)} and "
        f"{number(feedback.correlation, 2)}).{ours}",
        printed=PRINTED["table3"]["mean"]["residual_percent"],
        recomputed=100.0 - estimation.would_read_percent("table3", TEN_FOLD_PPM),
        ours=100.0 * scaling["forward_rms_ppm"] / TEN_FOLD_PPM if scaling else None,
        unit="%",
    )
    over = estimation.over_claimed_error()
    yield row(
        "B11",
        "Estimation error within 10 ppm",
        CONTRADICTS,
        f"Tables 3 and 4 are {listed([forward.mean_ppm, feedback.mean_ppm])} ppm off, {listed(over, 2)} times as much.",
        printed=PRINTED["text"]["estimation_error_ppm"],
        recomputed=forward.mean_ppm,
        ours=pick(population, "estimation_error_ppm"),
        unit="ppm",
    )


def _output(results: Mapping) -> Iterator[Row]:
    population = pick(results, "population")
    printed, inverse = output.residual_percent()
    yield row(
        "B12",
        "Eq. (31)",
        CONTRADICTS,
        f"193/24 is {number(printed)} %; 24/193 is {number(inverse, 5)} %.",
        printed=PRINTED["output"]["residual_percent"],
        recomputed=printed,
        unit="%",
    )
    stability = PRINTED["static"]["bias_stability_ug"]
    yield simulated(
        "B13",
        "24 µg measured with a bias stability of 50 µg",
        PRINTED["output"]["compensated_ug"],
        pick(population, "compensated_ug"),
        "what 95 % of single repetitions of our units stay below",
        f"One difference without an interval, below the {stability:g} µg of Table 2; the feedback estimate alone would "
        f"leave {number(output.feedback_residual_ug())} µg.",
        recomputed=output.feedback_residual_ug(),
        unit="µg",
    )
    yield simulated(
        "B14",
        "193 µg where +200 ppm at 1 g make 200",
        PRINTED["output"]["uncompensated_ug"],
        pick(population, "uncompensated_ug"),
        SINGLE,
        nothing=output.expected_change_ug(),
        reason=f"{number(abs(output.missing_ppm()))} ppm are missing; a drift of the magnet by as much between the two "
        "states suffices, which N_on − N_off does not see.",
        recomputed=output.expected_change_ug(),
        unit="µg",
    )


def _sight(results: Mapping) -> Iterator[Row]:
    exact, unit = pick(results, "exact"), pick(results, "unit")
    magnet = loop.seen_ppm(k_t=DRIFT_PPM)
    yield row(
        "B15",
        "δk_fb of eq. (13) against that of eq. (28)",
        CONTRADICTS,
        f"N_on − N_off cancels k_t: 200 ppm of B change it by {number(abs(magnet.on_less_off), 1)} ppm and the output "
        f"by {number(magnet.off)}, so {' and '.join(loop.not_seen())} are not compensated. What is found is "
        "δ(k_VI k_DA) less the drift of I_ref."
        + (
            f" Ours: {number(exact['magnet_current_ppm'], 1)} ppm in the test, "
            f"{number(exact['magnet_output_ug'], 5)} µg in the output."
            if exact
            else ""
        ),
        printed=DRIFT_PPM,
        recomputed=magnet.on_less_off,
        ours=pick(exact, "magnet_current_ppm"),
        unit="ppm",
    )
    forward = loop.seen_ppm(k_pre=-DRIFT_PPM)
    margins = pick(results, "stability")
    yield row(
        "B16",
        "The output test as a proof of the forward correction",
        CONTRADICTS,
        f"−200 ppm of the forward gain change the output by {number(abs(forward.off), 1)} ppm at a loop gain of 1e6, "
        "and by nothing with an integrator: 193 and 24 µg say nothing of the forward channel. What it changes is "
        "bandwidth and margin."
        + (f" Ours: {number(abs(exact['output_forward_ug']), 1)} µg." if exact else "")
        + (
            f" Crossover {margins['nominal']['crossover_hz']:.2f} to {margins['drifted']['crossover_hz']:.2f} Hz."
            if margins
            else ""
        ),
        printed="compensated",
        recomputed=forward.off,
        ours=pick(exact, "output_forward_ug"),
        unit="ppm",
    )
    left, open_ug = output.closure_ug()
    of_unit = pick(unit, "closure_ug")
    error = estimation.shift("table4").error_ppm
    yield decided(
        "B21",
        "Closure of 193, 218 and 24",
        abs(open_ug) <= error,
        f"−193 µg of output and a correction by 218.15 ppm leave {number(left, 3)} µg, {number(abs(open_ug), 2)} from "
        f"the printed 24 and less than the ±{number(error, 2)} of the mean: it is "
        "over-compensation. Feedback estimate and output differ by "
        f"{number(output.magnet_and_current_ppm())} ppm, which are the drifts of I_ref and B together between the two "
        "states."
        + (
            f" The identified unit, chosen after them, closes to {number(abs(of_unit), 2)} µg, our units to "
            f"{between(results['population']['closure_ug'])}."
            if of_unit is not None and pick(results, "population", "closure_ug")
            else ""
        ),
        CONTRADICTS,
        fails="the three numbers left more open than the error of the mean",
        passes=(left - error, left + error),
        printed=PRINTED["output"]["compensated_ug"],
        recomputed=left,
        unit="µg",
    )


def _electronics(results: Mapping) -> Iterator[Row]:
    steps = [electronics.step_ppm(bits) for bits in DA0_BITS]
    bits = pick(results, "exact", "reference_bits")
    yield row(
        "B17",
        "Resolution of DA0",
        NOT_REPRODUCED,
        f"{GIVEN}it is not stated. At the middle of its range one step is {listed(steps)} ppm with "
        f"{' / '.join(map(str, DA0_BITS))} bits; a correction to 2 ppm needs {electronics.bits_for(2.0)}."
        + (f" Ours has {bits:g}." if bits else ""),
        recomputed=steps[0],
        ours=electronics.step_ppm(int(bits)) if bits else None,
        unit="ppm",
    )
    yield decided(
        "B18",
        "Table 2 against Table 5 of Paper A",
        wording.same_as_paper_a(),
        "All four numbers are those of the accelerometers there, an analog unit; one data sheet holds both.",
        fails="one of the four were another number",
        printed=as_printed(list(PRINTED["static"].values())),
        recomputed=as_printed(list(dict(wording.INS.accelerometer).values())),
        unit="µg, µg, ppm, ppm",
    )
    shares = wording.shares()
    yield row(
        "B19",
        "Abstract: 90.26 % of the gain-drifting",
        CONTRADICTS,
        "It is the share of the forward gain alone, which the output does not show (B16); the feedback gain has "
        f"{number(shares['feedback'], 4)} %.",
        printed=PRINTED["abstract"]["estimated_percent"],
        recomputed=as_printed([round(share, 2) for share in shares.values()]),
        unit="%",
    )
    low, high = estimation.room_ppm()
    shift = [estimation.shift(table).mean_ppm for table in ("table3", "table4")]
    largest = max(shift, key=abs)
    yield decided(
        "B20",
        "Room within 3 °C against the residuals: the larger shift of Tables 3 and 4",
        abs(largest) <= high,
        f"Ordinary parts of 5 to 10 ppm/°C make ±{low:g} to ±{high:g} ppm of it; the shifts of {listed(shift)} ppm lie "
        "within, so the room suffices to explain them (B10).",
        fails="it were larger than what ordinary parts drift in such a room",
        passes=(-high, high),
        printed=largest,
        recomputed=f"±{low:g} to ±{high:g}",
        unit="ppm",
    )
    found = [electronics.amplifier_ppm(gain, -DRIFT_PPM) for gain in AMPLIFIERS]
    explains = electronics.gain_that_explains(PRINTED["table3"]["mean"]["drift_ppm"], -DRIFT_PPM)
    yield row(
        "B22",
        "Gain changed by a resistor",
        NOT_REPRODUCED,
        f"{GIVEN}the circuit is not printed. In a non-inverting amplifier −200 ppm of Rf make {listed(found)} ppm at "
        f"G = {as_printed(AMPLIFIERS)}; G = "
        f"{number(explains)} alone would give the mean of Table 3. "
        "Ours puts the drift into the gain, and can put it into the resistor.",
        printed=-DRIFT_PPM,
        recomputed=found[2],
        unit="ppm",
    )
