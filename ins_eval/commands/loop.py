"""``ins-eval loop``: tests of a digital accelerometer loop, simulated, and the gains that recorded ones give."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ins_eval.calibration import loop_gains
from ins_eval.calibration.loop_gains import Gain
from ins_eval.calibration.loop_readings import CURRENT, SCAN, LoopReadings, read
from ins_eval.digital_loop import bench, load, population, stability
from ins_eval.digital_loop.injector import Injection
from ins_eval.errors import UsageError
from ins_eval.files import write_whole
from ins_eval.report import text
from ins_eval.report.content import Paragraph, Section, Table
from ins_eval.report.json_file import as_json, write_json
from ins_eval.report.results import made_with
from ins_eval.streams import Streams

LARGEST_PPM = 10_000.0  # beyond, it is another loop: the scan would leave the ADC
LARGEST_DRIFT_PPM = 100_000.0  # beyond, the two states do not belong together
STATIC = ("state", "repetition", "n_out")


# ------------------------------------------------------------------------------------------------ simulate


def simulate(
    preset_or_file: str,
    output: Path,
    instrument: int = 0,
    seed: int = 1,
    json: Path | None = None,
    quiet: bool = False,
    **injected: Any,
) -> int:
    """Take one accelerometer through the paper's procedure and write what its bench recorded into `output`.

    ``scan.csv`` and ``current.csv`` are what `calibrate` takes; ``static.csv`` has N_out before and after the drift
    and compensated; ``manifest.json`` says what was simulated. `injected` are the fields of `Injection`, the drift that
    is put in. The same seed gives the same bytes.
    """
    injection = Injection(**injected)
    for option, value in (("--forward-ppm", injection.forward_ppm), ("--feedback-ppm", injection.feedback_ppm)):
        if not -LARGEST_PPM <= value <= LARGEST_PPM:  # also where it is no number
            raise UsageError(f"{option} {value:g}: expected {-LARGEST_PPM:g} to {LARGEST_PPM:g} ppm; choose another")
    loop = load(preset_or_file)
    margins = stability.margins(loop)  # an unstable loop has nothing to record
    streams = Streams(seed).at("digital loop")
    drawn = population.draw(streams, instrument, loop)
    done = bench.procedure(drawn, streams.at("unit", instrument, "bench"), injection)
    _write_tests(done, loop.counts_per_g, output)
    manifest = {
        "format": "ins-eval-loop/1",
        "loop": preset_or_file,
        "parameters": loop.parameters.model_dump(),
        "instrument": instrument,
        "seed": seed,
        "injected": asdict(injection),
        "truth": {
            "temperature_ppm_per_c": dict(drawn.temperature_ppm_per_c),
            "temperature_c": dict(zip(bench.STATES, done.temperature_c.tolist(), strict=True)),
            "forward_ppm": done.forward_true_ppm.tolist(),
            "feedback_ppm": done.feedback_true_ppm.tolist(),
        },
        "margins": margins._asdict(),
        "made_with": made_with(),
    }
    write_whole(output / "manifest.json", as_json(manifest))
    write_json(json, manifest)
    if not quiet:
        print(f"scan.csv, current.csv, static.csv and manifest.json: {output}")
        print(f"the gains they give: ins-eval loop calibrate {output / 'scan.csv'} {output / 'current.csv'}")
    return 0


def _write_tests(done: bench.Procedure, counts_per_g: float, output: Path) -> None:
    rows: dict[str, list[tuple]] = {"scan": [], "current": [], "static": []}
    for i, state in enumerate(bench.STATES):
        for k in range(done.gain.shape[1]):
            points = zip(done.n_fpga, done.scan_counts[i, k], strict=True)
            rows["scan"] += [(state, k + 1, n_fpga, counts) for n_fpga, counts in points]
            for setting, counts in (("off", done.off_counts[i, k]), ("on", done.on_counts[i, k])):
                rows["current"] += [(state, k + 1, setting, one) for one in counts]
    for state, output_ug in done.outputs_ug.items():
        counts = (bench.TESTED_AT_G + 1e-6 * output_ug) * counts_per_g
        rows["static"] += [(state, k + 1, one) for k, one in enumerate(counts)]
    for name, columns in (("scan", SCAN), ("current", CURRENT), ("static", STATIC)):
        buffer = io.StringIO()
        pd.DataFrame(rows[name], columns=list(columns)).to_csv(buffer, index=False, lineterminator="\n")
        write_whole(output / f"{name}.csv", buffer.getvalue().encode())


# ------------------------------------------------------------------------------------------------ calibrate


def calibrate(
    files: Sequence[Path], reference_code: int = 524288, json: Path | None = None, quiet: bool = False
) -> int:
    """Gains of the loop from recorded scans and current tests, their drift, and how to compensate it.

    `reference_code` is N_VREF as it is set now. The numbers go to the terminal and, where asked for, to `json`.
    """
    if reference_code < 1:
        raise UsageError(f"--n-vref {reference_code}: expected the code of DA0 as it is set now, 1 or more")
    readings = read(files)
    found = {**_forward(readings), **_feedback(readings)}
    for name, result in found.items():
        drift = result.get("drift_ppm")
        if drift is not None and not abs(drift.value) <= LARGEST_DRIFT_PPM:
            raise UsageError(
                f"{', '.join(map(str, files))}: the {name} gain would have drifted by {drift.value:.3g} ppm, which is "
                "no drift; check that reference and test are of the same accelerometer with the same settings"
            )
    compensation = _compensation(found, reference_code)
    tree = {"format": "ins-eval-loop-gains/1", **{name: _tree(result) for name, result in found.items()}}
    write_json(json, {**tree, "compensation": compensation, "unseen": list(loop_gains.UNSEEN)})
    if not quiet:
        print(text.render("Gains of the loop", _answer(found), _sections(found, compensation)), end="")
    return 0


def _forward(readings: LoopReadings) -> dict[str, dict[str, Any]]:
    if not readings.scans:
        return {}
    result: dict[str, Any] = {"repetitions": len(readings.scans["reference"])}
    for state, scans in readings.scans.items():
        slopes = [loop_gains.scan_gain(readings.n_fpga, one) for one in scans]
        if not all(one.value for one in slopes):
            raise UsageError(f"the scan of {state}: N_out does not change with N_FPGA; check the ADC and the carrier")
        result[state] = _mean(slopes)
    if "test" in readings.scans:
        result["drift_ppm"] = loop_gains.forward_drift(
            readings.n_fpga, readings.scans["reference"], readings.scans["test"]
        )
    return {"forward": result}


def _feedback(readings: LoopReadings) -> dict[str, dict[str, Any]]:
    if not readings.currents:
        return {}
    result: dict[str, Any] = {"repetitions": len(readings.currents["reference"])}
    steps = {s: [loop_gains.current_step(*one) for one in pairs] for s, pairs in readings.currents.items()}
    for state, of_state in steps.items():
        if not all(one.value for one in of_state):
            raise UsageError(f"the current test of {state}: N_out is the same with the current on; check the switch")
        result[state] = _mean(of_state)
    if "test" in steps:
        result["drift_ppm"] = loop_gains.feedback_drift(steps["reference"], steps["test"])
    return {"feedback": result}


def _mean(repetitions: Sequence[Gain]) -> Gain:
    """Over repetitions, whose scatter makes the interval; of a single one its own interval."""
    if len(repetitions) == 1:
        return repetitions[0]
    return loop_gains.over_repetitions(np.array([one.value for one in repetitions]))


def _compensation(found: Mapping[str, Mapping[str, Any]], code: int) -> dict[str, Any]:
    result: dict[str, Any] = {}
    if "drift_ppm" in found.get("forward", {}):
        result["controller_gain"] = float(loop_gains.controller_gain(found["forward"]["drift_ppm"].value))
    if "drift_ppm" in found.get("feedback", {}):
        new_code = int(loop_gains.reference_code(code, found["feedback"]["drift_ppm"].value))
        result |= {"n_vref": code, "new_n_vref": new_code, "rounding_ppm": loop_gains.rounding_ppm(code)}
    return result


def _tree(result: Mapping[str, Any]) -> dict[str, Any]:
    def finite(value: float) -> float | None:
        return float(value) if np.isfinite(value) else None

    return {
        key: {"value": finite(one.value), "interval95": [finite(one.low), finite(one.high)]}
        if isinstance(one, Gain)
        else one
        for key, one in result.items()
    }


# ------------------------------------------------------------------------------------------------ text

_GAINS = {"forward": "forward gain, N_out per N_FPGA", "feedback": "N_on - N_off, - I_ref / (k_VI k_DA)"}


def _answer(found: Mapping[str, Mapping[str, Any]]) -> str:
    drifts = [
        f"the {name} gain by {_shown(result['drift_ppm'], '+.1f')} ppm"
        for name, result in found.items()
        if "drift_ppm" in result
    ]
    if not drifts:
        return "Reference gains only: nothing of state 'test' was given, so no drift is found."
    return f"Between reference and test the loop has drifted: {' and '.join(drifts)} (95 % intervals)."


def _sections(found: Mapping[str, Mapping[str, Any]], compensation: Mapping[str, Any]) -> list[Section]:
    rows = []
    for name, result in found.items():
        for state in ("reference", "test"):
            if state in result:
                rows.append((_GAINS[name], state, *_cells(result[state], ".4f"), str(result["repetitions"])))
        if "drift_ppm" in result:
            rows.append((f"drift of the {name} gain, ppm", "", *_cells(result["drift_ppm"], "+.2f"), ""))
    table = Table("", ("quantity", "state", "value", "95 % interval", "repetitions"), rows, align="llrrr")
    words = []
    if "controller_gain" in compensation:
        gain = compensation["controller_gain"]
        words.append(Paragraph(f"multiply the gain of the controller by {gain:.7f}, eq. (22).", "Forward channel:"))
    if "new_n_vref" in compensation:
        words.append(
            Paragraph(
                f"set N_VREF from {compensation['n_vref']} to {compensation['new_n_vref']}, eq. (30); rounding to a "
                f"whole number leaves up to {compensation['rounding_ppm']:.2g} ppm.",
                "Feedback channel:",
            )
        )
    unseen = [Paragraph(f"{one[0].upper()}{one[1:]}.") for one in loop_gains.UNSEEN]
    return [
        Section("Gains", [table]),
        *([Section("Compensation", words)] if words else []),
        Section("What these tests cannot see", unseen),
    ]


def _cells(gain: Gain, form: str) -> tuple[str, str]:
    known = np.isfinite(gain.low) and np.isfinite(gain.high)
    return f"{gain.value:{form}}", f"{gain.low:{form}} to {gain.high:{form}}" if known else "one reading: none"


def _shown(gain: Gain, form: str) -> str:
    value, interval = _cells(gain, form)
    return f"{value} ({interval})"
