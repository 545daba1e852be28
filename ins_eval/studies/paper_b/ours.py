"""What our loop gives for the rows of Paper B: without disturbances, of many units, and of the identified one.

Estimates are ``{"value", "interval95"}``: median and central 95 % of single units or repetitions; of sizes of what may
have either sign, median and from 0 the smallest 95 %.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ins_eval.calibration import loop_gains
from ins_eval.digital_loop import (
    PARTS,
    Loop,
    bench,
    excitation,
    load,
    observability,
    pendulum,
    population,
    sampled,
    stability,
)
from ins_eval.digital_loop.bench import Procedure
from ins_eval.digital_loop.chamber import Calibrated
from ins_eval.digital_loop.in_flight import LoopResponse
from ins_eval.digital_loop.injector import Injection
from ins_eval.digital_loop.unit import Unit
from ins_eval.metrics import central
from ins_eval.streams import Streams
from ins_eval.studies.paper_b import attraction, in_flight, temperature
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.units import PPM, STANDARD_GRAVITY

FORWARD_PPM = PRINTED["table3"]["injected_ppm"]
FEEDBACK_PPM = PRINTED["table4"]["injected_ppm"]
CHANNELS = ("forward", "feedback")
IDENTIFIED = "paper-unit"
EXCITATIONS = 12  # of the rejected method: how well it repeats
TILTED_G = 0.5
SETTLING_S, MEASURED_S = 0.2, 2.0  # of the loop without disturbances
SWEEP_PPM = 1e6 * np.linspace(-0.5, 1.0, 31)  # of the forward gain
PERCENT_PPM = 1e4


class Ours(NamedTuple):
    """The tree for rows and page, and what the figures need of it besides."""

    results: dict[str, Any]
    identified: Procedure
    margins: list[stability.Margins]  # over `SWEEP_PPM`
    flown: dict[str, LoopResponse]  # by flight


def compute(seed: int, members: Sequence[population.Member], units: Sequence[Calibrated]) -> Ours:
    """All of it; `members` are those of `population.run` and `units` those of `chamber.run` with the same seed."""
    streams = Streams(seed).at("paper_b")
    loop = load()
    seen = observability.table(loop)
    identified = bench.procedure(identified_accelerometer(seed), streams.at("identified", "bench"))
    flown = in_flight.compute(loop, streams.at("in flight"))
    sweep = [stability.margins(loop, ppm) for ppm in SWEEP_PPM]
    results = {
        "seed": seed,
        "loop": parameters(loop),
        "exact": exact(streams.at("exact"), seen),
        "quiet": quiet(streams.at("quiet")),
        "attraction": attraction.attracted(loop, excitations(streams.at("exact"))),
        "temperature": temperature.of_temperature(members, units, FEEDBACK_PPM, seed),
        "in_flight": flown.results,
        "stability": margins(loop),
        "observability": [{"gain": gain_of(row.part), **row._asdict(), "seen_by": list(row.seen_by)} for row in seen],
        "year": year(loop, seen),
        "population": of_population(members, seed),
        "scaling": scaling(members),
        "unit": of_unit(identified),
        "printed_ppm": {c: PRINTED[t]["drift_ppm"] for c, t in zip(CHANNELS, ("table3", "table4"), strict=True)},
    }
    return Ours(results, identified, sweep, flown.shown)


def gain_of(part: str) -> str:
    """The gain in which a part sits."""
    return PARTS[part].gain


def parameters(loop: Loop) -> dict[str, str]:
    """Values of ours by the symbols of the paper, in words."""
    p = loop.parameters
    values = {
        "J": p.pendulum.inertia,
        "C": p.pendulum.damping,
        "D": p.pendulum.stiffness,
        "AD": p.adc.bits,
        "DA0": p.feedback.reference_bits,
        "DA2": p.feedback.bits,
        "R": p.feedback.resistor,
    }
    volts = loop.volts_per_count * p.carrier.amplitude.value
    return {
        **{symbol: f"{q.value:g} {q.unit}".replace("^2", "²").replace("ohm", "Ω") for symbol, q in values.items()},
        "k1": f"{loop.capacitance_gain:.3g} F/rad",
        "k_CV": f"{volts * loop['bridge_amplifier'] / (4.0 * p.pickoff.capacitance.value) * 1e-12:.3g} V/pF",
        "k_t": f"{loop.torque_per_ampere:.4g} N m/A",
    }


def constant_temperature(loop: Loop, repetitions: int) -> np.ndarray:
    """Temperatures (2, r) that stay at the bench's."""
    return np.full((2, repetitions), loop.parameters.bench.temperature.value)


