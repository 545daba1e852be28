"""Steps 1 to 5 of the paper's procedure on the static bench, at 1 g.

    1  estimate the reference of the forward and the feedback gain: scan, and constant current on and off
    2  static test: N_out(0)
    3  put the drift in; static test without compensation: N'_out(1)
    4  estimate again, compensate in the controller and through N_VREF; static test: N_out(1)
    5  compare

Each repetition goes through all of it. Between reference and test the accelerometer warms up, and the room is not the
same from repetition to repetition: temperatures are drawn, everything else follows from the parts.

Source: Paper B, section IV-A and Fig. 9.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ins_eval.calibration import loop_gains
from ins_eval.digital_loop import sampled
from ins_eval.digital_loop.injector import Injection
from ins_eval.digital_loop.model import Loop
from ins_eval.digital_loop.unit import Unit
from ins_eval.streams import Streams
from ins_eval.units import PPM

STATES = ("reference", "test")
TESTED_AT_G = 1.0
CURRENT_BLOCKS = 5  # means that are kept of each setting of the switch


@dataclass(frozen=True, eq=False)
class Procedure:
    """What one accelerometer gave; r repetitions, p points of the scan, b means of each setting of the switch.

    Arrays whose first axis has two entries hold the reference and the test, as `STATES`.

    injection           what was put in
    temperature_c       (2, r)
    n_fpga              (p,)
    scan_counts         (2, r, p) N_out of the scan
    on_counts           (2, r, b) N_out with the constant current, means
    off_counts          (2, r, b) without
    gain                (2, r) slope of the scan, eq. (19): k_pre-eq
    current_step        (2, r) N_on - N_off, eq. (26)
    forward_ppm         (r,) estimated drift of the forward gain, eq. (21)
    feedback_ppm        (r,) estimated drift of the feedback gain, eq. (28)
    forward_true_ppm    (r,) by which the forward gain of the closed loop did change
    feedback_true_ppm   (r,) by which k_VI k_DA did change
    controller_gain     (r,) eq. (22)
    reference_code      (r,) N'_VREF, eq. (30)
    outputs_ug          (r,) each of "before", "after" and "compensated": N_out(0), N'_out(1), N_out(1), less 1 g
    """

    injection: Injection
    temperature_c: np.ndarray
    n_fpga: np.ndarray
    scan_counts: np.ndarray
    on_counts: np.ndarray
    off_counts: np.ndarray
    gain: np.ndarray
    current_step: np.ndarray
    forward_ppm: np.ndarray
    feedback_ppm: np.ndarray
    forward_true_ppm: np.ndarray
    feedback_true_ppm: np.ndarray
    controller_gain: np.ndarray
    reference_code: np.ndarray
    outputs_ug: dict[str, np.ndarray]

    @property
    def forward_shift_ppm(self) -> np.ndarray:
        """(r,) estimate less what was put in, as the paper's Table 3 counts its residual."""
        return self.forward_ppm - self.injection.forward_ppm

    @property
    def feedback_shift_ppm(self) -> np.ndarray:
        """(r,) estimate less what was put in, as the paper's Table 4 counts its residual."""
        return self.feedback_ppm - self.injection.feedback_ppm

    @property
    def change_ug(self) -> np.ndarray:
        """(r,) N'_out(1) - N_out(0): what the drift did to the output."""
        return self.outputs_ug["after"] - self.outputs_ug["before"]

    @property
    def remaining_ug(self) -> np.ndarray:
        """(r,) N_out(1) - N_out(0): what is left of it after compensation."""
        return self.outputs_ug["compensated"] - self.outputs_ug["before"]


