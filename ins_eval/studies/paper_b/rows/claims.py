"""What the text of Paper B claims."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from scipy import stats

from ins_eval.studies.paper_b.audit import bridge, electronics, estimation, loop, output, pendulum
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.studies.papers import (
    CONTRADICTS,
    Estimate,
    Row,
    between,
    claimed,
    decided,
    given,
    listed,
    number,
    row,
    same,
    simulated,
)
from ins_eval.tables import pick

LINEAR_PPM = 1000.0
SIX = PRINTED["text"]["repetitions"] - 1
BY_CHANCE = float(np.sqrt(stats.f.ppf(0.975, SIX, SIX)))  # between the scatters of six and six repetitions
UNITS = "what 95 % of our units stay above"


def claim_rows(results: Mapping) -> Iterator[Row]:
    """All of them, in the order of the text."""
    yield from _headlines(results)
    yield from _loop(results)
    yield from _tests(results)
    yield from _precision(results)
    yield from _discussion(results)


def _remainder(percent: Estimate | None) -> dict | None:
    """What a residual in % leaves of 100."""
    if percent is None:
        return None
    low, high = percent["interval95"]
    return {"value": 100.0 - percent["value"], "interval95": [100.0 - high, 100.0 - low]}


def _headlines(results: Mapping) -> Iterator[Row]:
    population, of = pick(results, "population"), PRINTED["abstract"]
    yield simulated(
        "B-C1",
        "Abstract: 90.26 % of the gain's drift are estimated (forward)",
        of["estimated_percent"],
        _remainder(pick(population, "forward_residual_percent")),
        UNITS,
        nothing=100.0,
        reason="What decides is the room's temperature, so it says little of the method (B10).",
        recomputed=estimation.found_share_percent("table3"),
        unit="%",
    )
    found = estimation.found_share_percent("table4")
    yield row(
        "B-C2",
        "Contributions: 90.92 % of the feedback gain's drift are estimated",
        CONTRADICTS,
        f"By Table 4 {number(found, 5)} % were found; 90.92 is 100 less the error, which makes too much look like too "
        "little.",
        printed=of["feedback_estimated_percent"],
        recomputed=found,
        ours=_remainder(pick(population, "feedback_residual_percent")),
        unit="%",
    )
    yield simulated(
        "B-C3",
        "Abstract: 87.56 % of the output's error are removed",
        of["restrained_percent"],
        _remainder(pick(population, "output_residual_percent")),
        UNITS,
        "24/193 leaves so much; the sign of what is left has turned (B21).",
        nothing=100.0,
        recomputed=100.0 - output.residual_percent()[1],
        unit="%",
    )
    exact = pick(results, "exact")
    yield decided(
        "B-C5",
        "Both tests work without a turntable, whatever the acceleration",
        exact and abs(exact["feedback_tilted_ppm"] - exact["feedback_ppm"]) < 0.1,
        exact
        and f"At half the acceleration the current test finds {number(exact['feedback_tilted_ppm'], 6)} ppm instead of "
        f"{number(exact['feedback_ppm'], 6)}. The acceleration has to stay the same while the current is switched.",
        fails="the two differed by more than 0.1 ppm",
        ours=exact["feedback_tilted_ppm"] if exact else None,
        unit="ppm",
    )


def _loop(results: Mapping) -> Iterator[Row]:
    exact, margins = pick(results, "exact"), pick(results, "stability")
    mass = loop.seen_ppm(k_0=200.0)
    yield given(
        "B-C6",
        "The mass of the sealed pendulum is constant",
        f"it cannot be computed. 200 ppm of it would change the output by {number(mass.off)} ppm, and neither test "
        "would see it.",
        recomputed=mass.off,
        unit="ppm",
    )
    steady = [pendulum.steady_state(j, c, 2.0) for j, c in ((1.0, 4.0), (2.0, 9.0))]
    yield decided(
        "B-C7",
        "The steady deflection depends on the bending stiffness only",
        same(steady[0], steady[1], 1e-9) and same(steady[0], 0.5, 1e-9),
        "So by eq. (3), and by eq. (2) once it has its 1/J.",
        fails="it changed with the inertia or the damping, as by eq. (2) as printed",
        recomputed=steady[0],
        unit="1/D",
    )
    yield decided(
        "B-C8",
        "Equal reference capacitors of any size leave the gain as it is",
        same(bridge.gain(1.0, bridge.reference_ratio(5e4, 5e4)), bridge.gain(1.0), 1e-9),
        "Only their ratio is in the bridge's output.",
        fails="it changed the gain of the bridge",
    )
    line = pick(exact, "scan_nonlinearity_ppm")
    yield decided(
        "B-C9",
        "In open loop N_out is proportional to N_FPGA",
        exact and abs(line) < LINEAR_PPM,
        exact
        and f"The points of a scan lie on a line to {number(line, 2)} ppm of its height; what is left is the "
        "rounding of the carrier, the same in every scan.",
        fails=f"a point of the scan lay off the line by more than {LINEAR_PPM:g} ppm of its height",
        ours=line,
        unit="ppm",
    )
    stop = pick(exact, "deflection_over_stop")
    yield given(
        "B-C10",
        "In open loop the plate lies on its stop",
        "the stiffness is not printed and ours was chosen so."
        + (f" 1 g would deflect the plate to {number(stop, 2)} times the stop." if exact else ""),
        ours=stop,
    )
    nominal, restored = (pick(margins, key) for key in ("nominal", "compensated"))
    yield decided(
        "B-C11",
        "A drift of the forward gain can be undone in the controller",
        margins and abs(restored["crossover_hz"] / nominal["crossover_hz"] - 1.0) < 1e-6,
        margins
        and f"With eq. (22) the crossover is {restored['crossover_hz']:.4f} Hz again, {nominal['crossover_hz']:.4f} "
        f"before and {margins['drifted']['crossover_hz']:.4f} with the drift.",
        fails="the crossover came back with an error above 1e-6, as it does without the correction",
        ours=restored["crossover_hz"] if margins else None,
        recomputed=nominal["crossover_hz"] if margins else None,
        unit="Hz",
    )
    yield _attraction(pick(results, "attraction"))


def _attraction(found: Mapping | None) -> Row:
    """Of a plate that is held: the wiring that draws it most."""
    limit = PRINTED["text"]["estimation_error_ppm"]
    return decided(
        "B-C12",
        "Electrostatic attraction spoils the open-loop test with excitation",
        found and (found["added_scatter_ppm"]["held"] > limit or found["carrier_v"] > found["excited_v"]),
        found
        and "A free plate, as eq. (4) has it, is not drawn: both capacitors carry the same charge. Held at the middle "
        f"of the bridge, which draws it most, it is softer by {number(found['stiffness_ppm']['held'])} ppm of "
        f"D. That makes the gain {between(found['gain_ppm']['held'])} ppm larger, in every excitation alike: it adds "
        f"{number(found['added_scatter_ppm']['held'], 2)} ppm to a scatter of {number(found['scatter_ppm']['free'])}, "
        f"which the bias makes. The statement would hold for a carrier above {number(found['spoiling_v'], 2)} V, which "
        f"adds {limit:g} ppm, or above {number(found['excited_v'], 2)} V, which pulls the excited plate in; ours has "
        f"{number(found['carrier_v'], 2)} V. At 0 g the plate stays on its stop only if less than "
        f"{number(found['latching_um'], 2)} µm of gap is left there; at 1 g its weight holds it. Carrier and stiffness "
        "are ours.",
        fails=f"attraction added less than {limit:g} ppm of scatter and did not pull the excited plate in",
        ours=found["gain_ppm"]["held"] if found else None,
        unit="ppm",
    )


def _tests(results: Mapping) -> Iterator[Row]:
    exact, text = pick(results, "exact"), PRINTED["text"]
    asked = abs(output.magnet_and_current_ppm())
    yield decided(
        "B-C13",
        "Torquer and current source drift little against the rest",
        text["torquer_ppm_per_year"] < 0.1 * text["year_drift_scale_ppm"],
        f"{text['torquer_ppm_per_year']:g} against {text['year_drift_scale_ppm']:g} ppm a year. Between the two states "
        f"of the paper's own test the two together moved by {number(asked)} ppm (B21), years of it: temperature.",
        CONTRADICTS,
        fails="they drifted by more than a tenth of the rest",
        printed=text["torquer_ppm_per_year"],
        recomputed=asked,
        unit="ppm",
    )
    moved = pick(exact, "counts_on_less_off")
    yield decided(
        "B-C14",
        "A constant current acts as an acceleration does",
        exact and same(moved / exact["counts_on_less_off_expected"], 1.0, 1e-5),
        exact
        and f"Switched on it moves the counts by {number(moved, 7)}; −I_ref/(k_VI k_DA) is "
        f"{number(exact['counts_on_less_off_expected'], 7)}.",
        fails="the two differed by more than 5 ppm",
        ours=moved,
        unit="count",
    )
    yield decided(
        "B-C15",
        "Drifts of the forward and of the feedback gain are told apart",
        exact and abs(exact["forward_current_ppm"]) < 0.1 and abs(exact["feedback_scan_ppm"]) < 1.0,
        exact
        and f"−200 ppm of the forward gain change N_on − N_off by {number(abs(exact['forward_current_ppm']), 1)} ppm, "
        f"+200 ppm of the feedback gain change the scan by {number(abs(exact['feedback_scan_ppm']), 1)}.",
        fails="one drift showed in the other's test by more than 0.1 or 1 ppm",
        ours=exact["forward_current_ppm"] if exact else None,
        unit="ppm",
    )


def _precision(results: Mapping) -> Iterator[Row]:
    """How far the estimates can be trusted."""
    limit, over = PRINTED["text"]["estimation_error_ppm"], estimation.over_claimed_error()
    yield row(
        "B-C16",
        "The error of the estimation is restrained within 10 ppm",
        CONTRADICTS,
        f"Tables 3 and 4 have {listed(over, 3)} times as much on average (B11).",
        printed=limit,
        recomputed=max(over) * limit,
        unit="ppm",
    )
    quiet, population = pick(results, "quiet"), pick(results, "population")
    with_room = pick(population, "feedback_scatter_ppm") if quiet else None
    yield claimed(
        "B-C17",
        "The current test fluctuates with temperature",
        with_room,
        with_room
        and f"Repetitions scatter by {between(with_room)} ppm, and at constant temperature by "
        f"{number(quiet['feedback_scatter_ppm'], 2)}; by chance one six may scatter {number(BY_CHANCE)} times another.",
        above=BY_CHANCE * quiet["feedback_scatter_ppm"] if quiet else 0.0,
        what="the scatter",
        unit="ppm",
    )
    yield row(
        "B-C18",
        "The temperature of the magnet degrades the estimates",
        CONTRADICTS,
        "By eqs (26) and (16) no estimate holds the magnet: 200 ppm of it change N_on − N_off by "
        f"{number(abs(loop.seen_ppm(k_t=200.0).on_less_off), 1)} ppm. It degrades the output (B15).",
        recomputed=loop.seen_ppm(k_t=200.0).on_less_off,
        ours=pick(results, "exact", "magnet_current_ppm"),
        unit="ppm",
    )
    scatter = pick(population, "forward_scatter_ppm") if quiet else None
    yield claimed(
        "B-C19",
        "Enough time and a stable temperature are necessary",
        scatter,
        scatter
        and f"At constant temperature a scan of ours repeats to {number(quiet['forward_scatter_ppm'], 2)} ppm and a "
        f"current test to {number(quiet['feedback_scatter_ppm'], 2)}, which time would lower; the room adds up to "
        f"{between(scatter)} ppm, which it would not."
        + _known_temperature(pick(results, "temperature")),
        above=BY_CHANCE * quiet["forward_scatter_ppm"] if quiet else 0.0,
        what="the scatter",
        unit="ppm",
    )


def _discussion(results: Mapping) -> Iterator[Row]:
    left, limit = PRINTED["output"]["compensated_ug"], PRINTED["static"]["bias_stability_ug"]
    yield decided(
        "B-C20",
        "24 µg are close to the static precision of the device",
        left < limit,
        f"They are within the {limit:g} µg of Table 2. So would be anything else below it (B13).",
        passes=(0.0, limit),
        fails="more were left than the bias wanders",
        printed=left,
        recomputed=limit,
        unit="µg",
    )
    parts = pick(results, "observability")
    forward = [part for part in parts if part["gain"] == "forward" and abs(part["output_ug"]) < 0.1] if parts else []
    yield row(
        "B-C21",
        "Most drifts vary the loop gain and end up in the output",
        CONTRADICTS,
        "Those of the forward gain do not, by eq. (25): "
        f"{number(abs(loop.seen_ppm(k_pre=-200.0).off), 1)} ppm of the output for −200 ppm (B16)."
        + (f" Of our {len(parts)} parts {len(forward)} do not reach the output." if parts else ""),
        printed="all",
        recomputed=loop.seen_ppm(k_pre=-200.0).off,
        unit="ppm",
    )
    year = pick(results, "year")
    yield decided(
        "B-C22",
        "The long-term stability is improved significantly",
        year and year["after_ug"] < 0.5 * year["before_ug"],
        year
        and f"One year of ageing changes the output at 1 g by {number(year['before_ug'])} µg (standard deviation), "
        f"after self-calibration at the temperature of the reference by {number(year['after_ug'])}: magnet and current "
        "source are left. It follows from the drifts that the paper states.",
        fails="more than half of a year's drift were left",
        ours=year["after_ug"] if year else None,
        unit="µg",
    )
    mapped = electronics.amplifier_ppm(10.0, -200.0)
    yield given(
        "B-C23",
        "Changing a resistor makes a predictable drift of the gain",
        f"it depends on the circuit, which is not printed: −200 ppm of a resistor can be {number(mapped)} of the gain "
        "(B22).",
        printed=-200.0,
        recomputed=mapped,
        unit="ppm",
    )
    yield _calibrated(pick(results, "temperature"))


def _known_temperature(found: Mapping | None) -> str:
    if not found:
        return ""
    before, after = (
        listed([found["room"][arm][error]["value"] for error in ("forward_ppm", "feedback_ppm")], 2)
        for arm in ("none", "tests")
    )
    return (
        f" A known temperature does as well as a stable one: with each unit's coefficients (B-C24) the errors of both "
        f"gains in the same room fall from {before} to {after} ppm (RMS)."
    )


def _calibrated(found: Mapping | None) -> Row:
    """After the large change: below what the paper asks of an estimate, and below what it has left of its output."""
    limits = {name: PRINTED["text"]["estimation_error_ppm"] for name in ("forward_ppm", "feedback_ppm")}
    limits["output_ug"] = PRINTED["output"]["compensated_ug"]
    arms = found["far"] if found else {}
    said = {arm: listed([arms[arm][name]["value"] for name in limits], 2) for arm in arms}
    return decided(
        "B-C24",
        "Large changes of temperature can be calibrated in the laboratory",
        found
        and all(arms["tests_and_output"][name]["interval95"][1] < limit for name, limit in limits.items())
        and all(arms["other_unit"][name]["interval95"][0] > limit for name, limit in limits.items()),
        found
        and f"The paper does not do it. Ours: scan, current test and output of each unit at {found['temperatures']} "
        f"temperatures, then a test {found['large_change_c']:g} °C from its reference. Errors of forward and feedback "
        f"gain [ppm] and of the output [µg], RMS: {said['none']} as measured, {said['tests_and_output']} put back with "
        f"the unit's own coefficients, {listed([found['floor'][name] for name in limits], 2)} without any change. With "
        f"the tests alone put back the output keeps {number(arms['tests']['output_ug']['value'])} µg, since no test "
        f"sees the magnet; with another unit's coefficients {said['other_unit']} are left. Our parts have constant "
        "coefficients and one temperature: curvature and gradients are not in it.",
        fails=f"{limits['forward_ppm']:g} ppm or {limits['output_ug']:g} µg were left, or another unit's coefficients "
        "served as well",
        ours=arms["tests_and_output"]["output_ug"] if found else None,
        unit="µg",
    )
