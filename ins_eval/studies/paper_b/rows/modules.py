"""Rows of the modules of the loop, of the bench, and of the studies that the text names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ins_eval.studies.paper_b.audit import bridge, electronics, estimation, loop
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.studies.papers import CONTRADICTS, Row, decided, given, number, row
from ins_eval.tables import pick

PROPOSED = "its value is not printed; ours stands in the preset, with a source or marked as assumed."


def module_rows(results: Mapping) -> Iterator[Row]:
    """The modules of the loop, then those of the bench."""
    exact = pick(results, "exact")
    left = loop.seen_ppm(k_0=200.0, k_t=200.0).off
    yield decided(
        "B-M1",
        "Pendulosity k0 = m L; constant, since the drift of the arm acts on both torques",
        abs(left) < 0.1,
        "A drift of L is in k0 = m L and in k_t = B L_coil L, and the output goes with k0/k_t: "
        f"{number(left, 1)} ppm of 200 are left. A drift of the mass would be seen "
        f"in full ({number(loop.seen_ppm(k_0=200.0).off)} ppm) and by neither test.",
        fails="more than 0.1 of 200 ppm of the arm were left in the output, as they are of the mass",
        recomputed=left,
        unit="ppm",
    )
    yield given("B-M2", "Pendulum G(s) = 1/(J s² + C s + D)", PROPOSED + _of(results, "J", "C", "D"))
    yield given("B-M3", "Capacitance for each radian, k1 = 2 C0 l/d", PROPOSED + _of(results, "k1"))
    yield row(
        "B-M4",
        "AC bridge with reference capacitors",
        CONTRADICTS,
        "As eq. (4) prints it its gain at null is zero (B3); with V_IN k_amp/(4 C0) it works." + _of(results, "k_CV"),
        printed=bridge.printed_gain_at_null(),
        recomputed=bridge.gain(1.0),
        unit="V_IN k_amp/C0",
    )
    yield given("B-M5", "Analog-to-digital converter", PROPOSED + _of(results, "AD"))
    yield given("B-M8", "DA2 with its reference from DA0", PROPOSED + _of(results, "DA2", "DA0"))
    yield given("B-M9", "Voltage-to-current converter", PROPOSED + _of(results, "R"))
    yield given("B-M10", "Torquer k_t = B L_coil L", PROPOSED + _of(results, "k_t"))
    opened = pick(exact, "switch_open_ug")
    yield decided(
        "B-M11",
        "Switch M1 and constant-current source do not disturb the loop while open",
        exact and opened == 0.0,
        exact and f"The output with the switch open is that without the source, to {number(opened)} µg.",
        fails="a drift of the source changed the output while the switch is open",
        ours=opened,
        unit="µg",
    )
    mapped = [electronics.amplifier_ppm(g, -200.0) for g in (2.0, 10.0, 50.0)]
    yield row(
        "B-M13",
        "Drift injected through a resistor is that of the gain",
        CONTRADICTS,
        "In a non-inverting amplifier −200 ppm of the resistor change the gain by "
        f"{' / '.join(number(m) for m in mapped)} ppm at G = 2 / 10 / 50 (B22). The circuit is not printed; ours puts "
        "the drift into the gain unless told otherwise.",
        printed=PRINTED["table3"]["injected_ppm"],
        recomputed=mapped[1],
        unit="ppm",
    )
    static = pick(results, "unit", "static_scatter_ug")
    yield given(
        "B-M14",
        "Static test on a stabilized platform at 1 g",
        "the local gravity is not printed; ours is 1 g of the data sheets."
        + (f" Averaged, the output of our identified unit repeats to {number(static, 2)} µg." if static else ""),
        ours=static,
        unit="µg",
    )
    low, high = estimation.room_ppm()
    yield given(
        "B-M15",
        "Room temperature within 3 °C",
        f"assumed the same. At 5 to 10 ppm/°C of ordinary parts it allows ±{low:g} to ±{high:g} ppm (B20).",
        printed=PRINTED["text"]["room_c"],
        unit="°C",
    )


def _of(results: Mapping, *symbols: str) -> str:
    """What our loop has for these symbols, as a sentence."""
    found = [(symbol, pick(results, "loop", symbol)) for symbol in symbols]
    return "".join(f" {symbol} = {words}." for symbol, words in found if words)


def study_rows(results: Mapping) -> Iterator[Row]:
    """What the text names besides: stability, the long term, the sources of the residual."""
    margins = pick(results, "stability")
    nominal, drifted = pick(margins, "nominal"), pick(margins, "drifted")
    yield decided(
        "B-S1",
        "Drift of the forward gain endangers the stability of the loop (section I-A)",
        margins and drifted["phase_margin_deg"] < nominal["phase_margin_deg"] - 1.0,
        margins
        and f"At −200 ppm the crossover moves from {nominal['crossover_hz']:.2f} to {drifted['crossover_hz']:.2f} Hz "
        f"and the phase margin by {number(drifted['phase_margin_deg'] - nominal['phase_margin_deg'], 2)}° of "
        f"{nominal['phase_margin_deg']:.1f}°: for stability such a drift does not matter. It takes "
        f"{_tens(margins)} to change the margin by a degree.",
        fails="the phase margin fell by less than a degree",
        ours=drifted["phase_margin_deg"] - nominal["phase_margin_deg"] if margins else None,
        unit="°",
    )
    of = PRINTED["text"]
    year = pick(results, "year", "after_ug")
    yield given(
        "B-S2",
        "Torquer and current source drift by 5 ppm a year",
        "a specification after ageing. The current's drift goes into the correction in full and the torquer's is "
        "not seen: after a year they cost as much at 1 g as the specification says"
        + (f", {number(year)} µg together, as independent drifts." if year else "."),
        printed=of["torquer_ppm_per_year"],
        ours=year,
        unit="ppm",
    )
    gone = loop.seen_ppm(k_t=200.0).on_less_off
    yield row(
        "B-S3",
        "Sources of the residual that the text names: current source, magnet, length of the coil",
        CONTRADICTS,
        "Of these only the current source can enter Table 4: N_on − N_off does not hold the magnet or the coil "
        f"(200 ppm change it by {number(abs(gone), 1)} ppm). In the output all three count, and none of them can "
        "enter Table 3, whose residual is as large.",
        printed=len(PRINTED["factors"]["neglected"]) + 1,
        recomputed=1,
        unit="sources",
    )


def _tens(margins: Mapping) -> str:
    change = pick(margins, "degree_percent")
    return f"{number(change, 2)} %" if change else "a multiple of the gain"
