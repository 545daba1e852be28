"""Rows of equations (1) to (31)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ins_eval.studies.paper_b.audit import bridge, electronics, loop, output, pendulum
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.studies.papers import (
    CONTRADICTS,
    Row,
    decided,
    number,
    row,
    same,
)
from ins_eval.tables import pick
from ins_eval.units import PPM

ANY_PENDULUM = (2.0, 5.0, 1.0)  # J, C, D: overdamped; which factor is lost does not depend on them
DRIFT_PPM = 200.0
COUNTS = 1e-4  # last digit, as a share, to which counts of the loop are compared
TESTS = {"current_test_ppm": "test with the constant current", "output_ug": "output at 1 g"}


def equation_rows(results: Mapping) -> Iterator[Row]:
    """All of them."""
    exact, quiet = pick(results, "exact"), pick(results, "quiet")
    seen = {part["part"]: part for part in pick(results, "observability") or ()}
    yield from _pendulum(exact)
    yield from _bridge(exact, seen)
    yield from _gains(exact, seen)
    yield from _forward(exact)
    yield from _excitation(exact, quiet)
    yield from _closed_loop(exact, pick(results, "in_flight"))
    yield from _feedback(exact)


def _pendulum(exact: Mapping | None) -> Iterator[Row]:
    j, _, d = ANY_PENDULUM
    printed, right = (pendulum.steady_state(*ANY_PENDULUM, printed=p) for p in (True, False))
    for k, title in (
        (1, "Eq. (1): deflection of the pendulum by partial fractions"),
        (2, "Eq. (2): deflection over time"),
    ):
        yield row(
            f"B-E{k}",
            title,
            CONTRADICTS,
            "The partial fractions lack a factor 1/J, so that the limit is M J/D and not the M/D of eq. (3) (B1)."
            + (" The poles have to be real and distinct, which is not stated (B2)." if k == 1 else ""),
            printed="M/D",
            recomputed="M J/D",
        )
    error = pick(exact, "steady_state_error")
    yield decided(
        "B-E3",
        "Eq. (3): steady deflection M/D",
        same(right, 1.0 / d, 1e-9) and not same(printed, right, 1e-3),
        f"It holds with the 1/J, whatever J and C; by eq. (2) as printed it would be {number(printed / right)} times "
        f"as much for J = {j:g}."
        + (f" Our pendulum, exactly discretised, settles there to {number(error, 2)} of it." if exact else ""),
        CONTRADICTS,
        fails="the limit were not 1/D, as it is not by eq. (2) as printed",
    )


def _bridge(exact: Mapping | None, seen: Mapping) -> Iterator[Row]:
    yield row(
        "B-E4",
        "Eq. (4): output of the bridge",
        CONTRADICTS,
        "The ratio already holds the difference of the capacitances; multiplied by ΔC again it is no voltage, and "
        "its k_CV is zero at C1 = C2 (B3). Without it k_CV is V_IN k_amp/(4 C0).",
        printed=bridge.printed_gain_at_null(),
        recomputed=bridge.gain(1.0),
        unit="V_IN k_amp/C0",
    )
    closed, opened = bridge.closed_loop_gain_ppm(DRIFT_PPM), bridge.open_loop_gain_ppm(DRIFT_PPM)
    shifted = bridge.voltage(bridge.null_shift_ppm(DRIFT_PPM) * PPM, 1.0, bridge.reference_ratio(DRIFT_PPM))
    yield decided(
        "B-E5",
        "Eq. (5): bridge at null, with unequal references",
        abs(shifted) < 1e-12 and abs(closed) < 1e-6,
        f"It is an offset: {DRIFT_PPM:g} ppm of Cref1 shift the null to ΔC = {number(bridge.null_shift_ppm(200.0))} "
        "ppm of C0, where the bridge is balanced again with the same gain."
        + (f" The hinge then makes {number(exact['reference_output_ug'], 2)} µg of it in ours." if exact else ""),
        fails="the bridge were not balanced there, or its gain had changed",
        recomputed=bridge.null_shift_ppm(DRIFT_PPM),
        unit="ppm",
    )
    yield row(
        "B-E6",
        "Eq. (6): the references change the gain of the bridge at null",
        CONTRADICTS,
        f"By eqs (4) and (5) they do not: {DRIFT_PPM:g} ppm of Cref1 change k_CV by {number(closed)} ppm; the other "
        "factors act as printed.",
        printed="f(Cref1/(Cref1 + Cref2))",
        recomputed=closed,
        unit="ppm",
    )
    yield _approximation("B-E7", "Eq. (7): gain of the converter, 1/(1 + δ) as 1 − δ", _reading(seen, "adc_reference"))
    product = electronics.product_error_ppm([100.0] * 4)
    yield decided(
        "B-E8",
        "Eq. (8): forward gain as a product of drifting parts, approximately linear",
        abs(product) < 1.0,
        f"For four parts of 100 ppm the sum of the drifts is {number(product, 2)} ppm from the product.",
        fails="the two differed by 1 ppm",
        recomputed=product,
        unit="ppm",
    )
    yield row(
        "B-E16",
        "Eq. (16): the references act on the open-loop gain as on the bridge at null",
        CONTRADICTS,
        f"{DRIFT_PPM:g} ppm of Cref1 change the open-loop gain by {number(opened)} ppm and that at null by "
        f"{number(closed)} (B4).",
        printed="identical",
        recomputed=opened,
        ours=pick(exact, "reference_open_ppm"),
        unit="ppm",
    )


def _approximation(id: str, title: str, ours: float | None = None) -> Row:
    error = electronics.inverse_error_ppm(DRIFT_PPM)
    return decided(
        id,
        title,
        abs(error) < 1.0,
        f"At {DRIFT_PPM:g} ppm it is wrong by {number(abs(error), 1)} ppm."
        + (f" Ours: 200 ppm of the reference make {number(ours, 5)} ppm of the scan." if ours is not None else ""),
        fails="it were wrong by 1 ppm",
        recomputed=error,
        unit="ppm",
    )


def _gains(exact: Mapping | None, seen: Mapping) -> Iterator[Row]:
    yield _part(
        "B-E9", "Eq. (9): gain of DA2 and its reference", seen, "dac_reference", "current_test_ppm", DRIFT_PPM, "ppm"
    )
    yield row(
        "B-E10",
        "Eq. (10): gain of the voltage-to-current converter",
        CONTRADICTS,
        "V_in/R is a current; as a gain of the voltage it is 1/R, and so it is used here.",
        printed="V_in/R",
        recomputed="1/R",
    )
    yield _part("B-E11", "Eq. (11): length of the coil times arm", seen, "coil_length", "output_ug", -DRIFT_PPM, "µg")
    sight = loop.seen_ppm(k_t=DRIFT_PPM)
    yield _part("B-E12", "Eq. (12): magnetic induction", seen, "magnet", "output_ug", -DRIFT_PPM, "µg")
    yield row(
        "B-E13",
        "Eq. (13): feedback gain and its drift δk_fb",
        CONTRADICTS,
        f"It holds as a product. But eq. (28) gives the drift that it finds the same name, and that one lacks "
        f"{' and '.join(loop.not_seen())}: 200 ppm of B change the output by {number(sight.off)} ppm and N_on − N_off "
        f"by {number(abs(sight.on_less_off), 1)} (B15).",
        printed=DRIFT_PPM,
        recomputed=sight.on_less_off,
        ours=pick(exact, "magnet_current_ppm"),
        unit="ppm",
    )


def _part(id: str, title: str, seen: Mapping, part: str, test: str, expected: float, unit: str) -> Row:
    """A factor of a gain: 200 ppm of it have to change a test by as much."""
    found = _reading(seen, part, test)
    return decided(
        id,
        title,
        None if found is None else abs(found - expected) < 0.1,
        found is not None
        and f"A factor of the gain: ours drifted by 200 ppm changes the {TESTS[test]} by {number(found, 5)} {unit}.",
        fails=f"it changed it by another number than {number(expected)}, to 0.1",
        ours=found,
        unit=unit,
    )


def _reading(seen: Mapping, part: str, test: str = "forward_scan_ppm") -> float | None:
    """What a test of ours reads of a drift of a part by 200 ppm."""
    return pick(seen, part, test)


def _forward(exact: Mapping | None) -> Iterator[Row]:
    missing = ", ".join(bridge.not_in_the_scan())
    yield row(
        "B-E17",
        "Eq. (17): counts of the open loop, with the moment and 1/D",
        CONTRADICTS,
        f"In open loop the plate lies on its stop and ΔC is that of the stop: {missing} are not in the counts (B5).",
        printed=len(PRINTED["factors"]["eq17"]),
        recomputed=len(PRINTED["factors"]["open_loop"]),
        unit="factors",
    )
    found = pick(exact, "forward_ppm")
    yield decided(
        "B-E19",
        "Eq. (19): centred least squares over the scan",
        exact and abs(found - PRINTED["table3"]["injected_ppm"]) < 1.0,
        exact and f"Without disturbances it finds {number(found, 5)} ppm of −200.",
        fails="it missed the injected drift by 1 ppm",
        printed=PRINTED["table3"]["injected_ppm"],
        ours=found,
        unit="ppm",
    )
    yield row(
        "B-E21",
        "Eq. (21): counts after the drift less the first",
        CONTRADICTS,
        f"It subtracts {PRINTED['symbols']['subtracted_in_21']} of the other state where "
        f"{PRINTED['symbols']['same_status_in_21']} is meant; eq. (19) is centred, so nothing comes of it (B6).",
        printed=PRINTED["symbols"]["subtracted_in_21"],
        recomputed=PRINTED["symbols"]["same_status_in_21"],
    )
    yield _approximation("B-E22", "Eq. (22): compensation of the forward gain in the controller, 1 − δ")


def _steady_in_flight(found: Mapping | None) -> str:
    """How far the equation, which is of a loop at rest, is off in flight."""
    if not found:
        return ""
    calm, rock = found["flight"], found["wing rock"]
    return (
        f" Over the liveliest {found['duration_s']:g} s of a flight it stands for the sampled loop to "
        f"{number(calm['rms_ug']['value'], 2)} µg RMS and {number(calm['largest_mm_s']['value'], 2)} mm/s, with wing "
        f"rock {number(rock['rms_ug']['value'], 2)} and {number(rock['largest_mm_s']['value'], 2)}: the loop is "
        f"{number(found['delay_us'])} µs late."
    )


def _excitation(exact: Mapping | None, quiet: Mapping | None) -> Iterator[Row]:
    rejected = pick(exact, "rejected_scatter_ppm")
    yield decided(
        "B-E23",
        "Eq. (23): open loop excited through the torquer; not repeatable enough, rejected",
        exact and quiet and rejected > PRINTED["text"]["estimation_error_ppm"],
        exact
        and quiet
        and "The gap takes only a small excitation around the balance of 1 g, against which the bias wanders: the gain "
        f"found scatters by {number(rejected)} ppm from one excitation to the next, the one of the current test by "
        f"{number(quiet['feedback_scatter_ppm'], 2)}. Electrostatic attraction, "
        "which the paper names, has a row of its own (B-C12).",
        fails=f"it scattered by less than the {PRINTED['text']['estimation_error_ppm']:g} ppm that the paper asks for",
        ours=rejected,
        unit="ppm",
    )


def _closed_loop(exact: Mapping | None, in_flight: Mapping | None) -> Iterator[Row]:
    """Counts with the current on and off."""
    high, low = loop.seen_ppm(1e6, k_vi_da=DRIFT_PPM).on_less_off, loop.seen_ppm(1e2, k_vi_da=DRIFT_PPM).on_less_off
    on, off = pick(exact, "counts_on"), pick(exact, "counts_off")
    expected = pick(exact, "counts_per_g")
    of_source = pick(exact, "counts_on_less_off_expected")
    for k, name, counts, from_printed in (
        (24, "on", on, exact and expected + of_source),
        (25, "off", off, expected),
    ):
        yield decided(
            f"B-E{k}",
            f"Eq. ({k}): counts of the closed loop with the current {name}",
            exact and same(counts / from_printed, 1.0, COUNTS),
            exact
            and "The loop has an integrator, so that at rest its gain is without limit and the counts are "
            + ("(k0 a − k_t I_ref)/k_fb." if name == "on" else "k0 a/k_fb.")
            + (" The equation writes K0 for k0." if name == "on" else _steady_in_flight(in_flight))
            + f" That is {number(from_printed, 7)} at 1 g.",
            fails="our loop settled at other counts, by more than 50 ppm",
            ours=counts,
            unit="count",
        )
    yield decided(
        "B-E26",
        "Eq. (26): N_on − N_off is −I_ref/(k_VI k_DA)",
        abs(high - (1.0 / (1.0 + DRIFT_PPM * PPM) - 1.0) / PPM) < 0.1,
        f"It follows from eqs (24) and (25) for a large loop gain: 200 ppm of k_VI k_DA change it by {number(high, 6)} "
        f"ppm at a loop gain of 1e6 and by {number(low, 4)} at 100.",
        fails="at a loop gain of 1e6 it changed by another number than 1/(1 + 200 ppm) says, to 0.1 ppm",
        recomputed=high,
        ours=pick(exact, "counts_feedback_ppm"),
        unit="ppm",
    )


def _feedback(exact: Mapping | None) -> Iterator[Row]:
    """The feedback gain: its drift, and how that is undone."""
    found = pick(exact, "feedback_ppm")
    yield decided(
        "B-E28",
        "Eq. (28): the same after a drift of the feedback gain",
        exact and abs(found - PRINTED["table4"]["injected_ppm"]) < 0.1,
        exact
        and f"Without disturbances ΔN0/ΔN1 − 1 is {number(found, 6)} ppm for 200 ppm of k_VI k_DA. What it finds is "
        "not δk_fb of eq. (13) (B15).",
        fails="it missed the injected drift by 0.1 ppm",
        printed=PRINTED["table4"]["injected_ppm"],
        ours=found,
        unit="ppm",
    )
    left = pick(exact, "compensated_ug")
    yield decided(
        "B-E30",
        "Eq. (30): reference voltage from DA0, and its compensation",
        exact and abs(left) < 1.0,
        exact
        and f"Without disturbances {number(abs(left), 2)} µg are left of {number(abs(exact['output_feedback_ug']))} "
        f"µg at 1 g. The resolution of DA0 is not stated; at {electronics.bits_for(2.0)} bits its step is "
        f"{number(electronics.step_ppm(electronics.bits_for(2.0)), 2)} ppm (B17).",
        fails="1 µg or more were left",
        ours=left,
        unit="µg",
    )
    printed, _ = output.residual_percent()
    yield row(
        "B-E31",
        "Eq. (31): residual of the output",
        CONTRADICTS,
        f"As printed, (N'(1) − N(0))/(N(1) − N(0)) is 193/24, {number(printed)} %; the printed value is that of the "
        "inverse (B12).",
        printed=PRINTED["output"]["residual_percent"],
        recomputed=printed,
        unit="%",
    )
