"""Digital accelerometers after years of ageing: what became of their scale factors, and what a self-calibration leaves.

The units are those of `digital_loop.population`; everything follows from the temperature coefficients and the ageing of
their parts. A unit is taken through

    reference    N_on - N_off with the constant current, new, on the bench
    ageing       every part drifts with the years
    estimate     N_on - N_off again, warmer than the reference as on the paper's bench: eqs (26)-(28)
    correction   N_VREF of the feedback DAC, a whole number: eq. (30)

and its scale factor k0 g / (k_t k_VI k_DA) is compared with that of the new unit at the same temperature, since the
calibration in the chamber holds how it follows temperature. The tests are long enough to average their noise to below
0.1 ppm, so steady outputs stand for them here; `digital_loop.bench` simulates them sample by sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ins_eval.calibration import loop_gains
from ins_eval.digital_loop import Loop, bench, load, population
from ins_eval.errors import UsageError
from ins_eval.streams import Streams
from ins_eval.units import PPM

SIZE = 200
LONGEST_YEARS = 100.0  # of ageing in proportion to time


@dataclass(frozen=True, eq=False)
class Aged:
    """After `years`, of each unit (n,): changes of the scale factor and the gains in ppm since it was new.

    drifted_ppm, self_calibrated_ppm   scale factor without and with the correction
    feedback_ppm, torquer_ppm          k_VI k_DA, and k_t, which the estimate does not see
    current_ppm                        I_ref, which it takes for a drift of the opposite sign
    forward_ppm                        the forward gain, to which the output is blind
    estimate_ppm                       what the self-calibration took for the drift of k_VI k_DA
    warmer_c                           by how many degrees the estimate was made warmer than its reference
    """

    years: float
    drifted_ppm: np.ndarray
    self_calibrated_ppm: np.ndarray
    feedback_ppm: np.ndarray
    torquer_ppm: np.ndarray
    current_ppm: np.ndarray
    forward_ppm: np.ndarray
    estimate_ppm: np.ndarray
    warmer_c: np.ndarray


def aged(years: float, seed: int, size: int = SIZE, loop: Loop | None = None) -> Aged:
    """The first `size` units of the population of `loop` (by default the preset's) after `years` of ageing."""
    if not 0.0 <= years <= LONGEST_YEARS:
        raise UsageError(f"storage: {years:g} years, expected 0 to {LONGEST_YEARS:g}")
    loop = loop or load()
    streams = Streams(seed).at("digital loop")
    rows = [_unit(loop, streams, index, years) for index in range(size)]
    return Aged(years, **{key: np.array([row[key] for row in rows]) for key in rows[0]})


def _unit(loop: Loop, streams: Streams, index: int, years: float) -> dict[str, float]:
    unit = population.draw(streams, index, loop)
    reference_c, later_c = bench.temperatures(loop, streams.at("unit", index, "bench"))[:, 0]
    estimate_ppm = loop_gains.feedback_drift_ppm(
        _current_step(unit.at(reference_c)), _current_step(unit.at(later_c, years))
    )
    code = int(loop_gains.reference_code(loop.parameters.feedback.reference_code.value, estimate_ppm))
    at_c = loop.parameters.bench.temperature.value
    new, aged = unit.at(at_c), unit.at(at_c, years)

    def change(quantity: str, of: Loop = aged) -> float:
        return (getattr(of, quantity) / getattr(new, quantity) - 1.0) / PPM

    return {
        "drifted_ppm": change("counts_per_g"),
        "self_calibrated_ppm": change("counts_per_g", aged.with_compensation(reference_code=code)),
        "feedback_ppm": change("amperes_per_count"),
        "torquer_ppm": change("torque_per_ampere"),
        "current_ppm": (aged["reference_current"] / new["reference_current"] - 1.0) / PPM,
        "forward_ppm": change("forward_gain"),
        "estimate_ppm": float(estimate_ppm),
        "warmer_c": float(later_c - reference_c),
    }


def _current_step(loop: Loop) -> float:
    """N_on - N_off, eq. (26); the specific force cancels."""
    return loop.steady_counts(0.0, current_on=True) - loop.steady_counts(0.0)