def procedure(
    unit: Unit,
    streams: Streams,
    injection: Injection | None = None,
    temperature_c: np.ndarray | None = None,
    years: float = 0.0,
) -> Procedure:
    """Take `unit` through the procedure; `streams` is its node.

    `injection` is by default the paper's -200 and +200 ppm. `temperature_c` (2, r) at reference and test is drawn as
    the bench says unless it is given. The test comes `years` after the reference, during which the parts age.
    """
    injection = injection or Injection()
    if temperature_c is None:
        temperature_c = temperatures(unit.loop, streams)
    temperature_c = np.asarray(temperature_c, dtype=float)
    count = temperature_c.shape[1]
    loops = [
        [unit.at(celsius) for celsius in temperature_c[0]],
        [injection(unit.at(celsius, years)) for celsius in temperature_c[1]],
    ]
    nodes = [streams.at("repetition", i) for i in range(count)]
    scans = [
        [sampled.scan(loop, node.at("scan", state).rng()) for loop, node in zip(of_state, nodes, strict=True)]
        for state, of_state in zip(STATES, loops, strict=True)
    ]
    currents = [
        [current_test(loop, node.at("current", state)) for loop, node in zip(of_state, nodes, strict=True)]
        for state, of_state in zip(STATES, loops, strict=True)
    ]
    n_fpga = scans[0][0][0]
    scan_counts = np.array([[counts for _, counts in of_state] for of_state in scans])
    on_counts = np.array([[on for on, _ in of_state] for of_state in currents])
    off_counts = np.array([[off for _, off in of_state] for of_state in currents])
    gain = np.array([[loop_gains.scan_gain(n_fpga, one).value for one in of_state] for of_state in scan_counts])
    current_step = on_counts.mean(axis=-1) - off_counts.mean(axis=-1)
    forward_ppm = loop_gains.forward_drift_ppm(*gain)
    feedback_ppm = loop_gains.feedback_drift_ppm(*current_step)
    controller_gain = loop_gains.controller_gain(forward_ppm)
    code = unit.loop.parameters.feedback.reference_code.value
    reference_code = loop_gains.reference_code(code, feedback_ppm)
    compensated = [
        loop.with_compensation(float(k), int(n))
        for loop, k, n in zip(loops[1], controller_gain, reference_code, strict=True)
    ]
    forward, feedback = (
        np.array([[getattr(loop, quantity) for loop in of_state] for of_state in loops])
        for quantity in ("forward_gain", "amperes_per_count")
    )
    return Procedure(
        injection=injection,
        temperature_c=temperature_c,
        n_fpga=n_fpga,
        scan_counts=scan_counts,
        on_counts=on_counts,
        off_counts=off_counts,
        gain=gain,
        current_step=current_step,
        forward_ppm=forward_ppm,
        feedback_ppm=feedback_ppm,
        forward_true_ppm=(forward[1] / forward[0] - 1.0) / PPM,
        feedback_true_ppm=(feedback[1] / feedback[0] - 1.0) / PPM,
        controller_gain=controller_gain,
        reference_code=reference_code,
        outputs_ug={
            name: np.array(
                [static_test(loop, node.at("static", name)) for loop, node in zip(of_state, nodes, strict=True)]
            )
            / (PPM * unit.loop.counts_per_g)
            - TESTED_AT_G / PPM
            for name, of_state in (("before", loops[0]), ("after", loops[1]), ("compensated", compensated))
        },
    )


def temperatures(loop: Loop, streams: Streams) -> np.ndarray:
    """Temperature in degC (2, r) at reference and test of each repetition: the room of the day, then warmer."""
    bench = loop.parameters.bench
    count = int(bench.repetitions.value)
    room, warm_up = streams.at("room").rng(), streams.at("warm-up").rng()
    reference = bench.temperature.value + bench.room_sigma.value * room.standard_normal(count)
    return np.stack(
        [reference, reference + bench.warm_up.value + bench.warm_up_sigma.value * warm_up.standard_normal(count)]
    )


def current_test(loop: Loop, streams: Streams) -> tuple[np.ndarray, np.ndarray]:
    """Means of N_out (b,) with the constant current on and (b,) with it off, eqs. (24), (25)."""
    bench = loop.parameters.bench
    settling, kept = _periods(loop, bench.settling.value), _periods(loop, bench.current_test.value)
    on = np.repeat([0.0, 1.0], settling + kept)
    counts = sampled.closed_loop(loop, np.full(on.size, _force_g(loop, streams)), on, streams.at("loop").rng())
    off_counts, on_counts = (
        np.array([block.mean() for block in np.array_split(half[settling:], CURRENT_BLOCKS)])
        for half in np.split(counts, 2)
    )
    return on_counts, off_counts


def static_test(loop: Loop, streams: Streams) -> float:
    """Mean of N_out in working state at 1 g."""
    bench = loop.parameters.bench
    settling, kept = _periods(loop, bench.settling.value), _periods(loop, bench.static_test.value)
    off = np.zeros(settling + kept)
    counts = sampled.closed_loop(loop, np.full(off.size, _force_g(loop, streams)), off, streams.at("loop").rng())
    return float(counts[settling:].mean())


def _periods(loop: Loop, seconds: float) -> int:
    return max(1, round(seconds / loop.period_s))


def _force_g(loop: Loop, streams: Streams) -> float:
    """1 g and the bias that the accelerometer has in this test."""
    return TESTED_AT_G + PPM * loop.parameters.bench.bias_sigma.value * streams.at("bias").rng().standard_normal()
