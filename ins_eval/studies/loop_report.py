"""``ins-eval loop-report``: each table, module, equation, step, figure and claim of Paper B beside ours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ins_eval.digital_loop import Loop, chamber, load, population, sampled, stability
from ins_eval.files import write_whole
from ins_eval.report.json_file import as_json, write_json
from ins_eval.report.results import made_with, write_results
from ins_eval.streams import Streams
from ins_eval.studies.diagrams import diagrams
from ins_eval.studies.paper_b import figures, ours
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.studies.paper_b.rows import rows
from ins_eval.studies.paper_b.words import paper_b_content
from ins_eval.units import PPM, STANDARD_GRAVITY

SHOWN_S, MEAN_S = 4.0, 0.05  # of the static output drawn, and of each of its points
STEPS_PPM = {"as built": 0.0, "−200 ppm": -200.0, "−50 %": -5e5, "+100 %": 1e6}  # responses that are drawn
STEP_S = 0.02


def run(output: Path, size: int, seed: int, workers: int | None, quiet: bool, json: Path | None = None) -> int:
    """Compute, write ``rows.json``, ``metrics.json``, figures, page and text into `output`, print the text."""
    plan = population.ProcedurePlan(seed=seed)
    members = population.run(plan, size, workers, quiet)
    computed = ours.compute(seed, members, chamber.run(plan, size, workers, quiet))
    found = rows(computed.results)
    write_whole(output / "rows.json", as_json([asdict(row) for row in found]))
    write_whole(output / "manifest.json", as_json({"plan": asdict(plan), "size": size, **made_with()}))
    answer, sections = paper_b_content(found, computed.results)
    drawn = _figures(members, computed)
    write_results(output, "Paper B, statement by statement", answer, sections, computed.results, drawn, quiet)
    write_json(json, computed.results)
    return 0


def _figures(members: Sequence[population.Member], computed: ours.Ours) -> dict[str, Figure]:
    results, unit = computed.results, computed.identified
    loop = load()
    return {
        **diagrams(Path(figures.__file__).with_name("diagrams.toml")),
        "forward_estimation": figures.forward_estimation(
            n_fpga=unit.n_fpga,
            before=unit.scan_counts[0, 0],
            after=unit.scan_counts[1, 0],
            before_gain=unit.gain[0, 0],
            after_gain=unit.gain[1, 0],
        ),
        "feedback_estimation": figures.feedback_estimation(
            before=unit.current_step[0], after=unit.current_step[1], printed=PRINTED["table4"]
        ),
        "static_output": _static_output(computed, Streams(results["seed"]).at("paper_b", "shown")),
        "estimates_by_repetition": figures.estimates_by_repetition(
            identified_ppm={c: results["unit"][f"{c}_ppm"] for c in ours.CHANNELS},
            printed_ppm={"forward": PRINTED["table3"]["drift_ppm"], "feedback": PRINTED["table4"]["drift_ppm"]},
            population_ppm={c: results["population"][f"{c}_repetition_ppm"] for c in ours.CHANNELS},
            injected_ppm={"forward": ours.FORWARD_PPM, "feedback": ours.FEEDBACK_PPM},
        ),
        **_shifts(members),
        **_computed(computed),
        "stability_against_drift": figures.stability_against_drift(
            forward_ppm=ours.SWEEP_PPM,
            phase_margin_deg=[m.phase_margin_deg for m in computed.margins],
            crossover_hz=[m.crossover_hz for m in computed.margins],
            steps={name: _step(loop, ppm) for name, ppm in STEPS_PPM.items()},
        ),
    }


def _step(loop: Loop, forward_ppm: float) -> tuple[np.ndarray, np.ndarray]:
    """Time in s and output in g after a step of 1 g, with the forward gain off."""
    output_g = stability.step_response(loop, forward_ppm, STEP_S)
    return loop.period_s * np.arange(output_g.size), output_g


def _shifts(members: Sequence[population.Member]) -> dict[str, Figure]:
    """What the estimates are off, of all units, and against the size put in."""
    small, large = (float(size) for size in list(members[0])[:2])
    shift = {
        size: {c: [one[f"{size:g}"][f"{c}_shift_ppm"] for one in members] for c in ours.CHANNELS}
        for size in (small, large)
    }
    paired = {c: [s[: len(r)] for s, r in zip(shift[small][c], shift[large][c], strict=True)] for c in ours.CHANNELS}
    printed = {
        "forward": PRINTED["table3"]["mean"]["drift_ppm"] - ours.FORWARD_PPM,
        "feedback": PRINTED["table4"]["mean"]["drift_ppm"] - ours.FEEDBACK_PPM,
    }
    return {
        "shift_distribution": figures.shift_distribution(
            shift_ppm={c: np.array([one.mean() for one in shift[small][c]]) for c in ours.CHANNELS},
            printed_ppm=printed,
        ),
        "shift_and_size": figures.shift_and_size(
            small_ppm={c: np.concatenate(paired[c]) for c in ours.CHANNELS},
            large_ppm={c: np.concatenate(shift[large][c]) for c in ours.CHANNELS},
            sizes_ppm=(small, large),
        ),
    }


def _computed(computed: ours.Ours) -> dict[str, Figure]:
    """What the paper only says: attraction, calibration over temperature; and the loop in flight."""
    results = computed.results
    attraction, temperature = results["attraction"], results["temperature"]
    return {
        "attraction_by_carrier": figures.attraction_by_carrier(
            **attraction["by_carrier"],
            carrier_v=attraction["carrier_v"],
            excited_v=attraction["excited_v"],
            scatter_ppm=attraction["scatter_ppm"]["free"],
            limit_ppm=PRINTED["text"]["estimation_error_ppm"],
        ),
        "temperature_calibrated": figures.temperature_calibrated(
            **{key: temperature[key] for key in ("room", "far", "floor")},
            changes_c=(results["population"]["warm_up_c"]["value"], temperature["large_change_c"]),
        ),
        "loop_in_flight": figures.loop_in_flight(
            stretches={
                f"{name}, {results['in_flight'][name]['axis']} axis": {
                    "time_s": one.time_s,
                    "force_g": one.force / STANDARD_GRAVITY,
                    "off_ug": one.off / (PPM * STANDARD_GRAVITY),
                    "linear_ug": one.linear / (PPM * STANDARD_GRAVITY),
                }
                for name, one in computed.flown.items()
            },
        ),
    }


def _static_output(computed: ours.Ours, streams: Streams) -> Figure:
    """The identified unit's output over time, first repetition: before the drift, with it, and compensated."""
    done = computed.identified
    unit = ours.identified_accelerometer(computed.results["seed"])
    before, drifted = unit.at(done.temperature_c[0, 0]), done.injection(unit.at(done.temperature_c[1, 0]))
    compensated = drifted.with_compensation(float(done.controller_gain[0]), int(done.reference_code[0]))
    settling, points = round(0.2 / before.period_s), round(SHOWN_S / MEAN_S)
    each = round(MEAN_S / before.period_s)
    output_ug = {}
    for name, loop in (("before", before), ("after", drifted), ("compensated", compensated)):
        force_g = np.ones(settling + points * each)
        counts = sampled.closed_loop(loop, force_g, np.zeros(force_g.size), streams.at(name).rng())[settling:]
        output_ug[name] = (counts.reshape(points, each).mean(axis=1) / unit.loop.counts_per_g - 1.0) / PPM
    printed = PRINTED["output"]
    return figures.static_output(
        time_s=MEAN_S * (np.arange(points) + 0.5),
        output_ug=output_ug,
        printed_ug={"after": -printed["uncompensated_ug"], "compensated": printed["compensated_ug"]},
    )