def exact(streams: Streams, seen: Sequence[observability.DriftRow]) -> dict[str, Any]:
    """Without drift of temperature and bias, with the same noise of the converters before and after a drift."""
    loop = load()
    drifted = Injection(FORWARD_PPM, FEEDBACK_PPM)(loop)
    n_fpga, counts = sampled.scan(loop, streams.at("scan").rng())
    slopes = [
        loop_gains.scan_gain(n_fpga, c).value for c in (counts, sampled.scan(drifted, streams.at("scan").rng())[1])
    ]
    on, off = switched(loop, 1.0, streams)
    steps = [on - off, float(np.diff(switched(drifted, 1.0, streams)[::-1])[0])]
    feedback_ppm = float(loop_gains.feedback_drift_ppm(*steps))
    tilted = [float(np.diff(switched(one, TILTED_G, streams)[::-1])[0]) for one in (loop, drifted)]
    code = int(loop_gains.reference_code(loop.parameters.feedback.reference_code.value, feedback_ppm))
    outputs = [switched(one, 1.0, streams)[1] for one in (drifted, drifted.with_compensation(reference_code=code))]
    other_source = switched(loop.with_drift("reference_current", -1e5), 1.0, streams)[1]
    of_part = {row.part: row for row in seen}
    a, b = pendulum.discrete(loop, loop.period_s)
    settled = np.linalg.solve(np.eye(2) - a, b)[0] * loop["bending_stiffness"]
    off_line = np.abs(counts - np.polyval(np.polyfit(n_fpga, counts, 1), n_fpga)).max()
    ug = loop.counts_per_g * PPM
    return {
        "forward_ppm": float(loop_gains.forward_drift_ppm(*slopes)),
        "feedback_ppm": feedback_ppm,
        "feedback_tilted_ppm": float(loop_gains.feedback_drift_ppm(*tilted)),
        "counts_feedback_ppm": (steps[1] / steps[0] - 1.0) / PPM,
        "counts_on": on,
        "counts_off": off,
        "counts_per_g": loop.counts_per_g,
        "counts_on_less_off": steps[0],
        "counts_on_less_off_expected": -loop["reference_current"] / loop.amperes_per_count,
        "output_feedback_ug": (outputs[0] - off) / ug,
        "output_forward_ug": of_part["bridge_amplifier"].output_ug,
        "compensated_ug": (outputs[1] - off) / ug,
        "forward_current_ppm": of_part["bridge_amplifier"].current_test_ppm,
        "feedback_scan_ppm": of_part["sampling_resistor"].forward_scan_ppm,
        "magnet_current_ppm": of_part["magnet"].current_test_ppm,
        "magnet_output_ug": of_part["magnet"].output_ug,
        "reference_open_ppm": of_part["reference_capacitor_1"].forward_scan_ppm,
        "reference_output_ug": of_part["reference_capacitor_1"].output_ug,
        "stiffness_scan_ppm": of_part["bending_stiffness"].forward_scan_ppm,
        "spacing_scan_ppm": of_part["plate_spacing"].forward_scan_ppm,
        "scan_nonlinearity_ppm": float(off_line / counts.max() / PPM),
        "steady_state_error": float(abs(settled - 1.0)),
        "poles_rad_s": [float(pole) for pole in pendulum.poles(loop)],
        "inertia": loop.parameters.pendulum.inertia.value,
        "deflection_over_stop": loop.pendulosity * STANDARD_GRAVITY / loop["bending_stiffness"] / loop.stop_rad,
        "switch_open_ug": (other_source - off) / ug,
        "reference_bits": loop.parameters.feedback.reference_bits.value,
        "rejected_scatter_ppm": rejected_scatter_ppm(loop, excitations(streams)),
    }


def switched(loop: Loop, force_g: float, streams: Streams) -> tuple[float, float]:
    """Means of N_out with the constant current on and off, after settling, always with the same noise."""
    settling, kept = round(SETTLING_S / loop.period_s), round(MEASURED_S / loop.period_s)
    on = np.repeat([0.0, 1.0], settling + kept)
    counts = sampled.closed_loop(loop, np.full(on.size, force_g), on, streams.at("loop").rng())
    off_mean, on_mean = (float(half[settling:].mean()) for half in np.split(counts, 2))
    return on_mean, off_mean


def excitations(streams: Streams) -> list[Streams]:
    """Of each excitation of the rejected method."""
    return [streams.at("excitation", k) for k in range(EXCITATIONS)]


def rejected_scatter_ppm(loop: Loop, streams: Sequence[Streams]) -> float:
    """Standard deviation of the loop gain by eq. (23), from one excitation to the next."""
    slopes = [loop_gains.scan_gain(*excitation.excite(loop, one)).value for one in streams]
    return float(np.std(slopes, ddof=1) / abs(np.mean(slopes)) / PPM)


def quiet(streams: Streams) -> dict[str, float]:
    """Scatter of the estimates over the repetitions at constant temperature, ppm."""
    loop = load()
    constant = constant_temperature(loop, PRINTED["text"]["repetitions"])
    done = bench.procedure(Unit(loop, {}, {}), streams, temperature_c=constant)
    return {f"{c}_scatter_ppm": float(getattr(done, f"{c}_ppm").std(ddof=1)) for c in CHANNELS}


