"""What is left of the errors of the loop's tests, and of its output, once temperature is taken out.

The paper names this ("could be calibrated in laboratory", section IV-B) and does not do it. Arms, over the same tests:

    none                as the paper does
    tests               slope of the scan and N_on - N_off put back to the temperature of the reference
    tests_and_output    N_out too
    other_unit          the same with the coefficients of the next unit: has to fail
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ins_eval.calibration import loop_gains
from ins_eval.calibration.loop_temperature import TemperatureLine
from ins_eval.digital_loop import bench, load, population
from ins_eval.digital_loop.chamber import Calibrated
from ins_eval.digital_loop.unit import Unit
from ins_eval.metrics import root_mean_square
from ins_eval.streams import Streams
from ins_eval.units import PPM

ARMS = ("none", "tests", "tests_and_output", "other_unit")
ERRORS = ("forward_ppm", "feedback_ppm", "output_ug")
FLOOR_REPETITIONS = 40
BOOTSTRAP = 2000
Tests = Mapping[str, np.ndarray]  # of `population.KEPT`, with the repetitions (r,)


def of_temperature(
    members: Sequence[population.Member], units: Sequence[Calibrated], injected_ppm: float, seed: int
) -> dict[str, Any]:
    """``room`` and ``far``: by arm and error its RMS, and its ratio to that of "none" over the same tests.

    Estimates are ``{"value", "interval95"}``, bootstrap over units. ``floor``: the same errors without any change of
    temperature. ``ppm_per_c``: RMS of the coefficients, which a degree between thermometer and parts brings back.
    """
    streams = Streams(seed).at("paper_b", "temperature")
    code = load().parameters.feedback.reference_code.value
    room = [(one[f"{injected_ppm:g}"], unit.thermometer_c) for one, unit in zip(members, units, strict=True)]
    far = [({key: getattr(unit.far, key) for key in population.KEPT}, unit.far_thermometer_c) for unit in units]
    chosen = streams.at("bootstrap").rng().integers(len(units), size=(BOOTSTRAP, len(units)))
    lines = [unit.lines for unit in units]
    chamber = load().parameters.chamber
    return {
        "room": _compared(room, lines, code, injected_ppm, chosen),
        "far": _compared(far, lines, code, injected_ppm, chosen),
        "floor": floor(streams.at("floor"), injected_ppm),
        "ppm_per_c": {
            name: float(np.sqrt(np.mean([line[name].ppm_per_c.value ** 2 for line in lines]))) for name in lines[0]
        },
        "large_change_c": chamber.large_change.value,
        "chamber_c": [chamber.lowest.value, chamber.highest.value],
        "temperatures": int(chamber.temperatures.value),
    }


def errors(
    tests: Tests,
    thermometer_c: np.ndarray,
    lines: Mapping[str, TemperatureLine],
    arm: str,
    code: float,
    injected_ppm: float,
) -> dict[str, np.ndarray]:
    """Errors (r,) of `ERRORS` in one arm: estimates less what was put in, and what is left of the output's error.

    The output follows from that of the same test as it was compensated, N ~ 1 / N_VREF.
    """
    gain, step, left_ug = tests["gain"], tests["current_step"], tests["remaining_ug"]
    before, after = np.ones_like(left_ug), 1.0 + PPM * left_ug
    after = after * loop_gains.reference_code(code, loop_gains.feedback_drift_ppm(*step))
    if arm != "none":
        gain = lines["gain"].put_back(gain, thermometer_c)
        step = lines["current_step"].put_back(step, thermometer_c)
    after = after / loop_gains.reference_code(code, loop_gains.feedback_drift_ppm(*step))
    if arm not in ("none", "tests"):
        before, after = lines["output"].put_back(np.stack([before, after]), thermometer_c)
    return {
        "forward_ppm": loop_gains.forward_drift_ppm(*gain) + injected_ppm,
        "feedback_ppm": loop_gains.feedback_drift_ppm(*step) - injected_ppm,
        "output_ug": (after - before) / PPM,
    }


def floor(streams: Streams, injected_ppm: float) -> dict[str, float]:
    """RMS of the errors at constant temperature, of parts that no temperature changes."""
    loop = load()
    constant = np.full((2, FLOOR_REPETITIONS), loop.parameters.bench.temperature.value)
    done = bench.procedure(Unit(loop, {}, {}), streams, temperature_c=constant)
    tests = {key: getattr(done, key) for key in population.KEPT}
    code = loop.parameters.feedback.reference_code.value
    found = errors(tests, constant, {}, "none", code, injected_ppm)
    return {name: float(root_mean_square(error)) for name, error in found.items()}


def _compared(
    tests: Sequence[tuple[Tests, np.ndarray]],
    lines: Sequence[Mapping[str, TemperatureLine]],
    code: float,
    injected_ppm: float,
    chosen: np.ndarray,
) -> dict[str, Any]:
    found: dict[str, Any] = {}
    squares: dict[str, dict[str, np.ndarray]] = {}  # by arm and error, mean over the repetitions (units,)
    for arm in ARMS:
        used = [*lines[1:], lines[0]] if arm == "other_unit" else lines
        each = [errors(*one, line, arm, code, injected_ppm) for one, line in zip(tests, used, strict=True)]
        squares[arm] = {name: np.array([np.mean(e[name] ** 2) for e in each]) for name in ERRORS}
        found[arm] = {}
        for name, square in squares[arm].items():
            first = squares["none"][name]
            found[arm][name] = _interval(np.sqrt(square.mean()), np.sqrt(square[chosen].mean(axis=1)))
            ratios = np.sqrt(square[chosen].mean(axis=1) / first[chosen].mean(axis=1))
            found[arm][f"{name}_ratio"] = _interval(np.sqrt(square.mean() / first.mean()), ratios)
    return found


def _interval(value: float, resampled: np.ndarray) -> dict[str, Any]:
    return {"value": float(value), "interval95": [float(end) for end in np.quantile(resampled, (0.025, 0.975))]}
