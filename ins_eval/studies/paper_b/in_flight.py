"""How well the steady state stands for the sampled loop in flight: the liveliest stretch, calm and with wing rock."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ins_eval.calibration.loop_gains import over_repetitions
from ins_eval.digital_loop import Loop, in_flight, stability
from ins_eval.digital_loop.in_flight import LoopResponse
from ins_eval.metrics import root_mean_square
from ins_eval.profile import load as load_profile
from ins_eval.streams import Streams
from ins_eval.trajectory import Trajectory
from ins_eval.units import PPM, STANDARD_GRAVITY

FLIGHTS = {"flight": "climb-cruise-landing", "wing rock": "wing-rock"}
DURATION_S, INTERVAL_S = 20.0, 0.01
REALISATIONS = 4  # of the loop's noise
UG, MM_S = PPM * STANDARD_GRAVITY, 1e-3


class Flown(NamedTuple):
    """The tree, and of each flight the response that the figure shows."""

    results: dict[str, Any]
    shown: dict[str, LoopResponse]


def compute(loop: Loop, streams: Streams) -> Flown:
    """``delay_us`` of the transfer function, ``duration_s``, and by flight its numbers on the liveliest axis.

    With wing rock also rock_ppm, by which the gain of the loop is larger at its frequency than at rest.

    from_s, axis, change_g      the stretch: where, "x", "y" or "z", range of the specific force
    mean_ug, rms_ug             of the loop less the steady state, of samples of 10 ms
    rest_ug                     RMS of what is not in the transfer function: the steps of the converters
    delay_us                    fitted to it
    end_mm_s, largest_mm_s      velocity error at the end, and the largest on the way
    noise_ug, noise_mm_s        RMS of the noise in a sample, size of its velocity error at the end

    Estimates are means over realisations of the loop's noise with Student's interval.
    """
    results: dict[str, Any] = {"delay_us": 1e6 * in_flight.delay_s(loop), "duration_s": DURATION_S}
    shown = {}
    for name, profile in FLIGHTS.items():
        trajectory = Trajectory(load_profile(profile))
        from_s = in_flight.liveliest_s(trajectory, DURATION_S)
        force = trajectory.specific_force(np.arange(from_s, from_s + DURATION_S, INTERVAL_S))
        axis = int(np.argmax(np.sum(np.diff(force, axis=0) ** 2, axis=0)))
        found = [
            in_flight.flown(loop, trajectory, axis, from_s, DURATION_S, INTERVAL_S, streams.at(name, k))
            for k in range(REALISATIONS)
        ]
        each = [numbers(one) for one in found]
        estimates = {key: over_repetitions(np.array([one[key] for one in each])) for key in each[0]}
        results[name] = {
            "from_s": from_s,
            "axis": "xyz"[axis],
            "change_g": float(np.ptp(force[:, axis]) / STANDARD_GRAVITY),
            **{key: {"value": e.value, "interval95": [e.low, e.high]} for key, e in estimates.items()},
        }
        if trajectory.profile.wing_rock:
            gain = abs(stability.closed_loop(loop).at(trajectory.profile.wing_rock.frequency_hz, loop.period_s))
            results[name]["rock_ppm"] = float((gain - 1.0) / PPM)
        shown[name] = found[0]
    return Flown(results, shown)


def numbers(found: LoopResponse) -> dict[str, float]:
    """What `compute` says of one realisation."""
    delay_s = -float(found.off @ found.slope / (found.slope @ found.slope))
    velocity = np.cumsum(found.off) * INTERVAL_S
    return {
        "mean_ug": float(found.off.mean() / UG),
        "rms_ug": float(root_mean_square(found.off)) / UG,
        "rest_ug": float(root_mean_square(found.off - found.linear)) / UG,
        "delay_us": 1e6 * delay_s,
        "end_mm_s": float(velocity[-1] / MM_S),
        "largest_mm_s": float(np.abs(velocity).max() / MM_S),
        "noise_ug": float(root_mean_square(found.noise)) / UG,
        "noise_mm_s": float(abs(found.noise.sum()) * INTERVAL_S / MM_S),
    }