def margins(loop: Loop) -> dict[str, Any]:
    """Margins as it was, with the drift of the forward gain, and with that compensated; and what a degree takes."""
    drifted = loop.with_drift("bridge_amplifier", FORWARD_PPM)
    compensated = drifted.with_compensation(controller_gain=float(loop_gains.controller_gain(FORWARD_PPM)))
    of = {"nominal": loop, "drifted": drifted, "compensated": compensated}
    found: dict[str, Any] = {name: stability.margins(one)._asdict() for name, one in of.items()}
    by_a_percent = stability.margins(loop, PERCENT_PPM).phase_margin_deg - found["nominal"]["phase_margin_deg"]
    return {**found, "degree_percent": abs(1.0 / by_a_percent)}


def year(loop: Loop, seen: Sequence[observability.DriftRow]) -> dict[str, float]:
    """Standard deviation of the output at 1 g after a year of ageing, before and after self-calibration, ug.

    Self-calibration adds to the output what the current test reads: of electronics it takes off all, of the torquer
    nothing, and a drift of the current itself it puts in.
    """
    ageing = loop.parameters.ageing_sigma
    sizes = {row.part: getattr(ageing, row.part).value / observability.DRIFT_PPM for row in seen}
    return {
        "before_ug": float(np.sqrt(sum((row.output_ug * sizes[row.part]) ** 2 for row in seen))),
        "after_ug": float(
            np.sqrt(sum(((row.output_ug + row.current_test_ppm) * sizes[row.part]) ** 2 for row in seen))
        ),
    }


def of_population(members: Sequence[population.Member], seed: int) -> dict[str, Any]:
    """The population's summary, and what the rows hold against the tables: of units and of single repetitions."""
    key = f"{FEEDBACK_PPM:g}"
    single = {name: np.concatenate([one[key][name] for one in members]) for name in ("change_ug", "remaining_ug")}
    found = {"uncompensated_ug": np.abs(single["change_ug"])}
    sizes = {  # of what may have either sign
        "compensated_ug": np.abs(single["remaining_ug"]),
        "output_residual_percent": 100.0 * np.abs(single["remaining_ug"] / single["change_ug"]),
    }
    for channel, gain in zip(CHANNELS, ("gain", "current_step"), strict=True):
        of_units = [one[key][f"{channel}_ppm"] for one in members]
        shift = np.array([one[key][f"{channel}_shift_ppm"].mean() for one in members])
        sizes[f"{channel}_residual_percent"] = 100.0 * np.abs(shift) / FEEDBACK_PPM
        baselines = [np.std(one[key][gain][0], ddof=1) / abs(np.mean(one[key][gain][0])) / PPM for one in members]
        found |= {
            f"{channel}_ppm": np.array([values.mean() for values in of_units]),
            f"{channel}_repetition_ppm": np.concatenate(of_units),
            f"{channel}_baseline_scatter_ppm": np.array(baselines),
        }
    shifts = [np.concatenate([one[key][f"{channel}_shift_ppm"] for one in members]) for channel in CHANNELS]
    sizes["estimation_error_ppm"] = np.abs(np.concatenate(shifts))
    return {
        **population.summary(members, seed),
        **{name: central(values).as_tree() for name, values in found.items()},
        **{name: _up_to(values) for name, values in sizes.items()},
    }


def _up_to(sizes: np.ndarray) -> dict[str, Any]:
    """Median of sizes of what may have either sign, and from 0 what 95 % of them stay below."""
    value, most = np.quantile(sizes, (0.5, 0.95))
    return {"value": float(value), "interval95": [0.0, float(most)]}


def scaling(members: Sequence[population.Member]) -> dict[str, float]:
    """Shift with the larger drift put in over that with the paper's, of the same tests; and its size, ppm (RMS)."""
    first, other = list(members[0])[:2]
    found: dict[str, float] = {}
    for channel in CHANNELS:
        name = f"{channel}_shift_ppm"
        large = np.concatenate([one[other][name] for one in members])
        small = np.concatenate([one[first][name][: one[other][name].size] for one in members])
        found[f"{channel}_ratio"] = float((large @ small) / (small @ small))
        found[f"{channel}_rms_ppm"] = float(np.sqrt(np.mean(large**2)))
    return found


def identified_accelerometer(seed: int) -> Unit:
    """The paper's unit, whose coefficients were chosen after its tables."""
    return population.draw(Streams(seed).at("paper_b", "identified"), 0, load(IDENTIFIED))


def of_unit(done: Procedure) -> dict[str, Any]:
    """The identified unit's estimates and outputs."""
    change, left = float(done.change_ug.mean()), float(done.remaining_ug.mean())
    return {
        **{f"{channel}_ppm": getattr(done, f"{channel}_ppm").tolist() for channel in CHANNELS},
        "outputs_ug": {"uncompensated": change, "compensated": left},
        "closure_ug": left - (change + float(done.feedback_ppm.mean())),
        "static_scatter_ug": float(done.outputs_ug["before"].std(ddof=1)),
    }
